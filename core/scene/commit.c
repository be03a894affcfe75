/* Commit: resolve everything, share what came out as in the last snapshot, count what did not. */
#include "core/scene/tables.h"

#include <string.h>

#include "core/scene/parts.h"

/* A snapshot in the making. */
struct commit {
    struct lum_scene *scene;
    const struct lum_snapshot *last; /* NULL at the first commit */
    struct lum_snapshot *next;
    struct lum_snapshot_parts *parts;
    bool shared_materials, shared_top, same_shapes, same_power;
};

/* ---- resolving and sharing ---- */

/* Of two parts: as many, and alike to the last byte. */
#define SAME_ITEMS(a, b) ((a)->n == (b)->n && memcmp((a)->items, (b)->items, (a)->n * sizeof *(a)->items) == 0)

static bool same_emitter_shapes(const struct lum_light_part *a, const struct lum_light_part *b)
{
    return a->n_shapes == b->n_shapes && memcmp(a->shapes, b->shapes, a->n_shapes * sizeof *a->shapes) == 0;
}

static bool same_lights(const struct lum_light_part *a, const struct lum_light_part *b)
{
    return SAME_ITEMS(a, b) && same_emitter_shapes(a, b) && memcmp(&a->bounds, &b->bounds, sizeof a->bounds) == 0 &&
           lum_light_tree_same(&a->tree, &b->tree);
}

static bool same_media(const struct lum_snapshot_parts *a, const struct lum_snapshot_parts *b)
{
    return a->n_media == b->n_media && memcmp(a->media, b->media, a->n_media * sizeof *a->media) == 0;
}

static enum lum_status resolve_parts(struct commit *c, struct lum_error *err)
{
    struct lum_snapshot_parts *p = c->parts;
    const struct lum_normalisation *norm = &c->next->norm;
    enum lum_status status = lum_resolve_materials(c->scene, norm, &p->materials, err);
    if (status == LUM_OK)
        status = lum_resolve_instances(c->scene, norm, &p->instances, err);
    if (status == LUM_OK)
        status = lum_resolve_cameras(c->scene, &p->cameras, err);
    if (status == LUM_OK)
        status = lum_resolve_media(c->scene, norm, p, err);
    if (status != LUM_OK)
        return status;
    struct lum_bounds bounds = lum_instances_bounds(p->instances);
    struct lum_light_input in = {
        .scene = c->scene,
        .norm = norm,
        .instances = p->instances,
        .materials = p->materials,
        .previous = c->last ? c->last->parts->lights : NULL,
        .bounds = &bounds,
    };
    return lum_resolve_lights(&in, &p->lights, err);
}

static enum lum_status build_top(struct commit *c, struct lum_error *err)
{
    const struct lum_instance_part *part = c->parts->instances;
    struct lum_accel_instance *instances = lum_calloc(part->n, sizeof *instances);
    if (!instances)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u objects", part->n);
    for (uint32_t i = 0; i < part->n; i++) {
        instances[i].mesh = part->items[i].mesh->accel;
        instances[i].local_to_scene = part->items[i].local_to_scene;
    }
    enum lum_status status = lum_accel_top_create(c->scene->device, instances, part->n, c->parts->lights->shapes,
                                                  c->parts->lights->n_shapes, &c->next->top, err);
    lum_free(instances);
    return status;
}

static enum lum_status share_or_build_top(struct commit *c, struct lum_error *err)
{
    const struct lum_snapshot_parts *p = c->parts, *previous = c->last ? c->last->parts : NULL;
    if (previous && lum_instances_same_geometry(p->instances, previous->instances) &&
        same_emitter_shapes(p->lights, previous->lights)) {
        c->shared_top = true; /* or one of the same */
        if (c->scene->new_trees)
            return build_top(c, err);
        c->next->top = lum_accel_top_ref(c->last->top);
        return LUM_OK;
    }
    return build_top(c, err);
}

#define TAKE_LAST(part, unref) (unref(p->part), p->part = previous->part, lum_refs_get(&p->part->refs))

/* Replaces each part that equals the last snapshot's by that one. */
static void share_parts(struct commit *c)
{
    if (!c->last)
        return;
    struct lum_snapshot_parts *p = c->parts, *previous = c->last->parts;
    c->same_shapes = lum_lights_same_shape(p, previous);
    c->same_power = lum_lights_same_power(p, previous);
    c->shared_materials = SAME_ITEMS(p->materials, previous->materials);
    if (SAME_ITEMS(p->instances, previous->instances))
        TAKE_LAST(instances, lum_instance_part_unref);
    if (c->shared_materials)
        TAKE_LAST(materials, lum_material_part_unref);
    if (SAME_ITEMS(p->cameras, previous->cameras))
        TAKE_LAST(cameras, lum_camera_part_unref);
    if (same_lights(p->lights, previous->lights))
        TAKE_LAST(lights, lum_light_part_unref);
}

/* ---- alpha ---- */

static bool any_object(const struct lum_snapshot_parts *p, bool (*is)(const struct lum_material *m))
{
    for (uint32_t i = 0; i < p->instances->n; i++)
        if (is(&p->materials->items[p->instances->items[i].material]))
            return true;
    return false;
}

bool lum_material_has_holes(const struct lum_material *m)
{
    switch (m->alpha_mode) {
    case LUM_ALPHA_OPAQUE:
        return false;
    case LUM_ALPHA_MASK:
        return m->alpha < m->alpha_cutoff || m->base_color_tex.image;
    case LUM_ALPHA_BLEND:
        return m->alpha < 1.0f || m->base_color_tex.image;
    }
    return false;
}

/* ---- panes ---- */

/* Of all materials: objects may come to have it without an edit of materials. */
static bool any_unlit(const struct lum_snapshot_parts *p)
{
    for (uint32_t i = 0; i < p->materials->n; i++)
        if (p->materials->items[i].unlit)
            return true;
    return false;
}

/* True when both leave the same of light that goes straight through: everything counts but what they emit and what is
 * told by their names. */
static bool same_pane(const struct lum_material *a, const struct lum_material *b)
{
    if (!lum_material_is_pane(a) && !lum_material_is_pane(b))
        return true;
    struct lum_material x[2];
    memcpy(&x[0], a, sizeof x[0]);
    memcpy(&x[1], b, sizeof x[1]);
    for (int k = 0; k < 2; k++) {
        memset(&x[k].emission, 0, sizeof x[k].emission);
        memset(&x[k].emission_tex, 0, sizeof x[k].emission_tex);
        memset(x[k].id, 0, sizeof x[k].id);
    }
    return memcmp(&x[0], &x[1], sizeof x[0]) == 0;
}

static bool same_alpha(const struct lum_material *a, const struct lum_material *b)
{
    if (!lum_material_has_holes(a) && !lum_material_has_holes(b))
        return true;
    return a->alpha_mode == b->alpha_mode && a->alpha == b->alpha && a->alpha_cutoff == b->alpha_cutoff &&
           memcmp(&a->base_color_tex, &b->base_color_tex, sizeof a->base_color_tex) == 0;
}

bool lum_material_passes_same(const struct lum_material *a, const struct lum_material *b)
{
    return same_alpha(a, b) && same_pane(a, b);
}

static bool pass_same(const struct lum_snapshot_parts *a, const struct lum_snapshot_parts *b)
{
    if (a->instances->n != b->instances->n)
        return false;
    for (uint32_t i = 0; i < a->instances->n; i++)
        if (!lum_material_passes_same(&a->materials->items[a->instances->items[i].material],
                                      &b->materials->items[b->instances->items[i].material]))
            return false;
    return true;
}

/* ---- versions ---- */

/* The emission's texture counts: it is in what a light's layer responds with (effect/direct/layers.h), not in its
 * power. */
static bool same_but_emission(const struct lum_material_part *a, const struct lum_material_part *b)
{
    if (a->n != b->n)
        return false;
    for (uint32_t i = 0; i < a->n; i++) {
        struct lum_material x[2];
        memcpy(&x[0], &a->items[i], sizeof x[0]);
        memcpy(&x[1], &b->items[i], sizeof x[1]);
        for (int k = 0; k < 2; k++)
            memset(&x[k].emission, 0, sizeof x[k].emission);
        if (memcmp(&x[0], &x[1], sizeof x[0]) != 0)
            return false;
    }
    return true;
}

/* Every object that is in both has the same material. */
static bool same_assignment(const struct lum_snapshot_parts *a, const struct lum_snapshot_parts *b)
{
    for (uint32_t i = 0, j = 0; i < a->instances->n && j < b->instances->n;) {
        const struct lum_instance *x = &a->instances->items[i], *y = &b->instances->items[j];
        int order = strcmp(x->id, y->id);
        if (order == 0 && strcmp(a->materials->items[x->material].id, b->materials->items[y->material].id) != 0)
            return false;
        i += order <= 0;
        j += order >= 0;
    }
    return true;
}

/* Everything counts as changed in the first snapshot. */
static struct lum_versions count_versions(const struct commit *c)
{
    struct lum_versions v = c->last ? c->last->versions : c->scene->previous;
    if (!c->last)
        return (struct lum_versions){v.geometry + 1, v.material + 1, v.light_shape + 1, v.light_power + 1,
                                     v.medium + 1};
    const struct lum_snapshot_parts *p = c->parts, *previous = c->last->parts;
    bool same_geometry = c->shared_top && pass_same(p, previous);
    bool same_material = c->shared_materials || same_but_emission(p->materials, previous->materials);
    uint64_t step = c->scene->version_step ? c->scene->version_step : 1;
    v.geometry += same_geometry ? 0 : step;
    v.material += same_material && same_assignment(p, previous) ? 0 : step;
    v.light_shape += c->same_shapes ? 0 : step;
    v.light_power += c->same_power ? 0 : step;
    v.medium += same_media(p, previous) ? 0 : step;
    return v;
}

/* ---- the snapshot ---- */

static uint64_t count_triangles(const struct lum_instance_part *part)
{
    uint64_t n = 0;
    for (uint32_t i = 0; i < part->n; i++)
        n += part->items[i].mesh->n_triangles;
    return n;
}

static void publish(struct commit *c, uint64_t scene_rev)
{
    struct lum_snapshot *s = c->next;
    const struct lum_snapshot_parts *p = c->parts;
    s->scene_rev = scene_rev;
    s->bounds_lo = p->lights->bounds.lo;
    s->bounds_hi = p->lights->bounds.hi;
    s->alpha = (struct lum_accel_alpha){lum_snapshot_opaque, s};
    s->has_alpha = any_object(p, lum_material_has_holes);
    s->panes = (struct lum_accel_panes){lum_snapshot_passes, s};
    s->has_panes = any_object(p, lum_material_is_pane);
    s->has_sheets = any_object(p, lum_material_is_sheet);
    s->has_unlit = any_unlit(p);
    s->instances = p->instances->items;
    s->n_instances = p->instances->n;
    s->materials = p->materials->items;
    s->n_materials = p->materials->n;
    s->lights = p->lights->table;
    s->media = p->media;
    s->n_media = p->n_media;
    s->n_triangles = count_triangles(p->instances);
}

static struct lum_snapshot *snapshot_alloc(void)
{
    struct lum_snapshot *s = lum_calloc(1, sizeof *s);
    struct lum_snapshot_parts *parts = lum_calloc(1, sizeof *parts);
    if (!s || !parts) {
        lum_free(s);
        lum_free(parts);
        return NULL;
    }
    lum_refs_init(&s->refs);
    s->parts = parts;
    return s;
}

enum lum_status lum_scene_commit(struct lum_scene *scene, uint64_t scene_rev, const struct lum_snapshot **ret_snapshot,
                                 struct lum_error *err)
{
    struct commit c = {.scene = scene, .last = scene->last, .next = snapshot_alloc()};
    if (!c.next)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a snapshot");
    c.parts = c.next->parts;
    c.next->norm = lum_scene_place(scene, c.last ? &c.last->norm : NULL);
    enum lum_status status = resolve_parts(&c, err);
    if (status == LUM_OK)
        status = share_or_build_top(&c, err);
    if (status != LUM_OK) {
        lum_snapshot_unref(c.next);
        return status;
    }
    share_parts(&c);
    c.next->versions = count_versions(&c);
    publish(&c, scene_rev);
    lum_snapshot_unref(scene->last);
    scene->last = lum_snapshot_ref(c.next);
    scene->new_trees = false;
    *ret_snapshot = c.next;
    return LUM_OK;
}
