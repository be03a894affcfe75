#include "server/director/rest.h"

#include "server/director/view_moment.h"

#include "server/world/apply.h"

struct lum_view *lum_rest_shown_core(const struct lum_server_view *v)
{
    return v->rest.shown ? v->rest.core : v->core;
}

const struct lum_view_settings *lum_rest_shown_settings(const struct lum_server_view *v)
{
    return v->rest.shown ? &v->rest.settings : &v->settings;
}

void lum_server_view_shown_size(const struct lum_server_view *v, uint32_t ret_size[2])
{
    ret_size[0] = lum_rest_shown_settings(v)->w;
    ret_size[1] = lum_rest_shown_settings(v)->h;
}

bool lum_rest_is_larger(const struct lum_server_view *v)
{
    const double *size = v->want.rest_size;
    return v->rest.core && !v->rest.failed && !v->settings.deterministic && /* it begins by the clock */
           size[0] * size[1] > (double)v->settings.w * v->settings.h;
}

bool lum_rest_reserve(struct lum_server_view *v, const struct lum_world *world, struct lum_proto_error *err)
{
    struct lum_error e;
    if (v->rest.core || !(v->want.given & LUM_VIEW_BIT(REST_SIZE)))
        return true;
    if (lum_view_create(world->pool, &v->rest.core, &e))
        return lum_apply_error(&e, "", err);
    lum_view_share(v->rest.core, lum_moment_caches(world, v->moment));
    return true;
}

bool lum_rest_may_begin(const struct lum_server_view *v)
{
    const struct lum_pass_stats *last = &v->last_pass;
    return !v->stale && lum_rest_is_larger(v) && last->spp > 0 && last->preview <= 1 &&
           (lum_server_view_stopped_by(v) || lum_clock_ns() - v->newest_ns >= LUM_VIEW_REST_NS);
}
