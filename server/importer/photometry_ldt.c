/* EULUMDAT: one value on each line, in a fixed order. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/base/limits.h"
#include "server/importer/photometry.h"

#define LAMP_SETS_MAX 200u /* the format says 20; there are files with more */

struct ldt {
    struct lum_photometry_text *text;
    struct lum_photometry *p;
    struct lum_error *err;
    enum lum_status status; /* sticky: after a failure every read does nothing */
    struct lum_photometry_table table;
    uint32_t symmetry, n_c; /* planes all around: of them the table holds those that are not mirrored ones */
};

/* ---- lines ---- */

/* Of a line that tells nothing that is used, or of text. */
static void skip(struct ldt *f, uint32_t n_lines)
{
    const char *s;
    size_t n;
    for (; n_lines && !f->status; n_lines--)
        if (!lum_photometry_line(f->text, &s, &n))
            f->status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: the file ends in its head", f->text->line);
}

static void read_name(struct ldt *f)
{
    const char *s;
    size_t n;
    if (!f->status && lum_photometry_line(f->text, &s, &n))
        lum_photometry_add_name(f->p, s, n);
    else
        skip(f, 1);
}

/* A decimal comma is a point; an empty line, or one of a dash, is 0. */
static double read_number(struct ldt *f, const char *what, double lo, double hi)
{
    char text[LUM_LIMIT_JSON_NUMBER_BYTES + 1];
    const char *s;
    size_t n;
    double v = 0.0;
    if (f->status)
        return 0.0;
    if (!lum_photometry_line(f->text, &s, &n)) {
        f->status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: the file ends before %s", f->text->line, what);
        return 0.0;
    }
    while (n && (s[n - 1] != ',' && lum_photometry_blank(s[n - 1])))
        n--;
    while (n && (*s != ',' && lum_photometry_blank(*s)))
        s++, n--;
    bool empty = n == 0 || (n == 1 && (*s == '_' || *s == '-'));
    size_t m = n < sizeof text ? n : sizeof text - 1;
    for (size_t i = 0; i < m; i++)
        text[i] = s[i] == ',' ? '.' : s[i];
    if (!empty && (n >= sizeof text || !lum_photometry_parse(text, m, &v)))
        f->status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: \"%.*s\" is no number; expected %s", f->text->line,
                             n < 20 ? (int)n : 20, s, what);
    else if (!(v >= lo && v <= hi))
        f->status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: %s must be from %g to %g, not %g", f->text->line,
                             what, lo, hi, v);
    return f->status ? 0.0 : v;
}

static uint32_t read_whole(struct ldt *f, const char *what, double lo, double hi)
{
    double v = read_number(f, what, lo, hi);
    if (!f->status && v != floor(v))
        f->status =
            lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: %s must be a whole number, not %g", f->text->line, what, v);
    return f->status ? 0 : (uint32_t)v;
}

/* ---- the head ---- */

/* Planes of the table: by symmetry none, axial, about C0 - C180, about C90 - C270, about both. */
static void count_planes(struct ldt *f)
{
    static const uint32_t parts[] = {1, 0, 2, 2, 4};
    uint32_t part = parts[f->symmetry], n = f->n_c;
    if (part && n % part != 0)
        f->status =
            lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: %u planes cannot be symmetrical as said", f->text->line, n);
    f->table.n_planes = part == 0 ? 1 : part == 1 ? n : n / part + 1;
}

/* mm. A width of 0: it is round, and the length is its diameter. Lengths lie along C90, which is c0 here. */
static void read_opening(struct ldt *f)
{
    double length = read_number(f, "the luminous length", 0, 1e9), width = read_number(f, "its width", 0, 1e9);
    double height = 0.0;
    for (int k = 0; k < 4; k++)
        height = fmax(height, read_number(f, "its height", -1e9, 1e9));
    f->p->opening = length == 0.0 ? "point" : width == 0.0 ? "disc" : "rectangle";
    f->p->size_m[0] = 1e-3 * length;
    f->p->size_m[1] = 1e-3 * (width == 0.0 ? length : width);
    f->p->size_m[2] = 1e-3 * height;
}

/* Of each set its number of lamps, below 0 for absolute photometry; type; flux of all of them, colour temperature,
 * rendering index; watts. */
static void read_lamps(struct ldt *f)
{
    uint32_t n_sets = read_whole(f, "the number of lamp sets", 0, LAMP_SETS_MAX);
    for (uint32_t i = 0; i < n_sets && !f->status; i++) {
        f->p->absolute |= read_number(f, "the number of lamps", -1e6, 1e6) < 0.0;
        skip(f, 1);
        f->p->rated_lm += read_number(f, "the flux of the lamps", 0, 1e9);
        skip(f, 2);
        f->p->watts += read_number(f, "watts", 0, 1e9);
    }
    if (!f->status && !(f->p->rated_lm > 0.0))
        f->status =
            lum_fail(f->err, LUM_ERR_INVALID, "",
                     "line %u: the lamps have no flux: intensities are told per 1000 lm of them", f->text->line);
}

static void read_head(struct ldt *f)
{
    read_name(f);
    skip(f, 1);
    f->symmetry = read_whole(f, "the symmetry (0 to 4)", 0, 4);
    f->n_c = read_whole(f, "the number of planes", 1, LUM_LIMIT_WEB_VALUES);
    skip(f, 1);
    f->table.n_angles = read_whole(f, "the number of angles in a plane", 2, LUM_LIMIT_WEB_VALUES);
    if (!f->status)
        count_planes(f);
    skip(f, 2);
    read_name(f);
    skip(f, 6); /* number, file name, date; length, width, height of the housing */
    read_opening(f);
    skip(f, 2); /* downward flux, light output ratio */
}

/* ---- the table ---- */

/* What the intensities are to be multiplied by, and the tilt while measuring. */
static double read_factor(struct ldt *f)
{
    double factor = read_number(f, "the factor of the intensities", 0, 1e9);
    double tilt = read_number(f, "the tilt while measuring", -360, 360);
    if (factor == 0.0)
        factor = 1.0;
    if (tilt != 0.0)
        lum_photometry_note(f->p, "it was tilted by %g degrees while measured, and is not turned back", tilt);
    return factor;
}

/* Number, from 0, of the first plane of the table among all: C270 where the symmetry is about C90 - C270. */
static uint32_t first_plane(const struct ldt *f)
{
    return f->symmetry == 3 ? 3 * f->n_c / 4 : 0;
}

/* From the first plane on, ascending beyond 360. */
static void read_angles(struct ldt *f)
{
    struct lum_photometry_table *t = &f->table;
    double *c = f->status ? NULL : lum_calloc(f->n_c, sizeof *c);
    if (!f->status && !c)
        f->status = lum_fail(f->err, LUM_ERR_NOMEM, "", "out of memory for %u planes", f->n_c);
    for (uint32_t i = 0; i < f->n_c && !f->status; i++)
        c[i] = read_number(f, "the angle of a plane", 0, 360);
    t->planes_line = f->text->line;
    for (uint32_t k = 0, i = first_plane(f); k < t->n_planes && !f->status; k++, i++)
        t->planes[k] = c[i % f->n_c] + (i >= f->n_c && f->n_c > 1 ? 360.0 : 0.0);
    for (uint32_t k = 0; k < t->n_angles && !f->status; k++)
        t->angles[k] = read_number(f, "an angle in the planes", 0, 180);
    t->angles_line = f->text->line;
    if (!f->status)
        f->status =
            lum_photometry_check_angles("angles of planes", t->planes, t->n_planes, 0, 720, t->planes_line, f->err);
    if (!f->status)
        f->status =
            lum_photometry_check_angles("angles in planes", t->angles, t->n_angles, 0, 180, t->angles_line, f->err);
    lum_free(c);
}

static void read_values(struct ldt *f, double factor)
{
    struct lum_photometry_table *t = &f->table;
    double cd = factor * f->p->rated_lm / 1000.0;
    for (size_t i = 0; i < (size_t)t->n_planes * t->n_angles && !f->status; i++) {
        t->values[i] = cd * read_number(f, "an intensity", -1e12, 1e12);
        if (!f->status && !(fabs(t->values[i]) <= 1e12))
            f->status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: an intensity of %g cd is over 1e12",
                                 f->text->line, t->values[i]);
    }
}

/* ---- all around ---- */

/* Writes the symmetry out: the planes and their mirror images, once around and back to the first. */
static void spread(const struct ldt *f, struct lum_photometry_around *a)
{
    const double *c = f->table.planes;
    uint32_t n = f->table.n_planes;
    double first = c[0];
    for (uint32_t i = 0; i < n; i++)
        lum_photometry_add_plane(a, c[i], i);
    if (f->symmetry == 4) /* about C90 - C270 first: C0 to C180 */
        for (uint32_t i = n; i-- > 0;)
            lum_photometry_add_plane(a, 180.0 - c[i], i);
    if (f->symmetry == 3) /* C270 over C360 to C450, then on to C630 */
        for (uint32_t i = n; i-- > 0;)
            lum_photometry_add_plane(a, 900.0 - c[i], i);
    for (uint32_t i = a->n; (f->symmetry == 2 || f->symmetry == 4) && i-- > 0;)
        lum_photometry_add_plane(a, 360.0 - a->c[i], a->from[i]);
    if (f->symmetry == 0 && n > 1)
        lum_photometry_add_plane(a, first + 360.0, 0);
}

/* C0 lies across the luminaire here, and along it in the web: C90 becomes c = 0. */
static void take(struct ldt *f)
{
    struct lum_photometry_around a = {0};
    f->status = lum_photometry_around_alloc(&a, 4 * (size_t)f->table.n_planes + 1, f->err);
    if (!f->status)
        spread(f, &a);
    double span = f->status ? 0.0 : a.c[a.n - 1] - a.c[0];
    double shift = !f->status && a.c[0] >= 270.0 ? 450.0 : 90.0;
    if (!f->status && a.n > 1 && !(fabs(span - 360.0) < 0.01))
        f->status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: the planes do not go all around: over %g degrees",
                             f->table.planes_line, span);
    for (uint32_t i = 0; i < a.n && !f->status; i++)
        a.c[i] -= shift;
    if (!f->status && a.n > 1)
        a.c[a.n - 1] = a.c[0] + 360.0;
    if (!f->status)
        f->status = lum_photometry_take(f->p, &f->table, a.c, a.from, a.n, f->err);
    lum_photometry_around_finish(&a);
}

enum lum_status lum_ldt_read(struct lum_photometry_text *text, struct lum_photometry *p, struct lum_error *err)
{
    struct ldt f = {.text = text, .p = p, .err = err};
    read_head(&f);
    double factor = read_factor(&f);
    read_lamps(&f);
    skip(&f, 10); /* direct ratios */
    if (!f.status)
        f.status = lum_photometry_table_alloc(&f.table, text->line, err);
    read_angles(&f);
    read_values(&f, factor);
    if (!f.status)
        take(&f);
    lum_photometry_table_finish(&f.table);
    return f.status;
}
