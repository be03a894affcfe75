#include "server/export/glb.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

#define FLOAT 5126
#define UNSIGNED_INT 5125
#define ARRAY_BUFFER 34962
#define ELEMENT_ARRAY_BUFFER 34963
#define ALIGNMENT 4u /* of accessors of 32-bit numbers; the JSON's own, too (glTF 2.0, 4.4.3) */
#define EXTENSIONS_MAX 24u

struct chunk {
    const uint8_t *bytes;
    size_t n, offset;
    void (*free_bytes)(void *);
    uint64_t hash;
    enum use {
        PLAIN,
        INDICES,
        PLACES, /* with bounds */
        SCALARS,
        PAIRS,
        TRIPLES,
        QUADRUPLES
    } use;                   /* what is read in another way has bytes of its own: strides and bounds are of one use */
    uint32_t view, accessor; /* accessor UINT32_MAX: none yet */
};

struct lum_glb {
    struct lum_error error; /* status LUM_OK: none yet */
    cJSON *root, *lists[LUM_GLB_LIST_COUNT];
    uint32_t counts[LUM_GLB_LIST_COUNT];
    struct chunk *chunks;
    size_t n_chunks, cap_chunks;
    uint32_t *slots; /* of chunks by hash: number + 1; n_slots is a power of two, at most half full */
    size_t n_slots;
    uint64_t n_bytes, max_bytes; /* of the binary part; of the file */
    const char *uses[EXTENSIONS_MAX];
    size_t n_uses;
    char *json;
    size_t n_json;
};

struct lum_glb *lum_glb_create(uint64_t max_bytes)
{
    struct lum_glb *g = lum_calloc(1, sizeof *g);
    if (!g)
        return NULL;
    g->max_bytes = max_bytes;
    g->root = cJSON_CreateObject();
    bool ok = g->root != NULL;
    for (int i = 0; i < LUM_GLB_LIST_COUNT; i++)
        ok = (g->lists[i] = cJSON_CreateArray()) && ok;
    if (ok)
        return g;
    lum_glb_destroy(g);
    return NULL;
}

void lum_glb_destroy(struct lum_glb *g)
{
    if (!g)
        return;
    for (size_t i = 0; i < g->n_chunks; i++)
        if (g->chunks[i].free_bytes)
            g->chunks[i].free_bytes((void *)(uintptr_t)g->chunks[i].bytes);
    for (int i = 0; i < LUM_GLB_LIST_COUNT; i++)
        cJSON_Delete(g->lists[i]);
    cJSON_Delete(g->root);
    free(g->chunks);
    free(g->json);
    lum_free(g->slots);
    lum_free(g);
}

bool lum_glb_ok(const struct lum_glb *g)
{
    return g->error.status == LUM_OK;
}

void lum_glb_fail(struct lum_glb *g, const struct lum_error *err)
{
    if (lum_glb_ok(g))
        g->error = *err;
}

void lum_glb_fail_memory(struct lum_glb *g)
{
    struct lum_error err;
    (void)lum_fail(&err, LUM_ERR_NOMEM, "", "no memory for the glTF file");
    lum_glb_fail(g, &err);
}

/* ---- JSON ---- */

uint32_t lum_glb_add(struct lum_glb *g, enum lum_glb_list list, struct cJSON *item)
{
    if (!lum_glb_ok(g)) {
        cJSON_Delete(item);
        return 0;
    }
    if (!lum_json_add(g->lists[list], NULL, item)) {
        lum_glb_fail_memory(g);
        return 0;
    }
    return g->counts[list]++;
}

void lum_glb_uses(struct lum_glb *g, const char *name)
{
    for (size_t i = 0; i < g->n_uses; i++)
        if (strcmp(g->uses[i], name) == 0)
            return;
    if (g->n_uses < EXTENSIONS_MAX)
        g->uses[g->n_uses++] = name;
}

static cJSON *object_in(struct lum_glb *g, cJSON *o, const char *name)
{
    cJSON *in = cJSON_GetObjectItemCaseSensitive(o, name);
    if (in)
        return in;
    in = cJSON_CreateObject();
    if (lum_json_add(o, name, in))
        return in;
    lum_glb_fail_memory(g);
    return NULL;
}

struct cJSON *lum_glb_extension(struct lum_glb *g, struct cJSON *o, const char *name)
{
    cJSON *all = o ? object_in(g, o, "extensions") : NULL;
    lum_glb_uses(g, name);
    return all ? object_in(g, all, name) : NULL;
}

/* ---- bytes ---- */

/* FNV-1a, eight bytes at a time: which are compared then. */
static uint64_t hash_of(const uint8_t *bytes, size_t n)
{
    uint64_t h = 0xcbf29ce484222325u ^ n, word;
    size_t i = 0;
    for (; i + 8 <= n; i += 8) {
        memcpy(&word, bytes + i, 8);
        h = (h ^ word) * 0x100000001b3u;
        h ^= h >> 29;
    }
    for (; i < n; i++)
        h = (h ^ bytes[i]) * 0x100000001b3u;
    return h;
}

/* Of the same bytes for the same use; what: NULL: the next that is free. */
static uint32_t *slot_of(const struct lum_glb *g, uint64_t hash, const struct chunk *what)
{
    size_t at = hash & (g->n_slots - 1);
    for (; g->slots[at]; at = (at + 1) & (g->n_slots - 1)) {
        const struct chunk *c = &g->chunks[g->slots[at] - 1];
        if (what && c->hash == hash && c->n == what->n && c->use == what->use &&
            memcmp(c->bytes, what->bytes, c->n) == 0)
            break;
    }
    return &g->slots[at];
}

static bool grow(struct lum_glb *g)
{
    if (g->n_chunks == g->cap_chunks) {
        size_t cap = g->cap_chunks ? 2 * g->cap_chunks : 64;
        struct chunk *chunks = realloc(g->chunks, cap * sizeof *chunks);
        if (!chunks)
            return false;
        g->chunks = chunks;
        g->cap_chunks = cap;
    }
    if (2 * (g->n_chunks + 1) <= g->n_slots)
        return true;
    size_t n_slots = g->n_slots ? 2 * g->n_slots : 256;
    uint32_t *slots = lum_calloc(n_slots, sizeof *slots);
    if (!slots)
        return false;
    lum_free(g->slots);
    g->slots = slots;
    g->n_slots = n_slots;
    for (size_t i = 0; i < g->n_chunks; i++)
        *slot_of(g, g->chunks[i].hash, NULL) = (uint32_t)i + 1;
    return true;
}

static bool fits(struct lum_glb *g, size_t n)
{
    if (n <= g->max_bytes && g->n_bytes <= g->max_bytes - n)
        return true;
    struct lum_error err;
    (void)lum_fail(&err, LUM_ERR_LIMIT, "", "the glTF file would be larger than %llu MiB",
                   (unsigned long long)(g->max_bytes >> 20));
    lum_glb_fail(g, &err);
    return false;
}

static cJSON *view_json(const struct chunk *c)
{
    cJSON *o = cJSON_CreateObject();
    bool ok =
        lum_json_add_number(o, "buffer", 0) && lum_json_add_number(o, "byteLength", (double)c->n) &&
        (!c->offset || lum_json_add_number(o, "byteOffset", (double)c->offset)) &&
        (c->use == PLAIN || lum_json_add_number(o, "target", c->use == INDICES ? ELEMENT_ARRAY_BUFFER : ARRAY_BUFFER));
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

static uint32_t add_chunk(struct lum_glb *g, const struct chunk *given)
{
    if (!lum_glb_ok(g) || !fits(g, given->n + ALIGNMENT))
        return UINT32_MAX;
    if (!grow(g)) {
        lum_glb_fail_memory(g);
        return UINT32_MAX;
    }
    uint32_t *slot = slot_of(g, given->hash, given);
    if (*slot)
        return *slot - 1;
    struct chunk *c = &g->chunks[g->n_chunks];
    *c = *given;
    c->offset = (size_t)g->n_bytes;
    c->accessor = UINT32_MAX;
    c->view = lum_glb_add(g, LUM_GLB_BUFFER_VIEWS, view_json(c));
    if (!lum_glb_ok(g))
        return UINT32_MAX;
    g->n_bytes += (c->n + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    *slot = (uint32_t)++g->n_chunks;
    return *slot - 1;
}

/* NULL: failed. */
static struct chunk *share(struct lum_glb *g, const void *bytes, size_t n, enum use use, void (*free_bytes)(void *))
{
    struct chunk c = {.bytes = bytes, .n = n, .free_bytes = free_bytes, .hash = hash_of(bytes, n), .use = use};
    uint32_t at = add_chunk(g, &c);
    bool taken = at != UINT32_MAX && g->chunks[at].bytes == c.bytes;
    if (free_bytes && !taken)
        free_bytes((void *)(uintptr_t)bytes);
    return at == UINT32_MAX ? NULL : &g->chunks[at];
}

uint32_t lum_glb_bytes(struct lum_glb *g, const void *bytes, size_t n, void (*free_bytes)(void *))
{
    const struct chunk *c = share(g, bytes, n, PLAIN, free_bytes);
    return c ? c->view : 0;
}

/* ---- accessors ---- */

static bool add_bounds(cJSON *o, const float *values, size_t n, uint32_t n_components)
{
    cJSON *lo = cJSON_CreateArray(), *hi = cJSON_CreateArray();
    bool ok = lo && hi;
    for (uint32_t c = 0; c < n_components && ok; c++) {
        float least = INFINITY, most = -INFINITY;
        for (size_t i = c; i < n; i += n_components) {
            least = fminf(least, values[i]);
            most = fmaxf(most, values[i]);
        }
        ok = lum_json_add(lo, NULL, cJSON_CreateNumber((double)least)) &&
             lum_json_add(hi, NULL, cJSON_CreateNumber((double)most));
    }
    bool added = lum_json_add(o, "min", lo);
    return lum_json_add(o, "max", hi) && added && ok;
}

static uint32_t add_accessor(struct lum_glb *g, struct chunk *c, uint32_t n_components)
{
    static const char *const types[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    size_t n = c->n / sizeof(float);
    cJSON *o = cJSON_CreateObject();
    bool ok = lum_json_add_number(o, "bufferView", c->view) &&
              lum_json_add_number(o, "componentType", c->use == INDICES ? UNSIGNED_INT : FLOAT) &&
              lum_json_add_number(o, "count", (double)(n / n_components)) &&
              lum_json_add_string(o, "type", types[n_components]);
    if (ok && c->use == PLACES)
        ok = add_bounds(o, (const float *)(const void *)c->bytes, n, n_components);
    if (!ok)
        lum_glb_fail_memory(g);
    return c->accessor = lum_glb_add(g, LUM_GLB_ACCESSORS, o);
}

uint32_t lum_glb_floats(struct lum_glb *g, const float *values, size_t n, uint32_t n_components, bool bounds,
                        void (*free_values)(void *))
{
    enum use use = bounds ? PLACES : (enum use)(SCALARS + n_components - 1);
    struct chunk *c = share(g, values, n * sizeof *values, use, free_values);
    return !c ? 0 : c->accessor != UINT32_MAX ? c->accessor : add_accessor(g, c, n_components);
}

uint32_t lum_glb_indices(struct lum_glb *g, const uint32_t *values, size_t n, void (*free_values)(void *))
{
    struct chunk *c = share(g, values, n * sizeof *values, INDICES, free_values);
    return !c ? 0 : c->accessor != UINT32_MAX ? c->accessor : add_accessor(g, c, 1);
}

/* ---- the file ---- */

/* Nodes that are children stand behind their parent: what is nobody's child is of the scene. */
static cJSON *scene_json(const struct lum_glb *g, cJSON *extras)
{
    cJSON *o = cJSON_CreateObject(), *nodes = cJSON_CreateArray();
    uint32_t i = 0, child = UINT32_MAX;
    bool ok = o && nodes;
    for (const cJSON *n = g->lists[LUM_GLB_NODES]->child; n && ok; n = n->next, i++) {
        const cJSON *children = cJSON_GetObjectItemCaseSensitive(n, "children");
        if (i != child)
            ok = lum_json_add(nodes, NULL, cJSON_CreateNumber(i));
        child = children ? (uint32_t)children->child->valuedouble : child;
    }
    ok = (!extras || lum_json_add(o, "extras", extras)) && ok;
    if (i == 0)
        cJSON_Delete(nodes);
    else
        ok = lum_json_add(o, "nodes", nodes) && ok;
    if (ok)
        return o;
    cJSON_Delete(o);
    return NULL;
}

static bool add_list(struct lum_glb *g, cJSON *to, const char *key, enum lum_glb_list list)
{
    cJSON *items = g->lists[list];
    if (g->counts[list] == 0)
        return true;
    g->lists[list] = NULL;
    return lum_json_add(to, key, items);
}

static bool add_lists(struct lum_glb *g)
{
    static const char *const keys[LUM_GLB_LIST_COUNT] = {
        [LUM_GLB_ACCESSORS] = "accessors", [LUM_GLB_BUFFER_VIEWS] = "bufferViews", [LUM_GLB_CAMERAS] = "cameras",
        [LUM_GLB_IMAGES] = "images",       [LUM_GLB_MATERIALS] = "materials",      [LUM_GLB_MESHES] = "meshes",
        [LUM_GLB_NODES] = "nodes",         [LUM_GLB_SAMPLERS] = "samplers",        [LUM_GLB_TEXTURES] = "textures",
    };
    for (int i = 0; i < LUM_GLB_LIST_COUNT; i++) {
        const char *extension = i == LUM_GLB_LIGHTS ? "KHR_lights_punctual" : "EXT_lights_ies";
        bool any = g->counts[i] > 0;
        cJSON *to = keys[i] || !any ? g->root : lum_glb_extension(g, g->root, extension);
        if (!to || !add_list(g, to, keys[i] ? keys[i] : "lights", (enum lum_glb_list)i))
            return false;
    }
    return true;
}

static bool add_head(struct lum_glb *g)
{
    cJSON *asset = cJSON_CreateObject(), *used = cJSON_CreateArray(), *buffer = cJSON_CreateObject(),
          *buffers = cJSON_CreateArray();
    bool ok = lum_json_add_string(asset, "version", "2.0") &&
              lum_json_add_string(asset, "generator", "lumend " LUMEND_VERSION);
    ok = lum_json_add(g->root, "asset", asset) && ok;
    for (size_t i = 0; i < g->n_uses; i++)
        ok = lum_json_add(used, NULL, cJSON_CreateString(g->uses[i])) && ok;
    if (g->n_uses)
        ok = lum_json_add(g->root, "extensionsUsed", used) && ok;
    else
        cJSON_Delete(used);
    ok = lum_json_add_number(buffer, "byteLength", (double)g->n_bytes) && ok;
    ok = lum_json_add(buffers, NULL, buffer) && ok;
    if (g->n_bytes)
        return lum_json_add(g->root, "buffers", buffers) && ok;
    cJSON_Delete(buffers);
    return ok;
}

enum lum_status lum_glb_finish(struct lum_glb *g, struct cJSON *scene_extras, struct lum_error *err)
{
    if (!lum_glb_ok(g)) { /* lists may be half made */
        cJSON_Delete(scene_extras);
        *err = g->error;
        return err->status;
    }
    cJSON *scenes = cJSON_CreateArray();
    bool ok = lum_json_add(scenes, NULL, scene_json(g, scene_extras));
    ok = lum_json_add(g->root, "scenes", scenes) && ok;
    ok = ok && lum_json_add_number(g->root, "scene", 0) && add_lists(g) && add_head(g);
    if (ok && lum_glb_ok(g))
        g->json = lum_json_print(g->root, &g->n_json);
    if (!g->json)
        lum_glb_fail_memory(g);
    else
        (void)fits(g, g->n_json + 32);
    if (lum_glb_ok(g))
        return LUM_OK;
    *err = g->error;
    return err->status;
}

static size_t padded(size_t n)
{
    return (n + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

uint64_t lum_glb_size(const struct lum_glb *g)
{
    return 12 + 8 + padded(g->n_json) + (g->n_bytes ? 8 + g->n_bytes : 0);
}

struct sink {
    uint8_t *to; /* the next byte; NULL: file */
    FILE *file;
    bool failed;
};

static void put(struct sink *s, const void *bytes, size_t n)
{
    if (s->to) {
        memcpy(s->to, bytes, n);
        s->to += n;
    } else {
        s->failed = s->failed || fwrite(bytes, 1, n, s->file) != n;
    }
}

static void put_u32(struct sink *s, uint64_t v)
{
    const uint8_t b[4] = {(uint8_t)v, (uint8_t)(v >> 8), (uint8_t)(v >> 16), (uint8_t)(v >> 24)};
    put(s, b, sizeof b);
}

static void put_padding(struct sink *s, size_t n, char with)
{
    const char pad[ALIGNMENT] = {with, with, with, with};
    put(s, pad, padded(n) - n);
}

static void put_all(const struct lum_glb *g, struct sink *s)
{
    put(s, "glTF", 4);
    put_u32(s, 2);
    put_u32(s, lum_glb_size(g));
    put_u32(s, padded(g->n_json));
    put(s, "JSON", 4);
    put(s, g->json, g->n_json);
    put_padding(s, g->n_json, ' ');
    if (!g->n_bytes)
        return;
    put_u32(s, g->n_bytes);
    put(s, "BIN", 4);
    for (size_t i = 0; i < g->n_chunks; i++) {
        put(s, g->chunks[i].bytes, g->chunks[i].n);
        put_padding(s, g->chunks[i].n, 0);
    }
}

enum lum_status lum_glb_write(const struct lum_glb *g, FILE *out, struct lum_error *err)
{
    struct sink s = {.file = out};
    put_all(g, &s);
    return s.failed ? lum_fail(err, LUM_ERR_IO, "", "cannot be written: %s", strerror(errno)) : LUM_OK;
}

void lum_glb_copy(const struct lum_glb *g, uint8_t *to)
{
    struct sink s = {.to = to};
    put_all(g, &s);
}
