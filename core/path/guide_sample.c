/* Directions by the histogram of a cell, and by its mixture with a BSDF.
 *
 * A bin is a square of a face of the cube [-1, 1]^3, on which directions are even: with u, v on the face, the solid
 * angle of a small area is that area over (1 + u^2 + v^2)^1.5. No angles, so that any machine has the same. */
#include "core/path/guide.h"

#define SIDE LUM_PATH_GUIDE_SIDE

struct on_cube {
    uint32_t bin;
    float u, v;
};

static uint32_t column(float u)
{
    return (uint32_t)lum_clamp((u + 1.0f) * (0.5f * SIDE), 0.0f, SIDE - 1.0f);
}

static struct on_cube project(struct lum_vec3 d)
{
    float x = fabsf(d.x), y = fabsf(d.y), z = fabsf(d.z), w, u, v;
    uint32_t axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
    w = lum_v3_part(d, axis);
    u = axis == 0 ? d.y : axis == 1 ? d.z : d.x;
    v = axis == 0 ? d.z : axis == 1 ? d.x : d.y;
    float s = 1.0f / fabsf(w);
    uint32_t face = 2 * axis + (w < 0.0f), row = face * SIDE + column(v * s);
    return (struct on_cube){row * SIDE + column(u * s), u * s, v * s};
}

/* Per solid angle at (u, v) of bin's face. */
static float density(const struct lum_path_guide_cell *cell, uint32_t bin, float u, float v)
{
    float mass = (float)(cell->bins[bin] - (bin > 0 ? cell->bins[bin - 1] : 0)), r2 = 1.0f + u * u + v * v;
    return mass * (0.25f * SIDE * SIDE / LUM_PATH_GUIDE_WHOLE) * r2 * sqrtf(r2);
}

float lum_path_guide_pdf(const struct lum_path_guide_cell *cell, struct lum_vec3 d, uint32_t *ret_bin)
{
    struct on_cube at = project(d);
    *ret_bin = at.bin;
    return cell->share > 0.0f ? density(cell, at.bin, at.u, at.v) : 0.0f;
}

/* How many of n inclusive sums end at x or before. Without a branch: n is small. */
static inline uint32_t count_ended(const uint16_t *sums, uint32_t n, uint16_t x)
{
    uint16_t ended = 0;
    for (uint32_t i = 0; i < n; i++)
        ended = (uint16_t)(ended + (sums[i] <= x));
    return ended;
}

struct lum_vec3 lum_path_guide_sample(const struct lum_path_guide_cell *cell, struct lum_vec2 u, uint32_t *ret_bin,
                                      float *ret_pdf_sa)
{
    float x = lum_min(u.x * LUM_PATH_GUIDE_WHOLE, LUM_PATH_GUIDE_WHOLE - 0x1p-8f); /* the product may round up */
    uint32_t row = count_ended(cell->rows, LUM_PATH_GUIDE_ROWS, (uint16_t)x), face = row / SIDE;
    uint32_t bin = row * SIDE + count_ended(cell->bins + row * SIDE, SIDE, (uint16_t)x);
    float below = bin > 0 ? (float)cell->bins[bin - 1] : 0.0f, inside = (x - below) / ((float)cell->bins[bin] - below);
    float a = ((float)(bin % SIDE) + inside) * (2.0f / SIDE) - 1.0f,
          b = ((float)(row % SIDE) + u.y) * (2.0f / SIDE) - 1.0f;
    float one = face % 2 ? -1.0f : 1.0f;
    *ret_bin = bin;
    *ret_pdf_sa = density(cell, bin, a, b);
    return lum_normalize(face < 2 ? lum_v3(one, a, b) : face < 4 ? lum_v3(b, one, a) : lum_v3(a, b, one));
}

/* ---- with a BSDF: of its cosine-shaped directions, a share goes by the cell ---- */

static float mixed(const struct lum_path_guide_locate *at, float pdf_sa, float pdf_cell, float cosine)
{
    return pdf_sa + at->share * (pdf_cell - cosine * LUM_INV_PI);
}

float lum_path_guide_bsdf_pdf(const struct lum_path_guide_locate *at, const struct lum_bsdf *b, struct lum_vec3 wi,
                              float pdf_sa)
{
    float cosine = lum_dot(wi, b->frame.n);
    uint32_t bin;
    if (!(at->share > 0.0f && cosine > 0.0f))
        return pdf_sa;
    return mixed(at, pdf_sa, lum_path_guide_pdf(at->cell, wi, &bin), cosine);
}

/* The BSDF for a direction that the cell chose; below the surface there is none. */
static bool weigh(const struct lum_bsdf *b, struct lum_vec3 wo, struct lum_vec3 wi, struct lum_bsdf_sample *ret_sample)
{
    struct lum_bsdf_sample s = {.wi = wi, .lobe = LUM_LOBE_DIFFUSE};
    if (!(lum_dot(wi, b->frame.n) > 0.0f))
        return false;
    struct lum_rgb f = lum_bsdf_eval(b, wo, wi, &s.pdf_sa);
    if (!(s.pdf_sa > 0.0f) || lum_rgb_black(f))
        return false;
    s.weight = lum_rgb(f.r / s.pdf_sa, f.g / s.pdf_sa, f.b / s.pdf_sa);
    *ret_sample = s;
    return true;
}

bool lum_path_guide_bsdf_sample(const struct lum_path_guide_locate *at, const struct lum_bsdf *b, struct lum_vec3 wo,
                                struct lum_vec2 u, float u_lobe, struct lum_path_guide_step *ret_step)
{
    struct lum_path_guide_step *step = ret_step;
    struct lum_bsdf_sample *s = &step->s;
    bool by_cell = u_lobe < at->share;
    float pdf_cell = 0.0f;
    step->ratio = 1.0f;
    step->cosine = 0.0f;
    if (by_cell) {
        struct lum_vec3 wi = lum_path_guide_sample(at->cell, u, &step->bin, &pdf_cell);
        if (!weigh(b, wo, wi, s))
            return false;
    } else if (!lum_bsdf_sample(b, wo, u, u_lobe, s)) {
        return false;
    }
    if (!at->cell || !(s->pdf_sa > 0.0f))
        return true;
    step->cosine = lum_max(lum_dot(s->wi, b->frame.n), 0.0f);
    if (!(step->cosine > 0.0f))
        return true;
    if (!by_cell)
        pdf_cell = lum_path_guide_pdf(at->cell, s->wi, &step->bin);
    float pdf_sa = mixed(at, s->pdf_sa, pdf_cell, step->cosine);
    step->ratio = pdf_sa / s->pdf_sa;
    s->weight = lum_rgb_scale(s->weight, 1.0f / step->ratio);
    s->pdf_sa = pdf_sa;
    return true;
}
