/* From what was sent to the first complete frame that shows it. Times are given by the caller, so that tests need no
 * clock. */
#ifndef LUM_CLIENTS_REPLAY_LATENCY_H
#define LUM_CLIENTS_REPLAY_LATENCY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct cJSON;

/* ---- a set of durations ---- */
struct samples {
    double *us;
    size_t n, capacity;
    bool failed; /* memory was short: some are missing */
};
void samples_finish(struct samples *s);
void samples_add(struct samples *s, double us);
/* Sorts. Nearest rank: the least sample that at least p percent are not above; 0 < p <= 100. 0 when there are none. */
double samples_percentile(struct samples *s, double p);
/* {"n","min","p50","p90","p95","p99","max"}, or null when there are none. NULL: memory is short. */
struct cJSON *samples_to_json(struct samples *s);

/* ---- what waits for its frame ----
 * A mark is a number that grows: the scene revision of an edit (known once its reply came), or a camera_seq. */
#define LATENCY_WAITING_MAX 4096
#define LATENCY_FRAMES_KEPT 64
struct latency {
    struct {
        uint64_t request, mark; /* mark 0: not known yet */
        int64_t sent_ns;
    } waiting[LATENCY_WAITING_MAX];
    size_t n_waiting;
    struct {
        uint64_t mark;
        int64_t t_ns;
    } frames[LATENCY_FRAMES_KEPT]; /* the last complete ones, oldest first: a reply may come after its frame */
    size_t n_frames;
    struct samples samples;
};
/* request names it until its mark is known; false when too many wait. */
bool latency_sent(struct latency *l, uint64_t request, uint64_t mark, int64_t now_ns);
void latency_marked(struct latency *l, uint64_t request, uint64_t mark);
void latency_refused(struct latency *l, uint64_t request);
/* A complete frame that shows everything up to mark. */
void latency_frame(struct latency *l, uint64_t mark, int64_t t_ns);

#endif
