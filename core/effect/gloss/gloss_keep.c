/* Gloss: what is kept from pass to pass. */
#include <string.h>

#include "core/effect/gloss/gloss.h"

static void finish(void *state)
{
    struct lum_gloss *g = state;
    for (uint32_t t = 0; t < g->n_tiles; t++) {
        lum_free(g->tiles[t].gains);
        lum_free(g->tiles[t].segments);
    }
    lum_free(g->tiles);
    lum_free(g->lit);
    lum_arena_finish(&g->pixels.arena);
    *g = (struct lum_gloss){0};
}

static void lay_out(struct lum_gloss_pixels *p, size_t n)
{
    p->light = lum_arena_take(&p->arena, n, sizeof *p->light);
    p->albedo = lum_arena_take(&p->arena, n, sizeof *p->albedo);
    p->hit = lum_arena_take(&p->arena, n, sizeof *p->hit);
    p->mean = lum_arena_take(&p->arena, n, sizeof *p->mean);
    p->reach = lum_arena_take(&p->arena, n, sizeof *p->reach);
}

static bool reserve_pixels(struct lum_gloss_pixels *p, size_t n)
{
    if (p->arena.memory)
        return true;
    lay_out(p, n);
    if (!lum_arena_reserve(&p->arena))
        return false;
    lay_out(p, n);
    return true;
}

static bool reserve(void *state, const struct lum_pass *pass)
{
    struct lum_gloss *g = state;
    uint32_t n_lights = pass->snapshot->lights.n_lights;
    if (!reserve_pixels(&g->pixels, (size_t)pass->tiling.w * pass->tiling.h))
        return false;
    if (!g->tiles && !(g->tiles = lum_calloc(pass->tiling.n, sizeof *g->tiles)))
        return false;
    g->n_tiles = pass->tiling.n;
    if (g->n_lit >= n_lights)
        return true;
    lum_free(g->lit);
    g->lit = lum_calloc(n_lights, 1);
    g->n_lit = g->lit ? n_lights : 0;
    return g->lit;
}

/* Something moved since the pass before. */
static void move(struct lum_gloss *g)
{
    for (uint32_t t = 0; t < g->n_tiles; t++) /* a pass that was cancelled may have left some that something else met */
        g->tiles[t].state = g->tiles[t].state == LUM_GLOSS_KEPT ? LUM_GLOSS_MOVED : LUM_GLOSS_NONE;
}

static bool is_all_kept(const struct lum_gloss *g)
{
    for (uint32_t t = 0; t < g->n_tiles; t++)
        if (g->tiles[t].state != LUM_GLOSS_KEPT)
            return false;
    return true;
}

/* Paths serve at any power of the lights that they looked for: those that shone whenever any of them was traced. */
static void invalidate(void *state, const struct lum_pass *pass, const struct lum_outcome *outcome)
{
    struct lum_gloss *g = state;
    const struct lum_light_table *lights = &pass->snapshot->lights;
    bool serve = outcome->light != LUM_FATE_STALE;
    if (outcome->light == LUM_FATE_SAME)
        return;
    for (uint32_t a = 0; a < lights->n_active; a++)
        serve = serve && g->lit[lights->active[a]];
    if (outcome->light == LUM_FATE_MOVED)
        move(g);
    for (uint32_t t = 0; t < g->n_tiles && !serve; t++)
        g->tiles[t].state = LUM_GLOSS_NONE;
    if (is_all_kept(g))
        return;
    memset(g->lit, 0, g->n_lit);
    for (uint32_t a = 0; a < lights->n_active; a++)
        g->lit[lights->active[a]] = 1;
}

const struct lum_state_kind lum_gloss_kind = {sizeof(struct lum_gloss), reserve, invalidate, finish};
