/* Made-up frames and samples whose truth is known, for tests of residual.h: two walls that meet in a vertical edge in
 * the middle of the picture, seen from afar, so that pixels are squares of side 1 on each. */
#ifndef LUM_TESTS_NUMERIC_RESIDUAL_STAGE_H
#define LUM_TESTS_NUMERIC_RESIDUAL_STAGE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/base/pool.h"
#include "core/math/sampler.h"
#include "core/render/residual.h"

#define W 160u
#define H 96u
#define N (W * H)
#define TRUTH 10.0

struct stage {
    struct lum_pool *pool;
    struct lum_counters counters[4];
    struct lum_pass_stats stats;
    struct lum_rgb frame[N], shine[N];
    struct lum_film samples, picture;
    struct lum_surfaces guide;
    struct lum_vec3 p[N], n[N];
    struct lum_rgb albedo[N];
    float depth[N];
    uint8_t kind[N];
    uint32_t object[N];
    const uint32_t *neighbours; /* NULL: the frame was not smoothed */
    struct lum_residual_memory *memory;
    struct lum_residual result;
};

static inline bool is_left(uint32_t i)
{
    return i % W < W / 2;
}

static inline void stage_begin(struct stage *s, uint32_t n_threads)
{
    struct lum_error err;
    memset(s, 0, sizeof *s);
    assert_int_equal(lum_pool_create(n_threads, &s->pool, &err), LUM_OK);
    assert_int_equal(lum_film_init(&s->samples, W, H, &err), LUM_OK);
    assert_int_equal(lum_film_init(&s->picture, W, H, &err), LUM_OK);
    for (uint32_t i = 0; i < N; i++) {
        float along = (float)(i % W) - 0.5f * W;
        s->p[i] = lum_v3(is_left(i) ? along : 0.0f, (float)(i / W), is_left(i) ? 0.0f : along);
        s->n[i] = is_left(i) ? lum_v3(0, 0, 1) : lum_v3(-1, 0, 0);
        s->albedo[i] = lum_grey(0.5f);
        s->depth[i] = 1000.0f;
        s->kind[i] = LUM_PIXEL_SURFACE | LUM_PIXEL_DIFFUSE;
        s->frame[i] = lum_grey((float)TRUTH);
    }
    s->guide = (struct lum_surfaces){
        .p = s->p, .n = s->n, .albedo = s->albedo, .depth = s->depth, .kind = s->kind, .object = s->object};
}

static inline void stage_end(struct stage *s)
{
    lum_residual_finish(s->memory);
    lum_film_finish(&s->samples);
    lum_film_finish(&s->picture);
    lum_pool_destroy(s->pool);
}

/* Uniform with variance 1; of one draw of many. */
static inline double noise_of(uint32_t draw, uint32_t i, uint32_t sample)
{
    struct lum_sampler s = lum_sampler_halves(i % W, i / W, sample, draw);
    return ((double)lum_sampler_1d(&s, 0) - 0.5) * sqrt(12.0);
}

static inline double noise(uint32_t i, uint32_t sample)
{
    return noise_of(7, i, sample);
}

static inline void add_rgb(struct stage *s, uint32_t i, uint32_t sample, struct lum_rgb value)
{
    uint64_t nonfinite = 0;
    lum_film_add(&s->samples, i % W, i / W, sample, value, &nonfinite);
    assert_int_equal(nonfinite, 0);
}

static inline void add(struct stage *s, uint32_t i, uint32_t sample, double value)
{
    add_rgb(s, i, sample, lum_grey((float)value));
}

static inline void apply(struct stage *s)
{
    struct lum_error err;
    struct lum_stage_runner runner = {s->pool, s->counters, NULL, &s->stats, NULL};
    s->result = (struct lum_residual){.frame = s->frame,
                                      .shine = s->samples.first[0] ? s->shine : NULL,
                                      .truth = &s->samples,
                                      .guide = &s->guide,
                                      .neighbours = s->neighbours,
                                      .per_pixel = 1e-3f,
                                      .picture = &s->picture};
    assert_int_equal(lum_residual_apply(&s->result, &s->memory, &runner, &err), LUM_OK);
    assert_int_equal(s->result.nonfinite, 0);
}

static inline double shown(const struct stage *s, uint32_t i)
{
    return (double)lum_film_mean(&s->picture, i % W, i / W).g;
}

static inline double mean_square(const struct stage *s, double (*truth)(uint32_t i))
{
    double sum = 0.0;
    for (uint32_t i = 0; i < N; i++)
        sum += (shown(s, i) - truth(i)) * (shown(s, i) - truth(i));
    return sum / N;
}

static inline double even(uint32_t i)
{
    (void)i;
    return TRUTH;
}

#endif
