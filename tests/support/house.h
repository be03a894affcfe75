/* A rig with a lit room whose view shares caches that other views may share too. */
#ifndef LUM_TESTS_SUPPORT_HOUSE_H
#define LUM_TESTS_SUPPORT_HOUSE_H

#include "core/cache/caches.h"
#include "tests/support/rig.h"

struct house {
    struct rig rig;
    struct lum_caches *caches;
};

static inline void house_begin(struct house *h, const struct lum_method *method)
{
    struct rig *r = &h->rig;
    rig_begin(r, 2);
    rig_room(r);
    rig_bulb(r, "lamp", rig_v(0, 2.5, 0), 100.0);
    rig_commit(r);
    assert_non_null(method);
    r->settings.method = method;
    RIG_OK(lum_caches_create(2, &h->caches, &err));
    lum_view_share(r->view, h->caches);
}

static inline void house_end(struct house *h)
{
    lum_view_destroy(h->rig.view);
    h->rig.view = NULL;
    lum_caches_destroy(h->caches);
    rig_end(&h->rig);
}

#endif
