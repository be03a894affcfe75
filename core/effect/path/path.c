/* Everything, path traced: one sample of every pixel of a tile, or of every block of pixels. */
#include <string.h>

#include "core/effect/path/path.h"
#include "core/math/sampler.h"
#include "core/pass/pass.h"
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

/* What path `slot` brought home goes to all pixels of its block. rest: from the block's corner to the tile's. */
static void add_to_block(const struct lum_pass *pass, const struct lum_tile_rect *rest, uint32_t sample,
                         const struct lum_wave *w, uint32_t slot)
{
    uint64_t refused = 0; /* once for each pixel, but it is one path */
    for (uint32_t y = 0; y < pass->block && y < rest->h; y++)
        for (uint32_t x = 0; x < pass->block && x < rest->w; x++) {
            if (sample == 0)
                lum_film_reset_pixel(pass->film, rest->x + x, rest->y + y);
            if (w->keeps_first)
                lum_film_add_apart(pass->film, rest->x + x, rest->y + y, sample, w->radiance[slot], &w->first[slot],
                                   &refused);
            else
                lum_film_add(pass->film, rest->x + x, rest->y + y, sample, w->radiance[slot], &refused);
        }
    w->counters->nonfinite += refused > 0;
}

static void note_parts(const struct lum_pass *pass, const struct lum_tile_rect *r, uint32_t sample,
                       float (*parts)[LUM_EFFECT_COUNT])
{
    for (uint32_t i = 0; i < r->w * r->h; i++)
        lum_effect_noise_add(pass->effect_noise, r->x + i % r->w, r->y + i / r->w, sample, parts[i]);
}

static void learn(const struct lum_pass *pass, const struct lum_tile_rect *r, const struct lum_path_guide_notes *notes,
                  const struct lum_rgb *radiance)
{
    float means[LUM_TILE_PIXELS];
    for (uint32_t i = 0; i < r->w * r->h; i++)
        means[i] = lum_luminance(lum_film_mean(pass->film, r->x + i % r->w, r->y + i / r->w));
    lum_path_guide_learn(pass->guide, r->w * r->h, notes, means, radiance);
}

static void path_tile(const struct lum_pass *pass, uint32_t tile, struct lum_counters *counters)
{
    struct lum_tile_rect r = lum_tile_at(&pass->tiling, tile);
    uint32_t sample = pass->tile_spp[tile], slot = 0;
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
    float parts[LUM_TILE_PIXELS][LUM_EFFECT_COUNT];
    if (pass->effect_noise && pass->block == 1) {
        memset(parts, 0, sizeof parts);
        w.parts = parts;
    }
    add_eye_paths(&w, pass, &r, sample);
    lum_wave_run(&w, 0);
    if (w.parts)
        note_parts(pass, &r, sample, parts);
    if (w.notes)
        learn(pass, &r, &notes, w.radiance);
    for (uint32_t y = r.y; y < r.y + r.h; y += pass->block)
        for (uint32_t x = r.x; x < r.x + r.w; x += pass->block)
            add_to_block(pass, &(struct lum_tile_rect){x, y, r.x + r.w - x, r.y + r.h - y}, sample, &w, slot++);
    if (pass->block == 1)
        pass->tile_spp[tile] = sample + 1;
}

const struct lum_estimator lum_estimator_path = {.name = "path", .stage = LUM_STAGE_PATH, .tile = path_tile};
