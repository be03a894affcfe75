/* Surfaces that see no other: those in one plane, and those of a convex solid that is lit from outside. Surfaces
 * reflect on both sides, so an open shell or a room sees itself. */
#include "core/trace/facing.h"
#include "core/light/emitter.h"

#include <string.h>

#include "core/scene/snapshot.h"

/* Vertices that are this far from a plane, relative to the coordinates, may still be in it: what floats were rounded
 * to. A step so low passes less than its height over the scene's size, 2^-20, of the light that meets it. */
#define ROUNDING 0x1p-20

/* Triangles times vertices up to which a solid is examined: about a millisecond. */
#define EXAMINED_MAX 0x100000u

struct plane {
    double n[3], at[3];
    double slack; /* distance that rounding can make, per distance from `at` */
};

static struct lum_vec3 vertex(const struct lum_mesh *mesh, size_t i)
{
    return lum_v3(mesh->positions[3 * i], mesh->positions[3 * i + 1], mesh->positions[3 * i + 2]);
}

/* False: the triangle has no area to speak of. extent: of the coordinates. */
static bool plane_through(const struct lum_vec3 p[3], double extent, struct plane *ret_plane)
{
    double a[3] = {(double)p[1].x - (double)p[0].x, (double)p[1].y - (double)p[0].y, (double)p[1].z - (double)p[0].z};
    double b[3] = {(double)p[2].x - (double)p[0].x, (double)p[2].y - (double)p[0].y, (double)p[2].z - (double)p[0].z};
    double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    double edge = sqrt(fmax(a[0] * a[0] + a[1] * a[1] + a[2] * a[2], b[0] * b[0] + b[1] * b[1] + b[2] * b[2]));
    double height = length / edge, noise = ROUNDING * extent;
    if (!(height > 4.0 * noise)) /* NaN: a point */
        return false;
    *ret_plane = (struct plane){.at = {(double)p[0].x, (double)p[0].y, (double)p[0].z}, .slack = noise / height};
    for (int k = 0; k < 3; k++)
        ret_plane->n[k] = n[k] / length;
    return true;
}

/* On which side of the plane p is: -1, 1, or 0 for so near that rounding decides. */
static int side_of(const struct plane *plane, struct lum_vec3 p, double extent)
{
    double d[3] = {(double)p.x - plane->at[0], (double)p.y - plane->at[1], (double)p.z - plane->at[2]};
    double distance = d[0] * plane->n[0] + d[1] * plane->n[1] + d[2] * plane->n[2];
    double slack = ROUNDING * extent + plane->slack * sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    return distance > slack ? 1 : distance < -slack ? -1 : 0;
}

static bool reflects(const struct lum_snapshot *s, uint32_t instance)
{
    return lum_material_scatter(&s->materials[s->instances[instance].material]) != 0;
}

/* ---- in one plane ---- */

#define SCENE_EXTENT 64.0 /* of scene space (snapshot.h) */

static void triangle_in_scene(const struct lum_instance *o, uint32_t t, struct lum_vec3 ret_p[3])
{
    for (size_t k = 0; k < 3; k++)
        ret_p[k] = lum_affine_point(&o->local_to_scene, vertex(o->mesh, o->mesh->indices[3 * (size_t)t + k]));
}

static bool all_in_one_plane(const struct lum_snapshot *s)
{
    struct plane plane;
    bool have = false;
    for (uint32_t i = 0; i < s->n_instances; i++) {
        const struct lum_instance *o = &s->instances[i];
        for (uint32_t t = 0; reflects(s, i) && t < o->mesh->n_triangles; t++) {
            struct lum_vec3 p[3];
            triangle_in_scene(o, t, p);
            if (!have)
                have = plane_through(p, SCENE_EXTENT, &plane);
            for (int k = 0; have && k < 3; k++)
                if (side_of(&plane, p[k], SCENE_EXTENT) != 0)
                    return false;
        }
    }
    return have;
}

/* ---- a convex solid ---- */

static uint64_t mix64(uint64_t h)
{
    h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9ull;
    h = (h ^ h >> 27) * 0x94d049bb133111ebull;
    return h ^ h >> 31;
}

static uint64_t hash_position(struct lum_vec3 p)
{
    uint64_t h = 0;
    const float c[3] = {p.x + 0.0f, p.y + 0.0f, p.z + 0.0f}; /* -0 becomes 0 */
    for (int k = 0; k < 3; k++) {
        uint32_t bits;
        memcpy(&bits, &c[k], sizeof bits);
        h = mix64(h + 0x9e3779b97f4a7c15ull + bits);
    }
    return h;
}

/* True when every edge is passed as often one way as the other: the triangles bound a volume. By a sum in which the two
 * ways cancel; that it is 0 by chance has probability 2^-64. */
static bool is_closed(const struct lum_mesh *mesh)
{
    uint64_t sum = 0;
    for (uint32_t t = 0; t < mesh->n_triangles; t++)
        for (uint32_t k = 0; k < 3; k++) {
            const uint32_t *tri = &mesh->indices[3 * (size_t)t];
            uint64_t a = hash_position(vertex(mesh, tri[k])), b = hash_position(vertex(mesh, tri[(k + 1) % 3]));
            uint64_t edge = mix64(a + b);
            if (a != b)
                sum += a < b ? edge : 0u - edge;
        }
    return sum == 0;
}

/* True when all vertices lie behind every triangle, or all before (the winding is inward). */
static bool is_convex(const struct lum_mesh *mesh)
{
    struct lum_vec3 size = lum_v3_sub(mesh->bounds_hi, mesh->bounds_lo);
    double extent = (double)lum_v3_largest(size);
    int outside = 0;
    if ((uint64_t)mesh->n_triangles * mesh->n_vertices > EXAMINED_MAX)
        return false;
    for (uint32_t t = 0; t < mesh->n_triangles; t++) {
        const uint32_t *tri = &mesh->indices[3 * (size_t)t];
        const struct lum_vec3 p[3] = {vertex(mesh, tri[0]), vertex(mesh, tri[1]), vertex(mesh, tri[2])};
        struct plane plane;
        if (!plane_through(p, extent, &plane))
            continue;
        for (uint32_t i = 0; i < mesh->n_vertices; i++) {
            int side = side_of(&plane, vertex(mesh, i), extent);
            if (side != 0 && side == outside)
                return false;
            if (side != 0)
                outside = -side;
        }
    }
    return true;
}

/* False: it may be inside. */
static bool is_outside(const struct lum_light *l, const struct lum_bounds *b)
{
    const struct lum_emitter_row *row = l->kind;
    if (row->from_afar || !row->half)
        return row->from_afar;
    struct lum_vec3 half = row->half(l);
    return l->p.x + half.x < b->lo.x || l->p.x - half.x > b->hi.x || l->p.y + half.y < b->lo.y ||
           l->p.y - half.y > b->hi.y || l->p.z + half.z < b->lo.z || l->p.z - half.z > b->hi.z;
}

static bool is_solid_lit_from_outside(const struct lum_snapshot *s, const struct lum_instance *o)
{
    const struct lum_material *m = &s->materials[o->material];
    if (m->alpha_mode != LUM_ALPHA_OPAQUE || (lum_material_scatter(m) & (LUM_SCATTER_THROUGH | LUM_SCATTER_SHEET)))
        return false;
    struct lum_bounds box = lum_instance_bounds(o);
    for (uint32_t a = 0; a < s->lights.n_active; a++)
        if (!is_outside(&s->lights.lights[s->lights.active[a]], &box))
            return false;
    return is_convex(o->mesh) && is_closed(o->mesh);
}

enum lum_facing lum_surfaces_facing(const struct lum_snapshot *s)
{
    const struct lum_instance *only = NULL;
    uint32_t n = 0;
    for (uint32_t i = 0; i < s->n_instances; i++)
        if (reflects(s, i)) {
            only = &s->instances[i];
            n++;
        }
    if (n == 0)
        return LUM_FACING_NOTHING;
    if (all_in_one_plane(s))
        return LUM_FACING_FLAT;
    return n == 1 && is_solid_lit_from_outside(s, only) ? LUM_FACING_CONVEX : LUM_FACING_EACH_OTHER;
}
