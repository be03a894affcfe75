"""The unit of systemd: it is well-formed and tight, and what it allows is enough for the daemon and the importer's sandbox."""
import ctypes
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

from daemon import LUMEND, Daemon

HERE = os.path.dirname(os.path.abspath(__file__))
UNIT = os.environ["LUMEND_UNIT"]
EXPOSURE_MAX = 20  # of 100, by systemd's own reckoning


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=False)


def settings(name):
    with open(UNIT, encoding="utf-8") as unit:
        return re.findall(rf"(?m)^{name}=(.*)$", unit.read())


def calls_of(names):
    """Names of system calls; a set (@name) is what systemd says that it is."""
    calls = set()
    for name in names:
        if not name.startswith("@"):
            calls.add(name)
            continue
        lines = run("systemd-analyze", "syscall-filter", name).stdout.splitlines()[1:]
        calls |= calls_of([line.strip() for line in lines if line.strip() and not line.strip().startswith("#")])
    return calls


class Compare(ctypes.Structure):
    """struct scmp_arg_cmp: (argument & mask) == value."""
    _fields_ = [("argument", ctypes.c_uint), ("how", ctypes.c_int), ("mask", ctypes.c_uint64), ("value", ctypes.c_uint64)]


def shut_in(calls):
    """Like systemd: all but these calls fail with EPERM, for this process and all that it starts; a socket is of the families
    that the unit names; no memory is for writing and for executing, nor turned into such (MemoryDenyWriteExecute)."""
    lib = ctypes.CDLL("libseccomp.so.2", use_errno=True)
    lib.seccomp_init.restype = ctypes.c_void_p
    context = ctypes.c_void_p(lib.seccomp_init(0x00050001))  # SCMP_ACT_ERRNO(EPERM)
    full, w, x = 2**64 - 1, 2, 4
    families = [int(getattr(socket, name)) for name in settings("RestrictAddressFamilies")[0].split()]
    only = {"socket": [(0, full, family) for family in families], "mmap": [(2, w | x, some) for some in (0, w, x)],
            "mprotect": [(2, x, 0)]}
    for call in sorted(calls):
        number = lib.seccomp_syscall_resolve_name(call.encode())
        for rule in only.get(call, [None]) if number >= 0 else []:  # negative: not of this machine
            compare = Compare(rule[0], 7, rule[1], rule[2]) if rule else None  # SCMP_CMP_MASKED_EQ
            done = lib.seccomp_rule_add_array(context, 0x7fff0000, number, 1 if rule else 0,
                                              ctypes.byref(compare) if rule else None)
            assert done == 0, (call, rule)
    assert lib.seccomp_load(context) == 0, "the filter cannot be loaded"


class Unit(unittest.TestCase):
    def setUp(self):
        if not shutil.which("systemd-analyze"):
            self.skipTest("no systemd-analyze here")

    def test_it_is_well_formed(self):
        with tempfile.TemporaryDirectory() as folder:  # verify wants the program to be there
            path = os.path.join(folder, "lumend.service")
            with open(UNIT, encoding="utf-8") as unit, open(path, "w", encoding="utf-8") as copy:
                copy.write(re.sub(r"(?m)^ExecStart=\S+", f"ExecStart={os.path.abspath(LUMEND)}", unit.read()))
            done = run("systemd-analyze", "verify", "--man=no", "--recursive-errors=no", path)
        ours = [line for line in done.stderr.splitlines() if "lumend.service" in line]
        self.assertEqual(ours, [])

    def test_it_is_tight(self):
        done = run("systemd-analyze", "security", "--offline=yes", f"--threshold={EXPOSURE_MAX}", "--no-pager", UNIT)
        if "offline" in done.stderr:
            self.skipTest("this systemd cannot judge a unit that is not loaded")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        print(done.stdout.splitlines()[-1].encode("ascii", "ignore").decode().strip())

    def test_its_calls_are_enough_for_an_import(self):
        allowed, taken = settings("SystemCallFilter")
        calls = calls_of(allowed.split()) - calls_of(taken.lstrip("~").split())
        self.assertGreater(len(calls), 100)
        self.assertFalse(calls & {"mount", "ptrace", "reboot", "init_module", "bpf", "chroot"})
        with tempfile.TemporaryDirectory() as folder:
            try:
                with Daemon("--assets", os.path.join(HERE, "web"), "--state", folder,
                            wrapper=(sys.executable, __file__, "--shut-in", *sorted(calls))) as daemon:
                    ws = daemon.connect()
                    ws.call("view.open", {"size": [64, 64], "camera_id": "main"})
                    ws.call("scene.apply", {"ops": [{"op": "import", "id": "a", "asset": "lamp.gltf"}]})
                    ws.wait_notification("frame.stats")
                    self.assertEqual(daemon.metric("imports_total"), 1)
            except AssertionError as e:
                if "the filter cannot be loaded" in str(e):
                    self.skipTest("no filter can be loaded here")
                raise


if __name__ == "__main__":
    if sys.argv[1:2] == ["--shut-in"]:
        end = next(i for i, word in enumerate(sys.argv) if word == LUMEND)
        shut_in(sys.argv[2:end])
        os.execv(LUMEND, sys.argv[end:])
    unittest.main()
