/* A room of two lamps, which are dimmed, switched and moved. */
#ifndef LUM_TESTS_NUMERIC_RELIGHT_ROOM_H
#define LUM_TESTS_NUMERIC_RELIGHT_ROOM_H

#include "tests/numeric/fog.h"

static inline void put_lamp(struct rig *r, double power, bool on)
{
    struct lum_light_desc d = rig_quad(rig_v(0, 2.9, 0), rig_v(0.5, 0, 0), rig_v(0, 0, 0.5), 300 * power);
    d.on = on;
    rig_light(r, "lamp", &d);
}

static inline void put_bulb(struct rig *r, double power, bool on)
{
    struct lum_light_desc d = rig_point(rig_v(-1, 2, 0.5), 60 * power);
    d.on = on;
    rig_light(r, "bulb", &d);
}

/* A brushed crate between a lamp and a bulb, with or without fog around it. */
static inline void room(struct rig *r, bool fog)
{
    rig_begin(r, 0);
    rig_room(r);
    struct lum_material_desc brushed = rig_diffuse(0.8f);
    brushed.metallic = 1.0f;
    brushed.roughness = 0.4f;
    rig_material(r, "brushed", &brushed);
    rig_box(r, "crate", 0.5, 0.5, 0.5);
    rig_object(r, "crate", "crate", "brushed", rig_v(0.3, 0.5, -0.5));
    put_lamp(r, 1, true);
    put_bulb(r, 1, true);
    struct lum_medium_desc haze = fog_everywhere(0.2f, 0.1f, 0.5f);
    if (fog)
        put_fog(r, "fog", &haze);
    rig_camera(r, rig_v(0.3, 1.5, 1.9), rig_v(0, 1, -1), 70);
    r->settings.method = lum_method_find("live");
    r->settings.antialias = false; /* eye rays at edges are traced for every picture */
    r->settings.max_spp = 1;
    r->settings.shadow_budget = 0; /* or shadows learn more from frame to frame */
    r->settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    r->settings.w = 60;
    r->settings.h = 50;
}

#endif
