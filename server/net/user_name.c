#include "server/net/user_name.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#define CLIENT_BYTES 32 /* of the client's own name */

void lum_user_name(const char *client, struct lum_session_ref session, uint64_t starts,
                   char ret_user[LUM_LIMIT_ID_BYTES + 1])
{
    char name[CLIENT_BYTES + 1], again[16] = "";
    size_t n = 0;
    for (const char *p = client; *p && n < CLIENT_BYTES; p++)
        name[n++] = isalnum((unsigned char)*p) || strchr("_.:-", *p) ? *p : '_';
    name[n] = '\0';
    if (starts > 1)
        snprintf(again, sizeof again, ".%u", (unsigned)starts);
    snprintf(ret_user, LUM_LIMIT_ID_BYTES + 1, "%s.%u-%u%s", n ? name : "client", session.slot, session.generation,
             again);
}
