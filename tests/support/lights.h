/* Lights of every kind, each alone in a snapshot. */
#ifndef LUM_TESTS_SUPPORT_LIGHTS_H
#define LUM_TESTS_SUPPORT_LIGHTS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/light/facets.h"
#include "core/light/light.h"
#include "core/scene/snapshot.h"

struct lum_vec3 direction(double cos_theta, double phi);
/* One light in an otherwise empty snapshot. */
struct lum_snapshot snapshot_of(const struct lum_light *l);
struct lum_light light(const struct lum_emitter_row *kind); /* &lum_emitter_point: an even one */
struct lum_light spot(void);
struct lum_light quad(struct lum_vec3 centre, struct lum_vec3 u, struct lum_vec3 v);
struct lum_light disc(struct lum_vec3 centre, struct lum_vec3 n, float radius);
struct lum_light sphere(struct lum_vec3 centre, float radius);

/* A crumpled mesh of three triangles, one of them without area, behind a transform that scales unevenly. */
struct mesh_light {
    float positions[15], tri_cdf[3];
    uint32_t indices[9];
    struct lum_mesh mesh;
    struct lum_instance instance;
    struct lum_material material;
    struct lum_light light;
    struct lum_facets facets; /* of the light, if light.facets is set to them */
    struct lum_snapshot snapshot;
};

struct lum_vec3 mesh_vertex(const struct mesh_light *m, uint32_t tri, uint32_t k);
struct lum_vec3 mesh_normal(const struct mesh_light *m, uint32_t tri); /* length: twice the area */
void mesh_light_init(struct mesh_light *m);

#endif
