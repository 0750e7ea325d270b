#!/usr/bin/env python3
"""Computed torque for an arm that holds nothing, in NumPy, as a program that dexcheck asks at each step."""

import struct
import sys

import numpy as np

MAGIC, PROTOCOL = b"DEXCTRL\0", 1
TERMS = 1
STEP, BEGIN, END = 1, 2, 3
HELLO = struct.Struct("=8s6I17d")


def read(size):
    data = sys.stdin.buffer.read(size)
    if len(data) < size:
        sys.exit(0)
    return data


def write(data):
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()


def main():
    hello = HELLO.unpack(read(HELLO.size))
    if hello[0] != MAGIC or hello[1] != PROTOCOL:
        sys.exit("this is another protocol")
    p, n, contacts, robot_bytes, scenario_bytes = hello[2:7]
    if contacts > 0:
        sys.exit("this law is for a [joint_motion]")
    read(robot_bytes), read(scenario_bytes)
    K_p, K_v = np.frombuffer(read(16 * n)).reshape(2, n)
    write(struct.pack("=8sII", MAGIC, PROTOCOL, TERMS))

    while True:
        kind, doubles = struct.unpack("=II", read(8))
        if kind == END:
            return
        if kind == BEGIN:
            continue
        s = np.frombuffer(read(8 * doubles))
        q, xi = s[19:19 + p], s[19 + p:19 + p + n]
        joints = 19 + p + n + 25  # after the object's pose, velocity, coordinates and the support's force
        q_d, q_d_dot, q_d_ddot = s[joints:joints + 3 * n].reshape(3, n)
        terms = joints + 3 * n
        M, C = s[terms:terms + 2 * n * n].reshape(2, n, n)
        gravity, friction = s[terms + 2 * n * n:terms + 2 * n * n + 2 * n].reshape(2, n)
        # (18) with q_ddot = q_d_ddot + K_v e_dot + K_p e
        q_ddot = q_d_ddot + K_v * (q_d_dot - xi) + K_p * (q_d - q)
        tau = M @ q_ddot + C @ xi + gravity + friction
        write(struct.pack("=II", STEP, n) + tau.tobytes())


main()
