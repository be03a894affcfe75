/* Light paths, and the VPLs they leave. */
#include "core/math/lanes.h"
#include "core/math/sampler.h"
#include "core/vpl/vpl.h"

#include <string.h>

#include "core/base/pool.h"
#include "core/light/emit.h"
#include "core/material/bsdf.h"
#include "core/material/ggx.h"
#include "core/scene/surface.h"
#include "core/trace/rays.h"
#include "core/trace/stale.h"
#include "core/vpl/share.h"

/* Segments of a path between mirrors and glass, beyond those that end at a VPL; as deep as the eye's own branches. */
#define SPECULAR_MAX 10u

/* What a surface is taken to reflect where its colour must not matter; and the least that a VPL counts of its path's
 * first: what white rooms keep is not to hang on VPLs that are hardly ever drawn. */
#define ALBEDO_GUESS 0.7f
#define IMPORTANCE_FLOOR 0.02f

/* Sampler pairs: the light's two, then two for each segment. */
enum { PAIR_POSITION = 0, PAIR_DIRECTION = 1, PAIR_BSDF = 2, PAIR_LOBE = 3, PAIRS_PER_SEGMENT = 2 };

struct path {
    struct lum_rgb flux;    /* as if the light had this one path only; per unit of power */
    float importance;       /* of its first VPL: its part of the flux of all, about; it depends on no colour */
    float left;             /* of that, as if all surfaces were alike */
    uint32_t share, number; /* whose, and which of its paths */
    uint32_t bounce, last;  /* VPLs left so far; bounce after which nobody needs the path */
    uint32_t n_segments;
    bool found; /* by paths from the eye, too: it began at a lamp with an extent, or met what spreads light */
    struct lum_sampler sampler;
};

/* A batch of paths, densely packed: path i has ray i. Lives on a worker's stack. */
struct walk {
    const struct lum_snapshot *snapshot;
    const struct lum_known *known;
    const struct lum_vpl_plan *plan;
    struct lum_vpl_set *set;
    struct lum_counters *counters;
    bool media; /* there are some, and they count */
    struct lum_rays rays;
    struct lum_hits hits;
    struct path path[LUM_RAY_BATCH];
};

/* Lobes are at least this wide (alpha): a sharper one would show as a highlight of each of them. */
#define LOBE_LEAST 0.3f

/* What of its flux goes by a lobe of light from w, which arrives on the side of n. */
static void set_lobe(struct lum_vpl_set *set, uint32_t slot, struct lum_gloss_lobe l, struct lum_vec3 n,
                     struct lum_vec3 w, float gloss)
{
    float alpha = lum_max(l.alpha, LOBE_LEAST);
    struct lum_ggx_albedo e = lum_ggx_albedo(lum_ggx_row(alpha), lum_dot(n, w));
    float albedo = l.f0 * e.scale + l.f90 * e.bias;
    bool any = gloss > 0.0f && albedo > 0.0f;
    set->lobe[slot] = any ? gloss : 0.0f;
    set->wx[slot] = w.x, set->wy[slot] = w.y, set->wz[slot] = w.z;
    set->alpha[slot] = alpha;
    set->f0[slot] = any ? l.f0 / albedo : 0.0f;
    set->f90[slot] = any ? l.f90 / albedo : 0.0f;
}

/* n: to the side that it shines on. */
static bool leave_vpl(struct walk *w, const struct path *path, const struct lum_surface *s, struct lum_vec3 n,
                      struct lum_rgb albedo, uint32_t *ret_slot)
{
    float weight;
    uint32_t slot = lum_vpl_plan_slot(w->plan, path->share, path->number, path->bounce, &weight);
    if (slot == LUM_NO_OBJECT)
        return false;
    struct lum_rgb flux = lum_rgb_scale(lum_rgb_mul(path->flux, albedo), weight);
    if (lum_rgb_black(flux))
        return false;
    if (!lum_rgb_finite(flux) || !lum_v3_finite(s->p)) {
        w->counters->nonfinite++;
        return false;
    }
    struct lum_vpl_set *set = w->set;
    set->px[slot] = s->p.x, set->py[slot] = s->p.y, set->pz[slot] = s->p.z;
    set->nx[slot] = n.x, set->ny[slot] = n.y, set->nz[slot] = n.z;
    set->flux_unit[0][slot] = flux.r, set->flux_unit[1][slot] = flux.g, set->flux_unit[2][slot] = flux.b;
    set->importance[slot] = path->importance * fmaxf(path->left, IMPORTANCE_FLOOR) * weight;
    set->light[slot] = path->share; /* shares are in the order of the light table */
    set->object[slot] = s->instance;
    set->prim[slot] = s->prim;
    *ret_slot = slot;
    return true;
}

/* What of the lobes is left out. Light that comes straight from a lamp goes on by gloss all the same: as in path, where
 * that is direct light, and the effect glossy is what is seen by way of gloss. */
static uint32_t off_for(const struct walk *w, const struct path *path)
{
    return path->n_segments > 0 ? w->set->lobes_off : w->set->lobes_off & ~LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY);
}

/* False: the lobe is left out. Where gloss is, what is sampled of the base that it covers is of the base alone. */
static bool goes_on(uint32_t lobes_off, const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_bsdf_sample *inout)
{
    static const uint32_t effects[] = {
        [LUM_LOBE_DIFFUSE] = 0,
        [LUM_LOBE_DIFFUSE_TRANSMIT] = 0,
        [LUM_LOBE_GLOSSY] = LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY),
        [LUM_LOBE_REFLECT] = LUM_EFFECT_BIT(LUM_EFFECT_REFLECTION),
        [LUM_LOBE_TRANSMIT] = LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION),
        [LUM_LOBE_GLOSSY_TRANSMIT] = LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION),
    };
    if (lobes_off & effects[inout->lobe])
        return false;
    if (inout->lobe != LUM_LOBE_DIFFUSE || !lum_bsdf_has_gloss(b) || !(lobes_off & LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY)))
        return true;
    struct lum_rgb f = lum_bsdf_eval_parts(b, wo, inout->wi).diffuse;
    float pdf_sa = lum_bsdf_cosine_pdf(b, inout->wi);
    if (!(pdf_sa > 0.0f))
        return false;
    inout->weight = lum_rgb_scale(f, 1.0f / pdf_sa);
    return true;
}

/* Reflection that the lobe of the surface's own VPL does not have. */
static bool is_of_mirror(const struct lum_bsdf *b, struct lum_vec3 wo, enum lum_lobe lobe)
{
    bool rough_glass = lobe == LUM_LOBE_GLOSSY && b->glass > 0.0f && !(b->sheen.weight > 0.0f);
    return lobe == LUM_LOBE_REFLECT || (rough_glass && lum_rgb_black(lum_bsdf_gloss_albedo(b, wo)));
}

/* Where mirrors and glass send light into the open they leave a VPL, too, whose lobe is mirrored to where they send it:
 * what they focus is there in the mean, if not in its place. Without it the median of blocks of a first frame was .90
 * of that of `path` in CornellBox-Sphere, now .99, and the mean .973 and now .986 in interiors/office. What goes
 * straight on is no VPL's: rays of visibility go through panes, and frosted ones have their own; nor is what stays in a
 * solid. Nor what a lamp without extent sends straight to mirrors: no path of the reference finds that (caustic.h).
 * False: nobody needs the path any more. */
static bool leave_beam(struct walk *w, struct path *path, const struct lum_bsdf *b, const struct lum_surface *s,
                       struct lum_vec3 wo, const struct lum_bsdf_sample *bs)
{
    bool across = bs->lobe == LUM_LOBE_TRANSMIT || bs->lobe == LUM_LOBE_GLOSSY_TRANSMIT;
    if (!w->set->gloss || (across ? b->straight || b->thin : !is_of_mirror(b, wo, bs->lobe)))
        return true;
    bool solid = b->glass > 0.0f && !b->thin && !b->straight, inside = across != s->backface;
    if ((solid && inside) || !path->found)
        return true;
    struct lum_vec3 n = across ? lum_v3_neg(b->ng) : b->ng;
    struct lum_vec3 mirrored = lum_v3_sub(lum_v3_mul(n, 2.0f * lum_dot(n, bs->wi)), bs->wi);
    uint32_t slot;
    if (leave_vpl(w, path, s, n, lum_grey(1.0f), &slot))
        set_lobe(w->set, slot, (struct lum_gloss_lobe){LOBE_LEAST, 1.0f, 1.0f}, n, mirrored, 1.0f);
    return path->bounce++ != path->last;
}

/* Sends the path on; it is appended to the batch. */
static void scatter(struct walk *w, struct path path, const struct lum_bsdf *b, const struct lum_surface *s,
                    struct lum_vec3 wo)
{
    uint32_t pair = path.n_segments * PAIRS_PER_SEGMENT;
    struct lum_vec2 lobe = {0.5f, 0.5f};
    if (b->diffuse_prob < 1.0f || b->far_prob > 0.0f) /* there is something to choose */
        lobe = lum_sampler_2d(&path.sampler, PAIR_LOBE + pair);
    struct lum_bsdf_sample bs;
    if (!lum_bsdf_sample(b, wo, lum_sampler_2d(&path.sampler, PAIR_BSDF + pair), lobe.x, &bs))
        return;
    bool transmitted = bs.lobe == LUM_LOBE_TRANSMIT || bs.lobe == LUM_LOBE_GLOSSY_TRANSMIT;
    if (!goes_on(off_for(w, &path), b, wo, &bs))
        return;
    float eta2 = transmitted && !b->thin && !b->straight ? b->eta * b->eta : 1.0f; /* is in radiance, and not in flux */
    path.flux = lum_rgb_scale(lum_rgb_mul(path.flux, bs.weight), 1.0f / eta2);
    if (lum_rgb_black(path.flux) || path.n_segments > path.last + SPECULAR_MAX)
        return;
    path.found |= bs.pdf_sa > 0.0f;
    if (!leave_beam(w, &path, b, s, wo, &bs))
        return;
    path.n_segments++;
    w->path[w->rays.n] = path;
    lum_rays_push(&w->rays, lum_ray_offset(s->p, lum_dot(bs.wi, b->ng) >= 0.0f ? b->ng : lum_v3_neg(b->ng)), bs.wi,
                  INFINITY);
}

/* What a VPL sends on: evenly, and by a lobe. */
struct sent {
    struct lum_rgb even, gloss;
};

static struct sent sent_back(const struct walk *w, const struct path *path, const struct lum_bsdf *b,
                             struct lum_vec3 wo)
{
    struct sent sent = {0};
    if (!lum_rgb_black(b->diffuse)) /* what metals scatter evenly is little, and not worth a slot */
        sent.even = lum_bsdf_diffuse_albedo(b);
    if (!w->set->gloss || (off_for(w, path) & LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY)))
        return sent;
    sent.gloss = lum_bsdf_gloss_albedo(b, wo);
    if (b->sheen.weight > 0.0f)
        sent.even = lum_rgb_add(sent.even, lum_bsdf_sheen_albedo(b, wo));
    return sent;
}

/* Sheets, and, where there are lobes, thin rough glass. */
static struct sent sent_through(const struct walk *w, const struct lum_bsdf *b, struct lum_vec3 wo)
{
    struct sent sent = {0};
    if (w->set->lobes_off & LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION))
        return sent;
    if (w->set->gloss)
        sent.gloss = lum_bsdf_haze_albedo(b, wo, &sent.even);
    if (b->far_prob > 0.0f) {
        struct lum_bsdf far = lum_bsdf_far_side(b);
        sent.even = lum_rgb_add(sent.even, lum_bsdf_diffuse_albedo(&far));
    }
    return sent;
}

/* A slot holds one VPL: the one on this side or the one on the far side, in proportion to their luminance. False: there
 * is none. */
static bool leave_one(struct walk *w, const struct path *path, const struct lum_surface *s, const struct lum_bsdf *b,
                      struct lum_vec3 wo)
{
    struct sent back = sent_back(w, path, b, wo), through = sent_through(w, b, wo);
    struct lum_rgb up = lum_rgb_add(back.even, back.gloss), down = lum_rgb_add(through.even, through.gloss);
    float far = lum_luminance(down), both = far + lum_luminance(up);
    if (!(both > 0.0f))
        return false;
    uint32_t pair = PAIR_LOBE + path->n_segments * PAIRS_PER_SEGMENT, slot;
    /* How the path goes on takes the other coordinate. */
    bool crosses = far > 0.0f && lum_sampler_2d(&path->sampler, pair).y < far / both;
    struct lum_rgb albedo = crosses ? lum_rgb_scale(down, both / far) : up;
    if (!crosses && far > 0.0f)
        albedo = lum_rgb_scale(up, both / (both - far));
    struct lum_vec3 n = crosses ? lum_v3_neg(s->ng) : s->ng, w_lobe = wo;
    struct lum_gloss_lobe lobe = {b->alpha, 1.0f, 1.0f};
    if (crosses) /* facets of a sheet let light through as if they mirrored it to the other side */
        w_lobe = lum_v3_mad(wo, s->ng, -2.0f * lum_dot(wo, s->ng));
    else
        lobe = lum_bsdf_gloss_lobe(b, wo);
    if (leave_vpl(w, path, s, n, albedo, &slot))
        set_lobe(w->set, slot, lobe, n, w_lobe,
                 crosses ? lum_luminance(through.gloss) / far : lum_luminance(back.gloss) / lum_luminance(up));
    return true;
}

/* Ray i of the batch came back. What escapes, or meets an emitter's shape or an unlit surface, is gone. */
static void visit(struct walk *w, uint32_t i)
{
    if (w->hits.object[i] == LUM_NO_OBJECT)
        return;
    struct path path = w->path[i];
    struct lum_vec3 d = lum_rays_direction(&w->rays, i), wo = lum_v3_neg(d);
    struct lum_surface s;
    lum_snapshot_surface(w->snapshot, &w->hits, i, d, &s);
    if (s.instance == LUM_NO_OBJECT || w->snapshot->materials[s.material].unlit)
        return;
    const struct lum_material *m = &w->snapshot->materials[s.material];
    if (w->media) {
        bool from_afar = path.n_segments == 0 && lum_light_is_from_afar(&w->snapshot->lights.lights[path.share]);
        float length = from_afar ? INFINITY : w->hits.t[i];
        path.flux = lum_rgb_mul(path.flux, lum_media_transmittance(w->snapshot, s.p, wo, length));
    }
    if (s.backface)
        path.flux = lum_rgb_mul(path.flux, lum_material_transmittance(m, w->hits.t[i]));
    struct lum_bsdf b;
    lum_bsdf_init(&b, m, &s, wo);
    if (w->snapshot->has_sheets && !(w->set->lobes_off & LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION)))
        lum_bsdf_add_far_side(&b);
    if (leave_one(w, &path, &s, &b, wo)) {
        if (path.bounce++ == path.last)
            return;
        path.left *= ALBEDO_GUESS;
    }
    scatter(w, path, &b, &s, wo);
}

/* A light is as important as it has paths: half by its flux when it was first seen, half alike, so that those that were
 * dim then are still asked for when they are all that is left. By powers of 2: what moves elsewhere, and changes the
 * shares a little, leaves importance as it is. */
static float importance_of(const struct walk *w, uint32_t light, const struct lum_light_ray *shot)
{
    const struct lum_snapshot *s = w->snapshot;
    const struct lum_vpl_share *share = &w->plan->shares[light];
    double flux_unit = lum_light_flux_unit(&s->lights.lights[light], s->bounds_lo, s->bounds_hi);
    return (float)(exp2(round(log2(share->upto - share->below))) * (double)lum_luminance(shot->flux_unit) / flux_unit);
}

/* Path number `index` of all leaves its light. */
static void start(struct walk *w, uint32_t index)
{
    struct path path = {0};
    uint32_t salt;
    lum_vpl_plan_path(w->plan, index, &path.share, &path.number, &path.last, &salt);
    path.sampler = lum_sampler_at(salt, 0, path.number, w->plan->seed);
    struct lum_light_ray shot;
    if (!lum_light_emit(w->snapshot, path.share, &w->set->portals, lum_sampler_2d(&path.sampler, PAIR_POSITION),
                        lum_sampler_2d(&path.sampler, PAIR_DIRECTION), &shot))
        return;
    path.flux = shot.flux_unit;
    path.left = 1.0f;
    path.found = !w->snapshot->lights.lights[path.share].delta;
    path.importance = importance_of(w, path.share, &shot);
    w->path[w->rays.n] = path;
    lum_rays_push(&w->rays, shot.o, shot.d, INFINITY);
}

static void walk_batch(struct walk *w, uint32_t first, uint32_t n)
{
    w->rays.n = 0;
    for (uint32_t i = 0; i < n; i++)
        start(w, first + i);
    struct lum_trace trace = lum_trace_of(w->snapshot, w->counters);
    while (w->rays.n > 0) {
        uint32_t n_rays = w->rays.n;
        w->counters->rays[LUM_RAY_VPL] += lum_known_closest(w->known, &trace, &w->rays, &w->hits);
        w->rays.n = 0;
        for (uint32_t i = 0; i < n_rays; i++) /* path i is read before a path j <= i is written */
            visit(w, i);
    }
}

/* ---- over the pool ---- */

struct jobs {
    void (*run)(void *ctx, uint32_t job, struct lum_counters *counters);
    void *ctx;
    struct lum_counters *counters; /* by worker */
};

static void run_job(void *ctx, uint32_t job, uint32_t worker)
{
    const struct jobs *jobs = ctx;
    jobs->run(jobs->ctx, job, &jobs->counters[worker]);
}

static void add_counters(struct lum_counters *sum, const struct lum_counters *c)
{
    sum->rays[LUM_RAY_VPL] += c->rays[LUM_RAY_VPL];
    sum->nonfinite += c->nonfinite;
    sum->bad_rays += c->bad_rays;
}

enum lum_status lum_vpl_run(const struct lum_vpl_request *rq, uint32_t n_jobs,
                            void (*run)(void *ctx, uint32_t job, struct lum_counters *counters), void *ctx,
                            struct lum_error *err)
{
    uint32_t n_workers = rq->pool && n_jobs > 1 ? lum_pool_size(rq->pool) : 1;
    struct lum_counters *counters = lum_calloc(n_workers, sizeof *counters);
    if (!counters)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the counters of %u workers", n_workers);
    struct jobs jobs = {run, ctx, counters};
    enum lum_status status = LUM_OK;
    if (n_workers > 1)
        status = lum_pool_run(rq->pool, n_jobs, run_job, &jobs, NULL);
    else
        for (uint32_t job = 0; job < n_jobs; job++)
            run_job(&jobs, job, 0);
    for (uint32_t i = 0; i < n_workers; i++)
        add_counters(rq->counters, &counters[i]);
    lum_free(counters);
    return status;
}

struct emission {
    const struct lum_vpl_request *request;
    const struct lum_vpl_plan *plan;
    struct lum_vpl_set *set;
};

static void emit_batch(void *ctx, uint32_t batch, struct lum_counters *counters)
{
    const struct emission *emission = ctx;
    struct walk w;
    w.snapshot = emission->request->snapshot;
    w.known = &emission->request->known;
    w.plan = emission->plan;
    w.set = emission->set;
    w.counters = counters;
    w.media = emission->set->versions.medium != 0;
    uint32_t first = batch * LUM_RAY_BATCH, left = w.plan->n_paths - first;
    walk_batch(&w, first, left < LUM_RAY_BATCH ? left : LUM_RAY_BATCH);
}

enum lum_status lum_vpl_emit(const struct lum_vpl_request *rq, const struct lum_vpl_plan *plan, struct lum_vpl_set *set,
                             struct lum_error *err)
{
    struct emission emission = {rq, plan, set};
    return lum_vpl_run(rq, (plan->n_paths + LUM_RAY_BATCH - 1) / LUM_RAY_BATCH, emit_batch, &emission, err);
}
