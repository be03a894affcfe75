/* Lights as a renderer reads them: light entries by id, then emissive instances by object id (mesh_lights.h); emitter
 * shapes; the table from which one is picked. */
#include "core/scene/light_kind.h"
#include "core/scene/tables.h"

#include <string.h>

#include "core/light/emitter.h"
#include "core/light/web.h"
#include "core/scene/mesh_lights.h"
#include "core/scene/parts.h"

/* ---- lights ---- */

static void resolve_light(struct lum_light *l, const struct lum_light_entry *entry,
                          const struct lum_normalisation *norm)
{
    const struct lum_light_desc *d = &entry->desc;
    lum_light_kind_resolve(d, norm, l);
    l->instance = l->shape = LUM_NO_OBJECT;
    l->on = d->on;
    l->camera_visible = d->camera_visible;
    memcpy(l->id, entry->base.id, sizeof l->id);
    memcpy(l->group, entry->group, sizeof l->group);
}

/* The emitter's surface, which rays can hit. One too small for the scene's precision (2^-28 units across, in a scene of
 * 32..64) gets none: nothing hits it. */
static void add_shape(struct lum_light_part *part, struct lum_light *l, uint32_t light)
{
    const float smallest = 0x1p-28f;
    const struct lum_emitter_row *row = l->kind;
    if (!row->across || !(row->across(l) >= smallest) || !isfinite(l->area) || !lum_v3_finite(l->p))
        return;
    struct lum_accel_shape *s = &part->shapes[part->n_shapes];
    s->row = row->shape;
    s->p = l->p;
    s->u = l->u;
    s->v = l->v;
    s->n = l->n;
    s->radius = l->radius;
    s->hidden = !l->camera_visible;
    part->shape_lights[part->n_shapes] = light;
    l->shape = part->n_shapes++;
}

struct lum_bounds lum_shape_bounds(const struct lum_accel_shape *s)
{
    struct lum_vec3 half = lum_accel_shape_half(s);
    return (struct lum_bounds){lum_v3_sub(s->p, half), lum_v3_add(s->p, half)};
}

/* Of the sphere around the bounds; 1 for an empty scene. */
static float bounding_radius(const struct lum_bounds *b)
{
    return b->lo.x <= b->hi.x ? 0.5f * lum_length(lum_v3_sub(b->hi, b->lo)) : 1.0f;
}

/* ---- the pick table ---- */

/* Only one environment shines: the first sky by id that is on, or, where there is none, the first of the others. */
static uint32_t find_environment(const struct lum_light_part *part)
{
    uint32_t first = LUM_NO_OBJECT;
    for (uint32_t i = 0; i < part->n; i++) {
        const struct lum_light *l = &part->items[i];
        if (l->kind != &lum_emitter_environment || !l->on)
            continue;
        if (l->env_hash)
            return i;
        first = first == LUM_NO_OBJECT ? i : first;
    }
    return first;
}

/* Luminous flux of a light in scene units; only its ratio to the others matters. */
static double light_weight(const struct lum_light_part *part, uint32_t i)
{
    const struct lum_light *l = &part->items[i];
    if (!l->on || (l->kind == &lum_emitter_environment && i != part->table.environment))
        return 0.0;
    double flux = (double)lum_luminance(l->power) * lum_light_flux_unit(l, part->bounds.lo, part->bounds.hi);
    return flux > 0.0 && isfinite(flux) ? flux : 0.0;
}

/* Half of the picks go by flux, half to all lights alike: a sun that is blocked everywhere must not starve a desk lamp,
 * and the dimmest light keeps a probability far above the CDF's rounding. pick_pdf is the exact difference of
 * neighbouring CDF values, so that what is picked and what is divided by agree. */
static void fill_table(struct lum_light_part *part)
{
    struct lum_light_tree *tree = &part->tree;
    part->table = (struct lum_light_table){
        .lights = part->items,
        .n_lights = part->n,
        .active = part->active,
        .active_cdf = part->active_cdf,
        .pick_pdf = part->pick_pdf,
        .environment = find_environment(part),
        .scene_radius = bounding_radius(&part->bounds),
        .tree = tree,
        .afar = part->afar,
    };
    double total = 0.0, sum = 0.0, n_emitting = 0.0, somewhere = 0.0;
    for (uint32_t i = 0; i < part->n; i++) {
        double weight = light_weight(part, i);
        total += weight;
        n_emitting += weight > 0.0 ? 1.0 : 0.0;
    }
    float before = 0.0f;
    uint32_t n_active = 0, n_somewhere = 0;
    for (uint32_t i = 0; i < part->n; i++) {
        double weight = light_weight(part, i);
        if (!(weight > 0.0))
            continue;
        sum += 0.5 * weight / total + 0.5 / n_emitting;
        float cdf = (float)sum;
        part->active[n_active] = i;
        part->active_cdf[n_active++] = cdf;
        part->pick_pdf[i] = cdf - before;
        before = cdf;
        if (tree->n_nodes > 0 && tree->leaf_of[i] != LUM_NO_OBJECT) {
            somewhere += (double)part->pick_pdf[i];
            n_somewhere++;
        } else {
            part->afar[part->table.n_afar++] = i;
        }
    }
    if (n_active) { /* rounding may leave the last value a little off 1 */
        part->pick_pdf[part->active[n_active - 1]] += 1.0f - before;
        part->active_cdf[n_active - 1] = 1.0f;
    }
    part->table.n_active = n_active;
    lum_light_tree_brighten(tree, part->items, part->pick_pdf);
    part->table.tree_share = n_somewhere > 1 ? (float)somewhere : 0.0f;
}

/* ---- where lights are ---- */

static struct lum_light_reach reach_of(const struct lum_light_part *part, const struct lum_instance *instances,
                                       uint32_t i)
{
    const struct lum_light *l = &part->items[i];
    const struct lum_emitter_row *row = l->kind;
    if (row->reach)
        return row->reach(l);
    if (l->kind == &lum_emitter_mesh)
        return lum_mesh_light_reach(part, &instances[l->instance], i);
    return (struct lum_light_reach){.centre = {NAN, NAN, NAN}};
}

static bool build_tree(struct lum_light_part *part, const struct lum_instance *instances)
{
    struct lum_light_reach *reach = lum_calloc((size_t)part->n + 1, sizeof *reach);
    for (uint32_t i = 0; reach && i < part->n; i++)
        reach[i] = reach_of(part, instances, i);
    bool built = reach && lum_light_tree_build(&part->tree, reach, part->n);
    lum_free(reach);
    return built;
}

/* ---- the part ---- */

static struct lum_light_part *part_alloc(uint32_t n)
{
    struct lum_light_part *part = lum_calloc(1, sizeof *part);
    if (!part)
        return NULL;
    lum_refs_init(&part->refs);
    part->items = lum_calloc(n, sizeof *part->items);
    part->active = lum_calloc(n, sizeof *part->active);
    part->afar = lum_calloc(n, sizeof *part->afar);
    part->active_cdf = lum_calloc(n, sizeof *part->active_cdf);
    part->pick_pdf = lum_calloc(n, sizeof *part->pick_pdf);
    part->surfaces = lum_calloc(n, sizeof *part->surfaces);
    part->envs = lum_calloc(n, sizeof(struct lum_env_part *));
    part->webs = lum_calloc(n, sizeof(struct lum_web *));
    part->shapes = lum_calloc(n, sizeof *part->shapes);
    part->shape_lights = lum_calloc(n, sizeof *part->shape_lights);
    if (part->items && part->active && part->afar && part->active_cdf && part->pick_pdf && part->surfaces &&
        part->envs && part->webs && part->shapes && part->shape_lights)
        return part;
    lum_light_part_unref(part);
    return NULL;
}

void lum_light_part_unref(struct lum_light_part *part)
{
    if (!part || !lum_refs_put(&part->refs))
        return;
    for (uint32_t i = 0; i < part->n; i++) {
        lum_mesh_light_drop(part, i);
        lum_env_part_unref(part->envs[i]);
        lum_web_unref(part->webs[i]);
    }
    lum_free(part->items);
    lum_free(part->active);
    lum_free(part->afar);
    lum_free(part->active_cdf);
    lum_free(part->pick_pdf);
    lum_light_tree_finish(&part->tree);
    lum_free(part->surfaces);
    lum_free(part->envs);
    lum_free(part->webs);
    lum_free(part->shapes);
    lum_free(part->shape_lights);
    lum_free(part);
}

static enum lum_status add_lights(const struct lum_light_input *in, struct lum_light_part *part, struct lum_error *err)
{
    const struct lum_table *table = &in->scene->tables[LUM_ENTITY_LIGHT];
    for (uint32_t i = 0; i < table->n; i++) {
        struct lum_light_entry *entry = (struct lum_light_entry *)table->rows[i];
        struct lum_light *l = &part->items[part->n];
        resolve_light(l, entry, in->norm);
        add_shape(part, l, part->n);
        if (entry->image) {
            enum lum_status status = lum_image_entry_env(entry->image, &part->envs[part->n], err);
            if (status != LUM_OK)
                return status;
            l->env = part->envs[part->n]->map;
        }
        if (entry->desc.kind == &lum_light_kind_sky) {
            enum lum_status status = lum_sky_resolve(in, &entry->desc, l, &part->envs[part->n], err);
            if (status != LUM_OK)
                return status;
        }
        part->webs[part->n] = l->web ? lum_web_ref(l->web) : NULL;
        part->n++;
    }
    return LUM_OK;
}

enum lum_status lum_resolve_lights(const struct lum_light_input *in, struct lum_light_part **ret_part,
                                   struct lum_error *err)
{
    uint32_t n = in->scene->tables[LUM_ENTITY_LIGHT].n + lum_mesh_lights_count(in);
    struct lum_light_part *part = part_alloc(n);
    if (!part)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u lights", n);
    enum lum_status status = add_lights(in, part, err);
    if (status == LUM_OK)
        status = lum_mesh_lights_add(in, part, err);
    if (status != LUM_OK) {
        lum_light_part_unref(part);
        return status;
    }
    struct lum_bounds bounds = *in->bounds;
    for (uint32_t i = 0; i < part->n_shapes; i++) {
        struct lum_bounds shape = lum_shape_bounds(&part->shapes[i]);
        if (part->items[part->shape_lights[i]].kind->from_afar)
            continue;
        bounds = lum_bounds_join(&bounds, &shape);
    }
    part->bounds = bounds;
    if (!build_tree(part, in->instances->items)) {
        lum_light_part_unref(part);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory to sort %u lights", n);
    }
    fill_table(part);
    *ret_part = part;
    return LUM_OK;
}

/* ---- as bright as somebody wants ---- */

struct lum_light_part *lum_lights_relit(const struct lum_light_part *part,
                                        void (*change)(void *user, struct lum_light *light), void *user)
{
    struct lum_light_part *relit = part_alloc(part->n);
    if (!relit)
        return NULL;
    if (!lum_light_tree_copy(&relit->tree, &part->tree)) {
        lum_light_part_unref(relit);
        return NULL;
    }
    relit->n = part->n;
    relit->bounds = part->bounds;
    if (part->n)
        memcpy(relit->items, part->items, part->n * sizeof *part->items);
    for (uint32_t i = 0; i < part->n; i++)
        change(user, &relit->items[i]);
    fill_table(relit);
    return relit;
}

/* ---- comparison ---- */

/* A mesh emitter is where its instance is; the number of that instance does not matter. */
static bool same_place(const struct lum_snapshot_parts *a, const struct lum_snapshot_parts *b, uint32_t i)
{
    const struct lum_light *x = &a->lights->items[i], *y = &b->lights->items[i];
    if (x->kind != &lum_emitter_mesh || y->kind != &lum_emitter_mesh)
        return x->kind == y->kind;
    return memcmp(&a->instances->items[x->instance].local_to_scene, &b->instances->items[y->instance].local_to_scene,
                  sizeof(struct lum_affine)) == 0;
}

bool lum_lights_same_shape(const struct lum_snapshot_parts *a, const struct lum_snapshot_parts *b)
{
    if (a->lights->n != b->lights->n)
        return false;
    for (uint32_t i = 0; i < a->lights->n; i++) {
        struct lum_light x[2];
        memcpy(&x[0], &a->lights->items[i], sizeof x[0]);
        memcpy(&x[1], &b->lights->items[i], sizeof x[1]);
        for (int k = 0; k < 2; k++) {
            memset(&x[k].power, 0, sizeof x[k].power);
            x[k].mean_emission = 0.0f; /* an edit of a material */
            memset(x[k].group, 0, sizeof x[k].group);
            x[k].instance = 0;
            x[k].on = false;
        }
        if (memcmp(&x[0], &x[1], sizeof x[0]) != 0 || !same_place(a, b, i))
            return false;
    }
    return true;
}

bool lum_lights_same_power(const struct lum_snapshot_parts *a, const struct lum_snapshot_parts *b)
{
    if (a->lights->n != b->lights->n)
        return false;
    for (uint32_t i = 0; i < a->lights->n; i++) {
        const struct lum_light *x = &a->lights->items[i], *y = &b->lights->items[i];
        if (memcmp(&x->power, &y->power, sizeof x->power) != 0 || x->on != y->on || strcmp(x->group, y->group) != 0)
            return false;
    }
    return true;
}
