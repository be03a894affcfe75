/* A method: which estimator serves which effect. */
#ifndef LUM_CORE_PASS_METHOD_H
#define LUM_CORE_PASS_METHOD_H

#include "core/trace/demand.h"

struct lum_estimator;  /* pass/pass.h */
struct lum_ais;        /* effect/ais/ais.h */
struct lum_cache_kind; /* cache/kind.h */

struct lum_method {
    const char *name, *summary;
    bool progressive; /* each pass adds samples; else one pass is the whole answer */
    bool refines; /* the first pass is a whole answer; while nothing changes, further ones path trace, and take over. It
                   * has a cache or filters: the frame is corrected along the surfaces that these know */
    const struct lum_estimator *serves[LUM_EFFECT_COUNT]; /* of others lum_method_serves tells; never NULL of direct
                                                           * light, which also shows what shines by itself */
    const struct lum_ais *ais;                            /* interleaved sampling: its parameters; NULL: none */
    bool hard_shadows; /* of quads, discs and spheres, too: one shadow ray per light and pixel (thesis, 6.3) */
    const struct lum_cache_kind *cache;     /* what its indirect light is kept in; NULL: nothing */
    uint32_t pattern;                       /* methods with components: side of the interleaved pattern */
    const struct lum_estimator *filters[3]; /* methods with components: how they become smooth, one after the other */
};

/* Who serves an effect: the one that the method's row names, or the usual one of the effect's row. NULL: the method
 * leaves this effect out. */
static inline const struct lum_estimator *lum_method_serves(const struct lum_method *method, enum lum_effect e)
{
    bool usual = !method->progressive && !method->refines;
    return method->serves[e] || !usual ? method->serves[e] : lum_effect_rows[e]->usual;
}

#endif
