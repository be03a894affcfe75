/* The network: HTTP and WebSocket on one port. The only files that know libwebsockets are net.c and
 * net_http.c.
 *
 * One thread runs lum_net_run; everything of libwebsockets happens on it. Other threads may call lum_net_wake and
 * lum_net_stop, which only set a flag and interrupt the wait. */
#ifndef LUM_SERVER_NET_NET_H
#define LUM_SERVER_NET_NET_H

#include "server/net/access.h"
#include "server/net/address.h"
#include "server/net/http.h"
#include "server/net/session.h"

struct lum_net;
struct lum_service;
struct lum_tls;

struct lum_net_config {
    struct lum_address address;
    struct lum_access access;
    struct lum_auth *auth; /* outlives the net, whose thread takes what lum_auth_offer gave */
    /* Where there are projects: told that this thread and all directors turn. Outlives the net. */
    const struct lum_service *service;
    struct lum_tls *tls; /* NULL: none is spoken. Outlives the net, whose thread it belongs to from here on */
    struct lum_log log;
};

/* Binds and listens; connections wait in the kernel's queue until lum_net_wait or lum_net_run. */
LUM_MUST_USE enum lum_status lum_net_create(const struct lum_net_config *config, struct lum_net **ret_net,
                                            struct lum_error *err);
void lum_net_destroy(struct lum_net *net); /* accepts NULL */
uint16_t lum_net_port(const struct lum_net *net);
const struct lum_tls *lum_net_tls(const struct lum_net *net);   /* NULL: none is spoken */
struct lum_net_counters *lum_net_counters(struct lum_net *net); /* net thread */

/* While the scene is loaded: answers that it is, opens no session, and returns true once lum_net_wake was called and
 * *until is set. False: lum_net_stop came first, or (*ret_failed) the network broke. */
bool lum_net_wait(struct lum_net *net, const _Atomic bool *until, bool *ret_failed);
/* Serves until lum_net_stop; then opens no session any more, tells the clients, closes them, and returns when all are
 * gone (after at most a few seconds). sessions and projects outlive the call. */
void lum_net_run(struct lum_net *net, struct lum_sessions *sessions, struct lum_projects *projects);

void lum_net_wake(void *net);           /* thread: any. The director or a stream has something new */
void lum_net_stop(struct lum_net *net); /* thread: any */

const char *lum_net_library(void); /* "libwebsockets 4.1.6" */

#endif
