#include "server/stream/line.h"

#include <string.h>

/* Under so many bytes the time is that of threads that wake. */
#define LEAST_BYTES 4096.0
/* The way may have become longer: the soonest answer is looked for anew. */
#define SOONEST_LASTS_NS 10000000000ll
/* Frames tell the rate by their difference if that is at least this part of the larger one. */
#define DIFFERENCE 0.25
/* Of what a frame tells, against all before it: after three frames 7/8 is new. */
#define WEIGHT 0.5

void lum_line_begin(struct lum_line *line, uint64_t seq, int64_t now_ns)
{
    if (line->n == LUM_LIMIT_UNACKED_FRAMES)
        memmove(line->frames, line->frames + 1, --line->n * sizeof line->frames[0]);
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

static void know(struct lum_line *line, double bytes_s)
{
    line->bytes_s += line->bytes_s > 0.0 ? WEIGHT * (bytes_s - line->bytes_s) : bytes_s;
}

static void know_bound(struct lum_line *line, double bytes_s)
{
    if (bytes_s > line->bytes_s)
        know(line, bytes_s);
}

/* Of a frame that was sent alone. */
static void learn_alone(struct lum_line *line, double bytes, double ns, int64_t now_ns)
{
    double more = bytes - line->soonest.bytes, longer = ns - line->soonest.ns;
    if (line->soonest.ns > 0.0 && longer > 0.0 && more >= LEAST_BYTES && more >= DIFFERENCE * bytes)
        know(line, more / longer * 1e9);
    else if (bytes >= LEAST_BYTES)
        know_bound(line, bytes / ns * 1e9);
    if (line->soonest.ns <= 0.0 || longer <= 0.0 || now_ns - line->soonest.at_ns > SOONEST_LASTS_NS) {
        line->soonest.bytes = bytes;
        line->soonest.ns = ns;
        line->soonest.at_ns = now_ns;
    }
}

/* Of one that was waiting behind another when the line was through with that: was it there in time? */
static void learn_behind(struct lum_line *line, double bytes, double ns, double waited_ns)
{
    double way_ns = line->bytes_s > 0.0 ? line->soonest.ns - line->soonest.bytes / line->bytes_s * 1e9 : 0.0;
    if (bytes < LEAST_BYTES)
        return;
    if (waited_ns >= way_ns)
        know(line, bytes / ns * 1e9);
    else
        know_bound(line, bytes / ns * 1e9);
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
        learn_behind(line, bytes, (double)ns, (double)waited_ns);
    else if (whole && ns > 0)
        learn_alone(line, bytes, (double)ns, now_ns);
    if (there_ns > line->answered_ns)
        line->answered_ns = there_ns;
}
