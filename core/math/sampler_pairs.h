/* Whose pairs of a sampler are whose (lum_sampler_2d). Who draws for the same pixel and sample as another takes pairs
 * of its own, or the noise of both agrees: a new effect begins at LUM_PAIRS_OF_EFFECT. */
#ifndef LUM_CORE_MATH_SAMPLER_PAIRS_H
#define LUM_CORE_MATH_SAMPLER_PAIRS_H

/* Path tracing: the pixel, then four for each vertex; where every light is sampled, one for each; media. Light paths
 * (core/vpl) draw for a light, and no pixel: they count from 0, too. */
#define LUM_PAIRS_PATH 0x00000000u
#define LUM_PAIRS_PATH_LIGHTS 0x20000000u
#define LUM_PAIRS_PATH_MEDIA 0x40000000u
#define LUM_PAIRS_PATH_COLLIDE 0x60000000u
/* Meters, which draw for a place, and path trace: a lamp's sample. */
#define LUM_PAIRS_METER_LAMP 0x30000000u

/* Frames of deferred methods. */
#define LUM_PAIRS_SPECULAR_FOG 0x20000000u /* two for each medium and light */
#define LUM_PAIRS_AREA_POINTS 0x40000000u  /* for a lamp, not for a pixel: one net for all */
#define LUM_PAIRS_MANY_LIGHTS 0x50000000u
#define LUM_PAIRS_LIGHTS 0x80000000u /* from here up, by a hash of the light's id: direct light, of ais, too */
#define LUM_PAIRS_AIRLIGHT 0xa0000000u
#define LUM_PAIRS_MARCH 0xc0000000u /* fog of ais, by light and step */

/* 2^16 for each effect: from here up to 0x80000000 all that have no line above. */
#define LUM_PAIRS_OF_EFFECT(e) (0x70000000u + ((uint32_t)(e) << 16))

#endif
