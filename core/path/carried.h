/* What a path carries, and what fog does to it. */
#ifndef LUM_CORE_PATH_CARRIED_H
#define LUM_CORE_PATH_CARRIED_H

#include "core/math/sampler.h"
#include "core/medium/collide.h"

/* Of a path that fog has scattered: on which segment, and where. What a light sends there straight is sampled in
 * another way, too (lum_medium_scatter), against which a light that the path meets is weighted. */
struct lum_path_origin {
    struct lum_vec3 o, d;
    float tmax, t;
    uint32_t medium;
    bool seen; /* by the eye */
    float pdf; /* of t and medium; 0: the last vertex is none of fog */
};

/* What a path carries from one vertex to the next. */
struct lum_path {
    struct lum_rgb throughput;
    struct lum_vec3 p; /* last vertex but for panes, for the light pdf of what the ray hits */
    struct lum_vec3 n; /* normal there, as the light was picked by (lum_lights_pick_from) */
    float pdf_sa;      /* with which the ray was sampled; 0: by the eye or a delta lobe, so emission counts in full */
    bool every_light;  /* the last vertex sampled every light, and did not pick one */
    bool plain;        /* the last vertex sampled light as lum_light_sample_plainly does: it was one of the wave */
    bool direct_apart; /* what shines at the end of the ray is counted by whoever started the path */
    bool indirect;     /* a diffuse surface has scattered it: what it finds is indirect light */
    bool was_indirect; /* the same at the last vertex, whose direct light the ray may meet */
    bool seen;         /* with media: up to the last vertex, only mirrors and clear glass are between it and the eye */
    uint8_t effect;    /* that what it finds counts as. LUM_EFFECT_ANTIALIAS: nothing but panes was in its way */
    uint32_t n_panes;  /* that it went straight through on its way from vertices that spread light: no shadow ray
                        * counts those, and they are no part of its depth */
    uint32_t n_scattered; /* by fog. Beyond LUM_WAVE_SCATTERED_MAX no part of its depth either */
    struct lum_path_origin from;
    float survival;       /* roulette: it lives on with this chance, times its throughput */
    float roulette_scale; /* roulette takes throughput without it: the squared relative indices that it carries, and
                           * what guiding takes from it */
    uint32_t slot;        /* where its radiance is summed */
    struct lum_sampler sampler;
};

#define LUM_WAVE_SCATTERED_MAX 16u

/* What fog does to a path on a segment that a batch came back with. */
struct lum_wave_fog {
    bool scatters;             /* at hit; else it goes on from where the segment ends */
    bool seen;                 /* the eye sees the segment: its end is looked at in any case */
    float pass;                /* then: chance with which the path goes on from there, if it is not scattered */
    struct lum_rgb throughput; /* at the start of the segment */
    struct lum_collision hit;
};

#endif
