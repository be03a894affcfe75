/* Work beside the frames: probes, reports and the text of the scene and of what it was, for which sessions wait, and
 * what sensors show. It is done in slices of a few milliseconds; while views want passes it has a share of the time,
 * and else all of it. Between two slices the director looks at what was posted, so that no work, however long, keeps an
 * edit waiting. Thread: director.
 */
#ifndef LUM_SERVER_DIRECTOR_BESIDE_H
#define LUM_SERVER_DIRECTOR_BESIDE_H

#include <stdbool.h>
#include <stdint.h>

struct lum_director;
struct lum_server_view;

/* How much work of a kind is wanted. */
enum lum_need {
    LUM_NEED_NOTHING,
    LUM_NEED_REFINES, /* what is known grows more exact */
    LUM_NEED_AWAITED, /* somebody waits for it: an answer, or values that follow a hand */
};

/* All zero: nothing was done yet. */
struct lum_beside {
    double saved_ns;    /* of the share, what may be taken; below 0: taken ahead */
    int64_t counted_ns; /* until when it is counted */
    int turn;           /* the kind of work that was done last */
};

enum lum_beside_state {
    LUM_BESIDE_DONE, /* there is nothing to do */
    LUM_BESIDE_MORE,
    LUM_BESIDE_OWED, /* more, and its time has come: before the next pass */
};

/* The share of the time that it has before the picture of a change: of many views that wait for that, and whose clients
 * read, each has as much as what is asked for beside them. views: a list, linked by next. */
double lum_beside_share(const struct lum_server_view *views, int64_t now_ns);

/* One slice, if its time has come; view: that wants a pass next, NULL: none does. */
enum lum_beside_state lum_director_work_beside(struct lum_director *d, const struct lum_server_view *view);

#endif
