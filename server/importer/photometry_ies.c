/* IES LM-63, as of 1986, 1991, 1995, 2002 and 2019. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "protocol/base/limits.h"
#include "server/importer/photometry.h"

#define METRES_PER_FOOT 0.3048

struct ies {
    struct lum_photometry_text *text;
    struct lum_photometry *p;
    struct lum_error *err;
    int year; /* of the standard: 1986 where the file names none */
    double tilt;
    struct lum_photometry_table table;
    double lamps, lumens, multiplier, ballast, second, watts, width, length, height;
    uint32_t type, line; /* line: of the numbers that say how many there are */
};

/* ---- lines before the numbers ---- */

static bool begins(const char *s, size_t n, const char *with)
{
    size_t m = strlen(with);
    return n >= m && strncasecmp(s, with, m) == 0;
}

/* "IESNA:LM-63-2002", "IES:LM-63-2019", "IESNA91", "IESNA95"; anything else is of 1986, which had no such line. */
static int year_of(const char *s, size_t n)
{
    static const int years[] = {2019, 2002, 1995, 1991};
    if (!begins(s, n, "IES"))
        return 1986;
    for (size_t i = 0; i + 2 <= n && i < 32; i++)
        for (size_t k = 0; k < LUM_ARRAY_LEN(years); k++)
            if (s[i] == '0' + years[k] / 10 % 10 && s[i + 1] == '0' + years[k] % 10 && (i + 2 == n || s[i + 2] < '0'))
                return years[k];
    return 1986;
}

static void take_keyword(struct ies *f, const char *s, size_t n)
{
    static const char *const of_name[] = {"[MANUFAC]", "[LUMCAT]", "[LUMINAIRE]"};
    for (size_t k = 0; k < LUM_ARRAY_LEN(of_name); k++)
        if (begins(s, n, of_name[k]))
            lum_photometry_add_name(f->p, s + strlen(of_name[k]), n - strlen(of_name[k]));
}

/* Reads on to the line that begins with TILT=. */
static enum lum_status read_labels(struct ies *f, const char **ret_tilt, size_t *ret_n)
{
    const char *s;
    size_t n;
    bool first = true;
    while (lum_photometry_line(f->text, &s, &n)) {
        while (n && lum_photometry_blank(*s))
            s++, n--;
        if (begins(s, n, "TILT=")) {
            *ret_tilt = s + 5;
            *ret_n = n - 5;
            return LUM_OK;
        }
        if (first && n) {
            f->year = year_of(s, n);
            first = false;
        }
        take_keyword(f, s, n);
    }
    return lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: no line begins with TILT=: this is no IES LM-63 file",
                    f->text->line);
}

/* A count, or a code: a whole number. */
static enum lum_status read_whole(struct ies *f, const char *what, double lo, double hi, uint32_t *ret)
{
    double v;
    enum lum_status status = lum_photometry_number(f->text, what, &v, f->err);
    if (!status && !(v >= lo && v <= hi && v == floor(v)))
        status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: %s must be a whole number from %g to %g, not %g",
                          f->text->line, what, lo, hi, v);
    if (!status)
        *ret = (uint32_t)v;
    return status;
}

/* Factors by which a lamp dims in a luminaire that is tilted. Luminaires are taken as they were measured: at 0. */
static enum lum_status read_tilt_table(struct ies *f)
{
    uint32_t geometry, n;
    double angle = 0.0, factor = 1.0, before = 0.0;
    bool varies = false;
    enum lum_status status = read_whole(f, "the lamp's position (1 to 3)", 1, 3, &geometry);
    if (!status)
        status = read_whole(f, "the number of tilt angles", 1, 10000, &n);
    double *angles = status ? NULL : lum_calloc(n, sizeof *angles);
    if (!status && !angles)
        status = lum_fail(f->err, LUM_ERR_NOMEM, "", "out of memory for %u tilt angles", n);
    for (uint32_t i = 0; !status && i < n; i++)
        status = lum_photometry_number(f->text, "a tilt angle", &angles[i], f->err);
    for (uint32_t i = 0; !status && i < n; i++) {
        status = lum_photometry_number(f->text, "a tilt factor", &factor, f->err);
        if (!status && !(factor >= 0.0 && factor <= 10.0))
            status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: a tilt factor must be from 0 to 10, not %g",
                              f->text->line, factor);
        if (!status && (i == 0 || fabs(angles[i]) < fabs(angle))) {
            angle = angles[i];
            f->tilt = factor;
        }
        varies |= i > 0 && factor != before;
        before = factor;
    }
    lum_free(angles);
    if (!status && varies)
        lum_photometry_note(f->p, "its TILT factors are of tilted luminaires: that of %g degrees, %g, is applied",
                            angle, f->tilt);
    if (!status && !(f->tilt > 0.0))
        status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: the tilt factor of 0 degrees is 0", f->text->line);
    return status;
}

static enum lum_status read_tilt(struct ies *f, const char *s, size_t n)
{
    while (n && lum_photometry_blank(s[n - 1]))
        n--;
    while (n && lum_photometry_blank(*s))
        s++, n--;
    f->tilt = 1.0;
    if (n == 4 && begins(s, n, "NONE"))
        return LUM_OK;
    if (n == 7 && begins(s, n, "INCLUDE"))
        return read_tilt_table(f);
    return lum_fail(f->err, LUM_ERR_UNSUPPORTED, "",
                    "line %u: TILT=%.*s names another file, which is not read: only NONE and INCLUDE are",
                    f->text->line, n < 40 ? (int)n : 40, s);
}

/* ---- the numbers ---- */

static enum lum_status read_in_range(struct ies *f, const char *what, double lo, double hi, double *ret)
{
    enum lum_status status = lum_photometry_number(f->text, what, ret, f->err);
    if (!status && !(*ret >= lo && *ret <= hi))
        status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: %s must be from %g to %g, not %g", f->text->line, what,
                          lo, hi, *ret);
    return status;
}

static enum lum_status read_record(struct ies *f)
{
    uint32_t units = 0;
    enum lum_status status = read_in_range(f, "the number of lamps", 0, 1e6, &f->lamps);
    if (!status)
        status = read_in_range(f, "lumens per lamp", -1e9, 1e9, &f->lumens);
    if (!status)
        status = read_in_range(f, "the candela multiplier", 1e-9, 1e9, &f->multiplier);
    if (!status)
        status = read_whole(f, "the number of vertical angles", 2, LUM_LIMIT_WEB_VALUES, &f->table.n_angles);
    if (!status)
        status = read_whole(f, "the number of horizontal angles", 1, LUM_LIMIT_WEB_VALUES, &f->table.n_planes);
    f->line = f->text->line;
    if (!status)
        status = read_whole(f, "the type of photometry (1 C, 2 B, 3 A)", 1, 3, &f->type);
    if (!status)
        status = read_whole(f, "the unit (1 feet, 2 metres)", 1, 2, &units);
    if (!status)
        status = read_in_range(f, "the width of the opening", -1e6, 1e6, &f->width);
    if (!status)
        status = read_in_range(f, "the length of the opening", -1e6, 1e6, &f->length);
    if (!status)
        status = read_in_range(f, "the height of the opening", -1e6, 1e6, &f->height);
    if (!status)
        status = read_in_range(f, "the ballast factor", 1e-6, 1e3, &f->ballast);
    if (!status)
        status = lum_photometry_number(f->text, "the second factor", &f->second, f->err);
    if (!status)
        status = read_in_range(f, "input watts", -1e9, 1e9, &f->watts);
    double metre = units == 1 ? METRES_PER_FOOT : 1.0;
    f->width *= metre, f->length *= metre, f->height *= metre;
    return status;
}

/* Until 1991 the second factor was one of ballast and lamp together. Then it was kept for later, and is 1; in 2019 it
 * became a code for how the file came about. */
static enum lum_status factor_of(struct ies *f, double *ret)
{
    *ret = f->multiplier * f->ballast * f->tilt;
    if (f->year <= 1991) {
        *ret *= f->second;
        if (!(f->second >= 1e-6 && f->second <= 1e3))
            return lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: the ballast-lamp factor must be above 0, not %g",
                            f->text->line, f->second);
    } else if (f->year < 2019 && f->second != 1.0) {
        lum_photometry_note(f->p, "the factor %g after the ballast factor is not applied: since 1995 it is none",
                            f->second);
    }
    return LUM_OK;
}

static enum lum_status read_table(struct ies *f)
{
    struct lum_photometry_table *t = &f->table;
    double factor;
    enum lum_status status = factor_of(f, &factor);
    if (!status)
        status = lum_photometry_table_alloc(t, f->line, f->err);
    for (uint32_t i = 0; !status && i < t->n_angles; i++)
        status = lum_photometry_number(f->text, "a vertical angle", &t->angles[i], f->err);
    t->angles_line = f->text->line;
    for (uint32_t i = 0; !status && i < t->n_planes; i++)
        status = lum_photometry_number(f->text, "a horizontal angle", &t->planes[i], f->err);
    t->planes_line = f->text->line;
    for (size_t i = 0; !status && i < (size_t)t->n_planes * t->n_angles; i++) {
        status = lum_photometry_number(f->text, "an intensity", &t->values[i], f->err);
        t->values[i] *= factor;
        if (!status && !(fabs(t->values[i]) <= 1e12))
            status = lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: an intensity of %g cd is over 1e12", f->text->line,
                              t->values[i]);
    }
    double more;
    if (!status && !lum_photometry_number(f->text, "more", &more, NULL))
        lum_photometry_note(f->p, "line %u: numbers follow the last intensity", f->text->line);
    return status;
}

/* ---- planes of type C ---- */

static bool near(double a, double b)
{
    return fabs(a - b) < 0.01;
}

/* False: they end where none of the symmetries does. */
static bool spread(const struct lum_photometry_table *t, struct lum_photometry_around *a)
{
    uint32_t n = t->n_planes;
    double first = t->planes[0], last = t->planes[n - 1];
    if (n == 1) {
        lum_photometry_add_plane(a, 0.0, 0);
        return true;
    }
    double step = last - t->planes[n - 2];
    bool all = near(last - first, 360.0), missing = first == 0.0 && last > 180.0 && near(last + step, 360.0);
    bool quarter = first == 0.0 && near(last, 90.0), half = first == 0.0 && near(last, 180.0);
    bool across = (near(first, 90.0) && near(last, 270.0)) || (near(first, -90.0) && near(last, 90.0));
    if (!(all || missing || quarter || half || across))
        return false;
    if (across && near(first, 90.0)) /* what lies at 180 - c is the same: from -90 to 90 first */
        for (uint32_t i = n; i-- > 0;)
            lum_photometry_add_plane(a, 180.0 - t->planes[i], i);
    for (uint32_t i = 0; i < n; i++)
        lum_photometry_add_plane(a, t->planes[i], i);
    if (across && near(first, -90.0))
        for (uint32_t i = n; i-- > 0;)
            lum_photometry_add_plane(a, 180.0 - t->planes[i], i);
    if (quarter)
        for (uint32_t i = n; i-- > 0;)
            lum_photometry_add_plane(a, 180.0 - t->planes[i], i);
    if (quarter)
        for (uint32_t i = 0; i < n; i++)
            lum_photometry_add_plane(a, 180.0 + t->planes[i], i);
    if (quarter || half)
        for (uint32_t i = n; i-- > 0;)
            lum_photometry_add_plane(a, 360.0 - t->planes[i], i);
    if (missing)
        lum_photometry_add_plane(a, 360.0, 0);
    return true;
}

static enum lum_status take_type_c(struct ies *f)
{
    struct lum_photometry_table *t = &f->table;
    struct lum_photometry_around a = {0};
    enum lum_status status =
        lum_photometry_check_angles("vertical angles", t->angles, t->n_angles, 0.0, 180.0, t->angles_line, f->err);
    if (!status)
        status = lum_photometry_check_angles("horizontal angles", t->planes, t->n_planes, -360.0, 360.0, t->planes_line,
                                             f->err);
    if (!status)
        status = lum_photometry_around_alloc(&a, 4 * (size_t)t->n_planes, f->err);
    if (!status && !spread(t, &a))
        status =
            lum_fail(f->err, LUM_ERR_INVALID, "",
                     "line %u: horizontal angles from %g to %g: only 0, 0 to 90, 180 or 360, and 90 to 270 are known",
                     t->planes_line, t->planes[0], t->planes[t->n_planes - 1]);
    if (!status) {
        if (a.n > 1 && near(a.c[a.n - 1] - a.c[0], 360.0))
            a.c[a.n - 1] = a.c[0] + 360.0;
        status = lum_photometry_take(f->p, t, a.c, a.from, a.n, f->err);
    }
    lum_photometry_around_finish(&a);
    return status;
}

/* ---- types A and B: two angles from the beam ---- */

/* Angle i of n, ascending, of what is mirrored about its first one if that is 0; and which of the file's it is. */
static double mirrored(const double *deg, uint32_t n, uint32_t i, uint32_t *ret_from)
{
    uint32_t below = deg[0] == 0.0 ? n - 1 : 0;
    *ret_from = i < below ? n - 1 - i : i - below;
    return i < below ? -deg[*ret_from] : deg[*ret_from];
}

/* The pole lies at 90 degrees of one of the angles: of the vertical one for A, of the horizontal one for B. The other
 * turns about it. */
static enum lum_status take_type_ab(struct ies *f)
{
    struct lum_photometry_table *t = &f->table, to = {0};
    bool b = f->type == 2;
    enum lum_status status =
        lum_photometry_check_angles("vertical angles", t->angles, t->n_angles, -90.0, 90.0, t->angles_line, f->err);
    if (!status)
        status = lum_photometry_check_angles("horizontal angles", t->planes, t->n_planes, b ? -90.0 : -180.0,
                                             b ? 90.0 : 180.0, t->planes_line, f->err);
    if (!status && t->n_planes < 2)
        status =
            lum_fail(f->err, LUM_ERR_INVALID, "", "line %u: photometry of type %c needs two horizontal angles at least",
                     t->planes_line, b ? 'B' : 'A');
    if (status)
        return status;
    const double *turn = b ? t->angles : t->planes, *lift = b ? t->planes : t->angles;
    uint32_t n_turn = b ? t->n_angles : t->n_planes, n_lift = b ? t->n_planes : t->n_angles;
    to.n_planes = turn[0] == 0.0 ? 2 * n_turn - 1 : n_turn;
    to.n_angles = lift[0] == 0.0 ? 2 * n_lift - 1 : n_lift;
    uint32_t *from = lum_calloc(to.n_planes, sizeof *from);
    status = lum_photometry_table_alloc(&to, f->line, f->err);
    if (!status && !from)
        status = lum_fail(f->err, LUM_ERR_NOMEM, "", "out of memory for %u planes", to.n_planes);
    for (uint32_t i = 0; !status && i < to.n_planes; i++) {
        uint32_t at_turn, at_lift;
        from[i] = i;
        to.planes[i] = mirrored(turn, n_turn, i, &at_turn);
        for (uint32_t k = 0; k < to.n_angles; k++) { /* from the pole: the greatest first */
            to.angles[k] = 90.0 - mirrored(lift, n_lift, to.n_angles - 1 - k, &at_lift);
            size_t h = b ? at_lift : at_turn, v = b ? at_turn : at_lift;
            to.values[(size_t)i * to.n_angles + k] = t->values[h * t->n_angles + v];
        }
    }
    if (!status)
        status = lum_photometry_take(f->p, &to, to.planes, from, to.n_planes, f->err);
    f->p->type = b ? LUM_WEB_B : LUM_WEB_A;
    lum_photometry_table_finish(&to);
    lum_free(from);
    return status;
}

/* ---- the opening ---- */

/* Signs of width, length and height name shapes, in each version others. What they have in common is enough to say what
 * is seen from below: none negative, a box or a rectangle; across negative and height not, something round; height
 * negative, too, a ball, or a cylinder that lies. */
static void read_opening(struct ies *f)
{
    double w = f->width, l = f->length, h = f->height;
    struct lum_photometry *p = f->p;
    bool round = (w < 0.0 && l <= 0.0) || (l < 0.0 && w <= 0.0), mixed = w * l < 0.0;
    p->size_m[0] = fabs(l);
    p->size_m[1] = fabs(w);
    p->size_m[2] = fabs(h);
    if (w == 0.0 && l == 0.0 && h == 0.0)
        p->opening = "point";
    else if (round && h < 0.0 && w != 0.0 && !(f->year >= 2002 && l == 0.0))
        p->opening = "sphere";
    else if ((round || mixed) && h >= 0.0)
        p->opening = "disc";
    else
        p->opening = "rectangle"; /* and lying cylinders, standing discs: what they span */
    if (round) {                  /* one diameter for both */
        p->size_m[0] = l != 0.0 ? fabs(l) : fabs(w);
        p->size_m[1] = w != 0.0 ? fabs(w) : fabs(l);
    }
}

/* ---- the file ---- */

enum lum_status lum_ies_read(struct lum_photometry_text *text, struct lum_photometry *p, struct lum_error *err)
{
    struct ies f = {.text = text, .p = p, .err = err, .year = 1986};
    const char *tilt = NULL;
    size_t n = 0;
    enum lum_status status = read_labels(&f, &tilt, &n);
    if (!status)
        status = read_tilt(&f, tilt, n);
    if (!status)
        status = read_record(&f);
    if (!status)
        status = read_table(&f);
    if (!status)
        status = f.type == 1 ? take_type_c(&f) : take_type_ab(&f);
    if (!status) {
        p->absolute = f.lumens < 0.0;
        p->rated_lm = p->absolute ? 0.0 : f.lumens * f.lamps;
        p->watts = fmax(f.watts, 0.0);
        read_opening(&f);
    }
    lum_photometry_table_finish(&f.table);
    return status;
}
