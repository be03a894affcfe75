/* What the daemon and lumend-import, a program of its own, say to each other.
 *
 * Output stream of the child, on fd 1: chunks of { u32 kind, u32 n_bytes } little-endian and n_bytes:
 *   1 op        JSON text of one {"op":"add",...}; bulk arrays as {"blob":k}: k counts the blobs since the last op
 *   2 blob      raw little-endian bytes of the op that follows
 *   3 progress  {"stage":"read","fraction":0.25}
 *   4 warning   text for people
 *   5 done      empty; without it the import failed
 *   6 error     {"code":"unsupported","text":"..."}
 *   7 settings  an object: fields of the record "render", which a scene of this file alone has
 *
 * The child opens no file: over a socket on fd 3 it asks for one below the asset's directory and gets an open
 * descriptor. Request (one SEQPACKET datagram): u8 flags (1: any letter case), then the name, '/' separated. Reply:
 * struct lum_file_reply, with the descriptor attached when status is LUM_OK. */
#ifndef LUM_SERVER_IMPORT_WIRE_H
#define LUM_SERVER_IMPORT_WIRE_H

#include <stdint.h>

enum lum_import_chunk {
    LUM_CHUNK_OP = 1,
    LUM_CHUNK_BLOB,
    LUM_CHUNK_PROGRESS,
    LUM_CHUNK_WARNING,
    LUM_CHUNK_DONE,
    LUM_CHUNK_ERROR,
    LUM_CHUNK_SETTINGS
};

#define LUM_FILE_ANY_CASE 1u      /* "Wood.PNG" serves for "wood.png": files come from where that is the same */
#define LUM_FILE_NAME_BYTES 1024u /* a path below the folder: four times LUM_LIMIT_ASSET_BYTES, for %20 and "../" */

struct lum_file_reply {
    uint32_t status; /* enum lum_status: OK, NOT_FOUND, INVALID (outside, or no regular file), LIMIT, IO */
    uint32_t reserved;
    uint64_t n_bytes;
};

#endif
