#include "core/base/team.h"

#include <stdio.h>

void lum_team_gather(struct lum_team *team, const void *mine, size_t bytes, void *ret_all)
{
    team->kind->gather(team, mine, bytes, ret_all);
    team->heard_bytes += (team->size - 1) * (uint64_t)bytes;
}

void lum_team_gather_parts(struct lum_team *team, const void *mine, size_t part_bytes, const uint32_t *n_parts,
                           void *ret_all)
{
    team->kind->gather_parts(team, mine, part_bytes, n_parts, ret_all);
    for (uint32_t r = 0; r < team->size; r++)
        team->heard_bytes += r != team->rank ? n_parts[r] * (uint64_t)part_bytes : 0;
}

void lum_team_broadcast(struct lum_team *team, void *inout, size_t bytes)
{
    team->kind->broadcast(team, inout, bytes);
    team->heard_bytes += team->rank > 0 ? bytes : 0;
}

void lum_team_sum(struct lum_team *team, uint32_t *inout_numbers, size_t n)
{
    team->kind->sum(team, inout_numbers, n);
    team->heard_bytes += (team->size - 1) * (2 * sizeof *inout_numbers * (uint64_t)n / team->size); /* in a ring */
}

void *lum_team_room(struct lum_team *team, enum lum_team_room room, size_t bytes)
{
    if (bytes <= team->room_bytes[room])
        return team->room[room];
    lum_free(team->room[room]);
    team->room[room] = lum_calloc(1, bytes);
    team->room_bytes[room] = team->room[room] ? bytes : 0;
    if (!team->room[room])
        team->kind->give_up(team, "out of memory for what is told to the others");
    return team->room[room];
}

void lum_team_finish(struct lum_team *team)
{
    for (int i = 0; i < LUM_TEAM_ROOMS; i++) {
        lum_free(team->room[i]);
        team->room[i] = NULL;
        team->room_bytes[i] = 0;
    }
}

double lum_team_agree(struct lum_team *team, double value)
{
    lum_team_broadcast(team, &value, sizeof value);
    return value;
}

void lum_team_compare(struct lum_team *team, uint64_t hash, const char *what)
{
    uint64_t *all = lum_team_room(team, LUM_TEAM_ACCOUNTS, team->size * sizeof *all);
    lum_team_gather(team, &hash, sizeof hash, all);
    for (uint32_t r = 1; r < team->size; r++)
        if (all[r] != all[0]) {
            char why[128];
            snprintf(why, sizeof why, "%s of rank %u is not that of rank 0", what, r);
            team->kind->give_up(team, why);
        }
}
