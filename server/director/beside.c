#include "server/director/beside.h"

#include <math.h>

#include "server/director/internal.h"
#include "server/director/view_frames.h"

#define SLICE_NS 8e6       /* an edit that comes into a rest waits no longer for its frame */
#define SHARE_AWAITED 0.25 /* beside three views at most */
/* The picture shows the scene as it is, and only grows better: it can wait, and somebody does. */
#define SHARE_AWAITED_AT_REST 4.0
#define SHARE_REFINES 0.1
/* Of the share, at most: before the first picture of a change, and what a pass of many seconds leaves behind. */
#define SAVED_STALE_NS 6e7
#define SAVED_NS 5e8

/* The kinds of work take turns. */
enum { SENSORS, PROBES, SCENE_GETS, TIMELINE_GETS, REPORTS, N_KINDS };
static void (*const work_of[N_KINDS])(struct lum_director *d, double slice_ns) = {
    lum_director_measure, lum_director_probe, lum_director_write_scene, lum_director_write_timeline,
    lum_director_report};

/* The most that any kind needs. */
static enum lum_need needs(struct lum_director *d, bool busy, enum lum_need ret_needs[N_KINDS])
{
    enum lum_need most = LUM_NEED_NOTHING;
    ret_needs[SENSORS] = lum_director_sensors_need(d, busy);
    ret_needs[PROBES] = lum_director_probes_need(d);
    ret_needs[SCENE_GETS] = lum_director_scene_gets_need(d);
    ret_needs[TIMELINE_GETS] = lum_director_timeline_gets_need(d);
    ret_needs[REPORTS] = lum_director_reports_need(d);
    for (int k = 0; k < N_KINDS; k++)
        most = ret_needs[k] > most ? ret_needs[k] : most;
    return most;
}

double lum_beside_share(const struct lum_server_view *views, int64_t now_ns)
{
    unsigned n = 0;
    for (const struct lum_server_view *v = views; v; v = v->next)
        n += v->stale && lum_server_view_is_awaited(v, now_ns);
    return fmin(SHARE_AWAITED, 1.0 / (1.0 + n));
}

static double most_saved_ns(double share)
{
    return fmax(SLICE_NS, SAVED_STALE_NS * share / SHARE_AWAITED);
}

/* Time passes, and a share of it may be taken: of that in which there was something to do. */
static void count_time(struct lum_director *d, enum lum_need need, bool stale)
{
    struct lum_beside *b = &d->beside;
    int64_t now = lum_clock_ns();
    double stale_share = lum_beside_share(d->views, now);
    double awaited = stale ? stale_share : SHARE_AWAITED_AT_REST;
    double share = need == LUM_NEED_AWAITED ? awaited : fmin(SHARE_REFINES, awaited);
    if (need == LUM_NEED_NOTHING)
        b->saved_ns = SLICE_NS; /* what is asked for next begins at once */
    else
        b->saved_ns =
            fmin(b->saved_ns + share * (double)(now - b->counted_ns), stale ? most_saved_ns(stale_share) : SAVED_NS);
    b->counted_ns = now;
}

/* Between passes all that may be taken before a first picture at once: workers are slow to wake on a busy machine. At
 * rest an edit may come at any time, and slices stay short: there are more of them. */
static void work(struct lum_director *d, const enum lum_need of_kinds[N_KINDS], bool stale)
{
    struct lum_beside *b = &d->beside;
    int64_t from = lum_clock_ns();
    double most_ns = most_saved_ns(lum_beside_share(d->views, from));
    double slice_ns = stale ? fmax(SLICE_NS, fmin(b->saved_ns, most_ns)) : SLICE_NS;
    do
        b->turn = (b->turn + 1) % N_KINDS;
    while (of_kinds[b->turn] == LUM_NEED_NOTHING);
    work_of[b->turn](d, slice_ns);
    b->counted_ns = lum_clock_ns();
    b->saved_ns = fmax(b->saved_ns - (double)(b->counted_ns - from), -SAVED_STALE_NS);
}

enum lum_beside_state lum_director_work_beside(struct lum_director *d, const struct lum_server_view *view)
{
    struct lum_beside *b = &d->beside;
    bool busy = view != NULL;
    enum lum_need of_kinds[N_KINDS], need = needs(d, busy, of_kinds);
    count_time(d, need, busy && view->stale);
    if (need && (!busy || b->saved_ns > 0.0))
        work(d, of_kinds, busy && view->stale);
    lum_director_tell_sensors(d);
    if (!needs(d, busy, of_kinds))
        return LUM_BESIDE_DONE;
    return b->saved_ns > 0.0 ? LUM_BESIDE_OWED : LUM_BESIDE_MORE;
}
