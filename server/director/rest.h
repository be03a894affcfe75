/* The picture that a view shows once nothing moves, where that is larger (lum_server_view.rest): whether, and which of
 * the two is shown. Internal to the director. */
#ifndef LUM_SERVER_DIRECTOR_REST_H
#define LUM_SERVER_DIRECTOR_REST_H

#include "server/director/view.h"

/* What frames show. */
struct lum_view *lum_rest_shown_core(const struct lum_server_view *v);
const struct lum_view_settings *lum_rest_shown_settings(const struct lum_server_view *v);

/* There will be a larger picture, or is. */
bool lum_rest_is_larger(const struct lum_server_view *v);
/* Of a view that asks for another size at rest. */
bool lum_rest_reserve(struct lum_server_view *v, const struct lum_world *world, struct lum_proto_error *err);
/* The picture goes on, larger, once it has rested or is done. */
bool lum_rest_may_begin(const struct lum_server_view *v);

#endif
