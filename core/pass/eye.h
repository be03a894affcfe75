/* The eye: from pixels to rays and back. */
#ifndef LUM_CORE_PASS_EYE_H
#define LUM_CORE_PASS_EYE_H

#include "core/scene/snapshot.h"

/* The camera in scene space. */
struct lum_eye {
    struct lum_vec3 o;
    struct lum_frame frame; /* t right, b up, n forward */
    float per_pixel;        /* size of a pixel at distance 1: on the plane; of a panorama the larger of its sides */
    float w, h;
    bool panorama;
    float per_column, per_row; /* rad; of a panorama */
};
/* LUM_ERR_INVALID when the camera is not finite, looks nowhere, or its angle is out of 1..179 degrees. */
LUM_MUST_USE enum lum_status lum_eye_init(struct lum_eye *ret_eye, const struct lum_camera *camera,
                                          const struct lum_normalisation *norm, uint32_t w, uint32_t h,
                                          struct lum_error *err);
/* Direction through film position (x, y), of length 1 along the axis, and of unit length; pixel (i, j) covers
 * [i, i + 1) x [j, j + 1). The arithmetic is such that pictures of different width (or height, at equal per_pixel) see
 * the very same rays where they overlap. */
static inline struct lum_vec3 lum_eye_on_plane(const struct lum_eye *eye, float x, float y)
{
    float sx = (2.0f * x - eye->w) * 0.5f * eye->per_pixel, sy = (eye->h - 2.0f * y) * 0.5f * eye->per_pixel;
    return lum_v3_mad(lum_v3_mad(eye->frame.n, eye->frame.t, sx), eye->frame.b, sy);
}
struct lum_vec3 lum_eye_around(const struct lum_eye *eye, float x, float y); /* of a panorama, which has no plane */
static inline struct lum_vec3 lum_eye_direction(const struct lum_eye *eye, float x, float y)
{
    return eye->panorama ? lum_eye_around(eye, x, y) : lum_normalize(lum_eye_on_plane(eye, x, y));
}

/* The pixel through which the eye sees p, were nothing before it. False: p is behind the eye or beside the picture. */
bool lum_eye_pixel(const struct lum_eye *eye, struct lum_vec3 p, uint32_t *ret_x, uint32_t *ret_y);

#endif
