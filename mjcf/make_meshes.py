#!/usr/bin/env python3
"""Writes assets/*.msh: the tori and the robot's fairings (standard library only).

torus.msh and ring.msh are sampled from the tori that torus.xml and ring.xml describe; vertex (i, j), u = 2 pi i / N_U,
v = 2 pi j / N_V, is

    p(u, v) = [(R + r cos v) cos u, (R + r cos v) sin u, r sin v].

The counts are multiples of four, so that the outer and inner equators, the top and the bottom circle are hit exactly.

A fairing is a loft of superellipses |(x - c)/a|^n + |y/b|^n = 1 along z, with a, b, c Catmull-Rom curves through the
stations below and flat ends. Fairings are looks: they have no mass and no contacts. All lengths are in metres.

The format is MuJoCo's own binary one: four int32 (vertices, normals, texture coordinates, faces), float32 positions,
int32 triangles. Vertices are shared and normals left to the compiler, which smooths them; OBJ files come out faceted.
"""

import math
import pathlib
import struct

# name: (R, r, N_U, N_V)
TORI = {"torus": (0.035, 0.011, 64, 24), "ring": (0.25, 0.04, 96, 32)}

# name: (exponent n, points around, stations (z, a, b, c) from the lowest up); frame: the body that carries it.
FAIRINGS = {
    "base_shell": (2.0, 48, [
        (-0.012, 0.250, 0.250, 0), (0.000, 0.264, 0.264, 0), (0.050, 0.268, 0.268, 0), (0.090, 0.258, 0.258, 0),
        (0.118, 0.226, 0.226, 0), (0.132, 0.175, 0.175, 0), (0.146, 0.125, 0.125, 0), (0.170, 0.098, 0.098, 0),
        (0.200, 0.080, 0.080, 0)]),
    "column_shell": (2.0, 32, [
        (0.180, 0.092, 0.092, 0), (0.260, 0.077, 0.077, 0), (0.400, 0.074, 0.074, 0), (0.540, 0.080, 0.080, 0),
        (0.590, 0.090, 0.092, 0), (0.600, 0.088, 0.090, 0)]),
    "torso_shell": (2.5, 48, [
        (0.048, 0.082, 0.088, 0), (0.062, 0.096, 0.104, 0), (0.130, 0.108, 0.122, 0.002),
        (0.220, 0.124, 0.146, 0.006), (0.300, 0.134, 0.162, 0.010), (0.360, 0.130, 0.166, 0.010),
        (0.410, 0.110, 0.150, 0.006), (0.440, 0.084, 0.112, 0.004), (0.456, 0.060, 0.072, 0.002),
        (0.460, 0.044, 0.050, 0.000)]),
    "head_shell": (2.3, 40, [
        (0.512, 0.040, 0.044, 0.004), (0.522, 0.066, 0.066, 0.008), (0.550, 0.094, 0.088, 0.010),
        (0.600, 0.108, 0.100, 0.010), (0.645, 0.102, 0.096, 0.008), (0.680, 0.078, 0.076, 0.004),
        (0.697, 0.044, 0.046, 0.002), (0.702, 0.016, 0.018, 0.000)]),
    "visor": (2.5, 56, [
        (0.552, 0.066, 0.060, 0.036), (0.557, 0.076, 0.072, 0.036), (0.575, 0.085, 0.086, 0.034),
        (0.600, 0.088, 0.091, 0.034), (0.625, 0.085, 0.087, 0.034), (0.643, 0.075, 0.073, 0.034),
        (0.648, 0.066, 0.060, 0.034)]),
    "deltoid_shell": (2.2, 32, [
        (-0.100, 0.046, 0.046, 0), (-0.092, 0.052, 0.052, 0), (-0.050, 0.060, 0.058, 0), (0.000, 0.066, 0.062, 0),
        (0.035, 0.056, 0.053, 0), (0.056, 0.032, 0.032, 0), (0.062, 0.010, 0.010, 0)]),
    "upper_arm_shell": (2.2, 32, [
        (-0.268, 0.036, 0.034, 0), (-0.262, 0.043, 0.041, 0), (-0.220, 0.047, 0.046, 0), (-0.160, 0.050, 0.049, 0),
        (-0.112, 0.048, 0.048, 0), (-0.106, 0.042, 0.042, 0)]),
    "forearm_shell": (2.3, 32, [
        (-0.236, 0.027, 0.028, 0), (-0.230, 0.032, 0.034, 0), (-0.180, 0.037, 0.040, 0), (-0.110, 0.045, 0.048, 0),
        (-0.060, 0.046, 0.047, 0), (-0.042, 0.040, 0.040, 0), (-0.036, 0.032, 0.033, 0)]),
    "palm_shell": (4.0, 40, [
        (-0.0500, 0.0560, 0.0400, 0), (-0.0480, 0.0585, 0.0425, 0), (-0.0330, 0.0585, 0.0425, 0),
        (-0.0250, 0.0500, 0.0380, 0), (-0.0170, 0.0360, 0.0310, 0), (-0.0100, 0.0270, 0.0270, 0)]),
}
POINTS_PER_SPAN = 3


def torus_mesh(ring_radius, tube_radius, n_u, n_v):
    """Returns vertices and triangles (0-based, counter-clockwise seen from outside)."""
    vertices, faces = [], []
    for i in range(n_u):
        u = 2 * math.pi * i / n_u
        for j in range(n_v):
            v = 2 * math.pi * j / n_v
            rho = ring_radius + tube_radius * math.cos(v)
            vertices.append((rho * math.cos(u), rho * math.sin(u), tube_radius * math.sin(v)))

    def index(i, j):
        return i % n_u * n_v + j % n_v

    for i in range(n_u):
        for j in range(n_v):
            a, b, c, d = index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)
            faces += [(a, b, c), (a, c, d)]
    return vertices, faces


def refine(stations):
    """Returns the stations with Catmull-Rom points between them."""
    rows = [stations[0], *stations, stations[-1]]
    out = []
    for p0, p1, p2, p3 in zip(rows, rows[1:], rows[2:], rows[3:]):
        for k in range(POINTS_PER_SPAN):
            t = k / POINTS_PER_SPAN
            out.append(tuple(
                0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
                for a, b, c, d in zip(p0, p1, p2, p3)))
    return [*out, stations[-1]]


def loft_mesh(exponent, n_around, stations):
    """Returns vertices and triangles (0-based, counter-clockwise seen from outside)."""
    rings = refine(stations)
    vertices, faces = [], []
    for z, a, b, c in rings:
        for i in range(n_around):
            u = 2 * math.pi * i / n_around
            x, y = math.cos(u), math.sin(u)
            vertices.append((c + a * math.copysign(abs(x) ** (2 / exponent), x),
                             b * math.copysign(abs(y) ** (2 / exponent), y), z))
    for k in range(len(rings) - 1):
        for i in range(n_around):
            a, b = k * n_around + i, k * n_around + (i + 1) % n_around
            faces += [(a, b, b + n_around), (a, b + n_around, a + n_around)]
    bottom, top = len(vertices), len(vertices) + 1
    vertices += [(rings[0][3], 0.0, rings[0][0]), (rings[-1][3], 0.0, rings[-1][0])]
    last = (len(rings) - 1) * n_around
    for i in range(n_around):
        j = (i + 1) % n_around
        faces += [(bottom, j, i), (top, last + i, last + j)]
    return vertices, faces


def write_msh(path, vertices, faces):
    flat_vertices = [x for v in vertices for x in v]
    flat_faces = [k for f in faces for k in f]
    path.write_bytes(struct.pack("<4i", len(vertices), 0, 0, len(faces))
                     + struct.pack(f"<{len(flat_vertices)}f", *flat_vertices)
                     + struct.pack(f"<{len(flat_faces)}i", *flat_faces))


def main():
    folder = pathlib.Path(__file__).parent / "assets"
    folder.mkdir(exist_ok=True)
    for name, numbers in TORI.items():
        write_msh(folder / f"{name}.msh", *torus_mesh(*numbers))
    for name, (exponent, n_around, stations) in FAIRINGS.items():
        write_msh(folder / f"{name}.msh", *loft_mesh(exponent, n_around, stations))


if __name__ == "__main__":
    main()
