#include "core/material/bsdf.h"
#include "core/pass/pass.h"
#include "core/scene/surface.h"

void lum_surfaces_finish(struct lum_surfaces *s)
{
    lum_arena_finish(&s->arena);
    lum_memo_finish(&s->made);
    *s = (struct lum_surfaces){.version = s->version};
}

static void lay_out(struct lum_surfaces *s, size_t n)
{
    s->p = lum_arena_take(&s->arena, n, sizeof *s->p);
    s->n = lum_arena_take(&s->arena, n, sizeof *s->n);
    s->ng = lum_arena_take(&s->arena, n, sizeof *s->ng);
    s->albedo = lum_arena_take(&s->arena, n, sizeof *s->albedo);
    s->depth = lum_arena_take(&s->arena, n, sizeof *s->depth);
    s->kind = lum_arena_take(&s->arena, n, 1);
    s->object = lum_arena_take(&s->arena, n, sizeof *s->object);
    s->history_p = lum_arena_take(&s->arena, n, sizeof *s->history_p);
    s->history_n = lum_arena_take(&s->arena, n, sizeof *s->history_n);
}

static bool reserve(struct lum_surfaces *s, const struct lum_pass *pass)
{
    size_t n = (size_t)pass->tiling.w * pass->tiling.h;
    if (!s->arena.memory) {
        lay_out(s, n);
        if (!lum_arena_reserve(&s->arena))
            return false;
        lay_out(s, n);
    }
    return lum_memo_reserve(&s->made, pass->tiling.n);
}

/* The eye has moved: what it saw becomes what it saw before. */
static void step_back(struct lum_surfaces *s)
{
    struct lum_vec3 *p = s->p, *normal = s->n;
    s->p = s->history_p;
    s->n = s->history_n;
    s->history_p = p;
    s->history_n = normal;
}

/* Which objects shine, as a hash (FNV-1a by words). */
static uint64_t find_shining(const struct lum_snapshot *s)
{
    uint64_t hash = 0xcbf29ce484222325u;
    for (uint32_t i = 0; i < s->n_instances; i++)
        if (s->instances[i].light != LUM_NO_OBJECT)
            hash = (hash ^ i) * 0x100000001b3u;
    return hash;
}

/* Of a lamp that moves surfaces know its body, which is geometry, and which objects are lamps. */
static uint32_t renew(struct lum_surfaces *s, const struct lum_pass *pass)
{
    uint32_t edits = lum_basis_renew(&s->basis, pass);
    uint64_t shining = find_shining(pass->snapshot);
    if (shining == s->shining)
        edits &= ~LUM_EDIT_BIT(LUM_EDIT_LIGHT_SHAPE);
    s->shining = shining;
    return edits;
}

enum lum_status lum_surfaces_update(struct lum_surfaces *s, const struct lum_pass *pass, struct lum_error *err)
{
    uint64_t stamp = pass->gbuffer->stamp;
    uint32_t edits = renew(s, pass);
    if (s->stamp == stamp && !lum_is_stale(edits, LUM_PRODUCT_SURFACES))
        return LUM_OK;
    if (!reserve(s, pass)) {
        lum_surfaces_finish(s);
        return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for the surfaces of %u x %u pixels", pass->tiling.w,
                        pass->tiling.h);
    }
    if (s->stamp != stamp && pass->settings->reproject_shadows)
        step_back(s);
    bool moved_only =
        s->stamp == stamp && !lum_is_stale(edits & ~LUM_EDIT_BIT(LUM_EDIT_GEOMETRY), LUM_PRODUCT_SURFACES);
    bool partly = moved_only && lum_motion_mask_is_known(pass->motion_mask);
    for (uint32_t t = 0; t < pass->tiling.n; t++)
        if (!partly || lum_motion_mask_tile(pass->motion_mask, &pass->tiling, t))
            lum_memo_set(&s->made, t, 0);
    s->stamp = stamp;
    s->version++;
    return LUM_OK;
}

static void set_background(const struct lum_pass *pass, size_t at)
{
    struct lum_surfaces *s = pass->surfaces;
    s->p[at] = s->n[at] = s->ng[at] = lum_v3(0.0f, 0.0f, 0.0f);
    s->albedo[at] = lum_grey(0.0f);
    s->depth[at] = INFINITY;
    s->kind[at] = pass->settings->illuminance ? 0 : LUM_PIXEL_SHINES; /* or may: skies are switched on and off */
    s->object[at] = LUM_NO_OBJECT;
}

/* at: index in the picture; i: in the tile's batch. */
static void fill_pixel(const struct lum_pass *pass, const struct lum_hits *hits, uint32_t i, struct lum_vec3 d,
                       size_t at)
{
    struct lum_surfaces *s = pass->surfaces;
    set_background(pass, at);
    if (hits->object[i] == LUM_NO_OBJECT)
        return;
    struct lum_surface surface;
    lum_snapshot_surface(pass->snapshot, hits, i, d, &surface);
    s->object[at] = hits->object[i];
    s->p[at] = surface.p;
    s->n[at] = surface.ns;
    s->ng[at] = surface.ng;
    s->depth[at] = hits->t[i];
    if (surface.instance == LUM_NO_OBJECT) {
        s->kind[at] = surface.white ? 0 : LUM_PIXEL_SHINES;
        return;
    }
    const struct lum_material *m = &pass->snapshot->materials[surface.material];
    struct lum_bsdf b;
    lum_bsdf_init(&b, m, &surface, lum_v3_neg(d));
    s->n[at] = b.frame.n;
    s->albedo[at] = lum_bsdf_diffuse_albedo(&b);
    bool diffuse = !lum_rgb_black(s->albedo[at]);
    bool gloss = (b.alpha > 0.0f && (!lum_rgb_black(b.f0) || b.f90 > 0.0f || b.glass > 0.0f)) ||
                 lum_clearcoat_is_gloss(&b) || b.sheen.share > 0.0f;
    bool specular = !surface.white && lum_material_is_specular(m);
    bool sheet = !lum_rgb_black(b.through);
    bool shines = !surface.white && (surface.light != LUM_NO_OBJECT || m->unlit);
    s->kind[at] =
        (uint8_t)((diffuse || gloss || specular || sheet ? LUM_PIXEL_SURFACE : 0) | (diffuse ? LUM_PIXEL_DIFFUSE : 0) |
                  (gloss ? LUM_PIXEL_GLOSS : 0) | (specular ? LUM_PIXEL_SPECULAR : 0) | (sheet ? LUM_PIXEL_SHEET : 0) |
                  (shines ? LUM_PIXEL_SHINES : 0));
}

struct lum_rgb lum_surfaces_far_albedo(const struct lum_pass *pass, uint32_t x, uint32_t y)
{
    uint32_t tile = y / LUM_TILE_SIDE * pass->tiling.nx + x / LUM_TILE_SIDE;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_vec3 d = lum_center_direction(pass, x, y);
    struct lum_surface s;
    struct lum_bsdf b;
    lum_snapshot_surface(pass->snapshot, &pass->gbuffer->tiles[tile], (y - r.y) * r.w + x - r.x, d, &s);
    lum_bsdf_init(&b, &pass->snapshot->materials[s.material], &s, lum_v3_neg(d));
    b = lum_bsdf_far_side(&b);
    return lum_bsdf_diffuse_albedo(&b);
}

static void surfaces_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    (void)counters;
    if (lum_memo_step(&pass->surfaces->made, tile))
        return;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_rays rays;
    lum_tile_center_rays(pass, tile, &rays);
    for (uint32_t i = 0; i < rays.n; i++) {
        lum_snapshot_ask_ahead(pass->snapshot, &pass->gbuffer->tiles[tile], i, rays.n);
        fill_pixel(pass, &pass->gbuffer->tiles[tile], i, lum_rays_direction(&rays, i),
                   (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w);
    }
    lum_memo_set(&pass->surfaces->made, tile, 1);
}

struct lum_rgb lum_pass_transmittance(const struct lum_pass *pass, size_t pixel)
{
    float x = (float)(pixel % pass->tiling.w) + 0.5f, y = (float)(pixel / pass->tiling.w) + 0.5f;
    struct lum_vec3 d = lum_eye_direction(&pass->eye, x, y);
    return lum_media_transmittance(pass->snapshot, pass->eye.o, d, pass->surfaces->depth[pixel]);
}

struct lum_rgb lum_surfaces_shine(const struct lum_snapshot *s, const struct lum_gbuffer *gbuffer,
                                  const struct lum_tiling *tiling, const struct lum_eye *eye, uint32_t x, uint32_t y,
                                  uint32_t *ret_light)
{
    uint32_t tile = y / tiling->side * tiling->nx + x / tiling->side;
    struct lum_tile_rect r = lum_tile_at(tiling, tile);
    const struct lum_hits *hits = &gbuffer->tiles[tile];
    uint32_t slot = (y - r.y) * r.w + x - r.x;
    struct lum_vec3 d = lum_eye_direction(eye, (float)x + 0.5f, (float)y + 0.5f);
    *ret_light = s->lights.environment;
    if (hits->object[slot] == LUM_NO_OBJECT)
        return lum_lights_background(&s->lights, d, true);
    struct lum_surface surface;
    lum_snapshot_surface(s, hits, slot, d, &surface);
    *ret_light = surface.light;
    if (surface.instance == LUM_NO_OBJECT)
        return surface.emission;
    struct lum_bsdf bsdf;
    lum_bsdf_init(&bsdf, &s->materials[surface.material], &surface, lum_v3_neg(d));
    return bsdf.emission;
}

const struct lum_estimator lum_stage_surfaces = {
    .name = "surfaces", .stage = LUM_STAGE_SURFACES, .tile = surfaces_tile};
