/* Which effects a snapshot calls for, and the first thing that does. */
#include "core/trace/demand.h"

#include <stdio.h>

#include "core/scene/snapshot.h"
#include "core/trace/facing.h"

static void demand(struct lum_demand *d, enum lum_effect effect, const char *id, const char *why)
{
    if (d->on[effect])
        return;
    d->on[effect] = true;
    snprintf(d->why[effect], sizeof d->why[effect], "%s %s", id, why);
}

static void refuse(struct lum_demand *d, enum lum_effect effect, const char *why)
{
    if (!d->on[effect])
        snprintf(d->why[effect], sizeof d->why[effect], "%s", why);
}

static void demand_of_light(const struct lum_light *l, struct lum_demand *d)
{
    if (l->kind == LUM_EMIT_ENVIRONMENT)
        demand(d, LUM_EFFECT_ENVIRONMENT, l->id, "shines from all around");
    else if (l->delta)
        demand(d, LUM_EFFECT_DIRECT, l->id, "shines from a point or direction");
    else
        demand(d, LUM_EFFECT_SOFT_SHADOW, l->id, "shines from an area");
}

static void demand_of_lights(const struct lum_snapshot *s, struct lum_demand *d)
{
    for (uint32_t a = 0; a < s->lights.n_active; a++)
        demand_of_light(&s->lights.lights[s->lights.active[a]], d);
    refuse(d, LUM_EFFECT_DIRECT, "no point, spot or directional light is on");
    refuse(d, LUM_EFFECT_SOFT_SHADOW, "no light with an area is on");
    refuse(d, LUM_EFFECT_ENVIRONMENT, "no environment light is on");
}

/* ---- what surfaces do with the light of others ---- */

/* What there is to see from a surface. */
struct sights {
    bool lit;     /* some light is on */
    bool shining; /* something that shines has a body, or is all around: it shows in glossy surfaces, not only in
                     mirrors */
    bool glowing; /* something shows in mirrors and through glass only: unlit surfaces, fog that is lit */
    enum lum_facing facing;
};

static struct sights look_around(const struct lum_snapshot *s)
{
    struct sights sights = {.lit = s->lights.n_active > 0, .facing = lum_surfaces_facing(s)};
    for (uint32_t a = 0; a < s->lights.n_active; a++)
        sights.shining = sights.shining || !s->lights.lights[s->lights.active[a]].delta;
    for (uint32_t i = 0; i < s->n_media && sights.lit; i++)
        sights.glowing = sights.glowing || !lum_rgb_black(s->media[i].sigma_s);
    for (uint32_t i = 0; i < s->n_instances; i++)
        sights.glowing = sights.glowing || s->materials[s->instances[i].material].unlit;
    return sights;
}

static void demand_of_object(const struct lum_material *m, const char *object, const struct sights *see,
                             struct lum_demand *d)
{
    uint32_t scatter = lum_material_scatter(m);
    bool others = see->lit && see->facing == LUM_FACING_EACH_OTHER, lights = see->lit && see->shining;
    if (scatter & LUM_SCATTER_DIFFUSE && others)
        demand(d, LUM_EFFECT_INDIRECT_DIFFUSE, object, "passes its light on to other surfaces");
    if (scatter & LUM_SCATTER_GLOSS && (others || lights))
        demand(d, LUM_EFFECT_GLOSSY, object, "reflects with a gloss");
    if (scatter & LUM_SCATTER_MIRROR && (others || lights || see->glowing))
        demand(d, LUM_EFFECT_REFLECTION, object, "is a mirror");
    if (scatter & LUM_SCATTER_THROUGH && (others || lights || see->glowing))
        demand(d, LUM_EFFECT_TRANSMISSION, object, "lets light through");
}

static void refuse_scattering(const struct sights *see, uint32_t scatter, struct lum_demand *d)
{
    static const struct {
        enum lum_effect effect;
        uint32_t scatter;
        const char *why;
    } rows[] = {
        {LUM_EFFECT_INDIRECT_DIFFUSE, LUM_SCATTER_DIFFUSE, "no object is matte and not black"},
        {LUM_EFFECT_REFLECTION, LUM_SCATTER_MIRROR, "no object is a mirror"},
        {LUM_EFFECT_TRANSMISSION, LUM_SCATTER_THROUGH, "no object lets light through"},
        {LUM_EFFECT_GLOSSY, LUM_SCATTER_GLOSS, "no object reflects with a gloss"},
    };
    static const char *const alone[] = {
        [LUM_FACING_NOTHING] = "no object reflects",
        [LUM_FACING_FLAT] = "no surface faces another: all lie in one plane",
        [LUM_FACING_CONVEX] = "no surface faces another: one convex solid, lit from outside",
        [LUM_FACING_EACH_OTHER] = "nothing shines that it could show",
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++)
        refuse(d, rows[i].effect,
               !(scatter & rows[i].scatter) ? rows[i].why
               : see->lit                   ? alone[see->facing]
                                            : "no light is on");
}

static void demand_of_objects(const struct lum_snapshot *s, struct lum_demand *d)
{
    struct sights see = look_around(s);
    uint32_t scatter = 0;
    for (uint32_t i = 0; i < s->n_instances; i++) {
        const struct lum_material *m = &s->materials[s->instances[i].material];
        scatter |= lum_material_scatter(m);
        demand_of_object(m, s->instances[i].id, &see, d);
    }
    refuse_scattering(&see, scatter, d);
}

/* Black stays black in fog: without any light there is nothing to dim or to scatter. */
static void demand_of_media(const struct lum_snapshot *s, struct lum_demand *d)
{
    bool anything = s->lights.n_active > 0;
    for (uint32_t i = 0; i < s->n_instances && !anything; i++)
        anything = s->materials[s->instances[i].material].unlit;
    for (uint32_t i = 0; i < s->n_media && anything; i++)
        demand(d, LUM_EFFECT_MEDIA, s->media[i].id,
               lum_rgb_black(s->media[i].sigma_s) ? "absorbs light" : "scatters light");
    refuse(d, LUM_EFFECT_MEDIA, s->n_media ? "no light is on" : "no medium scatters or absorbs light");
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
}

void lum_demand_derive(const struct lum_snapshot *s, struct lum_demand *ret_demand)
{
    struct lum_demand d = {0};
    demand_of_lights(s, &d);
    demand_of_objects(s, &d);
    demand_of_media(s, &d);
    *ret_demand = d;
}
