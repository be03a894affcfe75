/* Statistics for numeric tests: a seeded generator, the chi-squared test, running means. Header only. */
#ifndef LUM_TESTS_NUMERIC_STATS_H
#define LUM_TESTS_NUMERIC_STATS_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

/* splitmix64 (Steele, Lea & Flood 2014). Independent of the sampler under test. */
struct rng {
    uint64_t state;
};

static inline uint64_t rng_u64(struct rng *r)
{
    uint64_t z = r->state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* [0, 1) */
static inline double rng_unit(struct rng *r)
{
    return (double)(rng_u64(r) >> 11) * 0x1p-53;
}

/* Mean and its standard error (Welford). */
struct mean {
    double n, mean, m2;
};

static inline void mean_add(struct mean *m, double x)
{
    m->n += 1.0;
    double d = x - m->mean;
    m->mean += d / m->n;
    m->m2 += d * (x - m->mean);
}

static inline double mean_stderr(const struct mean *m)
{
    return m->n > 1.0 ? sqrt(m->m2 / (m->n - 1.0) / m->n) : HUGE_VAL;
}

/* Upper regularised incomplete gamma function Q(a, x): series below a + 1, Lentz's continued fraction above. */
static inline double gamma_q(double a, double x)
{
    double scale = exp(-x + a * log(x) - lgamma(a));
    if (x < a + 1.0) {
        double term = 1.0 / a, sum = term;
        for (int n = 1; n < 10000 && term > sum * 1e-15; n++)
            sum += term *= x / (a + n);
        return 1.0 - sum * scale;
    }
    double b = x + 1.0 - a, c = 1e300, d = 1.0 / b, h = d;
    for (int n = 1; n < 10000; n++) {
        double an = -n * (n - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (fabs(d * c - 1.0) < 1e-15)
            break;
    }
    return h * scale;
}

struct chi2_cell {
    double expected, observed;
};

static inline int chi2_by_expected(const void *a, const void *b)
{
    double x = ((const struct chi2_cell *)a)->expected, y = ((const struct chi2_cell *)b)->expected;
    return (x > y) - (x < y);
}

/* Probability of deviations at least this large when the expected counts are true. Sorts the cells; the smallest are
 * pooled to at least 5 expected counts each, where the statistic is chi-squared. Expected and observed have the same
 * sum. */
static inline double chi2_p_value(struct chi2_cell *cells, int n)
{
    qsort(cells, (size_t)n, sizeof *cells, chi2_by_expected);
    double statistic = 0.0;
    int pooled = 0;
    struct chi2_cell pool = {0};
    for (int i = 0; i < n; i++) {
        pool.expected += cells[i].expected;
        pool.observed += cells[i].observed;
        if (pool.expected < 5.0)
            continue;
        double d = pool.observed - pool.expected;
        statistic += d * d / pool.expected;
        pooled++;
        pool = (struct chi2_cell){0};
    }
    return pooled > 1 ? gamma_q(0.5 * (pooled - 1), 0.5 * statistic + 1e-300) : 1.0;
}

/* Level of one of n tests such that all pass with probability 1 - level when nothing is wrong (Sidak 1967). */
static inline double sidak(double level, int n)
{
    return -expm1(log1p(-level) / n);
}

#endif
