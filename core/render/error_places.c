#include "core/render/error_places.h"

#include "core/math/sampler.h"

/* Pixels that a draw looks at, about: 64 for each that it draws. What is bright, or beside a lamp, may be a row of few
 * pixels, of which most are to be found: of eight looks for each probe, all over the picture, most missed it
 * (CornellBox-Glossy, 120 x 80, by `tic`: 15 pixels along the lamp are four fifths of the squared error, and 60 % of
 * the pictures were covered). */
#define LOOKS 4096u
#define LEAST_LOOKS 512u
#define RUN 8u /* pixels side by side that are looked at together, as neighbours are known then */

void lum_error_looks_finish(struct lum_error_looks *l)
{
    lum_free(l->light);
    lum_free(l->detail);
    lum_free(l->chance);
    *l = (struct lum_error_looks){0};
}

static bool reserve(struct lum_error_looks *l, uint32_t n)
{
    if (n <= l->max)
        return true;
    lum_error_looks_finish(l);
    l->light = lum_calloc(n, sizeof *l->light);
    l->detail = lum_calloc(n, sizeof *l->detail);
    l->chance = lum_calloc(n, sizeof *l->chance);
    l->max = n;
    if (l->light && l->detail && l->chance)
        return true;
    lum_error_looks_finish(l);
    return false;
}

/* Every step-th row of each column of runs, from one on that is drawn for that column. */
struct raster {
    uint32_t w, h, step, n_columns, seed;
    uint32_t shift; /* of this draw: 0 to step - 1 */
};

static struct raster make_raster(const struct lum_film *f, uint32_t seed, uint32_t draw)
{
    uint64_t n = (uint64_t)f->w * f->h;
    uint32_t step = n > LOOKS ? (uint32_t)(n / LOOKS) + (n % LOOKS > 0) : 1;
    step = step < f->h ? step : f->h;
    /* Golden ratio: few draws together have looked everywhere. */
    uint32_t turn = lum_hash_u32(seed) + draw * 0x9e3779b9u;
    return (struct raster){f->w, f->h, step, (f->w + RUN - 1) / RUN, seed, (uint32_t)(((uint64_t)turn * step) >> 32)};
}

static uint32_t first_row(const struct raster *r, uint32_t column)
{
    uint32_t own = (uint32_t)(((uint64_t)lum_hash_combine(r->seed, column) * r->step) >> 32);
    return (own + r->shift) % r->step;
}

static float luminance_at(const struct lum_film *f, uint32_t x, uint32_t y)
{
    return lum_luminance(lum_film_mean(f, x < f->w ? x : f->w - 1, y < f->h ? y : f->h - 1));
}

/* Of up to RUN pixels from (x, y) on: luminance, and the difference of the brightest and the darkest of each and its
 * four neighbours. */
static void look_at(const struct lum_film *f, uint32_t x, uint32_t y, uint32_t n, float *ret_light, float *ret_detail)
{
    float row[RUN + 2], above[RUN], below[RUN];
    for (uint32_t i = 0; i < n + 2; i++)
        row[i] = luminance_at(f, x + i > 0 ? x + i - 1 : 0, y);
    for (uint32_t i = 0; i < n; i++) {
        above[i] = luminance_at(f, x + i, y > 0 ? y - 1 : 0);
        below[i] = luminance_at(f, x + i, y + 1);
    }
    for (uint32_t i = 0; i < n; i++) {
        float least = lum_min(lum_min(row[i], row[i + 1]), lum_min(row[i + 2], lum_min(above[i], below[i])));
        float most = lum_max(lum_max(row[i], row[i + 1]), lum_max(row[i + 2], lum_max(above[i], below[i])));
        ret_light[i] = row[i + 1];
        ret_detail[i] = most - least;
    }
}

/* In a column that begins early there is a row more. */
static uint32_t most_looks(const struct raster *r)
{
    uint32_t most = r->w * ((r->h + r->step - 1) / r->step);
    return most + LEAST_LOOKS;
}

static uint32_t look(struct lum_error_looks *l, const struct lum_film *f, const struct raster *r)
{
    uint32_t n = 0;
    for (uint32_t c = 0; c < r->n_columns; c++) {
        uint32_t x = c * RUN, width = r->w - x < RUN ? r->w - x : RUN;
        for (uint32_t y = first_row(r, c); y < r->h; y += r->step, n += width)
            look_at(f, x, y, width, l->light + n, l->detail + n);
    }
    return n;
}

/* Of a picture of few pixels each counts several times, as often as the others. */
static uint32_t fill_up(struct lum_error_looks *l, uint32_t n_looks)
{
    uint32_t n = n_looks, wanted = (LEAST_LOOKS + n_looks - 1) / n_looks * n_looks;
    for (; n < wanted; n++) {
        l->light[n] = l->light[n - n_looks];
        l->detail[n] = l->detail[n - n_looks];
    }
    return n;
}

/* Scales masses so that chances of at most 1 add up to LUM_ERROR_PLACES. Each round makes some 1, and gives the others
 * what these had too much; few are needed, as few pixels have nearly all the mass. */
static void find_chances(float *chance, uint32_t n)
{
    for (int round = 0; round < 16; round++) {
        double mass = 0.0;
        uint32_t n_sure = 0;
        for (uint32_t i = 0; i < n; i++) {
            n_sure += chance[i] >= 1.0f;
            mass += chance[i] >= 1.0f ? 0.0 : (double)chance[i];
        }
        double scale = mass > 0.0 ? (double)(LUM_ERROR_PLACES - n_sure) / mass : 1.0;
        if (fabs(scale - 1.0) < 1e-6)
            return;
        for (uint32_t i = 0; i < n; i++)
            if (chance[i] < 1.0f)
                chance[i] = lum_min((float)((double)chance[i] * scale), 1.0f);
    }
}

/* By how much a picture is off somewhere goes with its light there, and with its contrast, but not always as their
 * squares: a mixture of what is right for many is wrong for none. Simulated with pictures of five methods in twelve
 * scenes, 96 x 64, and 64 paths of each pixel, 256 probes of two: the bound covers 92 % on average, and where only
 * squares count, a third each, 91 %; with eight looks for each probe 88 %. */
#define FOR_PIXELS 0.3
#define FOR_LIGHT2 0.2
#define FOR_DETAIL2 0.2
#define FOR_DETAIL 0.29 /* together less than 1, whatever is rounded */

static void weigh(struct lum_error_looks *l, uint32_t n)
{
    double light2 = 0.0, detail2 = 0.0, detail = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        light2 += (double)(l->light[i] * l->light[i]);
        detail2 += (double)(l->detail[i] * l->detail[i]);
        detail += (double)l->detail[i];
    }
    float per_pixel = (float)(FOR_PIXELS / n);
    float per_light2 = light2 > 0.0 ? (float)(FOR_LIGHT2 / light2) : 0.0f;
    float per_detail2 = detail2 > 0.0 ? (float)(FOR_DETAIL2 / detail2) : 0.0f;
    float per_detail = detail > 0.0 ? (float)(FOR_DETAIL / detail) : 0.0f;
    for (uint32_t i = 0; i < n; i++)
        l->chance[i] = per_pixel + per_light2 * l->light[i] * l->light[i] +
                       (per_detail2 * l->detail[i] + per_detail) * l->detail[i];
    find_chances(l->chance, n);
}

/* Pixel number i of those that were looked at. */
static void find_pixel(const struct raster *r, uint32_t i, struct lum_error_place *ret_place)
{
    for (uint32_t c = 0; c < r->n_columns; c++) {
        uint32_t x = c * RUN, width = r->w - x < RUN ? r->w - x : RUN, y = first_row(r, c);
        uint32_t n = width * ((r->h - y + r->step - 1) / r->step);
        if (i < n) {
            ret_place->x = x + i % width;
            ret_place->y = y + i / width * r->step;
            return;
        }
        i -= n;
    }
}

static void shuffle(struct lum_error_place *places, uint32_t seed)
{
    for (uint32_t i = LUM_ERROR_PLACES; i-- > 1;) {
        uint32_t k = (uint32_t)(((uint64_t)lum_hash_combine(seed, i) * (i + 1)) >> 32);
        struct lum_error_place other = places[k];
        places[k] = places[i];
        places[i] = other;
    }
}

/* Where the running sum of chances passes the next of LUM_ERROR_PLACES equal parts of it, from a random one on. */
static void pick(const float *chance, uint32_t n, float start, uint32_t *ret_picked)
{
    double total = 0.0, sum = 0.0;
    for (uint32_t i = 0; i < n; i++)
        total += (double)chance[i];
    for (uint32_t i = 0, n_picked = 0; i < n && n_picked < LUM_ERROR_PLACES; i++) {
        sum += (double)chance[i];
        if (sum > ((double)n_picked + (double)start) * total / LUM_ERROR_PLACES)
            ret_picked[n_picked++] = i;
    }
}

enum lum_status lum_error_places_draw(struct lum_error_looks *l, const struct lum_film *film, uint32_t seed,
                                      uint32_t draw, struct lum_error_place ret_places[LUM_ERROR_PLACES])
{
    struct raster r = make_raster(film, seed, draw);
    if (!reserve(l, most_looks(&r)))
        return LUM_ERR_NOMEM;
    uint32_t n_looks = look(l, film, &r), n = fill_up(l, n_looks), picked[LUM_ERROR_PLACES] = {0};
    weigh(l, n);
    struct lum_sampler s = lum_sampler_at(draw, 0, 1, seed);
    pick(l->chance, n, lum_sampler_1d(&s, 0), picked);
    /* Of all pixels a step-th part was looked at, each n / n_looks times. */
    double alike = (double)LUM_ERROR_PLACES * r.step * n_looks / ((double)n * r.w * r.h);
    for (uint32_t i = 0; i < LUM_ERROR_PLACES; i++) {
        ret_places[i].weight = (float)(alike / (double)l->chance[picked[i]]);
        ret_places[i].near = i / LUM_ERROR_NEAR; /* in the order of columns */
        find_pixel(&r, picked[i] % n_looks, &ret_places[i]);
    }
    shuffle(ret_places, lum_hash_combine(seed, draw));
    return LUM_OK;
}
