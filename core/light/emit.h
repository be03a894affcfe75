/* Light that leaves a light, for paths that start there. */
#ifndef LUM_CORE_LIGHT_EMIT_H
#define LUM_CORE_LIGHT_EMIT_H

#include <stdbool.h>
#include <stdint.h>

#include "core/math/rgb.h"
#include "core/math/vec.h"

struct lum_light;
struct lum_portals;
struct lum_snapshot;

struct lum_light_ray {
    struct lum_vec3 o, d;     /* d: unit. o: off the emitter's surface, ready to trace */
    struct lum_rgb flux_unit; /* per unit of power; its mean over both u is the light's flux */
    float density;            /* of light from afar: of such rays, over area across them and, but for parallel light
                               * and discs, solid angle */
};
/* Position and direction in proportion to what is emitted, so that every shot carries the same flux, but for textures,
 * images and colour. Light from afar enters through the box around the scene: directional light is uniform over the
 * faces that it sees, a constant environment is a box that shines inwards; with portals (NULL: none) half of it is
 * aimed at them. False: nothing leaves there. Thread: any. */
bool lum_light_emit(const struct lum_snapshot *s, uint32_t i, const struct lum_portals *portals,
                    struct lum_vec2 u_position, struct lum_vec2 u_direction, struct lum_light_ray *ret_shot);
/* Of light from afar, the ray that ends at p, in a direction drawn by u as light arrives there: as lum_light_emit might
 * have made it, with its flux and density; and over solid angle the density of the draw, 1 where density has none. */
bool lum_light_emit_to(const struct lum_snapshot *s, uint32_t i, const struct lum_portals *portals, struct lum_vec3 p,
                       struct lum_vec2 u, struct lum_light_ray *ret_shot, float *ret_pdf_sa);
/* And over solid angle the density with which that would draw direction wi, to the light. */
float lum_light_emit_to_pdf(const struct lum_snapshot *s, uint32_t i, struct lum_vec3 wi);
/* Flux of a light per unit of power: the mean luminance of flux_unit.
 * bounds: of all geometry; lo > hi when there is none. */
double lum_light_flux_unit(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi);
/* Likewise of a mesh emitter of this area, in whatever unit. */
double lum_mesh_light_flux(const struct lum_light *l, double area);

#endif
