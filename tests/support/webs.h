/* Photometric webs for tests, of a function of the angles. */
#ifndef LUM_TESTS_SUPPORT_WEBS_H
#define LUM_TESTS_SUPPORT_WEBS_H

#include <stdlib.h>

#include "core/light/web.h"

struct web_grid {
    enum lum_web_type type;
    double c0, c1, gamma0, gamma1; /* degrees, first and last */
    uint32_t n_c, n_gamma;
};

/* degrees to candela */
typedef double (*web_fn)(double c, double gamma);

static inline struct lum_web *web_of(const struct web_grid *g, web_fn fn)
{
    float *v = calloc(g->n_c + g->n_gamma + (size_t)g->n_c * g->n_gamma, sizeof *v), *c = v, *gamma = v + g->n_c;
    float *cd = gamma + g->n_gamma;
    struct lum_web *web = NULL;
    for (uint32_t i = 0; i < g->n_c; i++)
        c[i] = (float)(g->n_c == 1 ? g->c0 : g->c0 + (g->c1 - g->c0) * i / (g->n_c - 1));
    for (uint32_t k = 0; k < g->n_gamma; k++)
        gamma[k] = (float)(g->gamma0 + (g->gamma1 - g->gamma0) * k / (g->n_gamma - 1));
    for (uint32_t i = 0; i < g->n_c; i++)
        for (uint32_t k = 0; k < g->n_gamma; k++)
            cd[i * g->n_gamma + k] = (float)fn((double)c[i], (double)gamma[k]);
    struct lum_web_desc d = {g->type, g->n_c, g->n_gamma, c, gamma, cd};
    if (lum_web_create(&d, &web, NULL) != LUM_OK)
        web = NULL;
    free(v);
    return web;
}

static inline double web_even(double c, double gamma)
{
    (void)c, (void)gamma;
    return 100.0;
}

/* Lambert's. Exactly 0 on the horizon. */
static inline double web_cosine(double c, double gamma)
{
    (void)c;
    return gamma < 90.0 ? 1000.0 * cos(gamma * 0.017453292519943295) : 0.0;
}

/* Brightest to one side, dark in a quarter, and some light upwards. */
static inline double web_lopsided(double c, double gamma)
{
    double a = c * 0.017453292519943295, side = 1.0 + cos(a - 0.7);
    return gamma <= 120.0 ? 300.0 * side * side * (1.1 + cos(gamma * 0.026)) : 0.0;
}

/* The kinds of lamp that tests go through need one. */
static inline struct lum_web *web_of_a_lamp(void)
{
    static const struct web_grid grid = {LUM_WEB_C, 0, 360, 0, 180, 25, 37};
    return web_of(&grid, web_lopsided);
}

#endif
