/* A WebSocket client connection that is pulled, not called back: send, then ask for the next event. The only file of
 * the clients that knows libwebsockets. Thread: one. */
#ifndef LUM_CLIENTS_REPLAY_WS_H
#define LUM_CLIENTS_REPLAY_WS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct ws;

enum ws_event_kind { WS_TIMEOUT, WS_OPEN, WS_TEXT, WS_BINARY, WS_CLOSED };
struct ws_event {
    enum ws_event_kind kind;
    int64_t t_ns;         /* when its last byte was read */
    const uint8_t *bytes; /* text, binary: valid until the next call. Closed: the reason, a string */
    size_t n_bytes;
};

int64_t ws_clock_ns(void); /* monotonic */

/* url: ws://host[:port][/path], or wss. ca: of wss, the file (PEM) of who signed the server's certificate; NULL: whom
 * this machine trusts. Starts to connect. NULL: *ret_reason (static) says why. */
struct ws *ws_connect(const char *url, const char *ca, const char *subprotocol, const char **ret_reason);
void ws_destroy(struct ws *ws); /* accepts NULL; closes */

/* Queues a text, which it owns and frees; false when it is NULL or memory is short. */
bool ws_send(struct ws *ws, char *text);
/* Waits for the next event, at most until deadline_ns. */
struct ws_event ws_next(struct ws *ws, int64_t deadline_ns);

#endif
