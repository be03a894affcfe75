/* Effects: parts of light transport that a scene may or may not call for; and the kinds of ray that serve them. */
#ifndef LUM_CORE_TRACE_EFFECT_H
#define LUM_CORE_TRACE_EFFECT_H

#include "core/light/light.h"

enum lum_effect {
    LUM_EFFECT_DIRECT,      /* point, spot, directional light: hard shadows */
    LUM_EFFECT_SOFT_SHADOW, /* quad, disc, sphere, mesh emitters */
    LUM_EFFECT_ENVIRONMENT,
    LUM_EFFECT_INDIRECT_DIFFUSE,
    LUM_EFFECT_REFLECTION,   /* perfect mirror */
    LUM_EFFECT_TRANSMISSION, /* what is seen through glass. A lamp's light that arrives through panes is that lamp's own
                              * effect; without this one panes are opaque, to it as to the eye */
    LUM_EFFECT_GLOSSY,
    LUM_EFFECT_MEDIA,
    LUM_EFFECT_ANTIALIAS,
    LUM_EFFECT_COUNT
};
extern const char *const lum_effect_names[LUM_EFFECT_COUNT]; /* "direct", "soft_shadow", ... as in the stats */
#define LUM_EFFECT_BIT(e) (1u << (e))
/* name: n_name bytes. False, with *ret_effect as before: there is none of this name. */
bool lum_effect_find(const char *name, size_t n_name, enum lum_effect *ret_effect);

/* Kinds of ray that are counted apart. After LUM_RAY_PRIMARY come those of the effects, in the order of enum
 * lum_effect. */
enum lum_ray_kind {
    LUM_RAY_PRIMARY,
    LUM_RAY_DIRECT,
    LUM_RAY_SOFT_SHADOW,
    LUM_RAY_ENVIRONMENT,
    LUM_RAY_INDIRECT_DIFFUSE,
    LUM_RAY_REFLECTION,
    LUM_RAY_TRANSMISSION,
    LUM_RAY_GLOSSY,
    LUM_RAY_MEDIA,
    LUM_RAY_ANTIALIAS,
    LUM_RAY_VPL,
    LUM_RAY_PROBE,
    LUM_RAY_KIND_COUNT
};
const char *lum_ray_kind_name(enum lum_ray_kind kind); /* that of an effect is the effect's */

/* The kind of ray that serves an effect: both enumerations are in the same order but for primary rays. */
static inline enum lum_ray_kind lum_effect_ray_kind(enum lum_effect e)
{
    return (enum lum_ray_kind)((int)e + LUM_RAY_DIRECT);
}
_Static_assert((int)LUM_RAY_VPL == (int)LUM_RAY_DIRECT + LUM_EFFECT_COUNT, "a kind of ray for each effect");

/* The effect that the light of an emitter belongs to. */
static inline enum lum_effect lum_light_effect(const struct lum_light *l)
{
    if (l->kind == LUM_EMIT_ENVIRONMENT)
        return LUM_EFFECT_ENVIRONMENT;
    return l->delta ? LUM_EFFECT_DIRECT : LUM_EFFECT_SOFT_SHADOW;
}

/* The kind of shadow ray that a light asks for. */
static inline enum lum_ray_kind lum_light_ray_kind(const struct lum_light *l)
{
    return lum_effect_ray_kind(lum_light_effect(l));
}

#endif
