/* What a product of a view was made of, and which edits there were since (trace/stale.h). */
#ifndef LUM_CORE_PASS_BASIS_H
#define LUM_CORE_PASS_BASIS_H

#include "core/pass/settings.h"
#include "core/trace/stale.h"

/* Zeroed: it is not made. */
struct lum_basis {
    bool valid;
    struct lum_versions versions;
    struct lum_view_settings settings;
    bool on[LUM_EFFECT_COUNT];
};
struct lum_pass;
/* Edits since; it now stands for the pass. All of them where there was nothing. */
uint32_t lum_basis_renew(struct lum_basis *basis, const struct lum_pass *pass);

#endif
