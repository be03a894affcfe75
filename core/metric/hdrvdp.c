#include "core/metric/hdrvdp.h"

#include <math.h>
#include <string.h>

#include "core/math/vec.h"
#include "core/metric/cortex.h"
#include "core/metric/eye.h"
#include "core/metric/fft.h"
#include "core/metric/metric.h"

#define DEGREES_PER_RADIAN ((float)(180.0 / LUM_PI_D))
#define MARGIN 32u /* pixels of mirrored picture around it: a period of the coarsest band */
/* Luminances the eye can be adapted to: 10^-3, 10^-2 ... 10^2; sensitivity between them is that of both, by parts. */
#define LEVELS 6
#define LEVEL_FIRST (-3)
#define CURVE_STEPS 2048 /* of sensitivity over frequency */
/* Daly's masking, (1 + (k1 (k2 m)^s)^4)^(1/4), k1 = W^(1 - 1/(1-Q)), k2 = W^(1/(1-Q)): for the calibrated slope s = 1
 * the product k1 k2 is W = 6, whatever Q is. */
#define MASKING 6.0f
/* Differences that rounding makes: of luminance, in cd/m2, and of what is bright, relative to it. */
#define SAME_LUMINANCE 1e-4f
#define SAME_CONTRAST 1e-5f

struct vdp {
    const struct lum_hdrvdp_input *in;
    double picture_deg2;
    struct lum_fft fft;
    size_t n; /* of the mirrored picture */
    /* of each term of a transform */
    float *frequency, *angle; /* cycles per pixel; radians */
    float *transfer;          /* what the optics leave of it */
    float *filter;            /* by which it is multiplied */
    /* of each place */
    float *level;  /* log10 of the luminance it is adapted to, less LEVEL_FIRST */
    float *doubt;  /* sum over bands of (difference / threshold)^3.5: seen with probability 1 - exp(-doubt) */
    uint8_t *same; /* the pictures do not differ here */
    /* both pictures, x as the real part and r as the imaginary; transforms, and places */
    float *terms, *filtered, *band, *mask;
    float *memory;
};

/* ---- memory ---- */

static void find_frequencies(struct vdp *v)
{
    const uint32_t w = v->fft.w, h = v->fft.h;
    for (uint32_t j = 0; j < h; j++)
        for (uint32_t i = 0; i < w; i++) {
            float x = (float)lum_fft_frequency(i, w), y = (float)lum_fft_frequency(j, h);
            v->frequency[(size_t)j * w + i] = sqrtf(x * x + y * y);
            v->angle[(size_t)j * w + i] = atan2f(y, x);
        }
}

static enum lum_status begin(struct vdp *v, const struct lum_hdrvdp_input *in, struct lum_error *err)
{
    const uint32_t w = in->w, h = in->h;
    enum lum_status st;
    if (w == 0 || h == 0)
        return lum_fail(err, LUM_ERR_INVALID, "", "a picture without pixels");
    if (!(in->pixels_per_degree >= 1.0 && in->pixels_per_degree <= LUM_HDRVDP_PIXELS_PER_DEGREE_MAX))
        return lum_fail(err, LUM_ERR_INVALID, "pixels_per_degree", "pixels per degree must be 1 to %g",
                        LUM_HDRVDP_PIXELS_PER_DEGREE_MAX);
    if ((st = lum_metric_require_finite(&in->x, 1, w, h, "the picture", err)) ||
        (st = lum_metric_require_finite(&in->r, 1, w, h, "the reference", err)) ||
        (st = lum_fft_init(&v->fft, lum_fft_fast_size(w + 2 * MARGIN), lum_fft_fast_size(h + 2 * MARGIN), err)))
        return st;
    v->in = in;
    v->picture_deg2 = (double)w * h / (in->pixels_per_degree * in->pixels_per_degree);
    v->n = (size_t)v->fft.w * v->fft.h;
    v->memory = lum_calloc(v->n, 14 * sizeof *v->memory);
    v->same = lum_calloc(v->n, 1);
    if (!v->memory || !v->same)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory to compare %u x %u pixels by HDR-VDP", w, h);
    float *next = v->memory, **planes[] = {&v->frequency, &v->angle, &v->transfer, &v->filter, &v->level, &v->doubt};
    for (size_t i = 0; i < LUM_ARRAY_LEN(planes); i++, next += v->n)
        *planes[i] = next;
    float **pairs[] = {&v->terms, &v->filtered, &v->band, &v->mask};
    for (size_t i = 0; i < LUM_ARRAY_LEN(pairs); i++, next += 2 * v->n)
        *pairs[i] = next;
    find_frequencies(v);
    return LUM_OK;
}

static void end(struct vdp *v)
{
    lum_fft_finish(&v->fft);
    lum_free(v->memory);
    lum_free(v->same);
}

/* ret: the pictures of terms times by. */
static void filter(struct vdp *v, const float *by, float *ret)
{
    for (size_t i = 0; i < v->n; i++) {
        v->filtered[2 * i] = v->terms[2 * i] * by[i];
        v->filtered[2 * i + 1] = v->terms[2 * i + 1] * by[i];
    }
    lum_fft_inverse(&v->fft, v->filtered, ret);
}

/* ---- the optics ---- */

/* The pixel of a picture of n that is seen at i, mirrored at both ends as often as it takes. */
static uint32_t mirrored(int64_t i, uint32_t n)
{
    int64_t k = i % (2 * (int64_t)n);
    k = k < 0 ? k + 2 * (int64_t)n : k;
    return (uint32_t)(k < (int64_t)n ? k : 2 * (int64_t)n - 1 - k);
}

static void mirror_pictures(struct vdp *v, float *ret_pair)
{
    const struct lum_hdrvdp_input *in = v->in;
    for (uint32_t j = 0; j < v->fft.h; j++)
        for (uint32_t i = 0; i < v->fft.w; i++) {
            size_t at = (size_t)j * v->fft.w + i;
            size_t from = (size_t)mirrored((int64_t)j - MARGIN, in->h) * in->w + mirrored((int64_t)i - MARGIN, in->w);
            ret_pair[2 * at] = fminf(fmaxf(in->x[from], (float)LUM_EYE_LUMINANCE_MIN), (float)LUM_EYE_LUMINANCE_MAX);
            ret_pair[2 * at + 1] =
                fminf(fmaxf(in->r[from], (float)LUM_EYE_LUMINANCE_MIN), (float)LUM_EYE_LUMINANCE_MAX);
        }
}

/* Mean of logarithms, over all places of r. */
static double adaptation(const struct vdp *v, const float *pair)
{
    double sum = 0.0;
    for (size_t i = 0; i < v->n; i++)
        sum += log((double)pair[2 * i + 1]);
    return exp(sum / (double)v->n);
}

/* band: luminance on the retina. */
static void go_through_optics(struct vdp *v)
{
    mirror_pictures(v, v->band);
    double pupil_mm = lum_eye_pupil_mm(adaptation(v, v->band));
    lum_fft_forward(&v->fft, v->band, v->terms);
    for (size_t i = 0; i < v->n; i++)
        v->transfer[i] = (float)lum_eye_transfer((double)v->frequency[i] * v->in->pixels_per_degree, pupil_mm);
    filter(v, v->transfer, v->band);
    for (size_t i = 0; i < v->n; i++) {
        float x = v->band[2 * i], r = v->band[2 * i + 1];
        v->same[i] = fabsf(x - r) <= SAME_LUMINANCE + SAME_CONTRAST * r;
        v->level[i] = fminf(fmaxf(log10f(fmaxf(r, (float)LUM_EYE_LUMINANCE_MIN)) - LEVEL_FIRST, 0.0f), LEVELS - 1);
    }
}

/* ---- just noticeable differences, by frequency ---- */

struct curve {
    double step;
    float at[CURVE_STEPS];
};

static void find_curve(const struct vdp *v, double luminance, struct curve *c)
{
    const double highest =
        sqrt(0.5) * v->in->pixels_per_degree / lum_eye_squeeze(0.25 * LUM_PI_D); /* along the diagonal */
    const double peak = lum_eye_peak_sensitivity(luminance, v->picture_deg2);
    c->step = highest / (CURVE_STEPS - 2);
    for (int i = 0; i < CURVE_STEPS; i++)
        c->at[i] = (float)(lum_eye_curve(c->step * i, luminance, v->picture_deg2) / peak);
}

static float curve_at(const struct curve *c, double frequency)
{
    double t = frequency / c->step;
    uint32_t i = t < CURVE_STEPS - 2 ? (uint32_t)t : CURVE_STEPS - 2;
    return c->at[i] + (float)(t - i) * (c->at[i + 1] - c->at[i]);
}

/* Sensitivity over that at its peak, less what the optics took already. Nothing of what does not vary. */
static void find_sensitivity(struct vdp *v, double luminance)
{
    struct curve c;
    find_curve(v, luminance, &c);
    for (size_t i = 0; i < v->n; i++) {
        double f = (double)v->frequency[i] * v->in->pixels_per_degree;
        float s = fminf(curve_at(&c, f / lum_eye_squeeze((double)v->angle[i])), curve_at(&c, f));
        v->filter[i] = fminf(s / v->transfer[i], 1.0f);
    }
    v->filter[0] = 0.0f;
}

/* band: JND above and below what does not vary; 1 is at its threshold in each place, at every frequency. */
static void weigh_by_sensitivity(struct vdp *v)
{
    struct lum_jnd_scale scale;
    lum_jnd_scale_init(&scale, v->picture_deg2);
    for (size_t i = 0; i < 2 * v->n; i++)
        v->mask[i] = lum_jnd_of(&scale, v->band[i]);
    lum_fft_forward(&v->fft, v->mask, v->terms);
    memset(v->band, 0, 2 * v->n * sizeof *v->band);
    for (int level = 0; level < LEVELS; level++) {
        find_sensitivity(v, pow(10.0, LEVEL_FIRST + level));
        filter(v, v->filter, v->mask);
        for (size_t i = 0; i < v->n; i++) {
            float share = fmaxf(1.0f - fabsf(v->level[i] - (float)level), 0.0f);
            v->band[2 * i] += share * v->mask[2 * i];
            v->band[2 * i + 1] += share * v->mask[2 * i + 1];
        }
    }
}

/* ---- bands ---- */

/* Of a ring in one direction; times what is below its lower edge, for the mask. Half a cycle per pixel goes both ways
 * at once: it is of no direction, and left out, so that filters are even. */
static void find_band_filter(struct vdp *v, int ring, int orientation, bool for_mask)
{
    const uint32_t w = v->fft.w, h = v->fft.h;
    for (uint32_t j = 0; j < h; j++)
        for (uint32_t i = 0; i < w; i++) {
            const size_t at = (size_t)j * w + i;
            float f = v->frequency[at], share = lum_cortex_ring(f, ring);
            if (for_mask)
                share *= lum_cortex_low_pass(f, ring + 1);
            if (share > 0.0f)
                share *=
                    2 * i == w || 2 * j == h ? 0.0f : lum_cortex_fan(DEGREES_PER_RADIAN * v->angle[at], orientation);
            v->filter[at] = share;
        }
}

/* (difference / threshold)^3.5, threshold (1 + (6 m)^4)^(1/4). m, what hides a difference, is the lesser of that of the
 * two pictures: what is in one alone is itself the difference. */
static void add_band(struct vdp *v, bool masked)
{
    for (size_t i = 0; i < v->n; i++) {
        float m = masked ? MASKING * fminf(fabsf(v->mask[2 * i]), fabsf(v->mask[2 * i + 1])) : 0.0f;
        float d = fabsf(v->band[2 * i] - v->band[2 * i + 1]) / sqrtf(sqrtf(1.0f + m * m * m * m));
        v->doubt[i] += d * d * d * sqrtf(d);
    }
}

static void add_all_bands(struct vdp *v)
{
    lum_fft_forward(&v->fft, v->band, v->terms);
    for (int ring = 0; ring < LUM_CORTEX_BANDS; ring++)
        for (int orientation = 0; orientation < LUM_CORTEX_ORIENTATIONS; orientation++) {
            find_band_filter(v, ring, orientation, true);
            filter(v, v->filter, v->mask);
            find_band_filter(v, ring, orientation, false);
            filter(v, v->filter, v->band);
            add_band(v, true);
        }
    for (size_t i = 0; i < v->n; i++)
        v->filter[i] = lum_cortex_base(v->frequency[i]);
    filter(v, v->filter, v->band);
    add_band(v, false);
}

static struct lum_hdrvdp_result summarise(const struct vdp *v, float *ret_map)
{
    const uint32_t w = v->in->w, h = v->in->h;
    struct lum_hdrvdp_result sum = {0};
    for (uint32_t j = 0; j < h; j++)
        for (uint32_t i = 0; i < w; i++) {
            size_t at = (size_t)(j + MARGIN) * v->fft.w + i + MARGIN;
            float p = v->same[at] ? 0.0f : 1.0f - expf(-v->doubt[at]);
            sum.p75 += p >= 0.75f;
            sum.p95 += p >= 0.95f;
            sum.mean += (double)p;
            if (ret_map)
                ret_map[(size_t)j * w + i] = p;
        }
    const double n = (double)w * h;
    return (struct lum_hdrvdp_result){sum.p75 / n, sum.p95 / n, sum.mean / n};
}

enum lum_status lum_hdrvdp_compare(const struct lum_hdrvdp_input *in, float *ret_map,
                                   struct lum_hdrvdp_result *ret_result, struct lum_error *err)
{
    struct vdp v = {0};
    enum lum_status st = begin(&v, in, err);
    if (!st) {
        go_through_optics(&v);
        weigh_by_sensitivity(&v);
        add_all_bands(&v);
        *ret_result = summarise(&v, ret_map);
    }
    end(&v);
    return st;
}
