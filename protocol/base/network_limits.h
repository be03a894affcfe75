/* Limits of connections and sessions, and of what they send and are sent. Part of limits.h: include that. */
#ifndef LUM_PROTOCOL_BASE_NETWORK_LIMITS_H
#define LUM_PROTOCOL_BASE_NETWORK_LIMITS_H

#define LUM_LIMIT_SESSIONS 64u           /* that said hello */
#define LUM_LIMIT_CONNECTIONS 256u       /* TCP: a browser opens six for the page beside its session */
#define LUM_LIMIT_CONNECTIONS_PER_IP 64u /* an IPv6 /64 is one. A proxy in front is one */
/* Handshakes of TLS: each takes some 1.5 ms of the net thread, so that all take a tenth of it at most */
#define LUM_LIMIT_HANDSHAKES_PER_S 64u     /* of all; beyond what follows */
#define LUM_LIMIT_HANDSHAKES_BURST 512u    /* of all at once: everybody comes back after a restart */
#define LUM_LIMIT_HANDSHAKES_IP_PER_S 4u   /* of one address, or one /64 */
#define LUM_LIMIT_HANDSHAKES_IP_BURST 128u /* likewise, at once: a browser begins six for the page */
#define LUM_LIMIT_HANDSHAKE_NETWORKS 1024u /* remembered: those that came last */
#define LUM_LIMIT_KEY_CHANGES 32u          /* of a connection: each takes 20 us; a key is good for 2^24 records */
#define LUM_LIMIT_RESUME_S 300u            /* who was cut off may come back so long: a tunnel, a laptop */
#define LUM_LIMIT_PARKED 64u               /* of them; beyond, who was cut off longest is gone */
#define LUM_LIMIT_REPEATS 256u       /* edits of a session whose op_id is known: more than it can have under way */
#define LUM_LIMIT_REPEAT_USERS 256u  /* whose are known: those who edited last */
#define LUM_LIMIT_CHANGES_KEPT 1024u /* of the scene, for those who come back */
#define LUM_LIMIT_CHANGES_KEPT_BYTES (4u << 20) /* a quarter of what may wait for one session */
#define LUM_LIMIT_HELLO_S 5 /* from connection, or the refusal of a project that was waited for, to a session.hello */
#define LUM_LIMIT_OPENING_TOLD_S 2    /* who waits for a project hears so: a tenth of what a page takes for dead */
#define LUM_LIMIT_PRESENCE_PER_S 10u  /* news of where people are, to each: a hand is followed */
#define LUM_LIMIT_MESSAGES_PER_S 240u /* a 120 Hz drag of two values; token bucket with 2 s of burst */
#define LUM_LIMIT_RX_BYTES_PER_S (4u << 20)  /* of a session: reading them takes a tenth of the net thread at most */
#define LUM_LIMIT_RX_BURST_BYTES (16u << 20) /* two of the largest messages at once */
#define LUM_LIMIT_RX_REST_PER_S (64u << 10)  /* of a session, free: pings, headers of frames and of TLS */
#define LUM_LIMIT_FRAME_COST_BYTES 1024u     /* what a frame costs beside its bytes: tiny ones are not free */
#define LUM_LIMIT_VALUE_COST_BYTES 8u        /* and a value of JSON, which is an allocation */
#define LUM_LIMIT_CONTROL_QUEUE_BYTES (16u << 20) /* replies waiting in one session; over it the session is closed */
#define LUM_LIMIT_CODECS 16u                      /* that a client says it reads */
#define LUM_LIMIT_HELD_MS 1e9                     /* that a client says it had a frame before it acknowledged it */
#define LUM_LIMIT_UNACKED_FRAMES 2u               /* W = 2: one in flight, one being drawn */
#define LUM_LIMIT_TILE_SIDE 128u                  /* a PNG tile stays below one socket write of 64 KiB */
#define LUM_LIMIT_PING_S 10                       /* of silence, before a connection is asked whether it is there */
#define LUM_LIMIT_HANGUP_S 25                     /* likewise: 15 s for its answer */
#define LUM_LIMIT_HTTP_HEADER_BYTES 4096u         /* of a request: a browser's fits; larger is refused */

#endif
