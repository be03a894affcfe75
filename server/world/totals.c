#include "server/world/totals.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/scene/shapes.h"
#include "server/world/apply.h"

/* Of a triangle as it is drawn: positions, normals and indices in float, and the tree that rays go through. */
#define DRAWN_TRIANGLE_BYTES 200u

static uint64_t triangles_of(const struct lum_record_mesh *m)
{
    if (!m->shape[0])
        return m->indices.n / 3;
    struct lum_shape_params params = {.segments = {(uint32_t)m->segments[0], (uint32_t)m->segments[1]}};
    uint32_t n = 0;
    memcpy(params.param, m->param, sizeof params.param);
    return lum_shape_count(m->shape, &params, &n, NULL) ? 0
                                                        : n; /* what cannot be made is refused with its own reason */
}

struct lum_totals lum_totals_of(const struct lum_record *r)
{
    struct lum_totals t = {.bytes = r ? lum_record_bytes(r) : 0};
    if (r && r->type == LUM_RECORD_MESH) {
        t.triangles = triangles_of(&r->mesh);
        t.bytes += t.triangles * DRAWN_TRIANGLE_BYTES;
    } else if (r && r->type == LUM_RECORD_IMAGE) {
        t.texels = (uint64_t)r->image.width * r->image.height;
        t.bytes += r->image.n_bytes; /* the renderer has a copy */
    }
    return t;
}

struct lum_totals lum_totals_limits(void)
{
    struct lum_totals t = {LUM_LIMIT_SCENE_TRIANGLES, LUM_LIMIT_SCENE_TEXELS, LUM_LIMIT_SCENE_MEMORY};
    long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    uint64_t most = pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page / 4 * 3 : t.bytes;
    t.bytes = most < t.bytes ? most : t.bytes;
    return t;
}

struct lum_totals lum_totals_sum(struct lum_totals a, struct lum_totals b)
{
    return (struct lum_totals){a.triangles + b.triangles, a.texels + b.texels, a.bytes + b.bytes};
}

static struct lum_totals difference(struct lum_totals a, struct lum_totals b)
{
    return (struct lum_totals){a.triangles - b.triangles, a.texels - b.texels, a.bytes - b.bytes};
}

/* ---- limits ---- */

/* One of the three: its place in struct lum_totals, and how people know it. */
struct kind {
    size_t offset;
    const char *what;
};
static const struct kind kinds[] = {
    {offsetof(struct lum_totals, triangles), "triangles"},
    {offsetof(struct lum_totals, texels), "texels"},
    {offsetof(struct lum_totals, bytes), "bytes"},
};

static uint64_t amount(const struct kind *k, const struct lum_totals *t)
{
    return *(const uint64_t *)(const void *)((const char *)t + k->offset);
}

static const char *field_of(const struct lum_record *r)
{
    if (r->type == LUM_RECORD_MESH)
        return r->mesh.shape[0] ? "segments" : "indices";
    return r->type == LUM_RECORD_IMAGE ? "pixels" : "id";
}

/* The change with which the sum of all that grows first is over the limit; what shrinks is taken off before. */
static size_t culprit(const struct kind *k, uint64_t total, uint64_t limit, const struct lum_changes *c)
{
    size_t last = 0;
    for (size_t i = c->n; i-- > 0 && total > limit;) {
        struct lum_totals before = lum_totals_of(c->changes[i].before), after = lum_totals_of(c->changes[i].after);
        if (amount(k, &after) <= amount(k, &before))
            continue;
        total -= amount(k, &after) - amount(k, &before);
        last = i;
    }
    return last;
}

static enum lum_status refuse(const struct kind *k, uint64_t total, uint64_t limit, const struct lum_record *r,
                              struct lum_error *err)
{
    return lum_fail(err, LUM_ERR_LIMIT, field_of(r),
                    "the scene would have %llu %s in all, and may have %llu: make \"%.64s\" simpler, or remove others",
                    (unsigned long long)total, k->what, (unsigned long long)limit, r->id);
}

enum lum_status lum_totals_change(struct lum_totals *inout_totals, const struct lum_totals *limits,
                                  const struct lum_changes *changes, size_t *ret_failed, struct lum_error *err)
{
    struct lum_totals less = {0}, more = {0};
    for (size_t i = 0; i < changes->n; i++) {
        less = lum_totals_sum(less, lum_totals_of(changes->changes[i].before));
        more = lum_totals_sum(more, lum_totals_of(changes->changes[i].after));
    }
    struct lum_totals now = lum_totals_sum(difference(*inout_totals, less), more);
    for (size_t k = 0; k < LUM_ARRAY_LEN(kinds); k++) {
        uint64_t total = amount(&kinds[k], &now), limit = amount(&kinds[k], limits);
        if (total <= limit || total <= amount(&kinds[k], inout_totals))
            continue;
        *ret_failed = culprit(&kinds[k], total, limit, changes);
        return refuse(&kinds[k], total, limit, changes->changes[*ret_failed].after, err);
    }
    *inout_totals = now;
    return LUM_OK;
}

static int by_text(const void *a, const void *b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

static struct lum_totals with_children(const struct lum_document *doc, const char *id)
{
    const struct lum_record *r = lum_document_find(doc, id);
    struct lum_totals t = lum_totals_of(r);
    for (size_t i = 0; r && r->type == LUM_RECORD_IMPORT && i < r->import.n_made; i++)
        t = lum_totals_sum(t, lum_totals_of(lum_document_find(doc, r->import.made[i]->id)));
    return t;
}

static uint64_t less_or_zero(uint64_t a, uint64_t b)
{
    return a > b ? a - b : 0;
}

struct lum_totals_guard lum_totals_guard_of(const struct lum_totals *totals, const struct lum_totals *limits,
                                            const struct lum_document *doc, const struct lum_ops *ops)
{
    struct lum_totals_guard g = {*totals, *limits};
    const char **ids = lum_calloc(ops->n, sizeof *ids); /* each counts once, however many ops name it */
    size_t n = 0;
    for (size_t i = 0; ids && i < ops->n; i++)
        if (ops->ops[i].kind == LUM_OP_REMOVE || ops->ops[i].kind == LUM_OP_SET)
            ids[n++] = ops->ops[i].id;
    if (n)
        qsort(ids, n, sizeof *ids, by_text);
    for (size_t i = 0; i < n; i++) {
        if (i > 0 && strcmp(ids[i], ids[i - 1]) == 0)
            continue;
        struct lum_totals less = with_children(doc, ids[i]);
        g.totals =
            (struct lum_totals){less_or_zero(g.totals.triangles, less.triangles),
                                less_or_zero(g.totals.texels, less.texels), less_or_zero(g.totals.bytes, less.bytes)};
    }
    lum_free(ids);
    return g;
}

bool lum_totals_admit(void *guard, const struct lum_record *r, struct lum_proto_error *err)
{
    struct lum_totals_guard *g = guard;
    struct lum_totals more = lum_totals_of(r);
    struct lum_error e;
    g->totals = lum_totals_sum(g->totals, more);
    for (size_t k = 0; k < LUM_ARRAY_LEN(kinds); k++) {
        uint64_t total = amount(&kinds[k], &g->totals), limit = amount(&kinds[k], &g->limits);
        if (total > limit && amount(&kinds[k], &more) > 0 && refuse(&kinds[k], total, limit, r, &e))
            return lum_apply_error(&e, "", err);
    }
    return true;
}

void lum_totals_take_back(struct lum_totals *totals, const struct lum_changes *changes)
{
    for (size_t i = 0; i < changes->n; i++)
        *totals = lum_totals_sum(difference(*totals, lum_totals_of(changes->changes[i].after)),
                                 lum_totals_of(changes->changes[i].before));
}
