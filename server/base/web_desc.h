/* The web of a record in the renderer's terms. */
#ifndef LUM_SERVER_BASE_WEB_DESC_H
#define LUM_SERVER_BASE_WEB_DESC_H

#include <string.h>

#include "core/light/web.h"
#include "protocol/record/web.h"

/* Arrays are borrowed from the record's web. */
static inline struct lum_web_desc lum_web_desc_of(const struct lum_record_web *web)
{
    static const char types[] = "cba"; /* as enum lum_web_type */
    return (struct lum_web_desc){.type = (enum lum_web_type)(strchr(types, web->type[0]) - types),
                                 .n_c = (uint32_t)web->c_deg.n,
                                 .n_gamma = (uint32_t)web->gamma_deg.n,
                                 .c_deg = web->c_deg.f32,
                                 .gamma_deg = web->gamma_deg.f32,
                                 .candela = web->candela.f32};
}

#endif
