#define _GNU_SOURCE
#include "server/journal/block.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

#include <cjson/cJSON.h>
#include <openssl/evp.h>
#include <zlib.h>

#include "protocol/base/limits.h"
#include "protocol/json/json.h"

#define BUFFER_BYTES 65536u         /* of small writes, until there are enough for one */
#define MAX_BLOB_BYTES (1ull << 33) /* of one block: five arrays of the largest mesh, an image of the largest size */

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the structs are written as they lie in memory");

struct file_head {
    char magic[8];
    uint32_t version, kind;
    uint64_t salt, seq;
    uint32_t gap, crc;
};
struct block_head {
    char magic[4];
    uint32_t n_json;
    uint64_t n_blobs, seq, rev;
    uint32_t body_crc, head_crc;
};
_Static_assert(sizeof(struct file_head) == LUM_BLOCK_BYTES && sizeof(struct block_head) == LUM_BLOCK_BYTES, "no gaps");

static const char file_magic[8] = {'L', 'U', 'M', 'S', 'T', 'A', 'T', 'E'};
static const char block_magic[4] = {'L', 'U', 'M', 'R'};

static uint32_t crc_of(uint32_t crc, const void *bytes, size_t n)
{
    return (uint32_t)crc32_z(crc, bytes, n);
}

static enum lum_status no_memory(struct lum_error *err)
{
    return lum_fail(err, LUM_ERR_NOMEM, "state", "no memory to keep the state");
}

/* ---- writing ---- */

static enum lum_status flush(struct lum_block_writer *w, struct lum_error *err)
{
    enum lum_status st = lum_dir_write(w->dir, w->name, w->fd, w->buffer, w->n_buffer, err);
    w->n_buffer = 0;
    return st;
}

static enum lum_status put(struct lum_block_writer *w, const void *bytes, size_t n, struct lum_error *err)
{
    w->n_bytes += n;
    if (w->sha && EVP_DigestUpdate(w->sha, bytes, n) != 1)
        return lum_fail(err, LUM_ERR_INTERNAL, "state", "SHA-256 failed");
    if (w->n_buffer + n > BUFFER_BYTES) {
        enum lum_status st = flush(w, err);
        if (st || n > BUFFER_BYTES)
            return st ? st : lum_dir_write(w->dir, w->name, w->fd, bytes, n, err);
    }
    if (n > 0)
        memcpy(w->buffer + w->n_buffer, bytes, n);
    w->n_buffer += n;
    return LUM_OK;
}

static bool start_sha(struct lum_block_writer *w)
{
    w->sha = EVP_MD_CTX_new();
    return w->sha && EVP_DigestInit_ex(w->sha, EVP_sha256(), NULL) == 1;
}

enum lum_status lum_block_create(struct lum_block_writer *w, const struct lum_dir *dir, const char *name,
                                 enum lum_file_kind kind, uint64_t seq, uint32_t gap, struct lum_error *err)
{
    struct file_head head = {.version = LUM_STATE_VERSION, .kind = kind, .seq = seq, .gap = gap};
    memcpy(head.magic, file_magic, sizeof head.magic);
    bool content = kind == LUM_FILE_CONTENT;
    *w = (struct lum_block_writer){.dir = dir, .fd = -1, .buffer = malloc(BUFFER_BYTES)};
    snprintf(w->name, sizeof w->name, "%s", name);
    if (!content && getrandom(&head.salt, sizeof head.salt, 0) != (ssize_t)sizeof head.salt)
        head.salt = (uint64_t)lum_clock_ns();
    w->salt = (uint32_t)head.salt;
    head.crc = crc_of(0, &head, offsetof(struct file_head, crc));
    enum lum_status st = w->buffer && (!content || start_sha(w)) ? LUM_OK : no_memory(err);
    if (!st)
        st = lum_dir_create(dir, name, &w->fd, err);
    for (int copy = 0; copy < 2 && !st; copy++)
        st = put(w, &head, sizeof head, err);
    if (st)
        lum_block_close(w);
    return st;
}

static bool add_lengths(cJSON *json, const struct lum_blobs_out *blobs)
{
    cJSON *lengths = cJSON_CreateArray();
    for (size_t i = 0; i < blobs->n; i++)
        lum_json_add(lengths, NULL, cJSON_CreateNumber((double)blobs->blobs[i].n_bytes));
    return lum_json_add(json, "blobs", lengths);
}

static enum lum_status put_body(struct lum_block_writer *w, struct block_head *head, const char *text,
                                const struct lum_blobs_out *blobs, struct lum_error *err)
{
    static const uint8_t zeros[8] = {0};
    head->body_crc = crc_of(w->salt, text, head->n_json);
    for (size_t i = 0; blobs && i < blobs->n; i++) {
        head->body_crc = crc_of(head->body_crc, blobs->blobs[i].bytes, blobs->blobs[i].n_bytes);
        head->n_blobs += blobs->blobs[i].n_bytes;
    }
    head->head_crc = crc_of(w->salt, head, offsetof(struct block_head, head_crc));
    enum lum_status st = put(w, head, sizeof *head, err);
    if (!st)
        st = put(w, text, head->n_json, err);
    for (size_t i = 0; blobs && i < blobs->n && !st; i++)
        st = put(w, blobs->blobs[i].bytes, blobs->blobs[i].n_bytes, err);
    return st ? st : put(w, zeros, (size_t)(-w->n_bytes & 7), err);
}

enum lum_status lum_block_put(struct lum_block_writer *w, uint64_t seq, uint64_t rev, struct cJSON *json,
                              const struct lum_blobs_out *blobs, struct lum_error *err)
{
    size_t n = 0;
    bool ok = json && (!blobs || blobs->n == 0 || add_lengths(json, blobs));
    char *text = ok ? lum_json_print(json, &n) : NULL;
    cJSON_Delete(json);
    if (!text)
        return no_memory(err);
    struct block_head head = {.n_json = (uint32_t)n, .seq = seq, .rev = rev};
    memcpy(head.magic, block_magic, sizeof head.magic);
    enum lum_status st = n > LUM_LIMIT_STORED_BYTES
                             ? lum_fail(err, LUM_ERR_LIMIT, "state", "an edit is too long to keep: %zu bytes", n)
                             : put_body(w, &head, text, blobs, err);
    free(text);
    return st;
}

enum lum_status lum_block_flush(struct lum_block_writer *w, struct lum_error *err)
{
    return flush(w, err);
}

enum lum_status lum_block_sync(struct lum_block_writer *w, struct lum_error *err)
{
    enum lum_status st = flush(w, err);
    return st ? st : lum_dir_sync_file(w->dir, w->name, w->fd, err);
}

void lum_block_close(struct lum_block_writer *w)
{
    if (w->buffer && w->fd >= 0)
        close(w->fd);
    EVP_MD_CTX_free(w->sha);
    free(w->buffer);
    *w = (struct lum_block_writer){.fd = -1};
}

/* ---- reading ---- */

/* True when all n bytes are there. That the disk does not give them is another thing, and noted. */
static bool read_at(struct lum_block_reader *r, uint64_t at, void *ret, size_t n)
{
    char *to = ret;
    while (n > 0) {
        ssize_t done = pread(r->fd, to, n, (off_t)at);
        if (done < 0 && errno == EINTR)
            continue;
        if (done < 0)
            r->error = errno;
        if (done <= 0)
            return false;
        to += done;
        at += (uint64_t)done;
        n -= (size_t)done;
    }
    return true;
}

static enum lum_status fail_unread(const struct lum_block_reader *r, struct lum_error *err)
{
    return lum_fail(err, LUM_ERR_IO, "state",
                    "cannot read %.80s: %s. Nothing is changed; if the disk is broken there, copy the file with dd "
                    "conv=noerror,sync, and start with the copy",
                    r->name, strerror(r->error));
}

static bool is_file_head(const struct file_head *h)
{
    return memcmp(h->magic, file_magic, sizeof file_magic) == 0 &&
           h->crc == crc_of(0, h, offsetof(struct file_head, crc));
}

/* Either of the two. */
static bool read_file_head(struct lum_block_reader *r, struct file_head *ret)
{
    for (uint64_t copy = 0; copy < 2; copy++)
        if (read_at(r, copy * sizeof *ret, ret, sizeof *ret) && is_file_head(ret))
            return true;
    return false;
}

enum lum_status lum_block_open(struct lum_block_reader *r, const struct lum_dir *dir, const char *name,
                               enum lum_file_kind kind, struct lum_error *err)
{
    struct file_head head;
    *r = (struct lum_block_reader){.fd = -1};
    snprintf(r->name, sizeof r->name, "%s", name);
    enum lum_status st = lum_dir_read(dir, name, &r->fd, &r->n_bytes, err);
    if (st)
        return st;
    bool found = read_file_head(r, &head);
    if (r->error)
        st = fail_unread(r, err);
    else if (!found)
        st = lum_fail(err, LUM_ERR_INVALID, "state", "%.80s is damaged at offset 0: it has no head", name);
    else if (head.version < LUM_STATE_OLDEST || head.version > LUM_STATE_VERSION)
        st = lum_fail(
            err, LUM_ERR_UNSUPPORTED, "state",
            "%.40s has format %u, and this lumend reads formats %u to %u: start the lumend that wrote it, or take "
            "the scene over with its `lumend state export`",
            name, head.version, LUM_STATE_OLDEST, LUM_STATE_VERSION);
    else if (head.kind != (uint32_t)kind)
        st = lum_fail(err, LUM_ERR_INVALID, "state", "%.80s holds something else than its name says", name);
    if (st) {
        lum_block_close_reader(r);
        return st;
    }
    r->salt = (uint32_t)head.salt;
    r->seq = head.seq;
    r->gap = head.gap;
    r->at = 2 * sizeof head;
    return LUM_OK;
}

static uint64_t body_bytes(const struct block_head *h)
{
    return (h->n_json + h->n_blobs + 7) & ~7ull;
}

static bool is_head(const struct lum_block_reader *r, const struct block_head *h)
{
    return memcmp(h->magic, block_magic, sizeof block_magic) == 0 &&
           h->head_crc == crc_of(r->salt, h, offsetof(struct block_head, head_crc)) &&
           h->n_json <= LUM_LIMIT_STORED_BYTES && h->n_blobs <= MAX_BLOB_BYTES;
}

/* Where the next block's head stands, from `at` on; n_bytes: nowhere. */
static uint64_t find_head(struct lum_block_reader *r, uint64_t at)
{
    uint8_t window[4096 + LUM_BLOCK_BYTES];
    for (at = (at + 7) & ~7ull; at + LUM_BLOCK_BYTES <= r->n_bytes; at += 4096) {
        size_t n = r->n_bytes - at < sizeof window ? (size_t)(r->n_bytes - at) : sizeof window;
        if (!read_at(r, at, window, n))
            break;
        for (size_t i = 0; i < 4096 && i + LUM_BLOCK_BYTES <= n; i += 8) {
            struct block_head h;
            memcpy(&h, window + i, sizeof h);
            if (is_head(r, &h))
                return at + i;
        }
    }
    return r->n_bytes;
}

/* Is what stands here, and has no block behind it, the beginning of one that was never whole? Then less than a head is
 * there, or zeros, which a file system leaves where a power cut came before the data. */
static bool is_cut(const struct lum_block_reader *r, const struct block_head *h)
{
    static const struct block_head zeros = {0};
    return r->n_bytes - r->at < sizeof *h || memcmp(h, &zeros, sizeof zeros) == 0;
}

/* The text, into the reader's memory. */
static bool read_text(struct lum_block_reader *r, const struct block_head *h, struct lum_error *err)
{
    if (h->n_json > r->body_capacity) {
        free(r->body);
        r->body = malloc(h->n_json);
        r->body_capacity = r->body ? h->n_json : 0;
        if (!r->body)
            return !no_memory(err);
    }
    return read_at(r, r->at + sizeof *h, r->body, h->n_json);
}

/* The checksum of the body, from that of its text on: of blobs that nobody wants. */
static bool add_crc_of_blobs(struct lum_block_reader *r, const struct block_head *h, uint32_t *inout_crc)
{
    uint8_t bytes[4096];
    for (uint64_t at = 0; at < h->n_blobs; at += sizeof bytes) {
        size_t n = h->n_blobs - at < sizeof bytes ? (size_t)(h->n_blobs - at) : sizeof bytes;
        if (!read_at(r, r->at + sizeof *h + h->n_json + at, bytes, n))
            return false;
        *inout_crc = crc_of(*inout_crc, bytes, n);
    }
    return true;
}

/* Each into an array of its own, which records share: of large models there is no other copy. Their lengths are those
 * that the JSON tells. */
static bool read_blobs(struct lum_block_reader *r, const struct block_head *h, struct lum_block *f, uint32_t *inout_crc,
                       struct lum_error *err)
{
    uint64_t left = h->n_blobs, at = r->at + sizeof *h + h->n_json;
    const cJSON *lengths = cJSON_GetObjectItemCaseSensitive(f->json, "blobs");
    for (const cJSON *c = lengths ? lengths->child : NULL; c; c = c->next) {
        if (f->n_blobs == LUM_BLOBS_MAX || !cJSON_IsNumber(c) || !(c->valuedouble >= 0) ||
            c->valuedouble > (double)left)
            return false;
        size_t n = (size_t)c->valuedouble;
        void *bulk = lum_bulk_create(n);
        if (!bulk)
            return !no_memory(err);
        f->blobs[f->n_blobs++] = (struct lum_blob){.bytes = bulk, .n_bytes = n, .bulk = bulk};
        if (!read_at(r, at, bulk, n))
            return false;
        *inout_crc = crc_of(*inout_crc, bulk, n);
        at += n;
        left -= n;
    }
    return left == 0;
}

/* The text is parsed before the checksum of all is known, as it tells the blobs' lengths: it may be anything. */
static bool read_body(struct lum_block_reader *r, const struct block_head *h, struct lum_block *f,
                      struct lum_error *err)
{
    if (!read_text(r, h, err))
        return false;
    uint32_t crc = crc_of(r->salt, r->body, h->n_json);
    f->json = lum_json_parse_stored((const char *)r->body, h->n_json, NULL);
    if (f->json)
        return read_blobs(r, h, f, &crc, err) && crc == h->body_crc;
    if (add_crc_of_blobs(r, h, &crc) && crc == h->body_crc)
        lum_fail(err, LUM_ERR_NOMEM, "state", "a text of the state cannot be parsed, or memory is short for it");
    return false;
}

static enum lum_block_found next_block(struct lum_block_reader *r, struct lum_block *f, struct lum_error *err)
{
    struct block_head h = {.n_json = 1}; /* where it cannot be read it is no zeros either */
    *f = (struct lum_block){.offset = r->at, .n_bytes = r->n_bytes - r->at};
    if (r->at >= r->n_bytes)
        return LUM_BLOCK_END;
    if (!read_at(r, r->at, &h, sizeof h) || !is_head(r, &h)) {
        uint64_t next = find_head(r, r->at + 8);
        bool torn = next == r->n_bytes && is_cut(r, &h);
        f->n_bytes = next - r->at;
        r->at = next;
        return torn ? LUM_BLOCK_TORN : LUM_BLOCK_DAMAGED;
    }
    if (body_bytes(&h) > r->n_bytes - r->at - sizeof h) {
        r->at = r->n_bytes;
        return LUM_BLOCK_TORN;
    }
    f->n_bytes = sizeof h + body_bytes(&h);
    f->seq = h.seq;
    f->rev = h.rev;
    bool ok = read_body(r, &h, f, err);
    r->at += f->n_bytes;
    if (!ok)
        lum_block_finish(f);
    return ok ? LUM_BLOCK_WHOLE : LUM_BLOCK_DAMAGED;
}

enum lum_block_found lum_block_next(struct lum_block_reader *r, struct lum_block *ret_block, struct lum_error *err)
{
    enum lum_block_found found = next_block(r, ret_block, err);
    if (r->error)
        fail_unread(r, err);
    return found;
}

void lum_block_finish(struct lum_block *f)
{
    cJSON_Delete(f->json);
    f->json = NULL;
    for (size_t i = 0; i < f->n_blobs; i++)
        lum_bulk_unref(f->blobs[i].bulk);
    f->n_blobs = 0;
}

void lum_block_close_reader(struct lum_block_reader *r)
{
    if (r->fd >= 0)
        close(r->fd);
    free(r->body);
    *r = (struct lum_block_reader){.fd = -1};
}
