/* Messages to the server and to a client from arbitrary bytes; every refusal can be told. */
#include "tests/fuzz/fuzz.h"

#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/message/rpc.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    struct lum_rpc rpc;
    struct lum_rpc_incoming in;
    struct lum_proto_error err = {0};
    bool ok = lum_rpc_parse((const char *)data, n, &rpc, &err);
    char *reply = ok ? lum_rpc_result(rpc.id ? rpc.id : "null", cJSON_CreateObject()) : lum_rpc_error(rpc.id, &err);
    FUZZ_REQUIRE(reply);
    FUZZ_REQUIRE(lum_rpc_parse_incoming(reply, strlen(reply), &in, &err));
    FUZZ_REQUIRE(ok ? in.result != NULL : in.error != NULL);
    lum_rpc_incoming_finish(&in);
    free(reply);
    lum_rpc_finish(&rpc);
    free(lum_rpc_scan_id((const char *)data, n));
    if (lum_rpc_parse_incoming((const char *)data, n, &in, &err))
        lum_rpc_incoming_finish(&in);
    return 0;
}
