/* The ops of a scene.apply from arbitrary bytes; what is accepted comes back the same after writing and reading. */
#include "tests/fuzz/fuzz.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "tests/unit/protocol_util.h"

static void check_round_trip(const struct lum_op *op)
{
    cJSON *json = lum_op_to_json(op);
    char *text = json ? lum_json_print(json, NULL) : NULL;
    FUZZ_REQUIRE(text);
    struct lum_proto_error err = {0};
    cJSON *parsed = lum_json_parse(text, strlen(text), &err);
    struct lum_op again;
    FUZZ_REQUIRE(parsed && lum_op_from_json(parsed, NULL, &again, &err));
    FUZZ_REQUIRE(again.kind == op->kind && strcmp(again.id, op->id) == 0);
    FUZZ_REQUIRE(!op->record || records_equal(op->record, again.record));
    FUZZ_REQUIRE(!op->value || cJSON_Compare(op->value, again.value, true));
    lum_op_finish(&again);
    cJSON_Delete(parsed);
    cJSON_Delete(json);
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct lum_proto_error err = {0};
    cJSON *json = lum_json_parse((const char *)data, n, &err);
    struct lum_ops ops;
    if (!json) {
        FUZZ_REQUIRE(err.code != LUM_PROTO_OK && err.text[0]);
        return 0;
    }
    if (lum_ops_from_json(json, &ops, &err)) {
        for (size_t i = 0; i < ops.n; i++)
            check_round_trip(&ops.ops[i]);
        lum_ops_finish(&ops);
    } else {
        FUZZ_REQUIRE(err.code != LUM_PROTO_OK && err.text[0]);
    }
    cJSON_Delete(json);
    return 0;
}
