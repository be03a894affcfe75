/* A client of the director without sockets: commands in, texts and frames out. Nothing sleeps: waiting ends when the
 * director wakes the "net thread", or with ctest's own time limit. */
#ifndef LUM_TESTS_SUPPORT_DIRECTOR_CLIENT_H
#define LUM_TESTS_SUPPORT_DIRECTOR_CLIENT_H

#include <pthread.h>
#include <semaphore.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "server/director/internal.h"

enum { W = 40, H = 30, MAX_STREAMS = 4, MAX_TEXTS = 4096 };

struct client {
    struct lum_director *director;
    struct lum_session_ref session;
    pthread_mutex_t lock;
    pthread_cond_t bell;
    bool rung; /* guarded by lock */
    struct lum_stream *streams[MAX_STREAMS];
    uint32_t n_streams;
    char *texts[MAX_TEXTS]; /* everything said, in order */
    size_t n_texts;
    uint64_t next_id;
    char path[64], importer[64]; /* files to remove */
    /* NULL, or called on the director's own thread each time it has said something, while it goes no further: what is
     * to happen just then. */
    void (*on_said)(struct client *c);
    sem_t held, released;
    void (*then)(struct client *c);
};

/* The director stops at an answer until client_release: what is posted between is taken from the inbox all together.
 * then: NULL, or called once as on_said, when something was said of that. */
void client_hold(struct client *c);
void client_release(struct client *c, void (*then)(struct client *c));

/* Takes what the director said. */
void client_listen(struct client *c);
/* Until the director rings the bell. */
void client_wait(struct client *c);
/* cmocka: *state is a struct client of a director with a small scene; importer: a program. */
int client_setup_with(void **state, const char *importer);
int client_setup(void **state);
/* The scene is kept in state_dir (what is there comes before the small scene), on this disk (NULL: the real one). */
int client_setup_saved(void **state, const char *state_dir, const struct lum_disk *disk);
int client_teardown(void **state);
struct lum_request *client_request(struct client *c, const struct lum_request_type *type);
/* The reply, whole; delete it. That of a request posted before: by its id, which is next_id after client_request. */
cJSON *client_ask(struct client *c, struct lum_request *request);
cJSON *client_reply(struct client *c, uint64_t id);
/* The reply to a request as its JSON text. One that is refused when it is read gives its error, as the session does. */
cJSON *client_ask_text(struct client *c, const char *method, const char *params);
struct lum_request *client_edit(struct client *c, const char *ops);
uint64_t scene_rev_of(cJSON *reply);
void assert_taken(cJSON *reply); /* checks that it is no error, and drops it */
/* Checks that the reply is this error, and drops it. */
void assert_refused(cJSON *reply, const char *app, const char *path);
uint32_t client_open_view(struct client *c, enum lum_codec codec);
/* The next whole frame of the first stream, acknowledged; its last header. pixels (may be NULL) gets RGBA8 tiles
 * of full size: a rough pass of paths comes downscaled; any has 0 samples. */
struct lum_frame_header client_next_frame(struct client *c, uint8_t *pixels);
struct lum_frame_header client_converged_frame(struct client *c, uint64_t scene_rev, uint8_t *pixels);
uint64_t client_apply(struct client *c, const char *ops);

#endif
