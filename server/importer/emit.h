/* The importer's output stream (chunks as server/import/wire.h describes them) and the text of ops.
 *
 * Both are sticky: after the first failure every call does nothing, and the call that ends a unit (lum_emit_op) reports
 * it. Nothing here allocates. */
#ifndef LUM_SERVER_IMPORTER_EMIT_H
#define LUM_SERVER_IMPORTER_EMIT_H

#include "core/base/base.h"
#include "core/math/affine.h"

#define LUM_EMIT_WARNINGS 64u /* later ones are counted, not sent */

struct lum_emit {
    int fd;           /* -1: everything is checked and dropped (fuzzing) */
    uint64_t n_bytes; /* written so far */
    uint32_t n_ops;
    uint32_t n_blobs; /* since the last op */
    uint32_t n_warnings;
    bool broken; /* a write failed: the reader is gone */
    bool full;   /* LUM_LIMIT_IMPORT_OUTPUT_BYTES reached */
};

/* JSON text of one op. Strings given to it hold no character that JSON would escape: ids, enum names, numbers. */
struct lum_op_text {
    size_t n;
    bool failed; /* too long, or a number that is not finite */
    char text[8192];
};
void lum_op_begin(struct lum_op_text *o, const char *type, const char *id);
void lum_op_string(struct lum_op_text *o, const char *key, const char *value);
void lum_op_number(struct lum_op_text *o, const char *key, double value);
void lum_op_numbers(struct lum_op_text *o, const char *key, const double *values, size_t n);
void lum_op_bool(struct lum_op_text *o, const char *key, bool value);
void lum_op_object(struct lum_op_text *o, const char *key); /* opens {"key":{ ... */
void lum_op_close(struct lum_op_text *o);                   /* closes what lum_op_object opened */

/* True for what an object may have as its transform: finite, invertible, within the coordinates' limit. */
bool lum_op_transform_fits(const struct lum_affined *local_to_world);

/* Sends bulk data of the op that follows, and writes {"key":{"blob":k}} into it. */
void lum_emit_blob(struct lum_emit *e, struct lum_op_text *o, const char *key, const void *bytes, size_t n_bytes);
/* The same of doubles. */
void lum_emit_doubles(struct lum_emit *e, struct lum_op_text *o, const char *key, const void *bytes, size_t n_bytes);
/* Sends bulk data of the op that follows, whose number it gives. */
uint32_t lum_emit_bulk(struct lum_emit *e, const void *bytes, size_t n_bytes);
/* An op that is text already. */
LUM_MUST_USE enum lum_status lum_emit_text(struct lum_emit *e, const char *text, size_t n, struct lum_error *err);
/* What a scene of this file alone is to be set to: an object. */
void lum_emit_settings(struct lum_emit *e, const char *text, size_t n);
LUM_MUST_USE enum lum_status lum_emit_op(struct lum_emit *e, struct lum_op_text *o, struct lum_error *err);
void lum_emit_progress(struct lum_emit *e, const char *stage, double fraction);
void lum_emit_warning(struct lum_emit *e, const char *fmt, ...) LUM_PRINTF(2, 3);
void lum_emit_done(struct lum_emit *e);
void lum_emit_error(struct lum_emit *e, const char *code, const char *text);

#endif
