/* Light from afar: directional, discs, and environments. */
#include "core/light/emitter.h"

#include "core/accel/trace.h"
#include "core/light/environment.h"
#include "core/light/portals.h"
#include "core/math/warp.h"
#include "core/scene/snapshot.h"

/* The box around all geometry, a little larger, so that its faces are off the surfaces that touch them. */
struct box {
    float centre[3], half[3], face[3]; /* face: area of the two faces across each axis */
};

static struct box box_around(struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    float lo[3] = {bounds_lo.x, bounds_lo.y, bounds_lo.z}, hi[3] = {bounds_hi.x, bounds_hi.y, bounds_hi.z};
    struct box b;
    for (int k = 0; k < 3; k++) {
        b.centre[k] = lo[k] <= hi[k] ? 0.5f * (lo[k] + hi[k]) : 0.0f;
        b.half[k] = (lo[k] <= hi[k] ? 0.5f * (hi[k] - lo[k]) : 0.0f) + 2.0f * LUM_RAY_OFFSET;
    }
    for (int k = 0; k < 3; k++)
        b.face[k] = 4.0f * b.half[(k + 1) % 3] * b.half[(k + 2) % 3];
    return b;
}

/* An axis in proportion to weight; u becomes a fresh number. */
static int pick_axis(const float weight[3], float *inout_u)
{
    float x = *inout_u * (weight[0] + weight[1] + weight[2]), below = 0.0f;
    int k = 0;
    while (k < 2 && !(x < below + weight[k]))
        below += weight[k++];
    *inout_u = lum_clamp((x - below) / weight[k], 0.0f, LUM_ONE_MINUS);
    return k;
}

static struct lum_vec3 face_point(const struct box *b, int axis, float side, struct lum_vec2 u)
{
    float at[3];
    int second = (axis + 1) % 3, third = (axis + 2) % 3;
    at[axis] = b->centre[axis] + side * b->half[axis];
    at[second] = b->centre[second] + (2.0f * u.x - 1.0f) * b->half[second];
    at[third] = b->centre[third] + (2.0f * u.y - 1.0f) * b->half[third];
    return lum_v3(at[0], at[1], at[2]);
}

/* Faces of the box as light in direction d sees them. */
static void seen_faces(const struct box *b, const float d[3], float ret_area[3])
{
    for (int k = 0; k < 3; k++)
        ret_area[k] = fabsf(d[k]) * b->face[k];
}

/* Half of what comes from afar is aimed at portals, where any face it: rays by both ways weigh by both. */
#define AIMED 0.5f

static bool faces(uint32_t face, struct lum_vec3 d)
{
    return lum_dot(lum_portals_normal(face), d) > 0.0f;
}

/* Number of open cells that light in direction d may enter by. */
static uint32_t count_facing(const struct lum_portals *o, struct lum_vec3 d)
{
    uint32_t n = 0;
    for (uint32_t face = 0; o && o->n > 0 && face < 6; face++)
        n += faces(face, d) ? o->first[face + 1] - o->first[face] : 0;
    return n;
}

/* Point u of the one that u.x picks among those n, and how densely lines through it lie, over the area of a plane
 * across d. That is not left to density_of_aimed: by rounding a line at a cell's edge may enter by the one beside it.
 */
static struct lum_vec3 point_of_facing(const struct lum_portals *o, struct lum_vec3 d, uint32_t n, struct lum_vec2 u,
                                       float *ret_density)
{
    uint32_t left = (uint32_t)(u.x * (float)n), face = 0;
    u.x = lum_clamp(u.x * (float)n - (float)left, 0.0f, LUM_ONE_MINUS);
    for (;; face++) {
        uint32_t of_face = faces(face, d) ? o->first[face + 1] - o->first[face] : 0;
        if (left < of_face)
            break;
        left -= of_face;
    }
    struct lum_vec3 inward, x = lum_portals_point(o, o->cell[o->first[face] + left], u, &inward);
    *ret_density = 1.0f / ((float)n * lum_portals_cell_area(o, face / 2u) * lum_dot(inward, d));
    return x;
}

/* Back along d from x, within the box, to where light comes into it. */
static struct lum_vec3 back_to_face(const struct box *b, struct lum_vec3 x, struct lum_vec3 d)
{
    float at[3] = {x.x, x.y, x.z}, to[3] = {d.x, d.y, d.z}, least = INFINITY;
    for (int k = 0; k < 3; k++)
        if (to[k] != 0.0f)
            least = lum_min(least, (at[k] - b->centre[k] + (to[k] > 0.0f ? b->half[k] : -b->half[k])) / to[k]);
    return lum_v3_mad(x, d, -lum_max(least, 0.0f));
}

/* Density, over the area of a plane across it, of a line that is aimed at one of n cells; 0: it enters by none. */
static float density_of_aimed(const struct lum_portals *o, struct lum_vec3 p, struct lum_vec3 d, uint32_t n)
{
    struct lum_portal_hit hit;
    if (n == 0 || !lum_portals_enter(o, p, d, &hit) || !lum_portals_is_open(o, hit.cell))
        return 0.0f;
    return 1.0f / ((float)n * hit.area * hit.cosine);
}

/* Which half u.x is in; it becomes a fresh number. */
static bool pick_half(float *inout_u)
{
    bool second = *inout_u >= AIMED;
    *inout_u = lum_min(second ? (*inout_u - AIMED) / (1.0f - AIMED) : *inout_u / AIMED, LUM_ONE_MINUS);
    return second;
}

/* density: of the ray. False: it brings nothing. */
static bool emit_from_afar(struct lum_vec3 o, struct lum_vec3 d, struct lum_rgb value, float density,
                           struct lum_light_ray *ret)
{
    *ret = (struct lum_light_ray){o, d, lum_rgb_scale(value, 1.0f / density), density};
    return density > 0.0f && !lum_rgb_black(ret->flux_unit);
}

/* Parallel light with this irradiance on a plane that faces it, evenly over the box as it sees it, or through portals.
 */
static bool emit_parallel(const struct lum_snapshot *s, struct lum_vec3 d, struct lum_rgb irradiance,
                          const struct lum_portals *portals, struct lum_vec2 u, struct lum_light_ray *ret)
{
    struct box b = box_around(s->bounds_lo, s->bounds_hi);
    float to[3] = {d.x, d.y, d.z}, area[3];
    seen_faces(&b, to, area);
    uint32_t n = count_facing(portals, d);
    float all = area[0] + area[1] + area[2], aimed = n > 0 ? AIMED : 0.0f;
    struct lum_vec3 o;
    float through;
    if (n > 0 && !pick_half(&u.x)) {
        o = back_to_face(&b, point_of_facing(portals, d, n, u, &through), d);
    } else {
        int axis = pick_axis(area, &u.x);
        o = face_point(&b, axis, to[axis] > 0.0f ? -1.0f : 1.0f, u);
        through = density_of_aimed(portals, o, d, n);
    }
    return emit_from_afar(o, d, irradiance, (1.0f - aimed) / all + aimed * through, ret);
}

/* The same to a point. */
static bool emit_parallel_to(const struct lum_snapshot *s, struct lum_vec3 d, struct lum_rgb irradiance,
                             const struct lum_portals *portals, struct lum_vec3 p, struct lum_light_ray *ret,
                             float *ret_pdf_sa)
{
    struct box b = box_around(s->bounds_lo, s->bounds_hi);
    float to[3] = {d.x, d.y, d.z}, area[3];
    seen_faces(&b, to, area);
    uint32_t n = count_facing(portals, d);
    float aimed = n > 0 ? AIMED : 0.0f;
    *ret_pdf_sa = 1.0f;
    return emit_from_afar(back_to_face(&b, p, d), d, irradiance,
                          (1.0f - aimed) / (area[0] + area[1] + area[2]) + aimed * density_of_aimed(portals, p, d, n),
                          ret);
}

/* ---- directional ---- */

static bool sample_directional(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p,
                               struct lum_vec2 u, struct lum_light_sample *ret)
{
    (void)s, (void)p, (void)u;
    *ret = (struct lum_light_sample){lum_v3_neg(l->n), INFINITY, l->power, 0.0f};
    return true;
}

static bool emit_directional(const struct lum_snapshot *s, const struct lum_light *l, const struct lum_portals *portals,
                             struct lum_vec2 u_position, struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    (void)u_direction;
    return emit_parallel(s, l->n, lum_grey(1.0f), portals, u_position, ret);
}

static bool emit_directional_to(const struct lum_snapshot *s, const struct lum_light *l,
                                const struct lum_portals *portals, struct lum_vec3 p, struct lum_vec2 u,
                                struct lum_light_ray *ret, float *ret_pdf_sa)
{
    (void)u;
    return emit_parallel_to(s, l->n, lum_grey(1.0f), portals, p, ret, ret_pdf_sa);
}

static double flux_of_directional(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    struct box b = box_around(bounds_lo, bounds_hi);
    float d[3] = {l->n.x, l->n.y, l->n.z}, area[3];
    seen_faces(&b, d, area);
    return (double)(area[0] + area[1] + area[2]);
}

const struct lum_emitter_row lum_emitter_directional = {.sample = sample_directional,
                                                        .emit_from_afar = emit_directional,
                                                        .emit_to = emit_directional_to,
                                                        .flux = flux_of_directional,
                                                        .unit = LUM_POWER_ILLUMINANCE,
                                                        .from_afar = true};

/* ---- a disc ---- */

/* Square of the sine of the angle that its radius is seen under: a plane that faces radiance 1 from it gets pi times
 * that. */
static float sine_squared(const struct lum_light *l)
{
    float tangent = l->radius / LUM_FAR, t2 = tangent * tangent;
    return t2 / (1.0f + t2);
}

/* What of it is below the horizon where it touches it is not cut off: the sun does so for two minutes a day. */
static struct lum_irradiance far_disc_irradiance(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n)
{
    (void)p;
    float cosine = lum_max(-lum_dot(l->n, n), 0.0f);
    return (struct lum_irradiance){LUM_PI * sine_squared(l) * cosine, cosine};
}

/* A direction of its light, and the irradiance that all of it would be, were it all from there. */
static struct lum_vec3 draw_far_disc(const struct lum_light *l, struct lum_vec2 u, struct lum_rgb *ret_irradiance)
{
    struct lum_vec3 to = lum_normalize(lum_v3_neg(lum_disc_point(l, lum_warp_disc(u))));
    float cosine = lum_dot(to, l->n), distance = LUM_FAR / cosine;
    *ret_irradiance = lum_grey(l->area * cosine / (distance * distance));
    return to;
}

static bool emit_far_disc(const struct lum_snapshot *s, const struct lum_light *l, const struct lum_portals *portals,
                          struct lum_vec2 u_position, struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    struct lum_rgb irradiance;
    struct lum_vec3 to = draw_far_disc(l, u_direction, &irradiance);
    return emit_parallel(s, to, irradiance, portals, u_position, ret);
}

static bool emit_far_disc_to(const struct lum_snapshot *s, const struct lum_light *l, const struct lum_portals *portals,
                             struct lum_vec3 p, struct lum_vec2 u, struct lum_light_ray *ret, float *ret_pdf_sa)
{
    struct lum_rgb irradiance;
    struct lum_vec3 to = draw_far_disc(l, u, &irradiance);
    return emit_parallel_to(s, to, irradiance, portals, p, ret, ret_pdf_sa);
}

static double flux_of_far_disc(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    return LUM_PI_D * (double)sine_squared(l) * flux_of_directional(l, bounds_lo, bounds_hi);
}

const struct lum_emitter_row lum_emitter_far_disc = {.pdf = lum_emitter_pdf_by_area,
                                                     .place = lum_disc_place,
                                                     .emit_from_afar = emit_far_disc,
                                                     .emit_to = emit_far_disc_to,
                                                     .flux = flux_of_far_disc,
                                                     .irradiance = far_disc_irradiance,
                                                     .across = lum_round_across,
                                                     .shape = &lum_shape_disc,
                                                     .at = lum_disc_at,
                                                     .from_afar = true};

/* ---- environment ---- */

bool lum_environment_sample(const struct lum_light *l, struct lum_vec2 u, struct lum_light_sample *ret)
{
    if (!l->env) {
        *ret = (struct lum_light_sample){lum_warp_cone(u, 2.0f), INFINITY, l->power, 0.25f * LUM_INV_PI};
        return true;
    }
    struct lum_vec3 d;
    float pdf;
    if (!lum_env_map_sample(l->env, u, &d, &pdf))
        return false;
    *ret = (struct lum_light_sample){lum_frame_to_scene(&l->frame, d), INFINITY,
                                     lum_rgb_mul(l->power, lum_env_map_radiance(l->env, d)), pdf};
    return true;
}

/* Luminance of the brightest texel, in means. Where it is less, light comes from more than a sixteenth of the sphere, a
 * disc 58 degrees across: its shadows have no edges that would be lost between records. */
#define EVEN_PEAK 16.0

bool lum_light_is_even_sky(const struct lum_light *l)
{
    return l->kind == &lum_emitter_environment && (!l->env || lum_env_map_peak(l->env) <= EVEN_PEAK);
}

struct lum_rgb lum_sky_radiance(const struct lum_light *l, struct lum_vec3 d)
{
    if (!l->env)
        return l->power;
    return lum_rgb_mul(l->power, lum_env_map_radiance(l->env, lum_frame_to_local(&l->frame, d)));
}

static bool sample_environment(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p,
                               struct lum_vec2 u, struct lum_light_sample *ret)
{
    (void)s, (void)p;
    return lum_environment_sample(l, u, ret);
}

static float pdf_of_environment(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi, float distance,
                                float cos_light)
{
    (void)p, (void)distance, (void)cos_light;
    return l->env ? lum_env_map_pdf(l->env, lum_frame_to_local(&l->frame, wi)) : 0.25f * LUM_INV_PI;
}

/* Nearer to the plane of a portal than this cosine nothing is weighed: the pdf stays finite. */
#define PORTAL_COS_MIN 1e-6f

static float portal_pdf(const struct lum_portals *o, float distance, float cosine, float area)
{
    return distance * distance / (lum_max(cosine, PORTAL_COS_MIN) * area * (float)o->n);
}

float lum_environment_pdf_by_portals(const struct lum_light *l, const struct lum_portals *portals, struct lum_vec3 p,
                                     struct lum_vec3 wi)
{
    float all_around = pdf_of_environment(l, p, wi, 0.0f, 0.0f), aimed = 0.0f;
    struct lum_portal_hit hit;
    if (!portals || portals->n == 0 || !lum_portals_leave(portals, p, wi, &hit))
        return all_around;
    if (lum_portals_is_open(portals, hit.cell))
        aimed = portal_pdf(portals, hit.distance, hit.cosine, hit.area);
    return (1.0f - AIMED) * all_around + AIMED * aimed;
}

/* Towards a point of a portal; p is in the box. */
static bool sample_portal(const struct lum_light *l, const struct lum_portals *o, struct lum_vec3 p, struct lum_vec2 u,
                          struct lum_light_sample *ret)
{
    uint32_t k = (uint32_t)(u.x * (float)o->n);
    u.x = lum_clamp(u.x * (float)o->n - (float)k, 0.0f, LUM_ONE_MINUS);
    struct lum_vec3 inward, d = lum_v3_sub(lum_portals_point(o, o->cell[k], u, &inward), p);
    float distance = lum_length(d);
    if (!(lum_dot(d, inward) < 0.0f))
        return false;
    ret->wi = lum_v3_mul(d, 1.0f / distance);
    ret->distance = INFINITY;
    ret->radiance = lum_sky_radiance(l, ret->wi);
    float area = lum_portals_cell_area(o, o->cell[k] / lum_portals_per_face(o) / 2u);
    ret->pdf_sa = (1.0f - AIMED) * pdf_of_environment(l, p, ret->wi, 0.0f, 0.0f) +
                  AIMED * portal_pdf(o, distance, -lum_dot(ret->wi, inward), area);
    return isfinite(ret->pdf_sa) && ret->pdf_sa > 0.0f;
}

bool lum_environment_sample_by_portals(const struct lum_light *l, const struct lum_portals *portals, struct lum_vec3 p,
                                       struct lum_vec2 u, struct lum_light_sample *ret)
{
    struct lum_portal_hit hit; /* any direction tells whether p is in the box */
    if (!portals || portals->n == 0 || !lum_portals_leave(portals, p, lum_v3(1.0f, 0.0f, 0.0f), &hit))
        return lum_environment_sample(l, u, ret);
    if (!pick_half(&u.x))
        return sample_portal(l, portals, p, u, ret);
    if (!lum_environment_sample(l, u, ret))
        return false;
    ret->pdf_sa = lum_environment_pdf_by_portals(l, portals, p, ret->wi);
    return true;
}

static void aim_at_environment(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                               struct lum_light_target *inout)
{
    (void)s;
    struct lum_light_sample ls;
    if (lum_environment_sample(l, u, &ls))
        *inout = (struct lum_light_target){
            .kind = LUM_TARGET_DIRECTION, .wi = ls.wi, .pdf_sa = ls.pdf_sa, .radiance = ls.radiance};
}

static bool is_constant(const struct lum_light *l)
{
    return !l->env;
}

static struct lum_irradiance even_irradiance(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n)
{
    (void)l, (void)p, (void)n;
    return (struct lum_irradiance){LUM_PI, 2.0f / 3.0f};
}

/* A ray of an environment, and how densely such rays lie: over area across them and solid angle. */
struct sky_ray {
    struct lum_vec3 o, d;
    float density;
};

/* Density of rays from d to all of the box. */
static float density_over_box(const struct lum_light *l, const struct box *b, struct lum_vec3 d)
{
    float to[3] = {d.x, d.y, d.z}, area[3];
    if (!l->env)
        return 1.0f / (2.0f * LUM_PI * (b->face[0] + b->face[1] + b->face[2]));
    seen_faces(b, to, area);
    return lum_env_map_pdf(l->env, lum_frame_to_local(&l->frame, lum_v3_neg(d))) / (area[0] + area[1] + area[2]);
}

/* Of a constant one: the lines through a convex body are even where they start evenly on its surface, by the cosine. */
static bool aim_at_box(const struct lum_light *l, const struct box *b, struct lum_vec2 u_position,
                       struct lum_vec2 u_direction, struct sky_ray *ret)
{
    if (l->env) {
        struct lum_vec3 from;
        float pdf;
        if (!lum_env_map_sample(l->env, u_direction, &from, &pdf))
            return false;
        ret->d = lum_v3_neg(lum_frame_to_scene(&l->frame, from));
        float to[3] = {ret->d.x, ret->d.y, ret->d.z}, area[3];
        seen_faces(b, to, area);
        int axis = pick_axis(area, &u_position.x);
        ret->o = face_point(b, axis, to[axis] > 0.0f ? -1.0f : 1.0f, u_position);
        ret->density = pdf / (area[0] + area[1] + area[2]);
        return true;
    }
    int axis = pick_axis(b->face, &u_position.x);
    float side = u_position.y < 0.5f ? -1.0f : 1.0f;
    u_position.y = lum_min(side < 0.0f ? 2.0f * u_position.y : 2.0f * u_position.y - 1.0f, LUM_ONE_MINUS);
    struct lum_vec3 inward = lum_v3(axis == 0 ? -side : 0.0f, axis == 1 ? -side : 0.0f, axis == 2 ? -side : 0.0f);
    struct lum_frame f = lum_frame_from_normal(inward);
    ret->o = face_point(b, axis, side, u_position);
    ret->d = lum_frame_to_scene(&f, lum_warp_cosine(u_direction));
    ret->density = density_over_box(l, b, ret->d);
    return true;
}

/* The same through the open cells, which are one as likely as another. */
static float density_through(const struct lum_portals *o, const struct sky_ray *ray)
{
    struct lum_portal_hit hit;
    bool enters = lum_portals_enter(o, ray->o, ray->d, &hit) && lum_portals_is_open(o, hit.cell);
    return enters ? 1.0f / (LUM_PI * (float)o->n * hit.area) : 0.0f;
}

static struct sky_ray aim_at_portals(const struct lum_portals *o, const struct box *b, struct lum_vec2 u_position,
                                     struct lum_vec2 u_direction)
{
    uint32_t k = (uint32_t)(u_position.x * (float)o->n);
    u_position.x = lum_clamp(u_position.x * (float)o->n - (float)k, 0.0f, LUM_ONE_MINUS);
    struct lum_vec3 inward, x = lum_portals_point(o, o->cell[k], u_position, &inward);
    struct lum_frame f = lum_frame_from_normal(inward);
    struct sky_ray ray = {.d = lum_frame_to_scene(&f, lum_warp_cosine(u_direction))};
    ray.o = back_to_face(b, x, ray.d);
    ray.density = 1.0f / (LUM_PI * (float)o->n * lum_portals_cell_area(o, o->cell[k] / lum_portals_per_face(o) / 2u));
    return ray;
}

/* From d, per unit of power. */
static struct lum_rgb radiance_of_environment(const struct lum_light *l, struct lum_vec3 d)
{
    return l->env ? lum_env_map_radiance(l->env, lum_frame_to_local(&l->frame, d)) : lum_grey(1.0f);
}

static bool emit_environment(const struct lum_snapshot *s, const struct lum_light *l, const struct lum_portals *portals,
                             struct lum_vec2 u_position, struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    struct box b = box_around(s->bounds_lo, s->bounds_hi);
    struct sky_ray ray;
    bool aims = portals && portals->n > 0;
    if (aims && !pick_half(&u_position.x)) {
        ray = aim_at_portals(portals, &b, u_position, u_direction);
        ray.density = AIMED * ray.density + (1.0f - AIMED) * density_over_box(l, &b, ray.d);
    } else {
        if (!aim_at_box(l, &b, u_position, u_direction, &ray))
            return false;
        if (aims)
            ray.density = (1.0f - AIMED) * ray.density + AIMED * density_through(portals, &ray);
    }
    return emit_from_afar(ray.o, ray.d, radiance_of_environment(l, lum_v3_neg(ray.d)), ray.density, ret);
}

static bool emit_environment_to(const struct lum_snapshot *s, const struct lum_light *l,
                                const struct lum_portals *portals, struct lum_vec3 p, struct lum_vec2 u,
                                struct lum_light_ray *ret, float *ret_pdf_sa)
{
    struct box b = box_around(s->bounds_lo, s->bounds_hi);
    struct lum_light_sample ls;
    if (!lum_environment_sample(l, u, &ls))
        return false;
    struct sky_ray ray = {.o = p, .d = lum_v3_neg(ls.wi)};
    ray.density = density_over_box(l, &b, ray.d);
    if (portals && portals->n > 0)
        ray.density = (1.0f - AIMED) * ray.density + AIMED * density_through(portals, &ray);
    *ret_pdf_sa = ls.pdf_sa;
    return emit_from_afar(back_to_face(&b, p, ray.d), ray.d, radiance_of_environment(l, ls.wi), ray.density, ret);
}

static float emit_environment_to_pdf(const struct lum_light *l, struct lum_vec3 wi)
{
    return pdf_of_environment(l, wi, wi, 0.0f, 0.0f);
}

static double flux_of_environment(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    struct box b = box_around(bounds_lo, bounds_hi);
    return 2.0 * LUM_PI_D * (double)(b.face[0] + b.face[1] + b.face[2]) *
           (l->env ? lum_env_map_mean_luminance(l->env) : 1.0);
}

const struct lum_emitter_row lum_emitter_environment = {.sample = sample_environment,
                                                        .pdf = pdf_of_environment,
                                                        .aim = aim_at_environment,
                                                        .emit_from_afar = emit_environment,
                                                        .emit_to = emit_environment_to,
                                                        .emit_to_pdf = emit_environment_to_pdf,
                                                        .flux = flux_of_environment,
                                                        .has_irradiance = is_constant,
                                                        .irradiance = even_irradiance,
                                                        .from_afar = true};
