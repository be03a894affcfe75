/* JSON texts, typed reading, the JSON-RPC envelope. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>
#include <sys/mman.h>
#include <unistd.h>

#include "protocol/base/nearest.h"
#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "tests/unit/protocol_util.h"

static bool parses(const char *text, size_t n, struct lum_proto_error *err)
{
    cJSON *json = lum_json_parse(text, n, err);
    cJSON_Delete(json);
    return json != NULL;
}

static void strict_grammar(void **state)
{
    static const char *const good[] = {"null",
                                       "true",
                                       " [ ] ",
                                       "{}",
                                       "-0",
                                       "1e5",
                                       "1.5E-3",
                                       "\"\\u00e9\\n\"",
                                       "[1,2]",
                                       "{\"a\":{\"b\":[null]}}",
                                       "\"\xf0\x9f\x98\x80\"",
                                       "\"\\ud83d\\ude00\""};
    static const char *const bad[] = {"",
                                      " ",
                                      "nul",
                                      "NaN",
                                      "[NaN]",
                                      "Infinity",
                                      "-Infinity",
                                      "[1e999]",
                                      "01",
                                      "1.",
                                      ".5",
                                      "+1",
                                      "1e",
                                      "-",
                                      "0x10",
                                      "'a'",
                                      "\"\\x\"",
                                      "\"\\u12g4\"",
                                      "\"\\u0000\"",
                                      "\"\n\"",
                                      "\"",
                                      "[1",
                                      "[1,]",
                                      "{\"a\"}",
                                      "{\"a\":1,}",
                                      "{1:2}",
                                      "[]]",
                                      "[] []",
                                      "{\"a\":1,\"a\":2}",
                                      "\"\xff\"",
                                      "\"\xc0\x80\"",
                                      "\"\xed\xa0\x80\"",
                                      "\"\xf4\x90\x80\x80\"",
                                      "\"\xe2\x82\"",
                                      "\"\\ud83d\"",
                                      "\xef\xbb\xbf{}",
                                      "[1 2]"};
    (void)state;
    struct lum_proto_error err;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++)
        if (!parses(good[i], strlen(good[i]), &err))
            fail_msg("refused %s: %s", good[i], err.text);
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        memset(&err, 0, sizeof err);
        if (parses(bad[i], strlen(bad[i]), &err))
            fail_msg("accepted %s", bad[i]);
        assert_int_not_equal(err.code, LUM_PROTO_OK);
        assert_true(err.text[0]);
    }
    assert_false(parses("{}\0", 3, &err));
    assert_false(parses("\"a\0b\"", 5, &err));
}

/* n times open, then a 0, then n times close. */
static char *nested(unsigned n, const char *open, const char *close)
{
    char *text = calloc(n * (strlen(open) + strlen(close)) + 2, 1), *p = text;
    for (unsigned i = 0; i < n; i++)
        p += sprintf(p, "%s", open);
    *p++ = '0';
    for (unsigned i = 0; i < n; i++)
        p += sprintf(p, "%s", close);
    return text;
}

/* Parts of a message, each right before memory that may not be read. */
static void cut_texts_are_not_read_beyond_their_end(void **state)
{
    static const char *const texts[] = {"{\"a\":[1,{\"b\":\"c\"},[],null],\"d\":{\"e\":-1.5e3}}", "{\"1\":1,  ",
                                        "[1,\n"};
    (void)state;
    size_t page = (size_t)sysconf(_SC_PAGESIZE);
    char *pages = mmap(NULL, 2 * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    assert_true(pages != MAP_FAILED);
    assert_int_equal(mprotect(pages + page, page, PROT_NONE), 0);
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        size_t n_text = strlen(texts[i]);
        for (size_t n = 1; n < n_text + (i > 0); n++) {
            struct lum_proto_error err = {0};
            char *cut = pages + page - n;
            memcpy(cut, texts[i], n);
            assert_false(parses(cut, n, &err));
            assert_int_equal(err.code, LUM_PROTO_PARSE);
            if (n == n_text || texts[i][n - 1] == ',')
                assert_non_null(strstr(err.text, "bracket without end"));
        }
    }
    munmap(pages, 2 * page);
}

static void depth_limit(void **state)
{
    (void)state;
    for (int d = -1; d <= 1; d++) {
        char *arrays = nested((unsigned)(LUM_LIMIT_JSON_DEPTH + d), "[", "]");
        char *objects = nested((unsigned)(LUM_LIMIT_JSON_DEPTH + d), "{\"a\":", "}");
        struct lum_proto_error err = {0};
        assert_int_equal(parses(arrays, strlen(arrays), &err), d <= 0);
        assert_int_equal(parses(objects, strlen(objects), &err), d <= 0);
        if (d > 0)
            assert_string_equal(err.app, "limit_exceeded");
        free(arrays);
        free(objects);
    }
}

static void size_and_token_limits(void **state)
{
    (void)state;
    char *text = malloc(LUM_LIMIT_MESSAGE_BYTES + 1);
    memset(text, ' ', LUM_LIMIT_MESSAGE_BYTES + 1);
    text[0] = '7';
    assert_true(parses(text, LUM_LIMIT_MESSAGE_BYTES - 1, NULL));
    assert_true(parses(text, LUM_LIMIT_MESSAGE_BYTES, NULL));
    assert_false(parses(text, LUM_LIMIT_MESSAGE_BYTES + 1, NULL));
    /* the array itself is one value */
    for (int d = -1; d <= 1; d++) {
        size_t n = (size_t)((int)LUM_LIMIT_JSON_TOKENS - 1 + d);
        text[0] = '[';
        for (size_t i = 0; i < n; i++)
            memcpy(text + 1 + 2 * i, "1,", 2);
        text[2 * n] = ']';
        assert_int_equal(parses(text, 2 * n + 1, NULL), d <= 0);
    }
    free(text);
    char number[80];
    for (int d = -1; d <= 1; d++) {
        memset(number, '1', sizeof number);
        assert_int_equal(parses(number, (size_t)(LUM_LIMIT_JSON_NUMBER_BYTES + d), NULL), d <= 0);
    }
}

static void member_limit(void **state)
{
    (void)state;
    for (int d = -1; d <= 1; d++) {
        char text[2048] = "{", *p = text + 1;
        for (int i = 0; i < (int)LUM_LIMIT_JSON_MEMBERS + d; i++)
            p += sprintf(p, "%s\"m%d\":%d", i ? "," : "", i, i);
        *p = '}';
        assert_int_equal(parses(text, strlen(text), NULL), d <= 0);
    }
}

/* A message of the largest size must not take quadratic time: a million numbers are read in one walk. The test has no
 * clock; quadratic behaviour would run for hours. */
static void large_arrays_are_linear(void **state)
{
    (void)state;
    size_t n = 1000000;
    char *text = malloc(2 * n + 200), *p = text;
    p += sprintf(p, "{\"op\":\"add\",\"type\":\"mesh\",\"id\":\"m\",\"indices\":[0,1,2],\"positions\":[");
    for (size_t i = 0; i < n - 1; i++) {
        *p++ = '1';
        *p++ = i + 2 < n ? ',' : ']';
    }
    *p++ = '}';
    struct lum_proto_error err = {0};
    cJSON *json = lum_json_parse(text, (size_t)(p - text), &err);
    assert_non_null(json);
    struct lum_op op;
    if (!lum_op_from_json(json, NULL, &op, &err))
        fail_msg("%s", err.text);
    assert_int_equal(op.record->mesh.positions.n, n - 1);
    lum_op_finish(&op);
    cJSON_Delete(json);
    free(text);
}

static void numbers_come_back(void **state)
{
    (void)state;
    struct rng rng = {1};
    for (int i = 0; i < 20000; i++) {
        uint64_t bits = (uint64_t)rng_below(&rng, UINT32_MAX) << 32 | rng_below(&rng, UINT32_MAX);
        double v;
        memcpy(&v, &bits, sizeof v);
        if (!(v - v == 0.0)) /* not finite */
            continue;
        cJSON *number = cJSON_CreateNumber(v);
        char *text = lum_json_print(number, NULL);
        cJSON *back = lum_json_parse(text, strlen(text), NULL);
        if (!back || memcmp(&back->valuedouble, &v, sizeof v) != 0)
            fail_msg("%.17g printed as %s", v, text);
        cJSON_Delete(number);
        cJSON_Delete(back);
        free(text);
    }
}

static void texts_come_back(void **state)
{
    (void)state;
    const char *text = "{\"a\":[1,-0,true,null,\"q\\\"\\\\\\u0001\\u001f\xc3\xa9/\"],\"b\":{}}";
    cJSON *json = lum_json_parse(text, strlen(text), NULL);
    size_t n;
    char *again = lum_json_print(json, &n);
    assert_string_equal(again, text);
    assert_int_equal(n, strlen(text));
    free(again);
    cJSON_Delete(json);
}

/* A name cut within a character must not make a text that is not UTF-8. */
static void texts_are_utf8(void **state)
{
    static const struct {
        const char *in, *out;
    } cases[] = {{"a\xc3", "\"a\\ufffd\""}, {"\xff\xfe", "\"\\ufffd\\ufffd\""}, {"\xe2\x82z", "\"\\ufffd\\ufffdz\""}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        cJSON *json = cJSON_CreateString(cases[i].in);
        char *text = lum_json_print(json, NULL);
        assert_string_equal(text, cases[i].out);
        free(text);
        cJSON_Delete(json);
    }
    const char name[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"m\",\"";
    for (int shift = 0; shift < 3; shift++) { /* three-byte characters, cut at every place */
        char request[512], key[201] = "xx";
        key[shift] = '\0';
        for (int i = 0; i < 60; i++)
            strcat(key, "\xe2\x82\xac");
        snprintf(request, sizeof request, "%s%s\":1}", name, key);
        struct lum_rpc rpc;
        struct lum_proto_error err;
        assert_false(lum_rpc_parse(request, strlen(request), &rpc, &err));
        char *text = lum_rpc_error(rpc.id, &err);
        assert_true(parses(text, strlen(text), NULL));
        free(text);
        lum_rpc_finish(&rpc);
    }
}

static void reader_reads(void **state)
{
    (void)state;
    cJSON *json =
        json_of("{'n':2.5,'u':7,'b':true,'s':'abc','v':[1,2],'o':null,'c':'png','i':'a/b:c','sub':{'x':1},'z':null}");
    struct lum_proto_error err = {0};
    struct lum_json_reader r, sub;
    double n = 0, v[2] = {0}, x = 0;
    uint32_t u = 0;
    uint64_t big = 0;
    bool b = false;
    char s[4] = "";
    unsigned c = 0;
    lum_id id = "";
    lum_json_begin(&r, json, "", &err);
    assert_true(lum_json_number(&r, "n", 2.5, 2.5, &n) && n == 2.5);
    assert_true(lum_json_u32(&r, "u", 7, 7, &u) && u == 7);
    assert_true(lum_json_u64(&r, "u", &big) && big == 7);
    assert_true(lum_json_bool(&r, "b", &b) && b);
    assert_true(lum_json_string(&r, "s", s, sizeof s) && strcmp(s, "abc") == 0);
    assert_true(lum_json_numbers(&r, "v", 2, 1, 2, v) && v[0] == 1 && v[1] == 2);
    assert_true(cJSON_IsNull(lum_json_any_member(&r, "o")));
    assert_true(lum_json_choice(&r, "c", "jpeg|png|webp", &c) && c == 1);
    assert_true(lum_json_id(&r, "i", id) && strcmp(id, "a/b:c") == 0);
    assert_true(lum_json_object(&r, "sub", &sub) && lum_json_number(&sub, "x", 0, 1, &x) && lum_json_end(&sub));
    assert_false(lum_json_number(&r, "absent", 0, 1, &n));
    assert_false(lum_json_number(&r, "z", 0, 1, &n)); /* null is absent */
    assert_true(lum_json_end(&r));
    cJSON_Delete(json);
}

static void reader_refuses(void **state)
{
    static const struct {
        const char *json, *path, *app;
    } cases[] = {
        {"{'n':'1'}", "n", "invalid_value"},       {"{'n':0.5}", "n", "invalid_value"},
        {"{'n':100.5}", "n", "invalid_value"},     {"{'u':1.5}", "u", "invalid_value"},
        {"{'u':-1}", "u", "invalid_value"},        {"{'b':1}", "b", "invalid_value"},
        {"{'s':'abcd'}", "s", "invalid_value"},    {"{'s':3}", "s", "invalid_value"},
        {"{'v':[1]}", "v", "invalid_value"},       {"{'v':[1,2,3]}", "v", "invalid_value"},
        {"{'v':[1,'a']}", "v/1", "invalid_value"}, {"{'v':{'0':1,'1':2}}", "v", "invalid_value"},
        {"{'c':'pn'}", "c", "invalid_value"},      {"{'c':'jpeg|png'}", "c", "invalid_value"},
        {"{'c':''}", "c", "invalid_value"},        {"{'i':'a b'}", "i", "invalid_value"},
        {"{'i':''}", "i", "invalid_value"},        {"{'quallity':1}", "quallity", "unknown_field"},
        {"{'n':1,'n2':1}", "n2", "unknown_field"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        cJSON *json = json_of(cases[i].json);
        struct lum_proto_error err = {0};
        struct lum_json_reader r;
        double n, v[2];
        uint32_t u;
        bool b;
        char s[4];
        unsigned c;
        lum_id id;
        lum_json_begin(&r, json, "params", &err);
        lum_json_number(&r, "n", 1, 100, &n);
        lum_json_u32(&r, "u", 0, 9, &u);
        lum_json_bool(&r, "b", &b);
        lum_json_string(&r, "s", s, sizeof s);
        lum_json_numbers(&r, "v", 2, 0, 9, v);
        lum_json_choice(&r, "c", "jpeg|png", &c);
        lum_json_id(&r, "i", id);
        lum_json_number(&r, "quality", 1, 100, &n);
        assert_false(lum_json_end(&r));
        char path[64];
        snprintf(path, sizeof path, "params/%s", cases[i].path);
        assert_string_equal(err.path, path);
        assert_string_equal(err.app, cases[i].app);
        cJSON_Delete(json);
    }
}

static void ids(void **state)
{
    (void)state;
    char id[LUM_LIMIT_ID_BYTES + 2];
    for (int d = -1; d <= 1; d++) {
        memset(id, 'a', sizeof id);
        id[LUM_LIMIT_ID_BYTES + d] = '\0';
        assert_int_equal(lum_id_valid(id), d <= 0);
    }
    assert_true(lum_id_valid("AZaz09_.:/-"));
    assert_false(lum_id_valid(""));
    for (int c = 1; c < 256; c++) {
        char s[2] = {(char)c, '\0'};
        bool want = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                    (c < 128 && strchr("_.:/-", c));
        assert_int_equal(lum_id_valid(s), want);
    }
}

static void nearest_names(void **state)
{
    (void)state;
    static const char *const names[] = {"flux_lm",       "intensity_cd",   "position",    "on",
                                        "hall/lamp-12",  "hall/lamp-1",    "hall/lamp-2", "hall/lamp-3",
                                        "hall/door1_vf", "hall/current_vf"};
    char longest[300];
    memset(longest, 'x', sizeof longest);
    longest[299] = '\0';
    const struct {
        const char *given, *text;
    } rows[] = {
        {"flux_lmm", ": did you mean \"flux_lm\"?"},
        {"flux", ": did you mean \"flux_lm\"?"},
        {"Position", ": did you mean \"position\"?"},
        {"no", ""},
        {"completely else", ""},
        {longest, ""},
        {"", ""},
        {"curent_vf", ": did you mean \"hall/current_vf\"?"},
        {"hall/door1", ": did you mean \"hall/door1_vf\"?"},
        {"hull/lamp-1", ": did you mean \"hall/lamp-1\", \"hall/lamp-12\" or \"hall/lamp-2\"?"},
    };
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++)
        for (int backwards = 0; backwards < 2; backwards++) { /* the order of offers does not matter */
            const size_t n = sizeof names / sizeof names[0];
            struct lum_nearest near = {.given = rows[k].given};
            char text[128];
            for (size_t i = 0; i < n; i++)
                lum_nearest_offer(&near, names[backwards ? n - 1 - i : i]);
            lum_nearest_text(&near, text, sizeof text);
            assert_string_equal(text, rows[k].text);
        }
    struct lum_nearest near = {.given = "lamp-1"};
    for (size_t i = 4; i < 8; i++)
        lum_nearest_offer(&near, names[i]);
    for (size_t size = 1; size < 80; size++) { /* whole names or none */
        char text[80];
        memset(text, '!', sizeof text);
        lum_nearest_text(&near, text, size);
        assert_true(strlen(text) < size);
        assert_true(text[0] == '\0' || text[strlen(text) - 1] == '?');
    }
}

/* ---- JSON-RPC ---- */

static void rpc_requests(void **state)
{
    static const struct {
        const char *text, *id;
        bool ok;
    } cases[] = {
        {"{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"scene.get\"}", "1", true},
        {"{\"jsonrpc\":\"2.0\",\"id\":\"a\\\"b\",\"method\":\"m\",\"params\":{\"x\":1}}", "\"a\\\"b\"", true},
        {"{\"jsonrpc\":\"2.0\",\"method\":\"frame.ack\",\"params\":{}}", NULL, true},
        {"{\"jsonrpc\":\"2.0\",\"id\":null,\"method\":\"m\"}", NULL, false},
        {"{\"jsonrpc\":\"2.0\",\"id\":1.5,\"method\":\"m\"}", NULL, false},
        {"{\"jsonrpc\":\"2.0\",\"id\":[],\"method\":\"m\"}", NULL, false},
        {"{\"jsonrpc\":\"1.0\",\"id\":2,\"method\":\"m\"}", "2", false},
        {"{\"id\":3,\"method\":\"m\"}", "3", false},
        {"{\"jsonrpc\":\"2.0\",\"id\":4}", "4", false},
        {"{\"jsonrpc\":\"2.0\",\"id\":5,\"method\":7}", "5", false},
        {"{\"jsonrpc\":\"2.0\",\"id\":6,\"method\":\"m\",\"params\":[1]}", "6", false},
        {"{\"jsonrpc\":\"2.0\",\"id\":7,\"method\":\"m\",\"extra\":1}", "7", false},
        {"[{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"m\"}]", NULL, false},
        {"3", NULL, false},
        {"{", NULL, false},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct lum_rpc rpc;
        struct lum_proto_error err = {0};
        bool ok = lum_rpc_parse(cases[i].text, strlen(cases[i].text), &rpc, &err);
        if (ok != cases[i].ok)
            fail_msg("%s: %s", cases[i].text, err.text);
        if (cases[i].id)
            assert_string_equal(rpc.id, cases[i].id);
        else
            assert_null(rpc.id);
        char *scanned = lum_rpc_scan_id(cases[i].text, strlen(cases[i].text));
        if (!cases[i].id != !scanned || (scanned && strcmp(scanned, cases[i].id) != 0))
            fail_msg("%s: scanned %s", cases[i].text, scanned ? scanned : "nothing");
        free(scanned);
        lum_rpc_finish(&rpc);
    }
}

/* Of texts that are not parsed. */
static void rpc_ids_that_are_scanned(void **state)
{
    static const struct {
        const char *text, *id;
    } cases[] = {
        {"{\"params\":{\"id\":1,\"a\":[{\"id\":2}]},\"method\":\"id\",\"x\":\"\\\"id\\\":3\", \"id\" :\n\"four\"",
         "\"four\""},
        {"{\"a\":\"id\",\"id\":-5e0,\"id\":6", "-5"},
        {"{\"id\":\"\\u0061\"", "\"a\""},
        {"{\"id\"", NULL},
        {"{\"id\":", NULL},
        {"{\"id\":\"", NULL},
        {"{\"id\":\"\\", NULL},
        {"{\"id\":7}}]]\"", "7"},
        {"]}{\"id\":8", "8"},
        {"\"id\":9", NULL},
        {"{\"id\":{}}", NULL},
        {"", NULL},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char *id = lum_rpc_scan_id(cases[i].text, strlen(cases[i].text));
        if (!cases[i].id != !id || (id && strcmp(id, cases[i].id) != 0))
            fail_msg("%s: %s", cases[i].text, id ? id : "nothing");
        free(id);
    }
    char text[1000];
    memset(text, 'a', sizeof text);
    memcpy(text, "{\"id\":\"", 7);
    text[sizeof text - 1] = '"';
    assert_null(lum_rpc_scan_id(text, sizeof text)); /* too long for an id */
}

static void rpc_texts(void **state)
{
    (void)state;
    struct lum_proto_error err = {0};
    char *text = lum_rpc_result("7", json_of("{'scene_rev':3}"));
    assert_string_equal(text, "{\"jsonrpc\":\"2.0\",\"result\":{\"scene_rev\":3},\"id\":7}");
    free(text);
    lum_proto_fail_range(&err, "ops/0/flux_lm", 0, 1e12);
    text = lum_rpc_error("\"a\"", &err);
    assert_string_equal(
        text, "{\"jsonrpc\":\"2.0\",\"error\":{\"code\":-32602,\"message\":\"ops/0/flux_lm must be a number from 0 "
              "to 1e+12\",\"data\":{\"code\":\"invalid_value\",\"path\":\"ops/0/flux_lm\",\"min\":0,"
              "\"max\":1000000000000}},\"id\":\"a\"}");
    free(text);
    text = lum_rpc_error(NULL, &err);
    assert_non_null(strstr(text, "\"id\":null"));
    free(text);
    text = lum_rpc_notification("scene.changed", json_of("{}"));
    struct lum_rpc rpc;
    assert_true(lum_rpc_parse(text, strlen(text), &rpc, &err));
    assert_null(rpc.id);
    assert_string_equal(rpc.method, "scene.changed");
    lum_rpc_finish(&rpc);
    free(text);
    assert_null(lum_rpc_result("1", NULL));
}

static void rpc_incoming(void **state)
{
    (void)state;
    struct lum_rpc_incoming in;
    char *text = lum_rpc_request(12, "scene.get", json_of("{}"));
    struct lum_rpc rpc;
    assert_true(lum_rpc_parse(text, strlen(text), &rpc, NULL));
    assert_string_equal(rpc.id, "12");
    free(text);
    text = lum_rpc_result(rpc.id, json_of("{'a':1}"));
    assert_true(lum_rpc_parse_incoming(text, strlen(text), &in, NULL));
    assert_int_equal(in.id, 12);
    assert_non_null(in.result);
    assert_null(in.method);
    lum_rpc_incoming_finish(&in);
    lum_rpc_finish(&rpc);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(strict_grammar),
        cmocka_unit_test(cut_texts_are_not_read_beyond_their_end),
        cmocka_unit_test(depth_limit),
        cmocka_unit_test(size_and_token_limits),
        cmocka_unit_test(member_limit),
        cmocka_unit_test(large_arrays_are_linear),
        cmocka_unit_test(numbers_come_back),
        cmocka_unit_test(texts_come_back),
        cmocka_unit_test(texts_are_utf8),
        cmocka_unit_test(reader_reads),
        cmocka_unit_test(reader_refuses),
        cmocka_unit_test(ids),
        cmocka_unit_test(nearest_names),
        cmocka_unit_test(rpc_requests),
        cmocka_unit_test(rpc_ids_that_are_scanned),
        cmocka_unit_test(rpc_texts),
        cmocka_unit_test(rpc_incoming),
    };
    return cmocka_run_group_tests_name("json", tests, NULL, NULL);
}
