#define _GNU_SOURCE
#include "tests/support/crew.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What a member does when it meets the others: they do the same, of as many bytes. */
struct step {
    const char *name;
    uint64_t bytes;
};

struct crew {
    pthread_barrier_t barrier;
    _Atomic uint64_t next;
    const void *said[CREW_MAX]; /* by rank */
    struct step step[CREW_MAX];
    void (*fn)(struct lum_team *team, void *user);
    void *user;
};

struct member {
    struct lum_team team;
    struct crew *crew;
    pthread_t thread;
};

static struct crew *crew_of(struct lum_team *team)
{
    return ((struct member *)(void *)team)->crew;
}

static void meet(struct lum_team *team)
{
    pthread_barrier_wait(&crew_of(team)->barrier);
}

static void meet_to(struct lum_team *team, const char *name, uint64_t bytes)
{
    struct crew *crew = crew_of(team);
    const struct step *first = &crew->step[0];
    crew->step[team->rank] = (struct step){name, bytes};
    meet(team);
    for (uint32_t r = 1; r < team->size; r++) { /* of all, so that nobody copies before another aborts */
        const struct step *step = &crew->step[r];
        if (strcmp(step->name, first->name) == 0 && step->bytes == first->bytes)
            continue;
        fprintf(stderr, "rank %u is at: %s, %llu bytes; rank 0 at: %s, %llu bytes\n", r, step->name,
                (unsigned long long)step->bytes, first->name, (unsigned long long)first->bytes);
        abort();
    }
}

static void begin(struct lum_team *team)
{
    meet_to(team, "a loop", 0); /* nobody takes any more */
    if (team->rank == 0)
        atomic_store(&crew_of(team)->next, 0);
    meet(team);
}

static uint64_t take(struct lum_team *team, uint32_t n)
{
    return atomic_fetch_add(&crew_of(team)->next, n);
}

static void gather_parts(struct lum_team *team, const void *mine, size_t part_bytes, const uint32_t *n_parts,
                         void *ret_all)
{
    struct crew *crew = crew_of(team);
    unsigned char *at = ret_all;
    uint64_t bytes = 0;
    for (uint32_t r = 0; r < team->size; r++)
        bytes += (uint64_t)n_parts[r] * part_bytes;
    crew->said[team->rank] = mine;
    meet_to(team, "gather", bytes);
    for (uint32_t r = 0; r < team->size; r++) {
        memcpy(at, crew->said[r], n_parts[r] * part_bytes);
        at += n_parts[r] * part_bytes;
    }
    meet(team);
}

static void gather(struct lum_team *team, const void *mine, size_t bytes, void *ret_all)
{
    static const uint32_t one[CREW_MAX] = {1, 1, 1, 1, 1, 1, 1, 1};
    gather_parts(team, mine, bytes, one, ret_all);
}

static void broadcast(struct lum_team *team, void *inout, size_t bytes)
{
    struct crew *crew = crew_of(team);
    crew->said[team->rank] = inout;
    meet_to(team, "broadcast", bytes);
    if (team->rank > 0)
        memcpy(inout, crew->said[0], bytes);
    meet(team);
}

static void sum(struct lum_team *team, uint32_t *inout_numbers, size_t n)
{
    struct crew *crew = crew_of(team);
    uint32_t *sums = calloc(n, sizeof *sums);
    if (!sums)
        abort();
    crew->said[team->rank] = inout_numbers;
    meet_to(team, "sum", n * sizeof *sums);
    for (uint32_t r = 0; r < team->size; r++)
        for (size_t i = 0; i < n; i++)
            sums[i] += ((const uint32_t *)crew->said[r])[i];
    meet(team);
    memcpy(inout_numbers, sums, n * sizeof *sums);
    free(sums);
}

static void give_up(struct lum_team *team, const char *why)
{
    fprintf(stderr, "rank %u: %s\n", team->rank, why);
    _Exit(CREW_GAVE_UP);
}

static const struct lum_team_kind kind = {begin, take, gather, gather_parts, broadcast, sum, give_up};

static void *work(void *arg)
{
    struct member *m = arg;
    m->crew->fn(&m->team, m->crew->user);
    meet_to(&m->team, "its end", 0);
    lum_team_finish(&m->team);
    return NULL;
}

void crew_run(uint32_t n, void (*fn)(struct lum_team *team, void *user), void *user)
{
    struct crew crew = {.fn = fn, .user = user};
    struct member members[CREW_MAX] = {0};
    if (n < 1 || n > CREW_MAX || pthread_barrier_init(&crew.barrier, NULL, n) != 0)
        abort();
    for (uint32_t r = 0; r < n; r++)
        members[r] = (struct member){.team = {.kind = &kind, .rank = r, .size = n}, .crew = &crew};
    for (uint32_t r = 1; r < n; r++)
        if (pthread_create(&members[r].thread, NULL, work, &members[r]) != 0)
            abort();
    work(&members[0]);
    for (uint32_t r = 1; r < n; r++)
        pthread_join(members[r].thread, NULL);
    pthread_barrier_destroy(&crew.barrier);
}
