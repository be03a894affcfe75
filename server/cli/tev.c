#define _GNU_SOURCE /* SOCK_CLOEXEC */
#include "server/cli/tev.h"

#include <arpa/inet.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

/* Kinds of packets, as tev numbers them; UPDATE is the third form of that. */
enum { CLOSE_IMAGE = 2, CREATE_IMAGE = 4, UPDATE_IMAGE = 6 };

#define BAND_BYTES ((size_t)4 << 20) /* of pixels in one packet: few system calls, and little memory */
#define LENGTH_BYTES 4
#define PATIENCE_S 5
#define PATIENCE_TEXT "5 s"

struct lum_tev {
    int fd;
    char host[64];
    uint16_t port;
    uint8_t *packet;
    size_t size, n;
};

/* What errno says of a connection whose patience (SO_SNDTIMEO) may have ended. */
static const char *why(void)
{
    return errno == EAGAIN || errno == EINPROGRESS ? "no answer within " PATIENCE_TEXT : strerror(errno);
}

enum lum_status lum_tev_connect(const struct lum_address *a, struct lum_tev **ret, struct lum_error *err)
{
    const char *host = lum_address_local(a);
    struct sockaddr_in v4 = {.sin_family = AF_INET, .sin_port = htons(a->port)};
    struct sockaddr_in6 v6 = {.sin6_family = AF_INET6, .sin6_port = htons(a->port)};
    inet_pton(AF_INET, host, &v4.sin_addr);
    inet_pton(AF_INET6, host, &v6.sin6_addr);
    const struct timeval patience = {.tv_sec = PATIENCE_S};
    struct lum_tev *tev = calloc(1, sizeof *tev);
    if (!tev)
        return lum_fail(err, LUM_ERR_NOMEM, "tev", "no memory for a connection to tev");
    memcpy(tev->host, a->host, sizeof tev->host);
    tev->port = a->port;
    tev->fd = socket(a->ipv6 ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    bool there = tev->fd >= 0 && setsockopt(tev->fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience) == 0 &&
                 (a->ipv6 ? connect(tev->fd, (struct sockaddr *)&v6, sizeof v6)
                          : connect(tev->fd, (struct sockaddr *)&v4, sizeof v4)) == 0;
    if (there) {
        *ret = tev;
        return LUM_OK;
    }
    enum lum_status st = lum_fail(err, LUM_ERR_IO, "tev", "no tev at %s port %u: %s", a->host, a->port, why());
    lum_tev_close(tev);
    return st;
}

void lum_tev_close(struct lum_tev *tev)
{
    if (!tev)
        return;
    if (tev->fd >= 0)
        close(tev->fd);
    free(tev->packet);
    free(tev);
}

/* ---- a packet ---- */

static void put(struct lum_tev *tev, const void *bytes, size_t n)
{
    memcpy(tev->packet + tev->n, bytes, n);
    tev->n += n;
}

static void put_text(struct lum_tev *tev, const char *text)
{
    put(tev, text, strlen(text) + 1);
}

static void put_int(struct lum_tev *tev, uint32_t v)
{
    put(tev, &v, sizeof v);
}

static void put_long(struct lum_tev *tev, uint64_t v)
{
    put(tev, &v, sizeof v);
}

static void begin(struct lum_tev *tev, int kind)
{
    tev->n = LENGTH_BYTES; /* at its end */
    put(tev, &(uint8_t){(uint8_t)kind}, 1);
}

static enum lum_status send_packet(struct lum_tev *tev, struct lum_error *err)
{
    uint32_t length = (uint32_t)tev->n;
    memcpy(tev->packet, &length, sizeof length);
    for (size_t sent = 0; sent < tev->n;) {
        ssize_t n = send(tev->fd, tev->packet + sent, tev->n - sent, MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return lum_fail(err, LUM_ERR_IO, "tev", "tev at %s port %u takes no more: %s", tev->host, tev->port, why());
        sent += (size_t)n;
    }
    return LUM_OK;
}

/* ---- a picture ---- */

/* Of all that a packet has but pixels, and a little more. */
static size_t head_bytes(const struct lum_tev_image *image)
{
    size_t n = 64 + strlen(image->name);
    for (uint32_t i = 0; i < image->n_channels; i++)
        n += strlen(image->channels[i].name) + 1 + 2 * sizeof(uint64_t);
    return n;
}

static enum lum_status reserve(struct lum_tev *tev, size_t n, struct lum_error *err)
{
    if (n <= tev->size)
        return LUM_OK;
    uint8_t *more = realloc(tev->packet, n);
    if (!more)
        return lum_fail(err, LUM_ERR_NOMEM, "tev", "no memory for a packet of %zu bytes to tev", n);
    tev->packet = more;
    tev->size = n;
    return LUM_OK;
}

static void put_channels(struct lum_tev *tev, const struct lum_tev_image *image)
{
    put_int(tev, image->n_channels);
    for (uint32_t i = 0; i < image->n_channels; i++)
        put_text(tev, image->channels[i].name);
}

static enum lum_status begin_image(struct lum_tev *tev, const struct lum_tev_image *image, struct lum_error *err)
{
    begin(tev, CLOSE_IMAGE); /* of an earlier run; of none it is nothing */
    put_text(tev, image->name);
    enum lum_status st = send_packet(tev, err);
    begin(tev, CREATE_IMAGE);
    put(tev, &(uint8_t){1}, 1); /* and shows it */
    put_text(tev, image->name);
    put_int(tev, image->w);
    put_int(tev, image->h);
    put_channels(tev, image);
    return st ? st : send_packet(tev, err);
}

/* Pixels of all channels side by side: of channel i the first float is i, and the next n_channels further. */
static void put_pixels(struct lum_tev *tev, const struct lum_tev_image *image, uint32_t y, uint32_t rows)
{
    uint32_t n = image->n_channels;
    uint8_t *to = tev->packet + tev->n; /* of no alignment */
    for (uint32_t i = 0; i < n; i++) {
        const struct lum_exr_channel *c = &image->channels[i];
        for (size_t k = 0; k < (size_t)rows * image->w; k++)
            memcpy(to + sizeof(float) * (n * k + i), c->pixels + c->stride * ((size_t)y * image->w + k), sizeof(float));
    }
    tev->n += sizeof(float) * n * rows * image->w;
}

static enum lum_status send_rows(struct lum_tev *tev, const struct lum_tev_image *image, uint32_t y, uint32_t rows,
                                 struct lum_error *err)
{
    begin(tev, UPDATE_IMAGE);
    put(tev, &(uint8_t){0}, 1);
    put_text(tev, image->name);
    put_channels(tev, image);
    put_int(tev, 0);
    put_int(tev, y);
    put_int(tev, image->w);
    put_int(tev, rows);
    for (uint32_t i = 0; i < image->n_channels; i++)
        put_long(tev, i);
    for (uint32_t i = 0; i < image->n_channels; i++)
        put_long(tev, image->n_channels);
    put_pixels(tev, image, y, rows);
    return send_packet(tev, err);
}

enum lum_status lum_tev_show(struct lum_tev *tev, const struct lum_tev_image *image, struct lum_error *err)
{
    size_t row_bytes = sizeof(float) * image->n_channels * image->w;
    uint32_t band = row_bytes < BAND_BYTES ? (uint32_t)(BAND_BYTES / row_bytes) : 1;
    band = band < image->h ? band : image->h;
    enum lum_status st = reserve(tev, head_bytes(image) + band * row_bytes, err);
    if (!st && image->begin)
        st = begin_image(tev, image, err);
    for (uint32_t y = 0; !st && y < image->h; y += band)
        st = send_rows(tev, image, y, band < image->h - y ? band : image->h - y, err);
    return st;
}
