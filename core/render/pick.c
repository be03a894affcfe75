/* What is under a pixel, and around an eye. */
#include <stdlib.h>

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

/* Directions that cover the sphere evenly: heights in equal steps, each turned on by the golden angle. */
static struct lum_vec3 direction_around(uint32_t i, uint32_t n)
{
    const double golden_angle = 2.399963229728653; /* pi (3 - sqrt 5) */
    double up = 1.0 - (2.0 * i + 1.0) / n, flat = sqrt(1.0 - up * up), turn = golden_angle * i;
    return lum_v3((float)(flat * cos(turn)), (float)up, (float)(flat * sin(turn)));
}

static int nearer(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

void lum_surroundings_at(const struct lum_snapshot *s, const struct lum_camera *camera,
                         struct lum_surroundings *ret_around)
{
    *ret_around = (struct lum_surroundings){0};
    struct lum_eye eye;
    if (lum_eye_init(&eye, camera, &s->norm, 1, 1, NULL) != LUM_OK)
        return;
    struct lum_counters counters = {0};
    struct lum_rays rays = {.n = 0};
    struct lum_hits hits;
    for (uint32_t i = 0; i < LUM_RAY_BATCH; i++)
        lum_rays_push(&rays, eye.o, direction_around(i, LUM_RAY_BATCH), INFINITY);
    struct lum_trace trace = lum_trace_of_eye(s, &counters);
    lum_trace_closest(&trace, &rays, &hits);
    float met[LUM_RAY_BATCH];
    uint32_t n_met = 0;
    for (uint32_t i = 0; i < rays.n; i++)
        if (hits.object[i] != LUM_NO_OBJECT)
            met[n_met++] = hits.t[i];
    if (n_met == 0)
        return;
    qsort(met, n_met, sizeof *met, nearer);
    *ret_around = (struct lum_surroundings){.enclosed = (double)n_met / rays.n,
                                            .reach_m = (double)met[n_met / 2] / s->norm.scale};
}
