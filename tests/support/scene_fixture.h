/* A scene to test with, and short ways to fill it. Every helper asserts (cmocka) that it succeeds. */
#ifndef LUM_TESTS_SUPPORT_SCENE_FIXTURE_H
#define LUM_TESTS_SUPPORT_SCENE_FIXTURE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/accel/trace.h"
#include "core/scene/shapes.h"
#include "core/scene/snapshot.h"
#include "tests/support/default_material.h"

#define CHECK_OK(call)                                                                                                 \
    do {                                                                                                               \
        struct lum_error check_err = {.status = LUM_OK};                                                               \
        struct lum_error *err = &check_err;                                                                            \
        if ((call) != LUM_OK)                                                                                          \
            fail_msg("%s: %s: %s", #call, check_err.field, check_err.text);                                            \
    } while (0)

struct fixture {
    struct lum_device *device;
    struct lum_scene *scene;
    uint64_t rev;
};

int fixture_setup(void **state);        /* cmocka: *state is a struct fixture with an empty scene */
int fixture_setup_narrow(void **state); /* the same, with vectors of 8 */
int fixture_teardown(void **state);

void put_shape(struct lum_scene *scene, const char *id, const char *shape, uint32_t around, uint32_t along);
void put_material(struct lum_scene *scene, const char *id); /* white diffuse */
void put_emissive(struct lum_scene *scene, const char *id, double cd_m2);
void put_object(struct lum_scene *scene, const char *id, const char *mesh, const char *material, struct lum_affined m);
struct lum_light_desc light_desc(const struct lum_light_kind_row *kind); /* valid for every kind */
void put_light(struct lum_scene *scene, const char *id, const struct lum_light_desc *light);
/* A box of 2 m. */
void put_fog(struct lum_scene *scene, const char *id, float sigma_s);
/* One of everything: objects a (a ball), b and lamp (emissive), lights key and fill, camera main, medium fog. */
void furnish(struct lum_scene *scene);
const struct lum_snapshot *commit(struct fixture *f);

struct lum_affined at(double x, double y, double z);
struct lum_affined scaled_at(double s, double x, double y, double z);

/* World to scene. */
struct lum_vec3 to_scene(const struct lum_snapshot *s, double x, double y, double z);
/* Fills lane i of a batch with a ray in scene space, from 0 to infinity. */
void set_ray(struct lum_rays *rays, uint32_t i, struct lum_vec3 o, struct lum_vec3 d);
/* Traces; asserts that the gate refused nothing. */
void trace(const struct lum_snapshot *s, const struct lum_rays *rays, struct lum_hits *hits);

/* Reproducible numbers, uniform in [0, 1). */
struct random_stream {
    uint64_t state;
};
double random_double(struct random_stream *r);
uint32_t random_bits(struct random_stream *r);
struct lum_vec3 random_direction(struct random_stream *r);

#endif
