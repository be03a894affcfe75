/* Edits that are sent again, of which done.h knows. Thread: the director's. */
#ifndef LUM_SERVER_DIRECTOR_REPEATS_H
#define LUM_SERVER_DIRECTOR_REPEATS_H

#include "server/director/internal.h"

/* Before an edit with an op_id is made: so that it can be remembered then. False: memory is short. */
bool lum_repeats_reserve(struct lum_director *d, const struct lum_request *q);
/* It is in the scene as this revision, and the journal has it as entry seq (0: none). Does nothing without an op_id. */
void lum_repeats_note(struct lum_director *d, const struct lum_request *q, uint64_t scene_rev, uint64_t seq);
/* An undo or a redo found a conflict, and forgot its step, or there was none: sent again, it would take another one. */
void lum_repeats_note_refused(struct lum_director *d, const struct lum_request *q);
/* Answers as it was answered then. False: it is not known. */
bool lum_repeats_answer(struct lum_director *d, const struct lum_request *q);
/* The user will not come back, nor ask for imports that are under way. True: some edit was remembered. */
bool lum_repeats_forget(struct lum_director *d, const char *user);

#endif
