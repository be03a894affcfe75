/* Guided directions: where indirect light comes from, learned from a view's own path traced samples.
 *
 * Space is cut into cells by six trees, one for each way that a surface may face (the largest component of its normal);
 * a leaf where much was heard is halved. Each cell has a histogram, over the faces of a cube, of the light that arrives
 * from each direction times its cosine: what light sampling has not counted. Paths go on from diffuse surfaces by a
 * mixture of the cosine and of this (Vorba et al. 2014, Mueller et al. 2017), whose density is known to all that weighs
 * it.
 *
 * data flow: lum_path_guide_begin (between samples: densities of what was heard) -> paths go by the cells, and note
 * where they went
 * -> lum_path_guide_learn (end of a tile). A sample goes by what was learned from samples before it, so the mean stays
 * unbiased. What is heard is summed in integers: neither densities nor pictures depend on the order of threads. Nothing
 * is learned in a picture's first sample, and the two after it are a trial in one of four tiles. Where memory is short,
 * or what is saved is less than what it costs, paths go unguided. */
#ifndef LUM_CORE_PATH_GUIDE_H
#define LUM_CORE_PATH_GUIDE_H

#include "core/accel/trace.h"
#include "core/base/pool.h"
#include "core/film/film.h"
#include "core/material/bsdf.h"
#include "core/trace/rays.h"

#define LUM_PATH_GUIDE_BYTES                                                                                           \
    ((size_t)6 << 20)          /* of cells, each of 4 KiB: more than caches hold cost more than they save */
#define LUM_PATH_GUIDE_SIDE 8u /* bins along the edge of a face of the cube */
#define LUM_PATH_GUIDE_ROWS (6u * LUM_PATH_GUIDE_SIDE)
#define LUM_PATH_GUIDE_BINS (LUM_PATH_GUIDE_ROWS * LUM_PATH_GUIDE_SIDE)
#define LUM_PATH_GUIDE_WHOLE 65535.0f /* what distributions end at */

struct lum_path_guide_cell {
    float share; /* of cosine-shaped sampling that goes by what follows; 0: none, and nothing follows */
    uint16_t rows[LUM_PATH_GUIDE_ROWS]; /* the last bin of each row, of bins */
    uint16_t bins[LUM_PATH_GUIDE_BINS]; /* inclusive sums */
};

/* ---- directions (guide_sample.c). Thread: any ---- */

/* A unit direction, its bin, and its density per solid angle; over all directions. The cell has a share. */
struct lum_vec3 lum_path_guide_sample(const struct lum_path_guide_cell *cell, struct lum_vec2 u, uint32_t *ret_bin,
                                      float *ret_pdf_sa);
/* That density for unit d, and its bin. 0 without a share. */
float lum_path_guide_pdf(const struct lum_path_guide_cell *cell, struct lum_vec3 d, uint32_t *ret_bin);

/* What guides at a surface point. */
struct lum_path_guide_locate {
    const struct lum_path_guide_cell *cell; /* NULL: nothing; valid until the next lum_path_guide_begin */
    uint32_t index;
    float share; /* of all directions that go by the cell: part of those of the diffuse lobe */
};
/* Density with which paths go on to wi, where lum_bsdf_eval is not black, given the BSDF's own. */
float lum_path_guide_bsdf_pdf(const struct lum_path_guide_locate *at, const struct lum_bsdf *b, struct lum_vec3 wi,
                              float pdf_sa);

struct lum_path_guide_step {
    struct lum_bsdf_sample s;
    float ratio;  /* density of the direction over the BSDF's own; 1 where nothing guides */
    float cosine; /* with the shading normal, of a direction that can be learned from; else 0 */
    uint32_t bin; /* then */
};
/* As lum_bsdf_sample, guided. */
bool lum_path_guide_bsdf_sample(const struct lum_path_guide_locate *at, const struct lum_bsdf *b, struct lum_vec3 wo,
                                struct lum_vec2 u, float u_lobe, struct lum_path_guide_step *ret_step);

/* ---- learning ---- */

struct lum_path_guide;

/* Where a path went on from a surface that guides. */
#define LUM_PATH_GUIDE_NOTES 3u /* of a path: at its first surfaces. Those beyond matter less and are not guided */
struct lum_path_guide_note {
    uint32_t cell, bin;
    float scale;     /* from luminance in the picture to what arrived, times its cosine, over the direction's density */
    float before;    /* luminance that the path had brought home when this segment began; below 0: that is to be */
    float pdf_sa;    /* of the direction */
    float pdf_ratio; /* the same over that without guiding */
};
struct lum_path_guide_notes {
    struct lum_path_guide_note note[LUM_RAY_BATCH][LUM_PATH_GUIDE_NOTES]; /* by slot of the wave */
    float
        emitted[LUM_RAY_BATCH]; /* of what the first of them brought home: luminance that shone at the segment's end */
    uint8_t n[LUM_RAY_BATCH];
};

/* NULL: out of memory. */
struct lum_path_guide *lum_path_guide_create(void);
void lum_path_guide_destroy(struct lum_path_guide *guide); /* accepts NULL */

struct lum_team;

/* A pass of samples, one of every pixel. */
struct lum_guided_pass {
    const struct lum_snapshot *snapshot;
    const struct lum_film *film; /* with the samples before */
    uint32_t sample;             /* number of this one, from 0, which makes it forget everything */
    bool allowed; /* indirect light is shown, and no kind of light is left out: which lobe a path goes on by decides
                   * which lights it may find, so that how often it is the diffuse one must not change with what was
                   * learned */
    struct lum_team *team; /* that shares the samples, and what is heard from them; NULL: there are no others */
};
/* Before each pass, and the rest of one that was cut short. False: nothing guides or learns. Thread: the director. */
bool lum_path_guide_begin(struct lum_path_guide *guide, const struct lum_guided_pass *pass, struct lum_pool *pool);

/* What guides at surface point p with BSDF b; the place has a cell, and a share if its cell has. Thread: any. */
struct lum_path_guide_locate lum_path_guide_find(const struct lum_path_guide *guide, struct lum_vec3 p,
                                                 const struct lum_bsdf *b);

/* Paths of the tile in this column and row are guided in this pass. */
bool lum_path_guide_serves(const struct lum_path_guide *guide, uint32_t column, uint32_t row);
/* If they are: they are to make notes. */
bool lum_path_guide_learns(const struct lum_path_guide *guide, uint32_t tile);
/* A tile's paths came to their end. By slot: what the samples before show, as a mean of luminance, and this one.
 * Thread: any. */
void lum_path_guide_learn(struct lum_path_guide *guide, uint32_t n_slots, const struct lum_path_guide_notes *notes,
                          const float *means, const struct lum_rgb *radiance);

#endif
