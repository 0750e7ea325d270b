#!/usr/bin/env python3
"""Mass matrix, Coriolis forces and gravity of a small arm in NumPy, compared with its URDF by dexcheck:

    dexcheck consistency arm.urdf --program 'python3 arm.py'

or, without a running program, over files:

    dexcheck eval arm.urdf --states 1000 --out states
    python3 arm.py states
    dexcheck consistency arm.urdf --results states
"""

import json
import sys
from pathlib import Path

import numpy as np

GRAVITY = np.array([0.0, 0.0, -9.81])


def tensor(ixx, ixy, ixz, iyy, iyz, izz):
    return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])


# Where each joint stands on the link before it, its axis, and mass, centre of mass and inertia of its link.
ARM = [
    ([0.0, 0.0, 0.1], [0, 0, 1], 3.2, [0.01, 0.0, 0.12], tensor(0.021, 0.001, -0.002, 0.019, 0.0005, 0.008)),
    ([0.05, 0.0, 0.25], [0, 1, 0], 2.1, [0.18, 0.02, 0.0], tensor(0.004, -0.0012, 0.0003, 0.031, 0.0002, 0.032)),
    ([0.4, 0.0, 0.0], [0, 1, 0], 1.3, [0.15, -0.01, 0.005], tensor(0.002, 0.0004, -0.0001, 0.012, 0.0003, 0.0125)),
]


def rotation(axis, angle):
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=float)
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def terms(q, v):
    """M (n x n), c = C v (n) and g (n) by the Jacobians of the centres of mass."""
    n = len(ARM)
    M, c, g = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    R, p = np.eye(3), np.zeros(3)
    axes, origins, rates = [], [], []  # of the joints, in the world; and how the axes turn
    omega = np.zeros(3)
    for i, (xyz, axis, mass, com, inertia) in enumerate(ARM):
        p = p + R @ np.array(xyz)
        z = R @ np.array(axis, dtype=float)
        axes.append(z)
        origins.append(p)
        rates.append(np.cross(omega, z))  # the axis is fixed to the link before
        R = R @ rotation(axis, q[i])
        omega = omega + z * v[i]
        r = p + R @ np.array(com)
        Jv, Jw, Jv_dot, Jw_dot = (np.zeros((3, n)) for _ in range(4))
        r_dot = sum(np.cross(axes[k], r - origins[k]) * v[k] for k in range(i + 1))
        for k in range(i + 1):
            o_dot = sum((np.cross(axes[m], origins[k] - origins[m]) * v[m] for m in range(k)), np.zeros(3))
            Jv[:, k] = np.cross(axes[k], r - origins[k])
            Jv_dot[:, k] = np.cross(rates[k], r - origins[k]) + np.cross(axes[k], r_dot - o_dot)
            Jw[:, k] = axes[k]
            Jw_dot[:, k] = rates[k]
        I = R @ inertia @ R.T
        M += mass * Jv.T @ Jv + Jw.T @ I @ Jw
        c += mass * Jv.T @ (Jv_dot @ v) + Jw.T @ (I @ (Jw_dot @ v) + np.cross(omega, I @ omega))
        g -= mass * Jv.T @ GRAVITY
    return M, c, g


def write_lines():
    for line in sys.stdin:
        request = json.loads(line)
        if request["request"] == "hello":
            reply = {"dexcheck_protocol": 1, "name": "arm.py", "joints": ["yaw", "shoulder", "elbow"]}
        else:
            M, c, g = terms(np.array(request["q"]), np.array(request["v"]))
            reply = {"id": request["id"], "M": M.tolist(), "c": c.tolist(), "g": g.tolist()}
        print(json.dumps(reply), flush=True)


def write_files(folder):
    states = zip(np.load(folder / "q.npy"), np.load(folder / "v.npy"))
    M, c, g = zip(*(terms(q, v) for q, v in states))
    np.save(folder / "M.npy", np.array(M))
    np.save(folder / "c.npy", np.array(c))
    np.save(folder / "g.npy", np.array(g))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        write_files(Path(sys.argv[1]))
    else:
        write_lines()
