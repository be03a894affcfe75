#include "core/light/web_facts.h"

const char *const lum_web_symmetry_names[] = {"axial", "quadrant", "c0-c180", "c90-c270", "none"};

/* The lamp aims along +Z, c0 is +X, c90 is c0 x d: -Y. */
static struct lum_frame frame_of(const struct lum_web *w)
{
    return lum_web_frame(w->type, lum_v3(0, 0, 1), lum_v3(1, 0, 0));
}

static struct lum_vec3 way(double c_deg, double gamma_deg)
{
    double s = sin(gamma_deg * LUM_RAD_PER_DEG), c = c_deg * LUM_RAD_PER_DEG;
    return lum_v3((float)(s * cos(c)), (float)(-s * sin(c)), (float)cos(gamma_deg * LUM_RAD_PER_DEG));
}

static float share_towards(const struct lum_web *w, const struct lum_frame *f, struct lum_vec3 d)
{
    return lum_web_share_along(w, lum_frame_to_local(f, d));
}

double lum_web_polar_cd(const struct lum_web *w, double c_deg, double gamma_deg)
{
    if (w->type == LUM_WEB_C) /* exactly at the file's own angles */
        return w->peak_cd *
               (double)lum_web_share(w, (float)(c_deg * LUM_RAD_PER_DEG), (float)(gamma_deg * LUM_RAD_PER_DEG));
    struct lum_frame f = frame_of(w);
    return w->peak_cd * (double)share_towards(w, &f, way(c_deg, gamma_deg));
}

/* ---- beams ---- */

#define BEAM_STEPS 720 /* of an eighth of a degree, over 90 degrees */

/* Of two half planes together. up: around the back of the lamp. */
static double angle_over(const struct lum_web *w, double c_deg, bool up, double part)
{
    double sides[2], most = 0.0, sum = 0.0;
    for (int pass = 0; pass < 2; pass++)
        for (int side = 0; side < 2; side++) {
            sides[side] = 0.0;
            for (int i = 0; i <= BEAM_STEPS; i++) {
                double from_axis = 90.0 * i / BEAM_STEPS;
                double cd = lum_web_polar_cd(w, c_deg + 180.0 * side, up ? 180.0 - from_axis : from_axis);
                if (pass == 0)
                    most = fmax(most, cd);
                else if (cd >= part * most)
                    sides[side] = from_axis;
            }
            sum += pass ? sides[side] : 0.0;
        }
    return most > 0.0 ? sum : 0.0;
}

/* ---- where it is brightest, and where light goes ---- */

static void find_peak(const struct lum_web *w, const struct lum_frame *f, struct lum_web_facts *ret)
{
    uint32_t best = 0;
    for (uint32_t i = 1; i < w->n_c * w->n_gamma; i++)
        if (w->share[i] > w->share[best])
            best = i;
    double c = (double)w->c[best / w->n_gamma], gamma = (double)w->gamma[best % w->n_gamma];
    struct lum_vec3 local = lum_v3((float)(sin(gamma) * cos(c)), (float)(sin(gamma) * sin(c)), (float)cos(gamma));
    struct lum_vec3 d = lum_frame_to_scene(f, local);
    ret->peak_gamma_deg = atan2(hypot((double)d.x, (double)d.y), (double)d.z) / LUM_RAD_PER_DEG;
    ret->peak_c_deg = ret->peak_gamma_deg > 1e-3 ? atan2(-(double)d.y, (double)d.x) / LUM_RAD_PER_DEG : 0.0;
    if (ret->peak_c_deg < -1e-3)
        ret->peak_c_deg += 360.0;
}

/* Of type C by the bands on either side of 90 degrees, of which one that lies across is divided by its angle; of the
 * others by midpoints, three degrees by three. */
static double share_up(const struct lum_web *w, const struct lum_frame *f)
{
    double half[2] = {0.0, 0.0}, across = 0.5 * LUM_PI_D;
    for (uint32_t k = 0; w->type == LUM_WEB_C && k + 1 < w->n_gamma; k++) {
        double flux = (double)w->bands[k] - (k ? (double)w->bands[k - 1] : 0.0);
        double from = (double)w->gamma[k], to = (double)w->gamma[k + 1];
        double below = fmin(fmax((across - from) / (to - from), 0.0), 1.0);
        half[0] += flux * below;
        half[1] += flux * (1.0 - below);
    }
    for (int k = 0; w->type != LUM_WEB_C && k < 60; k++)
        for (int i = 0; i < 120; i++)
            half[k >= 30] +=
                (double)share_towards(w, f, way(3 * i + 1.5, 3 * k + 1.5)) * sin((3 * k + 1.5) * LUM_RAD_PER_DEG);
    return half[0] + half[1] > 0.0 ? half[1] / (half[0] + half[1]) : 0.0;
}

/* ---- symmetry ---- */

/* True when the web is the same where directions are turned or mirrored, at all of its own angles but its edges, beyond
 * which it is dark. */
static bool same_under(const struct lum_web *w, const struct lum_frame *f, float x, float y, bool turn)
{
    const float tolerance = 1e-3f;
    for (uint32_t i = 0; i < w->n_c; i++)
        for (uint32_t k = 0; k < w->n_gamma; k++) {
            float c = w->c[i], gamma = w->gamma[k], share = w->share[i * w->n_gamma + k];
            struct lum_vec3 local = lum_v3(sinf(gamma) * cosf(c), sinf(gamma) * sinf(c), cosf(gamma));
            struct lum_vec3 d = lum_frame_to_scene(f, local);
            if (turn && w->type == LUM_WEB_C && fabsf(w->share[k] - share) > tolerance)
                return false;
            bool edge = (k == 0 && gamma > 0.0f) || (k + 1 == w->n_gamma && gamma < 3.1415f) ||
                        (!w->closed && (i == 0 || i + 1 == w->n_c));
            struct lum_vec3 there = lum_v3(x * d.x, y * d.y, d.z);
            if (!turn && !edge && fabsf(share_towards(w, f, there) - share) > tolerance)
                return false;
        }
    return !turn || w->type == LUM_WEB_C;
}

static enum lum_web_symmetry symmetry_of(const struct lum_web *w, const struct lum_frame *f)
{
    if (same_under(w, f, 1, 1, true))
        return LUM_WEB_AXIAL;
    bool about_c0 = same_under(w, f, 1, -1, false), about_c90 = same_under(w, f, -1, 1, false);
    if (about_c0)
        return about_c90 ? LUM_WEB_QUADRANT : LUM_WEB_ABOUT_C0;
    return about_c90 ? LUM_WEB_ABOUT_C90 : LUM_WEB_LOPSIDED;
}

void lum_web_facts(const struct lum_web *w, struct lum_web_facts *ret)
{
    struct lum_frame f = frame_of(w);
    *ret = (struct lum_web_facts){.flux_lm = w->flux_sr * w->peak_cd, .peak_cd = w->peak_cd};
    find_peak(w, &f, ret);
    ret->up = share_up(w, &f);
    for (int k = 0; k < 2; k++) {
        ret->beam_deg[k] = angle_over(w, 90.0 * k, ret->up > 0.5, 0.5);
        ret->field_deg[k] = angle_over(w, 90.0 * k, ret->up > 0.5, 0.1);
    }
    ret->symmetry = symmetry_of(w, &f);
}
