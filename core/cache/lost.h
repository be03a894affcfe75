/* What a record lacks because VPLs are lifted (core/vpl/lifted.h).
 *
 * Where surfaces are nearer to each other than VPLs are, as slats of a blind, a record gets what comes from there from
 * one or two of them or from none: that is noise, however it is bounded. So lifted VPLs say what comes from further
 * away, and of what is near only what they leave; the rest is taken to be about as bright as what the point sees in the
 * mean. With G for the share of its light that lifted VPLs leave out, and E for what they bring, that is
 *   E + G c (E + G c (E + ...)) = E / (1 - c G).
 * No VPL shines on slats alone that happens to be between them; and what a record lacks hangs on no other record and no
 * power, so that it costs no ray when light is dimmed.
 *
 * What is near reflects what comes there, so c is how much that is of it beside what all that the point sees sends: by
 * what the materials of the things say that the record's rays met. In a room of one colour it is 1 however dark that
 * is; dark slats under a sky have their own albedo. Rays are kept as the things that they met, and their colours are
 * looked up when a record is summed, so that paint costs no ray either.
 *
 * G is known twice, and poorly: by the 16 rays that tell how near a record's surroundings are (proximity.h), of which
 * few go where much is lost, and by the rays from VPLs around that face as it does, for a neighbourhood and not for the
 * record. What both agree on is taken: the nearer to 0 of the two, nothing where one says that light is lost and the
 * other that there is too much. The first is of the record alone; the second, times how near its surroundings are
 * beside theirs. */
#ifndef LUM_CORE_CACHE_LOST_H
#define LUM_CORE_CACHE_LOST_H

#include "core/cache/proximity.h"

/* c G above: of irradiance that is E without, E c G / (1 - c G) is lacking. Between -0.3 and 0.7. The snapshot numbers
 * objects as it did when their surroundings were looked at. */
float lum_vpl_lacking(const struct lum_vpl_set *set, const struct lum_receiver *at, const struct lum_around *around,
                      const struct lum_snapshot *snapshot, float lift);

#endif
