/* glTF 2.0: the container, the JSON, and the order of reading. */
#include "server/importer/gltf.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/importer/gltf_json.h"
#include "server/importer/gltf_ours.h"

#define GLB_MAGIC 0x46546c67u /* "glTF" */
#define GLB_JSON 0x4e4f534au  /* "JSON", a chunk's type */
#define GLB_BIN 0x004e4942u   /* "BIN" */

/* Extensions that a file may require. Those marked so change nothing that is shown here. */
static const char *const supported[] = {
    "EXT_lights_ies",
    "EXT_meshopt_compression",
    "KHR_animation_pointer", /* nothing moves */
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants", /* the default variant is shown */
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "KHR_xmp_json_ld", /* metadata */
};

/* ---- container ---- */

static uint32_t load_u32(const uint8_t *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

/* 12-byte header, then chunks { length, type, bytes }: JSON first, BIN second, others ignored (glTF 2.0, 4.4). */
static bool split_glb(struct lum_gltf *g, const struct lum_bytes *file, struct lum_bytes *ret_json)
{
    if (file->n < 20)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "the GLB file is cut short");
    if (load_u32(file->data + 4) != 2)
        return lum_gltf_fail(g, LUM_ERR_UNSUPPORTED, "GLB version %u is not supported", load_u32(file->data + 4));
    size_t total = load_u32(file->data + 8);
    if (total > file->n || total < 20)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "the GLB header says %zu bytes, the file has %zu", total, file->n);
    size_t at = 12;
    for (uint32_t chunk = 0; at + 8 <= total; chunk++) {
        size_t n = load_u32(file->data + at);
        uint32_t type = load_u32(file->data + at + 4);
        at += 8;
        if (n > total - at)
            return lum_gltf_fail(g, LUM_ERR_INVALID, "GLB chunk %u says %zu bytes where %zu are left", chunk, n,
                                 total - at);
        struct lum_bytes bytes = {file->data + at, n};
        if (chunk == 0 && type == GLB_JSON)
            *ret_json = bytes;
        else if (chunk == 0)
            return lum_gltf_fail(g, LUM_ERR_INVALID, "the first GLB chunk is not JSON");
        else if (chunk == 1 && type == GLB_BIN)
            g->glb_bin = bytes;
        at += n;
    }
    return true;
}

/* ---- JSON ---- */

/* cJSON recurses to its own limit of 1000 levels, which is safe; a file needs fewer than 32. */
static bool parse(struct lum_gltf *g, struct lum_bytes json)
{
    if (json.n >= 3 && memcmp(json.data, "\xef\xbb\xbf", 3) == 0) {
        json.data += 3;
        json.n -= 3;
    }
    size_t n = json.n;
    while (n && json.data[n - 1] <= ' ') /* GLB is padded */
        n--;
    if (!n || (json.data[n - 1] != '}' &&
               json.data[n - 1] != ']')) /* cJSON up to 1.7.17 reads on beyond a comma at the end (CVE-2023-53154) */
        return lum_gltf_fail(g, LUM_ERR_INVALID, "the JSON is damaged: it does not end with a bracket");
    const char *end = NULL;
    g->root = cJSON_ParseWithLengthOpts((const char *)json.data, json.n, &end, false);
    if (!g->root)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "the JSON is damaged near byte %zu",
                             end ? (size_t)(end - (const char *)json.data) : json.n);
    if (!cJSON_IsObject(g->root))
        return lum_gltf_fail(g, LUM_ERR_INVALID, "the JSON is no object");
    return true;
}

static bool check_asset(struct lum_gltf *g)
{
    const cJSON *asset = lum_gltf_object(g, g->root, "asset");
    const char *version = lum_gltf_string(g, asset, "version"), *min = lum_gltf_string(g, asset, "minVersion");
    if (!lum_gltf_ok(g))
        return false;
    if (!version)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "asset.version is missing");
    const char *generator = lum_gltf_string(g, asset, "generator");
    g->is_ours = generator && strncmp(generator, "lumend ", 7) == 0;
    if (strncmp(version, "2.", 2) != 0 || (min && strcmp(min, "2.0") != 0))
        return lum_gltf_fail(g, LUM_ERR_UNSUPPORTED, "glTF version %.16s is not supported, only 2.0",
                             min ? min : version);
    return true;
}

static bool is_supported(const char *name)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(supported); i++)
        if (strcmp(name, supported[i]) == 0)
            return true;
    return false;
}

static bool check_extensions(struct lum_gltf *g)
{
    const cJSON *required = lum_gltf_list(g, g->root, "extensionsRequired");
    for (const cJSON *e = required ? required->child : NULL; e; e = e->next) {
        if (!cJSON_IsString(e))
            return lum_gltf_fail(g, LUM_ERR_INVALID, "extensionsRequired must hold strings");
        if (!is_supported(e->valuestring))
            return lum_gltf_fail(g, LUM_ERR_UNSUPPORTED, "needs the extension %.60s, which is not supported",
                                 e->valuestring);
    }
    return lum_gltf_ok(g);
}

static bool index_array(struct lum_gltf *g, enum lum_gltf_kind kind, const cJSON *list)
{
    size_t n = list ? (size_t)cJSON_GetArraySize(list) : 0;
    if (n > LUM_LIMIT_RECORDS * 16u)
        return lum_gltf_fail(g, LUM_ERR_LIMIT, "%s has more than %u elements", list->string, LUM_LIMIT_RECORDS * 16u);
    const cJSON **items = lum_calloc(n + 1, sizeof *items);
    if (!items)
        return lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory");
    g->arrays[kind].items = items;
    for (const cJSON *o = list ? list->child : NULL; o; o = o->next) {
        if (!cJSON_IsObject(o))
            return lum_gltf_fail(g, LUM_ERR_INVALID, "%s must hold objects", list->string);
        items[g->arrays[kind].n++] = o;
    }
    return true;
}

static bool index_arrays(struct lum_gltf *g)
{
    static const char *const keys[LUM_GLTF_KIND_COUNT] = {
        [LUM_GLTF_ACCESSORS] = "accessors", [LUM_GLTF_BUFFERS] = "buffers", [LUM_GLTF_BUFFER_VIEWS] = "bufferViews",
        [LUM_GLTF_CAMERAS] = "cameras",     [LUM_GLTF_IMAGES] = "images",   [LUM_GLTF_MATERIALS] = "materials",
        [LUM_GLTF_MESHES] = "meshes",       [LUM_GLTF_NODES] = "nodes",     [LUM_GLTF_SAMPLERS] = "samplers",
        [LUM_GLTF_SCENES] = "scenes",       [LUM_GLTF_SKINS] = "skins",     [LUM_GLTF_TEXTURES] = "textures",
    };
    for (int kind = 0; kind < LUM_GLTF_KIND_COUNT; kind++) {
        const char *extension = kind == LUM_GLTF_LIGHTS ? "KHR_lights_punctual" : "EXT_lights_ies";
        const cJSON *list = keys[kind] ? lum_gltf_list(g, g->root, keys[kind])
                                       : lum_gltf_list(g, lum_gltf_extension(g, g->root, extension), "lights");
        if (!lum_gltf_ok(g) || !index_array(g, (enum lum_gltf_kind)kind, list))
            return false;
    }
    return true;
}

/* ---- life ---- */

static bool make_tables(struct lum_gltf *g)
{
    const struct lum_gltf_array *a = g->arrays;
    g->buffers = lum_calloc(a[LUM_GLTF_BUFFERS].n, sizeof *g->buffers);
    g->decoded = lum_calloc(a[LUM_GLTF_BUFFER_VIEWS].n, sizeof *g->decoded);
    g->images = lum_calloc(a[LUM_GLTF_IMAGES].n, sizeof *g->images);
    g->materials = lum_calloc((size_t)a[LUM_GLTF_MATERIALS].n + 1, sizeof *g->materials);
    g->meshes = lum_calloc(a[LUM_GLTF_MESHES].n, sizeof *g->meshes);
    g->n_shown = lum_calloc(a[LUM_GLTF_MESHES].n, sizeof *g->n_shown);
    g->nodes = lum_calloc(a[LUM_GLTF_NODES].n, sizeof *g->nodes);
    if (!g->buffers || !g->decoded || !g->images || !g->materials || !g->meshes || !g->n_shown || !g->nodes)
        return lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory");
    return true;
}

static void finish(struct lum_gltf *g)
{
    for (uint32_t i = 0; g->buffers && i < g->arrays[LUM_GLTF_BUFFERS].n; i++)
        lum_free(g->buffers[i].data);
    for (uint32_t i = 0; g->decoded && i < g->arrays[LUM_GLTF_BUFFER_VIEWS].n; i++)
        lum_free(g->decoded[i].data);
    for (uint32_t i = 0; g->meshes && i < g->arrays[LUM_GLTF_MESHES].n; i++)
        lum_gltf_mesh_finish(&g->meshes[i]);
    lum_gltf_profiles_finish(g);
    lum_free(g->buffers);
    lum_free(g->decoded);
    lum_free(g->images);
    lum_free(g->materials);
    lum_free(g->meshes);
    lum_free(g->n_shown);
    lum_free(g->nodes);
    for (int kind = 0; kind < LUM_GLTF_KIND_COUNT; kind++)
        lum_free(g->arrays[kind].items);
    cJSON_Delete(g->root);
}

static bool read_file(struct lum_gltf *g, const struct lum_bytes *file)
{
    struct lum_bytes json = *file;
    if (file->n >= 4 && load_u32(file->data) == GLB_MAGIC && !split_glb(g, file, &json))
        return false;
    return parse(g, json) && check_asset(g) && check_extensions(g) && index_arrays(g) && make_tables(g) &&
           lum_gltf_flatten_nodes(g) && lum_gltf_emit_loose(g, true) && lum_gltf_emit_nodes(g) &&
           lum_gltf_emit_loose(g, false) && lum_gltf_emit_settings(g);
}

enum lum_status lum_gltf_import(struct lum_importer *im, const struct lum_bytes *file, struct lum_error *err)
{
    struct lum_gltf g = {.im = im, .at_kind = LUM_GLTF_KIND_COUNT};
    bool ok = read_file(&g, file);
    if (ok && im->emit.n_ops == 0)
        lum_emit_warning(&im->emit, "the file shows nothing");
    finish(&g);
    return ok ? LUM_OK : lum_fail(err, g.error.status, "", "%s", g.error.text);
}
