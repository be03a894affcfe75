/* What was meant by a name that does not exist: the nearest of those that do. One way for fields, ids and options. */
#ifndef LUM_PROTOCOL_BASE_NEAREST_H
#define LUM_PROTOCOL_BASE_NEAREST_H

#include <stddef.h>

#define LUM_NEAREST_MAX 3u /* names that a message offers: more are a list that nobody reads */

struct lum_nearest {
    const char *given;                   /* borrowed, as all names are */
    const char *names[LUM_NEAREST_MAX];  /* nearest first, then by name: the order of offers does not matter */
    unsigned distances[LUM_NEAREST_MAX]; /* slips of the fingers */
    unsigned n;
};

/* Zero all but `given`, then offer every name that there is. Near is what a few slips make of the name or of its last
 * part, after the slash ("current_vf" for "room/current_vf"), and what contains it. Letter case is no difference. Names
 * longer than an id are near to nothing. */
void lum_nearest_offer(struct lum_nearest *nearest, const char *name);

/* ": did you mean \"a\", \"b\" or \"c\"?" with as many of the names as fit and are about as near as the first; empty
 * when none is near. */
void lum_nearest_text(const struct lum_nearest *nearest, char *ret_text, size_t size);

/* The same among n names: or else, when none is near, ": there are a, b, c", all of them, if that fits. */
void lum_nearest_among(const char *given, const char *const *names, size_t n, char *ret_text, size_t size);

#endif
