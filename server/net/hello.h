/* session.hello: what a client says first, and what it is told then. */
#ifndef LUM_SERVER_NET_HELLO_H
#define LUM_SERVER_NET_HELLO_H

#include "protocol/message/rpc.h"
#include "protocol/record/record.h"
#include "server/net/auth.h"
#include "server/project/store.h"

struct cJSON;
struct lum_project;
struct lum_sessions_config;

struct lum_hello {
    char token[LUM_TOKEN_MAX_BYTES + 1]; /* "": none */
    char client[LUM_LIMIT_ID_BYTES + 1]; /* how it calls itself */
    lum_id resume;                       /* a name from before, which who was cut off may take again; "": none */
    char key[LUM_LIMIT_ID_BYTES + 1];    /* of that session */
    lum_project_id project;              /* whose scene it wants; "": the one, or none */
    bool has_scene_rev;
    uint64_t scene_rev; /* the newest that the client knows */
};

LUM_MUST_USE bool lum_hello_read(const struct lum_rpc *rpc, struct lum_hello *ret_hello, struct lum_proto_error *err);
struct lum_hello_answer {
    const struct lum_project *project; /* NULL: none */
    const char *user;
    enum lum_role role;
    const char *key;
    bool resumed;
    int missed; /* changes that are told after the reply; -1: nobody knows which there were */
};
/* The reply. NULL: memory is short. */
struct cJSON *lum_hello_result(const struct lum_sessions_config *config, const struct lum_hello_answer *answer);

#endif
