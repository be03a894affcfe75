#include "server/director/view_moment.h"

#include "server/director/budget.h"
#include "server/world/apply.h"

void lum_moment_drop(struct lum_moment_change *c)
{
    lum_snapshot_unref(c->snapshot);
    lum_view_destroy(c->core);
    lum_view_destroy(c->rest);
    *c = (struct lum_moment_change){0};
}

static bool make_core(struct lum_world *world, bool moment, struct lum_view **ret_core, struct lum_proto_error *err)
{
    struct lum_error e;
    if (lum_view_create(world->pool, ret_core, &e))
        return lum_apply_error(&e, "moment", err);
    lum_view_share(*ret_core, lum_moment_caches(world, moment));
    return true;
}

bool lum_moment_prepare(const struct lum_server_view *v, struct lum_world *world, const struct lum_view_params *params,
                        struct lum_moment_change *ret_change, struct lum_proto_error *err)
{
    struct lum_moment_change c = {.asked = params->given & LUM_VIEW_BIT(MOMENT)};
    const struct lum_opt *moment = &params->moment;
    *ret_change = (struct lum_moment_change){0};
    /* Of the one that it shows nothing is made anew, nor looked for: it may have become part of another since. */
    if (moment->set && v->moment && v->moment->scene_rev == (uint64_t)moment->value)
        c.asked = false;
    if (!c.asked)
        return true;
    if (moment->set && !lum_world_moment(world, (uint64_t)moment->value, &c.snapshot, &c.bytes, err))
        return false;
    c.otherwise = moment->set != (v->moment != NULL);
    if (c.otherwise && (!make_core(world, moment->set, &c.core, err) ||
                        (v->rest.core && !make_core(world, moment->set, &c.rest, err)))) {
        lum_moment_drop(&c);
        return false;
    }
    *ret_change = c;
    return true;
}

void lum_moment_take(struct lum_server_view *v, struct lum_moment_change *c)
{
    const struct lum_snapshot *was = v->moment;
    if (!c->asked)
        return;
    v->moment = c->snapshot;
    v->moment_bytes = c->bytes;
    c->snapshot = was;
    if (c->otherwise) {
        struct lum_view *core = v->core, *rest = v->rest.core;
        v->core = c->core;
        v->rest.core = c->rest;
        c->core = core;
        c->rest = rest;
        v->stale = true; /* whatever differs: it has no picture yet */
        v->complete = v->failed = v->prepared = false;
        v->sent_spp = 0;
        lum_budget_begin(&v->watch);
    }
    lum_moment_drop(c);
}
