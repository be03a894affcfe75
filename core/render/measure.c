#include "core/render/measure.h"

#include "core/base/pool.h"
#include "core/base/team.h"
#include "core/pass/method.h"

#define PATHS_AT_REST                                                                                                  \
    0.5                    /* a pixel: half the time of a sample of `path`. 600 x 400: 15 pairs in each of 4096 probes \
                            */
#define LEAST_PATHS 1024.0 /* of small pictures: probes enough for a statement */
#define RAYS_AT_REST 2.0   /* a pixel and call: calls are short, since an edit may wait for one */
#define DEAR 4.0 /* time of a path's ray over that of a picture's, until it is known: 1 of `path` to 6 of `igi` */

void lum_measure_finish(struct lum_measurement *m)
{
    lum_error_probes_destroy(m->probes);
    *m = (struct lum_measurement){0};
}

void lum_measure_begin(struct lum_measurement *m, bool alike)
{
    m->error = LUM_FILM_ERROR_UNKNOWN;
    m->n_known = 0.0;
    m->given_up = false;
    if (m->probes)
        lum_error_probes_begin(m->probes, alike);
}

/* One alone knows nothing then. Of a team all measure, or none. */
static void give_up(struct lum_measurement *m, struct lum_team *team)
{
    m->given_up = true;
    if (team)
        team->kind->give_up(team, "out of memory to measure the error");
}

/* With every effect that the picture should have; but soft edges, where the method makes none. Without memory nothing
 * is known. */
static enum lum_status trace(struct lum_measurement *m, const struct lum_pass *frame, const bool on[LUM_EFFECT_COUNT],
                             double max_rays, const struct lum_stage_runner *runner)
{
    struct lum_error unused;
    struct lum_pass pass = *frame;
    if (m->given_up)
        return LUM_OK;
    if (!m->probes && lum_error_probes_create(lum_pool_size(runner->pool), &m->probes, &unused) != LUM_OK) {
        give_up(m, runner->team);
        return LUM_OK;
    }
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        pass.on[e] = on[e] && (e != LUM_EFFECT_ANTIALIAS || lum_method_serves(frame->settings->method, e));
    int64_t begin_ns = lum_clock_ns();
    enum lum_status status = lum_error_probes_trace(m->probes, &pass, (uint64_t)max_rays, runner);
    m->error = lum_error_probes_error(m->probes, pass.film);
    m->n_known = lum_error_probes_known(m->probes);
    if (status == LUM_ERR_NOMEM)
        give_up(m, runner->team);
    runner->stats->stage_ms[LUM_STAGE_ERROR] += (double)(lum_clock_ns() - begin_ns) * 1e-6;
    return m->given_up ? LUM_OK : status;
}

static double rays_of(const struct lum_stage_runner *runner)
{
    uint64_t rays = 0;
    for (uint32_t w = 0; w < lum_pool_size(runner->pool); w++)
        rays += runner->counters[w].rays[LUM_RAY_PROBE];
    return (double)rays;
}

/* Of a team, as many as rank 0 says: how many rays of VPLs were known from before is a matter of what found room
 * (known_rays.c), and time is each one's own. */
static double agree(const struct lum_stage_runner *runner, double value)
{
    return runner->team ? lum_team_agree(runner->team, value) : value;
}

/* About so many rays. What they took tells how many the next ones may be. */
static void trace_share(struct lum_measurement *m, const struct lum_pass *frame, const bool on[LUM_EFFECT_COUNT],
                        double max_rays, const struct lum_stage_runner *runner)
{
    struct lum_stage_runner whole = *runner;
    whole.cancel = NULL;
    double before = rays_of(runner), before_ms = runner->stats->stage_ms[LUM_STAGE_ERROR];
    (void)trace(m, frame, on, max_rays, &whole);
    m->rays += rays_of(runner) - before;
    m->ms += runner->stats->stage_ms[LUM_STAGE_ERROR] - before_ms;
}

void lum_measure_share(struct lum_measurement *m, const struct lum_pass *frame, const bool on[LUM_EFFECT_COUNT],
                       struct lum_measure_cost cost, const struct lum_stage_runner *runner)
{
    double share = frame->settings->error_share, left_ms = cost.rays > 0 ? share * cost.ms : 0.0;
    bool timed = !frame->settings->deterministic, looked = false;
    if (!timed || agree(runner, m->rays) == 0.0) {
        double before_ms = m->ms;
        trace_share(m, frame, on, agree(runner, share * (double)cost.rays / DEAR), runner);
        left_ms -= m->ms - before_ms;
        looked = true;
    }
    if (timed) { /* of a first picture, too: its first rays were timed, and few, as they may have been dear */
        double max_rays = agree(runner, m->rays > 0.0 ? fmax(left_ms, 0.0) * m->rays / m->ms : 0.0);
        if (max_rays > 0.0 || !looked) /* a picture that was bettered is off by less, also without another ray */
            trace_share(m, frame, on, max_rays, runner);
    }
    if (cost.first && m->probes)
        lum_error_probes_note(m->probes);
}

enum lum_status lum_measure_more(struct lum_measurement *m, const struct lum_pass *frame,
                                 const bool on[LUM_EFFECT_COUNT], const struct lum_stage_runner *runner)
{
    double n = (double)frame->settings->w * frame->settings->h;
    enum lum_status status = trace(m, frame, on, RAYS_AT_REST * n, runner);
    if (m->probes && !frame->settings->method->progressive && !frame->settings->method->refines)
        lum_error_probes_note(m->probes);
    return status;
}

bool lum_measure_is_done(const struct lum_measurement *m, uint32_t w, uint32_t h)
{
    double wanted = fmax(PATHS_AT_REST * w * h, LEAST_PATHS);
    return m->given_up || (m->probes && (double)lum_error_probes_paths(m->probes) >= wanted);
}
