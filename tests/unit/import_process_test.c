/* The daemon's side of an import: whatever the child does, it is stopped, reaped and explained; and nothing outside the
 * asset's directory is opened. */
#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/image/exr.h"
#include "protocol/document/document.h"
#include "server/import/asset.h"
#include "tests/unit/import_kit.h"

static size_t count_fds(void)
{
    size_t n = 0;
    DIR *dir = opendir("/proc/self/fd");
    while (readdir(dir))
        n++;
    closedir(dir);
    return n;
}

struct fixture {
    struct kit kit;
    size_t n_fds;
};

static int setup(void **state)
{
    static struct fixture f;
    kit_open(&f.kit);
    f.n_fds = count_fds();
    *state = &f;
    return 0;
}

/* After every test: no child is left, and no descriptor. */
static int teardown(void **state)
{
    struct fixture *f = *state;
    assert_int_equal(waitpid(-1, NULL, WNOHANG), -1);
    assert_int_equal(errno, ECHILD);
    assert_int_equal(count_fds(), f->n_fds);
    kit_close(&f->kit);
    return 0;
}

/* A stand-in for the importer that runs a shell script. */
static void use_script(struct kit *k, const char *script)
{
    static char path[128];
    char text[1024];
    snprintf(text, sizeof text, "#!/bin/sh\n%s\n", script);
    kit_write_text(k, "importer.sh", text);
    snprintf(path, sizeof path, "%s/importer.sh", k->dir);
    assert_int_equal(chmod(path, 0755), 0);
    k->config.importer = path;
}

static void assert_fails(struct kit *k, const char *asset, const char *app, const char *text)
{
    assert_false(kit_import(k, asset));
    if (!strstr(k->err.text, text))
        fail_msg("\"%s\" does not say \"%s\"", k->err.text, text);
    assert_string_equal(k->err.app, app);
    assert_int_equal(k->result.n_records, 0);
}

static void ends_are_explained(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    kit_write_text(k, "a.obj", "");
    use_script(k, "kill -SEGV $$");
    assert_fails(k, "a.obj", "import_failed", "crashed (signal 11)");
    use_script(k, "kill -XCPU $$");
    assert_fails(k, "a.obj", "import_failed", "timed out after 120 s of CPU");
    use_script(k, "kill -SYS $$");
    assert_fails(k, "a.obj", "import_failed", "sandbox");
    use_script(k, "exit 0");
    assert_fails(k, "a.obj", "import_failed", "ended too early");
    use_script(k, "printf '\\005\\0\\0\\0\\0\\0\\0\\0'; exit 3");
    assert_fails(k, "a.obj", "import_failed", "failed at its end");
    k->config.importer = "/nonexistent";
    assert_fails(k, "a.obj", "import_failed", "cannot start /nonexistent");
}

static void damaged_output_is_refused(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    static const struct {
        const char *script, *text;
    } cases[] = {
        {"echo this is no chunk; exec sleep 1000", "damaged"},
        {"printf '\\001\\0\\0\\0\\377\\377\\377\\177'; exec sleep 1000", "damaged"},        /* an op of 2 GiB */
        {"printf '\\002\\0\\0\\0\\377\\377\\377\\377'; exec sleep 1000", "over the limit"}, /* a blob of 4 GiB */
        {"printf '\\001\\0\\0\\0\\002\\0\\0\\0{}'; exec sleep 1000", "op is missing"},      /* an op that is none */
        {"printf '\\003\\0\\0\\0\\002\\0\\0\\0{}'; exec sleep 1000", "damaged"}, /* progress without fields */
        {"printf '\\005\\0\\0\\0\\0\\0\\0\\0\\005\\0\\0\\0\\0\\0\\0\\0'; exec sleep 1000", "damaged"}, /* done twice */
        {"for i in 1 2 3 4 5 6 7 8 9; do printf '\\002\\0\\0\\0\\001\\0\\0\\0x'; done; exec sleep 1000", "damaged"},
        {"printf '\\006\\0\\0\\0\\002\\0\\0\\0no'; exec sleep 1000", "failed"}, /* an error that is no JSON */
    };
    kit_write_text(k, "a.obj", "");
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        print_message("case %zu\n", i);
        use_script(k, cases[i].script);
        assert_fails(k, "a.obj", strstr(cases[i].text, "limit") ? "limit_exceeded" : "import_failed", cases[i].text);
    }
}

static void foreign_ids_are_refused(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    const char *op = "{\"op\":\"add\",\"type\":\"medium\",\"id\":\"fog\"}";
    char script[256];
    snprintf(script, sizeof script, "printf '\\001\\0\\0\\0\\%03o\\0\\0\\0%s\\005\\0\\0\\0\\0\\0\\0\\0'",
             (unsigned)strlen(op), op);
    kit_write_text(k, "a.obj", "");
    use_script(k, script);
    assert_fails(k, "a.obj", "import_failed", "damaged");
}

static void cancel_kills(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    _Atomic bool cancel = true;
    kit_write_text(k, "a.obj", "");
    use_script(k, "exec sleep 1000");
    struct lum_record *import = lum_record_create(LUM_RECORD_IMPORT, "m");
    strcpy(import->import.asset, "a.obj");
    assert_false(lum_import_model(&k->config, import, NULL, NULL, &cancel, &k->result, &k->err));
    assert_string_equal(k->err.app, "cancelled");
    lum_record_unref(import);
}

struct canceller {
    char fifo[128];
    _Atomic bool cancel;
};

/* Cancels when somebody opens the fifo. */
static void *cancel_at_fifo(void *arg)
{
    struct canceller *c = arg;
    close(open(c->fifo, O_RDONLY));
    atomic_store(&c->cancel, true);
    return NULL;
}

/* Cancelling reaches a child that has closed its streams and stays; else it would be waited for five minutes. */
static void cancel_kills_a_silent_child(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    struct canceller c = {.cancel = false};
    char script[256];
    pthread_t thread;
    snprintf(c.fifo, sizeof c.fifo, "%s/fifo", k->dir);
    assert_int_equal(mkfifo(c.fifo, 0600), 0);
    kit_write_text(k, "a.obj", "");
    snprintf(script, sizeof script, "exec >&- 2>&-; sleep 0.2; : > %s; exec sleep 1000", c.fifo);
    use_script(k, script);
    assert_int_equal(pthread_create(&thread, NULL, cancel_at_fifo, &c), 0);
    struct lum_record *import = lum_record_create(LUM_RECORD_IMPORT, "m");
    strcpy(import->import.asset, "a.obj");
    assert_false(lum_import_model(&k->config, import, NULL, NULL, &c.cancel, &k->result, &k->err));
    lum_record_unref(import);
    pthread_join(thread, NULL);
}

/* A picture comes back under the id that was asked for, with pixels. */
static void foreign_pictures_are_refused(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    static const char *const ops[] = {
        "{\"op\":\"add\",\"type\":\"image\",\"id\":\"sky2\",\"width\":1,\"height\":1,\"pixels\":\"AAAAAA==\"}",
        "{\"op\":\"add\",\"type\":\"image\",\"id\":\"sky\",\"asset\":\"a.png\"}",
    };
    struct lum_record *image = lum_record_create(LUM_RECORD_IMAGE, "sky"), *decoded = NULL;
    strcpy(image->image.asset, "a.png");
    kit_write_text(k, "a.png", "");
    for (size_t i = 0; i < sizeof ops / sizeof ops[0]; i++) {
        char script[512];
        snprintf(script, sizeof script, "printf '\\001\\0\\0\\0\\%03o\\0\\0\\0%s\\005\\0\\0\\0\\0\\0\\0\\0'",
                 (unsigned)strlen(ops[i]), ops[i]);
        use_script(k, script);
        assert_false(lum_import_image(&k->config, image, NULL, &decoded, &k->err));
        assert_string_equal(k->err.app, "import_failed");
    }
    lum_record_unref(image);
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1 /* their own memory is in the way */
#else
#define SANITIZED 0
#endif

/* Of this process: the most it had in memory since peak_begin. */
static bool peak_begin(void)
{
    FILE *f = fopen("/proc/self/clear_refs", "w");
    return f && fputs("5", f) >= 0 && fclose(f) == 0;
}

static size_t peak_bytes(void)
{
    char line[128];
    size_t kib = 0;
    FILE *f = fopen("/proc/self/status", "r");
    while (f && fgets(line, sizeof line, f) && sscanf(line, "VmHWM: %zu", &kib) != 1)
        ;
    assert_non_null(f);
    fclose(f);
    return kib << 10;
}

/* What the importer sends in bulk is in memory once: the record has the very bytes that were read. */
static void large_pictures_are_in_memory_once(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    const char *op = "{\"op\":\"add\",\"type\":\"image\",\"id\":\"sky\",\"width\":4096,\"height\":4096,"
                     "\"pixels\":{\"blob\":0}}";
    const size_t n_bytes = 64u << 20;
    struct lum_record *image = lum_record_create(LUM_RECORD_IMAGE, "sky"), *decoded = NULL;
    strcpy(image->image.asset, "a.png");
    kit_write_text(k, "a.png", "");
    char script[512];
    snprintf(script, sizeof script,
             "printf '\\002\\0\\0\\0\\0\\0\\0\\004'; head -c %zu /dev/zero; "
             "printf '\\001\\0\\0\\0\\%03o\\0\\0\\0%s\\005\\0\\0\\0\\0\\0\\0\\0'",
             n_bytes, (unsigned)strlen(op), op);
    use_script(k, script);
    bool measured = peak_begin() && !SANITIZED;
    size_t before = measured ? peak_bytes() : 0;
    assert_true(lum_import_image(&k->config, image, NULL, &decoded, &k->err));
    if (measured && peak_bytes() - before > n_bytes + n_bytes / 2)
        fail_msg("%zu bytes for %zu", peak_bytes() - before, n_bytes);
    assert_int_equal(decoded->image.n_bytes, n_bytes);
    lum_record_unref(decoded);
    lum_record_unref(image);
}

static void cpu_time_is_limited(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    /* one face with 200 000 corners: ear clipping is quadratic */
    static char obj[8u << 20];
    size_t n = 0;
    for (int i = 0; i < 200000; i++)
        n += (size_t)snprintf(obj + n, sizeof obj - n, "v %.6f %.6f 0\n", cos(i * 3.14159265e-5),
                              sin(i * 3.14159265e-5));
    n += (size_t)snprintf(obj + n, sizeof obj - n, "f");
    for (int i = 1; i <= 200000; i++)
        n += (size_t)snprintf(obj + n, sizeof obj - n, " %d", i);
    kit_write(k, "a.obj", obj, n);
    k->config.cpu_s = 1;
    assert_fails(k, "a.obj", "import_failed", "timed out after 1 s of CPU");
}

static void memory_is_limited(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    /* a skin whose inverse bind matrices would fill 12 GiB, most of it zeros that the file does not hold */
    kit_write_text(k, "b.bin", "____________________________________________________________________");
    kit_write_text(
        k, "a.gltf",
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"uri\":\"b.bin\",\"byteLength\":68}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":4},{\"buffer\":0,\"byteLength\":64},"
        "{\"buffer\":0,\"byteLength\":36}],\"accessors\":[{\"componentType\":5126,\"count\":200000000,"
        "\"type\":\"MAT4\",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":0,\"componentType\":5125},"
        "\"values\":{\"bufferView\":1}}},{\"bufferView\":2,\"componentType\":5126,\"count\":3,"
        "\"type\":\"VEC3\"}],\"skins\":[{\"joints\":[0],\"inverseBindMatrices\":0}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":1}}]}],\"nodes\":[{\"mesh\":0,\"skin\":0}]}");
    assert_fails(k, "a.gltf", "limit_exceeded", "needed more than 4 GiB");
}

/* ---- files ---- */

static void nothing_outside_is_opened(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    char path[128], link_path[128];
    snprintf(path, sizeof path, "%s/sub", k->dir);
    assert_int_equal(mkdir(path, 0755), 0);
    snprintf(path, sizeof path, "%s/pipe", k->dir);
    assert_int_equal(mkfifo(path, 0644), 0);
    kit_write_text(k, "secret", "s");
    kit_write_text(k, "sub/inside", "i");
    snprintf(link_path, sizeof link_path, "%s/sub/link", k->dir);
    assert_int_equal(symlink("../secret", link_path), 0);
    snprintf(link_path, sizeof link_path, "%s/dirlink", k->dir);
    assert_int_equal(symlink("sub", link_path), 0);
    static const struct {
        const char *name;
        bool any_case;
        enum lum_status status;
    } cases[] = {
        {"sub/inside", false, LUM_OK},
        {"SUB/Inside", true, LUM_OK},
        {"SUB/Inside", false, LUM_ERR_NOT_FOUND},
        {"sub//inside", false, LUM_OK},
        {"", false, LUM_ERR_INVALID},
        {"/etc/passwd", false, LUM_ERR_INVALID},
        {"../secret", false, LUM_ERR_INVALID},
        {"sub/../secret", false, LUM_ERR_INVALID},
        {"./secret", false, LUM_ERR_INVALID},
        {"sub\\inside", false, LUM_ERR_INVALID},
        {"sub/link", false, LUM_ERR_INVALID},
        {"sub/LINK", true, LUM_ERR_INVALID},
        {"pipe", false, LUM_ERR_INVALID},
        {"sub", false, LUM_ERR_INVALID},
        {"sub/", false, LUM_ERR_INVALID},
        {"none", false, LUM_ERR_NOT_FOUND},
        {"secret/x", false, LUM_ERR_NOT_FOUND},
        {"..", false, LUM_ERR_INVALID},
    };
    int root_fd = open(k->dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    assert_true(root_fd >= 0);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        int fd = -1;
        uint64_t n = 0;
        enum lum_status status = lum_asset_open(root_fd, cases[i].name, cases[i].any_case, &fd, &n);
        if (status != cases[i].status)
            fail_msg("\"%s\": %s", cases[i].name, lum_status_text(status));
        if (!status) {
            assert_int_equal(n, 1);
            close(fd);
        }
    }
    int fd = -1;
    uint64_t n = 0;
    assert_int_not_equal(lum_asset_open(root_fd, "dirlink/inside", false, &fd, &n), LUM_OK);
    close(root_fd);
}

static void asset_names_stay_below_the_root(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    assert_fails(k, "../a.obj", "not_found", "below the asset directory");
    assert_fails(k, "/etc/passwd", "not_found", "below the asset directory");
    assert_fails(k, "none/a.obj", "not_found", "no such file");
    assert_fails(k, "none.obj", "not_found", "no such file");
    k->config.assets_dir = NULL;
    assert_fails(k, "a.obj", "unsupported", "--assets");
}

/* ---- other formats ---- */

static void obj_with_the_usual_traps(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    /* a quad by negative indices, no normals, a texture named in another letter case and with a backslash, CRLF */
    kit_write_text(
        k, "a.obj",
        "mtllib A.MTL\r\nv 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nvt 0 0\r\nvt 1 0\r\nvt 1 1\r\nvt 0 1\r\n"
        "o wall\r\nusemtl red paint\r\nf -4/-4 -3/-3 -2/-2 -1/-1\r\n");
    kit_write_text(k, "a.mtl", "newmtl red paint\r\nKd 0.5 0.25 0.125\r\nKe 1 1 1\r\nmap_Kd tex\\PIC.HDR\r\n");
    char path[128];
    snprintf(path, sizeof path, "%s/tex", k->dir);
    assert_int_equal(mkdir(path, 0755), 0);
    kit_write(k, "tex/pic.hdr", "#?RADIANCE\n\n-Y 1 +X 1\n\x80\x40\x20\x81", 26);
    if (!kit_import(k, "a.obj"))
        fail_msg("%s", k->err.text);
    const struct lum_record_mesh *mesh = &kit_only(k, LUM_RECORD_MESH)->mesh;
    assert_int_equal(mesh->indices.n, 6);
    assert_int_equal(mesh->positions.n, 12);
    assert_int_equal(mesh->normals.n, 12);
    for (size_t i = 0; i < 4; i++)
        assert_true(mesh->normals.f32[3 * i + 2] == 1.0f);
    double v_of_bottom = -1.0;
    for (size_t i = 0; i < 4; i++)
        if (mesh->positions.f32[3 * i] == 0.0f && mesh->positions.f32[3 * i + 1] == 0.0f)
            v_of_bottom = (double)mesh->uvs.f32[2 * i + 1];
    assert_true(v_of_bottom == 1.0); /* texture coordinates count from the top */
    const struct lum_record *m = kit_find(k, "m/material/red_paint");
    assert_true(m->material.base_color[0] == 0.5 && m->material.specular == 0.0);
    assert_true(fabs(m->material.emission_cd_m2 - 179.0) < 1e-4); /* floats of Assimp: 24 bits of 179 */
    assert_string_equal(m->material.base_color_texture.image, "m/image/PIC.HDR");
    assert_true(kit_warned(k, "photometric unit"));
}

/* ---- pictures ---- */

static struct lum_record *import_image(struct kit *k, const char *asset, const char *texel)
{
    struct lum_record *image = lum_record_create(LUM_RECORD_IMAGE, "pic"), *made = NULL;
    assert_non_null(image);
    snprintf(image->image.asset, sizeof image->image.asset, "%s", asset);
    snprintf(image->image.texel, sizeof image->image.texel, "%s", texel);
    if (!lum_import_image(&k->config, image, NULL, &made, &k->err))
        print_message("%s\n", k->err.text);
    lum_record_unref(image);
    return made;
}

static void hdr_picture(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    /* two lines from the bottom up, exposure 2; mantissas 128, 64, 0 of exponent 129: (m + 1/2) * 2^-7 / 2 */
    kit_write(k, "p.hdr",
              "#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n+Y 2 +X 1\n\x80\x40\x00\x81\x00\x00\x00\x00", 65);
    struct lum_record *r = import_image(k, "p.hdr", "srgb8");
    assert_non_null(r);
    assert_string_equal(r->image.texel, "rgb32f");
    assert_string_equal(r->image.asset, "p.hdr");
    float px[6];
    assert_int_equal(r->image.n_bytes, sizeof px);
    memcpy(px, r->image.pixels, sizeof px);
    const float want[6] = {0, 0, 0, 128.5f / 256.0f, 64.5f / 256.0f, 0.5f / 256.0f};
    for (int i = 0; i < 6; i++)
        assert_true(px[i] == want[i]);
    lum_record_unref(r);
}

static void exr_picture(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    const float px[12] = {1, 2, 3, 4, 5, 6, 70000, 8, 0.5f, 10, -1, 12};
    const struct lum_exr_channel c[3] = {{"R", px, 3, false}, {"G", px + 1, 3, false}, {"B", px + 2, 3, false}};
    char path[128];
    snprintf(path, sizeof path, "%s/p.exr", k->dir);
    assert_int_equal(lum_exr_write(path, 2, 2, c, 3, NULL, 0, NULL), LUM_OK);
    struct lum_record *r = import_image(k, "p.exr", "srgb8");
    assert_non_null(r);
    float got[12];
    assert_int_equal(r->image.n_bytes, sizeof got);
    memcpy(got, r->image.pixels, sizeof got);
    for (int i = 0; i < 12; i++)
        assert_true(got[i] == (px[i] < 0 ? 0 : px[i])); /* no negative light */
    lum_record_unref(r);
}

static void no_picture(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    kit_write_text(k, "p.png", "<html>");
    assert_null(import_image(k, "p.png", "srgb8"));
    assert_string_equal(k->err.app, "unsupported");
    kit_write_text(k, "q.png", "\x89PNG\r\n\x1a\n");
    assert_null(import_image(k, "q.png", "srgb8"));
    assert_string_equal(k->err.app, "import_failed");
}

/* ---- placing ---- */

static void import_transform_moves_everything(void **state)
{
    struct kit *k = &((struct fixture *)*state)->kit;
    kit_write_text(
        k, "a.gltf",
        "{\"asset\":{\"version\":\"2.0\"},\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"spot\"}]}},"
        "\"cameras\":[{\"perspective\":{\"yfov\":1}}],\"nodes\":[{\"name\":\"n\",\"translation\":[1,0,0],\"camera\":0,"
        "\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}}]}");
    struct lum_record *import = lum_record_create(LUM_RECORD_IMPORT, "m");
    strcpy(import->import.asset, "a.gltf");
    import->import.transform.translate[1] = 10;
    import->import.transform.rotate_deg[1] = 90; /* x to -z */
    for (int i = 0; i < 3; i++)
        import->import.transform.scale[i] = 2;
    assert_true(lum_import_model(&k->config, import, NULL, NULL, NULL, &k->result, &k->err));
    struct lum_op op = {.kind = LUM_OP_IMPORT, .id = "m", .record = import};
    struct lum_import_children children = {.import_id = "m", .records = k->result.records, .n = k->result.n_records};
    struct lum_document *doc = lum_document_create();
    struct lum_changes changes = {0};
    assert_true(lum_document_apply(doc, "ann", &(struct lum_ops){.ops = &op, .n = 1}, &children, 1, &changes, &k->err));
    const struct lum_record_camera *c = &lum_document_find(doc, kit_only(k, LUM_RECORD_CAMERA)->id)->camera;
    const struct lum_record_light *l = &lum_document_find(doc, kit_only(k, LUM_RECORD_LIGHT)->id)->light;
    const double position[3] = {0, 10, -2};
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(c->position[i] - position[i]) < 1e-12);
        assert_true(fabs(l->position[i] - position[i]) < 1e-12);
    }
    assert_true(c->target[0] < -1.9 && l->direction[0] < -1.9); /* looking along -z becomes -x */
    assert_true(l->intensity_cd.value == 1.0);
    lum_changes_finish(&changes);
    lum_document_destroy(doc);
    lum_record_unref(import);
}

int main(void)
{
#define TEST(f) cmocka_unit_test_setup_teardown(f, setup, teardown)
    const struct CMUnitTest tests[] = {
        TEST(ends_are_explained),
        TEST(damaged_output_is_refused),
        TEST(foreign_ids_are_refused),
        TEST(cancel_kills),
        TEST(cancel_kills_a_silent_child),
        TEST(foreign_pictures_are_refused),
        TEST(large_pictures_are_in_memory_once),
        TEST(cpu_time_is_limited),
        TEST(memory_is_limited),
        TEST(nothing_outside_is_opened),
        TEST(asset_names_stay_below_the_root),
        TEST(obj_with_the_usual_traps),
        TEST(hdr_picture),
        TEST(exr_picture),
        TEST(no_picture),
        TEST(import_transform_moves_everything),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
