/* Luminous openings of lamps with a photometric web: rectangles and discs, of which every point sends light as the web
 * says, so that from afar it is the web's. Of luminance I / (A cos), where I is the intensity towards who looks, and A
 * cos what he sees of the area: it is flat, and shines from both sides. */
#include "core/light/emitter.h"

#include "core/accel/trace.h"
#include "core/light/web.h"
#include "core/math/warp.h"

/* Nearer to its plane than this cosine, 0.9 degrees, an opening is as bright as at it: there luminance has no end, and
 * next to none of the light goes. */
#define LEAST_COS 0x1p-6f

float lum_opening_radiance(const struct lum_light *l, struct lum_vec3 wi)
{
    float cos_light = fabsf(lum_dot(wi, l->n));
    return lum_falloff_web.share(l, wi) / (l->area * lum_max(cos_light, LEAST_COS));
}

static struct lum_vec3 point_of(const struct lum_light *l, struct lum_vec2 u)
{
    return l->kind == &lum_emitter_opening_disc ? lum_disc_point(l, lum_warp_disc(u)) : lum_quad_point(l, u);
}

static bool place_on_opening(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                             struct lum_light_place *ret)
{
    (void)s;
    *ret = (struct lum_light_place){point_of(l, u), l->n, lum_grey(1.0f)};
    return true;
}

/* Each point has a sample of its own: what comes from one place differs by direction. */
static void aim_at_opening(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                           struct lum_light_target *inout)
{
    (void)s, (void)l, (void)u;
    inout->kind = LUM_TARGET_EACH;
}

static bool emit_opening(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                         struct lum_vec2 u_direction, struct lum_light_ray *ret)
{
    (void)s;
    struct lum_vec3 d = lum_falloff_web.draw(l, u_direction), p = point_of(l, u_position);
    struct lum_vec3 side = lum_dot(d, l->n) < 0.0f ? lum_v3_neg(l->n) : l->n;
    return lum_emit_ray(lum_ray_offset(p, side), d, lum_grey((float)l->web->flux_sr), ret);
}

static double flux_of_opening(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    (void)bounds_lo, (void)bounds_hi;
    return l->web->flux_sr;
}

/* All around, and as much anywhere: what a web says of one direction is not asked. */
static struct lum_light_reach reach_of_opening(const struct lum_light *l)
{
    bool round = l->kind == &lum_emitter_opening_disc;
    return (struct lum_light_reach){
        .centre = l->p,
        .radius = round ? l->radius : fmaxf(lum_length(lum_v3_add(l->u, l->v)), lum_length(lum_v3_sub(l->u, l->v))),
        .axis = l->n,
        .cos_faced = -1.0f,
        .intensity = (float)l->web->flux_sr * 0.25f * LUM_INV_PI};
}

const struct lum_emitter_row lum_emitter_opening_rectangle = {.reach = reach_of_opening,
                                                              .pdf = lum_emitter_pdf_by_area,
                                                              .place = place_on_opening,
                                                              .aim = aim_at_opening,
                                                              .emit = emit_opening,
                                                              .flux = flux_of_opening,
                                                              .unit = LUM_POWER_INTENSITY,
                                                              .half = lum_quad_half,
                                                              .across = lum_quad_across,
                                                              .shape = &lum_shape_quad,
                                                              .at = lum_quad_at};
const struct lum_emitter_row lum_emitter_opening_disc = {.reach = reach_of_opening,
                                                         .pdf = lum_emitter_pdf_by_area,
                                                         .place = place_on_opening,
                                                         .aim = aim_at_opening,
                                                         .emit = emit_opening,
                                                         .flux = flux_of_opening,
                                                         .unit = LUM_POWER_INTENSITY,
                                                         .half = lum_round_half,
                                                         .across = lum_round_across,
                                                         .shape = &lum_shape_disc,
                                                         .at = lum_disc_at};
