/* As many virtual point lights for every method that is compared. */
#ifndef LUM_TESTS_BENCH_SLOTS_H
#define LUM_TESTS_BENCH_SLOTS_H

#include "core/render/view.h"
#include "tests/bench/bench.h"

/* Of the slots that a method is given only those whose path meets a surface hold a virtual point light: a third of them
 * stays empty in `cornell`, from whose open side light leaves. Returns for how many slots (settings.n_vpls) n of them
 * do, or as nearly as a few tries find; 0 after a message on stderr. That of `live`, which has several paths to choose
 * from for each slot, is not asked. */
uint32_t lum_bench_slots_for(const struct lum_world *world, const struct lum_view_settings *settings, uint32_t n);

#endif
