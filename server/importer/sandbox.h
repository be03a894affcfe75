/* Shuts the process in before it reads a byte of the asset: no opening of files, no network, no new processes, no
 * writing but to the descriptors it has, and limits on memory, CPU time and descriptors. Works with and without root.
 */
#ifndef LUM_SERVER_IMPORTER_SANDBOX_H
#define LUM_SERVER_IMPORTER_SANDBOX_H

#include "core/base/base.h"

/* Descriptors above keep_fd are closed. The parent's death kills this process. In builds with sanitizers the system
 * call filter and the memory limit stay off: their runtimes need both. */
LUM_MUST_USE enum lum_status lum_sandbox_enter(int keep_fd, unsigned cpu_s, struct lum_error *err);

#endif
