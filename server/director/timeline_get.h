/* timeline.get: what was, as text, for whoever asks. What a moment says is written once, in slices beside the frames
 * (beside.h), and kept until that moment becomes another. The answer is of the scene as it is when it is sent: it has
 * all edits that were told before it. Thread: director. */
#ifndef LUM_SERVER_DIRECTOR_TIMELINE_GET_H
#define LUM_SERVER_DIRECTOR_TIMELINE_GET_H

#include "server/director/beside.h"
#include "server/director/request.h"

/* What a moment says, and all by which one that says something else can be told from it. */
struct lum_told_moment {
    uint64_t rev, to;
    int64_t at_ms;
    uint32_t n_edits, n_joined;
    size_t n_changes;
    bool first;
    char name[LUM_LIMIT_MOMENT_NAME_BYTES + 1], named_by[LUM_LIMIT_ID_BYTES + 1];
    char *text; /* NULL: not written yet */
    size_t n_text;
};

/* All zero: nobody has asked. */
struct lum_director_timeline_gets {
    struct lum_request *waiting;     /* oldest first; owned */
    struct lum_told_moment *moments; /* those of the document when they were looked at last, oldest first */
    size_t n;
};

enum lum_need lum_director_timeline_gets_need(const struct lum_director *d);
/* About slice_ns of the text; when it is whole, one answer. */
void lum_director_write_timeline(struct lum_director *d, double slice_ns);
/* The session is gone. */
void lum_director_drop_timeline_gets(struct lum_director *d, struct lum_session_ref session);
void lum_director_drop_all_timeline_gets(struct lum_director *d); /* and what was written */

#endif
