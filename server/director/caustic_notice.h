/* What no method shows of the light that mirrors and solid glass focus (vpl/caustic.h), in words. */
#ifndef LUM_SERVER_DIRECTOR_CAUSTIC_NOTICE_H
#define LUM_SERVER_DIRECTOR_CAUSTIC_NOTICE_H

#include "core/vpl/caustic.h"

#define LUM_CAUSTIC_TOLD 0.005 /* share of a lamp's light, or of all of them, from which on it is told */

struct lum_caustic_notice {
    char why[320];  /* "3.1 % of the light of sun is in no picture: ..."; empty: too little to tell, or not sure */
    char mend[320]; /* what can be done about it; empty with why */
};
struct lum_caustic_notice lum_caustic_notice(const struct lum_caustic_report *report);

#endif
