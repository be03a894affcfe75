#include <float.h>

#include "core/pass/eye.h"

#include "core/accel/trace.h"
#include "core/math/vec3d.h"

#define PI 3.14159265358979323846

/* False for a vector without direction. Scaled first, as lum_normalize. */
static bool unit(struct lum_vec3d *v)
{
    double m = fmax(fabs(v->x), fmax(fabs(v->y), fabs(v->z)));
    if (!(m > 0.0) || !isfinite(m))
        return false;
    double x = v->x / m, y = v->y / m, z = v->z / m, s = 1.0 / sqrt(x * x + y * y + z * z);
    *v = (struct lum_vec3d){x * s, y * s, z * s};
    return true;
}

static struct lum_vec3 narrow(struct lum_vec3d v)
{
    return lum_v3((float)v.x, (float)v.y, (float)v.z);
}

static bool finite3(struct lum_vec3d v)
{
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

/* The three axes, of unit length: up is that of the picture. */
static enum lum_status look(const struct lum_camera *camera, struct lum_vec3d *ret_right, struct lum_vec3d *ret_up,
                            struct lum_vec3d *ret_forward, struct lum_error *err)
{
    struct lum_vec3d forward = lum_v3d_sub(camera->target, camera->position), up = camera->up, right = {0};
    if (!unit(&forward))
        return lum_fail(err, LUM_ERR_INVALID, "target", "the camera's target must differ from its position");
    bool upright = unit(&up);
    if (upright)
        right = lum_v3d_cross(forward, up);
    /* Looking along up: any other axis serves. sin of the angle below 1e-9 is rounding of unit vectors. */
    if (!(right.x * right.x + right.y * right.y + right.z * right.z > 1e-18))
        right =
            lum_v3d_cross(forward, fabs(forward.y) < 0.9 ? (struct lum_vec3d){0, 1, 0} : (struct lum_vec3d){0, 0, -1});
    if (!unit(&right))
        return lum_fail(err, LUM_ERR_INVALID, "up", "the camera's up must not be zero");
    *ret_right = right;
    *ret_up = camera->panorama && upright ? up : lum_v3d_cross(right, forward);
    *ret_forward = camera->panorama ? lum_v3d_cross(*ret_up, right) : forward;
    return LUM_OK;
}

enum lum_status lum_eye_init(struct lum_eye *ret_eye, const struct lum_camera *camera,
                             const struct lum_normalisation *norm, uint32_t w, uint32_t h, struct lum_error *err)
{
    if (!finite3(camera->position) || !finite3(camera->target) || !finite3(camera->up))
        return lum_fail(err, LUM_ERR_INVALID, "camera", "the camera's position, target and up must be finite");
    if (!(camera->vfov_deg >= 1.0 && camera->vfov_deg <= 179.0))
        return lum_fail(err, LUM_ERR_INVALID, "vfov_deg", "the camera's angle must be 1 to 179 degrees");
    struct lum_vec3d right = {0}, up = {0}, forward = {0};
    enum lum_status status = look(camera, &right, &up, &forward, err);
    if (status != LUM_OK)
        return status;
    struct lum_vec3d o = lum_v3d_sub(camera->position, norm->centre);
    o = lum_v3d_mul(o, norm->scale);
    if (!(fmax(fabs(o.x), fmax(fabs(o.y), fabs(o.z))) < (double)LUM_RAY_LIMIT))
        return lum_fail(err, LUM_ERR_INVALID, "position", "the camera is too far from the scene");
    *ret_eye = (struct lum_eye){
        .o = narrow(o),
        .frame = {narrow(right), narrow(up), narrow(forward)},
        .per_pixel = (float)(2.0 * tan(camera->vfov_deg * (PI / 360.0)) / h),
        .w = (float)w,
        .h = (float)h,
        .panorama = camera->panorama,
    };
    if (!camera->panorama)
        return LUM_OK;
    ret_eye->per_column = (float)(2.0 * PI / w);
    ret_eye->per_row = (float)(PI / h);
    ret_eye->per_pixel = lum_max(ret_eye->per_column, ret_eye->per_row);
    return LUM_OK;
}

struct lum_vec3 lum_eye_around(const struct lum_eye *eye, float x, float y)
{
    float azimuth = (x - 0.5f * eye->w) * eye->per_column, elevation = (0.5f * eye->h - y) * eye->per_row;
    float level = cosf(elevation);
    struct lum_vec3 d = lum_v3(level * sinf(azimuth), sinf(elevation), level * cosf(azimuth));
    return lum_normalize(lum_frame_to_scene(&eye->frame, d));
}

/* What lies on an edge of it is in the picture: there is nothing beside a panorama. */
static bool pixel_around(const struct lum_eye *eye, struct lum_vec3 d, uint32_t *ret_x, uint32_t *ret_y)
{
    float x = 0.5f * eye->w + atan2f(d.x, d.z) / eye->per_column;
    float y = 0.5f * eye->h - atan2f(d.y, sqrtf(d.x * d.x + d.z * d.z)) / eye->per_row;
    if (!(lum_dot(d, d) > 0.0f) || isnan(x) || isnan(y))
        return false;
    *ret_x = (uint32_t)lum_clamp(x, 0.0f, eye->w - 1.0f);
    *ret_y = (uint32_t)lum_clamp(y, 0.0f, eye->h - 1.0f);
    return true;
}

bool lum_eye_pixel(const struct lum_eye *eye, struct lum_vec3 p, uint32_t *ret_x, uint32_t *ret_y)
{
    struct lum_vec3 d = lum_frame_to_local(&eye->frame, lum_v3_sub(p, eye->o));
    if (eye->panorama)
        return pixel_around(eye, d, ret_x, ret_y);
    float x = 0.5f * eye->w + d.x / (d.z * eye->per_pixel), y = 0.5f * eye->h - d.y / (d.z * eye->per_pixel);
    if (!(d.z > 0.0f && x >= 0.0f && x < eye->w && y >= 0.0f && y < eye->h))
        return false;
    *ret_x = (uint32_t)x;
    *ret_y = (uint32_t)y;
    return true;
}
