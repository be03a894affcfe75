/* A view of the scene as it was at an earlier moment, while all others see it as it is. Thread: the director. */
#ifndef LUM_SERVER_DIRECTOR_VIEW_MOMENT_H
#define LUM_SERVER_DIRECTOR_VIEW_MOMENT_H

#include "server/director/view.h"

/* From one moment to another, or to now, made ready so that it cannot fail any more. */
struct lum_moment_change {
    bool asked, otherwise;               /* for it; the views of the renderer are made anew */
    const struct lum_snapshot *snapshot; /* a reference; NULL: now */
    uint64_t bytes;                      /* that it has apart from the scene */
    struct lum_view *core, *rest;        /* owned */
};
/* What the params ask for. */
bool lum_moment_prepare(const struct lum_server_view *v, struct lum_world *world, const struct lum_view_params *params,
                        struct lum_moment_change *ret_change, struct lum_proto_error *err);
void lum_moment_take(struct lum_server_view *v, struct lum_moment_change *change); /* the change passes over */
void lum_moment_drop(struct lum_moment_change *change);

/* What views of that moment, or of now, share. */
static inline struct lum_caches *lum_moment_caches(const struct lum_world *world, bool moment)
{
    return moment ? world->past : world->caches;
}

#endif
