/* Indirect diffuse light goes up from a quarter of the resolution. */
#include "core/effect/indirect/records.h"
#include "core/effect/indirect/interpolated.h"
#include "core/pass/components.h"

static void upsample_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    struct lum_component_buffer *b = &pass->components->buffer[LUM_EFFECT_INDIRECT_DIFFUSE];
    if (!b->raw || lum_components_enter_filter(pass, LUM_EFFECT_INDIRECT_DIFFUSE, cell))
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_filter f = {.guide = &guide, .apart = 1, .step = 2, .in = b->raw};
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    lum_filter_by_taps(&f, lum_taps_of(pass), &(struct lum_filter_rect){r.x, r.y, r.w, r.h}, b->smooth);
}

const struct lum_estimator lum_stage_upsample = {
    .name = "upsample", .stage = LUM_STAGE_UPSAMPLE, .tile = upsample_cell, .cells = true};
