/* A small renderer for tests: device, pool, scene and view. Failures end the test. */
#ifndef LUM_TESTS_SUPPORT_RIG_LIFE_H
#define LUM_TESTS_SUPPORT_RIG_LIFE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <string.h>

#include "core/render/view.h"
#include "core/scene/desc.h"
#include "core/scene/scene.h"
#include "core/scene/snapshot.h"
#include "tests/support/isa.h"

struct rig {
    struct lum_device *device;
    struct lum_pool *pool;
    struct lum_scene *scene;
    const struct lum_snapshot *snapshot;
    struct lum_view *view;
    uint64_t rev;
    struct lum_view_settings settings;
};

#define RIG_OK(call)                                                                                                   \
    do {                                                                                                               \
        struct lum_error err = {0};                                                                                    \
        enum lum_status rig_status = (call);                                                                           \
        if (rig_status != LUM_OK)                                                                                      \
            fail_msg("%s: %s (%s)", #call, err.text, err.field);                                                       \
    } while (0)

/* isa: of the ray tracing kernels, as lum_device_create takes it. */
static inline void rig_begin_on(struct rig *r, uint32_t threads, const char *isa)
{
    *r = (struct rig){0};
    lum_thread_init_fp();
    RIG_OK(lum_device_create(1, isa, &r->device, &err));
    RIG_OK(lum_pool_create(threads, &r->pool, &err));
    RIG_OK(lum_scene_create(r->device, &r->scene, &err));
    RIG_OK(lum_view_create(r->pool, &r->view, &err));
    r->settings = lum_view_settings_default();
    r->settings.deterministic = true; /* tests compare bits */
    r->settings.w = 48;
    r->settings.h = 32;
}

static inline void rig_begin(struct rig *r, uint32_t threads)
{
    rig_begin_on(r, threads, test_isa());
}

static inline void rig_end(struct rig *r)
{
    lum_view_destroy(r->view);
    lum_snapshot_unref(r->snapshot);
    lum_scene_destroy(r->scene);
    lum_pool_destroy(r->pool);
    lum_device_destroy(r->device);
}

static inline void rig_commit(struct rig *r)
{
    const struct lum_snapshot *next = NULL;
    RIG_OK(lum_scene_commit(r->scene, ++r->rev, &next, &err));
    lum_snapshot_unref(r->snapshot);
    r->snapshot = next;
}

static inline struct lum_pass_stats rig_pass(struct rig *r)
{
    struct lum_pass_stats stats;
    RIG_OK(lum_view_pass(r->view, r->snapshot, &r->settings, NULL, &stats, &err));
    assert_int_equal(stats.nonfinite, 0);
    assert_int_equal(stats.bad_rays, 0);
    return stats;
}

/* A new view on the same scene, so that nothing is memoised. */
static inline void rig_fresh_view(struct rig *r)
{
    lum_view_destroy(r->view);
    r->view = NULL;
    RIG_OK(lum_view_create(r->pool, &r->view, &err));
}

static inline uint64_t rig_all_rays(const struct lum_pass_stats *s)
{
    uint64_t n = 0;
    for (int k = 0; k < LUM_RAY_KIND_COUNT; k++)
        n += s->rays[k];
    return n;
}

#endif
