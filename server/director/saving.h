/* The director and the journal (saving.c). Nothing of it does anything where no state is kept. Thread: the director's,
 * but for one. */
#ifndef LUM_SERVER_DIRECTOR_SAVING_H
#define LUM_SERVER_DIRECTOR_SAVING_H

#include "server/director/internal.h"

/* Opens the journal. *ret_loaded: the world has the state that was kept. */
LUM_MUST_USE enum lum_status lum_director_open_state(struct lum_director *d, bool *ret_loaded, struct lum_error *err);
/* The world is as it is to be at the start: writes it down, and starts the journal's thread. */
LUM_MUST_USE enum lum_status lum_director_start_saving(struct lum_director *d, struct lum_error *err);
/* Edits that follow are made now, as the entry (NULL: none) then says. */
void lum_director_set_time(struct lum_director *d, struct lum_entry *entry);
/* May edits be made? Else err is the refusal. */
bool lum_director_may_edit(struct lum_director *d, struct lum_proto_error *err);
/* What the journal is to keep of the request. False: memory is short. */
bool lum_director_make_entry(struct lum_director *d, struct lum_request *q, struct lum_entry **inout_entry);
/* Import thread: keeps what the importer made of the request's ops. */
bool lum_director_store_imports(struct lum_director *d, struct lum_import_job *job, struct lum_proto_error *err);
/* Hands the edit's entry to the journal: what is said from now on waits for it. */
void lum_director_submit(struct lum_director *d, struct lum_staged_edit *p);
/* The edit was announced: keeps what it takes to take it back until it is durable, or frees it. */
void lum_director_keep_unsaved(struct lum_director *d, struct lum_staged_edit *p);
/* Notes that are no edits: the user left; her undo (or redo) of the step `of` found a conflict, which forgot it. */
void lum_director_note(struct lum_director *d, enum lum_entry_kind kind, const char *user, const char *op_id,
                       uint64_t of);
/* A moment has another name. Returns the number of the journal's entry; 0: nothing is kept. The one that it had comes
 * back if that entry is lost. */
uint64_t lum_director_note_name(struct lum_director *d, const struct lum_request *q, const struct lum_moment_name *was);
void lum_director_tell_name(struct lum_director *d, uint64_t rev, const char *name, const char *user);
/* Once a turn, with no edit staged: frees what is durable, takes back what is lost, gives the journal its snapshots. */
void lum_director_turn_saving(struct lum_director *d);
/* Histories are not what the journal's entries tell: a snapshot shall. */
void lum_director_save_histories(struct lum_director *d);

#endif
