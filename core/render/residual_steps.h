/* What the steps of a residual's correction share: values of pixels, the memory, and what they do with outliers.
 * Internal to residual.c and outliers.c. */
#ifndef LUM_CORE_RENDER_RESIDUAL_STEPS_H
#define LUM_CORE_RENDER_RESIDUAL_STEPS_H

#include "core/render/residual.h"

#define LEVELS 6u /* filtered ones: the widest has a standard deviation of 26 pixels */
#define LANES 12u

/* Side of the squares over which outliers are shared out, pixels. */
#define SPREAD_SIDE 48u

/* What the frame is wrong by goes with how much it lights a place: neither residuals nor outliers go to pixels that it
 * lights otherwise. Of classes of light a pixel is between two. In powers of 2 of what a white surface would show, over
 * the picture's mean. One more is of what does not reflect, such as fog before the sky; the one after it is empty. */
#define LIT_CLASSES 8u
#define CLASSES (LIT_CLASSES + 2u)
#define CLASS_POWERS 1.5f

/* Added to the albedo that residuals are divided by: what is not in proportion to it (gloss, mirrors, black surfaces).
 */
#define ALBEDO_FLOOR 0.05f

/* How pixels lie in the scene, structure of arrays. */
enum {
    GUIDE_NX,
    GUIDE_NY,
    GUIDE_NZ,
    GUIDE_PX,
    GUIDE_PY,
    GUIDE_PZ,
    GUIDE_PER_TOLERANCE, /* 1 / (distance off the plane that still counts as the same surface, for neighbours) */
    GUIDE_KIND,          /* only the same kind is mixed */
    GUIDE_LIT,           /* class of light: no residuals are mixed of what the frame lights otherwise by one class */
    GUIDES
};

/* Values filtered together. Of residuals: A times its weights, its weights, B likewise; red, green, blue. */
struct lanes {
    _Alignas(16) float v[LANES];
};
enum { A = 0, B = 6, WEIGHTS = 3 };
enum { NONE = LEVELS + 1, CHOICES }; /* among levels and none at all, by their errors */
_Static_assert((int)CHOICES <= (int)LANES, "a lane for each");

/* Over pixels, of luminance. */
struct sums {
    double error; /* in units of the picture's mean */
    double mean;
    uint32_t n_both; /* pixels of which the error is known */
    uint64_t nonfinite;
};

/* Of outliers what is shared out, and the sum of the portions of those who get it. */
struct shared {
    struct lum_rgb rest, portions;
    struct lum_rgb edge; /* at edges what one half alone has beyond the limits: a part of it is shared out, too */
};

/* What is beyond the limits at edges, in units of the picture's mean. */
struct edges {
    double square, noise;  /* sums of squares: of the mean of the halves, and of half their difference */
    double sum, sum_noise; /* of what one half alone has, and the variance of that */
};

/* What its pixels bring, by class, to the four corners of a square. */
struct square {
    struct shared corner[4][CLASSES]; /* bit 0: on the right, bit 1: below */
    struct edges edges[CLASSES];
};

struct lum_residual_memory {
    uint32_t w, h, grid_w, grid_h;
    float *guide[GUIDES];
    struct lanes *first;      /* residuals as they are, but for outliers */
    struct lanes *from, *to;  /* what the last filter step made, and room for the next */
    float *own;               /* what a pixel itself weighs in what filter steps made of it */
    struct lanes *by_level;   /* errors of levels 0 to LEVELS, noise weighed; then the weights of these levels */
    struct lanes *blend;      /* residuals: levels by their weights */
    struct square *blocks;    /* of a grid: outliers */
    struct lum_rgb *rates;    /* of the grid's corners, class by class: what a portion of 1 gets of them */
    struct sums *sums;        /* of the grid */
    float edge_part[CLASSES]; /* of what is beyond the limits at edges, what stays there */
};

struct step {
    const struct lum_residual *r;
    struct lum_residual_memory *m;
    const struct lum_stage_runner *runner;
    void (*row)(const struct step *step, uint32_t y);
    uint32_t level;         /* of a filter step: neighbours are 2^level pixels away */
    float per_class;        /* 1: of pixels that are lit alike; 0: of others, too */
    const struct lanes *in; /* of a filter step */
    float scale; /* the picture's mean luminance: residuals are in units of it, so that no square of them overflows */
};

static inline float square_of(float x)
{
    return x * x;
}

/* What residuals are divided by. */
static inline struct lum_rgb albedo_at(const struct step *step, size_t i)
{
    return lum_rgb_scale(lum_rgb_add(step->r->guide->albedo[i], lum_grey(ALBEDO_FLOOR)), step->scale);
}

static inline struct lum_rgb rgb_of(const float v[3])
{
    return lum_rgb(v[0], v[1], v[2]);
}

static inline void set_rgb(float v[3], struct lum_rgb c)
{
    v[0] = c.r;
    v[1] = c.g;
    v[2] = c.b;
}

/* Weights: > 0, or all 0. */
static inline void put(struct lanes *l, uint32_t half, struct lum_rgb c, struct lum_rgb weights)
{
    set_rgb(l->v + half, lum_rgb_mul(c, weights));
    set_rgb(l->v + half + WEIGHTS, weights);
}

/* sum / weights; black where there is no weight. */
static inline struct lum_rgb over(struct lum_rgb sum, struct lum_rgb weights)
{
    return weights.r > 0.0f ? lum_rgb_div(sum, weights) : lum_grey(0.0f);
}

/* Black where no sample went in. */
static inline struct lum_rgb take(const struct lanes *l, uint32_t half)
{
    return over(rgb_of(l->v + half), rgb_of(l->v + half + WEIGHTS));
}

static inline struct lum_rgb mean_of(const struct lanes *l)
{
    return over(lum_rgb_add(rgb_of(l->v + A), rgb_of(l->v + B)),
                lum_rgb_add(rgb_of(l->v + A + WEIGHTS), rgb_of(l->v + B + WEIGHTS)));
}

static inline bool in_half(const struct lanes *l, uint32_t half)
{
    return l->v[half + WEIGHTS] > 0.0f;
}

static inline bool in_both(const struct lanes *l)
{
    return in_half(l, A) && in_half(l, B);
}

/* Residual of a pixel's half: its own, or, after one sample in all, that of the pixel beside it. */
void lum_residual_put(const struct step *step, size_t pixel, int half, struct lanes *l, uint32_t lane);

/* ---- outliers.c ---- */

/* What samples say at a pixel, as light: all of it, by half, and what of it is beyond the limits. */
struct sampled {
    float a, b;            /* luminance */
    struct lum_rgb beyond; /* mean of the halves */
    float beyond_apart;    /* half their difference, luminance */
    float part;            /* of what is beyond, what stays where it is */
    struct lum_rgb share;  /* of what is shared out what the pixel gets */
};

/* How much the frame lights a pixel: number of the class, and how far it is towards the next. */
float lum_outliers_class(const struct step *step, size_t pixel);
/* Limits `first` in a square of the grid by what is smoothed in `from`, and sums what is beyond. A job of a loop: ctx
 * is a step. */
void lum_outliers_limit(void *ctx, uint32_t square, struct lum_counters *counters);
/* Once all squares are limited. */
void lum_outliers_settle(struct lum_residual_memory *m);
/* Afterwards. */
struct sampled lum_outliers_at(const struct step *step, uint32_t x, uint32_t y);

#endif
