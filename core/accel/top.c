/* The top level: an Embree scene of instances whose geometry ids are the object numbers that hits report: meshes take
 * 0..n-1, the emitter shapes follow. So the instance id of a hit is its object, and that of a miss is LUM_NO_OBJECT.
 *
 * Emitter shapes are instances of one unit quad, disc and sphere. Put into the scene directly they would each add a
 * structure of their own kind, which every ray would walk: measured, a single sphere made occlusion rays 1.8 times
 * slower. */
#include "core/accel/embree.h"

#include <string.h>

_Static_assert(LUM_NO_OBJECT == RTC_INVALID_GEOMETRY_ID, "a miss must read as LUM_NO_OBJECT without a test");

/* ---- emitter shapes ---- */

/* Corners in the order that makes Embree's (u, v) run from (-1, -1) to (1, 1) in the x-y plane, with the normal along
 * +z. */
static bool fill_quad(RTCGeometry geometry)
{
    static const float corners[12] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    static const uint32_t indices[4] = {0, 1, 2, 3};
    void *corner =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 4);
    void *index =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(uint32_t), 1);
    if (!corner || !index)
        return false;
    memcpy(corner, corners, sizeof corners);
    memcpy(index, indices, sizeof indices);
    return true;
}

/* Of radius 1 around the origin; the disc's normal is +z. */
static bool fill_point(RTCGeometry geometry, bool disc)
{
    static const float centre[4] = {0, 0, 0, 1}, up[3] = {0, 0, 1};
    void *point = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, sizeof centre, 1);
    if (!point)
        return false;
    memcpy(point, centre, sizeof centre);
    if (!disc)
        return true;
    void *normal = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3, sizeof up, 1);
    if (!normal)
        return false;
    memcpy(normal, up, sizeof up);
    return true;
}

static RTCScene unit_shape(RTCDevice rtc, enum lum_accel_shape_kind kind)
{
    static const enum RTCGeometryType types[LUM_SHAPE_KIND_COUNT] = {
        [LUM_SHAPE_QUAD] = RTC_GEOMETRY_TYPE_QUAD,
        [LUM_SHAPE_DISC] = RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT,
        [LUM_SHAPE_SPHERE] = RTC_GEOMETRY_TYPE_SPHERE_POINT,
    };
    RTCScene scene = rtcNewScene(rtc);
    RTCGeometry geometry = rtcNewGeometry(rtc, types[kind]);
    bool ok = scene && geometry &&
              (kind == LUM_SHAPE_QUAD ? fill_quad(geometry) : fill_point(geometry, kind == LUM_SHAPE_DISC));
    if (ok) {
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST | LUM_SCENE_FLAG_FILTER);
        rtcSetGeometryMask(geometry, LUM_MASK_ALL);
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene, geometry, 0);
        rtcCommitScene(scene);
    }
    if (geometry)
        rtcReleaseGeometry(geometry);
    if (!ok && scene)
        rtcReleaseScene(scene);
    return ok ? scene : NULL;
}

bool lum_unit_shapes_create(struct lum_device *device)
{
    for (int kind = 0; kind < LUM_SHAPE_KIND_COUNT; kind++) {
        device->unit_shapes[kind] = unit_shape(device->rtc, (enum lum_accel_shape_kind)kind);
        if (!device->unit_shapes[kind])
            return false;
    }
    return rtcGetDeviceError(device->rtc) == RTC_ERROR_NONE;
}

void lum_unit_shapes_destroy(struct lum_device *device)
{
    for (int kind = 0; kind < LUM_SHAPE_KIND_COUNT; kind++)
        if (device->unit_shapes[kind])
            rtcReleaseScene(device->unit_shapes[kind]);
}

/* Unit shape -> scene space. A flat shape's third axis is free: it gets the length that keeps the map well conditioned.
 */
static struct lum_affine shape_placement(const struct lum_accel_shape *s)
{
    struct lum_vec3 x = lum_v3(s->radius, 0.0f, 0.0f), y = lum_v3(0.0f, s->radius, 0.0f),
                    z = lum_v3(0.0f, 0.0f, s->radius);
    if (s->kind == LUM_SHAPE_QUAD) {
        x = s->u;
        y = s->v;
        z = lum_v3_mul(s->n, fmaxf(lum_length(s->u), lum_length(s->v)));
    } else if (s->kind == LUM_SHAPE_DISC) {
        struct lum_frame frame = lum_frame_from_normal(s->n);
        x = lum_v3_mul(frame.t, s->radius);
        y = lum_v3_mul(frame.b, s->radius);
        z = lum_v3_mul(frame.n, s->radius);
    }
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
        if (!attach_instance(top, device->rtc, device->unit_shapes[s->kind], &m, mask))
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
