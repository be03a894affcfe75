#include "clients/replay/latency.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "protocol/json/json.h"

void samples_finish(struct samples *s)
{
    free(s->us);
    *s = (struct samples){0};
}

void samples_add(struct samples *s, double us)
{
    if (s->n == s->capacity) {
        size_t capacity = s->capacity ? 2 * s->capacity : 64;
        double *grown = realloc(s->us, capacity * sizeof *grown);
        if (!grown) {
            s->failed = true;
            return;
        }
        s->us = grown;
        s->capacity = capacity;
    }
    s->us[s->n++] = us;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double samples_percentile(struct samples *s, double p)
{
    if (s->n == 0)
        return 0.0;
    qsort(s->us, s->n, sizeof *s->us, ascending);
    double rank = ceil(p * (double)s->n / 100.0);
    size_t k = rank < 1.0 ? 1 : (size_t)rank;
    return s->us[(k > s->n ? s->n : k) - 1];
}

struct cJSON *samples_to_json(struct samples *s)
{
    static const struct {
        const char *name;
        double p;
    } rows[] = {{"min", 0.0}, {"p50", 50.0}, {"p90", 90.0}, {"p95", 95.0}, {"p99", 99.0}, {"max", 100.0}};
    if (s->n == 0)
        return cJSON_CreateNull();
    cJSON *json = cJSON_CreateObject();
    bool ok = lum_json_add_number(json, "n", (double)s->n);
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        ok = ok && lum_json_add_number(json, rows[i].name, samples_percentile(s, rows[i].p));
    if (ok)
        return json;
    cJSON_Delete(json);
    return NULL;
}

/* ---- waiting ---- */

static void remove_waiting(struct latency *l, size_t i)
{
    memmove(&l->waiting[i], &l->waiting[i + 1], (l->n_waiting - i - 1) * sizeof l->waiting[0]);
    l->n_waiting--;
}

static void shown(struct latency *l, size_t i, int64_t t_ns)
{
    samples_add(&l->samples, (double)(t_ns - l->waiting[i].sent_ns) * 1e-3);
    remove_waiting(l, i);
}

bool latency_sent(struct latency *l, uint64_t request, uint64_t mark, int64_t now_ns)
{
    if (l->n_waiting == LATENCY_WAITING_MAX)
        return false;
    l->waiting[l->n_waiting].request = request;
    l->waiting[l->n_waiting].mark = mark;
    l->waiting[l->n_waiting++].sent_ns = now_ns;
    return true;
}

void latency_marked(struct latency *l, uint64_t request, uint64_t mark)
{
    for (size_t i = 0; i < l->n_waiting; i++) {
        if (l->waiting[i].request != request)
            continue;
        l->waiting[i].mark = mark;
        for (size_t k = 0; k < l->n_frames; k++)
            if (l->frames[k].mark >= mark && l->frames[k].t_ns >= l->waiting[i].sent_ns) {
                shown(l, i, l->frames[k].t_ns);
                return;
            }
        return;
    }
}

void latency_refused(struct latency *l, uint64_t request)
{
    for (size_t i = 0; i < l->n_waiting; i++)
        if (l->waiting[i].request == request) {
            remove_waiting(l, i);
            return;
        }
}

void latency_frame(struct latency *l, uint64_t mark, int64_t t_ns)
{
    if (l->n_frames == LATENCY_FRAMES_KEPT) {
        memmove(&l->frames[0], &l->frames[1], (LATENCY_FRAMES_KEPT - 1) * sizeof l->frames[0]);
        l->n_frames--;
    }
    l->frames[l->n_frames].mark = mark;
    l->frames[l->n_frames++].t_ns = t_ns;
    for (size_t i = 0; i < l->n_waiting;)
        if (l->waiting[i].mark != 0 && l->waiting[i].mark <= mark)
            shown(l, i, t_ns);
        else
            i++;
}
