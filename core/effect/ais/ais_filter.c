/* The second half of the thesis' frame (5.2.4): after a barrier, cells are filtered.
 *
 * AIS filters component by component and IGI the sum of direct and indirect light. The thesis holds the first to be
 * smoother; the filter being linear, and the same for both, it makes no difference to the picture.
 *
 * Of a method that has estimators of others, too, their buffers are left alone. */
#include "core/effect/ais/ais.h"

static bool is_ours(const struct lum_pass *pass, enum lum_effect effect)
{
    const struct lum_estimator *e = lum_method_serves(pass->settings->method, effect);
    return e && e->smoothed_by == &lum_filter_ais;
}

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

/* Textures of sheets stay sharp: what was filtered is light on their far side. */
static void color_far_sides(const struct lum_pass *pass, uint32_t cell)
{
    struct lum_rgb *smooth = pass->components->buffer[LUM_EFFECT_TRANSMISSION].smooth;
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    for (uint32_t y = r.y; smooth && y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++) {
            size_t pixel = (size_t)y * pass->tiling.w + x;
            if (pass->surfaces->kind[pixel] & LUM_PIXEL_SHEET)
                smooth[pixel] = lum_rgb_mul(smooth[pixel], lum_surfaces_far_albedo(pass, x, y));
        }
}

static void filter_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    (void)counters;
    if (lum_components_enter_filter(pass, LUM_EFFECT_INDIRECT_DIFFUSE, cell))
        return;
    bool indirect = is_ours(pass, LUM_EFFECT_INDIRECT_DIFFUSE); /* igi has it among soft shadows */
    if (indirect || is_ours(pass, LUM_EFFECT_SOFT_SHADOW))
        filter(pass, cell, LUM_EFFECT_SOFT_SHADOW, LUM_PIXEL_DIFFUSE);
    if (is_ours(pass, LUM_EFFECT_GLOSSY))
        filter(pass, cell, LUM_EFFECT_GLOSSY, LUM_PIXEL_GLOSS | LUM_PIXEL_SPECULAR);
    if (is_ours(pass, LUM_EFFECT_MEDIA))
        filter(pass, cell, LUM_EFFECT_MEDIA, 0);
    if (!indirect)
        return;
    filter(pass, cell, LUM_EFFECT_INDIRECT_DIFFUSE, LUM_PIXEL_DIFFUSE);
    filter(pass, cell, LUM_EFFECT_TRANSMISSION, LUM_PIXEL_SHEET);
    color_far_sides(pass, cell);
}

const struct lum_estimator lum_filter_ais = {
    .name = "ais_filter",
    .stage = LUM_STAGE_FILTER,
    .tile = filter_cell,
    .cells = true,
};
