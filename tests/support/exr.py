"""Reads EXR files as lumend writes them: scan lines, compressed with ZIP, of whole or half floats."""
import array
import itertools
import struct
import sys
import zlib

LINES = 16  # of a block compressed with ZIP
FLIP = bytes(i ^ 128 for i in range(256))


class Exr:
    """width, height; channels: (name, bytes of a value) in the file's order, which is by name."""

    def __init__(self, path):
        with open(path, "rb") as file:
            self.data = file.read()
        at = 8
        while self.data[at]:
            name_end = self.data.index(0, at)
            type_end = self.data.index(0, name_end + 1)
            size = struct.unpack_from("<i", self.data, type_end + 1)[0]
            name, begin = self.data[at:name_end], type_end + 5
            if name == b"dataWindow":
                x0, y0, x1, y1 = struct.unpack_from("<4i", self.data, begin)
                self.width, self.height = x1 - x0 + 1, y1 - y0 + 1
            elif name == b"channels":
                self.channels = self._channels(begin)
            elif name == b"compression":
                assert self.data[begin] == 3, f"{path}: not compressed with ZIP"
            at = begin + size
        self.first_block = struct.unpack_from("<Q", self.data, at + 1)[0]
        assert self.first_block < len(self.data), path

    def _channels(self, at):
        found = []
        while self.data[at]:
            name_end = self.data.index(0, at)
            kind = struct.unpack_from("<i", self.data, name_end + 1)[0]
            found.append((self.data[at:name_end].decode(), 2 if kind == 1 else 4))
            at = name_end + 17
        return found

    def block_bytes(self):
        """All blocks as they are in the file: the header, which has times in it, and the table of offsets left out."""
        return self.data[self.first_block:]

    def rows(self):
        """For each row a dictionary: the values of each channel."""
        row_bytes = self.width * sum(size for _, size in self.channels)
        at, rows = self.first_block, []
        while len(rows) < self.height:
            size = struct.unpack_from("<i", self.data, at + 4)[0]
            packed, n = self.data[at + 8:at + 8 + size], min(LINES, self.height - len(rows))
            lines = packed if size == n * row_bytes else unzip(packed)
            rows += [self._row(lines, k * row_bytes) for k in range(n)]
            at += 8 + size
        return rows

    def _row(self, lines, at):
        row = {}
        for name, size in self.channels:
            row[name] = struct.unpack_from(f"<{self.width}{'e' if size == 2 else 'f'}", lines, at)
            at += self.width * size
        return row


def unzip(packed):
    """Bytes are stored as differences to the one before plus 128; first those at even places, then those at odd ones."""
    sums = array.array("Q", itertools.accumulate(zlib.decompress(packed)))
    if sys.byteorder == "big":
        sums.byteswap()
    bytes_ = bytearray(sums.tobytes()[::8])  # modulo 256
    bytes_[1::2] = bytes_[1::2].translate(FLIP)  # k times 128 less: as it was where k is even
    half, lines = (len(bytes_) + 1) // 2, bytearray(len(bytes_))
    lines[0::2], lines[1::2] = bytes_[:half], bytes_[half:]
    return bytes(lines)
