/* Asks memory for what is about to be shaded. A picture of a model with many textures meets each texel, and each
 * triangle, from somewhere else than the one before: looked up hit by hit, every one waits for its indices, then for
 * its vertices, then for one map after the other. Asked for some hits at a time, they wait together. */
#include "core/accel/trace.h"
#include "core/base/base.h"
#include "core/math/vec.h"
#include "core/scene/snapshot.h"
#include "core/scene/surface.h"

/* NULL: it has no maps, or is the background or a lamp's own shape. Vertices alone are not worth asking for:
 * it took a thirtieth of a sample of path in the office, whose few are at hand anyway. */
static const struct lum_instance *mapped_instance(const struct lum_snapshot *s, uint32_t object)
{
    const struct lum_instance *instance = object < s->n_instances ? &s->instances[object] : NULL;
    return instance && instance->mesh->uvs && s->materials[instance->material].has_maps ? instance : NULL;
}

static const uint32_t *triangle_of(const struct lum_instance *instance, const struct lum_hits *hits, uint32_t i)
{
    return instance->mesh->indices + 3 * (size_t)hits->prim[i];
}

static void ask_vertices(const struct lum_mesh *mesh, const uint32_t index[3])
{
    for (int k = 0; k < 3; k++) {
        lum_ask_memory(mesh->positions + 3 * (size_t)index[k]);
        if (mesh->normals)
            lum_ask_memory(mesh->normals + 3 * (size_t)index[k]);
        if (mesh->uvs)
            lum_ask_memory(mesh->uvs + 2 * (size_t)index[k]);
    }
}

/* As lum_surface.uv, but for rounding. */
static struct lum_vec2 uv_at(const float *uvs, const uint32_t index[3], float u, float v)
{
    const float *a = uvs + 2 * (size_t)index[0], *b = uvs + 2 * (size_t)index[1], *c = uvs + 2 * (size_t)index[2];
    float w = 1.0f - u - v;
    return (struct lum_vec2){w * a[0] + u * b[0] + v * c[0], w * a[1] + u * b[1] + v * c[1]};
}

void lum_snapshot_ask(const struct lum_snapshot *snapshot, const struct lum_hits *hits, uint32_t first, uint32_t n)
{
    const struct lum_instance *instance[LUM_RAY_BATCH];
    uint32_t at[LUM_RAY_BATCH], n_mapped = 0;
    for (uint32_t i = first; i < first + n; i++)
        if ((instance[n_mapped] = mapped_instance(snapshot, hits->object[i]))) {
            lum_ask_memory(triangle_of(instance[n_mapped], hits, i));
            at[n_mapped++] = i;
        }
    for (uint32_t k = 0; k < n_mapped; k++)
        ask_vertices(instance[k]->mesh, triangle_of(instance[k], hits, at[k]));
    for (uint32_t k = 0; k < n_mapped; k++) {
        const uint32_t *triangle = triangle_of(instance[k], hits, at[k]);
        struct lum_vec2 uv = uv_at(instance[k]->mesh->uvs, triangle, hits->u[at[k]], hits->v[at[k]]);
        lum_material_ask(&snapshot->materials[instance[k]->material], uv);
    }
}
