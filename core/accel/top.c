/* The top level: an Embree scene of instances whose geometry ids are the object numbers that hits report: meshes take
 * 0..n-1, the emitter shapes (emitter_shape.c) follow. So the instance id of a hit is its object, and that of a miss is
 * LUM_NO_OBJECT. */
#include "core/accel/embree.h"

#include <string.h>

_Static_assert(LUM_NO_OBJECT == RTC_INVALID_GEOMETRY_ID, "a miss must read as LUM_NO_OBJECT without a test");

/* Unit shape -> scene space. */
static struct lum_affine shape_placement(const struct lum_accel_shape *s)
{
    struct lum_vec3 x, y, z;
    s->row->place(s, &x, &y, &z);
    return (struct lum_affine){{{x.x, y.x, z.x, s->p.x}, {x.y, y.y, z.y, s->p.y}, {x.z, y.z, z.z, s->p.z}}};
}

/* ---- the top level ---- */

/* What is smaller than this is left out: no ray meets it, which is moved off its surface by more (LUM_RAY_OFFSET), and
 * no camera resolves it. Scene coordinates are at most 2^7, where floats are 2^-17 apart: the corners of something much
 * smaller are all the same number, and Embree aborts where a box of several such things has no size. So a lamp that is
 * carried 10^9 m away leaves a room that is a speck. */
#define SPECK 0x1p-15f

static bool is_speck(RTCScene scene, const struct lum_affine *m)
{
    struct RTCBounds b;
    rtcGetSceneBounds(scene, &b);
    struct lum_vec3 e = lum_v3(b.upper_x - b.lower_x, b.upper_y - b.lower_y, b.upper_z - b.lower_z);
    float size = 0.0f;
    for (uint32_t i = 0; i < 3; i++)
        size = fmaxf(size, fabsf(m->m[i][0]) * e.x + fabsf(m->m[i][1]) * e.y + fabsf(m->m[i][2]) * e.z);
    return !(size >= SPECK);
}

static void top_destroy(struct lum_accel_top *top)
{
    if (top->scene)
        rtcReleaseScene(top->scene);
    for (uint32_t i = 0; i < top->n_instances; i++)
        lum_accel_mesh_unref(top->meshes[i]);
    lum_free(top->meshes);
    lum_free(top->shapes);
    lum_free(top->specks);
    lum_free(top);
}

static void set_flags(RTCScene scene)
{
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC | LUM_SCENE_FLAG_FILTER);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_LOW);
}

/* Of this size, with nothing in it yet. NULL: out of memory. */
static struct lum_accel_top *top_new(struct lum_device *device, uint32_t n_instances,
                                     const struct lum_accel_shape *shapes, uint32_t n_shapes)
{
    struct lum_accel_top *top = lum_calloc(1, sizeof *top);
    if (!top)
        return NULL;
    lum_refs_init(&top->refs);
    top->device = device;
    top->meshes = lum_calloc(n_instances, sizeof(struct lum_accel_mesh *));
    top->shapes = lum_calloc(n_shapes, sizeof *top->shapes);
    top->specks = lum_calloc((size_t)n_instances + n_shapes, sizeof *top->specks);
    top->scene = rtcNewScene(device->rtc);
    if (!top->meshes || !top->shapes || !top->specks || !top->scene) {
        top_destroy(top);
        return NULL;
    }
    if (n_shapes)
        memcpy(top->shapes, shapes, n_shapes * sizeof *shapes);
    top->n_instances = n_instances;
    top->n_shapes = n_shapes;
    set_flags(top->scene);
    return top;
}

/* As the next object. */
static bool attach_instance(struct lum_accel_top *top, RTCDevice rtc, RTCScene scene, const struct lum_affine *m,
                            uint32_t mask)
{
    uint32_t object = top->n_attached++;
    top->specks[object] = is_speck(scene, m);
    if (top->specks[object])
        return true;
    RTCGeometry geometry = rtcNewGeometry(rtc, RTC_GEOMETRY_TYPE_INSTANCE);
    if (!geometry)
        return false;
    rtcSetGeometryInstancedScene(geometry, scene);
    rtcSetGeometryTimeStepCount(geometry, 1);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, m->m);
    rtcSetGeometryMask(geometry, mask);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(top->scene, geometry, object);
    rtcReleaseGeometry(geometry);
    return true;
}

static bool fill_scene(struct lum_accel_top *top, const struct lum_accel_instance *instances)
{
    struct lum_device *device = top->device;
    for (uint32_t i = 0; i < top->n_instances; i++) {
        if (!attach_instance(top, device->rtc, instances[i].mesh->scene, &instances[i].local_to_scene, LUM_MASK_ALL))
            return false;
        top->meshes[i] = lum_accel_mesh_ref(instances[i].mesh);
    }
    for (uint32_t i = 0; i < top->n_shapes; i++) {
        const struct lum_accel_shape *s = &top->shapes[i];
        struct lum_affine m = shape_placement(s);
        uint32_t mask = s->hidden ? LUM_MASK_OTHER : LUM_MASK_ALL;
        if (!attach_instance(top, device->rtc, device->unit_shapes[s->row->unit], &m, mask))
            return false;
    }
    rtcCommitScene(top->scene);
    return true;
}

static enum lum_status no_memory(struct lum_error *err)
{
    return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the scene's top level");
}

/* Destroys it when Embree has something to say about it. */
static enum lum_status give(struct lum_accel_top *top, struct lum_accel_top **ret_top, struct lum_error *err)
{
    enum lum_status status = lum_device_check(top->device, "scene build", err);
    if (status != LUM_OK) {
        top_destroy(top);
        return status;
    }
    *ret_top = top;
    return LUM_OK;
}

enum lum_status lum_accel_top_create(struct lum_device *device, const struct lum_accel_instance *instances,
                                     uint32_t n_instances, const struct lum_accel_shape *shapes, uint32_t n_shapes,
                                     struct lum_accel_top **ret_top, struct lum_error *err)
{
    struct lum_accel_top *top = top_new(device, n_instances, shapes, n_shapes);
    if (!top)
        return no_memory(err);
    if (!fill_scene(top, instances)) {
        top_destroy(top);
        return no_memory(err);
    }
    return give(top, ret_top, err);
}

/* Embree lets scenes share a geometry. */
enum lum_status lum_accel_top_create_part(const struct lum_accel_top *whole, const uint32_t *objects,
                                          uint32_t n_objects, struct lum_accel_top **ret_part, struct lum_error *err)
{
    struct lum_accel_top *part = top_new(whole->device, whole->n_instances, whole->shapes, whole->n_shapes);
    if (!part)
        return no_memory(err);
    for (uint32_t i = 0; i < n_objects; i++) {
        uint32_t object = objects[i];
        if (whole->specks[object])
            continue;
        rtcAttachGeometryByID(part->scene, rtcGetGeometry(whole->scene, object), object);
        if (object < whole->n_instances)
            part->meshes[object] = lum_accel_mesh_ref(whole->meshes[object]);
    }
    rtcCommitScene(part->scene);
    return give(part, ret_part, err);
}

struct lum_accel_top *lum_accel_top_ref(struct lum_accel_top *top)
{
    lum_refs_get(&top->refs);
    return top;
}

void lum_accel_top_unref(struct lum_accel_top *top)
{
    if (top && lum_refs_put(&top->refs))
        top_destroy(top);
}
