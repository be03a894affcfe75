#include "server/stream/line.h"

#include <string.h>

/* Under so many bytes the time is that of threads that wake. */
#define LEAST_BYTES 4096.0
/* The way may have become longer: the soonest answer is looked for anew. */
#define SOONEST_LASTS_NS 10000000000ll
/* Frames tell the rate by their difference if that is at least this part of the larger one. */
#define DIFFERENCE 0.25
/* Of what was known, against what a frame tells. Bytes and times are averaged, and not rates: of two answers that come
 * together the second says that its bytes took no time, and the first that its own took too long. Where one answer in
 * twenty is up to 200 ms late, one frame in ten thousand is thought three times as fast as its line is; one in a
 * hundred with half of it kept; nearly all if rates are averaged (line_test). */
#define KEPT 0.75
/* So many frames in a row that each tell of more than MUCH times the rate: the line has grown wide, and what was known
 * of it is forgotten. The times of slow frames are long, and would be the average for twenty. Answers that come
 * together are no more than frames that may be without one: the others of a run tell the rate as it is. */
#define FASTER_RUN 4u
#define MUCH 2.0
_Static_assert(FASTER_RUN >= 2 * LUM_LIMIT_UNACKED_FRAMES, "half of a run is of frames that came by themselves");
/* No frame's time is known better than that. */
#define LEAST_NS 1e6
/* Frames, or a time, of which none told more than a bound below the rate: then it is not believed any more. */
#define BOUNDS 16
#define BOUNDS_LAST_NS 10000000000ll

void lum_line_begin(struct lum_line *line, uint64_t seq, int64_t now_ns)
{
    if (line->n == LUM_LIMIT_UNACKED_FRAMES) {
        line->n--;
        memmove(line->frames, line->frames + 1, line->n * sizeof line->frames[0]);
    }
    line->frames[line->n++] = (struct lum_line_frame){.seq = seq, .began_ns = now_ns};
}

void lum_line_add(struct lum_line *line, uint64_t n_bytes, bool last)
{
    struct lum_line_frame *f = &line->frames[line->n - 1];
    f->n_bytes += n_bytes;
    f->whole = last;
}

void lum_line_cut(struct lum_line *line)
{
    if (line->n > 0 && !line->frames[line->n - 1].whole)
        line->n--;
}

/* True: it is the last of a run. */
static bool is_wider(struct lum_line *line, double bytes, double ns)
{
    if (bytes / ns * 1e9 <= MUCH * line->bytes_s)
        line->faster.n = 0;
    else if (line->faster.n++ == 0)
        line->faster.bytes = line->faster.ns = 0.0;
    line->faster.bytes += bytes;
    line->faster.ns += ns;
    return line->faster.n == FASTER_RUN;
}

static void know(struct lum_line *line, double bytes, double ns, int64_t now_ns)
{
    if (ns < LEAST_NS)
        ns = LEAST_NS;
    line->sum.bytes = KEPT * line->sum.bytes + bytes;
    line->sum.ns = KEPT * line->sum.ns + ns;
    if (is_wider(line, bytes, ns)) {
        line->sum.bytes = line->faster.bytes;
        line->sum.ns = line->faster.ns;
        line->faster.n = 0;
    }
    line->bytes_s = line->sum.bytes / line->sum.ns * 1e9;
    line->bounds.n = 0;
    line->bounds.bytes = line->bounds.ns = 0.0;
    line->bounds.since_ns = now_ns;
}

/* One above what was thought is news. Those below are, if there is nothing else for long: the greatest of them. */
static void know_bound(struct lum_line *line, double bytes, double ns, int64_t now_ns)
{
    if (ns < LEAST_NS)
        ns = LEAST_NS;
    if (bytes / ns * 1e9 > line->bytes_s) {
        know(line, bytes, ns, now_ns);
        return;
    }
    if (line->bounds.n == 0 || bytes / ns > line->bounds.bytes / line->bounds.ns) {
        line->bounds.bytes = bytes;
        line->bounds.ns = ns;
    }
    line->bounds.n++;
    if (line->bounds.n < BOUNDS && now_ns - line->bounds.since_ns <= BOUNDS_LAST_NS)
        return;
    line->sum.bytes = line->sum.ns = 0.0;
    know(line, line->bounds.bytes, line->bounds.ns, now_ns);
}

/* Of a frame that was sent alone. */
static void learn_alone(struct lum_line *line, double bytes, double ns, int64_t now_ns)
{
    double more = bytes - line->soonest.bytes, longer = ns - line->soonest.ns;
    if (line->soonest.ns > 0.0 && longer > 0.0 && more >= LEAST_BYTES && more >= DIFFERENCE * bytes)
        know(line, more, longer, now_ns);
    else if (bytes >= LEAST_BYTES)
        know_bound(line, bytes, ns, now_ns);
    if (line->soonest.ns <= 0.0 || longer <= 0.0 || now_ns - line->soonest.at_ns > SOONEST_LASTS_NS) {
        line->soonest.bytes = bytes;
        line->soonest.ns = ns;
        line->soonest.at_ns = now_ns;
    }
}

/* Of one that was waiting behind another when the line was through with that: was it there in time? */
static void learn_behind(struct lum_line *line, double bytes, double ns, double waited_ns, int64_t now_ns)
{
    double way_ns = line->bytes_s > 0.0 ? line->soonest.ns - line->soonest.bytes / line->bytes_s * 1e9 : 0.0;
    if (bytes < LEAST_BYTES)
        return;
    if (waited_ns >= way_ns)
        know(line, bytes, ns, now_ns);
    else
        know_bound(line, bytes, ns, now_ns);
}

void lum_line_answer(struct lum_line *line, uint64_t seq, int64_t held_ns, int64_t now_ns)
{
    uint32_t n = 0;
    double bytes = 0.0;
    bool whole = true;
    for (; n < line->n && line->frames[n].seq <= seq; n++) {
        bytes += (double)line->frames[n].n_bytes;
        whole = whole && line->frames[n].whole;
    }
    if (n == 0)
        return;
    int64_t began_ns = line->frames[0].began_ns, waited_ns = line->answered_ns - began_ns;
    line->n -= n;
    memmove(line->frames, line->frames + n, line->n * sizeof line->frames[0]);
    int64_t there_ns = now_ns - held_ns, ns = there_ns - (waited_ns > 0 ? line->answered_ns : began_ns);
    if (whole && ns > 0 && waited_ns > 0)
        learn_behind(line, bytes, (double)ns, (double)waited_ns, now_ns);
    else if (whole && ns > 0)
        learn_alone(line, bytes, (double)ns, now_ns);
    if (there_ns > line->answered_ns)
        line->answered_ns = there_ns;
}

double lum_line_owed_s(const struct lum_line *line)
{
    double bytes = 0.0;
    for (uint32_t i = 0; i < line->n; i++)
        bytes += (double)line->frames[i].n_bytes;
    return line->bytes_s > 0.0 ? bytes / line->bytes_s : 0.0;
}
