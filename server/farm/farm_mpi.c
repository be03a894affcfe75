/* A team over MPI. Of its errors none returns: the job ends, and says why.
 *
 * Jobs are handed out by a counter in the memory of rank 0, which all add to (MPI_Fetch_and_op): no rank waits for
 * another to answer. There are two, used in turn, so that rank 0 can reset one while the other is in use: nobody begins
 * the next loop but one before all, rank 0 among them, have met at the end of the next.
 *
 * MPI_THREAD_SERIALIZED: workers take jobs one at a time, under a lock; all else is called while none of them runs. */
#define _GNU_SOURCE
#include "server/farm/farm.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <mpi.h>

struct farm {
    struct lum_team team; /* first */
    pthread_mutex_t lock;
    MPI_Win window; /* of the counters */
    int64_t *counters;
    uint64_t n_loops;
    int n_parts[LUM_TEAM_MAX], first_part[LUM_TEAM_MAX];
};

static struct farm *farm_of(struct lum_team *team)
{
    return (struct farm *)(void *)team;
}

static void begin(struct lum_team *team)
{
    struct farm *f = farm_of(team);
    const int64_t zero = 0;
    f->n_loops++;
    if (team->rank > 0)
        return;
    MPI_Accumulate(&zero, 1, MPI_INT64_T, 0, (MPI_Aint)((f->n_loops + 1) % 2), 1, MPI_INT64_T, MPI_REPLACE, f->window);
    MPI_Win_flush(0, f->window);
}

static uint64_t take(struct lum_team *team, uint32_t n)
{
    struct farm *f = farm_of(team);
    int64_t more = n, first = 0;
    pthread_mutex_lock(&f->lock);
    MPI_Fetch_and_op(&more, &first, MPI_INT64_T, 0, (MPI_Aint)(f->n_loops % 2), MPI_SUM, f->window);
    MPI_Win_flush(0, f->window);
    pthread_mutex_unlock(&f->lock);
    return (uint64_t)first;
}

static void gather(struct lum_team *team, const void *mine, size_t bytes, void *ret_all)
{
    (void)team;
    MPI_Allgather(mine, (int)bytes, MPI_BYTE, ret_all, (int)bytes, MPI_BYTE, MPI_COMM_WORLD);
}

/* A part is one item of a type, so that there may be 2^31 of them. */
static void gather_parts(struct lum_team *team, const void *mine, size_t part_bytes, const uint32_t *n_parts,
                         void *ret_all)
{
    struct farm *f = farm_of(team);
    MPI_Datatype part;
    int first = 0;
    for (uint32_t r = 0; r < team->size; r++) {
        f->n_parts[r] = (int)n_parts[r];
        f->first_part[r] = first;
        first += f->n_parts[r];
    }
    MPI_Type_contiguous((int)part_bytes, MPI_BYTE, &part);
    MPI_Type_commit(&part);
    MPI_Allgatherv(mine, f->n_parts[team->rank], part, ret_all, f->n_parts, f->first_part, part, MPI_COMM_WORLD);
    MPI_Type_free(&part);
}

#define BYTES_AT_ONCE ((size_t)1 << 30) /* counts are of int */
#define SUM_AT_ONCE ((size_t)1 << 24)

static void broadcast(struct lum_team *team, void *inout, size_t bytes)
{
    (void)team;
    for (size_t at = 0; at < bytes; at += BYTES_AT_ONCE)
        MPI_Bcast((unsigned char *)inout + at, (int)(bytes - at < BYTES_AT_ONCE ? bytes - at : BYTES_AT_ONCE), MPI_BYTE,
                  0, MPI_COMM_WORLD);
}

static void sum(struct lum_team *team, uint32_t *inout_numbers, size_t n)
{
    (void)team;
    for (size_t at = 0; at < n; at += SUM_AT_ONCE)
        MPI_Allreduce(MPI_IN_PLACE, inout_numbers + at, (int)(n - at < SUM_AT_ONCE ? n - at : SUM_AT_ONCE),
                      MPI_UINT32_T, MPI_SUM, MPI_COMM_WORLD);
}

#define PASS_ON_NS 100000000l /* mpirun (MPICH) drops what it has not passed on when a job is aborted */

static void give_up(struct lum_team *team, const char *why)
{
    fprintf(stderr, "lumend: rank %u of %u ends all: %s\n", team->rank, team->size, why);
    fflush(NULL);
    nanosleep(&(struct timespec){.tv_nsec = PASS_ON_NS}, NULL);
    MPI_Abort(MPI_COMM_WORLD, EXIT_FAILURE);
    abort();
}

static const struct lum_team_kind over_mpi = {begin, take, gather, gather_parts, broadcast, sum, give_up};

/* As Open MPI, MPICH and those that follow them, and Slurm tell those whom they start. */
static bool is_started_by_mpirun(void)
{
    return getenv("OMPI_COMM_WORLD_RANK") || getenv("PMIX_RANK") || getenv("PMI_RANK");
}

static enum lum_status start(struct farm *f, struct lum_error *err)
{
    int provided = MPI_THREAD_SINGLE, rank, size;
    MPI_Init_thread(NULL, NULL, MPI_THREAD_SERIALIZED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    if (provided < MPI_THREAD_SERIALIZED)
        return lum_fail(err, LUM_ERR_UNSUPPORTED, "", "this MPI does not let threads call it in turn");
    if (size > (int)LUM_TEAM_MAX)
        return lum_fail(err, LUM_ERR_LIMIT, "", "at most %u ranks, not %d", LUM_TEAM_MAX, size);
    f->team = (struct lum_team){.kind = &over_mpi, .rank = (uint32_t)rank, .size = (uint32_t)size};
    MPI_Win_allocate(rank == 0 ? 2 * sizeof *f->counters : 0, sizeof *f->counters, MPI_INFO_NULL, MPI_COMM_WORLD,
                     &f->counters, &f->window);
    if (rank == 0)
        memset(f->counters, 0, 2 * sizeof *f->counters);
    MPI_Barrier(MPI_COMM_WORLD);
    MPI_Win_lock_all(0, f->window);
    return LUM_OK;
}

enum lum_status lum_farm_join(struct lum_team **ret_team, struct lum_error *err)
{
    *ret_team = NULL;
    if (!is_started_by_mpirun())
        return LUM_OK;
    struct farm *f = lum_calloc(1, sizeof *f);
    if (!f)
        return lum_fail(err, LUM_ERR_NOMEM, "", "out of memory for the other ranks");
    pthread_mutex_init(&f->lock, NULL);
    enum lum_status status = start(f, err);
    if (status == LUM_OK)
        *ret_team = &f->team;
    else
        lum_free(f);
    return status;
}

void lum_farm_leave(struct lum_team *team)
{
    if (!team)
        return;
    struct farm *f = farm_of(team);
    MPI_Win_unlock_all(f->window);
    MPI_Win_free(&f->window);
    MPI_Finalize();
    pthread_mutex_destroy(&f->lock);
    lum_team_finish(team);
    lum_free(f);
}

void lum_farm_version(char ret_text[LUM_FARM_VERSION_BYTES])
{
    char text[MPI_MAX_LIBRARY_VERSION_STRING];
    int n = 0;
    MPI_Get_library_version(text, &n);
    snprintf(ret_text, LUM_FARM_VERSION_BYTES, "%.*s", (int)strcspn(text, ",\n"), text);
}
