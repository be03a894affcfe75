#include "core/measure/meter.h"

#include <string.h>

#include "core/light/sample.h"
#include "core/math/sampler.h"
#include "core/math/sampler_pairs.h"
#include "core/pass/settings.h"
#include "core/path/wave.h"

/* With fewer, what is rare and bright is missed so often that what is known looks better. */
#define FIRST_SAMPLES 1024u
#define GLANCE_PATHS 32u
#define GLANCE_RAYS 512u /* shadow rays of a glance; and where that is less than one for each lamp, paths alone */
#define MORE_MAX 1048576u
#define RECHECK_SAMPLES 32u /* that take as long as finding out about the clearance of a place */

#define PAIR_TURN LUM_WAVE_PAIR_PIXEL /* which way a cylinder's plane is turned */

/* What one place knows. */
struct knows {
    enum lum_clearance clearance;
    bool checked; /* that is of the geometry there is now */
    bool glanced;
    double direct, direct_variance, indirect, indirect_variance; /* of the glance */
    double sum, square;                                          /* of n path samples */
    uint64_t n, target;                                          /* paths until its error is looked at again */
};

struct lum_meter {
    struct lum_meter_place *places;
    struct knows *knows;
    uint32_t n, seed, looked, next; /* next: whose turn it is */
    const struct lum_snapshot *snapshot;
    uint64_t geometry, n_samples;
    double glance_variance, glance_square; /* of the indirect light of all glances: sums */
};

enum lum_status lum_meter_create(const struct lum_meter_place *places, uint32_t n, uint32_t seed,
                                 struct lum_meter **ret_meter, struct lum_error *err)
{
    struct lum_meter *m = lum_calloc(1, sizeof *m);
    if (m) {
        *m = (struct lum_meter){.n = n, .seed = seed};
        m->places = lum_calloc(n, sizeof *m->places);
        m->knows = lum_calloc(n, sizeof *m->knows);
    }
    if (!m || !m->places || !m->knows) {
        lum_meter_destroy(m);
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for %u places", n);
    }
    for (uint32_t i = 0; i < n; i++) {
        m->places[i] = places[i];
        m->places[i].normal = lum_normalize(places[i].normal);
    }
    *ret_meter = m;
    return LUM_OK;
}

void lum_meter_destroy(struct lum_meter *m)
{
    if (!m)
        return;
    lum_snapshot_unref(m->snapshot);
    lum_free(m->places);
    lum_free(m->knows);
    lum_free(m);
}

enum lum_status lum_meter_copy(const struct lum_meter *of, struct lum_meter **ret_meter, struct lum_error *err)
{
    struct lum_meter *m;
    enum lum_status st = lum_meter_create(of->places, of->n, of->seed, &m, err);
    if (st)
        return st;
    struct lum_meter_place *places = m->places;
    struct knows *knows = m->knows;
    memcpy(knows, of->knows, of->n * sizeof *knows);
    *m = *of;
    m->places = places;
    m->knows = knows;
    m->snapshot = of->snapshot ? lum_snapshot_ref(of->snapshot) : NULL;
    *ret_meter = m;
    return LUM_OK;
}

void lum_meter_aim(struct lum_meter *m, const struct lum_snapshot *snapshot)
{
    bool same = m->snapshot && m->geometry == snapshot->versions.geometry &&
                lum_normalisation_equal(&m->snapshot->norm, &snapshot->norm);
    const struct lum_snapshot *was = m->snapshot;
    m->snapshot = lum_snapshot_ref(snapshot);
    lum_snapshot_unref(was);
    m->geometry = snapshot->versions.geometry;
    m->looked = m->next = 0;
    m->n_samples = 0;
    m->glance_variance = m->glance_square = 0.0;
    for (uint32_t i = 0; i < m->n; i++)
        m->knows[i] = (struct knows){.clearance = m->knows[i].clearance, .checked = same && m->knows[i].checked};
}

/* ---- geometry of a place ---- */

static struct lum_vec3 place_in_scene(const struct lum_meter *m, uint32_t i)
{
    return lum_world_to_scene(&m->snapshot->norm, m->places[i].point_world);
}

/* Axis n; b towards phi0. */
static struct lum_frame frame_of(const struct lum_meter_place *at)
{
    struct lum_frame f = lum_frame_from_normal(at->normal);
    if (at->kind != LUM_METER_HALF_CYLINDER)
        return f;
    struct lum_vec3 t = lum_v3_mad(at->facing, at->normal, -lum_dot(at->facing, at->normal));
    if (!(lum_dot(t, t) > 0.0f))
        return f;
    f.t = lum_normalize(t);
    f.b = lum_cross(f.n, f.t);
    return f;
}

/* The plane whose turn it is: of a cylinder one of those along the axis. */
static struct lum_vec3 plane_of(const struct lum_meter_place *at, const struct lum_frame *f, float turn)
{
    if (at->kind == LUM_METER_PLANE || at->kind == LUM_METER_EYE)
        return at->normal;
    float angle = LUM_PI * (at->kind == LUM_METER_CYLINDER ? 2.0f * turn : turn - 0.5f);
    return lum_frame_to_scene(f, lum_v3(cosf(angle), sinf(angle), 0.0f));
}

/* What radiance from wi counts for. */
static float response(const struct lum_meter_place *at, const struct lum_frame *f, struct lum_vec3 wi)
{
    float cos = lum_dot(wi, f->n);
    if (at->kind == LUM_METER_PLANE || at->kind == LUM_METER_EYE)
        return lum_max(cos, 0.0f);
    float sin = sqrtf(lum_max(1.0f - cos * cos, 0.0f));
    if (at->kind == LUM_METER_CYLINDER)
        return LUM_INV_PI * sin;
    return LUM_INV_PI * (sin + lum_dot(wi, f->t)); /* sin (1 + cos(phi - phi0)) */
}

/* ---- a glance ---- */

/* At places first, first + 1, ... */
struct look {
    struct lum_meter *meter;
    uint32_t first;
    bool glance;
};

/* A lamp by n samples: their mean, and the variance of that. One sample of an area may be half off; one of a lamp
 * without an area is exact. */
static void add_lamp(struct knows *k, const double *values, uint32_t n, bool exact)
{
    double mean = 0.0, variance = 0.0;
    for (uint32_t s = 0; s < n; s++)
        mean += values[s] / n;
    for (uint32_t s = 0; s < n; s++)
        variance += (values[s] - mean) * (values[s] - mean);
    k->direct += mean;
    if (!exact)
        k->direct_variance += n > 1 ? variance / ((double)n * (n - 1.0)) : 0.25 * mean * mean;
}

static void glance_lamp(const struct lum_meter *m, uint32_t place, uint32_t light, uint32_t n_rays, struct knows *k)
{
    const struct lum_snapshot *s = m->snapshot;
    const struct lum_meter_place *at = &m->places[place];
    const struct lum_frame frame = frame_of(at);
    const struct lum_vec3 p = place_in_scene(m, place);
    bool delta = s->lights.lights[light].delta;
    uint32_t n = delta ? 1 : n_rays, owner[LUM_RAY_BATCH];
    double values[LUM_RAY_BATCH] = {0};
    struct lum_rgb gain[LUM_RAY_BATCH], left[LUM_RAY_BATCH];
    struct lum_rays rays = {.n = 0};
    uint8_t occluded[LUM_RAY_BATCH];
    for (uint32_t i = 0; i < n; i++) {
        struct lum_sampler sampler = lum_sampler_at(place, light, i, m->seed);
        struct lum_light_sample ls;
        struct lum_vec2 u = delta ? (struct lum_vec2){0.5f, 0.5f} : lum_sampler_2d(&sampler, LUM_PAIRS_METER_LAMP);
        if (!lum_light_sample_at(s, light, p, u, &ls))
            continue;
        float worth = response(at, &frame, ls.wi) / (delta ? 1.0f : ls.pdf_sa);
        if (!(worth > 0.0f))
            continue;
        gain[rays.n] = lum_rgb_scale(ls.radiance, worth);
        if (s->n_media > 0)
            gain[rays.n] = lum_rgb_mul(gain[rays.n], lum_media_transmittance(s, p, ls.wi, ls.distance));
        owner[rays.n] = i;
        if (!lum_shadow_ray(&rays, p, lum_v3(0, 0, 0), ls.wi, ls.distance))
            values[i] = (double)lum_luminance(gain[rays.n]);
    }
    struct lum_counters counters = {0};
    struct lum_trace trace = lum_trace_of_light(s, &counters, true);
    if (rays.n > 0)
        lum_trace_light(&trace, &rays, occluded, left);
    for (uint32_t r = 0; r < rays.n; r++)
        if (!occluded[r])
            values[owner[r]] = (double)lum_luminance(trace.panes ? lum_rgb_mul(gain[r], left[r]) : gain[r]);
    add_lamp(k, values, n, delta);
}

/* One path of indirect light into slot i. */
static void start_indirect(struct lum_wave *w, const struct lum_meter *m, uint32_t place, uint32_t slot,
                           struct lum_sampler sampler)
{
    const struct lum_meter_place *at = &m->places[place];
    const struct lum_frame frame = frame_of(at);
    struct lum_vec3 n = plane_of(at, &frame, lum_sampler_2d(&sampler, PAIR_TURN).x);
    (void)lum_wave_add_indirect(w, slot, sampler, place_in_scene(m, place), n, n);
}

static void glance_around(const struct lum_meter *m, uint32_t place, struct knows *k)
{
    struct lum_counters counters = {0};
    struct lum_wave w;
    lum_wave_begin(&w, m->snapshot, &counters, LUM_DEPTH_DEFAULT, 0);
    w.every_light = m->snapshot->lights.n_active <= LUM_WAVE_LIGHTS; /* which one is no noise of a reading */
    for (uint32_t i = 0; i < GLANCE_PATHS; i++)
        start_indirect(&w, m, place, i, lum_sampler_at(place, 0, i, ~m->seed));
    lum_wave_run(&w, 1);
    double values[GLANCE_PATHS], mean = 0.0, variance = 0.0;
    for (uint32_t i = 0; i < GLANCE_PATHS; i++) {
        values[i] = (double)(LUM_PI * lum_luminance(w.radiance[i]));
        mean += values[i] / GLANCE_PATHS;
    }
    for (uint32_t i = 0; i < GLANCE_PATHS; i++)
        variance += (values[i] - mean) * (values[i] - mean);
    k->indirect = mean;
    k->indirect_variance = variance / (GLANCE_PATHS * (GLANCE_PATHS - 1.0));
}

static bool is_counted(const struct lum_meter_place *at, const struct lum_light *l)
{
    return at->kind != LUM_METER_EYE || l->kind == &lum_emitter_environment;
}

static void check(struct lum_meter *m, uint32_t place)
{
    struct lum_vec3 p = place_in_scene(m, place);
    bool near = lum_ray_can_start(p);
    struct knows *k = &m->knows[place];
    const struct lum_meter_place *at = &m->places[place];
    bool is_eye = at->kind == LUM_METER_EYE;
    if (is_eye && !at->is_roomy)
        k->clearance = near ? LUM_CLEARANCE_FREE : LUM_CLEARANCE_FAR;
    else
        k->clearance = lum_clearance_of(m->snapshot, p, is_eye ? lum_v3(0, 1, 0) : at->normal);
    k->checked = true;
}

static void look_job(void *ctx, uint32_t job, uint32_t worker)
{
    (void)worker;
    const struct look *look = ctx;
    struct lum_meter *m = look->meter;
    uint32_t place = look->first + job;
    struct knows *k = &m->knows[place];
    const struct lum_light_table *lights = &m->snapshot->lights;
    if (k->clearance == LUM_CLEARANCE_UNKNOWN)
        check(m, place);
    if (!look->glance || k->clearance != LUM_CLEARANCE_FREE || lights->n_active > GLANCE_RAYS)
        return;
    uint32_t n_rays = lights->n_active > 0 ? GLANCE_RAYS / lights->n_active : 1;
    n_rays = n_rays > 32 ? 32 : n_rays;
    for (uint32_t i = 0; i < lights->n_active; i++)
        if (is_counted(&m->places[place], &lights->lights[lights->active[i]]))
            glance_lamp(m, place, lights->active[i], n_rays, k);
    glance_around(m, place, k);
    k->glanced = true;
}

bool lum_meter_look(struct lum_meter *m, struct lum_pool *pool, uint32_t n_places, bool glance)
{
    uint32_t n = m->n - m->looked < n_places ? m->n - m->looked : n_places;
    struct look look = {m, m->looked, glance};
    (void)lum_pool_run(pool, n, look_job, &look, NULL); /* nobody cancels it */
    for (uint32_t i = 0; i < n; i++) {
        const struct knows *k = &m->knows[m->looked + i];
        m->glance_variance += k->indirect_variance;
        m->glance_square += k->indirect * k->indirect;
    }
    m->looked += n;
    return m->looked < m->n;
}

struct recheck {
    struct lum_meter *meter;
    uint32_t *places;
};

static void recheck_job(void *ctx, uint32_t job, uint32_t worker)
{
    (void)worker;
    const struct recheck *r = ctx;
    check(r->meter, r->places[job]);
}

/* At most n of the places whose clearance is of another geometry; counts them. */
static enum lum_status recheck(struct lum_meter *m, struct lum_pool *pool, uint32_t n, uint32_t *inout_n,
                               struct lum_error *err)
{
    struct recheck r = {m, lum_calloc(n, sizeof *r.places)};
    if (!r.places)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory to look at %u places", n);
    for (uint32_t i = 0; i < m->n && *inout_n < n; i++)
        if (!m->knows[i].checked)
            r.places[(*inout_n)++] = i;
    enum lum_status st = lum_pool_run(pool, *inout_n, recheck_job, &r, NULL);
    lum_free(r.places);
    return st;
}

/* ---- paths ---- */

/* So many of one place, from sample number first on. */
struct batch {
    uint32_t place, n;
    uint64_t first;
    uint32_t at; /* of the values: where its own begin */
};

struct refine {
    const struct lum_meter *meter;
    const struct batch *batches;
    uint32_t n_batches, n_samples;
    float *values; /* lx of each sample */
};

/* A white diffuse surface without extent: E = pi times the radiance that it would reflect. The path tracer has direct
 * light by sampling lights and indirect by paths, with the weights that it uses everywhere. Cylinders: the same of a
 * plane that is turned at random, sample by sample. */
static void start_path(struct lum_wave *w, const struct lum_meter *m, uint32_t place, uint32_t slot,
                       struct lum_sampler sampler)
{
    const struct lum_meter_place *at = &m->places[place];
    const struct lum_frame frame = frame_of(at);
    struct lum_vec3 n = plane_of(at, &frame, lum_sampler_2d(&sampler, PAIR_TURN).x);
    struct lum_bsdf white = lum_bsdf_white(n, n);
    lum_wave_add_vertex(w, slot, sampler, place_in_scene(m, place), &white, white.ng);
}

/* Light of the sky that comes straight to an eye, by one sample. */
static float sky_sample(const struct lum_meter *m, uint32_t place, struct lum_sampler sampler)
{
    const struct lum_snapshot *s = m->snapshot;
    uint32_t sky = s->lights.environment;
    struct lum_light_sample ls;
    struct lum_rays ray = {.n = 0};
    uint8_t occluded[LUM_RAY_BATCH];
    struct lum_rgb left[LUM_RAY_BATCH];
    struct lum_counters counters = {0};
    if (sky == LUM_NO_OBJECT || !(s->lights.pick_pdf[sky] > 0.0f) ||
        !lum_light_sample_at(s, sky, place_in_scene(m, place), lum_sampler_2d(&sampler, LUM_PAIRS_METER_LAMP), &ls))
        return 0.0f;
    float cos = lum_dot(ls.wi, m->places[place].normal);
    if (!(cos > 0.0f))
        return 0.0f;
    if (s->n_media > 0)
        ls.radiance =
            lum_rgb_mul(ls.radiance, lum_media_transmittance(s, place_in_scene(m, place), ls.wi, ls.distance));
    if (lum_shadow_ray(&ray, place_in_scene(m, place), lum_v3(0, 0, 0), ls.wi, ls.distance)) {
        struct lum_trace trace = lum_trace_of_light(s, &counters, true);
        lum_trace_light(&trace, &ray, occluded, left);
        if (occluded[0])
            return 0.0f;
        if (trace.panes)
            ls.radiance = lum_rgb_mul(ls.radiance, left[0]);
    }
    return lum_luminance(ls.radiance) * cos / ls.pdf_sa;
}

/* Which batch sample i is of. */
static uint32_t batch_of(const struct refine *r, uint32_t i)
{
    uint32_t lo = 0, hi = r->n_batches;
    while (hi - lo > 1) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (r->batches[mid].at <= i)
            lo = mid;
        else
            hi = mid;
    }
    return lo;
}

static void refine_job(void *ctx, uint32_t job, uint32_t worker)
{
    (void)worker;
    const struct refine *r = ctx;
    const struct lum_meter *m = r->meter;
    struct lum_counters counters = {0};
    struct lum_wave w;
    lum_wave_begin(&w, m->snapshot, &counters, LUM_DEPTH_DEFAULT, 0);
    w.every_light = m->snapshot->lights.n_active <= LUM_WAVE_LIGHTS; /* which one is no noise of a reading */
    uint32_t begin = job * LUM_RAY_BATCH, end = begin + LUM_RAY_BATCH;
    end = end < r->n_samples ? end : r->n_samples;
    for (uint32_t i = begin, b = batch_of(r, begin); i < end; i++) {
        while (i >= r->batches[b].at + r->batches[b].n)
            b++;
        const struct batch *batch = &r->batches[b];
        struct lum_sampler sampler =
            lum_sampler_at(batch->place, 0, (uint32_t)(batch->first + (i - batch->at)), m->seed);
        r->values[i] = 0.0f;
        if (m->places[batch->place].kind == LUM_METER_EYE) {
            start_indirect(&w, m, batch->place, i - begin, sampler);
            r->values[i] = sky_sample(m, batch->place, sampler);
        } else {
            start_path(&w, m, batch->place, i - begin, sampler);
        }
    }
    lum_wave_run(&w, 1);
    for (uint32_t i = begin; i < end; i++)
        r->values[i] += LUM_PI * lum_luminance(w.radiance[i - begin]);
}

static double stderr_of(const struct knows *k)
{
    double n = (double)k->n, mean = k->sum / n;
    return n > 1.0 ? sqrt(fmax(0.0, (k->square / n - mean * mean) / (n - 1.0))) : (double)INFINITY;
}

static double mean_of(const struct lum_meter *m)
{
    double sum = 0.0, n = 0.0;
    for (uint32_t i = 0; i < m->n; i++)
        if (m->knows[i].clearance == LUM_CLEARANCE_FREE) {
            if (m->knows[i].n < FIRST_SAMPLES)
                return 0.0; /* not known yet */
            sum += m->knows[i].sum / (double)m->knows[i].n;
            n++;
        }
    return n > 0.0 ? sum / n : 0.0;
}

/* Paths that the place still asks for. */
static uint64_t wanted(struct knows *k, const struct lum_meter_goal *goal, double mean, bool all_begun)
{
    if (k->clearance != LUM_CLEARANCE_FREE)
        return 0;
    if (k->n < FIRST_SAMPLES)
        k->target = FIRST_SAMPLES;
    else if (!all_begun)
        return 0;
    if (k->n >= k->target) {
        if (k->n >= goal->max_samples || stderr_of(k) <= goal->error * fmax(k->sum / (double)k->n, goal->dark * mean))
            return 0;
        k->target = k->n + (k->n < MORE_MAX ? k->n : MORE_MAX); /* as many again */
    }
    return k->target - k->n;
}

/* Places in turn until the slice is full. Returns the number of batches. */
static uint32_t fill(struct lum_meter *m, const struct lum_meter_goal *goal, uint32_t n_samples, struct batch *batches,
                     uint32_t *ret_samples)
{
    uint32_t n_batches = 0, total = 0;
    bool all_begun = true;
    for (uint32_t i = 0; i < m->n && all_begun; i++)
        all_begun = m->knows[i].clearance != LUM_CLEARANCE_FREE || m->knows[i].n >= FIRST_SAMPLES;
    double mean = all_begun ? mean_of(m) : 0.0;
    for (uint32_t i = 0; i < m->n && total < n_samples; i++) {
        uint32_t place = (m->next + i) % m->n;
        uint64_t more = wanted(&m->knows[place], goal, mean, all_begun);
        if (more == 0)
            continue;
        uint32_t n = more < n_samples - total ? (uint32_t)more : n_samples - total;
        batches[n_batches++] = (struct batch){place, n, m->knows[place].n, total};
        total += n;
    }
    if (n_batches > 0) {
        const struct batch *last = &batches[n_batches - 1]; /* cut short, it goes on first */
        m->next =
            m->knows[last->place].n + last->n < m->knows[last->place].target ? last->place : (last->place + 1) % m->n;
    }
    *ret_samples = total;
    return n_batches;
}

static void take(struct lum_meter *m, const struct refine *r)
{
    for (uint32_t b = 0; b < r->n_batches; b++) {
        struct knows *k = &m->knows[r->batches[b].place];
        for (uint32_t i = 0; i < r->batches[b].n; i++) {
            double v = (double)r->values[r->batches[b].at + i];
            v = isfinite(v) ? v : 0.0;
            k->sum += v;
            k->square += v * v;
        }
        k->n += r->batches[b].n;
    }
    m->n_samples += r->n_samples;
}

enum lum_status lum_meter_refine(struct lum_meter *m, struct lum_pool *pool, const struct lum_meter_goal *goal,
                                 uint32_t n_samples, bool *ret_more, struct lum_error *err)
{
    uint32_t n_rechecked = 0;
    enum lum_status checked = recheck(m, pool, n_samples / RECHECK_SAMPLES + 1, &n_rechecked, err);
    *ret_more = true;
    if (checked || n_rechecked > 0)
        return checked;
    struct batch *batches = lum_calloc(m->n, sizeof *batches);
    struct refine r = {.meter = m, .batches = batches, .values = lum_calloc(n_samples, sizeof(float))};
    enum lum_status st = LUM_ERR_NOMEM;
    if (batches && r.values) {
        r.n_batches = fill(m, goal, n_samples, batches, &r.n_samples);
        st = lum_pool_run(pool, (r.n_samples + LUM_RAY_BATCH - 1) / LUM_RAY_BATCH, refine_job, &r, NULL);
        if (st == LUM_OK)
            take(m, &r);
        *ret_more = r.n_samples > 0;
    } else {
        (void)lum_fail(err, st, "", "no memory for %u samples", n_samples);
    }
    lum_free(batches);
    lum_free(r.values);
    return st;
}

/* ---- reading ---- */

/* Of the indirect light of all glances: variance over value squared. A few paths miss what is rare and bright, and then
 * believe to know more than they do; those of all places together do not. */
static double pooled(const struct lum_meter *m)
{
    return m->glance_square > 0.0 ? m->glance_variance / m->glance_square : 0.0;
}

struct lum_meter_reading lum_meter_read(const struct lum_meter *m, uint32_t place)
{
    const struct knows *k = &m->knows[place];
    struct lum_meter_reading r = {k->clearance, 0.0, -1.0};
    if (k->glanced) {
        double indirect = fmax(k->indirect_variance, pooled(m) * k->indirect * k->indirect);
        r.lx = k->direct + k->indirect;
        r.stderr_lx = sqrt(fmax(k->direct_variance + indirect, 0.0));
    }
    /* a glance may be sure of less light than there is: once there are paths enough, they have it */
    if (k->n >= FIRST_SAMPLES || (k->n > 1 && (r.stderr_lx < 0.0 || stderr_of(k) < r.stderr_lx))) {
        r.lx = k->sum / (double)k->n;
        r.stderr_lx = stderr_of(k);
    }
    return r;
}

uint64_t lum_meter_samples(const struct lum_meter *m)
{
    return m->n_samples;
}
