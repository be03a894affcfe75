/* Pages of HTML that need no other file. */
#ifndef LUM_SERVER_REPORT_PAGE_H
#define LUM_SERVER_REPORT_PAGE_H

#include <stdio.h>

#include "server/stream/png.h"

struct lum_page {
    FILE *f; /* in memory: what is not finished is no file */
    char *text;
    size_t n;
};
LUM_MUST_USE enum lum_status lum_page_begin(struct lum_page *ret_page, struct lum_error *err);
/* Its text, released with free; or, where status says that it failed, nothing. Returns the first failure. */
LUM_MUST_USE enum lum_status lum_page_end(struct lum_page *p, enum lum_status status, char **ret_text, size_t *ret_n,
                                          struct lum_error *err);
/* The same into a file. */
LUM_MUST_USE enum lum_status lum_page_end_file(struct lum_page *p, const char *path, enum lum_status status,
                                               struct lum_error *err);

void lum_page_text(FILE *f, const char *text); /* escaped, for elements and attributes */
/* Size, text and data of an <img>: its attributes, after a blank. */
LUM_MUST_USE enum lum_status lum_page_image(FILE *f, const struct lum_png *png, const char *alt, struct lum_error *err);

#endif
