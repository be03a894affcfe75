/* Pieces of the JSON form of ops that the sources of protocol/ share. */
#ifndef LUM_PROTOCOL_OP_OP_JSON_H
#define LUM_PROTOCOL_OP_OP_JSON_H

#include "protocol/op/op.h"

/* Members of an op that are not fields of a record: "op" "type" "id" "t_ms". */
bool lum_op_member(const char *name);

bool lum_op_record_from_json(const struct cJSON *json, enum lum_record_type type, const char *id,
                             const struct lum_blobs *blobs, struct lum_record **ret_record,
                             struct lum_proto_error *err);

#endif
