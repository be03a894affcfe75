/* What a view holds from pass to pass. Internal to view.c and view_rough.c. */
#ifndef LUM_CORE_RENDER_VIEW_STATE_H
#define LUM_CORE_RENDER_VIEW_STATE_H

#include "core/light/portals.h"
#include "core/path/effect_noise.h"
#include "core/render/aov.h"
#include "core/render/deferred.h"
#include "core/render/measure.h"
#include "core/render/mix.h"
#include "core/render/refine.h"
#include "core/render/rough_base.h"
#include "core/render/view.h"

struct lum_view {
    struct lum_pool *pool;         /* borrowed */
    struct lum_team *team;         /* borrowed; NULL: it has none */
    struct lum_counters *counters; /* per worker of the pool */
    struct lum_tiling tiling;
    struct lum_film film;
    uint32_t *tile_spp;
    struct lum_deferred deferred;
    struct lum_refinement refinement; /* methods that refine */
    uint32_t block;             /* of a rough view: pixels a side that each of its own stands for; 0: it is none */
    bool early;                 /* of a rough view: its pass lacks the records that the whole picture made after it */
    bool whole;                 /* the film shows a whole frame of what deferred was last asked for */
    struct lum_rough_base base; /* of rough pictures */
    struct lum_mix mix;         /* of pictures while lights fade */
    bool mixed;                 /* the film shows one, of mix.shown: it is whole, and not what deferred was asked for */
    struct lum_view *rough; /* all but progressive methods: the same at a part of the resolution, for rough passes */
    struct lum_view *half;  /* likewise, at half the size, for those that are rougher than LUM_PREVIEW_WHOLE */
    struct lum_path_guide *guide; /* of its path traced samples; NULL: none was needed yet, or memory is short */
    struct lum_portals portals;   /* for them; of the geometry of portals_versions */
    struct lum_versions portals_versions;
    bool portals_known;
    struct lum_effect_noise effect_noise; /* likewise; without memory: not known */
    double noise[LUM_EFFECT_COUNT];       /* of the present picture's samples, when their halves were last even */
    struct lum_aov_buffers aov;
    struct lum_caches *own_caches; /* of a view that shares none; else NULL */
    /* what the film shows */
    bool rendered;
    bool previewed; /* the rough pass of the present picture has run */
    bool relit; /* the picture before it was whole, and only powers of lights differ: the frame is a new sum, and comes
                   at once */
    struct lum_film_error error; /* as the picture's own samples tell it, when the halves were last even */
    struct lum_measurement measurement;
    struct lum_measurement rough_measurement; /* of rough pictures, which are off by more than whole ones */
    struct lum_versions versions;
    struct lum_view_settings settings;
    struct lum_demand demand; /* of versions */
    struct lum_demand chosen; /* the same, as settings would have it */
};

/* Samples of the tile that has fewest. */
static inline uint32_t lum_view_least_spp(const uint32_t *tile_spp, uint32_t n_tiles)
{
    uint32_t least = UINT32_MAX;
    for (uint32_t i = 0; i < n_tiles; i++)
        if (tile_spp[i] < least)
            least = tile_spp[i];
    return least;
}

/* The fast frame; its picture is what later passes refine. Thread, errors: as lum_view_pass. */
enum lum_status lum_view_frame(struct lum_view *v, struct lum_pass *pass, const struct lum_stage_runner *runner,
                               struct lum_error *err);
/* The same while lights fade, as a sum of the pictures of both ends; that of the end is made first, if it has to be.
 * *ret_made false: it is no such picture, or memory is short, and nothing was done. */
enum lum_status lum_view_mix(struct lum_view *v, const struct lum_pass *frame, const struct lum_stage_runner *runner,
                             bool *ret_made, struct lum_error *err);
/* A rough pass. Thread, errors: as lum_view_pass. */
enum lum_status lum_view_rough(struct lum_view *v, const struct lum_pass *frame, const struct lum_stage_runner *runner,
                               struct lum_error *err);

#endif
