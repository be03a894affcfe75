/* Effects: parts of light transport that a scene may or may not call for; and the kinds of ray that serve them. */
#ifndef LUM_CORE_TRACE_EFFECT_H
#define LUM_CORE_TRACE_EFFECT_H

#include "core/light/light.h"

/* Every effect, in the order in which they are told. What else there is to know of one is its row (trace/demand.h), in
 * the room of its estimators. */
#define LUM_EFFECTS(X)                                                                                                 \
    X(DIRECT, direct)           /* point, spot, directional light: hard shadows */                                     \
    X(SOFT_SHADOW, soft_shadow) /* quad, disc, sphere, mesh emitters */                                                \
    X(ENVIRONMENT, environment)                                                                                        \
    X(INDIRECT_DIFFUSE, indirect_diffuse)                                                                              \
    X(REFLECTION, reflection)     /* perfect mirror */                                                                 \
    X(TRANSMISSION, transmission) /* what is seen through glass, and what comes through sheets. A lamp's light that    \
                                   * arrives through panes is that lamp's own effect; without this one panes are       \
                                   * opaque, to it as to the eye, and sheets, too */                                   \
    X(GLOSSY, glossy)                                                                                                  \
    X(MEDIA, media)           /* fog: what it takes from light, and what it scatters once */                           \
    X(SCATTERING, scattering) /* what fog scatters more than once, or to surfaces, or from them */                     \
    X(ANTIALIAS, antialias)

#define LUM_EFFECT_MEMBER(NAME, name) LUM_EFFECT_##NAME,
enum lum_effect { LUM_EFFECTS(LUM_EFFECT_MEMBER) LUM_EFFECT_COUNT };
extern const char *const lum_effect_names[LUM_EFFECT_COUNT]; /* "direct", "soft_shadow", ... as in the stats */
#define LUM_EFFECT_BIT(e) (1u << (e))
/* name: n_name bytes. False, with *ret_effect as before: there is none of this name. */
bool lum_effect_find(const char *name, size_t n_name, enum lum_effect *ret_effect);

/* Kinds of ray that are counted apart: those of the eye, those of each effect, and others. */
#define LUM_RAY_MEMBER(NAME, name) LUM_RAY_##NAME,
enum lum_ray_kind { LUM_RAY_PRIMARY, LUM_EFFECTS(LUM_RAY_MEMBER) LUM_RAY_VPL, LUM_RAY_PROBE, LUM_RAY_KIND_COUNT };
const char *lum_ray_kind_name(enum lum_ray_kind kind); /* that of an effect is the effect's */

/* The kind of ray that serves an effect. */
static inline enum lum_ray_kind lum_effect_ray_kind(enum lum_effect e)
{
    return (enum lum_ray_kind)((int)e + LUM_RAY_PRIMARY + 1);
}

/* The effect that the light of an emitter belongs to. */
static inline enum lum_effect lum_light_effect(const struct lum_light *l)
{
    if (l->kind == &lum_emitter_environment)
        return LUM_EFFECT_ENVIRONMENT;
    return l->delta ? LUM_EFFECT_DIRECT : LUM_EFFECT_SOFT_SHADOW;
}

/* The kind of shadow ray that a light asks for. */
static inline enum lum_ray_kind lum_light_ray_kind(const struct lum_light *l)
{
    return lum_effect_ray_kind(lum_light_effect(l));
}

#endif
