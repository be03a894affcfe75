#include "tests/support/fake_director.h"

#include <string.h>

#include "core/base/base.h"

bool lum_director_post(struct lum_director *d, struct lum_request *c)
{
    if (d->n_posted == d->capacity)
        return false;
    d->posted[d->n_posted++] = c;
    return true;
}

struct lum_out *lum_director_take_outbox(struct lum_director *d)
{
    struct lum_out *first = d->first;
    d->first = NULL;
    d->last = &d->first;
    return first;
}

uint64_t lum_director_scene_rev(const struct lum_director *d)
{
    (void)d;
    return 41;
}

uint64_t lum_director_starts(const struct lum_director *d)
{
    (void)d;
    return 0;
}

bool lum_director_alive(const struct lum_director *d)
{
    (void)d;
    return true;
}

void lum_director_metrics(const struct lum_director *d, struct lum_director_metrics *ret_metrics)
{
    (void)d;
    *ret_metrics = (struct lum_director_metrics){0};
}

enum lum_status lum_director_create(const struct lum_director_config *config, struct lum_director **ret_director,
                                    struct lum_error *err)
{
    if (config->scene && strcmp(config->scene, FAKE_DIRECTOR_FAILS) == 0)
        return lum_fail(err, LUM_ERR_IO, "", "as asked");
    struct lum_director *d = lum_calloc(1, sizeof *d);
    if (!d)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a fake director");
    fake_director_init(d);
    *ret_director = d;
    return LUM_OK;
}

void lum_director_destroy(struct lum_director *d)
{
    if (d)
        fake_director_finish(d);
    lum_free(d);
}

void fake_director_init(struct lum_director *d)
{
    *d = (struct lum_director){.capacity = LUM_ARRAY_LEN(d->posted)};
    d->last = &d->first;
}

void fake_director_forget(struct lum_director *d)
{
    for (unsigned i = 0; i < d->n_posted; i++)
        lum_request_destroy(d->posted[i]);
    d->n_posted = 0;
}

void fake_director_finish(struct lum_director *d)
{
    fake_director_forget(d);
    for (struct lum_out *o = lum_director_take_outbox(d), *next; o; o = next) {
        next = o->next;
        lum_out_destroy(o);
    }
}
