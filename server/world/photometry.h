/* Photometric webs as people are told of them: by scene.get, the request `photometry`, and lumend photometry. */
#ifndef LUM_SERVER_WORLD_PHOTOMETRY_H
#define LUM_SERVER_WORLD_PHOTOMETRY_H

#include "core/light/web_facts.h"
#include "protocol/document/document.h"

struct cJSON;

/* {"flux_lm":..,"rated_lm":..,"watts":..,...}: as in PROTOCOL.md. NULL when memory is short, or the web is none that
 * can be rendered. polar: with the intensities of four half planes. ugr: with the glare of one room, which takes a
 * millisecond: nothing for the lists of a whole scene. */
struct cJSON *lum_photometry_describe(const struct lum_record_web *web, bool polar, bool ugr);
/* UGR of the rooms of catalogues (core/measure/ugr_table.h): "spacing_h", "reflectances" of ceiling, walls and floor,
 * and "rooms": of each its "size_h" and its lists "crosswise" and "endwise", numbers or null. NULL as above; an empty
 * object for a lamp whose file names no opening. */
struct cJSON *lum_photometry_ugr(const struct lum_record_web *web);
/* Adds "photometry" to the add ops of lights that have a web. False when memory is short. ops: a list as scene.get and
 * scene.changed have it. */
bool lum_photometry_describe_lights(const struct lum_document *doc, struct cJSON *ops);

#endif
