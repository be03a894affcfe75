#define _GNU_SOURCE /* pthread_setname_np, sched_getaffinity */
#include "server/journal/read_ahead.h"

#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/base.h"

#define MOST_THREADS 8u /* more do not read faster: they wait for the disk, and for pages */

enum job_state { WAITS, READS, WHOLE, OF_NO_USE };
struct job {
    lum_sha sha;
    enum job_state state;
    struct lum_record_list records;
};
struct lum_read_ahead {
    const struct lum_dir *content;
    pthread_t threads[MOST_THREADS];
    uint32_t n_threads;
    pthread_mutex_t lock;
    pthread_cond_t bell; /* one is read */
    /* guarded by lock */
    struct job *jobs;
    size_t n, next;
    bool stop;
};

static void note_damage(void *user, const char *text)
{
    (void)text;
    *(bool *)user = true;
}

static bool read_whole(const struct lum_dir *content, const char *sha, struct lum_record_list *ret_records)
{
    bool damaged = false;
    struct lum_error unread = {0}, err;
    const struct lum_damage_sink damage = {note_damage, &damaged, &unread};
    if (lum_content_read(content, sha, &damage, ret_records, &err))
        return false;
    if (!damaged && !unread.status)
        return true;
    lum_record_list_finish(ret_records);
    return false;
}

static void *ahead_main(void *user)
{
    struct lum_read_ahead *a = user;
    pthread_mutex_lock(&a->lock);
    while (!a->stop && a->next < a->n) {
        struct job *job = &a->jobs[a->next++];
        struct lum_record_list records = {0};
        job->state = READS;
        pthread_mutex_unlock(&a->lock);
        bool whole = read_whole(a->content, job->sha, &records);
        pthread_mutex_lock(&a->lock);
        job->records = records;
        job->state = whole ? WHOLE : OF_NO_USE;
        pthread_cond_broadcast(&a->bell);
    }
    pthread_mutex_unlock(&a->lock);
    return NULL;
}

static uint32_t threads_for(size_t n)
{
    cpu_set_t set;
    int cpus = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
    uint32_t most = cpus < (int)MOST_THREADS ? (uint32_t)cpus : MOST_THREADS;
    return n < most ? (uint32_t)n : most;
}

struct lum_read_ahead *lum_read_ahead_begin(const struct lum_dir *content, const lum_sha *shas, size_t n)
{
    struct lum_read_ahead *a = lum_calloc(1, sizeof *a);
    struct job *jobs = lum_calloc(n, sizeof *jobs);
    if (!a || !jobs) {
        lum_free(a);
        lum_free(jobs);
        return NULL;
    }
    for (size_t i = 0; i < n; i++)
        memcpy(jobs[i].sha, shas[i], sizeof jobs[i].sha);
    a->content = content;
    a->jobs = jobs;
    a->n = n;
    pthread_mutex_init(&a->lock, NULL); /* of default attributes: cannot fail */
    pthread_cond_init(&a->bell, NULL);
    for (uint32_t want = threads_for(n); a->n_threads < want; a->n_threads++) {
        if (pthread_create(&a->threads[a->n_threads], NULL, ahead_main, a))
            break;
        pthread_setname_np(a->threads[a->n_threads], "lum-ahead");
    }
    if (a->n_threads)
        return a;
    lum_read_ahead_end(a);
    return NULL;
}

bool lum_read_ahead_take(struct lum_read_ahead *a, const char *sha, struct lum_record_list *ret_records)
{
    struct job *job = NULL;
    if (!a)
        return false;
    pthread_mutex_lock(&a->lock);
    for (size_t i = 0; i < a->n && !job; i++)
        if (a->jobs[i].state != OF_NO_USE && strcmp(a->jobs[i].sha, sha) == 0)
            job = &a->jobs[i];
    while (job && (job->state == WAITS || job->state == READS))
        pthread_cond_wait(&a->bell, &a->lock);
    bool whole = job && job->state == WHOLE;
    if (whole) {
        *ret_records = job->records;
        job->records = (struct lum_record_list){0};
        job->state = OF_NO_USE;
    }
    pthread_mutex_unlock(&a->lock);
    return whole;
}

void lum_read_ahead_end(struct lum_read_ahead *a)
{
    if (!a)
        return;
    pthread_mutex_lock(&a->lock);
    a->stop = true;
    pthread_mutex_unlock(&a->lock);
    for (uint32_t i = 0; i < a->n_threads; i++)
        pthread_join(a->threads[i], NULL);
    for (size_t i = 0; i < a->n; i++)
        lum_record_list_finish(&a->jobs[i].records);
    lum_free(a->jobs);
    pthread_cond_destroy(&a->bell);
    pthread_mutex_destroy(&a->lock);
    lum_free(a);
}
