/* A hostile state folder: each line of the input becomes a block with right checksums, so that what is tested is not
 * only them. Lines before one that is "journal" go into the snapshot, those after it into the journal, those after one
 * that is "content" into a file of content, which the word SHA stands for. Each block has the same four blobs. Recovery
 * ends; what it gives is a whole document, which can be edited, undone, written down and read again. */
#define _GNU_SOURCE
#include "tests/fuzz/fuzz.h"

#include <fcntl.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"
#include "tests/support/journal_keeper.h"
#include "tests/unit/protocol_util.h"

static const char sha[] = "5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a";

static void put_line(struct lum_block_writer *w, const char *line, size_t n, uint64_t seq)
{
    static const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static const double wide[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static const uint32_t triangle[3] = {0, 1, 2};
    static const uint8_t pixels[16] = {0};
    const struct lum_blobs_out blobs = {.blobs = {{(const uint8_t *)corners, sizeof corners},
                                                  {(const uint8_t *)wide, sizeof wide},
                                                  {(const uint8_t *)triangle, sizeof triangle},
                                                  {pixels, sizeof pixels}},
                                        .n = 4};
    char *text = malloc(n + 1);
    memcpy(text, line, n);
    text[n] = '\0';
    for (char *at = strstr(text, "SHA"); at && (size_t)(at - text) + sizeof sha <= n; at = strstr(at, "SHA"))
        memcpy(at, sha, sizeof sha - 1); /* the line has room for it: "SHA" and 61 more */
    cJSON *json = lum_json_parse(text, n, NULL);
    struct lum_error err;
    if (json)
        FUZZ_REQUIRE(!lum_block_put(w, seq, seq, json, &blobs, &err));
    free(text);
}

static void begin(struct lum_block_writer *w, const struct lum_dir *dir, const char *name, enum lum_file_kind kind,
                  uint64_t seq)
{
    struct lum_error err;
    FUZZ_REQUIRE(!lum_block_create(w, dir, name, kind, seq, 0, &err));
}

static void end(struct lum_block_writer *w)
{
    struct lum_error err;
    FUZZ_REQUIRE(!lum_block_flush(w, &err));
    lum_block_close(w);
}

static void write_folder(const struct lum_dir *dir, const struct lum_dir *content, const char *data, size_t size)
{
    struct lum_block_writer w;
    uint64_t seq = 1;
    begin(&w, dir, "snapshot-0", LUM_FILE_SNAPSHOT, 0);
    for (size_t at = 0; at < size && seq < 200;) {
        const char *line = data + at, *stop = memchr(line, '\n', size - at);
        size_t n = stop ? (size_t)(stop - line) : size - at;
        bool journal = n == 7 && memcmp(line, "journal", 7) == 0;
        if (journal || (n == 7 && memcmp(line, "content", 7) == 0)) {
            end(&w);
            begin(&w, journal ? dir : content, journal ? "journal-0" : sha,
                  journal ? LUM_FILE_JOURNAL : LUM_FILE_CONTENT, journal ? 0 : 2);
            seq = 1;
        } else {
            put_line(&w, line, n, seq++);
        }
        at += n + 1;
    }
    end(&w);
}

static void ignore(void *user, const char *text)
{
    (void)user;
    (void)text;
}

static void ignore_id(void *user, const char *id, const char *why)
{
    (void)user;
    FUZZ_REQUIRE(id && why);
}

/* Everything that was accepted can be used. */
static void use(struct lum_document *doc)
{
    struct lum_document_state state;
    struct lum_changes c;
    FUZZ_REQUIRE(document_whole(doc));
    for (int i = 0; i < 8; i++) {
        if (lum_document_undo(doc, "ann", &c, NULL))
            lum_changes_finish(&c);
        if (i % 2 && lum_document_redo(doc, "ann", &c, NULL))
            lum_changes_finish(&c);
        apply_text(doc, "ann", "[{'op':'set','id':'a','path':'/transform/translate','value':[1,2,3]}]", NULL);
        FUZZ_REQUIRE(document_whole(doc));
    }
    apply_text(doc, "ann", "[{'op':'remove','id':'a'}]", NULL);
    char *text = document_text(doc);
    FUZZ_REQUIRE(lum_document_take_state(doc, &state));
    struct lum_document *again = lum_document_from_state(&state, ignore_id, NULL);
    FUZZ_REQUIRE(again);
    lum_document_state_finish(&state);
    char *same = document_text(again);
    FUZZ_REQUIRE(strcmp(text, same) == 0);
    lum_document_destroy(again);
    free(text);
    free(same);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct keeper k; /* a folder for all inputs of the process, opened once: making one waits for the disk */
    static struct lum_dir dir, content;
    struct lum_recovery r;
    struct lum_error err;
    const struct lum_damage_sink damage = {.tell = ignore, .user = NULL};
    if (!k.dir[0]) {
        keeper_init(&k);
        FUZZ_REQUIRE(!lum_dir_open(AT_FDCWD, k.dir, false, &lum_disk_real, &dir, &err));
        FUZZ_REQUIRE(!lum_dir_open(dir.fd, "content", true, &lum_disk_real, &content, &err));
    }
    lum_dir_remove(&dir, "journal-0");
    lum_dir_remove(&content, sha);
    write_folder(&dir, &content, (const char *)data, size);
    if (!lum_recover(&dir, &content, &damage, &r, &err)) {
        if (r.doc)
            use(r.doc);
        lum_recovery_finish(&r);
    }
    return 0;
}
