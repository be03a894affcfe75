/* Photometric files: what versions and symmetries mean, what is refused and in which line, damaged files, and the real
 * ones of ../shared/scenes, where they are. */
#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/light/web_facts.h"
#include "protocol/base/limits.h"
#include "server/importer/photometry.h"

#define DEG 0.017453292519943295

static enum lum_status read_text(const char *text, const char *name, struct lum_photometry *p, struct lum_error *err)
{
    struct lum_bytes file = {(uint8_t *)(uintptr_t)text, strlen(text)};
    return lum_photometry_read(&file, name, p, err);
}

static struct lum_web *web_of(const struct lum_photometry *p)
{
    struct lum_web_desc d = {p->type, p->n_c, p->n_gamma, p->c_deg, p->gamma_deg, p->candela};
    struct lum_web *web = NULL;
    struct lum_error err = {0};
    if (lum_web_create(&d, &web, &err))
        fail_msg("%s", err.text);
    return web;
}

static struct lum_photometry good(const char *text, const char *name)
{
    struct lum_photometry p;
    struct lum_error err = {0};
    if (read_text(text, name, &p, &err))
        fail_msg("%s: %s", name, err.text);
    return p;
}

static void expect_near(const char *what, double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance))
        fail_msg("%s: %.9g, expected %.9g", what, got, want);
}

/* ---- versions of LM-63 ---- */

#define NUMBERS "\nTILT=NONE\n1 1000 2 2 1 1 2 0 0 0\n0.5 0.9 10\n0 90\n0\n100 0\n"

static void the_second_factor_goes_by_version(void **state)
{
    (void)state;
    static const struct {
        const char *first;
        double factor;
    } rows[] = {
        {"IESNA:LM-63-2019", 1},
        {"IES:LM-63-2019", 1},
        {"IESNA:LM-63-2002", 1},
        {"IESNA:LM-63-1995", 1},
        {"IESNA95", 1},
        {"IESNA91", 0.9},
        {"IESNA:LM-63-1991", 0.9},
        {"CFI", 0.9},
        {"2'x4' - 2 LAMP TROFFER", 0.9},
        {"\xef\xbb\xbfIESNA:LM-63-2002", 1},
        {"\n\n  IESNA:LM-63-2002 \r", 1},
        {"[TEST] LM-63-2002", 0.9}, /* says so elsewhere than in its first line */
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        char text[256];
        snprintf(text, sizeof text, "%s%s", rows[i].first, NUMBERS);
        struct lum_photometry p = good(text, "a.ies");
        expect_near(rows[i].first, (double)p.candela[0], 100 * 2 * 0.5 * rows[i].factor, 1e-5);
        lum_photometry_finish(&p);
    }
    struct lum_photometry p = good("IESNA:LM-63-2002" NUMBERS, "a.ies");
    assert_int_equal(p.n_notes, 1); /* 0.9 is odd there */
    assert_true(strstr(p.notes[0], "0.9") != NULL);
    lum_photometry_finish(&p);
}

static void openings_go_by_their_signs(void **state)
{
    (void)state;
    static const struct {
        const char *first, *size, *opening;
        double along, across, height;
    } rows[] = {
        {"IESNA:LM-63-2002", "0 0 0", "point", 0, 0, 0},
        {"IESNA:LM-63-2002", ".5 1.2 0", "rectangle", 1.2, 0.5, 0},
        {"IESNA:LM-63-2002", ".5 1.2 .1", "rectangle", 1.2, 0.5, 0.1},
        {"IESNA:LM-63-1995", "-.1 0 0", "disc", 0.1, 0.1, 0},
        {"IESNA:LM-63-1995", "-.1 0 .2", "disc", 0.1, 0.1, 0.2},
        {"IESNA:LM-63-1995", "-.1 0 -.1", "sphere", 0.1, 0.1, 0.1},
        {"IESNA91", "-.1 .3 0", "disc", 0.3, 0.1, 0},
        {"IESNA:LM-63-2002", "-.1 -.1 0", "disc", 0.1, 0.1, 0},
        {"IESNA:LM-63-2002", "-.2 -.1 0", "disc", 0.1, 0.2, 0},
        {"IESNA:LM-63-2002", "-.1 -.1 .3", "disc", 0.1, 0.1, 0.3},
        {"IES:LM-63-2019", "-.1 -.1 -.1", "sphere", 0.1, 0.1, 0.1},
        {"IESNA:LM-63-2002", "-.1 1.2 -.1", "rectangle", 1.2, 0.1, 0.1}, /* a tube */
        {"IESNA:LM-63-2002", "0 -.3 -.3", "rectangle", 0.3, 0.3, 0.3},   /* a disc that stands */
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++)
        for (int feet = 0; feet < 2; feet++) {
            char text[256];
            double unit = feet ? 0.3048 : 1.0;
            snprintf(text, sizeof text, "%s\nTILT=NONE\n1 -1 1 2 1 1 %d %s 1 1 10\n0 90\n0\n100 0\n", rows[i].first,
                     2 - feet, rows[i].size);
            struct lum_photometry p = good(text, "a.ies");
            assert_string_equal(p.opening, rows[i].opening);
            expect_near(rows[i].size, p.size_m[0], unit * rows[i].along, 1e-9);
            expect_near(rows[i].size, p.size_m[1], unit * rows[i].across, 1e-9);
            expect_near(rows[i].size, p.size_m[2], unit * rows[i].height, 1e-9);
            assert_true(p.absolute && p.rated_lm == 0.0 && p.watts == 10.0);
            lum_photometry_finish(&p);
        }
}

/* ---- symmetries ---- */

/* Of all planes with what they are to be the same as: about C0, about C90, about both, none. cd. */
static double field(double c, double gamma, bool about_c0, bool about_c90)
{
    double x = sin(gamma * DEG) * cos(c * DEG), y = sin(gamma * DEG) * sin(c * DEG);
    x = about_c90 ? fabs(x) : x;
    y = about_c0 ? fabs(y) : y;
    return gamma < 90 ? floor(1000 * cos(gamma * DEG) * (1 + 0.4 * x + 0.3 * y)) : 0;
}

static void expect_field(const char *what, const struct lum_photometry *p, bool about_c0, bool about_c90, double turn,
                         double scale)
{
    struct lum_web *w = web_of(p);
    for (int c = 0; c < 360; c += 15)
        for (int gamma = 0; gamma <= 90; gamma += 10) {
            double got = w->peak_cd * (double)lum_web_share(w, (float)(c * DEG), (float)(gamma * DEG));
            char text[80];
            snprintf(text, sizeof text, "%s, at c %d gamma %d", what, c, gamma);
            expect_near(text, got, scale * field(c + turn, gamma, about_c0, about_c90), 2e-3 * scale); /* of 1000 */
        }
    assert_true(w->closed);
    lum_web_unref(w);
}

static char *ies_of(int first, int last, bool about_c0, bool about_c90)
{
    char *text = calloc(1, 1 << 16);
    size_t n =
        (size_t)sprintf(text, "IESNA:LM-63-1995\nTILT=NONE\n1 -1 1 10 %d 1 2 0 0 0\n1 1 10\n", (last - first) / 15 + 1);
    for (int gamma = 0; gamma <= 90; gamma += 10)
        n += (size_t)sprintf(text + n, "%d ", gamma);
    for (int c = first; c <= last; c += 15)
        n += (size_t)sprintf(text + n, "%s%d", c % 45 ? " " : "\r\n", c);
    for (int c = first; c <= last; c += 15)
        for (int gamma = 0; gamma <= 90; gamma += 10)
            n += (size_t)sprintf(text + n, "%s%g", gamma % 30 ? "," : "\n", field(c, gamma, about_c0, about_c90));
    return text;
}

static void planes_of_lm63(void **state)
{
    (void)state;
    static const struct {
        int first, last;
        bool about_c0, about_c90;
    } rows[] = {
        {0, 90, true, true},    {0, 180, true, false},  {0, 360, false, false},    {0, 345, false, false},
        {90, 270, false, true}, {-90, 90, false, true}, {-180, 180, false, false},
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        char *text = ies_of(rows[i].first, rows[i].last, rows[i].about_c0, rows[i].about_c90), what[40];
        struct lum_photometry p = good(text, "a.ies");
        snprintf(what, sizeof what, "planes %d to %d", rows[i].first, rows[i].last);
        expect_field(what, &p, rows[i].about_c0, rows[i].about_c90, 0.0, 1.0);
        lum_photometry_finish(&p);
        free(text);
    }
}

/* cd/klm of a lamp of 2500 lm. */
static char *ldt_of(int symmetry)
{
    static const int first[] = {0, 0, 0, 270, 0}, n_stored[] = {24, 1, 13, 13, 7};
    bool about_c0 = symmetry == 2 || symmetry == 4, about_c90 = symmetry >= 3;
    char *text = calloc(1, 1 << 17);
    size_t n = (size_t)sprintf(text,
                               "M\xfcller\r\n1\r\n%d\r\n24\r\n15\r\n10\r\n10\r\n\r\nLampe\r\n\r\na.ldt\r\n\r\n"
                               "1200\r\n100\r\n50\r\n1100\r\n0\r\n\r\n_\r\n0\r\n0\r\n100\r\n80\r\n1,0\r\n0\r\n"
                               "2\r\n1\r\nT16\r\n1500,5\r\n3000K\r\n1B\r\n20,5\r\n1\r\nT5\r\n999,5\r\n\r\n\r\n10\r\n",
                               symmetry);
    for (int k = 0; k < 10; k++)
        n += (size_t)sprintf(text + n, "0,5\r\n");
    for (int c = 0; c < 360; c += 15)
        n += (size_t)sprintf(text + n, "%d,0\r\n", c);
    for (int gamma = 0; gamma <= 90; gamma += 10)
        n += (size_t)sprintf(text + n, "%d\r\n", gamma);
    for (int k = 0; k < n_stored[symmetry]; k++)
        for (int gamma = 0; gamma <= 90; gamma += 10) {
            double cd = field(first[symmetry] + 15 * k, gamma, about_c0, about_c90);
            n += (size_t)sprintf(text + n, "%d,%d\r\n", (int)cd / 10, (int)cd % 10);
        }
    return text;
}

/* The planes lie 90 degrees on: C90 is c 0. The file has a tenth of the field, times 2.5 klm. */
static void planes_of_eulumdat(void **state)
{
    (void)state;
    for (int symmetry = 0; symmetry <= 4; symmetry++) {
        char *text = ldt_of(symmetry), what[40];
        struct lum_photometry p = good(text, "a.LDT");
        snprintf(what, sizeof what, "symmetry %d", symmetry);
        if (symmetry == 1)
            for (int k = 0; k < 10; k++)
                expect_near(what, (double)p.candela[k], 0.25 * field(0, 10 * k, false, false), 1e-3);
        else
            expect_field(what, &p, symmetry == 2 || symmetry == 4, symmetry >= 3, 90.0, 0.25);
        assert_string_equal(p.name, "M\xc3\xbcller Lampe");
        assert_string_equal(p.opening, "disc"); /* a luminous width of 0 */
        expect_near("diameter", p.size_m[1], 1.1, 1e-9);
        expect_near("lumens", p.rated_lm, 2500.0, 1e-9);
        expect_near("watts", p.watts, 30.5, 1e-9);
        assert_false(p.absolute);
        lum_photometry_finish(&p);
        free(text);
    }
}

/* ---- types of photometry ---- */

/* A lobe about an axis 30 degrees up and 20 to the right of the beam, told by each type in its own angles: where it is
 * brightest is known. Up is c 0, right is -c 90 (core/light/web.h). */
static double lobe_at(double beam, double up, double right)
{
    const double axis[3] = {cos(30 * DEG) * cos(20 * DEG), sin(30 * DEG), cos(30 * DEG) * sin(20 * DEG)};
    double c = beam * axis[0] + up * axis[1] + right * axis[2];
    return c > 0 ? 1000 * pow(c, 8) : 0;
}

static void types_b_and_a(void **state)
{
    (void)state;
    for (int type = 1; type <= 3; type++) { /* C, B, A */
        char *text = calloc(1, 1 << 18);
        int h0 = type == 1 ? 0 : -90, h1 = type == 1 ? 360 : 90, v0 = type == 1 ? 0 : -90, v1 = type == 1 ? 180 : 90;
        size_t n = (size_t)sprintf(text, "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 %d %d %d 2 0 0 0\n1 1 10\n",
                                   (v1 - v0) / 5 + 1, (h1 - h0) / 5 + 1, type);
        for (int v = v0; v <= v1; v += 5)
            n += (size_t)sprintf(text + n, "%d\n", v);
        for (int h = h0; h <= h1; h += 5)
            n += (size_t)sprintf(text + n, "%d\n", h);
        for (int h = h0; h <= h1; h += 5)
            for (int v = v0; v <= v1; v += 5) {
                double sh = sin(h * DEG), ch = cos(h * DEG), sv = sin(v * DEG), cv = cos(v * DEG);
                double cd = type == 1   ? lobe_at(cv, sv * ch, -sv * sh)
                            : type == 2 ? lobe_at(ch * cv, ch * sv, sh)
                                        : lobe_at(cv * ch, sv, cv * sh);
                n += (size_t)sprintf(text + n, "%.3f\n", cd);
            }
        struct lum_photometry p = good(text, "a.ies");
        struct lum_web *w = web_of(&p);
        struct lum_web_facts f;
        lum_web_facts(w, &f);
        /* Flux of c^8 over half the sphere: 2 pi / 9; chords lie above or below a convex c^8 by (h^2 / 12) of its
         * second derivative, 8 times itself: 0.5 %. */
        expect_near("flux", f.flux_lm, 1000 * 2 * 3.14159265 / 9, 5);
        /* 30 up and 20 to the right: gamma from the beam; c from c 0 on to -c 90. To half a step of 5 degrees. */
        expect_near("gamma of the peak", f.peak_gamma_deg, acos(cos(30 * DEG) * cos(20 * DEG)) / DEG, 3.6);
        expect_near("c of the peak", f.peak_c_deg, 360 - atan2(cos(30 * DEG) * sin(20 * DEG), sin(30 * DEG)) / DEG, 6);
        assert_int_equal(f.symmetry, LUM_WEB_LOPSIDED);
        lum_web_unref(w);
        lum_photometry_finish(&p);
        free(text);
    }
}

/* From 0 on, angles of types A and B are mirrored. */
static void halves_of_b_are_mirrored(void **state)
{
    (void)state;
    struct lum_photometry p =
        good("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 3 2 2 0 0 0 1 1 10\n0 90\n0 45 90\n8 4 6 3 0 0\n", "a.ies");
    assert_int_equal(p.type, LUM_WEB_B);
    assert_int_equal(p.n_c, 3);
    assert_int_equal(p.n_gamma, 5);
    static const float want[3][5] = {{0, 3, 4, 3, 0}, {0, 6, 8, 6, 0}, {0, 3, 4, 3, 0}};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 5; k++)
            assert_true(p.candela[5 * i + k] == want[i][k] && p.gamma_deg[k] == (float)(45 * k) &&
                        p.c_deg[i] == (float)(90 * i - 90));
    lum_photometry_finish(&p);
}

/* ---- what is refused ---- */

static void refusals_name_the_line(void **state)
{
    (void)state;
#define HEAD "IESNA:LM-63-2002\n[TEST] 1\nTILT=NONE\n"
    static const struct {
        const char *text, *name, *why;
    } rows[] = {
        {"", "a.ies", "line 1: no line begins with TILT="},
        {"SPV1.0\n#NBZENITH 4\n0.4 0.6\n", "a.ies", "line 4: no line begins with TILT="},
        {"a\nTILT=../lamp.tlt\n1 1 1\n", "a.ies", "line 2: TILT=../lamp.tlt names another file"},
        {"a\nTILT=INCLUDE\n1\n2\n0 90\n1\n", "a.ies", "line 7: the file ends before a tilt factor"},
        {"a\nTILT=INCLUDE\n4\n", "a.ies", "line 3: the lamp's position"},
        {"a\nTILT=INCLUDE\n1\n1\n0\n0\n", "a.ies", "line 6: the tilt factor of 0 degrees is 0"},
        {HEAD "1 -1 1 2 1 1\n2 0 0\n", "a.ies", "line 6: the file ends before the height"},
        {HEAD "1 -1 1 two 1 1 2 0 0 0 1 1 1\n", "a.ies", "line 4: \"two\" is no number"},
        {HEAD "1 -1 0x10 2 1 1 2 0 0 0 1 1 1\n", "a.ies", "line 4: \"0x10\" is no number"},
        {HEAD "1 -1 inf 2 1 1 2 0 0 0 1 1 1\n", "a.ies", "line 4: \"inf\" is no number"},
        {HEAD "1 -1 1e999 2 1 1 2 0 0 0 1 1 1\n", "a.ies", "line 4: \"1e999\" is no number"},
        {HEAD "1 -1 0 2 1 1 2 0 0 0 1 1 1\n", "a.ies", "line 4: the candela multiplier must be"},
        {HEAD "1 -1 1 2.5 1 1 2 0 0 0 1 1 1\n", "a.ies", "line 4: the number of vertical angles must be a whole"},
        {HEAD "1 -1 1 1 1 1 2 0 0 0 1 1 1\n", "a.ies", "line 4: the number of vertical angles must be a whole"},
        {HEAD "1 -1 1 2 0 1 2 0 0 0 1 1 1\n", "a.ies", "line 4: the number of horizontal angles must be a whole"},
        {HEAD "1 -1 1 262144 262144 1 2 0 0 0 1 1 1\n", "a.ies", "line 4: 262144 planes of 262144 angles are over"},
        {HEAD "1 -1 1 2 1 4 2 0 0 0 1 1 1\n", "a.ies", "line 4: the type of photometry"},
        {HEAD "1 -1 1 2 1 1 3 0 0 0 1 1 1\n", "a.ies", "line 4: the unit"},
        {HEAD "1 -1 1 2 1 1 2 0 0 0\n0 1 1\n", "a.ies", "line 5: the ballast factor must be"},
        {HEAD "1 -1 1 2 1 1 2 0 0 0\n1 1 1\n90 0\n0\n1 1\n", "a.ies",
         "line 6: vertical angles must ascend: 0 follows 90"},
        {HEAD "1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 181\n0\n1 1\n", "a.ies", "line 6: vertical angles must be from 0 to 180"},
        {HEAD "1 -1 1 2 2 1 2 0 0 0\n1 1 1\n0 90\n0\n200\n1 1 1 1\n", "a.ies",
         "line 8: horizontal angles from 0 to 200"},
        {HEAD "1 -1 1 2 1 2 2 0 0 0\n1 1 1\n0 90\n0\n1 1\n", "a.ies", "line 7: photometry of type B needs two"},
        {HEAD "1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 NaN\n", "a.ies", "line 8: \"NaN\" is no number"},
        {HEAD "1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1\n", "a.ies", "line 9: the file ends before an intensity"},
        {HEAD "1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 1e13\n", "a.ies", "line 8: an intensity of 1e+13 cd is over"},
        {HEAD "1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n0 0\n", "a.ies", "no light"},
        {"IESNA91\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 0 1\n0 90 0 1 0\n", "a.ies", "line 4: the ballast-lamp factor"},
        {"a\n\n\n\n\n\n", "a.ldt", "line 4: the number of planes must be from 1"},
        {"a\nb\n7\n", "a.ldt", "line 3: the symmetry (0 to 4) must be from 0 to 4"},
        {"a\nb\n0\nx\n", "a.ldt", "line 4: \"x\" is no number; expected the number of planes"},
        {"a\n1\n2\n15\n", "a.ldt", "line 5: the file ends in its head"},
        {"a\n1\n4\n6\n60\n10\n", "a.ldt", "line 6: 6 planes cannot be symmetrical"},
    };
    for (size_t i = 0; i < LUM_ARRAY_LEN(rows); i++) {
        struct lum_photometry p;
        struct lum_error err = {0};
        enum lum_status status = read_text(rows[i].text, rows[i].name, &p, &err);
        lum_photometry_finish(&p);
        if (!status || !strstr(err.text, rows[i].why))
            fail_msg("row %zu: %s; expected %s", i, status ? err.text : "accepted", rows[i].why);
    }
}

/* The lamps' lumens scale the intensities of EULUMDAT, and only of it; other oddities are told and read. */
static void oddities_are_told(void **state)
{
    (void)state;
    struct lum_photometry p = good(HEAD "2 500 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1000 -5\n", "a.ies");
    expect_near("rated", p.rated_lm, 1000.0, 0.0);
    assert_int_equal(p.n_notes, 2);
    assert_non_null(strstr(p.notes[0], "below 0"));
    assert_non_null(strstr(p.notes[1], "more than the 1000 lm"));
    assert_true(p.candela[0] == 1000.0f && p.candela[1] == 0.0f);
    lum_photometry_finish(&p);
    p = good(HEAD "1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n10 5 7 8\n", "a.ies");
    assert_non_null(strstr(p.notes[0], "line 8: numbers follow"));
    lum_photometry_finish(&p);
    p = good("a\nTILT=INCLUDE\n2\n3\n-45 0 45\n.5 .8 .5\n1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n10 5\n", "a.ies");
    expect_near("tilt", (double)p.candela[0], 8.0, 1e-6);
    assert_non_null(strstr(p.notes[0], "TILT"));
    lum_photometry_finish(&p);
    p = good("[MANUFAC] A \"B\" \\ C\x01\n[LUMINAIRE] 30\xb0\n[X] y" NUMBERS, "a.ies");
    assert_string_equal(p.name, "A 'B' / C  30\xc2\xb0");
    lum_photometry_finish(&p);
}

/* One intensity more than a web may have, once its planes are written out; and one byte more than a file may have. */
static void files_have_a_limit(void **state)
{
    (void)state;
    for (int n = 511; n <= 513; n++) { /* planes all around: 512 angles in each */
        char *text = calloc(1, 1 << 22);
        size_t at = (size_t)sprintf(text, HEAD "1 -1 1 512 %d 1 2 0 0 0\n1 1 1\n", n);
        for (int i = 0; i < 512; i++)
            at += (size_t)sprintf(text + at, "%g ", i * 0.25);
        for (int i = 0; i < n; i++)
            at += (size_t)sprintf(text + at, "\n%g", i + 1 < n ? i * 0.5 : 360.0);
        for (int i = 0; i < n * 512; i++)
            at += (size_t)sprintf(text + at, "\n1");
        struct lum_photometry p;
        struct lum_error err = {0};
        enum lum_status status = read_text(text, "a.ies", &p, &err);
        assert_int_equal(status, n > 512 ? LUM_ERR_LIMIT : LUM_OK);
        lum_photometry_finish(&p);
        free(text);
    }
    for (int more = -1; more <= 1; more++) {
        size_t n = LUM_LIMIT_WEB_FILE_BYTES + (size_t)more;
        char *text = malloc(n + 1);
        memset(text, '\n', n);
        text[n] = '\0';
        memcpy(text, HEAD "1 -1 1 2 1 1 2 0 0 0 1 1 1 0 90 0 1 0", sizeof HEAD + 36);
        struct lum_photometry p;
        enum lum_status status = read_text(text, "a.ies", &p, NULL);
        assert_int_equal(status, more > 0 ? LUM_ERR_LIMIT : LUM_OK);
        lum_photometry_finish(&p);
        free(text);
    }
}

/* ---- damaged files ---- */

/* All truncations, and bytes changed at random: nothing crashes, and what is read is a web. */
static void damage(const char *text, size_t n, const char *name)
{
    static const char junk[] = "0123456789.-+eE, \n\r\t\x1a[]=TILNxyz\xff";
    char *copy = malloc(n + 1);
    uint64_t random = 1;
    for (size_t round = 0; round < n + 4000; round++) {
        size_t length = round < n ? round : n;
        memcpy(copy, text, n);
        for (int k = 0; round >= n && k < 1 + (int)(round % 3); k++) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            copy[(random >> 33) % n] = junk[(random >> 20) % (sizeof junk - 1)];
        }
        struct lum_bytes file = {(uint8_t *)copy, length};
        struct lum_photometry p;
        struct lum_error err = {0};
        if (!lum_photometry_read(&file, name, &p, &err)) {
            struct lum_web *w = web_of(&p);
            assert_true(w->flux_sr > 0.0 && isfinite(w->flux_sr * w->peak_cd));
            lum_web_unref(w);
        } else {
            assert_true(err.text[0] != '\0');
        }
        lum_photometry_finish(&p);
    }
    free(copy);
}

static void damaged_files(void **state)
{
    (void)state;
    char *text = ies_of(0, 90, true, true);
    damage(text, strlen(text), "a.ies");
    free(text);
    text = ldt_of(4);
    damage(text, strlen(text), "a.ldt");
    free(text);
    static const char b[] =
        "IESNA91\nTILT=INCLUDE\n1\n2\n0 90\n1 1\n1 900 1 3 3 2 1 -1 2 3 1 1 10\n-90 0 90\n0 45 90\n8 4 6 3 0 0 1 2 3\n";
    damage(b, sizeof b - 1, "b.ies");
}

static void memory_that_is_short(void **state)
{
    (void)state;
    char *texts[] = {ies_of(0, 90, true, true), ldt_of(3)};
    for (int k = 0; k < 2; k++) {
        struct lum_error err = {0};
        enum lum_status status = LUM_ERR_NOMEM;
        for (uint64_t n = 1; status; n++) {
            struct lum_photometry p;
            assert_true(n < 100);
            lum_alloc_fail_after(n);
            status = read_text(texts[k], k ? "a.ldt" : "a.ies", &p, &err);
            lum_alloc_fail_after(0);
            assert_true(!status || status == LUM_ERR_NOMEM);
            lum_photometry_finish(&p);
        }
        free(texts[k]);
    }
}

/* ---- real files ---- */

static struct lum_bytes load(const char *dir, const char *name)
{
    char path[512];
    struct lum_bytes file = {0};
    snprintf(path, sizeof path, "%s/%s", dir, name);
    FILE *f = fopen(path, "rb");
    if (!f)
        return file;
    file.data = calloc(1, 1 << 23);
    file.n = fread(file.data, 1, 1 << 23, f);
    fclose(f);
    return file;
}

/* By midpoints of a quarter of a degree: within a few 1e-4 of the integral. */
static double flux_by_midpoints(const struct lum_web *w)
{
    double sum = 0.0, step = 0.25 * DEG;
    for (int k = 0; k < 720; k++)
        for (int i = 0; i < 1440; i++)
            sum +=
                (double)lum_web_share(w, (float)((i + 0.5) * step), (float)((k + 0.5) * step)) * sin((k + 0.5) * step);
    return sum * step * step * w->peak_cd;
}

/* Lumens that are known otherwise: from the label of the file, which its maker wrote, or from the notes that came with
 * it. Within half a percent. */
static const struct {
    const char *name;
    double flux_lm;
} known[] = {
    {"ieslib_007cfb11e343.ies", 321},  {"ieslib_00c6ce79e1d2.ies", 2044},
    {"ieslib_01dac7d6c646.ies", 940},  {"ieslib_02a7562c6504.ies", 9600},
    {"ieslib_0646706b3d2d.ies", 1218}, {"ieslib_06b4cfdc8805.ies", 1221},
    {"indoor_60W_5300lm.ies", 5300},   {"outdoor_roadway_60W.ies", 9155.7},
    {"aec_MAXWELL_CIE.IES", 1000},     {"lbl_dll.ies", 1250},
};

static void check_known(const char *name, double flux_lm)
{
    for (size_t i = 0; i < LUM_ARRAY_LEN(known); i++)
        if (strcmp(name, known[i].name) == 0)
            expect_near(name, flux_lm, known[i].flux_lm, 0.005 * known[i].flux_lm);
}

/* Every file is read, and its flux is the integral; or it is refused with a line. */
static void samples(const char *dir, unsigned want_read, unsigned want_refused)
{
    DIR *d = opendir(dir);
    unsigned n_read = 0, n_refused = 0;
    if (!d) {
        printf("skipped: no %s\n", dir);
        return;
    }
    for (struct dirent *e; (e = readdir(d));) {
        struct lum_bytes file = e->d_name[0] == '.' ? (struct lum_bytes){0} : load(dir, e->d_name);
        struct lum_photometry p;
        struct lum_error err = {0};
        if (!file.data)
            continue;
        enum lum_status status = lum_photometry_read(&file, e->d_name, &p, &err);
        if (!status) {
            struct lum_web *w = web_of(&p);
            expect_near(e->d_name, p.flux_lm, flux_by_midpoints(w), 0.002 * p.flux_lm);
            check_known(e->d_name, p.flux_lm);
            assert_false(strncmp(e->d_name, "NOT_LM63", 8) == 0);
            lum_web_unref(w);
        } else if (strncmp(err.text, "line ", 5) != 0) {
            fail_msg("%s: %s", e->d_name, err.text);
        }
        n_read += !status;
        n_refused += status != LUM_OK;
        lum_photometry_finish(&p);
        free(file.data);
    }
    closedir(d);
    printf("%s: %u read, %u refused\n", dir, n_read, n_refused);
    assert_true(n_read >= want_read && n_refused >= want_refused);
}

static void our_own_samples(void **state)
{
    (void)state;
    samples(LUMEND_SOURCE "/tests/photometry", 3, 0);
}

static void real_samples(void **state)
{
    (void)state;
    samples(LUMEND_SOURCE "/../shared/scenes/ies", 28, 5);
}

static void malformed_samples(void **state)
{
    (void)state;
    samples(LUMEND_SOURCE "/../shared/scenes/malformed/generated/ies", 3, 12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_second_factor_goes_by_version),
        cmocka_unit_test(openings_go_by_their_signs),
        cmocka_unit_test(planes_of_lm63),
        cmocka_unit_test(planes_of_eulumdat),
        cmocka_unit_test(types_b_and_a),
        cmocka_unit_test(halves_of_b_are_mirrored),
        cmocka_unit_test(refusals_name_the_line),
        cmocka_unit_test(oddities_are_told),
        cmocka_unit_test(files_have_a_limit),
        cmocka_unit_test(damaged_files),
        cmocka_unit_test(memory_that_is_short),
        cmocka_unit_test(our_own_samples),
        cmocka_unit_test(real_samples),
        cmocka_unit_test(malformed_samples),
    };
    return cmocka_run_group_tests_name("photometry", tests, NULL, NULL);
}
