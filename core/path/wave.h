/* Wavefront path tracing of up to one ray batch of paths. */
#ifndef LUM_CORE_PATH_WAVE_H
#define LUM_CORE_PATH_WAVE_H

#include "core/accel/trace.h"
#include "core/film/film.h"
#include "core/material/bsdf.h"
#include "core/math/sampler_pairs.h"
#include "core/path/carried.h"
#include "core/trace/rays.h"

/* Light that a path brings home: at the end, multiplied by the power of the light; LUM_NO_OBJECT: from what shines
 * without being one. */
struct lum_gain {
    uint32_t slot, light;
    struct lum_rgb value;
};

/* Of a wave that is traced with every light at power 1, to be summed up at any power. */
struct lum_gains {
    struct lum_gain *gains;
    uint32_t n, max;
    uint32_t n_lost; /* for which there was no room */
};

/* A segment that the path of a slot went along, or a shadow ray of it. One that nothing ended is LUM_SEGMENT_FAR long.
 */
struct lum_path_segment {
    struct lum_vec3 from, to;
    uint32_t slot;
};
#define LUM_SEGMENT_FAR (4.0f * LUM_SCENE_REACH) /* beyond all that a scene holds, from wherever in it */

/* All of a wave: while nothing moves across those of a slot, its path brings home the same. */
struct lum_path_segments {
    struct lum_path_segment *segments;
    uint32_t n, max;
    uint32_t n_lost; /* for which there was no room */
};

/* Beyond, one is picked. By its flux that was its lamps once in a hundred paths, in an office by day: blotches. */
#define LUM_WAVE_LIGHTS 8u
#define LUM_WAVE_PAIR_PIXEL LUM_PAIRS_PATH /* sampler pair that paths leave to whoever starts them at the eye */

struct lum_path_guide;
struct lum_portals;
struct lum_path_guide_notes;

/* The paths that are alive, densely packed: path i has ray i. About 90 KiB: lives on a worker's stack. */
struct lum_wave {
    const struct lum_snapshot *snapshot;
    struct lum_counters *counters;
    uint32_t max_depth;
    uint32_t roulette_depth; /* segments that a path has behind it when roulette starts */
    float gloss_survival;    /* of paths of lum_wave_add_gloss: over what their pixel reflects in all, diffusely and
                                otherwise */
    bool media;              /* there are some, and they are wanted */
    bool scatters;           /* likewise: they scatter light any number of times */
    bool panes;              /* likewise: light goes straight through them */
    bool illuminance;        /* paths of lum_wave_add_eye find illuminance / pi where they first arrive, and nothing of
                                what is before that. Set after lum_wave_begin */
    bool keeps_first;        /* likewise: what shines where rays from the eye end goes to first, and not to radiance */
    bool lamps_apart; /* likewise: lamps and the sun that the eye sees, straight or through panes, are left out: who
                         started the paths counts them. Of the sky what is brighter than apart_cd_m2 is one */
    float apart_cd_m2;
    bool at_first;    /* while the first segments of eye paths are looked at */
    bool in_fog;      /* fog holds for the segments that are looked at */
    bool every_light; /* vertices sample every light, and do not pick one; of at most LUM_WAVE_LIGHTS that are on */
    /* Effects to leave out, bits LUM_EFFECT_BIT: kinds of light whose direct light nothing gets (the eye and mirrors
     * still see what shines, and what they light by way of a diffuse surface is another effect), and lobes that no path
     * goes on by. 0: nothing is asked of any vertex. */
    uint32_t lights_off, lobes_off;
    struct lum_rays rays;
    struct lum_hits hits;
    struct lum_path path[LUM_RAY_BATCH];
    struct lum_wave_fog fog[LUM_RAY_BATCH]; /* by ray of the batch that came back */
    struct lum_rays shadow_rays;
    struct lum_gain shadow_gain[LUM_RAY_BATCH];
    uint8_t shadow_kind[LUM_RAY_BATCH], shadow_effect[LUM_RAY_BATCH], occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];         /* by shadow ray: what panes leave, where there are any */
    struct lum_rgb radiance[LUM_RAY_BATCH];     /* by slot */
    struct lum_film_first first[LUM_RAY_BATCH]; /* by slot, if keeps_first */
    /* NULL: not wanted. Else set after lum_wave_begin, all 0, for paths of lum_wave_add_eye: the luminance of radiance
     * and shine, by slot and effect. What the eye sees shine by itself is that of antialias: nothing but edges makes it
     * noisy. */
    float (*parts)[LUM_EFFECT_COUNT];
    struct lum_gains *gains; /* NULL: all goes to radiance. Else set after lum_wave_begin, with a unit snapshot */
    const struct lum_portals *portals;      /* NULL: none are known. Else set likewise */
    struct lum_path_segments *segments_met; /* NULL: not wanted. Else set after lum_wave_begin */
    const struct lum_path_guide *guide;     /* NULL: paths go unguided. Else set after lum_wave_begin */
    struct lum_path_guide_notes *notes;     /* NULL: not wanted. Else set likewise, with a guide and without gains */
};

/* No path, no radiance. effects_off: bits LUM_EFFECT_BIT of what is to be left out. */
void lum_wave_begin(struct lum_wave *w, const struct lum_snapshot *snapshot, struct lum_counters *counters,
                    uint32_t max_depth, uint32_t effects_off);

/* Starts path number slot with a ray from the eye. */
void lum_wave_add_eye(struct lum_wave *w, uint32_t slot, struct lum_sampler sampler, struct lum_vec3 o,
                      struct lum_vec3 d);

/* Starts path number slot at a surface point as if a ray had hit it; wo is unit. radiance[slot] becomes what the point
 * sends towards wo, without emission. Call lum_wave_run with depth 1 afterwards. */
void lum_wave_add_vertex(struct lum_wave *w, uint32_t slot, struct lum_sampler sampler, struct lum_vec3 p,
                         const struct lum_bsdf *bsdf, struct lum_vec3 wo);

/* Starts path number slot with one ray of the non-cosine lobes of a surface point. Emission that it meets is weighted
 * against an estimator that samples every light at the point, with lum_bsdf_value.gloss_pdf_sa. Call lum_wave_run with
 * depth 1 afterwards. */
void lum_wave_add_gloss(struct lum_wave *w, uint32_t slot, struct lum_sampler sampler, struct lum_vec3 p,
                        const struct lum_bsdf *bsdf, struct lum_vec3 wo);

/* Starts path number slot with one ray from a surface point with geometric normal ng, in proportion to its cosine with
 * the shading normal n. radiance[slot] becomes the light that other surfaces send along it; what shines there by itself
 * is direct light, and left out. pi times its mean is the indirect irradiance. False: the ray would leave into the
 * surface, and brings nothing. Call lum_wave_step or lum_wave_run with depth 1 afterwards. */
bool lum_wave_add_indirect(struct lum_wave *w, uint32_t slot, struct lum_sampler sampler, struct lum_vec3 p,
                           struct lum_vec3 n, struct lum_vec3 ng);

/* One segment of all paths. Afterwards hits says where the rays ended that were there before, in their order. */
void lum_wave_step(struct lum_wave *w, uint32_t depth);

/* Traces all paths to their end. depth: segments they have behind them (0: eye rays, 1: after lum_wave_add_vertex). */
void lum_wave_run(struct lum_wave *w, uint32_t depth);

#endif
