/* Requests for the director: one table of method names, each with the function that reads its params. */
#ifndef LUM_SERVER_DIRECTOR_METHODS_H
#define LUM_SERVER_DIRECTOR_METHODS_H

#include "server/director/director.h"

struct lum_rpc;

/* A command with everything but the session filled in. NULL: err says what is wrong. Takes over rpc->id. */
struct lum_command *lum_method_command(struct lum_rpc *rpc, struct lum_proto_error *err);

#endif
