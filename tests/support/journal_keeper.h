/* A document whose edits are kept in a folder of /tmp, as the director keeps them, without renderer and network.
 * Nothing sleeps: waiting ends when the journal's thread calls back. */
#ifndef LUM_TESTS_SUPPORT_JOURNAL_KEEPER_H
#define LUM_TESTS_SUPPORT_JOURNAL_KEEPER_H

#include <pthread.h>

#include "server/journal/journal.h"
#include "server/journal/recover.h"

#define KEEPER_UNSAVED 512

struct keeper {
    char dir[40];
    struct lum_journal_config config;
    struct lum_journal *journal;
    struct lum_document *doc;
    pthread_mutex_t lock;
    pthread_cond_t bell;
    bool rung; /* guarded by lock */
    struct {
        uint64_t seq;
        struct lum_changes changes;
    } unsaved[KEEPER_UNSAVED]; /* not durable yet, oldest first */
    size_t n_unsaved;
    uint64_t n_acknowledged, n_taken_back;
    char log[65536]; /* all that the journal said, a line each; guarded by lock while one is open */
};
bool keeper_said(struct keeper *k, const char *what);
void keeper_forget_log(struct keeper *k);

void keeper_init(struct keeper *k);   /* a new folder; nothing is open */
void keeper_finish(struct keeper *k); /* closes, and removes the folder */
/* Recovers, or begins with `ops` (JSON with single quotes). False: refused, and err says why. */
bool keeper_open(struct keeper *k, const char *ops, struct lum_error *err);
void keeper_stop(struct keeper *k); /* the journal alone: nobody writes into the folder any more */
void keeper_close(struct keeper *k);
/* An edit by user, submitted. False: refused by the document or the journal. */
bool keeper_edit(struct keeper *k, const char *user, const char *ops);
bool keeper_walk(struct keeper *k, const char *user, bool redo);
bool keeper_revert(struct keeper *k, const char *user, uint64_t rev);
bool keeper_name(struct keeper *k, const char *user, uint64_t rev, const char *name);
/* What the director does in a turn: takes back what is lost, gives the state if it is wanted. */
void keeper_turn(struct keeper *k);
/* Until all edits are acknowledged or taken back. False: some were taken back. */
bool keeper_settle(struct keeper *k);
/* Until edits are accepted again. */
void keeper_wait_writable(struct keeper *k);
/* Until this many snapshots have been written. */
void keeper_wait_snapshots(struct keeper *k, uint64_t n);

/* What recovery finds in the folder, without changing it. Lines that it tells go to k->log. */
enum lum_status keeper_recover(struct keeper *k, struct lum_recovery *ret, struct lum_error *err);
/* The only file of this name's beginning, with the highest number; the caller frees it. */
uint8_t *keeper_read(struct keeper *k, const char *prefix, char ret_path[96], size_t *ret_n);
void keeper_write(const char *path, const uint8_t *bytes, size_t n);
unsigned keeper_count(struct keeper *k, const char *folder, const char *prefix); /* files */

#endif
