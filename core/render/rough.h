/* Rough pictures: the frame at a part of the resolution, seen at all of it. Light changes little along a surface,
 * so what a pixel gets is that of those of the coarse frame around it which lie on the same surface, times its own
 * albedo over theirs: edges and textures are those of the full picture. What shines by itself shines as it does, be it
 * as thin as it may.
 *
 * Lights that did not change while another one did are shown as sharp as the last frame did: their layers are summed as
 * a frame sums them, and left out of what the coarse frame lends, tile by tile. Internal to core/render. */
#ifndef LUM_CORE_RENDER_ROUGH_H
#define LUM_CORE_RENDER_ROUGH_H

#include "core/film/film.h"
#include "core/render/deferred.h"
#include "core/render/rough_base.h"

/* Fills the film with what `coarse` has of the light, for surfaces that the same eye sees at full resolution, and what
 * the pass's layers know of it. Of `coarse` these are read: snapshot, settings, eye, tiling, on, G-buffer, surfaces,
 * layers, film. Thread: that of the pass; it runs over all of the runner's. LUM_ERR_CANCELLED, LUM_ERR_NOMEM. */
LUM_MUST_USE enum lum_status lum_rough_upsample(const struct lum_pass *coarse, const struct lum_pass *pass,
                                                const struct lum_rough_base *base,
                                                const struct lum_stage_runner *runner, struct lum_error *err);

#endif
