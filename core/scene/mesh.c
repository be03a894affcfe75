/* Meshes: from what a client gives to what Embree and the shaders read.
 *
 * Positions are moved to a local space of extent 1..2 around the origin by a translation and a power of two, both exact
 * in double, so that float keeps its full precision wherever and however large the mesh was made. Triangles that no ray
 * can hit are dropped and counted. */
#include "core/scene/tables.h"

#include <float.h>
#include <string.h>

#include "core/math/vec3d.h"
#include "core/scene/parts.h"

/* What one put works on. */
struct mesh_build {
    const struct lum_mesh_desc *desc;
    struct lum_mesh *mesh;
    struct lum_triangles *triangles; /* the mesh's */
    uint8_t *used;                   /* per vertex: a triangle that is kept has it */
    uint64_t dropped;
};

struct lum_mesh *lum_mesh_ref(struct lum_mesh *mesh)
{
    lum_refs_get(&mesh->refs);
    return mesh;
}

void lum_mesh_unref(struct lum_mesh *mesh)
{
    if (!mesh || !lum_refs_put(&mesh->refs))
        return;
    lum_accel_mesh_unref(mesh->accel);
    lum_triangles_unref(mesh->triangles);
    lum_free(mesh->normals);
    lum_free(mesh->uvs);
    lum_free(mesh->tangents);
    lum_free(mesh->tangent_signs);
    lum_free(mesh->colors);
    lum_free(mesh);
}

static struct lum_vec3d given_position(const struct lum_mesh_desc *d, uint32_t i)
{
    if (d->positions)
        return (struct lum_vec3d){d->positions[3 * (size_t)i], d->positions[3 * (size_t)i + 1],
                                  d->positions[3 * (size_t)i + 2]};
    return (struct lum_vec3d){(double)d->positions_f[3 * (size_t)i], (double)d->positions_f[3 * (size_t)i + 1],
                              (double)d->positions_f[3 * (size_t)i + 2]};
}

/* Is a component of cross(b - a, c - a) at least that large? Not denormal, which threads may read as 0. */
static bool has_area(const struct lum_vec3d p[3], double least)
{
    struct lum_vec3d c = lum_v3d_cross(lum_v3d_sub(p[1], p[0]), lum_v3d_sub(p[2], p[0]));
    return (fabs(c.x) >= least) | (fabs(c.y) >= least) | (fabs(c.z) >= least);
}

/* A deforming mesh keeps triangles that have no area in this pose: they may open in the next. */
static bool triangle_usable(const struct lum_mesh_desc *d, const uint32_t *t)
{
    if (t[0] >= d->n_vertices || t[1] >= d->n_vertices || t[2] >= d->n_vertices)
        return false;
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
        return false;
    struct lum_vec3d p[3];
    for (int k = 0; k < 3; k++) {
        p[k] = given_position(d, t[k]);
        if (!lum_v3d_within(p[k], LUM_LENGTH_MAX))
            return false;
    }
    return d->deforming || has_area(p, DBL_MIN);
}

static void keep(struct mesh_build *b, uint32_t kept, const uint32_t *t)
{
    memmove(b->triangles->indices + 3 * (size_t)kept, t, 3 * sizeof *t);
    b->used[t[0]] = b->used[t[1]] = b->used[t[2]] = 1;
}

static void keep_usable_triangles(struct mesh_build *b)
{
    uint32_t kept = 0, n = b->desc->n_triangles;
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t *t = b->desc->indices + 3 * (size_t)i;
        if (triangle_usable(b->desc, t))
            keep(b, kept++, t);
    }
    b->dropped += n - kept;
    b->triangles->n_triangles = kept;
}

/* Numbers: fmin and fmax, which are calls, would look for what is none. */
static double least(double a, double b)
{
    return b < a ? b : a;
}

static double most(double a, double b)
{
    return b > a ? b : a;
}

static void grow(struct lum_vec3d *lo, struct lum_vec3d *hi, struct lum_vec3d p)
{
    *lo = (struct lum_vec3d){least(lo->x, p.x), least(lo->y, p.y), least(lo->z, p.z)};
    *hi = (struct lum_vec3d){most(hi->x, p.x), most(hi->y, p.y), most(hi->z, p.z)};
}

/* Nearest multiple of a power of two: a centre with few bits, so that subtracting it is exact for nearby positions. */
static double snap(double x, double grid)
{
    return nearbyint(x / grid) * grid;
}

/* local_to_given for the triangles' bounds: a centre on a grid of 2^-16 of the extent, scaled to extent 1..2. */
static struct lum_affined place_mesh(const struct mesh_build *b)
{
    struct lum_vec3d lo = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (uint32_t i = 0; i < b->desc->n_vertices; i++)
        if (b->used[i])
            grow(&lo, &hi, given_position(b->desc, i));
    bool any = b->triangles->n_triangles > 0;
    double extent = fmax(hi.x - lo.x, fmax(hi.y - lo.y, hi.z - lo.z));
    int exponent = 0;
    if (any && extent > 0.0)
        frexp(extent, &exponent);
    exponent = exponent < -60 ? -60 : exponent; /* smaller than 1e-18 m: stays small, never overflows */
    double unit = ldexp(1.0, exponent - 1), grid = ldexp(1.0, exponent - 16);
    struct lum_affined m = {{{unit, 0, 0, 0}, {0, unit, 0, 0}, {0, 0, unit, 0}}};
    if (any) {
        m.m[0][3] = snap(0.5 * (lo.x + hi.x), grid);
        m.m[1][3] = snap(0.5 * (lo.y + hi.y), grid);
        m.m[2][3] = snap(0.5 * (lo.z + hi.z), grid);
    }
    return m;
}

/* True when the pose still fits the space of the one before, so that it can keep it. */
static bool placement_serves(const struct lum_affined *m, const struct mesh_build *b)
{
    double largest = 0.0;
    for (uint32_t i = 0; i < b->desc->n_vertices; i++) {
        if (!b->used[i])
            continue;
        struct lum_vec3d p = given_position(b->desc, i);
        largest = most(largest, fabs(p.x - m->m[0][3]));
        largest = most(largest, fabs(p.y - m->m[1][3]));
        largest = most(largest, fabs(p.z - m->m[2][3]));
    }
    return largest <= 4.0 * m->m[0][0] && largest >= 0.125 * m->m[0][0];
}

static void localise_positions(struct mesh_build *b)
{
    const struct lum_affined *m = &b->mesh->local_to_given;
    double scale = 1.0 / m->m[0][0];
    for (uint32_t i = 0; i < b->desc->n_vertices; i++) {
        struct lum_vec3d p = given_position(b->desc, i);
        p = (struct lum_vec3d){(p.x - m->m[0][3]) * scale, (p.y - m->m[1][3]) * scale, (p.z - m->m[2][3]) * scale};
        if (!(fabs(p.x) <= 8.0 && fabs(p.y) <= 8.0 && fabs(p.z) <= 8.0))
            p = (struct lum_vec3d){0, 0, 0}; /* belongs to no triangle that was kept */
        float *out = b->triangles->positions + 3 * (size_t)i;
        out[0] = (float)p.x;
        out[1] = (float)p.y;
        out[2] = (float)p.z;
    }
}

/* Drops what rounding to float left without area: Embree works with denormals flushed to zero. */
static void drop_flat_triangles(struct mesh_build *b)
{
    struct lum_triangles *r = b->triangles;
    uint32_t kept = 0, n = r->n_triangles;
    memset(b->used, 0, r->n_vertices);
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t *t = r->indices + 3 * (size_t)i;
        struct lum_vec3d p[3];
        for (int k = 0; k < 3; k++) {
            const float *v = r->positions + 3 * (size_t)t[k];
            p[k] = (struct lum_vec3d){(double)v[0], (double)v[1], (double)v[2]};
        }
        if (b->desc->deforming || has_area(p, (double)FLT_MIN))
            keep(b, kept++, t);
    }
    b->dropped += n - kept;
    r->n_triangles = kept;
}

static void find_local_bounds(struct mesh_build *b)
{
    struct lum_vec3d lo = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (uint32_t i = 0; i < b->triangles->n_vertices; i++) {
        const float *p = b->triangles->positions + 3 * (size_t)i;
        if (b->used[i])
            grow(&lo, &hi, (struct lum_vec3d){(double)p[0], (double)p[1], (double)p[2]});
    }
    b->mesh->bounds_lo = lum_v3((float)lo.x, (float)lo.y, (float)lo.z);
    b->mesh->bounds_hi = lum_v3((float)hi.x, (float)hi.y, (float)hi.z);
}

/* One that is no direction becomes zero: there uvs say which way it runs. */
static void copy_tangents(struct lum_mesh *mesh, const float *given)
{
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        struct lum_vec3 t = lum_normalize(lum_v3(given[4 * i], given[4 * i + 1], given[4 * i + 2]));
        if (!lum_v3_finite(t))
            t = lum_v3(0.0f, 0.0f, 0.0f);
        memcpy(mesh->tangents + 3 * i, &t, 3 * sizeof(float));
        mesh->tangent_signs[i] = given[4 * i + 3] < 0.0f ? -1.0f : 1.0f;
    }
}

/* Attributes are made fit to interpolate: unit normals (a bad one becomes zero, which shades flat), finite uvs, colours
 * in 0..1. */
static void copy_attributes(struct mesh_build *b)
{
    const struct lum_mesh_desc *d = b->desc;
    for (size_t i = 0; d->normals && i < d->n_vertices; i++) {
        struct lum_vec3 n = lum_normalize(lum_v3(d->normals[3 * i], d->normals[3 * i + 1], d->normals[3 * i + 2]));
        memcpy(b->mesh->normals + 3 * i, &n, 3 * sizeof(float));
    }
    for (size_t i = 0; d->uvs && i < 2 * (size_t)d->n_vertices; i++)
        b->mesh->uvs[i] = fabsf(d->uvs[i]) <= 1e6f ? d->uvs[i] : 0.0f; /* NaN fails the test */
    if (d->tangents)
        copy_tangents(b->mesh, d->tangents);
    for (size_t i = 0; d->colors && i < 3 * (size_t)d->n_vertices; i++)
        b->mesh->colors[i] = d->colors[i] >= 0.0f ? fminf(d->colors[i], 1.0f) : 0.0f;
}

static enum lum_status check_desc(const struct lum_mesh_desc *d, struct lum_error *err)
{
    if (d->n_vertices < 1 || d->n_vertices > LUM_MESH_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "positions", "a mesh has 1 to %u vertices, not %u", LUM_MESH_MAX,
                        d->n_vertices);
    if (d->n_triangles < 1 || d->n_triangles > LUM_MESH_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "indices", "a mesh has 1 to %u triangles, not %u", LUM_MESH_MAX,
                        d->n_triangles);
    if ((!d->positions && !d->positions_f) || !d->indices)
        return lum_fail(err, LUM_ERR_INVALID, "positions", "a mesh needs positions and indices");
    return LUM_OK;
}

static struct lum_mesh *mesh_alloc(const struct lum_mesh_desc *d)
{
    struct lum_mesh *mesh = lum_calloc(1, sizeof *mesh);
    if (!mesh)
        return NULL;
    lum_refs_init(&mesh->refs);
    mesh->n_vertices = d->n_vertices;
    mesh->deforming = d->deforming;
    mesh->triangles = lum_triangles_create(d->n_vertices, d->n_triangles);
    bool ok = mesh->triangles != NULL;
    if (d->normals)
        ok &= (mesh->normals = lum_calloc(d->n_vertices, 3 * sizeof(float))) != NULL;
    if (d->uvs)
        ok &= (mesh->uvs = lum_calloc(d->n_vertices, 2 * sizeof(float))) != NULL;
    if (d->tangents) {
        ok &= (mesh->tangents = lum_calloc(d->n_vertices, 3 * sizeof(float))) != NULL;
        ok &= (mesh->tangent_signs = lum_calloc(d->n_vertices, sizeof(float))) != NULL;
    }
    if (d->colors)
        ok &= (mesh->colors = lum_calloc(d->n_vertices, 3 * sizeof(float))) != NULL;
    if (ok)
        return mesh;
    lum_mesh_unref(mesh);
    return NULL;
}

/* Everything but the acceleration structure. previous: the pose before, of a mesh that deforms; or NULL. */
static enum lum_status mesh_make(struct mesh_build *b, const struct lum_mesh *previous, struct lum_error *err)
{
    b->mesh = mesh_alloc(b->desc);
    b->used = b->mesh ? lum_calloc(b->desc->n_vertices, 1) : NULL;
    if (!b->used)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a mesh of %u triangles", b->desc->n_triangles);
    b->triangles = b->mesh->triangles;
    keep_usable_triangles(b);
    bool keep_place =
        previous && previous->deforming && b->desc->deforming && placement_serves(&previous->local_to_given, b);
    b->mesh->local_to_given = keep_place ? previous->local_to_given : place_mesh(b);
    localise_positions(b);
    drop_flat_triangles(b);
    find_local_bounds(b);
    lum_free(b->used);
    copy_attributes(b);
    b->mesh->positions = b->triangles->positions;
    b->mesh->indices = b->triangles->indices;
    b->mesh->n_triangles = b->triangles->n_triangles;
    return LUM_OK;
}

static bool same_topology(const struct lum_mesh *a, const struct lum_mesh *b)
{
    return a->deforming && b->deforming && a->n_triangles > 0 && a->n_vertices == b->n_vertices &&
           a->n_triangles == b->n_triangles &&
           memcmp(a->indices, b->indices, (size_t)a->n_triangles * 3 * sizeof(uint32_t)) == 0;
}

/* Of a mesh that does not deform, or whose topology is new. */
static enum lum_status build_tree(const struct lum_scene *scene, struct lum_mesh *mesh, struct lum_error *err)
{
    bool large = !mesh->deforming && mesh->n_triangles >= LUM_SCENE_QUICK_TRIANGLES, coincide = false;
    if (mesh->n_triangles == 0)
        return LUM_OK; /* every triangle was dropped: there is nothing to hit */
    mesh->quick = large && scene->hurry;
    enum lum_status status =
        large && !mesh->quick ? lum_triangles_coincide(mesh->triangles, NULL, &coincide, err) : LUM_OK;
    if (status != LUM_OK)
        return status;
    enum lum_tree tree = mesh->deforming ? LUM_TREE_REFIT : mesh->quick || coincide ? LUM_TREE_QUICK : LUM_TREE_FAST;
    return lum_accel_mesh_create(scene->device, mesh->triangles, tree, NULL, &mesh->accel, err);
}

/* A deforming mesh alternates between two structures: readers hold the newer one, the older one is refitted when nobody
 * reads it any more, else a new one is built. */
static enum lum_status mesh_accelerate(struct lum_scene *scene, struct lum_mesh_entry *entry, struct lum_mesh *mesh,
                                       struct lum_error *err)
{
    bool can_refit = entry->mesh && same_topology(entry->mesh, mesh);
    if (can_refit && entry->spare && lum_accel_mesh_unique(entry->spare)) {
        enum lum_status status = lum_accel_mesh_refit(entry->spare, mesh->positions, err);
        if (status == LUM_OK)
            mesh->accel = entry->spare;
        else
            lum_accel_mesh_unref(entry->spare); /* in an unknown state */
        entry->spare = NULL;
        return status;
    }
    return build_tree(scene, mesh, err);
}

/* The mesh passes over. */
static void keep_mesh(struct lum_scene *scene, struct lum_entry *base, struct mesh_build *b)
{
    struct lum_mesh_entry *entry = (struct lum_mesh_entry *)base;
    lum_accel_mesh_unref(entry->spare);
    bool keep_spare = entry->mesh && same_topology(entry->mesh, b->mesh);
    entry->spare = keep_spare ? lum_accel_mesh_ref(entry->mesh->accel) : NULL;
    lum_mesh_unref(entry->mesh);
    entry->mesh = b->mesh;
    scene->dropped_triangles += b->dropped;
    scene->has_quick |= b->mesh->quick;
    lum_table_keep(&scene->tables[LUM_ENTITY_MESH], base);
}

static enum lum_status open_entry(struct lum_scene *scene, const char *id, struct lum_entry **ret_entry,
                                  struct lum_error *err)
{
    return lum_table_open(&scene->tables[LUM_ENTITY_MESH], id, sizeof(struct lum_mesh_entry), ret_entry, err);
}

enum lum_status lum_scene_put_mesh(struct lum_scene *scene, const char *id, const struct lum_mesh_desc *desc,
                                   struct lum_error *err)
{
    struct lum_entry *base = NULL;
    enum lum_status status = check_desc(desc, err);
    if (status == LUM_OK)
        status = open_entry(scene, id, &base, err);
    if (status != LUM_OK)
        return status;
    struct lum_mesh_entry *entry = (struct lum_mesh_entry *)base;
    struct mesh_build b = {.desc = desc};
    status = mesh_make(&b, entry->mesh, err);
    if (status == LUM_OK)
        status = mesh_accelerate(scene, entry, b.mesh, err);
    if (status == LUM_OK) {
        keep_mesh(scene, base, &b);
        return LUM_OK;
    }
    lum_mesh_unref(b.mesh);
    lum_table_drop(&scene->tables[LUM_ENTITY_MESH], base);
    return status;
}

/* ---- beside the scene ---- */

enum lum_status lum_scene_make_mesh(const struct lum_scene *scene, const struct lum_mesh_desc *desc,
                                    struct lum_made_mesh *ret_made, struct lum_error *err)
{
    struct mesh_build b = {.desc = desc};
    enum lum_status status = check_desc(desc, err);
    if (status == LUM_OK)
        status = mesh_make(&b, NULL, err);
    if (status == LUM_OK)
        status = build_tree(scene, b.mesh, err);
    if (status == LUM_OK)
        *ret_made = (struct lum_made_mesh){b.mesh, b.dropped};
    else
        lum_mesh_unref(b.mesh);
    return status;
}

void lum_made_mesh_finish(struct lum_made_mesh *made)
{
    lum_mesh_unref(made->mesh);
    *made = (struct lum_made_mesh){0};
}

enum lum_status lum_scene_put_made_mesh(struct lum_scene *scene, const char *id, struct lum_made_mesh *made,
                                        struct lum_error *err)
{
    struct lum_entry *base = NULL;
    enum lum_status status = open_entry(scene, id, &base, err);
    if (status != LUM_OK)
        return status;
    struct mesh_build b = {.mesh = made->mesh, .dropped = made->dropped};
    *made = (struct lum_made_mesh){0};
    keep_mesh(scene, base, &b);
    return LUM_OK;
}

void lum_scene_hurry(struct lum_scene *scene, bool hurry)
{
    scene->hurry = hurry;
}

static struct lum_mesh *mesh_at(const struct lum_scene *scene, uint32_t i)
{
    return ((struct lum_mesh_entry *)scene->tables[LUM_ENTITY_MESH].rows[i])->mesh;
}

uint32_t lum_scene_quick_meshes(struct lum_scene *scene, struct lum_triangles **ret_triangles, uint32_t most)
{
    uint32_t n = 0;
    for (uint32_t i = 0; scene->has_quick && i < scene->tables[LUM_ENTITY_MESH].n && n < most; i++)
        if (mesh_at(scene, i)->quick)
            ret_triangles[n++] = lum_triangles_ref(mesh_at(scene, i)->triangles);
    scene->has_quick = false;
    return n;
}

/* Snapshots hold on to their own trees, and read no others. */
void lum_scene_give_tree(struct lum_scene *scene, const struct lum_triangles *of, struct lum_accel_mesh *tree)
{
    scene->has_quick = true; /* there may have been too many for one round */
    for (uint32_t i = 0; i < scene->tables[LUM_ENTITY_MESH].n; i++) {
        struct lum_mesh *mesh = mesh_at(scene, i);
        if (mesh->triangles != of || !mesh->quick)
            continue;
        mesh->quick = false;
        if (!tree)
            continue;
        lum_accel_mesh_unref(mesh->accel);
        mesh->accel = lum_accel_mesh_ref(tree);
        scene->new_trees = true;
    }
}
