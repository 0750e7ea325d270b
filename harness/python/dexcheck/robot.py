"""Robots with their terms, and logs of runs, from the library of C functions beside this file (terms.h describes them)."""

import ctypes
import json
import math
import os
from pathlib import Path

import numpy as np

from .controller import InputError


_FILE = "libdexcheck_terms.so"


def _open_library():
    # PyDLL keeps Python's lock during a call: an object's terms are for one thread at a time.
    folder = Path(__file__).resolve().parent
    places = [folder, folder / "_program/lib/python3/dist-packages/dexcheck"]  # of a build, of a wheel
    library = ctypes.PyDLL(str(next((one for one in places if (one / _FILE).is_file()), folder) / _FILE))
    text, handle, array = ctypes.c_char_p, ctypes.c_void_p, ctypes.c_void_p
    for name, result, arguments in [
            ("error", text, []),
            ("version", text, []),
            ("load", handle, [text, ctypes.c_bool, text]),
            ("open_log", handle, [text]),
            ("free", None, [handle]),
            ("describe", text, [handle]),
            ("audit", text, [handle]),
            ("term", ctypes.c_bool, [handle, ctypes.c_char, array, array, array]),
            ("pose", ctypes.c_bool, [handle, text, array, array]),
            ("jacobian", ctypes.c_bool, [handle, text, array, array]),
            ("signal", ctypes.c_bool, [handle, text, array])]:
        function = getattr(library, "dexcheck_" + name)
        function.restype, function.argtypes = result, arguments
    return library


_library = _open_library()
__version__ = _library.dexcheck_version().decode()


def _require(value):
    """The value of a call that returns null or false when it failed."""
    if not value:
        message = _library.dexcheck_error().decode()
        raise (InputError if message[0] == "i" else ValueError)(message[1:])
    return value


class _Native:
    """Owns an object of the library."""

    def __init__(self, handle):
        self._handle = _require(handle)
        self._facts = json.loads(_require(_library.dexcheck_describe(handle)))

    def __del__(self):
        if getattr(self, "_handle", None):
            _library.dexcheck_free(self._handle)


class Robot(_Native):
    """A description with its analytic model.

    file; name; joints, frames: names; nq, nv: numbers of positions and velocities; notes: what was done with the description.
    Terms are in the order of joints; those of a floating base come first, as MuJoCo has them.
    """

    def __init__(self, file, floating=False, packages=()):
        self.file, self.floating = os.fspath(file), floating
        self.path = os.path.abspath(self.file)  # wherever the process goes
        self.packages = [os.path.abspath(one) for one in ([packages] if isinstance(packages, (str, os.PathLike)) else packages)]
        super().__init__(_library.dexcheck_load(os.fsencode(file), floating, os.fsencode("\n".join(self.packages))))
        for key, value in self._facts.items():
            setattr(self, key, value)

    def __reduce__(self):
        return Robot, (self.path, self.floating, self.packages)  # a copy reads the file again

    def __repr__(self):
        return f"<dexcheck.Robot {self.name} of {self.file}: {len(self.joints)} joints>"

    def _take(self, name, values, size):
        """A vector's bytes, for a call; many times faster than its address."""
        array = np.asarray(values, float)
        if array.shape != (size,):
            raise ValueError(f"{name}: must have {size} entries, got shape {array.shape}")
        return array.tobytes()

    def _term(self, term, shape, q, v=None):
        value = (ctypes.c_double * math.prod(shape))()
        v = None if v is None else self._take("v", v, self.nv)
        if not _library.dexcheck_term(self._handle, term, self._take("q", q, self.nq), v, value):
            _require(False)
        return np.frombuffer(value).reshape(shape)

    def M(self, q):
        """Mass matrix, nv x nv, armature included."""
        return self._term(b"M", (self.nv, self.nv), q)

    def C(self, q, v):
        """Coriolis matrix, nv x nv; M_dot - 2 C is skew."""
        return self._term(b"C", (self.nv, self.nv), q, v)

    def c(self, q, v):
        """C v, nv."""
        return self._term(b"c", (self.nv,), q, v)

    def g(self, q):
        """Forces that hold the robot still, nv."""
        return self._term(b"g", (self.nv,), q)

    def h(self, q, v):
        """C v + g, nv."""
        return self._term(b"h", (self.nv,), q, v)

    def friction(self, q, v):
        """Viscous forces, nv."""
        return self._term(b"f", (self.nv,), q, v)

    def energy(self, q, v):
        """(kinetic, potential), J."""
        return tuple(self._term(b"e", (2,), q, v).tolist())

    def pose(self, name, q):
        """The pose of a frame or link in the world, 4 x 4."""
        q, X = self._take("q", q, self.nq), np.empty((4, 4))
        _require(_library.dexcheck_pose(self._handle, name.encode(), q, X.ctypes.data))
        return X

    def jacobian(self, frame, q):
        """The body Jacobian of a frame, 6 x nv: [linear; angular] along the frame's axes."""
        q, J = self._take("q", q, self.nq), np.empty((6, self.nv))
        _require(_library.dexcheck_jacobian(self._handle, frame.encode(), q, J.ctypes.data))
        return J

    def audit(self):
        """What is impossible or suspicious in the description, one line each."""
        return json.loads(_require(_library.dexcheck_audit(self._handle)))

    def compare(self, other, samples=1000, seed=1, digits=0, ignore=()):
        """Compares with another robot or file (TOML, URDF, MJCF), or with functions M(q), c(q, v), g(q), h(q, v),
        friction(q, v) of an object or a dictionary: to rounding, or to a number of digits. ignore: constants of joints in which
        the two may differ (armature, damping, friction, effort)."""
        from .comparison import compare
        return compare(self, other, samples, seed, digits, ignore)


def load(file, floating=False, packages=()):
    """Reads a parameter file (TOML), a URDF or an MJCF. packages: folders where a URDF's meshes are looked for."""
    return Robot(file, floating, packages)


class Log(_Native):
    """The signals of a run's log.h5 by name: log["q"] is an array with a row for each step, of one number a step a vector."""

    def __init__(self, file):
        self.file = os.fspath(file)
        super().__init__(_library.dexcheck_open_log(os.fsencode(file)))

    def __reduce__(self):
        return Log, (os.path.abspath(self.file),)

    def __iter__(self):
        return iter(self._facts["signals"])

    def keys(self):
        return list(self._facts["signals"])

    def __len__(self):
        return len(self._facts["signals"])

    def __contains__(self, name):
        return name in self._facts["signals"]

    def __getitem__(self, name):
        values = np.empty((self._facts["rows"], self._facts["signals"][name]["width"]))
        _require(_library.dexcheck_signal(self._handle, name.encode(), values.ctypes.data))
        return values.ravel() if values.shape[1] == 1 else values

    def unit(self, name):
        return self._facts["signals"][name]["unit"]

    def columns(self, name):
        """Names of a signal's numbers; none when it is a single one."""
        return self._facts["signals"][name]["columns"]

    def __repr__(self):
        return f"<dexcheck.Log {self.file}: {len(self)} signals of {self._facts['rows']} steps>"
