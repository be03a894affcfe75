/* Buffers, data URIs, buffer views, and EXT_meshopt_compression. */
#include <meshoptimizer.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/importer/gltf.h"
#include "server/importer/gltf_json.h"

/* ---- URIs ---- */

static int base64_value(char c)
{
    if (c >= 'A' && c <= 'Z')
        return c - 'A';
    if (c >= 'a' && c <= 'z')
        return c - 'a' + 26;
    if (c >= '0' && c <= '9')
        return c - '0' + 52;
    return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

static enum lum_status decode_base64(const char *text, struct lum_bytes *ret_bytes, struct lum_error *err)
{
    size_t n = strlen(text);
    while (n && text[n - 1] == '=')
        n--;
    uint8_t *data = lum_calloc(n / 4 * 3 + 3, 1);
    if (!data)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for a data URI");
    uint32_t bits = 0;
    size_t done = 0;
    for (size_t i = 0; i < n; i++) {
        int v = base64_value(text[i]);
        if (v < 0) {
            lum_free(data);
            return lum_fail(err, LUM_ERR_INVALID, "", "the data URI is not base64 at character %zu", i);
        }
        bits = bits << 6 | (uint32_t)v;
        if (i % 4)
            data[done++] = (uint8_t)(bits >> (6 - 2 * (i % 4)));
    }
    *ret_bytes = (struct lum_bytes){data, done};
    return LUM_OK;
}

static int hex_value(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

/* "a%20b.bin" to "a b.bin". False when the result is empty, too long or holds a 0. */
static bool percent_decode(const char *uri, char *ret_name, size_t cap)
{
    size_t n = 0;
    for (const char *p = uri; *p; p++) {
        if (n + 1 >= cap)
            return false;
        if (*p == '%' && hex_value(p[1]) >= 0 && hex_value(p[2]) >= 0) {
            ret_name[n++] = (char)(hex_value(p[1]) * 16 + hex_value(p[2]));
            p += 2;
        } else {
            ret_name[n++] = *p;
        }
    }
    ret_name[n] = 0;
    return n > 0 && strlen(ret_name) == n;
}

enum lum_status lum_gltf_load_uri(struct lum_gltf *g, const char *uri, struct lum_bytes *ret_bytes,
                                  struct lum_error *err)
{
    if (strncmp(uri, "data:", 5) == 0) {
        const char *comma = strchr(uri, ',');
        if (!comma || comma - uri < 7 || strncmp(comma - 7, ";base64", 7) != 0)
            return lum_fail(err, LUM_ERR_UNSUPPORTED, "", "only base64 data URIs are supported");
        return decode_base64(comma + 1, ret_bytes, err);
    }
    char name[LUM_FILE_NAME_BYTES + 1];
    if (!percent_decode(uri, name, sizeof name))
        return lum_fail(err, LUM_ERR_INVALID, "", "the file name in the URI is empty, too long or holds a 0");
    return lum_files_read(&g->im->files, name, 0, ret_bytes, err);
}

/* ---- buffers ---- */

static bool load_buffer(struct lum_gltf *g, uint32_t index, struct lum_bytes *ret_bytes)
{
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_BUFFERS, index);
    lum_gltf_at(g, LUM_GLTF_BUFFERS, index);
    uint64_t length = lum_gltf_uint(g, o, "byteLength", 0, LUM_LIMIT_IMPORT_FILE_BYTES);
    const char *uri = lum_gltf_string(g, o, "uri");
    struct lum_bytes bytes = {0};
    if (!lum_gltf_ok(g))
        return false;
    if (uri) {
        struct lum_error err;
        if (lum_gltf_load_uri(g, uri, &bytes, &err))
            return lum_gltf_fail(g, err.status, "%s", err.text);
        g->buffers[index] = bytes;
    } else if (index == 0 && g->glb_bin.data) {
        bytes = g->glb_bin;
    } else {
        return lum_gltf_fail(g, LUM_ERR_INVALID, "has no data");
    }
    if (length > bytes.n)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "byteLength is %llu, but there are only %zu bytes",
                             (unsigned long long)length, bytes.n);
    bytes.n = (size_t)length;
    if (uri)
        g->buffers[index].n = bytes.n;
    *ret_bytes = bytes;
    return true;
}

static bool find_buffer(struct lum_gltf *g, uint32_t index, struct lum_bytes *ret_bytes)
{
    enum lum_gltf_kind kind = g->at_kind;
    uint32_t at = g->at_index;
    if (index == LUM_GLTF_NONE)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "has no buffer");
    if (g->buffers[index].data) {
        *ret_bytes = g->buffers[index];
        return true;
    }
    bool ok = load_buffer(g, index, ret_bytes);
    lum_gltf_at(g, kind, at);
    return ok;
}

/* The bytes that "buffer", "byteOffset" and "byteLength" of o name; o is a buffer view or its meshopt extension. */
static bool find_span(struct lum_gltf *g, const cJSON *o, struct lum_gltf_view *ret_view)
{
    uint32_t buffer = lum_gltf_index(g, o, "buffer", LUM_GLTF_BUFFERS);
    uint64_t offset = lum_gltf_uint(g, o, "byteOffset", 0, LUM_LIMIT_IMPORT_FILE_BYTES);
    uint64_t length = lum_gltf_uint(g, o, "byteLength", 0, LUM_LIMIT_IMPORT_FILE_BYTES);
    struct lum_bytes bytes;
    if (!lum_gltf_ok(g) || !find_buffer(g, buffer, &bytes))
        return false;
    if (offset > bytes.n || length > bytes.n - offset)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "bytes %llu to %llu lie outside the buffer of %zu bytes",
                             (unsigned long long)offset, (unsigned long long)(offset + length), bytes.n);
    *ret_view = (struct lum_gltf_view){bytes.data + offset, (size_t)length, 0};
    return true;
}

/* ---- EXT_meshopt_compression ---- */

struct meshopt_params {
    size_t count, stride;
    const char *mode, *filter;
};

static bool meshopt_shape_ok(const struct meshopt_params *p)
{
    bool filtered = strcmp(p->filter, "NONE") != 0;
    if (strcmp(p->mode, "ATTRIBUTES") == 0) {
        if (p->stride == 0 || p->stride > 256 || p->stride % 4)
            return false;
        if (strcmp(p->filter, "OCTAHEDRAL") == 0)
            return p->stride == 4 || p->stride == 8;
        if (strcmp(p->filter, "QUATERNION") == 0)
            return p->stride == 8;
        return !filtered || strcmp(p->filter, "EXPONENTIAL") == 0;
    }
    if (filtered || (p->stride != 2 && p->stride != 4))
        return false;
    return strcmp(p->mode, "INDICES") == 0 || (strcmp(p->mode, "TRIANGLES") == 0 && p->count % 3 == 0);
}

static int meshopt_unpack(const struct meshopt_params *p, const struct lum_gltf_view *from, uint8_t *to)
{
    if (strcmp(p->mode, "TRIANGLES") == 0)
        return meshopt_decodeIndexBuffer(to, p->count, p->stride, from->data, from->n);
    if (strcmp(p->mode, "INDICES") == 0)
        return meshopt_decodeIndexSequence(to, p->count, p->stride, from->data, from->n);
    int code = meshopt_decodeVertexBuffer(to, p->count, p->stride, from->data, from->n);
    if (code)
        return code;
    if (strcmp(p->filter, "OCTAHEDRAL") == 0)
        meshopt_decodeFilterOct(to, p->count, p->stride);
    else if (strcmp(p->filter, "QUATERNION") == 0)
        meshopt_decodeFilterQuat(to, p->count, p->stride);
    else if (strcmp(p->filter, "EXPONENTIAL") == 0)
        meshopt_decodeFilterExp(to, p->count, p->stride);
    return 0;
}

static bool decode_meshopt(struct lum_gltf *g, uint32_t index, const cJSON *ext)
{
    struct meshopt_params p = {
        .count = (size_t)lum_gltf_uint(g, ext, "count", 0, LUM_LIMIT_VERTICES * 3ull),
        .stride = (size_t)lum_gltf_uint(g, ext, "byteStride", 0, 256),
        .mode = lum_gltf_string(g, ext, "mode"),
        .filter = lum_gltf_string(g, ext, "filter"),
    };
    struct lum_gltf_view packed;
    if (!lum_gltf_ok(g) || !find_span(g, ext, &packed))
        return false;
    if (!p.mode)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "EXT_meshopt_compression has no mode");
    if (!p.filter)
        p.filter = "NONE";
    if (!meshopt_shape_ok(&p))
        return lum_gltf_fail(g, LUM_ERR_INVALID,
                             "EXT_meshopt_compression: mode %.16s, filter %.16s and stride %zu do not fit", p.mode,
                             p.filter, p.stride);
    /* the coding spends at least a byte on 16 elements of 4 bytes: a bomb is seen before memory is taken */
    if (p.count / 16 > packed.n)
        return lum_gltf_fail(g, LUM_ERR_INVALID, "EXT_meshopt_compression: %zu bytes cannot hold %zu elements",
                             packed.n, p.count);
    struct lum_bytes out = {lum_calloc(p.count, p.stride), p.count * p.stride};
    if (!out.data)
        return lum_gltf_fail(g, LUM_ERR_NOMEM, "out of memory for %zu bytes", out.n);
    if (meshopt_unpack(&p, &packed, out.data)) {
        lum_free(out.data);
        return lum_gltf_fail(g, LUM_ERR_INVALID, "EXT_meshopt_compression: the data is damaged");
    }
    g->decoded[index] = out;
    return true;
}

/* ---- views ---- */

bool lum_gltf_view(struct lum_gltf *g, uint32_t index, struct lum_gltf_view *ret_view)
{
    const cJSON *o = lum_gltf_item(g, LUM_GLTF_BUFFER_VIEWS, index);
    enum lum_gltf_kind kind = g->at_kind;
    uint32_t at = g->at_index;
    lum_gltf_at(g, LUM_GLTF_BUFFER_VIEWS, index);
    const cJSON *ext = lum_gltf_extension(g, o, "EXT_meshopt_compression");
    size_t stride = (size_t)lum_gltf_uint(g, o, "byteStride", 0, 252);
    struct lum_gltf_view view = {0};
    if (!lum_gltf_ok(g))
        return false;
    if (ext) {
        if (!g->decoded[index].data && !decode_meshopt(g, index, ext))
            return false;
        view = (struct lum_gltf_view){g->decoded[index].data, g->decoded[index].n, 0};
    } else if (!find_span(g, o, &view)) {
        return false;
    }
    view.stride = stride;
    lum_gltf_at(g, kind, at);
    *ret_view = view;
    return true;
}

/* ---- either ---- */

bool lum_gltf_bytes(struct lum_gltf *g, const cJSON *o, struct lum_bytes *ret_bytes, bool *ret_owned,
                    struct lum_error *err)
{
    const char *uri = lum_gltf_string(g, o, "uri");
    uint32_t view = lum_gltf_index(g, o, "bufferView", LUM_GLTF_BUFFER_VIEWS);
    if (!lum_gltf_ok(g))
        return false;
    if (uri) {
        *ret_owned = true;
        return !lum_gltf_load_uri(g, uri, ret_bytes, err);
    }
    struct lum_gltf_view v;
    if (view == LUM_GLTF_NONE) {
        lum_fail(err, LUM_ERR_INVALID, "", "has neither uri nor bufferView");
        return false;
    }
    if (!lum_gltf_view(g, view, &v))
        return false;
    *ret_bytes = (struct lum_bytes){(uint8_t *)v.data, v.n};
    *ret_owned = false;
    return true;
}
