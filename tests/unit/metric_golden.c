#include "tests/unit/metric_golden.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/image/exr.h"
#include "core/math/color.h"
#include "server/stream/png.h"

static void read_png(const char *path, struct golden *ret)
{
    struct lum_png_image im;
    struct lum_error err;
    if (lum_png_read(path, 4096, &im, &err))
        fail_msg("%s", err.text);
    assert_true(im.w == GOLDEN_W && im.h == GOLDEN_H);
    for (int i = 0; i < GOLDEN_N; i++)
        for (int k = 0; k < 3; k++)
            ret->rgb[k][i] = lum_srgb8_to_linear[im.rgb[3 * i + k]];
    lum_free(im.rgb);
}

static void read_exr(const char *path, struct golden *ret)
{
    struct lum_exr_image im;
    struct lum_error err;
    if (lum_exr_read(path, 4096, 4096, &im, &err))
        fail_msg("%s", err.text);
    assert_true(im.w == GOLDEN_W && im.h == GOLDEN_H);
    for (int k = 0; k < 3; k++)
        for (uint32_t c = 0; c < im.n_channels; c++)
            if (strcmp(im.names[c], (const char *[]){"R", "G", "B"}[k]) == 0)
                memcpy(ret->rgb[k], im.pixels + (size_t)c * GOLDEN_N, sizeof ret->rgb[k]);
    lum_exr_finish(&im);
}

void golden_read(const char *name, struct golden *ret)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", METRIC_GOLDEN, name);
    if (strstr(name, ".png"))
        read_png(path, ret);
    else
        read_exr(path, ret);
}
