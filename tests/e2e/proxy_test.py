"""The reverse proxies of docker/proxy, started for real before one daemon and before three, each at its path: TLS, WebSocket,
headers, files that are sent, and who is turned away.

Where a proxy is not installed its test says so, and is skipped. LUMEND_NGINX and LUMEND_CADDY name the programs.
"""
import http.client
import json
import os
import re
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "clients", "python"))
import lumend
from access_test import SECURITY_HEADERS
from daemon import Daemon
from upload_test import announce
from wsclient import LAST_TILE, WAIT_S, HandshakeFailed, RpcError, WebSocket, connect_tcp, tile_header

FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docker", "proxy")
NAME = "lights.example"


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as sock:
        return sock.getsockname()[1]


class Proxied:
    """One of them, before these daemons."""

    program, option, default = None, None, None

    def setUp(self):
        self.program = os.environ.get(self.option) or shutil.which(self.default) or shutil.which(self.default, path="/usr/sbin")
        if not self.program:
            self.skipTest(f"{self.default} is not installed")
        if not shutil.which("openssl"):
            self.skipTest("openssl makes the certificate, and is not installed")
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.certificate, self.key = (os.path.join(self.folder, name) for name in ("cert.pem", "key.pem"))
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                        "-days", "2", "-subj", f"/CN={NAME}", "-addext", f"subjectAltName=DNS:{NAME},DNS:localhost",
                        "-out", self.certificate, "-keyout", self.key], check=True, capture_output=True)
        self.trust = ssl.create_default_context(cafile=self.certificate)
        self.daemons = self.start_daemons()
        self.http, self.https = free_port(), free_port()
        self.log = open(os.path.join(self.folder, "log"), "w+b")
        self.addCleanup(self.log.close)
        self.process = subprocess.Popen(self.command(), stdout=self.log, stderr=self.log,
                                        env={**os.environ, "HOME": self.folder, "XDG_DATA_HOME": self.folder,
                                             "XDG_CONFIG_HOME": self.folder})
        self.addCleanup(self.end)
        self.wait_open()

    def end(self):
        self.process.terminate()
        self.process.wait(WAIT_S)

    def wait_open(self):
        while True:
            try:
                for port in (self.http, self.https):
                    socket.create_connection(("127.0.0.1", port), WAIT_S).close()
                return
            except ConnectionRefusedError:
                if self.process.poll() is not None:
                    self.log.seek(0)
                    self.fail(f"{self.program} ended: {self.log.read().decode(errors='replace')}")

    def write(self, name, text):
        path = os.path.join(self.folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def shipped(self, name, *changes):
        """The file as it is in docker/proxy, but for these, and where the daemons are. Each must be there."""
        changes += tuple((f"127.0.0.1:{9460 + i}", f"127.0.0.1:{daemon.port}") for i, daemon in enumerate(self.daemons))
        with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
            text = file.read()
        for before, after in changes:
            self.assertIn(before, text)
            text = text.replace(before, after)
        return text

    # ---- what is asked of it ----

    def get(self, path, host=None, method="GET", headers=None, body=None):
        connection = http.client.HTTPSConnection("127.0.0.1", self.https, timeout=WAIT_S, context=self.trust)
        connection.sock = self.trust.wrap_socket(connect_tcp(self.https), server_hostname=NAME)
        connection.request(method, path, body, headers={"Host": host or f"{NAME}:{self.https}", **(headers or {})})
        response = connection.getresponse()
        answer = response.read()
        connection.close()
        return response.status, {k.lower(): v for k, v in response.getheaders()}, answer

    def connect(self, **options):
        host = options.pop("host", f"{NAME}:{self.https}")
        return WebSocket(self.https, host=host, wrap=lambda sock: self.trust.wrap_socket(sock, server_hostname=NAME), **options)


class BeforeOne(Proxied):
    def start_daemons(self):
        self.daemon = self.enterContext(Daemon("--allow-host", NAME))
        return [self.daemon]

    def test_the_page_comes_by_tls_with_its_headers(self):
        direct, through = self.daemon.get("/"), self.get("/")
        self.assertEqual((through[0], through[2]), (200, direct[2]))
        for name, value in SECURITY_HEADERS.items():
            self.assertEqual(through[1][name], value, name)
        self.assertEqual(through[1]["strict-transport-security"], "max-age=31536000")
        self.assertEqual(self.get("/nothing")[0], 404)
        self.assertEqual(self.get("/", headers={"If-None-Match": direct[1]["etag"]})[0], 304)

    def test_clear_text_is_sent_to_tls(self):
        connection = http.client.HTTPConnection("127.0.0.1", self.http, timeout=WAIT_S)
        connection.request("GET", "/", headers={"Host": NAME})
        response = connection.getresponse()
        self.assertEqual(response.status, 308)
        self.assertTrue(response.getheader("location").startswith(f"https://{NAME}"), response.getheader("location"))
        connection.close()

    def test_a_session_by_websocket(self):
        """Edits up to the largest, pictures, and an Origin as browsers send it."""
        ws = self.connect(origin=f"https://{NAME}:{self.https}")
        hello = ws.hello(self.daemon.token)
        ws.call("view.open", {"size": [200, 150], "camera_id": "main", "codec": "rgba8"})
        while not any(tile_header(tile)["flags"] & LAST_TILE for tile in ws.binaries):
            ws.pump()
        self.assertGreater(sum(map(len, ws.binaries)), 200 * 150 * 4)
        ops = [{"op": "add", "type": "sensor", "id": f"s{i}", "kind": "point", "position": [0, 1, 0]} for i in range(60)]
        self.assertEqual(ws.call("scene.apply", {"ops": ops})["scene_rev"], hello["scene_rev"] + 1)
        padded = json.dumps({"jsonrpc": "2.0", "id": 77, "method": "stats.get", "params": {}})
        ws.send_text(padded + " " * ((8 << 20) - len(padded)))  # the longest message that there may be
        self.assertIn("methods", ws.reply(77))
        ws.leave()

    def test_who_is_turned_away(self):
        for options in ({"origin": "https://evil.example"}, {"origin": f"http://{NAME}:{self.https}x"},
                        {"origin": "null"}, {"host": "evil.example"}):
            with self.assertRaises(HandshakeFailed, msg=options) as caught:
                self.connect(**options)
            if "origin" in options:  # another name is not even asked of lumend by each of them
                self.assertEqual(caught.exception.status, 403, options)
        self.assertEqual(self.get("/metrics", headers=self.daemon.bearer())[0], 403)
        ws = self.connect()
        with self.assertRaises(RpcError) as caught:
            ws.hello("a-token-of-nobody-at-all")
        self.assertEqual(caught.exception.app, "not_authorised")
        self.assertEqual(ws.wait_close(), 4001)  # the code comes through

    def test_old_tls_is_refused(self):
        old = ssl.create_default_context(cafile=self.certificate)
        old.minimum_version = ssl.TLSVersion.TLSv1
        old.maximum_version = ssl.TLSVersion.TLSv1_1
        old.set_ciphers("ALL:@SECLEVEL=0")
        with self.assertRaises((ssl.SSLError, ConnectionError)):
            old.wrap_socket(connect_tcp(self.https), server_hostname=NAME)


class BeforeThree(Proxied):
    """Each daemon has its path, and is as if it were alone there."""

    paths = ("/atrium/", "/office/", "/stage/")

    def start_daemons(self):
        return [self.enterContext(Daemon("--allow-host", NAME, "--state", os.path.join(self.folder, str(i)))) for i in range(3)]

    def enter(self, i):
        ws = self.connect(path=f"{self.paths[i]}ws", origin=f"https://{NAME}:{self.https}")
        ws.hello(self.daemons[i].token)
        return ws

    def test_each_path_has_its_page(self):
        for path, daemon in zip(self.paths, self.daemons):
            direct, through = daemon.get("/"), self.get(f"{path}?project=0123456789ab")
            self.assertEqual((through[0], through[2]), (200, direct[2]), path)
            for name, value in SECURITY_HEADERS.items():
                self.assertEqual(through[1][name], value, name)
            for file in re.findall(rb'(?:src|href)="\./([^"]+)"', direct[2]):
                self.assertEqual(self.get(path + file.decode())[::2], (200, daemon.get("/" + file.decode())[2]), file)
            self.assertNotRegex(direct[2], rb'(?:src|href)="/')  # that would be at no path
            status, headers, _ = self.get(path[:-1])  # who forgot the slash
            self.assertIn(status, (301, 308))
            self.assertRegex(headers["location"], f"^(https://{NAME}:{self.https})?{path}$")
            self.assertEqual([self.get(path + name, headers=daemon.bearer())[0] for name in ("readyz", "metrics", "nothing")],
                             [200, 403, 404])
        self.assertEqual([self.get(path)[0] for path in ("/", "/ws", "/metrics", "/cellar/", "/atriums/")], [404] * 5)

    def test_each_has_its_scene_and_its_people(self):
        sessions = [self.enter(i) for i in range(3)]
        for i, ws in enumerate(sessions):
            ws.call("scene.apply", {"ops": [{"op": "add", "type": "sensor", "id": f"s{i}", "kind": "point", "position": [0, 1, 0]}]})
        for i, ws in enumerate(sessions):
            ids = {op.get("id") for op in ws.call("scene.get")["ops"]}
            self.assertEqual(ids & {"s0", "s1", "s2"}, {f"s{i}"})
            stranger = self.connect(path=self.paths[i])
            with self.assertRaises(RpcError) as caught:
                stranger.hello(self.daemons[i - 1].token)
            self.assertEqual((caught.exception.app, stranger.wait_close()), ("not_authorised", 4001))
            with self.assertRaises(HandshakeFailed) as caught:
                self.connect(path=self.paths[i], origin="https://evil.example")
            self.assertEqual(caught.exception.status, 403)
        with self.assertRaises(HandshakeFailed) as caught:
            self.connect(path="/cellar/ws")
        self.assertEqual(caught.exception.status, 404)
        for ws in sessions:
            ws.leave()

    def test_files_go_to_whom_they_were_announced(self):
        body = os.urandom(3 << 20)
        sessions = [self.enter(i) for i in range(3)]
        for i, ws in enumerate(sessions):
            ticket = announce(ws, [("lamp.ies", body)])[1:]  # below the address of the page
            elsewhere = self.get(self.paths[i - 1] + ticket, method="PUT", body=b"x")
            self.assertEqual(elsewhere[0], 404)
            status, _, answer = self.get(self.paths[i] + ticket, method="PUT", body=body)
            self.assertEqual(status, 200, answer)
            self.assertRegex(json.loads(answer)["folder"], "^upload/")
        for ws in sessions:
            ws.leave()

    def test_one_that_ends_leaves_the_others(self):
        sessions = [self.enter(i) for i in range(3)]
        self.assertEqual(self.daemons[1].stop(), 0)
        self.assertEqual([self.get(path)[0] for path in self.paths], [200, 502, 200])
        for i in (0, 2):
            self.assertIn("methods", sessions[i].call("stats.get"))
            sessions[i].leave()

    def test_the_client_for_scripts_finds_its_path(self):
        with lumend.connect(f"https://localhost:{self.https}/office/#t={self.daemons[1].token}", ca=self.certificate) as session:
            with session.edit() as edit:
                edit.add_light("key", kind="point", position=[0, 2, 0], flux_lm=800)
        for i in range(3):
            ws = self.enter(i)
            self.assertEqual("key" in {op.get("id") for op in ws.call("scene.get")["ops"]}, i == 1)
            ws.leave()


class Nginx:
    option, default, file = "LUMEND_NGINX", "nginx", "nginx.conf"

    def command(self):
        site = self.shipped(self.file, ("listen 80;", f"listen 127.0.0.1:{self.http};"),
                            ("listen 443 ssl", f"listen 127.0.0.1:{self.https} ssl"),
                            ("/etc/ssl/private/lights.example.key", self.key), ("/etc/ssl/lights.example.pem", self.certificate))
        temporary = "".join(f"    {kind}_temp_path {self.folder}/{kind};\n"
                            for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
        main = self.write("main.conf", f"pid {self.folder}/pid;\nerror_log {self.folder}/error;\ndaemon off;\nworker_processes 1;\n"
                                       f"events {{ }}\nhttp {{\n    access_log off;\n{temporary}{site}\n}}\n")
        return [self.program, "-p", self.folder, "-e", f"{self.folder}/error", "-c", main]


class Caddy:
    option, default, file, names = "LUMEND_CADDY", "caddy", "Caddyfile", NAME

    def command(self):
        site = self.shipped(self.file, ("lights.example {\n", f"{self.names} {{\n\tbind 127.0.0.1\n\ttls {self.certificate} {self.key}\n"))
        # Of its own accord it would make an authority for localhost, and have this machine trust that: four seconds each time.
        settings = f"{{\n\tadmin off\n\tskip_install_trust\n\thttp_port {self.http}\n\thttps_port {self.https}\n\tdefault_bind 127.0.0.1\n}}\n"
        return [self.program, "run", "--adapter", "caddyfile", "--config", self.write("Caddyfile", settings + site)]


class NginxBeforeOne(Nginx, BeforeOne, unittest.TestCase):
    pass


class NginxBeforeThree(Nginx, BeforeThree, unittest.TestCase):
    file = "nginx-scenes.conf"


class CaddyBeforeOne(Caddy, BeforeOne, unittest.TestCase):
    pass


class CaddyBeforeThree(Caddy, BeforeThree, unittest.TestCase):
    file, names = "Caddyfile-scenes", f"{NAME}, localhost"


class Files(unittest.TestCase):
    """Also where no proxy is installed."""

    def test_each_file_says_how_lumend_has_to_be_started(self):
        for name in os.listdir(FOLDER):
            with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
                text = file.read()
            self.assertRegex(text, re.compile(r"^# .*lumend --listen 127\.0\.0\.1:9460 --allow-host lights\.example", re.M))


if __name__ == "__main__":
    if not any(os.environ.get(proxy.option) or shutil.which(proxy.default) or shutil.which(proxy.default, path="/usr/sbin")
               for proxy in (Nginx, Caddy)):
        print("skipped: neither nginx nor caddy is installed (LUMEND_NGINX, LUMEND_CADDY)")
    unittest.main()
