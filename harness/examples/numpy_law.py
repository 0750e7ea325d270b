"""The paper's law (55) in NumPy: dexcheck run curve --controller numpy_law.py --set control.law=computed_torque"""

import dexcheck
import numpy as np


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


class PaperLaw(dexcheck.Controller):
    reports_F_N = True

    def start(self, robot):
        self.robot = robot
        self.f_c = np.tile([0.0, 0.0, min(robot.f_min + 5.0, 0.5 * (robot.f_min + robot.f_max))], robot.N)

    def step(self, s):
        # the last bracket of (55), and V_dot = P^-1 X_o_ddot + d/dt(P^-1) X_o_dot
        robot, V = self.robot, s.V_Bo
        v, omega = V[:3], V[3:]
        B, _ = angle_map(s.X_o[3:], np.zeros(3))
        rates = np.linalg.solve(B, omega)
        B, B_dot = angle_map(s.X_o[3:], rates)
        X_o_dot = np.concatenate([s.R_Bo @ v, rates])
        command = s.X_d_ddot + robot.K_v * (s.X_d_dot - X_o_dot) + robot.K_p * (s.X_d - s.X_o)
        V_dot = np.concatenate([s.R_Bo.T @ command[:3] - np.cross(omega, v), B @ command[3:] + B_dot @ rates])
        # (47)
        J, G = s.J_B, s.G
        J_plus = np.linalg.solve(J @ J.T, J).T
        xi_c = s.v - J_plus @ (J @ s.v - G.T @ V)
        xi_dot_d = J_plus @ (s.G_dot.T @ V + G.T @ V_dot - s.J_B_dot @ xi_c - J @ s.sigma_prime) + s.sigma_prime
        # (49), (55)
        F_o = s.M_hat @ V_dot + s.C_hat_V + s.N_o
        self.f_c = grasp_force(G, F_o, robot.mu, robot.f_min, robot.f_max, robot.barrier_weight, self.f_c)
        F_N = self.f_c - G.T @ np.linalg.solve(G @ G.T, F_o)
        tau = s.M @ xi_dot_d + s.C @ xi_c + s.gravity + s.friction + J.T @ self.f_c
        tau[:2] = s.E_bar_inverse @ tau[:2]
        return tau, F_N
