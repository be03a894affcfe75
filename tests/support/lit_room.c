#include "tests/support/lit_room.h"

void lit_room(struct rig *r, uint32_t threads)
{
    rig_begin(r, threads);
    rig_room(r);
    struct lum_light_desc lamp = rig_quad(rig_v(0, 2.9, 0), rig_v(0.8, 0, 0), rig_v(0, 0, 0.8), 300);
    struct lum_light_desc bulb = rig_point(rig_v(-1, 2, 0.5), 60), far = rig_point(rig_v(1, 2.5, 1), 30);
    rig_light(r, "lamp", &lamp);
    rig_light(r, "bulb", &bulb);
    rig_light(r, "far", &far);
    struct lum_material_desc glass = lum_material_default(), mirror = lum_material_default(), glow = rig_diffuse(0.3f);
    glass.transmission = 1.0f;
    glass.roughness = 0.0f;
    glass.attenuation_color = lum_rgb(0.5f, 0.9f, 0.5f);
    glass.attenuation_distance_m = 0.3;
    mirror.metallic = 1.0f;
    mirror.roughness = 0.0f;
    glow.emission_cd_m2 = 40;
    rig_material(r, "glass", &glass);
    rig_material(r, "mirror", &mirror);
    rig_material(r, "glow", &glow);
    rig_box(r, "cube", 0.3, 0.3, 0.3);
    rig_object(r, "glass", "cube", "glass", rig_v(-0.6, 0.3, 0.2));
    rig_object(r, "mirror", "cube", "mirror", rig_v(0.4, 1.35, -0.3));
    rig_object(r, "glow", "cube", "glow", rig_v(-1.2, 0.4, -1.2));
    struct lum_light_desc sky = {.kind = &lum_light_kind_environment, .color = lum_grey(1), .intensity = 5, .on = true};
    rig_light(r, "sky", &sky);
    rig_commit(r);
    r->settings.shadow_samples = 4;
}

void use_method(struct rig *r, const char *method)
{
    r->settings.method = lum_method_find(method);
    assert_non_null(r->settings.method);
}

void assert_no_rays(const struct lum_pass_stats *s, const char *what)
{
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        if (s->rays[k] != 0)
            fail_msg("%s: %llu %s rays", what, (unsigned long long)s->rays[k], lum_ray_kind_name((enum lum_ray_kind)k));
    for (int e = 0; e < LUM_EFFECT_COUNT; e++)
        if (s->effects[e].rays || s->effects[e].tiles || s->effects[e].ns)
            fail_msg("%s: the effect %s did something", what, lum_effect_names[e]);
}
