/* Materials of every kind, and a surface to try them on. */
#ifndef LUM_TESTS_SUPPORT_MATERIALS_H
#define LUM_TESTS_SUPPORT_MATERIALS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/material/bsdf.h"
#include "core/material/material.h"
#include "core/scene/surface.h"

struct lum_material plain(float roughness);
struct lum_material matte(void);
struct lum_material metal(float roughness);
struct lum_material glass(float roughness, float ior);
/* Stretched by 0.7 along (0.6, 0.8). */
struct lum_material brushed(struct lum_material m);
/* Every branch of the mix. */
struct lum_material variant(int i, float roughness);

enum { N_VARIANTS = 24 };

struct lum_surface surface(bool backface);
struct lum_vec3 direction(double cos_theta, double phi);
bool is_transmitted(const struct lum_bsdf_sample *s);

#endif
