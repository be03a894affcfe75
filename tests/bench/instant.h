/* Shared by the halves of the study of instant caching: what was measured (instant.c) and how it is shown
 * (instant_report.c). */
#ifndef LUM_TESTS_BENCH_INSTANT_H
#define LUM_TESTS_BENCH_INSTANT_H

#include "tests/bench/reference.h"
#include "tests/bench/seen.h"

enum { INSTANT_SCENES = 12, INSTANT_ROUNDS = 5, INSTANT_POSES = 100, INSTANT_POINTS = 6 };

enum instant_method { INSTANT_RT, INSTANT_IGI, INSTANT_IC, INSTANT_TIC, INSTANT_LIVE, INSTANT_METHODS };
extern const char *const instant_methods[INSTANT_METHODS]; /* as lum_method_find knows them */

enum instant_part {
    INSTANT_WHOLE,
    INSTANT_DIFFUSE,
    INSTANT_PARTS
}; /* the whole frame, and its indirect diffuse light alone */
extern const char *const instant_parts[INSTANT_PARTS];

/* Frames of one method and part. n 0: there are none. */
struct instant_cell {
    size_t n;
    double ms[INSTANT_POSES], cpu_ms[INSTANT_POSES]; /* by round, or by pose */
    double rays[LUM_RAY_KIND_COUNT];                 /* of a frame, on average */
    double records, updated, created;                /* of a frame, on average */
};

/* A scene's first frame, or its animation. */
struct instant_frames {
    struct instant_cell cells[INSTANT_METHODS][INSTANT_PARTS];
    struct lum_bench_error errors[INSTANT_METHODS][INSTANT_PARTS]; /* of the last pose; NAN: there is none */
    struct lum_bench_seen seen[INSTANT_METHODS][INSTANT_PARTS];    /* of the same, against the reference */
    struct lum_bench_seen tic_igi[INSTANT_PARTS];                  /* of tic, against igi */
    struct lum_bench_seen noise[INSTANT_PARTS];                    /* one half of the reference, against the other */
    uint32_t reference_spp;
    double reference_relmse[INSTANT_PARTS];
};

struct instant_scene {
    const char *name;
    double accuracy;
    uint32_t n_slots; /* of which 256 hold a virtual point light */
    bool moves;       /* there is an animation */
    struct instant_frames first, moving;
};

/* What a frame of an animation costs as one number grows: the indirect diffuse light alone. */
enum instant_growth {
    INSTANT_VPLS,
    INSTANT_RECORDS,
    INSTANT_MOVERS,
    INSTANT_TRIANGLES,
    INSTANT_PIXELS,
    INSTANT_GROWTHS
};
extern const char *const instant_growths[INSTANT_GROWTHS];

struct instant_curve {
    size_t n;
    double x[INSTANT_POINTS]; /* of INSTANT_RECORDS: accuracy */
    struct instant_cell cells[INSTANT_POINTS][INSTANT_METHODS];
};

struct instant_study {
    struct instant_scene scenes[INSTANT_SCENES];
    size_t n_scenes;
    struct instant_curve growth[INSTANT_GROWTHS];
    uint32_t w, h;
    char machine[256];
};

/* Tables and figures: of the scenes, or of the growth. False after a message on stderr. */
bool instant_report(const struct instant_study *study, const struct lum_bench_options *options);
bool instant_report_growth(const struct instant_study *study, const struct lum_bench_options *options);

#endif
