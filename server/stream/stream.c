#include "server/stream/stream.h"

#include <pthread.h>
#include <string.h>

#include "core/base/base.h"
#include "protocol/base/limits.h"
#include "server/stream/line.h"

struct stream_slot {
    struct lum_encoded_tile *newest;  /* of the newest frame; NULL before the first */
    struct lum_encoded_tile *sending; /* taken by the cursor and not sent yet */
    uint64_t sent_version;            /* what the client has; 0: nothing */
};

struct lum_stream {
    struct lum_refs refs;
    uint32_t view_id; /* immutable */
    pthread_mutex_t lock;
    /* guarded by lock */
    struct stream_slot *slots;
    uint32_t n_slots;
    struct lum_frame_header newest_frame, sending_frame; /* frame_seq 0: none */
    uint32_t cursor, n_to_send;                          /* of the frame being sent */
    uint64_t acked;                                      /* the client's greatest acknowledgement; <= newest_frame's */
    uint64_t unacked[LUM_LIMIT_UNACKED_FRAMES];          /* begun frames > acked, oldest first */
    uint32_t n_unacked;
    uint64_t skipped;
    int64_t acked_ns; /* when the newest acknowledgement came */
    struct lum_line line;
};

struct lum_encoded_tile *lum_encoded_tile_create(uint32_t n_bytes)
{
    struct lum_encoded_tile *b = lum_calloc(1, sizeof *b + n_bytes);
    if (!b)
        return NULL;
    atomic_init(&b->refs, 1u);
    b->n_bytes = n_bytes;
    return b;
}

struct lum_encoded_tile *lum_encoded_tile_ref(struct lum_encoded_tile *b)
{
    atomic_fetch_add_explicit(&b->refs, 1u, memory_order_relaxed);
    return b;
}

void lum_encoded_tile_unref(struct lum_encoded_tile *b)
{
    /* release/acquire: every former owner's reads come before the free */
    if (b && atomic_fetch_sub_explicit(&b->refs, 1u, memory_order_acq_rel) == 1u)
        lum_free(b);
}

static void slots_free(struct stream_slot *slots, uint32_t n)
{
    for (uint32_t i = 0; slots && i < n; i++) {
        lum_encoded_tile_unref(slots[i].newest);
        lum_encoded_tile_unref(slots[i].sending);
    }
    lum_free(slots);
}

struct lum_stream *lum_stream_create(uint32_t view_id, uint32_t n_tiles)
{
    struct lum_stream *s = lum_calloc(1, sizeof *s);
    if (!s)
        return NULL;
    s->slots = lum_calloc(n_tiles, sizeof *s->slots);
    if (!s->slots || pthread_mutex_init(&s->lock, NULL)) {
        lum_free(s->slots);
        lum_free(s);
        return NULL;
    }
    lum_refs_init(&s->refs);
    s->view_id = view_id;
    s->n_slots = n_tiles;
    return s;
}

struct lum_stream *lum_stream_ref(struct lum_stream *s)
{
    lum_refs_get(&s->refs);
    return s;
}

void lum_stream_unref(struct lum_stream *s)
{
    if (!s || !lum_refs_put(&s->refs))
        return;
    slots_free(s->slots, s->n_slots);
    pthread_mutex_destroy(&s->lock);
    lum_free(s);
}

uint32_t lum_stream_view_id(const struct lum_stream *s)
{
    return s->view_id;
}

static bool has_unbegun_locked(const struct lum_stream *s)
{
    return s->newest_frame.frame_seq > s->sending_frame.frame_seq;
}

bool lum_stream_wants_frame(struct lum_stream *s)
{
    pthread_mutex_lock(&s->lock);
    bool wants = s->n_to_send == 0 && !has_unbegun_locked(s) && s->n_unacked < LUM_LIMIT_UNACKED_FRAMES;
    pthread_mutex_unlock(&s->lock);
    return wants;
}

static bool publish_locked(struct lum_stream *s, uint64_t frame_seq, struct lum_encoded_tile **tiles)
{
    uint32_t first = 0;
    while (first < s->n_slots && !tiles[first])
        first++;
    if (first == s->n_slots || frame_seq <= s->newest_frame.frame_seq)
        return false;
    if (has_unbegun_locked(s))
        s->skipped++;
    s->newest_frame = tiles[first]->header;
    s->newest_frame.frame_seq = frame_seq;
    for (uint32_t i = first; i < s->n_slots; i++) {
        if (!tiles[i])
            continue;
        struct lum_encoded_tile *old = s->slots[i].newest;
        s->slots[i].newest = tiles[i];
        tiles[i] = old; /* released by the caller, outside the lock */
    }
    return true;
}

bool lum_stream_publish(struct lum_stream *s, uint64_t frame_seq, struct lum_encoded_tile **tiles)
{
    pthread_mutex_lock(&s->lock);
    bool ok = publish_locked(s, frame_seq, tiles);
    pthread_mutex_unlock(&s->lock);
    /* Only this thread resizes, so n_slots stands still. */
    for (uint32_t i = 0; i < s->n_slots; i++)
        lum_encoded_tile_unref(tiles[i]);
    return ok;
}

bool lum_stream_resize(struct lum_stream *s, uint32_t n_tiles)
{
    struct stream_slot *slots = lum_calloc(n_tiles, sizeof *slots);
    if (!slots)
        return false;
    pthread_mutex_lock(&s->lock);
    struct stream_slot *old = s->slots;
    uint32_t n_old = s->n_slots;
    s->slots = slots;
    s->n_slots = n_tiles;
    /* A client that acknowledges last tiles never does so for a frame cut off: its credit comes back here. */
    if (s->n_to_send && s->sending_frame.frame_seq > s->acked) {
        s->n_unacked--;
        lum_line_cut(&s->line);
    }
    s->n_to_send = 0;
    if (has_unbegun_locked(s))
        s->skipped++;
    s->sending_frame.frame_seq = s->newest_frame.frame_seq;
    pthread_mutex_unlock(&s->lock);
    slots_free(old, n_old);
    return true;
}

/* Takes the newest frame: every tile the client does not have in its newest version. */
static void begin_frame_locked(struct lum_stream *s)
{
    s->sending_frame = s->newest_frame;
    s->cursor = 0;
    for (uint32_t i = 0; i < s->n_slots; i++) {
        struct stream_slot *slot = &s->slots[i];
        if (slot->newest && slot->newest->header.frame_seq > slot->sent_version) {
            slot->sending = lum_encoded_tile_ref(slot->newest);
            s->n_to_send++;
        }
    }
    if (s->sending_frame.frame_seq > s->acked) {
        s->unacked[s->n_unacked++] = s->sending_frame.frame_seq;
        lum_line_begin(&s->line, s->sending_frame.frame_seq, lum_clock_ns());
    }
}

static bool can_send_locked(const struct lum_stream *s)
{
    return s->n_to_send > 0 || (has_unbegun_locked(s) && s->n_unacked < LUM_LIMIT_UNACKED_FRAMES);
}

static void next_locked(struct lum_stream *s, struct lum_stream_tile *ret_tile)
{
    if (s->n_to_send == 0)
        begin_frame_locked(s);
    while (!s->slots[s->cursor].sending)
        s->cursor++;
    struct stream_slot *slot = &s->slots[s->cursor++];
    struct lum_frame_header header = slot->sending->header;
    const struct lum_frame_header *frame = &s->sending_frame;
    header.frame_seq = frame->frame_seq;
    header.scene_rev = frame->scene_rev;
    header.camera_seq = frame->camera_seq;
    header.server_us = frame->server_us;
    header.error = frame->error;
    header.spp = frame->spp;
    header.flags &= ~(uint32_t)(LUM_FRAME_LAST_TILE | LUM_FRAME_CONVERGED);
    header.flags |= frame->flags & LUM_FRAME_CONVERGED;
    if (--s->n_to_send == 0)
        header.flags |= LUM_FRAME_LAST_TILE;
    if (frame->frame_seq > s->acked)
        lum_line_add(&s->line, LUM_FRAME_HEADER_BYTES + slot->sending->n_bytes, s->n_to_send == 0);
    slot->sent_version = slot->sending->header.frame_seq;
    ret_tile->blob = slot->sending;
    ret_tile->header = header;
    slot->sending = NULL;
}

bool lum_stream_next(struct lum_stream *s, struct lum_stream_tile *ret_tile)
{
    pthread_mutex_lock(&s->lock);
    bool ok = can_send_locked(s);
    if (ok)
        next_locked(s, ret_tile);
    pthread_mutex_unlock(&s->lock);
    return ok;
}

bool lum_stream_pending(struct lum_stream *s)
{
    pthread_mutex_lock(&s->lock);
    bool pending = can_send_locked(s);
    pthread_mutex_unlock(&s->lock);
    return pending;
}

bool lum_stream_ack(struct lum_stream *s, uint64_t frame_seq, int64_t held_ns)
{
    pthread_mutex_lock(&s->lock);
    bool is_new = frame_seq > s->acked && frame_seq <= s->newest_frame.frame_seq;
    if (is_new) {
        uint32_t n = 0;
        while (n < s->n_unacked && s->unacked[n] <= frame_seq)
            n++;
        s->n_unacked -= n;
        memmove(s->unacked, s->unacked + n, s->n_unacked * sizeof s->unacked[0]);
        s->acked = frame_seq;
        s->acked_ns = lum_clock_ns();
        lum_line_answer(&s->line, frame_seq, held_ns, s->acked_ns);
    }
    pthread_mutex_unlock(&s->lock);
    return is_new;
}

bool lum_stream_is_idle(struct lum_stream *s, int64_t *ret_since_ns)
{
    pthread_mutex_lock(&s->lock);
    bool idle = s->n_to_send == 0 && !has_unbegun_locked(s) && s->n_unacked == 0;
    *ret_since_ns = s->acked_ns;
    pthread_mutex_unlock(&s->lock);
    return idle;
}

double lum_stream_owed_s(struct lum_stream *s)
{
    pthread_mutex_lock(&s->lock);
    double owed_s = lum_line_owed_s(&s->line);
    pthread_mutex_unlock(&s->lock);
    return owed_s;
}

double lum_stream_line(struct lum_stream *s)
{
    pthread_mutex_lock(&s->lock);
    double bytes_s = s->line.bytes_s;
    pthread_mutex_unlock(&s->lock);
    return bytes_s;
}

uint64_t lum_stream_skipped(struct lum_stream *s)
{
    pthread_mutex_lock(&s->lock);
    uint64_t n = s->skipped;
    pthread_mutex_unlock(&s->lock);
    return n;
}
