/* What tells the kinds of light apart in the scene's own terms. A kind is a row. */
#ifndef LUM_CORE_SCENE_LIGHT_KIND_H
#define LUM_CORE_SCENE_LIGHT_KIND_H

#include "core/light/light.h"
#include "core/scene/desc.h"
#include "core/scene/snapshot.h"

/* Luminance, intensity and illuminance: the sun's disc is 1.6e9 cd/m2; the square of a scene scale still fits a float.
 */
#define LUM_POWER_MAX 1e12

struct lum_light_kind_row {
    const struct lum_emitter_row *emitter; /* what it is at render time, and what its intensity is measured in */
    const struct lum_falloff *falloff;     /* of a point */
    bool aimed;                            /* has a direction */
    /* Of the fields that it has alone; each NULL where there are none. Half the box that it fills, in metres; what it
     * becomes at render time, with scene units a metre. */
    enum lum_status (*check)(const struct lum_light_desc *d, struct lum_error *err);
    struct lum_vec3d (*half)(const struct lum_light_desc *d);
    void (*resolve)(const struct lum_light_desc *d, double scale, struct lum_light *inout);
    double (*flux)(const struct lum_light_desc *d); /* lm of intensity 1. NULL: it has none to tell */
};

/* Its shape and power at render time, of a row that has been checked. */
void lum_light_kind_resolve(const struct lum_light_desc *d, const struct lum_normalisation *norm,
                            struct lum_light *ret_light);

/* Refuses a kind that there is not, and what its shape must not be. */
LUM_MUST_USE enum lum_status lum_light_kind_check(const struct lum_light_desc *d, struct lum_error *err);

#endif
