"""How a program talks with dexcheck, which queries it at each step (controller_protocol.h): for the laws beside it."""

import struct
import sys

TERMS, TELLS_F_N = 1, 2  # what a law needs, and what it reports
MAGIC, PROTOCOL = b"DEXCTRL\0", 1
STEP, BEGIN, END = 1, 2, 3
HELLO = struct.Struct("=8s6I17d")


def read(size):
    data = sys.stdin.buffer.read(size)
    if len(data) < size:
        sys.exit(0)
    return data


def write(data):
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()


def read_hello():
    """What the first message says: five counts, then 17 numbers of the scenario. The two files follow it."""
    magic, protocol, *rest = HELLO.unpack(read(HELLO.size))
    if magic != MAGIC or protocol != PROTOCOL:
        sys.exit("this is another protocol")
    counts, numbers = rest[:5], rest[5:]
    return counts, numbers


def answer_hello(flags):
    write(struct.pack("=8sII", MAGIC, PROTOCOL, flags))


def states():
    """The states for which dexcheck requests torques, one after the other, as bytes of doubles."""
    while True:
        kind, doubles = struct.unpack("=II", read(8))
        if kind == END:
            return
        if kind != BEGIN:
            yield read(8 * doubles)


def answer(*arrays):
    """Torques, and F_N when it is reported."""
    data = b"".join(array.tobytes() for array in arrays)
    write(struct.pack("=II", STEP, len(data) // 8) + data)
