"""Runs, studies and diagnoses by the program dexcheck, with results as Python has them."""

import csv
import io
import json
import os
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from ._dexcheck import InputError, Log
from .controller import RunError, serve

_PASS, _DISAGREEMENT, _INPUT = 0, 1, 2


def _find_program():
    """The environment's DEXCHECK, the program of this build or installation, or the one on the path."""
    folder = Path(__file__).resolve().parent
    near = [folder.parents[depth] / "bin/dexcheck" for depth in (1, 3)]
    found = os.environ.get("DEXCHECK") or next((str(one) for one in near if one.is_file()), None)
    return found or shutil.which("dexcheck") or "dexcheck"


class _Server:
    """Serves a law of this process to a program: one run after the other here, or each in a process of its own."""

    def __init__(self, law, apart, folder):
        self.law, self.apart, self.error, self.children = law, apart, None, []
        self.path = os.path.join(folder, "controller")
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(self.path)
        self.listener.listen(64)

    def accept(self):
        connection, _ = self.listener.accept()
        with connection:
            if not self.apart:
                self.error = serve(connection, self.law) or self.error
                return
            child = os.fork()
            if child == 0:
                try:
                    self.listener.close()
                    serve(connection, self.law)
                finally:
                    os._exit(0)
            self.children.append(child)
        self.children = [child for child in self.children if os.waitpid(child, os.WNOHANG)[0] == 0]

    def close(self):
        self.listener.close()
        for child in self.children:
            os.waitpid(child, 0)


def _execute(words, controller=None, apart=False):
    """Runs the program. Returns its exit code, what it printed, and the exception of a law that runs here."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        server = None
        if isinstance(controller, (str, os.PathLike)):
            words = [*words, "--controller", os.fspath(controller)]
        elif controller is not None:
            server = _Server(controller, apart, folder)
            words = [*words, "--controller", "unix:" + server.path]
        process = subprocess.Popen([_find_program(), *map(str, words)], stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                                   env={"DEXCHECK_PYTHON": sys.executable, **os.environ})
        try:
            if server is not None:
                _serve_until_end(process, server)
            code = process.wait()
        except BaseException:
            process.send_signal(signal.SIGINT)
            process.wait()
            raise
        finally:
            if server is not None:
                server.close()
        out.seek(0)
        err.seek(0)
        printed, line = out.read().decode(), (err.read().decode().strip().splitlines() or [""])[-1]
        line = line.replace("unix:" + server.path, "of this process") if server else line
        if code == _INPUT:
            raise InputError(line) from (server.error if server else None)
        if code not in (_PASS, _DISAGREEMENT):
            raise RunError(line) from (server.error if server else None)
        return code, printed


def _serve_until_end(process, server):
    ended = os.pidfd_open(process.pid)
    try:
        while True:
            ready, _, _ = select.select([server.listener, ended], [], [])
            if server.listener in ready:
                server.accept()
            elif ended in ready:
                return
    finally:
        os.close(ended)


def _assignments(values):
    """A dictionary as KEY=VALUE of TOML."""
    return [f"{key}={value if isinstance(value, str) else json.dumps(np.asarray(value).tolist())}"
            for key, value in (values or {}).items()]


class Run:
    """A run that came to its end; true when it passed. verdict, summary (the keys of summary.json), checks, causes,
    log["q"]: signals as arrays, folder."""

    def __init__(self, folder, text, keep):
        self.folder, self._text, self._keep = Path(folder), text, keep
        self.summary = json.loads((self.folder / "summary.json").read_text())
        self.verdict, self.checks, self.causes = (self.summary.get(key) for key in ("verdict", "checks", "causes"))
        self.log = Log(self.folder / "log.h5")

    def __bool__(self):
        return self.verdict == "pass"

    def __repr__(self):
        return self._text


def run(scenario, controller=None, *, set=None, seed=0, check=True, out=None, time_limit=None):
    """Runs a scenario, as `dexcheck run` does, with a controller of one's own: a Controller, a function of the state, or a
    file or command. set: keys of the scenario. out: the folder of log and summary; without, they go with the result."""
    keep = None if out else tempfile.TemporaryDirectory()
    folder = out or os.path.join(keep.name, "run")
    words = ["run", scenario, "--out", folder, "--no-report", "--quiet", "--seed", seed]
    for assignment in _assignments(set):
        words += ["--set", assignment]
    if not check:
        words.append("--no-check")
    if time_limit is not None:
        words += ["--controller-time-limit", time_limit]
    _, printed = _execute(words, controller)
    return Run(folder, printed.strip(), keep)


class Study:
    """The trials of a study, column by column: study["controller.stiffness"], study["position_error_rms"] are arrays.
    findings: what the study comes to, in words."""

    def __init__(self, text, findings):
        rows = list(csv.reader(io.StringIO(text)))
        self.findings, self.columns = findings, rows[0]
        self._values = {name: _to_array([row[i] for row in rows[1:]]) for i, name in enumerate(rows[0])}

    def __getitem__(self, name):
        return self._values[name]

    def __len__(self):
        return len(self._values["trial"])

    def __repr__(self):
        return self.findings


def _to_array(texts):
    try:
        return np.array([float(text) if text else np.nan for text in texts])
    except ValueError:
        return np.array(texts, dtype=object)


def study(study, controller=None, *, vary=None, set=None, db=None, jobs=None):
    """Makes a study, as `dexcheck study run` does: a study's name or file, or with `vary` a grid over a scenario,
    {"controller.stiffness": [100, 200]}. db: its database, which is kept. A law of this process is copied for each
    trial."""
    with tempfile.TemporaryDirectory() as folder:
        if vary:
            study = _write_study(study, vary, set, folder)
        database = db or os.path.join(folder, "study.sqlite")
        words = ["study", "run", study, "--db", database] + ([] if jobs is None else ["--jobs", jobs])
        _, findings = _execute(words, controller, apart=True)
        _, text = _execute(["study", "export", database, "--out", "-"])
        return Study(text, findings.strip())


def _write_study(scenario, vary, set, folder):
    scenario = os.path.abspath(scenario) if str(scenario).endswith(".toml") else scenario
    lines = ['name = "study"', f"scenario = {json.dumps(str(scenario))}", f"set = {json.dumps(_assignments(set))}"]
    for key, values in vary.items():
        lines += ["[[vary]]", f"key = {json.dumps(key)}", f"values = {json.dumps(np.asarray(values).tolist())}"]
    file = os.path.join(folder, "study.toml")
    Path(file).write_text("\n".join(lines) + "\n")
    return file


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
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "diagnosis.json")
        words = ["diagnose", a, b, "--json", file, "--quiet"]
        words += ["--digits", digits] if digits else []
        _execute(words)
        return Diagnosis(json.loads(Path(file).read_text()))
