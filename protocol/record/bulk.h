/* What records hold in bulk, and how it comes from an importer. */
#ifndef LUM_PROTOCOL_RECORD_BULK_H
#define LUM_PROTOCOL_RECORD_BULK_H

#include <stddef.h>
#include <stdint.h>

/* Numbers in bulk, owned. From a JSON array, or from a binary blob of an importer. */
struct lum_floats {
    double *f64; /* positions from JSON keep double precision */
    float *f32;  /* else this; exactly one is set when n > 0 */
    size_t n;
};
struct lum_indices {
    uint32_t *u32;
    size_t n;
};

/* Bulk arrays that an importer sends, and the journal keeps, beside the JSON: {"positions":{"blob":3}}, little-endian
 * 32-bit numbers or pixels; {"blob64":3}: doubles. */
#define LUM_BLOBS_MAX 8u /* of one record: a mesh has five arrays */
struct lum_blob {
    const uint8_t *bytes;
    size_t n_bytes;
};
struct lum_blobs {
    const struct lum_blob *blobs;
    size_t n;
};
/* Those of one record, on their way out: borrowed from it. */
struct lum_blobs_out {
    struct lum_blob blobs[LUM_BLOBS_MAX];
    size_t n;
};

#endif
