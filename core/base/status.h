/* Status codes and error text of the core library.
 *
 * A fallible function returns enum lum_status (0 is success) and, on failure, describes the cause in the
 * caller's struct lum_error (may be NULL). Outputs named ret_* are untouched on failure. */
#ifndef LUM_CORE_BASE_STATUS_H
#define LUM_CORE_BASE_STATUS_H

#if defined(__GNUC__)
#define LUM_MUST_USE __attribute__((warn_unused_result))
#define LUM_PRINTF(fmt_index, first_arg) __attribute__((format(printf, fmt_index, first_arg)))
#else
#define LUM_MUST_USE
#define LUM_PRINTF(fmt_index, first_arg)
#endif

enum lum_status {
    LUM_OK = 0,
    LUM_ERR_NOMEM,       /* an allocation failed; nothing changed */
    LUM_ERR_INVALID,     /* a value is out of its range or not finite */
    LUM_ERR_NOT_FOUND,   /* an id names nothing */
    LUM_ERR_CONFLICT,    /* an id is taken, or still in use */
    LUM_ERR_LIMIT,       /* a size is over its limit */
    LUM_ERR_IO,          /* a file could not be read or written */
    LUM_ERR_UNSUPPORTED, /* well-formed, but not something this build does */
    LUM_ERR_CANCELLED,   /* the caller's cancel flag was seen */
    LUM_ERR_INTERNAL,    /* a bug or a failing library (Embree, OpenEXR) */
};

struct lum_error {
    enum lum_status status;
    char field[64]; /* the field at fault ("radius"), or "" */
    char text[256]; /* one sentence for a person: what and the limit */
};

/* Fills *err (may be NULL) and returns status, so that `return lum_fail(...)` reads well. Thread: any. */
enum lum_status lum_fail(struct lum_error *err, enum lum_status status, const char *field, const char *fmt, ...)
    LUM_PRINTF(4, 5);

/* "out of memory", "invalid value", ... Never NULL. */
const char *lum_status_text(enum lum_status status);

#endif
