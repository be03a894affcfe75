#include "core/measure/gazes.h"

#include <string.h>

/* Of a lamp; closely as many as a single observer has. Where a lamp is seen whole, or not at all, one would do. */
#define RAYS_MOST 16u
#define RAYS_MOST_CLOSELY 64u
#define RAYS_LEAST 4u
#define RAYS_ALL 2048u /* of all lamps, where that leaves as many for each */
#define RAYS_ALL_CLOSELY 8192u

struct lum_gazes {
    uint32_t n, looked, looked_closely;
    struct lum_glare *glares; /* of the first `looked` */
};

enum lum_status lum_gazes_create(uint32_t n, struct lum_gazes **ret_gazes, struct lum_error *err)
{
    struct lum_gazes *g = lum_calloc(1, sizeof *g);
    if (g)
        *g = (struct lum_gazes){.n = n, .glares = lum_calloc(n, sizeof *g->glares)};
    if (!g || !g->glares) {
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
    lum_free(g->glares);
    lum_free(g);
}

enum lum_status lum_gazes_copy(const struct lum_gazes *of, struct lum_gazes **ret_gazes, struct lum_error *err)
{
    enum lum_status st = lum_gazes_create(of->n, ret_gazes, err);
    if (st)
        return st;
    (*ret_gazes)->looked = of->looked;
    (*ret_gazes)->looked_closely = of->looked_closely;
    memcpy((*ret_gazes)->glares, of->glares, of->looked * sizeof *of->glares);
    return LUM_OK;
}

void lum_gazes_forget(struct lum_gazes *g)
{
    g->looked = g->looked_closely = 0;
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
    j->gazes->glares[i] = (struct lum_glare){0};
    if (who.has_place)
        lum_glare_of(j->look->snapshot, &who.observer, j->n_rays, j->look->seed, &j->gazes->glares[i]);
}

bool lum_gazes_look(struct lum_gazes *g, const struct lum_gazes_look *look)
{
    uint32_t *looked = look->closely ? &g->looked_closely : &g->looked;
    uint32_t all = look->closely ? RAYS_ALL_CLOSELY : RAYS_ALL, most = look->closely ? RAYS_MOST_CLOSELY : RAYS_MOST;
    uint32_t rays = all / (look->snapshot->lights.n_active + 1), n = g->n - *looked;
    n = n < look->n ? n : look->n;
    struct job j = {g, look, *looked, rays < RAYS_LEAST ? RAYS_LEAST : rays > most ? most : rays};
    (void)lum_pool_run(look->pool, n, look_job, &j, NULL); /* nobody cancels it */
    *looked += n;
    return *looked < g->n;
}

const struct lum_glare *lum_gazes_at(const struct lum_gazes *g, uint32_t i)
{
    return i < g->looked ? &g->glares[i] : NULL;
}
