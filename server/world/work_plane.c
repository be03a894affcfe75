#include "server/world/work_plane.h"

#include "core/math/vec3d.h"
#include "core/render/view.h"

enum { GROUND_PROBES = 9 }; /* a side */

static double ground_below(const struct lum_snapshot *s, const struct lum_box *all)
{
    double ground = (double)INFINITY, middle = 0.5 * (all->lo.y + all->hi.y);
    for (uint32_t i = 0; i < GROUND_PROBES * GROUND_PROBES; i++) {
        double u = (i % GROUND_PROBES + 0.5) / GROUND_PROBES, v = ((double)(i / GROUND_PROBES) + 0.5) / GROUND_PROBES;
        struct lum_vec3d from = {all->lo.x + u * (all->hi.x - all->lo.x), middle,
                                 all->lo.z + v * (all->hi.z - all->lo.z)};
        struct lum_camera down = {
            .position = from, .target = {from.x, from.y - 1.0, from.z}, .up = {0, 0, -1}, .vfov_deg = 10};
        struct lum_pick hit;
        lum_pick_at(s, &down, 1, 1, 0.5, 0.5, &hit);
        if (hit.hit)
            ground = fmin(ground, hit.point_world.y);
    }
    return isfinite(ground) ? ground : all->lo.y;
}

static bool find_object(const struct lum_world *world, const char *on, struct lum_box *ret_box,
                        struct lum_proto_error *err)
{
    char near[sizeof err->text / 2];
    if (lum_snapshot_bounds(world->snapshot, on, ret_box))
        return true;
    lum_document_nearest(world->doc, LUM_RECORD_OBJECT, on, near, sizeof near);
    return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "on", "there is no object \"%.60s\" to be seen%s",
                          on, near);
}

void lum_work_plane_fit(struct lum_sensor_desc *d, uint32_t max_points)
{
    double a = lum_v3d_length(d->u), b = lum_v3d_length(d->v);
    if (!lum_sensor_check(d, max_points, NULL))
        return;
    /* cells of that size fill it but for what whole numbers add: the steps are few */
    d->spacing_m = fmax(sqrt(a * b / max_points), fmax(a, b) / max_points);
    while (lum_sensor_check(d, max_points, NULL))
        d->spacing_m *= 1.01;
}

bool lum_work_plane_place(const struct lum_world *world, const struct lum_work_plane *plane,
                          struct lum_sensor_desc *ret_desc, struct lum_proto_error *err)
{
    struct lum_box all, box;
    if (!lum_snapshot_bounds(world->snapshot, NULL, &all))
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "not_found", "",
                              "the scene has no surface: nothing to measure");
    if (!find_object(world, plane->on, &box, err))
        return false;
    double y = (plane->on ? box.hi.y : ground_below(world->snapshot, &all)) + plane->height_m,
           x0 = box.lo.x + plane->border_m, z0 = box.lo.z + plane->border_m, x1 = box.hi.x - plane->border_m,
           z1 = box.hi.z - plane->border_m;
    if (plane->area) {
        x0 = plane->area[0];
        z0 = plane->area[1];
        x1 = plane->area[2];
        z1 = plane->area[3];
    }
    if (x0 > all.hi.x || x1 < all.lo.x || z0 > all.hi.z || z1 < all.lo.z)
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "invalid_value", "area",
                              "the area lies beside the scene, which spans x %.2f to %.2f and z %.2f to %.2f", all.lo.x,
                              all.hi.x, all.lo.z, all.hi.z);
    if (!(x1 > x0 && z1 > z0))
        return lum_proto_fail(err, LUM_PROTO_APPLICATION, "invalid_value", "border",
                              "nothing is left of %.2f x %.2f m within a border of %g m: it must be less",
                              box.hi.x - box.lo.x, box.hi.z - box.lo.z, plane->border_m);
    *ret_desc = (struct lum_sensor_desc){.kind = LUM_SENSOR_GRID,
                                         .position = {0.5 * (x0 + x1), y, 0.5 * (z0 + z1)},
                                         .u = {x1 - x0, 0.0, 0.0},
                                         .v = {0.0, 0.0, z1 - z0},
                                         .normal = {0.0f, 1.0f, 0.0f},
                                         .facing = {0.0f, 0.0f, -1.0f}};
    if (!plane->on && !plane->area)
        ret_desc->floor_m2 = (all.hi.x - all.lo.x) * (all.hi.z - all.lo.z);
    return true;
}
