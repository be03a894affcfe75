/* Effects that are left out are left out exactly: what stays converges to the sum of the others. A lobe that no path
 * goes on by still reflects the lights, which are then sampled for it alone. So the picture without indirect_diffuse
 * and glossy is that of direct light on every surface, highlights included. */
#include "core/path/vertex.h"

#include "core/math/warp.h"

/* The effect that the cosine-shaped lobe counts as: of a metal it is light from several microfacets. */
static uint32_t cosine_effect(const struct lum_bsdf *b)
{
    bool matte = !lum_rgb_black(b->diffuse) || b->far_prob > 0.0f;
    return LUM_EFFECT_BIT(matte ? LUM_EFFECT_INDIRECT_DIFFUSE : LUM_EFFECT_GLOSSY);
}

uint32_t lum_lobe_effects(const struct lum_bsdf *b)
{
    uint32_t effects = b->diffuse_prob > 0.0f ? cosine_effect(b) : 0;
    if (b->diffuse_prob == 1.0f)
        return effects;
    if (b->clear.share > 0.0f)
        effects |= LUM_EFFECT_BIT(b->clear.alpha > 0.0f ? LUM_EFFECT_GLOSSY : LUM_EFFECT_REFLECTION);
    if (b->sheen.share > 0.0f && b->clear.share < 1.0f)
        effects |= LUM_EFFECT_BIT(LUM_EFFECT_GLOSSY);
    if (b->clear.share < 1.0f && b->sheen.share < 1.0f)
        effects |= LUM_EFFECT_BIT(b->alpha > 0.0f ? LUM_EFFECT_GLOSSY : LUM_EFFECT_REFLECTION);
    return b->glass > 0.0f ? effects | LUM_EFFECT_BIT(LUM_EFFECT_TRANSMISSION) : effects;
}

struct lum_rgb lum_vertex_respond_in_part(const struct lum_vertex *at, struct lum_vec3 wi, float pdf)
{
    const struct lum_bsdf *b = at->b;
    struct lum_bsdf_value v = lum_bsdf_eval_parts(b, at->wo, wi);
    bool across = lum_dot(wi, b->ng) < 0.0f;
    bool cosine = !(at->lobes_off & cosine_effect(b));
    bool gloss = !(at->lobes_off & LUM_EFFECT_BIT(across ? LUM_EFFECT_TRANSMISSION : LUM_EFFECT_GLOSSY));
    float pdf_gloss = (1.0f - b->diffuse_prob) * v.gloss_pdf_sa, pdf_on = gloss ? pdf_gloss : 0.0f;
    if (cosine)
        pdf_on += lum_bsdf_cosine_pdf(b, wi);
    float weight = lum_power_heuristic(pdf, pdf_on);
    return lum_rgb_mad(lum_rgb_scale(v.diffuse, cosine ? weight : 1.0f), v.gloss, gloss ? weight : 1.0f);
}

bool lum_vertex_keep_lobe(const struct lum_vertex *at, struct lum_bsdf_sample *inout_sample)
{
    const struct lum_bsdf *b = at->b;
    struct lum_bsdf_sample *bs = inout_sample;
    uint32_t effect = LUM_EFFECT_BIT((uint32_t)lum_lobe_ray_kind(bs->lobe) - LUM_RAY_DIRECT);
    if (at->lobes_off & effect)
        return false;
    bool across = lum_dot(bs->wi, b->ng) < 0.0f;
    uint32_t overlap = LUM_EFFECT_BIT(LUM_EFFECT_INDIRECT_DIFFUSE) |
                       LUM_EFFECT_BIT(across ? LUM_EFFECT_TRANSMISSION : LUM_EFFECT_GLOSSY);
    if (!(effect & overlap) || !(at->lobes_off & overlap) || !lum_bsdf_has_gloss(b) || !(bs->pdf_sa > 0.0f))
        return true;
    struct lum_bsdf_value v = lum_bsdf_eval_parts(b, at->wo, bs->wi);
    bool cosine = effect == cosine_effect(b);
    struct lum_rgb f = cosine ? v.diffuse : v.gloss;
    bs->pdf_sa = cosine ? lum_bsdf_cosine_pdf(b, bs->wi) : (1.0f - b->diffuse_prob) * v.gloss_pdf_sa;
    if (!(bs->pdf_sa > 0.0f))
        return false;
    bs->weight = lum_rgb(f.r / bs->pdf_sa, f.g / bs->pdf_sa, f.b / bs->pdf_sa);
    return true;
}
