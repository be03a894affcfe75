/* Lights as a renderer reads them: light entries by id, then emissive instances by object id; their emitter shapes; the
 * table from which one is picked. */
#include "core/scene/light_kind.h"
#include "core/scene/tables.h"

#include <string.h>

#include "core/light/emitter.h"
#include "core/light/web.h"
#include "core/math/sampler.h"
#include "core/scene/parts.h"

struct light_build {
    const struct lum_light_input *in;
    struct lum_light_part *part;
    uint32_t former_at; /* cursor over the previous part's mesh emitters, which are sorted alike */
};

static const struct lum_object_entry *object_of(const struct lum_light_input *in, const struct lum_instance *instance)
{
    return (const struct lum_object_entry *)lum_entry_find(&in->scene->tables[LUM_ENTITY_OBJECT], instance->id);
}

/* ---- area distribution of mesh emitters ---- */

static struct lum_area_cdf *area_cdf_ref(struct lum_area_cdf *cdf)
{
    lum_refs_get(&cdf->refs);
    return cdf;
}

static void area_cdf_unref(struct lum_area_cdf *cdf)
{
    if (!cdf || !lum_refs_put(&cdf->refs))
        return;
    lum_mesh_unref(cdf->mesh);
    lum_free(cdf->sums);
    lum_free(cdf);
}

/* Without the transform's translation. ret_area: a vector along the normal. */
static void triangle_of(const struct lum_instance *instance, uint32_t triangle, struct lum_vec3 ret_p[3],
                        struct lum_vec3 *ret_area)
{
    for (int k = 0; k < 3; k++) {
        const float *v =
            instance->mesh->positions + 3 * (size_t)instance->mesh->indices[3 * (size_t)triangle + (size_t)k];
        ret_p[k] = lum_affine_vector(&instance->local_to_scene, lum_v3(v[0], v[1], v[2]));
    }
    *ret_area = lum_v3_mul(lum_cross(lum_v3_sub(ret_p[1], ret_p[0]), lum_v3_sub(ret_p[2], ret_p[0])), 0.5f);
}

/* Where triangles lie and face to. That of one which bends by more than 60 degrees is all around, where it shows half
 * of its area, or a quarter of what is closed. */
static struct lum_light_reach reach_of_mesh(const struct lum_instance *instance, struct lum_vec3 centre, double total,
                                            struct lum_vec3 axis)
{
    const float least_cos = 0.5f;
    struct lum_light_reach r = {
        .centre = centre, .axis = lum_normalize(axis), .cos_faced = 1.0f, .intensity = (float)total};
    for (uint32_t i = 0; i < instance->mesh->n_triangles; i++) {
        struct lum_vec3 p[3], area;
        triangle_of(instance, i, p, &area);
        for (int k = 0; k < 3; k++)
            r.radius = lum_max(r.radius, lum_length(lum_v3_sub(p[k], centre)));
        float a = lum_length(area);
        if (a > 0.0f)
            r.cos_faced = lum_min(r.cos_faced, lum_dot(area, r.axis) / a);
    }
    if (lum_affine_mirrors(&instance->local_to_scene))
        r.axis = lum_v3_neg(r.axis); /* to the side that is wound counter-clockwise before */
    r.cos_faced -= 1e-3f;            /* normals of slivers are not exact */
    if (!(r.cos_faced > least_cos))
        r.cos_faced = -1.0f;
    if (r.cos_faced < 0.0f)
        r.intensity *= 0.25f;
    return r;
}

static struct lum_area_cdf *area_cdf_create(const struct lum_instance *instance)
{
    uint32_t n = instance->mesh->n_triangles;
    struct lum_area_cdf *cdf = lum_calloc(1, sizeof *cdf);
    float *sums = lum_calloc(n, sizeof *sums);
    if (!cdf || !sums) {
        lum_free(cdf);
        lum_free(sums);
        return NULL;
    }
    lum_refs_init(&cdf->refs);
    cdf->mesh = lum_mesh_ref((struct lum_mesh *)instance->mesh);
    for (int i = 0; i < 3; i++)
        memcpy(cdf->linear[i], instance->local_to_scene.m[i], 3 * sizeof(float));
    cdf->sums = sums;
    double centre[3] = {0.0, 0.0, 0.0};
    struct lum_vec3 axis = {0.0f, 0.0f, 0.0f};
    for (uint32_t i = 0; i < n; i++) {
        struct lum_vec3 p[3], along;
        triangle_of(instance, i, p, &along);
        double area = (double)lum_length(along);
        axis = lum_v3_add(axis, along);
        centre[0] += area * (double)(p[0].x + p[1].x + p[2].x) / 3.0;
        centre[1] += area * (double)(p[0].y + p[1].y + p[2].y) / 3.0;
        centre[2] += area * (double)(p[0].z + p[1].z + p[2].z) / 3.0;
        cdf->total += area;
        sums[i] = (float)cdf->total;
    }
    struct lum_vec3 middle = {0.0f, 0.0f, 0.0f};
    if (cdf->total > 0.0)
        middle =
            lum_v3((float)(centre[0] / cdf->total), (float)(centre[1] / cdf->total), (float)(centre[2] / cdf->total));
    cdf->reach = reach_of_mesh(instance, middle, cdf->total, axis);
    return cdf;
}

static bool area_cdf_serves(const struct lum_area_cdf *cdf, const struct lum_instance *instance)
{
    if (cdf->mesh != instance->mesh)
        return false;
    for (int i = 0; i < 3; i++)
        if (memcmp(cdf->linear[i], instance->local_to_scene.m[i], 3 * sizeof(float)) != 0)
            return false;
    return true;
}

/* What the previous part knows of the instance's surface, where mesh and linear map are the same; else its n. */
static uint32_t find_previous(struct light_build *b, const struct lum_instance *instance)
{
    const struct lum_light_part *previous = b->in->previous;
    for (; previous && b->former_at < previous->n; b->former_at++) {
        const struct lum_light *l = &previous->items[b->former_at];
        int order = l->kind == LUM_EMIT_MESH ? strcmp(l->id, instance->id) : -1;
        if (order == 0 && area_cdf_serves(previous->cdfs[b->former_at], instance))
            return b->former_at;
        if (order >= 0)
            break;
    }
    return previous ? previous->n : 0;
}

/* ---- what textures and holes leave of a mesh emitter's light ---- */

/* Stratified places; of a surface that is half black at random, as bad as can be, the mean is 0.8 % off. */
#define MEAN_PLACES 4096u
/* A speck that no place met may shine all the same, and must not count as dark. */
#define MEAN_LEAST 0x1p-20f

static void key_of(const struct lum_material *m, struct lum_emission_mean *ret)
{
    memset(ret, 0, sizeof *ret);
    bool holes = lum_material_has_holes(m);
    if (!holes && !m->emission_tex.image)
        return;
    memcpy(&ret->emission, &m->emission_tex, sizeof ret->emission);
    if (!holes)
        return;
    memcpy(&ret->alpha, &m->base_color_tex, sizeof ret->alpha);
    ret->alpha_mode = m->alpha_mode;
    ret->alpha_factor = m->alpha;
    ret->alpha_cutoff = m->alpha_cutoff;
}

static bool same_key(const struct lum_emission_mean *a, const struct lum_emission_mean *b)
{
    return memcmp(&a->emission, &b->emission, sizeof a->emission) == 0 &&
           memcmp(&a->alpha, &b->alpha, sizeof a->alpha) == 0 && a->alpha_mode == b->alpha_mode &&
           a->alpha_factor == b->alpha_factor && a->alpha_cutoff == b->alpha_cutoff;
}

/* l has its area, and is as it will be but for its power. */
static float find_mean(const struct light_build *b, const struct lum_light *l)
{
    struct lum_snapshot s = {.instances = b->in->instances->items,
                             .n_instances = b->in->instances->n,
                             .materials = b->in->materials->items,
                             .n_materials = b->in->materials->n,
                             .has_alpha = true};
    s.alpha = (struct lum_accel_alpha){lum_snapshot_opaque, &s};
    double sum = 0.0;
    for (uint32_t k = 0; k < MEAN_PLACES; k++) {
        struct lum_sampler sampler = {0x6d65616e, k};
        struct lum_light_place place;
        if (lum_light_place(&s, l, lum_sampler_2d(&sampler, 0), &place))
            sum += (double)lum_luminance(place.per_power);
    }
    return fmaxf((float)(sum / MEAN_PLACES), MEAN_LEAST);
}

static float mean_emission(const struct light_build *b, const struct lum_light *l, const struct lum_material *m,
                           const struct lum_emission_mean *previous)
{
    struct lum_emission_mean *mean = &b->part->means[b->part->n];
    key_of(m, mean);
    if (!mean->emission.image && !lum_material_has_holes(m))
        return 1.0f;
    if (mean->emission.image)
        lum_image_ref((struct lum_image *)mean->emission.image);
    if (mean->alpha.image)
        lum_image_ref((struct lum_image *)mean->alpha.image);
    return mean->mean = previous && same_key(previous, mean) ? previous->mean : find_mean(b, l);
}

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

/* All but the power. */
static void place_mesh_light(struct light_build *b, struct lum_light *l, uint32_t index, const struct lum_area_cdf *cdf)
{
    const struct lum_instance *instance = &b->in->instances->items[index];
    const struct lum_object_entry *o = object_of(b->in, instance);
    l->kind = LUM_EMIT_MESH;
    l->instance = index;
    l->shape = LUM_NO_OBJECT;
    l->tri_cdf = cdf->sums;
    l->area = (float)cdf->total;
    l->both_sides = !b->in->materials->items[instance->material].front_emission;
    l->on = !o->shine.off;
    l->camera_visible = true;
    memcpy(l->id, instance->id, sizeof l->id);
    memcpy(l->group, o->group, sizeof l->group);
}

#define LUMINANCE_MAX 1e12 /* as of a light or a material; a flux may ask for more of a small surface */

static struct lum_rgb mesh_light_power(const struct lum_light *l, const struct lum_object_entry *o,
                                       const struct lum_normalisation *norm)
{
    const struct lum_material_desc *m = &o->material->desc;
    double luminance = m->emission_cd_m2;
    if (o->shine.unit == LUM_SHINE_LUMINANCE)
        luminance = o->shine.amount;
    if (o->shine.unit == LUM_SHINE_FLUX && o->shine.amount > 0.0)
        luminance = o->shine.amount / lum_mesh_light_flux(l, (double)l->area / (norm->scale * norm->scale));
    else if (o->shine.unit == LUM_SHINE_FLUX)
        luminance = 0.0;
    return lum_rgb_scale(o->shine.has_color ? o->shine.color : m->emission, (float)fmin(luminance, LUMINANCE_MAX));
}

/* The emitter's surface, which rays can hit. One too small for the scene's precision (2^-28 units across, in a scene of
 * 32..64) gets none: nothing hits it. */
static void add_shape(struct lum_light_part *part, struct lum_light *l, uint32_t light)
{
    const float smallest = 0x1p-28f;
    const struct lum_emitter_row *row = lum_emitters[l->kind];
    if (!row->across || !(row->across(l) >= smallest) || !isfinite(l->area) || !lum_v3_finite(l->p))
        return;
    struct lum_accel_shape *s = &part->shapes[part->n_shapes];
    s->kind = row->shape;
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
    struct lum_vec3 half = lum_v3(s->radius, s->radius, s->radius);
    if (s->kind == LUM_SHAPE_QUAD)
        half = lum_v3(fabsf(s->u.x) + fabsf(s->v.x), fabsf(s->u.y) + fabsf(s->v.y), fabsf(s->u.z) + fabsf(s->v.z));
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
        if (l->kind != LUM_EMIT_ENVIRONMENT || !l->on)
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
    if (!l->on || (l->kind == LUM_EMIT_ENVIRONMENT && i != part->table.environment))
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
    const struct lum_emitter_row *row = lum_emitters[l->kind];
    if (row->reach)
        return row->reach(l);
    if (l->kind != LUM_EMIT_MESH)
        return (struct lum_light_reach){.centre = {NAN, NAN, NAN}};
    struct lum_light_reach r = part->cdfs[i]->reach;
    const float(*m)[4] = instances[l->instance].local_to_scene.m;
    r.centre = lum_v3_add(r.centre, lum_v3(m[0][3], m[1][3], m[2][3]));
    r.intensity *= l->mean_emission * (l->both_sides && r.cos_faced < 0.0f ? 2.0f : 1.0f);
    r.both_sides = l->both_sides;
    return r;
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

/* True when the surface shines, or would if it were switched on or less dimmed. */
static bool is_emissive(const struct lum_light_input *in, const struct lum_instance *instance)
{
    const struct lum_material *m = &in->materials->items[instance->material];
    const struct lum_object_entry *o = object_of(in, instance);
    return (!lum_rgb_black(m->emission) || o->shine.unit != LUM_SHINE_AS_MATERIAL) && !m->unlit;
}

static uint32_t count_lights(const struct lum_light_input *in)
{
    uint32_t n = in->scene->tables[LUM_ENTITY_LIGHT].n;
    for (uint32_t i = 0; i < in->instances->n; i++)
        n += is_emissive(in, &in->instances->items[i]);
    return n;
}

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
    part->cdfs = lum_calloc(n, sizeof(struct lum_area_cdf *));
    part->means = lum_calloc(n, sizeof *part->means);
    part->envs = lum_calloc(n, sizeof(struct lum_env_part *));
    part->webs = lum_calloc(n, sizeof(struct lum_web *));
    part->shapes = lum_calloc(n, sizeof *part->shapes);
    part->shape_lights = lum_calloc(n, sizeof *part->shape_lights);
    if (part->items && part->active && part->afar && part->active_cdf && part->pick_pdf && part->cdfs && part->means &&
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
        area_cdf_unref(part->cdfs[i]);
        lum_image_unref((struct lum_image *)part->means[i].emission.image);
        lum_image_unref((struct lum_image *)part->means[i].alpha.image);
        lum_env_part_unref(part->envs[i]);
        lum_web_unref(part->webs[i]);
    }
    lum_free(part->items);
    lum_free(part->active);
    lum_free(part->afar);
    lum_free(part->active_cdf);
    lum_free(part->pick_pdf);
    lum_light_tree_finish(&part->tree);
    lum_free(part->cdfs);
    lum_free(part->means);
    lum_free(part->envs);
    lum_free(part->webs);
    lum_free(part->shapes);
    lum_free(part->shape_lights);
    lum_free(part);
}

static enum lum_status add_lights(struct light_build *b, struct lum_error *err)
{
    const struct lum_table *table = &b->in->scene->tables[LUM_ENTITY_LIGHT];
    struct lum_light_part *part = b->part;
    for (uint32_t i = 0; i < table->n; i++) {
        struct lum_light_entry *entry = (struct lum_light_entry *)table->rows[i];
        struct lum_light *l = &part->items[part->n];
        resolve_light(l, entry, b->in->norm);
        add_shape(part, l, part->n);
        if (entry->image) {
            enum lum_status status = lum_image_entry_env(entry->image, &part->envs[part->n], err);
            if (status != LUM_OK)
                return status;
            l->env = part->envs[part->n]->map;
        }
        if (entry->desc.kind == LUM_LIGHT_SKY) {
            enum lum_status status = lum_sky_resolve(b->in, &entry->desc, l, &part->envs[part->n], err);
            if (status != LUM_OK)
                return status;
        }
        part->webs[part->n] = l->web ? lum_web_ref(l->web) : NULL;
        part->n++;
    }
    return LUM_OK;
}

static enum lum_status add_mesh_lights(struct light_build *b, struct lum_error *err)
{
    struct lum_light_part *part = b->part;
    for (uint32_t i = 0; i < b->in->instances->n; i++) {
        struct lum_instance *instance = &b->in->instances->items[i];
        if (!is_emissive(b->in, instance))
            continue;
        const struct lum_light_part *previous = b->in->previous;
        uint32_t was = find_previous(b, instance);
        bool known = previous && was < previous->n;
        struct lum_area_cdf *cdf = known ? area_cdf_ref(previous->cdfs[was]) : area_cdf_create(instance);
        if (!cdf)
            return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the emitter \"%s\"", instance->id);
        part->cdfs[part->n] = cdf;
        struct lum_light *l = &part->items[part->n];
        place_mesh_light(b, l, i, cdf);
        l->mean_emission =
            mean_emission(b, l, &b->in->materials->items[instance->material], known ? &previous->means[was] : NULL);
        l->power = mesh_light_power(l, object_of(b->in, instance), b->in->norm);
        instance->light = part->n++;
    }
    return LUM_OK;
}

enum lum_status lum_resolve_lights(const struct lum_light_input *in, struct lum_light_part **ret_part,
                                   struct lum_error *err)
{
    uint32_t n = count_lights(in);
    struct light_build b = {.in = in, .part = part_alloc(n)};
    if (!b.part)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u lights", n);
    enum lum_status status = add_lights(&b, err);
    if (status == LUM_OK)
        status = add_mesh_lights(&b, err);
    if (status != LUM_OK) {
        lum_light_part_unref(b.part);
        return status;
    }
    struct lum_bounds bounds = *in->bounds;
    for (uint32_t i = 0; i < b.part->n_shapes; i++) {
        struct lum_bounds shape = lum_shape_bounds(&b.part->shapes[i]);
        lum_bounds_grow(&bounds, shape.lo);
        lum_bounds_grow(&bounds, shape.hi);
    }
    b.part->bounds = bounds;
    if (!build_tree(b.part, in->instances->items)) {
        lum_light_part_unref(b.part);
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory to sort %u lights", n);
    }
    fill_table(b.part);
    *ret_part = b.part;
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
    if (x->kind != LUM_EMIT_MESH || y->kind != LUM_EMIT_MESH)
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
