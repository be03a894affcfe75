"""A small client of lumend: opens a view, sets one lamp, and writes the picture that shows it.

usage: python3 clients/minimal/client.py 'http://127.0.0.1:9460/#t=TOKEN' picture.png ceiling-panel 5500

The URL is the one that the server prints, ceiling-panel a lamp of its scene, 5500 the lamp's new flux in lumens. Python's
standard library is enough. "From connect to the first frame" in protocol/PROTOCOL.md explains the messages.
"""
import json, os, re, socket, ssl, struct, sys, zlib

LAST_TILE, CONVERGED = 1, 4  # flags of a tile
WIDTH, HEIGHT = 320, 240
if len(sys.argv) != 5:
    sys.exit(__doc__)
url, out, lamp, lumens = sys.argv[1:]
parts = re.fullmatch(r"http(s?)://(.+):(\d+)/(?:#t=(.*))?", url)
if not parts:
    sys.exit(f"{url} is not a URL as the server prints it: http://127.0.0.1:9460/#t=TOKEN")
secure, host, port, token = parts.groups()
try:
    line = socket.create_connection((host, int(port)))
    if secure:  # $SSL_CERT_FILE names who signed the certificate, where this machine does not know them
        line = ssl.create_default_context().wrap_socket(line, server_hostname=host)
except OSError as error:
    sys.exit(f"{url}: {error.strerror or error}: does lumend run there?")
incoming = line.makefile("rb")


def send_bytes(kind, data):
    size = struct.pack("!B", 128 | len(data)) if len(data) < 126 else struct.pack("!BH", 128 | 126, len(data))
    key = os.urandom(4)  # WebSocket: what a client sends is masked
    line.sendall(bytes([128 | kind]) + size + key + bytes(byte ^ key[i % 4] for i, byte in enumerate(data)))


def send(method, params, **request_id):
    send_bytes(1, json.dumps({"jsonrpc": "2.0", "method": method, "params": params, **request_id}).encode())


def receive():
    """The next message of the server: bytes for a tile, a dict for JSON. It may come in several pieces."""
    message, is_tile, last = b"", False, False
    while not last:
        kind, size = incoming.read(2)
        size = size if size < 126 else int.from_bytes(incoming.read(2 if size == 126 else 8), "big")
        piece = incoming.read(size)
        if kind & 15 == 9:  # a ping: who does not answer is cut off
            send_bytes(10, piece)
        elif kind & 15 < 8:
            message, is_tile, last = message + piece, is_tile or kind & 15 == 2, kind & 128
    return message if is_tile else json.loads(message)


def png_chunk(name, data):
    return struct.pack("!I", len(data)) + name + data + struct.pack("!I", zlib.crc32(name + data))


line.sendall(f"GET / HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
             "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: bHVtZW5kIGlzIGEgbGFtcA==\r\n"
             "Sec-WebSocket-Protocol: lumend.v1\r\n\r\n".encode())
while incoming.readline() != b"\r\n":
    pass  # the head of the answer: 101 Switching Protocols

send("session.hello", {"client": "minimal", **({"token": token} if token else {})}, id=1)
send("view.open", {"size": [WIDTH, HEIGHT], "codec": "rgba8", "method": "live", "spp": 4, "stats": False}, id=2)
rows = [bytearray(4 * WIDTH) for _ in range(HEIGHT)]
shown_rev, edit_rev, final = 0, None, False
while not (final and edit_rev and shown_rev >= edit_rev):
    message = receive()
    if isinstance(message, bytes):  # a tile: 64 bytes of header, then pixels
        _, _, _, head, flags, _, frame, rev, view, _, x, y, w, h = struct.unpack_from("<4sBBHIIQQIIHHHH", message)
        for i in range(h):
            rows[y + i][4 * x:4 * (x + w)] = message[head + 4 * w * i:head + 4 * w * (i + 1)]
        if flags & LAST_TILE:  # the picture is whole
            send("frame.ack", {"view_id": view, "frame_seq": frame})
            if not shown_rev:  # the first one
                edit = {"op": "set", "id": lamp, "path": "/flux_lm", "value": float(lumens)}
                send("scene.apply", {"ops": [edit]}, id=3)
            shown_rev, final = rev, bool(flags & CONVERGED)
    elif "error" in message:
        sys.exit(message["error"]["message"])
    elif message.get("id") == 3:
        edit_rev = message["result"]["scene_rev"]

with open(out, "wb") as file:
    file.write(b"\x89PNG\r\n\x1a\n" + png_chunk(b"IHDR", struct.pack("!2I5B", WIDTH, HEIGHT, 8, 6, 0, 0, 0)) +
               png_chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows))) + png_chunk(b"IEND", b""))
