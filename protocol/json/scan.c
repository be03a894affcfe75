#include "protocol/json/scan.h"

#include <stdint.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "protocol/base/utf8.h"

struct scanner {
    const uint8_t *begin, *p, *end;
    unsigned depth;
    size_t values, max_values;
    struct lum_proto_error *err;
};

static bool syntax(const struct scanner *s, const char *what)
{
    return lum_proto_fail(s->err, LUM_PROTO_PARSE, "invalid_value", "", "not JSON: %s at byte %zu", what,
                          (size_t)(s->p - s->begin));
}

static bool over_limit(const struct scanner *s, const char *what, unsigned limit)
{
    return lum_proto_fail(s->err, LUM_PROTO_BAD_REQUEST, "limit_exceeded", "", "more than %u %s", limit, what);
}

static bool is_hex(uint8_t c)
{
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

/* At the byte after a backslash. */
static bool scan_escape(struct scanner *s)
{
    if (s->p == s->end || !*s->p || !strchr("\"\\/bfnrtu", *s->p))
        return syntax(s, "unknown escape");
    if (*s->p++ != 'u')
        return true;
    if (s->end - s->p < 4 || !is_hex(s->p[0]) || !is_hex(s->p[1]) || !is_hex(s->p[2]) || !is_hex(s->p[3]))
        return syntax(s, "\\u without four hexadecimal digits");
    if (memcmp(s->p, "0000", 4) == 0)
        return syntax(s, "\\u0000 in a string");
    s->p += 4;
    return true;
}

static bool scan_string(struct scanner *s)
{
    s->p++;
    while (s->p < s->end && *s->p != '"') {
        if (*s->p == '\\') {
            s->p++;
            if (!scan_escape(s))
                return false;
            continue;
        }
        if (*s->p < 0x20)
            return syntax(s, "control character in a string");
        size_t n = lum_utf8_length(s->p, s->end);
        if (n == 0)
            return syntax(s, "not UTF-8");
        s->p += n;
    }
    if (s->p == s->end)
        return syntax(s, "string without end");
    s->p++;
    return true;
}

static size_t skip_digits(struct scanner *s)
{
    const uint8_t *from = s->p;
    while (s->p < s->end && *s->p >= '0' && *s->p <= '9')
        s->p++;
    return (size_t)(s->p - from);
}

static bool at(const struct scanner *s, const char *set)
{
    return s->p < s->end && *s->p && strchr(set, *s->p);
}

static bool scan_number(struct scanner *s)
{
    const uint8_t *from = s->p;
    if (*s->p == '-')
        s->p++;
    bool zero = at(s, "0");
    size_t n = skip_digits(s);
    if (n == 0 || (zero && n > 1))
        return syntax(s, "malformed number");
    if (at(s, ".")) {
        s->p++;
        if (skip_digits(s) == 0)
            return syntax(s, "malformed number");
    }
    if (at(s, "eE")) {
        s->p++;
        if (at(s, "+-"))
            s->p++;
        if (skip_digits(s) == 0)
            return syntax(s, "malformed number");
    }
    if (s->p - from > LUM_LIMIT_JSON_NUMBER_BYTES)
        return over_limit(s, "characters in a number", LUM_LIMIT_JSON_NUMBER_BYTES);
    return true;
}

static bool scan_word(struct scanner *s)
{
    static const char *const words[] = {"true", "false", "null"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        size_t n = strlen(words[i]);
        if ((size_t)(s->end - s->p) >= n && memcmp(s->p, words[i], n) == 0) {
            s->p += n;
            return true;
        }
    }
    return syntax(s, "unexpected character (NaN and Infinity are not JSON numbers)");
}

/* Reads one token that starts a value, or a bracket. */
static bool scan_token(struct scanner *s)
{
    uint8_t c = *s->p;
    if (c == '}' || c == ']') {
        if (s->depth == 0)
            return syntax(s, "unexpected bracket");
        s->depth--;
        s->p++;
        return true;
    }
    if (++s->values > s->max_values)
        return over_limit(s, "values in a message", (unsigned)s->max_values);
    if (c == '{' || c == '[') {
        if (++s->depth > LUM_LIMIT_JSON_DEPTH)
            return over_limit(s, "levels of nesting", LUM_LIMIT_JSON_DEPTH);
        s->p++;
        return true;
    }
    if (c == '"')
        return scan_string(s);
    if (c == '-' || (c >= '0' && c <= '9'))
        return scan_number(s);
    return scan_word(s);
}

bool lum_json_scan(const char *text, size_t n_bytes, bool stored, struct lum_proto_error *err)
{
    const uint8_t *begin = (const uint8_t *)text;
    struct scanner s = {.begin = begin, .p = begin, .end = begin + n_bytes, .err = err};
    s.max_values = stored ? LUM_LIMIT_STORED_TOKENS : LUM_LIMIT_JSON_TOKENS;
    unsigned max_bytes = stored ? LUM_LIMIT_STORED_BYTES : LUM_LIMIT_MESSAGE_BYTES;
    if (n_bytes > max_bytes)
        return over_limit(&s, "bytes in a message", max_bytes);
    while (s.p < s.end) {
        if (*s.p == ' ' || *s.p == '\t' || *s.p == '\n' || *s.p == '\r' || *s.p == ',' || *s.p == ':')
            s.p++;
        else if (!scan_token(&s))
            return false;
    }
    /* cJSON up to 1.7.17 reads on beyond the end after a comma there (CVE-2023-53154) */
    if (s.depth)
        return syntax(&s, "bracket without end");
    return true;
}
