/* Looks of a room's light, as ops: what stores one, and what brings it back. */
#ifndef LUM_SERVER_WORLD_PRESETS_H
#define LUM_SERVER_WORLD_PRESETS_H

#include "server/world/world.h"

struct cJSON;

/* The op that keeps all lamps as the document has them now, on the preset `id`, there already or not. name "", fade_s
 * not set: as they are. NULL: memory is short. */
struct cJSON *lum_preset_store_op(const struct lum_document *doc, const char *id, const char *name,
                                  struct lum_opt fade_s);
/* The ops that make lamps as the preset has them. Those that are gone, or cannot be so any more, are left out and named
 * in left_out. NULL: memory is short. */
struct cJSON *lum_preset_recall_ops(const struct lum_document *doc, const struct lum_record_preset *preset,
                                    struct cJSON *left_out);
/* The ops that make the lamps which fade stay as they shine now. Those of which that cannot be said go to their end. */
struct cJSON *lum_preset_stop_ops(const struct lum_world *world);

#endif
