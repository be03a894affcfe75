/* lumend compare as a user calls it, in process. */
#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/cli/commands.h"
#include "tests/unit/cli_kit.h"

static void write_exr(const char *name, float value)
{
    float pixels[4 * 4 * 3];
    for (size_t i = 0; i < LUM_ARRAY_LEN(pixels); i++)
        pixels[i] = value;
    struct lum_exr_channel c[3] = {{"R", pixels, 3, false}, {"G", pixels + 1, 3, false}, {"B", pixels + 2, 3, false}};
    assert_int_equal(lum_exr_write(cli_in_dir(name), 4, 4, c, 3, NULL, 0, NULL), LUM_OK);
}

/* Runs compare with stdout in a file. */
static cJSON *compare(const char *line, int *ret_status)
{
    fflush(stdout);
    int saved = dup(STDOUT_FILENO), out = open(cli_in_dir("stdout"), O_CREAT | O_TRUNC | O_RDWR, 0600);
    dup2(out, STDOUT_FILENO);
    *ret_status = cli_run(lum_cmd_compare, line);
    fflush(stdout);
    dup2(saved, STDOUT_FILENO);
    close(out);
    close(saved);
    if (*ret_status)
        return NULL;
    char *text = cli_read_text(cli_in_dir("stdout"));
    cJSON *o = cJSON_Parse(text);
    free(text);
    return o;
}

/* x = 1.125 r with r = 1024, both exact: relMSE = 128^2 / (1024^2 + 0.01) = 1/64 to 1e-8. */
static void compare_gives_closed_forms(void **state)
{
    (void)state;
    int status;
    write_exr("r.exr", 1024.0f);
    write_exr("x.exr", 1152.0f);
    cJSON *o = compare("compare @x.exr @r.exr --heatmap @heat.png", &status);
    assert_int_equal(status, LUM_EXIT_OK);
    assert_true(fabs(cli_member(o, "relmse")->valuedouble - 1.0 / 64.0) < 1e-8);
    assert_true(fabs(cli_member(o, "rmse")->valuedouble - 128.0) < 1e-9);
    assert_true(fabs(cli_member(o, "smape")->valuedouble - 128.0 / (2176.0 + 0.01)) < 1e-12);
    assert_int_equal(access(cli_in_dir("heat.png"), R_OK), 0);
    cJSON_Delete(o);
    o = compare("compare @x.exr @r.exr --metric rmse", &status);
    assert_null(cJSON_GetObjectItem(o, "relmse"));
    cli_member(o, "rmse");
    cJSON_Delete(o);
    compare("compare @x.exr", &status);
    assert_int_equal(status, LUM_EXIT_USAGE);
    compare("compare @x.exr @r.exr --metric flip", &status);
    assert_int_equal(status, LUM_EXIT_USAGE);
    compare("compare @x.exr @none.exr", &status);
    assert_int_equal(status, LUM_EXIT_FAILED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(compare_gives_closed_forms),
    };
    return cmocka_run_group_tests(tests, cli_make_dir, cli_remove_dir);
}
