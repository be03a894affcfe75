/* A team: several processes that do the same work in step, each with all of it in memory. What takes long is shared: a
 * loop's jobs are handed out one by one, each to one member, and what they leave is told to all. So all go on with the
 * same numbers, and each comes to the result that one alone would.
 *
 * Members take the same steps in the same order: each function below is called by all of them alike. None of them
 * fails: where a member is lost, all end. core only says what it needs of a team; server/farm has one over MPI. */
#ifndef LUM_CORE_BASE_TEAM_H
#define LUM_CORE_BASE_TEAM_H

#include "core/base/base.h"

struct lum_team;

struct lum_team_kind {
    /* A loop begins. */
    void (*begin)(struct lum_team *team);
    /* Takes the next n jobs of it: the first of them. Thread: any, several at once. */
    uint64_t (*take)(struct lum_team *team, uint32_t n);
    /* All hear what each says, by rank; everyone says as many bytes. */
    void (*gather)(struct lum_team *team, const void *mine, size_t bytes, void *ret_all);
    /* The same of parts of as many bytes each, of which the member of rank r has n_parts[r]. */
    void (*gather_parts)(struct lum_team *team, const void *mine, size_t part_bytes, const uint32_t *n_parts,
                         void *ret_all);
    /* All get what member 0 has. */
    void (*broadcast)(struct lum_team *team, void *inout, size_t bytes);
    /* Each number becomes its sum over all members, modulo 2^32. */
    void (*sum)(struct lum_team *team, uint32_t *inout_numbers, size_t n);
    /* All end, with this message. Does not return. */
    void (*give_up)(struct lum_team *team, const char *why);
};

#define LUM_TEAM_MAX 4096u /* members */

enum lum_team_room { LUM_TEAM_MINE, LUM_TEAM_ALL, LUM_TEAM_ACCOUNTS, LUM_TEAM_INDEX, LUM_TEAM_ROOMS };

struct lum_team {
    const struct lum_team_kind *kind;
    uint32_t rank, size;        /* rank: 0 .. size - 1 */
    void *room[LUM_TEAM_ROOMS]; /* for what is said and heard: kept, so that a pass at rest allocates nothing */
    size_t room_bytes[LUM_TEAM_ROOMS];
    uint64_t heard_bytes; /* from others so far, without what the wire adds */
};

void lum_team_gather(struct lum_team *team, const void *mine, size_t bytes, void *ret_all);
void lum_team_gather_parts(struct lum_team *team, const void *mine, size_t part_bytes, const uint32_t *n_parts,
                           void *ret_all);
void lum_team_broadcast(struct lum_team *team, void *inout, size_t bytes);
void lum_team_sum(struct lum_team *team, uint32_t *inout_numbers, size_t n);

/* Room for so many bytes; what is in it may be lost. Gives up where memory is short. */
void *lum_team_room(struct lum_team *team, enum lum_team_room room, size_t bytes);
void lum_team_finish(struct lum_team *team); /* frees it */

/* What member 0 says. */
double lum_team_agree(struct lum_team *team, double value);
/* Gives up unless all say the same. what: "the scene", for the message. */
void lum_team_compare(struct lum_team *team, uint64_t hash, const char *what);

#endif
