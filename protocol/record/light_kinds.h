/* Every kind of light there is, and which fields of a light's record each has. A kind is a row here, in the order in
 * which they are told; how it shines is its struct lum_light_kind_row in the renderer, which this folder does not know:
 * server/world/light_kinds.h brings the two together. */
#ifndef LUM_PROTOCOL_RECORD_LIGHT_KINDS_H
#define LUM_PROTOCOL_RECORD_LIGHT_KINDS_H

enum lum_light_has {
    LUM_HAS_DIRECTION = 1 << 0,
    LUM_HAS_EDGES = 1 << 1,    /* u, v */
    LUM_HAS_RADIUS = 1 << 2,   /* of a round shape */
    LUM_HAS_DIAMETER = 1 << 3, /* an angle */
    LUM_HAS_CONES = 1 << 4,
    LUM_HAS_WEB = 1 << 5,
    LUM_HAS_IMAGE = 1 << 6,
    LUM_HAS_SKY = 1 << 7, /* its distribution */
    LUM_HAS_SUN = 1 << 8, /* place and time */
    /* how much light: one of those that it has, and none where it has an amount of its own */
    LUM_HAS_FLUX = 1 << 9,
    LUM_HAS_INTENSITY = 1 << 10,
    LUM_HAS_LUMINANCE = 1 << 11,
    LUM_HAS_ILLUMINANCE = 1 << 12,
    LUM_HAS_AMOUNT = 1 << 13,
    LUM_HAS_BODY = 1 << 14, /* can be seen */
};
#define LUM_HAS_OF_POINT (LUM_HAS_FLUX | LUM_HAS_INTENSITY)
#define LUM_HAS_OF_AREA (LUM_HAS_FLUX | LUM_HAS_LUMINANCE | LUM_HAS_BODY)
#define LUM_HAS_OF_WEB (LUM_HAS_WEB | LUM_HAS_FLUX | LUM_HAS_AMOUNT | LUM_HAS_BODY)
#define LUM_HAS_OF_SKY (LUM_HAS_SKY | LUM_HAS_LUMINANCE | LUM_HAS_ILLUMINANCE | LUM_HAS_AMOUNT | LUM_HAS_BODY)
#define LUM_HAS_OF_SUN (LUM_HAS_SUN | LUM_HAS_DIAMETER | LUM_HAS_ILLUMINANCE | LUM_HAS_AMOUNT)

/* X(name, what its record has) */
#define LUM_LIGHT_KINDS(X)                                                                                             \
    X(point, LUM_HAS_OF_POINT)                                                                                         \
    X(spot, LUM_HAS_OF_POINT | LUM_HAS_DIRECTION | LUM_HAS_CONES)                                                      \
    X(ies, LUM_HAS_OF_WEB | LUM_HAS_DIRECTION)                                                                         \
    X(directional, LUM_HAS_DIRECTION | LUM_HAS_DIAMETER | LUM_HAS_ILLUMINANCE)                                         \
    X(quad, LUM_HAS_OF_AREA | LUM_HAS_EDGES)                                                                           \
    X(disc, LUM_HAS_OF_AREA | LUM_HAS_DIRECTION | LUM_HAS_RADIUS)                                                      \
    X(sphere, LUM_HAS_OF_AREA | LUM_HAS_RADIUS)                                                                        \
    X(environment, LUM_HAS_IMAGE | LUM_HAS_LUMINANCE | LUM_HAS_BODY)                                                   \
    X(sky, LUM_HAS_OF_SKY)                                                                                             \
    X(sun, LUM_HAS_OF_SUN)

/* What a kind has, of enum lum_light_has; 0: there is none of this name. */
unsigned lum_light_kind_has(const char *kind);

#endif
