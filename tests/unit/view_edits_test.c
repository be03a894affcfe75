/* Random edits: after each, the picture of a view that has been there all along equals one made from nothing, bit for
 * bit. A kind of edit that raises no counter, or a stage that forgets what it depends on, shows here as stale pixels.
 */
#include "core/cache/kind.h"
#include "core/interleave/interleave.h"
#include "core/scene/shapes.h"
#include "core/trace/stale.h"
#include "tests/support/effort.h"
#include "tests/support/rig.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/webs.h"
#include "server/world/light_kinds.h"

static const char *const meshes[] = {"thing", "other"}, *const materials[] = {"one", "two", "three"},
                         *const images[] = {"slide", "weave"};

/* What was done since the last picture, for the message. */
struct editor {
    struct rig rig;
    struct random_stream random;
    /* Lights keep their power and stay on: virtual point lights are shared out by what lights emitted when they were
     * first seen to shine (vpl.h), which a new view does not know. */
    bool steady;
    struct lum_versions pictured; /* what records depend on, at the last picture; but for fog */
    char done[512];
};

static uint32_t choose(struct editor *e, uint32_t n)
{
    return random_bits(&e->random) % n;
}

static bool chance(struct editor *e, double p)
{
    return random_double(&e->random) < p;
}

static float share(struct editor *e)
{
    return (float)random_double(&e->random);
}

static void note(struct editor *e, const char *edit, const char *id)
{
    size_t n = strlen(e->done);
    snprintf(e->done + n, sizeof e->done - n, " %s %s;", edit, id);
}

static void edit_image(struct editor *e, uint32_t k)
{
    uint8_t texels[4 * 4 * 4];
    for (size_t i = 0; i < sizeof texels; i++)
        texels[i] = (uint8_t)choose(e, 256);
    struct lum_image_desc d = {chance(e, 0.5) ? LUM_TEXEL_SRGB8 : LUM_TEXEL_LINEAR8, 4, 4, texels};
    note(e, "image", images[k]);
    RIG_OK(lum_scene_put_image(e->rig.scene, images[k], &d, &err));
}

static void edit_mesh(struct editor *e, uint32_t k)
{
    struct lum_shape_params size = {.size = {0.6, 0.6, 0.6}, .segments = {8, 4}};
    struct lum_shape_mesh m;
    RIG_OK(lum_shape_make(chance(e, 0.5) ? "box" : "sphere", &size, &m, &err));
    float *tangents = calloc(m.n_vertices, 4 * sizeof *tangents);
    assert_non_null(tangents);
    for (uint32_t i = 0; i < 4 * m.n_vertices; i++)
        tangents[i] = share(e) - 0.5f;
    struct lum_mesh_desc d = {.positions_f = m.positions,
                              .normals = chance(e, 0.5) ? m.normals : NULL,
                              .tangents = chance(e, 0.3) ? tangents : NULL,
                              .uvs = chance(e, 0.7) ? m.uvs : NULL,
                              .indices = m.indices,
                              .n_vertices = m.n_vertices,
                              .n_triangles = m.n_triangles,
                              .deforming = chance(e, 0.5)};
    note(e, "mesh", meshes[k]);
    RIG_OK(lum_scene_put_mesh(e->rig.scene, meshes[k], &d, &err));
    lum_shape_finish(&m);
    free(tangents);
}

static const char *maybe_image(struct editor *e)
{
    return chance(e, 0.4) ? images[choose(e, 2)] : NULL;
}

static void edit_material(struct editor *e, uint32_t k)
{
    struct lum_material_desc m = lum_material_default();
    m.base_color = lum_rgb(share(e), 0.5f, 0.3f);
    m.roughness = chance(e, 0.4) ? 0.0f : share(e);
    m.metallic = chance(e, 0.3) ? 1.0f : 0.0f;
    m.transmission = chance(e, 0.3) ? 1.0f : 0.0f;
    m.thin = chance(e, 0.5);
    if (m.base_color.r < 0.3f) /* a sheet */
        m.diffuse_transmittance = lum_rgb(0.0f, 0.5f, 2.0f * m.base_color.r);
    m.sheen_color = lum_grey(m.roughness > 0.6f ? 0.5f : 0.0f); /* cloth */
    if (m.base_color.r > 0.7f)                                  /* lacquered */
        m.clearcoat = m.base_color.r, m.clearcoat_roughness = m.roughness > 0.5f ? 0.0f : 0.4f;
    m.anisotropy = m.metallic > 0.0f ? m.base_color.r : 0.0f; /* brushed */
    m.attenuation_color = lum_rgb(0.5f, 0.9f, 0.3f);
    m.attenuation_distance_m = 0.3;
    double emission = 30.0 * (e->steady ? 0.5 : random_double(&e->random));
    m.emission_cd_m2 = chance(e, 0.4) ? emission : 0.0;
    m.unlit = chance(e, 0.2);
    m.alpha_mode = (enum lum_alpha_mode)choose(e, 3);
    m.alpha = chance(e, 0.5) ? 1.0f : share(e);
    m.base_color_texture.image = maybe_image(e);
    m.emission_texture.image = maybe_image(e);
    m.normal_texture.image = maybe_image(e);
    m.anisotropy = chance(e, 0.3) ? share(e) : 0.0f;
    m.anisotropy_texture.image = maybe_image(e);
    m.specular_texture.image = m.specular_color_texture.image = m.emission_texture.image;
    m.transmission_texture.image = m.normal_texture.image;
    m.diffuse_transmission_texture.image = m.anisotropy_texture.image;
    note(e, "material", materials[k]);
    rig_material(&e->rig, materials[k], &m);
}

/* Few places, so that one object often takes another's. (Lights are a little apart: of two shapes in the very same
 * place rays may find either, and another after something else has moved.) */
static void edit_object(struct editor *e, uint32_t k)
{
    const char id[] = {'o', (char)('a' + k), 0};
    struct lum_object_desc d = {.mesh = meshes[choose(e, 2)],
                                .material = materials[choose(e, 3)],
                                .local_to_world = at(0.5 * choose(e, 3) - 0.5, 0.4, 0.5 * choose(e, 2) - 0.5),
                                .visible = chance(e, 0.85)};
    note(e, "object", id);
    RIG_OK(lum_scene_put_object(e->rig.scene, id, &d, &err));
}

/* Opened, it shows the sky. */
static void edit_room(struct editor *e)
{
    struct lum_object_desc d = {
        .mesh = "room", .material = "white", .local_to_world = at(0, 1.5, 0), .visible = chance(e, 0.5)};
    note(e, "room", d.visible ? "closed" : "open");
    RIG_OK(lum_scene_put_object(e->rig.scene, "room", &d, &err));
}

static void remove_one(struct editor *e, enum lum_entity kind, char prefix)
{
    const char id[] = {prefix, (char)('a' + choose(e, 4)), 0};
    note(e, "remove", id);
    enum lum_status status = lum_scene_remove(e->rig.scene, kind, id, NULL);
    assert_true(status == LUM_OK || status == LUM_ERR_NOT_FOUND);
}

static void edit_light(struct editor *e, uint32_t k)
{
    const char id[] = {'l', (char)('a' + k), 0};
    static const struct web_grid down = {LUM_WEB_C, 0, 0, 0, 90, 1, 10};
    struct lum_light_desc d = light_desc(lum_light_kinds[choose(e, LUM_LIGHT_KIND_COUNT)].row);
    struct lum_web *web = NULL;
    if (e->steady && k > 0 &&
        (d.kind == &lum_light_kind_environment || d.kind == &lum_light_kind_sky)) /* of several, one shines */
        d = light_desc(&lum_light_kind_disc);
    d.position = rig_v(0.5 * choose(e, 2) + 0.01 * k, 2, 0);
    d.color = lum_rgb(1.0f, e->steady ? 0.5f : share(e), 0.4f);
    d.intensity = e->steady ? 10.0 : chance(e, 0.2) ? 0.0 : 20.0 * random_double(&e->random);
    d.on = e->steady || chance(e, 0.6);
    d.camera_visible = chance(e, 0.5);
    d.image = maybe_image(e);
    d.group = chance(e, 0.5) ? "warm" : NULL;
    if (d.kind == &lum_light_kind_ies) {
        d.web = web = chance(e, 0.5) ? web_of_a_lamp() : web_of(&down, web_cosine);
        d.u = rig_v(1, 0, choose(e, 2));
    }
    if (d.kind == &lum_light_kind_sun)
        d.direction = rig_v(1, -1.0 - k, 0.5); /* the sky goes with it */
    d.cie_type = 12 - 3 * (int)k;
    note(e, "light", id);
    rig_light(&e->rig, id, &d);
    lum_web_unref(web);
}

static void edit_medium(struct editor *e)
{
    struct lum_medium_desc d = {.sigma_s = lum_grey(chance(e, 0.3) ? 0.0f : share(e)),
                                .sigma_a = lum_grey(chance(e, 0.3) ? 0.0f : share(e)),
                                .g = chance(e, 0.5) ? 0.0f : 0.4f,
                                .everywhere = chance(e, 0.3),
                                .lo = rig_v(-1, 0, -1),
                                .hi = rig_v(1, 0.5 + choose(e, 2), 1)};
    note(e, "medium", "fog");
    RIG_OK(lum_scene_put_medium(e->rig.scene, "fog", &d, &err));
}

static void edit(struct editor *e)
{
    switch (choose(e, 11)) {
    case 0:
        edit_image(e, choose(e, 2));
        break;
    case 1:
        edit_mesh(e, choose(e, 2));
        break;
    case 2:
    case 3:
        edit_material(e, choose(e, 3));
        break;
    case 4:
        remove_one(e, LUM_ENTITY_OBJECT, 'o');
        edit_object(e, choose(e, 4));
        break;
    case 5:
        edit_object(e, choose(e, 4));
        break;
    case 6:
        remove_one(e, LUM_ENTITY_LIGHT, 'l');
        break;
    case 7:
        edit_medium(e);
        break;
    case 8:
        edit_room(e);
        break;
    default:
        edit_light(e, choose(e, 4));
    }
}

static void edit_settings(struct editor *e)
{
    struct lum_view_settings *s = &e->rig.settings;
    if (chance(e, 0.1))
        s->shadow_samples = 1 + choose(e, 4);
    if (chance(e, 0.1))
        s->max_depth = choose(e, 5);
    if (chance(e, 0.1))
        s->camera.position.x += 0.1;
    if (chance(e, 0.1))
        s->seed++;
    if (chance(e, 0.1))
        s->n_vpls = 1 + choose(e, 40);
    if (chance(e, 0.1))
        s->antialias = !s->antialias;
    if (chance(e, 0.2)) {
        static const uint32_t some[] = {LUM_EFFECT_BIT(LUM_EFFECT_DIRECT),
                                        LUM_EFFECT_BIT(LUM_EFFECT_SOFT_SHADOW),
                                        LUM_EFFECT_BIT(LUM_EFFECT_ENVIRONMENT),
                                        LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE),
                                        LUM_EFFECT_BIT(LUM_EFFECT_REFLECTION),
                                        LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION),
                                        LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY) | LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING),
                                        LUM_EFFECT_BIT(LUM_EFFECT_MEDIA),
                                        LUM_EFFECT_BIT(LUM_EFFECT_ANTIALIAS) | LUM_EFFECT_BIT(LUM_EFFECT_SCATTERING)};
        s->effects_off = some[choose(e, LUM_ARRAY_LEN(some))];
    }
    if (chance(e, 0.1))
        s->illuminance = !s->illuminance;
    if (!e->steady)
        s->effects_off |= LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
}

/* A pass that is cancelled at once, then perhaps another edit; or first-hit buffers between the passes. */
static void interrupt(struct editor *e)
{
    struct rig *r = &e->rig;
    if (chance(e, 0.2)) {
        const _Atomic bool cancel = true;
        struct lum_pass_stats unused;
        note(e, "cancel", "");
        enum lum_status status = lum_view_pass(r->view, r->snapshot, &r->settings, &cancel, &unused, NULL);
        assert_true(status == LUM_ERR_CANCELLED || status == LUM_OK); /* nothing was to be done */
        edit(e);
        rig_commit(r);
    }
    if (chance(e, 0.2)) {
        struct lum_aovs unused;
        note(e, "first hits", "");
        RIG_OK(lum_view_aovs(r->view, r->snapshot, &r->settings, &unused, &err));
    }
}

/* Where a cache keeps records, they lie where earlier pictures wanted them, and a new view with a cache of its own
 * interpolates others: what the view keeps besides must not show all the same. That such records are right is told by
 * the tests of their kinds. */
static void compare_with_forgetful_view(struct rig *r, const char *what)
{
    struct lum_rgb *remembered = rig_picture(r);
    lum_view_forget(r->view);
    rig_pass(r);
    rig_assert_picture(r, remembered, what);
    lum_free(remembered);
}

/* One that does not last forgets all when the scene changes; an edit that puts there what is there changes nothing. */
static bool cache_keeps_records(struct editor *e)
{
    const struct lum_cache_kind *cache = e->rig.settings.method->cache;
    struct lum_versions now = lum_versions_seen(e->rig.snapshot, false);
    bool same = lum_versions_equal(&now, &e->pictured);
    e->pictured = now;
    return cache && (cache->lasting || same);
}

static void compare_with_fresh_view(struct editor *e, const char *where)
{
    struct rig *r = &e->rig;
    char what[640];
    snprintf(what, sizeof what, "%s, after%s", where, e->done);
    rig_pass(r);
    if (cache_keeps_records(e)) {
        compare_with_forgetful_view(r, what);
        e->done[0] = 0;
        return;
    }
    struct lum_view *old = r->view;
    RIG_OK(lum_view_create(r->pool, &r->view, &err));
    rig_pass(r);
    struct lum_rgb *fresh = rig_picture(r);
    lum_view_destroy(r->view);
    r->view = old;
    rig_assert_picture(r, fresh, what);
    lum_free(fresh);
    e->done[0] = 0;
}

struct trial {
    const struct lum_method *method;
    bool steady;
    uint64_t seed;
    uint32_t w, h;
    int n_steps;
};

static void edit_at_random(const struct trial *t)
{
    struct editor e = {.random = {t->seed}, .steady = t->steady};
    struct rig *r = &e.rig;
    rig_begin(r, 2);
    rig_room(r);
    r->settings.w = t->w;
    r->settings.h = t->h;
    r->settings.max_spp = 1;
    r->settings.shadow_samples = 2;
    r->settings.shadow_budget = 0; /* what an older view knows of soft shadows beyond that, a new one does not */
    r->settings.n_vpls = 24;
    r->settings.method = t->method;
    for (uint32_t k = 0; k < 2; k++) {
        edit_image(&e, k);
        edit_mesh(&e, k);
    }
    for (uint32_t k = 0; k < 3; k++)
        edit_material(&e, k);
    for (uint32_t k = 0; k < 4; k++) {
        edit_object(&e, k);
        edit_light(&e, k);
    }
    e.done[0] = 0;
    for (int step = 0; step < t->n_steps; step++) {
        char where[64];
        snprintf(where, sizeof where, "%s%s, seed %llu, step %d", t->method->name, t->steady ? ", steady" : "",
                 (unsigned long long)t->seed, step);
        for (uint32_t n = choose(&e, 3) + 1; n > 0; n--)
            edit(&e);
        edit_settings(&e);
        rig_commit(r);
        interrupt(&e);
        compare_with_fresh_view(&e, where);
    }
    rig_end(r);
}

/* Where a sky is switched on, it is seen: no power of a light is in what is kept of surfaces. */
static void sky_that_comes_on_is_seen(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t i = 0; i < n; i++) {
        struct editor e = {0};
        rig_begin(&e.rig, 2);
        rig_room(&e.rig);
        RIG_OK(lum_scene_remove(e.rig.scene, LUM_ENTITY_OBJECT, "room", &err));
        e.rig.settings.method = &methods[i];
        e.rig.settings.max_spp = 1;
        struct lum_light_desc sky = light_desc(&lum_light_kind_environment);
        for (int on = 0; on <= 2; on++) {
            sky.on = on == 1;
            rig_light(&e.rig, "sky", &sky);
            rig_commit(&e.rig);
            compare_with_fresh_view(&e, methods[i].name);
        }
        rig_end(&e.rig);
    }
}

/* What a method did the first time it does again, and no more. */
static void forgotten_views_do_everything_again(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t i = 0; i < n; i++) {
        struct rig r;
        rig_begin(&r, 2);
        rig_room(&r);
        r.settings.max_spp = 1;
        r.settings.method = &methods[i];
        rig_commit(&r);
        struct lum_pass_stats first = rig_pass(&r);
        struct lum_rgb *picture = rig_picture(&r);
        lum_view_forget(r.view);
        struct lum_pass_stats again = rig_pass(&r);
        assert_memory_equal(again.rays, first.rays, sizeof first.rays);
        rig_assert_picture(&r, picture, methods[i].name);
        lum_free(picture);
        rig_end(&r);
    }
}

static void pictures_are_never_stale(void **state)
{
    (void)state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t i = 0; i < n; i++)
        for (uint64_t seed = 1; seed <= TEST_EFFORT(8); seed++)
            edit_at_random(&(struct trial){&methods[i], seed % 2, seed, LUM_CELL_SIDE + 5 /* two cells */, 19, 16});
}

/* Longer, and with enough pixels for what shows in few of them. */
static void larger_pictures_are_never_stale(void **state)
{
    (void)state;
    static const char *const methods[] = {"live", "ais"};
    for (size_t i = 0; i < LUM_ARRAY_LEN(methods); i++)
        for (uint64_t seed = 4; seed < 4 + TEST_EFFORT(2); seed++)
            edit_at_random(&(struct trial){lum_method_find(methods[i]), seed % 2 == 0, seed, 80, 56, TEST_EFFORT(50)});
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forgotten_views_do_everything_again),
        cmocka_unit_test(sky_that_comes_on_is_seen),
        cmocka_unit_test(pictures_are_never_stale),
        cmocka_unit_test(larger_pictures_are_never_stale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
