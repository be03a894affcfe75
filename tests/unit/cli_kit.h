/* The commands of lumend as a user calls them, in process. */
#ifndef LUM_TESTS_UNIT_CLI_KIT_H
#define LUM_TESTS_UNIT_CLI_KIT_H

#include <cjson/cJSON.h>

#include "core/image/exr.h"

/* The test's own folder: fixtures of a group. */
int cli_make_dir(void **state);
int cli_remove_dir(void **state);
/* A path in the folder; four of them live at a time. */
char *cli_in_dir(const char *name);

/* The words of line become argv; a word that starts with @ is a file in the folder. Returns the exit status. */
int cli_run(int (*command)(int, char **), const char *line);
/* What lumend render wrote to stderr; free it. */
char *cli_said(const char *line, int *ret_status);

/* These fail the test where there is no such thing. */
char *cli_read_text(const char *path); /* free it */
void cli_write_text(const char *path, const char *text);
struct lum_exr_image cli_read_exr(const char *name); /* in the folder; lum_exr_finish */
const float *cli_channel(const struct lum_exr_image *im, const char *name);
const cJSON *cli_member(const cJSON *o, const char *key);

#endif
