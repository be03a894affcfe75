/* Rough pictures: the frame at a part of the resolution, seen at all of it. Light changes little along a surface,
 * so what a pixel gets is that of those of the coarse frame around it which lie on the same surface, times its own
 * albedo over theirs: edges and textures are those of the full picture. What shines by itself shines as it does, be it
 * as thin as it may. Internal to core/render. */
#ifndef LUM_CORE_RENDER_ROUGH_H
#define LUM_CORE_RENDER_ROUGH_H

#include "core/film/film.h"
#include "core/render/deferred.h"

/* A picture and what it shows. */
struct lum_rough_picture {
    const struct lum_film *film;
    const struct lum_tiling *tiling;
    const struct lum_gbuffer *gbuffer;
    const struct lum_surfaces *surfaces;
    const struct lum_eye *eye;
};
/* Fills the film with what `coarse` has of the light, for surfaces that the same eye sees at full resolution. Thread:
 * that of the pass; it runs over all of the runner's. LUM_ERR_CANCELLED, LUM_ERR_NOMEM. */
LUM_MUST_USE enum lum_status lum_rough_upsample(const struct lum_rough_picture *coarse, const struct lum_pass *pass,
                                                const struct lum_stage_runner *runner, struct lum_error *err);

#endif
