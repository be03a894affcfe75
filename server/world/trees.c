#define _GNU_SOURCE /* pthread_setname_np */
#include "server/world/trees.h"

#include <pthread.h>
#include <sys/resource.h>

#include "core/accel/accel.h"
#include "core/base/pool.h"
#include "core/scene/scene.h"

#define MOST 64u /* of one round */
/* Pictures come first: of two threads of one processor this one gets a tenth. It builds alone: the ray tracer's threads
 * would not be nice, or, if they were started here, be nice to edits, too. */
#define NICENESS 10

struct tree {
    struct lum_triangles *of;
    struct lum_accel_mesh *made; /* NULL: not yet, or it keeps what it has */
};
struct lum_trees {
    struct lum_device *device;
    struct lum_trees_ready ready;
    struct tree trees[MOST];
    uint32_t n, n_taken;
    pthread_t thread;
    _Atomic uint32_t n_made; /* trees before it are the scene's writer's */
    _Atomic bool stop;
};

/* NULL: it keeps the quick one, as memory is short, or as others would be seen of triangles that coincide. */
static struct lum_accel_mesh *better(struct lum_trees *t, struct lum_triangles *of)
{
    bool coincide = true;
    struct lum_accel_mesh *made = NULL;
    if (lum_triangles_coincide(of, &t->stop, &coincide, NULL) || coincide ||
        lum_accel_mesh_create(t->device, of, LUM_TREE_FAST, &t->stop, &made, NULL))
        return NULL;
    return made;
}

static void *trees_main(void *user)
{
    struct lum_trees *t = user;
    lum_thread_init_fp();
    setpriority(PRIO_PROCESS, 0, NICENESS); /* of this thread; as it is, if it may not */
    for (uint32_t i = 0; i < t->n && !atomic_load(&t->stop); i++) {
        t->trees[i].made = better(t, t->trees[i].of);
        atomic_store(&t->n_made, i + 1);
        t->ready.tell(t->ready.user);
    }
    return NULL;
}

static struct lum_trees *start(struct lum_device *device, struct lum_scene *scene, const struct lum_trees_ready *ready)
{
    struct lum_triangles *quick[MOST];
    uint32_t n = lum_scene_quick_meshes(scene, quick, MOST);
    struct lum_trees *t = n ? lum_calloc(1, sizeof *t) : NULL;
    bool ok = t != NULL;
    if (ok) {
        t->device = device;
        t->ready = *ready;
        t->n = n;
        for (uint32_t i = 0; i < n; i++)
            t->trees[i].of = lum_triangles_ref(quick[i]);
        ok = pthread_create(&t->thread, NULL, trees_main, t) == 0;
    }
    if (ok)
        pthread_setname_np(t->thread, "lum-trees");
    for (uint32_t i = 0; i < n; i++) {
        if (t && !ok)
            lum_triangles_unref(t->trees[i].of);
        lum_triangles_unref(quick[i]);
    }
    if (ok)
        return t;
    lum_free(t);
    return NULL;
}

void lum_trees_stop(struct lum_trees *t)
{
    if (!t)
        return;
    atomic_store(&t->stop, true);
    pthread_join(t->thread, NULL);
    for (uint32_t i = 0; i < t->n; i++) {
        lum_triangles_unref(t->trees[i].of);
        lum_accel_mesh_unref(t->trees[i].made);
    }
    lum_free(t);
}

bool lum_trees_turn(struct lum_trees **inout_trees, struct lum_device *device, struct lum_scene *scene,
                    const struct lum_trees_ready *ready)
{
    struct lum_trees *t = *inout_trees;
    bool any = false;
    for (uint32_t n = t ? atomic_load(&t->n_made) : 0; t && t->n_taken < n; t->n_taken++) {
        struct tree *done = &t->trees[t->n_taken];
        lum_scene_give_tree(scene, done->of, done->made);
        any |= done->made != NULL;
    }
    if (t && t->n_taken < t->n)
        return any;
    lum_trees_stop(t);
    *inout_trees = start(device, scene, ready);
    return any;
}
