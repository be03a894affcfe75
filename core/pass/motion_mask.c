#include "core/pass/pass.h"

void lum_motion_mask_finish(struct lum_motion_mask *motion_mask)
{
    lum_snapshot_unref(motion_mask->snapshot);
    lum_free(motion_mask->seen);
    lum_free(motion_mask->background);
    lum_free(motion_mask->changed);
    lum_free(motion_mask->in_sight);
    *motion_mask = (struct lum_motion_mask){0};
}

/* What the camera alone sees does not count as motion. */
static bool same_to_camera(const struct lum_light_table *a, const struct lum_light_table *b)
{
    if (a->n_lights != b->n_lights)
        return false;
    for (uint32_t i = 0; i < a->n_lights; i++)
        if (a->lights[i].camera_visible != b->lights[i].camera_visible || a->lights[i].shape != b->lights[i].shape)
            return false;
    return true;
}

/* The motion says all that rays may find changed since the picture that both the surfaces and the G-buffer show. */
static bool find_motion(struct lum_motion_mask *motion_mask, const struct lum_pass *pass,
                        const struct lum_surfaces *surfaces)
{
    const struct lum_snapshot *before = motion_mask->snapshot, *now = pass->snapshot;
    if (!before || before->versions.geometry == now->versions.geometry || !surfaces || !surfaces->p ||
        surfaces->stamp != motion_mask->stamp || pass->gbuffer->stamp != motion_mask->stamp ||
        !same_to_camera(&before->lights, &now->lights))
        return false;
    lum_motion_between(before, now, &motion_mask->motion);
    return lum_motion_keeps_numbers(&motion_mask->motion);
}

static bool reserve(struct lum_motion_mask *motion_mask, const struct lum_pass *pass)
{
    struct lum_tiling blocks = lum_tiling_make(pass->tiling.w, pass->tiling.h, LUM_MOTION_BLOCK_SIDE);
    if (!motion_mask->seen)
        motion_mask->seen = lum_calloc(blocks.n, sizeof *motion_mask->seen);
    if (!motion_mask->background)
        motion_mask->background = lum_calloc(blocks.n, 1);
    if (!motion_mask->changed)
        motion_mask->changed = lum_calloc(blocks.n, 1);
    if (!motion_mask->in_sight)
        motion_mask->in_sight = lum_calloc(pass->tiling.n, 1);
    motion_mask->blocks = blocks;
    return motion_mask->seen && motion_mask->background && motion_mask->changed && motion_mask->in_sight;
}

/* No box of what moved is further from the eye. */
static float reach_of(const struct lum_motion *motion, struct lum_vec3 eye)
{
    float reach = 0.0f;
    for (uint32_t i = 0; i < motion->n; i++) {
        const struct lum_mover *m = &motion->movers[i];
        const struct lum_vec3 corners[4] = {m->old_box.lo, m->old_box.hi, m->new_box.lo, m->new_box.hi};
        for (int k = 0; k < 4; k++) {
            struct lum_vec3 d = lum_v3_sub(corners[k], eye);
            reach = lum_max(reach, fabsf(d.x) + fabsf(d.y) + fabsf(d.z));
        }
    }
    return 2.0f * reach; /* corners that are no diagonal's: at most the sum of both */
}

static void look_at_block(struct lum_motion_mask *motion_mask, const struct lum_pass *pass,
                          const struct lum_surfaces *surfaces, uint32_t block)
{
    struct lum_tile_rect r = lum_tile_at(&motion_mask->blocks, block);
    struct lum_bounds seen = LUM_BOUNDS_EMPTY;
    motion_mask->background[block] = 0;
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w;
        if (surfaces->object[pixel] != LUM_NO_OBJECT)
            lum_bounds_grow(&seen, surfaces->p[pixel]);
        else
            motion_mask->background[block] = 1;
    }
    motion_mask->seen[block] = seen;
}

static bool may_change(const struct lum_motion_mask *motion_mask, const struct lum_pass *pass, uint32_t block,
                       float reach)
{
    struct lum_tile_rect r = lum_tile_at(&motion_mask->blocks, block);
    struct lum_bounds eye = {pass->eye.o, pass->eye.o}, ends = motion_mask->seen[block];
    for (uint32_t i = 0; motion_mask->background[block] && i < r.w * r.h;
         i++) /* before a surface it is too far: no harm */
        lum_bounds_grow(&ends,
                        lum_v3_mad(pass->eye.o, lum_center_direction(pass, r.x + i % r.w, r.y + i / r.w), reach));
    return lum_motion_meets_between(&motion_mask->motion, &eye, &ends);
}

static void find_block(struct lum_motion_mask *motion_mask, const struct lum_pass *pass,
                       const struct lum_surfaces *surfaces, uint32_t block, float reach)
{
    if (motion_mask->seen_stamp != surfaces->stamp || motion_mask->changed[block])
        look_at_block(motion_mask, pass, surfaces, block);
    motion_mask->changed[block] = may_change(motion_mask, pass, block, reach) ? LUM_MOTION_MAYBE : LUM_MOTION_SAME;
}

static void find_tile(struct lum_motion_mask *motion_mask, const struct lum_pass *pass, uint32_t tile, float reach)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_bounds eye = {pass->eye.o, pass->eye.o}, ends = LUM_BOUNDS_EMPTY;
    for (uint32_t k = 0; k < 4; k++) {
        float x = k % 2 ? (float)(r.x + r.w) + 1.0f : (float)r.x - 1.0f;
        float y = k / 2 ? (float)(r.y + r.h) + 1.0f : (float)r.y - 1.0f;
        lum_bounds_grow(&ends, lum_v3_mad(pass->eye.o, lum_eye_on_plane(&pass->eye, x, y), reach));
    }
    /* a tile of a panorama has no corners between which all that it sees lies */
    motion_mask->in_sight[tile] = pass->eye.panorama || lum_motion_meets_between(&motion_mask->motion, &eye, &ends);
}

static void find_blocks(struct lum_motion_mask *motion_mask, const struct lum_pass *pass,
                        const struct lum_surfaces *surfaces, uint32_t tile, float reach)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    for (uint32_t y = r.y / LUM_MOTION_BLOCK_SIDE; y * LUM_MOTION_BLOCK_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_MOTION_BLOCK_SIDE; x * LUM_MOTION_BLOCK_SIDE < r.x + r.w; x++) {
            if (lum_memo_step(&surfaces->made, tile))
                find_block(motion_mask, pass, surfaces, y * motion_mask->blocks.nx + x, reach);
            else /* a pass was cancelled: the surfaces there are older yet */
                motion_mask->changed[y * motion_mask->blocks.nx + x] = LUM_MOTION_CHANGED;
        }
}

void lum_motion_mask_update(struct lum_motion_mask *motion_mask, const struct lum_pass *pass,
                            const struct lum_surfaces *surfaces)
{
    motion_mask->known = find_motion(motion_mask, pass, surfaces) && reserve(motion_mask, pass);
    float reach = motion_mask->known ? reach_of(&motion_mask->motion, pass->eye.o) : 0.0f;
    for (uint32_t t = 0; motion_mask->known && t < pass->tiling.n; t++) {
        find_tile(motion_mask, pass, t, reach);
        find_blocks(motion_mask, pass, surfaces, t, reach);
    }
    if (motion_mask->known)
        motion_mask->seen_stamp = surfaces->stamp;
    lum_snapshot_ref(pass->snapshot);
    lum_snapshot_unref(motion_mask->snapshot);
    motion_mask->snapshot = pass->snapshot;
}

/* margin: blocks around the tile that count, too. */
static bool any_changed(const struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling, uint32_t tile,
                        uint32_t margin)
{
    struct lum_tile_rect r = lum_tile_at(tiling, tile);
    uint32_t x0 = r.x / LUM_MOTION_BLOCK_SIDE, y0 = r.y / LUM_MOTION_BLOCK_SIDE;
    uint32_t x1 = (r.x + r.w - 1) / LUM_MOTION_BLOCK_SIDE + margin,
             y1 = (r.y + r.h - 1) / LUM_MOTION_BLOCK_SIDE + margin;
    for (uint32_t y = y0 > margin ? y0 - margin : 0; y <= y1 && y < motion_mask->blocks.ny; y++)
        for (uint32_t x = x0 > margin ? x0 - margin : 0; x <= x1 && x < motion_mask->blocks.nx; x++)
            if (motion_mask->changed[y * motion_mask->blocks.nx + x])
                return true;
    return false;
}

bool lum_motion_mask_tile(const struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling, uint32_t tile)
{
    return any_changed(motion_mask, tiling, tile, 0);
}

bool lum_motion_mask_around_tile(const struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling,
                                 uint32_t tile)
{
    return any_changed(motion_mask, tiling, tile, 1);
}

/* Box around the surface points that the eye saw in a tile. False: there were none. */
static bool tile_seen(const struct lum_motion_mask *motion_mask, const struct lum_tile_rect *r,
                      struct lum_bounds *ret_box)
{
    *ret_box = LUM_BOUNDS_EMPTY;
    for (uint32_t y = r->y; y < r->y + r->h; y += LUM_MOTION_BLOCK_SIDE)
        for (uint32_t x = r->x; x < r->x + r->w; x += LUM_MOTION_BLOCK_SIDE) {
            uint32_t block = y / LUM_MOTION_BLOCK_SIDE * motion_mask->blocks.nx + x / LUM_MOTION_BLOCK_SIDE;
            const struct lum_bounds *seen = &motion_mask->seen[block];
            *ret_box = lum_bounds_join(ret_box, seen);
        }
    return !lum_bounds_empty(ret_box);
}

bool lum_motion_mask_between(const struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling, uint32_t tile,
                             const struct lum_bounds *light)
{
    struct lum_tile_rect r = lum_tile_at(tiling, tile);
    struct lum_bounds seen;
    return lum_motion_mask_around_tile(motion_mask, tiling, tile) ||
           (tile_seen(motion_mask, &r, &seen) && lum_motion_meets_between(&motion_mask->motion, &seen, light));
}

/* Boxes meet where the latter is three times as large each way. */
static bool is_near(const struct lum_bounds *a, const struct lum_bounds *b)
{
    struct lum_vec3 lo = b->lo, hi = b->hi, by = lum_v3_sub(hi, lo);
    return lo.x <= hi.x && a->lo.x <= hi.x + by.x && a->hi.x >= lo.x - by.x && a->lo.y <= hi.y + by.y &&
           a->hi.y >= lo.y - by.y && a->lo.z <= hi.z + by.z && a->hi.z >= lo.z - by.z;
}

bool lum_motion_mask_near_tile(const struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling,
                               uint32_t tile)
{
    struct lum_tile_rect r = lum_tile_at(tiling, tile);
    struct lum_bounds seen;
    if (lum_motion_mask_around_tile(motion_mask, tiling, tile))
        return true;
    if (!tile_seen(motion_mask, &r, &seen))
        return false;
    for (uint32_t i = 0; i < motion_mask->motion.n; i++) {
        const struct lum_mover *m = &motion_mask->motion.movers[i];
        if (is_near(&seen, &m->old_box) || is_near(&seen, &m->new_box))
            return true;
    }
    return false;
}

bool lum_motion_mask_light(const struct lum_motion_mask *motion_mask, const struct lum_light *light,
                           struct lum_bounds *ret_bounds)
{
    return lum_light_bounds(motion_mask->snapshot, light, ret_bounds) &&
           !(light->kind == &lum_emitter_mesh && lum_motion_moves(&motion_mask->motion, light->instance, ret_bounds));
}

static bool same_hit(const struct lum_hits *a, const struct lum_hits *b, uint32_t i)
{
    return a->object[i] == b->object[i] &&
           (a->object[i] == LUM_NO_OBJECT ||
            (a->prim[i] == b->prim[i] && a->t[i] == b->t[i] && a->u[i] == b->u[i] && a->v[i] == b->v[i]));
}

/* Objects that were merged may all have moved. */
static bool is_mover(const struct lum_motion *motion, uint32_t object)
{
    for (uint32_t m = 0; m < motion->n; m++)
        if (motion->movers[m].n_objects > 1 || motion->movers[m].now == object)
            return true;
    return false;
}

void lum_motion_mask_compare(struct lum_motion_mask *motion_mask, const struct lum_tiling *tiling, uint32_t tile,
                             const struct lum_hits *before, const struct lum_hits *now)
{
    struct lum_tile_rect r = lum_tile_at(tiling, tile);
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        uint32_t x = (r.x + i % r.w) / LUM_MOTION_BLOCK_SIDE, y = (r.y + i / r.w) / LUM_MOTION_BLOCK_SIDE;
        uint8_t *changed = &motion_mask->changed[y * motion_mask->blocks.nx + x];
        bool moved = *changed == LUM_MOTION_MAYBE && now->object[i] != LUM_NO_OBJECT &&
                     is_mover(&motion_mask->motion, now->object[i]);
        if (moved || !same_hit(before, now, i))
            *changed = LUM_MOTION_CHANGED;
    }
    for (uint32_t y = r.y / LUM_MOTION_BLOCK_SIDE; y * LUM_MOTION_BLOCK_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_MOTION_BLOCK_SIDE; x * LUM_MOTION_BLOCK_SIDE < r.x + r.w; x++)
            if (motion_mask->changed[y * motion_mask->blocks.nx + x] == LUM_MOTION_MAYBE)
                motion_mask->changed[y * motion_mask->blocks.nx + x] = LUM_MOTION_SAME;
}
_Static_assert(LUM_TILE_SIDE % LUM_MOTION_BLOCK_SIDE == 0, "blocks lie within tiles");
