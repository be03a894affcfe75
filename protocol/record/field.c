/* Values without JSON: defaults, comparison, copies. */
#include "protocol/record/field.h"

#include <string.h>

static void *at(const struct lum_field *f, void *base)
{
    return (char *)base + f->offset;
}

static const void *at_const(const struct lum_field *f, const void *base)
{
    return (const char *)base + f->offset;
}

bool lum_field_is_bulk(const struct lum_field *f)
{
    return f->kind == LUM_FIELD_FLOATS || f->kind == LUM_FIELD_INDICES || f->kind == LUM_FIELD_PIXELS ||
           f->kind == LUM_FIELD_WEB || f->kind == LUM_FIELD_LAMPS;
}

bool lum_field_is_long(const struct lum_field *f)
{
    return lum_field_is_bulk(f) && f->kind != LUM_FIELD_LAMPS;
}

/* Bytes of a field that owns nothing and has no parts; 0 otherwise. */
static size_t plain_size(const struct lum_field *f)
{
    switch (f->kind) {
    case LUM_FIELD_NUMBER:
    case LUM_FIELD_INTEGER:
        return sizeof(double);
    case LUM_FIELD_U32:
        return sizeof(uint32_t);
    case LUM_FIELD_OPT:
        return sizeof(struct lum_opt);
    case LUM_FIELD_BOOL:
        return sizeof(bool);
    case LUM_FIELD_VECTOR:
        return f->n * sizeof(double);
    case LUM_FIELD_CHOICE:
    case LUM_FIELD_NAME:
    case LUM_FIELD_TEXT:
    case LUM_FIELD_ASSET:
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
    case LUM_FIELD_PARTS:
        return f->n;
    case LUM_FIELD_TEXTURE:
        return sizeof(struct lum_record_texture);
    case LUM_FIELD_TRANSFORM:
        return sizeof(struct lum_record_transform);
    case LUM_FIELD_BOX:
        return sizeof(struct lum_record_box);
    case LUM_FIELD_FLOATS:
    case LUM_FIELD_INDICES:
    case LUM_FIELD_PIXELS:
    case LUM_FIELD_WEB:
    case LUM_FIELD_LAMPS:
        break;
    }
    return 0;
}

bool lum_field_is_null(const struct lum_field *f, const void *base)
{
    const void *p = at_const(f, base);
    switch (f->kind) {
    case LUM_FIELD_VECTOR:
        for (unsigned k = 0; k < f->n; k++)
            if (((const double *)p)[k] != 0.0)
                return false;
        return f->flags & LUM_FIELD_NULLABLE;
    case LUM_FIELD_OPT:
        return !((const struct lum_opt *)p)->set;
    case LUM_FIELD_TEXT:
    case LUM_FIELD_ASSET:
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
        return *(const char *)p == '\0';
    case LUM_FIELD_TEXTURE:
        return ((const struct lum_record_texture *)p)->image[0] == '\0';
    case LUM_FIELD_BOX:
        return !((const struct lum_record_box *)p)->set;
    case LUM_FIELD_FLOATS:
        return ((const struct lum_floats *)p)->n == 0;
    case LUM_FIELD_INDICES:
        return ((const struct lum_indices *)p)->n == 0;
    case LUM_FIELD_PIXELS:
        return ((const struct lum_record_image *)base)->n_bytes == 0;
    case LUM_FIELD_WEB:
        return *(struct lum_record_web *const *)p == NULL;
    case LUM_FIELD_LAMPS:
        return ((const struct lum_lamps *)p)->n == 0;
    default:
        return false;
    }
}

/* ---- defaults ---- */

static void reset_bulk(const struct lum_field *f, void *base)
{
    if (f->kind == LUM_FIELD_FLOATS) {
        struct lum_floats *v = at(f, base);
        lum_bulk_unref(v->f64);
        lum_bulk_unref(v->f32);
        *v = (struct lum_floats){0};
    } else if (f->kind == LUM_FIELD_INDICES) {
        struct lum_indices *v = at(f, base);
        lum_bulk_unref(v->u32);
        *v = (struct lum_indices){0};
    } else if (f->kind == LUM_FIELD_WEB) {
        struct lum_record_web **web = at(f, base);
        lum_record_web_unref(*web);
        *web = NULL;
    } else if (f->kind == LUM_FIELD_LAMPS) {
        struct lum_lamps *lamps = at(f, base);
        lum_bulk_unref(lamps->items);
        *lamps = (struct lum_lamps){0};
    } else {
        struct lum_record_image *image = base;
        lum_bulk_unref(image->pixels);
        image->pixels = NULL;
        image->n_bytes = 0;
    }
}

void lum_field_reset(const struct lum_field *f, void *base)
{
    void *p = at(f, base);
    if (lum_field_is_bulk(f)) {
        reset_bulk(f, base);
        return;
    }
    memset(p, 0, plain_size(f));
    const struct lum_fields *parts = lum_field_parts(f);
    for (size_t i = 0; parts && i < parts->n; i++)
        lum_field_reset(&parts->fields[i], p);
    if (f->kind == LUM_FIELD_NUMBER || f->kind == LUM_FIELD_INTEGER)
        *(double *)p = f->def[0];
    else if (f->kind == LUM_FIELD_U32)
        *(uint32_t *)p = (uint32_t)f->def[0];
    else if (f->kind == LUM_FIELD_BOOL)
        *(bool *)p = f->def[0] != 0.0;
    else if (f->kind == LUM_FIELD_VECTOR)
        for (unsigned i = 0; i < f->n; i++)
            ((double *)p)[i] = f->def[i < 3 ? i : 2];
    else if (f->kind == LUM_FIELD_CHOICE)
        memcpy(p, f->text, strcspn(f->text, "|"));
    else if (f->kind == LUM_FIELD_NAME)
        memcpy(p, f->text, strlen(f->text));
}

/* ---- comparison ---- */

static double float_at(const struct lum_floats *v, size_t i)
{
    return v->f64 ? v->f64[i] : (double)v->f32[i];
}

static bool floats_equal(const struct lum_floats *a, const struct lum_floats *b)
{
    if (a->n != b->n)
        return false;
    if (a->f64 == b->f64 && a->f32 == b->f32)
        return true;
    for (size_t i = 0; i < a->n; i++)
        if (float_at(a, i) != float_at(b, i))
            return false;
    return true;
}

static bool bytes_equal(const void *a, size_t n_a, const void *b, size_t n_b)
{
    return n_a == n_b && (n_a == 0 || a == b || memcmp(a, b, n_a) == 0);
}

static bool doubles_equal(const double *a, const double *b, unsigned n)
{
    for (unsigned i = 0; i < n; i++)
        if (a[i] != b[i])
            return false;
    return true;
}

static bool parts_equal(const struct lum_fields *parts, const void *a, const void *b)
{
    for (size_t i = 0; i < parts->n; i++)
        if (!lum_field_equal(&parts->fields[i], a, b))
            return false;
    return true;
}

static bool transform_equal(const struct lum_record_transform *a, const struct lum_record_transform *b)
{
    if (a->is_matrix != b->is_matrix)
        return false;
    return a->is_matrix ? doubles_equal(a->matrix, b->matrix, 16) : parts_equal(&lum_transform_fields, a, b);
}

bool lum_field_equal(const struct lum_field *f, const void *a, const void *b)
{
    const void *p = at_const(f, a), *q = at_const(f, b);
    if (lum_field_is_null(f, a) || lum_field_is_null(f, b))
        return lum_field_is_null(f, a) && lum_field_is_null(f, b);
    switch (f->kind) {
    case LUM_FIELD_NUMBER:
    case LUM_FIELD_INTEGER:
        return doubles_equal(p, q, 1);
    case LUM_FIELD_VECTOR:
        return doubles_equal(p, q, f->n);
    case LUM_FIELD_OPT:
        return ((const struct lum_opt *)p)->value == ((const struct lum_opt *)q)->value;
    case LUM_FIELD_U32:
        return *(const uint32_t *)p == *(const uint32_t *)q;
    case LUM_FIELD_BOOL:
        return *(const bool *)p == *(const bool *)q;
    case LUM_FIELD_CHOICE:
    case LUM_FIELD_NAME:
    case LUM_FIELD_TEXT:
    case LUM_FIELD_ASSET:
    case LUM_FIELD_ID:
    case LUM_FIELD_REF:
        return strcmp(p, q) == 0;
    case LUM_FIELD_FLOATS:
        return floats_equal(p, q);
    case LUM_FIELD_INDICES: {
        const struct lum_indices *v = p, *w = q;
        return bytes_equal(v->u32, v->n * sizeof *v->u32, w->u32, w->n * sizeof *w->u32);
    }
    case LUM_FIELD_PIXELS: {
        const struct lum_record_image *v = a, *w = b;
        return bytes_equal(v->pixels, v->n_bytes, w->pixels, w->n_bytes);
    }
    case LUM_FIELD_WEB:
        return lum_record_web_equal(*(struct lum_record_web *const *)p, *(struct lum_record_web *const *)q);
    case LUM_FIELD_LAMPS:
        return lum_lamps_equal(p, q);
    case LUM_FIELD_TRANSFORM:
        return transform_equal(p, q);
    case LUM_FIELD_TEXTURE:
    case LUM_FIELD_BOX:
    case LUM_FIELD_PARTS:
        return parts_equal(lum_field_parts(f), p, q);
    }
    return false;
}

/* ---- copies ---- */

void lum_field_copy(const struct lum_field *f, void *to, const void *from)
{
    if (!lum_field_is_bulk(f)) {
        memcpy(at(f, to), at_const(f, from), plain_size(f));
    } else if (f->kind == LUM_FIELD_FLOATS) {
        const struct lum_floats *v = at_const(f, from);
        *(struct lum_floats *)at(f, to) = (struct lum_floats){lum_bulk_ref(v->f64), lum_bulk_ref(v->f32), v->n};
    } else if (f->kind == LUM_FIELD_INDICES) {
        const struct lum_indices *v = at_const(f, from);
        *(struct lum_indices *)at(f, to) = (struct lum_indices){lum_bulk_ref(v->u32), v->n};
    } else if (f->kind == LUM_FIELD_WEB) {
        struct lum_record_web *const *web = at_const(f, from);
        *(struct lum_record_web **)at(f, to) = *web ? lum_record_web_ref(*web) : NULL;
    } else if (f->kind == LUM_FIELD_LAMPS) {
        const struct lum_lamps *v = at_const(f, from);
        *(struct lum_lamps *)at(f, to) = (struct lum_lamps){lum_bulk_ref(v->items), v->n};
    } else {
        const struct lum_record_image *v = from;
        struct lum_record_image *image = to;
        image->pixels = lum_bulk_ref(v->pixels);
        image->n_bytes = v->n_bytes;
    }
}
