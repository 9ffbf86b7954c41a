"""Quaternions of many vehicles: (4, vehicles), w first, from body axes to world axes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def level(count: int, yaw_rad: float | Floats = 0.0) -> Floats:
    """Returns the attitudes of vehicles that stand level with this heading."""
    half = np.broadcast_to(np.asarray(yaw_rad, dtype=np.float64) / 2.0, (count,))
    zero = np.zeros(count)
    return np.array([np.cos(half), zero, zero, np.sin(half)])


def multiply(a: Floats, b: Floats) -> Floats:
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return np.array(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )


def conjugate(q: Floats) -> Floats:
    return np.concatenate((q[:1], -q[1:]))


def normalised(q: Floats) -> Floats:
    return np.asarray(q / np.sqrt(np.einsum("in,in->n", q, q)))


def matrix(q: Floats) -> Floats:
    """Returns rotation matrices (3, 3, vehicles) from body axes to world axes."""
    w, x, y, z = q
    rotation = np.empty((3, 3, *w.shape))
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz, wx, wy, wz = x * y, x * z, y * z, w * x, w * y, w * z
    rotation[0, 0], rotation[0, 1], rotation[0, 2] = 1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy)
    rotation[1, 0], rotation[1, 1], rotation[1, 2] = 2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx)
    rotation[2, 0], rotation[2, 1], rotation[2, 2] = 2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy)
    return rotation


def to_world(rotation: Floats, body: Floats) -> Floats:
    """`rotation`: matrices, as `matrix` makes them."""
    return np.asarray(np.einsum("ijn,jn->in", rotation, body))


def to_body(rotation: Floats, world: Floats) -> Floats:
    return np.asarray(np.einsum("jin,jn->in", rotation, world))


def limited(values: Floats, low: Floats | float, high: Floats | float) -> Floats:
    """`numpy.clip` in a third of its time, for the small arrays of a step."""
    return np.asarray(np.minimum(np.maximum(values, low), high))


def cross(a: Floats, b: Floats) -> Floats:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def from_vector(turn_rad: Floats) -> Floats:
    """Returns the quaternions of rotations about the axis `turn_rad` by its length."""
    half = 0.5 * np.sqrt(np.einsum("in,in->n", turn_rad, turn_rad))
    quaternion = np.empty((4, *half.shape))
    quaternion[0] = np.cos(half)
    half = np.maximum(half, 1e-12)
    quaternion[1:] = (0.5 * np.sin(half) / half) * turn_rad
    return quaternion


def to_vector(q: Floats) -> Floats:
    """Inverse of `from_vector`: the shorter way round."""
    q = np.where(q[0] < 0.0, -q, q)
    size = np.sqrt(np.einsum("in,in->n", q[1:], q[1:]))
    angle = 2.0 * np.arctan2(size, q[0])
    return np.asarray(np.where(size > 1e-12, angle / np.maximum(size, 1e-12), 2.0) * q[1:])


def from_euler(roll_rad: Floats, pitch_rad: Floats, yaw_rad: Floats) -> Floats:
    cr, cp, cy = np.cos(roll_rad / 2), np.cos(pitch_rad / 2), np.cos(yaw_rad / 2)
    sr, sp, sy = np.sin(roll_rad / 2), np.sin(pitch_rad / 2), np.sin(yaw_rad / 2)
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def to_euler(q: Floats) -> Floats:
    """Returns roll, pitch and yaw in radians, (3, vehicles)."""
    w, x, y, z = q
    return np.array(
        [
            np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)),
            np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        ]
    )


def tilt_rad(q: Floats) -> Floats:
    """Returns the angle between the body's down axis and the world's."""
    return np.asarray(np.arccos(np.clip(1.0 - 2.0 * (q[1] ** 2 + q[2] ** 2), -1.0, 1.0)))


def wrap_pi(angle_rad: Floats) -> Floats:
    return np.asarray((angle_rad + np.pi) % (2.0 * np.pi) - np.pi)
