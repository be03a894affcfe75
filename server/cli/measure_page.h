/* lumend measure --html: what was measured as a page to print, with pictures, in one file that needs no other. */
#ifndef LUM_SERVER_CLI_MEASURE_PAGE_H
#define LUM_SERVER_CLI_MEASURE_PAGE_H

#include "server/cli/measure_report.h"
#include "server/world/world.h"

struct lum_measure_page {
    const char *scene;
    const struct lum_world *world; /* published */
    const struct lum_measured *measured;
    size_t n;
    uint32_t pictures_spp;                  /* samples per pixel; 0: no pictures */
    void (*tell)(void *user, uint32_t spp); /* while pictures are made */
    void *user;
};

LUM_MUST_USE enum lum_status lum_measure_page_write(const char *path, const struct lum_measure_page *page,
                                                    struct lum_error *err);

#endif
