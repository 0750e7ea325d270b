#!/usr/bin/python3
"""A run's log read by h5py, without a manual: every dataset has a unit, a description and names that fit its columns.

h5py_test.py DEXCHECK; exit code 77 without h5py.
"""

import pathlib
import subprocess
import sys
import tempfile

try:
    import h5py
    import numpy
except ImportError:
    print("h5py (Debian: python3-h5py) is not installed")
    sys.exit(77)


def text_of(value):
    return value.decode() if isinstance(value, bytes) else str(value)


def check(log):
    datasets = {}
    log.visititems(lambda name, item: datasets.update({name: item}) if "unit" in item.attrs else None)
    assert len(datasets) > 30, sorted(datasets)
    rows = len(log["time"])
    for name, data in datasets.items():
        assert data.shape[0] == rows, name
        width = 1 if data.ndim == 1 else data.shape[1]
        units = text_of(data.attrs["unit"]).split(", ")
        assert len(units) in (1, width), f"{name}: {len(units)} units of {width} columns"
        assert text_of(data.attrs["description"]), name
        if "columns" in data.attrs:
            assert len(data.attrs["columns"]) == width, name
    qpos = log["engine/qpos"]
    names = [text_of(name) for name in qpos.attrs["columns"]]
    units = text_of(qpos.attrs["unit"]).split(", ")
    assert len(set(names)) == len(names) == len(units)
    # The torus is a free body: three positions in m, then a unit quaternion.
    first = names.index("torus_free.x")
    assert names[first + 3 : first + 7] == [f"torus_free.q{axis}" for axis in "wxyz"]
    assert units[first : first + 7] == ["m"] * 3 + ["1"] * 4
    assert numpy.allclose(numpy.linalg.norm(qpos[:, first + 3 : first + 7], axis=1), 1.0, atol=1e-12)
    assert abs(qpos[0, first + 2] - log["object/X_o"][0, 2]) < 1e-9
    assert units[names.index("r_elbow")] == "rad"


def main():
    with tempfile.TemporaryDirectory() as folder:
        run = pathlib.Path(folder) / "run"
        command = [sys.argv[1], "run", "paper", "--set", "duration=0.01", "--no-report", "--quiet", "--out", str(run)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        with h5py.File(run / "log.h5", "r") as log:
            check(log)
    print("h5py reads the log")


main()
