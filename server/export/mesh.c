/* Meshes: arrays that glTF has as they are, and beside them those that it would not. */
#include <math.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "core/scene/shapes.h"
#include "protocol/json/json.h"
#include "server/export/internal.h"

/* Of glTF's validator, of unit vectors. */
#define UNIT_ERROR 0.0005

/* ---- arrays ---- */

static float *floats_of(const struct lum_floats *f)
{
    float *copy = lum_calloc(f->n, sizeof *copy);
    for (size_t i = 0; i < f->n && copy; i++)
        copy[i] = f->f32 ? f->f32[i] : (float)f->f64[i];
    return copy;
}

static bool is_whole(const struct lum_floats *f)
{
    for (size_t i = 0; f->f64 && i < f->n; i++)
        if ((double)(float)f->f64[i] != f->f64[i])
            return false;
    return true;
}

/* Every n_components floats as a direction of length 1, and what is none as a fixed one. True: all were. */
static bool make_unit(float *v, size_t n, uint32_t n_components)
{
    bool were = true;
    for (size_t i = 0; i + n_components <= n; i += n_components) {
        const double d[3] = {(double)v[i], (double)v[i + 1], (double)v[i + 2]};
        double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        if (fabs(length - 1.0) <= UNIT_ERROR)
            continue;
        were = false;
        for (size_t c = 0; c < 3; c++)
            v[i + c] = length > 0.0 ? (float)(d[c] / length) : c == 1 ? 1.0f : 0.0f;
    }
    return were;
}

/* glTF's colours of vertices are at most 1. */
static bool clamp_colors(float *v, size_t n)
{
    bool were = true;
    for (size_t i = 0; i < n; i++) {
        were = were && v[i] <= 1.0f;
        v[i] = fminf(v[i], 1.0f);
    }
    return were;
}

static void keep_exact(struct lum_exporting *x, struct lum_export_entry *e, const char *key, const struct lum_floats *f)
{
    if (!e->exact && !(e->exact = cJSON_CreateObject()))
        lum_glb_fail_memory(x->glb);
    if (e->exact && f->f64)
        lum_export_bytes(x, e->exact, key, f->f64, f->n * sizeof *f->f64, 64);
    else if (e->exact)
        lum_export_bytes(x, e->exact, key, f->f32, f->n * sizeof *f->f32, 32);
}

static uint32_t put_array(struct lum_exporting *x, struct lum_export_entry *e, const char *key,
                          const struct lum_floats *f, uint32_t n_components)
{
    bool direction = strcmp(key, "normals") == 0 || strcmp(key, "tangents") == 0, same = is_whole(f);
    if (f->n == 0)
        return LUM_EXPORT_NONE;
    float *copy = floats_of(f);
    if (!copy) {
        lum_glb_fail_memory(x->glb);
        return LUM_EXPORT_NONE;
    }
    if (strcmp(key, "colors") == 0)
        same = clamp_colors(copy, f->n) && same;
    if (direction)
        same = make_unit(copy, f->n, n_components) && same;
    if (!same)
        keep_exact(x, e, key, f);
    return lum_glb_floats(x->glb, copy, f->n, n_components, strcmp(key, "positions") == 0, lum_free);
}

static void put_arrays(struct lum_exporting *x, struct lum_export_entry *e, const struct lum_record_mesh *m)
{
    e->positions = put_array(x, e, "positions", &m->positions, 3);
    e->normals = put_array(x, e, "normals", &m->normals, 3);
    e->uvs = put_array(x, e, "uvs", &m->uvs, 2);
    e->tangents = put_array(x, e, "tangents", &m->tangents, 4);
    e->colors = put_array(x, e, "colors", &m->colors, 3);
    e->indices = lum_glb_indices(x->glb, m->indices.u32, m->indices.n, NULL);
}

/* A built-in shape as arrays of a record. */
static bool shape_arrays(struct lum_exporting *x, const struct lum_record_mesh *m, struct lum_shape_mesh *ret_shape)
{
    struct lum_shape_params params = {.segments = {(uint32_t)m->segments[0], (uint32_t)m->segments[1]}};
    struct lum_error err;
    memcpy(params.size, m->size, sizeof params.size);
    memcpy(params.param, m->param, sizeof params.param);
    if (!lum_shape_make(m->shape, &params, ret_shape, &err))
        return true;
    lum_glb_fail(x->glb, &err);
    return false;
}

static void put_shape(struct lum_exporting *x, struct lum_export_entry *e)
{
    struct lum_shape_mesh s;
    if (!shape_arrays(x, &e->record->mesh, &s))
        return;
    size_t n = s.n_vertices;
    e->positions = lum_glb_floats(x->glb, s.positions, 3 * n, 3, true, lum_free);
    if (s.normals && make_unit(s.normals, 3 * n, 3))
        e->normals = lum_glb_floats(x->glb, s.normals, 3 * n, 3, false, lum_free);
    else
        lum_free(s.normals);
    if (s.uvs)
        e->uvs = lum_glb_floats(x->glb, s.uvs, 2 * n, 2, false, lum_free);
    e->empty = s.n_triangles == 0;
    e->indices = lum_glb_indices(x->glb, s.indices, 3 * (size_t)s.n_triangles, lum_free);
}

static void write_arrays(struct lum_exporting *x, struct lum_export_entry *e)
{
    const struct lum_record_mesh *m = &e->record->mesh;
    e->written = true;
    e->positions = e->normals = e->uvs = e->tangents = e->colors = LUM_EXPORT_NONE;
    if (m->shape[0]) {
        put_shape(x, e);
        return;
    }
    e->empty = m->indices.n == 0;
    if (!e->empty)
        put_arrays(x, e, m);
}

/* ---- meshes of glTF ---- */

static cJSON *primitive(struct lum_exporting *x, const struct lum_export_entry *e, uint32_t material)
{
    const struct {
        const char *key;
        uint32_t accessor;
    } all[] = {{"POSITION", e->positions},
               {"NORMAL", e->normals},
               {"TANGENT", e->tangents},
               {"TEXCOORD_0", e->uvs},
               {"COLOR_0", e->colors}};
    cJSON *o = cJSON_CreateObject(), *attributes = cJSON_CreateObject();
    bool ok = true;
    for (size_t i = 0; i < LUM_ARRAY_LEN(all); i++)
        if (all[i].accessor != LUM_EXPORT_NONE)
            ok = lum_json_add_number(attributes, all[i].key, all[i].accessor) && ok;
    ok = lum_json_add(o, "attributes", attributes) && ok;
    ok = ok && lum_json_add_number(o, "indices", e->indices) && lum_json_add_number(o, "material", material);
    if (!ok)
        lum_glb_fail_memory(x->glb);
    return o;
}

static uint32_t add_mesh(struct lum_exporting *x, struct lum_export_entry *e, uint32_t material)
{
    cJSON *o = cJSON_CreateObject(), *list = cJSON_CreateArray(), *extras = cJSON_CreateObject(),
          *ours = cJSON_CreateObject();
    bool ok = lum_json_add_string(o, "name", e->record->id) && lum_json_add_string(ours, "id", e->record->id) &&
              lum_json_add_bool(ours, "deforming", e->record->mesh.deforming);
    if (ok && e->record->mesh.shape[0]) {
        cJSON *shape = lum_record_to_json(e->record, false);
        cJSON_DeleteItemFromObjectCaseSensitive(shape, "op");
        ok = lum_json_add(ours, "record", shape);
    }
    if (ok && e->exact) /* the arrays of one mesh, whatever material it has */
        ok = lum_json_add(ours, "exact", cJSON_Duplicate(e->exact, true));
    ok = lum_json_add(list, NULL, primitive(x, e, material)) && ok;
    ok = lum_json_add(o, "primitives", list) && ok;
    ok = lum_json_add(extras, "lumend", ours) && ok;
    ok = lum_json_add(o, "extras", extras) && ok;
    if (!ok)
        lum_glb_fail_memory(x->glb);
    return lum_glb_add(x->glb, LUM_GLB_MESHES, o);
}

uint32_t lum_export_mesh(struct lum_exporting *x, struct lum_export_entry *e, uint32_t material)
{
    if (!e->written)
        write_arrays(x, e);
    for (const struct lum_export_pair *p = e->pairs; p; p = p->next)
        if (p->material == material)
            return p->mesh;
    if (e->empty || !lum_glb_ok(x->glb))
        return LUM_EXPORT_NONE;
    struct lum_export_pair *p = lum_calloc(1, sizeof *p);
    if (!p) {
        lum_glb_fail_memory(x->glb);
        return LUM_EXPORT_NONE;
    }
    *p = (struct lum_export_pair){e->pairs, material, add_mesh(x, e, material)};
    e->pairs = p;
    return p->mesh;
}

/* ---- area ---- */

static struct lum_vec3d vertex(const struct lum_record_mesh *m, const float *shape, uint32_t i)
{
    double v[3];
    for (size_t c = 0; c < 3; c++) {
        size_t at = 3 * (size_t)i + c;
        v[c] = shape ? (double)shape[at] : m->positions.f32 ? (double)m->positions.f32[at] : m->positions.f64[at];
    }
    return (struct lum_vec3d){v[0], v[1], v[2]};
}

double lum_export_area(const struct lum_record_mesh *m, const struct lum_affined *place)
{
    struct lum_shape_params params = {.segments = {(uint32_t)m->segments[0], (uint32_t)m->segments[1]}};
    struct lum_shape_mesh s = {0};
    memcpy(params.size, m->size, sizeof params.size);
    memcpy(params.param, m->param, sizeof params.param);
    if (m->shape[0] && lum_shape_make(m->shape, &params, &s, NULL))
        return 0.0;
    const uint32_t *indices = m->shape[0] ? s.indices : m->indices.u32;
    size_t n = m->shape[0] ? 3 * (size_t)s.n_triangles : m->indices.n;
    double twice = 0.0;
    for (size_t i = 0; i + 3 <= n; i += 3) {
        struct lum_vec3d p[3];
        for (size_t k = 0; k < 3; k++)
            p[k] = lum_affined_point(place, vertex(m, m->shape[0] ? s.positions : NULL, indices[i + k]));
        double a[3] = {p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z},
               b[3] = {p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z};
        twice += hypot(hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]), a[0] * b[1] - a[1] * b[0]);
    }
    if (m->shape[0])
        lum_shape_finish(&s);
    return twice / 2.0;
}
