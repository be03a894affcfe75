#define _GNU_SOURCE
#include "server/journal/recover.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/journal/entry.h"

/* ---- names ---- */

void lum_state_name(char ret_name[LUM_JOURNAL_NAME_BYTES], const char *prefix, uint64_t number)
{
    snprintf(ret_name, LUM_JOURNAL_NAME_BYTES, "%s-%llu", prefix, (unsigned long long)number);
}

struct listing {
    const char *prefix;
    struct lum_numbers_found found;
    size_t capacity;
    bool failed;
};

static void list_one(void *user, const char *name)
{
    struct listing *l = user;
    char same[LUM_JOURNAL_NAME_BYTES];
    size_t n = strlen(l->prefix);
    if (strncmp(name, l->prefix, n) != 0 || name[n] != '-')
        return;
    uint64_t number = strtoull(name + n + 1, NULL, 10);
    lum_state_name(same, l->prefix, number);
    if (strcmp(same, name) != 0)
        return;
    if (l->found.n == l->capacity) {
        size_t capacity = l->capacity ? 2 * l->capacity : 8;
        uint64_t *grown = realloc(l->found.numbers, capacity * sizeof *grown);
        if (!grown) {
            l->failed = true;
            return;
        }
        l->found.numbers = grown;
        l->capacity = capacity;
    }
    l->found.numbers[l->found.n++] = number;
}

static int ascending(const void *a, const void *b)
{
    uint64_t p = *(const uint64_t *)a, q = *(const uint64_t *)b;
    return (p > q) - (p < q);
}

enum lum_status lum_state_list(const struct lum_dir *dir, const char *prefix, struct lum_numbers_found *ret,
                               struct lum_error *err)
{
    struct listing l = {.prefix = prefix};
    enum lum_status st = lum_dir_each(dir, list_one, &l, err);
    if (!st && l.failed)
        st = lum_fail(err, LUM_ERR_NOMEM, "state", "no memory for the names of files");
    if (st) {
        free(l.found.numbers);
        return st;
    }
    if (l.found.n)
        qsort(l.found.numbers, l.found.n, sizeof *l.found.numbers, ascending);
    *ret = l.found;
    return LUM_OK;
}

/* ---- recovering ---- */

struct recovering {
    const struct lum_dir *dir, *content;
    const struct lum_damage_sink *damage; /* of the caller */
    struct lum_damage_sink counted;       /* counts, and passes on */
    struct lum_error unread;              /* what seems damaged may be whole */
    struct lum_numbers_found snapshots, journals;
    struct lum_recovery out;
};

static void count_and_tell(void *user, const char *text)
{
    struct recovering *c = user;
    c->out.n_damages++;
    c->damage->tell(c->damage->user, text);
}

static void left_out(void *user, const char *id, const char *why)
{
    struct recovering *c = user;
    lum_damage(&c->counted, "\"%.64s\" is left out: %s", id, why);
}

/* Memory that is short is no harm: the file is not put aside, and the next snapshots remove it. */
static void note_damaged(struct recovering *c, const char *name)
{
    void *grown = realloc(c->out.damaged, (c->out.n_damaged + 1) * sizeof *c->out.damaged);
    if (!grown)
        return;
    c->out.damaged = grown;
    memcpy(c->out.damaged[c->out.n_damaged++], name, LUM_JOURNAL_NAME_BYTES);
}

void lum_recovery_put_aside(const struct lum_recovery *r, const struct lum_dir *dir)
{
    for (size_t i = 0; i < r->n_damaged; i++) {
        char aside[LUM_JOURNAL_NAME_BYTES + 16];
        struct lum_error err;
        snprintf(aside, sizeof aside, "%s.damaged", r->damaged[i]);
        (void)!lum_dir_rename(dir, r->damaged[i], aside, &err);
    }
}

/* A file that another version wrote, or that cannot be opened, is no damage, and nothing is done before that is known.
 */
static enum lum_status check_versions(const struct recovering *c, const struct lum_numbers_found *list,
                                      const char *prefix, enum lum_file_kind kind, struct lum_error *err)
{
    for (size_t i = 0; i < list->n; i++) {
        char name[LUM_JOURNAL_NAME_BYTES];
        struct lum_block_reader r;
        lum_state_name(name, prefix, list->numbers[i]);
        enum lum_status st = lum_block_open(&r, c->dir, name, kind, err);
        if (st == LUM_ERR_UNSUPPORTED || st == LUM_ERR_IO)
            return st;
        if (!st)
            lum_block_close_reader(&r);
    }
    return LUM_OK;
}

/* Takes the snapshot, if it is whole or need not be. */
static bool try_snapshot(struct recovering *c, uint64_t number, bool whole)
{
    struct lum_snapshot_read s;
    struct lum_error err;
    char name[LUM_JOURNAL_NAME_BYTES];
    lum_state_name(name, "snapshot", number);
    if (lum_snapshot_load(c->dir, c->content, name, &c->counted, &s, &err)) {
        lum_damage_unread(&c->counted, &err);
        lum_damage(&c->counted, "%s", err.text);
        return false;
    }
    if (s.whole || !whole) {
        c->out.doc = lum_document_from_state(&s.state, left_out, c);
        if (!c->out.doc)
            lum_damage_no_memory(&c->counted);
        else if (lum_document_n_moments(c->out.doc) == 0) /* of a version that kept none */
            lum_document_begin_past(c->out.doc);
    }
    if (c->out.doc) {
        c->out.seq = number;
        c->out.starts = s.starts;
        c->out.kept = s.kept;
        s.kept = (struct lum_kept_list){0};
        c->out.done = s.done;
        s.done = NULL;
    }
    lum_snapshot_read_finish(&s);
    return c->out.doc != NULL;
}

static enum lum_status find_snapshot(struct recovering *c, struct lum_error *err)
{
    char name[LUM_JOURNAL_NAME_BYTES];
    const struct lum_numbers_found *list = &c->snapshots;
    for (size_t i = list->n; i-- > 0;) {
        if (try_snapshot(c, list->numbers[i], true)) {
            for (size_t k = i + 1; k < list->n; k++) {
                lum_state_name(name, "snapshot", list->numbers[k]);
                lum_damage(&c->counted, "%s is not used: the one before it is whole, and so are the edits since", name);
                note_damaged(c, name);
            }
            return LUM_OK;
        }
    }
    for (size_t i = list->n; i-- > 0;) {
        lum_state_name(name, "snapshot", list->numbers[i]);
        if (try_snapshot(c, list->numbers[i], false)) {
            lum_damage(&c->counted, "no snapshot is whole: what can be read of %s is kept", name);
            note_damaged(c, name);
            return LUM_OK;
        }
    }
    return lum_fail(err, LUM_ERR_INVALID, "state",
                    "no snapshot of the state can be read; `lumend state check` says what is damaged. Put the folder "
                    "aside to begin anew");
}

static void done(struct recovering *c, const char *name, const struct lum_block *f)
{
    char why[256] = "";
    const struct lum_replay replay = {c->out.doc, c->content, &c->counted, &c->out.kept, &c->out.done};
    if (lum_entry_replay(&replay, f, why)) {
        c->out.n_done++;
        return;
    }
    c->out.n_lost++;
    lum_damage(&c->counted, "%s: edit %llu at offset %llu (revision %llu) cannot be done: %s", name,
               (unsigned long long)f->seq, (unsigned long long)f->offset, (unsigned long long)f->rev, why);
}

/* Where the damage began that no whole record has followed yet. */
struct wound {
    bool open;
    uint64_t offset;
};

/* Edits last + 1 to next - 1 are not there. */
static void tell_lost(struct recovering *c, const char *name, const struct wound *w, uint64_t next)
{
    uint64_t first = c->out.seq + 1, last = next > first ? next - 1 : first;
    char which[64];
    if (first == last)
        snprintf(which, sizeof which, "edit %llu", (unsigned long long)first);
    else
        snprintf(which, sizeof which, "edits %llu to %llu", (unsigned long long)first, (unsigned long long)last);
    c->out.n_lost += last - first + 1;
    c->out.seq = last;
    lum_damage(&c->counted, "%s: %s at offset %llu %s", name, which, (unsigned long long)w->offset,
               w->open ? "is damaged" : "is missing");
}

/* end: the number of the last edit that this file can hold; a later file has the ones after. */
static void read_journal(struct recovering *c, const char *name, struct lum_block_reader *r, uint64_t end)
{
    struct wound wound = {0};
    for (bool more = true; more;) {
        struct lum_block f;
        struct lum_error err = {0};
        enum lum_block_found found = lum_block_next(r, &f, &err);
        lum_damage_unread(&c->counted, &err);
        more = found == LUM_BLOCK_WHOLE || found == LUM_BLOCK_DAMAGED;
        if (found == LUM_BLOCK_DAMAGED && !wound.open)
            wound = (struct wound){true, f.offset};
        if (found == LUM_BLOCK_TORN)
            c->out.n_cut += f.n_bytes;
        if (found == LUM_BLOCK_WHOLE && f.seq > c->out.seq && f.seq <= end) {
            if (f.seq > c->out.seq + 1)
                tell_lost(c, name, &wound, f.seq);
            wound.open = false;
            c->out.seq = f.seq;
            done(c, name, &f);
        }
        lum_block_finish(&f);
    }
    if (wound.open && c->out.seq < end)
        tell_lost(c, name, &wound, 0);
}

static void read_journals(struct recovering *c)
{
    lum_document_replay(c->out.doc, true);
    for (size_t i = 0; i < c->journals.n; i++) {
        char name[LUM_JOURNAL_NAME_BYTES];
        struct lum_block_reader r;
        struct lum_error err;
        uint64_t number = c->journals.numbers[i], damages = c->out.n_damages;
        if (number < c->out.seq && (i + 1 == c->journals.n || c->journals.numbers[i + 1] <= c->out.seq))
            continue; /* the snapshot has all of it */
        lum_state_name(name, "journal", number);
        enum lum_status st = lum_block_open(&r, c->dir, name, LUM_FILE_JOURNAL, &err);
        uint64_t gap = st ? 0 : r.gap < r.seq ? r.gap : r.seq; /* numbers before it that are of no edit: of starts */
        if (number > c->out.seq && number - c->out.seq > gap)
            tell_lost(c, name, &(struct wound){0}, number - gap + 1);
        c->out.seq = number > c->out.seq ? number : c->out.seq;
        if (st) {
            lum_damage_unread(&c->counted, &err);
            lum_damage(&c->counted, "%s", err.text);
        } else {
            read_journal(c, name, &r, i + 1 < c->journals.n ? c->journals.numbers[i + 1] : UINT64_MAX);
            lum_block_close_reader(&r);
        }
        if (c->out.n_damages > damages)
            note_damaged(c, name);
    }
    lum_document_replay(c->out.doc, false);
}

void lum_recovery_finish(struct lum_recovery *r)
{
    lum_document_destroy(r->doc);
    lum_kept_finish(&r->kept);
    lum_done_destroy(r->done);
    free(r->damaged);
    *r = (struct lum_recovery){0};
}

enum lum_status lum_recover(const struct lum_dir *dir, const struct lum_dir *content,
                            const struct lum_damage_sink *damage, struct lum_recovery *ret, struct lum_error *err)
{
    struct recovering c = {.dir = dir, .content = content, .damage = damage};
    c.counted = (struct lum_damage_sink){count_and_tell, &c, &c.unread};
    enum lum_status st = lum_state_list(dir, "snapshot", &c.snapshots, err);
    if (!st)
        st = lum_state_list(dir, "journal", &c.journals, err);
    if (!st)
        st = check_versions(&c, &c.snapshots, "snapshot", LUM_FILE_SNAPSHOT, err);
    if (!st)
        st = check_versions(&c, &c.journals, "journal", LUM_FILE_JOURNAL, err);
    if (!st && c.snapshots.n + c.journals.n > 0)
        st = find_snapshot(&c, err);
    if (!st && c.out.doc)
        read_journals(&c);
    free(c.snapshots.numbers);
    free(c.journals.numbers);
    if (c.unread.status) {
        st = c.unread.status;
        *err = c.unread;
    }
    if (st)
        lum_recovery_finish(&c.out);
    else
        *ret = c.out;
    return st;
}
