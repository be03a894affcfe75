#include "core/pass/pass.h"

#define NOWHERE ((struct lum_bounds){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}})

void lum_swept_finish(struct lum_swept *swept)
{
    lum_snapshot_unref(swept->snapshot);
    lum_free(swept->seen);
    lum_free(swept->background);
    lum_free(swept->changed);
    lum_free(swept->in_sight);
    *swept = (struct lum_swept){0};
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
static bool find_motion(struct lum_swept *swept, const struct lum_pass *pass, const struct lum_surfaces *surfaces)
{
    const struct lum_snapshot *before = swept->snapshot, *now = pass->snapshot;
    if (!before || before->versions.geometry == now->versions.geometry || !surfaces || !surfaces->p ||
        surfaces->stamp != swept->stamp || pass->gbuffer->stamp != swept->stamp ||
        !same_to_camera(&before->lights, &now->lights))
        return false;
    lum_motion_between(before, now, &swept->motion);
    return lum_motion_keeps_numbers(&swept->motion);
}

static bool reserve(struct lum_swept *swept, const struct lum_pass *pass)
{
    struct lum_tiling squares = lum_tiling_make(pass->tiling.w, pass->tiling.h, LUM_SWEPT_SIDE);
    if (!swept->seen)
        swept->seen = lum_calloc(squares.n, sizeof *swept->seen);
    if (!swept->background)
        swept->background = lum_calloc(squares.n, 1);
    if (!swept->changed)
        swept->changed = lum_calloc(squares.n, 1);
    if (!swept->in_sight)
        swept->in_sight = lum_calloc(pass->tiling.n, 1);
    swept->squares = squares;
    return swept->seen && swept->background && swept->changed && swept->in_sight;
}

/* No box of what moved is further from the eye. */
static float reach_of(const struct lum_motion *motion, struct lum_vec3 eye)
{
    float reach = 0.0f;
    for (uint32_t i = 0; i < motion->n; i++) {
        const struct lum_mover *m = &motion->movers[i];
        const struct lum_vec3 corners[4] = {m->old_lo, m->old_hi, m->new_lo, m->new_hi};
        for (int k = 0; k < 4; k++) {
            struct lum_vec3 d = lum_v3_sub(corners[k], eye);
            reach = lum_max(reach, fabsf(d.x) + fabsf(d.y) + fabsf(d.z));
        }
    }
    return 2.0f * reach; /* corners that are no diagonal's: at most the sum of both */
}

static void look_at_square(struct lum_swept *swept, const struct lum_pass *pass, const struct lum_surfaces *surfaces,
                           uint32_t square)
{
    struct lum_tile_rect r = lum_tile_at(&swept->squares, square);
    struct lum_bounds seen = NOWHERE;
    swept->background[square] = 0;
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        size_t pixel = (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w;
        if (surfaces->object[pixel] != LUM_NO_OBJECT)
            lum_bounds_grow(&seen, surfaces->p[pixel]);
        else
            swept->background[square] = 1;
    }
    swept->seen[square] = seen;
}

static bool may_change(const struct lum_swept *swept, const struct lum_pass *pass, uint32_t square, float reach)
{
    struct lum_tile_rect r = lum_tile_at(&swept->squares, square);
    struct lum_bounds eye = {pass->eye.o, pass->eye.o}, ends = swept->seen[square];
    for (uint32_t i = 0; swept->background[square] && i < r.w * r.h; i++) /* before a surface it is too far: no harm */
        lum_bounds_grow(&ends,
                        lum_v3_mad(pass->eye.o, lum_center_direction(pass, r.x + i % r.w, r.y + i / r.w), reach));
    return lum_motion_meets_between(&swept->motion, &eye, &ends);
}

static void find_square(struct lum_swept *swept, const struct lum_pass *pass, const struct lum_surfaces *surfaces,
                        uint32_t square, float reach)
{
    if (swept->seen_stamp != surfaces->stamp || swept->changed[square])
        look_at_square(swept, pass, surfaces, square);
    swept->changed[square] = may_change(swept, pass, square, reach) ? LUM_SWEPT_MAYBE : LUM_SWEPT_SAME;
}

static void find_tile(struct lum_swept *swept, const struct lum_pass *pass, uint32_t tile, float reach)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_bounds eye = {pass->eye.o, pass->eye.o}, ends = NOWHERE;
    for (uint32_t k = 0; k < 4; k++) {
        float x = k % 2 ? (float)(r.x + r.w) + 1.0f : (float)r.x - 1.0f;
        float y = k / 2 ? (float)(r.y + r.h) + 1.0f : (float)r.y - 1.0f;
        lum_bounds_grow(&ends, lum_v3_mad(pass->eye.o, lum_eye_on_plane(&pass->eye, x, y), reach));
    }
    swept->in_sight[tile] = lum_motion_meets_between(&swept->motion, &eye, &ends);
}

static void find_squares(struct lum_swept *swept, const struct lum_pass *pass, const struct lum_surfaces *surfaces,
                         uint32_t tile, float reach)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    for (uint32_t y = r.y / LUM_SWEPT_SIDE; y * LUM_SWEPT_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_SWEPT_SIDE; x * LUM_SWEPT_SIDE < r.x + r.w; x++) {
            if (surfaces->done[tile])
                find_square(swept, pass, surfaces, y * swept->squares.nx + x, reach);
            else /* a pass was cancelled: the surfaces there are older yet */
                swept->changed[y * swept->squares.nx + x] = LUM_SWEPT_CHANGED;
        }
}

void lum_swept_update(struct lum_swept *swept, const struct lum_pass *pass, const struct lum_surfaces *surfaces)
{
    swept->known = find_motion(swept, pass, surfaces) && reserve(swept, pass);
    float reach = swept->known ? reach_of(&swept->motion, pass->eye.o) : 0.0f;
    for (uint32_t t = 0; swept->known && t < pass->tiling.n; t++) {
        find_tile(swept, pass, t, reach);
        find_squares(swept, pass, surfaces, t, reach);
    }
    if (swept->known)
        swept->seen_stamp = surfaces->stamp;
    lum_snapshot_ref(pass->snapshot);
    lum_snapshot_unref(swept->snapshot);
    swept->snapshot = pass->snapshot;
}

/* margin: squares around the tile that count, too. */
static bool any_changed(const struct lum_swept *swept, const struct lum_tiling *tiling, uint32_t tile, uint32_t margin)
{
    struct lum_tile_rect r = lum_tile_at(tiling, tile);
    uint32_t x0 = r.x / LUM_SWEPT_SIDE, y0 = r.y / LUM_SWEPT_SIDE;
    uint32_t x1 = (r.x + r.w - 1) / LUM_SWEPT_SIDE + margin, y1 = (r.y + r.h - 1) / LUM_SWEPT_SIDE + margin;
    for (uint32_t y = y0 > margin ? y0 - margin : 0; y <= y1 && y < swept->squares.ny; y++)
        for (uint32_t x = x0 > margin ? x0 - margin : 0; x <= x1 && x < swept->squares.nx; x++)
            if (swept->changed[y * swept->squares.nx + x])
                return true;
    return false;
}

bool lum_swept_tile(const struct lum_swept *swept, const struct lum_tiling *tiling, uint32_t tile)
{
    return any_changed(swept, tiling, tile, 0);
}

bool lum_swept_around_tile(const struct lum_swept *swept, const struct lum_tiling *tiling, uint32_t tile)
{
    return any_changed(swept, tiling, tile, 1);
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

void lum_swept_compare(struct lum_swept *swept, const struct lum_tiling *tiling, uint32_t tile,
                       const struct lum_hits *before, const struct lum_hits *now)
{
    struct lum_tile_rect r = lum_tile_at(tiling, tile);
    for (uint32_t i = 0; i < r.w * r.h; i++) {
        uint32_t x = (r.x + i % r.w) / LUM_SWEPT_SIDE, y = (r.y + i / r.w) / LUM_SWEPT_SIDE;
        uint8_t *changed = &swept->changed[y * swept->squares.nx + x];
        bool moved =
            *changed == LUM_SWEPT_MAYBE && now->object[i] != LUM_NO_OBJECT && is_mover(&swept->motion, now->object[i]);
        if (moved || !same_hit(before, now, i))
            *changed = LUM_SWEPT_CHANGED;
    }
    for (uint32_t y = r.y / LUM_SWEPT_SIDE; y * LUM_SWEPT_SIDE < r.y + r.h; y++)
        for (uint32_t x = r.x / LUM_SWEPT_SIDE; x * LUM_SWEPT_SIDE < r.x + r.w; x++)
            if (swept->changed[y * swept->squares.nx + x] == LUM_SWEPT_MAYBE)
                swept->changed[y * swept->squares.nx + x] = LUM_SWEPT_SAME;
}
_Static_assert(LUM_TILE_SIDE % LUM_SWEPT_SIDE == 0, "squares lie within tiles");
