/* What glossy surfaces, mirrors and glass show becomes smooth by the filter of its interleaved samples. */
#include "core/effect/gloss/gloss.h"

static void gloss_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    const struct lum_component_buffer *gloss = &pass->components->buffer[LUM_EFFECT_GLOSSY];
    if (!gloss->raw || lum_components_enter_filter(pass, LUM_EFFECT_GLOSSY, cell))
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    const uint8_t kinds = LUM_PIXEL_SPECULAR | (pass->on[LUM_EFFECT_GLOSSY] ? LUM_PIXEL_GLOSS : 0);
    struct lum_filter f = {.guide = &guide,
                           .need = kinds,
                           .side = pass->settings->method->pattern,
                           .apart = 1,
                           .step = 1,
                           .in = gloss->raw};
    lum_filter_box(&f, &(struct lum_filter_rect){r.x, r.y, r.w, r.h}, gloss->smooth + (size_t)r.y * guide.w + r.x,
                   guide.w);
    const struct lum_gloss *paths = lum_pass_state(pass, &lum_gloss_kind);
    if (paths)
        lum_gloss_give_back(paths, pass, &r, gloss->smooth);
}

const struct lum_estimator lum_stage_gloss = {
    .name = "gloss", .stage = LUM_STAGE_FILTER, .tile = gloss_cell, .cells = true};
