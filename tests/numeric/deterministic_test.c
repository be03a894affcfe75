/* --deterministic: pictures do not depend on the number of threads, to the bit: neither after edits, nor where two
 * views share caches, nor in the first frames of built-in animations. */
#include "tests/support/built_in.h"
#include "tests/support/effort.h"
#include "tests/support/rig.h"

static const uint32_t threads[] = {1, 7, 2, 3, 16}; /* all are held against the first */

static struct lum_view_settings settings_of(const struct lum_method *method)
{
    struct lum_view_settings s = lum_view_settings_default();
    s.method = method;
    s.deterministic = true;
    s.reproject_shadows = false; /* as the server does with --deterministic */
    s.w = 72;
    s.h = 48;
    s.n_vpls = 64;
    s.max_depth = 3;
    s.max_spp = 1;
    return s;
}

/* A row of pictures, and whether another run makes the same ones. */
enum { SHOTS_MAX = 32 };
struct album {
    struct lum_rgb *shots[SHOTS_MAX];
    size_t n; /* taken in this run */
};

static void free_album(struct album *a)
{
    for (size_t i = 0; i < SHOTS_MAX; i++)
        lum_free(a->shots[i]);
}

/* The first run fills the album, later ones are held against it. */
static void take_picture(struct album *a, const struct lum_view *view, const char *what, uint32_t n_threads)
{
    const struct rig r = {.view = (struct lum_view *)view};
    assert_true(a->n < SHOTS_MAX);
    struct lum_rgb **shot = &a->shots[a->n++];
    char text[128];
    snprintf(text, sizeof text, "%s, picture %zu, %u threads", what, a->n - 1, n_threads);
    if (*shot)
        rig_assert_picture(&r, *shot, text);
    else
        *shot = rig_picture(&r);
}

/* ---- edits, and two views ---- */

struct lookers {
    struct rig rig;
    struct lum_caches *caches;
    struct lum_view *second;
    struct lum_view_settings beside;
};

static void put_lamp(struct rig *r, double x, double cd)
{
    rig_bulb(r, "lamp", rig_v(x, 2.4, 0.3), cd);
}

static void begin(struct lookers *l, const struct lum_method *method, uint32_t n_threads)
{
    struct rig *r = &l->rig;
    rig_begin(r, n_threads);
    rig_room(r);
    struct lum_camera camera = r->settings.camera;
    put_lamp(r, -0.7, 80);
    struct lum_light_desc panel = rig_quad(rig_v(0.5, 2.95, 0.5), rig_v(0.6, 0, 0), rig_v(0, 0, 0.6), 60);
    rig_light(r, "panel", &panel);
    rig_commit(r);
    r->settings = settings_of(method);
    r->settings.camera = camera;
    l->beside = r->settings;
    l->beside.w = 40;
    l->beside.h = 56;
    l->beside.camera.position = rig_v(-1.2, 1.7, 0.9);
    RIG_OK(lum_caches_create(n_threads, &l->caches, &err));
    RIG_OK(lum_view_create(r->pool, &l->second, &err));
    lum_view_share(r->view, l->caches);
    lum_view_share(l->second, l->caches);
}

static void end(struct lookers *l)
{
    lum_view_destroy(l->second);
    lum_view_destroy(l->rig.view);
    l->rig.view = NULL;
    lum_caches_destroy(l->caches);
    rig_end(&l->rig);
}

/* What is done before the k-th pair of pictures. False: that was all. */
static bool edit(struct lookers *l, int k)
{
    struct rig *r = &l->rig;
    struct lum_material_desc green = rig_diffuse(0.5f);
    green.base_color = lum_rgb(0.1f, 0.7f, 0.1f);
    switch (k) {
    case 0:
        return true; /* the first look */
    case 1:
        rig_object(r, "crate", "crate", "red", rig_v(0.1, 0.5, -0.6));
        break;
    case 2:
        l->beside.camera.position.x += 0.6;
        return true;
    case 3:
        put_lamp(r, -0.7, 20);
        break;
    case 4:
        put_lamp(r, 0.9, 20);
        break;
    case 5:
        rig_material(r, "red", &green);
        break;
    case 6:
        rig_object(r, "twin", "crate", "white", rig_v(-1.1, 0.5, -1.2));
        break;
    case 7:
        r->settings.camera.target.x -= 0.8;
        return true;
    case 8:
        RIG_OK(lum_scene_remove(r->scene, LUM_ENTITY_OBJECT, "crate", &err));
        break;
    default:
        return false;
    }
    rig_commit(r);
    return true;
}

static void look(struct lookers *l, struct lum_view *view, const struct lum_view_settings *settings)
{
    struct lum_pass_stats stats;
    RIG_OK(lum_view_pass(view, l->rig.snapshot, settings, NULL, &stats, &err));
    assert_int_equal(stats.nonfinite + stats.bad_rays, 0);
}

static void run_edits(const struct lum_method *method, uint32_t n_threads, struct album *album)
{
    struct lookers l = {0};
    begin(&l, method, n_threads);
    album->n = 0;
    for (int k = 0; edit(&l, k); k++) {
        look(&l, l.rig.view, &l.rig.settings);
        look(&l, l.second, &l.beside);
        take_picture(album, l.rig.view, method->name, n_threads);
        take_picture(album, l.second, method->name, n_threads);
    }
    l.rig.settings.max_spp = 3; /* methods that refine go on */
    for (int pass = 0; pass < 2; pass++)
        look(&l, l.rig.view, &l.rig.settings);
    take_picture(album, l.rig.view, method->name, n_threads);
    end(&l);
}

static void edits_and_two_views(void **state)
{
    (void)state;
    size_t n_methods;
    const struct lum_method *methods = lum_methods(&n_methods);
    for (size_t m = 0; m < n_methods; m++) {
        struct album album = {0};
        for (size_t t = 0; t < 1 + TEST_EFFORT(LUM_ARRAY_LEN(threads) - 1); t++)
            run_edits(&methods[m], threads[t], &album);
        free_album(&album);
    }
}

/* ---- animations ---- */

enum { POSES = 6 };

static void run_replay(const char *scene, const struct lum_method *method, uint32_t n_threads, struct album *album)
{
    struct built_in *b = built_in_open(scene, n_threads);
    struct lum_view *view = NULL;
    struct lum_view_settings settings = settings_of(method);
    char what[64];
    snprintf(what, sizeof what, "%s, %s", scene, method->name);
    RIG_OK(lum_view_create(built_in_pool(b), &view, &err));
    album->n = 0;
    for (int pose = 0; pose < POSES; pose++) {
        struct lum_pass_stats stats;
        assert_true(built_in_next_pose(b));
        const struct lum_snapshot *s = built_in_snapshot(b);
        RIG_OK(lum_snapshot_camera(s, NULL, &settings.camera, &err));
        RIG_OK(lum_view_pass(view, s, &settings, NULL, &stats, &err));
        assert_int_equal(stats.nonfinite + stats.bad_rays, 0);
        take_picture(album, view, what, n_threads);
    }
    lum_view_destroy(view);
    built_in_close(b);
}

static void animations(void **state)
{
    (void)state;
    static const char *const scenes[] = {"bunnies-2", "wobble"};
    size_t n_methods;
    const struct lum_method *methods = lum_methods(&n_methods);
    lum_thread_init_fp();
    for (size_t s = 0; s < LUM_ARRAY_LEN(scenes); s++)
        for (size_t m = s % TEST_STRIDE; m < n_methods; m += TEST_STRIDE) {
            struct album album = {0};
            run_replay(scenes[s], &methods[m], 1, &album);
            run_replay(scenes[s], &methods[m], 3, &album);
            free_album(&album);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(edits_and_two_views),
        cmocka_unit_test(animations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
