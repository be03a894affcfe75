#include "core/measure/sensor.h"

#include "core/math/vec3d.h"
#include "core/measure/gazes.h"

#define GLARE_RAYS 64u    /* of a lamp, at most */
#define EYE_ROUNDS_MIN 2u /* of each half */
#define EYE_ROUNDS_MAX 64u
#define GAZE_RAYS 8u         /* shadow rays that take as long as a path, about */
#define EYE_ERROR 0.003      /* of DGP, standard: its bands are 0.05 wide */
#define GLARE_RAYS_ALL 8192u /* of all lamps, where that leaves 4 for each: it takes some milliseconds */

struct lum_sensor {
    struct lum_sensor_desc desc;
    struct lum_meter *meter;
    uint32_t nu, nv;
    const struct lum_snapshot *snapshot; /* the meter's */
    bool looked;                         /* glare is known */
    struct lum_glare glare;
    struct lum_fisheye *eye; /* of an observer, else NULL */
    struct lum_gazes *gazes; /* of eyes, else NULL: by point, then direction, as the meter's places */
    enum { EYE_SHUT, EYE_GLANCED, EYE_OPEN, EYE_SETTLED } seen;
    bool bright_known;
    struct lum_bright bright; /* what it saw: of a glance until it knows more */
    uint64_t eye_paths;       /* since it was aimed */
};

/* EN 12464-1, 4.4: the side d, which is the longer one, or the shorter where that is half of it or less, has the whole
 * number of cells that is next to d / p, p = 0.2 * 5^(log10 d) m, and 10 m at most. Theirs is the spacing of the other
 * side, too, as far as whole numbers allow. */
static double standard_spacing(double a, double b)
{
    double longer = fmax(a, b), shorter = fmin(a, b), d = longer >= 2.0 * shorter ? shorter : longer;
    double p = fmin(0.2 * pow(5.0, log10(d)), 10.0);
    return d / fmax(round(d / p), 1.0);
}

static double points_along(const struct lum_sensor_desc *d, double length, double spacing)
{
    double cells = length / spacing;
    return fmax(d->spacing_m > 0.0 ? ceil(cells - 1e-9) : round(cells), 1.0);
}

static enum lum_status lay_out(const struct lum_sensor_desc *d, uint32_t max_points, uint32_t *ret_nu, uint32_t *ret_nv,
                               struct lum_error *err)
{
    double a = lum_v3d_length(d->u), b = lum_v3d_length(d->v), nu = 1.0, nv = 1.0;
    double spacing = d->spacing_m > 0.0 ? d->spacing_m : standard_spacing(a, d->kind == LUM_SENSOR_GRID ? b : a);
    if (d->kind == LUM_SENSOR_LINE || d->kind == LUM_SENSOR_GRID)
        nu = points_along(d, a, spacing);
    if (d->kind == LUM_SENSOR_GRID)
        nv = points_along(d, b, spacing);
    uint32_t most = lum_sensor_has_eyes(d) && d->n_directions > 0 ? max_points / d->n_directions : max_points;
    if (!(nu * nv <= (double)most))
        return lum_fail(err, LUM_ERR_LIMIT, "spacing_m",
                        "%.0f x %.0f points are more than %u: a wider spacing is needed", nu, nv, most);
    *ret_nu = (uint32_t)nu;
    *ret_nv = (uint32_t)nv;
    return LUM_OK;
}

enum lum_status lum_sensor_check(const struct lum_sensor_desc *desc, uint32_t max_points, struct lum_error *err)
{
    uint32_t nu, nv;
    return lay_out(desc, max_points, &nu, &nv, err);
}

struct lum_vec3d lum_sensor_point(const struct lum_sensor *s, uint32_t i)
{
    const struct lum_sensor_desc *d = &s->desc;
    struct lum_vec3d p = d->position;
    if (d->kind == LUM_SENSOR_POINT || d->kind == LUM_SENSOR_OBSERVER)
        return p;
    double u = ((double)(i % s->nu) + 0.5) / s->nu - 0.5,
           v = d->kind == LUM_SENSOR_GRID ? ((double)(i / s->nu) + 0.5) / s->nv - 0.5 : 0.0;
    return lum_v3d_mad(lum_v3d_mad(p, d->u, u), d->v, v);
}

struct lum_vec3 lum_sensor_direction(const struct lum_sensor *s, uint32_t direction)
{
    struct lum_vec3 d = s->desc.facing;
    float angle = 2.0f * LUM_PI * (float)direction / (float)s->desc.n_directions, c = cosf(angle), n = sinf(angle);
    return lum_v3(c * d.x + n * d.z, d.y, c * d.z - n * d.x);
}

static enum lum_status create_eyes(struct lum_sensor *s, struct lum_error *err)
{
    uint32_t n_directions = s->desc.n_directions, n = s->nu * s->nv * n_directions;
    struct lum_meter_place *places = lum_calloc(n, sizeof *places);
    if (!places)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for %u eyes", n);
    for (uint32_t i = 0; i < n; i++)
        places[i] = (struct lum_meter_place){.point_world = lum_sensor_point(s, i / n_directions),
                                             .normal = lum_sensor_direction(s, i % n_directions),
                                             .kind = LUM_METER_EYE,
                                             .is_roomy = true};
    enum lum_status st = lum_meter_create(places, n, s->desc.seed, &s->meter, err);
    lum_free(places);
    return st ? st : lum_gazes_create(n, &s->gazes, err);
}

static enum lum_status create_meter(struct lum_sensor *s, struct lum_error *err)
{
    const struct lum_sensor_desc *d = &s->desc;
    uint32_t n_points = s->nu * s->nv, n = s->desc.modelling ? 2 * n_points : n_points;
    struct lum_meter_place *places = lum_calloc(n, sizeof *places);
    if (!places)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for %u points", n);
    bool eye = d->kind == LUM_SENSOR_OBSERVER;
    for (uint32_t i = 0; i < n; i++)
        places[i] = (struct lum_meter_place){.point_world = lum_sensor_point(s, i % n_points),
                                             .normal = eye ? d->facing : d->normal,
                                             .facing = d->facing,
                                             .kind = eye             ? LUM_METER_EYE
                                                     : i >= n_points ? LUM_METER_CYLINDER
                                                                     : d->quantity};
    enum lum_status st = lum_meter_create(places, n, d->seed, &s->meter, err);
    lum_free(places);
    return st;
}

enum lum_status lum_sensor_create(const struct lum_sensor_desc *desc, uint32_t max_points,
                                  struct lum_sensor **ret_sensor, struct lum_error *err)
{
    struct lum_sensor *s = lum_calloc(1, sizeof *s);
    if (!s)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a sensor");
    s->desc = *desc;
    enum lum_status st = lay_out(desc, max_points, &s->nu, &s->nv, err);
    if (!st)
        st = lum_sensor_has_eyes(desc) ? create_eyes(s, err) : create_meter(s, err);
    if (!st && desc->kind == LUM_SENSOR_OBSERVER)
        st = lum_fisheye_create(&s->eye, err);
    if (st) {
        lum_sensor_destroy(s);
        return st;
    }
    *ret_sensor = s;
    return LUM_OK;
}

void lum_sensor_destroy(struct lum_sensor *s)
{
    if (!s)
        return;
    lum_meter_destroy(s->meter);
    lum_fisheye_destroy(s->eye);
    lum_gazes_destroy(s->gazes);
    lum_free(s);
}

enum lum_status lum_sensor_copy(const struct lum_sensor *of, struct lum_sensor **ret_sensor, struct lum_error *err)
{
    struct lum_sensor *s = lum_calloc(1, sizeof *s);
    if (!s)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a sensor");
    *s = *of;
    s->meter = NULL;
    s->eye = NULL;
    s->gazes = NULL;
    enum lum_status st = lum_meter_copy(of->meter, &s->meter, err);
    if (!st && of->eye)
        st = lum_fisheye_copy(of->eye, &s->eye, err);
    if (!st && of->gazes)
        st = lum_gazes_copy(of->gazes, &s->gazes, err);
    if (st) {
        lum_sensor_destroy(s);
        return st;
    }
    *ret_sensor = s;
    return LUM_OK;
}

void lum_sensor_size(const struct lum_sensor *s, uint32_t *ret_nu, uint32_t *ret_nv)
{
    *ret_nu = s->nu;
    *ret_nv = s->nv;
}

struct lum_meter_reading lum_sensor_reading(const struct lum_sensor *s, uint32_t i)
{
    return lum_meter_read(s->meter, s->gazes ? i * s->desc.n_directions : i);
}

struct lum_meter_reading lum_sensor_cylindrical(const struct lum_sensor *s, uint32_t i)
{
    return lum_meter_read(s->meter, s->nu * s->nv + i);
}

uint64_t lum_sensor_samples(const struct lum_sensor *s)
{
    return lum_meter_samples(s->meter) + s->eye_paths + (s->gazes ? lum_gazes_rays(s->gazes) / GAZE_RAYS : 0);
}

void lum_sensor_aim(struct lum_sensor *s, const struct lum_snapshot *snapshot)
{
    lum_meter_aim(s->meter, snapshot);
    s->snapshot = snapshot;
    s->looked = s->bright_known = false;
    s->glare = (struct lum_glare){0};
    s->bright = (struct lum_bright){0};
    s->seen = EYE_SHUT;
    if (s->gazes)
        lum_gazes_forget(s->gazes);
    s->eye_paths = 0;
}

static struct lum_observer observer_of(const struct lum_sensor *s)
{
    return (struct lum_observer){s->desc.position, s->desc.facing};
}

/* Lamps and the sun, one by one. */
static void look_at_lamps(struct lum_sensor *s)
{
    uint32_t n = GLARE_RAYS_ALL / (s->snapshot->lights.n_active + 1), least = n < 4 ? 4 : n;
    const struct lum_observer o = observer_of(s);
    lum_glare_of(s->snapshot, &o, least < GLARE_RAYS ? least : GLARE_RAYS, s->desc.seed, &s->glare);
}

/* Of what else is bright; at most n paths. */
static void look_around(struct lum_sensor *s, struct lum_pool *pool, uint32_t n)
{
    const struct lum_observer o = observer_of(s);
    uint64_t before = lum_fisheye_paths(s->eye);
    lum_fisheye_trace(s->eye, s->snapshot, &o, pool, n, s->desc.seed);
    s->eye_paths += lum_fisheye_paths(s->eye) - before;
    if (lum_fisheye_rounds(s->eye) == 0)
        return;
    s->bright = lum_fisheye_bright(s->eye, &o);
    s->bright_known = true;
}

static void glance_around(struct lum_sensor *s, struct lum_pool *pool)
{
    lum_fisheye_begin(s->eye, LUM_FISHEYE_GLANCE_SIDE);
    s->seen = EYE_GLANCED;
    while (lum_fisheye_rounds(s->eye) == 0)
        look_around(s, pool, LUM_FISHEYE_GLANCE_SIDE * LUM_FISHEYE_GLANCE_SIDE);
}

static struct lum_gazer gazer_of(const void *user, uint32_t i)
{
    const struct lum_sensor *s = user;
    uint32_t n = s->desc.n_directions;
    return (struct lum_gazer){.has_place = lum_meter_read(s->meter, i).clearance == LUM_CLEARANCE_FREE,
                              .observer = {lum_sensor_point(s, i / n), lum_sensor_direction(s, i % n)}};
}

static bool look_from_all(struct lum_sensor *s, struct lum_pool *pool, uint32_t n_samples, bool closely)
{
    return lum_gazes_look(s->gazes, &(struct lum_gazes_look){.snapshot = s->snapshot,
                                                             .gazer = gazer_of,
                                                             .user = s,
                                                             .pool = pool,
                                                             .n_rays = (uint64_t)n_samples * GAZE_RAYS,
                                                             .seed = s->desc.seed,
                                                             .closely = closely});
}

bool lum_sensor_look(struct lum_sensor *s, struct lum_pool *pool, uint32_t n_places, bool glance)
{
    bool more = lum_meter_look(s->meter, pool, n_places, glance);
    if (s->desc.kind != LUM_SENSOR_OBSERVER || s->looked)
        return more;
    s->looked = true;
    if (lum_meter_read(s->meter, 0).clearance == LUM_CLEARANCE_FREE) {
        look_at_lamps(s);
        if (glance)
            glance_around(s, pool);
    }
    return more;
}

bool lum_sensor_glance_at_lamps(struct lum_sensor *s, struct lum_pool *pool, uint32_t n_samples)
{
    return s->gazes && look_from_all(s, pool, n_samples, false);
}

static struct lum_dgp dgp_of(const struct lum_sensor *s, struct lum_amount eye)
{
    struct lum_bright all = lum_bright_and(s->glare.bright, s->bright);
    return s->bright_known ? lum_dgp_of(&all, eye.value, eye.stderr_of) : (struct lum_dgp){(double)NAN, (double)NAN};
}

/* All light at the eye. */
static struct lum_amount light_at_eye(const struct lum_sensor *s)
{
    struct lum_meter_reading around = lum_meter_read(s->meter, 0);
    return (struct lum_amount){around.lx + s->glare.direct_lx, hypot(around.stderr_lx, s->glare.direct_stderr)};
}

/* False: it is as well known as it needs to be. */
static bool refine_eye(struct lum_sensor *s, struct lum_pool *pool, uint32_t n_samples)
{
    if (s->seen == EYE_SETTLED || lum_meter_read(s->meter, 0).clearance != LUM_CLEARANCE_FREE)
        return false;
    if (s->seen != EYE_OPEN) {
        lum_fisheye_begin(s->eye, LUM_FISHEYE_SIDE);
        s->seen = EYE_OPEN;
    }
    look_around(s, pool, n_samples);
    uint32_t rounds = lum_fisheye_rounds(s->eye);
    if (rounds >= EYE_ROUNDS_MAX ||
        (rounds >= EYE_ROUNDS_MIN && dgp_of(s, (struct lum_amount){light_at_eye(s).value, 0.0}).stderr_of <= EYE_ERROR))
        s->seen = EYE_SETTLED;
    return true;
}

enum lum_status lum_sensor_refine(struct lum_sensor *s, struct lum_pool *pool, const struct lum_meter_goal *goal,
                                  uint32_t n_samples, bool *ret_more, struct lum_error *err)
{
    struct lum_meter_goal own = *goal;
    if (s->gazes)
        own.error = fmax(own.error, LUM_SENSOR_EYE_ERROR);
    enum lum_status st = lum_meter_refine(s->meter, pool, &own, n_samples, ret_more, err);
    if (!st && !*ret_more && s->eye)
        *ret_more = refine_eye(s, pool, n_samples);
    if (!st && !*ret_more && s->gazes)
        *ret_more = look_from_all(s, pool, n_samples, true);
    return st;
}

static void count_in(struct lum_sensor_result *r, uint32_t i, const struct lum_meter_reading *at)
{
    r->n_known++;
    r->mean.value += at->lx;
    r->mean.stderr_of += at->stderr_lx * at->stderr_lx;
    if (r->n_known == 1 || at->lx < r->least.value) {
        r->least = (struct lum_amount){at->lx, at->stderr_lx};
        r->least_at = i;
    }
    if (r->n_known == 1 || at->lx > r->most.value)
        r->most = (struct lum_amount){at->lx, at->stderr_lx};
}

/* Ez over E, both means: their noise is independent. False: some of Ez is not known. */
static bool add_modelling(const struct lum_sensor *s, struct lum_sensor_result *r)
{
    struct lum_amount ez = {0};
    uint32_t n = 0;
    for (uint32_t i = 0; i < r->n; i++) {
        struct lum_meter_reading at = lum_sensor_cylindrical(s, i);
        if (at.clearance != LUM_CLEARANCE_FREE || !(at.stderr_lx >= 0.0))
            continue;
        ez.value += at.lx;
        ez.stderr_of += at.stderr_lx * at.stderr_lx;
        n++;
    }
    if (n == 0 || n < r->n_known)
        return false;
    r->cylindrical = (struct lum_amount){ez.value / n, sqrt(ez.stderr_of) / n};
    if (r->mean.value > 0.0) {
        r->modelling.value = r->cylindrical.value / r->mean.value;
        r->modelling.stderr_of =
            hypot(r->cylindrical.stderr_of, r->modelling.value * r->mean.stderr_of) / r->mean.value;
    }
    return true;
}

static struct lum_gaze gaze_of(const struct lum_sensor *s, uint32_t i, uint32_t direction)
{
    uint32_t place = i * s->desc.n_directions + direction;
    struct lum_meter_reading around = lum_meter_read(s->meter, place);
    const struct lum_glare *glare = lum_gazes_at(s->gazes, place);
    if (!glare || around.clearance != LUM_CLEARANCE_FREE || !(around.stderr_lx >= 0.0))
        return (struct lum_gaze){.known = false, .ugr = {(double)NAN, (double)NAN}};
    struct lum_amount background = {around.lx / LUM_PI_D, around.stderr_lx / LUM_PI_D};
    return (struct lum_gaze){.known = true,
                             .direction = direction,
                             .ugr = lum_ugr_of(glare, background.value, background.stderr_of),
                             .background = background,
                             .glare = *glare};
}

/* By UGR: that of darkness has no bound, and would hide all others. */
static bool is_worse(const struct lum_ugr *a, const struct lum_ugr *b)
{
    return isfinite(a->ugr) == isfinite(b->ugr) ? a->ugr > b->ugr : isfinite(a->ugr);
}

struct lum_gaze lum_sensor_gaze(const struct lum_sensor *s, uint32_t i)
{
    struct lum_gaze worst = {.known = false};
    bool dark = false;
    for (uint32_t k = 0; k < s->desc.n_directions; k++) {
        struct lum_gaze is = gaze_of(s, i, k);
        if (!is.known)
            return is;
        dark = dark || is.ugr.ugr == (double)INFINITY;
        if (k == 0 || is_worse(&is.ugr, &worst.ugr))
            worst = is;
    }
    worst.dark = dark;
    return worst;
}

static bool result_of_eyes(const struct lum_sensor *s, struct lum_sensor_result *ret)
{
    const struct lum_amount none = {(double)NAN, (double)NAN};
    struct lum_sensor_result r = {.n = s->nu * s->nv,
                                  .mean = none,
                                  .least = none,
                                  .most = none,
                                  .uniformity = none,
                                  .cylindrical = none,
                                  .modelling = none,
                                  .ugr = {none.value, none.value},
                                  .eye = none,
                                  .dgp = {none.value, none.value}};
    for (uint32_t i = 0; i < r.n; i++) {
        enum lum_clearance clearance = lum_sensor_reading(s, i).clearance;
        struct lum_gaze is = lum_sensor_gaze(s, i);
        r.n_inside += clearance == LUM_CLEARANCE_INSIDE;
        r.n_covered += clearance == LUM_CLEARANCE_COVERED || clearance == LUM_CLEARANCE_FAR;
        r.n_dark += is.dark;
        if (!is.known || (r.n_known++ > 0 && !is_worse(&is.ugr, &r.ugr)))
            continue;
        r.worst_at = i, r.worst_direction = is.direction;
        r.ugr = is.ugr, r.glare = is.glare, r.mean = is.background;
    }
    *ret = r;
    return r.n_known > 0 && r.n_known + r.n_inside + r.n_covered == r.n;
}

/* The points' noise is independent. That of the least one is taken for Emin's: among points that are alike the least is
 * the one that noise made least, so that Emin and Uo are low by up to about two of them. */
bool lum_sensor_result(const struct lum_sensor *s, struct lum_sensor_result *ret)
{
    if (s->gazes)
        return result_of_eyes(s, ret);
    struct lum_sensor_result r = {.n = s->nu * s->nv, .glare = s->glare};
    for (uint32_t i = 0; i < r.n; i++) {
        struct lum_meter_reading at = lum_meter_read(s->meter, i);
        r.n_inside += at.clearance == LUM_CLEARANCE_INSIDE;
        r.n_covered += at.clearance == LUM_CLEARANCE_COVERED || at.clearance == LUM_CLEARANCE_FAR;
        if (at.clearance == LUM_CLEARANCE_FREE && at.stderr_lx >= 0.0)
            count_in(&r, i, &at);
    }
    const double none = (double)NAN;
    if (r.n_known == 0)
        r.mean = r.least = r.most = r.uniformity = (struct lum_amount){none, none};
    bool whole = r.n_known > 0 && r.n_known + r.n_inside + r.n_covered == r.n;
    if (r.n_known > 0) {
        r.mean = (struct lum_amount){r.mean.value / r.n_known, sqrt(r.mean.stderr_of) / r.n_known};
        if (r.mean.value > 0.0) {
            r.uniformity.value = r.least.value / r.mean.value;
            r.uniformity.stderr_of = hypot(r.least.stderr_of, r.uniformity.value * r.mean.stderr_of) / r.mean.value;
        }
    }
    r.cylindrical = r.modelling = (struct lum_amount){none, none};
    if (s->desc.modelling)
        whole = add_modelling(s, &r) && whole;
    if (s->desc.kind == LUM_SENSOR_OBSERVER) {
        r.mean = (struct lum_amount){r.mean.value / LUM_PI_D, r.mean.stderr_of / LUM_PI_D};
        r.ugr = r.n_known > 0 ? lum_ugr_of(&s->glare, r.mean.value, r.mean.stderr_of) : (struct lum_ugr){none, none};
        r.eye = r.n_known > 0 ? light_at_eye(s) : (struct lum_amount){none, none};
        r.dgp = r.n_known > 0 ? dgp_of(s, r.eye) : (struct lum_dgp){none, none};
        r.n_bright = s->glare.bright.n + s->bright.n;
    }
    *ret = r;
    return whole;
}
