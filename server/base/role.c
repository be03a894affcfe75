#include "server/base/role.h"

#include <string.h>

static const char *const names[LUM_ROLE_COUNT] = {
    [LUM_ROLE_VIEW] = "view",
    [LUM_ROLE_MEASURE] = "measure",
    [LUM_ROLE_EDIT] = "edit",
    [LUM_ROLE_ADMIN] = "admin",
};

const char *lum_role_name(enum lum_role role)
{
    return names[role];
}

bool lum_role_parse(const char *name, enum lum_role *ret_role)
{
    for (int i = 0; i < LUM_ROLE_COUNT; i++) {
        if (strcmp(names[i], name) == 0) {
            *ret_role = (enum lum_role)i;
            return true;
        }
    }
    return false;
}
