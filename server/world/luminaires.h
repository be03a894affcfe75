/* Objects that shine, in messages: how much light leaves them is known to the renderer, not to their records. */
#ifndef LUM_SERVER_WORLD_LUMINAIRES_H
#define LUM_SERVER_WORLD_LUMINAIRES_H

#include "core/scene/snapshot.h"

struct cJSON;

/* "emits" of an object; NULL: it does not shine in the snapshot. The caller owns it. False: memory is short. */
bool lum_luminaire_describe(const struct lum_snapshot *s, const char *id, struct cJSON **ret_emits);

/* What is otherwise in `now`: by id of the object the members of "emits" that changed, all of one that is new, and null
 * for one that shines no more. NULL: nothing, or memory is short. was: NULL before the first snapshot. The caller owns
 * it. */
struct cJSON *lum_luminaires_changes(const struct lum_snapshot *was, const struct lum_snapshot *now);

#endif
