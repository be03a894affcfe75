#include "tests/support/vpls.h"

struct lum_vpl_request vpls_request(struct vpls *v, const struct rig *r)
{
    return (struct lum_vpl_request){.snapshot = r->snapshot,
                                    .n = v->n,
                                    .max_bounces = v->max_bounces,
                                    .seed = v->seed,
                                    .media = v->media,
                                    .scatters = v->scatters,
                                    .gloss = v->gloss,
                                    .pool = r->pool,
                                    .counters = &v->counters,
                                    .tries = v->tries};
}

void vpls_update(struct vpls *v, const struct rig *r)
{
    struct lum_vpl_request rq = vpls_request(v, r);
    memset(&v->counters, 0, sizeof v->counters);
    RIG_OK(lum_vpl_update(&v->set, &rq, &err));
    assert_int_equal(v->counters.nonfinite, 0);
    assert_int_equal(v->counters.bad_rays, 0);
}

uint64_t vpls_gather(const struct rig *r, const struct lum_vpl_set *set, struct lum_bound bound,
                     const struct lum_gather_points *points, struct lum_rgb *ret_irradiance)
{
    uint32_t *slots = lum_calloc(set->n, sizeof *slots);
    assert_non_null(slots);
    for (uint32_t i = 0; i < set->n; i++)
        slots[i] = i;
    struct lum_counters counters = {0};
    for (uint32_t i = 0; i < points->n_points; i++)
        ret_irradiance[i] = lum_grey(0.0f);
    struct lum_gather job = {.snapshot = r->snapshot,
                             .set = set,
                             .slots = slots,
                             .n_slots = set->n,
                             .bound = bound,
                             .media = true,
                             .points = points,
                             .irradiance = ret_irradiance,
                             .counters = &counters};
    lum_vpl_gather(&job);
    lum_free(slots);
    assert_int_equal(counters.bad_rays, 0);
    for (uint32_t i = 0; i < points->n_points; i++)
        assert_true(lum_rgb_finite(ret_irradiance[i]));
    return counters.rays[LUM_RAY_INDIRECT_DIFFUSE];
}

void vpls_add_point(struct lum_gather_points *pts, struct lum_vec3 p, struct lum_vec3 n)
{
    uint32_t i = pts->n_points++;
    pts->p[i] = p;
    pts->n[i] = pts->ng[i] = n;
}

struct lum_light_desc light_of_kind(const struct lum_light_kind_row *kind)
{
    return (struct lum_light_desc){.kind = kind,
                                   .position = {-0.4, 1.7, 0.3},
                                   .direction = {0.5, -1, -0.2},
                                   .u = {0.4, 0, 0}, /* faces down */
                                   .v = {0, 0, 0.5},
                                   .radius_m = 0.25,
                                   .inner_cone_rad = 0.3,
                                   .outer_cone_rad = 0.9,
                                   .cie_type = 12,
                                   .ground_albedo = 0.2,
                                   .color = {1.5f, 0.9f, 0.2f},
                                   .intensity = 100,
                                   .on = true};
}
