#include <float.h>

#include "core/render/frame.h"

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

struct lum_tiling lum_tiling_make(uint32_t w, uint32_t h, uint32_t side)
{
    uint32_t nx = (w + side - 1) / side, ny = (h + side - 1) / side;
    return (struct lum_tiling){w, h, side, nx, ny, nx * ny};
}

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

struct lum_tile_rect lum_tile_at(const struct lum_tiling *t, uint32_t tile)
{
    uint32_t x = tile % t->nx * t->side, y = tile / t->nx * t->side;
    return (struct lum_tile_rect){x, y, least(t->side, t->w - x), least(t->side, t->h - y)};
}

void lum_tile_center_rays(const struct lum_pass *pass, uint32_t tile, struct lum_rays *ret_rays)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    ret_rays->n = 0;
    for (uint32_t y = 0; y < r.h; y++)
        for (uint32_t x = 0; x < r.w; x++) {
            struct lum_vec3 d = lum_center_direction(pass, r.x + x, r.y + y);
            lum_rays_push(ret_rays, pass->eye.o, d, INFINITY);
        }
}

/* From here on only the direction counts: the offset of an origin turns it by less than float can tell. And a ray as
 * long as its light is far would leave the range of LUM_RAY_LIMIT. */
#define FAR_LIGHT 0x1p20f

bool lum_shadow_ray(struct lum_rays *rays, struct lum_vec3 p, struct lum_vec3 ng, struct lum_vec3 wi, float distance)
{
    struct lum_vec3 o = lum_ray_offset(p, lum_dot(wi, ng) >= 0.0f ? ng : lum_v3_neg(ng));
    if (!(distance < FAR_LIGHT)) {
        lum_rays_push(rays, o, wi, distance * (1.0f - 0x1p-12f));
        return true;
    }
    /* From the offset origin to the very point on the light, which must not be met itself: scene coordinates are below
     * 2^7, so each end is off by at most an ulp of 2^-17; and by the relative rounding of distance * wi and of t. */
    struct lum_vec3 d = lum_v3_sub(lum_v3_mad(p, wi, distance), o);
    float length = lum_length(d);
    float tfar = 1.0f - 0x1p-12f - 0x1p-16f / length;
    if (!(tfar > 0.0f))
        return false;
    lum_rays_push(rays, o, d, tfar);
    return true;
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
