"""OpenEXR files of pictures: one part, scan lines, channels B G R as half floats (openexr.com, "OpenEXR File Layout")."""
import struct
import zlib

ZIP, ROWS = 3, 16  # the rows of a block that ZIP packs together
HALF = 1
REC709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)  # primaries and white


def _attribute(name, kind, value):
    return f"{name}\0{kind}\0".encode() + struct.pack("<i", len(value)) + value


def _header(width, height):
    channels = b"".join(name + b"\0" + struct.pack("<4i", HALF, 0, 1, 1) for name in (b"B", b"G", b"R"))
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    return b"".join((b"\x76\x2f\x31\x01\2\0\0\0",  # magic, version
                     _attribute("channels", "chlist", channels + b"\0"),
                     _attribute("chromaticities", "chromaticities", struct.pack("<8f", *REC709)),
                     _attribute("compression", "compression", bytes([ZIP])),
                     _attribute("dataWindow", "box2i", window),
                     _attribute("displayWindow", "box2i", window),
                     _attribute("lineOrder", "lineOrder", b"\0"),
                     _attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
                     _attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
                     _attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
                     _attribute("whiteLuminance", "float", struct.pack("<f", 1)),
                     b"\0"))


def _block(pixels, width, y, n):
    """Rows y to y + n. Low bytes before high ones, each as its difference from the last: what deflate finds repeated."""
    low, high = (b"".join(pixels[8 * width * row + 2 * channel + byte:8 * width * (row + 1):8]
                          for row in range(y, y + n) for channel in (2, 1, 0)) for byte in (0, 1))
    halves = low + high
    packed = zlib.compress(halves[:1] + bytes((b - a + 128) & 255 for a, b in zip(halves, halves[1:])))
    if len(packed) >= len(halves):  # a reader knows by the length
        packed = bytearray(len(halves))
        packed[0::2], packed[1::2] = low, high
    return struct.pack("<2i", y, len(packed)) + packed


def exr_file(width, height, pixels):
    """pixels: R G B 1 as half floats, little-endian, rows from the top."""
    head = _header(width, height)
    blocks = [_block(pixels, width, y, min(ROWS, height - y)) for y in range(0, height, ROWS)]
    at, offsets = len(head) + 8 * len(blocks), []
    for block in blocks:
        offsets.append(at)
        at += len(block)
    return b"".join((head, struct.pack(f"<{len(offsets)}Q", *offsets), *blocks))
