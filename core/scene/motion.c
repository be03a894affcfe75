/* Both snapshots have their objects in the order of their ids, and their emitter shapes in that of their lights' ids:
 * one walk along both finds what is in only one of them, and what differs. A mesh is immutable once it is in a
 * snapshot: a pose of a mesh that deforms is a struct lum_mesh of its own (only Embree's part of an older pose is used
 * again, when no snapshot holds it any more), so that equal pointers mean equal contents, and the box before is still
 * known. */
#include "core/scene/motion.h"

#include <string.h>

#include "core/accel/trace.h"
#include "core/math/sampler.h"
#include "core/scene/parts.h"

/* Objects are numbered as in struct lum_hits: instances, then emitter shapes. */
static const struct lum_accel_shape *shape_of(const struct lum_snapshot *s, uint32_t object)
{
    return &s->parts->lights->shapes[object - s->n_instances];
}

static const char *object_id(const struct lum_snapshot *s, uint32_t object)
{
    if (object < s->n_instances)
        return s->instances[object].id;
    return s->lights.lights[s->parts->lights->shape_lights[object - s->n_instances]].id;
}

static struct lum_bounds object_box(const struct lum_snapshot *s, uint32_t object)
{
    struct lum_bounds b =
        object < s->n_instances ? lum_instance_bounds(&s->instances[object]) : lum_shape_bounds(shape_of(s, object));
    const float pad = 2.0f * LUM_RAY_OFFSET;
    b.lo = lum_v3_sub(b.lo, lum_v3(pad, pad, pad));
    b.hi = lum_v3_add(b.hi, lum_v3(pad, pad, pad));
    return b;
}

static bool same_shape(const struct lum_accel_shape *a, const struct lum_accel_shape *b)
{
    return a->row == b->row && memcmp(&a->p, &b->p, sizeof a->p) == 0 && memcmp(&a->u, &b->u, sizeof a->u) == 0 &&
           memcmp(&a->v, &b->v, sizeof a->v) == 0 && memcmp(&a->n, &b->n, sizeof a->n) == 0 && a->radius == b->radius;
}

/* Object i of one snapshot blocks the same rays as object j of the other, of the same id. */
static bool same_object(const struct lum_snapshot *a, uint32_t i, const struct lum_snapshot *b, uint32_t j)
{
    if (i >= a->n_instances)
        return same_shape(shape_of(a, i), shape_of(b, j));
    const struct lum_instance *x = &a->instances[i], *y = &b->instances[j];
    return x->mesh == y->mesh && memcmp(&x->local_to_scene, &y->local_to_scene, sizeof x->local_to_scene) == 0 &&
           lum_material_passes_same(&a->materials[x->material], &b->materials[y->material]);
}

/* Half the surface: segments that cross the scene at random meet the box in proportion. */
static float area_of(const struct lum_bounds *b)
{
    struct lum_vec3 d = lum_v3_sub(b->hi, b->lo);
    return lum_bounds_empty(b) ? 0.0f : d.x * d.y + d.y * d.z + d.z * d.x;
}

/* Two movers as one. */
static struct lum_mover merged(const struct lum_mover *a, const struct lum_mover *b)
{
    return (struct lum_mover){
        .n_objects = a->n_objects + b->n_objects,
        .before = LUM_NO_OBJECT,
        .now = LUM_NO_OBJECT,
        .old_box = lum_bounds_join(&a->old_box, &b->old_box),
        .new_box = lum_bounds_join(&a->new_box, &b->new_box),
    };
}

static float area_of_both(const struct lum_mover *m)
{
    return area_of(&m->old_box) + area_of(&m->new_box);
}

static void enclose(struct lum_bounds *around, const struct lum_mover *m)
{
    *around = lum_bounds_join(around, &m->old_box);
    *around = lum_bounds_join(around, &m->new_box);
}

void lum_motion_enclose(struct lum_motion *motion)
{
    motion->around = LUM_BOUNDS_EMPTY;
    for (uint32_t i = 0; i < motion->n; i++)
        enclose(&motion->around, &motion->movers[i]);
}

void lum_motion_add(struct lum_motion *motion, const struct lum_mover *mover)
{
    enclose(&motion->around, mover);
    if (motion->n < LUM_MOTION_MAX) {
        motion->movers[motion->n++] = *mover;
        return;
    }
    uint32_t best = 0;
    float least = INFINITY;
    for (uint32_t i = 0; i < motion->n; i++) {
        struct lum_mover both = merged(&motion->movers[i], mover);
        float growth = area_of_both(&both) - area_of_both(&motion->movers[i]);
        if (growth < least) {
            least = growth;
            best = i;
        }
    }
    motion->movers[best] = merged(&motion->movers[best], mover);
}

bool lum_motion_is_merged(const struct lum_motion *motion)
{
    for (uint32_t i = 0; i < motion->n; i++)
        if (motion->movers[i].n_objects > 1)
            return true;
    return false;
}

static void add_object(struct lum_motion *motion, const struct lum_snapshot *before, uint32_t i,
                       const struct lum_snapshot *now, uint32_t j)
{
    motion->renumbers |= i == LUM_NO_OBJECT || j == LUM_NO_OBJECT;
    lum_motion_add(motion, &(struct lum_mover){
                               .n_objects = 1,
                               .object = lum_hash64_text(i == LUM_NO_OBJECT ? object_id(now, j) : object_id(before, i)),
                               .before = i,
                               .now = j,
                               .old_box = i == LUM_NO_OBJECT ? LUM_BOUNDS_EMPTY : object_box(before, i),
                               .new_box = j == LUM_NO_OBJECT ? LUM_BOUNDS_EMPTY : object_box(now, j),
                           });
}

struct range {
    uint32_t at, end;
};

static void walk(struct lum_motion *motion, const struct lum_snapshot *before, struct range a,
                 const struct lum_snapshot *now, struct range b)
{
    while (a.at < a.end || b.at < b.end) {
        int order = a.at == a.end ? 1 : b.at == b.end ? -1 : strcmp(object_id(before, a.at), object_id(now, b.at));
        uint32_t i = order <= 0 ? a.at++ : LUM_NO_OBJECT, j = order >= 0 ? b.at++ : LUM_NO_OBJECT;
        if (order != 0 || !same_object(before, i, now, j))
            add_object(motion, before, i, now, j);
    }
}

static uint32_t object_end(const struct lum_snapshot *s)
{
    return s->n_instances + s->parts->lights->n_shapes;
}

void lum_motion_between(const struct lum_snapshot *before, const struct lum_snapshot *now,
                        struct lum_motion *ret_motion)
{
    ret_motion->n = 0;
    ret_motion->renumbers = false;
    ret_motion->around = LUM_BOUNDS_EMPTY;
    ret_motion->everything = !lum_normalisation_equal(&before->norm, &now->norm);
    if (ret_motion->everything)
        return;
    const struct lum_snapshot_parts *a = before->parts, *b = now->parts;
    if (a->instances != b->instances || a->materials != b->materials)
        walk(ret_motion, before, (struct range){0, before->n_instances}, now, (struct range){0, now->n_instances});
    if (a->lights != b->lights)
        walk(ret_motion, before, (struct range){before->n_instances, object_end(before)}, now,
             (struct range){now->n_instances, object_end(now)});
}

bool lum_motion_has(const struct lum_motion *motion, uint64_t object)
{
    for (uint32_t i = 0; i < motion->n; i++)
        if (motion->movers[i].n_objects == 1 && motion->movers[i].object == object)
            return true;
    return motion->everything;
}

bool lum_motion_moves(const struct lum_motion *motion, uint32_t object, const struct lum_bounds *box)
{
    for (uint32_t i = 0; i < motion->n; i++) {
        const struct lum_mover *m = &motion->movers[i];
        bool within = lum_bounds_hold(&m->new_box, box->lo) && lum_bounds_hold(&m->new_box, box->hi);
        if (m->n_objects > 1 ? within : m->now == object)
            return true;
    }
    return motion->everything;
}

bool lum_motion_carries(const struct lum_motion *motion, uint64_t object, struct lum_vec3 p)
{
    for (uint32_t i = 0; i < motion->n; i++) {
        const struct lum_mover *m = &motion->movers[i];
        if (m->n_objects > 1 && lum_bounds_hold(&m->old_box, p))
            return true;
    }
    return lum_motion_has(motion, object);
}

/* Separating axes (Gottschalk 1996): the box's own three, and those across the segment and an edge. No division; what
 * is rounded is far below the padding of the boxes. mid, half: of the segment. */
static bool segment_meets(struct lum_vec3 mid, struct lum_vec3 half, const struct lum_bounds *b)
{
    if (lum_bounds_empty(b))
        return false;
    struct lum_vec3 c = lum_v3_sub(mid, lum_v3_mul(lum_v3_add(b->lo, b->hi), 0.5f));
    struct lum_vec3 e = lum_v3_mul(lum_v3_sub(b->hi, b->lo), 0.5f), d = lum_v3_abs(half);
    return fabsf(c.x) <= e.x + d.x && fabsf(c.y) <= e.y + d.y && fabsf(c.z) <= e.z + d.z &&
           fabsf(c.y * half.z - c.z * half.y) <= e.y * d.z + e.z * d.y &&
           fabsf(c.z * half.x - c.x * half.z) <= e.z * d.x + e.x * d.z &&
           fabsf(c.x * half.y - c.y * half.x) <= e.x * d.y + e.y * d.x;
}

bool lum_motion_meets(const struct lum_motion *motion, struct lum_vec3 a, struct lum_vec3 b)
{
    struct lum_vec3 mid = lum_v3_mul(lum_v3_add(a, b), 0.5f), half = lum_v3_mul(lum_v3_sub(b, a), 0.5f);
    if (!segment_meets(mid, half, &motion->around)) /* as of most */
        return motion->everything;
    for (uint32_t i = 0; i < motion->n; i++) {
        const struct lum_mover *m = &motion->movers[i];
        if (segment_meets(mid, half, &m->old_box) || segment_meets(mid, half, &m->new_box))
            return true;
    }
    return motion->everything;
}

bool lum_motion_met(const struct lum_motion *motion, struct lum_vec3 a, struct lum_vec3 b)
{
    struct lum_vec3 mid = lum_v3_mul(lum_v3_add(a, b), 0.5f), half = lum_v3_mul(lum_v3_sub(b, a), 0.5f);
    for (uint32_t i = 0; i < motion->n; i++)
        if (segment_meets(mid, half, &motion->movers[i].old_box))
            return true;
    return motion->everything;
}

/* Where the segments have come a share t of their way, they are in the box between both, which is linear in t: so is
 * each of the six conditions that it overlaps `box`. True when some t of [0, 1] meets all of them. */
static bool shaft_meets(const struct lum_bounds *a, const struct lum_bounds *b, const struct lum_bounds *box)
{
    if (lum_bounds_empty(box))
        return false;
    struct lum_vec3 lo = box->lo, hi = box->hi;
    /* at least 0 where the condition holds: at t = 0 and at t = 1 */
    const float at0[6] = {hi.x - a->lo.x, hi.y - a->lo.y, hi.z - a->lo.z,
                          a->hi.x - lo.x, a->hi.y - lo.y, a->hi.z - lo.z};
    const float at1[6] = {hi.x - b->lo.x, hi.y - b->lo.y, hi.z - b->lo.z,
                          b->hi.x - lo.x, b->hi.y - lo.y, b->hi.z - lo.z};
    float first = 0.0f, last = 1.0f;
    for (int i = 0; i < 6; i++) {
        if (at0[i] < 0.0f && at1[i] < 0.0f)
            return false;
        if (at0[i] < 0.0f)
            first = lum_max(first, at0[i] / (at0[i] - at1[i]));
        else if (at1[i] < 0.0f)
            last = lum_min(last, at0[i] / (at0[i] - at1[i]));
    }
    return first <= last;
}

bool lum_motion_meets_between(const struct lum_motion *motion, const struct lum_bounds *a, const struct lum_bounds *b)
{
    if (!shaft_meets(a, b, &motion->around))
        return motion->everything;
    for (uint32_t i = 0; i < motion->n; i++) {
        const struct lum_mover *m = &motion->movers[i];
        if (shaft_meets(a, b, &m->old_box) || shaft_meets(a, b, &m->new_box))
            return true;
    }
    return motion->everything;
}

bool lum_motion_keeps_numbers(const struct lum_motion *motion)
{
    return !motion->renumbers && !motion->everything;
}

/* Coordinates of a scene are at most that; twice, for what is rounded at LUM_FAR. */
#define EXTENT 0x1p8f

static struct lum_bounds around(struct lum_vec3 p, float by)
{
    return (struct lum_bounds){lum_v3_sub(p, lum_v3(by, by, by)), lum_v3_add(p, lum_v3(by, by, by))};
}

bool lum_light_bounds(const struct lum_snapshot *s, const struct lum_light *light, struct lum_bounds *ret_bounds)
{
    if (light->kind == &lum_emitter_mesh)
        *ret_bounds = lum_instance_bounds(&s->instances[light->instance]);
    else if (light->shape != LUM_NO_OBJECT)
        *ret_bounds = lum_shape_bounds(&s->parts->lights->shapes[light->shape]);
    else if (light->kind == &lum_emitter_point)
        *ret_bounds = (struct lum_bounds){light->p, light->p};
    else if (light->kind == &lum_emitter_directional)
        *ret_bounds = around(lum_v3_mul(light->n, -LUM_FAR), EXTENT);
    else if (light->kind == &lum_emitter_far_disc)
        *ret_bounds = around(light->p, light->radius + EXTENT);
    else
        return false;
    return true;
}
