"""Numbers in few bytes: positions and rotations as 16-bit integers, everything else that is small as halves.

A position is stored per body and axis as a multiple of a step of its own: range / 65535, but not finer than a
millionth of the scene, so that a resting body costs nothing. Rotations of space drop the largest of the four
numbers of the quaternion, whose square is 1 minus the others' (15 bits each). What decoding loses is measured
by decoding, not estimated. Knows no run.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from carom.recording import Floats

Codes = npt.NDArray[np.uint16]

#: Largest code of 16 bits.
FULL = 65535
#: Largest code of the 15 bits of a quaternion's component, which lies within 1/sqrt(2).
HALF = 32767
#: Finest step of a position, as a share of the scene's size [1].
FINEST = 1e-6
#: Frames that are decoded at once when errors are measured.
_AT_ONCE = 64


def encode_position(position: Floats, finest: float) -> tuple[Codes, Floats, Floats]:
    """Codes (f, n, d) of positions, with the lowest value (n, d) and the step (n, d) of each body [m].

    Parameters
    ----------
    position : (f, n, d) float64 array [m]
    finest : steps are not finer than this [m]
    """
    low = position.min(axis=0)
    step = np.maximum((position.max(axis=0) - low) / FULL, finest)
    codes = np.empty(position.shape, dtype=np.uint16)
    for begin in range(0, len(position), _AT_ONCE):
        part = position[begin : begin + _AT_ONCE]
        codes[begin : begin + _AT_ONCE] = np.clip(np.rint((part - low) / step), 0, FULL)
    return codes, low, step


def decode_position(codes: Codes, low: Floats, step: Floats) -> Floats:
    """Positions from their codes [m]."""
    return low + codes.astype(np.float64) * step


def position_error(position: Floats, codes: Codes, low: Floats, step: Floats) -> float:
    """Largest distance between a position and what is decoded for it [m]."""
    worst = 0.0
    for begin in range(0, len(position), _AT_ONCE):
        some = slice(begin, begin + _AT_ONCE)
        apart = np.linalg.norm(decode_position(codes[some], low, step) - position[some], axis=2)
        worst = max(worst, float(apart.max(initial=0.0)))
    return worst


def encode_rotation(rotation: Floats) -> Codes:
    """Codes (f, n, 1) of [cos, sin], or (f, n, 3) of quaternions [w, x, y, z].

    The first two codes of a quaternion carry the number of the dropped component in their highest bits.
    """
    if rotation.shape[2] == 2:
        angle = np.arctan2(rotation[..., 1], rotation[..., 0])
        turns = np.rint(angle / (2 * np.pi) * (FULL + 1)).astype(np.int64) & FULL
        angles: Codes = turns[..., None].astype(np.uint16)
        return angles
    dropped = np.abs(rotation).argmax(axis=2)
    sign = np.where(np.take_along_axis(rotation, dropped[..., None], 2) < 0, -1.0, 1.0)
    kept = (np.arange(3) + (np.arange(3) >= dropped[..., None])).astype(np.int64)
    parts = np.take_along_axis(rotation * sign, kept, 2)
    codes: Codes = np.clip(np.rint((parts * np.sqrt(2) + 1) / 2 * HALF), 0, HALF).astype(np.uint16)
    codes[..., 0] |= ((dropped & 1) << 15).astype(np.uint16)
    codes[..., 1] |= ((dropped >> 1) << 15).astype(np.uint16)
    return codes


def decode_rotation(codes: Codes) -> Floats:
    """[cos, sin] or quaternions [w, x, y, z] from their codes."""
    if codes.shape[2] == 1:
        angle = codes[..., 0] * (2 * np.pi / (FULL + 1))
        return np.stack([np.cos(angle), np.sin(angle)], axis=2)
    dropped = (codes[..., 0] >> 15).astype(np.int64) + 2 * (codes[..., 1] >> 15).astype(np.int64)
    parts = ((codes & HALF) / HALF * 2 - 1) / np.sqrt(2)
    largest = np.sqrt(np.maximum(0.0, 1 - (parts**2).sum(axis=2)))
    found = np.empty((*codes.shape[:2], 4))
    kept = np.arange(3) + (np.arange(3) >= dropped[..., None])
    np.put_along_axis(found, kept, parts, 2)
    np.put_along_axis(found, dropped[..., None], largest[..., None], 2)
    return found


def rotation_error(rotation: Floats, codes: Codes) -> float:
    """Largest angle between a rotation and what is decoded for it [rad]."""
    worst = 0.0
    spatial = rotation.shape[2] == 4
    for begin in range(0, len(rotation), _AT_ONCE):
        some = slice(begin, begin + _AT_ONCE)
        given, found = rotation[some], decode_rotation(codes[some])
        found = np.where((given * found).sum(axis=2, keepdims=True) < 0, -found, found) if spatial else found
        chord = np.linalg.norm(given - found, axis=2).max(initial=0.0)
        # a chord is 2 sin of half the angle between two unit numbers; quaternions turn by twice that angle
        angle = 2 * np.arcsin(min(1.0, float(chord) / 2))
        worst = max(worst, 2 * angle if spatial else angle)
    return worst


def halves(values: Floats) -> tuple[npt.NDArray[np.float16], float]:
    """Values as halves with 11 bits of mantissa, and the factor that brings them back."""
    largest = float(np.abs(values).max(initial=0.0))
    scale = 1.0 if 1e-3 < largest < 6e4 or largest == 0 else largest / 1024
    return (values / scale).astype(np.float16), scale
