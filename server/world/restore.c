#include "server/world/restore.h"

#include <string.h>

#include "core/base/base.h"
#include "core/scene/scene.h"
#include "server/world/apply.h"

struct restoring {
    struct lum_scene *scene;
    const struct lum_record **meshes; /* that can be made beside the scene, in the order of the document */
    struct lum_made_mesh *made;       /* of each; empty where that failed: putting it says why */
    uint32_t n_meshes, n_put;
    struct lum_totals totals;
    enum lum_status status;
    struct lum_error *err;
};

static bool can_be_made(const struct lum_record *r)
{
    return r->type == LUM_RECORD_MESH && !r->mesh.deforming;
}

static void count_mesh(void *user, const struct lum_record *r)
{
    struct restoring *g = user;
    g->n_meshes += can_be_made(r);
}

static void note_mesh(void *user, const struct lum_record *r)
{
    struct restoring *g = user;
    if (can_be_made(r))
        g->meshes[g->n_meshes++] = r;
}

static void make_one(void *user, uint32_t job, uint32_t worker)
{
    struct restoring *g = user;
    (void)worker;
    if (lum_apply_make_mesh(g->scene, g->meshes[job], &g->made[job], NULL))
        g->made[job] = (struct lum_made_mesh){0};
}

static bool make_meshes(struct restoring *g, struct lum_pool *pool, const struct lum_document *doc)
{
    if (!lum_document_each(doc, count_mesh, g))
        return false;
    g->meshes = lum_calloc(g->n_meshes, sizeof(*g->meshes));
    g->made = lum_calloc(g->n_meshes, sizeof *g->made);
    g->n_meshes = 0;
    return g->meshes && g->made && lum_document_each(doc, note_mesh, g) &&
           lum_pool_run(pool, g->n_meshes, make_one, g, NULL) == LUM_OK;
}

static void put_one(void *user, const struct lum_record *r)
{
    struct restoring *g = user;
    if (g->status)
        return;
    g->totals = lum_totals_sum(g->totals, lum_totals_of(r));
    struct lum_made_mesh *made = can_be_made(r) ? &g->made[g->n_put++] : NULL;
    struct lum_error e = {0};
    if (made && made->mesh)
        g->status = lum_scene_put_made_mesh(g->scene, r->id, made, &e);
    else
        g->status = lum_apply_put(g->scene, r, &e);
    if (g->status)
        lum_fail(g->err, g->status, e.field, "\"%.64s\" cannot be shown: %.160s", r->id, e.text);
}

enum lum_status lum_scene_of_document(struct lum_scene *scene, struct lum_pool *pool, const struct lum_document *doc,
                                      struct lum_totals *ret_totals, struct lum_error *err)
{
    struct restoring g = {.scene = scene, .err = err};
    if (!make_meshes(&g, pool, doc) || !lum_document_each(doc, put_one, &g))
        g.status = lum_fail(err, LUM_ERR_NOMEM, "", "no memory for the scene");
    for (uint32_t i = 0; g.made && i < g.n_meshes; i++)
        lum_made_mesh_finish(&g.made[i]);
    lum_free(g.meshes);
    lum_free(g.made);
    *ret_totals = g.totals;
    return g.status;
}
