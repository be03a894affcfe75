/* Real and hostile third-party files: every one is imported, or refused with a reason; the importer never crashes, and
 * this process survives. Needs ../shared/scenes, and says so where it is absent. */
#define _GNU_SOURCE
#include <ftw.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include <cmocka.h>

#include "tests/support/effort.h"
#include "tests/unit/import_kit.h"

#define SCENES LUMEND_SOURCE "/../shared/scenes"

static size_t count_triangles(const struct kit *k)
{
    size_t n = 0;
    for (size_t i = 0; i < k->result.n_records; i++)
        if (k->result.records[i]->type == LUM_RECORD_OBJECT)
            n += kit_find(k, k->result.records[i]->object.mesh)->mesh.indices.n / 3;
    return n;
}

/* ---- the walk; ftw gives its callback no context ---- */

static struct {
    char (*paths)[256]; /* below SCENES */
    size_t n, cap;
} found;

static const char *const model_endings[] = {"gltf", "glb", "obj", "3ds", "ase", "lwo", "md5mesh",
                                            "ply",  "raw", "smd", "x",   "xml", "off"};
static const char *const image_endings[] = {"png", "jpg", "jpeg", "hdr", "exr"};

static bool ends_in(const char *path, const char *const *endings, size_t n)
{
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < n; i++)
        if (strcasecmp(dot + 1, endings[i]) == 0)
            return true;
    return false;
}

static bool is_model(const char *path)
{
    return ends_in(path, model_endings, sizeof model_endings / sizeof model_endings[0]);
}

static bool is_image(const char *path)
{
    return ends_in(path, image_endings, sizeof image_endings / sizeof image_endings[0]);
}

static int visit(const char *path, const struct stat *st, int kind, struct FTW *ftw)
{
    (void)st;
    (void)ftw;
    if (kind != FTW_F || !(is_model(path) || is_image(path)))
        return 0;
    if (found.n == found.cap) {
        found.cap = found.cap ? 2 * found.cap : 256;
        found.paths = realloc(found.paths, found.cap * sizeof found.paths[0]);
        assert_non_null(found.paths);
    }
    snprintf(found.paths[found.n++], sizeof found.paths[0], "%s", path + strlen(SCENES) + 1);
    return 0;
}

static int compare_paths(const void *a, const void *b)
{
    return strcmp(a, b);
}

static void find_files(const char *folder)
{
    char path[512];
    found.n = 0;
    snprintf(path, sizeof path, SCENES "/%s", folder);
    assert_int_equal(nftw(path, visit, 16, FTW_PHYS), 0);
    qsort(found.paths, found.n, sizeof found.paths[0], compare_paths);
    assert_true(found.n > 0);
}

/* ---- importing ---- */

static bool import_image(struct kit *k, const char *path)
{
    struct lum_record *image = lum_record_create(LUM_RECORD_IMAGE, "pic"), *made = NULL;
    assert_non_null(image);
    snprintf(image->image.asset, sizeof image->image.asset, "%s", path);
    bool ok = lum_import_image(&k->config, image, NULL, &made, &k->err);
    lum_record_unref(image);
    lum_record_unref(made);
    return ok;
}

static bool import_any(struct kit *k, const char *path)
{
    memset(&k->err, 0, sizeof k->err);
    lum_import_result_finish(&k->result);
    return is_model(path) ? kit_import(k, path) : import_image(k, path);
}

/* A refusal is the importer's own word about the file, not the story of its death. */
static void assert_clean_refusal(const struct kit *k, const char *path)
{
    static const char *const deaths[] = {"crashed",         "sandbox",           "damaged output", "output is damaged",
                                         "ended too early", "failed at its end", "cannot start"};
    if (!k->err.text[0] || !k->err.app[0])
        fail_msg("%s: refused without a reason", path);
    for (size_t i = 0; i < sizeof deaths / sizeof deaths[0]; i++)
        if (strstr(k->err.text, deaths[i]))
            fail_msg("%s: %s", path, k->err.text);
}

static int setup(void **state)
{
    static struct kit kit;
    kit_open(&kit);
    kit.config.assets_dir = SCENES;
    *state = &kit;
    return 0;
}

static int teardown(void **state)
{
    kit_close(*state);
    return 0;
}

static void good_files_load(void **state)
{
    static const char *const folders[] = {"gltf_features", "interiors", "classic_gi", "cornell", "meshes", "envmaps"};
    struct kit *k = *state;
    size_t n = 0, refused = 0;
    for (size_t i = 0; i < sizeof folders / sizeof folders[0]; i++) {
        find_files(folders[i]);
        for (size_t j = 0; j < found.n; j++, n++) {
            const char *path = found.paths[j];
            if (import_any(k, path))
                continue;
            refused++;
            bool draco = strstr(path, "draco") && strstr(k->err.text, "KHR_draco_mesh_compression");
            bool dwa = strstr(path, "dwab.exr") && strcmp(k->err.app, "unsupported") == 0;
            if (!draco && !dwa)
                fail_msg("%s: %s", path, k->err.text);
        }
    }
    print_message("%zu files, %zu refused by name\n", n, refused);
}

/* The sanitizers end a program whose operator new gets no memory; elsewhere the reader says so. */
static bool needs_bad_alloc(const char *path)
{
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    return strstr(path, "OutOfMemory.off") != NULL;
#else
    (void)path;
    return false;
#endif
}

static void hostile_files_are_harmless(void **state)
{
    struct kit *k = *state;
    size_t refused = 0;
    find_files("malformed");
    for (size_t j = 0; j < found.n; j++) {
        const char *path = found.paths[j];
        if (needs_bad_alloc(path))
            continue;
        bool slow =
            strstr(path, "million_gon") != NULL; /* a face of 300 000 corners: quadratic, stopped by the CPU limit */
        k->config.cpu_s = slow ? 1 : 0;
        bool ok = import_any(k, path);
        refused += !ok;
        if (!ok && !slow)
            assert_clean_refusal(k, path);
        if (!ok && strstr(path, "/ok_"))
            fail_msg("%s: %s", path, k->err.text);
    }
    k->config.cpu_s = 0;
    print_message("%zu files, %zu refused\n", found.n, refused);
}

/* Rows of INDEX.md: | name | `path` | format, size | triangles | ... */
static bool parse_row(const char *line, char path[256], size_t *ret_triangles)
{
    const char *tick = strchr(line, '`'), *end = tick ? strchr(tick + 1, '`') : NULL;
    const char *bar = end ? strchr(end, '|') : NULL;
    bar = bar ? strchr(bar + 1, '|') : NULL;
    if (!bar || end - tick > 255)
        return false;
    snprintf(path, 256, "%.*s", (int)(end - tick - 1), tick + 1);
    *ret_triangles = 0;
    const char *p = bar + 1;
    for (; *p == ' ' || *p == ',' || (*p >= '0' && *p <= '9'); p++)
        if (*p >= '0' && *p <= '9')
            *ret_triangles = 10 * *ret_triangles + (size_t)(*p - '0');
    return *p == '|' && *ret_triangles > 0;
}

static void triangle_counts_are_those_of_the_index(void **state)
{
    struct kit *k = *state;
    FILE *f = fopen(SCENES "/INDEX.md", "r");
    assert_non_null(f);
    static char line[4096];
    size_t rows = 0, wrong = 0;
    while (fgets(line, sizeof line, f)) {
        char path[256];
        size_t want = 0;
        if (!parse_row(line, path, &want) || strncmp(path, "gltf_features", 13) == 0)
            continue;
        rows++;
        if (!kit_import(k, path))
            fail_msg("%s: %s", path, k->err.text);
        size_t got = count_triangles(k);
        if (got != want) {
            print_message("%s: %zu triangles, INDEX.md says %zu\n", path, got, want);
            wrong++;
        }
    }
    fclose(f);
    print_message("%zu models counted\n", rows);
    assert_true(rows > 20);
    assert_int_equal(wrong, 0);
}

/* The same model stored plainly and by EXT_meshopt_compression. */
static void meshopt_equals_its_decoded_copy(void **state)
{
    static const char *const pairs[][2] = {
        {"gltf_features/Ingenuity_MESHOPT.glb", "gltf_features/Ingenuity.glb"},
        {"gltf_features/japanese_bridge_garden_MESHOPT.glb", "gltf_features/japanese_bridge_garden.glb"},
    };
    struct kit *k = *state, plain = {.config = k->config};
    for (size_t p = 0; p < 2; p++) {
        assert_true(kit_import(k, pairs[p][0]));
        assert_true(kit_import(&plain, pairs[p][1]));
        assert_int_equal(k->result.n_records, plain.result.n_records);
        for (size_t i = 0; i < k->result.n_records; i++) {
            const struct lum_record *a = k->result.records[i], *b = plain.result.records[i];
            assert_string_equal(a->id, b->id);
            if (a->type != LUM_RECORD_MESH)
                continue;
            assert_int_equal(a->mesh.indices.n, b->mesh.indices.n);
            assert_memory_equal(a->mesh.indices.u32, b->mesh.indices.u32, 4 * a->mesh.indices.n);
            assert_int_equal(a->mesh.positions.n, b->mesh.positions.n);
            assert_memory_equal(a->mesh.positions.f32, b->mesh.positions.f32, 4 * a->mesh.positions.n);
        }
    }
    lum_import_result_finish(&plain.result);
}

/* ---- damaged copies of good files ---- */

static uint8_t *read_file(const char *path, size_t *ret_n)
{
    char full[512];
    snprintf(full, sizeof full, SCENES "/%s", path);
    FILE *f = fopen(full, "rb");
    assert_non_null(f);
    fseek(f, 0, SEEK_END);
    *ret_n = (size_t)ftell(f);
    rewind(f);
    uint8_t *data = malloc(*ret_n);
    assert_non_null(data);
    assert_int_equal(fread(data, 1, *ret_n, f), *ret_n);
    fclose(f);
    return data;
}

static uint32_t next_random(uint32_t *s) /* xorshift32 */
{
    *s ^= *s << 13;
    *s ^= *s >> 17;
    *s ^= *s << 5;
    return *s;
}

static void damaged_copies_are_harmless(void **state)
{
    static const char *const files[] = {"cornell/CornellBox-Original.glb", "cornell/obj/CornellBox-Original.obj",
                                        "gltf_features/CesiumMan.glb",     "meshes/obj/suzanne.obj",
                                        "envmaps/museum_piz.exr",          "gltf_features/Ingenuity_MESHOPT.glb"};
    struct kit *k = *state;
    k->config.assets_dir = k->dir;
    k->config.cpu_s = 20;
    size_t runs = 0, refused = 0;
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        size_t n = 0;
        uint8_t *good = read_file(files[i], &n);
        char name[32];
        snprintf(name, sizeof name, "copy%s", strrchr(files[i], '.'));
        for (uint32_t seed = 1; seed <= TEST_EFFORT(20); seed++, runs++) {
            uint32_t random = seed * 2654435761u;
            uint8_t *bad = malloc(n);
            assert_non_null(bad);
            memcpy(bad, good, n);
            size_t cut = seed % 4 == 0 ? next_random(&random) % n : n;
            for (uint32_t flips = seed % 4 == 0 ? 0 : 1u << seed % 8; flips; flips--)
                bad[next_random(&random) % n] ^= (uint8_t)(1u << next_random(&random) % 8);
            kit_write(k, name, bad, cut);
            free(bad);
            char copy[128];
            snprintf(copy, sizeof copy, "%s, seed %u", files[i], seed);
            if (import_any(k, name))
                continue;
            refused++;
            assert_clean_refusal(k, copy);
        }
        free(good);
    }
    print_message("%zu damaged copies, %zu refused\n", runs, refused);
}

int main(void)
{
    struct stat st;
    if (stat(SCENES, &st)) {
        puts("skipped: no ../shared/scenes");
        return 77;
    }
#define TEST(f) cmocka_unit_test_setup_teardown(f, setup, teardown)
    const struct CMUnitTest tests[] = {
        TEST(good_files_load),
        TEST(hostile_files_are_harmless),
        TEST(triangle_counts_are_those_of_the_index),
        TEST(meshopt_equals_its_decoded_copy),
        TEST(damaged_copies_are_harmless),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    free(found.paths);
    return failed;
}
