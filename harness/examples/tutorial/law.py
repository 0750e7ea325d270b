"""Computed torque with the equations of model.py."""

import dexcheck
from model import terms


class Law(dexcheck.Controller):
    terms = False  # this law has its own model, so none is sent to it
    parameters = {"natural_frequency": 10.0, "damping_ratio": 1.0}  # rad/s and 1; runs and studies may set them

    def step(self, s):
        M, c, g, friction = terms(s.q, s.v)
        K_p = self.natural_frequency**2
        K_v = 2 * self.damping_ratio * self.natural_frequency
        acceleration = s.a_d + K_v * (s.v_d - s.v) + K_p * (s.q_d - s.q)
        return M @ acceleration + c + g
