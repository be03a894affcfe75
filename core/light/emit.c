/* Sampling what lights emit. */
#include "core/light/emitter.h"

#include "core/accel/trace.h"
#include "core/math/warp.h"
#include "core/scene/snapshot.h"

bool lum_emit_ray(struct lum_vec3 o, struct lum_vec3 d, struct lum_rgb flux, struct lum_light_ray *ret)
{
    if (lum_rgb_black(flux))
        return false;
    *ret = (struct lum_light_ray){o, d, flux, 0.0f};
    return true;
}

bool lum_emit_surface(struct lum_vec3 p, struct lum_vec3 n, struct lum_vec2 u, struct lum_rgb flux,
                      struct lum_light_ray *ret)
{
    struct lum_frame f = lum_frame_from_normal(n);
    return lum_emit_ray(lum_ray_offset(p, n), lum_frame_to_scene(&f, lum_warp_cosine(u)), flux, ret);
}

bool lum_light_emit(const struct lum_snapshot *s, uint32_t i, const struct lum_portals *portals,
                    struct lum_vec2 u_position, struct lum_vec2 u_direction, struct lum_light_ray *ret_shot)
{
    const struct lum_light *l = &s->lights.lights[i];
    const struct lum_emitter_row *row = l->kind;
    return row->emit ? row->emit(s, l, u_position, u_direction, ret_shot)
                     : row->emit_from_afar(s, l, portals, u_position, u_direction, ret_shot);
}

bool lum_light_emit_to(const struct lum_snapshot *s, uint32_t i, const struct lum_portals *portals, struct lum_vec3 p,
                       struct lum_vec2 u, struct lum_light_ray *ret_shot, float *ret_pdf_sa)
{
    const struct lum_light *l = &s->lights.lights[i];
    const struct lum_emitter_row *row = l->kind;
    return row->emit_to && row->emit_to(s, l, portals, p, u, ret_shot, ret_pdf_sa);
}

float lum_light_emit_to_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 wi)
{
    const struct lum_light *l = &s->lights.lights[i];
    const struct lum_emitter_row *row = l->kind;
    return row->emit_to_pdf ? row->emit_to_pdf(l, wi) : 1.0f;
}

double lum_light_flux_unit(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi)
{
    const struct lum_emitter_row *row = l->kind;
    return row->flux ? row->flux(l, bounds_lo, bounds_hi) : LUM_PI_D * (double)l->area;
}
