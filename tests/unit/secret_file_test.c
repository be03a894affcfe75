/* Who may read a file of secrets, by its owner, its group and its mode: all of them tried, whoever runs this test. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/net/secret_file.h"

#define SOMEBODY 1000

int __real_fstat(int fd, struct stat *st);
int __wrap_fstat(int fd, struct stat *st);

static struct stat shown;

int __wrap_fstat(int fd, struct stat *st)
{
    int status = __real_fstat(fd, st);
    st->st_mode = (st->st_mode & S_IFMT) | shown.st_mode;
    st->st_uid = shown.st_uid;
    st->st_gid = shown.st_gid;
    return status;
}

static char path[] = "/tmp/lumend-secret-XXXXXX";

static bool is_read(enum lum_file_readers readers, uid_t owner, gid_t group, mode_t mode)
{
    char text[16];
    size_t n = 0;
    struct lum_error err;
    shown = (struct stat){.st_uid = owner, .st_gid = group, .st_mode = mode};
    enum lum_status status = lum_secret_file_read(readers, "token-file", path, text, sizeof text, &n, &err);
    if (status)
        assert_non_null(strstr(err.text, "chmod 600"));
    else
        assert_string_equal(text, "secret");
    return !status;
}

/* As LoadCredential of systemd gives it: of root and its group, and the service is named in the access list, whose mask
 * shows where the mode has its group. */
static void credentials_of_systemd(void **state)
{
    (void)state;
    for (enum lum_file_readers readers = LUM_FILE_OF_OWNER; readers <= LUM_FILE_OF_ALL; readers++) {
        assert_true(is_read(readers, 0, 0, 0440));
        assert_true(is_read(readers, SOMEBODY, SOMEBODY, 0400)); /* where the file system has no access lists */
    }
}

static void every_mode(void **state)
{
    (void)state;
    for (mode_t mode = 0; mode <= 0777; mode++) {
        bool closed = !(mode & 0077), group_reads = (mode & 0077) == 0040;
        assert_int_equal(is_read(LUM_FILE_OF_OWNER, SOMEBODY, SOMEBODY, mode), closed);
        assert_int_equal(is_read(LUM_FILE_OF_OWNER, SOMEBODY, 0, mode), closed);
        assert_int_equal(is_read(LUM_FILE_OF_OWNER, 0, SOMEBODY, mode), closed);
        assert_int_equal(is_read(LUM_FILE_OF_OWNER, 0, 0, mode), closed || group_reads);
        assert_int_equal(is_read(LUM_FILE_OF_OWNER_OR_ROOTS_GROUP, SOMEBODY, 0, mode), closed);
        assert_int_equal(is_read(LUM_FILE_OF_OWNER_OR_ROOTS_GROUP, 0, SOMEBODY, mode), closed || group_reads);
        assert_true(is_read(LUM_FILE_OF_ALL, SOMEBODY, SOMEBODY, mode));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(credentials_of_systemd), cmocka_unit_test(every_mode)};
    int fd = mkstemp(path);
    if (fd < 0 || write(fd, "secret", 6) != 6 || close(fd))
        return 1;
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed;
}
