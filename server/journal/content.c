#define _GNU_SOURCE
#include "server/journal/content.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>
#include <openssl/evp.h>

#include "protocol/json/json.h"
#include "protocol/op/op.h"

bool lum_sha_is(const char *text)
{
    return strspn(text, "0123456789abcdef") == LUM_SHA_BYTES && text[LUM_SHA_BYTES] == '\0';
}

void lum_record_list_finish(struct lum_record_list *r)
{
    for (size_t i = 0; i < r->n; i++)
        lum_record_unref(r->records[i]);
    free(r->records);
    *r = (struct lum_record_list){0};
}

void lum_damage(const struct lum_damage_sink *sink, const char *fmt, ...)
{
    char text[320];
    va_list args;
    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    sink->tell(sink->user, text);
}

void lum_damage_no_memory(const struct lum_damage_sink *sink)
{
    struct lum_error err;
    lum_fail(&err, LUM_ERR_NOMEM, "state", "no memory for the scene that the state holds");
    lum_damage_unread(sink, &err);
}

void lum_damage_unread(const struct lum_damage_sink *sink, const struct lum_error *err)
{
    if (sink->unread && !sink->unread->status && (err->status == LUM_ERR_NOMEM || err->status == LUM_ERR_IO))
        *sink->unread = *err;
}

void lum_damage_note(const struct lum_damage_sink *sink, const struct lum_proto_error *err)
{
    if (err->code == LUM_PROTO_INTERNAL) /* lum_proto_fail_memory */
        lum_damage_no_memory(sink);
}

/* ---- one record ---- */

struct cJSON *lum_stored_record(const struct lum_record *r, struct lum_blobs_out *ret_blobs)
{
    cJSON *json = cJSON_CreateObject();
    bool ok = lum_json_add(json, "op", lum_record_to_blobs(r, ret_blobs));
    if (ok && r->origin[0])
        ok = lum_json_add_string(json, "origin", r->origin);
    if (ok && r->type == LUM_RECORD_IMAGE && r->image.pixels && r->image.asset[0])
        ok = lum_json_add_string(json, "asset", r->image.asset);
    if (ok && r->type == LUM_RECORD_LIGHT && r->light.web && r->light.asset[0])
        ok = lum_json_add_string(json, "asset", r->light.asset);
    if (ok)
        return json;
    cJSON_Delete(json);
    return NULL;
}

/* The settings are a "set", since they always exist. */
static struct lum_record *read_settings(const struct lum_op *op, struct lum_proto_error *err)
{
    struct lum_record *r = lum_record_create(LUM_RECORD_RENDER, "render");
    if (!r)
        lum_proto_fail_memory(err);
    if (r && strcmp(op->id, "render") == 0 && lum_record_set(r, op->path, op->value, err))
        return r;
    lum_record_unref(r);
    return NULL;
}

static bool read_names(const cJSON *json, struct lum_record *r, struct lum_proto_error *err)
{
    const cJSON *origin = cJSON_GetObjectItemCaseSensitive(json, "origin");
    const char *asset = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(json, "asset"));
    if (origin && !lum_json_to_id(origin, "origin", r->origin, err))
        return false;
    if (!asset)
        return true;
    bool light = r->type == LUM_RECORD_LIGHT && r->light.web;
    if ((r->type != LUM_RECORD_IMAGE && !light) || strlen(asset) > LUM_LIMIT_ASSET_BYTES)
        return lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "asset", "asset is too long");
    strcpy(light ? r->light.asset : r->image.asset, asset);
    return true;
}

struct lum_record *lum_stored_record_read(const struct lum_block *f, struct lum_proto_error *err)
{
    struct lum_blobs blobs = {f->blobs, f->n_blobs};
    struct lum_op op = {0};
    struct lum_record *r = NULL;
    if (!lum_op_from_json(cJSON_GetObjectItemCaseSensitive(f->json, "op"), &blobs, &op, err))
        return NULL;
    if (op.kind == LUM_OP_SET)
        r = read_settings(&op, err);
    else if (op.record)
        r = lum_record_ref(op.record);
    else
        lum_proto_fail(err, LUM_PROTO_BAD_PARAMS, "invalid_value", "op", "is no record");
    lum_op_finish(&op);
    if (r && !read_names(f->json, r, err)) {
        lum_record_unref(r);
        return NULL;
    }
    return r;
}

/* ---- files ---- */

static enum lum_status write_records(struct lum_block_writer *w, struct lum_record *const *records, size_t n,
                                     struct lum_error *err)
{
    enum lum_status st = LUM_OK;
    for (size_t i = 0; i < n && !st; i++) {
        struct lum_blobs_out blobs;
        cJSON *json = lum_stored_record(records[i], &blobs);
        st = lum_block_put(w, i + 1, 0, json, &blobs, err);
    }
    return st ? st : lum_block_sync(w, err);
}

static void to_hex(const uint8_t bytes[32], lum_sha ret)
{
    for (int i = 0; i < 32; i++)
        snprintf(ret + 2 * i, 3, "%02x", bytes[i]);
}

static enum lum_status finish_sha(void *sha, lum_sha ret, struct lum_error *err)
{
    uint8_t bytes[EVP_MAX_MD_SIZE];
    if (EVP_DigestFinal_ex(sha, bytes, NULL) != 1)
        return lum_fail(err, LUM_ERR_INTERNAL, "state", "SHA-256 failed");
    to_hex(bytes, ret);
    return LUM_OK;
}

enum lum_status lum_content_write(const struct lum_dir *content, struct lum_record *const *records, size_t n,
                                  lum_sha ret_sha, struct lum_error *err)
{
    static _Atomic uint64_t n_made; /* names only: threads must not write into one file */
    struct lum_block_writer w;
    char part[40];
    snprintf(part, sizeof part, "part-%llu", (unsigned long long)atomic_fetch_add(&n_made, 1));
    enum lum_status st = lum_block_create(&w, content, part, LUM_FILE_CONTENT, n, 0, err);
    if (st)
        return st;
    st = write_records(&w, records, n, err);
    if (!st)
        st = finish_sha(w.sha, ret_sha, err);
    lum_block_close(&w);
    if (!st)
        st = lum_dir_rename(content, part, ret_sha, err);
    if (st)
        lum_dir_remove(content, part);
    return st;
}

/* n: what the head of the file says; it is believed as far as the file is long. */
static enum lum_status make_room(const struct lum_block_reader *r, struct lum_record_list *ret, struct lum_error *err)
{
    if (r->seq > LUM_LIMIT_RECORDS || r->seq * LUM_BLOCK_BYTES > r->n_bytes)
        return lum_fail(err, LUM_ERR_INVALID, "state", "a file of content says that it has %llu records",
                        (unsigned long long)r->seq);
    ret->records = calloc(r->seq ? (size_t)r->seq : 1, sizeof(*ret->records));
    ret->n = ret->records ? (size_t)r->seq : 0;
    return ret->records ? LUM_OK : lum_fail(err, LUM_ERR_NOMEM, "state", "no memory for the state");
}

static void take_record(struct lum_record_list *list, const char *sha, const struct lum_block *f,
                        const struct lum_damage_sink *damage)
{
    struct lum_proto_error why = {.text = "its number is out of place"};
    bool placed = f->seq >= 1 && f->seq <= list->n && !list->records[f->seq - 1];
    struct lum_record *r = placed ? lum_stored_record_read(f, &why) : NULL;
    if (r) {
        list->records[f->seq - 1] = r;
        return;
    }
    lum_damage_note(damage, &why);
    lum_damage(damage, "content/%.12s: record %llu at offset %llu is none: %s", sha, (unsigned long long)f->seq,
               (unsigned long long)f->offset, why.text);
}

enum lum_status lum_content_read(const struct lum_dir *content, const char *sha, const struct lum_damage_sink *damage,
                                 struct lum_record_list *ret_records, struct lum_error *err)
{
    struct lum_block_reader r;
    struct lum_record_list list = {0};
    enum lum_status st = lum_block_open(&r, content, sha, LUM_FILE_CONTENT, err);
    if (st)
        return st;
    st = make_room(&r, &list, err);
    for (bool more = !st; more;) {
        struct lum_block f;
        struct lum_error why = {0};
        enum lum_block_found found = lum_block_next(&r, &f, &why);
        lum_damage_unread(damage, &why);
        more = found != LUM_BLOCK_END && found != LUM_BLOCK_TORN;
        if (found == LUM_BLOCK_WHOLE)
            take_record(&list, sha, &f, damage);
        else if (found != LUM_BLOCK_END)
            lum_damage(damage, "content/%.12s: record %llu at offset %llu is damaged", sha, (unsigned long long)f.seq,
                       (unsigned long long)f.offset);
        lum_block_finish(&f);
    }
    lum_block_close_reader(&r);
    if (!st)
        *ret_records = list;
    else
        lum_record_list_finish(&list);
    return st;
}

static enum lum_status hash_file(int fd, lum_sha ret, struct lum_error *err)
{
    uint8_t bytes[65536];
    EVP_MD_CTX *sha = EVP_MD_CTX_new();
    bool ok = sha && EVP_DigestInit_ex(sha, EVP_sha256(), NULL) == 1;
    ssize_t n = 0;
    while (ok && ((n = read(fd, bytes, sizeof bytes)) > 0 || (n < 0 && errno == EINTR)))
        ok = n < 0 || EVP_DigestUpdate(sha, bytes, (size_t)n) == 1;
    enum lum_status st = ok && n == 0 ? finish_sha(sha, ret, err)
                                      : lum_fail(err, LUM_ERR_IO, "state", "a file of content cannot be read");
    EVP_MD_CTX_free(sha);
    return st;
}

enum lum_status lum_content_check(const struct lum_dir *content, const char *sha, struct lum_error *err)
{
    int fd;
    uint64_t n_bytes;
    lum_sha found;
    enum lum_status st = lum_dir_read(content, sha, &fd, &n_bytes, err);
    if (st)
        return st;
    st = hash_file(fd, found, err);
    close(fd);
    if (!st && strcmp(found, sha) != 0)
        st = lum_fail(err, LUM_ERR_INVALID, "state", "content/%.12s is damaged: its bytes do not give its name", sha);
    return st;
}
