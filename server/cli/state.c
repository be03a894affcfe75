/* lumend state: what --state kept, without a daemon. */
#define _GNU_SOURCE
#include "server/cli/commands.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "protocol/op/op.h"
#include "server/base/write_file.h"
#include "server/cli/help.h"
#include "server/cli/option.h"
#include "server/journal/journal.h"
#include "server/journal/recover.h"

static const char usage[] =
    "usage: lumend state check DIR\n"
    "       lumend state export DIR [options]\n"
    "       lumend state compact DIR\n"
    "What a daemon with --state DIR kept. Not while one is using DIR.\n"
    "\n"
    "check    reads all of it and says what is damaged, and what a start would make of that; changes nothing.\n"
    "         Exit status 0: whole, 1: not.\n"
    "export   writes the scene as a .jsonl file, which lumend --scene and lumend render --scene read.\n"
    "compact  writes the scene anew and removes what it does not need: older snapshots, edits, models.\n"
    "         What lies between two backups can then not be found again; undo is kept,\n"
    "         and so are moments of the timeline that have names.\n"
    "\n"
    "Options of export:\n";

struct options {
    const char *out;
    bool imports;
};

#define AT(m) .offset = offsetof(struct options, m)
static const struct lum_option_row rows[] = {
    {"out", "FILE", .kind = LUM_OPTION_TEXT, AT(out),
     .help = "where to write, all of it or nothing; default: standard output"},
    {"imports", .kind = LUM_OPTION_SWITCH, AT(imports),
     .help = "models stay import ops, which need the model files; default: all that they brought"},
};

/* ---- the folder ---- */

struct state {
    struct lum_dir dir, content;
    int lock_fd;
    struct lum_recovery recovery;
};

static void tell(void *user, const char *text)
{
    fprintf(user, "%s\n", text);
}

static enum lum_status open_state(const char *path, FILE *damage_to, struct state *s, struct lum_error *err)
{
    const struct lum_damage_sink damage = {.tell = tell, .user = damage_to};
    *s = (struct state){.dir.fd = -1, .content.fd = -1, .lock_fd = -1};
    enum lum_status st = lum_dir_open(AT_FDCWD, path, false, &lum_disk_real, &s->dir, err);
    if (!st)
        st = lum_dir_lock(&s->dir, path, &s->lock_fd, err);
    if (!st)
        st = lum_dir_open(s->dir.fd, "content", false, &lum_disk_real, &s->content, err);
    if (st == LUM_ERR_NOT_FOUND)
        return lum_fail(err, LUM_ERR_NOT_FOUND, "state", "%.200s holds no state of lumend", path);
    if (!st)
        st = lum_recover(&s->dir, &s->content, &damage, &s->recovery, err);
    if (!st && !s->recovery.doc)
        st = lum_fail(err, LUM_ERR_NOT_FOUND, "state", "%.200s holds no state of lumend", path);
    return st;
}

static void close_state(struct state *s)
{
    lum_recovery_finish(&s->recovery);
    lum_dir_close(&s->content);
    lum_dir_close(&s->dir);
    if (s->lock_fd >= 0)
        close(s->lock_fd);
}

/* ---- check ---- */

struct checking {
    const struct state *state;
    unsigned n_content, n_damaged;
};

static void check_content(void *user, const char *name)
{
    struct checking *c = user;
    struct lum_error err;
    if (!lum_sha_is(name))
        return;
    c->n_content++;
    if (!lum_content_check(&c->state->content, name, &err))
        return;
    c->n_damaged++;
    printf("%s\n", err.text);
}

static enum lum_status check(const struct state *s, const struct options *o, const char *path, struct lum_error *err)
{
    const struct lum_recovery *r = &s->recovery;
    struct checking c = {.state = s};
    (void)o;
    enum lum_status st = lum_dir_each(&s->content, check_content, &c, err);
    if (st)
        return st;
    if (r->n_cut)
        printf("%llu bytes at the end are of an edit that was never acknowledged: a start cuts them off\n",
               (unsigned long long)r->n_cut);
    printf("revision %llu, %zu records, %llu edits since the snapshot, %u files of content\n",
           (unsigned long long)lum_document_rev(r->doc), lum_document_count(r->doc, LUM_RECORD_TYPE_COUNT),
           (unsigned long long)r->n_done, c.n_content);
    if (r->n_damages + c.n_damaged == 0)
        return LUM_OK;
    return lum_fail(err, LUM_ERR_INVALID, "state", "%.100s is damaged: a start loses %llu edits, and keeps the rest",
                    path, (unsigned long long)r->n_lost);
}

/* ---- export ---- */

struct exporting {
    const struct lum_document *doc;
    FILE *out;
    struct lum_error *err;
    enum lum_status status;
};

static void write_op(struct exporting *e, const char *id, cJSON *op)
{
    size_t n = 0;
    char *text = op ? lum_json_print(op, &n) : NULL;
    if (!e->status && !text)
        e->status = lum_fail(e->err, LUM_ERR_NOMEM, "state", "no memory for the scene");
    if (!e->status && n > LUM_LIMIT_STORED_BYTES)
        e->status = lum_fail(e->err, LUM_ERR_LIMIT, "state",
                             "\"%.64s\" is too large for a line of a scene file: export with --imports", id);
    if (!e->status && fprintf(e->out, "%s\n", text) < 0)
        e->status = lum_fail(e->err, LUM_ERR_IO, "state", "the scene cannot be written");
    free(text);
}

static void export_record(void *user, const struct lum_record *r)
{
    struct exporting *e = user;
    if (e->status || r->type == LUM_RECORD_IMPORT || r->type == LUM_RECORD_RENDER)
        return;
    if (r->type == LUM_RECORD_PATCH && !lum_document_has_target(e->doc, r))
        return; /* nobody could add it again */
    struct lum_record *plain = NULL;
    bool image = r->type == LUM_RECORD_IMAGE && r->image.pixels && r->image.asset[0];
    bool web = r->type == LUM_RECORD_LIGHT && r->light.web && r->light.asset[0];
    if (image || web) { /* what the file said instead */
        if (!(plain = lum_record_clone(r))) {
            e->status = lum_fail(e->err, LUM_ERR_NOMEM, "state", "no memory for the scene");
            return;
        }
        (image ? plain->image.asset : plain->light.asset)[0] = '\0';
    }
    cJSON *op = lum_record_to_json(plain ? plain : r, false);
    write_op(e, r->id, op);
    cJSON_Delete(op);
    lum_record_unref(plain);
}

static void export_flat(struct exporting *e, const struct lum_document *doc)
{
    e->doc = doc;
    if (!lum_document_each(doc, export_record, e) && !e->status)
        e->status = lum_fail(e->err, LUM_ERR_NOMEM, "state", "no memory for the scene");
    struct lum_record *r = lum_record_clone(lum_document_find(doc, "render"));
    const struct lum_record *camera = r ? lum_document_find(doc, r->render.camera) : NULL;
    if (r && (!camera || camera->type != LUM_RECORD_CAMERA))
        r->render.camera[0] = '\0'; /* it is gone */
    cJSON *settings = r ? lum_record_to_json(r, false) : NULL;
    write_op(e, "render", settings); /* last: they name a camera */
    cJSON_Delete(settings);
    lum_record_unref(r);
}

static void export_ops(struct exporting *e, const struct lum_document *doc)
{
    cJSON *json = lum_document_to_json(doc, false), *ops = cJSON_GetObjectItem(json, "ops");
    if (!json)
        e->status = lum_fail(e->err, LUM_ERR_NOMEM, "state", "no memory for the scene");
    for (cJSON *op = ops ? ops->child : NULL; op; op = op->next)
        write_op(e, cJSON_GetStringValue(cJSON_GetObjectItem(op, "id")), op);
    cJSON_Delete(json);
}

static enum lum_status export_scene(const struct state *s, const struct options *o, const char *path,
                                    struct lum_error *err)
{
    struct lum_part_file file = {.out = stdout};
    (void)path;
    if (o->out && lum_part_open(o->out, &file, err))
        return LUM_ERR_IO;
    struct exporting e = {.out = file.out, .err = err};
    fprintf(e.out, "{\"lumend\":1,\"kind\":\"scene\"}\n");
    (o->imports ? export_ops : export_flat)(&e, s->recovery.doc);
    if (o->out) {
        struct lum_error closing;
        enum lum_status closed = lum_part_close(&file, !e.status, &closing);
        if (closed)
            *err = closing; /* says why */
        return closed ? closed : e.status;
    }
    if (!e.status && fflush(stdout) != 0)
        e.status = lum_fail(err, LUM_ERR_IO, "state", "the scene cannot be written");
    return e.status;
}

/* ---- compact ---- */

static void log_to_stderr(void *user, int level, const char *component, const char *text)
{
    (void)user;
    (void)component;
    if (level < 2)
        fprintf(stderr, "lumend state compact: %s\n", text);
}

static void wake_nobody(void *user)
{
    (void)user;
}

/* A start and an end: everything is in a new snapshot. After two of them nothing older is left. */
static enum lum_status begin_anew(const char *path, struct lum_error *err)
{
    const struct lum_journal_config config = {
        .dir = path, .log = {.write = log_to_stderr}, .saved = wake_nobody, .attention = wake_nobody};
    struct lum_journal *journal;
    struct lum_document *doc = NULL;
    struct lum_document_state state;
    struct lum_journal_status status;
    enum lum_status st = lum_journal_open(&config, &journal, &doc, err);
    if (st)
        return st;
    if (doc)
        lum_document_thin_past(doc);
    if (!doc || !lum_document_take_state(doc, &state))
        st = lum_fail(err, LUM_ERR_NOMEM, "state", "no memory for the scene");
    if (!st)
        st = lum_journal_start(journal, &state, err);
    lum_journal_status(journal, &status);
    if (!st && status.read_only)
        st = lum_fail(err, LUM_ERR_IO, "state", "%s", status.why);
    lum_journal_close(journal);
    lum_document_destroy(doc);
    return st;
}

static enum lum_status compact(const char *path, struct lum_error *err)
{
    struct state s;
    enum lum_status st = open_state(path, stderr, &s, err); /* is there something? */
    close_state(&s);
    for (int i = 0; i < 2 && !st; i++)
        st = begin_anew(path, err);
    if (st)
        return st;
    st = open_state(path, stderr, &s, err); /* what was removed is gone: is what stands in its place whole? */
    if (!st && s.recovery.n_damages)
        st = lum_fail(err, LUM_ERR_INVALID, "state",
                      "%.100s was written anew, and is damaged: keep a copy of it, and report", path);
    close_state(&s);
    return st;
}

/* ---- the command ---- */

static int fail(int status, const char *command, const struct lum_error *err)
{
    fprintf(stderr, "lumend state%s%s: %s\n", command[0] ? " " : "", command, err->text);
    return status;
}

static enum lum_status run(const char *command, const char *path, const struct options *o, struct lum_error *err)
{
    struct state s;
    if (strcmp(command, "compact") == 0)
        return compact(path, err);
    bool checks = strcmp(command, "check") == 0;
    enum lum_status st = open_state(path, checks ? stdout : stderr, &s, err);
    if (!st)
        st = (checks ? check : export_scene)(&s, o, path, err);
    close_state(&s);
    return st;
}

void lum_help_state(const struct lum_help *h)
{
    lum_help_text(h, usage);
    lum_help_options(h, rows, LUM_ARRAY_LEN(rows));
}

int lum_cmd_state(int argc, char **argv)
{
    struct options o = {0};
    struct lum_option_words words = {0};
    struct lum_error err = {0};
    if (argc == 2 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0)) {
        lum_help_state(&(struct lum_help){stdout, false});
        return LUM_EXIT_OK;
    }
    if (lum_option_parse(argc, argv, rows, LUM_ARRAY_LEN(rows), &words, NULL, &o, &err))
        return fail(LUM_EXIT_USAGE, "", &err);
    const char *command = words.n > 0 ? words.list[0] : "";
    bool known = strcmp(command, "check") == 0 || strcmp(command, "export") == 0 || strcmp(command, "compact") == 0;
    bool options_fit = strcmp(command, "export") == 0 || (!o.out && !o.imports);
    if (!known || words.n != 2 || !options_fit) {
        lum_fail(&err, LUM_ERR_INVALID, "",
                 known && words.n == 2 ? "--out and --imports are of export (see: lumend state --help)"
                                       : "needs check, export or compact, and a folder (see: lumend state --help)");
        return fail(LUM_EXIT_USAGE, known ? command : "", &err);
    }
    return run(command, words.list[1], &o, &err) ? fail(LUM_EXIT_FAILED, command, &err) : LUM_EXIT_OK;
}
