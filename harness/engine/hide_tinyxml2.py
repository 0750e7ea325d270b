"""Copies libmujoco.so with its own TinyXML-2 hidden: hide_tinyxml2.py LIBRARY COPY

Releases since 3.0 have a TinyXML-2 of their own in the library and export it. In a program that links the system's
TinyXML-2, of another version, each of the two calls functions of the other, and the first MJCF ends it with SIGSEGV. Of
symbols that are hidden, the loader binds a library's own references to itself, and shows them to nobody else.
"""
import pathlib
import struct
import sys

DYNSYM, HIDDEN = 11, 2


def hide(library):
    """@param library a bytearray: ELF of 64 bits, little endian. @return how many symbols are hidden now."""
    if library[:6] != b"\x7fELF\x02\x01":
        sys.exit("hide_tinyxml2: not an ELF library of 64 bits, little endian")
    table, = struct.unpack_from("<Q", library, 40)
    size, count = struct.unpack_from("<HH", library, 58)
    sections = [struct.unpack_from("<IIQQQQIIQQ", library, table + size * i) for i in range(count)]
    hidden = 0
    for _, kind, _, _, offset, length, link, _, _, _ in sections:
        if kind != DYNSYM:
            continue
        names = sections[link][4]
        for at in range(offset, offset + length, 24):
            name, _, other, section = struct.unpack_from("<IBBH", library, at)
            text = library[names + name:library.index(0, names + name)]
            if section != 0 and (b"N8tinyxml2" in text or b"NK8tinyxml2" in text):
                library[at + 5] = other & ~3 | HIDDEN
                hidden += 1
    return hidden


def main():
    library, copy = map(pathlib.Path, sys.argv[1:])
    content = bytearray(library.read_bytes())
    hide(content)
    if not copy.exists() or copy.read_bytes() != content:
        copy.write_bytes(content)


if __name__ == "__main__":
    main()
