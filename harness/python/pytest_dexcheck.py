"""A plugin of pytest: each pair of descriptions of a robot is one test, which fails with what dexcheck prints.

    pytest --dexcheck robot.urdf robot.xml

or, in pytest.ini, one line a pair, with options of `dexcheck consistency` where they are needed:

    [pytest]
    dexcheck =
        robot.urdf robot.xml
        arm.urdf arm.xml --only gripper --digits 6
"""

import os
import pathlib
import shlex
import shutil
import subprocess

import pytest

DISAGREE = 1  # exit code of dexcheck; 0 agrees, others made no comparison


def pytest_addoption(parser):
    group = parser.getgroup("dexcheck")
    group.addoption("--dexcheck", nargs=2, action="append", default=[], metavar=("A", "B"),
                    help="compare two descriptions of one robot (TOML, URDF, MJCF); may be given again")
    group.addoption("--dexcheck-program", default=os.environ.get("DEXCHECK", ""), metavar="FILE",
                    help="the program dexcheck (default: DEXCHECK, the one of this installation, or of PATH)")
    parser.addini("dexcheck", "pairs of descriptions to compare, one pair a line, with options of dexcheck consistency",
                  type="linelist", default=[])


@pytest.hookimpl(tryfirst=True)  # before -k deselects
def pytest_collection_modifyitems(session, config, items):
    pairs = [(config.invocation_params.dir, words) for words in config.getoption("--dexcheck")]
    pairs += [(config.rootpath, shlex.split(line)) for line in config.getini("dexcheck")]
    items += [Pair.from_parent(session, name=f"dexcheck {shlex.join(words)}", folder=folder, words=words)
              for folder, words in pairs]


class Disagreement(Exception):
    pass


class NotCompared(Exception):
    pass


class Pair(pytest.Item):
    def __init__(self, folder, words, **kwargs):
        super().__init__(**kwargs)
        self.folder, self.words = folder, words

    def runtest(self):
        program = self.config.getoption("--dexcheck-program") or find_program()
        try:
            result = subprocess.run([program, "consistency", *self.words], cwd=self.folder, stdin=subprocess.DEVNULL,
                                    capture_output=True, text=True, errors="replace", check=False)
        except OSError as error:
            raise NotCompared(f"{program}: cannot be run: {error.strerror}") from None
        self.add_report_section("call", "dexcheck", result.stdout)
        if result.returncode != 0:
            kind = Disagreement if result.returncode == DISAGREE else NotCompared
            raise kind((result.stdout + result.stderr).strip() or f"{program}: ended with {result.returncode}")

    def repr_failure(self, excinfo):
        if isinstance(excinfo.value, (Disagreement, NotCompared)):
            return str(excinfo.value)
        return super().repr_failure(excinfo)

    def reportinfo(self):
        return self.folder, None, f"dexcheck consistency {shlex.join(self.words)}"


def find_program():
    """The program that this file was installed with, in ../../../bin, or the one of PATH."""
    installed = pathlib.Path(__file__).resolve().parents[3] / "bin/dexcheck"
    return str(installed) if installed.exists() else shutil.which("dexcheck") or "dexcheck"
