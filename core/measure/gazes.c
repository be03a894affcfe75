#include "core/measure/gazes.h"

#include <string.h>

/* Of a lamp; closely as many as a single observer has. Where a lamp is seen whole, or not at all, one would do. */
#define RAYS_MOST 16u
#define RAYS_MOST_CLOSELY 64u
#define RAYS_LEAST 4u
#define RAYS_ALL 2048u /* of all lamps, where that leaves as many for each */
#define RAYS_ALL_CLOSELY 8192u

/* What one has seen; what it knows of a place where it had none is nothing. */
struct gaze {
    bool has_place;
    struct lum_glare glare;
};

struct lum_gazes {
    uint32_t n, looked, looked_closely;
    uint64_t n_rays;
    struct gaze *all;
};

enum lum_status lum_gazes_create(uint32_t n, struct lum_gazes **ret_gazes, struct lum_error *err)
{
    struct lum_gazes *g = lum_calloc(1, sizeof *g);
    if (g)
        *g = (struct lum_gazes){.n = n, .all = lum_calloc(n, sizeof *g->all)};
    if (!g || !g->all) {
        lum_gazes_destroy(g);
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for %u observers", n);
    }
    *ret_gazes = g;
    return LUM_OK;
}

void lum_gazes_destroy(struct lum_gazes *g)
{
    if (!g)
        return;
    lum_free(g->all);
    lum_free(g);
}

enum lum_status lum_gazes_copy(const struct lum_gazes *of, struct lum_gazes **ret_gazes, struct lum_error *err)
{
    enum lum_status st = lum_gazes_create(of->n, ret_gazes, err);
    if (st)
        return st;
    struct gaze *all = (*ret_gazes)->all;
    memcpy(all, of->all, of->n * sizeof *all);
    **ret_gazes = *of;
    (*ret_gazes)->all = all;
    return LUM_OK;
}

void lum_gazes_forget(struct lum_gazes *g)
{
    memset(g->all, 0, g->n * sizeof *g->all);
    g->looked = g->looked_closely = 0;
    g->n_rays = 0;
}

struct job {
    struct lum_gazes *gazes;
    const struct lum_gazes_look *look;
    uint32_t first, n_rays;
};

static void look_job(void *ctx, uint32_t job, uint32_t worker)
{
    (void)worker;
    const struct job *j = ctx;
    uint32_t i = j->first + job;
    struct lum_gazer who = j->look->gazer(j->look->user, i);
    struct gaze *is = &j->gazes->all[i];
    *is = (struct gaze){.has_place = who.has_place};
    if (who.has_place)
        lum_glare_of(j->look->snapshot, &who.observer, j->n_rays, j->look->seed, &is->glare);
}

/* Of one look at all lamps; those without an extent take one. */
static uint64_t rays_of_look(const struct lum_light_table *lights, uint32_t each)
{
    uint64_t n = 0;
    for (uint32_t i = 0; i < lights->n_active; i++)
        n += lights->lights[lights->active[i]].delta ? 1 : each;
    return n > 0 ? n : 1;
}

bool lum_gazes_look(struct lum_gazes *g, const struct lum_gazes_look *look)
{
    uint32_t *looked = look->closely ? &g->looked_closely : &g->looked;
    uint32_t all = look->closely ? RAYS_ALL_CLOSELY : RAYS_ALL, most = look->closely ? RAYS_MOST_CLOSELY : RAYS_MOST;
    uint32_t each = all / (look->snapshot->lights.n_active + 1), left = g->n - *looked;
    each = each < RAYS_LEAST ? RAYS_LEAST : each > most ? most : each;
    uint64_t rays = rays_of_look(&look->snapshot->lights, each), fit = look->n_rays / rays;
    uint32_t at_once = lum_pool_size(look->pool); /* take no longer than one does */
    fit = fit > at_once ? fit : at_once;
    uint32_t n = fit < left ? (uint32_t)fit : left;
    struct job j = {g, look, *looked, each};
    (void)lum_pool_run(look->pool, n, look_job, &j, NULL); /* nobody cancels it */
    *looked += n;
    g->n_rays += n * rays;
    return *looked < g->n;
}

uint64_t lum_gazes_rays(const struct lum_gazes *g)
{
    return g->n_rays;
}

const struct lum_glare *lum_gazes_at(const struct lum_gazes *g, uint32_t i)
{
    return g->all[i].has_place ? &g->all[i].glare : NULL;
}
