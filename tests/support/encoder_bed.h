/* An encoder and a small film for it to encode. Includes cmocka's headers. */
#ifndef LUM_TESTS_SUPPORT_ENCODER_BED_H
#define LUM_TESTS_SUPPORT_ENCODER_BED_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "server/stream/encode.h"

/* Neither a multiple of the tile's side nor of 4: four tiles, three of them cut. */
enum { W = 199, H = 130, TILES = 4 };

struct fixture {
    struct lum_pool *pool;
    struct lum_encoder *encoder;
    struct lum_film film;
    struct lum_picture picture;
    struct lum_tile_state states[TILES];
    struct lum_encoded_tile *tiles[TILES];
};

/* The film shows what `shade` says. */
static inline struct fixture *encoder_bed_begin(struct lum_rgb (*shade)(uint32_t x, uint32_t y))
{
    struct fixture *f = calloc(1, sizeof *f);
    assert_non_null(f);
    assert_int_equal(lum_pool_create(3, &f->pool, NULL), LUM_OK);
    assert_int_equal(lum_encoder_create(f->pool, &f->encoder, NULL), LUM_OK);
    assert_int_equal(lum_film_init(&f->film, W, H, NULL), LUM_OK);
    uint64_t nonfinite = 0;
    for (uint32_t y = 0; y < H; y++)
        for (uint32_t x = 0; x < W; x++)
            lum_film_add(&f->film, x, y, 0, shade(x, y), &nonfinite);
    f->picture = (struct lum_picture){.film = &f->film,
                                      .display = {.ev100 = -log2(1.2), .tone = LUM_TONE_NONE}, /* white is 1 cd/m2 */
                                      .header = {.frame_seq = 7, .scene_rev = 3, .view_id = 9, .quality = 95}};
    return f;
}

static inline void encoder_bed_release(struct fixture *f)
{
    for (int i = 0; i < TILES; i++) {
        lum_encoded_tile_unref(f->tiles[i]);
        f->tiles[i] = NULL;
    }
}

static inline int encoder_bed_end(void **state)
{
    struct fixture *f = *state;
    encoder_bed_release(f);
    lum_film_finish(&f->film);
    lum_encoder_destroy(f->encoder);
    lum_pool_destroy(f->pool);
    free(f);
    return 0;
}

/* Encodes, and returns how many tiles came out. */
static inline int encoder_bed_run(struct fixture *f)
{
    encoder_bed_release(f);
    assert_int_equal(lum_encoder_run(f->encoder, &f->picture, f->states, f->tiles, NULL), LUM_OK);
    int n = 0;
    for (int i = 0; i < TILES; i++)
        n += f->tiles[i] != NULL;
    return n;
}

#endif
