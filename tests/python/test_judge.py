"""Recordings as NumPy arrays, judged: python3 -m pytest tests/python"""

import os

import numpy as np
import pytest

import dexcheck

PANDA = f"{os.environ['DEXCHECK_SOURCE']}/controller/parameters/panda.toml"
FRICTION = 1.5  # N m


@pytest.fixture(name="panda", scope="module")
def make_panda():
    return dexcheck.load(PANDA)


@pytest.fixture(name="recording", scope="module")
def make_recording(panda):
    """Sines about a posture, with the model's own torques and noise."""
    random = np.random.default_rng(3)
    t = np.arange(0, 20, 0.004)
    home = np.array([0, 0.2, 0, -1.6, 0, 1.8, 0])
    q, qd, qdd = np.tile(home, (len(t), 1)), np.zeros((len(t), 7)), np.zeros((len(t), 7))
    for k in (1, 2, 3):
        w = 2 * np.pi * random.uniform(0.1, 0.2, 7) * k
        phase, size = random.uniform(0, 2 * np.pi, 7), random.uniform(0.15, 0.3, 7)
        q += size * np.sin(np.outer(t, w) + phase)
        qd += size * w * np.cos(np.outer(t, w) + phase)
        qdd -= size * w * w * np.sin(np.outer(t, w) + phase)
    tau = np.array([panda.M(q[i]) @ qdd[i] + panda.h(q[i], qd[i]) for i in range(len(t))])
    assert np.abs(tau).max() > 10
    return t, q + random.normal(0, 1e-5, q.shape), qd, tau + random.normal(0, 0.02, tau.shape)


def test_the_right_model_explains_it(panda, recording):
    judgement = dexcheck.judge(panda, *recording)
    assert judgement.explained and judgement, judgement
    assert judgement.causes == [] and judgement.verdict == "explained" and str(judgement).startswith("EXPLAINED: ")
    assert list(judgement.joints) == panda.joints
    for joint in judgement.joints.values():
        assert joint["torque"] > joint["left"] > 0 and joint["left"] < 1.5 * joint["noise"]
    assert judgement.rows == len(recording[0])


def test_a_cause_is_named_with_its_size(panda, recording):
    t, q, qd, tau = recording
    rubbing = tau.copy()
    rubbing[:, 3] += FRICTION * np.sign(qd[:, 3])
    judgement = dexcheck.judge(PANDA, t, q, qd, tau=rubbing)
    assert not judgement.explained and not judgement
    cause = judgement.causes[0]
    assert (cause.fault, cause.place, cause.unit, cause.outcome) == ("dry friction", "joint panda_joint4", "N m", "named")
    assert cause.value == pytest.approx(FRICTION, rel=0.05) and 0 < cause.error < 0.1 * FRICTION
    assert cause.text in str(judgement) and cause.time is None
    joint = judgement.joints["panda_joint4"]
    assert joint["residual"] > 5 * joint["left"]
    assert judgement.fraction > 0.9
    # Columns in another order are the same recording, velocities that are missing are derived.
    again = dexcheck.judge(panda, t, q[:, ::-1], tau=rubbing[:, ::-1], joints=panda.joints[::-1])
    assert (again.causes[0].fault, again.causes[0].place) == (cause.fault, cause.place)


def test_bad_input_is_refused(panda, recording):
    t, q, qd, tau = recording
    with pytest.raises(dexcheck.InputError, match="tau: must have 5000 x 7 entries, got 5000 x 6"):
        dexcheck.judge(panda, t, q, qd, tau[:, :6])
    with pytest.raises(dexcheck.InputError, match="must have one of tau and current"):
        dexcheck.judge(panda, t, q)
    with pytest.raises(dexcheck.InputError, match='joints: "nobody" must be a joint of'):
        dexcheck.judge(panda, t, q[:, :1], tau=tau[:, :1], joints=["nobody"])
    with pytest.raises(dexcheck.InputError, match="time goes back"):
        dexcheck.judge(panda, t[::-1], q, tau=tau)
    with pytest.raises(dexcheck.InputError, match="t: must not be empty"):
        dexcheck.judge(panda, [], q, tau=tau)
    with pytest.raises(dexcheck.InputError):
        dexcheck.judge("nowhere.urdf", t, q, tau=tau)
