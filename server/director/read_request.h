/* Messages of clients made requests: the table of what can be asked is here, and what several readers share. */
#ifndef LUM_SERVER_DIRECTOR_READ_REQUEST_H
#define LUM_SERVER_DIRECTOR_READ_REQUEST_H

#include "server/base/role.h"
#include "server/director/request.h"

struct lum_json_reader;
struct lum_rpc;

/* A request with everything but the session filled in. NULL: err says what is wrong, or that it is not for this role.
 * Takes over rpc->id. */
struct lum_request *lum_request_read(struct lum_rpc *rpc, enum lum_role role, struct lum_proto_error *err);
/* May this role ask for a method that needs the other? False: err names both. */
bool lum_request_allowed(const char *method, enum lum_role needs, enum lum_role role, struct lum_proto_error *err);

/* For lum_request_type.read: no params; an id alone. */
bool lum_request_read_nothing(struct lum_json_reader *r, struct lum_request *q);
bool lum_request_read_id(struct lum_json_reader *r, struct lum_request *q);
/* Members for such a function, which reads others, too, and ends with lum_json_end: view_id; that with x and y. */
bool lum_request_read_view_id(struct lum_json_reader *r, struct lum_request *q);
bool lum_request_read_pixel(struct lum_json_reader *r, struct lum_request *q);

#endif
