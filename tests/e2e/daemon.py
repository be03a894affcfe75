"""Starts lumend for a test, waits for its ready line, and checks that it ended well."""
import hashlib
import atexit
import http.client
import os
import re
import signal
import subprocess
import tempfile
import threading
import time
import weakref

from authority import Authority
from wsclient import BROKEN, WAIT_S, WebSocket, connect_tcp

LUMEND = os.environ.get("LUMEND", "lumend")
SANITIZE = os.environ.get("LUMEND_SANITIZE", "")  # what the daemon was built with: "address,undefined", "thread" or nothing
SKY = os.path.join(os.path.dirname(os.path.abspath(__file__)), "sky.jsonl")  # for --scene, where pictures only have to come


def eventually(condition, what):
    """A hang must not hang the suite."""
    end_s = time.monotonic() + WAIT_S
    while not condition():
        if time.monotonic() > end_s:
            raise AssertionError(f"not in {WAIT_S} s: {what}")


class Tls:
    """For tests that run by clear text and, with LUMEND_TEST_TLS, by TLS."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()
        atexit.register(self.folder.cleanup)
        authority = Authority(self.folder.name)
        self.trust = authority.trust()
        self.options = ["--tls-{}={}".format(*pair) for pair in zip(("cert", "key"), authority.issue("daemon"))]


TLS = Tls() if os.environ.get("LUMEND_TEST_TLS") else None


def write_people(path, people):
    """The file of --tokens. people: {name: (role, token) or (role, token, last day)}"""
    lines = ["# who may connect", ""]
    for name, (role, token, *until) in people.items():
        lines.append(" ".join([name, role, "sha256:" + hashlib.sha256(token.encode()).hexdigest(), *until]))
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")


class Daemon:
    """With `with`: at the end SIGTERM, and the exit status must be 0. trust: how to reach it by TLS; None: by clear text."""

    def __init__(self, *options, wrapper=(), listen="127.0.0.1:0", threads=1, environment=None, trust=TLS and TLS.trust,
                 scene=os.environ.get("LUMEND_TEST_SCENE", "cornell")):
        command = [*wrapper, LUMEND, "serve", "--listen", listen, "--threads", str(threads),
                   *(["--scene", scene] if scene else []), *(TLS.options if TLS else ()), *options]
        self.trust = trust
        self.sessions = weakref.WeakSet()
        self.log = tempfile.TemporaryFile()
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self.log,
                                        env={**os.environ, **(environment or {})})
        self.ready_line = self._read_line()
        match = re.fullmatch(r"lumend ready https?://(\[[0-9a-f:]+\]|[a-z0-9.-]+):(\d+)/(?:#t=(\S+))?\n", self.ready_line)
        if not match:
            self.process.kill()
            self.process.wait()
            raise AssertionError(f"no ready line but {self.ready_line!r}; log:\n{self.read_log()}")
        self.host, self.port, self.token = match[1], int(match[2]), match[3]

    def _read_line(self):
        timer = threading.Timer(10 * WAIT_S, self.process.kill)  # a hang must not hang the suite
        timer.start()
        line = self.process.stdout.readline().decode()
        timer.cancel()
        return line

    def read_log(self):
        log = self.log.fileno()
        return os.pread(log, os.fstat(log).st_size, 0).decode(errors="replace")  # the daemon writes where this file is at

    def __enter__(self):
        return self

    def __exit__(self, kind, value, traceback):
        if self.trust:  # who does not answer the end of TLS would be waited for, a second
            for session in self.sessions:
                session.close()
        status = self.stop()
        log = self.read_log()
        self.log.close()
        if status != 0 or "Sanitizer" in log or kind:
            print(f"---- log of the daemon, exit status {status} ----\n{log}")
        if kind is None:
            assert status == 0, f"lumend ended with {status}"
            assert "Sanitizer" not in log, "a sanitizer complained"

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            status = self.process.wait(2 * WAIT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise AssertionError("SIGTERM did not end the daemon") from None
        finally:
            self.process.stdout.close()
        return status

    def connect(self, hello=True, **options):
        ws = WebSocket(self.port, trust=self.trust, **options)
        self.sessions.add(ws)
        if hello:
            ws.hello(self.token)
        return ws

    def tcp(self, **options):
        """A connection by which nothing was said."""
        return connect_tcp(self.port, trust=self.trust, **options)

    def http(self):
        if self.trust:
            return http.client.HTTPSConnection("127.0.0.1", self.port, timeout=WAIT_S, context=self.trust)
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=WAIT_S)

    def get(self, path, headers=None, method="GET"):
        """(status, headers, body). By TLS one who asks in a loop may have to wait: handshakes of an address are limited."""
        end = time.monotonic() + WAIT_S
        while True:
            try:
                return self._get(path, headers, method)
            except BROKEN:
                if not self.trust or time.monotonic() > end:
                    raise

    def _get(self, path, headers, method):
        connection = self.http()
        connection.request(method, path, headers=headers or {})
        response = connection.getresponse()
        body = response.read()
        connection.close()
        return response.status, {k.lower(): v for k, v in response.getheaders()}, body

    def bearer(self):
        """The header that says who may read /metrics."""
        return {"Authorization": f"Bearer {self.token}"}

    def metric(self, name):
        for line in self.get("/metrics", self.bearer())[2].decode().splitlines():
            if line.startswith(f"lumend_{name} "):
                return float(line.split()[1])
        raise AssertionError(f"no metric {name}")

    def assert_well(self):
        """The daemon is up and correct for others, whose address has begun no handshakes."""
        assert self.process.poll() is None, "the daemon is gone"
        assert self.get("/healthz")[0] == 200
        ws = self.connect(source="127.0.0.100")
        assert "scene_rev" in ws.call("scene.get") if not os.environ.get("LUMEND_FAKE") else True
        ws.close()

    def rss_bytes(self):
        with open(f"/proc/{self.process.pid}/statm", encoding="ascii") as statm:
            return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
