#include "server/world/light_groups.h"

#include <string.h>

#include "server/world/apply.h"

/* The group that a record shines in, or NULL when it does not. */
static const char *group_of(const struct lum_document *doc, const struct lum_record *r)
{
    if (r->type == LUM_RECORD_LIGHT)
        return r->light.group[0] ? r->light.group : r->id;
    if (r->type == LUM_RECORD_MATERIAL && r->material.unlit)
        return r->id;
    if (r->type != LUM_RECORD_OBJECT)
        return NULL;
    const struct lum_record_object *o = &r->object;
    const struct lum_record *m = lum_document_find(doc, o->material);
    bool shines = o->flux_lm.set || o->luminance_cd_m2.set || (m && m->material.emission_cd_m2 > 0.0);
    if (!shines || !m || m->material.unlit)
        return NULL;
    return o->group[0] ? o->group : r->id;
}

bool lum_record_is_lamp(const struct lum_document *doc, const struct lum_record *r)
{
    return r->type != LUM_RECORD_MATERIAL && group_of(doc, r);
}

struct listing {
    const struct lum_document *doc;
    struct lum_light_groups groups;
    size_t capacity;
    bool failed;
};

static void list_one(void *user, const struct lum_record *r)
{
    struct listing *l = user;
    const char *group = group_of(l->doc, r);
    if (!group || l->failed)
        return;
    for (size_t i = 0; i < l->groups.n; i++)
        if (strcmp(l->groups.names[i], group) == 0)
            return;
    if (l->groups.n == l->capacity) {
        size_t capacity = l->capacity ? 2 * l->capacity : 16;
        lum_id *names = lum_calloc(capacity, sizeof *names);
        l->failed = !names;
        if (!names)
            return;
        if (l->groups.n)
            memcpy(names, l->groups.names, l->groups.n * sizeof *names);
        lum_free(l->groups.names);
        l->groups.names = names;
        l->capacity = capacity;
    }
    strcpy(l->groups.names[l->groups.n++], group);
}

enum lum_status lum_light_groups_list(const struct lum_world *w, struct lum_light_groups *ret_groups,
                                      struct lum_error *err)
{
    struct listing l = {.doc = w->doc};
    if (!lum_document_each(w->doc, list_one, &l) || l.failed) {
        lum_free(l.groups.names);
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the light groups");
    }
    *ret_groups = l.groups;
    return LUM_OK;
}

void lum_light_groups_finish(struct lum_light_groups *groups)
{
    lum_free(groups->names);
    *groups = (struct lum_light_groups){0};
}

static void darken(struct lum_record *r)
{
    if (r->type == LUM_RECORD_LIGHT) {
        r->light.on = false;
        return;
    }
    if (r->type == LUM_RECORD_OBJECT)
        r->object.on = false;
    else /* it shows its colour without light */
        memset(r->material.base_color, 0, sizeof r->material.base_color);
}

struct solo {
    struct lum_world *world;
    const char *group;
    enum lum_status status;
    struct lum_error *err;
};

static void solo_one(void *user, const struct lum_record *r)
{
    struct solo *s = user;
    const char *group = group_of(s->world->doc, r);
    if (!group || s->status)
        return;
    if (!s->group || strcmp(group, s->group) == 0) {
        s->status = lum_apply_put(s->world->scene, r, s->err);
        return;
    }
    struct lum_record *dark = lum_record_clone(r);
    if (!dark) {
        s->status = lum_fail(s->err, LUM_ERR_NOMEM, "", "no memory for the light groups");
        return;
    }
    darken(dark);
    s->status = lum_apply_put(s->world->scene, dark, s->err);
    lum_record_unref(dark);
}

enum lum_status lum_light_groups_solo(struct lum_world *w, const char *group, struct lum_error *err)
{
    struct solo s = {w, group, LUM_OK, err};
    if (!lum_document_each(w->doc, solo_one, &s))
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the light groups");
    return s.status ? s.status : lum_world_commit(w, err);
}
