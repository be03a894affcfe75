/* What is under a pixel. */
#include "core/pass/pass.h"
#include "core/render/view.h"
#include "core/scene/surface.h"

void lum_pick_at(const struct lum_snapshot *s, const struct lum_camera *camera, uint32_t w, uint32_t h, double x,
                 double y, struct lum_pick *ret_pick)
{
    *ret_pick = (struct lum_pick){0};
    struct lum_eye eye;
    if (w < 1 || h < 1 || !isfinite(x) || !isfinite(y) || lum_eye_init(&eye, camera, &s->norm, w, h, NULL) != LUM_OK)
        return;
    struct lum_counters counters = {0};
    struct lum_rays rays;
    struct lum_hits hits;
    struct lum_vec3 d = lum_eye_direction(&eye, (float)x, (float)y);
    rays.n = 0;
    lum_rays_push(&rays, eye.o, d, INFINITY);
    struct lum_trace trace = lum_trace_of_eye(s, &counters);
    lum_trace_closest(&trace, &rays, &hits);
    if (hits.object[0] == LUM_NO_OBJECT)
        return;
    struct lum_surface surface;
    lum_snapshot_surface(s, &hits, 0, d, &surface);
    double scale = s->norm.scale;
    *ret_pick = (struct lum_pick){
        .hit = true,
        .id =
            surface.instance == LUM_NO_OBJECT ? s->lights.lights[surface.light].id : s->instances[surface.instance].id,
        .point_world = {(double)surface.p.x / scale + s->norm.centre.x, (double)surface.p.y / scale + s->norm.centre.y,
                        (double)surface.p.z / scale + s->norm.centre.z},
        .normal = surface.ng,
        .distance_m = (double)hits.t[0] / scale,
    };
}
