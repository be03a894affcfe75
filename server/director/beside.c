#include "server/director/beside.h"

#include <math.h>

#include "server/director/internal.h"

#define SLICE_NS 8e6 /* an edit that comes into a rest waits no longer for its frame */
#define SHARE_AWAITED 0.25
#define SHARE_REFINES 0.1
/* Of the share, at most: before the first picture of a change, and what a pass of many seconds leaves behind. */
#define SAVED_STALE_NS 6e7
#define SAVED_NS 5e8

/* Time passes, and a share of it may be taken: of that in which there was something to do. */
static void count_time(struct lum_beside *b, enum lum_need need, bool stale)
{
    int64_t now = lum_clock_ns();
    double share = need == LUM_NEED_AWAITED ? SHARE_AWAITED : SHARE_REFINES;
    if (need == LUM_NEED_NOTHING)
        b->saved_ns = SLICE_NS; /* what is asked for next begins at once */
    else
        b->saved_ns = fmin(b->saved_ns + share * (double)(now - b->counted_ns), stale ? SAVED_STALE_NS : SAVED_NS);
    b->counted_ns = now;
}

/* Between passes all that may be taken before a first picture at once: workers are slow to wake on a busy machine. */
static void work(struct lum_director *d, enum lum_need sensors, enum lum_need probes, bool passes)
{
    struct lum_beside *b = &d->beside;
    double slice_ns = passes ? fmax(SLICE_NS, fmin(b->saved_ns, SAVED_STALE_NS)) : SLICE_NS;
    int64_t from = lum_clock_ns();
    if (sensors && (!probes || b->sensors_next))
        lum_director_measure(d, slice_ns);
    else
        lum_director_probe(d, slice_ns);
    b->sensors_next = !b->sensors_next;
    b->counted_ns = lum_clock_ns();
    b->saved_ns = fmax(b->saved_ns - (double)(b->counted_ns - from), -SAVED_STALE_NS);
}

enum lum_beside_state lum_director_work_beside(struct lum_director *d, const struct lum_server_view *view)
{
    struct lum_beside *b = &d->beside;
    enum lum_need sensors = lum_director_sensors_need(d, view != NULL), probes = lum_director_probes_need(d);
    count_time(b, sensors > probes ? sensors : probes, view && view->stale);
    if ((sensors || probes) && (!view || b->saved_ns > 0.0))
        work(d, sensors, probes, view != NULL);
    lum_director_tell_sensors(d);
    if (!lum_director_sensors_need(d, view != NULL) && !lum_director_probes_need(d))
        return LUM_BESIDE_DONE;
    return b->saved_ns > 0.0 ? LUM_BESIDE_OWED : LUM_BESIDE_MORE;
}
