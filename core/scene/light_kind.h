/* What tells the kinds of light apart in the scene's own terms. A kind is one row of light_kind.c. */
#ifndef LUM_CORE_SCENE_LIGHT_KIND_H
#define LUM_CORE_SCENE_LIGHT_KIND_H

#include "core/light/light.h"
#include "core/scene/desc.h"

/* Luminance, intensity and illuminance: the sun's disc is 1.6e9 cd/m2; the square of a scene scale still fits a float.
 */
#define LUM_POWER_MAX 1e12

struct lum_light_kind_row {
    const char *name;         /* as in records: "spot" */
    enum lum_emitter emitter; /* what it is at render time; tells the unit of its intensity too: cd of a point, lx of a
                                 directional light, else cd/m2 */
    enum lum_falloff falloff; /* of a point */
    bool aimed;               /* has a direction */
    /* Checks the fields that it has alone. NULL: none. */
    enum lum_status (*check)(const struct lum_light_desc *d, struct lum_error *err);
    double (*flux)(const struct lum_light_desc *d); /* lm of intensity 1. NULL: it has none to tell */
};
extern const struct lum_light_kind_row lum_light_kinds[LUM_LIGHT_KIND_COUNT];

/* Refuses a kind that there is not, and what its shape must not be. */
LUM_MUST_USE enum lum_status lum_light_kind_check(const struct lum_light_desc *d, struct lum_error *err);

#endif
