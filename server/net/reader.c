#define _GNU_SOURCE /* pthread_setname_np */
#include "server/net/reader.h"

#include <pthread.h>
#include <stdlib.h>
#include <sys/resource.h>

#include "core/base/base.h"
#include "protocol/base/network_limits.h"
#include "server/director/read_request.h"

/* Small messages and pictures come first: of two threads of one processor this one gets a quarter. */
#define NICENESS 5

struct lum_reader {
    void (*ready)(void *user);
    void *user;
    pthread_t thread;
    bool has_thread;
    pthread_mutex_t lock;
    pthread_cond_t bell; /* something came, was taken, or it is over */
    /* guarded by lock */
    struct {
        struct lum_reading *first, **end;
    } lines[LUM_LIMIT_CONNECTIONS]; /* that wait, by the slots of their sessions */
    uint32_t n_waiting, turn;       /* in all of them; whose was taken last */
    size_t n_bytes;                 /* of text that waits */
    struct lum_reading *done;       /* NULL: none waits to be taken */
    bool stop;
};

void lum_reading_finish(struct lum_reading *m)
{
    lum_request_destroy(m->request);
    lum_rpc_finish(&m->rpc);
    free(m->text);
    *m = (struct lum_reading){0};
}

void lum_reading_destroy(struct lum_reading *m)
{
    if (!m)
        return;
    lum_reading_finish(m);
    lum_free(m);
}

static void read_one(struct lum_reading *m)
{
    m->parsed = lum_rpc_parse(m->text ? m->text : "", m->n_bytes, &m->rpc, &m->err);
    free(m->text);
    m->text = NULL;
    if (!m->parsed)
        return;
    m->request = lum_request_read(&m->rpc, m->role, &m->err);
    m->asked = true;
}

/* The first of this line, which has one. */
static struct lum_reading *pop(struct lum_reader *r, uint32_t slot)
{
    struct lum_reading *m = r->lines[slot].first;
    r->lines[slot].first = m->next;
    if (!m->next)
        r->lines[slot].end = &r->lines[slot].first;
    m->next = NULL;
    r->n_waiting--;
    r->n_bytes -= m->n_bytes;
    return m;
}

static struct lum_reading *wait_for_one(struct lum_reader *r)
{
    struct lum_reading *m = NULL;
    pthread_mutex_lock(&r->lock);
    while (!r->stop && (!r->n_waiting || r->done))
        pthread_cond_wait(&r->bell, &r->lock);
    if (!r->stop) {
        do
            r->turn = (r->turn + 1) % LUM_LIMIT_CONNECTIONS;
        while (!r->lines[r->turn].first);
        m = pop(r, r->turn);
    }
    pthread_mutex_unlock(&r->lock);
    return m;
}

static void *reader_main(void *user)
{
    struct lum_reader *r = user;
    setpriority(PRIO_PROCESS, 0, NICENESS); /* of this thread; as it is, if it may not */
    for (struct lum_reading *m; (m = wait_for_one(r));) {
        read_one(m);
        pthread_mutex_lock(&r->lock);
        r->done = m;
        pthread_mutex_unlock(&r->lock);
        r->ready(r->user);
    }
    return NULL;
}

enum lum_status lum_reader_create(void (*ready)(void *user), void *user, struct lum_reader **ret_reader,
                                  struct lum_error *err)
{
    struct lum_reader *r = lum_calloc(1, sizeof *r);
    if (!r)
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory to read messages");
    r->ready = ready;
    r->user = user;
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++)
        r->lines[i].end = &r->lines[i].first;
    pthread_mutex_init(&r->lock, NULL); /* of default attributes: cannot fail */
    pthread_cond_init(&r->bell, NULL);
    if (pthread_create(&r->thread, NULL, reader_main, r)) {
        lum_reader_destroy(r);
        return lum_fail(err, LUM_ERR_NOMEM, "", "the thread that reads messages cannot be started");
    }
    pthread_setname_np(r->thread, "lum-reader");
    r->has_thread = true;
    *ret_reader = r;
    return LUM_OK;
}

void lum_reader_destroy(struct lum_reader *r)
{
    if (!r)
        return;
    pthread_mutex_lock(&r->lock);
    r->stop = true;
    pthread_cond_signal(&r->bell);
    pthread_mutex_unlock(&r->lock);
    if (r->has_thread)
        pthread_join(r->thread, NULL);
    lum_reading_destroy(r->done);
    for (uint32_t i = 0; i < LUM_LIMIT_CONNECTIONS; i++)
        while (r->lines[i].first)
            lum_reading_destroy(pop(r, i));
    pthread_cond_destroy(&r->bell);
    pthread_mutex_destroy(&r->lock);
    lum_free(r);
}

bool lum_reader_take(struct lum_reader *r, struct lum_reading *m)
{
    uint32_t slot = m->from.slot;
    pthread_mutex_lock(&r->lock);
    bool fits = m->n_bytes < LUM_READER_SMALL_BYTES || r->n_bytes + m->n_bytes <= LUM_READER_MAX_BYTES;
    if (fits) {
        m->next = NULL;
        *r->lines[slot].end = m;
        r->lines[slot].end = &m->next;
        r->n_waiting++;
        r->n_bytes += m->n_bytes;
        pthread_cond_signal(&r->bell);
    }
    pthread_mutex_unlock(&r->lock);
    return fits;
}

void lum_reader_forget(struct lum_reader *r, struct lum_session_ref session)
{
    pthread_mutex_lock(&r->lock);
    while (r->lines[session.slot].first)
        lum_reading_destroy(pop(r, session.slot));
    pthread_mutex_unlock(&r->lock);
}

size_t lum_reader_waiting_bytes(struct lum_reader *r)
{
    pthread_mutex_lock(&r->lock);
    size_t n = r->n_bytes;
    pthread_mutex_unlock(&r->lock);
    return n;
}

struct lum_reading *lum_reader_next(struct lum_reader *r)
{
    pthread_mutex_lock(&r->lock);
    struct lum_reading *m = r->done;
    r->done = NULL;
    pthread_cond_signal(&r->bell);
    pthread_mutex_unlock(&r->lock);
    return m;
}
