/* The one form of all files of the state: a head, then blocks. A block is a JSON text and, where it has bulk data, the
 * bytes of its blobs.
 *
 * - head, 40 bytes: magic "LUMSTATE", u32 version, u32 kind, u64 salt, u64 seq, u32 gap, u32 crc of the 36 before;
 *   and the same again: without the salt nothing else could be read
 * - block, 40 bytes: magic "LUMR", u32 n_json, u64 n_blobs, u64 seq, u64 scene_rev, u32 crc of the body, u32 crc of
 *   the 36 before
 * - body: n_json bytes of text, n_blobs bytes, zeros up to a multiple of 8
 *
 * Little-endian; the checksum is zlib's CRC-32, begun with the salt, which is random: what a client sends cannot pass
 * for a block, nor can a block of another file. A block's length and its body have checksums of their own: where a body
 * is damaged the next block is found all the same; where the head is, it is looked for (blocks begin at multiples of
 * 8). */
#ifndef LUM_SERVER_JOURNAL_BLOCK_H
#define LUM_SERVER_JOURNAL_BLOCK_H

#include "protocol/record/bulk.h"
#include "server/journal/disk.h"

struct cJSON;

#define LUM_STATE_VERSION 3u /* 2: op_ids of all edits, and in snapshots; 3: what was, and when */
#define LUM_STATE_OLDEST 1u  /* that is read */
#define LUM_BLOCK_BYTES 40u

enum lum_file_kind { LUM_FILE_JOURNAL = 1, LUM_FILE_SNAPSHOT, LUM_FILE_CONTENT };

/* ---- writing ---- */
struct lum_block_writer {
    const struct lum_dir *dir;
    char name[96];
    int fd; /* -1: closed */
    uint32_t salt;
    uint64_t n_bytes; /* written, what waits in the buffer included */
    void *sha;        /* EVP_MD_CTX: over all bytes; NULL: none */
    uint8_t *buffer;
    size_t n_buffer;
};
/* Creates the file and writes its head. seq: the number of the last edit before; the last `gap` numbers up to it are of
 * no edit. Content: how many records, and 0. Content is the same bytes for the same records: its salt is 0, and its
 * SHA-256 is computed along. */
LUM_MUST_USE enum lum_status lum_block_create(struct lum_block_writer *w, const struct lum_dir *dir, const char *name,
                                              enum lum_file_kind kind, uint64_t seq, uint32_t gap,
                                              struct lum_error *err);
/* json is consumed (NULL: making it failed). Its member "blobs" is set to the lengths of blobs, if there are any. */
LUM_MUST_USE enum lum_status lum_block_put(struct lum_block_writer *w, uint64_t seq, uint64_t rev, struct cJSON *json,
                                           const struct lum_blobs_out *blobs, struct lum_error *err);
/* All that was put is with the system: it outlives this process, not a power cut. */
LUM_MUST_USE enum lum_status lum_block_flush(struct lum_block_writer *w, struct lum_error *err);
/* All that was put is on disk. After a failure of any of these the file can only be closed: its content is unknown. */
LUM_MUST_USE enum lum_status lum_block_sync(struct lum_block_writer *w, struct lum_error *err);
void lum_block_close(struct lum_block_writer *w); /* accepts a zeroed or closed one; nothing is flushed */

/* ---- reading ---- */
enum lum_block_found {
    LUM_BLOCK_WHOLE,
    LUM_BLOCK_END,
    LUM_BLOCK_TORN,    /* the file ends in the middle of something, as after a power cut */
    LUM_BLOCK_DAMAGED, /* what stands here is not what was written; the reader goes on behind it */
};
struct lum_block_reader {
    int fd; /* -1: closed */
    char name[96];
    int error; /* errno of a read that failed; 0: none */
    uint64_t n_bytes, at;
    uint32_t salt;
    uint64_t seq; /* of the head */
    uint32_t gap;
    uint8_t *body;
    size_t body_capacity;
};
struct lum_block {            /* valid until the next is read */
    uint64_t offset, n_bytes; /* in the file; of what is torn or damaged, too */
    uint64_t seq, rev;        /* damaged: seq 0: not known */
    /* owned by the reader's user: lum_block_finish */
    struct cJSON *json;
    struct lum_blob blobs[LUM_BLOBS_MAX]; /* bulk arrays: a reference each */
    size_t n_blobs;
};
/* LUM_ERR_NOT_FOUND; LUM_ERR_UNSUPPORTED: another version, the text says what to do; LUM_ERR_INVALID: the head is
 * damaged or of another kind. */
LUM_MUST_USE enum lum_status lum_block_open(struct lum_block_reader *r, const struct lum_dir *dir, const char *name,
                                            enum lum_file_kind kind, struct lum_error *err);
/* A failing read or allocation looks like damage: err (else untouched) says that it is none (LUM_ERR_IO, _NOMEM). */
enum lum_block_found lum_block_next(struct lum_block_reader *r, struct lum_block *ret_block, struct lum_error *err);
void lum_block_finish(struct lum_block *f);
void lum_block_close_reader(struct lum_block_reader *r);

#endif
