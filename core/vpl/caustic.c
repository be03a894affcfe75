/* How much light mirrors and solid glass focus, by light paths. */
#include "core/vpl/caustic.h"

#include <stdio.h>
#include <string.h>

#include "core/light/emit.h"
#include "core/material/bsdf.h"
#include "core/math/sampler.h"
#include "core/scene/surface.h"
#include "core/trace/rays.h"
#include "core/trace/stale.h"
#include "core/vpl/share.h"

/* Sampler pairs: the light's two, then one for each segment. */
enum { PAIR_POSITION = 0, PAIR_DIRECTION = 1, PAIR_LOBE = 2 };

#define N_BATCHES (LUM_CAUSTIC_PATHS / LUM_RAY_BATCH)
_Static_assert(LUM_CAUSTIC_PATHS % LUM_RAY_BATCH == 0, "paths fill their batches");

/* What a path found, as shares of the flux that it left its light with. */
struct finding {
    struct lum_rgb arriving, focused;
    uint32_t object; /* first one that sent it on; LUM_NO_OBJECT: none */
};

/* Sums over the paths of a light; per unit of its power, in scene units, but for flux_unit / n_paths. */
struct lum_caustic_light {
    uint32_t light;
    uint32_t first_path, n_paths;
    double n_expected; /* paths by its share of all: n_paths is this, rounded up or down */
    double flux_unit;
    double arriving[3], focused[3];                             /* by colour */
    double arriving_squared, focused_squared, arriving_focused; /* products of luminances */
    uint32_t object;                                            /* LUM_NO_OBJECT: nothing is focused */
};

struct path {
    struct lum_rgb left; /* of the flux that it started with */
    uint32_t index;      /* among all paths */
    uint32_t n_segments;
    bool arrived;
    struct lum_sampler sampler;
};

/* A batch of paths, densely packed: path i has ray i. Lives on a worker's stack. */
struct walk {
    const struct lum_snapshot *snapshot;
    struct finding *findings; /* of all paths */
    struct lum_counters *counters;
    struct lum_rays rays;
    struct lum_hits hits;
    struct path path[LUM_RAY_BATCH];
};

/* ---- one path ---- */

static struct lum_rgb times_flux(struct lum_rgb left, const struct lum_bsdf *b, const struct lum_bsdf_sample *lobe)
{
    bool bent = lobe->lobe == LUM_LOBE_TRANSMIT && !b->thin && !b->straight;
    float eta2 = bent ? b->eta * b->eta : 1.0f; /* is in radiance, and not in flux */
    return lum_rgb_scale(lum_rgb_mul(left, lobe->weight), 1.0f / eta2);
}

static bool spreads(const struct lum_bsdf *b)
{
    return !lum_rgb_black(b->diffuse) || lum_clearcoat_is_gloss(b) || b->sheen.share > 0.0f ||
           (b->alpha > 0.0f && (b->f90 > 0.0f || b->glass > 0.0f));
}

/* One of the lobes, with a chance as large as what it sends on: else the path ends. */
static bool pick_lobe(const struct lum_rgb *sent, const struct lum_rgb *left, uint32_t n_lobes, float u,
                      uint32_t *ret_lobe, float *ret_prob)
{
    float before = lum_rgb_max(*left), below = 0.0f;
    for (uint32_t k = 0; k < n_lobes; k++) {
        float prob = lum_min(lum_rgb_max(sent[k]) / before, 1.0f);
        *ret_lobe = k;
        *ret_prob = prob;
        if (u < below + prob)
            return true;
        below += prob;
    }
    return false;
}

static void go_on(struct walk *w, struct path path, struct lum_rgb left, const struct lum_bsdf *b, struct lum_vec3 p,
                  struct lum_vec3 wi)
{
    path.left = left;
    if (lum_rgb_black(left) || ++path.n_segments == LUM_CAUSTIC_SEGMENTS)
        return;
    w->path[w->rays.n] = path;
    lum_rays_push(&w->rays, lum_ray_offset(p, lum_dot(wi, b->ng) >= 0.0f ? b->ng : lum_v3_neg(b->ng)), wi, INFINITY);
}

/* What the lobes without spread leave to the surface itself. */
static struct lum_rgb kept(struct lum_rgb left, const struct lum_rgb *sent, uint32_t n_lobes)
{
    for (uint32_t k = 0; k < n_lobes; k++)
        left = lum_rgb(left.r - sent[k].r, left.g - sent[k].g, left.b - sent[k].b);
    return lum_rgb(lum_max(left.r, 0.0f), lum_max(left.g, 0.0f), lum_max(left.b, 0.0f));
}

/* Flux `path.left` meets a surface. */
static void meet(struct walk *w, struct path path, const struct lum_bsdf *b, const struct lum_surface *s, bool pane,
                 struct lum_vec3 wo)
{
    struct lum_bsdf_sample lobes[2];
    struct lum_rgb sent[2];
    uint32_t n_lobes = lum_bsdf_delta_lobes(b, wo, lobes), lobe;
    float prob;
    for (uint32_t k = 0; k < n_lobes; k++)
        sent[k] = times_flux(path.left, b, &lobes[k]);
    struct finding *f = &w->findings[path.index];
    struct lum_rgb here = spreads(b) ? kept(path.left, sent, n_lobes) : lum_grey(0.0f);
    if (!lum_rgb_finite(path.left) || !lum_rgb_finite(here)) {
        w->counters->nonfinite++;
        return;
    }
    if (!path.arrived)
        f->arriving = lum_rgb_add(f->arriving, pane ? here : path.left);
    if (f->object != LUM_NO_OBJECT)
        f->focused = lum_rgb_add(f->focused, here);
    if (pane) {
        go_on(w, path, lum_rgb_mul(path.left, lum_bsdf_straight(b, wo)), b, s->p, lum_v3_neg(wo));
        return;
    }
    path.arrived = true;
    float u = n_lobes > 0 ? lum_sampler_1d(&path.sampler, PAIR_LOBE + path.n_segments) : 0.0f;
    if (!pick_lobe(sent, &path.left, n_lobes, u, &lobe, &prob))
        return;
    if (f->object == LUM_NO_OBJECT)
        f->object = s->instance;
    go_on(w, path, lum_rgb_scale(sent[lobe], 1.0f / prob), b, s->p, lobes[lobe].wi);
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
    if (s.backface)
        path.left = lum_rgb_mul(path.left, lum_material_transmittance(m, w->hits.t[i]));
    if (lum_rgb_black(path.left))
        return;
    struct lum_bsdf b;
    lum_bsdf_init(&b, m, &s, wo);
    meet(w, path, &b, &s, lum_material_is_pane(m), wo);
}

static void start(struct walk *w, const struct lum_caustic_light *l, uint32_t index)
{
    uint32_t salt = lum_hash_text(w->snapshot->lights.lights[l->light].id);
    struct path path = {.left = lum_grey(1.0f), .index = index};
    path.sampler = lum_sampler_at(salt, 0, index - l->first_path, 0);
    w->findings[index] = (struct finding){.object = LUM_NO_OBJECT};
    struct lum_light_ray shot;
    if (!lum_light_emit(w->snapshot, l->light, NULL, lum_sampler_2d(&path.sampler, PAIR_POSITION),
                        lum_sampler_2d(&path.sampler, PAIR_DIRECTION), &shot))
        return;
    w->path[w->rays.n] = path;
    lum_rays_push(&w->rays, shot.o, shot.d, INFINITY);
}

/* ---- all paths ---- */

struct emission {
    const struct lum_snapshot *snapshot;
    const struct lum_caustic_light *lights; /* in the order of their paths */
    struct finding findings[LUM_CAUSTIC_PATHS];
    struct lum_counters counters[N_BATCHES];
};

static void emit_batch(void *ctx, uint32_t batch, uint32_t worker)
{
    (void)worker;
    struct emission *emission = ctx;
    struct walk w;
    w.snapshot = emission->snapshot;
    w.findings = emission->findings;
    w.counters = &emission->counters[batch];
    w.rays.n = 0;
    const struct lum_caustic_light *l = emission->lights;
    for (uint32_t k = 0; k < LUM_RAY_BATCH; k++) {
        uint32_t index = batch * LUM_RAY_BATCH + k;
        while (index >= l->first_path + l->n_paths)
            l++;
        start(&w, l, index);
    }
    struct lum_trace trace = lum_trace_of(w.snapshot, w.counters);
    while (w.rays.n > 0) {
        uint32_t n_rays = w.rays.n;
        w.counters->rays[LUM_RAY_VPL] += n_rays;
        lum_trace_closest(&trace, &w.rays, &w.hits);
        w.rays.n = 0;
        for (uint32_t i = 0; i < n_rays; i++) { /* path i is read before a path j <= i is written */
            lum_snapshot_ask_ahead(w.snapshot, &w.hits, i, n_rays);
            visit(&w, i);
        }
    }
}

/* The object that most of the light's focused paths met first. by_object: zeroed, and left so. */
static void find_object(struct lum_caustic_light *l, const struct finding *findings, double *by_object)
{
    double most = 0.0;
    for (uint32_t i = 0; i < l->n_paths; i++) {
        if (findings[i].object == LUM_NO_OBJECT)
            continue;
        double sum = by_object[findings[i].object] += (double)lum_luminance(findings[i].focused);
        if (sum > most) {
            most = sum;
            l->object = findings[i].object;
        }
    }
    for (uint32_t i = 0; i < l->n_paths; i++)
        if (findings[i].object != LUM_NO_OBJECT)
            by_object[findings[i].object] = 0.0;
}

static void sum_up(struct lum_caustic_light *l, const struct finding *findings, double *by_object)
{
    for (uint32_t i = 0; i < l->n_paths; i++) {
        const struct finding *f = &findings[i];
        double a = (double)lum_luminance(f->arriving), c = (double)lum_luminance(f->focused);
        const float arriving[] = {f->arriving.r, f->arriving.g, f->arriving.b};
        const float focused[] = {f->focused.r, f->focused.g, f->focused.b};
        for (int k = 0; k < 3; k++) {
            l->arriving[k] += (double)arriving[k];
            l->focused[k] += (double)focused[k];
        }
        l->arriving_squared += a * a;
        l->focused_squared += c * c;
        l->arriving_focused += a * c;
    }
    find_object(l, findings, by_object);
}

static void count(struct lum_caustics *c, const struct emission *emission)
{
    for (uint32_t b = 0; b < N_BATCHES; b++) {
        c->report.n_rays += emission->counters[b].rays[LUM_RAY_VPL];
        c->bad_rays += emission->counters[b].bad_rays;
        c->nonfinite += emission->counters[b].nonfinite;
    }
}

static enum lum_status emit_all(struct lum_caustics *c, const struct lum_snapshot *s, struct lum_pool *pool,
                                struct lum_error *err)
{
    struct emission *emission = lum_calloc(1, sizeof *emission);
    double *by_object = lum_calloc(s->n_instances, sizeof *by_object);
    enum lum_status status = LUM_OK;
    if (!emission || !by_object) {
        status = lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u light paths", LUM_CAUSTIC_PATHS);
    } else {
        emission->snapshot = s;
        emission->lights = c->lights;
        status = lum_pool_run(pool, N_BATCHES, emit_batch, emission, NULL);
        for (uint32_t k = 0; k < c->n_lights; k++)
            sum_up(&c->lights[k], emission->findings + c->lights[k].first_path, by_object);
        count(c, emission);
    }
    lum_free(by_object);
    lum_free(emission);
    return status;
}

/* ---- which lights ---- */

/* Something that sends light on without spread, and not straight. */
static bool may_focus(const struct lum_snapshot *s)
{
    for (uint32_t i = 0; i < s->n_instances; i++) {
        const struct lum_material *m = &s->materials[s->instances[i].material];
        if (lum_material_scatter(m) & LUM_SCATTER_MIRROR && !lum_material_is_pane(m))
            return true;
    }
    return false;
}

/* A lamp without extent that is on. */
static bool counts(const struct lum_snapshot *s, uint32_t light)
{
    return s->lights.lights[light].delta && !lum_rgb_black(lum_light_present_power(&s->lights, light));
}

static uint32_t n_counting(const struct lum_snapshot *s)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < s->lights.n_lights; i++)
        n += counts(s, i);
    return n;
}

static double flux_now(const struct lum_snapshot *s, const struct lum_caustic_light *l)
{
    return l->flux_unit * (double)lum_luminance(lum_light_present_power(&s->lights, l->light));
}

/* Half of the paths by flux, half to all alike. */
static void share_paths(struct lum_caustics *c, const struct lum_snapshot *s)
{
    double all = 0.0, below = 0.0, n = (double)c->n_lights;
    for (uint32_t k = 0; k < c->n_lights; k++)
        all += flux_now(s, &c->lights[k]);
    uint32_t first = 0;
    for (uint32_t k = 0; k < c->n_lights; k++) {
        struct lum_caustic_light *l = &c->lights[k];
        double share = 0.5 * (all > 0.0 ? flux_now(s, l) / all : 1.0 / n) + 0.5 / n;
        below += share;
        uint32_t upto = k + 1 == c->n_lights ? LUM_CAUSTIC_PATHS : (uint32_t)(below * LUM_CAUSTIC_PATHS + 0.5);
        upto = upto < LUM_CAUSTIC_PATHS ? upto : LUM_CAUSTIC_PATHS;
        l->first_path = first;
        l->n_paths = upto - first;
        l->n_expected = share * LUM_CAUSTIC_PATHS;
        first = upto;
    }
}

static enum lum_status list_lights(struct lum_caustics *c, const struct lum_snapshot *s, uint32_t n,
                                   struct lum_error *err)
{
    c->lights = lum_calloc(n, sizeof *c->lights);
    if (!c->lights)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u lights", n);
    for (uint32_t i = 0; i < s->lights.n_lights; i++) {
        if (!counts(s, i))
            continue;
        double flux_unit = lum_light_flux_unit(&s->lights.lights[i], s->bounds_lo, s->bounds_hi);
        c->lights[c->n_lights++] =
            (struct lum_caustic_light){.light = i, .flux_unit = flux_unit, .object = LUM_NO_OBJECT};
    }
    share_paths(c, s);
    return LUM_OK;
}

/* ---- the report ---- */

static double luminous(const double rgb[3], struct lum_rgb power)
{
    struct lum_rgb c = lum_rgb((float)rgb[0], (float)rgb[1], (float)rgb[2]);
    return (double)lum_luminance(lum_rgb_mul(c, power));
}

/* Over the paths of one light or of several, in lm and lm^2. */
struct sums {
    double arriving, focused, arriving_squared, focused_squared, arriving_focused;
};

/* n_paths: over which its flux is spread. */
static struct sums sums_of(const struct lum_caustic_light *l, const struct lum_snapshot *s, double n_paths)
{
    struct lum_rgb power = lum_light_present_power(&s->lights, l->light);
    double unit = l->n_paths > 0 ? l->flux_unit / n_paths / (s->norm.scale * s->norm.scale) : 0.0;
    double grey = unit * (double)lum_luminance(power);
    return (struct sums){unit * luminous(l->arriving, power), unit * luminous(l->focused, power),
                         grey * grey * l->arriving_squared, grey * grey * l->focused_squared,
                         grey * grey * l->arriving_focused};
}

/* The standard error is that of the sum of focused - share * arriving, whose mean is 0. */
static struct lum_caustic_amount amount_of(const struct sums *m)
{
    double share = m->arriving > 0.0 ? m->focused / m->arriving : 0.0;
    double variance = m->focused_squared - 2.0 * share * m->arriving_focused + share * share * m->arriving_squared;
    return (struct lum_caustic_amount){m->arriving, m->focused, sqrt(fmax(variance, 0.0))};
}

/* Kept in order, the most focused light first. */
static void tell_light(struct lum_caustic_report *r, const struct lum_caustic_light *l, const struct lum_snapshot *s,
                       const struct lum_caustic_amount *amount)
{
    uint32_t at = r->n_lights;
    while (at > 0 && r->lights[at - 1].amount.focused_lm < amount->focused_lm)
        at--;
    if (at == LUM_CAUSTIC_LIGHTS)
        return;
    r->n_lights += r->n_lights < LUM_CAUSTIC_LIGHTS;
    memmove(&r->lights[at + 1], &r->lights[at], (r->n_lights - 1 - at) * sizeof r->lights[0]);
    struct lum_caustic_of_light *told = &r->lights[at];
    const struct lum_instance *object = &s->instances[l->object];
    snprintf(told->id, sizeof told->id, "%s", s->lights.lights[l->light].id);
    snprintf(told->object, sizeof told->object, "%s", object->id);
    told->glass = lum_material_scatter(&s->materials[object->material]) & LUM_SCATTER_THROUGH;
    told->from_afar = s->lights.lights[l->light].kind == &lum_emitter_directional;
    told->amount = *amount;
}

static void report(struct lum_caustics *c, const struct lum_snapshot *s)
{
    struct lum_caustic_report *r = &c->report;
    struct sums all = {0};
    r->known = true;
    r->scene_rev = s->scene_rev;
    r->n_lights = 0;
    for (uint32_t k = 0; k < c->n_lights; k++) {
        const struct lum_caustic_light *l = &c->lights[k];
        struct sums own = sums_of(l, s, l->n_paths), m = own;
        if (l->n_expected < 1.0) /* those that have a path stand for those that have none */
            m = sums_of(l, s, l->n_expected);
        all.arriving += m.arriving;
        all.focused += m.focused;
        all.arriving_squared += m.arriving_squared;
        all.focused_squared += m.focused_squared;
        all.arriving_focused += m.arriving_focused;
        struct lum_caustic_amount amount = amount_of(&own);
        if (amount.focused_lm > 0.0 && l->object != LUM_NO_OBJECT)
            tell_light(r, l, s, &amount);
    }
    r->all = amount_of(&all);
}

double lum_caustic_share(const struct lum_caustic_amount *amount)
{
    return amount->arriving_lm > 0.0 ? amount->focused_lm / amount->arriving_lm : 0.0;
}

double lum_caustic_share_stderr(const struct lum_caustic_amount *amount)
{
    return amount->arriving_lm > 0.0 ? amount->stderr_lm / amount->arriving_lm : 0.0;
}

/* ---- when ---- */

/* Every lamp that counts has had its paths, and nothing has changed on their way. */
static bool is_known(const struct lum_caustics *c, const struct lum_snapshot *s)
{
    if (!c->report.known || lum_is_stale(lum_edits_of_versions(&c->versions, &s->versions), LUM_PRODUCT_CAUSTICS))
        return false;
    uint32_t n = 0;
    for (uint32_t k = 0; k < c->n_lights; k++)
        n += counts(s, c->lights[k].light);
    return !c->focusing || n == n_counting(s);
}

bool lum_caustics_serve(const struct lum_caustics *c, const struct lum_snapshot *s)
{
    return is_known(c, s) || !may_focus(s) || n_counting(s) == 0;
}

enum lum_status lum_caustics_update(struct lum_caustics *c, const struct lum_snapshot *s, struct lum_pool *pool,
                                    struct lum_error *err)
{
    if (is_known(c, s)) {
        c->versions = s->versions;
        c->report.n_rays = c->bad_rays = c->nonfinite = 0;
        report(c, s);
        return LUM_OK;
    }
    struct lum_caustics next = {.focusing = may_focus(s), .versions = s->versions};
    uint32_t n = next.focusing ? n_counting(s) : 0;
    enum lum_status status = n > 0 ? list_lights(&next, s, n, err) : LUM_OK;
    if (status == LUM_OK && n > 0)
        status = emit_all(&next, s, pool, err);
    if (status != LUM_OK) {
        lum_caustics_finish(&next);
        return status;
    }
    report(&next, s);
    lum_caustics_finish(c);
    *c = next;
    return LUM_OK;
}

void lum_caustics_finish(struct lum_caustics *c)
{
    lum_free(c->lights);
    *c = (struct lum_caustics){0};
}
