/* What records hold in bulk, and how it comes from an importer. */
#ifndef LUM_PROTOCOL_RECORD_BULK_H
#define LUM_PROTOCOL_RECORD_BULK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Arrays in bulk are shared: each record that has one holds a reference, and nobody writes to one that is shared. */
void *lum_bulk_create(size_t n_bytes); /* zeros, one reference; NULL: memory is short */
void *lum_bulk_ref(void *bytes);       /* accepts NULL */
void lum_bulk_unref(void *bytes);      /* accepts NULL */
/* The same in two steps, for what the array itself refers to. True: it was the last reference; then free it. */
bool lum_bulk_leave(void *bytes); /* accepts NULL */
void lum_bulk_free(void *bytes);
size_t lum_bulk_bytes(const void *bytes); /* accepts NULL */

/* Numbers in bulk. From a JSON array, or from a binary blob of an importer. */
struct lum_floats {
    double *f64; /* a reference: positions from JSON keep double precision */
    float *f32;  /* a reference: else this; exactly one is set when n > 0 */
    size_t n;
};
struct lum_indices {
    uint32_t *u32; /* a reference */
    size_t n;
};

/* Bulk arrays that an importer sends, and the journal keeps, beside the JSON: {"positions":{"blob":3}}, little-endian
 * 32-bit numbers or pixels; {"blob64":3}: doubles. */
#define LUM_BLOBS_MAX 8u /* of one record: a mesh has six arrays */
struct lum_blob {
    const uint8_t *bytes;
    size_t n_bytes;
    void *bulk; /* the bytes are such an array, and who reads them shares it; NULL: they are copied */
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
