#include "core/measure/ugr_table.h"

#include "core/measure/position_index.h"

const struct lum_ugr_room lum_ugr_rooms[LUM_UGR_ROOMS] = {{2, 2}, {2, 3},  {2, 4},  {2, 6},  {2, 8},  {2, 12}, {4, 2},
                                                          {4, 3}, {4, 4},  {4, 6},  {4, 8},  {4, 12}, {8, 4},  {8, 6},
                                                          {8, 8}, {8, 12}, {12, 4}, {12, 6}, {12, 8}};
const struct lum_ugr_paint lum_ugr_paints[LUM_UGR_PAINTS] = {
    {0.7, 0.5, 0.2}, {0.7, 0.3, 0.2}, {0.5, 0.5, 0.2}, {0.5, 0.3, 0.2}, {0.3, 0.3, 0.2}};

/* ---- light that goes to and fro ---- */

/* Share of the light of one of two equal rectangles, opposite to each other, that reaches the other; sides over their
 * distance. */
static double across(double x, double y)
{
    double x1 = sqrt(1.0 + x * x), y1 = sqrt(1.0 + y * y);
    double sum = log(x1 * y1 / sqrt(1.0 + x * x + y * y)) + x * y1 * atan(x / y1) + y * x1 * atan(y / x1) -
                 x * atan(x) - y * atan(y);
    return 2.0 * sum / (LUM_PI_D * x * y);
}

/* Flux that walls get is w of each lumen that they got at once. Ceiling c, walls w, floor f:
 *   c = c0 + rw Fwc w + rf F f,  w = w0 + rc (1 - F) c + rw (1 - 2 Fwc) w + rf (1 - F) f,  f = f0 + rc F c + rw Fwc w.
 * The first and the last give c and f by w; then w. */
struct lum_ugr_transfer lum_ugr_transfer_of(const struct lum_ugr_room *room, const struct lum_ugr_paint *p)
{
    double x = room->x_h, y = room->y_h, opposite = across(x, y);
    double to_end = x * y * (1.0 - opposite) / (2.0 * (x + y)); /* of the walls' light, to ceiling or floor */
    double loop = 1.0 / (1.0 - p->ceiling * p->floor * opposite * opposite);
    /* reaches the walls of a lumen on the ceiling, or on the floor, before walls reflect it */
    double of_ceiling = loop * (1.0 - opposite) * p->ceiling * (1.0 + p->floor * opposite);
    double of_floor = loop * (1.0 - opposite) * p->floor * (1.0 + p->ceiling * opposite);
    double again = p->walls * (1.0 - 2.0 * to_end + to_end * (of_ceiling + of_floor));
    double all = 1.0 / (1.0 - again);
    return (struct lum_ugr_transfer){of_floor * all, all - 1.0, of_ceiling * all};
}

/* ---- light straight from luminaires ---- */

#define N_GAMMA 180 /* rings of a degree */
#define N_AROUND 72 /* directions of each */

struct rings {
    double cd[N_GAMMA]; /* mean all around, at the middle of each */
    double down_lm, up_lm;
};

struct hung {
    const struct lum_web *web;
    struct lum_frame frame;
};

/* It aims along -y. */
static struct hung hang(const struct lum_web *web, struct lum_vec3 c0)
{
    return (struct hung){web, lum_web_frame(web->type, lum_v3(0, -1, 0), c0)};
}

static double intensity(const struct hung *h, struct lum_vec3 d)
{
    return h->web->peak_cd * (double)lum_web_share_along(h->web, lum_frame_to_local(&h->frame, d));
}

static double ring_sr(int k)
{
    return 2.0 * LUM_PI_D * (cos(LUM_PI_D * k / N_GAMMA) - cos(LUM_PI_D * (k + 1) / N_GAMMA));
}

static void measure_rings(const struct lum_web *web, struct rings *ret)
{
    struct hung h = hang(web, lum_v3(1, 0, 0));
    *ret = (struct rings){.down_lm = 0.0};
    for (int k = 0; k < N_GAMMA; k++) {
        double gamma = LUM_PI_D * (k + 0.5) / N_GAMMA, out = sin(gamma);
        for (int i = 0; i < N_AROUND; i++) {
            double c = 2.0 * LUM_PI_D * (i + 0.5) / N_AROUND;
            struct lum_vec3 d = lum_v3((float)(out * cos(c)), (float)-cos(gamma), (float)(out * sin(c)));
            ret->cd[k] += intensity(&h, d) / N_AROUND;
        }
        *(k < N_GAMMA / 2 ? &ret->down_lm : &ret->up_lm) += ret->cd[k] * ring_sr(k);
    }
}

/* Share of a row of n luminaires, one to each of n equal parts of a length, that is still within it moved by offset. */
static double share_within(double offset, double length, double n)
{
    double left = floor(n - 0.5 - fabs(offset) * n / length) + 1.0;
    return fmin(fmax(left / n, 0.0), 1.0);
}

/* Light that reaches the floor at once, lm of one luminaire: of each ring, the part of the luminaires from which it
 * lands within the room. */
static double floor_lm(const struct rings *rings, const struct lum_ugr_room *room, double spacing)
{
    double sum = 0.0, nx = room->x_h / spacing, ny = room->y_h / spacing;
    for (int k = 0; k < N_GAMMA / 2; k++) {
        double reach = tan(LUM_PI_D * (k + 0.5) / N_GAMMA), share = 0.0;
        for (int i = 0; i < N_AROUND / 4; i++) { /* the room is alike in all quarters */
            double c = 2.0 * LUM_PI_D * (i + 0.5) / N_AROUND;
            share += share_within(reach * cos(c), room->x_h, nx) * share_within(reach * sin(c), room->y_h, ny);
        }
        sum += rings->cd[k] * ring_sr(k) * share * 4.0 / N_AROUND;
    }
    return sum;
}

/* ---- glare ---- */

/* m2 that shine towards unit direction d, for a luminaire that hangs with its length along c0. */
static double area_towards(const struct lum_ugr_luminaire *l, struct lum_vec3 c0, struct lum_vec3 d)
{
    double along = l->size_m[0], wide = l->size_m[1], high = l->size_m[2];
    double down = fabs((double)d.y), to_c0 = fabs((double)lum_dot(d, c0));
    double out = sqrt(fmax(1.0 - down * down, 0.0)), to_c90 = sqrt(fmax(out * out - to_c0 * to_c0, 0.0));
    if (l->sphere)
        return 0.25 * LUM_PI_D * along * wide;
    if (l->round)
        return 0.25 * LUM_PI_D * along * wide * down + high * sqrt(along * wide) * out;
    return along * wide * down + high * (along * to_c90 + wide * to_c0);
}

/* Sum of I^2 / (A r^2 p^2), r in H. The eye is at the origin and looks along -z. EULUMDAT's C 0, which lies across the
 * length, faces the eye crosswise, its C 90 endwise. */
static double glare_sum(const struct lum_ugr_luminaire *l, const struct lum_ugr_room *room, enum lum_ugr_view view,
                        double spacing)
{
    struct lum_vec3 c0 = view == LUM_UGR_CROSSWISE ? lum_v3(1, 0, 0) : lum_v3(0, 0, 1);
    struct hung h = hang(l->web, c0);
    double sum = 0.0;
    uint32_t nx = (uint32_t)lround(room->x_h / spacing), ny = (uint32_t)lround(room->y_h / spacing);
    for (uint32_t i = 0; i < nx * ny; i++) {
        double aside = (i % nx + 0.5) * spacing - 0.5 * room->x_h, ahead = (i / nx + 0.5) * spacing;
        double p = lum_position_index_table(fabs(aside) / ahead, 1.0 / ahead);
        double r2 = aside * aside + ahead * ahead + 1.0, r = sqrt(r2);
        struct lum_vec3 d = lum_v3((float)(-aside / r), (float)(-1.0 / r), (float)(ahead / r));
        double area = area_towards(l, c0, d), cd = intensity(&h, d);
        if (isfinite(p) && area > 0.0)
            sum += cd * cd / (area * r2 * p * p);
    }
    return sum;
}

void lum_ugr_room_of(const struct lum_ugr_luminaire *l, uint32_t index, double spacing, struct lum_ugr_cells *ret)
{
    const struct lum_ugr_room *room = &lum_ugr_rooms[index];
    double walls_h2 = 2.0 * (room->x_h + room->y_h), n = room->x_h * room->y_h / (spacing * spacing);
    struct rings rings;
    measure_rings(l->web, &rings);
    double on_floor = floor_lm(&rings, room, spacing);
    ret->floor_share = on_floor / (rings.down_lm + rings.up_lm);
    for (uint32_t k = 0; k < LUM_UGR_PAINTS; k++) {
        struct lum_ugr_transfer t = lum_ugr_transfer_of(room, &lum_ugr_paints[k]);
        ret->walls_lx_h2[k] =
            n / walls_h2 *
            (on_floor * t.from_floor + (rings.down_lm - on_floor) * t.from_walls + rings.up_lm * t.from_ceiling);
    }
    for (int view = 0; view < LUM_UGR_VIEWS; view++) {
        double glare = glare_sum(l, room, (enum lum_ugr_view)view, spacing);
        for (uint32_t k = 0; k < LUM_UGR_PAINTS; k++) {
            double background = ret->walls_lx_h2[k] / LUM_PI_D;
            ret->ugr[view][k] = glare > 0.0 && background > 0.0 ? 8.0 * log10(0.25 / background * glare) : (double)NAN;
        }
    }
}
