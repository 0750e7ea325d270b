"""Runs and studies by the program dexcheck, with results as Python has them."""

import csv
import io
import json
import os
import re
import tempfile
from pathlib import Path

import numpy as np

from .controller import InputError
from .program import execute
from .robot import Log


def _assignments(values):
    """A dictionary as KEY=VALUE of TOML."""
    return [f"{key}={value if isinstance(value, str) else json.dumps(np.asarray(value).tolist())}"
            for key, value in (values or {}).items()]


class Run:
    """A run that came to its end; true when it passed. verdict, summary (the keys of summary.json), checks, causes,
    log["q"]: signals as arrays, folder."""

    def __init__(self, folder, text, keep):
        self.folder, self._text, self._keep = Path(folder), text, keep
        self.summary = json.loads((self.folder / "summary.json").read_text(encoding="utf8"))
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
    _, printed = execute(words, controller)
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
        if set and not vary:
            raise InputError("study: set is for a grid of vary; a study's file has its own")
        if vary:
            study = _write_study(study, vary, set, folder)
        database = db or os.path.join(folder, "study.sqlite")
        words = ["study", "run", study, "--db", database] + ([] if jobs is None else ["--jobs", jobs])
        _, findings = execute(words, controller, apart=True)
        _, text = execute(["study", "export", database, "--out", "-"])
        if not db:  # it is gone at the end
            findings = re.sub(r"\s+in\s+" + re.escape(database), "", findings)
        return Study(text, findings.strip())


def _write_study(scenario, vary, set, folder):
    scenario = os.path.abspath(scenario) if str(scenario).endswith(".toml") else scenario
    lines = ['name = "study"', f"scenario = {json.dumps(str(scenario))}", f"set = {json.dumps(_assignments(set))}"]
    for key, values in vary.items():
        lines += ["[[vary]]", f"key = {json.dumps(key)}", f"values = {json.dumps(np.asarray(values).tolist())}"]
    file = os.path.join(folder, "study.toml")
    Path(file).write_text("\n".join(lines) + "\n")
    return file
