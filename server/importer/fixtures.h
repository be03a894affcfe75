/* Which triangles of a mesh that shines make up one fixture, so that each becomes a lamp of its own.
 *
 * Triangles that share a corner belong together; so do parts whose boxes meet or nearly do (the glass and the cap of a
 * bulb, both faces of a panel). Where more would be left than anybody dims one by one, those that are near each other
 * are one. */
#ifndef LUM_SERVER_IMPORTER_FIXTURES_H
#define LUM_SERVER_IMPORTER_FIXTURES_H

#include <stdint.h>

#define LUM_FIXTURES_PER_MESH 256u /* a ceiling of luminaires; the points of a chain of lights are grouped */
#define LUM_FIXTURES_PER_IMPORT                                                                                        \
    1024u /* objects: each is a record, something to trace and a light to sample; then meshes stay whole */

struct lum_fixture_query {
    const float *positions;  /* 3 * n_vertices, finite */
    const uint32_t *indices; /* 3 * n_triangles, below n_vertices */
    uint32_t n_vertices, n_triangles;
    uint32_t most; /* fixtures; 1 at least */
};
/* ret_fixture[i]: the fixture of triangle i; they are numbered in the order of their first triangles. Returns how many
 * there are; 0: memory is short. */
uint32_t lum_fixtures_find(const struct lum_fixture_query *q, uint32_t *ret_fixture);

#endif
