/* Edits that go on and on, or too far, by every method: meshes whose triangles change while they deform, an object that
 * is dragged far out of the scene and back, and a soak of edits of all kinds. After each, the picture is finite
 * (rig_pass asserts it) and that of a view that begins anew, bit for bit. */
#include <stdlib.h>

#include "core/cache/kind.h"
#include "tests/support/effort.h"
#include "tests/support/random_scene.h"

struct bed {
    struct rig r;
    const struct lum_method *method;
};

static void begin(struct bed *b, const struct lum_method *method)
{
    rig_begin(&b->r, 1);
    b->method = b->r.settings.method = method;
    b->r.settings.max_spp = 1;
    b->r.settings.n_vpls = 32;
    b->r.settings.w = 24;
    b->r.settings.h = 20;
    b->r.settings.shadow_budget = 0; /* what an older view knows beyond that, a new one does not */
}

/* All passes; records made. */
static uint64_t render(struct bed *b)
{
    struct lum_pass_stats stats;
    uint64_t created = 0;
    do {
        stats = rig_pass(&b->r);
        created += stats.cache.created;
    } while (!stats.complete);
    return created;
}

/* A new view; of methods with virtual lights one that begins anew, for it knows what lights once emitted (vpl.h), and
 * records lie where they were wanted. */
static void assert_as_anew(struct bed *b, const char *what)
{
    char text[96];
    struct lum_rgb *picture = rig_picture(&b->r);
    snprintf(text, sizeof text, "%s, %s", b->method->name, what);
    if (lum_method_counts_vpls(b->method))
        lum_view_forget(b->r.view);
    else
        rig_fresh_view(&b->r);
    render(b);
    rig_assert_picture(&b->r, picture, text);
    lum_free(picture);
}

/* ---- meshes that deform ---- */

struct pose {
    const char *what;
    double p[15];
    uint32_t n_vertices, indices[12], n_triangles;
    bool still;
};

/* A tent of four triangles over a square, and what may become of it. */
#define SQUARE -0.4, 0, -0.4, 0.4, 0, -0.4, 0.4, 0, 0.4, -0.4, 0, 0.4
#define FAN                                                                                                            \
    {                                                                                                                  \
        0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4                                                                             \
    }
static const struct pose poses[] = {
    {"a tent", {SQUARE, 0, 0.6, 0}, 5, FAN, 4, false},
    {"higher", {SQUARE, 0, 0.9, 0}, 5, FAN, 4, false},
    {"leaning", {SQUARE, 0.3, 0.7, 0}, 5, FAN, 4, false},
    {"other triangles, as many", {SQUARE, 0, 0.7, 0}, 5, {0, 4, 1, 1, 4, 2, 2, 0, 3, 3, 4, 0}, 4, false},
    {"fewer triangles", {SQUARE, 0, 0.7, 0}, 5, {0, 1, 4, 1, 2, 4}, 2, false},
    {"fewer vertices", {SQUARE}, 4, {0, 1, 2, 0, 2, 3}, 2, false},
    {"more of both", {SQUARE, 0, 0.5, 0}, 5, FAN, 4, false},
    {"shut", {SQUARE, 0, 0, 0}, 5, FAN, 4, false},
    {"a line", {-0.4, 0, 0, 0.4, 0, 0, 0.2, 0, 0, -0.2, 0, 0, 0, 0, 0}, 5, FAN, 4, false},
    {"a point", {0}, 5, FAN, 4, false},
    {"open again", {SQUARE, 0, 0.6, 0}, 5, FAN, 4, false},
    {"a vertex that is none", {SQUARE, NAN, 0.6, 0}, 5, FAN, 4, false},
    {"an index that is none", {SQUARE, 0, 0.6, 0}, 5, {0, 1, 4, 1, 2, 4, 2, 3, 9, 3, 0, 4}, 4, false},
    {"a hundred times as large", {-40, 0, -40, 40, 0, -40, 40, 0, 40, -40, 0, 40, 0, 0.6, 0}, 5, FAN, 4, false},
    {"small again", {SQUARE, 0, 0.6, 0}, 5, FAN, 4, false},
    {"still", {SQUARE, 0, 0.8, 0}, 5, FAN, 4, true},
    {"deforming once more", {SQUARE, 0, 0.5, 0}, 5, FAN, 4, false},
};

static void put_pose(struct rig *r, const struct pose *pose)
{
    struct lum_mesh_desc d = {.positions = pose->p,
                              .indices = pose->indices,
                              .n_vertices = pose->n_vertices,
                              .n_triangles = pose->n_triangles,
                              .deforming = !pose->still};
    RIG_OK(lum_scene_put_mesh(r->scene, "tent", &d, &err));
    rig_commit(r);
}

static void look_at_tent(struct rig *r)
{
    rig_camera(r, rig_v(-0.9, 1.3, 1.6), rig_v(-0.6, 0.3, 0), 50);
}

/* Twice round, so that each pose follows each refit or rebuilt structure; the snapshot before is still read (the view's
 * cache holds it) when the next pose comes. The picture by direct light is that of a scene in which the mesh is as it
 * is now: vertices are stored in another place of rounding, 2^-23 of their size, which an edge of a pixel shows. */
static void topology_changes(struct bed *b)
{
    struct rig *r = &b->r;
    rig_room(r);
    rig_bulb(r, "bulb", rig_v(-1, 2.2, 0.5), 100);
    struct lum_material_desc cloth = rig_diffuse(0.5f);
    rig_material(r, "cloth", &cloth);
    put_pose(r, &poses[0]);
    rig_object(r, "tent", "tent", "cloth", rig_v(-0.6, 0.1, 0));
    look_at_tent(r);
    for (size_t k = 0; k < 2 * LUM_ARRAY_LEN(poses); k++) {
        const struct pose *pose = &poses[k < LUM_ARRAY_LEN(poses) ? k : k * 5 % LUM_ARRAY_LEN(poses)];
        put_pose(r, pose);
        render(b);
        assert_as_anew(b, pose->what);
    }
}

static void poses_are_those_of_new_scenes(struct bed *b)
{
    struct rig *r = &b->r;
    struct bed fresh;
    r->settings.effects_off = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE);
    r->settings.antialias = false;
    struct lum_material_desc cloth = rig_diffuse(0.5f);
    for (size_t k = 0; k < LUM_ARRAY_LEN(poses); k++) {
        begin(&fresh, b->method);
        fresh.r.settings = r->settings;
        struct rig *both[] = {r, &fresh.r};
        for (int i = k > 0; i < 2; i++) {
            rig_room(both[i]);
            rig_bulb(both[i], "bulb", rig_v(-1, 2.2, 0.5), 100);
            rig_material(both[i], "cloth", &cloth);
            put_pose(both[i], &poses[k]);
            rig_object(both[i], "tent", "tent", "cloth", rig_v(-0.6, 0.1, 0));
        }
        look_at_tent(r);
        look_at_tent(&fresh.r);
        put_pose(r, &poses[k]);
        rig_commit(&fresh.r);
        render(b);
        render(&fresh);
        uint32_t n = 0, pixels = r->settings.w * r->settings.h;
        for (uint32_t i = 0; i < pixels; i++) {
            double x = (double)lum_film_mean(lum_view_film(r->view), i % r->settings.w, i / r->settings.w).g;
            double y = (double)lum_film_mean(lum_view_film(fresh.r.view), i % r->settings.w, i / r->settings.w).g;
            n += !(fabs(x - y) <= 1e-3 * y);
        }
        /* of 480 pixels some 100 lie at an edge of the tent or of its shadow, of which one in ten may round otherwise
         * where all of the room is placed anew by 100 m */
        if (n > 10)
            fail_msg("%s, %s: %u pixels differ from a scene that is made so", b->method->name, poses[k].what, n);
        rig_end(&fresh.r);
    }
}

/* ---- far out, and back ---- */

static void put_ball(struct rig *r, double x)
{
    rig_object(r, "ball", "crate", "red", rig_v(x, 0.5, 0));
    rig_commit(r);
}

/* A scene is placed anew only when something lies beyond 128 units, in a map in which the extent is 32 to 64: then it
 * has grown at least (128 + 16) / 64 times; back, when it is below 8 units: a quarter. So a way of 4 km and back, from
 * 4 m, moves everything log(1000) / log(2.25) + log(1000) / log(4) = 14 times at most, and to and fro at one place not
 * at all after the first time. In between what is cached stays: on the way nothing is near enough to the room to be
 * seen. */
static void dragged_out_of_the_scene(struct bed *b)
{
    struct rig *r = &b->r;
    rig_room(r);
    rig_bulb(r, "bulb", rig_v(-1, 2.2, 0.5), 100);
    put_ball(r, 1);
    r->settings.camera.position = rig_v(-0.3, 1.4, 1.8);
    uint64_t first = render(b);
    uint32_t n_placed = 0;
    bool back = false;
    for (double x = 3; x >= 3; x = back ? x / 1.25 : x * 1.25) {
        struct lum_normalisation was = r->snapshot->norm;
        put_ball(r, x);
        bool placed = !lum_normalisation_equal(&was, &r->snapshot->norm);
        uint64_t created = render(b);
        n_placed += placed;
        if (!placed && b->method->cache && b->method->cache->lasting && created > first / 4)
            fail_msg("%s: %llu records were made while the ball was %g m away, %llu at first", b->method->name,
                     (unsigned long long)created, x, (unsigned long long)first);
        if (placed)
            assert_as_anew(b, "placed anew");
        for (int k = 0; k < 4 && placed; k++) { /* to and fro */
            was = r->snapshot->norm;
            put_ball(r, k % 2 ? x : x * (back ? 1.02 : 0.98));
            assert_true(lum_normalisation_equal(&was, &r->snapshot->norm));
        }
        back = back || x > 4000;
    }
    if (n_placed < 2 || n_placed > 14)
        fail_msg("%s: the scene was placed anew %u times", b->method->name, n_placed);
    put_ball(r, 1);
    render(b);
    assert_as_anew(b, "back again");
}

/* ---- a soak ---- */

/* $LUMEND_SOAK: so many edits in place of these. */
static uint32_t n_edits(void)
{
    const char *more = getenv("LUMEND_SOAK");
    return more ? (uint32_t)strtoul(more, NULL, 10) : 60;
}

/* Items of a random scene come, go and change; now and then the picture is compared. Memory does not grow with edits:
 * there are at most as many records as a picture asks for, times those that scenes before left where they still hold.
 */
static void soak(struct bed *b)
{
    struct rig *r = &b->r;
    struct random_scene s = random_scene_make(77);
    uint32_t n = n_edits(), most = 0;
    random_scene_put(r, &s);
    render(b);
    for (uint32_t k = 1; k <= n; k++) {
        uint32_t i = k * 2654435761u % (RANDOM_ITEMS - 1) + 1;
        s.items[i].gone = !s.items[i].gone;
        s.items[i].seed += k % 3;
        random_scene_put_item(r, &s, i);
        rig_commit(r);
        struct lum_pass_stats stats = rig_pass(r);
        most = stats.cache.records > most ? (uint32_t)stats.cache.records : most;
        if (k % 10 == 0) {
            char what[32];
            render(b);
            snprintf(what, sizeof what, "after %u edits", k);
            assert_as_anew(b, what);
        }
    }
    uint32_t pixels = r->settings.w * r->settings.h;
    if (most > 8 * pixels)
        fail_msg("%s: %u records for %u pixels", b->method->name, most, pixels);
}

/* ---- all of them, with every method ---- */

static struct long_case {
    const char *name;
    void (*check)(struct bed *);
} cases[] = {
    {"triangles_change_while_a_mesh_deforms", topology_changes},
    {"poses_are_those_of_new_scenes", poses_are_those_of_new_scenes},
    {"dragged_out_of_the_scene_and_back", dragged_out_of_the_scene},
    {"a_soak_of_edits", soak},
};

static void with_every_method(void **state)
{
    const struct long_case *c = *state;
    size_t n;
    const struct lum_method *methods = lum_methods(&n);
    for (size_t m = 0; m < n; m++) {
        if (!TEST_TAKES(m, (size_t)(c - cases)))
            continue;
        struct bed b = {0};
        begin(&b, &methods[m]);
        c->check(&b);
        rig_end(&b.r);
    }
}

int main(void)
{
    struct CMUnitTest tests[LUM_ARRAY_LEN(cases)];
    for (size_t i = 0; i < LUM_ARRAY_LEN(cases); i++)
        tests[i] = (struct CMUnitTest){cases[i].name, with_every_method, NULL, NULL, &cases[i]};
    return cmocka_run_group_tests_name("numeric.long_edits", tests, NULL, NULL);
}
