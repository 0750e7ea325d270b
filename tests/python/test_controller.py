"""Controllers of one's own in Python: runs, studies, logs: python3 -m pytest tests/python"""

import os

import numpy as np
import pytest

import dexcheck

SOURCE = os.environ["DEXCHECK_SOURCE"]
SHORT = {"duration": 0.2, "settle": 0.05}
LAW_FILE = f"{SOURCE}/harness/examples/numpy_joint_law.py"


class Law(dexcheck.Controller):
    """Computed torque, with a memory."""

    parameters = {"omega": 20.0}

    def start(self, robot):
        self.robot, self.seen, self.begun = robot, [], 0

    def begin(self):
        self.begun += 1

    def step(self, s):
        self.seen.append((s.t, s.q.copy()))
        a = s.a_d + 2 * self.omega * (s.v_d - s.v) + self.omega**2 * (s.q_d - s.q)
        return s.M @ a + s.C @ s.v + s.gravity + s.friction


def test_a_run_has_its_checks_and_its_log():
    law = Law()
    run = dexcheck.run("panda-reach", law, set=SHORT)
    assert run and run.verdict == "pass", run
    assert 0 < run.checks["law_torque"]["max"] < 1e-13
    assert run.log["time"].shape == (200,) and run.log["q"].shape == run.log["tau"].shape == (200, 7)
    assert run.log.columns("q")[0] == "panda_joint1" and run.log.unit("time") == "s" and "q" in run.log
    # What the law saw is what was recorded; the object is this process's own.
    assert law.begun == 1 and law.robot.n == 7 and law.robot.time_step == 1e-3
    assert np.array_equal([q for _, q in law.seen[-200:]], run.log["q"])
    with pytest.raises(KeyError):
        run.log["nothing"]


def test_the_programs_own_law_makes_the_same_run(tmp_path):
    run = dexcheck.run("panda-reach", set=SHORT, out=tmp_path / "run")
    own = dexcheck.run("panda-reach", Law(), set=SHORT)
    filed = dexcheck.run("panda-reach", LAW_FILE, set=SHORT)
    assert (tmp_path / "run/log.h5").exists()
    for other in own, filed:
        np.testing.assert_allclose(other.log["tau"], run.log["tau"], rtol=1e-9, atol=1e-9)


def test_parameters_are_set_for_one_run():
    law = Law(omega=30)
    dexcheck.run("panda-reach", law, set={**SHORT, "controller.omega": 5, "control.law": "computed_torque"}, check=False)
    assert law.omega == 30
    with pytest.raises(dexcheck.InputError, match="controller.omeag: is none of its parameters: it takes omega"):
        dexcheck.run("panda-reach", law, set={**SHORT, "controller.omeag": 5})
    with pytest.raises(TypeError, match="omeag"):
        Law(omeag=3)


def test_an_exception_ends_the_run_in_one_line():
    def law(s):
        if s.t > 0.01:
            raise RuntimeError("out of cheese")
        return s.gravity

    with pytest.raises(dexcheck.RunError, match=r"RuntimeError: out of cheese \(test_controller.py:\d+\)") as raised:
        dexcheck.run("panda-reach", law, set=SHORT)
    assert "\n" not in str(raised.value) and "out of cheese" in str(raised.value.__cause__)
    with pytest.raises(dexcheck.RunError, match="FileNotFoundError: .*none.csv"):
        dexcheck.run("panda-reach", lambda s: open("none.csv"), set=SHORT)  # an OSError, but no end of the run
    with pytest.raises(dexcheck.RunError, match="SystemExit"):
        dexcheck.run("panda-reach", lambda s: __import__("sys").exit(0), set=SHORT)
    with pytest.raises(dexcheck.RunError, match="real torques"):
        dexcheck.run("panda-reach", lambda s: s.gravity + 1j, set=SHORT)
    with pytest.raises(dexcheck.RunError, match="must return 7 torques"):
        dexcheck.run("panda-reach", lambda s: 0.0, set=SHORT)
    with pytest.raises(dexcheck.InputError, match="none.toml"):
        dexcheck.run("none.toml", law)
    with pytest.raises(dexcheck.RunError, match="within 0.3 s"):
        dexcheck.run("panda-reach", lambda s: __import__("time").sleep(5), set=SHORT, time_limit=0.3)


def test_a_study_varies_the_parameters_of_a_function():
    def pd(s, stiffness=400.0, damping=40.0):
        return s.gravity + s.M @ (stiffness * (s.q_d - s.q) + damping * (s.v_d - s.v))

    study = dexcheck.study("panda-reach", pd, vary={"controller.stiffness": [100, 400], "controller.damping": [20, 40]},
                           set={**SHORT, "duration": 0.5}, jobs=2)
    assert len(study) == 4 and set(study["outcome"]) == {"tracked"}
    error = study["joint_error_max"]
    assert error.dtype == float and (error > 0).all()
    soft = study["controller.stiffness"] == 100
    assert error[~soft].max() < error[soft].min()
    assert "4" in study.findings


def test_a_law_that_fails_costs_its_trial_alone():
    def law(s, danger=0.0):
        if danger and s.t > 0.01:
            raise ValueError("too dangerous")
        return s.gravity + s.M @ (400 * (s.q_d - s.q) + 40 * (s.v_d - s.v))

    study = dexcheck.study("panda-reach", law, vary={"controller.danger": [0, 1, 0]}, set=SHORT)
    assert list(study["outcome"]) == ["tracked", "crashed", "tracked"]
    assert "ValueError: too dangerous (test_controller.py" in study["failure"][1]


def test_the_file_of_the_examples_is_a_study(tmp_path):
    folder = f"{SOURCE}/harness/examples"
    text = open(f"{folder}/own_gains.toml").read()
    for before, now in (('set = [', 'set = ["duration=2", "settle=0.1", '), ('"numpy', f'"{folder}/numpy')):
        assert text.count(before) == 1
        text = text.replace(before, now)
    (tmp_path / "gains.toml").write_text(text)
    study = dexcheck.study(tmp_path / "gains.toml", db=tmp_path / "gains.sqlite", jobs=2)
    assert len(study) == 12 and (tmp_path / "gains.sqlite").exists()
    best = np.nanargmin(study["joint_error_rms"])
    assert study["controller.natural_frequency"][best] > 10


def test_diagnose_says_what_repairs_a_description(tmp_path):
    panda = f"{SOURCE}/controller/parameters/panda.toml"
    text = open(panda).read()
    wrong = tmp_path / "panda.toml"
    assert "mass = 3.228604" in text
    wrong.write_text(text.replace("mass = 3.228604", "mass = 3.3"))
    diagnosis = dexcheck.diagnose(wrong, f"{SOURCE}/mjcf/panda_scene.xml")
    assert not diagnosis and "3.2286" in str(diagnosis)
    assert dexcheck.diagnose(panda, f"{SOURCE}/mjcf/panda_scene.xml")
