#!/usr/bin/python3
"""Runs every case with the built program and prints a table: run_cases.py DEXCHECK [NAME...].

A folder beside this file is a case. Its case.toml has
  about      what was reported, or changed, and the right answer
  files      files of this folder that it needs beside its own
  recording  the kind of recording that crane.py makes
  left_to    what a later piece of work is to do; the case is a known failure until then
  [[run]]    a command without "dexcheck", and what its output must be:
    exit     the exit code, or a list of those that are right
    has      regular expressions that its text has, in any order
    lacks    those that it has not: other causes, wrong names
    near     [expression with <number>, value, tolerance]: the first number that it finds
    causes   how many causes are named
    folder, environment
Text is standard output and error, each run of spaces and line ends one space. The exit code is 0 when each case is as
it is expected: right, or a known failure that still is one.
"""
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
CAUSE = re.compile(r"^(?: {2,4}\d+ {2}\S| {0,4}\d+\. \S)", re.MULTILINE)
NUMBER = r"([-+]?[\d.]+(?:e[-+]?\d+)?)"
SECONDS = 300  # of one command; against hangs only


def list_faults(run, code, text):
    """@returns what a command's exit code and text lack, one line each."""
    flat = " ".join(text.split())
    codes = run["exit"] if isinstance(run["exit"], list) else [run["exit"]]
    faults = [f"exit code {code}, not {run['exit']}"] if code not in codes else []
    faults += [f"lacks /{one}/" for one in run.get("has", []) if not re.search(one, flat)]
    faults += [f"has /{one}/" for one in run.get("lacks", []) if re.search(one, flat)]
    for one, value, tolerance in run.get("near", []):
        match = re.search(one.replace("<number>", NUMBER), flat)
        if not match:
            faults.append(f"lacks /{one}/")
        elif not abs(float(match[1]) - value) <= tolerance:
            faults.append(f"{match[0]}, not {value} +- {tolerance}")
    named = len(CAUSE.findall(text))
    if "causes" in run and named != run["causes"]:
        faults.append(f"{named} causes, not {run['causes']}")
    return faults


def verdict_of(text):
    """@returns the line with the verdict; of a command without one the last line."""
    lines = [line for line in text.splitlines() if line.strip()]
    verdict = [line for line in lines if re.match(r"(AGREE|DISAGREE|EXPLAINED|DIFFERS|PASS|FAIL|GOOD|FOUND|OK)", line)]
    return (verdict or lines or [""])[0]


def run_case(program, case, folder):
    """@returns verdicts and faults of a case's commands."""
    verdicts, faults = [], []
    for run in case["run"]:
        environment = {k: v for k, v in os.environ.items() if k not in run.get("unset", [])} | run.get("environment", {})
        try:
            done = subprocess.run([program, *shlex.split(run["command"])], cwd=folder / run.get("folder", "."), text=True,
                                  errors="replace", timeout=SECONDS, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, env=environment)
            code, text = done.returncode, done.stdout
        except (subprocess.TimeoutExpired, FileNotFoundError) as error:
            code, text = -1, str(error)
        verdicts.append(f"{code}: {verdict_of(text)}")
        faults += [f"dexcheck {run['command']}: {fault}" for fault in list_faults(run, code, text)]
    return verdicts, faults


def main(program, names):
    unexpected, known = [], []
    for folder in sorted(path.parent for path in HERE.glob("*/case.toml")):
        name = folder.name
        if names and name not in names:
            continue
        case = tomllib.loads((folder / "case.toml").read_text())
        with tempfile.TemporaryDirectory() as scratch:
            scratch = Path(scratch)
            shutil.copytree(folder, scratch, dirs_exist_ok=True)
            for file in case.get("files", []):
                shutil.copy(HERE / file, scratch)
            if "recording" in case:
                subprocess.run([sys.executable, HERE / "crane.py", case["recording"]], cwd=scratch, check=True)
            verdicts, faults = run_case(os.path.abspath(program), case, scratch)
        left_to = case.get("left_to")
        word = "right" if not faults else "WRONG"
        if left_to:
            known.append(name)
            word = f"left to {left_to}" if faults else "RIGHT, but listed as left"
        if bool(faults) != bool(left_to):
            unexpected.append(name)
        print(f"{name:30} {verdicts[0][:84]:84} {word}")
        for verdict in verdicts[1:]:
            print(f"{'':30} {verdict[:84]}")
        if names or (faults and not left_to):
            for fault in faults:
                print(f"{'':32}{fault}")
    print(f"\nleft: {', '.join(known) or 'none'}")
    print(f"not as expected: {', '.join(unexpected) or 'none'}")
    return 1 if unexpected else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
