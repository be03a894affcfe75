/* Content of a snapshot, read by several threads before it is asked for. Of what is damaged nothing is kept: whoever
 * asks reads it anew, and tells what is wrong in the order of the snapshot. */
#ifndef LUM_SERVER_JOURNAL_READ_AHEAD_H
#define LUM_SERVER_JOURNAL_READ_AHEAD_H

#include "server/journal/content.h"

struct lum_read_ahead;

/* Begins with them, in order; a name may come twice. NULL: memory is short, or no thread can be started. */
struct lum_read_ahead *lum_read_ahead_begin(const struct lum_dir *content, const lum_sha *shas, size_t n);
/* Waits for it, and gives it away. False: it is not among them, was given away, or is not whole. ahead may be NULL. */
bool lum_read_ahead_take(struct lum_read_ahead *ahead, const char *sha, struct lum_record_list *ret_records);
void lum_read_ahead_end(struct lum_read_ahead *ahead); /* accepts NULL; forgets the rest */

#endif
