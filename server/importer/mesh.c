#include "server/importer/mesh.h"

#include <string.h>

#include "server/importer/fixtures.h"

void lum_mesh_parts_finish(struct lum_mesh_parts *parts)
{
    lum_free(parts->ids);
    *parts = (struct lum_mesh_parts){0};
}

static void put_array(struct lum_emit *e, struct lum_op_text *op, const char *key, const float *values, size_t n,
                      const struct lum_mesh_exact *exact)
{
    if (exact->bytes && exact->doubles)
        lum_emit_doubles(e, op, key, exact->bytes, n * sizeof(double));
    else if (exact->bytes || values)
        lum_emit_blob(e, op, key, exact->bytes ? exact->bytes : values, n * sizeof(float));
}

enum lum_status lum_mesh_send_known(struct lum_importer *im, const struct lum_mesh_known *known,
                                    const struct lum_mesh_arrays *m, struct lum_error *err)
{
    struct lum_emit *e = &im->emit;
    struct lum_op_text op;
    size_t n = m->n_vertices;
    lum_op_begin(&op, "mesh", known->id);
    put_array(e, &op, "positions", m->positions, 3 * n, &known->positions);
    lum_emit_blob(e, &op, "indices", m->indices, 3 * sizeof(uint32_t) * m->n_triangles);
    put_array(e, &op, "normals", m->normals, 3 * n, &known->normals);
    put_array(e, &op, "uvs", m->uvs, 2 * n, &known->uvs);
    put_array(e, &op, "tangents", m->tangents, 4 * n, &known->tangents);
    put_array(e, &op, "colors", m->colors, 3 * n, &known->colors);
    if (known->deforming)
        lum_op_bool(&op, "deforming", true);
    return lum_emit_op(e, &op, err);
}

static enum lum_status send_arrays(struct lum_importer *im, const char *id, const struct lum_mesh_arrays *m,
                                   struct lum_error *err)
{
    return lum_mesh_send_known(im, &(struct lum_mesh_known){.id = id}, m, err);
}

/* ---- fixtures ---- */

static void free_arrays(struct lum_mesh_arrays *m)
{
    lum_free(m->positions);
    lum_free(m->normals);
    lum_free(m->uvs);
    lum_free(m->tangents);
    lum_free(m->colors);
    lum_free(m->indices);
}

/* Room for as many as there are, of the kinds that there are. */
static bool alloc_like(const struct lum_mesh_arrays *m, struct lum_mesh_arrays *ret)
{
    size_t n = m->n_vertices;
    *ret = (struct lum_mesh_arrays){
        .positions = lum_calloc(3 * n, sizeof(float)),
        .normals = m->normals ? lum_calloc(3 * n, sizeof(float)) : NULL,
        .uvs = m->uvs ? lum_calloc(2 * n, sizeof(float)) : NULL,
        .tangents = m->tangents ? lum_calloc(4 * n, sizeof(float)) : NULL,
        .colors = m->colors ? lum_calloc(3 * n, sizeof(float)) : NULL,
        .indices = lum_calloc(3 * (size_t)m->n_triangles, sizeof(uint32_t)),
    };
    return ret->positions && ret->indices && (ret->normals || !m->normals) && (ret->uvs || !m->uvs) &&
           (ret->tangents || !m->tangents) && (ret->colors || !m->colors);
}

static void copy_vertex(const struct lum_mesh_arrays *m, uint32_t from, struct lum_mesh_arrays *part)
{
    size_t to = part->n_vertices++;
    memcpy(part->positions + 3 * to, m->positions + 3 * (size_t)from, 3 * sizeof(float));
    if (m->normals)
        memcpy(part->normals + 3 * to, m->normals + 3 * (size_t)from, 3 * sizeof(float));
    if (m->uvs)
        memcpy(part->uvs + 2 * to, m->uvs + 2 * (size_t)from, 2 * sizeof(float));
    if (m->tangents)
        memcpy(part->tangents + 4 * to, m->tangents + 4 * (size_t)from, 4 * sizeof(float));
    if (m->colors)
        memcpy(part->colors + 3 * to, m->colors + 3 * (size_t)from, 3 * sizeof(float));
}

struct split {
    const struct lum_mesh_arrays *mesh;
    uint32_t *fixture; /* by triangle */
    uint32_t *order;   /* triangles by fixture */
    uint32_t *number;  /* by vertex: in the part, + 1; valid where stamp is the part's */
    uint32_t *stamp;
    struct lum_mesh_arrays part; /* reused */
};

/* The fixture whose triangles start at order[*inout_at]. */
static void extract(struct split *s, uint32_t *inout_at)
{
    uint32_t fixture = s->fixture[s->order[*inout_at]];
    s->part.n_vertices = s->part.n_triangles = 0;
    for (; *inout_at < s->mesh->n_triangles && s->fixture[s->order[*inout_at]] == fixture; ++*inout_at) {
        for (size_t k = 0; k < 3; k++) {
            uint32_t v = s->mesh->indices[3 * (size_t)s->order[*inout_at] + k];
            if (s->stamp[v] != fixture + 1) { /* a vertex is of one fixture; the stamp says that it is numbered */
                s->stamp[v] = fixture + 1;
                s->number[v] = s->part.n_vertices;
                copy_vertex(s->mesh, v, &s->part);
            }
            s->part.indices[3 * (size_t)s->part.n_triangles + k] = s->number[v];
        }
        s->part.n_triangles++;
    }
}

/* By counting: the triangles of a fixture keep their order. */
static bool sort_triangles(struct split *s, uint32_t n_fixtures)
{
    uint32_t *at = lum_calloc((size_t)n_fixtures + 1, sizeof *at);
    if (!at)
        return false;
    for (uint32_t t = 0; t < s->mesh->n_triangles; t++)
        at[s->fixture[t] + 1]++;
    for (uint32_t f = 0; f < n_fixtures; f++)
        at[f + 1] += at[f];
    for (uint32_t t = 0; t < s->mesh->n_triangles; t++)
        s->order[at[s->fixture[t]]++] = t;
    lum_free(at);
    return true;
}

static enum lum_status send_fixtures(struct lum_importer *im, const struct lum_id_request *name, struct split *s,
                                     struct lum_mesh_parts *parts, struct lum_error *err)
{
    uint32_t at = 0;
    enum lum_status status = LUM_OK;
    for (uint32_t f = 0; f < parts->n && !status; f++) {
        extract(s, &at);
        status = lum_ids_make(&im->ids, name, parts->ids[f], err);
        if (!status)
            status = send_arrays(im, parts->ids[f], &s->part, err);
    }
    return status;
}

/* How many fixtures there are, each triangle's in s->fixture; 1 where they stay whole, 0: memory is short. */
static uint32_t find_fixtures(const struct lum_importer *im, struct split *s, uint32_t n_lamps)
{
    uint32_t left = (LUM_FIXTURES_PER_IMPORT - im->n_fixtures) / n_lamps;
    struct lum_fixture_query q = {
        .positions = s->mesh->positions,
        .indices = s->mesh->indices,
        .n_vertices = s->mesh->n_vertices,
        .n_triangles = s->mesh->n_triangles,
        .most = left < LUM_FIXTURES_PER_MESH ? left : LUM_FIXTURES_PER_MESH,
    };
    return lum_fixtures_find(&q, s->fixture);
}

static enum lum_status send_apart(struct lum_importer *im, const struct lum_id_request *name,
                                  const struct lum_mesh_arrays *m, uint32_t n_lamps, struct lum_mesh_parts *ret_parts,
                                  struct lum_error *err)
{
    struct split s = {
        .mesh = m,
        .fixture = lum_calloc(m->n_triangles, sizeof *s.fixture),
        .order = lum_calloc(m->n_triangles, sizeof *s.order),
        .number = lum_calloc(m->n_vertices, sizeof *s.number),
        .stamp = lum_calloc(m->n_vertices, sizeof *s.stamp),
    };
    enum lum_status status = LUM_OK;
    bool ok = alloc_like(m, &s.part) && s.fixture && s.order && s.number && s.stamp;
    uint32_t n = ok ? find_fixtures(im, &s, n_lamps) : 0;
    ret_parts->ids = n ? lum_calloc(n, sizeof(lum_id)) : NULL;
    ret_parts->n = n;
    if (!ret_parts->ids || !sort_triangles(&s, n))
        status = lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a mesh of %u vertices", m->n_vertices);
    else
        status = send_fixtures(im, name, &s, ret_parts, err);
    im->n_fixtures += n > 1 ? n * n_lamps : 0;
    free_arrays(&s.part);
    lum_free(s.fixture);
    lum_free(s.order);
    lum_free(s.number);
    lum_free(s.stamp);
    return status;
}

/* ---- any mesh ---- */

static enum lum_status send_whole(struct lum_importer *im, const struct lum_id_request *name,
                                  const struct lum_mesh_arrays *m, struct lum_mesh_parts *ret_parts,
                                  struct lum_error *err)
{
    ret_parts->ids = lum_calloc(1, sizeof(lum_id));
    ret_parts->n = 1;
    if (!ret_parts->ids)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a mesh");
    enum lum_status status = lum_ids_make(&im->ids, name, ret_parts->ids[0], err);
    return status ? status : send_arrays(im, ret_parts->ids[0], m, err);
}

enum lum_status lum_mesh_send(struct lum_importer *im, const struct lum_id_request *name,
                              const struct lum_mesh_arrays *m, uint32_t n_lamps, struct lum_mesh_parts *ret_parts,
                              struct lum_error *err)
{
    *ret_parts = (struct lum_mesh_parts){0};
    if (m->n_triangles == 0)
        return LUM_OK;
    bool apart = n_lamps > 0 && m->n_triangles > 1 && LUM_FIXTURES_PER_IMPORT - im->n_fixtures > n_lamps;
    enum lum_status status =
        apart ? send_apart(im, name, m, n_lamps, ret_parts, err) : send_whole(im, name, m, ret_parts, err);
    if (status)
        lum_mesh_parts_finish(ret_parts);
    return status;
}
