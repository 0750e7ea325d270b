"""The arm of most cases, crane4, and recordings of it: crane.py KIND writes recording.csv.

A recording has a row every 4 ms. Its motion is a sum of sines per joint, its torques are those of Newton and Euler's
equations. Positions are rounded to steps of an encoder; velocities and torques have noise. The seed is fixed.
"""
import sys

import numpy as np

JOINTS = ("swivel", "lift", "fold", "roll")
# Per joint: origin xyz and rpy in the parent link, axis in the child link.
PLACES = (((0, 0, 0.31), (0, 0, 0), (0, 0, 1)),
          ((0.04, 0, 0.12), (0, 0, 0.3), (0, 1, 0)),
          ((0.37, 0.02, 0), (0, 0.4, 0), (0, -1, 0)),
          ((0.29, 0.01, 0), (0.2, 0.15, -0.5), (1, 0, 0)))
# Per link that moves: mass in kg, centre of mass in m, inertia xx, xy, xz, yy, yz, zz about it in kg m^2.
BODIES = ((4.3, (0.012, -0.021, 0.083), (0.0312, 0.0011, -0.0019, 0.0287, 0.0023, 0.0174)),
          (3.1, (0.171, 0.014, -0.009), (0.0071, -0.0018, 0.0009, 0.0462, 0.0004, 0.0471)),
          (1.9, (0.134, -0.017, 0.021), (0.0043, 0.0007, -0.0012, 0.0193, 0.0005, 0.0188)),
          (0.85, (0.052, 0.008, -0.013), (0.00093, -0.00011, 0.00007, 0.00141, 0.00013, 0.00122)))
STEP = 0.004  # s
COUNTS = 2**20  # of an encoder, per turn
DRIVE_GAINS = np.array([9.5, 11.2, 8.7, 4.1])  # N m/A
DRY, VISCOUS = np.array([2.2, 3.0, 1.3, 0.3]), np.array([1.5, 2.0, 0.9, 0.25])  # N m; N m s/rad


def turn(axis, angle):
    """Rotation matrices about an axis, one per angle."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], float)
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * K + (1 - c) * (K @ K)


def from_rpy(rpy):
    roll, pitch, yaw = (turn(axis, np.array([angle]))[0] for axis, angle in zip(np.eye(3), rpy))
    return yaw @ pitch @ roll


def tensor(xx, xy, xz, yy, yz, zz):
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inverse_dynamics(q, v, a, bodies=BODIES):
    """Torques of rows of positions, velocities and accelerations; the base stands upright."""
    n = len(q)
    R, w, dw, acc, at = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    acc[:, 2] = 9.81
    cross, axes, places, forces, moments = np.cross, [], [], [], []
    for i, ((xyz, rpy, axis), (mass, com, inertia)) in enumerate(zip(PLACES, bodies)):
        d = R @ np.array(xyz, float)
        acc, at = acc + cross(dw, d) + cross(w, cross(w, d)), at + d
        R = R @ from_rpy(rpy)
        u = R @ np.array(axis, float)
        dw, w = dw + u * a[:, i:i + 1] + cross(w, u * v[:, i:i + 1]), w + u * v[:, i:i + 1]
        R = R @ turn(axis, q[:, i])
        c, I = R @ np.array(com, float), R @ tensor(*inertia) @ R.transpose(0, 2, 1)
        force = mass * (acc + cross(dw, c) + cross(w, cross(w, c)))
        Iw, Idw = (np.einsum("nij,nj->ni", I, x) for x in (w, dw))
        axes.append(u), places.append(at), forces.append(force)
        moments.append(Idw + cross(w, Iw) + cross(at + c, force))  # about the origin
    return np.array([np.sum(u * (sum(moments[i:]) - cross(at, sum(forces[i:]))), 1)
                     for i, (u, at) in enumerate(zip(axes, places))]).T


def motion(duration=14.0, turns=0.0):
    """Times, positions, velocities and accelerations. @param turns amplitude that is added to roll, rad."""
    t = np.arange(round(duration / STEP)) * STEP
    middle = (0.2, -0.6, 1.0, 0.08)
    sines = (((0.176, 0.27), (0.173, 0.12), (0.08, 0.65), (0.03, 0.51)), ((0.115, 0.27), (0.11, 0.15), (0.075, 0.56), (0.04, 0.83)),
             ((0.16, 0.44), (0.09, 0.14), (0.066, 0.74)), ((0.25, 0.16), (0.19, 0.31), (0.1, 0.63), (0.09, 0.79)))
    q, v, a = np.tile(middle, (len(t), 1)).astype(float), np.zeros((len(t), 4)), np.zeros((len(t), 4))
    for joint, parts in enumerate(sines):
        if turns and joint == 3:
            parts += ((turns, 0.1),)
        for k, (size, frequency) in enumerate(parts):
            omega, phase = 2 * np.pi * frequency, 1.3 * joint + 2.1 * k
            q[:, joint] += size * np.sin(omega * t + phase)
            v[:, joint] += size * omega * np.cos(omega * t + phase)
            a[:, joint] -= size * omega**2 * np.sin(omega * t + phase)
    return t, q, v, a


def stand():
    """Seven postures, each held for 1 s, with 3 s between them that are not recorded."""
    postures = np.array([[0.1, -0.3, 0.5, 0.2], [-1.5, -1.4, 1.9, 0.6], [-0.7, 0.2, 0.9, 1.3], [-0.2, -0.1, 2, -2.2],
                         [0.4, 0.5, 0.1, 2], [0.9, -1.1, 1.4, -0.8], [1.6, -0.8, 0.2, -1.5]])
    t = np.concatenate([4.0 * i + np.arange(250) * STEP for i in range(len(postures))])
    q = np.repeat(postures, 250, axis=0)
    return t, q, np.zeros_like(q), np.zeros_like(q)


def record(kind):
    """@returns the head and the rows of one kind of recording: what is wrong with it is in these lines alone."""
    bodies = list(BODIES)
    mass, com, inertia = BODIES[3]
    if kind == "payload":  # 1.6 kg at (0.11, 0, 0) m of the wrist, a point
        at, m = np.array([0.11, 0, 0]), 1.6
        whole = (mass * np.array(com) + m * at) / (mass + m)
        about = tensor(*inertia)
        for part, d in ((mass, np.array(com) - whole), (m, at - whole)):
            about = about + part * (d @ d * np.eye(3) - np.outer(d, d))
        bodies[3] = (mass + m, whole, about[np.triu_indices(3)])
    if kind == "com":
        bodies[3] = (mass, np.array(com) + (0.03, 0, 0), inertia)
    t, q, v, a = stand() if kind == "static" else motion(turns=2.9 if kind == "wrapped" else 0.0)
    tau = inverse_dynamics(q, v, a, bodies)
    friction = DRY * np.sign(v) + VISCOUS * v
    noise = np.random.default_rng(7)
    q = np.round(q * COUNTS / (2 * np.pi)) * (2 * np.pi) / COUNTS
    v = v + noise.normal(0, 1e-3, v.shape)
    tau = tau + noise.normal(0, 0.03, tau.shape)
    effort = "effort"
    if kind in ("signs", "static"):
        tau = -tau
    elif kind in ("currents", "currents_named", "currents_exchanged"):
        effort = "effort" if kind == "currents" else "current"
        tau = (tau + (0 if kind == "currents_exchanged" else friction)) / DRIVE_GAINS
        if kind == "currents_exchanged":
            tau = tau[:, [2, 1, 0, 3]]
    elif kind == "alphabetical":
        q, v, tau = (x[:, np.argsort(JOINTS)] for x in (q, v, tau))
    elif kind == "wrapped":
        q[:, 3] = (q[:, 3] + np.pi) % (2 * np.pi) - np.pi
    elif kind == "filtered":  # a first-order low-pass, 4 ms (1 - 0.05) / 0.05 = 76 ms late
        for row in range(1, len(v)):
            v[row] = v[row - 1] + 0.05 * (v[row] - v[row - 1])
    elif kind == "degrees":
        v = np.degrees(v)
    elif kind == "exchanged":
        q, v, tau = (x[:, [2, 1, 0, 3]] for x in (q, v, tau))
    elif kind in ("offset", "offset_large"):
        q[:, 2] += 0.35 if kind == "offset" else 0.8
    elif kind == "coarse":  # a row every 20 ms, and 0.9 N m s/rad of lift that no model has
        tau[:, 1] += 0.9 * v[:, 1]
        t, q, v, tau = (x[::5] for x in (t, q, v, tau))
    elif kind not in ("right", "payload", "com"):
        sys.exit(f"crane: {kind}: no such recording")
    head = [f"{what}_{joint}" for what in ("position", "velocity", effort) for joint in JOINTS]
    if kind == "alphabetical":  # no names: the rows alone could tell
        head = [f"{what}{i}" for what in ("q", "qd", "tau") for i in range(1, 5)]
    head = ",".join(["time"] + head)
    return head, np.column_stack([t, q, v, tau])


if __name__ == "__main__":
    head, rows = record(sys.argv[1])
    np.savetxt("recording.csv", rows, fmt="%.7g", delimiter=",", header=head, comments="")
