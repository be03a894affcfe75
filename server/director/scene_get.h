/* The whole scene as text, for whoever asks: written record by record in slices beside the frames (beside.h), while
 * edits go on, and sent as soon as all of it is as the scene is then. So the answer keeps its place among the news of
 * edits: it has all that were told before it, and none that is told after. Thread: director. */
#ifndef LUM_SERVER_DIRECTOR_SCENE_GET_H
#define LUM_SERVER_DIRECTOR_SCENE_GET_H

#include "server/director/beside.h"
#include "server/director/request.h"

struct lum_scene_text;

/* All zero: nobody waits. */
struct lum_director_scene_gets {
    struct lum_request *waiting; /* oldest first; owned */
    struct lum_scene_text *text; /* for the oldest; NULL: not begun */
};

enum lum_need lum_director_scene_gets_need(const struct lum_director *d);
/* About slice_ns of the text; when it is whole, one answer. */
void lum_director_write_scene(struct lum_director *d, double slice_ns);
/* The session is gone. */
void lum_director_drop_scene_gets(struct lum_director *d, struct lum_session_ref session);
void lum_director_drop_all_scene_gets(struct lum_director *d);

#endif
