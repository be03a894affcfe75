#include "protocol/base/nearest.h"

#include <ctype.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "protocol/base/limits.h"

#define FAR UINT_MAX
#define CONTAINED 2u /* as far as two slips: one who remembers a part of a name is right more often */
#define PART_MIN 3u  /* letters that say something */

static unsigned least(unsigned a, unsigned b)
{
    return a < b ? a : b;
}

/* Letters to insert, leave out or replace to make b of a (Levenshtein), one row of the table at a time; FAR when they
 * are more than `most`, which is found out early: there may be a hundred thousand names. */
static unsigned edit_distance(const char *a, const char *b, unsigned most)
{
    size_t n = strlen(b), n_a = strlen(a);
    if (n_a > n + most || n > n_a + most)
        return FAR;
    unsigned row[LUM_LIMIT_ID_BYTES + 1];
    for (size_t j = 0; j <= n; j++)
        row[j] = (unsigned)j;
    for (size_t i = 0; a[i]; i++) {
        unsigned diagonal = row[0], best = (unsigned)i + 1;
        row[0] = best;
        for (size_t j = 0; j < n; j++) {
            unsigned replaced = diagonal + (tolower((unsigned char)a[i]) != tolower((unsigned char)b[j]));
            unsigned gap = (row[j] < row[j + 1] ? row[j] : row[j + 1]) + 1;
            diagonal = row[j + 1];
            row[j + 1] = replaced < gap ? replaced : gap;
            best = row[j + 1] < best ? row[j + 1] : best;
        }
        if (best > most)
            return FAR;
    }
    return row[n] <= most ? row[n] : FAR;
}

/* One slip in three letters, and one for short names. */
static unsigned slips(const char *given, const char *name)
{
    return edit_distance(given, name, least(1 + (unsigned)strlen(given) / 3, (unsigned)strlen(name) / 2));
}

static bool contains(const char *name, const char *part)
{
    size_t n = strlen(part);
    for (; n >= PART_MIN && strlen(name) >= n; name++)
        if (strncasecmp(name, part, n) == 0)
            return true;
    return false;
}

static const char *last_part(const char *name)
{
    const char *slash = strrchr(name, '/');
    return slash ? slash + 1 : name;
}

static unsigned distance(const char *given, const char *name)
{
    if (strlen(given) > LUM_LIMIT_ID_BYTES || strlen(name) > LUM_LIMIT_ID_BYTES)
        return FAR;
    unsigned d = least(slips(given, name), contains(name, given) ? CONTAINED : FAR);
    return least(d, slips(last_part(given), last_part(name)));
}

void lum_nearest_offer(struct lum_nearest *nearest, const char *name)
{
    unsigned d = distance(nearest->given, name), at = nearest->n;
    while (at > 0 && (d < nearest->distances[at - 1] ||
                      (d == nearest->distances[at - 1] && strcmp(name, nearest->names[at - 1]) < 0)))
        at--;
    if (d == FAR || at == LUM_NEAREST_MAX)
        return;
    nearest->n = least(nearest->n + 1, LUM_NEAREST_MAX);
    for (unsigned i = nearest->n - 1; i > at; i--) {
        nearest->names[i] = nearest->names[i - 1];
        nearest->distances[i] = nearest->distances[i - 1];
    }
    nearest->names[at] = name;
    nearest->distances[at] = d;
}

void lum_nearest_text(const struct lum_nearest *nearest, char *ret_text, size_t size)
{
    static const char lead[] = ": did you mean ", last[] = " or ";
    size_t room = sizeof lead + sizeof last, at = 0;
    unsigned n = 0;
    while (n < nearest->n && nearest->distances[n] <= nearest->distances[0] + 1 &&
           room + strlen(nearest->names[n]) + 4 <= size) /* quotes, comma and space */
        room += strlen(nearest->names[n++]) + 4;
    ret_text[0] = '\0';
    for (unsigned i = 0; i < n; i++)
        at += (size_t)snprintf(ret_text + at, size - at, "%s\"%s\"%s",
                               i == 0       ? lead
                               : i + 1 == n ? last
                                            : ", ",
                               nearest->names[i], i + 1 == n ? "?" : "");
}

void lum_nearest_among(const char *given, const char *const *names, size_t n, char *ret_text, size_t size)
{
    struct lum_nearest near = {.given = given};
    for (size_t i = 0; i < n; i++)
        lum_nearest_offer(&near, names[i]);
    lum_nearest_text(&near, ret_text, size);
    size_t at = 0;
    for (size_t i = 0; near.n == 0 && i < n && at < size; i++)
        at += (size_t)snprintf(ret_text + at, size - at, "%s%s", i == 0 ? ": there are " : ", ", names[i]);
    if (at >= size)
        ret_text[0] = '\0';
}
