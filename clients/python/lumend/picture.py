"""Pictures of a view, and the tiles that they come in (protocol/PROTOCOL.md, section 5)."""
import array
import dataclasses
import struct
import zlib

from lumend.exr import exr_file

HEADER = struct.Struct("<4sBBHIIQQIIHHHHHHBBBBIHH")
LAST_TILE, CONVERGED = 1, 4
TILE, HDR_TILE = 1, 2
RGBA8, HALF_DEFLATE = 0, 4
BYTES_PER_PIXEL = {RGBA8: 4, HALF_DEFLATE: 8}


@dataclasses.dataclass(frozen=True)
class Tile:
    flags: int
    frame_seq: int
    scene_rev: int
    view_id: int
    camera_seq: int
    x: int
    y: int
    w: int
    h: int
    full_w: int
    full_h: int
    codec: int
    pixels: bytes  # rows from the top; RGBA8, or RGB1 in half floats


def read_tile(message):
    """None: of a kind that this client does not know. Raises ValueError, or zlib.error."""
    if len(message) < HEADER.size:
        raise ValueError("a tile without a header")
    (magic, version, kind, head, flags, n, frame, rev, view, camera, x, y, w, h, full_w, full_h, codec, _, downscale, _,
     _, _, _) = HEADER.unpack_from(message)
    if magic != b"LUMF" or version != 1:
        raise ValueError("not a tile of lumend.v1")
    if kind not in (TILE, HDR_TILE):
        return None
    payload = message[head:head + n]
    if codec == HALF_DEFLATE:
        payload = zlib.decompressobj().decompress(payload, 8 * w * h + 1)  # no more than fits, whatever it unpacks to
    side = 1 << min(downscale, 16)  # of the square that each of its pixels covers
    columns, rows = -(-w // side), -(-h // side)
    if codec not in BYTES_PER_PIXEL or len(payload) != BYTES_PER_PIXEL[codec] * columns * rows \
            or x + w > full_w or y + h > full_h:
        raise ValueError("a tile that does not fit its header")
    if downscale:
        payload = _spread(payload, BYTES_PER_PIXEL[codec], columns, side, w, h)
    return Tile(flags, frame, rev, view, camera, x, y, w, h, full_w, full_h, codec, payload)


def _spread(pixels, size, columns, side, w, h):
    """Each pixel over the square that it covers: w * h in all."""
    rows = []
    for at in range(0, len(pixels), size * columns):
        row = b"".join(pixels[i:i + size] * side for i in range(at, at + size * columns, size))
        rows.append(row[:size * w])
    return b"".join(rows[y // side] for y in range(h))


class Canvas:
    """What a view shows. The tiles of a frame come into it together, with its last: before that nothing of them shows."""

    def __init__(self):
        self._tiles, self._pixels, self._size, self._codec = [], bytearray(), (0, 0), None

    def take(self, tile):
        """True: it completes a frame."""
        if self._tiles and self._tiles[0].frame_seq != tile.frame_seq:
            self._tiles = []
        self._tiles.append(tile)
        if not tile.flags & LAST_TILE:
            return False
        if (tile.full_w, tile.full_h) != self._size or tile.codec != self._codec:
            self._size, self._codec = (tile.full_w, tile.full_h), tile.codec
            self._pixels = bytearray(BYTES_PER_PIXEL[tile.codec] * tile.full_w * tile.full_h)
        for each in self._tiles:
            self._put(each)
        self._tiles = []
        return True

    def _put(self, tile):
        n, stride = BYTES_PER_PIXEL[tile.codec] * tile.w, BYTES_PER_PIXEL[tile.codec] * tile.full_w
        for row in range(tile.h):
            at = stride * (tile.y + row) + BYTES_PER_PIXEL[tile.codec] * tile.x
            self._pixels[at:at + n] = tile.pixels[n * row:n * (row + 1)]

    def picture(self, scene_rev, converged, stats):
        return Picture(*self._size, self._codec == HALF_DEFLATE, bytes(self._pixels), scene_rev, converged, stats)


@dataclasses.dataclass(frozen=True)
class Picture:
    """What a view showed at one moment.

    linear: pixels are half floats R G B 1 in cd/m2, linear Rec.709 (of the overlay `illuminance` illuminance / pi); else
    they are bytes R G B A as a screen shows them. Rows from the top. stats: members of `frame.stats`.
    """
    width: int
    height: int
    linear: bool
    pixels: bytes
    scene_rev: int
    converged: bool
    stats: dict

    def pixel(self, x, y):
        """(R, G, B): 0 to 255, or cd/m2 where it is linear."""
        if not (0 <= x < self.width and 0 <= y < self.height):
            raise IndexError(f"pixel {x}, {y} of a picture of {self.width} x {self.height}")
        at = self.width * y + x
        return struct.unpack_from("<4e", self.pixels, 8 * at)[:3] if self.linear else tuple(self.pixels[4 * at:4 * at + 3])

    def luminance(self):
        """cd/m2 of each pixel, rows from the top, of a linear picture."""
        if not self.linear:
            raise ValueError("only views opened with linear=True tell luminance")
        values = struct.unpack(f"<{len(self.pixels) // 2}e", self.pixels)
        return array.array("f", (0.2126 * r + 0.7152 * g + 0.0722 * b
                                 for r, g, b in zip(values[0::4], values[1::4], values[2::4])))

    def numpy(self):
        """An array of height x width x 3: uint8, or float16 where it is linear. Needs numpy."""
        import numpy
        kind = numpy.dtype("<f2") if self.linear else numpy.uint8
        return numpy.frombuffer(self.pixels, kind).reshape(self.height, self.width, 4)[:, :, :3]

    def save_png(self, path):
        if self.linear:
            raise ValueError("a linear picture has no colours of a screen: open the view with linear=False")
        rows = b"".join(b"\0" + self.pixels[4 * self.width * y:4 * self.width * (y + 1)] for y in range(self.height))
        with open(path, "wb") as file:
            file.write(b"\x89PNG\r\n\x1a\n")
            for name, data in ((b"IHDR", struct.pack("!2I5B", self.width, self.height, 8, 6, 0, 0, 0)),
                               (b"IDAT", zlib.compress(rows)), (b"IEND", b"")):
                file.write(struct.pack("!I", len(data)) + name + data + struct.pack("!I", zlib.crc32(name + data)))

    def save_exr(self, path):
        """Of a linear picture: R, G and B in cd/m2, linear Rec.709, as half floats."""
        if not self.linear:
            raise ValueError("a picture of a screen has no luminances: open the view with linear=True")
        with open(path, "wb") as file:
            file.write(exr_file(self.width, self.height, self.pixels))
