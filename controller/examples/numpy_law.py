#!/usr/bin/env python3
"""The paper's law (55) in NumPy, as a program that dexcheck queries at each step (controller_protocol.h)."""

import sys

import numpy as np

sys.dont_write_bytecode = True
from protocol import TELLS_F_N, TERMS, answer, answer_hello, read, read_hello, states  # noqa: E402


class Fields:
    """Takes one array after the other from a message."""

    def __init__(self, data):
        self.data, self.at = np.frombuffer(data), 0

    def take(self, *shape):
        count = int(np.prod(shape))
        self.at += count
        return self.data[self.at - count:self.at].reshape(shape)


def angle_map(angles, rates):
    """B with omega = B d/dt [alpha, beta, gamma] of ZYZ angles, and its rate."""
    (sb, sg), (cb, cg) = np.sin(angles[1:]), np.cos(angles[1:])
    b, g = rates[1:]
    B = np.array([[-sb * cg, sg, 0], [sb * sg, cg, 0], [cb, 0, 1]])
    B_dot = np.array([[-cb * cg * b + sb * sg * g, cg * g, 0], [cb * sg * b + sb * cg * g, -sg * g, 0],
                      [-sb * b, 0, 0]])
    return B, B_dot


def grasp_force(G, F_o, mu, f_min, f_max, rho, f):
    """Least sum f_z - rho (sum log det P + logs of slacks) with G f = F_o, by Newton's method from f inside the cones."""
    k = f.size
    for _ in range(100):
        x, y, z = f.reshape(-1, 3).T
        det = mu**2 * z**2 - x**2 - y**2
        slope, H = np.zeros((k // 3, 3)), np.zeros((k, k))
        slope[:, 0], slope[:, 1] = 2 * rho * x / det, 2 * rho * y / det
        slope[:, 2] = 1 - 2 * rho * mu**2 * z / det - rho / (z - f_min) + rho / (f_max - z)
        for i in range(k // 3):
            c = np.array([-2 * x[i], -2 * y[i], 2 * mu**2 * z[i]])  # of det
            D = np.diag([-2.0, -2.0, 2 * mu**2])
            block = rho * (np.outer(c, c) / det[i]**2 - D / det[i])
            block[2, 2] += rho / (z[i] - f_min)**2 + rho / (f_max - z[i])**2
            H[3 * i:3 * i + 3, 3 * i:3 * i + 3] = block
        KKT = np.block([[H, G.T], [G, np.zeros((6, 6))]])
        step = np.linalg.solve(KKT, np.concatenate([-slope.ravel(), F_o - G @ f]))[:k]
        size = 1.0
        while True:
            new = (f + size * step).reshape(-1, 3)
            inside = (mu * new[:, 2] > np.hypot(new[:, 0], new[:, 1])) & (new[:, 2] > f_min) & (new[:, 2] < f_max)
            if inside.all():
                break
            size *= 0.5
            if size < 1e-12:
                raise RuntimeError("no contact forces inside the friction cones hold the object")
        f = new.ravel()
        if size == 1.0 and np.abs(step).max() < 1e-12 * np.abs(f).max():
            break
    return f


def main():
    (p, n, N, robot_bytes, scenario_bytes), numbers = read_hello()
    K_v, K_p = np.array(numbers[1:7]), np.array(numbers[7:13])
    mu, f_min, f_max, rho = numbers[13:17]
    read(robot_bytes), read(scenario_bytes)
    answer_hello(TERMS | TELLS_F_N)
    k = 3 * N
    f_c = np.tile([0.0, 0.0, min(f_min + 5.0, 0.5 * (f_min + f_max))], N)

    for state in states():
        s = Fields(state)
        t = s.take(1)[0]
        X_d, X_d_dot, X_d_ddot = s.take(6), s.take(6), s.take(6)
        q, xi = s.take(p), s.take(n)
        R, p_o, V, X_o = s.take(3, 3), s.take(3), s.take(6), s.take(6)
        s.take(5 * N), s.take(N), s.take(N), s.take(1)
        M, C, gravity, friction = s.take(n, n), s.take(n, n), s.take(n), s.take(n)
        J, J_dot, G, G_dot = s.take(k, n), s.take(k, n), s.take(6, k), s.take(6, k)
        M_hat, C_hat_V, N_o, sigma_prime = s.take(6, 6), s.take(6), s.take(6), s.take(n)
        E_inv = s.take(2, 2)

        # the last bracket of (55), and V_dot = P^-1 X_o_ddot + d/dt(P^-1) X_o_dot
        v, omega = V[:3], V[3:]
        B, _ = angle_map(X_o[3:], np.zeros(3))
        rates = np.linalg.solve(B, omega)
        B, B_dot = angle_map(X_o[3:], rates)
        X_o_dot = np.concatenate([R @ v, rates])
        command = X_d_ddot + K_v * (X_d_dot - X_o_dot) + K_p * (X_d - X_o)
        V_dot = np.concatenate([R.T @ command[:3] - np.cross(omega, v), B @ command[3:] + B_dot @ rates])
        # (47)
        J_plus = np.linalg.solve(J @ J.T, J).T
        xi_c = xi - J_plus @ (J @ xi - G.T @ V)
        xi_dot_d = J_plus @ (G_dot.T @ V + G.T @ V_dot - J_dot @ xi_c - J @ sigma_prime) + sigma_prime
        # (49), (55)
        F_o = M_hat @ V_dot + C_hat_V + N_o
        f_c = grasp_force(G, F_o, mu, f_min, f_max, rho, f_c)
        F_N = f_c - G.T @ np.linalg.solve(G @ G.T, F_o)
        tau = M @ xi_dot_d + C @ xi_c + gravity + friction + J.T @ f_c
        tau[:2] = E_inv @ tau[:2]
        answer(tau, F_N)


main()
