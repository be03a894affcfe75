/* What somebody who looks at a picture would see of its error: HDR-VDP and HDR-FLIP of the first frames of every
 * method, against path tracing; the thesis' tables 5.3 and 6.5 on our scenes.
 *
 * Against two references: through the centres of pixels, as the thesis' methods render, and antialiased, as the product
 * does. A method that smooths edges is compared with the second alone, the others with both: the thesis puts down most
 * of what is seen to aliasing, and this tells how much of it is. 256 virtual point lights, as in 5.4 and 6.3, which the
 * thesis' methods get as many slots for as that takes (slots.h).
 *
 * Noise of the reference is seen, too. How much of it: its two halves against each other, which differ by twice the
 * noise of their mean. */
#include <math.h>

#include "tests/bench/places.h"
#include "tests/bench/reference.h"
#include "tests/bench/seen.h"
#include "tests/bench/slots.h"
#include "tests/bench/table.h"

#define METHODS "igi,ais,ais-max,irrcache,ic,tic,live"
#define VPLS 256u

enum { SMOOTH, CENTERS, REFERENCES }; /* antialiased; through the centres of pixels */

struct rig {
    struct lum_bench_stand at;
    struct lum_bench_reference reference[REFERENCES];
    uint32_t n_slots;
    float *igi; /* 3 * w * h */
};

static bool look(const struct rig *rig, const float *x, const float *r, struct lum_bench_seen *ret_seen)
{
    return lum_bench_look(rig->at.settings.w, rig->at.settings.h, x, r, ret_seen);
}

/* ---- a scene ---- */

static const struct lum_bench_column columns[] = {
    {"scene", "scene", LUM_BENCH_TEXT},
    {"method", "method", LUM_BENCH_TEXT},
    {"p75_centers", "pixel centres: P >= 75 %", 2},
    {"p95_centers", "P >= 95 %", 2},
    {"dim75_centers", "dim: P >= 75 %", 2},
    {"dim95_centers", "P >= 95 %", 2},
    {"flip_centers", "HDR-FLIP", 4},
    {"p75_smooth", "antialiased: P >= 75 %", 2},
    {"p95_smooth", "P >= 95 %", 2},
    {"dim75_smooth", "dim: P >= 75 %", 2},
    {"dim95_smooth", "P >= 95 %", 2},
    {"flip_smooth", "HDR-FLIP", 4},
    {"reference_spp", NULL, 0},
};

static void tell(const struct rig *rig, const char *what, const struct lum_bench_seen seen[REFERENCES],
                 struct lum_bench_table *table)
{
    LUM_BENCH_TEXTS(table, rig->at.place->scene, what);
    LUM_BENCH_NUMBERS(table, seen[CENTERS].p75, seen[CENTERS].p95, seen[CENTERS].dim75, seen[CENTERS].dim95,
                      seen[CENTERS].flip, seen[SMOOTH].p75, seen[SMOOTH].p95, seen[SMOOTH].dim75, seen[SMOOTH].dim95,
                      seen[SMOOTH].flip, (double)rig->reference[SMOOTH].spp);
}

/* Half against half. */
static bool look_at_references(struct rig *rig, struct lum_bench_table *table)
{
    struct lum_bench_seen seen[REFERENCES];
    for (int k = 0; k < REFERENCES; k++)
        if (!look(rig, rig->reference[k].half[0], rig->reference[k].half[1], &seen[k]))
            return false;
    tell(rig, "half of the reference / the other", seen, table);
    return true;
}

/* On a view of its own, with caches of its own. */
static bool render(struct rig *rig, const struct lum_method *method, float *ret_picture)
{
    struct lum_error err = {0};
    struct lum_view *view = NULL;
    struct lum_pass_stats stats;
    rig->at.settings.method = method;
    rig->at.settings.n_vpls = method->refines ? VPLS : rig->n_slots; /* live has paths to choose from */
    bool ok = lum_view_create(rig->at.world.pool, &view, &err) == LUM_OK &&
              lum_view_pass(view, rig->at.world.snapshot, &rig->at.settings, NULL, &stats, &err) == LUM_OK;
    if (ok)
        lum_bench_picture_of(view, ret_picture);
    lum_view_destroy(view);
    return ok || lum_bench_failed(err.text);
}

static bool look_at_method(struct rig *rig, const struct lum_method *method, struct lum_bench_table *table)
{
    struct lum_bench_seen seen[REFERENCES] = {LUM_BENCH_NOT_SEEN, LUM_BENCH_NOT_SEEN};
    bool smooth = method->serves[LUM_EFFECT_ANTIALIAS] != NULL;
    if (!render(rig, method, rig->at.picture))
        return false;
    for (int k = 0; k < REFERENCES; k++)
        if ((k == SMOOTH || !smooth) && !look(rig, rig->at.picture, rig->reference[k].truth, &seen[k]))
            return false;
    tell(rig, method->name, seen, table);
    return true;
}

/* The second half of table 6.5. */
static bool look_at_tic_beside_igi(struct rig *rig, struct lum_bench_table *table)
{
    struct lum_bench_seen seen[REFERENCES] = {LUM_BENCH_NOT_SEEN, LUM_BENCH_NOT_SEEN};
    if (!render(rig, lum_method_find("tic"), rig->at.picture) || !render(rig, lum_method_find("igi"), rig->igi) ||
        !look(rig, rig->at.picture, rig->igi, &seen[CENTERS]))
        return false;
    tell(rig, "tic / igi", seen, table);
    return true;
}

static bool open_rig(struct rig *rig)
{
    if (!lum_bench_stand_open(&rig->at, (const uint32_t[]){300, 200}, (const uint32_t[]){48, 32}))
        return false;
    rig->at.settings.n_vpls = VPLS;
    const size_t n = (size_t)rig->at.settings.w * rig->at.settings.h;
    rig->igi = lum_calloc(3 * n, sizeof *rig->igi);
    return rig->igi || lum_bench_failed("out of memory");
}

static bool make_references(struct rig *rig)
{
    for (int k = 0; k < REFERENCES; k++) {
        struct lum_view_settings settings = rig->at.settings;
        settings.antialias = k == SMOOTH;
        struct lum_bench_truth truth = lum_bench_truth_of(rig->at.options, &rig->at.world, &settings);
        truth.least_spp = truth.most_spp; /* what is told hangs on its noise */
        truth.or_more = true;
        if (!lum_bench_reference_make(&rig->reference[k], &truth))
            return false;
    }
    return true;
}

static bool measure_scene(void *of, void *table)
{
    struct rig *rig = of;
    lum_bench_progress("vision: %s: references", rig->at.place->scene);
    if (!open_rig(rig)) {
        printf("skipped: %s\n", rig->at.place->scene);
        return true;
    }
    rig->n_slots = lum_bench_slots_for(&rig->at.world, &rig->at.settings, VPLS);
    if (rig->n_slots == 0 || !make_references(rig) || !look_at_references(rig, table))
        return false;
    lum_bench_progress("vision: %s: methods", rig->at.place->scene);
    for (size_t m = 0; m < rig->at.n_methods; m++)
        if (!look_at_method(rig, rig->at.methods[m], table))
            return false;
    return look_at_tic_beside_igi(rig, table);
}

static void close_rig(void *of)
{
    struct rig *rig = of;
    for (int k = 0; k < REFERENCES; k++)
        lum_bench_reference_finish(&rig->reference[k]);
    lum_free(rig->igi);
    lum_bench_stand_close(&rig->at);
}

int lum_bench_vision(const struct lum_bench_options *options)
{
    const struct lum_bench_tour tour = {METHODS, sizeof(struct rig), measure_scene, close_rig};
    struct lum_bench_table table = LUM_BENCH_TABLE(columns);
    lum_thread_init_fp();
    bool ok = lum_bench_go(&tour, options, &table);
    printf("HDR-VDP: %% of pixels whose error is seen with at least this probability; dim: of pictures of %g cd/m2 on "
           "average;\nHDR-FLIP: mean, 0 to 1\n",
           LUM_BENCH_DIM);
    ok = lum_bench_table_finish(&table, options, "vision") && ok;
    return ok ? 0 : 1;
}
