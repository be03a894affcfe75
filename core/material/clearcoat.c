#include "core/material/clearcoat.h"

#include "core/material/sheen.h"

static float albedo_of(const struct lum_clearcoat *c, struct lum_ggx_albedo e)
{
    return lum_clamp(c->weight * (LUM_CLEARCOAT_F0 * e.scale + e.bias), 0.0f, 1.0f);
}

static float left_at(const struct lum_clearcoat *c, float cos)
{
    return 1.0f - albedo_of(c, lum_ggx_albedo(c->row, lum_min(fabsf(cos), 1.0f)));
}

/* Mean of 1 - E, of light that what lies below lets through: where one reflects much so does the other. At midpoints,
 * for each hit: more of them keep more light where E turns at grazing angles, and take time. */
static float mean_left(const struct lum_bsdf *b)
{
    enum { STEPS = 8 };
    float both = 0.0f, through = 0.0f;
    if (b->coat[1] == 0.0f && b->coat[2] == 0.0f && b->sheen.weight == 0.0f)
        return 1.0f - albedo_of(&b->clear, lum_ggx_albedo_mean(b->clear.row));
    for (int k = 0; k < STEPS; k++) {
        float cos = ((float)k + 0.5f) / STEPS, t = cos * lum_bsdf_through_base(b, cos) * lum_sheen_through(b, cos);
        through += t;
        both += t * left_at(&b->clear, cos);
    }
    return through > 0.0f ? both / through : 1.0f;
}

void lum_clearcoat_init(struct lum_bsdf *b, float weight, float alpha, struct lum_vec3 n, struct lum_vec3 wo)
{
    struct lum_clearcoat *c = &b->clear;
    c->weight = weight;
    c->alpha = alpha;
    c->row = lum_ggx_row(c->alpha);
    c->n = c->alpha == 0.0f && b->alpha == 0.0f ? b->frame.n : n; /* two mirrors reflect into one direction */
    c->left = left_at(c, lum_dot(wo, b->frame.n));
    float mean = mean_left(b);
    c->norm = mean > 0.0f ? c->left / mean : 0.0f;

    float own = albedo_of(c, lum_ggx_albedo(c->row, lum_min(lum_dot(wo, c->n), 1.0f)));
    float even = b->diffuse_prob * b->lobes * c->left, other = (1.0f - b->diffuse_prob) * b->lobes * c->left;
    c->share = own > 0.0f ? own / (own + other) : 0.0f;
    b->lobes = even + other + own;
    b->diffuse_prob = b->lobes > 0.0f ? even / b->lobes : 0.0f;
    b->coat_left *= c->left;
}

float lum_clearcoat_even(const struct lum_bsdf *b, float cos_i)
{
    return b->clear.norm * left_at(&b->clear, cos_i);
}

float lum_clearcoat_left(const struct lum_bsdf *b, float cos_i)
{
    return lum_min(b->clear.left, left_at(&b->clear, cos_i));
}

static float fresnel_at(const struct lum_clearcoat *c, float cos)
{
    float m = 1.0f - lum_min(cos, 1.0f), schlick = m * m * m * m * m;
    return c->weight * (LUM_CLEARCOAT_F0 + (1.0f - LUM_CLEARCOAT_F0) * schlick);
}

void lum_clearcoat_add(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec3 wi, float cos_i,
                       struct lum_bsdf_value *v)
{
    const struct lum_clearcoat *c = &b->clear;
    float cos_o = lum_dot(wo, c->n), own_cos = lum_dot(wi, c->n);
    v->gloss = lum_rgb_scale(v->gloss, lum_clearcoat_left(b, cos_i));
    v->gloss_pdf_sa *= 1.0f - c->share;
    if (!lum_clearcoat_is_gloss(b) || !(cos_i > 0.0f && lum_dot(wi, b->ng) > 0.0f && cos_o > 0.0f && own_cos > 0.0f))
        return;
    struct lum_frame frame = lum_frame_from_normal(c->n);
    struct lum_vec3 h = lum_normalize(lum_v3_add(wo, wi));
    float d = 0.25f * lum_ggx_d(lum_frame_to_local(&frame, h), c->alpha);
    float f = fresnel_at(c, lum_dot(wo, h)) * d * lum_ggx_g2_over_cos(cos_o, own_cos, c->alpha) * own_cos;
    v->gloss = lum_rgb_add(v->gloss, lum_grey(f));
    v->gloss_pdf_sa += c->share * d * lum_ggx_g1_over_cos(cos_o, c->alpha);
}

float lum_clearcoat_mirror(const struct lum_bsdf *b, struct lum_vec3 wo)
{
    return fresnel_at(&b->clear, lum_max(lum_dot(wo, b->clear.n), 0.0f));
}

bool lum_clearcoat_reflect(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec2 u, struct lum_vec3 *ret_wi)
{
    struct lum_frame frame = lum_frame_from_normal(b->clear.n);
    struct lum_vec3 h = b->clear.n;
    if (b->clear.alpha > 0.0f)
        h = lum_frame_to_scene(&frame, lum_ggx_sample_visible(lum_frame_to_local(&frame, wo), b->clear.alpha, u));
    *ret_wi = lum_normalize(lum_v3_sub(lum_v3_mul(h, 2.0f * lum_dot(wo, h)), wo));
    return lum_dot(*ret_wi, b->ng) > 0.0f && lum_dot(*ret_wi, b->clear.n) > 0.0f;
}

float lum_clearcoat_gloss_albedo(const struct lum_bsdf *b, struct lum_vec3 wo)
{
    if (!lum_clearcoat_is_gloss(b))
        return 0.0f;
    return albedo_of(&b->clear, lum_ggx_albedo(b->clear.row, lum_clamp(lum_dot(wo, b->clear.n), 0.0f, 1.0f)));
}
