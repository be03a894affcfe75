/* From a material's parameters and textures to the BSDF at a point. */
#include "core/material/material.h"

#include "core/material/bsdf.h"
#include "core/material/brushed.h"
#include "core/material/clearcoat.h"
#include "core/material/sheen.h"
#include "core/material/ggx.h"
#include "core/scene/surface.h"

/* Indices of refraction closer to 1 than this count as equal: the half vector of refraction, whose length is about
 * |1 - eta|, would be wrong by more than LUM_ALPHA_MIN. */
#define MATCHED_IOR 0x1p-12f

static struct lum_rgb clamp01_rgb(struct lum_rgb c)
{
    return lum_rgb(lum_clamp01(c.r), lum_clamp01(c.g), lum_clamp01(c.b));
}

static uint32_t clearcoat_bits(const struct lum_material *m)
{
    if (!(m->clearcoat > 0.0f))
        return 0;
    bool smooth = m->clearcoat_roughness * m->clearcoat_roughness < LUM_ALPHA_MIN && !m->clearcoat_roughness_tex.image;
    return smooth ? LUM_SCATTER_MIRROR : LUM_SCATTER_GLOSS;
}

/* Where no texture makes it rough. */
static bool is_smooth(const struct lum_material *m)
{
    float alpha = m->roughness * m->roughness;
    if (lum_material_is_brushed(m))
        alpha = lum_brushed_along(alpha, m->anisotropy);
    return alpha < LUM_ALPHA_MIN && !m->metallic_roughness_tex.image && !m->anisotropy_tex.image;
}

bool lum_material_is_specular(const struct lum_material *m)
{
    if (m->unlit)
        return false;
    if (m->transmission > 0.0f && m->metallic < 1.0f)
        return true;
    if (clearcoat_bits(m) == LUM_SCATTER_MIRROR)
        return true;
    return is_smooth(m) && (m->metallic > 0.0f || m->specular > 0.0f);
}

bool lum_material_is_pane(const struct lum_material *m)
{
    if (m->unlit || !(m->transmission > 0.0f) || !(m->metallic < 1.0f))
        return false;
    return ((m->thin || m->straight) && is_smooth(m)) || lum_ior_is_matched(m->ior);
}

bool lum_ior_is_matched(float ior)
{
    return ior - 1.0f < MATCHED_IOR;
}

uint32_t lum_material_scatter(const struct lum_material *m)
{
    if (m->unlit)
        return 0;
    bool metal = m->metallic > 0.0f, dielectric = m->metallic < 1.0f, matched = lum_ior_is_matched(m->ior);
    bool glass = dielectric && m->transmission > 0.0f, black = lum_rgb_black(m->base_color);
    bool coat = dielectric && m->specular > 0.0f && !matched;
    bool total = glass && !m->thin && !matched; /* reflection from inside, whatever specular is */
    bool rest = dielectric && (m->transmission < 1.0f || m->transmission_tex.image); /* that is no glass */
    uint32_t bits = rest && !black ? LUM_SCATTER_DIFFUSE : 0;
    if (lum_material_is_sheet(m))
        bits |= LUM_SCATTER_DIFFUSE | LUM_SCATTER_SHEET;
    if (metal || coat || total) {
        bits |= is_smooth(m) ? LUM_SCATTER_MIRROR : LUM_SCATTER_GLOSS;
    }
    bits |= clearcoat_bits(m) | (lum_rgb_max(m->sheen_color) > 0.0f ? LUM_SCATTER_GLOSS : 0);
    return glass && !black ? bits | LUM_SCATTER_THROUGH : bits;
}

struct lum_rgb lum_material_transmittance(const struct lum_material *m, float distance)
{
    if (m->thin || !(m->transmission > 0.0f) || lum_rgb_black(m->sigma_a))
        return lum_grey(1.0f);
    return lum_rgb(expf(-m->sigma_a.r * distance), expf(-m->sigma_a.g * distance), expf(-m->sigma_a.b * distance));
}

void lum_material_ask(const struct lum_material *m, struct lum_vec2 uv)
{
#define ASK(SLOT, name)                                                                                                \
    if (m->name##_tex.image)                                                                                           \
        lum_texture_ask(&m->name##_tex, uv);
    LUM_TEXTURES(ASK)
#undef ASK
}

static struct lum_rgb base_color(const struct lum_material *m, struct lum_vec2 uv, struct lum_rgb vertex_color)
{
    struct lum_rgb tex = lum_texture_sample(&m->base_color_tex, uv).rgb;
    return clamp01_rgb(lum_rgb_mul(lum_rgb_mul(m->base_color, tex), vertex_color));
}

struct lum_rgb lum_material_emission(const struct lum_material *m, struct lum_rgb white, struct lum_vec2 uv,
                                     struct lum_rgb vertex_color)
{
    if (m->unlit)
        return base_color(m, uv, vertex_color);
    if (lum_rgb_black(white))
        return lum_grey(0.0f);
    return lum_rgb_mul(white, lum_texture_sample(&m->emission_tex, uv).rgb);
}

/* A normal map. */
struct relief {
    const struct lum_texture *tex;
    float scale;
};

/* The normal map's normal around s->ns. Its red runs along +u and its green along -v, which is up in the picture
 * (glTF). Seen from behind, the front's normal is turned round as a whole. Where uv spans no area it has no directions,
 * and says nothing. */
static struct lum_vec3 mapped_normal(struct relief r, const struct lum_surface *s)
{
    struct lum_vec3 n = s->ns;
    if (!r.tex->image)
        return n;
    struct lum_vec3 t = lum_normalize(lum_v3_mad(s->dpdu, n, -lum_dot(n, s->dpdu)));
    struct lum_vec3 b = lum_cross(n, t);
    if (!(lum_dot(t, t) > 0.0f))
        return n;
    if (lum_dot(b, s->dpdv) > 0.0f)
        b = lum_v3_neg(b);
    struct lum_rgb c = lum_texture_sample(r.tex, s->uv).rgb;
    float side = s->backface ? -r.scale : r.scale;
    struct lum_vec3 v = lum_v3_mul(n, 2.0f * c.b - 1.0f);
    v = lum_v3_mad(lum_v3_mad(v, t, side * (2.0f * c.r - 1.0f)), b, side * (2.0f * c.g - 1.0f));
    return lum_normalize(v);
}

/* Bends ns towards ng just so far that wo is above it (NOTES H11). Leaves it alone where it is ng already. */
static struct lum_vec3 normal_facing(struct lum_vec3 ns, struct lum_vec3 ng, struct lum_vec3 wo)
{
    float cos_g = lum_dot(wo, ng), cos_s = lum_dot(wo, ns);
    float least = lum_min(cos_g, 0x1p-7f); /* below half a degree of grazing */
    if (!(cos_s < least) && lum_dot(ns, ns) > 0.0f)
        return ns;
    struct lum_vec3 n = lum_normalize(lum_v3_mad(ns, ng, (least - cos_s) / cos_g));
    return lum_dot(n, wo) > 0.0f ? n : ng;
}

/* How far, and which way, a point is brushed. */
struct lines {
    float strength;
    struct lum_vec2 stretch; /* unit, along tangent and bitangent */
};

/* The texture's red and green are a direction, from which the material's turns on; none where they are level. */
static struct lines lines_at(const struct lum_material *m, struct lum_vec2 uv)
{
    struct lines l = {lum_clamp01(m->anisotropy), m->stretch};
    if (!m->anisotropy_tex.image)
        return l;
    struct lum_rgb c = lum_texture_sample(&m->anisotropy_tex, uv).rgb;
    float x = 2.0f * c.r - 1.0f, y = 2.0f * c.g - 1.0f, length = sqrtf(x * x + y * y);
    l.strength *= lum_clamp01(c.b);
    if (length > 0x1p-7f) /* a step of a byte is as much */
        l.stretch = (struct lum_vec2){(m->stretch.x * x - m->stretch.y * y) / length,
                                      (m->stretch.y * x + m->stretch.x * y) / length};
    return l;
}

/* Turns it about its normal so that t runs along the stretch. The bitangent is the one of a normal map (see there),
 * seen from the front: from behind the same scratches are seen. */
static void turn_frame(struct lum_frame *f, struct lum_vec2 stretch, const struct lum_surface *s)
{
    struct lum_vec3 t = lum_normalize(s->tangent);
    t = lum_v3_mad(t, f->n, -lum_dot(f->n, t));
    if (!(lum_dot(t, t) > 1e-6f)) /* along the normal, as far as rounding lets one see */
        return;
    t = lum_normalize(t);
    t = lum_normalize(lum_v3_mad(t, f->n, -lum_dot(f->n, t)));
    struct lum_vec3 b = lum_cross(f->n, t);
    if (lum_dot(b, s->bitangent) < 0.0f)
        b = lum_v3_neg(b);
    f->t = lum_v3_mad(lum_v3_mul(t, stretch.x), b, stretch.y);
    f->b = lum_cross(f->n, f->t);
}

/* Frame and sides. False when wo lies in the surface, or the surface has no normal. */
static bool init_frame(struct lum_bsdf *b, const struct lum_material *m, const struct lines *lines,
                       const struct lum_surface *s, struct lum_vec3 wo)
{
    struct lum_vec3 ns = mapped_normal((struct relief){&m->normal_tex, m->normal_scale}, s);
    b->ng = s->ng;
    if (lum_dot(wo, b->ng) < 0.0f) {
        b->ng = lum_v3_neg(b->ng);
        ns = lum_v3_neg(ns);
    }
    if (!(lum_dot(wo, b->ng) > 0.0f) || !lum_v3_finite(ns)) {
        b->ng = lum_v3(0.0f, 0.0f, 0.0f);
        return false;
    }
    b->frame = lum_frame_from_normal(normal_facing(ns, b->ng, wo));
    if (lum_material_is_brushed(m))
        turn_frame(&b->frame, lines->stretch, s);
    return true;
}

/* Bumps of the coat are those of its own map alone. Where textures say how rough it is, it is nowhere a mirror. */
static void add_clearcoat(struct lum_bsdf *b, const struct lum_material *m, const struct lum_surface *s,
                          struct lum_vec3 wo)
{
    float weight = lum_clamp01(m->clearcoat * lum_texture_sample(&m->clearcoat_tex, s->uv).rgb.r);
    float rough = lum_clamp01(m->clearcoat_roughness * lum_texture_sample(&m->clearcoat_roughness_tex, s->uv).rgb.g);
    float alpha = rough * rough, least = m->clearcoat_roughness_tex.image ? LUM_ALPHA_MIN : 0.0f;
    struct lum_vec3 n = b->frame.n;
    if (!(weight > 0.0f))
        return;
    if (m->normal_tex.image || m->clearcoat_normal_tex.image) {
        struct lum_vec3 own = mapped_normal((struct relief){&m->clearcoat_normal_tex, m->clearcoat_normal_scale}, s);
        if (lum_v3_finite(own))
            n = normal_facing(lum_dot(s->ng, b->ng) < 0.0f ? lum_v3_neg(own) : own, b->ng, wo);
    }
    lum_clearcoat_init(b, weight, alpha < LUM_ALPHA_MIN ? least : alpha, n, wo);
}

/* What it reflects: where its texture lets less pass, more is left. */
static struct lum_rgb sheet_base(const struct lum_material *m, struct lum_rgb base, float passed)
{
    float share = m->diffuse_transmission_share;
    return passed < 1.0f ? clamp01_rgb(lum_rgb_scale(base, (1.0f - share * passed) / (1.0f - share))) : base;
}

/* What a sheet transmits of what textures and vertices leave to it; passed: as its own texture says. */
static struct lum_rgb sheet_color(const struct lum_material *m, struct lum_rgb base, float passed)
{
    struct lum_rgb t = lum_rgb_scale(m->diffuse_transmittance, passed);
    return lum_rgb(lum_clamp(t.r, 0.0f, 1.0f - base.r), lum_clamp(t.g, 0.0f, 1.0f - base.g),
                   lum_clamp(t.b, 0.0f, 1.0f - base.b));
}

static struct lum_rgb mean_of(const struct lum_texture *t)
{
    return t->image ? t->image->mean : lum_grey(1.0f);
}

float lum_material_reflects(const struct lum_material *m)
{
    if (m->unlit)
        return 0.0f;
    float metal = lum_clamp01(m->metallic * mean_of(&m->metallic_roughness_tex).b), ior = lum_max(m->ior, 1.0f);
    float clear = lum_clamp01(m->transmission * mean_of(&m->transmission_tex).r);
    float coated = (1.0f - metal) * (1.0f - clear), r = (ior - 1.0f) / (ior + 1.0f);
    struct lum_rgb base = clamp01_rgb(lum_rgb_mul(m->base_color, mean_of(&m->base_color_tex)));
    struct lum_rgb color = lum_rgb_mul(m->specular_color, mean_of(&m->specular_color_tex));
    struct lum_rgb coat = clamp01_rgb(lum_rgb_scale(color, r * r * lum_clamp01(m->specular))); /* alphas count as 1 */
    struct lum_rgb even = lum_rgb_mad(base, lum_rgb_mul(base, coat), -1.0f); /* of what the coat leaves */
    if (lum_material_is_sheet(m))
        even = lum_rgb_add(even, sheet_color(m, base, 1.0f));
    even = lum_rgb_scale(even, coated);
    struct lum_rgb all = lum_rgb_mad(lum_rgb_mad(even, base, metal), coat, 1.0f - metal);
    return lum_clamp01(lum_luminance(all));
}

/* Of which the surface is a mix; the rest is glass. */
struct shares {
    float metal, coated;
    struct lum_rgb base;
};

static void init_roughness(struct lum_bsdf *b, const struct lum_material *m, const struct lines *lines, float alpha)
{
    float along = lum_material_is_brushed(m) ? lum_brushed_along(alpha, lines->strength) : alpha;
    b->alpha = alpha;
    if (along < LUM_ALPHA_MIN)
        b->alpha = m->metallic_roughness_tex.image || m->anisotropy_tex.image ? LUM_ALPHA_MIN : 0.0f;
    else if (along > lum_max(alpha, LUM_ALPHA_MIN)) {
        b->spread = (struct lum_vec2){along, lum_max(alpha, LUM_ALPHA_MIN)};
        b->brushed = m->brushed;
        b->brushed_row = lum_brushed_row(m->brushed, lines->strength, b->spread.y);
        b->alpha = sqrtf(0.5f * (b->spread.x * b->spread.x + b->spread.y * b->spread.y));
    } else if (lum_material_is_brushed(m))
        b->alpha = lum_max(alpha, LUM_ALPHA_MIN);
}

/* The mix of metal, coated base and glass; each share times its own parameters (bsdf.h). */
static struct shares init_lobes(struct lum_bsdf *b, const struct lum_material *m, const struct lines *lines,
                                const struct lum_surface *s)
{
    struct lum_texel_value mr = lum_texture_sample(&m->metallic_roughness_tex, s->uv);
    float metal = lum_clamp01(m->metallic * mr.rgb.b), roughness = lum_clamp01(m->roughness * mr.rgb.g);
    float clear = lum_clamp01(m->transmission * lum_texture_sample(&m->transmission_tex, s->uv).rgb.r);
    float glass = (1.0f - metal) * clear, coated = 1.0f - metal - glass;
    struct lum_rgb base = base_color(m, s->uv, s->vertex_color);

    init_roughness(b, m, lines, roughness * roughness);

    float ior = lum_max(m->ior, 1.0f), r = (ior - 1.0f) / (ior + 1.0f);
    bool matched = lum_ior_is_matched(ior);
    float specular = lum_clamp01(m->specular * lum_texture_sample(&m->specular_tex, s->uv).a);
    specular = matched ? 0.0f : specular; /* matched: there is no interface, at grazing neither */
    b->thin = m->thin;
    b->straight = matched || ((m->thin || m->straight) && b->alpha == 0.0f);
    b->eta = matched ? 1.0f : s->backface && !m->thin && !b->straight ? ior : 1.0f / ior;
    struct lum_rgb color = lum_rgb_mul(m->specular_color, lum_texture_sample(&m->specular_color_tex, s->uv).rgb);
    struct lum_rgb f0 = clamp01_rgb(lum_rgb_scale(color, r * r));
    f0 = lum_rgb_scale(f0, specular);

    coated = lum_max(coated, 0.0f);
    struct lum_rgb matt = base;
    if (lum_material_is_sheet(m)) {
        float passed = lum_clamp01(lum_texture_sample(&m->diffuse_transmission_tex, s->uv).a);
        matt = sheet_base(m, base, passed);
        b->through = lum_rgb_scale(sheet_color(m, matt, passed), coated);
    }
    b->diffuse = lum_rgb_scale(matt, coated);
    b->f0 = lum_rgb_mad(lum_rgb_scale(base, metal), f0, coated);
    b->f90 = metal + coated * specular;
    b->glass = glass;
    b->glass_f0 = f0;
    b->glass_f90 = specular;
    b->transmit = lum_rgb_scale(base, glass);
    return (struct shares){metal, coated, base};
}

/* Fresnel reflectance of light that met two or more microfacets, from the mean reflectance and the mean albedo a of one
 * meeting (Kulla & Conty 2017). 1 / 21: mean of Schlick's (1 - c)^5. */
static float multiple_fresnel(float f0, float f90, float a)
{
    float f = f0 + (f90 - f0) * (1.0f / 21.0f);
    return f * f * a / (1.0f - f * (1.0f - a));
}

static struct lum_rgb multiple_fresnel_rgb(struct lum_rgb f0, float f90, float a)
{
    return lum_rgb(multiple_fresnel(f0.r, f90, a), multiple_fresnel(f0.g, f90, a), multiple_fresnel(f0.b, f90, a));
}

/* Of thin glass both sides get of it what a microfacet reflects and transmits on average. scale: (1 - a(wo)) over its
 * mean.
 */
static void add_glass_multi(struct lum_bsdf *b, struct lum_rgb tint, float scale, float a)
{
    struct lum_rgb f0 = b->glass_f0, up, down;
    float f90 = b->glass_f90;
    struct lum_rgb mean = lum_rgb_mad(lum_grey(f90 / 21.0f), f0, 20.0f / 21.0f);
    lum_glass_sheet(mean, tint, &up, &down);
    struct lum_rgb f = lum_rgb_add(up, down);
    struct lum_rgb k = lum_rgb(f.r * a / (1.0f - f.r * (1.0f - a)), f.g * a / (1.0f - f.g * (1.0f - a)),
                               f.b * a / (1.0f - f.b * (1.0f - a)));
    k = lum_rgb_scale(k, b->glass * scale);
    b->multi = lum_rgb_add(b->multi, lum_rgb_mul(up, k));
    if (b->brushed) /* microfacets across are too sharp to draw it by, so it stays on this side */
        b->multi = lum_rgb_add(b->multi, lum_rgb_mul(down, k));
    else
        b->multi_far = lum_rgb_mul(down, k);
}

/* 1 - E at one direction, or its mean. */
static float through_coat(const struct lum_bsdf *b, struct lum_ggx_albedo e)
{
    return lum_max(b->coat[0] - b->coat[1] * e.scale - b->coat[2] * e.bias, 0.0f);
}

/* What the interface leaves to the base and loses to several meetings, and the probabilities of sampling them. */
static void init_weights(struct lum_bsdf *b, const struct shares *of, struct lum_vec3 wo)
{
    b->coat[0] = b->coat_norm = b->coat_left = 1.0f;
    if (b->f90 == 0.0f && b->glass == 0.0f && lum_rgb_black(b->f0)) { /* matte: no interface */
        b->diffuse_prob = lum_rgb_black(b->diffuse) ? 0.0f : 1.0f;
        b->lobes = lum_luminance(b->diffuse);
        return;
    }
    if (!b->brushed)
        b->row = lum_ggx_row(b->alpha);
    struct lum_ggx_albedo e = lum_bsdf_facet_albedo(b, wo), mean = lum_bsdf_facet_albedo_mean(b);
    float lost = 1.0f - (e.scale + e.bias), mean_kept = mean.scale + mean.bias;
    float coat_f0 = lum_rgb_max(b->glass_f0), coat_f90 = b->glass_f90, coat_multi = 0.0f;
    if (b->alpha > 0.0f && mean_kept < 1.0f) {
        struct lum_rgb metal = multiple_fresnel_rgb(of->base, 1.0f, mean_kept);
        struct lum_rgb coat = multiple_fresnel_rgb(b->glass_f0, coat_f90, mean_kept);
        float scale = lum_max(lost, 0.0f) / (1.0f - mean_kept);
        b->multi = lum_rgb_mad(lum_rgb_scale(metal, of->metal * scale), coat, of->coated * scale);
        coat_multi = lum_rgb_max(coat);
        if (b->thin && b->glass > 0.0f && !b->straight)
            add_glass_multi(b, of->base, scale, mean_kept);
    }
    b->coat[0] = 1.0f - coat_multi;
    b->coat[1] = coat_f0 - coat_multi;
    b->coat[2] = coat_f90 - coat_multi;
    float through = through_coat(b, e), through_mean = through_coat(b, mean);
    b->coat_norm = through_mean > 0.0f ? through / through_mean : 0.0f;
    if (b->coat_norm == 0.0f)
        b->diffuse = b->through = lum_grey(0.0f);

    float cosine = lum_luminance(b->diffuse) * through + lum_luminance(b->multi) * (1.0f - mean_kept);
    struct lum_rgb spec = lum_rgb_add(lum_rgb_scale(b->f0, e.scale), lum_grey(b->f90 * e.bias));
    float rest = lum_luminance(spec) + b->glass * lum_luminance(b->glass_f0) + lum_luminance(b->transmit);
    b->diffuse_prob = cosine > 0.0f ? cosine / (cosine + rest) : 0.0f;
    b->lobes = cosine + rest;
    b->coat_left = through;
}

void lum_bsdf_add_far_side(struct lum_bsdf *b)
{
    float far = lum_luminance(b->through) * b->coat_left, near = b->diffuse_prob * b->lobes;
    if (!(far > 0.0f))
        return;
    b->far_prob = far / (near + far);
    b->diffuse_prob = (near + far) / (b->lobes + far);
}

struct lum_bsdf lum_bsdf_far_side(const struct lum_bsdf *b)
{
    struct lum_bsdf far = *b;
    far.frame = lum_frame_from_normal(lum_v3_neg(b->frame.n));
    if (b->brushed)
        far.frame.t = b->frame.t, far.frame.b = lum_v3_neg(b->frame.b);
    far.ng = lum_v3_neg(b->ng);
    far.diffuse = b->through;
    far.through = far.f0 = far.transmit = far.multi = far.emission = lum_grey(0.0f);
    far.f90 = far.glass = far.far_prob = far.clear.share = far.sheen.share = 0.0f;
    far.diffuse_prob = 1.0f;
    return far;
}

struct lum_bsdf lum_bsdf_white(struct lum_vec3 n, struct lum_vec3 ng)
{
    return (struct lum_bsdf){.frame = lum_frame_from_normal(n),
                             .ng = ng,
                             .diffuse = lum_grey(1.0f),
                             .diffuse_prob = 1.0f,
                             .coat = {1.0f},
                             .coat_norm = 1.0f,
                             .alpha = 1.0f,
                             .eta = 1.0f};
}

/* A luxmeter lies on the surface, and not on the bumps of a normal map. */
static void init_white(struct lum_bsdf *b, const struct lum_surface *s, struct lum_vec3 wo)
{
    float side = lum_dot(wo, s->ng);
    struct lum_vec3 ng = side < 0.0f ? lum_v3_neg(s->ng) : s->ng, ns = side < 0.0f ? lum_v3_neg(s->ns) : s->ns;
    if (side != 0.0f && lum_v3_finite(ns))
        *b = lum_bsdf_white(normal_facing(ns, ng, wo), ng);
    else
        *b = (struct lum_bsdf){.eta = 1.0f};
}

void lum_bsdf_init(struct lum_bsdf *ret_bsdf, const struct lum_material *m, const struct lum_surface *s,
                   struct lum_vec3 wo)
{
    if (s->white) {
        init_white(ret_bsdf, s, wo);
        return;
    }
    *ret_bsdf =
        (struct lum_bsdf){.eta = 1.0f, .emission = lum_material_emission(m, s->emission, s->uv, s->vertex_color)};
    struct lines lines = lines_at(m, s->uv);
    if (!init_frame(ret_bsdf, m, &lines, s, wo) || m->unlit)
        return;
    struct shares shares = init_lobes(ret_bsdf, m, &lines, s);
    init_weights(ret_bsdf, &shares, wo);
    if (lum_rgb_max(m->sheen_color) > 0.0f)
        lum_sheen_init(ret_bsdf, clamp01_rgb(m->sheen_color), lum_clamp01(m->sheen_roughness), wo);
    if (m->clearcoat > 0.0f)
        add_clearcoat(ret_bsdf, m, s, wo);
}

struct lum_rgb lum_bsdf_albedo(const struct lum_bsdf *b)
{
    struct lum_rgb glass = lum_rgb_add(b->transmit, lum_rgb_scale(b->glass_f0, b->glass));
    if (b->clear.weight > 0.0f)
        glass = lum_rgb_add(glass, lum_grey(b->clear.weight * LUM_CLEARCOAT_F0));
    return clamp01_rgb(lum_rgb_add(lum_rgb_add(lum_rgb_add(b->diffuse, b->f0), glass), b->through));
}
