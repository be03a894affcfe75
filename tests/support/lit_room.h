/* The room of the rig with a light of each kind that matters to views. */
#ifndef LUM_TESTS_SUPPORT_LIT_ROOM_H
#define LUM_TESTS_SUPPORT_LIT_ROOM_H

#include "tests/support/rig.h"

void lit_room(struct rig *r, uint32_t threads);
void use_method(struct rig *r, const char *method);
void assert_no_rays(const struct lum_pass_stats *s, const char *what);

#endif
