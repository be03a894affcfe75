/* The lines of --audit: who changed what. They are in the log once the edit is in the scene, in the order of revisions.
 */
#ifndef LUM_SERVER_DIRECTOR_AUDIT_H
#define LUM_SERVER_DIRECTOR_AUDIT_H

#include "server/director/internal.h"

/* Of an edit that was published. Nothing where nobody asked for it. */
void lum_director_audit(struct lum_director *d, const struct lum_staged_edit *p);
/* Of one that was taken back, because the journal could not keep it. rev: the revision without it. */
void lum_director_audit_lost(struct lum_director *d, const struct lum_staged_edit *p, uint64_t rev);

#endif
