#!/usr/bin/env python3
"""The smallest relative error of a number of the parameter file that the checks of a run find.

    tests/benchmarks/smallest_error.py build/release/bin/dexcheck [SCENARIO ...]

Each number is changed by a millionth in one run. A check that then shows more than in the right run finds the
change in proportion, so the smallest change that it finds is a millionth times its bound over its value.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

CHANGE = 1e-6
KINDS = {"model": "terms", "inverse_dynamics": "motion", "forward_dynamics": "forces"}
NUMBERS = [
    ("mass of the battery", "base.shapes.1.mass", 12.0),
    ("mass of the wheels", "base.wheels.mass", 1.5),
    ("mass of the forearms", "template.arm.links.forearm.shapes.0.mass", 1.4),
    ("mass of the last phalanges", "template.finger.links.phalanx_4.shapes.0.mass", 0.015),
    ("centre of the forearms", "template.arm.links.forearm.shapes.0.center.0", 0.125),
    ("inertia of the forearms, by their radius", "template.arm.links.forearm.shapes.0.radius", 0.034),
    ("armature of the elbows", "template.arm.joints.elbow.armature", 0.02),
    ("friction of the elbows", "template.arm.joints.elbow.damping", 0.2),
    ("wheel radius", "base.wheel_radius", 0.1),
    ("place of the fingertips", "template.finger.frames.0.xyz.0", 0.0185),
    ("radius of the fingertips", "template.finger.frames.0.sphere_radius", 0.009),
    ("mass of the torus", "object.mass", 0.2),
    ("gravity", "gravity.2", -9.81),
]


def run(program, scenario, changes, folder):
    """Value and bound of each check of a run."""
    summary = pathlib.Path(folder) / "summary.json"
    command = [program, "run", scenario, "--quiet", "--no-log", "--json", str(summary), "--set", "duration=0.05"]
    for change in changes:
        command += ["--set", change]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        sys.exit(done.stderr)
    return json.loads(summary.read_text())["checks"]


def find(program, scenario, folder):
    right = run(program, scenario, [], folder)
    print(f"{scenario:<42} {'terms':>9} {'motion':>9} {'forces':>9}")
    for name, key, value in NUMBERS:
        wrong = run(program, scenario, [f"model.{key}={value * (1.0 + CHANGE)!r}"], folder)
        smallest = dict.fromkeys(KINDS.values(), float("inf"))
        for check, found in wrong.items():
            kind = KINDS.get(found["kind"])
            largest = found.get("residual", found["max"])
            if kind is None or not largest or check not in right or largest < 2.0 * right[check]["max"]:
                continue
            smallest[kind] = min(smallest[kind], CHANGE * found["bound"] / largest)
        print(f"{name:<42}", *(f"{smallest[kind]:9.0e}" for kind in KINDS.values()), flush=True)


def main():
    program, *scenarios = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        for scenario in scenarios or ["curve"]:
            find(program, scenario, folder)


if __name__ == "__main__":
    main()
