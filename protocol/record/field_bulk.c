/* Arrays in bulk: JSON arrays, base64 pixels, and the blobs that an importer sends beside its JSON. */
#include "protocol/record/field.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/base/base64.h"
#include "protocol/json/json.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "blobs are little-endian and are copied as they are");
_Static_assert(sizeof(float) == 4, "blobs hold 32-bit floats");

static bool wrong(const struct lum_field *f, struct lum_proto_error *err, const char *wanted)
{
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", f->name, "%s must be %s", f->name, wanted);
}

static bool wrong_element(const struct lum_field *f, size_t i, double min, double max, struct lum_proto_error *err)
{
    char path[64];
    snprintf(path, sizeof path, "%s/%zu", f->name, i);
    return lum_proto_fail_range(err, path, min, max);
}

/* {"blob":k} to blob k as a bulk array of one's own, or shared, whose numbers have `width` bytes: one reference. */
static bool read_blob(const struct lum_field *f, const cJSON *json, const struct lum_blobs *blobs, size_t width,
                      struct lum_blob *ret_own, struct lum_proto_error *err)
{
    const cJSON *k = cJSON_GetObjectItemCaseSensitive(json, width == 8 ? "blob64" : "blob");
    if (!blobs || !cJSON_IsNumber(k) || json->child->next)
        return wrong(f, err, f->kind == LUM_FIELD_PIXELS ? "base64" : "an array of numbers");
    if (!(k->valuedouble >= 0) || k->valuedouble >= (double)blobs->n || k->valuedouble != floor(k->valuedouble))
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "not_found", f->name, "%s: no such blob", f->name);
    const struct lum_blob *blob = &blobs->blobs[(size_t)k->valuedouble];
    if (blob->n_bytes % width != 0)
        return wrong(f, err, "a blob of whole numbers");
    uint8_t *own = blob->bulk ? lum_bulk_ref(blob->bulk) : lum_bulk_create(blob->n_bytes);
    if (!own)
        return lum_proto_fail_memory(err);
    if (!blob->bulk && blob->n_bytes)
        memcpy(own, blob->bytes, blob->n_bytes);
    *ret_own = (struct lum_blob){own, blob->n_bytes, own};
    return true;
}

static size_t count(const cJSON *array)
{
    size_t n = 0;
    for (const cJSON *c = array->child; c; c = c->next)
        n++;
    return n;
}

static bool read_floats_blob(const struct lum_field *f, struct lum_floats *ret, const cJSON *json,
                             const struct lum_blobs *blobs, struct lum_proto_error *err)
{
    struct lum_blob own;
    bool wide = (f->flags & LUM_FIELD_DOUBLE) && cJSON_HasObjectItem(json, "blob64");
    if (!read_blob(f, json, blobs, wide ? 8 : 4, &own, err))
        return false;
    *ret = wide ? (struct lum_floats){.f64 = own.bulk, .n = own.n_bytes / 8}
                : (struct lum_floats){.f32 = own.bulk, .n = own.n_bytes / 4};
    for (size_t i = 0; i < ret->n; i++) {
        double v = wide ? ret->f64[i] : (double)ret->f32[i];
        if (!(v >= f->min && v <= f->max))
            return wrong_element(f, i, f->min, f->max, err);
    }
    return true;
}

static bool read_floats(const struct lum_field *f, struct lum_floats *ret, const cJSON *json,
                        const struct lum_blobs *blobs, struct lum_proto_error *err)
{
    if (cJSON_IsObject(json))
        return read_floats_blob(f, ret, json, blobs, err);
    if (!cJSON_IsArray(json))
        return wrong(f, err, "an array of numbers");
    size_t n = count(json);
    bool wide = f->flags & LUM_FIELD_DOUBLE;
    double *f64 = wide ? lum_bulk_create(n * sizeof *f64) : NULL;
    float *f32 = wide ? NULL : lum_bulk_create(n * sizeof *f32);
    if (!f64 && !f32)
        return lum_proto_fail_memory(err);
    *ret = (struct lum_floats){.f64 = f64, .f32 = f32, .n = n};
    size_t i = 0;
    for (const cJSON *c = json->child; c; c = c->next, i++) {
        if (!cJSON_IsNumber(c) || !(c->valuedouble >= f->min && c->valuedouble <= f->max))
            return wrong_element(f, i, f->min, f->max, err);
        if (wide)
            f64[i] = c->valuedouble;
        else
            f32[i] = (float)c->valuedouble;
    }
    return true;
}

static bool read_indices(const struct lum_field *f, struct lum_indices *ret, const cJSON *json,
                         const struct lum_blobs *blobs, struct lum_proto_error *err)
{
    const double max = (double)LUM_LIMIT_VERTICES - 1;
    if (cJSON_IsObject(json)) { /* the validator compares every index with the number of vertices */
        struct lum_blob own;
        if (!read_blob(f, json, blobs, 4, &own, err))
            return false;
        *ret = (struct lum_indices){own.bulk, own.n_bytes / 4};
        return true;
    }
    if (!cJSON_IsArray(json))
        return wrong(f, err, "an array of numbers");
    size_t n = count(json), i = 0;
    uint32_t *u32 = lum_bulk_create(n * sizeof *u32);
    if (!u32)
        return lum_proto_fail_memory(err);
    *ret = (struct lum_indices){u32, n};
    for (const cJSON *c = json->child; c; c = c->next, i++) {
        if (!cJSON_IsNumber(c) || !(c->valuedouble >= 0 && c->valuedouble <= max) ||
            c->valuedouble != floor(c->valuedouble))
            return wrong_element(f, i, 0, max, err);
        u32[i] = (uint32_t)c->valuedouble;
    }
    return true;
}

static bool read_pixels(const struct lum_field *f, struct lum_record_image *image, const cJSON *json,
                        const struct lum_blobs *blobs, struct lum_proto_error *err)
{
    if (cJSON_IsObject(json)) {
        struct lum_blob own;
        if (!read_blob(f, json, blobs, 1, &own, err))
            return false;
        image->pixels = own.bulk;
        image->n_bytes = own.n_bytes;
        return true;
    }
    size_t n_bytes;
    if (!cJSON_IsString(json) || !lum_base64_bytes(json->valuestring, &n_bytes))
        return wrong(f, err, "base64");
    image->pixels = lum_bulk_create(n_bytes);
    if (!image->pixels)
        return lum_proto_fail_memory(err);
    image->n_bytes = n_bytes;
    return lum_base64_decode(json->valuestring, image->pixels) || wrong(f, err, "base64");
}

bool lum_field_read_bulk(const struct lum_field *f, void *base, const cJSON *json, const struct lum_blobs *blobs,
                         struct lum_proto_error *err)
{
    void *p = (char *)base + f->offset;
    lum_field_reset(f, base);
    if (f->kind == LUM_FIELD_FLOATS)
        return read_floats(f, p, json, blobs, err);
    if (f->kind == LUM_FIELD_INDICES)
        return read_indices(f, p, json, blobs, err);
    return read_pixels(f, base, json, blobs, err);
}

/* ---- writing ---- */

static cJSON *write_indices(const struct lum_indices *v)
{
    cJSON *array = cJSON_CreateArray();
    for (size_t i = 0; array && i < v->n; i++)
        if (!lum_json_add(array, NULL, cJSON_CreateNumber(v->u32[i]))) {
            cJSON_Delete(array);
            return NULL;
        }
    return array;
}

static cJSON *write_floats(const struct lum_floats *v)
{
    cJSON *array = cJSON_CreateArray();
    for (size_t i = 0; array && i < v->n; i++)
        if (!lum_json_add(array, NULL, cJSON_CreateNumber(v->f64 ? v->f64[i] : (double)v->f32[i]))) {
            cJSON_Delete(array);
            return NULL;
        }
    return array;
}

struct cJSON *lum_field_write_bulk(const struct lum_field *f, const void *base)
{
    const void *p = (const char *)base + f->offset;
    if (f->kind == LUM_FIELD_FLOATS)
        return write_floats(p);
    if (f->kind == LUM_FIELD_INDICES)
        return write_indices(p);
    const struct lum_record_image *image = base;
    char *text = lum_base64_encode(image->pixels, image->n_bytes);
    cJSON *json = text ? cJSON_CreateString(text) : NULL;
    free(text);
    return json;
}

/* Its arrays are blobs, its other fields are not. */
static cJSON *write_web_blobs(const struct lum_record_web *web, struct lum_blobs_out *out)
{
    cJSON *o = cJSON_CreateObject();
    bool ok = o != NULL;
    for (size_t i = 0; i < lum_web_fields.n && ok; i++) {
        const struct lum_field *part = &lum_web_fields.fields[i];
        if (!lum_field_is_null(part, web))
            ok = lum_json_add(o, part->name,
                              lum_field_is_bulk(part) ? lum_field_write_blob(part, web, out)
                                                      : lum_field_write(part, web));
    }
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

struct cJSON *lum_field_write_blob(const struct lum_field *f, const void *base, struct lum_blobs_out *out)
{
    const void *p = (const char *)base + f->offset;
    if (f->kind == LUM_FIELD_WEB)
        return write_web_blobs(*(struct lum_record_web *const *)p, out);
    const struct lum_floats *floats = p;
    const struct lum_record_image *image = base;
    bool wide = f->kind == LUM_FIELD_FLOATS && floats->f64;
    struct lum_blob blob = {image->pixels, image->n_bytes, NULL};
    if (f->kind == LUM_FIELD_FLOATS)
        blob = wide ? (struct lum_blob){(const uint8_t *)floats->f64, 8 * floats->n, NULL}
                    : (struct lum_blob){(const uint8_t *)floats->f32, 4 * floats->n, NULL};
    else if (f->kind == LUM_FIELD_INDICES)
        blob = (struct lum_blob){(const uint8_t *)((const struct lum_indices *)p)->u32,
                                 4 * ((const struct lum_indices *)p)->n, NULL};
    cJSON *json = cJSON_CreateObject();
    if (out->n < LUM_BLOBS_MAX && lum_json_add_number(json, wide ? "blob64" : "blob", (double)out->n)) {
        out->blobs[out->n++] = blob;
        return json;
    }
    cJSON_Delete(json);
    return NULL;
}
