/* Methods and effects.
 *
 * An effect is a part of light transport that a scene may or may not call for. An estimator computes one or several
 * effects of a frame. A method is a row in a table that says which estimator serves each effect; adding a method is one
 * row, and its estimator one file. All methods live in one binary and are chosen per view at run time. */
#ifndef LUM_CORE_METHOD_METHOD_H
#define LUM_CORE_METHOD_METHOD_H

#include "core/base/base.h"

enum lum_effect {
    LUM_EFFECT_DIRECT,           /* point, spot, directional light: hard shadows */
    LUM_EFFECT_SOFT_SHADOW,      /* quad, disc, sphere, mesh emitters */
    LUM_EFFECT_ENVIRONMENT,
    LUM_EFFECT_INDIRECT_DIFFUSE,
    LUM_EFFECT_REFLECTION,       /* perfect mirror */
    LUM_EFFECT_TRANSMISSION,     /* what is seen through glass. A lamp's light that arrives through panes is that lamp's own
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

/* Kinds of ray that are counted apart. After LUM_RAY_PRIMARY come those of the effects, in the order of enum lum_effect. */
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
extern const char *const lum_ray_kind_names[LUM_RAY_KIND_COUNT];

/* What the snapshot calls for, and why: the first thing that does, or why nothing does. */
struct lum_demand {
    bool on[LUM_EFFECT_COUNT];
    char why[LUM_EFFECT_COUNT][LUM_ID_MAX + 64];
};
struct lum_snapshot;
void lum_demand_derive(const struct lum_snapshot *snapshot, struct lum_demand *ret_demand);
/* What the view chooses: anti-aliasing, and effects that it forces off or on (bits 1 << enum lum_effect; off wins). */
struct lum_view_settings;
void lum_demand_choose(struct lum_demand *demand, const struct lum_view_settings *settings);

struct lum_estimator; /* render/frame.h */
struct lum_ais;       /* estimator/ais.h */
struct lum_cache_kind; /* cache/cache.h */

struct lum_method {
    const char *name, *summary;
    bool progressive; /* each pass adds samples; else one pass is the whole answer */
    bool refines;     /* the first pass is a whole answer; while nothing changes, further ones path trace, and take over. It has a
                       * cache or filters: the frame is corrected along the surfaces that these know */
    const struct lum_estimator *serves[LUM_EFFECT_COUNT]; /* NULL: the method leaves this effect out */
    const struct lum_ais *ais; /* interleaved sampling: its parameters; NULL: none */
    bool hard_shadows; /* of quads, discs and spheres, too: one shadow ray per light and pixel (thesis, 6.3) */
    const struct lum_cache_kind *cache; /* what its indirect light is kept in; NULL: nothing */
    uint32_t pattern; /* methods with components: side of the interleaved pattern */
    const struct lum_estimator *filters[2]; /* methods with components: how they become smooth, one after the other */
};

/* The table, in display order; n rows. */
const struct lum_method *lum_methods(size_t *ret_n);
const struct lum_method *lum_method_find(const char *name); /* NULL when there is none */
/* True when lum_view_settings.n_vpls counts for the method: virtual point lights, or rays of a hemisphere. */
bool lum_method_counts_vpls(const struct lum_method *method);

#endif
