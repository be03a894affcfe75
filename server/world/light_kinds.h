/* Kinds of light by their names: the rows of the renderer, in the order of the protocol's list. */
#ifndef LUM_SERVER_WORLD_LIGHT_KINDS_H
#define LUM_SERVER_WORLD_LIGHT_KINDS_H

#include "core/scene/light_kind.h"
#include "protocol/record/light_kinds.h"

#define LUM_LIGHT_KIND_DECLARE(name, has) extern const struct lum_light_kind_row lum_light_kind_##name;
LUM_LIGHT_KINDS(LUM_LIGHT_KIND_DECLARE)
#define LUM_LIGHT_KIND_NAMED(name, has) {#name, &lum_light_kind_##name},
static const struct {
    const char *name;
    const struct lum_light_kind_row *row;
} lum_light_kinds[] = {LUM_LIGHT_KINDS(LUM_LIGHT_KIND_NAMED)};
#define LUM_LIGHT_KIND_COUNT (sizeof lum_light_kinds / sizeof lum_light_kinds[0])

#endif
