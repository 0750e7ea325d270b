#!/usr/bin/env python3
"""Prints the <inertial> elements of panda.xml from the published tensors (standard library only).

MuJoCo 2.2.2 diagonalises fullinertia with a Jacobi iteration that stops once a rotation is below about 1e-6 rad, and the
tensor it keeps is off by as much. Here the iteration runs to rounding, I = R diag(d) R^T, and panda.xml carries d and
the quaternion of R instead.
"""

import math

# Gaz et al. 2019: mass; centre of mass in the link frame; Ixx Iyy Izz Ixy Ixz Iyz about it, along the link's axes.
LINKS = [
    (4.970684, (0.003875, 0.002081, -0.04762), (0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169)),
    (0.646926, (-0.003141, -0.02872, 0.003495), (0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704)),
    (3.228604, (0.027518, 0.039252, -0.066502), (0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805)),
    (3.587895, (-0.05317, 0.104419, 0.027454), (0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641)),
    (1.225946, (-0.011953, 0.041065, -0.038437), (0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229)),
    (1.666555, (0.060149, -0.014117, -0.010517), (0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341)),
    (0.735522, (0.010517, -0.004252, 0.061597), (0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741)),
]


def diagonalise(a):
    """Returns d and the unit quaternion (w, x, y, z) of a rotation R with a = R diag(d) R^T (cyclic Jacobi)."""
    a = [row[:] for row in a]
    q = (1.0, 0.0, 0.0, 0.0)
    for _ in range(20):
        for i, j in ((0, 1), (1, 2), (2, 0)):
            k = 3 - i - j
            if a[i][j] == 0.0:
                continue
            # Turn by t about axis k: tan 2t = 2 a_ij / (a_ii - a_jj), |t| <= pi/4.
            t = 0.5 * math.atan2(2 * a[i][j], a[i][i] - a[j][j])
            if abs(t) > math.pi / 4:
                t -= math.copysign(math.pi / 2, t)
            r = [[float(m == n) for n in range(3)] for m in range(3)]
            r[i][i] = r[j][j] = math.cos(t)
            r[i][j], r[j][i] = -math.sin(t), math.sin(t)
            a = product(transpose(r), product(a, r))
            axis = [0.0, 0.0, 0.0]
            axis[k] = math.sin(t / 2)
            q = quaternion_product(q, (math.cos(t / 2), *axis))
    norm = math.sqrt(sum(x * x for x in q))
    return [a[i][i] for i in range(3)], [x / norm for x in q]


def product(a, b):
    return [[math.fsum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def transpose(a):
    return [list(row) for row in zip(*a)]


def quaternion_product(p, q):
    a, b, c, d = p
    e, f, g, h = q
    return (a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e)


def main():
    for mass, com, (xx, yy, zz, xy, xz, yz) in LINKS:
        d, q = diagonalise([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        print(f'<!-- {xx} {yy} {zz} {xy} {xz} {yz} -->')
        print(f'<inertial mass="{mass}" pos="{" ".join(map(str, com))}"')
        print(f'          diaginertia="{" ".join(map(repr, d))}"')
        print(f'          quat="{" ".join(map(repr, q))}"/>')


if __name__ == "__main__":
    main()
