#include "server/stream/video.h"

#include <string.h>

enum { MOST_THREADS = 2 }; /* of one encoder: more wait for each other in pictures of this size */

bool lum_video_fits(uint32_t w, uint32_t h)
{
    return (uint64_t)w * h <= LUM_LIMIT_VIDEO_PIXELS;
}

void lum_video_close(struct lum_video *v)
{
    if (!v->vp9)
        return;
    struct lum_video **at = &v->room->first;
    while (*at != v)
        at = &(*at)->next;
    *at = v->next;
    v->room->n--;
    v->room->n_pixels -= (uint64_t)v->w * v->h;
    lum_vp9_destroy(v->vp9);
    *v = (struct lum_video){0};
}

static struct lum_video *longest_unused(const struct lum_video_room *room)
{
    struct lum_video *found = room->first;
    for (struct lum_video *v = room->first; v; v = v->next)
        if (v->used_ns < found->used_ns)
            found = v;
    return found;
}

int64_t lum_video_close_unused(struct lum_video_room *room, int64_t now_ns)
{
    while (room->n > 0) {
        struct lum_video *v = longest_unused(room);
        int64_t wait_ns = v->used_ns + LUM_VIDEO_KEPT_NS - now_ns;
        if (wait_ns > 0)
            return wait_ns;
        lum_video_close(v);
    }
    return INT64_MAX;
}

/* Views that all move keep what they have: an encoder that changes hands with every picture makes key chunks alone. */
static bool make_room(struct lum_video_room *room, uint64_t n_pixels)
{
    int64_t before_ns = lum_clock_ns() - LUM_VIDEO_UNUSED_NS;
    while (room->n > 0 && (room->n >= LUM_LIMIT_VIDEOS || room->n_pixels + n_pixels > LUM_LIMIT_VIDEO_PIXELS)) {
        struct lum_video *v = longest_unused(room);
        if (v->used_ns > before_ns)
            return false;
        lum_video_close(v);
    }
    return true;
}

static bool open_video(struct lum_video *v, struct lum_encoder *e, uint32_t w, uint32_t h)
{
    struct lum_video_room *room = lum_encoder_videos(e);
    uint32_t n_threads = lum_encoder_threads(e);
    if (!lum_video_fits(w, h) || !make_room(room, (uint64_t)w * h))
        return false;
    struct lum_vp9 *vp9 = lum_vp9_create(w, h, n_threads < MOST_THREADS ? n_threads : MOST_THREADS);
    if (!vp9)
        return false;
    *v = (struct lum_video){.vp9 = vp9, .w = w, .h = h, .room = room, .next = room->first};
    room->first = v;
    room->n++;
    room->n_pixels += (uint64_t)w * h;
    return true;
}

static struct lum_encoded_tile *blob_of(const struct lum_vp9_frame *f, const struct lum_picture *p)
{
    struct lum_encoded_tile *blob = lum_encoded_tile_create((uint32_t)f->n);
    if (!blob)
        return NULL;
    memcpy(blob->bytes, f->bytes, f->n);
    blob->header = p->header;
    struct lum_frame_header *h = &blob->header;
    h->kind = LUM_FRAME_TILE;
    h->codec = LUM_CODEC_VP9;
    h->flags |= f->key ? LUM_FRAME_KEY : 0u;
    h->quality = f->quality;
    h->downscale = 0;
    h->x = h->y = 0;
    h->w = h->full_w = (uint16_t)p->film->w;
    h->h = h->full_h = (uint16_t)p->film->h;
    h->payload_len = blob->n_bytes;
    return blob;
}

enum lum_status lum_video_run(struct lum_video *v, struct lum_encoder *e, const struct lum_picture *picture,
                              const struct lum_video_want *want, struct lum_encoded_tile **ret_tile,
                              struct lum_error *err)
{
    const uint32_t w = picture->film->w, h = picture->film->h;
    struct lum_encoded_tile *blob = NULL;
    if (v->vp9 && (v->w != w || v->h != h))
        lum_video_close(v);
    if (v->vp9 || open_video(v, e, w, h)) {
        v->used_ns = lum_clock_ns();
        lum_encoder_draw(e, picture, v->vp9);
        const struct lum_vp9_frame f = lum_vp9_encode(v->vp9, want->n_bytes, want->key);
        blob = f.n > 0 ? blob_of(&f, picture) : NULL;
    }
    if (!blob) { /* a chunk that was not sent is missing to those after it */
        lum_video_close(v);
        return lum_fail(err, LUM_ERR_NOMEM, "", "no memory for a video of %u x %u", w, h);
    }
    *ret_tile = blob;
    return LUM_OK;
}
