/* The second half of the thesis' frame (5.2.4): after a barrier, cells are filtered.
 *
 * AIS filters component by component and IGI the sum of direct and indirect light. The thesis holds the first to be
 * smoother; the filter being linear, and the same for both, it makes no difference to the picture. */
#include "core/effect/ais/ais.h"

static void filter(const struct lum_pass *pass, uint32_t cell, enum lum_effect which, uint8_t need)
{
    const struct lum_component_buffer *buffer = &pass->components->buffer[which];
    if (!buffer->raw)
        return;
    struct lum_guide guide = lum_components_guide(pass);
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    struct lum_filter_rect rect = {r.x, r.y, r.w, r.h};
    struct lum_filter f = {&guide, need, LUM_AIS_SIDE, 1, 1, buffer->raw, false};
    if (which == LUM_EFFECT_INDIRECT_DIFFUSE)
        f = lum_ais_upsampling(pass, &guide);
    if (f.step > 1)
        lum_filter_upsampled(&f, &rect, buffer->smooth);
    else
        lum_filter_box(&f, &rect, buffer->smooth + (size_t)r.y * guide.w + r.x, guide.w);
}

static void filter_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    if (lum_components_enter_filter(pass, LUM_EFFECT_INDIRECT_DIFFUSE, cell))
        return;
    filter(pass, cell, LUM_EFFECT_SOFT_SHADOW, LUM_PIXEL_DIFFUSE);
    filter(pass, cell, LUM_EFFECT_INDIRECT_DIFFUSE, LUM_PIXEL_DIFFUSE);
    filter(pass, cell, LUM_EFFECT_GLOSSY, LUM_PIXEL_GLOSS | LUM_PIXEL_SPECULAR | LUM_PIXEL_SHEET);
    filter(pass, cell, LUM_EFFECT_MEDIA, 0);
}

const struct lum_estimator lum_filter_ais = {
    .name = "ais_filter",
    .stage = LUM_STAGE_FILTER,
    .tile = filter_cell,
    .cells = true,
};
