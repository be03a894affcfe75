#include "protocol/document/import_transform.h"

#include <math.h>
#include <string.h>

#include "protocol/record/aim.h"
#include "protocol/record/field.h"

/* Row-major 3x4: points are columns. */
struct map {
    double m[3][4];
};

static double determinant(const struct map *a)
{
    const double(*m)[4] = a->m;
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

static void map_vector(const struct map *a, double v[3])
{
    double r[3];
    for (int i = 0; i < 3; i++)
        r[i] = a->m[i][0] * v[0] + a->m[i][1] * v[1] + a->m[i][2] * v[2];
    memcpy(v, r, sizeof r);
}

static void map_point(const struct map *a, double p[3])
{
    map_vector(a, p);
    for (int i = 0; i < 3; i++)
        p[i] += a->m[i][3];
}

static struct map multiply(const struct map *a, const struct map *b)
{
    struct map r;
    for (int j = 0; j < 4; j++) {
        double column[3] = {b->m[0][j], b->m[1][j], b->m[2][j]};
        if (j < 3)
            map_vector(a, column);
        else
            map_point(a, column);
        for (int i = 0; i < 3; i++)
            r.m[i][j] = column[i];
    }
    return r;
}

/* By cofactors. The transform of a record is invertible: its validator saw to it. */
static struct map inverse(const struct map *a)
{
    struct map r;
    double s = 1.0 / determinant(a), back[3] = {a->m[0][3], a->m[1][3], a->m[2][3]};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int p = (j + 1) % 3, q = (j + 2) % 3, k = (i + 1) % 3, l = (i + 2) % 3;
            r.m[i][j] = s * (a->m[p][k] * a->m[q][l] - a->m[p][l] * a->m[q][k]);
        }
    map_vector(&r, back);
    for (int i = 0; i < 3; i++)
        r.m[i][3] = -back[i];
    return r;
}

static bool has_transform(const struct lum_record *r)
{
    return r->type == LUM_RECORD_OBJECT || r->type == LUM_RECORD_LIGHT || r->type == LUM_RECORD_CAMERA ||
           r->type == LUM_RECORD_SENSOR || r->type == LUM_RECORD_MEDIUM;
}

static void map_transform(const struct map *a, struct lum_record_transform *t)
{
    static const double last[4] = {0, 0, 0, 1};
    struct map local;
    lum_record_transform_affine(t, local.m);
    struct map world = multiply(a, &local);
    t->is_matrix = true;
    memcpy(t->matrix, world.m, sizeof world.m);
    memcpy(t->matrix + 12, last, sizeof last);
}

/* A map that mirrors turns a lamp's web, but cannot mirror it. */
static void map_aim(const struct map *a, struct lum_record_light *l)
{
    double c0[3];
    bool rolls = strcmp(l->kind, "ies") == 0;
    if (rolls)
        lum_aim_c0(l->direction, l->roll_deg, c0);
    map_vector(a, l->direction);
    if (!rolls)
        return;
    map_vector(a, c0);
    l->roll_deg = lum_aim_roll_deg(l->direction, c0);
}

static void map_sensor(const struct map *a, struct lum_record_sensor *s)
{
    map_point(a, s->position);
    map_vector(a, s->u);
    map_vector(a, s->v);
    map_vector(a, s->normal);
    map_vector(a, s->direction);
}

/* The box around it where it is then: boxes of fog stand upright. */
static void map_box(const struct map *a, struct lum_record_box *box)
{
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int corner = 0; corner < 8 && box->set; corner++) {
        double p[3];
        for (int i = 0; i < 3; i++)
            p[i] = corner >> i & 1 ? box->max[i] : box->min[i];
        map_point(a, p);
        for (int i = 0; i < 3; i++) {
            lo[i] = fmin(lo[i], p[i]);
            hi[i] = fmax(hi[i], p[i]);
        }
    }
    memcpy(box->min, lo, sizeof lo);
    memcpy(box->max, hi, sizeof hi);
}

static void map_record(const struct map *a, struct lum_record *r)
{
    switch (r->type) {
    case LUM_RECORD_OBJECT:
        map_transform(a, &r->object.transform);
        break;
    case LUM_RECORD_LIGHT: /* candela, lux and luminance stay: a lamp in a model that is scaled is the same lamp */
        map_point(a, r->light.position);
        map_aim(a, &r->light);
        map_vector(a, r->light.u);
        map_vector(a, r->light.v);
        r->light.radius *= cbrt(fabs(determinant(a))); /* the length by which the map scales on average */
        break;
    case LUM_RECORD_CAMERA:
        map_point(a, r->camera.position);
        map_point(a, r->camera.target);
        map_vector(a, r->camera.up);
        break;
    case LUM_RECORD_SENSOR:
        map_sensor(a, &r->sensor);
        break;
    case LUM_RECORD_MEDIUM:
        if (r->medium.box.set)
            map_box(a, &r->medium.box);
        break;
    default:
        break;
    }
}

/* ---- limits ---- */

static bool numbers_in_range(const double *v, size_t n, double min, double max)
{
    for (size_t i = 0; i < n; i++)
        if (!(v[i] >= min && v[i] <= max))
            return false;
    return true;
}

static bool field_in_range(const struct lum_field *f, const void *base)
{
    const void *p = (const char *)base + f->offset;
    switch (f->kind) {
    case LUM_FIELD_NUMBER:
        return numbers_in_range(p, 1, f->min, f->max);
    case LUM_FIELD_VECTOR:
        return numbers_in_range(p, f->n, f->min, f->max);
    case LUM_FIELD_TRANSFORM: {
        const struct lum_record_transform *t = p;
        return !t->is_matrix || numbers_in_range(t->matrix, 16, -LUM_LIMIT_COORD_M, LUM_LIMIT_COORD_M);
    }
    default:
        return true;
    }
}

/* What is transformed must be what a client could have set, or the ops of the scene would not read back. */
static bool check_fits(const struct lum_record *r, struct lum_proto_error *err)
{
    const struct lum_fields *t = lum_fields_of(r->type);
    bool ok = true;
    for (size_t i = 0; i < t->n && ok; i++)
        ok = field_in_range(&t->fields[i], lum_record_body(r));
    struct lum_proto_error why;
    return (ok && lum_record_validate(r, &why)) ||
           lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "transform",
                          "transform puts \"%s\" out of the limits of its fields", r->id);
}

static struct lum_record *mapped(const struct map *a, const struct lum_record *r, struct lum_proto_error *err)
{
    struct lum_record *placed = lum_record_clone(r);
    if (!placed) {
        lum_proto_fail_memory(err);
        return NULL;
    }
    map_record(a, placed);
    return placed;
}

static struct lum_record *checked(struct lum_record *placed, struct lum_proto_error *err)
{
    if (!placed || check_fits(placed, err))
        return placed;
    lum_record_unref(placed);
    return NULL;
}

struct lum_record *lum_import_apply_transform(const struct lum_record_transform *to, struct lum_record *local,
                                              struct lum_proto_error *err)
{
    if (!has_transform(local))
        return lum_record_ref(local);
    struct map map;
    lum_record_transform_affine(to, map.m);
    return checked(mapped(&map, local, err), err);
}

/* The fields that are the same in `now` and `before` become those of `after`. */
static void follow(struct lum_record *moved, const struct lum_record *now, const struct lum_record *before,
                   const struct lum_record *after)
{
    const struct lum_fields *t = lum_fields_of(now->type);
    for (size_t i = 0; i < t->n; i++)
        if (lum_field_equal(&t->fields[i], lum_record_body(now), lum_record_body(before))) {
            lum_field_reset(&t->fields[i], lum_record_body(moved));
            lum_field_copy(&t->fields[i], lum_record_body(moved), lum_record_body(after));
        }
}

struct lum_record *lum_import_reapply_transform(const struct lum_import_move *move, struct lum_record *local,
                                                struct lum_record *now, struct lum_proto_error *err)
{
    if (!has_transform(local))
        return lum_record_ref(now);
    struct map from, to;
    lum_record_transform_affine(move->from, from.m);
    lum_record_transform_affine(move->to, to.m);
    struct map back = inverse(&from), step = multiply(&to, &back);
    struct lum_record *before = mapped(&from, local, err), *after = mapped(&to, local, err);
    struct lum_record *moved = mapped(&step, now, err);
    bool ok = before && after && moved;
    if (ok)
        follow(moved, now, before, after);
    lum_record_unref(before);
    lum_record_unref(after);
    if (ok)
        return checked(moved, err);
    lum_record_unref(moved);
    return NULL;
}
