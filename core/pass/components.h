/* Effect by effect buffers of a deferred view: the component pipeline of the thesis (5.2).
 *
 * The buffer of an effect may be filled by estimators of others, too: gloss has what mirrors show; that of transmission
 * has indirect light that sheets let through, and exists where there are any. They write `raw`,
 * pixel by pixel or at a quarter of the resolution, from interleaved samples; the method's filter makes `smooth` of it;
 * the composite adds it to the picture as the effect's row says (enum lum_adds). Buffers exist only for effects that
 * are on. They hold the sum over the lights at their present power: any change of what the eye or the lights see makes
 * all of them anew. What a change of power alone leaves as it was, estimators keep for themselves (state.h). */
#ifndef LUM_CORE_PASS_COMPONENTS_H
#define LUM_CORE_PASS_COMPONENTS_H

#include "core/interleave/interleave.h"
#include "core/pass/pass.h"

struct lum_component_buffer {
    /* w * h, row by row; NULL: nothing calls for it. raw has room for (w + 1) * (h + 1): it may be used for up to two
     * pictures of a quarter of the resolution instead, rounded up. */
    struct lum_rgb *raw, *smooth;
    uint8_t *iterations; /* w * h: how often the pixel's tile of the pattern was refined, for the guidance map */
};

struct lum_components {
    struct lum_component_buffer buffer[LUM_EFFECT_COUNT];
    struct lum_rgb *radiance; /* w * h: the composite's, before anti-aliasing; NULL: that is off */
    uint32_t w, h;
    struct lum_memo made[LUM_EFFECT_COUNT], filtered[LUM_EFFECT_COUNT]; /* by cell or tile: how far it is */
    uint32_t lasting; /* bits LUM_EFFECT_BIT: as estimators of the pass say (struct lum_estimator) */
    /* what they show */
    struct lum_basis basis;
    uint64_t surfaces; /* version of the surfaces */
};

void lum_components_finish(struct lum_components *c);

/* Makes the buffers that the pass calls for, frees the others, and marks everything as undone if anything that they
 * depend on has changed; *ret_outcome says what. On failure there are none. */
LUM_MUST_USE enum lum_status lum_components_update(struct lum_components *c, const struct lum_pass *pass,
                                                   struct lum_outcome *ret_outcome, struct lum_error *err);

/* For an estimator of the effect, and a filter of its buffer: true when the cell or tile is done already; else says so
 * for the next time. */
bool lum_components_enter(const struct lum_pass *pass, enum lum_effect effect, uint32_t tile);
bool lum_components_enter_filter(const struct lum_pass *pass, enum lum_effect effect, uint32_t tile);

/* Adds radiance to a pixel of a raw buffer; nothing if the buffer does not exist. */
static inline void lum_component_add(struct lum_components *c, enum lum_effect which, size_t pixel,
                                     struct lum_rgb value)
{
    struct lum_rgb *raw = c->buffer[which].raw;
    if (raw)
        raw[pixel] = lum_rgb_add(raw[pixel], value);
}

/* What guides filters: the surfaces of the pass. */
struct lum_guide lum_components_guide(const struct lum_pass *pass);

#endif
