/* What `lumend render` tells on stderr of options and scenes before it begins. */
#ifndef LUM_SERVER_CLI_RENDER_NOTICE_H
#define LUM_SERVER_CLI_RENDER_NOTICE_H

#include "core/method/method.h"
#include "core/scene/snapshot.h"
#include "server/cli/render_options.h"
#include "server/stream/overlay.h"

void lum_render_tell_unused(const struct lum_render_options *options, const struct lum_method *method);
/* Of a picture all around. */
void lum_render_tell_unseen_lamps(const struct lum_snapshot *snapshot);
/* Of a map that a picture has: which colour says what, on stdout. */
void lum_render_tell_legend(const char *name, const struct lum_overlay *overlay);

#endif
