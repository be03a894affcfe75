/* First-hit buffers for files and for the denoisers and metrics that read them. */
#include "core/render/aov.h"

#include "core/base/pool.h"
#include "core/material/bsdf.h"
#include "core/scene/surface.h"

void lum_aov_finish(struct lum_aov_buffers *aov)
{
    lum_free(aov->albedo);
    lum_free(aov->normal_world);
    lum_free(aov->depth_m);
    lum_free(aov->instance);
    *aov = (struct lum_aov_buffers){0};
}

static bool reserve(struct lum_aov_buffers *aov, size_t n)
{
    if (aov->albedo)
        return true;
    aov->albedo = lum_calloc(n, sizeof *aov->albedo);
    aov->normal_world = lum_calloc(n, sizeof *aov->normal_world);
    aov->depth_m = lum_calloc(n, sizeof *aov->depth_m);
    aov->instance = lum_calloc(n, sizeof *aov->instance);
    return aov->albedo && aov->normal_world && aov->depth_m && aov->instance;
}

struct aov_run {
    const struct lum_aov_buffers *aov;
    const struct lum_pass *pass;
};

/* at: index in the picture; i: in the tile's batch. */
static void fill_pixel(const struct aov_run *run, const struct lum_hits *hits, uint32_t i, struct lum_vec3 d, size_t at)
{
    const struct lum_aov_buffers *aov = run->aov;
    const struct lum_snapshot *s = run->pass->snapshot;
    aov->albedo[at] = lum_grey(0.0f);
    aov->normal_world[at] = lum_v3(0.0f, 0.0f, 0.0f);
    aov->depth_m[at] = INFINITY;
    aov->instance[at] = LUM_NO_OBJECT;
    if (hits->object[i] == LUM_NO_OBJECT)
        return;
    struct lum_surface surface;
    lum_snapshot_surface(s, hits, i, d, &surface);
    surface.white = false; /* the albedo is the surface's own, whatever the picture is of */
    aov->depth_m[at] = (float)((double)hits->t[i] / s->norm.scale);
    aov->normal_world[at] = surface.ns; /* scene space is world space moved and scaled evenly */
    aov->instance[at] = surface.instance;
    if (surface.instance == LUM_NO_OBJECT)
        return;
    struct lum_bsdf b;
    lum_bsdf_init(&b, &s->materials[surface.material], &surface, lum_v3_neg(d));
    aov->albedo[at] = lum_bsdf_albedo(&b);
}

static void aov_tile(void *ctx, uint32_t tile, uint32_t worker)
{
    (void)worker;
    const struct aov_run *run = ctx;
    const struct lum_pass *pass = run->pass;
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    struct lum_rays rays;
    lum_tile_center_rays(pass, tile, &rays);
    for (uint32_t i = 0; i < rays.n; i++)
        fill_pixel(run, &pass->gbuffer->tiles[tile], i, lum_rays_direction(&rays, i),
                   (size_t)(r.y + i / r.w) * pass->tiling.w + r.x + i % r.w);
}

enum lum_status lum_aov_update(struct lum_aov_buffers *aov, const struct lum_pass *pass, struct lum_pool *pool,
                               struct lum_error *err)
{
    uint32_t edits = lum_basis_renew(&aov->basis, pass);
    if (aov->stamp == pass->gbuffer->stamp && !lum_is_stale(edits, LUM_PRODUCT_AOVS))
        return LUM_OK;
    if (!reserve(aov, (size_t)pass->tiling.w * pass->tiling.h)) {
        lum_aov_finish(aov);
        return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for first-hit buffers");
    }
    struct aov_run run = {aov, pass};
    aov->stamp = pass->gbuffer->stamp;
    return lum_pool_run(pool, pass->tiling.n, aov_tile, &run, NULL);
}
