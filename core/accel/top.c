/* The top level: an Embree scene whose geometry ids are the object numbers that hits report. Instances take 0..n-1, the
 * emitter shapes follow, so that "instance id if any, else geometry id" is the object, and a miss is LUM_NO_OBJECT. */
#include "core/accel/embree.h"

#include <string.h>

_Static_assert(LUM_NO_OBJECT == RTC_INVALID_GEOMETRY_ID, "a miss must read as LUM_NO_OBJECT without a test");

static void attach(struct lum_accel_top *top, RTCGeometry geometry, uint32_t id)
{
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(top->scene, geometry, id);
    rtcReleaseGeometry(geometry);
}

static bool add_instance(struct lum_accel_top *top, RTCDevice rtc, const struct lum_accel_instance *instance,
                         uint32_t id)
{
    RTCGeometry geometry = rtcNewGeometry(rtc, RTC_GEOMETRY_TYPE_INSTANCE);
    if (!geometry)
        return false;
    rtcSetGeometryInstancedScene(geometry, instance->mesh->scene);
    rtcSetGeometryTimeStepCount(geometry, 1);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, instance->local_to_scene.m);
    rtcSetGeometryMask(geometry, LUM_MASK_ALL);
    attach(top, geometry, id);
    top->meshes[id] = lum_accel_mesh_ref(instance->mesh);
    top->n_instances = id + 1;
    return true;
}

/* Corners in the order that makes Embree's (u, v) run from p - u - v to p + u + v, with the normal along cross(u, v).
 */
static bool fill_quad(RTCGeometry geometry, const struct lum_accel_shape *s)
{
    float *corner =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 4);
    uint32_t *index =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(uint32_t), 1);
    if (!corner || !index)
        return false;
    static const float side[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (uint32_t i = 0; i < 4; i++) {
        struct lum_vec3 p = lum_v3_mad(lum_v3_mad(s->p, s->u, side[i][0]), s->v, side[i][1]);
        memcpy(corner + 3 * i, &p, 3 * sizeof(float));
        index[i] = i;
    }
    return true;
}

static bool fill_point(RTCGeometry geometry, const struct lum_accel_shape *s)
{
    float *point =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 4 * sizeof(float), 1);
    if (!point)
        return false;
    memcpy(point, &s->p, 3 * sizeof(float));
    point[3] = s->radius;
    if (s->kind == LUM_SHAPE_SPHERE)
        return true;
    float *normal =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 1);
    if (!normal)
        return false;
    memcpy(normal, &s->n, 3 * sizeof(float));
    return true;
}

static bool add_shape(struct lum_accel_top *top, RTCDevice rtc, const struct lum_accel_shape *s, uint32_t id)
{
    static const enum RTCGeometryType types[] = {
        [LUM_SHAPE_QUAD] = RTC_GEOMETRY_TYPE_QUAD,
        [LUM_SHAPE_DISC] = RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT,
        [LUM_SHAPE_SPHERE] = RTC_GEOMETRY_TYPE_SPHERE_POINT,
    };
    RTCGeometry geometry = rtcNewGeometry(rtc, types[s->kind]);
    if (!geometry)
        return false;
    if (!(s->kind == LUM_SHAPE_QUAD ? fill_quad(geometry, s) : fill_point(geometry, s))) {
        rtcReleaseGeometry(geometry);
        return false;
    }
    rtcSetGeometryMask(geometry, s->hidden ? LUM_MASK_OTHER : LUM_MASK_ALL);
    attach(top, geometry, id);
    top->has_round |= s->kind != LUM_SHAPE_QUAD;
    return true;
}

static void top_destroy(struct lum_accel_top *top)
{
    if (top->scene)
        rtcReleaseScene(top->scene);
    for (uint32_t i = 0; i < top->n_instances; i++)
        lum_accel_mesh_unref(top->meshes[i]);
    lum_free(top->meshes);
    lum_free(top->shapes);
    lum_free(top);
}

static bool fill_scene(struct lum_accel_top *top, RTCDevice rtc, const struct lum_accel_instance *instances,
                       uint32_t n_instances)
{
    rtcSetSceneFlags(top->scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC | LUM_SCENE_FLAG_FILTER);
    rtcSetSceneBuildQuality(top->scene, RTC_BUILD_QUALITY_LOW);
    for (uint32_t i = 0; i < n_instances; i++)
        if (!add_instance(top, rtc, &instances[i], i))
            return false;
    for (uint32_t i = 0; i < top->n_shapes; i++)
        if (!add_shape(top, rtc, &top->shapes[i], n_instances + i))
            return false;
    rtcCommitScene(top->scene);
    return true;
}

enum lum_status lum_accel_top_create(struct lum_device *device, const struct lum_accel_instance *instances,
                                     uint32_t n_instances, const struct lum_accel_shape *shapes, uint32_t n_shapes,
                                     struct lum_accel_top **ret_top, struct lum_error *err)
{
    struct lum_accel_top *top = lum_calloc(1, sizeof *top);
    if (!top)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the scene's top level");
    lum_refs_init(&top->refs);
    top->meshes = lum_calloc(n_instances, sizeof(struct lum_accel_mesh *));
    top->shapes = lum_calloc(n_shapes, sizeof *top->shapes);
    top->scene = rtcNewScene(device->rtc);
    if (!top->meshes || !top->shapes || !top->scene)
        goto no_memory;
    if (n_shapes)
        memcpy(top->shapes, shapes, n_shapes * sizeof *shapes);
    top->n_shapes = n_shapes;
    if (!fill_scene(top, device->rtc, instances, n_instances))
        goto no_memory;
    enum lum_status status = lum_device_check(device, "scene build", err);
    if (status != LUM_OK) {
        top_destroy(top);
        return status;
    }
    *ret_top = top;
    return LUM_OK;
no_memory:
    top_destroy(top);
    return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the scene's top level");
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
