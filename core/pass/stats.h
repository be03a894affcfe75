/* The stages of a pass, and what it says of itself. */
#ifndef LUM_CORE_PASS_STATS_H
#define LUM_CORE_PASS_STATS_H

#include "core/cache/caches.h"
#include "core/film/film.h"
#include "core/trace/demand.h"

/* In the order in which they run. */
/* clang-format off: a stage a line */
#define LUM_STAGES(X)                                                                                                  \
    X(GBUFFER, gbuffer)                                                                                                \
    X(SURFACES, surfaces)                                                                                              \
    X(VPLS, vpls)                                                                                                      \
    X(CACHE, cache)                                                                                                    \
    X(RECORDS, records)                                                                                                \
    X(DIRECT, direct)                                                                                                  \
    X(SHADOW, shadow)                                                                                                  \
    X(REFINE, refine)                                                                                                  \
    X(INDIRECT, indirect)                                                                                              \
    X(SPECULAR, specular)                                                                                              \
    X(GLOSSY, glossy)                                                                                                  \
    X(MEDIA, media)                                                                                                    \
    X(FILTER, filter)                                                                                                  \
    X(UPSAMPLE, upsample)                                                                                              \
    X(PATH, path)                                                                                                      \
    X(COMPOSITE, composite)                                                                                            \
    X(ANTIALIAS, antialias)                                                                                            \
    X(ERROR, error)
/* clang-format on */
#define LUM_STAGE_MEMBER(NAME, name) LUM_STAGE_##NAME,
enum lum_stage { LUM_STAGES(LUM_STAGE_MEMBER) LUM_STAGE_COUNT };
extern const char *const lum_stage_names[LUM_STAGE_COUNT];

struct lum_effect_stats {
    uint64_t rays, tiles;
    int64_t ns;   /* CPU */
    double noise; /* of its light, as samples of the present picture have it, over the mean luminance of all; NAN: not
                     known */
};

/* What one pass did. Counters are of this pass only; exactly 0 where nothing ran. */
struct lum_pass_stats {
    uint64_t scene_rev;
    double ms, cpu_ms;
    double stage_ms[LUM_STAGE_COUNT];
    uint64_t rays[LUM_RAY_KIND_COUNT];
    struct lum_demand demand;
    struct lum_effect_stats effects[LUM_EFFECT_COUNT];
    bool served[LUM_EFFECT_COUNT]; /* by the method: one that is called for and not served is missing in the picture */
    uint32_t n_vpls, n_vpls_moved; /* virtual point lights that shine, and those of them that lie elsewhere than in the
                                      pass before */
    struct lum_cache_counts cache;
    uint64_t nonfinite, bad_rays; /* must be 0 */
    double culled_bound;          /* of lamps that were left out of any tile, at most, over the tile's own light */
    uint32_t spp;                 /* least samples of any pixel so far */
    struct lum_film_error error;  /* of the picture */
    bool unlit;                   /* it is black, though something shines: its error is not known */
    double noise;                 /* bound of the error that its samples have by themselves; NAN: not known, or none */
    uint32_t preview;             /* > 1: this was the rough pass, of blocks of this side; spp is still 0 */
    bool measuring;               /* this pass did nothing but measure the error */
    bool changed;                 /* the film differs from before the pass */
    bool complete;                /* nothing left to do for this snapshot and these settings */
};

#endif
