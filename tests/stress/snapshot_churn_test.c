/* Readers trace whatever snapshot is newest, and hold on to old ones, while the writer commits new ones: rigid moves, a
 * mesh that deforms by refit, dimmed lights, objects that come and go. Every snapshot must show its own revision: the
 * sheet's height is a function of scene_rev. Run under the thread sanitizer it also proves that readers need no lock.
 */
#include "tests/support/scene_fixture.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/accel/trace.h"
#include "core/base/pool.h"
#include "core/scene/scene.h"
#include "core/scene/surface.h"

enum { READERS = 3, COMMITS = 2000, KEPT = 4, SIDE = 8 };

struct churn {
    /* guarded by lock: the newest snapshot, as a server would hand it over */
    pthread_mutex_t lock;
    const struct lum_snapshot *newest;
    /* any thread */
    _Atomic bool done;
    _Atomic uint64_t n_traced, n_wrong;
};

static double height_at(uint64_t rev)
{
    return 0.0625 * (double)(rev % 16);
}

static const struct lum_snapshot *take_newest(struct churn *c)
{
    pthread_mutex_lock(&c->lock);
    const struct lum_snapshot *s = c->newest ? lum_snapshot_ref(c->newest) : NULL;
    pthread_mutex_unlock(&c->lock);
    return s;
}

static void hand_over(struct churn *c, const struct lum_snapshot *s)
{
    pthread_mutex_lock(&c->lock);
    const struct lum_snapshot *old = c->newest;
    c->newest = s;
    pthread_mutex_unlock(&c->lock);
    lum_snapshot_unref(old);
}

/* Rays straight down on the sheet must land at this revision's height. */
static void check_snapshot(struct churn *c, const struct lum_snapshot *s, struct random_stream *r)
{
    struct lum_rays rays = {.n = 48};
    struct lum_hits hits;
    for (uint32_t i = 0; i < rays.n; i++)
        set_ray(&rays, i, to_scene(s, random_double(r) - 0.5, 2.0, random_double(r) - 0.5), lum_v3(0.0f, -1.0f, 0.0f));
    uint64_t bad = 0;
    const struct lum_trace t = {.top = s->top, .bad_rays = &bad};
    lum_trace_closest(&t, &rays, &hits);
    for (uint32_t i = 0; i < rays.n; i++) {
        bool right = hits.object[i] < s->n_instances && strcmp(s->instances[hits.object[i]].id, "sheet") == 0;
        if (right) {
            struct lum_surface surface;
            lum_snapshot_surface(s, &hits, i, lum_v3(0.0f, -1.0f, 0.0f), &surface);
            double y = (double)surface.p.y / s->norm.scale + s->norm.centre.y;
            right = fabs(y - height_at(s->scene_rev)) < 1e-4; /* floats of a scene some metres large */
        }
        atomic_fetch_add(&c->n_wrong, !right);
    }
    atomic_fetch_add(&c->n_wrong, bad);
    atomic_fetch_add(&c->n_traced, rays.n);
}

static void *reader_main(void *arg)
{
    struct churn *c = arg;
    lum_thread_init_fp();
    struct random_stream r = {13};
    const struct lum_snapshot *kept[KEPT] = {NULL};
    for (uint32_t turn = 0; !atomic_load(&c->done) || turn < KEPT; turn++) {
        const struct lum_snapshot *s = take_newest(c);
        if (!s)
            continue;
        lum_snapshot_unref(kept[turn % KEPT]);
        kept[turn % KEPT] = s;
        for (uint32_t k = 0; k < KEPT; k++)
            if (kept[k])
                check_snapshot(c, kept[k], &r);
    }
    for (uint32_t k = 0; k < KEPT; k++)
        lum_snapshot_unref(kept[k]);
    return NULL;
}

static void put_sheet(struct lum_scene *scene, double height)
{
    static float positions[(SIDE + 1) * (SIDE + 1) * 3];
    static uint32_t indices[SIDE * SIDE * 6];
    uint32_t n = 0;
    for (uint32_t j = 0; j <= SIDE; j++)
        for (uint32_t i = 0; i <= SIDE; i++) {
            float *p = positions + 3 * (size_t)(j * (SIDE + 1) + i);
            p[0] = (float)i * 2.0f / SIDE - 1.0f;
            p[1] = (float)height;
            p[2] = (float)j * 2.0f / SIDE - 1.0f;
            uint32_t a = j * (SIDE + 1) + i, b = a + SIDE + 1, quad[6] = {a, b, a + 1, b, b + 1, a + 1};
            if (i < SIDE && j < SIDE) {
                memcpy(indices + n, quad, sizeof quad);
                n += 6;
            }
        }
    struct lum_mesh_desc desc = {.positions_f = positions,
                                 .indices = indices,
                                 .n_vertices = (SIDE + 1) * (SIDE + 1),
                                 .n_triangles = SIDE * SIDE * 2,
                                 .deforming = true};
    CHECK_OK(lum_scene_put_mesh(scene, "sheet", &desc, err));
}

/* One revision's edits, all below the sheet or beside it. */
static void edit(struct lum_scene *scene, uint64_t rev)
{
    put_sheet(scene, height_at(rev));
    put_object(scene, "mover", "ball", "glow", at(3.0, 0.1 * (double)(rev % 20), 0));
    struct lum_light_desc light = light_desc(&lum_light_kind_quad);
    light.position = (struct lum_vec3d){0, 3.0, 0};
    light.intensity = 10.0 + (double)(rev % 7);
    put_light(scene, "key", &light);
    if (rev % 5 == 0)
        put_object(scene, "guest", "ball", "white", at(-3, 0, 0));
    if (rev % 5 == 3)
        CHECK_OK(lum_scene_remove(scene, LUM_ENTITY_OBJECT, "guest", err));
}

static void readers_see_whole_revisions(void **state)
{
    struct fixture *f = *state;
    static struct churn c;
    pthread_mutex_init(&c.lock, NULL);
    put_shape(f->scene, "ball", "sphere", 16, 8);
    put_material(f->scene, "white");
    put_emissive(f->scene, "glow", 5.0);
    put_sheet(f->scene, 0.0);
    put_object(f->scene, "sheet", "sheet", "white", at(0, 0, 0));
    pthread_t readers[READERS];
    for (int i = 0; i < READERS; i++)
        assert_int_equal(pthread_create(&readers[i], NULL, reader_main, &c), 0);
    for (uint64_t rev = 5; rev < 5 + COMMITS; rev++) {
        edit(f->scene, rev);
        const struct lum_snapshot *s = NULL;
        CHECK_OK(lum_scene_commit(f->scene, rev, &s, err));
        hand_over(&c, s);
    }
    atomic_store(&c.done, true);
    for (int i = 0; i < READERS; i++)
        pthread_join(readers[i], NULL);
    hand_over(&c, NULL);
    pthread_mutex_destroy(&c.lock);
    assert_int_equal(atomic_load(&c.n_wrong), 0);
    assert_true(atomic_load(&c.n_traced) > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(readers_see_whole_revisions, fixture_setup, fixture_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
