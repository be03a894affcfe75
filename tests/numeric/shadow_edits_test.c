/* Shadows after any edits, soft and hard: a view that has lived through them, passes that were cut short included,
 * shows bit for bit what a new one does. */
#include "tests/support/cut_short.h"
#include "tests/support/effort.h"

enum { RUNS = TEST_EFFORT(24), STEPS = 25 };

/* ---- any edits ---- */

struct dice {
    uint32_t state;
};

static uint32_t roll(struct dice *d, uint32_t n)
{
    d->state = d->state * 1664525u + 1013904223u;
    return (d->state >> 8) % n;
}

static double between(struct dice *d, double lo, double hi)
{
    return lo + (hi - lo) * roll(d, 4096) / 4096.0;
}

static void put_lamp(struct rig *r, struct dice *d, const char *id)
{
    struct lum_light_desc l = rig_quad(rig_v(between(d, -1, 1), between(d, 2.2, 2.8), between(d, -1, 1)),
                                       rig_v(between(d, 0.3, 1.2), 0, 0), rig_v(0, 0, between(d, 0.3, 0.8)), 100);
    uint32_t kind = roll(d, 7);
    if (kind == 1) {
        l.kind = &lum_light_kind_sphere;
        l.radius_m = between(d, 0.05, 0.3);
    } else if (kind == 2) {
        l.kind = &lum_light_kind_disc;
        l.radius_m = between(d, 0.1, 0.5);
        l.direction = rig_v(0, -1, 0.2);
    } else if (kind == 3) {
        l = rig_point(rig_v(between(d, -1, 1), between(d, 1.6, 2.8), between(d, -1, 1)), 100);
    } else if (kind >= 4) {
        l = (struct lum_light_desc){.kind = &lum_light_kind_directional,
                                    .direction = rig_v(between(d, -1, 1), -1, between(d, -1, 1)),
                                    .diameter_rad = kind == 4 ? 0.0 : between(d, 0.01, 0.2),
                                    .color = lum_grey(1),
                                    .intensity = 50};
    }
    l.on = roll(d, 4) > 0;
    l.camera_visible = roll(d, 2);
    rig_light(r, id, &l);
}

static void put_sky(struct rig *r, struct dice *d)
{
    static const char *const images[] = {"even", "sun", NULL};
    struct lum_light_desc l = {.kind = &lum_light_kind_environment,
                               .color = lum_grey(1),
                               .intensity = between(d, 1, 30),
                               .image = images[roll(d, 3)],
                               .on = roll(d, 2),
                               .camera_visible = roll(d, 2)};
    rig_light(r, "sky", &l);
}

static void put_material(struct rig *r, struct dice *d, const char *id)
{
    struct lum_material_desc m = rig_diffuse(0.6f);
    uint32_t k = roll(d, 7);
    if (k == 1) /* glossy */
        m.specular = 1, m.roughness = 0.4f;
    else if (k == 2) /* rough glass */
        m.specular = 1, m.roughness = 0.3f, m.transmission = 1;
    else if (k == 3) /* metal */
        m.metallic = 1, m.roughness = 0.2f;
    else if (k == 4)
        m.base_color = lum_grey(0);
    else if (k == 5)
        m.unlit = true;
    else if (k == 6)
        m.emission_cd_m2 = 50;
    rig_material(r, id, &m);
}

static void put_fog(struct rig *r, struct dice *d)
{
    struct lum_medium_desc m = {
        .sigma_s = lum_grey((float)between(d, 0, 0.2)), .sigma_a = lum_grey(0.05f), .everywhere = true};
    RIG_OK(lum_scene_put_medium(r->scene, "fog", &m, &err));
}

static void edit(struct rig *r, struct dice *d)
{
    static const uint32_t sizes[][2] = {{48, 32}, {33, 17}, {3, 5}, {1, 1}, {18, 21}, {36, 36}, {97, 53}};
    static const char *const materials[] = {"white", "red", "grey"}, *const lamps[] = {"a", "b"};
    static const uint32_t off[] = {LUM_EFFECT_DIRECT, LUM_EFFECT_SOFT_SHADOW, LUM_EFFECT_ENVIRONMENT, LUM_EFFECT_MEDIA};
    const uint32_t *size = sizes[roll(d, LUM_ARRAY_LEN(sizes))];
    switch (roll(d, 12)) {
    case 0:
        rig_object(r, "roof", "roof", "grey", rig_v(between(d, -1, 1), between(d, 1, 2), between(d, -1, 0.5)));
        break;
    case 1:
        put_material(r, d, materials[roll(d, 3)]);
        break;
    case 2:
        put_lamp(r, d, lamps[roll(d, 2)]);
        break;
    case 3:
        put_sky(r, d);
        break;
    case 4:
        r->settings.max_depth = roll(d, 3) ? 8 : roll(d, 2);
        break;
    case 5:
        r->settings.effects_off ^= LUM_EFFECT_BIT(off[roll(d, 4)]);
        break;
    case 6:
        r->settings.seed = roll(d, 3);
        break;
    case 7:
        r->settings.camera.position.x += between(d, -0.05, 0.05);
        break;
    case 8:
        r->settings.w = size[0], r->settings.h = size[1];
        break;
    case 9:
        put_fog(r, d);
        break;
    default:
        rig_object(r, "crate", "crate", "red", rig_v(between(d, -1, 1), between(d, 0.5, 1.5), between(d, -1, 0.5)));
        break;
    }
}

/* ---- the test ---- */

static void put_image(struct rig *r, const char *id, float bright)
{
    float texels[3 * 8 * 4];
    for (int i = 0; i < 3 * 8 * 4; i++)
        texels[i] = i / 3 == 13 ? bright : 1.0f;
    struct lum_image_desc image = {LUM_TEXEL_RGB32F, 8, 4, texels};
    RIG_OK(lum_scene_put_image(r->scene, id, &image, &err));
}

static void begin_room(struct rig *r, struct dice *d)
{
    rig_begin(r, 2);
    struct lum_material_desc m = rig_diffuse(0.5f);
    rig_material(r, "white", &m);
    rig_material(r, "red", &m);
    rig_material(r, "grey", &m);
    put_image(r, "even", 1.5f);
    put_image(r, "sun", 500.0f);
    rig_square(r, "floor", 3);
    rig_box(r, "crate", 0.4, 0.5, 0.4);
    rig_square(r, "roof", 0.7);
    rig_object(r, "floor", "floor", "white", rig_v(0, 0, 0));
    rig_object(r, "crate", "crate", "red", rig_v(0.5, 0.5, -0.4));
    rig_object(r, "roof", "roof", "grey", rig_v(-0.5, 1.2, -0.4));
    rig_camera(r, rig_v(-0.3, 1.4, 1.8), rig_v(0.2, 0.7, -0.5), 60);
    put_lamp(r, d, "a");
    put_lamp(r, d, "b");
    put_sky(r, d);
    rig_commit(r);
    r->settings.method = lum_method_find("live");
    r->settings.max_spp = 1;
    r->settings.antialias = false;
    r->settings.shadow_budget = 0; /* what an older view knows beyond that, a new one does not */
    r->settings.effects_off =
        LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE) | LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY) |
        LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING) | /* of light paths, which lamps share as they first shone */
        LUM_EFFECT_BIT(LUM_EFFECT_MEDIA);       /* so are points in fog */
}

static void compare_with_new_view(struct rig *r, uint32_t run, uint32_t step)
{
    struct lum_view *fresh;
    struct lum_pass_stats stats;
    RIG_OK(lum_view_create(r->pool, &fresh, &err));
    RIG_OK(lum_view_pass(fresh, r->snapshot, &r->settings, NULL, &stats, &err));
    const struct lum_film *a = lum_view_film(r->view), *b = lum_view_film(fresh);
    for (uint32_t i = 0; i < a->w * a->h; i++) {
        struct lum_rgb x = lum_film_mean(a, i % a->w, i / a->w), y = lum_film_mean(b, i % a->w, i / a->w);
        if (memcmp(&x, &y, sizeof x) != 0)
            fail_msg("run %u, step %u, pixel %u,%u: %g %g %g, a new view shows %g %g %g", run, step, i % a->w, i / a->w,
                     (double)x.r, (double)x.g, (double)x.b, (double)y.r, (double)y.g, (double)y.b);
    }
    lum_view_destroy(fresh);
}

static void any_edits_leave_nothing_stale(void **state)
{
    (void)state;
    uint32_t n_cut = 0;
    for (uint32_t run = 0; run < RUNS; run++) {
        struct dice d = {run * 7919u + 1};
        struct rig r;
        begin_room(&r, &d);
        r.settings.antialias = run % 2; /* of hard shadows */
        for (uint32_t step = 0; step < STEPS; step++) {
            for (uint32_t k = roll(&d, 3); k < 3; k++)
                edit(&r, &d);
            rig_commit(&r);
            if (roll(&d, 2)) {
                struct lum_pass_stats unused;
                uint32_t left, loop = roll(&d, 12) + 1, jobs = roll(&d, 6) + 1;
                n_cut += pass_is_cut_short(&r, loop, jobs, &unused, &left);
                if (roll(&d, 2))
                    edit(&r, &d);
                rig_commit(&r);
            }
            rig_pass(&r);
            compare_with_new_view(&r, run, step);
        }
        rig_end(&r);
    }
    print_message("%u passes cut short\n", n_cut);
    assert_true(n_cut > RUNS);
}

/* Fog, and how deep paths go, have no say in who sees a lamp: what rays found out in penumbrae stays, all of it. Where
 * fog does not show, no bit changes when it does, and no ray is traced. */
static void fog_leaves_shadows_alone(void **state)
{
    (void)state;
    struct dice d = {99};
    struct rig r;
    begin_room(&r, &d);
    r.settings.shadow_budget = lum_view_settings_default().shadow_budget;
    r.settings.w = 96;
    r.settings.h = 64;
    struct lum_material_desc glow = rig_diffuse(0);
    glow.emission_cd_m2 = 100;
    rig_material(&r, "glow", &glow);
    rig_object(&r, "lamp", "crate", "glow", rig_v(-0.6, 0.2, -0.2)); /* half of it below the horizon of the floor */
    for (uint32_t step = 0; step < 4; step++) {
        put_fog(&r, &d);
        rig_commit(&r);
        struct lum_pass_stats stats = rig_pass(&r);
        struct lum_rgb *picture = rig_picture(&r);
        put_fog(&r, &d);
        rig_commit(&r);
        stats = rig_pass(&r);
        rig_assert_picture(&r, picture, "fog that does not show");
        assert_int_equal(stats.rays[LUM_RAY_SOFT_SHADOW], 0);
        lum_free(picture);
        put_lamp(&r, &d, "a");
        rig_commit(&r);
        rig_pass(&r);
    }
    rig_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_edits_leave_nothing_stale),
        cmocka_unit_test(fog_leaves_shadows_alone),
    };
    return cmocka_run_group_tests_name("numeric.shadow_edits", tests, NULL, NULL);
}
