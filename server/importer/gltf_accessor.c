/* Accessors: bounds, sparse overrides, component types. An accessor is first packed into tight bytes, then converted.
 */
#include <math.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"

enum component { I8 = 5120, U8 = 5121, I16 = 5122, U16 = 5123, U32 = 5125, F32 = 5126 };

#define MAX_COUNT (3ull * LUM_LIMIT_TRIANGLES) /* the indices of the largest mesh */

struct packed {
    uint8_t *bytes;
    uint32_t count, n_components;
    enum component component;
    size_t component_bytes, element_bytes;
    bool normalized;
};

static size_t size_of_component(uint64_t c)
{
    return c == I8 || c == U8 ? 1 : c == I16 || c == U16 ? 2 : c == U32 || c == F32 ? 4 : 0;
}

static uint32_t count_components(const char *type)
{
    static const struct {
        const char *name;
        uint32_t n;
    } types[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
    for (size_t i = 0; type && i < LUM_ARRAY_LEN(types); i++)
        if (strcmp(type, types[i].name) == 0)
            return types[i].n;
    return 0; /* MAT2 and MAT3 are used by no attribute */
}

static bool read_layout(struct lum_gltf *g, const cJSON *o, struct packed *p)
{
    uint64_t component = lum_gltf_uint(g, o, "componentType", 0, F32);
    p->count = (uint32_t)lum_gltf_uint(g, o, "count", 0, MAX_COUNT);
    p->normalized = lum_gltf_bool(g, o, "normalized", false);
    p->n_components = count_components(lum_gltf_string(g, o, "type"));
    p->component_bytes = size_of_component(component);
    p->component = (enum component)component;
    p->element_bytes = p->component_bytes * p->n_components;
    if (lum_gltf_ok(g) && p->element_bytes == 0)
        lum_gltf_fail(g, LUM_ERR_INVALID, "componentType or type is unknown");
    if (lum_gltf_ok(g) && p->count == 0)
        lum_gltf_fail(g, LUM_ERR_INVALID, "count must be at least 1");
    return lum_gltf_ok(g);
}

/* count elements of element_bytes from byteOffset of a view, or refused. */
static bool find_elements(struct lum_gltf *g, const cJSON *o, uint64_t count, size_t element_bytes,
                          struct lum_gltf_view *ret_view)
{
    uint32_t index = lum_gltf_index(g, o, "bufferView", LUM_GLTF_BUFFER_VIEWS);
    uint64_t offset = lum_gltf_uint(g, o, "byteOffset", 0, LUM_LIMIT_IMPORT_FILE_BYTES);
    struct lum_gltf_view v;
    if (!lum_gltf_ok(g))
        return false;
    if (index == LUM_GLTF_NONE)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "has no bufferView");
    if (!lum_gltf_view(g, index, &v))
        return false;
    if (v.stride == 0)
        v.stride = element_bytes;
    if (v.stride < element_bytes)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "byteStride %zu is less than the element's %zu bytes", v.stride,
                             element_bytes);
    /* count <= 2^28, stride <= 252: no overflow in 64 bits */
    uint64_t need = offset + (count ? (count - 1) * v.stride + element_bytes : 0);
    if (need > v.n)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "needs %llu bytes of a buffer view of %zu", (unsigned long long)need,
                             v.n);
    *ret_view = (struct lum_gltf_view){v.data + offset, (size_t)(need - offset), v.stride};
    return true;
}

static uint32_t load_uint(const uint8_t *p, enum component c)
{
    uint16_t u16;
    uint32_t u32;
    switch (c) {
    case U8:
        return *p;
    case U16:
        memcpy(&u16, p, sizeof u16);
        return u16;
    default:
        memcpy(&u32, p, sizeof u32);
        return u32;
    }
}

static bool apply_sparse(struct lum_gltf *g, const cJSON *sparse, struct packed *p)
{
    uint64_t n = lum_gltf_uint(g, sparse, "count", 0, p->count);
    const cJSON *indices = lum_gltf_object(g, sparse, "indices"), *values = lum_gltf_object(g, sparse, "values");
    uint64_t type = lum_gltf_uint(g, indices, "componentType", 0, U32);
    struct lum_gltf_view iv, vv;
    if (!lum_gltf_ok(g))
        return false;
    if (!indices || !values || (type != U8 && type != U16 && type != U32))
        return lum_gltf_fail(g, LUM_ERR_INVALID, "sparse needs indices of unsigned integers and values");
    if (!find_elements(g, indices, n, size_of_component(type), &iv) ||
        !find_elements(g, values, n, p->element_bytes, &vv))
        return false;
    for (uint64_t i = 0; i < n; i++) {
        uint32_t at = load_uint(iv.data + i * iv.stride, (enum component)type);
        if (at >= p->count)
            return lum_gltf_fail(g, LUM_ERR_INVALID, "sparse index %u of %u elements", at, p->count);
        memcpy(p->bytes + at * p->element_bytes, vv.data + i * vv.stride, p->element_bytes);
    }
    return true;
}

static bool fill(struct lum_gltf *g, const cJSON *o, struct packed *p)
{
    if (cJSON_GetObjectItemCaseSensitive(o, "bufferView")) {
        struct lum_gltf_view v;
        if (!find_elements(g, o, p->count, p->element_bytes, &v))
            return false;
        for (size_t i = 0; i < p->count; i++)
            memcpy(p->bytes + i * p->element_bytes, v.data + i * v.stride, p->element_bytes);
    }
    const cJSON *sparse = lum_gltf_object(g, o, "sparse");
    return !sparse || apply_sparse(g, sparse, p);
}

/* The caller frees ret_packed->bytes. */
static bool pack(struct lum_gltf *g, uint32_t index, struct packed *ret_packed)
{
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_ACCESSORS, index);
    struct packed p = {0};
    if (!o)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "an accessor is missing");
    if (!read_layout(g, o, &p))
        return false;
    /* A file of 700 bytes may ask for zeros by the gigabyte: they are refused unless some value is stored. */
    if (!cJSON_GetObjectItemCaseSensitive(o, "bufferView") && !lum_gltf_object(g, o, "sparse") && p.count > 65536)
        return lum_gltf_fail(g, LUM_ERR_LIMIT, "%u elements without data", p.count);
    p.bytes = lum_calloc(p.count, p.element_bytes);
    if (!p.bytes)
        return lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory for %u elements", p.count);
    if (!fill(g, o, &p)) {
        lum_free(p.bytes);
        return false;
    }
    *ret_packed = p;
    return true;
}

/* The value of a component as a float (glTF 2.0, 3.6.2.2 and 3.11: normalised integers; quantised ones are taken as
 * they are). */
static float load_float(const uint8_t *p, enum component c, bool normalized)
{
    float f;
    int16_t i16;
    switch (c) {
    case F32:
        memcpy(&f, p, sizeof f);
        return f;
    case I8:
        f = (float)*(const int8_t *)p;
        return normalized ? fmaxf(f / 127.0f, -1.0f) : f;
    case I16:
        memcpy(&i16, p, sizeof i16);
        f = (float)i16;
        return normalized ? fmaxf(f / 32767.0f, -1.0f) : f;
    default:
        f = (float)load_uint(p, c);
        return !normalized ? f : c == U8 ? f / 255.0f : c == U16 ? f / 65535.0f : f / 4294967296.0f;
    }
}

static bool convert_floats(struct lum_gltf *g, const struct packed *p, uint32_t n, float *to)
{
    for (uint32_t i = 0; i < p->count; i++)
        for (uint32_t c = 0; c < n; c++) {
            float f = load_float(p->bytes + i * p->element_bytes + c * p->component_bytes, p->component, p->normalized);
            if (!isfinite(f))
                return lum_gltf_fail(g, LUM_ERR_INVALID, "element %u is not finite", i);
            to[(size_t)i * n + c] = f;
        }
    return true;
}

static bool convert_uints(struct lum_gltf *g, const struct packed *p, uint32_t n, uint32_t *to)
{
    if (p->component != U8 && p->component != U16 && p->component != U32)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "must hold unsigned integers");
    for (uint32_t i = 0; i < p->count; i++)
        for (uint32_t c = 0; c < n; c++)
            to[(size_t)i * n + c] = load_uint(p->bytes + i * p->element_bytes + c * p->component_bytes, p->component);
    return true;
}

static bool read_values(struct lum_gltf *g, uint32_t index, uint32_t n, bool floats, void **ret_values,
                        uint32_t *ret_count)
{
    enum lum_gltf_kind kind = g->at_kind;
    uint32_t at = g->at_index;
    struct packed p = {0};
    lum_gltf_at(g, LUM_GLTF_ACCESSORS, index);
    if (!pack(g, index, &p))
        return false;
    bool ok = false;
    void *values = NULL;
    if (p.n_components < n)
        lum_gltf_fail(g, LUM_ERR_INVALID, "has %u components where %u are needed", p.n_components, n);
    else if (!(values = lum_calloc((size_t)p.count * n, 4)))
        lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory for %u elements", p.count);
    else
        ok = floats ? convert_floats(g, &p, n, values) : convert_uints(g, &p, n, values);
    lum_free(p.bytes);
    if (!ok) {
        lum_free(values);
        return false;
    }
    *ret_values = values;
    *ret_count = p.count;
    lum_gltf_at(g, kind, at);
    return true;
}

bool lum_gltf_floats(struct lum_gltf *g, uint32_t accessor, uint32_t n_components, float **ret_values,
                     uint32_t *ret_count)
{
    void *values = NULL;
    if (!read_values(g, accessor, n_components, true, &values, ret_count))
        return false;
    *ret_values = values;
    return true;
}

bool lum_gltf_uints(struct lum_gltf *g, uint32_t accessor, uint32_t n_components, uint32_t **ret_values,
                    uint32_t *ret_count)
{
    void *values = NULL;
    if (!read_values(g, accessor, n_components, false, &values, ret_count))
        return false;
    *ret_values = values;
    return true;
}
