/* Photometric files: IES LM-63 and EULUMDAT. Readers are total over arbitrary bytes; what they refuse, they refuse with
 * the line and the reason. No file but the one that they are given is opened: a file of TILT factors is refused. */
#ifndef LUM_SERVER_IMPORTER_PHOTOMETRY_H
#define LUM_SERVER_IMPORTER_PHOTOMETRY_H

#include "core/light/web.h"
#include "server/importer/importer.h"

#define LUM_PHOTOMETRY_NOTES 8u /* of one file; beyond, nobody reads them */

/* A web in cd and degrees, ready for core/light/web.h: symmetries are written out, factors applied. */
struct lum_photometry {
    enum lum_web_type type;
    uint32_t n_c, n_gamma;
    float *c_deg, *gamma_deg, *candela; /* owned; NULL until they are read */
    char name[128];                  /* of maker and luminaire, printable UTF-8 without quotes and backslashes; or "" */
    const char *opening;             /* as the field of a web record: "disc" */
    double size_m[3];                /* along c0, along c90, height */
    bool absolute;                   /* no lamps are rated */
    double rated_lm, watts, flux_lm; /* of all lamps; 0: not said; the integral of the web */
    char notes[LUM_PHOTOMETRY_NOTES][160]; /* what was odd, for people */
    uint32_t n_notes;
};

/* By the file's name EULUMDAT (.ldt, .eul) or LM-63. The caller finishes ret_photometry, also on failure. */
LUM_MUST_USE enum lum_status lum_photometry_read(const struct lum_bytes *file, const char *name,
                                                 struct lum_photometry *ret_photometry, struct lum_error *err);
void lum_photometry_finish(struct lum_photometry *p);
/* Sends the notes as warnings that begin with name; and the arrays, as member "web" of the light that follows. */
void lum_photometry_warn(struct lum_emit *e, const char *name, const struct lum_photometry *p);
void lum_photometry_put(struct lum_emit *e, struct lum_op_text *op, const struct lum_photometry *p);

/* ---- between the readers ---- */

/* Text, of which a line is counted when it is left. */
struct lum_photometry_text {
    const char *at, *end;
    uint32_t line; /* of what was read last, from 1 */
    bool ended;    /* at a line break: the next read is of the next line */
};
/* The next line without its end, not terminated. False: there is none. */
bool lum_photometry_line(struct lum_photometry_text *t, const char **ret_line, size_t *ret_n);
/* The next number, between blanks, commas and line ends. what: of what, for the refusal. */
LUM_MUST_USE enum lum_status lum_photometry_number(struct lum_photometry_text *t, const char *what, double *ret_value,
                                                   struct lum_error *err);
/* All of s[0..n) as a number: digits, point, sign, exponent. */
bool lum_photometry_parse(const char *s, size_t n, double *ret_value);
bool lum_photometry_blank(char c); /* between words */

/* A table as the file has it, which the readers fill: angles in degrees, values plane by plane in cd. */
struct lum_photometry_table {
    uint32_t n_planes, n_angles;
    double *planes, *angles, *values; /* owned */
    uint32_t planes_line, angles_line;
};
/* n_planes and n_angles are set: makes room, or says that they are too many. */
LUM_MUST_USE enum lum_status lum_photometry_table_alloc(struct lum_photometry_table *t, uint32_t line,
                                                        struct lum_error *err);
void lum_photometry_table_finish(struct lum_photometry_table *t);
/* Which planes there are all around, ascending, and of which plane of the file each is. */
struct lum_photometry_around {
    double *c;
    uint32_t *from, n;
};
LUM_MUST_USE enum lum_status lum_photometry_around_alloc(struct lum_photometry_around *a, size_t most,
                                                         struct lum_error *err);
void lum_photometry_around_finish(struct lum_photometry_around *a);
/* Once of two that are the same by symmetry. */
void lum_photometry_add_plane(struct lum_photometry_around *a, double c, uint32_t from);
/* Puts the table into the photometry: plane k of it at c_deg[k] is from[k] of the table, all angles as gammas. */
LUM_MUST_USE enum lum_status lum_photometry_take(struct lum_photometry *p, const struct lum_photometry_table *t,
                                                 const double *c_deg, const uint32_t *from, uint32_t n_c,
                                                 struct lum_error *err);
LUM_MUST_USE enum lum_status lum_photometry_check_angles(const char *what, const double *deg, uint32_t n, double lo,
                                                         double hi, uint32_t line, struct lum_error *err);
void lum_photometry_note(struct lum_photometry *p, const char *fmt, ...) LUM_PRINTF(2, 3);
/* Adds words of the file to the name. */
void lum_photometry_add_name(struct lum_photometry *p, const char *s, size_t n);

enum lum_status lum_ies_read(struct lum_photometry_text *text, struct lum_photometry *p, struct lum_error *err);
enum lum_status lum_ldt_read(struct lum_photometry_text *text, struct lum_photometry *p, struct lum_error *err);

#endif
