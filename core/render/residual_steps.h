/* What the steps of a residual's correction share: the memory, and how a step goes through it. Internal to residual.c
 * and outliers.c. */
#ifndef LUM_CORE_RENDER_RESIDUAL_STEPS_H
#define LUM_CORE_RENDER_RESIDUAL_STEPS_H

#include <stddef.h>
#include <stdint.h>

#include "core/math/rgb.h"
#include "core/render/outliers.h"
#include "core/render/residual.h"
#include "core/render/residual_lanes.h"

#define LEVELS 6u /* filtered ones: the widest has a standard deviation of 26 pixels */

/* Added to the albedo that residuals are divided by, for what is not in proportion to it: gloss, mirrors, black. */
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

enum { NONE = LEVELS + 1, CHOICES }; /* among levels and none at all, by their errors */
_Static_assert((int)CHOICES <= (int)LANES, "a lane for each");

/* Over pixels, of luminance. */
struct sums {
    double error; /* in units of the picture's mean */
    double mean;
    uint32_t n_both; /* pixels of which the error is known */
    uint64_t nonfinite;
};

struct lum_residual_memory {
    uint32_t w, h, grid_w, grid_h;
    float *guide[GUIDES];
    struct lanes *first;      /* residuals as they are, but for outliers */
    struct lanes *from, *to;  /* what the last filter step made, and room for the next */
    float *own;               /* what a pixel itself weighs in what filter steps made of it; in the end its squared
                                 error, in units of the picture's mean; NAN: unknown */
    double scale;             /* that mean; 0: the picture was not finished */
    struct lanes *by_level;   /* errors of levels 0 to LEVELS, noise weighed; then the weights of these levels */
    struct lanes *blend;      /* residuals: levels by their weights */
    struct block *blocks;     /* of a grid: outliers */
    struct rate *rates;       /* of the grid's corners, class by class */
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

/* Of its portion of outliers a pixel takes what filtered levels weigh. Unfiltered samples have their own, and where the
 * frame is left as it is it was found right without. */
static inline float taken(const float weights[CHOICES])
{
    float sum = 0.0f; /* not what the others leave of 1: that would be rounding where it is least */
    for (uint32_t k = 1; k <= LEVELS; k++)
        sum += weights[k];
    return sum;
}

/* What residuals are divided by: the albedo that a half's samples met, of a pixel that has some. */
static inline struct lum_rgb half_albedo(const struct step *step, size_t i, int half)
{
    const struct lum_film_first *first = step->r->truth->first[half];
    struct lum_rgb albedo = first ? first[i].albedo : step->r->guide->albedo[i];
    return lum_rgb_scale(lum_rgb_add(albedo, lum_grey(ALBEDO_FLOOR)), step->scale);
}

/* The same of all its samples; without any, that of its middle. */
struct lum_rgb lum_residual_albedo(const struct step *step, size_t i);
/* And of those of one half. */
struct lum_rgb lum_residual_albedo_by(const struct step *step, size_t i, int half);
/* The albedo that the frame shows there. */
struct lum_rgb lum_residual_frame_albedo(const struct step *step, size_t i);

/* The frame, as bright as with this albedo. */
struct lum_rgb lum_residual_painted(const struct step *step, size_t i, struct lum_rgb albedo);
/* What shines by itself, by the samples of halves first to last and by the frame, half of it for each. */
struct lum_rgb lum_residual_shine(const struct lum_residual *r, size_t i, int first, int last);
/* By a half's samples alone, luminance; of one that has none, what the picture shows. */
float lum_residual_sampled_shine(const struct lum_residual *r, size_t i, int half);

/* Residual of a pixel's half: its own, or, after one sample in all, that of the pixel beside it. Returns the samples.
 */
struct lum_rgb lum_residual_put(const struct step *step, size_t pixel, int half, struct lanes *l, uint32_t lane);

#endif
