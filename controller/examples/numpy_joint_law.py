#!/usr/bin/env python3
"""Computed torque for an arm that holds nothing, in NumPy, as a program that dexcheck queries at each step."""

import sys

import numpy as np

sys.dont_write_bytecode = True
from protocol import TERMS, answer, answer_hello, read, read_hello, states  # noqa: E402


def main():
    (p, n, contacts, robot_bytes, scenario_bytes), _ = read_hello()
    if contacts > 0:
        sys.exit("this law is for a [joint_motion]")
    read(robot_bytes), read(scenario_bytes)
    K_p, K_v = np.frombuffer(read(16 * n)).reshape(2, n)
    answer_hello(TERMS)

    for state in states():
        s = np.frombuffer(state)
        q, xi = s[19:19 + p], s[19 + p:19 + p + n]
        joints = 19 + p + n + 25  # after the object's pose, velocity, coordinates and the support's force
        q_d, q_d_dot, q_d_ddot = s[joints:joints + 3 * n].reshape(3, n)
        terms = joints + 3 * n
        M, C = s[terms:terms + 2 * n * n].reshape(2, n, n)
        gravity, friction = s[terms + 2 * n * n:terms + 2 * n * n + 2 * n].reshape(2, n)
        # (18) with q_ddot = q_d_ddot + K_v e_dot + K_p e
        q_ddot = q_d_ddot + K_v * (q_d_dot - xi) + K_p * (q_d - q)
        tau = M @ q_ddot + C @ xi + gravity + friction
        answer(tau)


main()
