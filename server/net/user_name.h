/* Names of users, which scene.changed tells and undo is kept under. */
#ifndef LUM_SERVER_NET_USER_NAME_H
#define LUM_SERVER_NET_USER_NAME_H

#include "server/director/request.h"

/* "web" from slot 3 becomes "web.3-17": unique among the users, in the alphabet of ids. A daemon that was started again
 * with its state adds how often it was: "web.3-17.2". */
void lum_user_name(const char *client, struct lum_session_ref session, uint64_t starts,
                   char ret_user[LUM_LIMIT_ID_BYTES + 1]);

#endif
