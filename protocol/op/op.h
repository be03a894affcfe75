/* Ops: edits as plain data, and their JSON form.
 *
 *   {"op":"add","type":"light","id":"key","kind":"point",...}   add, or fail when the id exists
 *   {"op":"set","id":"key","path":"/flux_lm","value":800}       change one field
 *   {"op":"remove","id":"key"}
 *   {"op":"import","id":"room","asset":"room.glb","transform":...}
 *
 * Everything here is total over arbitrary input: it fills *ret_error and fails, it never crashes. Not thread-safe per
 * object; no globals. */
#ifndef LUM_PROTOCOL_OP_OP_H
#define LUM_PROTOCOL_OP_OP_H

#include "protocol/base/error.h"
#include "protocol/record/record.h"

struct cJSON;

enum lum_op_kind { LUM_OP_ADD, LUM_OP_SET, LUM_OP_REMOVE, LUM_OP_IMPORT };

struct lum_op {
    enum lum_op_kind kind;
    lum_id id;
    struct lum_record *record; /* add, import: owned. Set of a light's asset: a light with the web of it, or NULL */
    char path[LUM_LIMIT_PATH_BYTES + 1]; /* set: "/flux_lm", "/transform/translate", "/transform/translate/1" */
    struct cJSON *value;                 /* set: owned */
};

struct lum_ops {
    struct lum_op *ops;
    size_t n;
    double *t_ms;      /* replay records: time of each op; NULL in scenes and messages */
    uint32_t *lines;   /* of a .jsonl text: where each op stands, from 1; else NULL */
    lum_id undo_group; /* a drag: successive transactions of one user with this name are one undo step; "": alone */
};

/* A photometric file, by its name. */
bool lum_is_web_file(const char *name);
/* The photometric file that the op gives a light: an add of one with an asset, or a set of it, of which the file's name
 * tells that it is one. NULL: none. */
const char *lum_op_web_file(const struct lum_op *op);

/* One op from a parsed JSON object. blobs NULL: blob references are refused (clients may not send them). */
bool lum_op_from_json(const struct cJSON *json, const struct lum_blobs *blobs, struct lum_op *ret_op,
                      struct lum_proto_error *err);
void lum_op_finish(struct lum_op *op);

/* The "ops" array of scene.apply. The error path starts with "ops/3/...". */
bool lum_ops_from_json(const struct cJSON *array, struct lum_ops *ret_ops, struct lum_proto_error *err);
/* The same of a journal, where it may be longer. */
bool lum_ops_from_stored(const struct cJSON *array, struct lum_ops *ret_ops, struct lum_proto_error *err);
/* A .jsonl text: header line, then one op a line; blank lines and lines that start with # are skipped. The error text
 * names the line. */
bool lum_ops_from_jsonl(const char *text, size_t n_bytes, struct lum_ops *ret_ops, struct lum_proto_error *err);
/* For a refusal after the reading: "ops/2/mesh" in the path becomes "mesh", and the text names the line. */
void lum_ops_name_line(const struct lum_ops *ops, struct lum_proto_error *err);
void lum_ops_finish(struct lum_ops *ops);

/* {"op":"add",...} that lum_op_from_json reads back to an equal record. elide_bulk: arrays and pixels become counts
 * ("n_triangles"), for lists shown to people. NULL when memory is short. */
struct cJSON *lum_record_to_json(const struct lum_record *r, bool elide_bulk);

/* The same with bulk data as blobs, borrowed from r. Decoded pixels stand in for the asset that they came from, whose
 * name the caller keeps. */
struct cJSON *lum_record_to_blobs(const struct lum_record *r, struct lum_blobs_out *ret_blobs);

/* The op as it is sent or stored. NULL when memory is short. */
struct cJSON *lum_op_to_json(const struct lum_op *op);

/* Writes one field of *record from JSON value; the record's other fields keep their values. On failure it may be half
 * changed: work on a clone. */
bool lum_record_set(struct lum_record *record, const char *path, const struct cJSON *value,
                    struct lum_proto_error *err);

#endif
