#define _GNU_SOURCE
#include "server/importer/emit.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "protocol/base/limits.h"
#include "server/import/wire.h"

/* ---- text of an op ---- */

static void op_append(struct lum_op_text *o, const char *fmt, ...) LUM_PRINTF(2, 3);
static void op_append(struct lum_op_text *o, const char *fmt, ...)
{
    if (o->failed)
        return;
    va_list args;
    va_start(args, fmt);
    int n = vsnprintf(o->text + o->n, sizeof o->text - o->n, fmt, args);
    va_end(args);
    if (n < 0 || (size_t)n >= sizeof o->text - o->n)
        o->failed = true;
    else
        o->n += (size_t)n;
}

static void op_key(struct lum_op_text *o, const char *key)
{
    bool first = o->n == 0 || o->text[o->n - 1] == '{';
    op_append(o, "%s\"%s\":", first ? "" : ",", key);
}

static void op_value(struct lum_op_text *o, double value)
{
    if (!isfinite(value))
        o->failed = true;
    op_append(o, "%.17g", value);
}

void lum_op_begin(struct lum_op_text *o, const char *type, const char *id)
{
    o->n = 0;
    o->failed = false;
    op_append(o, "{\"op\":\"add\",\"type\":\"%s\",\"id\":\"%s\"", type, id);
}

void lum_op_string(struct lum_op_text *o, const char *key, const char *value)
{
    op_key(o, key);
    op_append(o, "\"%s\"", value);
}

void lum_op_number(struct lum_op_text *o, const char *key, double value)
{
    op_key(o, key);
    op_value(o, value);
}

void lum_op_numbers(struct lum_op_text *o, const char *key, const double *values, size_t n)
{
    op_key(o, key);
    op_append(o, "[");
    for (size_t i = 0; i < n; i++) {
        if (i)
            op_append(o, ",");
        op_value(o, values[i]);
    }
    op_append(o, "]");
}

bool lum_op_transform_fits(const struct lum_affined *local_to_world)
{
    struct lum_affined inverse;
    for (int i = 0; i < 12; i++)
        if (!(fabs(local_to_world->m[i / 4][i % 4]) <= LUM_LIMIT_COORD_M))
            return false;
    return lum_affined_invert(local_to_world, &inverse);
}

void lum_op_bool(struct lum_op_text *o, const char *key, bool value)
{
    op_key(o, key);
    op_append(o, value ? "true" : "false");
}

void lum_op_object(struct lum_op_text *o, const char *key)
{
    op_key(o, key);
    op_append(o, "{");
}

void lum_op_close(struct lum_op_text *o)
{
    op_append(o, "}");
}

/* ---- chunks ---- */

static void write_all(struct lum_emit *e, const void *bytes, size_t n)
{
    const uint8_t *p = bytes;
    e->n_bytes += n;
    while (n && e->fd >= 0 && !e->broken) {
        ssize_t done = write(e->fd, p, n);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0) {
            e->broken = true;
            return;
        }
        p += done;
        n -= (size_t)done;
    }
}

static void write_chunk(struct lum_emit *e, enum lum_import_chunk kind, const void *bytes, size_t n)
{
    if (e->full || n > UINT32_MAX || e->n_bytes + n + 8 > LUM_LIMIT_IMPORT_OUTPUT_BYTES) {
        e->full = true;
        return;
    }
    uint32_t head[2] = {(uint32_t)kind, (uint32_t)n};
    write_all(e, head, sizeof head);
    write_all(e, bytes, n);
}

uint32_t lum_emit_bulk(struct lum_emit *e, const void *bytes, size_t n_bytes)
{
    write_chunk(e, LUM_CHUNK_BLOB, bytes, n_bytes);
    return e->n_blobs++;
}

void lum_emit_blob(struct lum_emit *e, struct lum_op_text *o, const char *key, const void *bytes, size_t n_bytes)
{
    op_key(o, key);
    op_append(o, "{\"blob\":%u}", (unsigned)lum_emit_bulk(e, bytes, n_bytes));
}

void lum_emit_doubles(struct lum_emit *e, struct lum_op_text *o, const char *key, const void *bytes, size_t n_bytes)
{
    op_key(o, key);
    op_append(o, "{\"blob64\":%u}", (unsigned)lum_emit_bulk(e, bytes, n_bytes));
}

enum lum_status lum_emit_op(struct lum_emit *e, struct lum_op_text *o, struct lum_error *err)
{
    lum_op_close(o);
    if (o->failed)
        return lum_fail(err, LUM_ERR_INVALID, "op", "an op could not be written: %.60s...", o->text);
    return lum_emit_text(e, o->text, o->n, err);
}

enum lum_status lum_emit_text(struct lum_emit *e, const char *text, size_t n, struct lum_error *err)
{
    if (e->n_ops >= LUM_LIMIT_RECORDS)
        return lum_fail(err, LUM_ERR_LIMIT, "ops", "has more than %u parts", LUM_LIMIT_RECORDS);
    write_chunk(e, LUM_CHUNK_OP, text, n);
    e->n_ops++;
    e->n_blobs = 0;
    if (e->full)
        return lum_fail(err, LUM_ERR_LIMIT, "output", "holds more than %llu MiB of decoded data",
                        (unsigned long long)(LUM_LIMIT_IMPORT_OUTPUT_BYTES >> 20));
    if (e->broken)
        return lum_fail(err, LUM_ERR_IO, "output", "nobody reads the output");
    return LUM_OK;
}

void lum_emit_settings(struct lum_emit *e, const char *text, size_t n)
{
    write_chunk(e, LUM_CHUNK_SETTINGS, text, n);
}

void lum_emit_progress(struct lum_emit *e, const char *stage, double fraction)
{
    char text[96];
    int n = snprintf(text, sizeof text, "{\"stage\":\"%s\",\"fraction\":%.3f}", stage, fraction);
    write_chunk(e, LUM_CHUNK_PROGRESS, text, (size_t)n);
}

void lum_emit_warning(struct lum_emit *e, const char *fmt, ...)
{
    if (e->n_warnings++ >= LUM_EMIT_WARNINGS)
        return;
    char text[256];
    va_list args;
    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    write_chunk(e, LUM_CHUNK_WARNING, text, strlen(text));
}

void lum_emit_done(struct lum_emit *e)
{
    if (e->n_warnings > LUM_EMIT_WARNINGS) {
        uint32_t more = e->n_warnings - LUM_EMIT_WARNINGS;
        e->n_warnings = 0;
        lum_emit_warning(e, "and %u more warnings", more);
    }
    write_chunk(e, LUM_CHUNK_DONE, NULL, 0);
}

void lum_emit_error(struct lum_emit *e, const char *code, const char *text)
{
    char safe[512];
    size_t n = 0;
    for (const char *p = text; *p && n + 8 < sizeof safe; p++) {
        unsigned char c = (unsigned char)*p;
        if (c == '"' || c == '\\')
            safe[n++] = '\\';
        safe[n++] = c < 0x20 || c > 0x7e ? '?' : (char)c; /* names in files are not always UTF-8 */
    }
    safe[n] = 0;
    char json[640];
    int len = snprintf(json, sizeof json, "{\"code\":\"%s\",\"text\":\"%s\"}", code, safe);
    e->full = false; /* the one chunk that goes out over the limit */
    e->n_bytes = 0;
    write_chunk(e, LUM_CHUNK_ERROR, json, (size_t)len);
}
