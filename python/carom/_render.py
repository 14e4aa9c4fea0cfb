"""Pictures of space without a graphics card: triangles, balls and planes into a depth buffer, then light.

Perspective by the pinhole; triangles by edge functions with 1/z interpolated, balls and planes by the roots
of their equations along each pixel's ray. Light: one far lamp with a soft shadow map, a sky, and darkening
of corners from the depth buffer; ink where bodies or faces meet. numpy alone. Knows no worlds and no
shapes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Image = npt.NDArray[np.float32]

#: Direction to the lamp, and the colour of the sky that a picture fades into.
LAMP = np.array([-0.45, -0.6, 1.1]) / np.linalg.norm([-0.45, -0.6, 1.1])
SKY = np.array([0.965, 0.972, 0.98])


@dataclass(frozen=True)
class Camera:
    """A pinhole, or with `angle` 0 a parallel view.

    Attributes
    ----------
    eye : (3,) place [m]
    axes : (3, 3) rows right, up, forward [1]
    angle : full vertical angle of view [rad]; 0 for a parallel view
    height : of what a parallel view shows [m]
    pixels : width and height of the picture [1]
    """

    eye: Floats
    axes: Floats
    angle: float
    height: float
    pixels: tuple[int, int]

    @property
    def scale(self) -> float:
        """Pixels per unit of slope (pinhole), or per metre (parallel)."""
        tall = self.pixels[1]
        return tall / self.height if self.angle == 0 else 0.5 * tall / np.tan(0.5 * self.angle)

    def project(self, points: Floats) -> Floats:
        """(k, 3) pixel coordinates from the upper left corner, and depth along the view [m]."""
        seen = (points - self.eye) @ self.axes.T
        depth = seen[:, 2]
        flat = seen[:, :2] if self.angle == 0 else seen[:, :2] / np.maximum(depth, 1e-9)[:, None]
        wide, tall = self.pixels
        return np.column_stack(
            [0.5 * wide + self.scale * flat[:, 0], 0.5 * tall - self.scale * flat[:, 1], depth]
        )

    def rays(self, rows: slice, columns: slice) -> tuple[Floats, Floats]:
        """Starts and directions, (r, c, 3) each, of a block of pixels; directions have forward part 1."""
        wide, tall = self.pixels
        x = (np.arange(columns.start, columns.stop) + 0.5 - 0.5 * wide) / self.scale
        y = (0.5 * tall - np.arange(rows.start, rows.stop) - 0.5) / self.scale
        across = np.broadcast_to(x[None, :, None], (len(y), len(x), 1)) * self.axes[0]
        across = across + np.broadcast_to(y[:, None, None], (len(y), len(x), 1)) * self.axes[1]
        if self.angle == 0:
            return self.eye + across, np.broadcast_to(self.axes[2], across.shape)
        return np.broadcast_to(self.eye, across.shape), across + self.axes[2]


def looking(
    at: Floats, azimuth: float, elevation: float, distance: float, angle: float, pixels: tuple[int, int]
) -> Camera:
    """A camera `distance` [m] from a point, seen from azimuth and elevation [degrees]; z is up."""
    turn, lift = np.radians([azimuth, elevation])
    back = np.array([np.cos(turn) * np.cos(lift), np.sin(turn) * np.cos(lift), np.sin(lift)])
    right = np.array([-np.sin(turn), np.cos(turn), 0.0])
    axes = np.array([right, np.cross(back, right), -back])
    return Camera(at + distance * back, axes, angle, 2 * distance * np.tan(angle / 2), pixels)


@dataclass
class Scene:
    """What is drawn: triangles (t, 3, 3) [m], balls, planes, each with a colour and its body's number."""

    triangles: list[tuple[Floats, Floats, int, bool]] = field(default_factory=list)
    balls: list[tuple[Floats, float, Floats, int, Floats]] = field(default_factory=list)
    planes: list[tuple[Floats, Floats, Floats, int]] = field(default_factory=list)


class _Buffer:
    """Nearest depth of each pixel, and the normal, colour and body found there."""

    def __init__(self, camera: Camera) -> None:
        wide, tall = camera.pixels
        self.camera = camera
        self.depth = np.full((tall, wide), np.inf)
        self.normal = np.zeros((tall, wide, 3), dtype=np.float32)
        self.color = np.zeros((tall, wide, 3), dtype=np.float32)
        self.body = np.full((tall, wide), -1, dtype=np.int32)
        self.floor = np.zeros((tall, wide), dtype=bool)

    def block(self, x: Floats, y: Floats) -> tuple[slice, slice] | None:
        """The pixels that a set of places can cover."""
        wide, tall = self.camera.pixels
        left, right = int(max(0, np.floor(x.min()))), int(min(wide, np.ceil(x.max()) + 1))
        top, low = int(max(0, np.floor(y.min()))), int(min(tall, np.ceil(y.max()) + 1))
        return (slice(top, low), slice(left, right)) if right > left and low > top else None

    def put(self, place: tuple[slice, slice], hit: npt.NDArray[np.bool_], depth: Floats, normal: Floats,
            color: Floats, body: int) -> None:  # fmt: skip
        """Keeps what is nearer than what is there."""
        near = hit & (depth < self.depth[place])
        self.depth[place][near] = depth[near]
        self.normal[place][near] = normal if normal.ndim == 1 else normal[near]
        self.color[place][near] = color if color.ndim == 1 else color[near]
        self.body[place][near] = body

    def triangle(self, corners: Floats, seen: Floats, normal: Floats, color: Floats, body: int) -> None:
        """One triangle by edge functions."""
        place = self.block(seen[:, 0], seen[:, 1])
        (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = seen
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if place is None or abs(area) < 1e-12 or min(z0, z1, z2) <= 1e-6:
            return
        x = np.arange(place[1].start, place[1].stop)[None, :] + 0.5
        y = np.arange(place[0].start, place[0].stop)[:, None] + 0.5
        w0 = ((x1 - x) * (y2 - y) - (x2 - x) * (y1 - y)) / area
        w1 = ((x2 - x) * (y0 - y) - (x0 - x) * (y2 - y)) / area
        w2 = 1.0 - w0 - w1
        hit = (w0 >= 0) & (w1 >= 0) & (w2 >= 0)
        if not hit.any():
            return
        if self.camera.angle == 0:
            depth = w0 * z0 + w1 * z1 + w2 * z2
        else:
            depth = 1.0 / np.where(hit, w0 / z0 + w1 / z1 + w2 / z2, 1.0)
        self.put(place, hit, depth, normal, color, body)

    def ball(self, center: Floats, radius: float, color: Floats, body: int, turn: Floats) -> None:
        """One ball, with a band about its own equator that shows how it turns."""
        seen = self.camera.project(center[None])[0]
        reach = self.camera.scale * radius * (1.0 if self.camera.angle == 0 else 1.3 / max(seen[2], 1e-6))
        place = self.block(seen[0] + np.array([-reach, reach]), seen[1] + np.array([-reach, reach]))
        if place is None or seen[2] <= radius:
            return
        start, way = self.camera.rays(*place)
        off = start - center
        a, b, c = (way * way).sum(-1), (off * way).sum(-1), (off * off).sum(-1) - radius * radius
        root = b * b - a * c
        hit = root > 0
        depth = np.where(hit, (-b - np.sqrt(np.where(hit, root, 0.0))) / a, np.inf)
        normal = (off + np.where(hit, depth, 0.0)[..., None] * way) / radius
        band = np.abs(normal @ turn[:, 2]) < 0.16
        painted = np.where(band[..., None], 0.35 * color + 0.65, color)
        self.put(place, hit, depth, normal, painted, body)

    def plane(self, origin: Floats, normal: Floats, color: Floats, body: int) -> None:
        """A whole plane, with faint squares to show distance."""
        wide, tall = self.camera.pixels
        place = (slice(0, tall), slice(0, wide))
        start, way = self.camera.rays(*place)
        along = way @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = ((origin - start) @ normal) / along
        hit = (along < -1e-6) & (depth > 0) & (depth < 1e6)
        self.put(place, hit, depth, normal, np.broadcast_to(color, (tall, wide, 3)), body)
        self.floor |= self.body == body


def _drawn(scene: Scene, camera: Camera, with_planes: bool) -> _Buffer:
    buffer = _Buffer(camera)
    for origin, normal, color, body in scene.planes if with_planes else ():
        buffer.plane(origin, normal, color, body)
    for corners, color, body, both in scene.triangles:
        seen = camera.project(corners.reshape(-1, 3)).reshape(-1, 3, 3)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        to_eye = (
            (camera.eye - corners[:, 0]) if camera.angle else np.broadcast_to(-camera.axes[2], normals.shape)
        )
        away = (normals * to_eye).sum(axis=1) <= 0
        normals[away] *= -1.0
        for number in range(len(corners)) if both else np.flatnonzero(~away):
            buffer.triangle(corners[number], seen[number], normals[number], color, body)
    for center, radius, color, body, turn in scene.balls:
        buffer.ball(center, radius, color, body, turn)
    return buffer


def render(scene: Scene, camera: Camera, reach: tuple[Floats, float], smooth: int = 2) -> Image:
    """The picture as (height, width, 3) floats from 0 to 1.

    Parameters
    ----------
    reach : middle and radius [m] of what throws shadows
    smooth : side of the block of pixels that becomes one [1]
    """
    wide, tall = camera.pixels
    fine = Camera(camera.eye, camera.axes, camera.angle, camera.height, (wide * smooth, tall * smooth))
    buffer = _drawn(scene, fine, True)
    start, way = fine.rays(slice(0, tall * smooth), slice(0, wide * smooth))
    seen = np.isfinite(buffer.depth)
    depth = np.where(seen, buffer.depth, 0.0)
    points = (start + depth[..., None] * way).astype(np.float32)
    facing = np.clip(buffer.normal @ LAMP.astype(np.float32), 0.0, 1.0)
    light = 0.34 + 0.16 * buffer.normal[..., 2] + 0.58 * facing * _lit(scene, points, buffer, reach)
    light *= _corners(buffer, points, fine, smooth)
    color = _squares(buffer, points, reach) * np.clip(light, 0.0, 1.25)[..., None]
    color = np.where(_ink(buffer)[..., None], 0.45 * color, color)
    far = np.linalg.norm(points - reach[0].astype(np.float32), axis=-1) / (2.6 * reach[1])
    fog = np.where(buffer.floor, np.clip(far - 0.55, 0.0, 1.0), 0.0)
    fog[~seen] = 1.0
    color = color * (1.0 - fog[..., None]) + SKY.astype(np.float32) * fog[..., None]
    blocks = np.clip(color, 0.0, 1.0).reshape(tall, smooth, wide, smooth, 3)
    return np.asarray(blocks.mean(axis=(1, 3)), dtype=np.float32)


def _lit(scene: Scene, points: Image, buffer: _Buffer, reach: tuple[Floats, float]) -> Image:
    """How much of the lamp each pixel sees, from 0 to 1: its depth map, looked up in a small disc."""
    middle, radius = reach
    turn = np.degrees(np.arctan2(LAMP[1], LAMP[0]))
    lift = np.degrees(np.arcsin(LAMP[2]))
    side = 1400
    view = looking(middle, float(turn), float(lift), 4 * radius, 0.0, (side, side))
    lamp = Camera(view.eye, view.axes, 0.0, 2.2 * radius, (side, side))
    depth = _drawn(scene, lamp, False).depth
    raised = points + buffer.normal * np.float32(0.004 * radius)
    seen = (raised - lamp.eye.astype(np.float32)) @ lamp.axes.T.astype(np.float32)
    x = 0.5 * side + np.float32(lamp.scale) * seen[..., 0]
    y = 0.5 * side - np.float32(lamp.scale) * seen[..., 1]
    lit = np.zeros(x.shape, dtype=np.float32)
    golden = 2.399963
    count = 12
    for k in range(count):
        off = 4.0 * np.sqrt((k + 0.5) / count)
        column = (x + off * np.cos(golden * k)).astype(np.int32)
        row = (y + off * np.sin(golden * k)).astype(np.int32)
        inside = (column >= 0) & (column < side) & (row >= 0) & (row < side)
        nearest = depth[np.clip(row, 0, side - 1), np.clip(column, 0, side - 1)]
        lit += np.where(inside & (nearest < seen[..., 2] - 0.003 * radius), 0.0, 1.0).astype(np.float32)
    return np.asarray(lit / count, dtype=np.float32)


def _corners(buffer: _Buffer, points: Image, camera: Camera, smooth: int) -> Image:
    """Darkening where neighbours in the picture rise over a pixel's tangent plane; at the final size."""
    points, normal = points[::smooth, ::smooth], buffer.normal[::smooth, ::smooth]
    tall, wide = points.shape[:2]
    dark = np.zeros((tall, wide), dtype=np.float32)
    count, size = 36, max(wide, tall) / 40.0
    deep = np.where(np.isfinite(buffer.depth), buffer.depth, 1.0)[::smooth, ::smooth].astype(np.float32)
    span = np.float32(2.0 * size * smooth / camera.scale) * (deep if camera.angle else np.float32(1.0))
    for k in range(count):
        off = size * np.sqrt((k + 0.5) / count)
        dx, dy = int(off * np.cos(2.399963 * k)), int(off * np.sin(2.399963 * k))
        other = np.roll(points, (dy, dx), axis=(0, 1)) - points
        away = np.linalg.norm(other, axis=-1) + np.float32(1e-9)
        above = (other * normal).sum(-1) / away
        fade = np.clip(1.0 - away / span, 0.0, 1.0)
        dark += (np.clip(above - 0.08, 0.0, 1.0) * fade).astype(np.float32)
    shade = np.clip(1.0 - 2.6 * dark / count, 0.35, 1.0)
    return np.asarray(np.repeat(np.repeat(shade, smooth, axis=0), smooth, axis=1), dtype=np.float32)


def _ink(buffer: _Buffer) -> npt.NDArray[np.bool_]:
    """Pixels at the border of two bodies, or of two faces of one that meet at more than some 25 degrees."""
    ink = np.zeros(buffer.depth.shape, dtype=bool)
    for axis in (0, 1):
        other = np.roll(buffer.body, 1, axis=axis)
        turned = (np.roll(buffer.normal, 1, axis=axis) * buffer.normal).sum(-1) < 0.9
        ink |= (other != buffer.body) | (turned & (buffer.body >= 0) & ~buffer.floor)
    ink[0, :] = ink[-1, :] = False
    ink[:, 0] = ink[:, -1] = False
    return ink


def _squares(buffer: _Buffer, points: Image, reach: tuple[Floats, float]) -> Image:
    """Colours, with a faint chequered floor whose squares are a power of ten times 1, 2 or 5."""
    wish = reach[1] / 4.0
    power = 10.0 ** np.floor(np.log10(wish))
    square = power * max(step for step in (1.0, 2.0, 5.0) if step * power <= wish)
    tile = (np.floor(points[..., 0] / square) + np.floor(points[..., 1] / square)) % 2 > 0
    tiled = np.where((buffer.floor & tile)[..., None], np.float32(0.955) * buffer.color, buffer.color)
    return np.asarray(tiled, dtype=np.float32)
