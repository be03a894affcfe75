"""Start, stop, options, and what people read."""
import http.client
import json
import os
import re
import signal
import socket
import subprocess
import tempfile
import unittest

from daemon import LUMEND, Daemon, eventually
from wsclient import BINARY, WAIT_S, WebSocket


UPGRADE = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": "x3JJHMbDL1EzLkh9GBhXDw==",
           "Sec-WebSocket-Version": "13", "Sec-WebSocket-Protocol": "lumend.v1"}


def run(*arguments, environment=None):
    return subprocess.run([LUMEND, *arguments], capture_output=True, text=True, timeout=2 * WAIT_S, check=False,
                          env={**os.environ, **(environment or {})})


STOP_S = 15  # what is promised is 5 s for such a peer; TimeoutStopSec of the unit is 30


class Stop(unittest.TestCase):
    def test_drain(self):
        """SIGTERM: everyone is told, replies under way arrive, code 1012, exit status 0."""
        with Daemon() as daemon:
            sessions = [daemon.connect() for _ in range(5)]
            sessions[0].call("view.open", {"size": [64, 64], "camera_id": "main"})
            guest = WebSocket(daemon.port)
            daemon.process.send_signal(signal.SIGTERM)
            for ws in sessions:
                ws.wait_notification("session.closing")
                self.assertEqual(ws.wait_close(), 1012)
            self.assertEqual(guest.wait_close(), 1012)
            self.assertEqual(daemon.process.wait(WAIT_S), 0)

    def wait_stuck(self, daemon):
        """Of the first frame, 256 KiB, as much is on its way as the kernel takes (TCP_NOTSENT_LOWAT)."""
        eventually(lambda: daemon.metric("ws_tx_bytes_total") > 128 << 10, "half of a frame is sent")

    def test_drain_does_not_wait_for_a_peer_that_does_not_read(self):
        with Daemon("--method", "whitted") as daemon:
            deaf = daemon.connect(rcvbuf=4096)
            deaf.call("view.open", {"size": [256, 256], "camera_id": "main", "codec": "rgba8"})
            self.wait_stuck(daemon)
            daemon.process.send_signal(signal.SIGTERM)
            self.assertEqual(daemon.process.wait(STOP_S), 0)

    def test_nobody_new_while_draining(self):
        with Daemon("--method", "whitted") as daemon:
            deaf = daemon.connect(rcvbuf=4096)  # keeps the drain open for a while
            deaf.call("view.open", {"size": [256, 256], "camera_id": "main", "codec": "rgba8"})
            ws = daemon.connect()
            self.wait_stuck(daemon)
            daemon.process.send_signal(signal.SIGTERM)
            ws.wait_notification("session.closing")
            self.assertEqual(daemon.get("/readyz")[::2], (503, b"shutting down\n"))
            self.assertEqual(daemon.get("/healthz")[0], 200)
            self.assertEqual(daemon.get("/", UPGRADE)[0], 503)
            deaf.sock.close()
            self.assertEqual(daemon.process.wait(WAIT_S), 0)  # a second signal would end it with 1

    def test_interrupt_stops_too(self):
        with Daemon() as daemon:
            daemon.process.send_signal(signal.SIGINT)
            self.assertEqual(daemon.process.wait(WAIT_S), 0)

    def test_two_daemons_one_after_the_other_on_one_port(self):
        with Daemon() as first:
            port = first.port
            ws = first.connect()  # leaves a socket in TIME_WAIT on the server's side
            self.assertEqual(first.stop(), 0)
            self.assertEqual(ws.wait_close(), 1012)
        with Daemon(listen=f"127.0.0.1:{port}") as second:
            self.assertEqual(second.port, port)


class Loading(unittest.TestCase):
    """The importer of the scene's model waits for a word on a pipe before it begins."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.pipe, importer = self.folder.name + "/pipe", self.folder.name + "/importer"
        os.mkfifo(self.pipe)
        self.addCleanup(self.let_go)  # in any case: nobody else ends it
        with open(importer, "w", encoding="ascii") as script:
            script.write(f'#!/bin/sh\nread word < {self.pipe}\nexec {os.path.dirname(LUMEND)}/lumend-import "$@"\n')
        os.chmod(importer, 0o700)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.process = subprocess.Popen([LUMEND, "--listen", f"127.0.0.1:{self.port}", "--importer", importer, "--no-auth",
                                         "--scene", os.path.join(os.path.dirname(__file__), "web", "lamp.gltf")],
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.addCleanup(self.process.stdout.close)
        self.addCleanup(self.process.wait)
        self.addCleanup(self.process.kill)
        eventually(self.listens, "it listens")

    def listens(self):
        self.assertIsNone(self.process.poll())
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", self.port)) == 0

    def let_go(self):
        """True when somebody waited for it."""
        try:
            pipe = os.open(self.pipe, os.O_WRONLY | os.O_NONBLOCK)
        except OSError:
            return False
        os.write(pipe, b"go\n")
        os.close(pipe)
        return True

    def get(self, path, headers=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=WAIT_S)
        connection.request("GET", path, headers=headers or {})
        response = connection.getresponse()
        body = response.read()
        connection.close()
        return response.status, body

    def test_not_ready_and_alive_until_the_scene_is_there(self):
        self.assertEqual(self.get("/readyz"), (503, b"loading the scene\n"))
        self.assertEqual(self.get("/healthz"), (200, b"ok\n"))
        self.assertEqual(self.get("/")[0], 200)
        self.assertEqual(self.get("/metrics")[0], 503)
        self.assertEqual(self.get("/", UPGRADE)[0], 503)
        eventually(self.let_go, "the importer waits")
        self.assertIn(b"lumend ready ", self.process.stdout.readline())
        self.assertEqual(self.get("/readyz"), (200, b"ready\n"))
        self.assertEqual(self.get("/metrics")[0], 200)

    def test_a_stop_does_not_wait_for_the_scene(self):
        self.process.send_signal(signal.SIGTERM)
        self.assertEqual(self.process.wait(WAIT_S), 0)
        self.assertEqual(self.process.stdout.read(), b"")


class Ready(unittest.TestCase):
    def test_stdout_is_one_line(self):
        with Daemon() as daemon:
            daemon.connect().close()
            daemon.process.send_signal(signal.SIGTERM)
            self.assertEqual(daemon.process.stdout.read(), b"")
            daemon.process.wait(WAIT_S)

    def test_log_lines(self):
        with Daemon("--log", "debug") as daemon:
            ws = WebSocket(daemon.port)
            ws.hello(daemon.token, client='evil" level=error\nts=1')
            ws.close()
            daemon.assert_well()
            self.assertEqual(daemon.stop(), 0)
            for line in daemon.read_log().splitlines():
                self.assertRegex(line, r'^ts=\S+Z level=(error|warning|info|debug) at=[a-z_]+ text="[ -~]*"( dropped=\d+)?$')
            self.assertNotIn(daemon.token, daemon.read_log())

    def test_frames_arrive(self):
        with Daemon() as daemon:
            ws = daemon.connect()
            ws.call("view.open", {"size": [64, 64], "camera_id": "main"})
            opcode, message = None, b""
            while opcode != BINARY:
                opcode, message = ws.recv_message()
            self.assertEqual(message[:4], b"LUMF")


class CommandLine(unittest.TestCase):
    def test_help_and_version(self):
        done = run("--help")
        self.assertEqual(done.returncode, 0)
        for word in ("--scene", "--token-file", "--listen", "render", "LUMEND_TOKEN_FILE"):
            self.assertIn(word, done.stdout)
        done = run("--version")
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stdout, r"^lumend \d+\.\d+\.\d+ \(protocol 1\)\n")
        for library in ("Embree", "OpenEXR", "libwebsockets", "cJSON"):
            self.assertRegex(done.stdout, rf"(?m)^{library} \d+\.\d+\.\d+$")
        for codec in ("WebP", "VP9"):
            self.assertRegex(done.stdout, rf"(?m)^with(out)? {codec}$")

    def test_scenes_have_titles(self):
        lines = run("scenes").stdout.splitlines()
        self.assertIn("cornell", [line.split()[0] for line in lines])
        for line in lines:
            self.assertGreater(len(line.split()), 2, line)

    def test_scenes_and_methods_explain_themselves(self):
        for command in ("scenes", "methods"):
            done = run(command, "--help")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertTrue(done.stdout.startswith(f"usage: lumend {command}"))
        self.assertTrue(run("scenes", "cornell-moves").stdout.startswith('{"lumend": 1, "kind": "replay"'))
        for arguments in (("scenes", "nonsense"), ("scenes", "cornell", "nonsense"), ("methods", "nonsense")):
            done = run(*arguments)
            self.assertEqual((done.returncode, done.stdout), (2, ""), arguments)
            self.assertIn("'nonsense'", done.stderr)

    def test_a_file_is_named_once(self):
        for arguments in (("--scene", "/no/place.jsonl"), ("--scene", "/no/place.glb"), ("--edits", "/no/place")):
            done = run("render", "--scene", "cornell", *arguments, "--out", "/tmp/x.png")
            self.assertEqual((done.returncode, done.stderr.count("place")), (1, 1), done.stderr)

    def test_compare_by_blocks(self):
        with tempfile.TemporaryDirectory() as folder:
            a, b = (f"{folder}/{seed}.exr" for seed in (1, 2))
            for seed, path in ((1, a), (2, b)):
                done = run("render", "--scene", "cornell", "--method", "path", "--spp", "2", "--size", "96x64",
                           "--seed", str(seed), "--out", path)
                self.assertEqual(done.returncode, 0, done.stderr)
            same = json.loads(run("compare", a, a, "--metric", "blocks").stdout)
            both = json.loads(run("compare", a, a, "--second", b, "--metric", "rmse,blocks").stdout)
            alone = json.loads(run("compare", a, b, "--metric", "rmse").stdout)
        self.assertNotIn("rmse", same)
        blocks = same["blocks"]
        self.assertEqual((blocks["grid"], blocks["side"]), ([24, 16], 4))
        self.assertEqual(blocks["counted"] + blocks["dark"], 24 * 16)
        self.assertEqual({blocks[key] for key in ("mean", "median", "p5", "p25", "p75", "p95", "lowest", "highest")}, {1})
        self.assertGreater(blocks["stderr"]["mean"], both["blocks"]["stderr"]["mean"])
        self.assertGreater(both["blocks"]["stderr"]["mean"], 0)
        self.assertAlmostEqual(both["rmse"], alone["rmse"] / 2, delta=1e-5 * alone["rmse"])  # of a from (a + b) / 2

    def test_usage_errors(self):
        for arguments, words in ((["--nonsense"], "unknown option '--nonsense'"), (["--scene"], "--scene needs a value"),
                                 (["--no-auth=1"], "--no-auth takes no value"), (["serve", "x"], "unexpected argument 'x'"),
                                 (["--listen", "9460"], "--listen must be HOST:PORT"),
                                 (["--listen", "127.0.0.1:65536"], "--listen must be"),
                                 (["--listen", "127.0.0.1:-1"], "--listen must be"),
                                 (["--listen", "nowhere.example:1"], "needs an address"),
                                 (["--listen", ":80"], "--listen must be"), (["--threads", "x"], "--threads must be a whole number"),
                                 (["--threads", "1025"], "from 0 to 1024"), (["--log", "loud"], "--log must be"),
                                 (["--isa", "mmx"], "--isa must be one of sse2, "),
                                 (["render", "--isa", "mmx"], "--isa must be one of sse2, "),
                                 (["--no-auth", "--token-file", "f"], "exclude each other"),
                                 (["--treads=3"], "unknown option '--treads=3': did you mean --threads?"),
                                 (["--port", "80"], "unknown option '--port': did you mean --listen HOST:PORT?"),
                                 (["--name", "x"], "unknown option '--name'\n"),  # several take one
                                 (["render"], "--scene NAME|FILE is missing (see: lumend render --help)"),
                                 (["--method", "foo"], "--method must be a method, not 'foo': there are whitted, "),
                                 (["render", "--method", "foo"], "not 'foo': there are whitted, "),
                                 (["render", "--thread", "3"], "abbreviated: write --threads"),
                                 (["render", "--sied", "3"], "did you mean --seed?"),
                                 (["compare", "--heatmop=f"], "did you mean --heatmap?"),
                                 (["nonsense"], "no command 'nonsense'")):
            done = run(*arguments)
            self.assertEqual((done.returncode, done.stdout), (2, ""), arguments)
            self.assertIn(words, done.stderr, arguments)
            self.assertLessEqual(done.stderr.count("\n"), 2, arguments)  # not the whole help

    def test_an_unknown_option_without_a_neighbour_is_only_named(self):
        for arguments in (["--nonsense"], ["--l"], ["render", "--" + 80 * "s"], ["compare", "-z"]):
            self.assertNotIn("did you mean", run(*arguments).stderr, arguments)

    def test_what_the_environment_set_is_blamed_on_it(self):
        for variable, value, *arguments in (("LUMEND_THREADS", "zz"), ("LUMEND_LOG", "loud"), ("LUMEND_LISTEN", "9460"),
                                            ("LUMEND_METHOD", "foo"), ("LUMEND_ISA", "mmx"),
                                            ("LUMEND_NO_AUTH", "yes"),
                                            ("LUMEND_NO_AUTH", "1", "--listen", "0.0.0.0:0")):
            done = run(*arguments, environment={variable: value})
            self.assertEqual(done.returncode, 2)
            self.assertRegex(done.stderr, rf"^lumend: \${variable} (must be|is refused)")

    def test_a_misspelt_variable_is_named(self):
        with Daemon(environment={"LUMEND_THREDS": "2", "LUMEND_TOKEN": "of lumend-replay"}) as daemon:
            daemon.assert_well()
            self.assertIn("LUMEND_THREDS", daemon.read_log())
            self.assertNotIn("LUMEND_TOKEN", daemon.read_log())

    def test_failures(self):
        for arguments in (["--token-file", "/nonexistent/token"], ["--listen", "192.0.2.1:0"], ["--scene", "no-such-scene"]):
            if os.environ.get("LUMEND_FAKE") and "--scene" in arguments:
                continue
            done = run("serve", "--listen", "127.0.0.1:0", *arguments)
            self.assertEqual((done.returncode, done.stdout), (1, ""), arguments)
            last = done.stderr.strip().splitlines()[-1]
            self.assertRegex(last, r"^lumend: .*" + re.escape(arguments[1].split(":")[0]), arguments)

    def test_the_batch_renderer_heeds_the_variable_of_the_instruction_set(self):
        done = run("render", "--scene", "furnace", "--out", "/tmp/x.png", environment={"LUMEND_ISA": "mmx"})
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("the instruction set must be one of sse2, ", done.stderr)

    def test_where_settings_come_from(self):
        done = run("--print-config", "--threads", "3", environment={"LUMEND_LOG": "debug", "LUMEND_THREADS": "2"})
        self.assertEqual(done.returncode, 0)
        rows = {line.split()[0]: line.split()[1:] for line in done.stdout.splitlines()}
        self.assertEqual(rows["threads"], ["3", "--threads"])
        self.assertEqual(rows["log"], ["debug", "$LUMEND_LOG"])
        self.assertEqual(rows["listen"], ["127.0.0.1:9460", "default"])

    def test_healthcheck(self):
        with Daemon() as daemon:
            self.assertEqual(run("--healthcheck", "--listen", f"127.0.0.1:{daemon.port}").returncode, 0)
            self.assertEqual(run("--healthcheck", "--listen", f"0.0.0.0:{daemon.port}").returncode, 0)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))  # bound and not listening: nobody answers there
            done = run("--healthcheck", "--listen", f"127.0.0.1:{free.getsockname()[1]}")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no server at 127.0.0.1", done.stderr)


if __name__ == "__main__":
    unittest.main()
