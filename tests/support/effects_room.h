/* A small scene that calls for any choice of effects, each at full strength, at strength 0, or not at all.
 *
 * Absent and zero scenes have the same surfaces in the same places, so that their pictures must agree bit for bit. Only
 * one effect is varied at a time; the others are there, but for indirect_diffuse: it is absent where no surface faces
 * another, which leaves no room for the objects of the others. */
#ifndef LUM_TESTS_SUPPORT_EFFECTS_ROOM_H
#define LUM_TESTS_SUPPORT_EFFECTS_ROOM_H

#include "core/method/method.h"
#include "tests/support/rig.h"

enum strength { STRENGTH_ABSENT, STRENGTH_ZERO, STRENGTH_FULL, N_STRENGTHS };

struct effects_room {
    enum lum_effect varied;
    enum strength strength;
};

static inline enum strength effects_room_strength(const struct effects_room *s, enum lum_effect e)
{
    return e == s->varied ? s->strength : STRENGTH_FULL;
}

static inline void effects_room_lights(struct rig *r, const struct effects_room *s)
{
    enum strength direct = effects_room_strength(s, LUM_EFFECT_DIRECT),
                  soft = effects_room_strength(s, LUM_EFFECT_SOFT_SHADOW),
                  sky = effects_room_strength(s, LUM_EFFECT_ENVIRONMENT);
    struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), direct == STRENGTH_ZERO ? 0.0 : 60.0);
    bulb.on = direct != STRENGTH_ABSENT;
    rig_light(r, "bulb", &bulb);
    struct lum_light_desc panel =
        rig_quad(rig_v(0.5, 2.2, 0), rig_v(0.5, 0, 0), rig_v(0, 0, 0.5), soft == STRENGTH_ZERO ? 0.0 : 90.0);
    panel.on = soft != STRENGTH_ABSENT;
    rig_light(r, "panel", &panel);
    if (sky == STRENGTH_ABSENT)
        return;
    struct lum_light_desc env = {.kind = &lum_light_kind_environment,
                                 .color = lum_grey(1),
                                 .intensity = sky == STRENGTH_ZERO ? 0.0 : 3.0,
                                 .on = true,
                                 .camera_visible = true};
    rig_light(r, "sky", &env);
}

static inline void effects_room_item(struct rig *r, const char *id, const struct lum_material_desc *m,
                                     struct lum_vec3d at)
{
    rig_material(r, id, m);
    rig_object(r, id, "item", id, at);
}

/* Three boxes: a mirror, a pane of coloured glass, and one with a gloss. */
static inline void effects_room_items(struct rig *r, const struct effects_room *s)
{
    enum strength mirror = effects_room_strength(s, LUM_EFFECT_REFLECTION),
                  glass = effects_room_strength(s, LUM_EFFECT_TRANSMISSION),
                  gloss = effects_room_strength(s, LUM_EFFECT_GLOSSY);
    struct lum_material_desc m = rig_diffuse(0.3f);
    if (mirror == STRENGTH_FULL)
        m.metallic = 1.0f;
    if (mirror != STRENGTH_ABSENT)
        m.roughness = 0.0f; /* at strength 0: smooth, but without an interface */
    effects_room_item(r, "mirror", &m, rig_v(-0.7, 0.25, -0.5));

    m = rig_diffuse(1.0f);
    m.transmission = 1.0f;
    m.thin = true;
    m.ior = 1.0f;
    if (glass == STRENGTH_FULL)
        m.base_color = lum_rgb(0.6f, 0.9f, 0.7f);
    if (glass != STRENGTH_ABSENT)
        effects_room_item(r, "pane", &m, rig_v(0, 0.25, 0.5));

    m = rig_diffuse(0.4f);
    if (gloss != STRENGTH_ABSENT) {
        m.roughness = 0.4f;
        m.specular = 1.0f;
        m.ior = gloss == STRENGTH_ZERO ? 1.0f : 1.5f;
    }
    effects_room_item(r, "vase", &m, rig_v(0.8, 0.25, 0.3));
}

/* Floor and crate. Where nothing is to face anything the crate is black: it reflects nothing, and still casts shadows.
 */
static inline void effects_room_ground(struct rig *r, const struct effects_room *s)
{
    enum strength indirect = effects_room_strength(s, LUM_EFFECT_INDIRECT_DIFFUSE);
    struct lum_material_desc floor = rig_diffuse(0.7f), crate = rig_diffuse(indirect == STRENGTH_FULL ? 0.5f : 0.0f);
    crate.unlit = indirect == STRENGTH_ABSENT;
    rig_material(r, "floor", &floor);
    rig_material(r, "crate", &crate);
    rig_square(r, "floor", 2.0);
    rig_box(r, "item", 0.25, 0.25, 0.25);
    rig_object(r, "floor", "floor", "floor", rig_v(0, 0, 0));
    rig_object(r, "crate", "item", "crate", rig_v(0.3, 0.25, -0.6));
}

static inline void effects_room_media(struct rig *r, const struct effects_room *s)
{
    enum strength fog = effects_room_strength(s, LUM_EFFECT_MEDIA),
                  scatters = effects_room_strength(s, LUM_EFFECT_SCATTERING);
    if (fog == STRENGTH_ABSENT)
        return;
    struct lum_medium_desc d = {.lo = rig_v(-1.5, 0, -1.5), .hi = rig_v(1.5, 1, 1)};
    if (fog == STRENGTH_FULL) /* what scatters light once scatters it again: without that it only absorbs */
        *(scatters == STRENGTH_FULL ? &d.sigma_s : &d.sigma_a) = lum_grey(0.1f);
    RIG_OK(lum_scene_put_medium(r->scene, "fog", &d, &err));
}

/* Everything into a rig that was just begun. */
static inline void effects_room_furnish(struct rig *r, const struct effects_room *s)
{
    effects_room_ground(r, s);
    effects_room_lights(r, s);
    if (s->varied != LUM_EFFECT_INDIRECT_DIFFUSE) {
        effects_room_items(r, s);
        effects_room_media(r, s);
    }
    rig_camera(r, rig_v(0.2, 1.1, 2.6), rig_v(0, 0.4, -0.2), 45);
    r->settings.antialias = effects_room_strength(s, LUM_EFFECT_ANTIALIAS) == STRENGTH_FULL;
    r->settings.n_vpls = 32;
    r->settings.shadow_samples = 4;
    rig_commit(r);
}

#endif
