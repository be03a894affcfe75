#include "core/metric/lab.h"

#include <math.h>

/* Linear Rec.709 to XYZ, each over that of white, and back; from the chromaticities of IEC 61966-2-1. */
static const float to_xyz[3][3] = {
    {0.433887346f, 0.376224009f, 0.189888645f},
    {0.212639006f, 0.715168679f, 0.072192315f},
    {0.017750040f, 0.109447621f, 0.872802339f},
};
static const float to_rgb[3][3] = {
    {3.080399091f, -1.537383178f, -0.543015913f},
    {-0.921223359f, 1.875967502f, 0.045255857f},
    {0.052873939f, -0.203976959f, 1.151103020f},
};

static void multiply(const float m[3][3], const float v[3], float ret[3])
{
    for (int i = 0; i < 3; i++)
        ret[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

struct lum_lab lum_ycxcz_of(const float rgb[3])
{
    float xyz[3];
    multiply(to_xyz, rgb, xyz);
    return (struct lum_lab){116.0f * xyz[1] - 16.0f, 500.0f * (xyz[0] - xyz[1]), 200.0f * (xyz[1] - xyz[2])};
}

void lum_ycxcz_to_rgb(struct lum_lab c, float ret_rgb[3])
{
    float y = (c.l + 16.0f) / 116.0f;
    multiply(to_rgb, (float[3]){y + c.a / 500.0f, y, y - c.b / 200.0f}, ret_rgb);
}

#define DELTA (6.0f / 29.0f) /* CIE 15: where the line meets the cube root */

/* A cube root, with a straight line for what is dark, and the way back. */
static float compress(float t)
{
    return t > DELTA * DELTA * DELTA ? cbrtf(t) : t / (3.0f * DELTA * DELTA) + 4.0f / 29.0f;
}

static float expand(float f)
{
    return f > DELTA ? f * f * f : 3.0f * DELTA * DELTA * (f - 4.0f / 29.0f);
}

struct lum_lab lum_lab_of(const float rgb[3])
{
    float xyz[3];
    multiply(to_xyz, rgb, xyz);
    float x = compress(xyz[0]), y = compress(xyz[1]), z = compress(xyz[2]);
    return (struct lum_lab){116.0f * y - 16.0f, 500.0f * (x - y), 200.0f * (y - z)};
}

void lum_lab_to_rgb(struct lum_lab c, float ret_rgb[3])
{
    float y = (c.l + 16.0f) / 116.0f;
    multiply(to_rgb, (float[3]){expand(y + c.a / 500.0f), expand(y), expand(y - c.b / 200.0f)}, ret_rgb);
}
