/* The table of albedos of brushed surfaces. */
#include "core/material/brushed.h"

/* Nodes: strength = k / 7, alpha = 10^(-3 + 3 j / 11), or the one that there is of either; cos = (i / 13)^3; cosine of
 * the azimuth, from the stretch, = (k / 6)^2. Near grazing the albedo turns with the roughness seen from there over the
 * cosine: that falls fast where one looks across the stretch. */
enum { STRENGTHS = 8, ALPHAS = 12, COSINES = 14, AZIMUTHS = 7, SAMPLES = 16 };

struct albedo {
    float a, b; /* for F = 1, and for F = (1 - v.h)^5 */
};
struct by_alpha {
    struct albedo at[COSINES][AZIMUTHS];
    struct albedo around[COSINES]; /* mean over azimuths */
    struct albedo mean;            /* and over the hemisphere, by cosine */
};
struct lum_brushed_table {
    struct lum_refs refs;
    float strength, alpha; /* as asked for */
    uint32_t n_strengths, n_alphas;
    struct by_alpha of[]; /* by strength, then alpha */
};

static struct albedo mix(struct albedo x, struct albedo y, float w)
{
    return (struct albedo){x.a + (y.a - x.a) * w, x.b + (y.b - x.b) * w};
}

static struct lum_ggx_albedo of(struct albedo e)
{
    return (struct lum_ggx_albedo){e.a - e.b, e.b};
}

/* Mean over microfacets seen from o, at the middles of a grid of the samples that lum_brushed_sample_visible takes. */
static struct albedo integrate(struct lum_vec3 o, struct lum_vec2 alpha)
{
    struct albedo sum = {0};
    for (int k = 0; k < SAMPLES * SAMPLES; k++) {
        struct lum_vec2 u = {((float)(k % SAMPLES) + 0.5f) / SAMPLES, ((float)(k / SAMPLES) + 0.5f) / SAMPLES};
        struct lum_vec3 h = lum_brushed_sample_visible(o, alpha, u);
        float c = lum_dot(o, h), m = lum_max(1.0f - c, 0.0f);
        struct lum_vec3 i = lum_v3_sub(lum_v3_mul(h, 2.0f * c), o);
        if (!(i.z > 0.0f))
            continue;
        float both = lum_brushed_g2_over_cos(o, i, alpha) * i.z / lum_brushed_g1_over_cos(o, alpha);
        sum.a += both;
        sum.b += both * m * m * m * m * m;
    }
    return (struct albedo){sum.a / (SAMPLES * SAMPLES), sum.b / (SAMPLES * SAMPLES)};
}

struct node {
    uint32_t i;
    float w; /* of node i + 1 */
};

static struct node node_at(float x, uint32_t n)
{
    float at = lum_clamp(x, 0.0f, 1.0f) * (float)(n - 1);
    uint32_t i = at < (float)(n - 1) ? (uint32_t)at : n - 2;
    return (struct node){i, at - (float)i};
}

static struct albedo at_azimuth(const struct albedo row[AZIMUTHS], struct node z)
{
    return mix(row[z.i], row[z.i + 1], z.w);
}

static struct albedo around_at(const struct by_alpha *t, float cos)
{
    struct node c = node_at(cbrtf(lum_clamp(cos, 0.0f, 1.0f)), COSINES);
    return mix(t->around[c.i], t->around[c.i + 1], c.w);
}

/* Means are of what is interpolated, so that what several microfacets reflect adds up to what one does not. */
static void add_means(struct by_alpha *t)
{
    enum { STEPS = 64 };
    for (int i = 0; i < COSINES; i++)
        for (int k = 0; k < STEPS; k++) {
            float azimuth = ((float)k + 0.5f) * (0.5f * LUM_PI / STEPS);
            struct albedo e = at_azimuth(t->at[i], node_at(sqrtf(cosf(azimuth)), AZIMUTHS));
            t->around[i].a += e.a / STEPS, t->around[i].b += e.b / STEPS;
        }
    for (int k = 0; k < STEPS; k++) {
        float cos = sqrtf(((float)k + 0.5f) / STEPS); /* evenly by its square: weight 2 cos */
        struct albedo e = around_at(t, cos);
        t->mean.a += e.a / STEPS, t->mean.b += e.b / STEPS;
    }
}

static void fill(struct by_alpha *t, struct lum_vec2 alpha)
{
    for (int i = 0; i < COSINES; i++)
        for (int k = 0; k < AZIMUTHS; k++) {
            float cos = (float)i / (COSINES - 1), x = (float)k / (AZIMUTHS - 1);
            cos = lum_max(cos * cos * cos, 1e-6f);
            float sin = sqrtf(1.0f - cos * cos), y = sqrtf(1.0f - x * x * x * x);
            t->at[i][k] = integrate(lum_v3(sin * x * x, sin * y, cos), alpha);
        }
    add_means(t);
}

struct lum_brushed_table *lum_brushed_table_create(float strength, float alpha)
{
    uint32_t n_strengths = strength >= 0.0f ? 1 : STRENGTHS, n_alphas = alpha >= 0.0f ? 1 : ALPHAS;
    struct lum_brushed_table *table = lum_calloc(1, sizeof *table + n_strengths * n_alphas * sizeof table->of[0]);
    if (!table)
        return NULL;
    lum_refs_init(&table->refs);
    table->strength = strength, table->alpha = alpha;
    table->n_strengths = n_strengths, table->n_alphas = n_alphas;
    for (uint32_t i = 0; i < n_strengths * n_alphas; i++) {
        uint32_t k = i / n_alphas, j = i % n_alphas;
        float s = n_strengths == 1 ? strength : (float)k / (STRENGTHS - 1);
        float across = n_alphas == 1 ? alpha : powf(LUM_ALPHA_MIN, 1.0f - (float)j / (ALPHAS - 1));
        fill(&table->of[i],
             (struct lum_vec2){lum_max(lum_brushed_along(across, s), LUM_ALPHA_MIN), lum_max(across, LUM_ALPHA_MIN)});
    }
    return table;
}

bool lum_brushed_table_serves(const struct lum_brushed_table *table, float strength, float alpha)
{
    return table->strength == strength && table->alpha == alpha;
}

struct lum_brushed_table *lum_brushed_table_ref(const struct lum_brushed_table *table)
{
    lum_refs_get(&((struct lum_brushed_table *)table)->refs); /* the count is the one thing that is not const */
    return (struct lum_brushed_table *)table;
}

void lum_brushed_table_unref(const struct lum_brushed_table *table)
{
    if (table && lum_refs_put(&((struct lum_brushed_table *)table)->refs))
        lum_free((struct lum_brushed_table *)table);
}

struct lum_brushed_row lum_brushed_row(const struct lum_brushed_table *table, float strength, float alpha)
{
    struct lum_brushed_row row = {{0, 0.0f}, {0, 0.0f}};
    if (table->n_alphas > 1) {
        struct node at = node_at(1.0f - log10f(lum_max(alpha, LUM_ALPHA_MIN)) / log10f(LUM_ALPHA_MIN), ALPHAS);
        row.alpha = (struct lum_ggx_row){at.i, at.w};
    }
    if (table->n_strengths > 1) {
        struct node at = node_at(strength, STRENGTHS);
        row.strength = (struct lum_ggx_row){at.i, at.w};
    }
    return row;
}

/* Nodes around a row, up to four, with the weight of each. */
struct corner {
    const struct by_alpha *of;
    float w;
};

static uint32_t corners_of(const struct lum_brushed_table *table, const struct lum_brushed_row *row,
                           struct corner ret_corners[4])
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < (row->strength.w > 0.0f ? 2u : 1u); k++)
        for (uint32_t j = 0; j < (row->alpha.w > 0.0f ? 2u : 1u); j++) {
            float w = (k ? row->strength.w : 1.0f - row->strength.w) * (j ? row->alpha.w : 1.0f - row->alpha.w);
            const struct by_alpha *of = &table->of[(row->strength.i + k) * table->n_alphas + row->alpha.i + j];
            ret_corners[n++] = (struct corner){of, w};
        }
    return n;
}

static void add(struct albedo *sum, float w, struct albedo e)
{
    sum->a += w * e.a;
    sum->b += w * e.b;
}

struct lum_ggx_albedo lum_brushed_albedo(const struct lum_brushed_table *table, const struct lum_brushed_row *row,
                                         struct lum_vec3 w)
{
    float sin = sqrtf(w.x * w.x + w.y * w.y), azimuth = sin > 0.0f ? fabsf(w.x) / sin : 1.0f;
    struct node c = node_at(cbrtf(lum_min(fabsf(w.z), 1.0f)), COSINES), z = node_at(sqrtf(azimuth), AZIMUTHS);
    struct corner corners[4];
    struct albedo e = {0};
    uint32_t n = corners_of(table, row, corners);
    for (uint32_t k = 0; k < n; k++) {
        const struct by_alpha *t = corners[k].of;
        add(&e, corners[k].w, mix(at_azimuth(t->at[c.i], z), at_azimuth(t->at[c.i + 1], z), c.w));
    }
    return of(e);
}

struct lum_ggx_albedo lum_brushed_albedo_at(const struct lum_brushed_table *table, const struct lum_brushed_row *row,
                                            float cos)
{
    struct corner corners[4];
    struct albedo e = {0};
    uint32_t n = corners_of(table, row, corners);
    for (uint32_t k = 0; k < n; k++)
        add(&e, corners[k].w, around_at(corners[k].of, cos));
    return of(e);
}

struct lum_ggx_albedo lum_brushed_albedo_mean(const struct lum_brushed_table *table, const struct lum_brushed_row *row)
{
    struct corner corners[4];
    struct albedo e = {0};
    uint32_t n = corners_of(table, row, corners);
    for (uint32_t k = 0; k < n; k++)
        add(&e, corners[k].w, corners[k].of->mean);
    return of(e);
}
