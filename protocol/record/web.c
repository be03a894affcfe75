#include "protocol/record/web.h"

#include <stdlib.h>

#include "protocol/record/field.h"

struct lum_record_web *lum_record_web_create(void)
{
    struct lum_record_web *web = calloc(1, sizeof *web);
    if (!web)
        return NULL;
    atomic_init(&web->refs, 1u);
    for (size_t i = 0; i < lum_web_fields.n; i++)
        lum_field_reset(&lum_web_fields.fields[i], web);
    return web;
}

struct lum_record_web *lum_record_web_ref(struct lum_record_web *web)
{
    atomic_fetch_add_explicit(&web->refs, 1u, memory_order_relaxed);
    return web;
}

void lum_record_web_unref(struct lum_record_web *web)
{
    if (!web || atomic_fetch_sub_explicit(&web->refs, 1u, memory_order_acq_rel) != 1u)
        return;
    for (size_t i = 0; i < lum_web_fields.n; i++)
        if (lum_field_is_bulk(&lum_web_fields.fields[i]))
            lum_field_reset(&lum_web_fields.fields[i], web);
    free(web);
}

bool lum_record_web_equal(const struct lum_record_web *a, const struct lum_record_web *b)
{
    if (a == b || !a || !b)
        return a == b;
    for (size_t i = 0; i < lum_web_fields.n; i++)
        if (!lum_field_equal(&lum_web_fields.fields[i], a, b))
            return false;
    return true;
}

size_t lum_record_web_bytes(const struct lum_record_web *web)
{
    return web ? (web->c_deg.n + web->gamma_deg.n + web->candela.n) * sizeof(float) : 0;
}

static bool ascends(const char *name, const struct lum_floats *v, struct lum_proto_error *err)
{
    for (size_t i = 1; i < v->n; i++)
        if (!(v->f32[i] > v->f32[i - 1]))
            return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", name, "%s must ascend: %g follows %g",
                                  name, (double)v->f32[i], (double)v->f32[i - 1]);
    return true;
}

bool lum_record_web_validate(const struct lum_record_web *web, struct lum_proto_error *err)
{
    size_t n_c = web->c_deg.n, n_gamma = web->gamma_deg.n;
    if (n_c < 1 || n_gamma < 2)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", n_c < 1 ? "c_deg" : "gamma_deg",
                              "a web has one plane at least, of two angles at least");
    if (n_c > LUM_LIMIT_WEB_VALUES || n_gamma > LUM_LIMIT_WEB_VALUES || n_c * n_gamma > LUM_LIMIT_WEB_VALUES)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "limit_exceeded", "candela", "a web may have %u intensities",
                              LUM_LIMIT_WEB_VALUES);
    if (web->candela.n != n_c * n_gamma)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "candela",
                              "%zu planes of %zu angles take %zu intensities, not %zu", n_c, n_gamma, n_c * n_gamma,
                              web->candela.n);
    if (!ascends("c_deg", &web->c_deg, err) || !ascends("gamma_deg", &web->gamma_deg, err))
        return false;
    if (web->c_deg.f32[n_c - 1] - web->c_deg.f32[0] > 360.0f)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "c_deg",
                              "c_deg must span at most 360 degrees");
    for (size_t i = 0; i < web->candela.n; i++)
        if (web->candela.f32[i] > 0.0f)
            return true;
    return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "candela", "all intensities are 0");
}
