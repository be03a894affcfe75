/* Typed, range-checked access to the JSON of a glTF file. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"

static const char *const kind_names[LUM_GLTF_KIND_COUNT] = {
    [LUM_GLTF_ACCESSORS] = "accessors",   [LUM_GLTF_BUFFERS] = "buffers",     [LUM_GLTF_BUFFER_VIEWS] = "bufferViews",
    [LUM_GLTF_CAMERAS] = "cameras",       [LUM_GLTF_IMAGES] = "images",       [LUM_GLTF_LIGHTS] = "lights",
    [LUM_GLTF_IES_LIGHTS] = "IES lights", [LUM_GLTF_MATERIALS] = "materials", [LUM_GLTF_MESHES] = "meshes",
    [LUM_GLTF_NODES] = "nodes",           [LUM_GLTF_SAMPLERS] = "samplers",   [LUM_GLTF_SCENES] = "scenes",
    [LUM_GLTF_SKINS] = "skins",           [LUM_GLTF_TEXTURES] = "textures",
};

void lum_gltf_at(struct lum_gltf *g, enum lum_gltf_kind kind, uint32_t index)
{
    g->at_kind = kind;
    g->at_index = index;
}

bool lum_gltf_ok(const struct lum_gltf *g)
{
    return g->error.status == LUM_OK;
}

/* "accessors[3]: ", or nothing at the top of the file. */
static int locate(const struct lum_gltf *g, char *text, size_t cap)
{
    if (g->at_kind == LUM_GLTF_KIND_COUNT)
        return 0;
    return snprintf(text, cap, "%s[%u]: ", kind_names[g->at_kind], g->at_index);
}

bool lum_gltf_fail(struct lum_gltf *g, enum lum_status status, const char *fmt, ...)
{
    if (!lum_gltf_ok(g))
        return false;
    g->error.status = status;
    int n = locate(g, g->error.text, sizeof g->error.text);
    va_list args;
    va_start(args, fmt);
    vsnprintf(g->error.text + n, sizeof g->error.text - (size_t)n, fmt, args);
    va_end(args);
    return false;
}

void lum_gltf_warn(struct lum_gltf *g, const char *fmt, ...)
{
    char text[256];
    int n = locate(g, text, sizeof text);
    va_list args;
    va_start(args, fmt);
    vsnprintf(text + n, sizeof text - (size_t)n, fmt, args);
    va_end(args);
    lum_emit_warning(&g->im->emit, "%s", text);
}

bool lum_gltf_go_on_without(struct lum_gltf *g, const char *what, enum lum_gltf_kind kind, uint32_t index)
{
    struct lum_error why = g->error;
    if (why.status == LUM_ERR_NOMEM)
        return false;
    g->error = (struct lum_error){0};
    lum_gltf_at(g, kind, index);
    lum_gltf_warn(g, "%s are not used: %s", what, why.text);
    return true;
}

const cJSON *lum_gltf_item(const struct lum_gltf *g, enum lum_gltf_kind kind, uint32_t index)
{
    return index < g->arrays[kind].n ? g->arrays[kind].items[index] : NULL;
}

static const cJSON *member(const cJSON *o, const char *key)
{
    return cJSON_IsObject(o) ? cJSON_GetObjectItemCaseSensitive(o, key) : NULL;
}

const cJSON *lum_gltf_object(struct lum_gltf *g, const cJSON *o, const char *key)
{
    const cJSON *v = member(o, key);
    if (v && !cJSON_IsObject(v))
        lum_gltf_fail(g, LUM_ERR_INVALID, "%s must be an object", key);
    return cJSON_IsObject(v) ? v : NULL;
}

const cJSON *lum_gltf_list(struct lum_gltf *g, const cJSON *o, const char *key)
{
    const cJSON *v = member(o, key);
    if (v && !cJSON_IsArray(v))
        lum_gltf_fail(g, LUM_ERR_INVALID, "%s must be an array", key);
    return cJSON_IsArray(v) ? v : NULL;
}

const cJSON *lum_gltf_extension(struct lum_gltf *g, const cJSON *o, const char *name)
{
    return lum_gltf_object(g, lum_gltf_object(g, o, "extensions"), name);
}

const char *lum_gltf_string(struct lum_gltf *g, const cJSON *o, const char *key)
{
    const cJSON *v = member(o, key);
    if (v && !cJSON_IsString(v))
        lum_gltf_fail(g, LUM_ERR_INVALID, "%s must be a string", key);
    return cJSON_IsString(v) ? v->valuestring : NULL;
}

bool lum_gltf_bool(struct lum_gltf *g, const cJSON *o, const char *key, bool absent)
{
    const cJSON *v = member(o, key);
    if (v && !cJSON_IsBool(v))
        lum_gltf_fail(g, LUM_ERR_INVALID, "%s must be true or false", key);
    return cJSON_IsBool(v) ? cJSON_IsTrue(v) : absent;
}

static bool whole_number(const cJSON *v, uint64_t max, uint64_t *ret_value)
{
    if (!cJSON_IsNumber(v) || !(v->valuedouble >= 0.0) || v->valuedouble > 9007199254740992.0 /* 2^53 */)
        return false;
    uint64_t u = (uint64_t)v->valuedouble;
    if ((double)u != v->valuedouble || u > max)
        return false;
    *ret_value = u;
    return true;
}

uint64_t lum_gltf_uint(struct lum_gltf *g, const cJSON *o, const char *key, uint64_t absent, uint64_t max)
{
    const cJSON *v = member(o, key);
    uint64_t value = absent;
    if (v && !whole_number(v, max, &value))
        lum_gltf_fail(g, LUM_ERR_INVALID, "%s must be a whole number from 0 to %llu", key, (unsigned long long)max);
    return value;
}

bool lum_gltf_index_value(struct lum_gltf *g, const cJSON *value, const char *key, enum lum_gltf_kind kind,
                          uint32_t *ret_index)
{
    uint64_t index = 0;
    if (!whole_number(value, UINT32_MAX - 1, &index) || index >= g->arrays[kind].n)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "%s names none of the %u %s", key, g->arrays[kind].n,
                             kind_names[kind]);
    *ret_index = (uint32_t)index;
    return true;
}

uint32_t lum_gltf_index(struct lum_gltf *g, const cJSON *o, const char *key, enum lum_gltf_kind kind)
{
    const cJSON *v = member(o, key);
    uint32_t index = LUM_GLTF_NONE;
    if (v)
        lum_gltf_index_value(g, v, key, kind, &index);
    return index;
}

double lum_gltf_number(struct lum_gltf *g, const cJSON *o, const char *key, double absent)
{
    const cJSON *v = member(o, key);
    if (!v)
        return absent;
    if (cJSON_IsNumber(v) && isfinite(v->valuedouble))
        return v->valuedouble;
    lum_gltf_fail(g, LUM_ERR_INVALID, "%s must be a finite number", key);
    return absent;
}

static double clamp(struct lum_gltf *g, const char *key, double v, const double range[2])
{
    double c = fmin(fmax(v, range[0]), range[1]);
    if (c != v && !g->warned_clamped) {
        g->warned_clamped = true;
        lum_gltf_warn(g, "%s is outside %g to %g; such values are clamped", key, range[0], range[1]);
    }
    return c;
}

double lum_gltf_clamped(struct lum_gltf *g, const cJSON *o, const char *key, double absent, const double range[2])
{
    return clamp(g, key, lum_gltf_number(g, o, key, absent), range);
}

bool lum_gltf_numbers(struct lum_gltf *g, const cJSON *o, const char *key, double *values, uint32_t n)
{
    const cJSON *list = lum_gltf_list(g, o, key);
    if (!list)
        return false;
    const cJSON *v = list->child;
    for (uint32_t i = 0; i < n; i++, v = v->next)
        if (!v || !cJSON_IsNumber(v) || !isfinite(v->valuedouble))
            return lum_gltf_fail(g, LUM_ERR_INVALID, "%s must be %u finite numbers", key, n);
    if (v)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "%s must be %u finite numbers", key, n);
    v = list->child;
    for (uint32_t i = 0; i < n; i++, v = v->next)
        values[i] = v->valuedouble;
    return true;
}

void lum_gltf_clamped_numbers(struct lum_gltf *g, const cJSON *o, const char *key, double *values, uint32_t n,
                              const double range[2])
{
    if (lum_gltf_numbers(g, o, key, values, n))
        for (uint32_t i = 0; i < n; i++)
            values[i] = clamp(g, key, values[i], range);
}
