#define _GNU_SOURCE
#include "server/importer/sandbox.h"

#include <errno.h>
#include <fcntl.h>
#include <seccomp.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "protocol/base/limits.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define SANITIZED 1
#endif
#endif
#ifndef SANITIZED
#define SANITIZED 0
#endif

#if SANITIZED
/* The environment is empty here, so the sanitizers' settings are compiled in: memory that is refused is NULL, as under
 * RLIMIT_AS. Visible: the runtime, a shared library, looks the function up. */
__attribute__((visibility("default"))) const char *__asan_default_options(void);
__attribute__((visibility("default"))) const char *__tsan_default_options(void);

const char *__asan_default_options(void)
{
    return "allocator_may_return_null=1:max_allocation_size_mb=4096:detect_leaks=1";
}

const char *__tsan_default_options(void)
{
    return "allocator_may_return_null=1:max_allocation_size_mb=4096";
}
#endif

#define MAX_FDS 16 /* three streams, the file socket, and what is being read */

static bool limit(int resource, rlim_t soft, rlim_t hard)
{
    struct rlimit now;
    if (getrlimit(resource, &now))
        return false;
    /* never above what the parent was given */
    struct rlimit r = {soft < now.rlim_max ? soft : now.rlim_max, hard < now.rlim_max ? hard : now.rlim_max};
    return setrlimit(resource, &r) == 0;
}

static bool set_limits(unsigned cpu_s)
{
    /* CPU: SIGXCPU at the soft limit says what happened; the hard one kills. */
    return (SANITIZED || limit(RLIMIT_AS, LUM_LIMIT_IMPORT_MEMORY_BYTES, LUM_LIMIT_IMPORT_MEMORY_BYTES)) &&
           limit(RLIMIT_CPU, cpu_s, cpu_s + 1) && limit(RLIMIT_FSIZE, 0, 0) && limit(RLIMIT_NOFILE, MAX_FDS, MAX_FDS) &&
           limit(RLIMIT_CORE, 0, 0);
}

/* System calls that memory, threads' locks, the clock, the three streams and the file socket need. */
static const int allowed[] = {
    SCMP_SYS(read),
    SCMP_SYS(write),
    SCMP_SYS(writev),
    SCMP_SYS(close),
    SCMP_SYS(lseek),
    SCMP_SYS(brk),
    SCMP_SYS(munmap),
    SCMP_SYS(mremap),
    SCMP_SYS(madvise),
    SCMP_SYS(futex),
    SCMP_SYS(exit),
    SCMP_SYS(exit_group),
    SCMP_SYS(rt_sigaction),
    SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(rt_sigreturn),
    SCMP_SYS(sigaltstack),
    SCMP_SYS(clock_gettime),
    SCMP_SYS(gettimeofday),
    SCMP_SYS(time),
    SCMP_SYS(getrandom),
    SCMP_SYS(getpid),
    SCMP_SYS(gettid),
    SCMP_SYS(sched_yield),
    SCMP_SYS(sched_getaffinity),
    SCMP_SYS(restart_syscall),
    SCMP_SYS(getrusage),
};

/* Calls that libraries try and do without: they fail instead of killing. */
static const int refused[] = {
    SCMP_SYS(open),   SCMP_SYS(openat), SCMP_SYS(stat),   SCMP_SYS(lstat),   SCMP_SYS(newfstatat),
    SCMP_SYS(statx),  SCMP_SYS(fstat),  SCMP_SYS(access), SCMP_SYS(ioctl),   SCMP_SYS(readlink),
    SCMP_SYS(getcwd), SCMP_SYS(uname),  SCMP_SYS(fcntl),  SCMP_SYS(sysinfo),
};

static int add_rules(scmp_filter_ctx f, int socket_fd)
{
    int e = 0;
    for (size_t i = 0; i < LUM_ARRAY_LEN(allowed) && !e; i++)
        e = seccomp_rule_add(f, SCMP_ACT_ALLOW, allowed[i], 0);
    for (size_t i = 0; i < LUM_ARRAY_LEN(refused) && !e; i++)
        e = seccomp_rule_add(f, SCMP_ACT_ERRNO(EACCES), refused[i], 0);
    /* memory that is never executable */
    if (!e)
        e = seccomp_rule_add(f, SCMP_ACT_ALLOW, SCMP_SYS(mmap), 1, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
    if (!e)
        e = seccomp_rule_add(f, SCMP_ACT_ALLOW, SCMP_SYS(mprotect), 1, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
    /* messages on the file socket alone; signals to itself alone (abort) */
    if (!e)
        e = seccomp_rule_add(f, SCMP_ACT_ALLOW, SCMP_SYS(sendmsg), 1, SCMP_A0(SCMP_CMP_EQ, (scmp_datum_t)socket_fd));
    if (!e)
        e = seccomp_rule_add(f, SCMP_ACT_ALLOW, SCMP_SYS(recvmsg), 1, SCMP_A0(SCMP_CMP_EQ, (scmp_datum_t)socket_fd));
    if (!e)
        e = seccomp_rule_add(f, SCMP_ACT_ALLOW, SCMP_SYS(tgkill), 1, SCMP_A0(SCMP_CMP_EQ, (scmp_datum_t)getpid()));
    return e;
}

static int filter_calls(int socket_fd)
{
    scmp_filter_ctx f = seccomp_init(SCMP_ACT_KILL_PROCESS);
    if (!f)
        return -ENOMEM;
    int e = add_rules(f, socket_fd);
    if (!e)
        e = seccomp_load(f); /* sets no_new_privs as well */
    seccomp_release(f);
    return e;
}

/* Where memory is short the kernel takes this process, and not the daemon. Without /proc it goes by size, as ever. */
static void offer_as_victim(void)
{
    int fd = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
    if (fd < 0)
        return;
    (void)!write(fd, "1000", 4);
    close(fd);
}

enum lum_status lum_sandbox_enter(int keep_fd, unsigned cpu_s, struct lum_error *err)
{
    clearenv();
    offer_as_victim();
    if (close_range((unsigned)keep_fd + 1, ~0u, 0))
        return lum_fail(err, LUM_ERR_INTERNAL, "", "sandbox: closing descriptors failed: %s", strerror(errno));
    if (prctl(PR_SET_PDEATHSIG, SIGKILL) || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) ||
        prctl(PR_SET_DUMPABLE, SANITIZED, 0, 0, 0))
        return lum_fail(err, LUM_ERR_INTERNAL, "", "sandbox: prctl failed: %s", strerror(errno));
    if (!set_limits(cpu_s))
        return lum_fail(err, LUM_ERR_INTERNAL, "", "sandbox: setting limits failed: %s", strerror(errno));
    int e = SANITIZED ? 0 : filter_calls(keep_fd);
    if (e)
        return lum_fail(err, LUM_ERR_INTERNAL, "", "sandbox: the system call filter failed: %s", strerror(-e));
    return LUM_OK;
}
