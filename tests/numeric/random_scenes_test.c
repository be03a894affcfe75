/* What holds of every scene, asked of scenes put together at random from odd but allowed parts, by every method. A
 * fault is reported with the number of its scene, made as small as it can be (tests/support/random_scene.h). */
#include "core/cache/kind.h"
#include "core/effect/ais/ais.h"
#include "core/pass/eye.h"
#include "tests/support/random_scene.h"

#define MAX_SPP 2u
#define FLUSHED 0x1p-54f /* 2^(-126 + 60 + 12) */

static void begin(struct rig *r, const struct random_scene *s, const struct lum_method *method, uint32_t threads)
{
    rig_begin(r, threads);
    r->settings.w = 20;
    r->settings.h = 18;
    r->settings.max_spp = MAX_SPP;
    r->settings.n_vpls = 16;
    r->settings.shadow_samples = 4;
    r->settings.method = method;
    random_scene_put(r, s);
}

/* False: there is no picture to ask for, since the eye is too far from a scene as small as this. */
static bool is_in_reach(const struct rig *r)
{
    const struct lum_view_settings *s = &r->settings;
    struct lum_eye eye;
    return lum_eye_init(&eye, &s->camera, &r->snapshot->norm, s->w, s->h, NULL) == LUM_OK;
}

/* A complete picture. False: something was dropped, or is not a radiance. */
static bool render(struct rig *r, char ret_what[256])
{
    struct lum_pass_stats stats;
    if (!is_in_reach(r))
        return true;
    do {
        RIG_OK(lum_view_pass(r->view, r->snapshot, &r->settings, NULL, &stats, &err));
        if (stats.nonfinite || stats.bad_rays) {
            snprintf(ret_what, 256, "%llu values were not finite, %llu rays were refused",
                     (unsigned long long)stats.nonfinite, (unsigned long long)stats.bad_rays);
            return false;
        }
    } while (!stats.complete);
    const struct lum_film *f = lum_view_film(r->view);
    for (uint32_t i = 0; i < f->w * f->h; i++) {
        struct lum_rgb c = lum_film_mean(f, i % f->w, i / f->w);
        if (!(isfinite(c.r) && isfinite(c.g) && isfinite(c.b) && c.r >= 0.0f && c.g >= 0.0f && c.b >= 0.0f)) {
            snprintf(ret_what, 256, "pixel %u is %g %g %g", i, (double)c.r, (double)c.g, (double)c.b);
            return false;
        }
    }
    return true;
}

static bool finite(const struct random_scene *s, const struct lum_method *method, char ret_what[256])
{
    struct rig r;
    begin(&r, s, method, 1);
    bool ok = render(&r, ret_what);
    rig_end(&r);
    return ok;
}

static void light_is_finite(void **state)
{
    (void)state;
    random_scenes_hold("light_is_finite", 0, 30, finite);
}

static bool same(float x, float y, float tolerance, float floor)
{
    return fabsf(x - y) <= tolerance * fabsf(x) + floor;
}

/* Pixels of two rigs, one scaled. */
static bool same_pictures(const struct rig *a, const struct rig *b, float scale, float tolerance, char ret_what[256])
{
    const struct lum_film *f = lum_view_film(a->view), *g = lum_view_film(b->view);
    const float floor = tolerance > 0.0f ? FLUSHED : 0.0f;
    for (uint32_t i = 0; i < f->w * f->h; i++) {
        struct lum_rgb x = lum_rgb_scale(lum_film_mean(f, i % f->w, i / f->w), scale);
        struct lum_rgb y = lum_film_mean(g, i % g->w, i / g->w);
        if (!same(x.r, y.r, tolerance, floor) || !same(x.g, y.g, tolerance, floor) ||
            !same(x.b, y.b, tolerance, floor)) {
            snprintf(ret_what, 256, "pixel %u is %.9g %.9g %.9g, not %.9g %.9g %.9g", i, (double)y.r, (double)y.g,
                     (double)y.b, (double)x.r, (double)x.g, (double)x.b);
            return false;
        }
    }
    return true;
}

/* Light is linear: all of it times a power of two changes no bit but of the exponents, whatever was chosen by how much
 * light there is. Only what is flushed to zero, below 2^-126, may be missing in a sum, or in the last bit of one: a
 * pixel sums up to some thousand terms, with factors up to the 2^60 that the nearness of a light can be. */
static bool linear(const struct random_scene *s, const struct lum_method *method, char ret_what[256])
{
    struct rig a, b;
    struct random_scene bright = *s, dim;
    bright.all_lit = bright.clear = true;
    dim = bright;
    dim.light = 0x1p-10;
    begin(&a, &bright, method, 1);
    begin(&b, &dim, method, 1);
    bool ok = render(&a, ret_what) && render(&b, ret_what) && same_pictures(&a, &b, 0x1p-10f, 0x1p-22f, ret_what);
    rig_end(&a);
    rig_end(&b);
    return ok;
}

static void light_is_linear(void **state)
{
    (void)state;
    random_scenes_hold("light_is_linear", 1000, 12, linear);
}

/* Units do not matter: all lengths times a power of two change no bit. Not of methods whose records or fog count in
 * metres (NOTES R2, R3). */
static bool any_unit(const struct random_scene *s, const struct lum_method *method, char ret_what[256])
{
    struct rig a, b;
    struct random_scene usual = *s, small;
    const struct lum_cache_kind *cache = method->cache;
    if (cache == &lum_cache_instant || cache == &lum_cache_temporal)
        return true;
    usual.clear = true; /* of limits of intensities and of fog */
    small = usual;
    small.scale = 0x1p-7;
    begin(&a, &usual, method, 1);
    begin(&b, &small, method, 1);
    if (method->ais && method->ais->adaptive)
        a.settings.effects_off = b.settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_MEDIA);
    bool ok = render(&a, ret_what) && render(&b, ret_what) && same_pictures(&a, &b, 1.0f, 0.0f, ret_what);
    rig_end(&a);
    rig_end(&b);
    return ok;
}

static void units_do_not_matter(void **state)
{
    (void)state;
    random_scenes_hold("units_do_not_matter", 4000, 12, any_unit);
}

/* ---- who does what, and when ---- */

static bool shuffled; /* lum_pool_run does its jobs one by one, in an order of its own (linked with --wrap) */

enum lum_status __real_lum_pool_run(struct lum_pool *pool, uint32_t n_jobs, lum_job_fn fn, void *ctx,
                                    const _Atomic bool *cancel);
enum lum_status __wrap_lum_pool_run(struct lum_pool *pool, uint32_t n_jobs, lum_job_fn fn, void *ctx,
                                    const _Atomic bool *cancel);
enum lum_status __wrap_lum_pool_run(struct lum_pool *pool, uint32_t n_jobs, lum_job_fn fn, void *ctx,
                                    const _Atomic bool *cancel)
{
    if (!shuffled || cancel)
        return __real_lum_pool_run(pool, n_jobs, fn, ctx, cancel);
    uint32_t step = n_jobs * 5 / 8 | 1;
    while (n_jobs > 1 && (n_jobs % step == 0 || step % n_jobs == 0))
        step += 2;
    uint32_t common = n_jobs, rest = step;
    for (uint32_t t; rest; common = t) {
        t = rest;
        rest = common % rest;
    }
    if (common != 1)
        step = 1;
    for (uint32_t k = 0; k < n_jobs; k++)
        fn(ctx, (uint32_t)((n_jobs - 1 - (uint64_t)k * step % n_jobs)), 0);
    return LUM_OK;
}

/* Hard case 36: the picture is the same bits for three threads, and for tiles (records, rows, rays) in another order.
 */
static bool any_order(const struct random_scene *s, const struct lum_method *method, char ret_what[256])
{
    struct rig a, b;
    begin(&a, s, method, 1);
    bool ok = render(&a, ret_what);
    for (int k = 0; k < 2 && ok; k++) {
        begin(&b, s, method, k == 0 ? 3 : 1);
        shuffled = k == 1;
        ok = render(&b, ret_what) && same_pictures(&a, &b, 1.0f, 0.0f, ret_what);
        shuffled = false;
        rig_end(&b);
    }
    rig_end(&a);
    return ok;
}

static void order_does_not_matter(void **state)
{
    (void)state;
    random_scenes_hold("order_does_not_matter", 2000, 12, any_order);
}

/* ---- edits ---- */

/* Items come and go, and change. After each edit the picture is that of a view that begins anew: nothing of what was
 * kept is out of date. */
static bool up_to_date(const struct random_scene *s, const struct lum_method *method, char ret_what[256])
{
    struct rig r;
    struct random_scene now = *s;
    begin(&r, s, method, 1);
    r.settings.shadow_budget = 0; /* what an older view knows beyond that, a new one does not */
    bool ok = render(&r, ret_what);
    for (uint32_t k = 0; k < 6 && ok; k++) {
        uint32_t i = 1 + (uint32_t)(s->seed * 7 + k * 5) % (RANDOM_ITEMS - 1);
        if (s->items[i].gone) /* what shrinking took away stays away */
            continue;
        now.items[i].gone = k % 3 == 0;
        now.items[i].seed = s->items[i].seed + (k % 3 == 1 ? 7919 * k : 0);
        random_scene_put_item(&r, &now, i);
        rig_commit(&r);
        if (!is_in_reach(&r))
            break;
        ok = render(&r, ret_what);
        struct lum_rgb *picture = rig_picture(&r);
        if (lum_method_counts_vpls(
                method)) /* knows what lights once emitted (vpl.h), or has records where it wanted them */
            lum_view_forget(r.view);
        else
            rig_fresh_view(&r);
        ok = ok && render(&r, ret_what);
        for (uint32_t at = 0; at < r.settings.w * r.settings.h && ok; at++) {
            struct lum_rgb c = lum_film_mean(lum_view_film(r.view), at % r.settings.w, at / r.settings.w);
            ok = memcmp(&c, &picture[at], sizeof c) == 0;
            if (!ok)
                snprintf(ret_what, 256, "after edit %u, of %c: pixel %u is %.9g %.9g %.9g, anew %.9g %.9g %.9g", k,
                         'a' + i, at, (double)picture[at].r, (double)picture[at].g, (double)picture[at].b, (double)c.r,
                         (double)c.g, (double)c.b);
        }
        lum_free(picture);
    }
    rig_end(&r);
    return ok;
}

static void edits_leave_nothing_stale(void **state)
{
    (void)state;
    random_scenes_hold("edits_leave_nothing_stale", 3000, 12, up_to_date);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_is_finite),           cmocka_unit_test(light_is_linear),
        cmocka_unit_test(units_do_not_matter),       cmocka_unit_test(order_does_not_matter),
        cmocka_unit_test(edits_leave_nothing_stale),
    };
    return cmocka_run_group_tests_name("numeric.random_scenes", tests, NULL, NULL);
}
