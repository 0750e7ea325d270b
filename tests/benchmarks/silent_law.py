"""A controller that sends no torque: what the way to Python and back takes."""

import dexcheck
import numpy as np


class Silent(dexcheck.Controller):
    def start(self, robot):
        self.tau = np.zeros(robot.n)

    def step(self, s):
        return self.tau
