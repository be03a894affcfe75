/* The figure: a hooded, robed statue on a round plinth, modelled as a closed surface over angle and height.
 *
 * The body is an elliptical lathe whose axis sways, displaced by folds that deepen towards the hem, by two sleeves that
 * meet before the chest and by a hood around a face. Heights are in units of the whole height, 0 at the floor. */
#include "core/scene/shape_grid.h"

struct figure {
    double fold_depth, fold_turn;
};

/* Cubic through control points, monotone where they are (Fritsch & Carlson 1980), so that profiles do not overshoot. */
struct knot {
    double x, y;
};

static double tangent(const struct knot *k, int i, int n)
{
    if (i == 0 || i == n - 1)
        return 0.0;
    double a = (k[i].y - k[i - 1].y) / (k[i].x - k[i - 1].x), b = (k[i + 1].y - k[i].y) / (k[i + 1].x - k[i].x);
    return a * b <= 0.0 ? 0.0 : 2.0 * a * b / (a + b);
}

static double curve(const struct knot *k, int n, double x)
{
    if (x <= k[0].x)
        return k[0].y;
    int i = 0;
    while (i < n - 2 && x > k[i + 1].x)
        i++;
    if (x >= k[n - 1].x)
        return k[n - 1].y;
    double w = k[i + 1].x - k[i].x, t = (x - k[i].x) / w;
    double a = tangent(k, i, n) * w, b = tangent(k, i + 1, n) * w;
    double t2 = t * t, t3 = t2 * t;
    return (2 * t3 - 3 * t2 + 1) * k[i].y + (t3 - 2 * t2 + t) * a + (3 * t2 - 2 * t3) * k[i + 1].y + (t3 - t2) * b;
}
#define CURVE(points, x) curve(points, (int)LUM_ARRAY_LEN(points), x)

static double bump(double x, double width)
{
    return exp(-x * x / (width * width));
}

/* Half width (x) and half depth (z) of the body against height. */
static const struct knot half_width[] = {
    {0.050, 0.170}, {0.075, 0.172}, {0.160, 0.150}, {0.300, 0.132}, {0.440, 0.126}, {0.560, 0.116}, {0.660, 0.126},
    {0.740, 0.136}, {0.785, 0.124}, {0.825, 0.088}, {0.860, 0.066}, {0.905, 0.067}, {0.945, 0.058}, {0.980, 0.034},
};
static const struct knot half_depth[] = {
    {0.050, 0.158}, {0.075, 0.160}, {0.160, 0.136}, {0.300, 0.114}, {0.440, 0.104}, {0.560, 0.090}, {0.660, 0.094},
    {0.740, 0.088}, {0.785, 0.080}, {0.825, 0.070}, {0.860, 0.066}, {0.905, 0.076}, {0.945, 0.068}, {0.980, 0.040},
};
/* The axis: hips to one side, shoulders to the other, head bowed forward. */
static const struct knot sway_x[] = {{0.05, 0.0},    {0.30, 0.010},  {0.50, 0.016},
                                     {0.72, -0.004}, {0.90, -0.010}, {1.0, -0.012}};
static const struct knot sway_z[] = {{0.05, 0.0},   {0.45, 0.010}, {0.70, -0.006},
                                     {0.84, 0.004}, {0.92, 0.024}, {1.0, 0.020}};
/* Depth of the folds relative to the radius. */
static const struct knot fold_depth[] = {{0.05, 0.170}, {0.20, 0.135}, {0.42, 0.095}, {0.56, 0.052},
                                         {0.70, 0.040}, {0.80, 0.050}, {0.86, 0.014}, {0.95, 0.0}};

/* Rounded ridges with sharper valleys, n of them around; periodic in the angle. The 0.02 rounds the valleys to what the
 * default tessellation can show. */
static double ridges(double angle, int n, double phase)
{
    double c = cos(0.5 * (n * angle + phase));
    return sqrt(c * c + 0.02) - 2.0 / LUM_PI_D;
}

static double folds(const struct figure *f, double angle, double y)
{
    double turn = f->fold_turn, free_fall = 1.0 - y;
    double sway = 0.35 * sin(7.0 * y + 1.3) * turn;
    double coarse = ridges(angle + sway, 9, 2.6 * turn * y);
    double fine = ridges(angle - 0.6 * sway, 15, 1.1 - 5.0 * turn * y);
    double cloak = ridges(angle, 4, 9.0 * turn * y + 0.7); /* wraps round the body */
    return f->fold_depth * CURVE(fold_depth, y) * (0.75 * coarse + 0.38 * fine + 0.55 * cloak * free_fall);
}

/* Sleeves: from the elbows at the sides up to the joined hands in front; cloth hangs below the forearm. angle is 0 at
 * the front (+z). */
static double sleeves(double angle, double y)
{
    double side = fabs(angle), along = fmin(side / 1.45, 1.0);
    double arm = 0.650 - 0.075 * along * along; /* height of the forearm */
    double below = arm - y;
    double width = below > 0.0 ? 0.060 + 0.065 * along : 0.038;
    double reach = side < 1.45 ? 1.0 : bump(side - 1.45, 0.35);
    double drape = 1.0 + 0.16 * cos(9.0 * side - 60.0 * below) * bump(below - 0.03, 0.05);
    double forearm = 0.036 * reach * bump(below, width) * (0.85 + 0.15 * cos(2.2 * side)) * drape;
    double hands = 0.014 * bump(angle, 0.24) * bump(y - 0.668, 0.042);
    double upper_arm = 0.022 * bump(side - 1.50, 0.42) * bump(y - 0.655, 0.085);
    return forearm + hands + upper_arm;
}

/* A hood around a face with brow, eyes, nose, mouth and chin; the veil falls to the shoulders. */
static double hood(double angle, double y)
{
    double a = angle / 0.86, b = (y - 0.893) / 0.056, r = sqrt(a * a + b * b);
    double opening = -0.017 / (1.0 + exp(9.0 * (r - 0.84)));
    double rim = 0.008 * bump(r - 1.05, 0.24);
    double face = 0.012 * bump(angle, 0.42) * bump(y - 0.893, 0.042);
    double nose =
        0.0100 * bump(angle, 0.13) * bump(y - 0.889, 0.010) + 0.0045 * bump(angle, 0.10) * bump(y - 0.902, 0.011);
    double brow = 0.0036 * bump(angle, 0.40) * bump(y - 0.914, 0.008);
    double eyes = -0.0044 * (bump(angle - 0.27, 0.13) + bump(angle + 0.27, 0.13)) * bump(y - 0.9035, 0.0075);
    double mouth = 0.0030 * bump(angle, 0.17) * (bump(y - 0.8765, 0.0034) + bump(y - 0.8700, 0.0034));
    double chin = 0.0064 * bump(angle, 0.20) * bump(y - 0.8585, 0.0085);
    double veil = 0.016 * bump(fabs(angle) - 1.10, 0.40) * bump(y - 0.835, 0.050);
    return opening + rim + face + nose + brow + eyes + mouth + chin + veil;
}

/* The crown of the hood closes as an ellipse over the last control point. */
static double crown(double y)
{
    const double from = 0.945, top = 1.0;
    if (y <= from)
        return 1.0;
    double t = (y - from) / (top - from);
    return sqrt(fmax(0.0, 1.0 - t * t));
}

static struct lum_vec3d body_point(const struct figure *f, double angle, double y)
{
    double yc = fmin(y, 0.945);
    double c = cos(angle), s = sin(angle); /* angle from +z towards +x */
    double w = CURVE(half_width, yc), d = CURVE(half_depth, yc);
    double front = remainder(angle, 2.0 * LUM_PI_D);
    double r = (1.0 + folds(f, front, y)) * crown(y);
    double out = (sleeves(front, y) + hood(front, y)) * crown(y);
    double length = sqrt(w * w * s * s + d * d * c * c);
    double push = r + out / length;
    return (struct lum_vec3d){CURVE(sway_x, y) + push * w * s, y, CURVE(sway_z, y) + push * d * c};
}

/* v: the underside from its centre to the hem, then up over the body; rows gather where there is detail. */
static const struct knot row_height[] = {
    {0.000, 0.050}, {0.030, 0.056}, {0.110, 0.120}, {0.290, 0.400}, {0.400, 0.560},  {0.580, 0.730},
    {0.660, 0.830}, {0.700, 0.850}, {0.900, 0.926}, {0.960, 0.980}, {0.985, 0.9965}, {1.000, 1.000},
};
#define UNDERSIDE 0.02 /* share of v; hidden inside the plinth */

static struct lum_vec3d robe_position(const void *ctx, double u, double v)
{
    double angle =
        2.0 * LUM_PI_D * u - 0.45 * sin(2.0 * LUM_PI_D * u); /* from +z towards +x; columns gather at the front */
    if (v >= UNDERSIDE)
        return body_point(ctx, angle, CURVE(row_height, (v - UNDERSIDE) / (1.0 - UNDERSIDE)));
    struct lum_vec3d hem = body_point(ctx, angle, 0.050);
    double t = v / UNDERSIDE;
    return (struct lum_vec3d){t * hem.x, 0.050, t * hem.z};
}

struct robe {
    struct figure figure;
    uint32_t nv;
};

/* Row 0 is the centre of the underside, row 1 the hem, row nv the crown. */
static void robe_at(const void *ctx, struct lum_grid_point *g)
{
    const struct robe *robe = ctx;
    double v = g->j == 0 ? 0.0 : UNDERSIDE + (1.0 - UNDERSIDE) * (g->j - 1.0) / (robe->nv - 1.0);
    if (g->j == 0 || g->j == robe->nv) {
        double y = g->j == 0 ? 0.050 : 1.0;
        g->p = g->j == 0 ? (struct lum_vec3d){0, y, 0} : (struct lum_vec3d){CURVE(sway_x, y), y, CURVE(sway_z, y)};
        g->n = (struct lum_vec3d){0, g->j == 0 ? -1 : 1, 0};
        return;
    }
    g->p = robe_position(&robe->figure, g->u, v);
    struct lum_grid_point probe = {.u = g->u, .v = v + 2e-5}; /* on the body's side of the hem's edge */
    lum_grid_normal(&probe, robe_position, &robe->figure);
    g->n = probe.n;
}

/* The plinth: a lathe with sharp edges; points are given twice where it has an edge. */
struct profile_point {
    double r, y, nr, ny;
};
static const struct profile_point plinth[] = {
    {0.000, 0.000, 0, -1},    {0.215, 0.000, 0, -1},    {0.215, 0.000, 1, 0}, {0.215, 0.020, 1, 0},
    {0.215, 0.020, 0.6, 0.8}, {0.203, 0.029, 0.6, 0.8}, {0.203, 0.029, 1, 0}, {0.203, 0.046, 1, 0},
    {0.203, 0.046, 0.7, 0.7}, {0.193, 0.056, 0.7, 0.7}, {0.193, 0.056, 0, 1}, {0.000, 0.056, 0, 1},
};
#define PLINTH_ROWS (LUM_ARRAY_LEN(plinth) / 2)

/* Each band of the plinth is its own grid of one row: ctx points to its lower profile point. */
static void band_at(const void *ctx, struct lum_grid_point *g)
{
    const struct profile_point *p = (const struct profile_point *)ctx + g->j;
    double angle = 2.0 * LUM_PI_D * g->u;
    g->p = (struct lum_vec3d){p->r * sin(angle), p->y, p->r * cos(angle)};
    g->n = (struct lum_vec3d){p->nr * sin(angle), p->ny, p->nr * cos(angle)};
}

enum lum_status lum_shape_figure(struct lum_shape_build *b, const struct lum_shape_input *in, struct lum_error *err)
{
    if (!(in->param[0] >= 0.0 && in->param[0] <= 2.0 && fabs(in->param[1]) <= 4.0))
        return lum_fail(err, LUM_ERR_INVALID, "param", "a figure's folds are 0 to 2 deep and turn at most 4");
    const struct robe robe = {{in->param[0], in->param[1]}, in->segments[1]};
    struct lum_grid grids[1 + PLINTH_ROWS];
    grids[0] = (struct lum_grid){.at = robe_at,
                                 .ctx = &robe,
                                 .nu = in->segments[0],
                                 .nv = in->segments[1],
                                 .closed_u = true,
                                 .pole_lo = true,
                                 .pole_hi = true};
    for (size_t k = 0; k < PLINTH_ROWS; k++)
        grids[1 + k] = (struct lum_grid){.at = band_at,
                                         .ctx = &plinth[2 * k],
                                         .nu = in->segments[0],
                                         .nv = 1,
                                         .closed_u = true,
                                         .pole_lo = k == 0,
                                         .pole_hi = k + 1 == PLINTH_ROWS};
    return lum_shape_of_grids(b, grids, (uint32_t)LUM_ARRAY_LEN(grids), err);
}
