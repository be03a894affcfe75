/* What a desk makes of the lamps: patches of the document, the values of their channels, and the light that follows. */
#ifndef LUM_SERVER_WORLD_PATCHES_H
#define LUM_SERVER_WORLD_PATCHES_H

#include "core/light/light.h"
#include "protocol/document/document.h"
#include "server/desk/desk.h"

enum lum_patch_channels { LUM_PATCH_DIM, LUM_PATCH_DIM16, LUM_PATCH_RGB, LUM_PATCH_RGB16 };

struct lum_patch {
    lum_id target;
    struct lum_desk_key key;
    uint16_t address; /* from 0 */
    enum lum_patch_channels channels;
    enum lum_patch_curve { LUM_CURVE_LINEAR, LUM_CURVE_SQUARE, LUM_CURVE_DALI } curve;
    /* the newest state of its channels */
    bool known; /* somebody sent them once */
    float value[3];
};

struct lum_patches {
    struct lum_patch *items; /* sorted by target */
    size_t n;
    uint64_t generation; /* grows whenever they are collected anew */
};

/* Anew from the document; nothing is known of their channels then. False: no memory, they are as they were. */
bool lum_patches_collect(struct lum_patches *patches, const struct lum_document *doc);
void lum_patches_finish(struct lum_patches *patches);
uint32_t lum_patch_width(const struct lum_patch *patch); /* slots that it takes, from its address on */
/* Takes what its universe sends: slots, of which n were ever sent. True: the value is another. */
bool lum_patch_read(struct lum_patch *patch, const uint8_t *slots, uint32_t n);
/* Is there any light that is not as the document says? */
bool lum_patches_known(const struct lum_patches *patches);
/* Of lum_snapshot_relit; user: the patches. Those of a light and of its group multiply. A colour takes the place of the
 * light's own, and full white is as bright as the light is. */
void lum_patches_shine(void *user, struct lum_light *light);

#endif
