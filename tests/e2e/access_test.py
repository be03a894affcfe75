"""Who may connect: token, Origin, Host, time to say hello; and what HTTP answers."""
import os
import re
import tempfile
import unittest

from daemon import Daemon
from wsclient import Closed, HandshakeFailed, RpcError, WebSocket, connect_tcp

TOKEN = "a-token.of_20~characters"
# Of every answer, whatever it is. What the page may load comes from its own server, and nobody may frame it.
SECURITY_HEADERS = {
    "content-security-policy":
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
        "worker-src 'self' blob:; font-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=(), payment=(), usb=()",
}


class Token(unittest.TestCase):
    def setUp(self):
        self.daemon = self.enterContext(Daemon())

    def test_hello_gives_the_session_and_its_limits(self):
        ws = WebSocket(self.daemon.port)
        hello = ws.hello(self.daemon.token, client="me & you")
        self.assertEqual(hello["protocol"], 1)
        self.assertEqual(hello["role"], "edit")
        self.assertRegex(hello["session"], r"^me___you\.[0-9-]+$")
        limits = hello["limits"]
        self.assertEqual((limits["message_bytes"], limits["bytes_per_s"], limits["burst_bytes"]), (8 << 20, 4 << 20, 16 << 20))
        self.assertEqual((limits["undo_steps"], limits["undo_bytes"]), (256, 512 << 20))
        self.assertIsInstance(hello["scene_rev"], int)
        self.assertIs(hello["imports"], False)

    def test_hello_says_whether_models_can_be_imported(self):
        with tempfile.TemporaryDirectory() as folder:
            for assets, imports in ((folder, True), (os.path.join(folder, "none"), False)):
                with Daemon("--assets", assets) as daemon:
                    self.assertIs(WebSocket(daemon.port).hello(daemon.token)["imports"], imports)

    def test_wrong_tokens_are_refused_and_closed(self):
        right = self.daemon.token
        first, last = ("x" if c != "x" else "y" for c in (right[0], right[-1]))
        for token in (None, "", "x", right[:-1], right + "x", first + right[1:], right[:-1] + last, right.upper(), "y" * 256):
            ws = WebSocket(self.daemon.port)
            with self.assertRaises(RpcError) as caught:
                ws.hello(token)
            self.assertEqual(caught.exception.app, "not_authorised", token)
            self.assertEqual(ws.wait_close(), 4001, token)
        self.daemon.assert_well()
        log = self.daemon.read_log()
        self.assertIn("127.0.0.1 turned away: no token", log)
        self.assertNotIn(right[:-1], log)

    def test_token_of_a_wrong_type_is_an_error_and_not_a_login(self):
        for token in (5, True, [], {}, [self.daemon.token], "z" * 257):
            ws = WebSocket(self.daemon.port)
            with self.assertRaises(RpcError) as caught:
                ws.hello(token)
            self.assertIn(caught.exception.code, (-32602, -32700), token)
            with self.assertRaises(RpcError) as caught:
                ws.call("scene.get")
            self.assertEqual(caught.exception.app, "not_authorised")
            self.assertIn("session", ws.hello(self.daemon.token))  # the connection lives, and may still say it right

    def test_nothing_is_answered_before_hello(self):
        ws = WebSocket(self.daemon.port)
        for method in ("scene.get", "scene.apply", "view.open", "frame.ack", "stats.get", "nonsense"):
            with self.assertRaises(RpcError) as caught:
                ws.call(method, {})
            self.assertEqual(caught.exception.app, "not_authorised", method)
        self.assertIn("session", ws.hello(self.daemon.token))
        with self.assertRaises(RpcError) as caught:
            ws.hello(self.daemon.token)
        self.assertEqual(caught.exception.app, "conflict")
        ws.call("scene.get")

    def test_no_hello_is_closed_and_others_go_on(self):
        silent, chatty = WebSocket(self.daemon.port), WebSocket(self.daemon.port)
        good = self.daemon.connect()
        with self.assertRaises(Closed) as caught:
            while True:  # talking without hello does not put off the deadline
                try:
                    chatty.call("scene.get")
                except RpcError:
                    pass
        self.assertEqual(caught.exception.code, 4001)
        self.assertEqual(silent.wait_close(), 4001)
        good.call("scene.get")


class OriginAndHost(unittest.TestCase):
    def setUp(self):
        self.daemon = self.enterContext(
            Daemon("--allow-host", "render.example,other.example", "--allow-origin", "https://desk.example"))
        self.port = self.daemon.port

    def status(self, **options):
        """Of a handshake and of a page with these headers: they must agree."""
        headers = {"Host": options["host"] if "host" in options else f"127.0.0.1:{self.port}", **self.daemon.bearer()}
        if "origin" in options:
            headers["Origin"] = options["origin"]
        pages = {self.daemon.get(path, headers)[0] for path in ("/", "/metrics", "/healthz", "/readyz")}
        self.assertEqual(len(pages), 1, options)
        try:
            WebSocket(self.port, **options).close()
            status = 101
        except HandshakeFailed as failed:
            status = failed.status
        self.assertEqual((pages.pop(), status), (200, 101) if status == 101 else (403, 403), options)
        return status

    def test_allowed(self):
        port = self.port
        for options in ({}, {"host": f"localhost:{port}"}, {"host": "LOCALHOST"}, {"host": f"[::1]:{port}"},
                        {"host": "render.example"}, {"host": f"Other.Example:{port}"}, {"host": "127.1.2.3:1"},
                        {"origin": f"http://127.0.0.1:{port}"},
                        {"origin": f"http://localhost:{port}", "host": f"localhost:{port}"},
                        {"origin": "https://render.example", "host": "render.example"},
                        {"origin": "https://desk.example"}):
            self.assertEqual(self.status(**options), 101, options)

    def test_refused(self):
        port = self.port
        for options in ({"host": "evil.example"}, {"host": f"evil.example:{port}"}, {"host": "127.0.0.1.evil.example"},
                        {"host": "render.example.evil.example"}, {"host": "xrender.example"}, {"host": "10.0.0.1"},
                        {"host": "[fe80::1]"}, {"host": "localhost:port"}, {"host": "localhost:80:80"},
                        {"host": "user@localhost"}, {"host": "[::1"}, {"host": "a" * 290},
                        {"origin": "http://evil.example"}, {"origin": "null"}, {"origin": f"http://127.0.0.1:{port + 1}"},
                        {"origin": f"http://localhost:{port}"}, {"origin": "http://127.0.0.1"},
                        {"origin": f"ftp://127.0.0.1:{port}"}, {"origin": "https://desk.example.evil.example"},
                        {"origin": "https://render.example"}, {"origin": f"http://127.0.0.1:{port}@evil.example"},
                        {"origin": "http://" + "a" * 290}):
            self.assertEqual(self.status(**options), 403, options)
        self.daemon.assert_well()

    def test_no_host_at_all(self):
        sock = connect_tcp(self.port)
        sock.sendall(b"GET / HTTP/1.1\r\n\r\n")
        self.assertIn(b" 403 ", sock.recv(100))


class Pages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = cls.enterClassContext(Daemon())

    def test_the_client_and_its_security_headers(self):
        status, headers, body = self.daemon.get("/")
        self.assertEqual(status, 200)
        self.assertIn(b"<html", body)
        policy = headers["content-security-policy"]
        for part in ("default-src 'none'", "script-src 'self'", "frame-ancestors 'none'", "base-uri 'none'"):
            self.assertIn(part, policy)
        self.assertNotIn("unsafe", policy)
        self.assertEqual(headers["x-content-type-options"], "nosniff")
        self.assertEqual(headers["referrer-policy"], "no-referrer")
        self.assertNotIn("access-control-allow-origin", headers)
        self.assertEqual(int(headers["content-length"]), len(body))
        self.assertNotIn(self.daemon.token.encode(), body)

    def test_every_answer_has_the_security_headers(self):
        _, page, _ = self.daemon.get("/")
        script = re.search(rb'src="(/assets/[^"]+\.js)"', self.daemon.get("/")[2])
        asked = [("/", {}, "GET", 200), ("/", {}, "HEAD", 200), ("/", {"If-None-Match": page["etag"]}, "GET", 304),
                 ("/healthz", {}, "GET", 200), ("/readyz", {}, "GET", 200), ("/metrics", self.daemon.bearer(), "GET", 200),
                 ("/metrics", {}, "GET", 401), ("/nothing", {}, "GET", 404), ("/", {}, "POST", 405),
                 ("/", {"Host": "evil.example"}, "GET", 403), ("/", {"Origin": "http://evil.example"}, "GET", 403)]
        asked += [(script[1].decode(), {}, "GET", 200)] if script else []
        for path, headers, method, expected in asked:
            status, answered, _ = self.daemon.get(path, headers, method)
            self.assertEqual(status, expected, path)
            for name, value in SECURITY_HEADERS.items():
                self.assertEqual(answered.get(name), value, f"{method} {path} {headers}: {name}")
            for name in ("access-control-allow-origin", "set-cookie", "x-powered-by"):
                self.assertNotIn(name, answered)

    def test_etag(self):
        _, headers, body = self.daemon.get("/")
        self.assertEqual(self.daemon.get("/", {"If-None-Match": headers["etag"]})[::2], (304, b""))
        self.assertEqual(self.daemon.get("/", {"If-None-Match": '"0"'})[::2], (200, body))

    def test_head_has_the_headers_and_no_body(self):
        status, headers, body = self.daemon.get("/", method="HEAD")
        self.assertEqual((status, body), (200, b""))
        self.assertEqual(headers["content-length"], self.daemon.get("/")[1]["content-length"])

    def test_health_and_metrics(self):
        self.assertEqual(self.daemon.get("/healthz")[0], 200)
        self.assertEqual(self.daemon.get("/readyz")[0], 200)
        status, headers, body = self.daemon.get("/metrics", self.daemon.bearer())
        self.assertEqual(status, 200)
        self.assertTrue(headers["content-type"].startswith("text/plain; version=0.0.4"))
        for line in body.decode().splitlines():
            self.assertRegex(line, r"^(# (HELP|TYPE) lumend_[a-z_]+ .+|lumend_[a-z_]+(\{.*\})? [0-9.e+-]+)$")
        before = self.daemon.metric("sessions_total")
        self.daemon.connect().close()
        self.assertEqual(self.daemon.metric("sessions_total"), before + 1)

    def test_metrics_need_the_token(self):
        """What is going on is for those who may edit; whether the server lives is for everybody."""
        right = self.daemon.token
        other = "x" if right[0] != "x" else "y"
        for says in (None, "", "Bearer", "Bearer ", f"Bearer {other}{right[1:]}", f"Bearer {right}x", f"Bearer {right[:-1]}",
                     f"Basic {right}", right, f"Bearer  {right}", f"Bearer {right} {right}", "Bearer " + "y" * 1000):
            for method in ("GET", "HEAD"):
                headers = {"If-None-Match": "*"} | ({} if says is None else {"Authorization": says})
                status, headers, body = self.daemon.get("/metrics", headers, method=method)
                self.assertEqual((status, headers["www-authenticate"]), (401, "Bearer"), says)
                self.assertEqual((b"Authorization: Bearer TOKEN" in body, b"lumend_" in body), (method == "GET", False))
        self.assertEqual(self.daemon.get("/metrics", {"authorization": f"bearer {right}"})[0], 200)
        for path in ("/healthz", "/readyz", "/"):
            self.assertEqual(self.daemon.get(path, {"Authorization": "Bearer x"})[0], 200, path)

    def test_what_is_not_there(self):
        for path in ("/nothing", "/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/assets/", "/" + "a" * 300,
                     "/index.html/"):
            self.assertIn(self.daemon.get(path)[0], (403, 404), path)
        for method in ("POST", "PUT", "DELETE", "OPTIONS"):
            self.assertEqual(self.daemon.get("/", method=method)[0], 405, method)


class Start(unittest.TestCase):
    def test_without_auth_the_url_has_no_fragment(self):
        with Daemon("--no-auth") as daemon:
            self.assertIsNone(daemon.token)
            ws = WebSocket(daemon.port)
            self.assertIn("session", ws.hello(None))
            self.assertEqual(daemon.get("/metrics")[0], 200)

    def test_token_file(self):
        with tempfile.NamedTemporaryFile("w", suffix=".token") as file:
            file.write(TOKEN + "\n")
            file.flush()
            with Daemon("--token-file", file.name) as daemon:
                self.assertEqual(daemon.token, TOKEN)
                daemon.assert_well()
            with Daemon(environment={"LUMEND_TOKEN_FILE": file.name}) as daemon:
                self.assertEqual(daemon.token, TOKEN)
            if os.getuid() == 0:  # what is root's alone may also be read by its group
                os.chown(file.name, 0, 1)
            for mode in (0o666, 0o644, 0o640, 0o620, 0o604, 0o601):
                os.chmod(file.name, mode)
                with self.assertRaisesRegex(AssertionError, f"its mode is {mode:o}, .* chmod 600 {file.name}"):
                    Daemon("--token-file", file.name)
            os.chmod(file.name, 0o400)
            Daemon("--token-file", file.name).stop()

    def test_open_door_is_refused(self):
        with self.assertRaisesRegex(AssertionError, "--no-auth is refused on 0.0.0.0"):
            Daemon("--no-auth", listen="0.0.0.0:0")

    def test_all_addresses_with_a_token(self):
        with Daemon(listen="0.0.0.0:0") as daemon:
            self.assertEqual(daemon.host, "127.0.0.1")
            daemon.assert_well()

    def test_ipv6(self):
        try:
            daemon = Daemon(listen="[::1]:0")
        except AssertionError:
            self.skipTest("no IPv6 here")
        self.assertEqual(daemon.host, "[::1]")
        self.assertEqual(daemon.stop(), 0)

    def test_taken_port(self):
        with Daemon() as daemon:
            with self.assertRaisesRegex(AssertionError, f"cannot listen on 127.0.0.1 port {daemon.port}: another program does"):
                Daemon(listen=f"127.0.0.1:{daemon.port}")
            daemon.assert_well()


if __name__ == "__main__":
    unittest.main()
