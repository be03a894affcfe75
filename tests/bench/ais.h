/* Shared by the halves of the study of adaptive interleaved sampling: what was measured (ais.c) and how it is shown
 * (ais_report.c). */
#ifndef LUM_TESTS_BENCH_AIS_H
#define LUM_TESTS_BENCH_AIS_H

#include "tests/bench/reference.h"

enum { AIS_SCENES = 18, AIS_ROUNDS = 6, AIS_DRAWS = 8, AIS_POINTS = 16, AIS_VPLS = 256 /* 5.4 */ };

enum ais_method { AIS_A, AIS_MAX, AIS_IGI, AIS_LIVE, AIS_METHODS };
extern const char *const ais_methods[AIS_METHODS]; /* as lum_method_find knows them */

/* Components, each alone: indirect diffuse, direct with its shadows, participating media; and everything. */
enum ais_part { AIS_ID, AIS_SS, AIS_PM, AIS_FULL, AIS_PARTS };
extern const char *const ais_parts[AIS_PARTS];

/* Fresh frames of one method and part. n 0: the method does not serve it, or the scene does not call for it. */
struct ais_cell {
    size_t n;                                  /* rounds */
    double ms[AIS_ROUNDS], cpu_ms[AIS_ROUNDS]; /* of a frame: mean of the two of a round */
    uint64_t rays[LUM_RAY_KIND_COUNT];         /* of a frame */
};

/* A frame at one setting, for error against cost. */
struct ais_point {
    bool at_default;
    uint32_t n_vpls, spp;
    uint32_t shadow_budget; /* of live alone */
    double cache_accuracy;  /* same */
    double cpu_ms;
    struct lum_bench_error picked_by, error; /* means of different draws, where there are several; see ais.c */
    uint64_t rays;
};
struct ais_curve {
    struct ais_point points[AIS_POINTS];
    size_t n;
};

/* A scene whose surfaces are glossy is there twice: first as NAME-no-gloss, without that effect in all methods and in
 * the reference. */
struct ais_scene {
    char name[64];
    bool partly; /* glossy: ais serves it in part */
    struct ais_cell cells[AIS_METHODS][AIS_PARTS];
    struct lum_bench_error errors[AIS_METHODS]; /* of AIS_FULL; NAN where there is none */
    struct ais_curve curves[AIS_METHODS + 1];   /* the last one is path's */
    uint32_t reference_spp;
    double reference_relmse; /* noise that is left in the reference; not in relmse, which knows of it */
    uint32_t n_slots;        /* of which AIS_VPLS hold a virtual point light */
    double iterations;       /* of AIS_ID of ais, the first one included: mean over the pixels that it computes */
};

struct ais_study {
    struct ais_scene scenes[AIS_SCENES];
    size_t n_scenes;
    uint32_t w, h;
    char machine[256];
};

/* Tables and figures. False after a message on stderr. */
bool ais_report(const struct ais_study *study, const struct lum_bench_options *options);

#endif
