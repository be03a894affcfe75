/* Built without MPI. */
#include "server/farm/farm.h"

enum lum_status lum_farm_join(struct lum_team **ret_team, struct lum_error *err)
{
    (void)err;
    *ret_team = NULL;
    return LUM_OK;
}

void lum_farm_leave(struct lum_team *team)
{
    (void)team;
}

void lum_farm_version(char ret_text[LUM_FARM_VERSION_BYTES])
{
    ret_text[0] = '\0';
}
