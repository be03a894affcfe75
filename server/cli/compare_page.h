/* lumend compare --html: both pictures and the maps in one file, that needs no other. */
#ifndef LUM_SERVER_CLI_COMPARE_PAGE_H
#define LUM_SERVER_CLI_COMPARE_PAGE_H

#include "server/cli/compare_measure.h"

/* comparison: measured, with maps and shown. json: the result as it is printed. */
LUM_MUST_USE enum lum_status lum_compare_page_write(const char *path, const struct lum_comparison *comparison,
                                                    const char *json, struct lum_error *err);

#endif
