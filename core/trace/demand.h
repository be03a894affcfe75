/* What there is to know of an effect apart from how it is estimated: above all what in a scene calls for it. Anything
 * else costs nothing. */
#ifndef LUM_CORE_TRACE_DEMAND_H
#define LUM_CORE_TRACE_DEMAND_H

#include "core/trace/effect.h"

/* What the snapshot calls for, and why: the first thing that does, or why nothing does. */
struct lum_demand {
    bool on[LUM_EFFECT_COUNT];
    uint32_t by_fog; /* bits LUM_EFFECT_BIT: nothing but light that fog scatters calls for these */
    char why[LUM_EFFECT_COUNT][LUM_ID_MAX + 64];
};

/* A scene as effects ask about it. */
struct lum_sights {
    const struct lum_snapshot *snapshot;
    bool lit;          /* some light is on */
    bool each_other;   /* and there are surfaces that may see one another */
    bool fog;          /* and there is fog that scatters: it sends on what surfaces send, and lights them */
    bool shining;      /* something that shines has a body, or is all around: it shows in glossy surfaces, not only in
                          mirrors */
    bool glowing;      /* something shows in mirrors and through glass only: unlit surfaces, fog that is lit */
    const char *alone; /* why no surface sees another */
};

/* How what estimators leave in the buffer of an effect (pass/components.h) comes into the picture. */
enum lum_adds {
    LUM_ADDS_NOTHING, /* it has none */
    LUM_ADDS_WHITE,   /* radiance of a white surface (irradiance / pi): times albedo, dimmed by media before the eye */
    LUM_ADDS_SURFACE, /* radiance that leaves the surface: dimmed likewise */
    LUM_ADDS_AIR,     /* radiance that arrives at the eye */
};

struct lum_estimator; /* pass/pass.h */

struct lum_effect_row {
    /* Calls for the effect, or refuses it. NULL: views do (lum_demand_choose). */
    void (*demand)(const struct lum_sights *see, const struct lum_effect_row *row, enum lum_effect effect,
                   struct lum_demand *demand);
    const char *why, *why_not;     /* what calls for it does, or nothing does: for the two below */
    uint32_t scatter;              /* bits enum lum_scatter: of surfaces that do so */
    bool lamps_count, glow_counts; /* and show lamps in themselves, and what is in no lamp's light */
    enum lum_adds adds;
    /* Serves it in every method that shows frames and adds no samples to them, and whose row names no other. NULL:
     * there is none that suits all. */
    const struct lum_estimator *usual;
    bool guided; /* how often its samples were refined can be seen (lum_view_guidance) */
};
#define LUM_EFFECT_ROW(NAME, name) extern const struct lum_effect_row lum_effect_##name;
LUM_EFFECTS(LUM_EFFECT_ROW)
extern const struct lum_effect_row *const lum_effect_rows[LUM_EFFECT_COUNT];
/* Asks all rows. */
void lum_demand_derive(const struct lum_snapshot *snapshot, struct lum_demand *ret_demand);

/* For rows. Of what calls for an effect, the first counts; to refuse says nothing then. */
void lum_demand_call(struct lum_demand *demand, enum lum_effect effect, const char *id, const char *why);
void lum_demand_refuse(struct lum_demand *demand, enum lum_effect effect, const char *why);
/* Of effects of lights: the first of its own that is on calls for it. */
void lum_demand_by_light(const struct lum_sights *see, const struct lum_effect_row *row, enum lum_effect effect,
                         struct lum_demand *demand);
/* Of effects of surfaces: the first that scatters light so, if there is anything to scatter. */
void lum_demand_by_surface(const struct lum_sights *see, const struct lum_effect_row *row, enum lum_effect effect,
                           struct lum_demand *demand);

/* What a view chooses: anti-aliasing, and effects that it forces off or on (bits LUM_EFFECT_BIT; off wins). */
void lum_demand_choose(struct lum_demand *demand, bool antialias, uint32_t effects_off, uint32_t effects_on);

#endif
