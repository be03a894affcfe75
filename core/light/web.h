/* Photometric webs: the luminous intensity of a lamp by direction, as goniometers measure it. Immutable, and shared by
 * all lights that have the same. */
#ifndef LUM_CORE_LIGHT_WEB_H
#define LUM_CORE_LIGHT_WEB_H

#include "core/base/base.h"
#include "core/math/vec.h"

/* How the goniometer turned (LM-63). The lamp aims along d, its length lies along c0 (unit, at right angles), and
 * c90 = c0 x d. A direction is sin(gamma) (cos(c) x + sin(c) y) + cos(gamma) z:
 *   C  z = d,    x = c0, y = c90    what luminaires are measured in: gamma 0 is where the lamp aims
 *   B  z = -c90, x = d,  y = c0     floodlights: c is their vertical angle, gamma 90 degrees less the horizontal one
 *   A  z = c0,   x = d,  y = -c90   headlights: c is their horizontal angle, gamma 90 degrees less the vertical one */
enum lum_web_type { LUM_WEB_C, LUM_WEB_B, LUM_WEB_A };

/* Angles in degrees, ascending: c over at most 360, or one, for a web that is the same all around; gamma from 0 to 180.
 * candela: n_gamma values of each c. Arrays are borrowed. */
struct lum_web_desc {
    enum lum_web_type type;
    uint32_t n_c, n_gamma;
    const float *c_deg, *gamma_deg, *candela;
};

#define LUM_WEB_VALUES_MAX (1u << 18) /* half a degree in all directions */

/* Between the angles intensity is linear in both; beyond the first and the last it is 0. */
struct lum_web {
    struct lum_refs refs;
    enum lum_web_type type;
    uint32_t n_c, n_gamma; /* at least 2 */
    float *c, *gamma;      /* rad */
    float *share;          /* n_gamma of each c: intensity over peak_cd */
    float *bands;          /* n_gamma - 1 prefix sums: share of the flux up to gamma[i + 1]; the last is 1 */
    float *cells;          /* of each band n_c - 1: share of the band's flux up to c[i + 1]; the last is 1 */
    bool closed;           /* c goes all around */
    double peak_cd;
    double flux_sr; /* flux per peak_cd: the exact integral of what lum_web_share says */
    uint64_t hash;  /* of all that tells webs apart */
};

/* Refuses what lum_web_desc does not allow, and a web without light. One reference is the caller's. */
LUM_MUST_USE enum lum_status lum_web_create(const struct lum_web_desc *desc, struct lum_web **ret_web,
                                            struct lum_error *err);
struct lum_web *lum_web_ref(const struct lum_web *web);
void lum_web_unref(const struct lum_web *web); /* accepts NULL. Thread: any */
uint64_t lum_web_desc_hash(const struct lum_web_desc *desc);

/* Intensity over that of the brightest direction; rad. */
float lum_web_share(const struct lum_web *web, float c, float gamma);
/* The same where d (unit) is x, y, z of its frame. */
float lum_web_share_along(const struct lum_web *web, struct lum_vec3 d);
/* A direction (unit) in that frame, of density lum_web_share / flux_sr over solid angle. */
struct lum_vec3 lum_web_draw(const struct lum_web *web, struct lum_vec2 u);
/* The frame of a lamp that aims along d, with c0 at right angles: t, b, n are x, y, z. It is left-handed. */
struct lum_frame lum_web_frame(enum lum_web_type type, struct lum_vec3 d, struct lum_vec3 c0);

#endif
