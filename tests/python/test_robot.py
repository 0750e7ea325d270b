"""The Python module, as a robot's own tests would use it: python3 -m pytest tests/python"""

import copy
import os
import pickle
import re
import timeit

import numpy as np
import pytest

import dexcheck

ROOT = os.environ["DEXCHECK_SOURCE"]
ARM = f"{ROOT}/harness/descriptions/examples/arm.urdf"
PANDA = f"{ROOT}/controller/parameters/panda.toml"
PANDA_MJCF = f"{ROOT}/mjcf/panda.xml"


@pytest.fixture(name="panda")
def make_panda():
    return dexcheck.load(PANDA)


@pytest.fixture(name="state")
def make_state(panda):
    random = np.random.default_rng(1)
    return random.uniform(-1, 1, panda.nq), random.uniform(-1, 1, panda.nv)


def test_names(panda):
    assert panda.joints == [f"panda_joint{i}" for i in range(1, 8)]
    assert (panda.nq, panda.nv) == (7, 7)
    assert panda.name in repr(panda)


def test_terms_hang_together(panda, state):
    q, v = state
    M, C = panda.M(q), panda.C(q, v)
    assert M.shape == C.shape == (7, 7)
    np.testing.assert_allclose(M, M.T, atol=1e-14)
    np.testing.assert_allclose(panda.c(q, v), C @ v, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(panda.h(q, v), C @ v + panda.g(q), rtol=1e-13, atol=1e-13)
    kinetic, _ = panda.energy(q, v)
    assert kinetic == pytest.approx(0.5 * v @ M @ v, rel=1e-13)
    # M_dot - 2 C is skew; gravity is the gradient of the potential energy.
    h = 1e-6
    M_dot = (panda.M(q + h * v) - panda.M(q - h * v)) / (2 * h)
    skew = M_dot - 2 * C
    np.testing.assert_allclose(skew, -skew.T, atol=1e-8)
    assert np.abs(skew).max() > 1e-3
    slope = [(panda.energy(q + h * e, 0 * v)[1] - panda.energy(q - h * e, 0 * v)[1]) / (2 * h) for e in np.eye(7)]
    np.testing.assert_allclose(panda.g(q), slope, atol=1e-6)


def test_jacobian_is_the_rate_of_the_pose(panda, state):
    q, v = state
    frame = panda.frames[0]
    h = 1e-6
    rate = (panda.pose(frame, q + h * v) - panda.pose(frame, q - h * v)) / (2 * h)
    X = panda.pose(frame, q)
    twist = panda.jacobian(frame, q) @ v
    np.testing.assert_allclose(X[:3, :3].T @ rate[:3, 3], twist[:3], atol=1e-8)
    np.testing.assert_allclose((X[:3, :3].T @ rate[:3, :3])[[2, 0, 1], [1, 2, 0]], twist[3:], atol=1e-8)


def test_files_agree(panda):
    result = panda.compare(PANDA_MJCF, samples=50)
    assert result, result
    assert result.terms["M_bar"]["pass"] and result.terms["M_bar"]["compared"] >= 50 * 49
    assert result.causes == [] and str(result).startswith("AGREE: ")
    assert panda.compare(dexcheck.load(PANDA_MJCF), samples=10)


def test_a_mistake_is_found_and_named(panda, tmp_path):
    wrong = tmp_path / "wrong.urdf"
    with open(ARM, encoding="utf8") as file:
        text = file.read()
    turn = r'(ixy|ixz|iyz)="(-?)([\d.]+)"'
    wrong.write_text(re.sub(turn, lambda m: f'{m[1]}="{"" if m[2] else "-"}{m[3]}"', text))
    result = dexcheck.load(wrong).compare(ARM, samples=20)
    assert not result
    assert not result.terms["M_bar"]["pass"]
    cause = result.causes[0]
    assert cause["id"] == "inertia.product_sign" and cause["explained"] == 1.0, result
    assert any("signs of its products" in line for line in result.differences)
    assert cause["text"] in str(result)


class OwnModel:
    """A model of one's own: any object with some of M, c, g, h, friction."""

    def __init__(self, robot, factor=1.0):
        self.robot = robot
        self.factor = factor

    def M(self, q):
        return self.factor * self.robot.M(q)

    def g(self, q):
        return self.robot.g(q)


def test_own_functions(panda):
    assert panda.compare(OwnModel(panda), samples=50)
    result = panda.compare(OwnModel(panda, 1.0 + 1e-9), samples=50)
    assert not result and not result.terms["M_bar"]["pass"] and result.terms["gravity"]["pass"]
    assert panda.compare(OwnModel(panda, 1.0 + 1e-9), samples=50, digits=6)
    # The engine itself answers for an MJCF.
    engine = dexcheck.load(PANDA_MJCF)
    assert engine.compare({"M": panda.M, "c": panda.c, "g": panda.g}, samples=50)


def test_floating_base():
    robot = dexcheck.load(ARM, floating=True)
    assert (robot.nq, robot.nv) == (10, 9)
    q = np.array([0, 0, 0, 1, 0, 0, 0, 0.1, 0.2, 0.3])
    M = robot.M(q)
    np.testing.assert_allclose(M[:3, :3], np.eye(3) * M[0, 0], atol=1e-12)
    np.testing.assert_allclose(M[6:, 6:], dexcheck.load(ARM).M(q[7:]), atol=1e-13)


BALL = """<mujoco><worldbody><body name="stand"><body name="upper"><joint name="shoulder" type="ball"/>
<inertial pos="0.1 0.2 0.3" mass="2" diaginertia="0.04 0.05 0.06"/><site name="tip" pos="0.2 0 0.1"/>
<body name="lower" pos="0.3 0 0"><joint name="elbow" axis="0 1 0"/>
<inertial pos="0.1 0 0.01" mass="1" diaginertia="0.004 0.006 0.008"/></body></body></body></worldbody></mujoco>"""


def test_ball_joints(tmp_path):
    """Four numbers in q and three in v for a ball; the engine itself answers for the MJCF."""
    file = tmp_path / "ball.xml"
    file.write_text(BALL)
    robot = dexcheck.load(file)
    assert (robot.nq, robot.nv) == (5, 4)
    assert robot.joints == ["shoulder", "elbow"]
    q = np.array([0.8, 0.3, -0.4, 0.2, 0.7])
    q[:4] /= np.linalg.norm(q[:4])
    v = np.array([1.0, -2.0, 0.5, 1.5])
    h = 1e-6

    def moved(step):
        """q after the ball has turned by step along its own axes: q_dot = q (0, v) / 2."""
        w, x, y, z = q[:4]
        rate = 0.5 * np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
        return np.concatenate([q[:4] + rate @ step[:3], q[4:] + step[3:]])

    slope = [(robot.energy(moved(h * e), 0 * v)[1] - robot.energy(moved(-h * e), 0 * v)[1]) / (2 * h) for e in np.eye(4)]
    np.testing.assert_allclose(robot.g(q), slope, atol=1e-6)
    twist = robot.jacobian("tip", q) @ v
    rate = (robot.pose("tip", moved(h * v)) - robot.pose("tip", moved(-h * v))) / (2 * h)
    np.testing.assert_allclose(robot.pose("tip", q)[:3, :3].T @ rate[:3, 3], twist[:3], atol=1e-8)
    assert robot.compare({"M": robot.M, "c": robot.c, "g": robot.g, "h": robot.h}, samples=20)
    assert not robot.compare({"M": lambda q: robot.M(q).T + np.eye(4) * 1e-9}, samples=2)
    with pytest.raises(ValueError):
        robot.M(np.zeros(4))


def test_bad_input_is_refused(panda, tmp_path):
    for bad in [tmp_path / "none.urdf", ARM.replace(".urdf", ".py")]:
        with pytest.raises(dexcheck.InputError):
            dexcheck.load(bad)
    with pytest.raises(ValueError):
        panda.M(np.zeros(6))
    with pytest.raises(dexcheck.InputError, match="M: must have 7 x 7 entries, got 3 x 3"):
        panda.compare({"M": lambda q: np.eye(3)}, samples=1)
    with pytest.raises(dexcheck.InputError, match="must have one of M, c, g, h, friction"):
        panda.compare({})
    with pytest.raises(dexcheck.InputError, match="'gravity': must be a function and one of"):
        panda.compare({"M": panda.M, "gravity": panda.g})
    with pytest.raises(dexcheck.InputError, match="g: must be real"):
        panda.compare({"g": lambda q: panda.g(q) + 0j}, samples=1)
    with pytest.raises(dexcheck.InputError, match="must be loaded with floating=False"):
        dexcheck.load(ARM).compare(dexcheck.load(ARM, floating=True))
    with pytest.raises(RuntimeError, match="my own mistake"):
        panda.compare({"M": raise_mistake}, samples=1)
    with pytest.raises(ValueError, match='nowhere'):
        panda.pose("nowhere", np.zeros(7))


def test_a_copy_is_a_robot_of_its_own(panda, state):
    q, _ = state
    copies = [copy.copy(panda), copy.deepcopy(panda), pickle.loads(pickle.dumps(panda))]
    for one in copies:
        np.testing.assert_array_equal(one.M(q), panda.M(q))


def raise_mistake(_):
    raise RuntimeError("my own mistake")


def test_a_call_costs_little():
    """A term of an arm of three joints, call included, costs less than NumPy's inverse of a matrix of its size: a ratio of one
    run, since machines differ and are busy."""

    def measure(call, calls=1000):
        return min(timeit.repeat(call, number=calls, repeat=30)) / calls

    robot = dexcheck.load(ARM)
    q, v = np.array([0.1, 0.2, 0.3]), np.array([1.0, 2.0, 3.0])
    identity = np.eye(3)
    inverse = measure(lambda: np.linalg.inv(identity))
    for call in (lambda: robot.M(q), lambda: robot.c(q, v), lambda: robot.g(q)):
        seconds = measure(call)
        print(f"{1e6 * seconds:.2f} us, {1e6 * inverse:.2f} us")
        assert seconds < inverse
