#!/usr/bin/python3
# Mass matrix, gravity and C v of crane4 by Newton and Euler; the base stands upright here.
import json
import sys

import crane
import numpy as np

for line in sys.stdin:
    m = json.loads(line)
    if m["request"] == "hello":
        print(json.dumps({"dexcheck_protocol": 1, "name": "newton_euler", "joints": crane.JOINTS}), flush=True)
        continue
    # One row each: at rest, at the velocities, and with a unit acceleration of each joint.
    q, v = np.tile(m["q"], (6, 1)), np.zeros((6, 4))
    v[1] = m["v"]
    tau = crane.inverse_dynamics(q, v, np.vstack([np.zeros((2, 4)), np.eye(4)]))
    g = tau[0]
    print(json.dumps({"id": m["id"], "M": (tau[2:] - g).T.tolist(), "c": (tau[1] - g).tolist(), "g": g.tolist()}), flush=True)
