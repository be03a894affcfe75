"""TLS by the daemon itself (--tls-cert, --tls-key): what is spoken, what is refused, and certificates that are renewed.

Other tests run by TLS, too, where LUMEND_TEST_TLS is set (e2e.abuse_tls and others of CMakeLists.txt).
"""
import ctypes
import ctypes.util
import http.client
import os
import select
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from access_test import SECURITY_HEADERS
from authority import Authority, openssl
from daemon import LUMEND, SANITIZE, Daemon, write_people
from wsclient import LAST_TILE, WAIT_S, HandshakeFailed, WebSocket, connect_tcp, read_to_end, tile_header

PYTHON = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", "clients", "python"))
sys.path.insert(0, PYTHON)
import lumend

NAME = "lights.example"
BURST, PER_S = 128, 4  # LUM_LIMIT_HANDSHAKES_IP_BURST, LUM_LIMIT_HANDSHAKES_IP_PER_S
KEY_CHANGES = 32       # LUM_LIMIT_KEY_CHANGES
REPLAY = os.environ.get("LUMEND_REPLAY")


def serve(*options, environment=None):
    """A daemon that is expected not to start: (exit status, what it said)."""
    done = subprocess.run([LUMEND, "serve", "--listen", "127.0.0.1:0", *options], capture_output=True, text=True,
                          timeout=WAIT_S, env={**os.environ, **(environment or {})})
    return done.returncode, done.stderr


def read(path):
    with open(path, "rb") as file:
        return file.read()


class KeyChanger:
    """A client of TLS 1.3 that says nothing but new keys (RFC 8446, 4.6.3), which Python's ssl cannot."""

    def __init__(self, sock):
        name = ctypes.util.find_library("ssl")
        self.lib = name and ctypes.CDLL(name)
        if not self.lib:
            raise unittest.SkipTest("no libssl to be called")
        for function in ("TLS_client_method", "SSL_CTX_new", "SSL_new"):
            getattr(self.lib, function).restype = ctypes.c_void_p
        self.context = ctypes.c_void_p(self.lib.SSL_CTX_new(ctypes.c_void_p(self.lib.TLS_client_method())))
        self.ssl = ctypes.c_void_p(self.lib.SSL_new(self.context))
        sock.settimeout(None)  # the library waits in its own way
        assert self.lib.SSL_set_fd(self.ssl, sock.fileno()) == 1
        assert self.lib.SSL_connect(self.ssl) == 1

    def change(self, answered):
        """answered: the server has to do so, too. False: it has hung up."""
        ok = self.lib.SSL_key_update(self.ssl, int(answered)) == 1 and self.lib.SSL_do_handshake(self.ssl) == 1
        self.lib.ERR_clear_error()  # Python's own connections would find it
        return ok

    def is_served(self):
        request, answer = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n", b""
        n = self.lib.SSL_write(self.ssl, request, len(request))
        while n > 0 and not answer.endswith(b"\r\n\r\nok\n"):
            part = ctypes.create_string_buffer(4096)
            n = self.lib.SSL_read(self.ssl, part, len(part))
            answer += part.raw[:max(n, 0)]
        self.lib.ERR_clear_error()
        return n > 0

    def close(self):
        self.lib.SSL_free(self.ssl)
        self.lib.SSL_CTX_free(self.context)


class WithAuthority(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.authority = Authority(self.folder)
        self.trust = self.authority.trust()

    def serve(self, pair, *options, **more):
        return self.enterContext(Daemon("--tls-cert", pair[0], "--tls-key", pair[1], *options, trust=self.trust, **more))

    def write(self, name, *texts, mode=0o600):
        path = os.path.join(self.folder, name)
        with open(path, "wb") as file:
            for text in texts:
                file.write(text if isinstance(text, bytes) else read(text))
        os.chmod(path, mode)
        return path


class Spoken(WithAuthority):
    def setUp(self):
        super().setUp()
        self.daemon = self.serve(self.authority.issue("daemon", f"DNS:{NAME},DNS:localhost,IP:127.0.0.1"), "--allow-host", NAME)

    def tls(self, trust=None, name="127.0.0.1"):
        """A connection after its handshake."""
        return (trust or self.trust).wrap_socket(connect_tcp(self.daemon.port), server_hostname=name)

    def get(self, path, host, headers=None):
        """As a browser that came by this name."""
        connection = http.client.HTTPSConnection("127.0.0.1", self.daemon.port, timeout=WAIT_S, context=self.trust)
        connection.sock = self.tls(name=NAME)
        connection.request("GET", path, headers={"Host": host, **(headers or {})})
        response = connection.getresponse()
        response.read()
        connection.close()
        return response.status, {k.lower(): v for k, v in response.getheaders()}

    def test_a_session_and_a_picture(self):
        self.assertTrue(self.daemon.ready_line.startswith("lumend ready https://127.0.0.1:"), self.daemon.ready_line)
        ws = self.daemon.connect(origin=f"https://127.0.0.1:{self.daemon.port}")
        ws.call("view.open", {"size": [320, 200], "camera_id": "main", "codec": "rgba8"})
        while not any(tile_header(tile)["flags"] & LAST_TILE for tile in ws.binaries):
            ws.pump()
        self.assertGreater(sum(map(len, ws.binaries)), 320 * 200 * 4)
        ws.leave()
        self.daemon.assert_well()

    def test_only_what_is_safe_is_spoken(self):
        for version in (ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3):
            self.trust.minimum_version = self.trust.maximum_version = version
            with self.tls() as sock:
                cipher, spoken, _ = sock.cipher()
                self.assertEqual((sock.version(), sock.compression()), (spoken, None))
                self.assertRegex(cipher, "GCM|CHACHA20")
        self.trust.minimum_version, self.trust.maximum_version = ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.MAXIMUM_SUPPORTED
        self.trust.set_alpn_protocols(["h2", "http/1.1"])
        with self.tls() as sock:
            self.assertEqual(sock.selected_alpn_protocol(), "http/1.1")

    def test_what_is_old_is_refused(self):
        for version, ciphers in ((ssl.TLSVersion.TLSv1, "ALL:@SECLEVEL=0"), (ssl.TLSVersion.TLSv1_1, "ALL:@SECLEVEL=0"),
                                 (ssl.TLSVersion.TLSv1_2, "AES128-SHA:AES256-GCM-SHA384:@SECLEVEL=0"),
                                 (ssl.TLSVersion.TLSv1_2, "ECDHE-ECDSA-AES128-SHA256:@SECLEVEL=0")):
            old = self.authority.trust()
            old.set_ciphers(ciphers)
            old.minimum_version = old.maximum_version = version
            with self.assertRaises((ssl.SSLError, ConnectionError), msg=(version, ciphers)):
                self.tls(old)
        self.daemon.assert_well()

    def test_no_session_is_taken_up_and_no_handshake_is_begun_anew(self):
        self.trust.maximum_version = ssl.TLSVersion.TLSv1_2
        with self.tls() as sock:
            self.assertEqual(sock.session.has_ticket, False)
            session = sock.session
        with self.trust.wrap_socket(connect_tcp(self.daemon.port), server_hostname="127.0.0.1", session=session) as sock:
            self.assertFalse(sock.session_reused)
        done = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{self.daemon.port}", "-tls1_2", "-legacy_renegotiation"],
                              input=b"R\n", capture_output=True, timeout=WAIT_S)  # R: begins a new handshake
        self.assertIn(b"no renegotiation", done.stderr)
        self.daemon.assert_well()

    def test_headers(self):
        """Strict-Transport-Security speaks for all ports of a name: only who is reached by the default one says it."""
        port = self.daemon.port
        for path, status in (("/", 200), ("/healthz", 200), ("/nothing", 404)):
            for host, pinned in ((NAME, True), (f"{NAME}:443", True), (f"{NAME}:{port}", False), ("localhost", False),
                                 (f"localhost:{port}", False), ("127.0.0.1", False), ("[::1]", False)):
                answered, headers = self.get(path, host)
                self.assertEqual(answered, status)
                for name, value in SECURITY_HEADERS.items():
                    self.assertEqual(headers[name], value, name)
                self.assertEqual(headers.get("strict-transport-security"), "max-age=31536000" if pinned else None, host)
        status, headers = self.get("/", "evil.example")
        self.assertEqual((status, headers.get("strict-transport-security")), (403, None))
        with Daemon("--allow-host", NAME, trust=None) as clear:  # where it would be a lie
            self.assertNotIn("strict-transport-security", clear.get("/", {"Host": NAME})[1])

    def test_its_own_pages_come_by_https_alone(self):
        port = self.daemon.port
        self.daemon.connect(origin=f"https://{NAME}:{port}", host=f"{NAME}:{port}").leave()
        for origin in (f"http://127.0.0.1:{port}", "https://evil.example", "null"):
            with self.assertRaises(HandshakeFailed) as caught:
                self.daemon.connect(origin=origin)
            self.assertEqual(caught.exception.status, 403, origin)

    def test_clear_text_is_hung_up_on(self):
        for text in (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", b"\0" * 300, os.urandom(5000), b"\x16\x03\x01\xff\xff" + bytes(4096)):
            with connect_tcp(self.daemon.port) as sock:
                sock.sendall(text)
                self.assertNotIn(b"HTTP", read_to_end(sock))  # ends, or its own time-out fails the test
        with self.assertRaises(HandshakeFailed):
            WebSocket(self.daemon.port)
        self.daemon.assert_well()

    def test_who_is_silent_does_not_hold_up_the_end(self):
        """The clock is another daemon, which gives a guest 5 s to say hello."""
        ws = self.daemon.connect()
        with Daemon(trust=None) as other:
            self.daemon.process.send_signal(signal.SIGTERM)
            guest = WebSocket(other.port)
            self.assertEqual(self.daemon.process.wait(WAIT_S), 0)
            self.assertEqual(select.select([guest.sock], [], [], 0)[0], [], "it was waited for")
        ws.wait_notification("session.closing")  # it is told all the same
        self.assertEqual(ws.wait_close(), 1012)

    def test_health_and_metrics(self):
        self.assertEqual(self.daemon.get("/healthz")[2], b"ok\n")
        self.assertEqual(self.daemon.get("/metrics")[0], 401)
        left_s = self.daemon.metric("tls_certificate_ends_seconds") - time.time()
        self.assertTrue(19 * 86400 < left_s <= 20 * 86400, left_s)
        listen = ["--listen", f"127.0.0.1:{self.daemon.port}"]
        secure = [f"--tls-{kind}={path}" for kind, path in zip(("cert", "key"), self.authority.issue("other"))]
        for options, status in ((secure, 0), ([], 1)):
            asked = subprocess.run([LUMEND, "--healthcheck", *listen, *options], capture_output=True, timeout=WAIT_S)
            self.assertEqual(asked.returncode, status, asked.stderr)

    def client_hello(self):
        sent = ssl.MemoryBIO()
        try:
            self.trust.wrap_bio(ssl.MemoryBIO(), sent, server_hostname="127.0.0.1").do_handshake()
        except ssl.SSLWantReadError:
            return sent.read()

    def test_handshakes_that_never_end(self):
        """Each is closed; more than there are places for shut nobody out, and who is in stays."""
        good = self.daemon.connect()
        hello = self.client_hello()
        starts = (b"", hello[:1], hello[:5], hello[:-1], hello)
        ends = []
        for start in starts:
            ends.append(connect_tcp(self.daemon.port))
            ends[-1].sendall(start)
        ends.append(self.tls())  # and one that says nothing after it
        for sock in ends:
            read_to_end(sock)  # ends, or its own time-out fails the test
            sock.close()
        many = []
        for i in range(256 + 64):
            many.append(connect_tcp(self.daemon.port, source=f"127.0.0.{2 + i % 7}"))
            try:
                many[-1].sendall(starts[i % len(starts)])
            except ConnectionError:
                pass
        for source in ("127.0.0.1", "127.0.0.2", "127.0.0.99"):
            ws = self.daemon.connect(source=source)
            ws.call("stats.get")
            ws.leave()
        good.call("scene.get")
        self.assertGreater(self.daemon.metric("connections_turned_out_total"), 64)
        for sock in many:
            sock.close()

    def test_a_flood_of_handshakes(self):
        """Of one address: it gets its share of the server's time, others are served in between."""
        good, begin, tried, done = self.daemon.connect(), time.monotonic(), 0, 0
        while tried < 2 * BURST or done < BURST:
            with connect_tcp(self.daemon.port, source="127.0.0.2") as sock:
                tried += 1
                try:
                    self.trust.wrap_socket(sock, server_hostname="127.0.0.1").close()
                    done += 1
                except (ssl.SSLError, ConnectionError):
                    pass
            if tried % 32 == 0:
                good.call("stats.get")
                self.assertEqual(self.daemon.get("/healthz")[0], 200)
        self.assertLessEqual(done, BURST + PER_S * (time.monotonic() - begin))
        self.assertGreaterEqual(self.daemon.metric("tls_handshakes_refused_total"), tried - done)
        self.daemon.assert_well()

    def test_a_flood_of_new_keys(self):
        """So many are enough for any connection: who sends more is cut off, and nobody waits for that."""
        good = self.daemon.connect()
        for answered in (False, True):
            with connect_tcp(self.daemon.port, source="127.0.0.2") as sock:
                changer, n = KeyChanger(sock), 0
                while n <= 2 * KEY_CHANGES and changer.is_served():
                    for _ in range(KEY_CHANGES // 4):  # what of them comes too late is never known
                        n += changer.change(answered)
                    good.call("stats.get")
                changer.close()
            self.assertEqual(n // KEY_CHANGES, 1)
        self.daemon.assert_well()

    def test_a_dribbled_handshake_is_cut_off(self):
        hello = self.client_hello()
        with connect_tcp(self.daemon.port) as sock:
            sock.settimeout(0.5)
            cut = False
            for byte in hello[:100]:  # the time-out is the pace
                try:
                    sock.sendall(bytes([byte]))
                    cut = sock.recv(1) == b""
                except TimeoutError:
                    continue
                except ConnectionError:
                    cut = True
                if cut:
                    break
            self.assertTrue(cut, "a dribbled handshake was never cut off")


class Clients(WithAuthority):
    def setUp(self):
        super().setUp()
        self.daemon = self.serve(self.authority.issue("daemon", "DNS:localhost"))
        self.url = f"https://localhost:{self.daemon.port}/#t={self.daemon.token}"

    def test_python(self):
        with lumend.connect(self.url, ca=self.authority.certificate) as session:
            with session.edit() as edit:
                edit.set("ceiling-panel", flux_lm=2000)
            self.assertGreater(session.view(160, 120, spp=1).picture().width, 0)
            answers = []
            several = [threading.Thread(target=lambda: answers.extend(session.call("scene.get")["scene_rev"] for _ in range(50)))
                       for _ in range(4)]
            for thread in several:
                thread.start()
            for thread in several:
                thread.join()
            self.assertEqual(len(answers), 200)
        for url, ca, kind, part in ((self.url, None, lumend.Disconnected, "is not trusted"),
                                    (self.url, Authority(self.folder, "stranger").certificate, lumend.Disconnected, "is not trusted"),
                                    (self.url.replace("localhost", "127.0.0.1"), self.authority.certificate, lumend.Disconnected, "is not trusted"),
                                    (self.url, "/nothing", ValueError, "no such file"),
                                    (self.url.replace("https", "http"), self.authority.certificate, ValueError, "ca=.* is for https"),
                                    (self.url.replace("https", "http"), None, lumend.Disconnected, "does its address begin with https|something else")):
            with self.assertRaisesRegex(kind, part, msg=url):
                lumend.connect(url, ca=ca)

    def test_the_smallest(self):
        client = os.path.join(PYTHON, "..", "minimal", "client.py")
        picture = os.path.join(self.folder, "picture.png")
        subprocess.run([sys.executable, client, self.url, picture, "ceiling-panel", "5500"], check=True, timeout=10 * WAIT_S,
                       env={**os.environ, "SSL_CERT_FILE": self.authority.certificate}, capture_output=True)
        self.assertEqual(read(picture)[:4], b"\x89PNG")

    def replay(self, *options, url=None):
        return subprocess.run([REPLAY, "--url", url or f"wss://localhost:{self.daemon.port}", "--token", self.daemon.token,
                               "--camera-orbit", "2", "--view-size", "64x48", "--timeout", "20", *options], capture_output=True,
                              text=True, timeout=WAIT_S)

    @unittest.skipUnless(REPLAY, "LUMEND_REPLAY names lumend-replay")
    def test_replay(self):
        done = self.replay("--ca", self.authority.certificate)
        self.assertEqual(done.returncode, 0, done.stderr)
        for options, url, part in (((), None, "whom --ca names"),
                                   (("--ca", Authority(self.folder, "stranger").certificate), None, "whom --ca names"),
                                   (("--ca", self.authority.certificate), f"wss://127.0.0.1:{self.daemon.port}", "whom --ca names"),
                                   (("--ca", "/nothing"), None, "the file of --ca cannot be read"),
                                   (("--ca", self.authority.certificate), f"ws://localhost:{self.daemon.port}", "--ca is for wss://")):
            done = self.replay(*options, url=url)
            self.assertEqual(done.returncode, 1, (options, done.stdout))
            self.assertIn(part, done.stderr)


class Start(WithAuthority):
    """What is wrong is told before anything is served: which file, and why."""

    def refused(self, cert, key, *parts):
        status, said = serve(f"--tls-cert={cert}", f"--tls-key={key}")
        self.assertEqual(status, 1, said)
        self.assertEqual(len(said.splitlines()), 1, said)
        for part in parts:
            self.assertIn(part, said)

    def test_both_or_neither(self):
        cert, key = self.authority.issue("daemon")
        for options, environment, part in (([f"--tls-cert={cert}"], {}, "--tls-cert goes with --tls-key, which is missing"),
                                           ([f"--tls-key={key}"], {}, "--tls-key goes with --tls-cert, which is missing"),
                                           ([], {"LUMEND_TLS_KEY": key}, "$LUMEND_TLS_KEY goes with --tls-cert, which is missing")):
            status, said = serve(*options, environment=environment)
            self.assertEqual(status, 2, said)
            self.assertIn(part, said)

    def test_files_that_are_wrong(self):
        cert, key = self.authority.issue("daemon")
        other_cert, other_key = self.authority.issue("other")
        empty, junk = self.write("empty", b""), self.write("junk", b"no pem\n" * 10)
        cut = self.write("cut", read(cert)[:-60])
        second = self.write("second", cert, read(other_cert).replace(b"MII", b"MXX", 1))
        locked = os.path.join(self.folder, "locked")
        openssl("pkey", "-in", key, "-aes256", "-passout", "pass:x", "-out", locked)
        os.chmod(locked, 0o600)
        large = self.write("large", b"x" * 300000)
        many = self.write("many", *[cert] * 20)
        torn = self.write("torn", read(key)[:100])
        missing = os.path.join(self.folder, "missing")
        for wrong, part in ((missing, "No such file"), (self.folder, "Is a directory"), (empty, "has no certificate in PEM"),
                            (junk, "has no certificate in PEM"), (key, "has no certificate in PEM"), (cut, "cannot be read"),
                            (second, "certificate 2 cannot be read"), (large, "at most 256 KiB"), (many, "more than 16 certificates")):
            self.refused(wrong, key, wrong, part)
        for wrong, part in ((missing, "No such file"), (self.folder, "Is a directory"), (empty, "has no private key in PEM"),
                            (junk, "has no private key in PEM"), (torn, "its private key cannot be read"), (locked, "passphrase"), (large, "at most 256 KiB")):
            self.refused(cert, wrong, wrong, part)
        self.refused(cert, other_key, other_key, cert, "is not that of the certificate")
        weak = self.authority.issue("weak", key=("rsa", "rsa_keygen_bits:1024"))
        self.refused(*weak, weak[0], "key too small")

    def test_a_key_that_others_may_read(self):
        cert, key = self.authority.issue("daemon")
        mine = os.getuid() != 0
        for mode, ok in ((0o644, False), (0o604, False), (0o660, False), (0o640, not mine), (0o400, True)):
            os.chmod(key, mode)
            if not ok:
                self.refused(cert, key, key, f"its mode is {mode:03o}", "chmod 600")
                continue
            with Daemon("--tls-cert", cert, "--tls-key", key, trust=self.trust) as daemon:
                self.assertEqual(daemon.get("/healthz")[0], 200)

    def test_what_may_be_wrong_is_told(self):
        cert, key = self.authority.issue("old", days="0")
        with Daemon("--tls-cert", cert, "--tls-key", key, "--allow-host", f"localhost,{NAME}", trust=None) as daemon:
            said = daemon.read_log()
            self.assertIn(f"level=warning at=tls text=\"{cert}: its time is over", said)
            self.assertIn(f"{cert} is not for {NAME}", said)
            self.assertNotIn("is not for localhost", said)
            with self.assertRaisesRegex(ssl.SSLCertVerificationError, "expired"):
                self.trust.wrap_socket(connect_tcp(daemon.port), server_hostname="localhost")
        cert, key = self.authority.issue("soon", days="5")
        with Daemon("--tls-cert", cert, "--tls-key", key, trust=None) as daemon:
            self.assertRegex(daemon.read_log(), "its time ends in [45] days")

    def test_clear_text_beyond_this_machine_is_told(self):
        token = self.write("token", b"t" * 32)
        pair = ["--{}={}".format(*pair) for pair in zip(("tls-cert", "tls-key"), self.authority.issue("daemon"))]
        for listen, options, told in (("0.0.0.0:0", [], True), ("0.0.0.0:0", pair, False), ("127.0.0.1:0", [], False)):
            with Daemon("--token-file", token, *options, listen=listen, trust=None) as daemon:
                daemon.process.send_signal(signal.SIGTERM)
                daemon.process.wait(WAIT_S)  # it says so after the line that this waited for
                self.assertEqual("clear text beyond this machine" in daemon.read_log(), told, (listen, options))

    def test_the_printed_address_is_one_of_the_certificate(self):
        for names, options, host in (("IP:127.0.0.1", ["--allow-host", NAME], "127.0.0.1"),
                                     (f"DNS:{NAME}", ["--allow-host", f"other.example,{NAME}"], NAME),
                                     (f"DNS:*.{NAME}", ["--allow-host", f"a.{NAME}"], f"a.{NAME}"),
                                     ("DNS:localhost", [], "localhost"), ("DNS:elsewhere.example", [], "127.0.0.1")):
            cert, key = self.authority.issue("named", names)
            with Daemon("--tls-cert", cert, "--tls-key", key, *options, trust=None) as daemon:
                self.assertEqual(daemon.host, host, names)


class Renewed(WithAuthority):
    def setUp(self):
        super().setUp()
        self.served = tuple(os.path.join(self.folder, f"served.{kind}") for kind in ("pem", "key"))
        self.install("first")

    def install(self, name, **more):
        for made, served in zip(self.authority.issue(name, **more), self.served):
            shutil.copy(made, served)  # with its mode

    def name_of(self, daemon):
        with self.trust.wrap_socket(connect_tcp(daemon.port), server_hostname="127.0.0.1") as sock:
            return dict(pair for part in sock.getpeercert()["subject"] for pair in part)["commonName"]

    def wait_for(self, daemon, name):
        """The thread of signals says that it is there, and then wakes that of the network."""
        for _ in range(1000):
            if self.name_of(daemon) == name:
                return
        self.fail(f"new connections have {self.name_of(daemon)}, not {name}")

    def hang_up(self, daemon, said):
        """SIGHUP, until the log says so."""
        before = daemon.read_log().count(said)
        daemon.process.send_signal(signal.SIGHUP)
        while daemon.read_log().count(said) == before:
            self.assertIsNone(daemon.process.poll())

    def test_a_renewed_certificate_is_for_new_connections(self):
        daemon = self.serve(self.served)
        old = daemon.connect()
        self.assertEqual(self.name_of(daemon), "first")
        for name, more in (("second", {}), ("third", {"key": ("rsa", "rsa_keygen_bits:2048")}), ("fourth", {})):
            self.install(name, **more)  # another kind of key does not stand beside the one before
            self.hang_up(daemon, "new connections have the certificate")
            self.wait_for(daemon, name)
            old.call("scene.get")
        new = daemon.connect()
        for ws in (new, old):
            ws.call("scene.get")
            ws.leave()

    def test_one_that_is_wrong_changes_nothing(self):
        daemon = self.serve(self.served)
        for change, part in ((lambda: os.remove(self.served[1]), "No such file"),
                             (lambda: self.write("served.key", b"junk"), "has no private key"),
                             (lambda: shutil.copy(self.authority.issue("stray")[1], self.served[1]), "is not that of the certificate")):
            change()
            self.hang_up(daemon, "the certificate stays the one that it was")
            self.assertIn(part, daemon.read_log())
            self.assertEqual(self.name_of(daemon), "first")

    def test_with_people_both_are_read(self):
        people = os.path.join(self.folder, "people")
        write_people(people, {"ann": ("edit", "a" * 32)})
        daemon = self.serve(self.served, "--tokens", people)
        ann = daemon.connect(hello=False)
        ann.hello("a" * 32)
        self.install("second")
        write_people(people, {"ann": ("edit", "a" * 32), "ben": ("view", "b" * 32)})
        self.hang_up(daemon, "new connections have the certificate")
        self.assertIn("SIGHUP: 2 people may connect", daemon.read_log())
        self.wait_for(daemon, "second")
        ann.call("scene.get")

    def test_a_chain_is_sent(self):
        """Of a certificate that another signed than the one that is trusted."""
        between = Authority(self.folder, "between")
        request, more = (os.path.join(self.folder, name) for name in ("between.csr", "between.ext"))
        openssl("req", "-new", "-key", between._key, "-subj", "/CN=between", "-out", request)
        with open(more, "w", encoding="ascii") as file:
            file.write("basicConstraints=critical,CA:TRUE\nkeyUsage=critical,keyCertSign\n")
        openssl("x509", "-req", "-in", request, "-CA", self.authority.certificate, "-CAkey", self.authority._key,
                "-CAcreateserial", "-days", "20", "-extfile", more, "-out", between.certificate)
        cert, key = between.issue("leaf")
        whole = self.write("whole.pem", cert, between.certificate)
        with Daemon("--tls-cert", cert, "--tls-key", key, trust=None) as daemon:
            with self.assertRaises(ssl.SSLCertVerificationError):
                self.name_of(daemon)
        self.assertEqual(self.name_of(self.serve((whole, key))), "leaf")


if __name__ == "__main__":
    if not shutil.which("openssl"):
        print("skipped: openssl makes the certificates, and is not installed")
    elif "without TLS" in serve("--tls-cert=/nothing", "--tls-key=/nothing")[1]:
        print("skipped: this lumend was built without TLS")
    else:
        # TLS is of one thread, but for certificates that are read again.
        unittest.main(defaultTest="Renewed" if "thread" in SANITIZE else None)
