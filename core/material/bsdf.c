/* Evaluation and sampling of the BSDF. Local directions: z is the shading normal, wo is above.
 *
 * Sampling: what is cosine-shaped (base, multiple scattering) with probability diffuse_prob, else a microfacet of the
 * interface, which then reflects or transmits in proportion to what it does there. lum_bsdf_eval gives the pdf of the
 * whole mixture, so that every sampled weight is f |cos| / pdf by construction. */
#include "core/material/bsdf.h"

#include "core/material/brushed.h"
#include "core/material/clearcoat.h"
#include "core/math/warp.h"
#include "core/material/sheen.h"

static float facet_density(const struct lum_bsdf *b, struct lum_vec3 h)
{
    return b->brushed ? lum_brushed_d(h, b->spread) : lum_ggx_d(h, b->alpha);
}

static float seen_over_cos(const struct lum_bsdf *b, struct lum_vec3 o)
{
    return b->brushed ? lum_brushed_g1_over_cos(o, b->spread) : lum_ggx_g1_over_cos(o.z, b->alpha);
}

/* i may be on the other side. */
static float seen_by_both(const struct lum_bsdf *b, struct lum_vec3 o, struct lum_vec3 i)
{
    return b->brushed ? lum_brushed_g2_over_cos(o, i, b->spread) : lum_ggx_g2_over_cos(o.z, fabsf(i.z), b->alpha);
}

float lum_fresnel_dielectric(float cos_i, float eta)
{
    if (eta == 1.0f)
        return 0.0f;
    float c = lum_clamp(cos_i, 0.0f, 1.0f);
    float sin2_t = eta * eta * (1.0f - c * c);
    if (!(sin2_t < 1.0f))
        return 1.0f;
    float t = sqrtf(1.0f - sin2_t);
    float s = (eta * c - t) / (eta * c + t), p = (c - eta * t) / (c + eta * t);
    return lum_min(0.5f * (s * s + p * p), 1.0f);
}

/* What a microfacet reflects and transmits of light that meets it at cosine c. */
struct microfacet {
    struct lum_rgb reflect, transmit;
    float reflect_prob; /* of the two; -1: it does neither */
};

void lum_glass_sheet(struct lum_rgb r, struct lum_rgb tint, struct lum_rgb *ret_up, struct lum_rgb *ret_down)
{
    float most = lum_min(lum_rgb_max(r), 1.0f), enters = 1.0f - most;
    const float reflected[3] = {r.r, r.g, r.b}, t[3] = {tint.r, tint.g, tint.b};
    float up[3], down[3];
    for (int k = 0; k < 3; k++) {
        float again = most * t[k], sum = enters / lum_max(1.0f - again * again, 0x1p-24f);
        up[k] = reflected[k] * (1.0f + enters * sum * t[k] * t[k]);
        down[k] = enters * sum * t[k];
    }
    *ret_up = lum_rgb(up[0], up[1], up[2]);
    *ret_down = lum_rgb(down[0], down[1], down[2]);
}

static struct microfacet microfacet_at(const struct lum_bsdf *b, float c)
{
    float m = 1.0f - lum_min(c, 1.0f), schlick = m * m * m * m * m;
    struct microfacet f = {.reflect = lum_rgb_add(lum_rgb_scale(b->f0, 1.0f - schlick), lum_grey(b->f90 * schlick))};
    if (b->glass > 0.0f) {
        /* The exact Fresnel, stretched to run from f0 to f90 as Schlick's does. All is reflected beyond the critical
         * angle. */
        float exact = lum_fresnel_dielectric(c, b->eta), r = (1.0f - b->eta) / (1.0f + b->eta), normal = r * r;
        float w = exact < 1.0f ? lum_max((exact - normal) / (1.0f - normal), 0.0f) : 1.0f;
        float f90 = exact < 1.0f ? b->glass_f90 : 1.0f;
        struct lum_rgb glass = lum_rgb_add(lum_rgb_scale(b->glass_f0, 1.0f - w), lum_grey(f90 * w));
        if (b->thin) {
            struct lum_rgb up, tint = lum_rgb_scale(b->transmit, 1.0f / b->glass);
            lum_glass_sheet(glass, tint, &up, &f.transmit);
            f.reflect = lum_rgb_mad(f.reflect, up, b->glass);
            f.transmit = lum_rgb_scale(f.transmit, b->glass);
        } else {
            f.reflect = lum_rgb_mad(f.reflect, glass, b->glass);
            f.transmit = lum_rgb_scale(b->transmit, lum_max(1.0f - lum_rgb_max(glass), 0.0f));
        }
    }
    float reflect = lum_luminance(f.reflect), both = reflect + lum_luminance(f.transmit);
    f.reflect_prob = both > 0.0f ? reflect / both : -1.0f;
    return f;
}

struct lum_ggx_albedo lum_bsdf_facet_albedo(const struct lum_bsdf *b, struct lum_vec3 w)
{
    if (b->brushed)
        return lum_brushed_albedo(b->brushed, &b->brushed_row, lum_frame_to_local(&b->frame, w));
    return lum_ggx_albedo(b->row, fabsf(lum_dot(b->frame.n, w)));
}

struct lum_ggx_albedo lum_bsdf_facet_albedo_mean(const struct lum_bsdf *b)
{
    return b->brushed ? lum_brushed_albedo_mean(b->brushed, &b->brushed_row) : lum_ggx_albedo_mean(b->row);
}

/* Mean over azimuths. */
static struct lum_ggx_albedo facet_albedo_at(const struct lum_bsdf *b, float cos)
{
    return b->brushed ? lum_brushed_albedo_at(b->brushed, &b->brushed_row, cos) : lum_ggx_albedo(b->row, cos);
}

/* i: local, on either side. */
static struct lum_ggx_albedo facet_albedo_to(const struct lum_bsdf *b, struct lum_vec3 i)
{
    return b->brushed ? lum_brushed_albedo(b->brushed, &b->brushed_row, i) : lum_ggx_albedo(b->row, fabsf(i.z));
}

float lum_bsdf_through_base(const struct lum_bsdf *b, float cos)
{
    if (b->coat[1] == 0.0f && b->coat[2] == 0.0f)
        return 1.0f;
    struct lum_ggx_albedo e = facet_albedo_at(b, cos);
    return lum_max(b->coat[0] - b->coat[1] * e.scale - b->coat[2] * e.bias, 0.0f);
}

static bool is_covered(const struct lum_bsdf *b)
{
    return b->clear.weight > 0.0f || b->sheen.weight > 0.0f;
}

/* What fuzz and clear coat leave of gloss and glass, by the cosine of wi. */
static float left_below(const struct lum_bsdf *b, float cos_i)
{
    float left = b->sheen.weight > 0.0f ? lum_sheen_left(b, cos_i) : 1.0f;
    return b->clear.weight > 0.0f ? left * lum_clearcoat_left(b, cos_i) : left;
}

/* And of even scattering. */
static float even_below(const struct lum_bsdf *b, float cos_i)
{
    float left = b->sheen.weight > 0.0f ? lum_sheen_even(b, cos_i) : 1.0f;
    return b->clear.weight > 0.0f ? left * lum_clearcoat_even(b, cos_i) : left;
}

/* Mean of that by wi: what is scattered evenly leaves through both once. */
static float even_mean_below(const struct lum_bsdf *b)
{
    float left = b->sheen.weight > 0.0f ? b->sheen.left : 1.0f;
    return b->clear.weight > 0.0f ? left * b->clear.left : left;
}

#define MEAN_COS 0.6667f /* of even light */

/* Even in wi exactly: no coat over the base, and nothing that met several microfacets. */
static bool is_matte(const struct lum_bsdf *b)
{
    return b->coat[1] == 0.0f && b->coat[2] == 0.0f && lum_rgb_black(b->multi);
}

/* What is even in wi but for how much of it gets through: the base under its coat, and light from several microfacets.
 * e: of microfacets from there, unless it is matte. */
static struct lum_rgb even_at(const struct lum_bsdf *b, float cos_i, struct lum_ggx_albedo e)
{
    struct lum_rgb base = b->diffuse, multi = lum_grey(0.0f);
    bool covered = is_covered(b);
    if (!is_matte(b)) {
        float through = lum_max(b->coat[0] - b->coat[1] * e.scale - b->coat[2] * e.bias, 0.0f);
        float lost = lum_max(1.0f - (e.scale + e.bias), 0.0f);
        if (!covered)
            return lum_rgb_mad(lum_rgb_scale(b->diffuse, through * b->coat_norm), b->multi, lost);
        base = lum_rgb_scale(b->diffuse, through * b->coat_norm);
        multi = lum_rgb_scale(b->multi, lost);
    }
    if (!covered)
        return base;
    return lum_rgb_mad(lum_rgb_scale(base, even_below(b, cos_i)), multi, left_below(b, cos_i));
}

struct lum_rgb lum_bsdf_diffuse_at(const struct lum_bsdf *b, float cos_i)
{
    return even_at(b, cos_i, is_matte(b) ? (struct lum_ggx_albedo){0} : facet_albedo_at(b, cos_i));
}

/* i: local, above. */
static struct lum_rgb even_to(const struct lum_bsdf *b, struct lum_vec3 i)
{
    return even_at(b, i.z, is_matte(b) ? (struct lum_ggx_albedo){0} : facet_albedo_to(b, i));
}

static struct lum_rgb far_to(const struct lum_bsdf *b, struct lum_vec3 i)
{
    struct lum_bsdf far = *b;
    far.diffuse = b->through;
    far.multi = lum_grey(0.0f);
    return even_to(&far, lum_v3(i.x, i.y, -i.z));
}

float lum_bsdf_cosine_pdf(const struct lum_bsdf *b, struct lum_vec3 wi)
{
    float c = lum_dot(wi, b->frame.n), share = c > 0.0f ? 1.0f - b->far_prob : b->far_prob;
    return b->diffuse_prob * share * fabsf(c) * LUM_INV_PI;
}

struct lum_rgb lum_bsdf_straight(const struct lum_bsdf *b, struct lum_vec3 wo)
{
    if (!b->straight || lum_dot(b->ng, b->ng) == 0.0f)
        return lum_grey(0.0f);
    float cos_o = lum_dot(wo, b->frame.n);
    struct lum_rgb through = microfacet_at(b, cos_o).transmit;
    return is_covered(b) ? lum_rgb_scale(through, left_below(b, cos_o)) : through;
}

/* Scattering at microfacets that reflect o to i; i is above. Also serves thin transmission, with i mirrored. pdf: given
 * that a microfacet was chosen. */
static struct lum_rgb eval_reflected(const struct lum_bsdf *b, struct lum_vec3 o, struct lum_vec3 i, bool transmitted,
                                     float *ret_pdf)
{
    struct lum_vec3 h = lum_normalize(lum_v3_add(o, i));
    struct microfacet f = microfacet_at(b, lum_dot(o, h));
    if (f.reflect_prob < 0.0f)
        return lum_grey(0.0f);
    float d = 0.25f * facet_density(b, h);
    float prob = transmitted ? 1.0f - f.reflect_prob : f.reflect_prob;
    *ret_pdf = prob * d * seen_over_cos(b, o);
    return lum_rgb_scale(transmitted ? f.transmit : f.reflect, d * seen_by_both(b, o, i) * i.z);
}

/* Thin rough glass; i is below. What met several microfacets is drawn like what met one, whose tails reach as far. */
static struct lum_rgb eval_through_sheet(const struct lum_bsdf *b, struct lum_vec3 o, struct lum_vec3 i, float *ret_pdf)
{
    struct lum_rgb once = eval_reflected(b, o, lum_v3(i.x, i.y, -i.z), true, ret_pdf);
    if (lum_rgb_black(b->multi_far))
        return once;
    struct lum_ggx_albedo e = facet_albedo_to(b, i);
    float lost = lum_max(1.0f - (e.scale + e.bias), 0.0f);
    return lum_rgb_mad(once, b->multi_far, lost * -i.z * LUM_INV_PI);
}

/* Rough refraction, Walter et al. 2007 eq. 16, 17 and 21; i is below. */
static struct lum_rgb eval_refracted(const struct lum_bsdf *b, struct lum_vec3 o, struct lum_vec3 i, float *ret_pdf)
{
    struct lum_vec3 h = lum_v3_add(lum_v3_mul(o, b->eta), i);
    float length = lum_length(h);
    if (!(length > 0.0f))
        return lum_grey(0.0f);
    h = lum_v3_mul(h, copysignf(1.0f, h.z) / length);
    float c_o = lum_dot(o, h), c_i = -lum_dot(i, h);
    if (!(c_o > 0.0f && c_i > 0.0f))
        return lum_grey(0.0f);
    struct microfacet f = microfacet_at(b, c_o);
    if (f.reflect_prob < 0.0f)
        return lum_grey(0.0f);
    float jacobian = c_i / (length * length); /* dh / di */
    float d = facet_density(b, h) * c_o * jacobian;
    *ret_pdf = (1.0f - f.reflect_prob) * d * seen_over_cos(b, o);
    float g = seen_by_both(b, o, i) * -i.z;
    return lum_rgb_scale(f.transmit, b->eta * b->eta * d * g);
}

struct lum_bsdf_value lum_bsdf_eval_parts(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec3 wi)
{
    struct lum_bsdf_value v = {.diffuse = lum_grey(0.0f), .gloss = lum_grey(0.0f)};
    struct lum_vec3 o = lum_frame_to_local(&b->frame, wo), i = lum_frame_to_local(&b->frame, wi);
    float side = lum_dot(wi, b->ng); /* 0 when there is nothing to scatter */
    if (i.z > 0.0f && side > 0.0f) {
        if (b->diffuse_prob > 0.0f) {
            float c = i.z * LUM_INV_PI;
            v.diffuse = lum_rgb_scale(even_to(b, i), c);
            v.pdf_sa = b->diffuse_prob * (1.0f - b->far_prob) * c;
        }
        if (b->alpha > 0.0f && b->diffuse_prob < 1.0f)
            v.gloss = eval_reflected(b, o, i, false, &v.gloss_pdf_sa);
    } else if (i.z < 0.0f && side < 0.0f) {
        if (b->alpha > 0.0f && b->glass > 0.0f && b->eta != 1.0f)
            v.gloss = b->thin ? eval_through_sheet(b, o, i, &v.gloss_pdf_sa) : eval_refracted(b, o, i, &v.gloss_pdf_sa);
        if (b->far_prob > 0.0f) {
            float c = -i.z * LUM_INV_PI;
            v.diffuse = lum_rgb_scale(far_to(b, i), c);
            v.pdf_sa = b->diffuse_prob * b->far_prob * c;
        }
    }
    if (b->sheen.weight > 0.0f)
        lum_sheen_add(b, o, i, i.z > 0.0f && side > 0.0f, &v);
    if (b->clear.weight > 0.0f)
        lum_clearcoat_add(b, wo, wi, i.z, &v);
    v.pdf_sa += (1.0f - b->diffuse_prob) * v.gloss_pdf_sa;
    return v;
}

/* eval_reflected where nothing is transmitted, for directions in lanes and without a branch: lum_ggx_d and
 * lum_ggx_g2_over_cos are written out, so that what the lanes share is outside, and no lane divides for itself alone.
 */
#define LANES 4
static void eval_metal_and_coat(const struct lum_bsdf *b, struct lum_vec3 wo, uint32_t n, const struct lum_vec3 *wi,
                                struct lum_rgb *ret_gloss, float *ret_pdf_sa)
{
    struct lum_vec3 o = lum_frame_to_local(&b->frame, wo), i[LANES];
    float side[LANES], f[LANES], schlick[LANES], pdf[LANES];
    float a2 = b->alpha * b->alpha, s_o = lum_ggx_s(o.z, b->alpha), g1 = lum_ggx_g1_over_cos(o.z, b->alpha);
    for (uint32_t k = 0; k < LANES; k++) {
        struct lum_vec3 w = wi[k < n ? k : 0];
        i[k] = lum_frame_to_local(&b->frame, w);
        side[k] = lum_dot(w, b->ng);
    }
    for (uint32_t k = 0; k < LANES; k++) {
        float x = o.x + i[k].x, y = o.y + i[k].y, z = o.z + i[k].z, s = 1.0f / sqrtf(x * x + y * y + z * z);
        float c = (o.x * x + o.y * y + o.z * z) * s, m = c < 1.0f ? 1.0f - c : 0.0f;
        float t = (a2 * z * z + x * x + y * y) * s * s, d = 0.25f * LUM_INV_PI * a2 / (t * t);
        float g2 = 2.0f / (i[k].z * s_o + o.z * sqrtf(a2 + (1.0f - a2) * i[k].z * i[k].z));
        float open = (float)((i[k].z > 0.0f) & (side[k] > 0.0f));
        schlick[k] = m * m * m * m * m;
        f[k] = open > 0.0f ? d * g2 * i[k].z : 0.0f;
        pdf[k] = open > 0.0f ? d * g1 : 0.0f;
    }
    for (uint32_t k = 0; k < n; k++) {
        struct lum_rgb microfacet = lum_rgb_add(lum_rgb_scale(b->f0, 1.0f - schlick[k]), lum_grey(b->f90 * schlick[k]));
        ret_gloss[k] = lum_rgb_scale(microfacet, f[k]);
        ret_pdf_sa[k] = pdf[k];
    }
}

void lum_bsdf_eval_gloss(const struct lum_bsdf *b, struct lum_vec3 wo, uint32_t n, const struct lum_vec3 *wi,
                         struct lum_rgb *ret_gloss, float *ret_pdf_sa)
{
    bool simple = b->glass == 0.0f && !b->brushed && !is_covered(b) && b->alpha > 0.0f && b->diffuse_prob < 1.0f;
    for (uint32_t k = 0; simple && k < n; k += LANES)
        eval_metal_and_coat(b, wo, n - k < LANES ? n - k : LANES, wi + k, ret_gloss + k, ret_pdf_sa + k);
    for (uint32_t k = 0; !simple && k < n; k++) {
        struct lum_bsdf_value v = lum_bsdf_eval_parts(b, wo, wi[k]);
        ret_gloss[k] = v.gloss;
        ret_pdf_sa[k] = v.gloss_pdf_sa;
    }
}

struct lum_bsdf lum_bsdf_gloss(const struct lum_bsdf *b)
{
    struct lum_bsdf g = *b;
    g.diffuse = g.multi = g.through = lum_grey(0.0f);
    g.diffuse_prob = g.far_prob = 0.0f;
    return g;
}

struct lum_rgb lum_bsdf_eval(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec3 wi, float *ret_pdf_sa)
{
    struct lum_bsdf_value v = lum_bsdf_eval_parts(b, wo, wi);
    *ret_pdf_sa = v.pdf_sa;
    return lum_rgb_add(v.diffuse, v.gloss);
}

struct lum_rgb lum_bsdf_diffuse_albedo(const struct lum_bsdf *b)
{
    bool covered = is_covered(b);
    if (is_matte(b))
        return covered ? lum_rgb_scale(b->diffuse, even_mean_below(b)) : b->diffuse;
    struct lum_ggx_albedo e = lum_bsdf_facet_albedo_mean(b);
    float through = lum_max(b->coat[0] - b->coat[1] * e.scale - b->coat[2] * e.bias, 0.0f);
    float lost = lum_max(1.0f - (e.scale + e.bias), 0.0f);
    if (covered)
        return lum_rgb_mad(lum_rgb_scale(b->diffuse, through * b->coat_norm * even_mean_below(b)), b->multi,
                           lost * left_below(b, MEAN_COS));
    return lum_rgb_mad(lum_rgb_scale(b->diffuse, through * b->coat_norm), b->multi, lost);
}

struct lum_rgb lum_bsdf_gloss_albedo(const struct lum_bsdf *b, struct lum_vec3 wo)
{
    struct lum_rgb below = lum_grey(0.0f);
    if (b->alpha > 0.0f && !lum_rgb_black(b->f0)) {
        struct lum_ggx_albedo e = lum_bsdf_facet_albedo(b, wo);
        below = lum_rgb_add(lum_rgb_scale(b->f0, e.scale), lum_grey(b->f90 * e.bias));
    }
    if (!is_covered(b))
        return below;
    return lum_rgb_add(lum_rgb_scale(below, even_mean_below(b)), lum_grey(lum_clearcoat_gloss_albedo(b, wo)));
}

/* A microfacet's transmittance falls as Schlick's reflectance rises, about. */
struct lum_rgb lum_bsdf_haze_albedo(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_rgb *ret_even)
{
    *ret_even = lum_grey(0.0f);
    if (!b->thin || b->straight || !(b->glass > 0.0f))
        return lum_grey(0.0f);
    struct lum_ggx_albedo e = lum_bsdf_facet_albedo(b, wo), mean = lum_bsdf_facet_albedo_mean(b);
    float left = is_covered(b) ? left_below(b, MEAN_COS) : 1.0f;
    *ret_even = lum_rgb_scale(b->multi_far, lum_max(1.0f - (mean.scale + mean.bias), 0.0f) * left);
    return lum_rgb_add(lum_rgb_scale(microfacet_at(b, 1.0f).transmit, e.scale * left),
                       lum_rgb_scale(microfacet_at(b, 0.0f).transmit, e.bias * left));
}

struct lum_gloss_lobe lum_bsdf_gloss_lobe(const struct lum_bsdf *b, struct lum_vec3 wo)
{
    struct lum_gloss_lobe lobe = {b->alpha, lum_rgb_max(b->f0), b->f90};
    float own = lum_clearcoat_is_gloss(b) ? lum_clearcoat_gloss_albedo(b, wo) : 0.0f;
    if (own > 0.0f && 2.0f * own > lum_rgb_max(lum_bsdf_gloss_albedo(b, wo)))
        lobe = (struct lum_gloss_lobe){b->clear.alpha, b->clear.weight * LUM_CLEARCOAT_F0, b->clear.weight};
    return lobe;
}

static struct lum_rgb divide(struct lum_rgb c, float by)
{
    return lum_rgb(c.r / by, c.g / by, c.b / by);
}

/* A sample of a lobe with spread, weighted by the whole mixture. What a tilted microfacet sends to the wrong side of
 * the surface would hit the next microfacet: it is lost, as in the pdf. */
static bool finish_spread(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec3 i, enum lum_lobe lobe,
                          struct lum_bsdf_sample *ret_sample)
{
    struct lum_bsdf_sample s = {.wi = lum_frame_to_scene(&b->frame, i), .lobe = lobe};
    bool across = lobe == LUM_LOBE_GLOSSY_TRANSMIT || lobe == LUM_LOBE_DIFFUSE_TRANSMIT;
    if (across ? i.z >= 0.0f : i.z <= 0.0f)
        return false;
    struct lum_rgb f = lum_bsdf_eval(b, wo, s.wi, &s.pdf_sa);
    if (!(s.pdf_sa > 0.0f) || lum_rgb_black(f))
        return false;
    s.weight = divide(f, s.pdf_sa);
    *ret_sample = s;
    return true;
}

/* A sample of a matte surface: the cosines cancel, and the weight is the albedo without rounding. */
static bool sample_matte(const struct lum_bsdf *b, struct lum_vec3 i, struct lum_bsdf_sample *ret_sample)
{
    struct lum_vec3 wi = lum_frame_to_scene(&b->frame, i);
    if (!(i.z > 0.0f && lum_dot(wi, b->ng) > 0.0f))
        return false;
    *ret_sample = (struct lum_bsdf_sample){wi, even_to(b, i), i.z * LUM_INV_PI, LUM_LOBE_DIFFUSE};
    return true;
}

/* Mirror direction of o at microfacet h, local. */
static struct lum_vec3 mirrored(struct lum_vec3 o, struct lum_vec3 h, float cos_o)
{
    return lum_v3_sub(lum_v3_mul(h, 2.0f * cos_o), o);
}

/* Refracted direction; the microfacet transmits, so cos_t exists. */
static struct lum_vec3 refracted(struct lum_vec3 o, struct lum_vec3 h, float cos_o, float eta)
{
    float cos_t = sqrtf(lum_max(1.0f - eta * eta * (1.0f - cos_o * cos_o), 0.0f));
    return lum_normalize(lum_v3_mad(lum_v3_mul(o, -eta), h, eta * cos_o - cos_t));
}

static bool sample_reflection(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec3 i, struct lum_rgb weight,
                              struct lum_bsdf_sample *ret_sample)
{
    if (b->alpha > 0.0f)
        return finish_spread(b, wo, i, LUM_LOBE_GLOSSY, ret_sample);
    struct lum_vec3 wi = lum_frame_to_scene(&b->frame, i);
    if (!(lum_dot(wi, b->ng) > 0.0f))
        return false;
    *ret_sample = (struct lum_bsdf_sample){wi, weight, 0.0f, LUM_LOBE_REFLECT};
    return true;
}

static bool sample_transmission(const struct lum_bsdf *b, struct lum_vec3 wo, const struct lum_vec3 *h,
                                struct lum_rgb weight, struct lum_bsdf_sample *ret_sample)
{
    struct lum_vec3 o = lum_frame_to_local(&b->frame, wo);
    float cos_o = lum_dot(o, *h);
    if (b->straight) {
        *ret_sample = (struct lum_bsdf_sample){lum_v3_neg(wo), weight, 0.0f, LUM_LOBE_TRANSMIT};
        return true;
    }
    if (b->thin) {
        struct lum_vec3 i = mirrored(o, *h, cos_o);
        return finish_spread(b, wo, lum_v3(i.x, i.y, -i.z), LUM_LOBE_GLOSSY_TRANSMIT, ret_sample);
    }
    struct lum_vec3 i = refracted(o, *h, cos_o, b->eta);
    if (b->alpha > 0.0f)
        return finish_spread(b, wo, i, LUM_LOBE_GLOSSY_TRANSMIT, ret_sample);
    struct lum_vec3 wi = lum_frame_to_scene(&b->frame, i);
    if (!(lum_dot(wi, b->ng) < 0.0f))
        return false;
    *ret_sample = (struct lum_bsdf_sample){wi, lum_rgb_scale(weight, b->eta * b->eta), 0.0f, LUM_LOBE_TRANSMIT};
    return true;
}

/* What lies below a clear coat is dimmed by it; what has spread was when it was evaluated. */
static bool dim_delta(const struct lum_bsdf *b, bool found, struct lum_bsdf_sample *inout_sample)
{
    if (found && is_covered(b) && inout_sample->pdf_sa == 0.0f)
        inout_sample->weight =
            lum_rgb_scale(inout_sample->weight, left_below(b, lum_dot(inout_sample->wi, b->frame.n)));
    return found;
}

/* prob: that it was chosen. */
static bool sample_clearcoat(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec2 u, float prob,
                             struct lum_bsdf_sample *ret_sample)
{
    struct lum_vec3 wi;
    if (!lum_clearcoat_reflect(b, wo, u, &wi))
        return false;
    if (b->clear.alpha > 0.0f)
        return finish_spread(b, wo, lum_frame_to_local(&b->frame, wi), LUM_LOBE_GLOSSY, ret_sample);
    *ret_sample = (struct lum_bsdf_sample){wi, lum_grey(lum_clearcoat_mirror(b, wo) / prob), 0.0f, LUM_LOBE_REFLECT};
    return true;
}

/* Of a microfacet that is seen from o. */
static struct lum_vec3 facet_normal(const struct lum_bsdf *b, struct lum_vec3 o, struct lum_vec2 u)
{
    if (b->brushed)
        return lum_brushed_sample_visible(o, b->spread, u);
    return b->alpha > 0.0f ? lum_ggx_sample_visible(o, b->alpha, u) : lum_v3(0.0f, 0.0f, 1.0f);
}

bool lum_bsdf_sample(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec2 u, float u_lobe,
                     struct lum_bsdf_sample *ret_sample)
{
    if (lum_dot(b->ng, b->ng) == 0.0f)
        return false;
    if (u_lobe < b->diffuse_prob * b->far_prob) {
        struct lum_vec3 i = lum_warp_cosine(u);
        return finish_spread(b, wo, lum_v3(i.x, i.y, -i.z), LUM_LOBE_DIFFUSE_TRANSMIT, ret_sample);
    }
    if (b->diffuse_prob == 1.0f && b->far_prob == 0.0f)
        return sample_matte(b, lum_warp_cosine(u), ret_sample);
    if (u_lobe < b->diffuse_prob)
        return finish_spread(b, wo, lum_warp_cosine(u),
                             lum_rgb_black(b->diffuse) && b->far_prob == 0.0f ? LUM_LOBE_GLOSSY : LUM_LOBE_DIFFUSE,
                             ret_sample);
    u_lobe = (u_lobe - b->diffuse_prob) / (1.0f - b->diffuse_prob);
    float facet_prob = 1.0f - b->diffuse_prob;
    if (u_lobe < b->clear.share)
        return sample_clearcoat(b, wo, u, facet_prob * b->clear.share, ret_sample);
    if (b->clear.share > 0.0f) {
        u_lobe = (u_lobe - b->clear.share) / (1.0f - b->clear.share);
        facet_prob *= 1.0f - b->clear.share;
    }
    if (u_lobe < b->sheen.share)
        return finish_spread(b, wo, lum_warp_cone(u, 1.0f), LUM_LOBE_GLOSSY, ret_sample);
    if (b->sheen.share > 0.0f) {
        u_lobe = (u_lobe - b->sheen.share) / (1.0f - b->sheen.share);
        facet_prob *= 1.0f - b->sheen.share;
    }

    struct lum_vec3 o = lum_frame_to_local(&b->frame, wo);
    struct lum_vec3 h = facet_normal(b, o, u);
    float cos_o = lum_dot(o, h);
    if (!(cos_o > 0.0f))
        return false;
    struct microfacet f = microfacet_at(b, cos_o);
    if (u_lobe < f.reflect_prob) { /* the weights are of delta lobes; those with spread have their own */
        struct lum_rgb weight = divide(f.reflect, facet_prob * f.reflect_prob);
        return dim_delta(b, sample_reflection(b, wo, mirrored(o, h, cos_o), weight, ret_sample), ret_sample);
    }
    if (f.reflect_prob < 0.0f || lum_rgb_black(f.transmit))
        return false;
    struct lum_rgb weight = divide(f.transmit, facet_prob * (1.0f - f.reflect_prob));
    return dim_delta(b, sample_transmission(b, wo, &h, weight, ret_sample), ret_sample);
}

/* The mirror of a clear coat: where what lies below is one, too, they are one lobe. */
static uint32_t add_clear_mirror(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_bsdf_sample *lobes,
                                 uint32_t n)
{
    struct lum_vec3 wi;
    if (!(b->clear.share > 0.0f) || b->clear.alpha > 0.0f)
        return n;
    struct lum_rgb weight = lum_grey(lum_clearcoat_mirror(b, wo));
    if (n > 0 && lobes[0].lobe == LUM_LOBE_REFLECT) {
        lobes[0].weight = lum_rgb_add(lobes[0].weight, weight);
        return n;
    }
    if (!lum_clearcoat_reflect(b, wo, (struct lum_vec2){0.5f, 0.5f}, &wi))
        return n;
    lobes[n] = (struct lum_bsdf_sample){wi, weight, 0.0f, LUM_LOBE_REFLECT};
    return n + 1;
}

uint32_t lum_bsdf_delta_lobes(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_bsdf_sample ret_lobes[2])
{
    if (lum_dot(b->ng, b->ng) == 0.0f)
        return 0;
    const struct lum_vec3 h = lum_v3(0.0f, 0.0f, 1.0f);
    struct lum_vec3 o = lum_frame_to_local(&b->frame, wo);
    struct microfacet f = microfacet_at(b, o.z);
    uint32_t n = 0;
    if (b->alpha == 0.0f && !lum_rgb_black(f.reflect))
        n += sample_reflection(b, wo, mirrored(o, h, o.z), f.reflect, &ret_lobes[n]);
    if ((b->alpha == 0.0f || b->eta == 1.0f) && !lum_rgb_black(f.transmit))
        n += sample_transmission(b, wo, &h, f.transmit, &ret_lobes[n]);
    for (uint32_t k = 0; k < n; k++)
        dim_delta(b, true, &ret_lobes[k]);
    return add_clear_mirror(b, wo, ret_lobes, n);
}
