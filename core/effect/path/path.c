/* Everything, path traced: one sample of every pixel of a tile, or of every block of pixels. */
#include <string.h>

#include "core/effect/path/path.h"
#include "core/math/sampler.h"
#include "core/pass/share.h"
#include "core/path/effect_noise.h"
#include "core/path/guide.h"
#include "core/path/wave.h"

static void add_eye_paths(struct lum_wave *w, const struct lum_pass *pass, const struct lum_tile_rect *r,
                          uint32_t sample)
{
    for (uint32_t y = r->y; y < r->y + r->h; y += pass->block)
        for (uint32_t x = r->x; x < r->x + r->w; x += pass->block) {
            struct lum_sampler sampler = lum_sampler_halves(x, y, sample, pass->settings->seed);
            struct lum_vec2 at = {0.5f, 0.5f};
            if (lum_pass_antialiased(pass))
                at = lum_sampler_2d(&sampler, LUM_WAVE_PAIR_PIXEL);
            float side = (float)pass->block;
            struct lum_vec3 d = lum_eye_direction(&pass->eye, (float)x + side * at.x, (float)y + side * at.y);
            lum_wave_add_eye(w, w->rays.n, sampler, pass->eye.o, d);
        }
}

/* Pixels of a tile that lum_effect_noise looks at: a square of them. */
#define LOOKED_SIDE (LUM_TILE_SIDE / LUM_EFFECT_NOISE_STEP)
#define LOOKED (LOOKED_SIDE * LOOKED_SIDE)
_Static_assert(LUM_TILE_SIDE % LUM_EFFECT_NOISE_STEP == 0, "each tile has the same of them");

/* What the paths of a tile brought home, by slot. */
struct found {
    const struct lum_rgb *radiance;
    const struct lum_film_first *first;     /* NULL: it is not kept apart */
    const float (*parts)[LUM_EFFECT_COUNT]; /* by pixel that is looked at; NULL: nobody asks */
};

/* What path `slot` brought home goes to all pixels of its block. rest: from the block's corner to the tile's. Returns
 * whether it was refused. */
static bool add_to_block(const struct lum_pass *pass, const struct lum_tile_rect *rest, uint32_t sample,
                         const struct found *f, uint32_t slot)
{
    uint64_t refused = 0; /* once for each pixel, but it is one path */
    for (uint32_t y = 0; y < pass->block && y < rest->h; y++)
        for (uint32_t x = 0; x < pass->block && x < rest->w; x++) {
            if (sample == 0)
                lum_film_reset_pixel(pass->film, rest->x + x, rest->y + y);
            if (f->first)
                lum_film_add_apart(pass->film, rest->x + x, rest->y + y, sample, f->radiance[slot], &f->first[slot],
                                   &refused);
            else
                lum_film_add(pass->film, rest->x + x, rest->y + y, sample, f->radiance[slot], &refused);
        }
    return refused > 0;
}

static uint32_t looked(uint32_t x, uint32_t y)
{
    return y / LUM_EFFECT_NOISE_STEP * LOOKED_SIDE + x / LUM_EFFECT_NOISE_STEP;
}

/* Returns how many were refused. */
static uint64_t add_to_film(const struct lum_pass *pass, uint32_t tile, const struct found *f)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    uint32_t sample = pass->tile_spp[tile], slot = 0;
    uint64_t refused = 0;
    for (uint32_t y = 0; f->parts && y < r.h; y += LUM_EFFECT_NOISE_STEP)
        for (uint32_t x = 0; x < r.w; x += LUM_EFFECT_NOISE_STEP)
            lum_effect_noise_add(pass->effect_noise, r.x + x, r.y + y, sample, f->parts[looked(x, y)]);
    for (uint32_t y = r.y; y < r.y + r.h; y += pass->block)
        for (uint32_t x = r.x; x < r.x + r.w; x += pass->block) {
            struct lum_tile_rect rest = {x, y, r.x + r.w - x, r.y + r.h - y};
            refused += add_to_block(pass, &rest, sample, f, slot++);
        }
    if (pass->block == 1)
        pass->tile_spp[tile] = sample + 1;
    return refused;
}

static void learn(const struct lum_pass *pass, const struct lum_tile_rect *r, const struct lum_path_guide_notes *notes,
                  const struct lum_rgb *radiance)
{
    float means[LUM_TILE_PIXELS];
    for (uint32_t i = 0; i < r->w * r->h; i++)
        means[i] = lum_luminance(lum_film_mean(pass->film, r->x + i % r->w, r->y + i / r->w));
    lum_path_guide_learn(pass->guide, r->w * r->h, notes, means, radiance);
}

static bool wants_parts(const struct lum_pass *pass)
{
    return pass->effect_noise && pass->block == 1;
}

/* ---- what others need of a tile: the same as its film, in a row ---- */

#define RADIANCE_BYTES (LUM_TILE_PIXELS * sizeof(struct lum_rgb))
#define FIRST_BYTES (LUM_TILE_PIXELS * sizeof(struct lum_film_first))
#define PARTS_BYTES (LOOKED * LUM_EFFECT_COUNT * sizeof(float))

static size_t first_bytes(const struct lum_pass *pass)
{
    return pass->film->first[0] ? FIRST_BYTES : 0;
}

static size_t bytes_left(const struct lum_pass *pass)
{
    return RADIANCE_BYTES + first_bytes(pass) + (wants_parts(pass) ? PARTS_BYTES : 0);
}

static void leave(const struct found *f, void *left)
{
    unsigned char *at = left;
    memcpy(at, f->radiance, RADIANCE_BYTES);
    at += RADIANCE_BYTES;
    if (f->first) {
        memcpy(at, f->first, FIRST_BYTES);
        at += FIRST_BYTES;
    }
    if (f->parts)
        memcpy(at, f->parts, PARTS_BYTES);
}

static void take_over(const struct lum_pass *pass, uint32_t tile, const void *left)
{
    const unsigned char *at = left, *first = at + RADIANCE_BYTES, *parts = first + first_bytes(pass);
    struct found f = {.radiance = (const void *)at};
    if (pass->film->first[0])
        f.first = (const void *)first;
    if (wants_parts(pass))
        f.parts = (const void *)parts;
    if (pass->tile_spp[tile] < pass->target_spp)
        (void)add_to_film(pass, tile, &f); /* who traced them has counted those that were refused */
}

/* ---- a tile ---- */

/* The paths of a tile, to their ends. left: NULL: nobody else needs it. */
static void trace_tile(const struct lum_pass *pass, uint32_t tile, void *left, struct lum_counters *counters)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    uint32_t sample = pass->tile_spp[tile];
    if (sample >= pass->target_spp)
        return;
    struct lum_wave w;
    lum_wave_begin(&w, pass->snapshot, counters, pass->settings->max_depth, lum_pass_effects_off(pass));
    w.illuminance = pass->settings->illuminance;
    w.keeps_first = pass->film->first[0] != NULL;
    w.portals = pass->portals;
    struct lum_path_guide_notes notes;
    if (pass->guide && lum_path_guide_serves(pass->guide, tile % pass->tiling.nx, tile / pass->tiling.nx))
        w.guide = pass->guide;
    if (w.guide && lum_path_guide_learns(w.guide, tile)) {
        memset(notes.n, 0, sizeof notes.n);
        memset(notes.emitted, 0, sizeof notes.emitted);
        w.notes = &notes;
    }
    float parts[LUM_TILE_PIXELS][LUM_EFFECT_COUNT], few[LOOKED][LUM_EFFECT_COUNT];
    if (wants_parts(pass)) {
        memset(parts, 0, sizeof parts);
        w.parts = parts;
    }
    add_eye_paths(&w, pass, &r, sample);
    lum_wave_run(&w, 0);
    for (uint32_t y = 0; w.parts && y < r.h; y += LUM_EFFECT_NOISE_STEP)
        for (uint32_t x = 0; x < r.w; x += LUM_EFFECT_NOISE_STEP)
            memcpy(few[looked(x, y)], parts[y * r.w + x], sizeof few[0]);
    const struct found f = {w.radiance, w.keeps_first ? w.first : NULL, w.parts ? few : NULL};
    if (w.notes)
        learn(pass, &r, &notes, w.radiance);
    if (left)
        leave(&f, left);
    counters->nonfinite += add_to_film(pass, tile, &f);
}

static void path_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    trace_tile(pass, tile, NULL, counters);
}

static const struct lum_tile_share share = {bytes_left, trace_tile, take_over};

const struct lum_estimator lum_estimator_path = {
    .name = "path", .stage = LUM_STAGE_PATH, .tile = path_tile, .share = &share};
