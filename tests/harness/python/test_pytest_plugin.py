"""The plugin of pytest as it is installed: python3 -m pytest test_pytest_plugin.py, with DEXCHECK_CMAKE, DEXCHECK_BUILD and
DEXCHECK_SOURCE in the environment."""

import os
import pathlib
import subprocess
import sys

import pytest

SOURCE = pathlib.Path(os.environ["DEXCHECK_SOURCE"])
MJCF = SOURCE / "mjcf/panda.xml"


@pytest.fixture(name="prefix", scope="session")
def install(tmp_path_factory):
    prefix = tmp_path_factory.mktemp("prefix")
    subprocess.run([os.environ["DEXCHECK_CMAKE"], "--install", os.environ["DEXCHECK_BUILD"], "--component", "program",
                    "--prefix", prefix], check=True, stdout=subprocess.DEVNULL)
    return prefix


@pytest.fixture(name="run")
def make_run(prefix, tmp_path):
    """Runs pytest in a folder with panda.toml, which agrees, and wrong.toml, which has another gravity."""
    text = (SOURCE / "controller/parameters/panda.toml").read_text()
    (tmp_path / "panda.toml").write_text(text)
    wrong = "\n".join("gravity = [0, 0, -9.8]" if line.startswith("gravity = ") else line for line in text.split("\n"))
    assert wrong != text
    (tmp_path / "wrong.toml").write_text(wrong)

    def run(*words):
        path = os.pathsep.join([str(prefix / "lib/python3/dist-packages"), os.environ.get("PYTHONPATH", "")])
        environment = {"PATH": "/usr/bin:/bin", "PYTHONPATH": path.rstrip(os.pathsep), "PYTHONDONTWRITEBYTECODE": "1"}
        return subprocess.run([sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-ra", *map(str, words)],
                              cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

    return run


def test_pairs_that_agree(run):
    result = run("-v", "--dexcheck", "panda.toml", MJCF)
    assert result.returncode == 0, result.stdout + result.stderr
    assert f"dexcheck panda.toml {MJCF} PASSED" in result.stdout
    assert "1 passed" in result.stdout


def test_each_pair_is_a_test_and_says_what_differs(run):
    result = run("--dexcheck", "panda.toml", MJCF, "--dexcheck", "wrong.toml", MJCF)
    assert result.returncode == 1
    assert "1 failed, 1 passed" in result.stdout
    assert f"_ dexcheck consistency wrong.toml {MJCF} _" in result.stdout
    assert "DISAGREE" in result.stdout and "gravity_vector" in result.stdout
    assert "Traceback" not in result.stdout and "subprocess" not in result.stdout


def test_bad_input_is_a_failure_with_its_line(run):
    result = run("--dexcheck", "none.toml", MJCF)
    assert result.returncode == 1
    assert "none.toml: cannot be read" in result.stdout


def test_pairs_of_the_ini_file_have_options(run, tmp_path):
    (tmp_path / "pytest.ini").write_text(f"[pytest]\ndexcheck =\n    panda.toml {MJCF} --samples 20\n    wrong.toml {MJCF} --digits 2\n")
    (tmp_path / "test_own.py").write_text("def test_own():\n    pass\n")
    result = run()
    assert "3 passed" in result.stdout, result.stdout  # 9.8 for 9.81 is right to two digits
    result = run("-k", "wrong")
    assert "1 passed, 2 deselected" in result.stdout, result.stdout


def test_a_program_that_is_not_there(run):
    result = run("--dexcheck", "panda.toml", MJCF, "--dexcheck-program", "/nowhere/dexcheck")
    assert result.returncode == 1
    assert "/nowhere/dexcheck: cannot be run: No such file" in result.stdout


def test_without_pairs_nothing_is_added(run):
    assert run().returncode == 5  # no tests
