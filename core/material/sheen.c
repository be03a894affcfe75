#include "core/material/sheen.h"

#define COS_MIN 2e-3f /* the header says why */

/* ---- the table ---- */

/* Nodes: roughness = (4 + j) / 15; cos = (i / 23)^2. tests/numeric/sheen_test.c computes it anew by quadrature. */
enum { ROUGHNESS_NODES = 12, COS_NODES = 24 };
/* clang-format off */
static const float albedo_table[ROUGHNESS_NODES][COS_NODES] = {
    {0.9706f, 0.9664f, 0.9756f, 0.9176f, 0.8349f, 0.7446f, 0.6545f, 0.5681f,
     0.4871f, 0.4124f, 0.3443f, 0.2829f, 0.2284f, 0.1805f, 0.1393f, 0.1045f,
     0.0756f, 0.0526f, 0.0349f, 0.0216f, 0.0121f, 0.0058f, 0.0021f, 0.0003f},
    {0.8584f, 0.8555f, 0.8736f, 0.8329f, 0.7699f, 0.6992f, 0.6274f, 0.5575f,
     0.4909f, 0.4282f, 0.3698f, 0.3158f, 0.2662f, 0.2211f, 0.1804f, 0.1441f,
     0.1123f, 0.0851f, 0.0625f, 0.0438f, 0.0288f, 0.0171f, 0.0083f, 0.0024f},
    {0.8020f, 0.7998f, 0.8236f, 0.7927f, 0.7407f, 0.6809f, 0.6195f, 0.5592f,
     0.5011f, 0.4459f, 0.3938f, 0.3447f, 0.2988f, 0.2561f, 0.2165f, 0.1802f,
     0.1470f, 0.1175f, 0.0918f, 0.0695f, 0.0502f, 0.0336f, 0.0198f, 0.0086f},
    {0.7794f, 0.7777f, 0.8058f, 0.7809f, 0.7352f, 0.6817f, 0.6262f, 0.5714f,
     0.5184f, 0.4677f, 0.4194f, 0.3736f, 0.3302f, 0.2891f, 0.2504f, 0.2141f,
     0.1803f, 0.1493f, 0.1217f, 0.0968f, 0.0744f, 0.0541f, 0.0358f, 0.0197f},
    {0.7792f, 0.7777f, 0.8096f, 0.7884f, 0.7462f, 0.6961f, 0.6439f, 0.5921f,
     0.5419f, 0.4937f, 0.4476f, 0.4036f, 0.3616f, 0.3215f, 0.2833f, 0.2469f,
     0.2125f, 0.1804f, 0.1514f, 0.1248f, 0.1001f, 0.0770f, 0.0554f, 0.0353f},
    {0.7944f, 0.7931f, 0.8281f, 0.8091f, 0.7686f, 0.7200f, 0.6693f, 0.6189f,
     0.5700f, 0.5229f, 0.4779f, 0.4347f, 0.3933f, 0.3536f, 0.3154f, 0.2788f,
     0.2437f, 0.2107f, 0.1806f, 0.1527f, 0.1263f, 0.1012f, 0.0771f, 0.0540f},
    {0.8196f, 0.8185f, 0.8560f, 0.8381f, 0.7981f, 0.7498f, 0.6993f, 0.6491f,
     0.6005f, 0.5538f, 0.5090f, 0.4660f, 0.4246f, 0.3848f, 0.3463f, 0.3092f,
     0.2735f, 0.2397f, 0.2087f, 0.1796f, 0.1520f, 0.1254f, 0.0996f, 0.0746f},
    {0.8499f, 0.8488f, 0.8883f, 0.8706f, 0.8303f, 0.7815f, 0.7305f, 0.6799f,
     0.6310f, 0.5840f, 0.5389f, 0.4957f, 0.4541f, 0.4139f, 0.3750f, 0.3374f,
     0.3010f, 0.2665f, 0.2347f, 0.2049f, 0.1764f, 0.1488f, 0.1219f, 0.0957f},
    {0.8796f, 0.8787f, 0.9193f, 0.9015f, 0.8604f, 0.8107f, 0.7589f, 0.7077f,
     0.6583f, 0.6108f, 0.5654f, 0.5219f, 0.4799f, 0.4394f, 0.4002f, 0.3621f,
     0.3252f, 0.2902f, 0.2579f, 0.2275f, 0.1985f, 0.1703f, 0.1428f, 0.1160f},
    {0.9027f, 0.9019f, 0.9430f, 0.9248f, 0.8830f, 0.8327f, 0.7804f, 0.7288f,
     0.6790f, 0.6313f, 0.5858f, 0.5421f, 0.5001f, 0.4595f, 0.4201f, 0.3820f,
     0.3449f, 0.3097f, 0.2772f, 0.2467f, 0.2175f, 0.1892f, 0.1615f, 0.1346f},
    {0.9122f, 0.9115f, 0.9527f, 0.9344f, 0.8926f, 0.8424f, 0.7902f, 0.7389f,
     0.6894f, 0.6422f, 0.5971f, 0.5539f, 0.5123f, 0.4722f, 0.4333f, 0.3955f,
     0.3588f, 0.3239f, 0.2918f, 0.2616f, 0.2327f, 0.2047f, 0.1773f, 0.1508f},
    {0.9014f, 0.9008f, 0.9416f, 0.9240f, 0.8834f, 0.8345f, 0.7837f, 0.7338f,
     0.6859f, 0.6401f, 0.5964f, 0.5545f, 0.5143f, 0.4754f, 0.4377f, 0.4011f,
     0.3655f, 0.3316f, 0.3004f, 0.2712f, 0.2432f, 0.2161f, 0.1895f, 0.1638f},
};
/* clang-format on */

/* Directional albedo of a white one. Interpolated, within 0.01. */
static float white_albedo(float roughness, float cos_o)
{
    float r = lum_clamp(15.0f * roughness - 4.0f, 0.0f, ROUGHNESS_NODES - 1.0f);
    float c = sqrtf(lum_clamp01(cos_o)) * (COS_NODES - 1);
    uint32_t j = (uint32_t)r < ROUGHNESS_NODES - 1 ? (uint32_t)r : ROUGHNESS_NODES - 2;
    uint32_t i = (uint32_t)c < COS_NODES - 1 ? (uint32_t)c : COS_NODES - 2;
    float v = r - (float)j, u = c - (float)i;
    const float *a = &albedo_table[j][i], *b = &albedo_table[j + 1][i];
    return (a[0] + (a[1] - a[0]) * u) * (1.0f - v) + (b[0] + (b[1] - b[0]) * u) * v;
}

/* ---- the distribution ---- */

/* The fit of the shadowing, by x = cos: its five numbers between those for a roughness of 1 and of 0. */
struct shadowing {
    float a, b, c, d, e;
};

static struct shadowing shadowing_of(float alpha)
{
    static const struct shadowing rough = {21.5473f, 3.82987f, 0.19823f, -1.97760f, -4.32054f};
    static const struct shadowing smooth = {25.3245f, 3.32435f, 0.16801f, -1.27393f, -4.85967f};
    float t = (1.0f - alpha) * (1.0f - alpha);
    return (struct shadowing){rough.a + (smooth.a - rough.a) * t, rough.b + (smooth.b - rough.b) * t,
                              rough.c + (smooth.c - rough.c) * t, rough.d + (smooth.d - rough.d) * t,
                              rough.e + (smooth.e - rough.e) * t};
}

static float fit_at(const struct shadowing *s, float x)
{
    return s->a / (1.0f + s->b * powf(x, s->c)) + s->d * x + s->e;
}

static float lambda(const struct shadowing *s, float cos)
{
    return expf(cos < 0.5f ? fit_at(s, cos) : 2.0f * fit_at(s, 0.5f) - fit_at(s, 1.0f - cos));
}

/* f cos_i of a white one. */
static float eval(float alpha, struct lum_vec3 o, struct lum_vec3 i)
{
    struct lum_vec3 h = lum_v3_add(o, i);
    float length2 = lum_dot(h, h), sin2 = length2 > 0.0f ? (h.x * h.x + h.y * h.y) / length2 : 0.0f;
    float cos_o = lum_clamp(o.z, COS_MIN, 1.0f), cos_i = lum_clamp(i.z, COS_MIN, 1.0f);
    struct shadowing s = shadowing_of(alpha);
    float d = (2.0f + 1.0f / alpha) * powf(lum_clamp(sin2, 0.0f, 1.0f), 0.5f / alpha) * 0.5f * LUM_INV_PI;
    return d / (1.0f + lambda(&s, cos_o) + lambda(&s, cos_i)) / (4.0f * cos_o * cos_i) * i.z;
}

/* ---- the lobe ---- */

float lum_sheen_through(const struct lum_bsdf *b, float cos)
{
    return 1.0f - b->sheen.weight * (b->sheen.weight > 0.0f ? white_albedo(b->sheen.roughness, fabsf(cos)) : 0.0f);
}

/* Mean of what it lets through of light that the base's coat lets through. At midpoints,
 * for each hit: more of them keep more light where E turns at grazing angles, and take time. */
static float mean_left(const struct lum_bsdf *b)
{
    enum { STEPS = 8 };
    float both = 0.0f, through = 0.0f;
    for (int k = 0; k < STEPS; k++) {
        float cos = ((float)k + 0.5f) / STEPS, t = cos * lum_bsdf_through_base(b, cos);
        through += t;
        both += t * lum_sheen_through(b, cos);
    }
    return through > 0.0f ? both / through : 1.0f;
}

void lum_sheen_init(struct lum_bsdf *b, struct lum_rgb color, float roughness, struct lum_vec3 wo)
{
    struct lum_sheen *s = &b->sheen;
    float cos_o = lum_dot(wo, b->frame.n);
    s->color = color;
    s->weight = lum_rgb_max(color);
    s->roughness = lum_clamp(roughness, LUM_SHEEN_ROUGHNESS_MIN, 1.0f);
    s->left = lum_sheen_through(b, cos_o);
    float mean = mean_left(b);
    s->norm = mean > 0.0f ? s->left / mean : 0.0f;

    float own = lum_luminance(lum_bsdf_sheen_albedo(b, wo));
    float even = b->diffuse_prob * b->lobes * s->left, other = (1.0f - b->diffuse_prob) * b->lobes * s->left;
    s->share = own > 0.0f ? own / (own + other) : 0.0f;
    b->lobes = even + other + own;
    b->diffuse_prob = b->lobes > 0.0f ? even / b->lobes : 0.0f;
    b->coat_left *= s->left;
}

struct lum_rgb lum_bsdf_sheen_albedo(const struct lum_bsdf *b, struct lum_vec3 wo)
{
    if (!(b->sheen.weight > 0.0f))
        return lum_grey(0.0f);
    float albedo = white_albedo(b->sheen.roughness, fabsf(lum_dot(wo, b->frame.n)));
    return lum_rgb_scale(b->sheen.color, b->clear.weight > 0.0f ? albedo * b->clear.left : albedo);
}

float lum_sheen_even(const struct lum_bsdf *b, float cos_i)
{
    return b->sheen.norm * lum_sheen_through(b, cos_i);
}

float lum_sheen_left(const struct lum_bsdf *b, float cos_i)
{
    return lum_min(b->sheen.left, lum_sheen_through(b, cos_i));
}

void lum_sheen_add(const struct lum_bsdf *b, struct lum_vec3 o, struct lum_vec3 i, bool above, struct lum_bsdf_value *v)
{
    const struct lum_sheen *s = &b->sheen;
    v->gloss = lum_rgb_scale(v->gloss, lum_sheen_left(b, i.z));
    v->gloss_pdf_sa *= 1.0f - s->share;
    if (!above || !(s->share > 0.0f))
        return;
    v->gloss = lum_rgb_mad(v->gloss, s->color, eval(s->roughness * s->roughness, o, i));
    v->gloss_pdf_sa += s->share * 0.5f * LUM_INV_PI; /* evenly over the hemisphere */
}
