"""As a service of systemd: what is told, when, and by which thread."""
import contextlib
import ctypes
import os
import signal
import socket
import subprocess
import tempfile
import threading
import unittest

from daemon import LUMEND, Daemon
from wsclient import WAIT_S

PTRACE_SEIZE, PTRACE_INTERRUPT, PTRACE_DETACH, WALL = 0x4206, 0x4207, 17, 0x40000000


class Manager:
    """The socket of a service manager: a file's, or an abstract one."""

    def __init__(self, abstract=False):
        self.folder = tempfile.TemporaryDirectory()
        self.name = f"@lumend-test-{os.getpid()}" if abstract else self.folder.name + "/notify"
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.settimeout(WAIT_S)
        self.socket.bind(self.name.replace("@", "\0"))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()
        self.folder.cleanup()

    def next(self):
        return self.socket.recv(4096).decode()

    def environment(self, **more):
        return {"NOTIFY_SOCKET": self.name, **more}


def thread_of(pid, name):
    """The oldest of that name: those that it starts have it, too."""
    for tid in sorted(int(tid) for tid in os.listdir(f"/proc/{pid}/task")):
        with open(f"/proc/{pid}/task/{tid}/comm", encoding="ascii") as comm:
            if comm.read().strip() == name:
                return tid
    raise AssertionError(f"no thread {name}")


@contextlib.contextmanager
def stopped(tid):
    """One thread of another process stands still; None: that is not allowed here."""
    ptrace = ctypes.CDLL(None, use_errno=True).ptrace
    ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
    if ptrace(PTRACE_SEIZE, tid, None, None) != 0:
        yield None
        return
    ptrace(PTRACE_INTERRUPT, tid, None, None)
    os.waitpid(tid, WALL)
    try:
        yield tid
    finally:
        ptrace(PTRACE_DETACH, tid, None, None)


class Notify(unittest.TestCase):
    def test_ready_alive_and_stopping(self):
        for abstract in (False, True):
            with Manager(abstract) as manager:
                with Daemon(environment=manager.environment(WATCHDOG_USEC="50000")) as daemon:
                    told = [manager.next()]
                    while told[-1] != "READY=1":
                        told.append(manager.next())
                    after = [manager.next() for _ in range(3)]  # nobody looks: the director sleeps, and is alive
                    self.assertEqual(set(told[:-1] + after), {"WATCHDOG=1"})
                    self.assertEqual(daemon.get("/readyz")[0], 200)
                    daemon.process.send_signal(signal.SIGTERM)
                    while manager.next() != "STOPPING=1":
                        pass
                    self.assertEqual(daemon.process.wait(WAIT_S), 0)

    def test_ready_waits_behind_a_queue_that_is_full(self):
        """That of a UNIX datagram socket is short: a daemon that is long at starting fills it with signs of life."""
        with Manager() as manager, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as other:
            other.connect(manager.name)
            other.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                while True:
                    other.send(b"WATCHDOG=1")
            with Daemon(environment=manager.environment()) as daemon:
                answer = threading.Thread(target=daemon.get, args=("/healthz",))
                answer.start()
                answer.join(0.5)  # one that did not wait has answered by then, and its word is lost
                while manager.next() != "READY=1":
                    pass
                answer.join()

    def test_nothing_alive_is_told_where_it_is_not_wanted(self):
        for more in ({}, {"WATCHDOG_USEC": "1000", "WATCHDOG_PID": "1"}, {"WATCHDOG_USEC": "-5"}):
            with Manager() as manager, Daemon(environment=manager.environment(**more)) as daemon:
                self.assertEqual(manager.next(), "READY=1")
                daemon.assert_well()
                daemon.stop()
                self.assertEqual(manager.next(), "STOPPING=1")

    def test_projects_are_alive_together_and_one_that_is_stuck_is_silent(self):
        with tempfile.TemporaryDirectory() as folder, Manager() as manager, \
                Daemon("--projects", folder, scene=None, environment=manager.environment(WATCHDOG_USEC="20000")) as daemon:
            while manager.next() != "WATCHDOG=1":  # no director is there
                pass
            lobby = daemon.connect()
            made = [lobby.call("project.create", {"name": name})["project"] for name in "AB"]
            sessions = [daemon.connect(hello=False) for _ in made]
            for ws, project in zip(sessions, made):
                ws.hello(daemon.token, project=project)
            self.assertEqual(manager.next(), "WATCHDOG=1")
            with stopped(thread_of(daemon.process.pid, "lum-director")) as tid:
                if tid is None:
                    self.skipTest("ptrace is not allowed here")
                manager.socket.setblocking(False)
                with self.assertRaises(BlockingIOError):
                    while True:
                        manager.next()
                manager.socket.settimeout(0.05)  # what was told once more before it was missed
                with contextlib.suppress(TimeoutError):
                    while True:
                        manager.next()
                manager.socket.settimeout(0.3)
                with self.assertRaises(TimeoutError):
                    manager.next()
            manager.socket.settimeout(WAIT_S)
            self.assertEqual(manager.next(), "WATCHDOG=1")

    def test_a_stuck_director_is_silent(self):
        """One thread is stopped by ptrace; the others go on, and do not speak for it."""
        with Manager() as manager, Daemon(environment=manager.environment(WATCHDOG_USEC="20000")) as daemon:
            told = set()
            while len(told) < 2:  # it runs, and has its name
                told.add(manager.next())
            with stopped(thread_of(daemon.process.pid, "lum-director")) as tid:
                if tid is None:
                    self.skipTest("ptrace is not allowed here")
                manager.socket.setblocking(False)
                with self.assertRaises(BlockingIOError):
                    while True:
                        manager.next()
                manager.socket.settimeout(0.3)  # fifteen of its periods
                for _ in range(2):
                    self.assertEqual(daemon.get("/healthz")[0], 200)  # the network's thread goes on
                    with self.assertRaises(TimeoutError):
                        manager.next()
            manager.socket.settimeout(WAIT_S)
            self.assertEqual(manager.next(), "WATCHDOG=1")

    def test_a_socket_that_is_none_is_told(self):
        for name, words in (("relative", "must be a path or @NAME"), ("/" + 200 * "x", "of at most 107 bytes"),
                            ("/no/such/socket", "nobody listens at $NOTIFY_SOCKET (/no/such/socket)")):
            done = subprocess.run([LUMEND, "--listen", "127.0.0.1:0"], env={**os.environ, "NOTIFY_SOCKET": name},
                                  capture_output=True, text=True, timeout=2 * WAIT_S, check=False)
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn(words, done.stderr)


if __name__ == "__main__":
    unittest.main()
