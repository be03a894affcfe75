/* The invalidation table: every edit of core/trace/stale.h is made on a real scene, through the ops of clients, and the
 * ray counters tell what ran again. Rays that the table does not allow are exactly 0; and those that the edit calls for
 * are there, so that 0 means something. */
#include "core/pass/basis.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "server/world/apply.h"
#include "server/world/scene_source.h"

#define RAYS(kind) (1u << LUM_RAY_##kind)
#define OF_LIGHTS (RAYS(DIRECT) | RAYS(SOFT_SHADOW) | RAYS(ENVIRONMENT))
#define ALL_RAYS (RAYS(KIND_COUNT) - 1u)

struct studio {
    struct lum_world world;
    struct lum_view *view;
    struct lum_view_settings settings;
};

static void apply(struct studio *s, const char *op)
{
    char text[1024];
    snprintf(text, sizeof text, "{\"lumend\":1,\"kind\":\"scene\"}\n%s\n", op);
    struct lum_ops ops;
    struct lum_changes changes;
    struct lum_proto_error err;
    struct lum_error e;
    if (!lum_ops_from_jsonl(text, strlen(text), &ops, &err) ||
        !lum_world_apply(&s->world, &(struct lum_edit){.user = "test", .ops = &ops}, &changes, &err))
        fail_msg("%s: %s: %s", op, err.path, err.text);
    lum_changes_finish(&changes);
    lum_ops_finish(&ops);
    assert_int_equal(lum_world_commit(&s->world, &e), LUM_OK);
    assert_int_equal(lum_apply_settings(lum_world_render(&s->world), &s->settings, &e), LUM_OK);
    assert_int_equal(lum_snapshot_camera(s->world.snapshot, "main", &s->settings.camera, &e), LUM_OK);
    s->settings.max_spp = 1; /* the frame, and no refinement after it */
}

/* `cornell`, whose lamps have soft shadows, with a bulb that has hard ones and thin fog over the floor. */
static void begin(struct studio *s, const char *method, uint32_t effects_off)
{
    struct lum_proto_error err;
    struct lum_error e;
    char set_method[96];
    memset(s, 0, sizeof *s);
    assert_int_equal(lum_world_init(&s->world, 2, NULL, NULL, &e), LUM_OK);
    if (!lum_scene_load(&s->world, "cornell", &(struct lum_import_config){0}, &err))
        fail_msg("%s", err.text);
    s->settings = lum_view_settings_default();
    s->settings.w = 64;
    s->settings.h = 48;
    s->settings.effects_off = effects_off;
    s->settings.shadow_budget = 0; /* what a frame adds to soft shadows that are not stale */
    snprintf(set_method, sizeof set_method, "{\"op\":\"set\",\"id\":\"render\",\"path\":\"/method\",\"value\":\"%s\"}",
             method);
    apply(s, "{\"op\":\"add\",\"type\":\"light\",\"id\":\"bulb\",\"kind\":\"point\",\"position\":[0.5,3,1],\"flux_lm\":"
             "500}");
    apply(s,
          "{\"op\":\"add\",\"type\":\"medium\",\"id\":\"fog\",\"sigma_s\":[0.01,0.01,0.01],\"box\":{\"min\":[-2,0,-2],"
          "\"max\":[2,0.5,2]}}");
    apply(s, set_method);
    assert_int_equal(lum_view_create(s->world.pool, &s->view, &e), LUM_OK);
    lum_view_share(s->view, s->world.caches);
}

static void end(struct studio *s)
{
    lum_view_destroy(s->view);
    lum_world_finish(&s->world);
}

static struct lum_pass_stats pass(struct studio *s)
{
    struct lum_pass_stats stats;
    struct lum_error e = {0};
    if (lum_view_pass(s->view, s->world.snapshot, &s->settings, NULL, &stats, &e))
        fail_msg("%s: %s", e.field, e.text);
    assert_int_equal(stats.nonfinite, 0);
    return stats;
}

/* A row of it. */
struct row {
    const char *edit, *op;
    uint32_t free,
        some;       /* bits RAYS: none of these; and, of those that the method traces at all, some of each of these */
    uint32_t known; /* of which a method that keeps where rays ended traces none */
};
#define SET(id, path, value) "{\"op\":\"set\",\"id\":\"" id "\",\"path\":\"" path "\",\"value\":" value "}"
#define DISC(id, at)                                                                                                   \
    "{\"op\":\"add\",\"type\":\"light\",\"id\":\"" id "\",\"kind\":\"disc\",\"position\":" at                          \
    ",\"direction\":[0.2,-0.3,1],\"radius\":0.2,\"flux_lm\":300}"
#define REMOVE(id) "{\"op\":\"remove\",\"id\":\"" id "\"}"
static const struct row rows[] = {
    {"exposure", SET("render", "/exposure_ev", "9"), ALL_RAYS, 0, 0},
    {"tone map", SET("render", "/tone_map", "\"aces\""), ALL_RAYS, 0, 0},
    {"intensity of a lamp", SET("ceiling-panel", "/flux_lm", "2000"), ALL_RAYS, 0, 0},
    {"intensity of a bulb", SET("bulb", "/flux_lm", "900"), ALL_RAYS, 0, 0},
    {"colour", SET("globe", "/cct_k", "6500"), ALL_RAYS, 0, 0},
    {"off", SET("globe", "/on", "false"), ALL_RAYS, 0, 0},
    {"on", SET("globe", "/on", "true"), ALL_RAYS, 0, 0},
    {"group", SET("globe", "/group", "\"evening\""), ALL_RAYS, 0, 0},
    {"bulb moved", SET("bulb", "/position", "[-0.5,3,1]"), RAYS(PRIMARY) | RAYS(SOFT_SHADOW), RAYS(DIRECT) | RAYS(VPL),
     0},
    /* its body is seen, and casts shadows: it is an object that moves, too */
    {"lamp moved", SET("globe", "/position", "[0.3,0.4,0.9]"), 0, RAYS(PRIMARY) | RAYS(SOFT_SHADOW) | RAYS(VPL), 0},
    {"object moved", SET("short-plinth", "/transform", "{\"translate\":[0.8,0.125,0.5],\"scale\":[0.7,0.25,0.7]}"), 0,
     RAYS(PRIMARY) | RAYS(DIRECT) | RAYS(SOFT_SHADOW) | RAYS(VPL), 0},
    {"material colour", SET("red", "/base_color", "[0.1,0.1,0.6]"), RAYS(PRIMARY) | OF_LIGHTS, RAYS(VPL), RAYS(VPL)},
    {"camera", SET("main", "/position", "[0.2,2.0,7.3]"), RAYS(VPL), RAYS(PRIMARY) | RAYS(DIRECT) | RAYS(SOFT_SHADOW),
     0},
    /* light on its way to virtual point lights is dimmed, too */
    {"medium", SET("fog", "/sigma_s", "[0.02,0.02,0.02]"), RAYS(PRIMARY) | OF_LIGHTS, RAYS(MEDIA), 0},
};

/* excused: kinds of ray that the method still traces where the table does not allow it. */
static void every_row_holds(const char *method, uint32_t effects_off, uint32_t excused)
{
    bool keeps_rays = strcmp(method, "live") == 0;
    struct studio s;
    begin(&s, method, effects_off);
    struct lum_pass_stats first = pass(&s);
    assert_true(first.rays[LUM_RAY_PRIMARY] > 0);
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        apply(&s, rows[i].op);
        struct lum_pass_stats stats = pass(&s);
        for (int k = 0; k < LUM_RAY_KIND_COUNT; k++) {
            unsigned long long n = stats.rays[k];
            uint32_t none = (rows[i].free & ~excused) | (keeps_rays ? rows[i].known : 0), some = rows[i].some & ~none;
            if (none & 1u << k && n > 0)
                fail_msg("%s: %s: %llu rays of kind %s", method, rows[i].edit, n,
                         lum_ray_kind_name((enum lum_ray_kind)k));
            if (some & 1u << k && first.rays[k] > 0 && n == 0)
                fail_msg("%s: %s: no ray of kind %s", method, rows[i].edit, lum_ray_kind_name((enum lum_ray_kind)k));
        }
    }
    end(&s);
}

#define OFF(effect) LUM_EFFECT_BIT(LUM_EFFECT_##effect)

/* Where its buffers are light by light. */
static void live_traces_what_it_must(void **state)
{
    (void)state;
    every_row_holds("live", OFF(INDIRECT_DIFFUSE) | OFF(MEDIA), 0);
}

/* Its buffers by effect are sums over the lights: a dimmed light makes them anew. */
static void live_with_all_effects(void **state)
{
    (void)state;
    every_row_holds("live", 0, RAYS(INDIRECT_DIFFUSE) | RAYS(MEDIA));
}

static void whitted_traces_what_it_must(void **state)
{
    (void)state;
    every_row_holds("whitted", 0, 0);
}

static void tic_traces_what_it_must(void **state)
{
    (void)state;
    if (lum_method_find("tic"))
        every_row_holds("tic", 0, 0);
}

/* ---- what moved where ---- */

static struct lum_rgb *picture(const struct studio *s)
{
    const struct lum_film *film = lum_view_film(s->view);
    struct lum_rgb *p = lum_calloc((size_t)film->w * film->h, sizeof *p);
    assert_non_null(p);
    for (uint32_t i = 0; i < film->w * film->h; i++)
        p[i] = lum_film_mean(film, i % film->w, i / film->w);
    return p;
}

static void assert_nothing_is_stale(struct studio *s, const char *edit)
{
    struct lum_rgb *kept = picture(s);
    lum_view_forget(s->view);
    pass(s);
    struct lum_rgb *fresh = picture(s);
    for (uint32_t i = 0; i < s->settings.w * s->settings.h; i++)
        if (memcmp(&kept[i], &fresh[i], sizeof *kept) != 0)
            fail_msg("%s: pixel (%u, %u) is %.9g %.9g %.9g, not %.9g %.9g %.9g", edit, i % s->settings.w,
                     i / s->settings.w, (double)kept[i].r, (double)kept[i].g, (double)kept[i].b, (double)fresh[i].r,
                     (double)fresh[i].g, (double)fresh[i].b);
    lum_free(kept);
    lum_free(fresh);
}

/* Where nothing that moved can show, nothing is traced again, and all is as if it were. */
static void motion_is_followed_where_it_shows(void **state)
{
    (void)state;
    static const struct {
        const char *edit, *op;
        bool cancelled, little; /* few rays are needed */
    } steps[] = {
        {"moved", SET("short-statue", "/transform/translate", "[0.8,1.1,0.45]"), false, true},
        {"again", SET("short-statue", "/transform/translate", "[0.75,1.2,0.4]"), false, true},
        {"cancelled", SET("short-statue", "/transform/translate", "[0.6,1.4,0.3]"), true, false},
        {"after that", SET("short-statue", "/transform/translate", "[0.5,1.5,0.2]"), false, false},
        {"lamp dimmed", SET("globe", "/flux_lm", "50"), false, true},
        {"lamp moved", SET("globe", "/position", "[0.3,0.4,0.9]"), false, false},
        {"bulb moved", SET("bulb", "/position", "[-0.4,2.8,0.9]"), false, false},
        {"paint shines", SET("red", "/emission_cd_m2", "40"), false, false},
        {"and no more", SET("red", "/emission_cd_m2", "0"), false, false},
        {"lamp unseen", SET("globe", "/camera_visible", "false"), false, false},
        {"camera", SET("main", "/position", "[0.2,2.0,7.3]"), true, false},
        {"moved after the camera", SET("short-statue", "/transform/translate", "[0.4,1.6,0.1]"), false, false},
        {"hidden", SET("short-statue", "/visible", "false"), false, false},
        {"shown", SET("short-statue", "/visible", "true"), false, false},
        {"repainted", SET("red", "/base_color", "[0.1,0.1,0.6]"), false, false},
        {"far", SET("short-statue", "/transform/translate", "[-0.7,0.4,0.6]"), false, false},
        /* bodies of lamps are numbered by their ids: these come before those of the others, or after */
        {"a lamp more, the first", DISC("a", "[-0.6,1.6,0.6]"), false, false},
        {"it moved", SET("a", "/position", "[-0.5,1.5,0.7]"), false, false},
        {"the last instead", REMOVE("a") "\n" DISC("z", "[0.7,1.9,0.5]"), false, false},
        {"with another id", REMOVE("z") "\n" DISC("b", "[0.7,1.9,0.5]"), false, false},
        {"one more, and one moved", DISC("c", "[-0.6,1.6,0.6]") "\n" SET("b", "/position", "[-0.8,1.0,0.5]"), false,
         false},
        {"each where the other was",
         SET("c", "/position", "[-0.8,1.0,0.5]") "\n" SET("b", "/position", "[-0.6,1.6,0.6]"), false, false},
        {"both gone", REMOVE("b") "\n" REMOVE("c"), false, false},
        /* by their own fields: no paint changes. Without hard lights what does not shine is not looked at */
        {"no hard light", REMOVE("bulb"), false, false},
        {"an object shines", SET("short-plinth", "/luminance_cd_m2", "40"), false, false},
        {"another does instead",
         SET("short-plinth", "/luminance_cd_m2", "null") "\n" SET("short-statue", "/luminance_cd_m2", "40"), false,
         false},
        {"none does", SET("short-statue", "/luminance_cd_m2", "null"), false, false},
    };
    struct studio s;
    begin(&s, "live", OFF(MEDIA));
    s.settings.w = 160;
    s.settings.h = 120;
    s.settings.deterministic = true;
    struct lum_pass_stats first = pass(&s);
    for (size_t i = 0; i < LUM_ARRAY_LEN(steps); i++) {
        apply(&s, steps[i].op);
        if (steps[i].cancelled) {
            const _Atomic bool cancel = true;
            struct lum_pass_stats unused;
            assert_int_equal(lum_view_pass(s.view, s.world.snapshot, &s.settings, &cancel, &unused, NULL),
                             LUM_ERR_CANCELLED);
            continue;
        }
        struct lum_pass_stats stats = pass(&s);
        const enum lum_ray_kind kinds[] = {LUM_RAY_PRIMARY, LUM_RAY_SOFT_SHADOW};
        for (size_t k = 0; steps[i].little && k < LUM_ARRAY_LEN(kinds); k++)
            if (2 * stats.rays[kinds[k]] > first.rays[kinds[k]])
                fail_msg("%s: %llu of %llu rays", steps[i].edit, (unsigned long long)stats.rays[kinds[k]],
                         (unsigned long long)first.rays[kinds[k]]);
        assert_nothing_is_stale(&s, steps[i].edit);
    }
    end(&s);
}

/* ---- the table itself ---- */

static void every_setting_is_an_edit(void **state)
{
    (void)state;
    struct lum_view_settings a = lum_view_settings_default();
    a.method = lum_method_find("live");
    struct {
        struct lum_view_settings settings;
        enum lum_edit_kind edit;
    } cases[16];
    size_t n = 0;
#define CASE(field, value, kind)                                                                                       \
    cases[n].settings = a;                                                                                             \
    cases[n].settings.field = value;                                                                                   \
    cases[n++].edit = kind
    CASE(camera.position.x, a.camera.position.x + 1, LUM_EDIT_CAMERA);
    CASE(camera.vfov_deg, a.camera.vfov_deg + 1, LUM_EDIT_CAMERA);
    CASE(w, a.w + 1, LUM_EDIT_CAMERA);
    CASE(method, lum_method_find("igi"), LUM_EDIT_METHOD);
    CASE(seed, a.seed + 1, LUM_EDIT_METHOD);
    CASE(reproject_shadows, !a.reproject_shadows, LUM_EDIT_METHOD);
    CASE(max_depth, a.max_depth + 1, LUM_EDIT_DEPTH);
    CASE(shadow_samples, 4, LUM_EDIT_SHADOW_SAMPLES);
    CASE(n_vpls, a.n_vpls + 1, LUM_EDIT_VPLS);
    CASE(storage, LUM_STORAGE_LOCK, LUM_EDIT_CACHE);
    CASE(cache_accuracy, 0.5f * a.cache_accuracy, LUM_EDIT_CACHE);
    CASE(deterministic, !a.deterministic, LUM_EDIT_CACHE);
    CASE(illuminance, !a.illuminance, LUM_EDIT_QUANTITY);
#undef CASE
    for (size_t i = 0; i < n; i++) {
        assert_int_equal(lum_edits_of_settings(&a, &cases[i].settings), LUM_EDIT_BIT(cases[i].edit));
        assert_false(lum_view_same_picture(&a, &cases[i].settings));
        assert_true(lum_is_stale(LUM_EDIT_BIT(cases[i].edit), LUM_PRODUCT_COMPONENTS));
    }
    struct lum_view_settings b = a;
    b.max_spp = 7;
    b.preview = 4;
    b.shadow_budget = 0;
    assert_int_equal(lum_edits_of_settings(&a, &b), 0);
    assert_true(lum_view_same_picture(&a, &b));
    b.effects_off = 1;
    assert_false(lum_view_same_picture(&a, &b));
}

static void no_edit_makes_nothing_stale(void **state)
{
    (void)state;
    for (int p = 0; p < LUM_PRODUCT_COUNT; p++) {
        assert_false(lum_is_stale(0, (enum lum_product)p));
        assert_true(lum_is_stale(LUM_EDITS_ALL, (enum lum_product)p)); /* nothing lasts for ever */
    }
    struct lum_versions was = {1, 1, 1, 1, 1}, now = {2, 2, 2, 2, 2};
    assert_int_equal(lum_edits_of_versions(&was, &was), 0);
    assert_int_equal(lum_edits_of_versions(&was, &now), LUM_EDITS_OF_SCENE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(live_traces_what_it_must),          cmocka_unit_test(live_with_all_effects),
        cmocka_unit_test(whitted_traces_what_it_must),       cmocka_unit_test(tic_traces_what_it_must),
        cmocka_unit_test(motion_is_followed_where_it_shows), cmocka_unit_test(every_setting_is_an_edit),
        cmocka_unit_test(no_edit_makes_nothing_stale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
