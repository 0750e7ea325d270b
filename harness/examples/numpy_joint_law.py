"""Computed torque for an arm that holds nothing, in NumPy: dexcheck run panda-reach --controller numpy_joint_law.py"""

import dexcheck


class JointComputedTorque(dexcheck.Controller):
    # Numbers of its own, which a run or a study may set (controller.natural_frequency): rad/s, 1. At 0 it has the scenario's gains.
    parameters = {"natural_frequency": 0.0, "damping_ratio": 1.0}

    def start(self, robot):
        if robot.N > 0:
            raise ValueError("this law is for a [joint_motion]")
        self.K_p, self.K_v = robot.K_p, robot.K_v
        if self.natural_frequency > 0:
            self.K_p = self.natural_frequency**2
            self.K_v = 2 * self.damping_ratio * self.natural_frequency

    def step(self, s):
        # (18) with q_ddot = q_d_ddot + K_v e_dot + K_p e
        q_ddot = s.a_d + self.K_v * (s.v_d - s.v) + self.K_p * (s.q_d - s.q)
        return s.M @ q_ddot + s.C @ s.v + s.gravity + s.friction
