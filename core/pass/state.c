#include "core/pass/state.h"

#include <assert.h>

#include "core/pass/pass.h"

static void finish_row(struct lum_states *s, uint32_t i)
{
    s->row[i].kind->finish(s->row[i].state);
    lum_free(s->row[i].state);
    s->row[i] = s->row[--s->n];
}

void lum_states_finish(struct lum_states *s)
{
    while (s->n > 0)
        finish_row(s, s->n - 1);
    *s = (struct lum_states){0};
}

static uint32_t find(const struct lum_states *s, const struct lum_state_kind *kind)
{
    uint32_t i = 0;
    while (i < s->n && s->row[i].kind != kind)
        i++;
    return i;
}

static bool plan(struct lum_states *s, const struct lum_pass *pass, const struct lum_state_kind *kind)
{
    uint32_t i = find(s, kind);
    if (i == s->n) {
        assert(s->n < LUM_STATES_MAX); /* the table of methods decides it, and nobody outside */
        void *state = lum_calloc(1, kind->bytes);
        if (!state)
            return false;
        s->row[s->n].kind = kind;
        s->row[s->n++].state = state;
    }
    s->row[i].planned = true;
    return kind->reserve(s->row[i].state, pass);
}

enum lum_status lum_states_update(struct lum_states *s, const struct lum_pass *pass,
                                  const struct lum_state_kind *const *kinds, uint32_t n,
                                  const struct lum_outcome *outcome, struct lum_error *err)
{
    if (s->w != pass->tiling.w || s->h != pass->tiling.h)
        lum_states_finish(s);
    s->w = pass->tiling.w;
    s->h = pass->tiling.h;
    for (uint32_t i = 0; i < s->n; i++)
        s->row[i].planned = false;
    for (uint32_t k = 0; k < n; k++)
        if (kinds[k] && !plan(s, pass, kinds[k])) {
            lum_states_finish(s);
            return lum_fail(err, LUM_ERR_NOMEM, "size", "out of memory for the buffers of %u x %u pixels",
                            pass->tiling.w, pass->tiling.h);
        }
    for (uint32_t i = s->n; i-- > 0;)
        if (!s->row[i].planned && pass->snapshot->lights.n_active > 0)
            finish_row(s, i);
    for (uint32_t i = 0; i < s->n; i++)
        s->row[i].kind->invalidate(s->row[i].state, pass, outcome);
    return LUM_OK;
}

void *lum_state(const struct lum_states *states, const struct lum_state_kind *kind)
{
    uint32_t i = find(states, kind);
    return i < states->n && states->row[i].planned ? states->row[i].state : NULL;
}

void *lum_pass_state(const struct lum_pass *pass, const struct lum_state_kind *kind)
{
    return pass->states ? lum_state(pass->states, kind) : NULL;
}
