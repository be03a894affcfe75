/* How components become smooth pictures: what glossy surfaces, mirrors and glass show by the filter of its interleaved
 * samples, indirect diffuse light by going up from a quarter of the resolution. */
#include "core/estimator/components.h"
#include "core/estimator/estimators.h"

static void gloss_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    (void)counters;
    const struct lum_component_buffer *gloss = &pass->components->buffer[LUM_COMPONENT_GLOSS];
    if (!gloss->raw || lum_components_enter(pass, LUM_STAGE_FILTER, packet))
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    const uint8_t kinds = LUM_PIXEL_SPECULAR | (pass->on[LUM_EFFECT_GLOSSY] ? LUM_PIXEL_GLOSS : 0);
    struct lum_filter f = {.guide = &guide,
                           .need = kinds,
                           .side = pass->settings->method->pattern,
                           .apart = 1,
                           .step = 1,
                           .in = gloss->raw};
    lum_filter_box(&f, &(struct lum_filter_rect){r.x, r.y, r.w, r.h}, gloss->smooth + (size_t)r.y * guide.w + r.x,
                   guide.w);
    if (pass->components->gloss)
        lum_gloss_give_back(pass, &r, gloss->smooth);
}

static void upsample_packet(const struct lum_pass *pass, uint32_t packet, struct lum_counters *counters)
{
    (void)counters;
    struct lum_component_buffer *b = &pass->components->buffer[LUM_COMPONENT_INDIRECT];
    if (!b->raw || lum_components_enter(pass, LUM_STAGE_UPSAMPLE, packet))
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_filter f = {.guide = &guide, .apart = 1, .step = 2, .in = b->raw};
    struct lum_tile_rect r = lum_tile_at(&pass->packets, packet);
    lum_filter_by_taps(&f, pass->components->taps, &(struct lum_filter_rect){r.x, r.y, r.w, r.h}, b->smooth);
}

const struct lum_estimator lum_stage_gloss = {
    .name = "gloss", .stage = LUM_STAGE_FILTER, .tile = gloss_packet, .packets = true};
const struct lum_estimator lum_stage_upsample = {
    .name = "upsample", .stage = LUM_STAGE_UPSAMPLE, .tile = upsample_packet, .packets = true};
