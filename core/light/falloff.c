#include "core/light/falloff.h"

#include "core/light/light.h"
#include "core/light/web.h"
#include "core/math/warp.h"

/* ---- even ---- */

static float even_share(const struct lum_light *l, struct lum_vec3 wi)
{
    (void)l, (void)wi;
    return 1.0f;
}

static double even_flux(const struct lum_light *l)
{
    (void)l;
    return 4.0 * LUM_PI_D;
}

static struct lum_vec3 even_draw(const struct lum_light *l, struct lum_vec2 u)
{
    (void)l;
    return lum_warp_cone(u, 2.0f);
}

const struct lum_falloff lum_falloff_even = {even_share, even_flux, even_draw, .cone = false};

/* ---- spot ---- */

/* Between the cones the square of a ramp in the cosine (glTF KHR_lights_punctual). */
float lum_spot_share(const struct lum_light *l, float one_minus_cos)
{
    if (one_minus_cos <= l->omc_inner)
        return 1.0f;
    if (!(one_minus_cos < l->omc_outer))
        return 0.0f;
    float ramp = (l->omc_outer - one_minus_cos) / (l->omc_outer - l->omc_inner);
    return ramp * ramp;
}

/* 1 - cos of the angle between -wi and the axis, both unit, without cancellation: half the square of the chord. */
static float spot_share(const struct lum_light *l, struct lum_vec3 wi)
{
    struct lum_vec3 chord = lum_v3_add(wi, l->n);
    return lum_spot_share(l, 0.5f * lum_dot(chord, chord));
}

static double spot_flux(const struct lum_light *l)
{
    return (double)(2.0f * LUM_PI * (2.0f * l->omc_inner + l->omc_outer) / 3.0f);
}

/* Evenly in the inner cone, whose share of the flux is 3 inner / (2 inner + outer), and by the inverse of the ramp's
 * integral, a cube, outside. */
static struct lum_vec3 spot_draw(const struct lum_light *l, struct lum_vec2 u)
{
    float inner = l->omc_inner, outer = l->omc_outer, share = 3.0f * inner / (2.0f * inner + outer);
    float omc = u.x < share ? u.x / share * inner
                            : outer - (outer - inner) * cbrtf(lum_clamp((1.0f - u.x) / (1.0f - share), 0.0f, 1.0f));
    float s = sqrtf(lum_max(omc * (2.0f - omc), 0.0f)), phi = 2.0f * LUM_PI * u.y;
    struct lum_frame f = lum_frame_from_normal(l->n);
    return lum_frame_to_scene(&f, lum_v3(s * cosf(phi), s * sinf(phi), 1.0f - omc));
}

const struct lum_falloff lum_falloff_spot = {spot_share, spot_flux, spot_draw, .cone = true};

/* ---- a web ---- */

static float web_share(const struct lum_light *l, struct lum_vec3 wi)
{
    return lum_web_share_along(l->web, lum_frame_to_local(&l->frame, lum_v3_neg(wi)));
}

static double web_flux(const struct lum_light *l)
{
    return l->web->flux_sr;
}

static struct lum_vec3 web_draw(const struct lum_light *l, struct lum_vec2 u)
{
    return lum_normalize(lum_frame_to_scene(&l->frame, lum_web_draw(l->web, u)));
}

const struct lum_falloff lum_falloff_web = {web_share, web_flux, web_draw, .cone = false};
