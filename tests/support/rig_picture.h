/* What a rig's picture shows. */
#ifndef LUM_TESTS_SUPPORT_RIG_PICTURE_H
#define LUM_TESTS_SUPPORT_RIG_PICTURE_H

#include "tests/support/rig_life.h"

/* Mean radiance over the film. */
static inline struct lum_rgb rig_mean(const struct rig *r)
{
    const struct lum_film *f = lum_view_film(r->view);
    double sum[3] = {0};
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++) {
            struct lum_rgb c = lum_film_mean(f, x, y);
            sum[0] += (double)c.r;
            sum[1] += (double)c.g;
            sum[2] += (double)c.b;
        }
    double n = (double)f->w * f->h;
    return lum_rgb((float)(sum[0] / n), (float)(sum[1] / n), (float)(sum[2] / n));
}

/* A copy of all pixels; free with lum_free. */
static inline struct lum_rgb *rig_picture(const struct rig *r)
{
    const struct lum_film *f = lum_view_film(r->view);
    struct lum_rgb *p = lum_calloc((size_t)f->w * f->h, sizeof *p);
    assert_non_null(p);
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++)
            p[(size_t)y * f->w + x] = lum_film_mean(f, x, y);
    return p;
}

/* Fails unless the film is bit for bit this picture. */
static inline void rig_assert_picture(const struct rig *r, const struct lum_rgb *expected, const char *what)
{
    const struct lum_film *f = lum_view_film(r->view);
    for (uint32_t y = 0; y < f->h; y++)
        for (uint32_t x = 0; x < f->w; x++) {
            struct lum_rgb got = lum_film_mean(f, x, y), want = expected[(size_t)y * f->w + x];
            if (memcmp(&got, &want, sizeof got) != 0)
                fail_msg("%s: pixel %u,%u is %g %g %g, expected %g %g %g", what, x, y, (double)got.r, (double)got.g,
                         (double)got.b, (double)want.r, (double)want.g, (double)want.b);
        }
}

/* The film is bit for bit what a new view makes, which is the rig's from now on. */
static inline void rig_assert_as_fresh(struct rig *r, const char *what)
{
    struct lum_rgb *picture = rig_picture(r);
    rig_fresh_view(r);
    rig_pass(r);
    rig_assert_picture(r, picture, what);
    lum_free(picture);
}

#endif
