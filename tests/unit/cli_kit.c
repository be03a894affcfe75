#define _GNU_SOURCE /* mkdtemp */
#include "tests/unit/cli_kit.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/cli/commands.h"

enum { MAX_ARGS = 24 };

static char dir[64]; /* the test's own folder */

int cli_make_dir(void **state)
{
    (void)state;
    snprintf(dir, sizeof dir, "/tmp/lumend-test-XXXXXX");
    return mkdtemp(dir) ? 0 : -1;
}

int cli_remove_dir(void **state)
{
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -r '%s'", dir);
    return system(command);
}

char *cli_in_dir(const char *name)
{
    static char paths[4][128];
    static int next;
    char *p = paths[next++ % 4];
    snprintf(p, sizeof paths[0], "%s/%s", dir, name);
    return p;
}

int cli_run(int (*command)(int, char **), const char *line)
{
    char text[2048], *argv[MAX_ARGS + 1], owned[MAX_ARGS][512];
    int argc = 0;
    snprintf(text, sizeof text, "%s", line);
    for (char *word = strtok(text, " "); word && argc < MAX_ARGS; word = strtok(NULL, " ")) {
        snprintf(owned[argc], sizeof owned[0], "%s", word[0] == '@' ? cli_in_dir(word + 1) : word);
        argv[argc] = owned[argc];
        argc++;
    }
    argv[argc] = NULL;
    return command(argc, argv);
}

char *cli_read_text(const char *path)
{
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    char *text = calloc(1, 1 << 20);
    assert_non_null(text);
    assert_true(fread(text, 1, (1 << 20) - 1, f) > 0);
    fclose(f);
    return text;
}

void cli_write_text(const char *path, const char *text)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_true(fputs(text, f) >= 0);
    assert_int_equal(fclose(f), 0);
}

const float *cli_channel(const struct lum_exr_image *im, const char *name)
{
    for (uint32_t i = 0; i < im->n_channels; i++)
        if (strcmp(im->names[i], name) == 0)
            return im->pixels + (size_t)i * im->w * im->h;
    fail_msg("no channel %s", name);
    return NULL;
}

struct lum_exr_image cli_read_exr(const char *name)
{
    struct lum_exr_image im;
    struct lum_error err;
    if (lum_exr_read(cli_in_dir(name), 4096, 4096, &im, &err))
        fail_msg("%s", err.text);
    return im;
}

const cJSON *cli_member(const cJSON *o, const char *key)
{
    const cJSON *m = cJSON_GetObjectItemCaseSensitive(o, key);
    if (!m)
        fail_msg("no member %s", key);
    return m;
}

char *cli_said(const char *line, int *ret_status)
{
    char path[128];
    snprintf(path, sizeof path, "%s/stderr.txt", dir);
    fflush(stderr);
    int saved = dup(STDERR_FILENO), file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    assert_true(saved >= 0 && file >= 0 && dup2(file, STDERR_FILENO) >= 0);
    *ret_status = cli_run(lum_cmd_render, line);
    fflush(stderr);
    assert_true(dup2(saved, STDERR_FILENO) >= 0);
    close(saved);
    close(file);
    return cli_read_text(path);
}
