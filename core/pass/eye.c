#include <float.h>

#include "core/pass/eye.h"

#include "core/accel/trace.h"

static struct lum_vec3d sub(struct lum_vec3d a, struct lum_vec3d b)
{
    return (struct lum_vec3d){a.x - b.x, a.y - b.y, a.z - b.z};
}

static struct lum_vec3d cross(struct lum_vec3d a, struct lum_vec3d b)
{
    return (struct lum_vec3d){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

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

enum lum_status lum_eye_init(struct lum_eye *ret_eye, const struct lum_camera *camera,
                             const struct lum_normalisation *norm, uint32_t w, uint32_t h, struct lum_error *err)
{
    if (!finite3(camera->position) || !finite3(camera->target) || !finite3(camera->up))
        return lum_fail(err, LUM_ERR_INVALID, "camera", "the camera's position, target and up must be finite");
    if (!(camera->vfov_deg >= 1.0 && camera->vfov_deg <= 179.0))
        return lum_fail(err, LUM_ERR_INVALID, "vfov_deg", "the camera's angle must be 1 to 179 degrees");
    struct lum_vec3d forward = sub(camera->target, camera->position);
    if (!unit(&forward))
        return lum_fail(err, LUM_ERR_INVALID, "target", "the camera's target must differ from its position");
    struct lum_vec3d up = camera->up, right = {0};
    if (unit(&up))
        right = cross(forward, up);
    /* Looking along up: any other axis serves. sin of the angle below 1e-9 is rounding of unit vectors. */
    if (!(right.x * right.x + right.y * right.y + right.z * right.z > 1e-18))
        right = cross(forward, fabs(forward.y) < 0.9 ? (struct lum_vec3d){0, 1, 0} : (struct lum_vec3d){0, 0, -1});
    if (!unit(&right))
        return lum_fail(err, LUM_ERR_INVALID, "up", "the camera's up must not be zero");
    struct lum_vec3d o = sub(camera->position, norm->centre);
    o = (struct lum_vec3d){o.x * norm->scale, o.y * norm->scale, o.z * norm->scale};
    if (!(fmax(fabs(o.x), fmax(fabs(o.y), fabs(o.z))) < (double)LUM_RAY_LIMIT))
        return lum_fail(err, LUM_ERR_INVALID, "position", "the camera is too far from the scene");
    *ret_eye = (struct lum_eye){
        .o = narrow(o),
        .frame = {narrow(right), narrow(cross(right, forward)), narrow(forward)},
        .per_pixel = (float)(2.0 * tan(camera->vfov_deg * (3.14159265358979323846 / 360.0)) / h),
        .w = (float)w,
        .h = (float)h,
    };
    return LUM_OK;
}

bool lum_eye_pixel(const struct lum_eye *eye, struct lum_vec3 p, uint32_t *ret_x, uint32_t *ret_y)
{
    struct lum_vec3 d = lum_frame_to_local(&eye->frame, lum_v3_sub(p, eye->o));
    float x = 0.5f * eye->w + d.x / (d.z * eye->per_pixel), y = 0.5f * eye->h - d.y / (d.z * eye->per_pixel);
    if (!(d.z > 0.0f && x >= 0.0f && x < eye->w && y >= 0.0f && y < eye->h))
        return false;
    *ret_x = (uint32_t)x;
    *ret_y = (uint32_t)y;
    return true;
}
