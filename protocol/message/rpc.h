/* The JSON-RPC 2.0 envelope of text messages. Batches are refused; params are by name, never by position. */
#ifndef LUM_PROTOCOL_MESSAGE_RPC_H
#define LUM_PROTOCOL_MESSAGE_RPC_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/base/error.h"

struct cJSON;

struct lum_rpc {
    struct cJSON *root;         /* owned */
    char *id;                   /* the request's id as JSON text, owned; NULL: a notification, which gets no reply */
    const char *method;         /* in root */
    const struct cJSON *params; /* an object in root, or NULL */
};

/* On failure *ret_rpc holds the id if one could be read, so that the error can name it, and nothing else. Finish it
 * either way. The reply to a text whose id could not be read carries "id":null (lum_rpc_error with id NULL). */
bool lum_rpc_parse(const char *text, size_t n_bytes, struct lum_rpc *ret_rpc, struct lum_proto_error *err);
void lum_rpc_finish(struct lum_rpc *rpc);
/* The id alone, as JSON text to be freed, of a text that is not parsed: it takes no memory for what is in it. NULL:
 * none that can be seen so, such as in a text that is no JSON. */
char *lum_rpc_scan_id(const char *text, size_t n_bytes);

/* Texts to send; the caller frees them. NULL when memory is short. result and params are consumed in every case; a NULL
 * result or params means that making it failed, and gives NULL. */
char *lum_rpc_result(const char *id, struct cJSON *result);
char *lum_rpc_error(const char *id, const struct lum_proto_error *err);
char *lum_rpc_notification(const char *method, struct cJSON *params);
char *lum_rpc_request(uint64_t id, const char *method, struct cJSON *params); /* clients */

/* What came to a client: a reply (id) or a notification (method). */
struct lum_rpc_incoming {
    struct cJSON *root;         /* owned */
    uint64_t id;                /* of our request; 0: none */
    const char *method;         /* notification, or NULL */
    const struct cJSON *result; /* reply: NULL when it is an error */
    const struct cJSON *error;
    const struct cJSON *params;
};
bool lum_rpc_parse_incoming(const char *text, size_t n_bytes, struct lum_rpc_incoming *ret_in,
                            struct lum_proto_error *err);
void lum_rpc_incoming_finish(struct lum_rpc_incoming *in);

#endif
