/* What lighting designers ask of a photometric web. */
#ifndef LUM_CORE_LIGHT_WEB_FACTS_H
#define LUM_CORE_LIGHT_WEB_FACTS_H

#include "core/light/web.h"

enum lum_web_symmetry {
    LUM_WEB_AXIAL,    /* the same all around */
    LUM_WEB_QUADRANT, /* about both of the next two planes */
    LUM_WEB_ABOUT_C0, /* about the plane through c 0 and c 180 */
    LUM_WEB_ABOUT_C90,
    LUM_WEB_LOPSIDED
};
extern const char *const lum_web_symmetry_names[]; /* "axial" "quadrant" "c0-c180" "c90-c270" "none" */

struct lum_web_facts {
    double flux_lm, peak_cd;
    double peak_c_deg, peak_gamma_deg; /* where it is brightest: of type C, c and gamma; else likewise, from its beam */
    double up;                         /* share of the flux that goes away from where it aims */
    /* Angle between the outermost directions of at least a half, and a tenth, of the brightest one in the plane through
     * c 0 and c 180, and in that through c 90 and c 270; around the beam, or if most light goes up around its back */
    double beam_deg[2], field_deg[2];
    enum lum_web_symmetry symmetry;
};
void lum_web_facts(const struct lum_web *web, struct lum_web_facts *ret_facts);

/* Intensity, cd, at an angle (deg, 0 to 180) from where it aims, in the half plane c 0, 90, 180 or 270. */
double lum_web_polar_cd(const struct lum_web *web, double c_deg, double gamma_deg);

#endif
