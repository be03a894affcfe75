"""A lighting desk in 30 lines: sends channel values of one universe as sACN (ANSI E1.31), 44 times a second, until Ctrl + C.

usage: desk.py HOST:PORT UNIVERSE VALUE...        for example: desk.py 127.0.0.1:5568 1 255 128 0
"""
import socket
import struct
import sys
import time
import uuid


def packet(universe, sequence, slots, priority=100, options=0, cid=uuid.uuid4().bytes, name="desk.py"):
    n = 126 + len(slots)
    root = b"\0\x10\0\0ASC-E1.17\0\0\0" + struct.pack(">HI16s", 0x7000 | n - 16, 4, cid)
    framing = struct.pack(">HI64sBHBBH", 0x7000 | n - 38, 2, name.encode()[:63], priority, 0, sequence % 256, options, universe)
    return root + framing + struct.pack(">HBBHHHB", 0x7000 | n - 115, 2, 0xa1, 0, 1, 1 + len(slots), 0) + bytes(slots)


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    host, port = sys.argv[1].rsplit(":", 1)
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sequence = 0
    try:
        while True:
            out.sendto(packet(int(sys.argv[2]), sequence, [int(v) for v in sys.argv[3:]]), (host, int(port)))
            sequence += 1
            time.sleep(1 / 44)
    except KeyboardInterrupt:  # says that it ends: three times, for packets get lost
        for k in range(3):
            out.sendto(packet(int(sys.argv[2]), sequence + k, [], options=0x40), (host, int(port)))


if __name__ == "__main__":
    main()
