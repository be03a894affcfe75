#include "core/trace/demand.h"

#include <stdio.h>

#include "core/scene/snapshot.h"
#include "core/trace/facing.h"

#define ROW(NAME, name) &lum_effect_##name,
const struct lum_effect_row *const lum_effect_rows[LUM_EFFECT_COUNT] = {LUM_EFFECTS(ROW)};

static struct lum_sights sights_of(const struct lum_snapshot *s)
{
    static const char *const alone[] = {
        [LUM_FACING_NOTHING] = "no object reflects",
        [LUM_FACING_FLAT] = "no surface faces another: all lie in one plane",
        [LUM_FACING_CONVEX] = "no surface faces another: one convex solid, lit from outside",
        [LUM_FACING_EACH_OTHER] = "nothing shines that it could show",
    };
    enum lum_facing facing = lum_surfaces_facing(s);
    struct lum_sights sights = {.snapshot = s, .lit = s->lights.n_active > 0, .alone = alone[facing]};
    sights.each_other = sights.lit && facing == LUM_FACING_EACH_OTHER;
    for (uint32_t a = 0; a < s->lights.n_active; a++)
        sights.shining = sights.shining || !s->lights.lights[s->lights.active[a]].delta;
    for (uint32_t i = 0; i < s->n_media && sights.lit; i++)
        sights.glowing = sights.glowing || !lum_rgb_black(s->media[i].sigma_s);
    sights.fog = sights.glowing;
    for (uint32_t i = 0; i < s->n_instances; i++)
        sights.glowing = sights.glowing || s->materials[s->instances[i].material].unlit;
    return sights;
}

void lum_demand_derive(const struct lum_snapshot *snapshot, struct lum_demand *ret_demand)
{
    struct lum_sights sights = sights_of(snapshot);
    struct lum_demand d = {0};
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (lum_effect_rows[e]->demand)
            lum_effect_rows[e]->demand(&sights, lum_effect_rows[e], (enum lum_effect)e, &d);
    *ret_demand = d;
}

void lum_demand_call(struct lum_demand *d, enum lum_effect effect, const char *id, const char *why)
{
    d->by_fog &= ~LUM_EFFECT_BIT(effect);
    if (d->on[effect])
        return;
    d->on[effect] = true;
    snprintf(d->why[effect], sizeof d->why[effect], "%s %s", id, why);
}

void lum_demand_refuse(struct lum_demand *d, enum lum_effect effect, const char *why)
{
    if (!d->on[effect])
        snprintf(d->why[effect], sizeof d->why[effect], "%s", why);
}

void lum_demand_by_light(const struct lum_sights *see, const struct lum_effect_row *row, enum lum_effect effect,
                         struct lum_demand *d)
{
    const struct lum_light_table *t = &see->snapshot->lights;
    for (uint32_t a = 0; a < t->n_active; a++)
        if (lum_light_effect(&t->lights[t->active[a]]) == effect)
            lum_demand_call(d, effect, t->lights[t->active[a]].id, row->why);
    lum_demand_refuse(d, effect, row->why_not);
}

void lum_demand_by_surface(const struct lum_sights *see, const struct lum_effect_row *row, enum lum_effect effect,
                           struct lum_demand *d)
{
    const struct lum_snapshot *s = see->snapshot;
    bool without_fog = see->each_other || (row->lamps_count && see->shining) || (row->glow_counts && see->glowing);
    bool anything = without_fog || see->fog, was_on = d->on[effect];
    const char *refused = row->why_not;
    for (uint32_t i = 0; i < s->n_instances; i++) {
        if (!(lum_material_scatter(&s->materials[s->instances[i].material]) & row->scatter))
            continue;
        if (anything)
            lum_demand_call(d, effect, s->instances[i].id, row->why);
        refused = see->lit ? see->alone : "no light is on";
    }
    lum_demand_refuse(d, effect, refused);
    if (d->on[effect] && !was_on && !without_fog)
        d->by_fog |= LUM_EFFECT_BIT(effect);
}

void lum_demand_choose(struct lum_demand *d, bool antialias, uint32_t effects_off, uint32_t effects_on)
{
    d->on[LUM_EFFECT_ANTIALIAS] = antialias;
    snprintf(d->why[LUM_EFFECT_ANTIALIAS], sizeof d->why[0], "%s",
             antialias ? "the view asks for it" : "the view looks through pixel centres");
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++) {
        bool off = effects_off & 1u << e, on = effects_on & 1u << e;
        if (!off && !on)
            continue;
        d->on[e] = !off;
        snprintf(d->why[e], sizeof d->why[e], "%s", off ? "the view switched it off" : "the view forces it on");
    }
    if (d->on[LUM_EFFECT_SCATTERING] && !d->on[LUM_EFFECT_MEDIA]) { /* fog that is not there scatters nothing */
        d->on[LUM_EFFECT_SCATTERING] = false;
        snprintf(d->why[LUM_EFFECT_SCATTERING], sizeof d->why[0], "the view leaves fog out");
    }
}
