/* What `lumend render` tells on stderr of options and scenes before it begins. */
#ifndef LUM_SERVER_CLI_RENDER_NOTICE_H
#define LUM_SERVER_CLI_RENDER_NOTICE_H

#include "core/method/method.h"
#include "core/scene/snapshot.h"
#include "server/cli/render_options.h"

void lum_render_tell_unused(const struct lum_render_options *options, const struct lum_method *method);
/* Of a picture all around. */
void lum_render_tell_unseen_lamps(const struct lum_snapshot *snapshot);

#endif
