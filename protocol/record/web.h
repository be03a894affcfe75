/* The photometric web of a light, as a file has it. Read whole, never changed: copies of a record share it. */
#ifndef LUM_PROTOCOL_RECORD_WEB_H
#define LUM_PROTOCOL_RECORD_WEB_H

#include <stdatomic.h>

#include "protocol/base/value.h"
#include "protocol/record/bulk.h"

struct lum_record_web {
    _Atomic uint32_t refs;
    char name[128];
    char type[4];                                /* "c" "b" "a": of photometry (core/light/web.h) */
    struct lum_floats c_deg, gamma_deg, candela; /* f32 */
    char opening[12];                            /* "point" "rectangle" "disc" "sphere" */
    double size[3];                              /* m: of the opening along c0, along c90, and its height */
    struct lum_opt rated_lm;                     /* of its lamps; not set: absolute photometry */
    struct lum_opt watts;
};

struct lum_record_web *lum_record_web_create(void); /* with defaults; NULL when memory is short */
struct lum_record_web *lum_record_web_ref(struct lum_record_web *web);
void lum_record_web_unref(struct lum_record_web *web);                                     /* accepts NULL */
bool lum_record_web_equal(const struct lum_record_web *a, const struct lum_record_web *b); /* accepts NULL */
size_t lum_record_web_bytes(const struct lum_record_web *web);                             /* accepts NULL */

struct lum_proto_error;
/* How its arrays fit together: err names them without the field that holds the web. */
bool lum_record_web_validate(const struct lum_record_web *web, struct lum_proto_error *err);

#endif
