#include "server/importer/photometry.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "protocol/base/limits.h"

_Static_assert(LUM_LIMIT_WEB_VALUES == LUM_WEB_VALUES_MAX, "what a record may hold can be rendered");

/* ---- text ---- */

bool lum_photometry_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',' || c == '\f' || c == '\v' ||
           c == '\x1a'; /* the end of a file once */
}

static void count_line(struct lum_photometry_text *t)
{
    t->line += t->ended;
    t->ended = false;
}

bool lum_photometry_line(struct lum_photometry_text *t, const char **ret_line, size_t *ret_n)
{
    count_line(t);
    if (t->at >= t->end)
        return false;
    const char *from = t->at, *stop = memchr(from, '\n', (size_t)(t->end - from));
    const char *to = stop ? stop : t->end;
    t->at = stop ? stop + 1 : t->end;
    t->ended = stop != NULL;
    *ret_line = from;
    *ret_n = (size_t)(to - from) - (to > from && to[-1] == '\r');
    return true;
}

bool lum_photometry_parse(const char *s, size_t n, double *ret_value)
{
    char text[LUM_LIMIT_JSON_NUMBER_BYTES + 1], *end;
    if (n == 0 || n >= sizeof text)
        return false;
    memcpy(text, s, n);
    text[n] = 0;
    if (strspn(text, "0123456789+-.eE") != n)
        return false;
    *ret_value = strtod(text, &end);
    return end == text + n && isfinite(*ret_value);
}

enum lum_status lum_photometry_number(struct lum_photometry_text *t, const char *what, double *ret_value,
                                      struct lum_error *err)
{
    count_line(t);
    for (; t->at < t->end && lum_photometry_blank(*t->at); t->at++)
        t->line += *t->at == '\n';
    const char *from = t->at;
    while (t->at < t->end && !lum_photometry_blank(*t->at))
        t->at++;
    size_t n = (size_t)(t->at - from);
    if (n == 0)
        return lum_fail(err, LUM_ERR_INVALID, "", "line %u: the file ends before %s", t->line, what);
    if (!lum_photometry_parse(from, n, ret_value))
        return lum_fail(err, LUM_ERR_INVALID, "", "line %u: \"%.*s\" is no number; expected %s", t->line,
                        n < 20 ? (int)n : 20, from, what);
    return LUM_OK;
}

/* ---- tables ---- */

enum lum_status lum_photometry_table_alloc(struct lum_photometry_table *t, uint32_t line, struct lum_error *err)
{
    if ((uint64_t)t->n_planes * t->n_angles > LUM_LIMIT_WEB_VALUES)
        return lum_fail(err, LUM_ERR_LIMIT, "", "line %u: %u planes of %u angles are over the limit of %u intensities",
                        line, t->n_planes, t->n_angles, LUM_LIMIT_WEB_VALUES);
    t->planes = lum_calloc(t->n_planes, sizeof *t->planes);
    t->angles = lum_calloc(t->n_angles, sizeof *t->angles);
    t->values = lum_calloc((size_t)t->n_planes * t->n_angles, sizeof *t->values);
    if (t->planes && t->angles && t->values)
        return LUM_OK;
    return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u x %u intensities", t->n_planes, t->n_angles);
}

void lum_photometry_table_finish(struct lum_photometry_table *t)
{
    lum_free(t->planes);
    lum_free(t->angles);
    lum_free(t->values);
}

enum lum_status lum_photometry_check_angles(const char *what, const double *deg, uint32_t n, double lo, double hi,
                                            uint32_t line, struct lum_error *err)
{
    for (uint32_t i = 0; i < n; i++) {
        if (!(deg[i] >= lo && deg[i] <= hi))
            return lum_fail(err, LUM_ERR_INVALID, "", "line %u: %s must be from %g to %g degrees, not %g", line, what,
                            lo, hi, deg[i]);
        if (i > 0 && !((float)deg[i] > (float)deg[i - 1]))
            return lum_fail(err, LUM_ERR_INVALID, "", "line %u: %s must ascend: %g follows %g", line, what, deg[i],
                            deg[i - 1]);
    }
    return LUM_OK;
}

enum lum_status lum_photometry_around_alloc(struct lum_photometry_around *a, size_t most, struct lum_error *err)
{
    a->c = lum_calloc(most, sizeof *a->c);
    a->from = lum_calloc(most, sizeof *a->from);
    return a->c && a->from ? LUM_OK : lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %zu planes", most);
}

void lum_photometry_around_finish(struct lum_photometry_around *a)
{
    lum_free(a->c);
    lum_free(a->from);
}

void lum_photometry_add_plane(struct lum_photometry_around *a, double c, uint32_t from)
{
    if (a->n > 0 && !(c > a->c[a->n - 1] + 1e-6)) /* on the plane of symmetry */
        return;
    a->c[a->n] = c;
    a->from[a->n++] = from;
}

enum lum_status lum_photometry_take(struct lum_photometry *p, const struct lum_photometry_table *t, const double *c_deg,
                                    const uint32_t *from, uint32_t n_c, struct lum_error *err)
{
    if ((uint64_t)n_c * t->n_angles > LUM_LIMIT_WEB_VALUES)
        return lum_fail(err, LUM_ERR_LIMIT, "", "%u planes of %u angles are over the limit of %u intensities", n_c,
                        t->n_angles, LUM_LIMIT_WEB_VALUES);
    p->n_c = n_c;
    p->n_gamma = t->n_angles;
    p->c_deg = lum_calloc(n_c, sizeof *p->c_deg);
    p->gamma_deg = lum_calloc(t->n_angles, sizeof *p->gamma_deg);
    p->candela = lum_calloc((size_t)n_c * t->n_angles, sizeof *p->candela);
    if (!p->c_deg || !p->gamma_deg || !p->candela)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for %u x %u intensities", n_c, t->n_angles);
    bool negative = false;
    for (uint32_t k = 0; k < t->n_angles; k++)
        p->gamma_deg[k] = (float)t->angles[k];
    for (uint32_t i = 0; i < n_c; i++) {
        p->c_deg[i] = (float)c_deg[i];
        for (uint32_t k = 0; k < t->n_angles; k++) {
            double cd = t->values[(size_t)from[i] * t->n_angles + k];
            negative |= cd < 0.0;
            p->candela[(size_t)i * t->n_angles + k] = (float)fmax(cd, 0.0);
        }
    }
    if (negative)
        lum_photometry_note(p, "intensities below 0 are taken as 0");
    return LUM_OK;
}

/* ---- what was read ---- */

void lum_photometry_note(struct lum_photometry *p, const char *fmt, ...)
{
    if (p->n_notes == LUM_PHOTOMETRY_NOTES)
        return;
    va_list args;
    va_start(args, fmt);
    vsnprintf(p->notes[p->n_notes++], sizeof p->notes[0], fmt, args);
    va_end(args);
}

/* Latin-1, or UTF-8 if it is that, as UTF-8; what JSON would escape becomes a blank or an apostrophe. */
void lum_photometry_add_name(struct lum_photometry *p, const char *s, size_t n)
{
    size_t at = strlen(p->name), start = at;
    while (n && lum_photometry_blank(s[n - 1]))
        n--;
    while (n && lum_photometry_blank(*s))
        s++, n--;
    for (size_t i = 0; i < n && at + 4 < sizeof p->name; i++) {
        unsigned char c = (unsigned char)s[i], next = i + 1 < n ? (unsigned char)s[i + 1] : 0;
        if (at == start && start > 0)
            p->name[at++] = ' ';
        if ((c & 0xe0u) == 0xc0 && c >= 0xc2 && (next & 0xc0u) == 0x80) { /* two bytes of UTF-8 */
            p->name[at++] = (char)c;
            p->name[at++] = s[++i];
        } else if (c >= 0xa0) { /* Latin-1 */
            p->name[at++] = (char)(0xc0 | c >> 6);
            p->name[at++] = (char)(0x80 | (c & 0x3f));
        } else if (c < 0x7f) {
            p->name[at++] = (char)(c < 0x20 ? ' ' : c == '"' ? '\'' : c == '\\' ? '/' : c);
        }
    }
    p->name[at] = 0;
}

static bool ends_with(const char *s, const char *end)
{
    size_t n = strlen(s), m = strlen(end);
    return n >= m && strcasecmp(s + n - m, end) == 0;
}

/* The renderer's own check, and the integral. */
static enum lum_status integrate(struct lum_photometry *p, struct lum_error *err)
{
    struct lum_web_desc d = {p->type, p->n_c, p->n_gamma, p->c_deg, p->gamma_deg, p->candela};
    struct lum_web *web = NULL;
    enum lum_status status = lum_web_create(&d, &web, err);
    if (status)
        return status;
    p->flux_lm = web->flux_sr * web->peak_cd;
    lum_web_unref(web);
    if (!p->absolute && p->rated_lm > 0.0 && p->flux_lm > 1.005 * p->rated_lm)
        lum_photometry_note(p, "its intensities add up to %.0f lm, more than the %.0f lm of its lamps", p->flux_lm,
                            p->rated_lm);
    return LUM_OK;
}

enum lum_status lum_photometry_read(const struct lum_bytes *file, const char *name, struct lum_photometry *p,
                                    struct lum_error *err)
{
    const char *data = (const char *)file->data;
    struct lum_photometry_text text = {data, data + file->n, 1, false};
    *p = (struct lum_photometry){.opening = "point"};
    if (file->n > LUM_LIMIT_WEB_FILE_BYTES)
        return lum_fail(err, LUM_ERR_LIMIT, "", "line 1: %zu bytes are over the limit of %u", file->n,
                        LUM_LIMIT_WEB_FILE_BYTES);
    if (file->n >= 3 && memcmp(data, "\xef\xbb\xbf", 3) == 0)
        text.at += 3;
    bool ldt = ends_with(name, ".ldt") || ends_with(name, ".eul");
    enum lum_status status = ldt ? lum_ldt_read(&text, p, err) : lum_ies_read(&text, p, err);
    return status ? status : integrate(p, err);
}

void lum_photometry_finish(struct lum_photometry *p)
{
    lum_free(p->c_deg);
    lum_free(p->gamma_deg);
    lum_free(p->candela);
    p->c_deg = p->gamma_deg = p->candela = NULL;
}

void lum_photometry_warn(struct lum_emit *e, const char *name, const struct lum_photometry *p)
{
    for (uint32_t i = 0; i < p->n_notes; i++)
        lum_emit_warning(e, "%.60s: %s", name, p->notes[i]);
}

void lum_photometry_put(struct lum_emit *e, struct lum_op_text *op, const struct lum_photometry *p)
{
    static const char *const types[] = {[LUM_WEB_C] = "c", [LUM_WEB_B] = "b", [LUM_WEB_A] = "a"};
    lum_op_object(op, "web");
    lum_op_string(op, "type", types[p->type]);
    lum_emit_blob(e, op, "c_deg", p->c_deg, p->n_c * sizeof *p->c_deg);
    lum_emit_blob(e, op, "gamma_deg", p->gamma_deg, p->n_gamma * sizeof *p->gamma_deg);
    lum_emit_blob(e, op, "candela", p->candela, (size_t)p->n_c * p->n_gamma * sizeof *p->candela);
    if (p->name[0])
        lum_op_string(op, "name", p->name);
    lum_op_string(op, "opening", p->opening);
    lum_op_numbers(op, "size", p->size_m, 3);
    if (!p->absolute && p->rated_lm > 0.0)
        lum_op_number(op, "rated_lm", p->rated_lm);
    if (p->watts > 0.0)
        lum_op_number(op, "watts", p->watts);
    lum_op_close(op);
}
