/* Pictures of methods against closed forms. */
#ifndef LUM_TESTS_NUMERIC_READING_H
#define LUM_TESTS_NUMERIC_READING_H

#include "core/method/method.h"
#include "tests/support/effort.h"
#include "tests/support/rig.h"

#define PI 3.14159265358979323846

/* Mean of SEEDS pictures of a method, and the standard error of that. Of `live` its first frames. */
struct reading {
    double mean, error;
};

enum { SEEDS = TEST_EFFORT(12) };

static inline struct reading read_picture(struct rig *r, const struct lum_method *method, uint32_t spp)
{
    struct reading sum = {0};
    r->settings.method = method;
    r->settings.max_spp = method->progressive ? spp : 1;
    for (r->settings.seed = 0; r->settings.seed < SEEDS; r->settings.seed++) {
        rig_fresh_view(r);
        while (!rig_pass(r).complete && !method->refines)
            continue;
        double value = (double)rig_mean(r).g;
        sum.mean += value / SEEDS;
        sum.error += value * value / SEEDS;
    }
    r->settings.seed = 0;
    sum.error = sqrt(fmax(0.0, sum.error - sum.mean * sum.mean) / (SEEDS - 1));
    return sum;
}

/* share: by which it may be off besides four standard errors. */
static inline void check(const char *what, const struct lum_method *method, struct reading got, double want,
                         double share)
{
    if (TEST_TELLS && !(fabs(got.mean - want) <= 4.0 * got.error + share * want))
        fail_msg("%s, %s: %.5g +- %.3g, closed form %.5g", what, method->name, got.mean, got.error, want);
}

/* A square of the material does not show where light is the same from everywhere. share: as above. */
static inline void check_in_furnace(const char *what, const struct lum_material_desc *material, struct lum_vec3d eye,
                                    uint32_t spp, double share)
{
    struct rig r;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    rig_begin(&r, 0);
    rig_furnace(&r, 1, 0.0f, 0.5);
    rig_material(&r, "square", material);
    rig_square(&r, "square", 0.5);
    rig_object(&r, "square", "square", "square", rig_v(0, -0.2, 0));
    rig_camera(&r, eye, rig_v(0, -0.2, 0), 30);
    r.settings.w = r.settings.h = 12;
    rig_commit(&r);
    for (size_t m = 0; m < n; m++)
        check(what, &methods[m], read_picture(&r, &methods[m], spp), 0.5, share);
    rig_end(&r);
}

#endif
