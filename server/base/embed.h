/* Files compiled into the binary (built-in scenes, the web client), so that lumend is one file to deploy. */
#ifndef LUM_SERVER_BASE_EMBED_H
#define LUM_SERVER_BASE_EMBED_H

#include <stddef.h>

struct lum_embedded {
    const char *key;            /* NULL ends the table */
    const unsigned char *bytes; /* n bytes and a terminating 0 */
    size_t n;
};
extern const struct lum_embedded lum_embedded_scenes[];  /* key: "cornell.jsonl" */
extern const struct lum_embedded lum_embedded_replays[]; /* key: "cornell-moves.jsonl" */
extern const struct lum_embedded lum_embedded_web[];     /* key: "index.html", "assets/app-1a2b.js" ... */

#endif
