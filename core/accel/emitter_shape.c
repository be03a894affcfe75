/* The shapes of emitters, each a row, and the unit shapes that Embree knows.
 *
 * They are instances of one unit shape each. Put into the scene directly they would each add a structure of their own
 * kind, which every ray would walk: measured, a single sphere made occlusion rays 1.8 times slower. */
#include "core/accel/embree.h"

#include <string.h>

/* ---- quad ---- */

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

static void place_quad(const struct lum_accel_shape *s, struct lum_vec3 *ret_x, struct lum_vec3 *ret_y,
                       struct lum_vec3 *ret_z)
{
    *ret_x = s->u;
    *ret_y = s->v;
    *ret_z = lum_v3_mul(s->n, fmaxf(lum_length(s->u), lum_length(s->v)));
}

static struct lum_vec3 half_quad(const struct lum_accel_shape *s)
{
    return lum_v3(fabsf(s->u.x) + fabsf(s->v.x), fabsf(s->u.y) + fabsf(s->v.y), fabsf(s->u.z) + fabsf(s->v.z));
}

static struct lum_vec3 on_quad(const struct lum_accel_shape *s, struct lum_vec3 q, float *inout_u, float *inout_v)
{
    (void)q, (void)inout_u, (void)inout_v; /* Embree's */
    return s->n;
}

/* ---- disc and sphere: a point with a radius ---- */

static bool fill_sphere(RTCGeometry geometry)
{
    static const float centre[4] = {0, 0, 0, 1};
    void *point = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, sizeof centre, 1);
    if (!point)
        return false;
    memcpy(point, centre, sizeof centre);
    return true;
}

/* Its normal is +z. */
static bool fill_disc(RTCGeometry geometry)
{
    static const float up[3] = {0, 0, 1};
    if (!fill_sphere(geometry))
        return false;
    void *normal = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3, sizeof up, 1);
    if (!normal)
        return false;
    memcpy(normal, up, sizeof up);
    return true;
}

static void place_disc(const struct lum_accel_shape *s, struct lum_vec3 *ret_x, struct lum_vec3 *ret_y,
                       struct lum_vec3 *ret_z)
{
    struct lum_frame frame = lum_frame_from_normal(s->n);
    *ret_x = lum_v3_mul(frame.t, s->radius);
    *ret_y = lum_v3_mul(frame.b, s->radius);
    *ret_z = lum_v3_mul(frame.n, s->radius);
}

static void place_sphere(const struct lum_accel_shape *s, struct lum_vec3 *ret_x, struct lum_vec3 *ret_y,
                         struct lum_vec3 *ret_z)
{
    *ret_x = lum_v3(s->radius, 0.0f, 0.0f);
    *ret_y = lum_v3(0.0f, s->radius, 0.0f);
    *ret_z = lum_v3(0.0f, 0.0f, s->radius);
}

static struct lum_vec3 half_round(const struct lum_accel_shape *s)
{
    return lum_v3(s->radius, s->radius, s->radius);
}

static struct lum_vec3 on_disc(const struct lum_accel_shape *s, struct lum_vec3 q, float *ret_u, float *ret_v)
{
    struct lum_frame frame = lum_frame_from_normal(s->n);
    *ret_u = lum_dot(q, frame.t) / s->radius;
    *ret_v = lum_dot(q, frame.b) / s->radius;
    return s->n;
}

static struct lum_vec3 on_sphere(const struct lum_accel_shape *s, struct lum_vec3 q, float *ret_u, float *ret_v)
{
    (void)s, (void)ret_u, (void)ret_v; /* the normal says where */
    return q;
}

/* ---- all ---- */

const struct lum_accel_shape_row lum_shape_quad = {LUM_UNIT_SQUARE, place_quad, half_quad, on_quad};
const struct lum_accel_shape_row lum_shape_disc = {LUM_UNIT_DISC, place_disc, half_round, on_disc};
const struct lum_accel_shape_row lum_shape_sphere = {LUM_UNIT_SPHERE, place_sphere, half_round, on_sphere};

static const struct {
    enum RTCGeometryType type;
    bool (*fill)(RTCGeometry geometry);
} units[LUM_UNIT_COUNT] = {
    [LUM_UNIT_SQUARE] = {RTC_GEOMETRY_TYPE_QUAD, fill_quad},
    [LUM_UNIT_DISC] = {RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT, fill_disc},
    [LUM_UNIT_SPHERE] = {RTC_GEOMETRY_TYPE_SPHERE_POINT, fill_sphere},
};

struct lum_vec3 lum_accel_shape_half(const struct lum_accel_shape *s)
{
    return s->row->half(s);
}

static RTCScene unit_shape(RTCDevice rtc, enum lum_accel_unit unit)
{
    RTCScene scene = rtcNewScene(rtc);
    RTCGeometry geometry = rtcNewGeometry(rtc, units[unit].type);
    bool ok = scene && geometry && units[unit].fill(geometry);
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
    for (int unit = 0; unit < LUM_UNIT_COUNT; unit++) {
        device->unit_shapes[unit] = unit_shape(device->rtc, (enum lum_accel_unit)unit);
        if (!device->unit_shapes[unit])
            return false;
    }
    return rtcGetDeviceError(device->rtc) == RTC_ERROR_NONE;
}

void lum_unit_shapes_destroy(struct lum_device *device)
{
    for (int unit = 0; unit < LUM_UNIT_COUNT; unit++)
        if (device->unit_shapes[unit])
            rtcReleaseScene(device->unit_shapes[unit]);
}
