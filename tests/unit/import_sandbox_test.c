/* The sandbox holds: what a hijacked importer would try is refused or kills it. Each attempt runs in a forked process.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/base/base.h"
#include "server/importer/sandbox.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1 /* the filter is off: nothing to test */
#else
#define SANITIZED 0
#endif

enum { KEEP_FD = 3, DONE_WHAT_IS_FORBIDDEN = 0, REFUSED = 10, NOT_SET_UP = 11 };

/* Each returns true when it got what it wanted. */
static bool try_read_file(void)
{
    return open("/etc/passwd", O_RDONLY) >= 0;
}

static bool try_write_file(void)
{
    return open("/tmp/lumend-sandbox-test", O_WRONLY | O_CREAT, 0600) >= 0;
}

static bool try_openat2(void)
{
    uint64_t how[3] = {O_RDONLY, 0, 0};
    return syscall(437, AT_FDCWD, "/etc/passwd", how, sizeof how) >= 0;
}

static bool try_socket(void)
{
    return socket(AF_INET, SOCK_STREAM, 0) >= 0;
}

static bool try_fork(void)
{
    return fork() >= 0;
}

static bool try_exec(void)
{
    execl("/bin/true", "true", (char *)NULL);
    return false;
}

static bool try_ptrace(void)
{
    return ptrace(PTRACE_TRACEME, 0, NULL, NULL) == 0;
}

static bool try_kill_parent(void)
{
    return kill(getppid(), 0) == 0;
}

static bool try_executable_memory(void)
{
    return mmap(NULL, 4096, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) != MAP_FAILED;
}

static bool try_unlink(void)
{
    return unlink("/tmp/lumend-sandbox-test") == 0;
}

static bool try_inherited_descriptor(void)
{
    char byte;
    return read(KEEP_FD + 1, &byte, 1) >= 0; /* open in the test, closed by the sandbox */
}

static bool try_environment(void)
{
    return getenv("PATH") != NULL;
}

static bool try_much_memory(void)
{
    return mmap(NULL, 5ull << 30, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) != MAP_FAILED;
}

static const struct attempt {
    const char *name;
    bool (*try)(void);
    bool kills; /* else it is refused */
} attempts[] = {
    {"reading a file", try_read_file, false},
    {"writing a file", try_write_file, false},
    {"openat2", try_openat2, true},
    {"a socket", try_socket, true},
    {"fork", try_fork, true},
    {"exec", try_exec, true},
    {"ptrace", try_ptrace, true},
    {"a signal to the parent", try_kill_parent, true},
    {"executable memory", try_executable_memory, true},
    {"unlink", try_unlink, true},
    {"an inherited descriptor", try_inherited_descriptor, false},
    {"the environment", try_environment, false},
    {"5 GiB of memory", try_much_memory, false},
};

static void run_attempt(const struct attempt *a)
{
    if (dup2(0, KEEP_FD) < 0 || dup2(0, KEEP_FD + 1) < 0 || lum_sandbox_enter(KEEP_FD, 5, NULL))
        _exit(NOT_SET_UP);
    _exit(a->try() ? DONE_WHAT_IS_FORBIDDEN : REFUSED);
}

static void check_attempt(const struct attempt *a)
{
    int status = 0;
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0)
        run_attempt(a);
    assert_int_equal(waitpid(pid, &status, 0), pid);
    if (a->kills && !(WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS))
        fail_msg("%s does not kill: status %#x", a->name, (unsigned)status);
    if (!a->kills && !(WIFEXITED(status) && WEXITSTATUS(status) == REFUSED))
        fail_msg("%s is not refused: status %#x", a->name, (unsigned)status);
}

static void nothing_forbidden_succeeds(void **state)
{
    (void)state;
    if (SANITIZED)
        skip();
    for (size_t i = 0; i < LUM_ARRAY_LEN(attempts); i++)
        check_attempt(&attempts[i]);
}

/* The same without root, where setting the filter depends on no_new_privs. */
static void nothing_forbidden_succeeds_without_root(void **state)
{
    (void)state;
    if (SANITIZED || geteuid() != 0)
        skip();
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0) {
        if (setgid(65534) || setuid(65534))
            _exit(NOT_SET_UP);
        for (size_t i = 0; i < LUM_ARRAY_LEN(attempts); i++)
            check_attempt(&attempts[i]);
        _exit(0);
    }
    int status = 0;
    assert_int_equal(waitpid(pid, &status, 0), pid);
    assert_int_equal(status, 0);
}

/* Who has too little memory shall take it from a hostile file's reader, and not from the daemon. */
static void it_is_the_first_to_go_when_memory_is_short(void **state)
{
    (void)state;
    int pair[2], status = 0, score = 0;
    char byte = 0, path[64];
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0) {
        if (dup2(pair[1], KEEP_FD) < 0 || lum_sandbox_enter(KEEP_FD, 5, NULL) || write(KEEP_FD, "x", 1) != 1)
            _exit(NOT_SET_UP);
        _exit(read(KEEP_FD, &byte, 1) == 1 ? 0 : REFUSED);
    }
    assert_int_equal(read(pair[0], &byte, 1), 1);
    snprintf(path, sizeof path, "/proc/%d/oom_score_adj", (int)pid);
    FILE *f = fopen(path, "r");
    assert_non_null(f);
    assert_int_equal(fscanf(f, "%d", &score), 1);
    fclose(f);
    assert_int_equal(write(pair[0], "x", 1), 1);
    assert_int_equal(waitpid(pid, &status, 0), pid);
    assert_int_equal(status, 0);
    close(pair[0]);
    close(pair[1]);
    assert_int_equal(score, 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_forbidden_succeeds),
        cmocka_unit_test(nothing_forbidden_succeeds_without_root),
        cmocka_unit_test(it_is_the_first_to_go_when_memory_is_short),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
