"""A hand in a scene at 1 kHz, observed by Python."""

from __future__ import annotations

import csv
import os
import weakref
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _native
from ._arguments import overrides, refuse
from .errors import SolveFailed
from .runs import History
from .scene import Scene

HandState = _native.HandState


def _check(value, name, low, high, whole=False):
    right = isinstance(value, (int, np.integer) if whole else (int, float, np.integer, np.floating))
    if isinstance(value, bool) or not right or not low <= value <= high:
        refuse(name, repr(value), f"a {'whole ' if whole else ''}number from {low:g} to {high:g}")
    return value


class Session:
    """A scene with a "haptic" (docs/theory/haptics.md) in a hand, on threads of C++ that Python never enters.

    scene: a Scene, or what one is made of, with `set`. device: "simulated", "recorded:FILE", "udp:PORT" or "spacemouse".
    duration [s]: default the trajectory's, else the scene's end. virtual_time: without a clock, the same ticks in every
    run; then `late`, the share of ticks that come 3 ticks late, and `latency`, the periods that a step of the simulation
    takes. control: of passivity; else the energy is counted only. threads, cache: as Simulation.

    In real time the loop requests a real-time priority and locks the process's memory while it lasts, where it may. Raises
    InputError with all that is wrong.

    >>> import amontons as am
    >>> import amontons.haptic
    >>> scene = {"schema": 1, "bodies": {
    ...     "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
    ...     "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.01}, "start": {"place": [0, 0, 0.011]},
    ...              "drive": {"z": [[0, 0], [0.3, -0.005]]}}},
    ...     "contact": [{"between": ["ball", "floor"], "friction": 0.3}],
    ...     "haptic": {"handle": "ball", "device": "omega.3", "hand": {"stiffness": 1000, "damping": 20}},
    ...     "time": {"step": 0.02, "end": 0.5}}
    >>> with am.haptic.Session(scene, virtual_time=True) as session:
    ...     session.start()
    ...     session.wait()
    True
    >>> session.summary()["ticks"]
    500
    >>> round(float(session.trace()["sent_z"][-1]), 1)  # 4 mm below the floor, by two springs of 1000 N/m
    2.0
    """

    def __init__(self, scene: Scene | str | os.PathLike | Mapping, device: str = "simulated", *, set: Mapping[str, Any] = {},
                 duration: float | None = None, virtual_time: bool = False, late: float = 0.0, latency: int = 1,
                 control: bool = True, threads: int = 1, cache: str | os.PathLike | None = None):
        if not isinstance(scene, Scene):
            scene = Scene(scene, set=set)
        elif set:
            scene = scene.changed(set)
        if not isinstance(device, str):
            refuse("device", f"a {type(device).__name__}", "a text such as 'simulated' or 'udp:5005'")
        duration = 0.0 if duration is None else float(_check(duration, "duration", 0.001, 3600))
        if (late or latency != 1) and not virtual_time:
            refuse("late" if late else "latency", repr(late or latency), "of virtual_time alone")
        self._native = _native.HandSession(
            scene._text, device, duration, bool(virtual_time), float(_check(late, "late", 0, 0.5)),
            int(_check(latency, "latency", 0, 20, whole=True)), bool(control),
            int(_check(threads, "threads", 1, 1024, whole=True)), "" if cache is None else os.fspath(cache))
        # No thread may be left when the process ends.
        self._end = weakref.finalize(self, self._native.end)

    def start(self) -> None:
        """Begins, and returns at once. Once: RuntimeError the second time."""
        self._native.start()

    def stop(self) -> None:
        """Ends what is running; the force tends to zero in 50 ms. Returns when it has."""
        self._native.end()

    def wait(self, seconds: float | None = None) -> bool:
        """Waits for its end, so many seconds at most. Whether it has ended, or was never started. Ctrl-C ends the wait."""
        left = float("inf") if seconds is None else float(seconds)
        while left > 0 and not self._native.wait(min(left, 0.05)):
            left -= 0.05
        return not self.running

    @property
    def running(self) -> bool:
        """Started, and not at its end yet."""
        return self._native.running

    def latest(self) -> HandState | None:
        """A HandState: what the simulation's last step came to; None before the first."""
        return self._native.latest()

    @property
    def messages(self) -> list[str]:
        """What `amontons haptic` prints on stderr: warnings, faults, what set() did."""
        return self._native.messages()

    def set(self, path: str, value: Any) -> None:
        """Requests another value of the scene, which takes effect once what it needs is computed; `messages` reports it."""
        for line in overrides({path: value}):
            self._native.request(line)

    def summary(self) -> dict[str, Any]:
        """What `amontons haptic --json` states, as a dict, after the end. RuntimeError before; SolveFailed if there was no
        force, or the simulation stopped."""
        answer = self._native.summary()
        if answer["status"] == "failed":
            error = SolveFailed(self._native.message())
            error.summary = answer
            raise error
        return answer

    def trace(self) -> History:
        """A History of all ticks after the end: the columns of haptics.csv, name to (ticks,) array, with `units`."""
        return History(list(csv.reader(self._native.trace().splitlines())))

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_):
        self.stop()

    def __repr__(self):
        state = "running" if self.running else "ended" if self._native.started else "not started"
        return f"<haptic.Session: {state}>"
