/* PROTOCOL.md against the code: every request of its examples is accepted, every file of its examples applies, the
 * tables of fields are those of the code, and every request of the code has a section.   protocol_doc_test --write
 * writes the tables anew. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "protocol/json/json.h"
#include "protocol/message/rpc.h"
#include "protocol/record/light_kinds.h"
#include "server/director/read_request.h"
#include "tests/unit/protocol_util.h"

static char *page; /* the whole of PROTOCOL.md; set once by main */

static char *read_page(void)
{
    FILE *f = fopen(PROTOCOL_MD, "rb");
    char *text = calloc(1, 1 << 20);
    if (!f || !text)
        return NULL;
    text[fread(text, 1, (1 << 20) - 1, f)] = '\0';
    fclose(f);
    return text;
}

/* ---- tables ---- */

struct text {
    char *s;
    size_t n, capacity;
};

__attribute__((format(printf, 2, 3))) static void put(struct text *t, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    t->n += (size_t)vsnprintf(t->s + t->n, t->capacity - t->n, fmt, args);
    va_end(args);
}

static void put_type(struct text *t, const struct lum_field *f)
{
    static const char *const names[] = {
        [LUM_FIELD_NUMBER] = "number", [LUM_FIELD_INTEGER] = "integer", [LUM_FIELD_U32] = "integer",
        [LUM_FIELD_OPT] = "number",    [LUM_FIELD_BOOL] = "boolean",    [LUM_FIELD_NAME] = "name",
        [LUM_FIELD_ASSET] = "path",    [LUM_FIELD_ID] = "id",           [LUM_FIELD_INDICES] = "integers",
        [LUM_FIELD_PIXELS] = "string", [LUM_FIELD_TEXTURE] = "texture", [LUM_FIELD_TRANSFORM] = "transform",
        [LUM_FIELD_BOX] = "box",       [LUM_FIELD_FLOATS] = "numbers",  [LUM_FIELD_WEB] = "web",
        [LUM_FIELD_TEXT] = "text",     [LUM_FIELD_LAMPS] = "lamps",
    };
    if (f->kind == LUM_FIELD_VECTOR)
        put(t, "%u %s", f->n, f->flags & LUM_FIELD_WHOLE ? "integers" : "numbers");
    else if (f->kind == LUM_FIELD_REF)
        put(t, "id of %s %s", f->ref == LUM_RECORD_IMAGE || f->ref == LUM_RECORD_OBJECT ? "an" : "a",
            lum_record_type_names[f->ref]);
    else if (f->kind == LUM_FIELD_CHOICE)
        for (const char *w = f->text; *w; w += strcspn(w, "|") + (strchr(w, '|') != NULL))
            put(t, "%s`%.*s`", w == f->text ? "" : " ", (int)strcspn(w, "|"), w);
    else
        put(t, "%s", names[f->kind]);
}

static void put_default(struct text *t, const struct lum_field *f)
{
    if (f->flags & LUM_FIELD_REQUIRED)
        put(t, "required");
    else if (f->kind == LUM_FIELD_CHOICE)
        put(t, "`%.*s`", (int)strcspn(f->text, "|"), f->text);
    else if (f->kind == LUM_FIELD_NAME)
        put(t, f->text[0] ? "`%s`" : "empty%s", f->text);
    else if (f->kind == LUM_FIELD_BOOL)
        put(t, f->def[0] != 0.0 ? "true" : "false");
    else if (f->kind == LUM_FIELD_TRANSFORM)
        put(t, "identity");
    else if (f->kind == LUM_FIELD_VECTOR && !(f->flags & LUM_FIELD_NULLABLE))
        for (unsigned i = 0; i < f->n; i++)
            put(t, "%s%g", i ? " " : "", f->def[i < 3 ? i : 2]);
    else if (f->kind == LUM_FIELD_NUMBER || f->kind == LUM_FIELD_INTEGER || f->kind == LUM_FIELD_U32)
        put(t, "%g", f->def[0]);
    else
        put(t, "null");
}

/* 1e9 rather than 1000000000. */
static void put_number(struct text *t, double v)
{
    for (int e = 6; e <= 12; e++)
        if (fabs(v) == pow(10.0, e)) {
            put(t, "%s1e%d", v < 0.0 ? "-" : "", e);
            return;
        }
    put(t, "%.10g", v);
}

/* "spot, disc: ..." */
static void put_doc(struct text *t, const struct lum_field *f)
{
    for (const char *w = f->only; w && *w; w++)
        put(t, "%.*s", *w == '|' ? 2 : 1, *w == '|' ? ", " : w);
    bool first = true;
#define PUT_IF_IT_HAS(kind, bits)                                                                                      \
    if ((bits)&f->has) {                                                                                               \
        put(t, first ? #kind : ", " #kind);                                                                            \
        first = false;                                                                                                 \
    }
    LUM_LIGHT_KINDS(PUT_IF_IT_HAS)
    put(t, "%s%s", (f->has || f->only) && f->doc[0] ? ": " : "", f->doc);
}

static char *table_of(const struct lum_fields *fields)
{
    struct text t = {calloc(1, 1 << 16), 0, 1 << 16};
    put(&t, "| field | type | default | range | unit | |\n|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < fields->n; i++) {
        const struct lum_field *f = &fields->fields[i];
        put(&t, "| `%s` | ", f->name);
        put_type(&t, f);
        put(&t, " | ");
        put_default(&t, f);
        put(&t, " | ");
        if (f->min < f->max) {
            put_number(&t, f->min);
            put(&t, " to ");
            put_number(&t, f->max);
        }
        put(&t, " | %s | ", f->unit);
        put_doc(&t, f);
        put(&t, " |\n");
    }
    return t.s;
}

static const struct lum_fields *fields_named(const char *name)
{
    if (strcmp(name, "texture") == 0)
        return &lum_texture_fields;
    if (strcmp(name, "transform") == 0)
        return &lum_transform_fields;
    if (strcmp(name, "box") == 0)
        return &lum_box_fields;
    if (strcmp(name, "lamps") == 0)
        return &lum_lamp_fields;
    if (strcmp(name, "web") == 0)
        return &lum_web_fields;
    for (int type = 0; type < LUM_RECORD_TYPE_COUNT; type++)
        if (strcmp(name, lum_record_type_names[type]) == 0)
            return lum_fields_of(type);
    return NULL;
}

/* The page with every table replaced by the code's; *ret_n counts them. */
static char *page_with_tables(unsigned *ret_n)
{
    static const char open[] = "<!-- fields:", close[] = "<!-- end -->";
    struct text out = {calloc(1, 1 << 20), 0, 1 << 20};
    const char *p = page, *at;
    for (*ret_n = 0; (at = strstr(p, open)); ++*ret_n) {
        char name[32];
        const char *line_end = strchr(at, '\n') + 1, *end = strstr(at, close);
        sscanf(at + strlen(open), "%31[a-z]", name);
        put(&out, "%.*s", (int)(line_end - p), p);
        char *table = table_of(fields_named(name));
        put(&out, "%s", table);
        free(table);
        p = end;
    }
    put(&out, "%s", p);
    return out.s;
}

static void tables_are_those_of_the_code(void **state)
{
    (void)state;
    unsigned n;
    char *want = page_with_tables(&n);
    assert_int_equal(n, LUM_RECORD_TYPE_COUNT + 5);
    if (strcmp(want, page) != 0) {
        size_t i = 0;
        while (want[i] == page[i])
            i++;
        fail_msg("the tables differ from the code, first at \"%.80s\"; run protocol_doc_test --write", want + i);
    }
    free(want);
}

static void members_of_views_are_those_of_the_code(void **state)
{
    (void)state;
    const char *from = strstr(page, "### view.open"), *to = strstr(page, "### frame.ack");
    assert_true(from && to && from < to);
    for (size_t i = 0; i < lum_view_fields.n; i++) {
        char row[40];
        snprintf(row, sizeof row, "| `%s` |", lum_view_fields.fields[i].name);
        const char *at = strstr(from, row);
        if (!at || at > to)
            fail_msg("PROTOCOL.md does not tell of %s", lum_view_fields.fields[i].name);
    }
}

/* ---- requests ---- */

/* True when a heading has the word: one heading may be of several requests. */
static bool has_section(const char *word)
{
    size_t n = strlen(word);
    for (const char *at = page; (at = strstr(at, "\n### ")); at++)
        for (const char *w = at + 4; w[0] == ' '; w += 1 + strcspn(w + 1, " \n"))
            if (strncmp(w + 1, word, n) == 0 && strchr(",\n", w[1 + n]))
                return true;
    return false;
}

static void every_request_has_a_section_and_an_example(void **state)
{
#define ADDRESS(name, role) &lum_request_##name,
    static const struct lum_request_type *const types[] = {LUM_REQUESTS(ADDRESS)};
    (void)state;
    assert_true(has_section("session.hello") && has_section("scene.redo") && !has_section("scene"));
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        char example[80];
        snprintf(example, sizeof example, "\"method\":\"%s\"", types[i]->name);
        if (!has_section(types[i]->name) || !strstr(page, example))
            fail_msg("PROTOCOL.md has no section of %s, or no example", types[i]->name);
    }
}

/* What the table of roles says is what is held to. */
static void every_request_has_its_role(void **state)
{
#define NAME_AND_ROLE(name, role) {&lum_request_##name, LUM_ROLE_##role},
    static const struct {
        const struct lum_request_type *type;
        enum lum_role role;
    } rows[] = {LUM_REQUESTS(NAME_AND_ROLE)};
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char head[32], method[80];
        snprintf(head, sizeof head, "\n| `%s` | `", lum_role_name(rows[i].role));
        snprintf(method, sizeof method, "`%s`", rows[i].type->name);
        const char *row = strstr(page, head), *found = row ? strstr(row, method) : NULL;
        if (!found || found > row + 1 + strcspn(row + 1, "\n"))
            fail_msg("PROTOCOL.md does not have %s in the row of the role %s", method, lum_role_name(rows[i].role));
    }
}

/* ---- examples ---- */

static void check_request(const char *line, size_t n)
{
    struct lum_rpc rpc;
    struct lum_proto_error err = {0};
    if (!lum_rpc_parse(line, n, &rpc, &err))
        fail_msg("%.*s: %s", (int)n, line, err.text);
    bool own = strncmp(rpc.method, "session.", 8) == 0 || strcmp(rpc.method, "frame.ack") == 0 ||
               strncmp(rpc.method, "project.", 8) == 0 || strncmp(rpc.method, "version.", 8) == 0 ||
               strcmp(rpc.method, "trash.empty") == 0 || strcmp(rpc.method, "asset.upload") == 0 ||
               strcmp(rpc.method, "presence.set") == 0; /* the session's */
    if (!own) {
        struct lum_request *c = lum_request_read(&rpc, LUM_ROLE_ADMIN, &err);
        if (!c)
            fail_msg("%.*s: %s", (int)n, line, err.text);
        lum_request_destroy(c);
    }
    lum_rpc_finish(&rpc);
}

static void examples_are_accepted(void **state)
{
    unsigned sent = 0, received = 0;
    (void)state;
    for (const char *line = page; line; line = strchr(line, '\n') ? strchr(line, '\n') + 1 : NULL) {
        static const char to_server[] = "\xe2\x86\x92 ", to_client[] = "\xe2\x86\x90 ";
        size_t n = strcspn(line, "\n"), arrow = strlen(to_server);
        if (strncmp(line, to_server, arrow) == 0) {
            check_request(line + arrow, n - arrow);
            sent++;
        } else if (strncmp(line, to_client, arrow) == 0) {
            struct lum_rpc_incoming in;
            if (!lum_rpc_parse_incoming(line + arrow, n - arrow, &in, NULL))
                fail_msg("%.*s", (int)n, line);
            lum_rpc_incoming_finish(&in);
            received++;
        }
    }
    assert_true(sent >= 13 && received >= 13);
}

static void files_apply(void **state)
{
    static const char fence[] = "```jsonl\n";
    unsigned n = 0;
    (void)state;
    for (const char *p = page; (p = strstr(p, fence)); n++) {
        p += strlen(fence);
        size_t length = (size_t)(strstr(p, "```") - p);
        struct lum_ops ops;
        struct lum_changes c = {0};
        struct lum_proto_error err;
        if (!lum_ops_from_jsonl(p, length, &ops, &err))
            fail_msg("%.*s: %s", (int)length, p, err.text);
        struct lum_document *doc = lum_document_create();
        struct lum_import_children none = {.import_id = "room"};
        if (!lum_document_apply(doc, "ann", &ops, &none, 1, &c, &err))
            fail_msg("%.*s: %s at %s", (int)length, p, err.text, err.path);
        lum_changes_finish(&c);
        lum_document_destroy(doc);
        lum_ops_finish(&ops);
    }
    assert_int_equal(n, 3);
}

int main(int argc, char **argv)
{
    page = read_page();
    if (!page) {
        fprintf(stderr, "cannot read %s\n", PROTOCOL_MD);
        return 1;
    }
    if (argc > 1 && strcmp(argv[1], "--write") == 0) {
        unsigned n;
        char *text = page_with_tables(&n);
        FILE *f = fopen(PROTOCOL_MD, "wb");
        if (!f || fputs(text, f) < 0 || fclose(f) != 0)
            return 1;
        free(text);
        free(page);
        return 0;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_are_those_of_the_code),
        cmocka_unit_test(members_of_views_are_those_of_the_code),
        cmocka_unit_test(every_request_has_a_section_and_an_example),
        cmocka_unit_test(every_request_has_its_role),
        cmocka_unit_test(examples_are_accepted),
        cmocka_unit_test(files_apply),
    };
    int failed = cmocka_run_group_tests_name("protocol_doc", tests, NULL, NULL);
    free(page);
    return failed;
}
