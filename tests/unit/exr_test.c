/* OpenEXR files: round trip, half saturation, refusals, nothing left behind by a failed write. */
#define _GNU_SOURCE /* mkdtemp */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/image/exr.h"

#define W 37 /* not a multiple of the 16 rows of a ZIP chunk, nor of anything else */
#define H 21

static char dir[64];
static char path[128];

static int make_dir(void **state)
{
    (void)state;
    snprintf(dir, sizeof dir, "/tmp/lum-exr-XXXXXX");
    if (!mkdtemp(dir))
        return -1;
    snprintf(path, sizeof path, "%s/a.exr", dir);
    return 0;
}

static int count_files(void)
{
    DIR *d = opendir(dir);
    int n = 0;
    for (struct dirent *e; (e = readdir(d));)
        n += e->d_name[0] != '.';
    closedir(d);
    return n;
}

static int remove_dir(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(dir);
}

static float value(int c, int x, int y)
{
    return (float)(c * 10000 + y * 100 + x) / 64.0f; /* exact in half up to 2048 / 64 steps of 1/32: c = 0 only */
}

static enum lum_status write_file(uint32_t w, uint32_t h, const float *rgb, bool half)
{
    struct lum_exr_channel c[3] = {{"R", rgb, 3, half}, {"G", rgb + 1, 3, half}, {"key.B", rgb + 2, 3, half}};
    struct lum_exr_attribute a[2] = {{"lumend:stats", "{\"frames\":[]}"}, {"lumend:empty", ""}};
    struct lum_error err = {0};
    return lum_exr_write(path, w, h, c, 3, a, 2, &err);
}

static const float *plane(const struct lum_exr_image *img, const char *name)
{
    for (uint32_t i = 0; i < img->n_channels; i++)
        if (strcmp(img->names[i], name) == 0)
            return img->pixels + (size_t)i * img->w * img->h;
    return NULL;
}

static void floats_come_back_bit_for_bit(void **state)
{
    (void)state;
    static float rgb[W * H * 3];
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            for (int c = 0; c < 3; c++)
                rgb[(y * W + x) * 3 + c] = value(c, x, y);
    rgb[0] = 1e6f;
    rgb[1] = 3.0e38f;
    rgb[2] = -1e-30f;
    assert_int_equal(write_file(W, H, rgb, false), LUM_OK);
    assert_int_equal(count_files(), 1);
    struct lum_exr_image img;
    struct lum_error err = {0};
    assert_int_equal(lum_exr_read(path, W, H, &img, &err), LUM_OK);
    assert_int_equal(img.w, W);
    assert_int_equal(img.h, H);
    assert_int_equal(img.n_channels, 3);
    const float *p[3] = {plane(&img, "R"), plane(&img, "G"), plane(&img, "key.B")};
    for (int i = 0; i < W * H; i++)
        for (int c = 0; c < 3; c++)
            if (memcmp(&p[c][i], &rgb[3 * i + c], sizeof(float)) != 0)
                fail_msg("pixel %d channel %d: wrote %a, read %a", i, c, (double)rgb[3 * i + c], (double)p[c][i]);
    lum_exr_finish(&img);
}

static void halves_saturate(void **state)
{
    (void)state;
    static float rgb[W * H * 3];
    rgb[0] = 1e6f;
    rgb[1] = -1e6f;
    rgb[2] = 65504.0f;
    rgb[3] = INFINITY;
    rgb[4] = 0.5f;
    assert_int_equal(write_file(W, H, rgb, true), LUM_OK);
    struct lum_exr_image img;
    assert_int_equal(lum_exr_read(path, W, H, &img, NULL), LUM_OK);
    assert_true(plane(&img, "R")[0] == 65504.0f);
    assert_true(plane(&img, "G")[0] == -65504.0f);
    assert_true(plane(&img, "key.B")[0] == 65504.0f);
    assert_true(plane(&img, "R")[1] == 65504.0f);
    assert_true(plane(&img, "G")[1] == 0.5f);
    lum_exr_finish(&img);
}

static void limits_and_broken_files_are_refused(void **state)
{
    (void)state;
    static float rgb[W * H * 3];
    assert_int_equal(write_file(W, H, rgb, false), LUM_OK);
    struct lum_exr_image img;
    struct lum_error err = {0};
    assert_int_equal(lum_exr_read(path, W - 1, H, &img, &err), LUM_ERR_LIMIT);
    assert_non_null(strstr(err.text, "limit is 36 x 21"));
    assert_int_equal(lum_exr_read(path, W, H - 1, &img, &err), LUM_ERR_LIMIT);
    assert_int_equal(lum_exr_read("/nonexistent/a.exr", W, H, &img, &err), LUM_ERR_IO);
    assert_int_equal(write_file(0, H, rgb, false), LUM_ERR_INVALID);

    /* Truncated at every length, and each byte flipped: an error or an image, never a crash. */
    FILE *f = fopen(path, "rb");
    static unsigned char bytes[1 << 16];
    size_t n = fread(bytes, 1, sizeof bytes, f);
    fclose(f);
    for (size_t i = 0; i < 2 * n; i++) {
        f = fopen(path, "wb");
        size_t len = i < n ? i : n;
        if (i >= n)
            bytes[i - n] ^= 0xff;
        fwrite(bytes, 1, len, f);
        if (i >= n)
            bytes[i - n] ^= 0xff;
        fclose(f);
        if (lum_exr_read(path, 256, 256, &img, &err) == LUM_OK)
            lum_exr_finish(&img);
    }
}

static void failed_write_keeps_the_old_file(void **state)
{
    (void)state;
    static float rgb[W * H * 3];
    rgb[0] = 7.0f;
    assert_int_equal(write_file(W, H, rgb, false), LUM_OK);
    rgb[0] = 8.0f;
    lum_alloc_fail_after(1);
    assert_int_equal(write_file(W, H, rgb, false), LUM_ERR_NOMEM);
    lum_alloc_fail_after(0);
    assert_int_equal(count_files(), 1);
    struct lum_exr_image img;
    for (uint64_t k = 1; k <= 2; k++) {
        lum_alloc_fail_after(k);
        assert_int_equal(lum_exr_read(path, W, H, &img, NULL), LUM_ERR_NOMEM);
    }
    lum_alloc_fail_after(0);
    assert_int_equal(lum_exr_read(path, W, H, &img, NULL), LUM_OK);
    assert_true(plane(&img, "R")[0] == 7.0f);
    lum_exr_finish(&img);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(floats_come_back_bit_for_bit),
        cmocka_unit_test(halves_saturate),
        cmocka_unit_test(limits_and_broken_files_are_refused),
        cmocka_unit_test(failed_write_keeps_the_old_file),
    };
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
