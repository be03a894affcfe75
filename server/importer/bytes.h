/* A piece of memory with its length. */
#ifndef LUM_SERVER_IMPORTER_BYTES_H
#define LUM_SERVER_IMPORTER_BYTES_H

#include <stddef.h>
#include <stdint.h>

struct lum_bytes {
    uint8_t *data;
    size_t n;
};

#endif
