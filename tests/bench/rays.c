/* Rays per second: our traversal calls against bare Embree on the same scene and the same rays, and a path traced pass.
 *
 * The rays are what a path tracer shoots: primary rays of a 512 x 512 picture in 16 x 16 tiles, cosine-distributed
 * bounce rays from what they hit, and shadow rays from there to a light. "Embree" is rtcIntersect16 or rtcOccluded16
 * over packets prepared beforehand: nothing is paid for but traversal and one copy of the packet, which the call
 * overwrites. "lumend" is lum_trace_closest or lum_trace_any over the batches that estimators use: gate, packing,
 * unpacking.
 *
 * One thread, CPU time, the two in turn (A B B A); the ratio is the median over pairs with a 95 % bootstrap interval.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/accel/embree.h"
#include "core/light/sample.h"
#include "core/math/sampler.h"
#include "core/math/warp.h"
#include "core/pass/pass.h"
#include "core/render/view.h"
#include "core/scene/surface.h"
#include "tests/bench/table.h"

#define SIDE 512u
#define N_BATCHES (SIDE * SIDE / LUM_TILE_PIXELS)

enum kind { PRIMARY, BOUNCE, SHADOW, N_KINDS };
static const char *const kind_names[N_KINDS] = {"primary", "bounce", "shadow"};

/* Embree 4 and 3 differ in how a query's context is given. */
#if RTC_VERSION_MAJOR >= 4
struct query {
    struct RTCRayQueryContext context;
    struct RTCIntersectArguments intersect;
    struct RTCOccludedArguments occluded;
};
#else
struct query {
    struct RTCIntersectContext context;
};
#endif

struct study {
    struct lum_world world;
    struct lum_rays *rays[N_KINDS]; /* N_BATCHES each */
    struct RTCRayHit16 *cells[N_KINDS];
    size_t n_packets[N_KINDS];
    uint64_t n_rays[N_KINDS];
};

/* From what the primary rays of a batch hit: one bounce ray and one shadow ray each. */
static void secondary_rays(struct study *st, uint32_t batch)
{
    const struct lum_snapshot *s = st->world.snapshot;
    const struct lum_rays *primary = &st->rays[PRIMARY][batch];
    struct lum_rays *bounce = &st->rays[BOUNCE][batch], *shadow = &st->rays[SHADOW][batch];
    struct lum_hits hits;
    uint64_t bad = 0;
    struct lum_trace trace = {.top = s->top, .coherent = true, .bad_rays = &bad};
    lum_trace_closest(&trace, primary, &hits);
    bounce->n = shadow->n = 0;
    for (uint32_t i = 0; i < primary->n; i++) {
        if (hits.object[i] == LUM_NO_OBJECT)
            continue;
        struct lum_surface surface;
        struct lum_sampler sampler = lum_sampler_at(batch, i, 0, 1);
        lum_snapshot_surface(s, &hits, i, lum_rays_direction(primary, i), &surface);
        struct lum_frame frame = lum_frame_from_normal(surface.ng);
        struct lum_vec3 p = lum_ray_offset(surface.p, surface.ng);
        lum_rays_push(bounce, p, lum_frame_to_scene(&frame, lum_warp_cosine(lum_sampler_2d(&sampler, 0))), INFINITY);
        float u = lum_sampler_1d(&sampler, 1), prob;
        struct lum_light_sample ls;
        uint32_t light = lum_lights_pick(&s->lights, &u, &prob);
        if (light != LUM_NO_OBJECT && lum_light_sample_at(s, light, p, lum_sampler_2d(&sampler, 2), &ls))
            lum_rays_push(shadow, p, ls.wi, isinf(ls.distance) ? INFINITY : ls.distance * 0.999f);
    }
}

static void packet_of(const struct lum_rays *r, uint32_t first, struct RTCRayHit16 *p)
{
    memset(p, 0, sizeof *p);
    for (uint32_t k = 0; k < 16; k++) {
        uint32_t i = first + k < r->n ? first + k : r->n - 1;
        p->ray.org_x[k] = r->ox[i], p->ray.org_y[k] = r->oy[i], p->ray.org_z[k] = r->oz[i];
        p->ray.dir_x[k] = r->dx[i], p->ray.dir_y[k] = r->dy[i], p->ray.dir_z[k] = r->dz[i];
        p->ray.tnear[k] = r->tnear[i], p->ray.tfar[k] = r->tfar[i];
        p->ray.mask[k] = LUM_MASK_ALL;
        p->hit.geomID[k] = p->hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
}

static bool make_packets(struct study *st, enum kind kind)
{
    size_t n = 0;
    for (uint32_t b = 0; b < N_BATCHES; b++)
        n += (st->rays[kind][b].n + 15u) / 16u, st->n_rays[kind] += st->rays[kind][b].n;
    st->cells[kind] = lum_calloc(n, sizeof *st->cells[kind]);
    if (!st->cells[kind])
        return false;
    for (uint32_t b = 0; b < N_BATCHES; b++)
        for (uint32_t first = 0; first < st->rays[kind][b].n; first += 16)
            packet_of(&st->rays[kind][b], first, &st->cells[kind][st->n_packets[kind]++]);
    return true;
}

static void trace_packet(RTCScene scene, enum kind kind, struct query *q, struct RTCRayHit16 *p)
{
    static const _Alignas(64) int valid[16] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
#if RTC_VERSION_MAJOR >= 4
    if (kind == SHADOW)
        rtcOccluded16(valid, scene, &p->ray, &q->occluded);
    else
        rtcIntersect16(valid, scene, p, &q->intersect);
#else
    if (kind == SHADOW)
        rtcOccluded16(valid, scene, &q->context, &p->ray);
    else
        rtcIntersect16(valid, scene, &q->context, p);
#endif
}

static void init_query(struct query *q, bool coherent)
{
#if RTC_VERSION_MAJOR >= 4
    rtcInitRayQueryContext(&q->context);
    rtcInitIntersectArguments(&q->intersect);
    rtcInitOccludedArguments(&q->occluded);
    q->intersect.context = q->occluded.context = &q->context;
    if (coherent)
        q->intersect.flags = q->occluded.flags = RTC_RAY_QUERY_FLAG_COHERENT;
#else
    rtcInitIntersectContext(&q->context);
    if (coherent)
        q->context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
#endif
}

/* Seconds of CPU for one sweep over all rays of a kind. */
static double sweep_embree(const struct study *st, enum kind kind)
{
    struct query q;
    init_query(&q, kind == PRIMARY);
    int64_t begin = lum_cpu_clock_ns();
    for (size_t i = 0; i < st->n_packets[kind]; i++) {
        _Alignas(64) struct RTCRayHit16 p = st->cells[kind][i];
        trace_packet(st->world.snapshot->top->scene, kind, &q, &p);
    }
    return (double)(lum_cpu_clock_ns() - begin) * 1e-9;
}

static double sweep_lumend(const struct study *st, enum kind kind)
{
    uint64_t bad = 0;
    struct lum_trace trace = {.top = st->world.snapshot->top, .coherent = kind == PRIMARY, .bad_rays = &bad};
    static struct lum_hits hits;
    uint8_t occluded[LUM_RAY_BATCH];
    int64_t begin = lum_cpu_clock_ns();
    for (uint32_t b = 0; b < N_BATCHES; b++) {
        if (kind == SHADOW)
            lum_trace_any(&trace, &st->rays[kind][b], occluded);
        else
            lum_trace_closest(&trace, &st->rays[kind][b], &hits);
    }
    return (double)(lum_cpu_clock_ns() - begin) * 1e-9;
}

struct ratio {
    double embree_mrays, lumend_mrays;
    struct lum_bench_median ratio;
};

static struct ratio measure(const struct study *st, enum kind kind, size_t pairs)
{
    double embree[64], lumend[64], ratios[64];
    sweep_embree(st, kind), sweep_lumend(st, kind); /* warm-up */
    for (size_t i = 0; i < pairs; i++) {
        double a1 = sweep_embree(st, kind), b1 = sweep_lumend(st, kind), b2 = sweep_lumend(st, kind),
               a2 = sweep_embree(st, kind);
        embree[i] = a1 + a2;
        lumend[i] = b1 + b2;
        ratios[i] = embree[i] / lumend[i];
    }
    struct ratio r;
    r.ratio = lum_bench_bootstrap(ratios, pairs);
    double rays = 2.0 * (double)st->n_rays[kind] * 1e-6;
    r.embree_mrays = rays / lum_bench_quantile(embree, pairs, 0.5);
    r.lumend_mrays = rays / lum_bench_quantile(lumend, pairs, 0.5);
    return r;
}

/* A path traced pass: all its rays over all its CPU time, shading included. */
static bool path_pass(struct study *st, size_t passes, double *ret_mrays, double *ret_rays_per_sample)
{
    struct lum_view *view = NULL;
    struct lum_error err = {0};
    struct lum_view_settings settings = lum_view_settings_default();
    double best = 0.0;
    uint64_t rays = 0;
    bool ok = lum_snapshot_camera(st->world.snapshot, NULL, &settings.camera, &err) == LUM_OK &&
              lum_view_create(st->world.pool, &view, &err) == LUM_OK;
    settings.w = settings.h = SIDE;
    for (size_t i = 0; ok && i < passes; i++) {
        struct lum_pass_stats stats;
        ok = lum_view_pass(view, st->world.snapshot, &settings, NULL, &stats, &err) == LUM_OK;
        rays = 0;
        for (size_t k = 0; k < LUM_RAY_KIND_COUNT; k++)
            rays += stats.rays[k];
        if (ok && i > 0)
            best = fmax(best, (double)rays / stats.cpu_ms * 1e-3);
    }
    if (!ok)
        fprintf(stderr, "lumend-bench: %s\n", err.text);
    lum_view_destroy(view);
    *ret_mrays = best;
    *ret_rays_per_sample = (double)rays / (SIDE * SIDE);
    return ok;
}

static bool prepare(struct study *st)
{
    const struct lum_snapshot *s = st->world.snapshot;
    struct lum_camera camera;
    struct lum_error err = {0};
    struct lum_pass pass = {.tiling = lum_tiling_make(SIDE, SIDE, LUM_TILE_SIDE)};
    if (lum_snapshot_camera(s, NULL, &camera, &err) != LUM_OK ||
        lum_eye_init(&pass.eye, &camera, &s->norm, SIDE, SIDE, &err) != LUM_OK) {
        fprintf(stderr, "lumend-bench: %s\n", err.text);
        return false;
    }
    for (int k = 0; k < N_KINDS; k++)
        if (!(st->rays[k] = lum_calloc(N_BATCHES, sizeof *st->rays[k])))
            return false;
    for (uint32_t b = 0; b < N_BATCHES; b++) {
        lum_tile_center_rays(&pass, b, &st->rays[PRIMARY][b]);
        secondary_rays(st, b);
    }
    return make_packets(st, PRIMARY) && make_packets(st, BOUNCE) && make_packets(st, SHADOW);
}

static const struct lum_bench_column columns[] = {
    {"kind", "rays", LUM_BENCH_TEXT},       {"embree_mrays_s", "Embree Mray/s", 2},
    {"lumend_mrays_s", "lumend Mray/s", 2}, {"ratio", "ratio", 3},
    {"ratio_lo", "95 % from", 3},           {"ratio_hi", "to", 3},
};

static bool report(const struct lum_bench_options *o, const struct ratio *r, double path_mrays, double per_sample)
{
    struct lum_bench_table t = LUM_BENCH_TABLE(columns);
    for (int k = 0; k < N_KINDS; k++) {
        lum_bench_table_text(&t, kind_names[k]);
        LUM_BENCH_NUMBERS(&t, r[k].embree_mrays, r[k].lumend_mrays, r[k].ratio.median, r[k].ratio.lo, r[k].ratio.hi);
    }
    lum_bench_table_text(&t, "path");
    LUM_BENCH_NUMBERS(&t, (double)NAN, path_mrays, (double)NAN, (double)NAN, (double)NAN);
    printf("%s, one thread, %u x %u; path: %.1f rays a sample, shading included\n", o->scene, SIDE, SIDE, per_sample);
    return lum_bench_table_finish(&t, o, "rays");
}

int lum_bench_rays(const struct lum_bench_options *options)
{
    struct study st = {0};
    struct ratio ratios[N_KINDS];
    double path_mrays = 0.0, per_sample = 0.0;
    int status = 1;
    if (!lum_bench_world(options->scene, 1, &st.world))
        return 1;
    lum_thread_init_fp();
    if (!prepare(&st))
        goto out;
    for (enum kind k = PRIMARY; k < N_KINDS; k++) {
        lum_bench_progress("rays: %s", kind_names[k]);
        ratios[k] = measure(&st, k, options->quick ? 4 : 24);
    }
    lum_bench_progress("rays: path");
    if (!path_pass(&st, options->quick ? 3 : 8, &path_mrays, &per_sample))
        goto out;
    status = report(options, ratios, path_mrays, per_sample) ? 0 : 1;
out:
    for (int k = 0; k < N_KINDS; k++) {
        lum_free(st.rays[k]);
        lum_free(st.cells[k]);
    }
    lum_world_finish(&st.world);
    return status;
}
