/* The glTF writer where memory is short, and at the limit of its size. What it writes is read back by
 * e2e/export_test.py.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <cjson/cJSON.h>

#include "protocol/op/op.h"
#include "server/export/export.h"

static const char scene[] =
    "{\"lumend\":1,\"kind\":\"scene\"}\n"
    "{\"op\":\"add\",\"type\":\"image\",\"id\":\"dot\",\"width\":1,\"height\":1,\"pixels\":\"gIAAgA==\"}\n"
    "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"box\",\"shape\":\"box\"}\n"
    "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"leaf\",\"positions\":[0,0,0,0.1,0,0,0,1,0],\"indices\":[0,1,2],"
    "\"normals\":[0,0,2,0,0,1,0,0,1]}\n"
    "{\"op\":\"add\",\"type\":\"material\",\"id\":\"glow\",\"emission_cd_m2\":5,\"base_color_texture\":{\"image\":"
    "\"dot\"}}\n"
    "{\"op\":\"add\",\"type\":\"object\",\"id\":\"a\",\"mesh\":\"box\",\"material\":\"glow\",\"flux_lm\":3}\n"
    "{\"op\":\"add\",\"type\":\"object\",\"id\":\"b\",\"mesh\":\"leaf\",\"material\":\"glow\","
    "\"transform\":[1,0.5,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}\n"
    "{\"op\":\"add\",\"type\":\"light\",\"id\":\"lamp\",\"kind\":\"ies\",\"position\":[0,2,0],"
    "\"web\":{\"c_deg\":[0],\"gamma_deg\":[0,90],\"candela\":[100,0]}}\n"
    "{\"op\":\"add\",\"type\":\"camera\",\"id\":\"main\",\"position\":[0,0,5],\"target\":[0,0,0]}\n";

struct records {
    struct lum_ops ops;
    struct lum_record *list[16];
    size_t n;
};

static void read_records(struct records *r)
{
    struct lum_proto_error err;
    *r = (struct records){0};
    if (!lum_ops_from_jsonl(scene, sizeof scene - 1, &r->ops, &err))
        fail_msg("%s", err.text);
    for (size_t i = 0; i < r->ops.n; i++)
        r->list[r->n++] = r->ops.ops[i].record;
}

static enum lum_status write_scene(const struct records *r, uint64_t max_bytes, const _Atomic bool *cancel,
                                   uint64_t *ret_size, struct lum_error *err)
{
    const struct lum_export_source source = {r->list, r->n, max_bytes, cancel};
    struct lum_glb *glb = NULL;
    enum lum_status status = lum_export_scene(&source, &glb, err);
    if (status)
        return status;
    *ret_size = lum_glb_size(glb);
    uint8_t *bytes = malloc((size_t)*ret_size);
    assert_non_null(bytes);
    lum_glb_copy(glb, bytes);
    assert_memory_equal(bytes, "glTF\2\0\0\0", 8);
    free(bytes);
    lum_glb_destroy(glb);
    return LUM_OK;
}

static void test_each_allocation_may_fail(void **state)
{
    (void)state;
    struct records r;
    uint64_t size = 0;
    read_records(&r);
    uint64_t k = 1;
    for (enum lum_status status = LUM_ERR_NOMEM; status; k++) {
        struct lum_error err = {0};
        lum_alloc_fail_after(k);
        status = write_scene(&r, LUM_LIMIT_EXPORT_BYTES, NULL, &size, &err);
        lum_alloc_fail_after(0);
        assert_true(status == LUM_OK || status == LUM_ERR_NOMEM);
    }
    assert_true(k > 3); /* it allocates: the loop failed some of them */
    lum_ops_finish(&r.ops);
}

static uint64_t allocations_left; /* of cJSON's, of this one test; 0: all succeed */

static void *scarce_malloc(size_t n)
{
    return allocations_left > 0 && --allocations_left == 0 ? NULL : malloc(n);
}

static void test_each_piece_of_json_may_fail(void **state)
{
    (void)state;
    struct records r;
    uint64_t size = 0, k = 1;
    cJSON_Hooks hooks = {scarce_malloc, free};
    read_records(&r);
    cJSON_InitHooks(&hooks);
    for (enum lum_status status = LUM_ERR_NOMEM; status; k++) {
        struct lum_error err = {0};
        allocations_left = k;
        status = write_scene(&r, LUM_LIMIT_EXPORT_BYTES, NULL, &size, &err);
        assert_true(allocations_left > 0 || status == LUM_ERR_NOMEM);
    }
    allocations_left = 0;
    cJSON_InitHooks(NULL);
    assert_true(k > 100);
    lum_ops_finish(&r.ops);
}

static void test_a_file_is_as_large_as_it_may_be(void **state)
{
    (void)state;
    struct records r;
    struct lum_error err;
    uint64_t size, again, least = 0;
    read_records(&r);
    assert_int_equal(write_scene(&r, LUM_LIMIT_EXPORT_BYTES, NULL, &size, &err), LUM_OK);
    for (uint64_t most = size + 64; most > 0 && !least; most--) /* its margin is that of a header and paddings */
        if (write_scene(&r, most, NULL, &again, &err))
            least = most;
    assert_int_equal(err.status, LUM_ERR_LIMIT);
    assert_non_null(strstr(err.text, "larger than 0 MiB"));
    assert_int_equal(write_scene(&r, least + 1, NULL, &again, &err), LUM_OK);
    assert_true(again <= least + 1);
    assert_int_equal(write_scene(&r, 1, NULL, &again, &err), LUM_ERR_LIMIT);
    lum_ops_finish(&r.ops);
}

static void test_it_can_be_stopped(void **state)
{
    (void)state;
    struct records r;
    struct lum_error err;
    uint64_t size;
    _Atomic bool stop = true;
    read_records(&r);
    assert_int_equal(write_scene(&r, LUM_LIMIT_EXPORT_BYTES, &stop, &size, &err), LUM_ERR_CANCELLED);
    lum_ops_finish(&r.ops);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_allocation_may_fail),
        cmocka_unit_test(test_each_piece_of_json_may_fail),
        cmocka_unit_test(test_a_file_is_as_large_as_it_may_be),
        cmocka_unit_test(test_it_can_be_stopped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
