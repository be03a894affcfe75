/* The page of `lumend measure --html` for who asks for it by report.get: what the sensors show, with pictures. It is
 * made in slices beside the frames (beside.h), of one revision of the scene, whatever is edited meanwhile; one report
 * at a time. Thread: director. */
#ifndef LUM_SERVER_DIRECTOR_REPORTS_H
#define LUM_SERVER_DIRECTOR_REPORTS_H

#include "server/director/beside.h"
#include "server/director/request.h"

struct lum_reporting;

/* All zero: nobody waits. */
struct lum_director_reports {
    struct lum_request *waiting; /* oldest first; owned */
    struct lum_reporting *now;   /* for the oldest; NULL: not begun */
};

enum lum_need lum_director_reports_need(const struct lum_director *d);
/* About slice_ns of the oldest, or one pass of a picture, which an edit ends; when it is whole, the answer. */
void lum_director_report(struct lum_director *d, double slice_ns);
/* The session is gone. */
void lum_director_drop_reports(struct lum_director *d, struct lum_session_ref session);
void lum_director_drop_all_reports(struct lum_director *d);

#endif
