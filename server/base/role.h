/* What somebody may do here. Each role may do all that those before it may. */
#ifndef LUM_SERVER_BASE_ROLE_H
#define LUM_SERVER_BASE_ROLE_H

#include <stdbool.h>

enum lum_role {
    LUM_ROLE_VIEW,    /* see the scene, from views of one's own */
    LUM_ROLE_MEASURE, /* ask how much light falls where */
    LUM_ROLE_EDIT,    /* change the scene */
    LUM_ROLE_ADMIN,   /* see who is here, and end sessions */
    LUM_ROLE_COUNT
};
#define LUM_ROLE_NAMES "view, measure, edit or admin" /* for messages */

const char *lum_role_name(enum lum_role role);
bool lum_role_parse(const char *name, enum lum_role *ret_role);

#endif
