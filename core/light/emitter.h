/* What tells emitters apart at render time: a row of functions, in a file of its own. What they share is below. */
#ifndef LUM_CORE_LIGHT_EMITTER_H
#define LUM_CORE_LIGHT_EMITTER_H

#include "core/accel/accel.h"
#include "core/light/emit.h"
#include "core/light/irradiance.h"
#include "core/light/light.h"
#include "core/light/sample.h"
#include "core/light/tree.h"

struct lum_portals;

/* What the power of an emitter is measured in. */
enum lum_power_unit { LUM_POWER_LUMINANCE, LUM_POWER_INTENSITY, LUM_POWER_ILLUMINANCE };

#define LUM_ONE_MINUS 0x1.fffffep-1f /* the largest float below 1 */

struct lum_emitter_row {
    /* lum_light_sample_at and lum_light_aim (NULL: by place, or each point by itself), lum_light_pdf (NULL: 0),
     * lum_light_even_pdf (NULL: 0), lum_light_place (NULL: none) */
    bool (*sample)(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec3 p, struct lum_vec2 u,
                   struct lum_light_sample *ret_sample);
    float (*pdf)(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi, float distance, float cos_light);
    float (*even_pdf)(const struct lum_light *l, struct lum_vec3 p);
    void (*aim)(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                struct lum_light_target *inout_target);
    bool (*place)(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                  struct lum_light_place *ret_place);
    /* lum_light_emit (one of the two), lum_light_flux_unit (NULL: pi times the area) */
    bool (*emit)(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u_position,
                 struct lum_vec2 u_direction, struct lum_light_ray *ret_shot);
    bool (*emit_from_afar)(const struct lum_snapshot *s, const struct lum_light *l, const struct lum_portals *portals,
                           struct lum_vec2 u_position, struct lum_vec2 u_direction, struct lum_light_ray *ret_shot);
    /* of light from afar: lum_light_emit_to, lum_light_emit_to_pdf (NULL: 1) */
    bool (*emit_to)(const struct lum_snapshot *s, const struct lum_light *l, const struct lum_portals *portals,
                    struct lum_vec3 p, struct lum_vec2 u, struct lum_light_ray *ret_shot, float *ret_pdf_sa);
    float (*emit_to_pdf)(const struct lum_light *l, struct lum_vec3 wi);
    double (*flux)(const struct lum_light *l, struct lum_vec3 bounds_lo, struct lum_vec3 bounds_hi);
    /* lum_light_irradiance, at one point or at many. Both NULL: there is no closed form; has NULL: there always is */
    bool (*has_irradiance)(const struct lum_light *l);
    struct lum_irradiance (*irradiance)(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n);
    void (*irradiances)(const struct lum_light *l, uint32_t n_points, const struct lum_vec3 *p,
                        const struct lum_vec3 *n, struct lum_irradiance *ret);
    /* Where it is and shines to (tree.h). NULL: nowhere, or a mesh, of which the scene knows. */
    struct lum_light_reach (*reach)(const struct lum_light *l);
    /* Half the box that it fills around p. NULL: it is from afar, or shines from inside other things, too. */
    struct lum_vec3 (*half)(const struct lum_light *l);
    /* Of what rays can meet; across NULL: of nothing. How wide it is at its narrowest, as what it is traced, and the
     * point of a hit, of which ng is the normal there (any length; it becomes a unit). */
    float (*across)(const struct lum_light *l);
    const struct lum_accel_shape_row *shape;
    struct lum_vec3 (*at)(const struct lum_light *l, struct lum_vec2 uv, struct lum_vec3 *inout_ng);
    enum lum_power_unit unit; /* cd/m2, or: cd of a point, lx of light from one direction */
    bool from_afar;           /* it is nowhere */
    bool flat;                /* it shines from one side of the plane through p */
};

/* ---- emitters with area (light.c) ---- */

/* Solid-angle pdf of a point sampled uniformly over area. 0 when it is not lit from there, or not finite. */
float lum_emitter_area_pdf(float distance, float cos_light, float area);
float lum_emitter_pdf_by_area(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 wi, float distance,
                              float cos_light);
/* Finishes a sample at point x of an emitter that is sampled by area; cos_light is taken on all sides that shine. */
bool lum_emitter_area_sample(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 x, struct lum_vec3 n,
                             struct lum_light_sample *ret_sample);
struct lum_light_target lum_emitter_target(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n);
static inline bool lum_emitter_in_front(const struct lum_light *l, struct lum_vec3 p)
{
    return lum_dot(lum_v3_sub(p, l->p), l->n) > 0.0f;
}

/* For rows of what has the shape of a disc (d: in the unit disc), of a sphere, or of a quad. */
struct lum_vec3 lum_disc_point(const struct lum_light *l, struct lum_vec2 d);
bool lum_disc_place(const struct lum_snapshot *s, const struct lum_light *l, struct lum_vec2 u,
                    struct lum_light_place *ret);
struct lum_vec3 lum_disc_at(const struct lum_light *l, struct lum_vec2 uv, struct lum_vec3 *inout_ng);
struct lum_vec3 lum_round_half(const struct lum_light *l);
float lum_round_across(const struct lum_light *l);
struct lum_vec3 lum_quad_point(const struct lum_light *l, struct lum_vec2 u);
struct lum_vec3 lum_quad_at(const struct lum_light *l, struct lum_vec2 uv, struct lum_vec3 *inout_ng);
struct lum_vec3 lum_quad_half(const struct lum_light *l);
float lum_quad_across(const struct lum_light *l);

/* Meshes of few triangles, as seen from near (mesh.c). False: p is not near, or l is another light. */
bool lum_mesh_look(const struct lum_light *l, struct lum_vec3 p, struct lum_facets_view *ret_view);
bool lum_mesh_sample(const struct lum_light *l, struct lum_vec3 p, const struct lum_facets_view *view,
                     struct lum_vec2 u, struct lum_light_sample *ret_sample);

/* Radiance per unit of power from a lamp's opening to where wi (unit) points to it from (opening.c). */
float lum_opening_radiance(const struct lum_light *l, struct lum_vec3 wi);

/* ---- light that leaves (emit.c) ---- */

bool lum_emit_ray(struct lum_vec3 o, struct lum_vec3 d, struct lum_rgb flux, struct lum_light_ray *ret_shot);
bool lum_emit_surface(struct lum_vec3 p, struct lum_vec3 n, struct lum_vec2 u, struct lum_rgb flux,
                      struct lum_light_ray *ret_shot);

struct lum_rgb lum_sky_radiance(const struct lum_light *l, struct lum_vec3 d); /* from direction d */

/* ---- lum_light_irradiance (irradiance.c) ---- */

void lum_quad_irradiances(const struct lum_light *l, uint32_t n_points, const struct lum_vec3 *p,
                          const struct lum_vec3 *n, struct lum_irradiance *ret);
struct lum_irradiance lum_disc_irradiance(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n);
struct lum_irradiance lum_sphere_irradiance(const struct lum_light *l, struct lum_vec3 p, struct lum_vec3 n);

#endif
