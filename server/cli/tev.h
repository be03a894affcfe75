/* Pictures for tev, a viewer of HDR images, by its protocol over TCP: packets of their length, 4 bytes, a kind and its
 * fields, all little-endian; text ends with a 0. Nothing is read: tev does not answer. */
#ifndef LUM_SERVER_CLI_TEV_H
#define LUM_SERVER_CLI_TEV_H

#include "core/image/exr.h"
#include "server/net/address.h"

struct lum_tev; /* a connection */

/* Waits 5 s at most, as each packet does later. */
LUM_MUST_USE enum lum_status lum_tev_connect(const struct lum_address *address, struct lum_tev **ret_tev,
                                             struct lum_error *err);
void lum_tev_close(struct lum_tev *tev); /* accepts NULL */

struct lum_tev_image {
    const char *name; /* tev replaces what it has under it, where begin is set */
    bool begin;
    uint32_t w, h;
    const struct lum_exr_channel *channels; /* those of its beginning, or some of them */
    uint32_t n_channels;
};
/* In bands of rows, of some MiB. Fails where tev has gone: the connection is then of no use. */
LUM_MUST_USE enum lum_status lum_tev_show(struct lum_tev *tev, const struct lum_tev_image *image,
                                          struct lum_error *err);

#endif
