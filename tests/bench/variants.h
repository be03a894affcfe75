/* Scenes that the thesis has and the product does not: built-in ones with something changed. */
#ifndef LUM_TESTS_BENCH_VARIANTS_H
#define LUM_TESTS_BENCH_VARIANTS_H

#include <stdio.h>

#include "server/world/world.h"

/* The built-in scene that it is a variant of; else the scene itself. */
const char *lum_bench_variant_base(const char *scene);
/* Makes of the base, which is loaded, the variant, and commits; nothing to do for other scenes. */
bool lum_bench_vary(struct lum_world *world, const char *scene, struct lum_proto_error *err);
/* A line for each, as of --help. */
void lum_bench_print_variants(FILE *to);

#endif
