#include "core/film/false_color.h"

#include <math.h>

#include "core/film/film.h"

const char *const lum_scale_kind_names[] = {"log", "linear", NULL};
const char *const lum_palette_names[] = {"even", "spectrum", NULL};

/* ---- colours ---- */

/* Ottosson 2020: OKLab, in which distances are what eyes see as differences. */
static struct lum_rgb from_oklab(double lightness, double a, double b)
{
    double l = lightness + 0.3963377774 * a + 0.2158037573 * b, m = lightness - 0.1055613458 * a - 0.0638541728 * b,
           s = lightness - 0.0894841775 * a - 1.2914855480 * b;
    l = l * l * l;
    m = m * m * m;
    s = s * s * s;
    return lum_rgb((float)(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
                   (float)(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
                   (float)(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s));
}

/* From a dark violet by blue, teal and green to a light yellow, as colourful as screens can: lightness rises by the
 * same everywhere. The middle is paler, since teal is. */
static struct lum_rgb even_color(double at)
{
    double lightness = 0.25 + 0.69 * at, hue = (300.0 - 195.0 * at) * LUM_PI_D / 180.0, rest = 1.0 - at;
    double chroma = 0.16 * rest * rest + 2.0 * 0.06 * at * rest + 0.18 * at * at;
    return from_oklab(lightness, chroma * cos(hue), chroma * sin(hue));
}

static void spectrum_color(double at, uint8_t ret_rgb[3])
{
    static const uint8_t stops[][3] = {{27, 20, 64},   {42, 47, 143},  {36, 87, 197},  {26, 134, 201},
                                       {22, 168, 160}, {61, 187, 95},  {140, 198, 63}, {214, 199, 47},
                                       {245, 166, 35}, {242, 113, 28}, {226, 52, 45},  {255, 217, 236}};
    const uint32_t last = LUM_ARRAY_LEN(stops) - 1;
    double x = at * last;
    uint32_t i = x < last - 1 ? (uint32_t)x : last - 1;
    for (int c = 0; c < 3; c++)
        ret_rgb[c] = (uint8_t)lround(stops[i][c] + (x - i) * (stops[i + 1][c] - stops[i][c]));
}

void lum_palette_color(enum lum_palette palette, double at, uint8_t ret_rgb[3])
{
    at = fmin(fmax(at, 0.0), 1.0);
    if (palette == LUM_PALETTE_SPECTRUM)
        spectrum_color(at, ret_rgb);
    else
        lum_tone_pixel(even_color(at), 1.0, LUM_TONE_NONE, ret_rgb);
}

/* ---- round values ---- */

/* Steps within a decade. The first is the scale of illuminance of EN 12464-1: 100, 150, 200, 300, 500, 750 ... */
struct series {
    uint32_t n;
    double step[6];
};
static const struct series series[] = {{6, {1.0, 1.5, 2.0, 3.0, 5.0, 7.5}}, {3, {1.0, 2.0, 5.0}}, {1, {1.0}}};

#define MOST_LIMITS 14u   /* a legend is read at a glance */
#define MOST_DECADES 4.0  /* of a scale that follows the picture: below is the dark */
#define ROUNDING 1e-9     /* a value is one of a series, but for rounding */
#define LINEAR_STEPS 10.0 /* at most */

static double ten_to(double decade)
{
    return pow(10.0, decade);
}

/* The least of a series that is no less than x > 0, or the greatest that is no more. */
static double round_by(const struct series *s, double x, bool up)
{
    double decade = floor(log10(x)), found = 0.0;
    for (double d = decade - 1.0; d <= decade + 1.0; d++)
        for (uint32_t i = 0; i < s->n; i++) {
            double v = s->step[i] * ten_to(d);
            if (up ? v >= x * (1.0 - ROUNDING) && found == 0.0 : v <= x * (1.0 + ROUNDING))
                found = v;
        }
    return found;
}

/* Those of a series within the scale. Returns how many there are, of which as many are kept as there is room for. */
static uint32_t limits_of(const struct series *s, struct lum_scale *scale)
{
    uint32_t n = 0;
    for (double d = floor(log10(scale->min)) - 1.0; d <= log10(scale->max) + 1.0; d++)
        for (uint32_t i = 0; i < s->n; i++) {
            double v = s->step[i] * ten_to(d);
            if (v < scale->min * (1.0 - ROUNDING) || v > scale->max * (1.0 + ROUNDING))
                continue;
            if (n < LUM_SCALE_LIMITS)
                scale->limits[n] = v;
            n++;
        }
    return n;
}

/* A round step that goes into a range some five to ten times. */
static double linear_step(double range)
{
    static const struct series steps = {4, {1.0, 2.0, 2.5, 5.0}};
    return round_by(&steps, range / LINEAR_STEPS, true);
}

static void set_linear_limits(struct lum_scale *s)
{
    double step = linear_step(s->max - s->min), first = ceil(s->min / step * (1.0 - ROUNDING));
    for (double k = fmax(first, 1.0); k * step <= s->max * (1.0 + ROUNDING) && s->n_limits < LUM_SCALE_LIMITS; k++)
        s->limits[s->n_limits++] = k * step;
}

static void set_limits(struct lum_scale *s)
{
    if (s->kind == LUM_SCALE_LOG)
        for (size_t i = 0; i < LUM_ARRAY_LEN(series); i++) {
            uint32_t n = limits_of(&series[i], s);
            s->n_limits = n < LUM_SCALE_LIMITS ? n : LUM_SCALE_LIMITS;
            if (n <= MOST_LIMITS)
                break;
        }
    if (s->n_limits < 3) { /* of a short range */
        s->n_limits = 0;
        set_linear_limits(s);
    }
}

/* ---- the picture's range ---- */

/* Values above 0, counted by twelfths of an octave. */
enum { BINS = 1536, PER_OCTAVE = 12, LOWEST = -64 };
struct histogram {
    uint64_t n[BINS], all;
};

static void count_values(struct histogram *h, const float *values, size_t n_values)
{
    *h = (struct histogram){0};
    for (size_t i = 0; i < n_values; i++) {
        if (!(values[i] > 0.0f))
            continue;
        int bin = (int)((log2((double)values[i]) - LOWEST) * PER_OCTAVE);
        h->n[bin < 0 ? 0 : bin < BINS ? bin : BINS - 1]++;
        h->all++;
    }
}

/* The value that a share of them do not reach, to a bin. */
static double percentile(const struct histogram *h, double share)
{
    uint64_t below = 0;
    uint32_t i = 0;
    for (; i + 1 < BINS && (double)(below + h->n[i]) < share * (double)h->all; i++)
        below += h->n[i];
    return exp2((double)(i + 1) / PER_OCTAVE + LOWEST);
}

static double round_max(const struct lum_scale *s, double x)
{
    return s->kind == LUM_SCALE_LOG ? round_by(&series[0], x, true) : ceil(x / linear_step(x)) * linear_step(x);
}

static void set_range(struct lum_scale *s, const struct lum_false_color *want, const struct histogram *h)
{
    double low = h->all ? percentile(h, 0.02) : 1.0, high = h->all ? percentile(h, 0.99) : 1.0;
    s->max = isnan(want->max) ? round_max(s, fmax(high, isnan(want->min) ? 0.0 : 2.0 * want->min)) : want->max;
    s->min = want->min;
    if (isnan(s->min) && s->kind == LUM_SCALE_LINEAR)
        s->min = 0.0;
    else if (isnan(s->min)) /* at least a factor of 2 */
        s->min = round_by(&series[0], fmin(fmax(low, s->max * ten_to(-MOST_DECADES)), 0.5 * s->max), false);
}

/* ---- */

bool lum_scale_make(const struct lum_false_color *want, const float *values, size_t n_values,
                    struct lum_scale *ret_scale)
{
    struct lum_scale s = {.kind = want->scale, .smooth = want->smooth};
    struct histogram h;
    count_values(&h, values, n_values);
    if (h.all == 0 && (isnan(want->min) || isnan(want->max)))
        return false;
    set_range(&s, want, &h);
    set_limits(&s);
    s.n_colors = s.smooth ? LUM_SCALE_COLORS : s.n_limits + 1;
    for (uint32_t i = 0; i < s.n_colors; i++)
        lum_palette_color(want->palette, (double)i / fmax(s.n_colors - 1.0, 1.0), s.colors[i]);
    *ret_scale = s;
    return true;
}

uint32_t lum_scale_color(const struct lum_scale *s, double value)
{
    uint32_t i = 0;
    if (!s->smooth) {
        while (i < s->n_limits && value >= s->limits[i])
            i++;
        return i;
    }
    double at = s->kind == LUM_SCALE_LINEAR ? (value - s->min) / (s->max - s->min)
                : value > s->min            ? log(value / s->min) / log(s->max / s->min)
                                            : 0.0;
    return (uint32_t)(fmin(fmax(at, 0.0), 1.0) * (s->n_colors - 1) + 0.5);
}
