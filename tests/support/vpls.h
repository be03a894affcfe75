/* Virtual point lights of a rig: made, and gathered at points. */
#ifndef LUM_TESTS_SUPPORT_VPLS_H
#define LUM_TESTS_SUPPORT_VPLS_H

#include "core/pass/pass.h"
#include "core/vpl/gather.h"
#include "core/vpl/vpl.h"
#include "tests/support/rig.h"

struct vpls {
    struct lum_vpl_set set;
    struct lum_counters counters;
    uint32_t n, max_bounces, seed;
    bool media, scatters, gloss;
    uint32_t tries;
};

struct lum_vpl_request vpls_request(struct vpls *v, const struct rig *r);
void vpls_update(struct vpls *v, const struct rig *r);
/* Irradiance from all slots at the points; returns the rays. */
uint64_t vpls_gather(const struct rig *r, const struct lum_vpl_set *set, struct lum_bound bound,
                     const struct lum_gather_points *points, struct lum_rgb *ret_irradiance);

static const struct lum_bound no_bound = {LUM_BOUND_NONE, 0.0f};
void vpls_add_point(struct lum_gather_points *pts, struct lum_vec3 p, struct lum_vec3 n);
struct lum_light_desc light_of_kind(const struct lum_light_kind_row *kind);

#endif
