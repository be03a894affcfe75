/* Limits: everything a client can grow has a cap here, with the reason. Each is tested one below, at, and one above. */
#ifndef LUM_PROTOCOL_BASE_LIMITS_H
#define LUM_PROTOCOL_BASE_LIMITS_H

#include "protocol/base/network_limits.h"

/* ---- text ---- */
#define LUM_LIMIT_ID_BYTES 64        /* an id is a name for people; [A-Za-z0-9_.:/-] */
#define LUM_LIMIT_IMPORT_ID_BYTES 32 /* of an import: leaves 31 for the names of what it brings, "room/lamp" */
#define LUM_LIMIT_ASSET_BYTES 255    /* one path below the asset root */
#define LUM_LIMIT_PATH_BYTES 95      /* the deepest field path is under 40 */
#define LUM_LIMIT_STRING_BYTES 4096

/* ---- JSON ---- */
#define LUM_LIMIT_MESSAGE_BYTES (8u << 20) /* a mesh edit of 100 k vertices; parsed in 30 to 200 ms */
#define LUM_LIMIT_JSON_DEPTH 32            /* the deepest message is 8 */
#define LUM_LIMIT_JSON_MEMBERS 64u /* of one object: the largest record has 25 fields; keeps duplicate checks cheap */
#define LUM_LIMIT_JSON_NUMBER_BYTES 63      /* digits of one number: the parser's own buffer */
#define LUM_LIMIT_JSON_TOKENS 1200000u      /* numbers and strings of the largest message; cJSON takes 64 B each */
#define LUM_LIMIT_STORED_BYTES (256u << 20) /* a line of a scene file: a mesh of a million vertices */
#define LUM_LIMIT_STORED_TOKENS (16u * LUM_LIMIT_JSON_TOKENS) /* of it */
#define LUM_LIMIT_SCENE_BYTES (1u << 30)                      /* a scene file or journal */
#define LUM_LIMIT_OPS_PER_MESSAGE 4096u

/* ---- scene ---- */
#define LUM_LIMIT_RECORDS 200000u
#define LUM_LIMIT_MOVED (2u * LUM_LIMIT_RECORDS) /* by imports that a transaction sets: all of a scene, twice */
#define LUM_LIMIT_LIGHTS 4096u
#define LUM_LIMIT_MEDIA 8u             /* every ray is cut by every one of them */
#define LUM_LIMIT_SENSORS 64u          /* a plane and an observer in each of 32 rooms */
#define LUM_LIMIT_SENSOR_POINTS 4096u  /* of one: 100 x 100 m by EN 12464-1 are 400 */
#define LUM_LIMIT_DIRECTIONS 64u       /* that an eye looks in */
#define LUM_LIMIT_PATCHES 1024u        /* each channel of two universes */
#define LUM_LIMIT_PRESETS 64u          /* with all lamps that a scene may have, 1.6 M values */
#define LUM_LIMIT_FADE_S 3600.0        /* of a recall: a sunrise of an hour */
#define LUM_LIMIT_VERTICES (64u << 20) /* a mesh: u32 indices times 3 stay below 2^31 */
#define LUM_LIMIT_TRIANGLES (64u << 20)
#define LUM_LIMIT_SEGMENTS 2048u /* built-in shapes: 2048^2 * 2 = 8 M triangles */
#define LUM_LIMIT_IMAGE_SIDE 16384u
#define LUM_LIMIT_IMAGE_TEXELS (1u << 27)     /* half of what a square of that side has: 512 MiB of 8-bit RGBA */
#define LUM_LIMIT_SCENE_TRIANGLES (64u << 20) /* of all meshes: some 12 GiB as they are drawn */
#define LUM_LIMIT_SCENE_TEXELS (1u << 28)     /* of all images: two of the largest */
#define LUM_LIMIT_SCENE_MEMORY (16ull << 30)  /* of all records, as sent and as drawn; or most of the machine's */
#define LUM_LIMIT_WEB_VALUES (1u << 18)       /* intensities of a photometric web: half a degree in all directions */
#define LUM_LIMIT_WEB_FILE_BYTES (16u << 20)  /* text of a photometric file: 64 bytes for each of so many */
#define LUM_LIMIT_COORD_M 1e9             /* metres from the origin: an Earth's orbit of satellites is not a scene */
#define LUM_LIMIT_UNDO 256u               /* transactions kept per user */
#define LUM_LIMIT_UNDO_BYTES (1ull << 29) /* records that transactions of all users may hold on to */
#define LUM_LIMIT_UNDO_USERS 256u         /* users with a history; beyond, the one idle longest loses it */

#define LUM_LIMIT_PAST_STEPS 1024u          /* moments of a scene: a day of steps that take half a minute each */
#define LUM_LIMIT_PAST_BYTES (1ull << 29)   /* records that they hold on to, as LUM_LIMIT_UNDO_BYTES */
#define LUM_LIMIT_MOMENTS 100u              /* that have names, as versions of a project */
#define LUM_LIMIT_MOMENT_NAME_BYTES 120     /* a line of a list */
#define LUM_LIMIT_MOMENTS_SHOWN 8u          /* at once, by views: each has surfaces of its own to trace */
#define LUM_LIMIT_MOMENT_BYTES (1ull << 30) /* that all of them take more than the scene */

/* ---- views ---- */
#define LUM_LIMIT_VIEW_MIN 1u
#define LUM_LIMIT_VIEW_SIDE 4096u        /* as wide as a 4K display; a side fits into the 16 bits of a frame */
#define LUM_LIMIT_VIEW_PIXELS (1u << 23) /* film of 2 halves in double: 48 B a pixel = 400 MiB */
#define LUM_LIMIT_VIEWS_PER_SESSION 8u
#define LUM_LIMIT_VIEWS 64u               /* of all sessions: one each; they take turns */
#define LUM_LIMIT_VIEWS_PIXELS (1u << 25) /* all views together: 1.6 GiB of film */
#define LUM_LIMIT_VIDEOS 16u              /* encoders of video: as many hands over thin lines, while pixels last */
#define LUM_LIMIT_VIDEO_PIXELS (1u << 22) /* of all of them, as they move; 82 B a pixel, and 20 MiB each: 660 MiB */
#define LUM_LIMIT_SPP 65536u
#define LUM_LIMIT_SOLO 16u                  /* names of lamps and groups that a view shows alone */
#define LUM_LIMIT_FALSE_COLOR 1e12          /* lx or cd/m2 of a scale: the sun's disc has 1.6e9 cd/m2 */
#define LUM_LIMIT_VIEW_EV 40.0              /* either way: a thousand times beyond starlight and the sun's disc */
#define LUM_LIMIT_DEPTH 64u                 /* and the default: roulette ends nearly all paths before */
#define LUM_LIMIT_CACHES_BYTES (2ull << 30) /* all irradiance caches of a scene: four at their largest */

/* ---- answers that take their time ---- */
#define LUM_LIMIT_PROBES_WAITING 64u       /* of a session: a work plane of points; a minute of work */
#define LUM_LIMIT_SCENE_GETS_WAITING 4u    /* of a session: each answer is as long as the scene */
#define LUM_LIMIT_TIMELINE_GETS_WAITING 4u /* likewise: of a thousand moments half a megabyte */
#define LUM_LIMIT_ASSETS_WAITING 64u       /* of a session: what a list of files shows at once, and a page more */

/* ---- assets ---- */
#define LUM_LIMIT_ASSETS_LISTED 4096u   /* of one answer: a maker's catalogue, in 1 MiB */
#define LUM_LIMIT_ASSET_ENTRIES 262144u /* looked at for it: some seconds of a slow disk */
#define LUM_LIMIT_ASSET_DEPTH 8u        /* folders in each other; each holds a descriptor */

/* ---- uploads ---- */
#define LUM_LIMIT_UPLOAD_BYTES (512u << 20)          /* of all files that are sent together: a building with textures */
#define LUM_LIMIT_UPLOAD_SESSION_BYTES (2048u << 20) /* announced in a session's life: four of the largest */
#define LUM_LIMIT_UPLOAD_FILES 256u                  /* sent together */
#define LUM_LIMIT_UPLOAD_NAME_BYTES 180              /* leaves room for where it lies: LUM_LIMIT_ASSET_BYTES */
#define LUM_LIMIT_UPLOADS_AT_ONCE 4u                 /* announced, or on their way; one of a session */
#define LUM_LIMIT_UPLOAD_BEGIN_S 60                  /* from the announcement on */
#define LUM_LIMIT_UPLOAD_END_S 900                   /* from the beginning on: the largest by 5 Mbit/s */

/* ---- projects ---- */
#define LUM_LIMIT_PROJECTS 1024u         /* of a server, those in the trash, too: a list of them is 200 KiB */
#define LUM_LIMIT_PROJECT_NAME_BYTES 120 /* a line of a list */
#define LUM_LIMIT_PROJECTS_OPEN 64u      /* as many as there are sessions */
#define LUM_LIMIT_VERSIONS 100u          /* of a project: each takes what its scene takes on disk */
#define LUM_LIMIT_PROJECT_REQUESTS 64u   /* that wait for the disk: one of each session */
#define LUM_LIMIT_PROJECT_REQUESTS_OF 8u /* of these, of one session: a page asks for one at a time */
#define LUM_LIMIT_TRASH_S (30 * 86400)   /* a month: who deleted by mistake was on holiday */

/* ---- imports ---- */
#define LUM_LIMIT_IMPORTS_AT_ONCE 2u
#define LUM_LIMIT_IMPORTS_WAITING 64u /* with those that run: each holds on to its message, and may take minutes */
#define LUM_LIMIT_IMPORT_CPU_S 120    /* a child that never ends holds one of the two places no longer */
#define LUM_LIMIT_IMPORT_MEMORY_BYTES (4ull << 30)         /* the largest file, the most that it sends, and a GiB */
#define LUM_LIMIT_IMPORT_OUTPUT_BYTES (2ull << 30)         /* meshes and images, as the document then holds them */
#define LUM_LIMIT_IMPORT_FILE_BYTES (1ull << 30)           /* one file */
#define LUM_LIMIT_EXPORT_BYTES LUM_LIMIT_IMPORT_FILE_BYTES /* of a glTF file that is written: it can be read again */
#define LUM_LIMIT_DOWNLOADS 16u                            /* such files that wait to be fetched, one of a session */
#define LUM_LIMIT_DOWNLOAD_BEGIN_S 60                      /* from the answer on, as for uploads */
#define LUM_LIMIT_IMPORT_WALL_S 300                        /* a child that waits instead of working */
#define LUM_LIMIT_IMPORT_FILES 4096u                       /* buffers and images beside one asset */
#define LUM_LIMIT_IMPORT_WARNINGS 65u                      /* what the importer sends: 64 and a count */

#endif
