#include "protocol/record/record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json/json.h"
#include "protocol/record/field.h"

struct lum_record *lum_record_create(enum lum_record_type type, const char *id)
{
    struct lum_record *r = calloc(1, sizeof *r);
    if (!r)
        return NULL;
    atomic_init(&r->refs, 1u);
    r->type = type;
    size_t n = strlen(id);
    memcpy(r->id, id, n < LUM_LIMIT_ID_BYTES ? n : LUM_LIMIT_ID_BYTES);
    const struct lum_fields *t = lum_fields_of(type);
    for (size_t i = 0; i < t->n; i++)
        lum_field_reset(&t->fields[i], lum_record_body(r));
    return r;
}

struct lum_record *lum_record_ref(struct lum_record *r)
{
    atomic_fetch_add_explicit(&r->refs, 1u, memory_order_relaxed);
    return r;
}

static void free_bulk(struct lum_record *r)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    for (size_t i = 0; i < t->n; i++)
        if (lum_field_is_bulk(&t->fields[i]))
            lum_field_reset(&t->fields[i], lum_record_body(r));
    if (r->type != LUM_RECORD_IMPORT || !lum_bulk_leave(r->import.made))
        return;
    for (size_t i = 0; i < r->import.n_made; i++)
        lum_record_unref(r->import.made[i]); /* one level: an import never makes imports */
    lum_bulk_free(r->import.made);
}

void lum_record_unref(struct lum_record *r)
{
    if (!r || atomic_fetch_sub_explicit(&r->refs, 1u, memory_order_acq_rel) != 1u)
        return;
    free_bulk(r);
    free(r);
}

struct lum_record *lum_record_clone(const struct lum_record *r)
{
    struct lum_record *c = lum_record_create(r->type, r->id);
    if (!c)
        return NULL;
    memcpy(c->origin, r->origin, sizeof c->origin);
    const struct lum_fields *t = lum_fields_of(r->type);
    for (size_t i = 0; i < t->n; i++)
        lum_field_copy(&t->fields[i], lum_record_body(c), lum_record_body(r));
    if (r->type == LUM_RECORD_IMPORT) {
        c->import.made = lum_bulk_ref(r->import.made);
        c->import.n_made = r->import.n_made;
    }
    return c;
}

/* ---- size ---- */

_Static_assert(sizeof(struct lum_record) <= LUM_RECORD_BYTES, "LUM_RECORD_BYTES is what a record takes");

static size_t field_bytes(const struct lum_field *f, const void *base)
{
    const void *p = (const char *)base + f->offset;
    switch (f->kind) {
    case LUM_FIELD_FLOATS:
        return lum_bulk_bytes(((const struct lum_floats *)p)->f64) +
               lum_bulk_bytes(((const struct lum_floats *)p)->f32);
    case LUM_FIELD_INDICES:
        return lum_bulk_bytes(((const struct lum_indices *)p)->u32);
    case LUM_FIELD_PIXELS:
        return lum_bulk_bytes(((const struct lum_record_image *)base)->pixels);
    case LUM_FIELD_WEB:
        return lum_record_web_bytes(*(struct lum_record_web *const *)p);
    case LUM_FIELD_LAMPS:
        return lum_bulk_bytes(((const struct lum_lamps *)p)->items);
    default:
        return 0;
    }
}

size_t lum_record_bytes(const struct lum_record *r)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    size_t n = LUM_RECORD_BYTES;
    for (size_t i = 0; i < t->n; i++)
        n += field_bytes(&t->fields[i], lum_record_body(r));
    return r->type == LUM_RECORD_IMPORT ? n + lum_bulk_bytes(r->import.made) : n;
}

/* ---- references ---- */

static bool ref_field(const struct lum_field *f, const void *base, const char *path, lum_ref_fn fn, void *user)
{
    const char *id = (const char *)base + f->offset;
    return id[0] == '\0' || fn(user, f->ref, id, path);
}

bool lum_record_each_ref(const struct lum_record *r, lum_ref_fn fn, void *user)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    const char *base = lum_record_body(r);
    for (size_t i = 0; i < t->n; i++) {
        const struct lum_field *f = &t->fields[i];
        if (f->kind == LUM_FIELD_REF && !ref_field(f, base, f->name, fn, user))
            return false;
        if (f->kind == LUM_FIELD_TEXTURE &&
            !ref_field(&lum_texture_fields.fields[0], base + f->offset, f->name, fn, user))
            return false;
    }
    return true;
}

/* ---- transforms ---- */

void lum_record_transform_affine(const struct lum_record_transform *t, double ret_m[3][4])
{
    if (t->is_matrix) {
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 4; j++)
                ret_m[i][j] = t->matrix[4 * i + j];
        return;
    }
    /* R = Rz Ry Rx, so that the turn about X is applied first */
    double c[3], s[3];
    for (int i = 0; i < 3; i++) {
        double a = t->rotate_deg[i] * (3.14159265358979323846 / 180.0);
        c[i] = cos(a);
        s[i] = sin(a);
    }
    const double r[3][3] = {
        {c[1] * c[2], s[0] * s[1] * c[2] - c[0] * s[2], c[0] * s[1] * c[2] + s[0] * s[2]},
        {c[1] * s[2], s[0] * s[1] * s[2] + c[0] * c[2], c[0] * s[1] * s[2] - s[0] * c[2]},
        {-s[1], s[0] * c[1], c[0] * c[1]},
    };
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            ret_m[i][j] = r[i][j] * t->scale[j];
        ret_m[i][3] = t->translate[i];
    }
}
