/* Outliers of residuals: what samples say beyond the limits is shared out over a block of pixels. Internal to
 * residual.c and outliers.c. */
#ifndef LUM_CORE_RENDER_OUTLIERS_H
#define LUM_CORE_RENDER_OUTLIERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/math/rgb.h"

struct lum_counters;
struct lum_residual_memory;
struct step;

/* Side of the blocks over which outliers are shared out, pixels. */
#define SPREAD_SIDE 48u

/* What the frame is wrong by goes with how much it lights a place: neither residuals nor outliers go to pixels that it
 * lights otherwise. Of classes of light a pixel is between two. In powers of 2 of what a white surface would show, over
 * the picture's mean. One more is of what does not reflect, such as fog before the sky; the one after it is empty. As
 * many again are of mirrors and glass: their samples go one way or another by chance, and what these find is no light
 * of matt surfaces around. */
#define LIT_CLASSES 8u
#define SPECULAR_CLASSES (LIT_CLASSES + 2u) /* the first of these */
#define CLASSES (2u * SPECULAR_CLASSES)
/* Wider: what is shared out lands where it is darker or brighter; narrower: in fewer pixels, where it shows. Of the
 * eight the first is that of 2^-5.25, a 38th of the mean, the last that of 38 times it. */
#define CLASS_POWERS 1.5f

/* Of outliers what is shared out, and the sum of the portions of those who get it. */
struct shared {
    struct lum_rgb rest, portions;
    struct lum_rgb alike;      /* away from edges what both halves have above the limits: as far as it is by chance */
    struct lum_rgb edge;       /* at edges what one half alone has beyond the limits: a part of it is shared out, too */
    float n, n_alone, n_alike; /* pixels away from edges; of these, where one half alone, and both, are above them */
};

/* Of a corner and class: what a portion of 1 gets, and of what both halves have the part that is by chance. */
struct rate {
    struct lum_rgb shared;
    float by_chance;
};

/* What is beyond the limits at edges, in units of the picture's mean. */
struct edges {
    double square, noise;  /* sums of squares: of the mean of the halves, and of half their difference */
    double sum, sum_noise; /* of what one half alone has, and the variance of that */
};

/* What its pixels bring, by class, to the four corners of a block. */
struct block {
    struct shared corner[4][CLASSES]; /* bit 0: on the right, bit 1: below */
    struct edges edges[CLASSES];
};

/* What samples say at a pixel, as light: by half, and what of their residual is beyond the limits. */
struct sampled {
    float a, b;            /* luminance */
    struct lum_rgb beyond; /* mean of the halves */
    float beyond_apart;    /* half their difference, luminance */
    float part;            /* of what is beyond, what stays where it is */
    bool at_edge;          /* of an object: what is beyond may be another one */
    struct lum_rgb share;  /* of what is shared out what the pixel gets if it takes its whole portion */
};

/* True where an object has an edge, or is next to one. */
bool lum_outliers_are_at_edge(const struct step *step, uint32_t x, uint32_t y);
/* How much the frame lights a pixel: number of the class, and how far it is towards the next. */
float lum_outliers_class(const struct step *step, size_t pixel);
/* Limits `first` in a block of the grid by what is smoothed in `from`, and sums what is beyond. A job of a loop: ctx
 * is a step. */
void lum_outliers_limit(void *ctx, uint32_t block, struct lum_counters *counters);
/* Once the levels of all pixels are chosen: sums anew what is beyond, and what the frame as it is leaves out. Likewise
 * a job; lum_outliers_settle after it. */
void lum_outliers_deal(void *ctx, uint32_t block, struct lum_counters *counters);
/* Once all blocks are summed. */
void lum_outliers_settle(struct lum_residual_memory *m);
/* Afterwards. */
struct sampled lum_outliers_at(const struct step *step, uint32_t x, uint32_t y);

#endif
