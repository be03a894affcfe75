/* Requests for the director: one table of method names, each with the function that reads its params. */
#ifndef LUM_SERVER_DIRECTOR_READ_REQUEST_H
#define LUM_SERVER_DIRECTOR_READ_REQUEST_H

#include "server/director/request.h"

struct lum_rpc;

/* A request with everything but the session filled in. NULL: err says what is wrong. Takes over rpc->id. */
struct lum_request *lum_request_read(struct lum_rpc *rpc, struct lum_proto_error *err);

#endif
