/* Which effects a snapshot calls for, and the first thing that does. */
#include "core/method/method.h"

#include <stdio.h>

#include "core/render/view.h"

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

static void demand_of_material(const struct lum_material *m, const char *object, struct lum_demand *d)
{
    if (m->unlit)
        return;
    bool metal = m->metallic > 0.0f, coat = m->metallic < 1.0f && m->specular > 0.0f && m->ior > 1.0f;
    bool glass = m->transmission > 0.0f && m->metallic < 1.0f, base = m->metallic < 1.0f && m->transmission < 1.0f;
    if (base && !lum_rgb_black(m->base_color))
        demand(d, LUM_EFFECT_INDIRECT_DIFFUSE, object, "reflects light diffusely");
    bool total = glass && !m->thin && m->ior > 1.0f; /* from inside, whatever specular is */
    if (metal || coat || total) {
        if (lum_material_is_specular(m) && m->roughness * m->roughness < LUM_ALPHA_MIN)
            demand(d, LUM_EFFECT_REFLECTION, object, "is a mirror");
        else
            demand(d, LUM_EFFECT_GLOSSY, object, "reflects with a gloss");
    }
    if (glass)
        demand(d, LUM_EFFECT_TRANSMISSION, object, "lets light through");
}

void lum_demand_choose(struct lum_demand *d, const struct lum_view_settings *settings)
{
    d->on[LUM_EFFECT_ANTIALIAS] = settings->antialias;
    snprintf(d->why[LUM_EFFECT_ANTIALIAS], sizeof d->why[0], "%s",
             settings->antialias ? "the view asks for it" : "the view looks through pixel centres");
    for (uint32_t e = 0; e < LUM_EFFECT_COUNT; e++) {
        bool off = settings->effects_off & 1u << e, on = settings->effects_on & 1u << e;
        if (!off && !on)
            continue;
        d->on[e] = !off;
        snprintf(d->why[e], sizeof d->why[e], "%s", off ? "the view switched it off" : "the view forces it on");
    }
}

void lum_demand_derive(const struct lum_snapshot *s, struct lum_demand *ret_demand)
{
    struct lum_demand d = {0};
    for (uint32_t a = 0; a < s->lights.n_active; a++)
        demand_of_light(&s->lights.lights[s->lights.active[a]], &d);
    refuse(&d, LUM_EFFECT_DIRECT, "no point, spot or directional light is on");
    refuse(&d, LUM_EFFECT_SOFT_SHADOW, "no light with an area is on");
    refuse(&d, LUM_EFFECT_ENVIRONMENT, "no environment light is on");
    const char *nothing = "no object reflects in this way";
    if (s->lights.n_active == 0)
        nothing = "no light is on";
    for (uint32_t i = 0; s->lights.n_active > 0 && i < s->n_instances; i++)
        demand_of_material(&s->materials[s->instances[i].material], s->instances[i].id, &d);
    for (int e = LUM_EFFECT_INDIRECT_DIFFUSE; e <= LUM_EFFECT_GLOSSY; e++)
        refuse(&d, (enum lum_effect)e, nothing);
    for (uint32_t i = 0; i < s->n_media; i++)
        demand(&d, LUM_EFFECT_MEDIA, s->media[i].id,
               lum_rgb_black(s->media[i].sigma_s) ? "absorbs light" : "scatters light");
    refuse(&d, LUM_EFFECT_MEDIA, "no medium scatters or absorbs light");
    *ret_demand = d;
}
