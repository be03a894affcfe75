#include "core/light/web.h"

#include <string.h>

#include "core/math/cdf.h"

/* ---- making one ---- */

static enum lum_status check_angles(const char *field, const float *deg, uint32_t n, double lo, double hi,
                                    struct lum_error *err)
{
    for (uint32_t i = 0; i < n; i++) {
        if (!((double)deg[i] >= lo && (double)deg[i] <= hi))
            return lum_fail(err, LUM_ERR_INVALID, field, "%s must be from %g to %g degrees, not %g", field, lo, hi,
                            (double)deg[i]);
        if (i > 0 && !(deg[i] > deg[i - 1]))
            return lum_fail(err, LUM_ERR_INVALID, field, "%s must ascend: %g does not follow %g", field, (double)deg[i],
                            (double)deg[i - 1]);
    }
    return LUM_OK;
}

static enum lum_status check_desc(const struct lum_web_desc *d, float *ret_peak, struct lum_error *err)
{
    if (d->n_c < 1 || d->n_gamma < 2 || (uint64_t)d->n_c * d->n_gamma > LUM_WEB_VALUES_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "candela", "a web has at least 1 x 2 values and at most %u, not %u x %u",
                        LUM_WEB_VALUES_MAX, d->n_c, d->n_gamma);
    if ((unsigned)d->type > LUM_WEB_A)
        return lum_fail(err, LUM_ERR_INVALID, "type", "is not a type of photometry");
    enum lum_status status = check_angles("c_deg", d->c_deg, d->n_c, -360.0, 720.0, err);
    if (status == LUM_OK && d->c_deg[d->n_c - 1] - d->c_deg[0] > 360.0f)
        status = lum_fail(err, LUM_ERR_INVALID, "c_deg", "c_deg must span at most 360 degrees");
    if (status == LUM_OK)
        status = check_angles("gamma_deg", d->gamma_deg, d->n_gamma, 0.0, 180.0, err);
    for (uint32_t i = 0; status == LUM_OK && i < d->n_c * d->n_gamma; i++) {
        if (!(d->candela[i] >= 0.0f && d->candela[i] <= 1e12f))
            return lum_fail(err, LUM_ERR_INVALID, "candela", "candela must be from 0 to 1e12, not %g",
                            (double)d->candela[i]);
        *ret_peak = lum_max(*ret_peak, d->candela[i]);
    }
    return status;
}

static uint64_t hash_bytes(uint64_t h, const void *bytes, size_t n)
{
    const uint8_t *p = bytes;
    for (; n >= 8; n -= 8, p += 8) { /* a multiply-xorshift for each word, as in MurmurHash */
        uint64_t w;
        memcpy(&w, p, 8);
        h = (h ^ w) * 0x9e3779b97f4a7c15u;
        h ^= h >> 32;
    }
    uint64_t w = n;
    memcpy(&w, p, n);
    h = (h ^ w ^ (uint64_t)n << 56) * 0x9e3779b97f4a7c15u;
    return h ^ h >> 29;
}

uint64_t lum_web_desc_hash(const struct lum_web_desc *d)
{
    const uint64_t head[2] = {(uint64_t)d->type, (uint64_t)d->n_c << 32 | d->n_gamma};
    uint64_t h = hash_bytes(1, head, sizeof head);
    h = hash_bytes(h, d->c_deg, d->n_c * sizeof *d->c_deg);
    h = hash_bytes(h, d->gamma_deg, d->n_gamma * sizeof *d->gamma_deg);
    return hash_bytes(h, d->candela, (size_t)d->n_c * d->n_gamma * sizeof *d->candela);
}

static struct lum_web *web_alloc(uint32_t n_c, uint32_t n_gamma)
{
    struct lum_web *w = lum_calloc(1, sizeof *w);
    if (!w)
        return NULL;
    lum_refs_init(&w->refs);
    w->n_c = n_c;
    w->n_gamma = n_gamma;
    w->c = lum_calloc(n_c, sizeof *w->c);
    w->gamma = lum_calloc(n_gamma, sizeof *w->gamma);
    w->share = lum_calloc((size_t)n_c * n_gamma, sizeof *w->share);
    w->bands = lum_calloc(n_gamma - 1, sizeof *w->bands);
    w->cells = lum_calloc((size_t)(n_c - 1) * (n_gamma - 1), sizeof *w->cells);
    if (w->c && w->gamma && w->share && w->bands && w->cells)
        return w;
    lum_web_unref(w);
    return NULL;
}

struct lum_web *lum_web_ref(const struct lum_web *web)
{
    struct lum_web *w = (struct lum_web *)(uintptr_t)web;
    lum_refs_get(&w->refs);
    return w;
}

void lum_web_unref(const struct lum_web *web)
{
    struct lum_web *w = (struct lum_web *)(uintptr_t)web;
    if (!w || !lum_refs_put(&w->refs))
        return;
    lum_free(w->c);
    lum_free(w->gamma);
    lum_free(w->share);
    lum_free(w->bands);
    lum_free(w->cells);
    lum_free(w);
}

/* A web of one plane becomes one of two that are the same. */
static void copy_values(struct lum_web *w, const struct lum_web_desc *d, float peak)
{
    bool around = d->n_c == 1;
    for (uint32_t i = 0; i < w->n_c; i++)
        w->c[i] = (float)((around ? 360.0 * i : (double)d->c_deg[i]) * LUM_RAD_PER_DEG);
    for (uint32_t k = 0; k < w->n_gamma; k++)
        w->gamma[k] = (float)((double)d->gamma_deg[k] * LUM_RAD_PER_DEG);
    w->closed = around || d->c_deg[d->n_c - 1] - d->c_deg[0] >= 360.0f;
    for (uint32_t i = 0; i < w->n_c; i++)
        for (uint32_t k = 0; k < w->n_gamma; k++)
            w->share[i * w->n_gamma + k] = d->candela[(around ? 0 : i) * w->n_gamma + k] / peak;
}

/* ---- the integral ---- */

/* Integral of (a + (b - a) t) sin(gamma) from gamma0 to gamma0 + t h, t in 0..1, where a and b are at its ends:
 * with p + q gamma in place of the first, -p cos + q (sin - gamma cos). Around gamma0, where it cancels least:
 * a (cos(gamma0) - cos(gamma)) + q (sin(gamma) - sin(gamma0) - (gamma - gamma0) cos(gamma)). */
static double integral_upto(double gamma0, double h, double a, double b, double t)
{
    double to = gamma0 + t * h, half = 0.5 * t * h;
    double cos_step = 2.0 * sin(gamma0 + half) * sin(half), sin_step = 2.0 * cos(gamma0 + half) * sin(half);
    return a * cos_step + (b - a) / h * (sin_step - t * h * cos(to));
}

struct cell {
    float i00, i01, i10, i11; /* shares at c0 gamma0, c0 gamma1, c1 gamma0, c1 gamma1 */
    double c0, width, gamma0, height;
};

static struct cell cell_at(const struct lum_web *w, uint32_t i, uint32_t k)
{
    const float *a = w->share + i * w->n_gamma + k, *b = a + w->n_gamma;
    return (struct cell){a[0],
                         a[1],
                         b[0],
                         b[1],
                         (double)w->c[i],
                         (double)w->c[i + 1] - (double)w->c[i],
                         (double)w->gamma[k],
                         (double)w->gamma[k + 1] - (double)w->gamma[k]};
}

/* Over c its mean is that of the two sides. */
static double cell_flux(const struct cell *e)
{
    double a = 0.5 * ((double)e->i00 + (double)e->i10), b = 0.5 * ((double)e->i01 + (double)e->i11);
    return fmax(e->width * integral_upto(e->gamma0, e->height, a, b, 1.0), 0.0);
}

static double band_flux(const struct lum_web *w, uint32_t k)
{
    double sum = 0.0;
    for (uint32_t i = 0; i + 1 < w->n_c; i++) {
        struct cell e = cell_at(w, i, k);
        sum += cell_flux(&e);
    }
    return sum;
}

static void integrate(struct lum_web *w)
{
    double upto = 0.0;
    for (uint32_t k = 0; k + 1 < w->n_gamma; k++)
        w->flux_sr += band_flux(w, k);
    for (uint32_t k = 0; k + 1 < w->n_gamma; k++) {
        float *cells = w->cells + (size_t)k * (w->n_c - 1);
        double band = band_flux(w, k), sum = 0.0;
        for (uint32_t i = 0; i + 1 < w->n_c; i++) {
            struct cell e = cell_at(w, i, k);
            sum += cell_flux(&e);
            cells[i] = band > 0.0 ? (float)(sum / band) : 0.0f;
        }
        upto += band;
        w->bands[k] = w->flux_sr > 0.0 ? (float)(upto / w->flux_sr) : 0.0f;
    }
}

/* Angles that differ in degrees may be one in radians, where floats are further apart. */
static bool ascends(const float *at, uint32_t n)
{
    for (uint32_t i = 0; i + 1 < n; i++)
        if (!(at[i] < at[i + 1]))
            return false;
    return true;
}

enum lum_status lum_web_create(const struct lum_web_desc *d, struct lum_web **ret_web, struct lum_error *err)
{
    float peak = 0.0f;
    enum lum_status status = check_desc(d, &peak, err);
    if (status != LUM_OK)
        return status;
    if (!(peak > 0.0f))
        return lum_fail(err, LUM_ERR_INVALID, "candela", "the web has no light: all intensities are 0");
    struct lum_web *w = web_alloc(d->n_c == 1 ? 2 : d->n_c, d->n_gamma);
    if (!w)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a web of %u x %u", d->n_c, d->n_gamma);
    w->type = d->type;
    w->peak_cd = (double)peak;
    w->hash = lum_web_desc_hash(d);
    copy_values(w, d, peak);
    if (!ascends(w->c, w->n_c) || !ascends(w->gamma, w->n_gamma)) {
        lum_web_unref(w);
        return lum_fail(err, LUM_ERR_INVALID, "c_deg", "angles of the web are nearer to each other than radians tell");
    }
    integrate(w);
    if (!(w->flux_sr > 0.0)) { /* all light is at the poles */
        lum_web_unref(w);
        return lum_fail(err, LUM_ERR_INVALID, "candela", "the web has no light: it spans no solid angle");
    }
    *ret_web = w;
    return LUM_OK;
}

/* ---- asking it ---- */

/* Index i with at[i] <= x <= at[i + 1], and how far x is between them. False: beyond the ends. */
static bool find_between(const float *at, uint32_t n, float x, uint32_t *ret_i, float *ret_t)
{
    if (!(x >= at[0] && x <= at[n - 1]))
        return false;
    uint32_t lo = 0, hi = n - 1;
    while (hi - lo > 1) {
        uint32_t middle = lo + (hi - lo) / 2;
        if (x >= at[middle])
            lo = middle;
        else
            hi = middle;
    }
    *ret_i = lo;
    *ret_t = (x - at[lo]) / (at[lo + 1] - at[lo]);
    return true;
}

float lum_web_share(const struct lum_web *w, float c, float gamma)
{
    uint32_t i, k;
    float s, t;
    if (!find_between(w->gamma, w->n_gamma, gamma, &k, &t))
        return 0.0f;
    while (c < w->c[0])
        c += 2.0f * LUM_PI;
    while (c > w->c[w->n_c - 1] && c - 2.0f * LUM_PI >= w->c[0])
        c -= 2.0f * LUM_PI;
    if (w->closed) /* rounding may leave it a little beyond the last */
        c = lum_min(c, w->c[w->n_c - 1]);
    if (!find_between(w->c, w->n_c, c, &i, &s))
        return 0.0f;
    const float *a = w->share + i * w->n_gamma + k, *b = a + w->n_gamma;
    return lum_mix(lum_mix(a[0], a[1], t), lum_mix(b[0], b[1], t), s);
}

float lum_web_share_along(const struct lum_web *w, struct lum_vec3 d)
{
    return lum_web_share(w, atan2f(d.y, d.x), atan2f(sqrtf(d.x * d.x + d.y * d.y), d.z));
}

/* ---- drawing from it ---- */

/* The t where integral_upto is the share u of all: Newton's steps, halving where they leave the bracket. */
static double invert_band(const struct cell *e, double a, double b, double u)
{
    double goal = u * integral_upto(e->gamma0, e->height, a, b, 1.0), lo = 0.0, hi = 1.0, t = u;
    for (int i = 0; i < 60 && hi - lo > 1e-9; i++) {
        double miss = integral_upto(e->gamma0, e->height, a, b, t) - goal;
        double slope = (a + (b - a) * t) * sin(e->gamma0 + t * e->height) * e->height;
        if (miss > 0.0)
            hi = t;
        else
            lo = t;
        double next = slope > 0.0 ? t - miss / slope : -1.0;
        if (fabs(next - t) < 1e-10)
            break;
        t = next > lo && next < hi ? next : 0.5 * (lo + hi);
    }
    return t;
}

/* In 0..1, of a density that is linear from a to b. */
static double invert_linear(double a, double b, double u)
{
    double root = a + sqrt(a * a + (b * b - a * a) * u);
    return root > 0.0 ? fmin(u * (a + b) / root, 1.0) : u;
}

/* What is left of u in the entry of a table that it chose. */
static double rest_of(const float *cdf, uint32_t i, float below, float u)
{
    double width = (double)cdf[i] - (double)below;
    return width > 0.0 ? fmin(fmax(((double)u - (double)below) / width, 0.0), 1.0) : 0.5;
}

struct lum_vec3 lum_web_draw(const struct lum_web *w, struct lum_vec2 u)
{
    float below_k, below_i;
    uint32_t k = lum_cdf_find(w->bands, w->n_gamma - 1, u.x, &below_k);
    const float *cells = w->cells + (size_t)k * (w->n_c - 1);
    uint32_t i = lum_cdf_find(cells, w->n_c - 1, u.y, &below_i);
    struct cell e = cell_at(w, i, k);
    double a = 0.5 * ((double)e.i00 + (double)e.i10), b = 0.5 * ((double)e.i01 + (double)e.i11);
    double t = invert_band(&e, a, b, rest_of(w->bands, k, below_k, u.x));
    double left = (double)e.i00 + ((double)e.i01 - (double)e.i00) * t;
    double right = (double)e.i10 + ((double)e.i11 - (double)e.i10) * t;
    double s = invert_linear(left, right, rest_of(cells, i, below_i, u.y));
    double gamma = e.gamma0 + t * e.height, c = e.c0 + s * e.width, sine = sin(gamma);
    return lum_normalize(lum_v3((float)(sine * cos(c)), (float)(sine * sin(c)), (float)cos(gamma)));
}

/* ---- its frame ---- */

struct lum_frame lum_web_frame(enum lum_web_type type, struct lum_vec3 d, struct lum_vec3 c0)
{
    struct lum_vec3 c90 = lum_cross(c0, d);
    struct lum_frame f = {.t = c0, .b = c90, .n = d};
    if (type == LUM_WEB_B)
        f = (struct lum_frame){.t = d, .b = c0, .n = lum_v3_neg(c90)};
    if (type == LUM_WEB_A)
        f = (struct lum_frame){.t = d, .b = lum_v3_neg(c90), .n = c0};
    return f;
}
