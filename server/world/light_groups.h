/* Light groups: what each set of lights alone contributes. Light is linear, so the pictures of all groups sum to the
 * whole.
 *
 * A group is what lights and objects that shine name in "group" (else their own id), and each unlit material is a group
 * by its id. */
#ifndef LUM_SERVER_WORLD_LIGHT_GROUPS_H
#define LUM_SERVER_WORLD_LIGHT_GROUPS_H

#include "server/world/world.h"

/* A light, or an object that shines, be it switched on or off. */
bool lum_record_is_lamp(const struct lum_document *doc, const struct lum_record *r);

struct lum_light_groups {
    lum_id *names;
    size_t n;
};
LUM_MUST_USE enum lum_status lum_light_groups_list(const struct lum_world *world, struct lum_light_groups *ret_groups,
                                                   struct lum_error *err);
void lum_light_groups_finish(struct lum_light_groups *groups);

/* Lets only this group shine in the renderer's scene, NULL: all as the document says; and commits. The document stays
 * as it is. After a failure call it with NULL. */
LUM_MUST_USE enum lum_status lum_light_groups_solo(struct lum_world *world, const char *group, struct lum_error *err);

#endif
