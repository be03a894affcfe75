/* What is sampled of them: a triangle by its area, then a point on it. What they give is their power times a mean over
 * what textures and holes leave of it. Both are taken over from the snapshot before where they are the same. */
#include "core/scene/mesh_lights.h"

#include <string.h>

#include "core/light/emitter.h"
#include "core/light/facets.h"
#include "core/math/sampler.h"

/* Inclusive prefix sums of triangle areas in scene space, for one mesh under one linear map. */
struct lum_area_cdf {
    struct lum_refs refs;
    struct lum_mesh *mesh;
    float linear[3][3];
    double total;
    struct lum_light_reach reach; /* of the mesh, relative to the map's translation, around the centre of its area,
                                   * which is its intensity */
    float *sums;
    struct lum_facets *facets; /* without the translation; NULL: there are too many */
};

struct build {
    const struct lum_light_input *in;
    struct lum_light_part *part;
    uint32_t former_at; /* cursor over those of the previous part, which are sorted alike */
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
    lum_free(cdf->facets);
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

static void find_facets(const struct lum_instance *instance, struct lum_facets *ret)
{
    struct lum_vec3 p[LUM_FACETS_MAX][3], along;
    uint32_t n = instance->mesh->n_triangles;
    for (uint32_t i = 0; i < n; i++)
        triangle_of(instance, i, p[i], &along);
    lum_facets_init(ret, n, (const struct lum_vec3(*)[3])p, lum_affine_mirrors(&instance->local_to_scene));
}

static struct lum_area_cdf *area_cdf_create(const struct lum_instance *instance)
{
    uint32_t n = instance->mesh->n_triangles;
    bool few = n > 0 && n <= LUM_FACETS_MAX;
    struct lum_area_cdf *cdf = lum_calloc(1, sizeof *cdf);
    struct lum_facets *facets = few ? lum_calloc(1, sizeof *facets) : NULL;
    float *sums = lum_calloc(n, sizeof *sums);
    if (!cdf || !sums || (few && !facets)) {
        lum_free(cdf);
        lum_free(sums);
        lum_free(facets);
        return NULL;
    }
    if (few)
        find_facets(instance, facets);
    cdf->facets = facets;
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

struct lum_light_reach lum_mesh_light_reach(const struct lum_light_part *part, const struct lum_instance *instance,
                                            uint32_t light)
{
    const struct lum_light *l = &part->items[light];
    struct lum_light_reach r = part->surfaces[light].cdf->reach;
    const float(*m)[4] = instance->local_to_scene.m;
    r.centre = lum_v3_add(r.centre, lum_v3(m[0][3], m[1][3], m[2][3]));
    r.intensity *= l->mean_emission * (l->both_sides && r.cos_faced < 0.0f ? 2.0f : 1.0f);
    r.both_sides = l->both_sides;
    return r;
}

/* What the previous part knows of the instance's surface, where mesh and linear map are the same; else its n. */
static uint32_t find_previous(struct build *b, const struct lum_instance *instance)
{
    const struct lum_light_part *previous = b->in->previous;
    for (; previous && b->former_at < previous->n; b->former_at++) {
        const struct lum_light *l = &previous->items[b->former_at];
        int order = l->kind == &lum_emitter_mesh ? strcmp(l->id, instance->id) : -1;
        if (order == 0 && area_cdf_serves(previous->surfaces[b->former_at].cdf, instance))
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
static float find_mean(const struct build *b, const struct lum_light *l)
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

static float mean_emission(const struct build *b, const struct lum_light *l, const struct lum_material *m,
                           const struct lum_emission_mean *previous)
{
    struct lum_emission_mean *mean = &b->part->surfaces[b->part->n].mean;
    key_of(m, mean);
    if (!mean->emission.image && !lum_material_has_holes(m))
        return 1.0f;
    if (mean->emission.image)
        lum_image_ref((struct lum_image *)mean->emission.image);
    if (mean->alpha.image)
        lum_image_ref((struct lum_image *)mean->alpha.image);
    return mean->mean = previous && same_key(previous, mean) ? previous->mean : find_mean(b, l);
}

/* ---- one of them ---- */

/* All but the power. */
static void place_mesh_light(struct build *b, struct lum_light *l, uint32_t index, const struct lum_area_cdf *cdf)
{
    const struct lum_instance *instance = &b->in->instances->items[index];
    const struct lum_object_entry *o = object_of(b->in, instance);
    l->kind = &lum_emitter_mesh;
    l->instance = index;
    l->shape = LUM_NO_OBJECT;
    l->tri_cdf = cdf->sums;
    l->area = (float)cdf->total;
    l->facets_at =
        lum_v3(instance->local_to_scene.m[0][3], instance->local_to_scene.m[1][3], instance->local_to_scene.m[2][3]);
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

/* ---- all of them ---- */

/* True when the surface shines, or would if it were switched on or less dimmed. */
static bool is_emissive(const struct lum_light_input *in, const struct lum_instance *instance)
{
    const struct lum_material *m = &in->materials->items[instance->material];
    const struct lum_object_entry *o = object_of(in, instance);
    return (!lum_rgb_black(m->emission) || o->shine.unit != LUM_SHINE_AS_MATERIAL) && !m->unlit;
}

/* What is no lamp but the room: its closed form has no angle that all coats and fuzz take it from. Of the scene. */
#define ROOM_SHARE 0.25f

/* An even light, of which nothing else is seen than what faces a point: the far side of panes is. */
static bool has_facets(const struct lum_light_input *in, const struct lum_light *l, const struct lum_material *m,
                       const struct lum_facets *facets)
{
    if (!facets || m->emission_tex.image || lum_material_has_holes(m) || lum_material_is_pane(m))
        return false;
    struct lum_vec3 across = lum_v3_sub(in->bounds->hi, in->bounds->lo);
    bool room = facets->near2 > 4.0f * ROOM_SHARE * ROOM_SHARE * lum_dot(across, across); /* near2: 16 radii squared */
    return !(l->both_sides && facets->closed && room);
}

uint32_t lum_mesh_lights_count(const struct lum_light_input *in)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < in->instances->n; i++)
        n += is_emissive(in, &in->instances->items[i]);
    return n;
}

enum lum_status lum_mesh_lights_add(const struct lum_light_input *in, struct lum_light_part *part,
                                    struct lum_error *err)
{
    struct build b = {.in = in, .part = part};
    for (uint32_t i = 0; i < in->instances->n; i++) {
        struct lum_instance *instance = &in->instances->items[i];
        if (!is_emissive(in, instance))
            continue;
        uint32_t was = find_previous(&b, instance);
        const struct lum_mesh_surface *known =
            in->previous && was < in->previous->n ? &in->previous->surfaces[was] : NULL;
        struct lum_area_cdf *cdf = known ? area_cdf_ref(known->cdf) : area_cdf_create(instance);
        if (!cdf)
            return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the emitter \"%s\"", instance->id);
        part->surfaces[part->n].cdf = cdf;
        struct lum_light *l = &part->items[part->n];
        place_mesh_light(&b, l, i, cdf);
        const struct lum_material *m = &in->materials->items[instance->material];
        l->facets = has_facets(in, l, m, cdf->facets) ? cdf->facets : NULL;
        l->mean_emission = mean_emission(&b, l, m, known ? &known->mean : NULL);
        l->power = mesh_light_power(l, object_of(in, instance), in->norm);
        instance->light = part->n++;
    }
    return LUM_OK;
}

void lum_mesh_light_drop(struct lum_light_part *part, uint32_t light)
{
    struct lum_mesh_surface *s = &part->surfaces[light];
    area_cdf_unref(s->cdf);
    lum_image_unref((struct lum_image *)s->mean.emission.image);
    lum_image_unref((struct lum_image *)s->mean.alpha.image);
}
