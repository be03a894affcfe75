/* Rough passes of a view. */
#include "core/method/method.h"
#include "core/render/pace.h"
#include "core/render/rough.h"
#include "core/render/view_state.h"

/* The settings of a rough pass's own view: edges are those of the full picture. */
static struct lum_view_settings rough_settings(const struct lum_view_settings *s)
{
    struct lum_view_settings rough = *s;
    rough.w = (s->w + s->preview - 1) / s->preview;
    rough.h = (s->h + s->preview - 1) / s->preview;
    rough.preview = 1;
    rough.max_spp = 1;
    rough.antialias = false;
    rough.error_share = 0.0;
    if (s->preview_eased)
        lum_pace_apply_ease(&rough);
    return rough;
}

/* A pass of the view as the rough picture reads it. */
static struct lum_pass made_pass(struct lum_view *v, const struct lum_pass *frame, const struct lum_snapshot *snapshot,
                                 const struct lum_view_settings *settings)
{
    struct lum_pass pass = *frame;
    pass.snapshot = snapshot;
    pass.settings = settings;
    pass.tiling = v->tiling;
    pass.gbuffer = &v->deferred.gbuffer;
    pass.surfaces = &v->deferred.surfaces;
    pass.layers = &v->deferred.layers;
    pass.film = &v->film;
    return pass;
}

/* The rough view has this frame of this snapshot. */
static bool has_coarse(const struct lum_view *v, const struct lum_snapshot *snapshot,
                       const struct lum_view_settings *settings)
{
    const struct lum_view *r = v->rough;
    return r && r->rendered && r->deferred.motion_mask.snapshot == snapshot && r->film.w == settings->w &&
           r->film.h == settings->h && r->settings.shadow_budget == settings->shadow_budget &&
           lum_view_same_picture(&r->settings, settings) && lum_view_least_spp(r->tile_spp, r->tiling.n) > 0;
}

/* The frame at a part of the resolution. *ret_stats: its pass. */
static enum lum_status run_coarse(struct lum_view *v, const struct lum_snapshot *snapshot, uint32_t block,
                                  const struct lum_view_settings *settings, const _Atomic bool *cancel,
                                  struct lum_pass_stats *ret_stats, struct lum_error *err)
{
    enum lum_status status = v->rough ? LUM_OK : lum_view_create(v->pool, &v->rough, err);
    if (status != LUM_OK)
        return status;
    lum_view_share(v->rough, v->deferred.caches);
    v->rough->block = block * (v->block > 0 ? v->block : 1);
    v->deferred.keeps_surfaces = v->rough->deferred.keeps_surfaces = true;
    return lum_view_pass(v->rough, snapshot, settings, cancel, ret_stats, err);
}

/* If the film and the rough view's are whole, and of the same snapshot: before either is made anew. */
static void take_base(struct lum_view *v, const struct lum_pass *frame, const struct lum_view_settings *settings)
{
    const struct lum_snapshot *then = v->deferred.motion_mask.snapshot;
    if (!v->whole || !then || !v->deferred.surfaces.kind || !has_coarse(v, then, settings) ||
        !lum_normalisation_equal(&then->norm, &frame->snapshot->norm))
        return;
    struct lum_pass fine = made_pass(v, frame, then, frame->settings);
    struct lum_pass coarse = made_pass(v->rough, frame, then, settings);
    if (lum_eye_init(&coarse.eye, &settings->camera, &then->norm, settings->w, settings->h, &(struct lum_error){0}) ==
        LUM_OK)
        lum_rough_base_take(&v->base, &fine, &coarse);
}

/* ---- of half the size ---- */

static struct lum_view_settings half_settings(const struct lum_view_settings *s)
{
    struct lum_view_settings half = *s;
    half.w = (s->w + 1) / 2;
    half.h = (s->h + 1) / 2;
    half.preview = s->preview / 2;
    half.antialias = false;
    half.error_share = 0.0;
    return half;
}

struct doubling {
    const struct lum_film *from;
    const struct lum_pass *to;
};

static float between(float at, uint32_t n)
{
    return lum_clamp(at, 0.0f, (float)(n - 1));
}

/* Between the four pixels around: what is twice as large should not have steps. */
static struct lum_rgb half_at(const struct lum_film *f, const struct lum_film *whole, uint32_t x, uint32_t y)
{
    /* Both show all of the view, also where the whole picture is of an odd size. */
    float sx = (float)f->w / (float)whole->w, sy = (float)f->h / (float)whole->h;
    float fx = between(((float)x + 0.5f) * sx - 0.5f, f->w), fy = between(((float)y + 0.5f) * sy - 0.5f, f->h);
    uint32_t ix = (uint32_t)fx, iy = (uint32_t)fy, jx = ix + 1 < f->w ? ix + 1 : ix, jy = iy + 1 < f->h ? iy + 1 : iy;
    float u = fx - (float)ix, v = fy - (float)iy;
    struct lum_rgb top =
        lum_rgb_add(lum_rgb_scale(lum_film_mean(f, ix, iy), 1.0f - u), lum_rgb_scale(lum_film_mean(f, jx, iy), u));
    struct lum_rgb low =
        lum_rgb_add(lum_rgb_scale(lum_film_mean(f, ix, jy), 1.0f - u), lum_rgb_scale(lum_film_mean(f, jx, jy), u));
    return lum_rgb_add(lum_rgb_scale(top, 1.0f - v), lum_rgb_scale(low, v));
}

static void double_tile(void *ctx, uint32_t tile, struct lum_counters *counters)
{
    const struct doubling *d = ctx;
    struct lum_tile_rect r = lum_tile_at(&d->to->tiling, tile);
    for (uint32_t y = r.y; y < r.y + r.h; y++)
        for (uint32_t x = r.x; x < r.x + r.w; x++)
            lum_film_set(d->to->film, x, y, half_at(d->from, d->to->film, x, y), &counters->nonfinite);
}

/* The rough picture of one of half the size, twice as large: where to see all surfaces takes too long. */
static enum lum_status rough_of_half(struct lum_view *v, const struct lum_pass *frame,
                                     const struct lum_stage_runner *runner, struct lum_error *err)
{
    struct lum_view_settings settings = half_settings(frame->settings);
    enum lum_status status = v->half ? LUM_OK : lum_view_create(v->pool, &v->half, err);
    v->whole = false;
    lum_rough_base_finish(&v->base); /* it hears of nothing that moves meanwhile */
    if (status != LUM_OK)
        return status;
    lum_view_share(v->half, v->deferred.caches);
    v->half->block = 2;
    v->half->previewed = false; /* if this pass was cancelled after that one */
    status = lum_view_pass(v->half, frame->snapshot, &settings, runner->cancel, runner->stats, err);
    if (status != LUM_OK)
        return status;
    int64_t begin_ns = lum_clock_ns();
    struct doubling doubling = {lum_view_film(v->half), frame};
    status = lum_stage_loop(runner, frame->tiling.n, double_tile, &doubling);
    runner->stats->stage_ms[LUM_STAGE_UPSAMPLE] += (double)(lum_clock_ns() - begin_ns) * 1e-6;
    return status;
}

/* ---- of all of it ---- */

/* The fast frame at a part of the resolution, seen at all of it (rough.h). */
static enum lum_status rough_of_whole(struct lum_view *v, const struct lum_pass *frame,
                                      const struct lum_stage_runner *runner, struct lum_error *err)
{
    struct lum_view_settings settings = rough_settings(frame->settings);
    struct lum_pass pass = *frame, coarse;
    take_base(v, frame, &settings);
    v->whole = false;
    enum lum_status status =
        run_coarse(v, frame->snapshot, frame->settings->preview, &settings, runner->cancel, runner->stats, err);
    if (status == LUM_OK)
        status = lum_deferred_see(&v->deferred, &pass, runner, err);
    if (status == LUM_OK) {
        v->rough->early = v->rough->deferred.records.cache != NULL;
        coarse = made_pass(v->rough, frame, frame->snapshot, &settings);
        status = lum_eye_init(&coarse.eye, &settings.camera, &frame->snapshot->norm, settings.w, settings.h, err);
    }
    if (status == LUM_OK) {
        const struct lum_rough_base *base = lum_rough_base_follow(&v->base, &pass, &coarse) ? &v->base : NULL;
        status = lum_rough_upsample(&coarse, &pass, base, runner, err);
    }
    return status;
}

enum lum_status lum_view_rough(struct lum_view *v, const struct lum_pass *frame, const struct lum_stage_runner *runner,
                               struct lum_error *err)
{
    bool whole = frame->settings->preview <= LUM_PREVIEW_WHOLE;
    enum lum_status status = whole ? rough_of_whole(v, frame, runner, err) : rough_of_half(v, frame, runner, err);
    if (status != LUM_OK)
        return status;
    runner->stats->preview = frame->settings->preview;
    runner->stats->changed = true;
    v->previewed = true;
    return LUM_OK;
}

enum lum_status lum_view_prepare(struct lum_view *view, const struct lum_snapshot *snapshot,
                                 const struct lum_view_settings *settings, const _Atomic bool *cancel,
                                 struct lum_pass_stats *ret_stats, struct lum_error *err)
{
    *ret_stats = (struct lum_pass_stats){0};
    if (settings->preview <= 1 || settings->preview > LUM_PREVIEW_WHOLE || settings->method->progressive ||
        !view->whole || view->deferred.motion_mask.snapshot != snapshot)
        return LUM_OK;
    struct lum_view_settings rough = rough_settings(settings);
    bool early = view->rough && view->rough->early;
    if (has_coarse(view, snapshot, &rough) && !early)
        return LUM_OK;
    if (early)
        lum_view_forget(view->rough);
    enum lum_status status = run_coarse(view, snapshot, settings->preview, &rough, cancel, ret_stats, err);
    if (status == LUM_OK)
        view->rough->early = false;
    return status;
}
