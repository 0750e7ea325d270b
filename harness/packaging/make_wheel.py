#!/usr/bin/env python3
"""Makes a wheel of the archive: make_wheel.py dexcheck-VERSION-linux-MACHINE.tar.xz FOLDER

The wheel holds the Python package, and below dexcheck/_program the archive as it is. Its script `dexcheck` starts that program.
It is for systems whose glibc is not older than this one's.
"""

import base64
import hashlib
import platform
import re
import sys
import tarfile
import zipfile
from pathlib import Path

METADATA = """Metadata-Version: 2.1
Name: dexcheck
Version: {version}
Summary: Checks analytic robot models and controllers against MuJoCo
License: Apache-2.0
Requires-Python: >=3.9
Provides-Extra: numpy
Requires-Dist: numpy; extra == "numpy"
"""
WHEEL = "Wheel-Version: 1.0\nGenerator: dexcheck\nRoot-Is-Purelib: false\nTag: {tag}\n"
ENTRY_POINTS = "[console_scripts]\ndexcheck = dexcheck.start:main\n\n[pytest11]\ndexcheck = pytest_dexcheck\n"
MODULES = "lib/python3/dist-packages/"


class Wheel:
    """A zip file with a record of its files' digests."""

    def __init__(self, path, info):
        self.archive, self.info, self.record = zipfile.ZipFile(path, "w"), info, []

    def add(self, name, data, mode=0o644):
        entry = zipfile.ZipInfo(name)  # of a fixed date: the same files make the same wheel
        entry.external_attr = (0o100000 | mode) << 16
        entry.compress_type = zipfile.ZIP_DEFLATED
        self.archive.writestr(entry, data)
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        self.record.append(f"{name},sha256={digest},{len(data)}\n")

    def close(self):
        self.add(f"{self.info}/RECORD", "".join(self.record + [f"{self.info}/RECORD,,\n"]).encode())
        self.archive.close()


def main():
    path = Path(sys.argv[1])
    version, machine = re.fullmatch(r"dexcheck-(.*)-linux-(.*)\.tar\.xz", path.name).groups()
    tag = f"py3-none-manylinux_{platform.libc_ver()[1].replace('.', '_')}_{machine}"
    out = Path(sys.argv[2], f"dexcheck-{version}-{tag}.whl")
    wheel = Wheel(out, f"dexcheck-{version}.dist-info")
    with tarfile.open(path) as archive:
        for member in archive:
            if not member.isfile():
                continue
            name = member.name.split("/", 1)[1]
            data = archive.extractfile(member).read()
            wheel.add(f"dexcheck/_program/{name}", data, member.mode)
            if name.startswith(MODULES) and name.endswith(".py"):
                wheel.add(name[len(MODULES):], data)
    for name, text in {"METADATA": METADATA, "WHEEL": WHEEL, "entry_points.txt": ENTRY_POINTS}.items():
        wheel.add(f"{wheel.info}/{name}", text.format(version=version, tag=tag).encode())
    wheel.close()
    print(out)


main()
