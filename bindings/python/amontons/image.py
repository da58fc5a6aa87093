"""Images as a fluoroscope takes them, without a display."""

from __future__ import annotations

import dataclasses
import operator
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arguments import refuse


@dataclasses.dataclass(frozen=True)
class Camera:
    """A point source, and the plane across its main ray on which the image is measured.

    source: (3,) [m]. target: (3,) the middle of the plane [m]. up: (3,) a direction that is up in the image. width: of
    the image on that plane [m]; pixels are square.
    """

    source: Sequence[float]
    target: Sequence[float]
    width: float
    up: Sequence[float] = (0, 0, 1)

    def _numbers(self):
        try:
            all = [np.asarray(v, float) for v in (self.source, self.target, self.up)]
        except (TypeError, ValueError):
            refuse("camera", "places that are no numbers", "(x, y, z) [m]")
        for name, v in zip(("source", "target", "up"), all):
            if v.shape != (3,) or not np.isfinite(v).all():
                refuse(f"camera.{name}", f"{v.tolist()}", "three finite numbers")
        ray = all[1] - all[0]
        if not np.linalg.norm(np.cross(ray, all[2])) > 1e-9 * np.linalg.norm(ray) * np.linalg.norm(all[2]):
            refuse("camera.up", f"{all[2].tolist()} beside the ray {ray.tolist()}", "another direction, neither zero")
        if not isinstance(self.width, (int, float, np.integer, np.floating)) or not (np.isfinite(self.width) and self.width > 0):
            refuse("camera.width", f"{self.width!r}", "> 0 [m]")
        return np.concatenate([*all, [self.width]])


def _options(camera: Camera, size: Any, attenuation: float, white: float, noise: float,
             seed: int) -> tuple[NDArray[np.float64], int, int, float, float, float, int]:
    if not isinstance(camera, Camera):
        refuse("camera", f"a {type(camera).__name__}", "a Camera")
    numbers = camera._numbers()
    try:
        height, width = (operator.index(n) for n in size)
        seed = operator.index(seed)
    except (TypeError, ValueError):
        refuse("size", f"{size!r}, and seed {seed!r}", "(height, width) and a seed in whole numbers")
    if not (1 <= height <= 8192 and 1 <= width <= 8192):
        refuse("size", f"{(height, width)}", "1 to 8192 pixels each")
    for name, value in (("attenuation", attenuation), ("white", white), ("noise", noise)):
        if not isinstance(value, (int, float, np.integer, np.floating)) or not (np.isfinite(value) and value >= 0):
            refuse(name, f"{value!r}", "finite, >= 0")
    return numbers, height, width, float(attenuation), float(white), float(noise), seed % 2**64


def xray(what: Any, camera: Camera, size: tuple[int, int] = (256, 256), *, attenuation: float = 2000.0, white: float = 200.0,
         noise: float = 5.0, seed: int = 0, radius: float | None = None) -> NDArray[np.uint8]:
    """A fluoroscopic image of wires and rods: white exp(-attenuation l), l the mean length of a pixel's rays in them.

    what: a Simulation; or (n, 3) points of a line, with its radius [m]. (Of a Batch: Batch.xray.) size: (height, width)
    in pixels. attenuation [1/m]. noise: standard deviation of Gaussian noise in greys.

    Returns (height, width) uint8. The same bits for the same arguments.

    >>> import amontons as am
    >>> line = [[-1, 0, 0], [1, 0, 0]]
    >>> image = am.xray(line, am.Camera((0, -1, 0), (0, 0, 0), 0.1), (5, 5), radius=0.001, noise=0)
    >>> image[:, 2].tolist() == [200, 200, image[2, 2], 200, 200], bool(image[2, 2] < 200)
    (True, True)
    """
    options = _options(camera, size, attenuation, white, noise, seed)
    if isinstance(what, _native.Stepper):
        return _native.xray_of_simulations([what], *options, 1, None)[0]
    if hasattr(what, "xray"):
        return what.xray(camera, size, attenuation=attenuation, white=white, noise=noise, seed=seed)
    try:
        points = np.asarray(what, float)
    except (TypeError, ValueError):
        refuse("what", f"a {type(what).__name__}", "a Simulation, a Batch, or (n, 3) finite points")
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        refuse("what", f"shape {points.shape}" if points.ndim != 2 or points.shape[1] != 3 else "numbers that are not finite", "a Simulation, a Batch, or (n, 3) finite points")
    if radius is None or not isinstance(radius, (int, float, np.integer, np.floating)) or not (np.isfinite(radius) and radius > 0):
        refuse("radius", f"{radius!r}", "> 0 [m]")
    return _native.xray_of_line(points, float(radius), *options)
