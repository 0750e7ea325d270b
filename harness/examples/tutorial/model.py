"""Equations of motion of the triple pendulum by Lagrange: M(q) a + c(q, v) + g(q) + friction = tau.

theta_i = q_1 + ... + q_i is the angle of link i from the vertical. The centre of mass of link i moves with
p_dot_i = sum_k L[i, k] theta_dot_k (cos theta_k, sin theta_k), and the potential energy is - sum_i m_i g z_i.
"""

import json
import sys

import numpy as np

m = np.array([3.0, 2.0, 1.2])  # masses, kg
I = np.array([0.04, 0.015, 0.004])  # inertias about the centres of mass, across the links, kg m^2
J = np.array([0.1, 0.1, 0.1])  # inertias of the rotors, kg m^2
D = np.array([0.3, 0.2, 0.1])  # viscous friction, N m s/rad
L = np.array([[0.2, 0.0, 0.0], [0.4, 0.15, 0.0], [0.4, 0.3, 0.1]])  # lever of theta_k on centre of mass i, m
T = np.tril(np.ones((3, 3)))  # theta = T q
H = L.T @ np.diag(m) @ L


def terms(q, v):
    """M (3 x 3, kg m^2), c, g and friction (3 each, N m) at angles q (rad) and velocities v (rad/s)."""
    theta, theta_dot = T @ q, T @ v
    difference = theta[:, None] - theta[None, :]
    M = T.T @ (H * np.cos(difference) + np.diag(I)) @ T + np.diag(J)
    c = T.T @ (H * np.sin(difference)) @ theta_dot**2
    g = T.T @ (9.81 * (m @ L) * np.sin(theta))
    return M, c, g, D * v


if __name__ == "__main__":
    for line in sys.stdin:  # one request of dexcheck, one answer
        request = json.loads(line)
        if request["request"] == "hello":
            answer = {"dexcheck_protocol": 1, "name": "model.py", "joints": ["shoulder", "elbow", "wrist"]}
        else:
            M, c, g, friction = terms(np.array(request["q"]), np.array(request["v"]))
            answer = {"id": request["id"], "M": M.tolist(), "c": c.tolist(), "g": g.tolist(), "friction": friction.tolist()}
        print(json.dumps(answer), flush=True)
