/* Where studies look: scenes and models through one camera each; and the methods that they are asked for. */
#ifndef LUM_TESTS_BENCH_PLACES_H
#define LUM_TESTS_BENCH_PLACES_H

#include "core/method/method.h"
#include "tests/bench/bench.h"

enum { LUM_BENCH_PLACES = 64, LUM_BENCH_METHODS = 9 };

struct lum_bench_place {
    char source[4096];  /* name or file */
    char scene[64];     /* as it is called */
    const char *camera; /* the end of its id; NULL: the scene's own */
};
struct lum_bench_places {
    struct lum_bench_place items[LUM_BENCH_PLACES];
    size_t n;
};

/* --scene; with --quick two; else all built-in scenes and, where they are, the models that nobody here made. */
void lum_bench_list_places(const struct lum_bench_options *options, struct lum_bench_places *ret_places);
/* False after a message on stderr. */
bool lum_bench_place_camera(const struct lum_bench_place *place, struct lum_world *world,
                            struct lum_camera *ret_camera);

/* A place as a study has it: the settings that its record says, through its camera. */
struct lum_bench_stand {
    const struct lum_bench_options *options;
    const struct lum_bench_place *place;
    const struct lum_method *methods[LUM_BENCH_METHODS];
    size_t n_methods;
    /* of one that is open */
    struct lum_world world;
    struct lum_view_settings settings;
    float *picture; /* 3 * w * h */
};
/* whole, quick: sizes of pictures, as in lum_bench_size. False after a message on stderr. Close it in both cases. */
bool lum_bench_stand_open(struct lum_bench_stand *stand, const uint32_t whole[2], const uint32_t quick[2]);
void lum_bench_stand_close(struct lum_bench_stand *stand);

/* A study of one place after the other. Its rig, of so many bytes, begins with a struct lum_bench_stand; each place has
 * a new one, which is 0 but for that. */
struct lum_bench_tour {
    const char *methods; /* without --methods */
    size_t rig_bytes;
    bool (*measure)(void *rig, void *results);
    void (*close)(void *rig); /* also of one that could not be measured */
};
/* Until a place fails: false then, or after a message on stderr. */
bool lum_bench_go(const struct lum_bench_tour *tour, const struct lum_bench_options *options, void *results);

/* list: names, with commas between. False after a message on stderr. */
bool lum_bench_find_methods(const char *list, const struct lum_method *ret_methods[LUM_BENCH_METHODS], size_t *ret_n);

#endif
