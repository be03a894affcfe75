/* The first stratum of every fourth pixel; and what is known from before, and what the light would bring. */
#include "core/effect/area_shadow/area_trace.h"

#include <string.h>

#include "core/pass/components.h"
#include "core/light/irradiance.h"

#define GLOSS_ALBEDO 0.1f /* guidance only: what a surface reflects otherwise than diffusely */

/* ---- what is known from before the eye moved ---- */

/* The pixel that saw the same spot when the eye was elsewhere: it lies within a pixel's size of the plane there. */
static uint32_t history_pixel(const struct lum_pass *pass, size_t pixel)
{
    const struct lum_surfaces *s = pass->surfaces;
    uint32_t x, y;
    if (!(s->kind[pixel] & (LUM_PIXEL_DIFFUSE | LUM_PIXEL_GLOSS)) ||
        !lum_eye_pixel(&pass->layers->history_eye, s->p[pixel], &x, &y))
        return LUM_NOWHERE;
    uint32_t from = y * pass->tiling.w + x;
    float off = lum_dot(s->n[pixel], lum_v3_sub(s->history_p[from], s->p[pixel]));
    bool same =
        lum_dot(s->n[pixel], s->history_n[from]) > LUM_SAME_COS && fabsf(off) <= pass->eye.per_pixel * s->depth[pixel];
    return same ? from : LUM_NOWHERE;
}

static void find_previous(const struct lum_pass *pass, struct lum_tile_rect r, uint32_t *ret_from)
{
    for (uint32_t i = 0; i < r.w * r.h; i++)
        ret_from[i] = history_pixel(pass, (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w);
}

/* Takes over what that pixel knew of every other stratum, in turn. So nothing is older than two moves, each of which is
 * off by up to half a pixel. Measured in a pan of cornell by 2.5 pixels a frame, before shares were joined (relMSE,
 * rays): nothing carried on 1.4e-3, 475 thousand; all but one stratum 2.6e-3, 114; all but four 9e-4, 339; half 7e-4,
 * 394. What the pixel knows by itself, after an edit of materials, stays. */
static void reproject(const struct lum_pass *pass, struct lum_area_visibility *area, struct lum_tile_rect r,
                      const uint32_t *from)
{
    uint16_t keep = pass->layers->n_moves % 2 ? 0xaaaau : 0x5555u;
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        if (from[i] == LUM_NOWHERE)
            continue;
        struct lum_visibility was = area->history[from[i]];
        struct lum_visibility *visibility = &area->visibility[(size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w];
        uint16_t traced = was.traced & keep & (uint16_t) ~(visibility->traced | visibility->visible);
        visibility->traced |= traced;
        if (area->left && !(visibility->traced & visibility->visible) && (was.visible & traced))
            area->left[(size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w] = area->history_left[from[i]];
        visibility->visible |= was.visible & traced;
    }
}

/* Drops of what the pixels know what no ray in front of the surface has found out: where a sample lies to the shading
 * normal, and whether the surface lets light through, decided the rest, and may be otherwise now. */
static void reconsider(const struct lum_pass *pass, const struct lum_layer *layer, struct lum_tile_rect r)
{
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w;
        struct lum_visibility *visibility = &layer->area.visibility[pixel];
        uint32_t true_still = 0;
        struct lum_area_view view;
        if (layer->area.left && layer->area.left[pixel]) { /* of which stratum it is was not kept */
            layer->area.left[pixel] = 0;
            *visibility = (struct lum_visibility){0};
        }
        lum_area_look(pass, layer, pixel, &view);
        for (uint32_t left = visibility->traced; left; left &= left - 1) {
            uint32_t k = (uint32_t)__builtin_ctz(left);
            struct lum_light_sample ls;
            if (lum_area_sample(&view, k, &ls) == LUM_AREA_OPEN && lum_dot(ls.wi, pass->surfaces->ng[pixel]) > 0.0f)
                true_still |= 1u << k;
        }
        visibility->traced &= (uint16_t)true_still;
        visibility->visible &= (uint16_t)true_still;
    }
}

/* ---- what the light would bring, were nothing in the way ---- */

/* Pixels that stand for their tile of the pattern. */
struct probes {
    uint32_t n;
    size_t pixel[2 * LUM_AREA_ACROSS * LUM_AREA_ACROSS];
    uint32_t subset[2 * LUM_AREA_ACROSS * LUM_AREA_ACROSS];
    float ratio[2 * LUM_AREA_ACROSS * LUM_AREA_ACROSS]; /* of the mean */
};

static void add_probes(struct probes *p, const struct lum_pass *pass, const struct lum_layer *layer,
                       struct lum_tile_rect t, uint32_t subset)
{
    uint32_t n = t.w > 2 && t.h > 2 ? 2 : 1;
    for (uint32_t i = 0; i < n; i++) {
        size_t pixel = (size_t)(t.y + 2 * i) * pass->tiling.w + t.x + 2 * i;
        if (!lum_area_wants(pass, layer, pixel))
            continue;
        p->pixel[p->n] = pixel;
        p->subset[p->n] = subset;
        p->ratio[p->n++] = 1.0f / (float)n;
    }
}

/* By the pixel's own stratum, where there is no closed form. */
static float sample_unshadowed(const struct lum_pass *pass, const struct lum_layer *layer, size_t pixel)
{
    uint32_t k =
        lum_pattern_subset(LUM_AREA_SIDE, (uint32_t)(pixel % pass->tiling.w), (uint32_t)(pixel / pass->tiling.w));
    struct lum_light_sample ls;
    struct lum_area_view view;
    lum_area_look(pass, layer, pixel, &view);
    if (lum_area_sample(&view, k, &ls) == LUM_AREA_NEEDLESS)
        return 0.0f;
    return lum_luminance(ls.radiance) * fabsf(lum_dot(ls.wi, pass->surfaces->n[pixel])) / ls.pdf_sa;
}

/* The irradiance of each at power 1, or its luminance. */
static void find_irradiance(const struct lum_pass *pass, const struct lum_layer *layer, const struct probes *p,
                            float *ret)
{
    const struct lum_light *light = &pass->layers->unit.lights.lights[layer->index];
    struct lum_vec3 at[LUM_ARRAY_LEN(p->pixel)], n[LUM_ARRAY_LEN(p->pixel)];
    struct lum_irradiance all[LUM_ARRAY_LEN(p->pixel)];
    if (!lum_light_has_irradiance(light)) {
        for (uint32_t i = 0; i < p->n; i++)
            ret[i] = sample_unshadowed(pass, layer, p->pixel[i]);
        return;
    }
    for (uint32_t i = 0; i < p->n; i++)
        at[i] = pass->surfaces->p[p->pixel[i]], n[i] = pass->surfaces->n[p->pixel[i]];
    lum_light_irradiance(light, p->n, at, n, all);
    for (uint32_t i = 0; i < p->n; i++)
        ret[i] = all[i].cosine_integral;
}

/* The mean over two pixels of each tile of the pattern of which it is not known. */
static void estimate_unshadowed(const struct lum_pass *pass, struct lum_layer *layer, struct lum_tile_rect r)
{
    const struct lum_surfaces *s = pass->surfaces;
    struct lum_tiling subsets = lum_area_tiling(pass);
    float *unshadowed = layer->area.unshadowed, white[LUM_ARRAY_LEN(((struct probes *)0)->pixel)];
    struct probes p = {.n = 0};
    for (uint32_t y = r.y / LUM_AREA_SIDE; y * LUM_AREA_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_AREA_SIDE; x * LUM_AREA_SIDE < r.x + r.w; x++) {
            uint32_t subset = y * subsets.nx + x;
            if (unshadowed[subset] != LUM_AREA_UNKNOWN)
                continue;
            unshadowed[subset] = 0.0f;
            add_probes(&p, pass, layer, lum_tile_at(&subsets, subset), subset);
        }
    find_irradiance(pass, layer, &p, white);
    for (uint32_t i = 0; i < p.n; i++) {
        float gloss = s->kind[p.pixel[i]] & LUM_PIXEL_GLOSS ? GLOSS_ALBEDO : 0.0f;
        float diffuse = layer->index == pass->cached_sky ? 0.0f : lum_luminance(s->albedo[p.pixel[i]]);
        unshadowed[p.subset[i]] += white[i] * LUM_INV_PI * (gloss + diffuse) * p.ratio[i];
    }
}

/* ---- asking ---- */

/* Those in which not all is one surface of one kind, where pixels may see other parts of the light than their
 * neighbours do; and those that the border of the picture cuts, which may hold no pixel that is asked first. */
static void find_edges(const struct lum_pass *pass, struct lum_tile_rect r, struct lum_area_subsets *ret_edges)
{
    const uint8_t *kind = pass->surfaces->kind, lit = LUM_PIXEL_DIFFUSE | LUM_PIXEL_GLOSS,
                  kinds = lit | LUM_PIXEL_SPECULAR;
    struct lum_guide guide = lum_components_guide(pass);
    *ret_edges = (struct lum_area_subsets){0};
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        uint32_t x = i % r.w, y = i / r.w, x0 = x - x % LUM_AREA_SIDE, y0 = y - y % LUM_AREA_SIDE;
        size_t pixel = (size_t)(r.y + y) * pass->tiling.w + r.x + x,
               corner = (size_t)(r.y + y0) * pass->tiling.w + r.x + x0;
        bool cut = x0 + LUM_AREA_SIDE > r.w || y0 + LUM_AREA_SIDE > r.h;
        bool alike = pixel == corner || !(kind[pixel] & lit) || lum_guide_same_surface(&guide, pixel, corner);
        ret_edges->in[lum_area_subset_at(x, y)] |= cut || !alike || (kind[pixel] & kinds) != (kind[corner] & kinds);
    }
}

/* What the pixels that are asked first say. Nobody takes their word at edges, nor where none of them sees the light in
 * front of it, though it brings something. True: they say something new. */
static bool sum_first(const struct lum_pass *pass, struct lum_area_visibility *s, struct lum_tile_rect r,
                      const struct lum_area_subsets *edges)
{
    struct lum_tiling subsets = lum_area_tiling(pass);
    uint32_t nx = (r.w + LUM_AREA_SIDE - 1) / LUM_AREA_SIDE, ny = (r.h + LUM_AREA_SIDE - 1) / LUM_AREA_SIDE;
    uint8_t first[LUM_AREA_ACROSS * LUM_AREA_ACROSS];
    bool changed = false;
    for (uint32_t i = 0; i < LUM_AREA_ACROSS * LUM_AREA_ACROSS; i++)
        first[i] = edges->in[i] ? LUM_AREA_LIT | LUM_AREA_DARK : 0;
    for (uint32_t left = s->first_points; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left), dx, dy;
        lum_pattern_pixel(LUM_AREA_SIDE, k, &dx, &dy);
        for (uint32_t y = dy; y < r.h; y += LUM_AREA_SIDE)
            for (uint32_t x = dx; x < r.w; x += LUM_AREA_SIDE) {
                struct lum_visibility visibility = s->visibility[(size_t)(r.y + y) * pass->tiling.w + r.x + x];
                if (visibility.traced >> k & 1)
                    first[lum_area_subset_at(x, y)] |= visibility.visible >> k & 1 ? LUM_AREA_LIT : LUM_AREA_DARK;
            }
    }
    for (uint32_t y = 0; y < ny; y++) {
        size_t at = (size_t)(r.y / LUM_AREA_SIDE + y) * subsets.nx + r.x / LUM_AREA_SIDE;
        for (uint32_t x = 0; x < nx; x++) {
            uint8_t bits = first[y * LUM_AREA_ACROSS + x];
            if (bits == 0 && s->unshadowed[at + x] > 0.0f)
                bits = LUM_AREA_LIT | LUM_AREA_DARK;
            changed |= s->first[at + x] != bits;
            s->first[at + x] = bits;
        }
    }
    return changed;
}

static void trace_cell(const struct lum_pass *pass, uint32_t cell, struct lum_counters *counters)
{
    if (pass->settings->max_depth == 0)
        return;
    struct lum_tile_rect r = lum_tile_at(&pass->cells, cell);
    struct lum_area_batch b;
    uint32_t a = 0, from[LUM_CELL_SIDE * LUM_CELL_SIDE];
    struct lum_area_subsets all, edges;
    bool looked = false;
    memset(all.in, true, sizeof all.in);
    for (struct lum_layer *layer; (layer = lum_area_next(pass, &a));) {
        if (layer->area.begun[cell] == LUM_AREA_BEGUN)
            continue;
        lum_area_begin(&b, pass, layer, counters);
        if (!looked)
            find_edges(pass, r, &edges);
        if (pass->layers->reprojected && !looked)
            find_previous(pass, r, from);
        looked = true;
        if (layer->area.begun[cell] == LUM_AREA_DOUBTED)
            reconsider(pass, layer, r);
        if (pass->layers->reprojected)
            reproject(pass, &layer->area, r, from);
        lum_area_trace_batch(&b, r, lum_area_first_points(pass, layer), &all);
        estimate_unshadowed(pass, layer, r);
        layer->area.begun[cell] = LUM_AREA_BEGUN;
        layer->area.asked[cell] = pass->layers->n_passes;
        if (sum_first(pass, &layer->area, r, &edges))
            layer->area.changed[cell] = pass->layers->n_passes;
    }
}

const struct lum_estimator lum_estimator_area_shadow = {
    .name = "area shadow",
    .stage = LUM_STAGE_SHADOW,
    .tile = trace_cell,
    .cells = true,
    .layering = LUM_LAYERING_AREA,
    .surfaces = true,
    .then = &lum_area_fill,
};
