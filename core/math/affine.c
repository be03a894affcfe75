#include "core/math/affine.h"

struct lum_affined lum_affined_identity(void)
{
    return (struct lum_affined){{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
}

struct lum_affined lum_affined_mul(const struct lum_affined *a, const struct lum_affined *b)
{
    struct lum_affined r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            r.m[i][j] = a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j] + a->m[i][2] * b->m[2][j] +
                        (j == 3 ? a->m[i][3] : 0.0);
    return r;
}

struct lum_vec3d lum_affined_point(const struct lum_affined *a, struct lum_vec3d p)
{
    return (struct lum_vec3d){
        a->m[0][0] * p.x + a->m[0][1] * p.y + a->m[0][2] * p.z + a->m[0][3],
        a->m[1][0] * p.x + a->m[1][1] * p.y + a->m[1][2] * p.z + a->m[1][3],
        a->m[2][0] * p.x + a->m[2][1] * p.y + a->m[2][2] * p.z + a->m[2][3],
    };
}

bool lum_affined_invert(const struct lum_affined *a, struct lum_affined *ret_inverse)
{
    const double(*m)[4] = a->m;
    double c00 = m[1][1] * m[2][2] - m[1][2] * m[2][1];
    double c01 = m[1][2] * m[2][0] - m[1][0] * m[2][2];
    double c02 = m[1][0] * m[2][1] - m[1][1] * m[2][0];
    double det = m[0][0] * c00 + m[0][1] * c01 + m[0][2] * c02;
    if (det == 0.0 || !isfinite(det) || !isfinite(1.0 / det))
        return false;
    double s = 1.0 / det;
    struct lum_affined r = {{
        {c00 * s, (m[0][2] * m[2][1] - m[0][1] * m[2][2]) * s, (m[0][1] * m[1][2] - m[0][2] * m[1][1]) * s, 0},
        {c01 * s, (m[0][0] * m[2][2] - m[0][2] * m[2][0]) * s, (m[0][2] * m[1][0] - m[0][0] * m[1][2]) * s, 0},
        {c02 * s, (m[0][1] * m[2][0] - m[0][0] * m[2][1]) * s, (m[0][0] * m[1][1] - m[0][1] * m[1][0]) * s, 0},
    }};
    for (int i = 0; i < 3; i++) {
        r.m[i][3] = -(r.m[i][0] * m[0][3] + r.m[i][1] * m[1][3] + r.m[i][2] * m[2][3]);
        if (!isfinite(r.m[i][0]) || !isfinite(r.m[i][1]) || !isfinite(r.m[i][2]) || !isfinite(r.m[i][3]))
            return false;
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double v = m[i][0] * r.m[0][j] + m[i][1] * r.m[1][j] + m[i][2] * r.m[2][j];
            if (!(fabs(v - (i == j ? 1.0 : 0.0)) < 1e-6))
                return false;
        }
    *ret_inverse = r;
    return true;
}

struct lum_affine lum_affine_from_double(const struct lum_affined *a)
{
    struct lum_affine r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            r.m[i][j] = (float)a->m[i][j];
    return r;
}
