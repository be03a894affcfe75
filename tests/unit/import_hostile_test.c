/* The readers over damaged input, inside this process so that a sanitizer sees every byte: all truncations and
 * single-bit flips of good files, and every allocation failing once. Nothing may crash, leak or hang; what is accepted
 * is checked by the limits of the stream. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "server/importer/image.h"
#include "server/importer/importer.h"

static enum lum_status import_gltf(const uint8_t *data, size_t n, struct lum_error *err)
{
    struct lum_importer im = {.emit = {.fd = -1}, .files = {-1}, .asset = "a.glb"};
    struct lum_bytes file = {(uint8_t *)(uintptr_t)data, n};
    lum_ids_init(&im.ids, "m");
    enum lum_status status = lum_gltf_import(&im, &file, err);
    lum_ids_finish(&im.ids);
    return status;
}

static enum lum_status decode_image(const uint8_t *data, size_t n, struct lum_error *err)
{
    struct lum_texels texels = {0};
    struct lum_bytes file = {(uint8_t *)(uintptr_t)data, n};
    enum lum_status status = lum_image_decode(&file, &texels, err);
    if (!status)
        lum_free(texels.pixels);
    return status;
}

/* ---- good files ---- */

struct file {
    uint8_t bytes[4096];
    size_t n;
};

static void append(struct file *f, const void *bytes, size_t n)
{
    memcpy(f->bytes + f->n, bytes, n);
    f->n += n;
}

/* A GLB with what there is: skin, morph target, sparse accessor, light, camera, texture, node tree. */
static void make_glb(struct file *f)
{
    static const char json[] =
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":256}],\"bufferViews\":["
        "{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,\"byteLength\":12},"
        "{\"buffer\":0,\"byteOffset\":48,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":96,\"byteLength\":64},"
        "{\"buffer\":0,\"byteOffset\":160,\"byteLength\":26}],\"accessors\":["
        "{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":5121,\"count\":3,\"type\":\"VEC4\"},"
        "{\"bufferView\":2,\"componentType\":5126,\"count\":3,\"type\":\"VEC4\"},"
        "{\"bufferView\":3,\"componentType\":5126,\"count\":1,\"type\":\"MAT4\"},"
        "{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,"
        "\"componentType\":5121},\"values\":{\"bufferView\":0}}}],"
        "\"images\":[{\"bufferView\":4}],\"textures\":[{\"source\":0}],\"materials\":[{\"pbrMetallicRoughness\":{"
        "\"baseColorTexture\":{\"index\":0}},\"emissiveFactor\":[1,1,1]}],\"skins\":[{\"joints\":[1],"
        "\"inverseBindMatrices\":3}],\"meshes\":[{\"weights\":[1],\"primitives\":[{\"material\":0,\"mode\":5,"
        "\"attributes\":{"
        "\"POSITION\":0,\"JOINTS_0\":1,\"WEIGHTS_0\":2},\"targets\":[{\"POSITION\":4}]}]}],"
        "\"cameras\":[{\"perspective\":{\"yfov\":1}}],\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":"
        "\"spot\"}"
        "]}},\"nodes\":[{\"mesh\":0,\"skin\":0,\"children\":[1]},{\"camera\":0,\"rotation\":[0,0,0,1],\"extensions\":{"
        "\"KHR_lights_punctual\":{\"light\":0}}}]}   ";
    uint32_t json_bytes = (uint32_t)(sizeof json - 1) & ~3u, bin_bytes = 256;
    uint8_t bin[256] = {0};
    float values[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, weights[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, matrix[16] = {0};
    for (int i = 0; i < 4; i++)
        matrix[5 * i] = 1;
    memcpy(bin, values, 36);
    memcpy(bin + 48, weights, 48);
    memcpy(bin + 96, matrix, 64);
    memcpy(bin + 160, "#?RADIANCE\n\n-Y 1 +X 1\n\x80\x40\x20\x81", 26);
    const uint32_t head[5] = {0x46546c67, 2, 12 + 8 + json_bytes + 8 + bin_bytes, json_bytes, 0x4e4f534a};
    const uint32_t bin_head[2] = {bin_bytes, 0x004e4942};
    append(f, head, sizeof head);
    append(f, json, json_bytes);
    append(f, bin_head, sizeof bin_head);
    append(f, bin, sizeof bin);
}

/* 16 x 3 in the new run-length coding, then flat. */
static void make_hdr(struct file *f)
{
    static const char head[] = "#?RADIANCE\nEXPOSURE=1.5\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 16\n";
    static const uint8_t line[] = {2, 2, 0, 16, 128 + 16, 7, 8,        1, 2,        3,  4,
                                   5, 6, 7, 8,  128 + 8,  9, 128 + 16, 1, 128 + 16, 130};
    append(f, head, sizeof head - 1);
    append(f, line, sizeof line);
    append(f, line, sizeof line);
    for (int i = 0; i < 8; i++)
        append(f, (uint8_t[]){1, 2, 3, 128, 1, 1, 1, 1}, 8); /* each pixel, and a run of one more */
}

typedef enum lum_status (*reader)(const uint8_t *data, size_t n, struct lum_error *err);

static void truncate_and_flip(reader read, const struct file *good)
{
    struct lum_error err = {0};
    if (read(good->bytes, good->n, &err))
        fail_msg("the good file is refused: %s", err.text);
    struct file bad;
    size_t refused = 0;
    for (size_t n = 0; n < good->n; n++) {
        bad = *good;
        refused += read(bad.bytes, n, &err) != LUM_OK;
    }
    assert_int_equal(refused, good->n); /* no byte of these files is spare */
    for (size_t bit = 0; bit < 8 * good->n; bit++) {
        bad = *good;
        bad.bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        refused += read(bad.bytes, bad.n, &err) != LUM_OK;
    }
    print_message("%zu of %zu damaged copies refused\n", refused, 9 * good->n);
}

static void glb_truncated_and_flipped(void **state)
{
    (void)state;
    struct file f = {.n = 0};
    make_glb(&f);
    truncate_and_flip(import_gltf, &f);
}

static void hdr_truncated_and_flipped(void **state)
{
    (void)state;
    struct file f = {.n = 0};
    make_hdr(&f);
    truncate_and_flip(decode_image, &f);
}

/* Each allocation of ours fails once: the import is refused, or a picture is left out, and nothing leaks. */
static void sweep(reader read, const struct file *f)
{
    size_t refused = 0;
    for (uint64_t k = 1; k <= 200; k++) { /* more than there are: the last runs are whole */
        struct lum_error err = {0};
        lum_alloc_fail_after(k);
        enum lum_status status = read(f->bytes, f->n, &err);
        lum_alloc_fail_after(0);
        assert_true(status == LUM_OK || status == LUM_ERR_NOMEM);
        refused += status != LUM_OK;
        assert_false(k == 200 && status);
    }
    assert_true(refused > 20);
}

static void glb_without_memory(void **state)
{
    (void)state;
    struct file f = {.n = 0};
    make_glb(&f);
    sweep(import_gltf, &f);
}

static void hdr_orientations(void **state)
{
    (void)state;
    /* a 2 x 1 picture, bright at the left, in all eight axis orders: what is read is the same picture or its transpose
     */
    static const char *const resolutions[8] = {"-Y 1 +X 2", "-Y 1 -X 2", "+Y 1 +X 2", "+Y 1 -X 2",
                                               "-X 1 +Y 2", "+X 1 +Y 2", "-X 1 -Y 2", "+X 1 -Y 2"};
    for (int i = 0; i < 8; i++) {
        char text[64];
        int n = snprintf(text, sizeof text, "#?RGBE\n\n%s\n", resolutions[i]);
        memcpy(text + n, "\x80\x80\x80\x81\x00\x00\x00\x00", 8);
        struct lum_texels t = {0};
        struct lum_bytes file = {(uint8_t *)text, (size_t)n + 8};
        struct lum_error err;
        if (lum_image_decode(&file, &t, &err))
            fail_msg("%s: %s", resolutions[i], err.text);
        const float *px = t.pixels;
        bool wide = i < 4, bright_first = i < 4 ? resolutions[i][5] == '+' : resolutions[i][5] == '-';
        assert_int_equal(t.width, wide ? 2 : 1);
        assert_int_equal(t.height, wide ? 1 : 2);
        assert_true((px[0] > px[3]) == bright_first);
        lum_free(t.pixels);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(glb_truncated_and_flipped),
        cmocka_unit_test(hdr_truncated_and_flipped),
        cmocka_unit_test(glb_without_memory),
        cmocka_unit_test(hdr_orientations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
