/* Where the scene lies: the map from metres to scene space.
 *
 * Centre and scale are chosen from the bounds of everything that has a surface, so that the largest extent
 * becomes 32..64 units around the origin. They are kept while the scene still fits, so that an edit does not move
 * everything else: an earlier placement serves while all lies within 128 units and the extent is at least 8. */
#include "core/scene/light_kind.h"
#include "core/math/vec3d.h"
#include "core/scene/tables.h"

#include <math.h>

struct bounds {
    struct lum_vec3d lo, hi;
};

static void grow(struct bounds *b, struct lum_vec3d p)
{
    b->lo = (struct lum_vec3d){fmin(b->lo.x, p.x), fmin(b->lo.y, p.y), fmin(b->lo.z, p.z)};
    b->hi = (struct lum_vec3d){fmax(b->hi.x, p.x), fmax(b->hi.y, p.y), fmax(b->hi.z, p.z)};
}

static void grow_by_object(struct bounds *b, const struct lum_object_entry *o)
{
    const struct lum_mesh *mesh = o->mesh->mesh;
    if (!o->visible || mesh->n_triangles == 0)
        return;
    struct lum_affined m = lum_affined_mul(&o->local_to_world, &mesh->local_to_given);
    for (int corner = 0; corner < 8; corner++) {
        struct lum_vec3d p = {(double)(corner & 1 ? mesh->bounds_hi.x : mesh->bounds_lo.x),
                              (double)(corner & 2 ? mesh->bounds_hi.y : mesh->bounds_lo.y),
                              (double)(corner & 4 ? mesh->bounds_hi.z : mesh->bounds_lo.z)};
        grow(b, lum_affined_point(&m, p));
    }
}

static void grow_by_light(struct bounds *b, const struct lum_light_desc *d)
{
    const struct lum_light_kind_row *row = d->kind;
    if (!row->half)
        return;
    struct lum_vec3d c = d->position, half = row->half(d);
    grow(b, lum_v3d_sub(c, half));
    grow(b, lum_v3d_mad(c, half, 1.0));
}

static double extent_of(const struct bounds *b)
{
    return fmax(b->hi.x - b->lo.x, fmax(b->hi.y - b->lo.y, b->hi.z - b->lo.z));
}

static bool still_serves(const struct lum_normalisation *n, const struct bounds *b)
{
    double reach = fmax(fmax(fabs(b->lo.x - n->centre.x), fabs(b->hi.x - n->centre.x)),
                        fmax(fmax(fabs(b->lo.y - n->centre.y), fabs(b->hi.y - n->centre.y)),
                             fmax(fabs(b->lo.z - n->centre.z), fabs(b->hi.z - n->centre.z))));
    return reach * n->scale <= (double)LUM_SCENE_REACH && extent_of(b) * n->scale >= 8.0;
}

struct lum_normalisation lum_scene_place(const struct lum_scene *scene, const struct lum_normalisation *previous)
{
    struct bounds b = {{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    const struct lum_table *objects = &scene->tables[LUM_ENTITY_OBJECT], *lights = &scene->tables[LUM_ENTITY_LIGHT];
    for (uint32_t i = 0; i < objects->n; i++)
        grow_by_object(&b, (const struct lum_object_entry *)objects->rows[i]);
    for (uint32_t i = 0; i < lights->n; i++)
        grow_by_light(&b, &((const struct lum_light_entry *)lights->rows[i])->desc);

    double extent = extent_of(&b);
    bool empty = !(b.lo.x <= b.hi.x) || !(extent > 0.0);
    if (previous && (empty || still_serves(previous, &b)))
        return *previous;
    if (empty)
        return (struct lum_normalisation){.centre = {0, 0, 0}, .scale = 1.0};
    int exponent = 0;
    frexp(extent, &exponent);
    /* 2^+-36: squared, and times the largest intensity, it still fits a float */
    exponent = exponent < -30 ? -30 : exponent > 42 ? 42 : exponent;
    /* A centre with few bits: subtracting it is exact, and a scene moved by a multiple of the grid gets the same bits.
     */
    double grid = ldexp(1.0, exponent - 16);
    return (struct lum_normalisation){
        .centre = {nearbyint(0.5 * (b.lo.x + b.hi.x) / grid) * grid, nearbyint(0.5 * (b.lo.y + b.hi.y) / grid) * grid,
                   nearbyint(0.5 * (b.lo.z + b.hi.z) / grid) * grid},
        .scale = ldexp(1.0, 6 - exponent),
    };
}
