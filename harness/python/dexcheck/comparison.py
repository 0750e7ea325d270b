"""Whether two descriptions agree and why not, and whether a model explains a recording: what the program says, as objects."""

import json
import math
import os
import tempfile
from pathlib import Path

import numpy as np

from .controller import InputError
from .program import as_path, execute
from .robot import Robot

_TERMS = ("M", "c", "g", "h", "friction")


def _execute(words, robot=None):
    """Runs a command that writes JSON. Returns what it wrote."""
    if robot is not None:
        words = [*words, *(["--floating"] if robot.floating else [])]
    _, text = execute([*words, "--json", "-"])
    return json.loads(text)


def _package_words(robot):
    return [word for folder in robot.packages for word in ("--package", folder)]


class Comparison:
    """What a comparison found; true when the two agree.

    terms: by constant and term max, bound, digits, pass, compared, where, values; differences: a line for each cause, without
    causes for each constant and term that differs; causes: text, id, places, explained (a fraction); notes.
    """

    def __init__(self, first, second, result):
        self._names, self._samples = (first, second), result["samples"]
        self.agrees, self.notes = result["verdict"] == "pass", result["notes"]
        self.causes, self.differences = result.get("causes", []), result["differences"]
        self.terms = {name: {**check, "values": (check["model"], check["engine"])} for name, check in result["checks"].items()}

    def __bool__(self):
        return self.agrees

    def __repr__(self):
        both = " and ".join(self._names)
        if self.agrees:
            return f"AGREE: {both} in {len(self.terms)} constants and terms at {self._samples} states"
        return "\n  ".join([f"DISAGREE: {both}", *self.differences])


def compare(robot, other, samples, seed, digits, ignore):
    """Robot.compare."""
    words = ["consistency", robot.path, "--samples", samples, "--seed", seed, *_package_words(robot)]
    words += ["--digits", digits] if digits else []
    words += [f"--ignore={ignore if isinstance(ignore, str) else ','.join(ignore)}"] if ignore else []
    name = Path(robot.file).name
    if isinstance(other, Robot):
        if other.floating != robot.floating:
            raise InputError(f"{other.file}: must be loaded with floating={robot.floating}, as {robot.file} is")
        words += _package_words(other)
        other = other.path
    if isinstance(other, (str, os.PathLike)):
        words.insert(2, as_path(other))
        return Comparison(name, Path(other).name, _execute(words, robot))
    with tempfile.TemporaryDirectory() as folder:
        folder = os.path.join(folder, "results")
        execute(["eval", robot.path, "--states", samples, "--seed", seed, "--out", folder,
                 *(["--floating"] if robot.floating else []), *_package_words(robot)])
        _save_terms(robot, other, folder)
        called = "functions" if isinstance(other, dict) else type(other).__name__
        return Comparison(name, called, _execute([*words, "--results", folder], robot))


def _save_terms(robot, functions, folder):
    """Calls the functions of an object or a dictionary at the states of a folder, and writes what they return beside them."""
    if isinstance(functions, dict):
        for name, function in functions.items():
            if name not in _TERMS or not callable(function):
                raise InputError(f"functions: {name!r}: must be a function and one of {', '.join(_TERMS)}")
    find = functions.get if isinstance(functions, dict) else lambda name: getattr(functions, name, None)
    found = {name: find(name) for name in _TERMS if find(name) is not None}
    if not found:
        raise InputError(f"functions: must have one of {', '.join(_TERMS)}")
    q, v = (np.load(os.path.join(folder, name + ".npy")) for name in ("q", "v"))
    for name, function in found.items():
        shape = (robot.nv, robot.nv) if name == "M" else (robot.nv,)
        values = np.empty((len(q), *shape))
        for i in range(len(q)):
            value = function(q[i]) if name in ("M", "g") else function(q[i], v[i])
            if np.iscomplexobj(value):
                raise InputError(f"{name}: must be real, got complex numbers")
            value = np.asarray(value, float)
            if value.shape != shape:
                raise InputError(f"{name}: must have {_print_shape(shape)} entries, got {_print_shape(value.shape)}")
            values[i] = value
        np.save(os.path.join(folder, name + ".npy"), values)


def _print_shape(shape):
    return " x ".join(map(str, shape))


class Diagnosis(dict):
    """What `dexcheck diagnose` writes with --json; true when the two agree."""

    def __bool__(self):
        return self["verdict"] == "pass"

    def __repr__(self):
        lines = [cause["text"] for cause in self["causes"]]
        lines += [f"not explained: {line}" for line in self["unexplained"]]
        return "\n  ".join([self["verdict"].upper() + f": {self['robot']} and {self['mjcf']}", *lines])


def diagnose(a, b, *, digits=0):
    """Why two descriptions of one robot disagree: the causes, each with the value that would be right."""
    a, b = (one.path if isinstance(one, Robot) else as_path(one) for one in (a, b))
    return Diagnosis(_execute(["diagnose", a, b, "--quiet", *(["--digits", digits] if digits else [])]))


class Cause:
    """What explains a part of what a model does not; of a class the likeliest.

    fault, place, value, unit, detail; error: standard error of the value, infinite where the motion does not determine it;
    text; outcome: "named", "class" (others do as well) or "not explained"; others: that this motion does not separate from
    it; rival; time: (from, to) in s, None for always.
    """

    def __init__(self, cause):
        first = cause["faults"][0] if cause["faults"] else dict.fromkeys(("fault", "place", "value", "unit", "detail"))
        self.fault, self.place, self.value = first["fault"], first["place"], first["value"]
        self.unit, self.detail = first["unit"], first["detail"]
        error = first.get("standard_error")
        self.error = math.inf if error is None else error
        self.text, self.outcome, self.rival = cause["text"], cause["outcome"], cause["rival"]
        self.others = [f"{one['place']}: {one['fault']}" for one in cause["faults"][1:]]
        self.time = None if cause["from_s"] is None else (cause["from_s"], cause["to_s"])

    def __repr__(self):
        return self.text


class Judgement:
    """Whether a model explains a recording; true when it does.

    verdict: "explained", "partly explained" (not all joints that move are judged), "not explained" or "differs"; causes, the
    one that explains most first; joints: by joint, root mean squares of torque, residual (beyond the model), left (beyond the
    causes), noise, held_residual, held_left, samples, of currents drive_gain; fraction of the squared residual that the causes
    explain; rows; notes.
    """

    def __init__(self, result):
        self.verdict, self._sentence = result["verdict"], result["verdict_text"]
        self.explained = self.verdict == "explained"
        self.causes = [Cause(one) for one in result["causes"]]
        self.joints = {one.pop("joint"): one for one in result["joints"]}
        self.fraction, self.rows, self.notes = result["explained"], result["rows"], result["notes"]

    def __bool__(self):
        return self.explained

    def __repr__(self):
        return "\n  ".join([f"{self.verdict.upper()}: {self._sentence}", *(cause.text for cause in self.causes)])


def judge(model, t, q, qd=None, tau=None, qdd=None, joints=None, current=None):
    """Whether a model (a Robot or a file) explains a recording: times t (n), positions q, torques tau or currents, and, where
    known, velocities and accelerations, n x joints each, in SI units; columns are the model's joints, or those named in
    joints."""
    robot = model if isinstance(model, Robot) else Robot(model)
    names = robot.joints if joints is None else list(joints)
    for name in names:
        if name not in robot.joints:
            raise InputError(f'joints: "{name}" must be a joint of {robot.name}')
    if (tau is None) == (current is None):
        raise InputError("judge: must have one of tau and current")
    arrays = {"t": np.asarray(t, float)}
    if arrays["t"].ndim != 1 or arrays["t"].size == 0:
        raise InputError(f"t: must not be empty, and have one entry a row, got shape {arrays['t'].shape}")
    columns = ['t = "t"']
    for key, values in {"q": q, "qd": qd, "qdd": qdd, "tau": tau, "current": current}.items():
        if values is None:
            continue
        array = np.asarray(values, float)
        if array.shape != (len(arrays["t"]), len(names)):
            raise InputError(f"{key}: must have {len(arrays['t'])} x {len(names)} entries, got {_print_shape(array.shape)}")
        arrays.update({f"{key}_{i}": array[:, i] for i in range(len(names))})
        columns.append(f"{key} = {{ columns = {json.dumps([f'{key}_{i}' for i in range(len(names))])}, "
                       f"joints = {json.dumps(names, ensure_ascii=False)} }}")
    with tempfile.TemporaryDirectory() as folder:
        recording, table = os.path.join(folder, "recording.npz"), os.path.join(folder, "columns.toml")
        np.savez(recording, **arrays)
        Path(table).write_text("\n".join(columns) + "\n", encoding="utf8")
        return Judgement(_execute(["judge", robot.path, recording, "--columns", table, *_package_words(robot)], robot))
