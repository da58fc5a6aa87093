"""Many simulations at once."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arguments import refuse
from .image import Camera, _options
from .scene import Scene
from .simulation import Simulation


class Batch:
    """`count` simulations of one scene, or one of each entry of `set`, on threads of C++.

    Each gives the bits that it gives alone, for any number of threads. They share the walls of vessels.

    scene: as Simulation takes it. set: a sequence of `count` dicts, as Scene.changed takes them. threads: default one
    for each processor.

    >>> import amontons as am
    >>> batch = am.Batch({"schema": 1, "bodies": {"ball": {"kind": "rigid", "mass": 1,
    ...     "shape": {"generate": "ball", "radius": 0.1}}}, "gravity": [0, 0, -9.81],
    ...     "time": {"kind": "dynamic", "step": 0.1, "end": 1}}, 2, set=[{}, {"gravity": [0, 0, -1.62]}])
    >>> batch.advance(0.5).tolist(), batch.quantity("ball_velocity_z").round(12).tolist()
    ([0, 0], [-4.905, -0.81])
    """

    def __init__(self, scene: Scene | str | os.PathLike | Mapping, count: int, *,
                 set: Sequence[Mapping[str, Any]] | None = None, threads: int | None = None):
        if not isinstance(scene, Scene):
            scene = Scene(scene)
        if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1:
            refuse("count", repr(count), "a whole number >= 1")
        changes = [{}] * int(count) if set is None else list(set)
        if len(changes) != count:
            refuse("set", f"{len(changes)} entries", f"{count}, one for each simulation")
        threads = len(os.sched_getaffinity(0)) if threads is None else threads
        if isinstance(threads, bool) or not isinstance(threads, (int, np.integer)) or not 1 <= threads <= 1024:
            refuse("threads", repr(threads), "a whole number from 1 to 1024")
        #: The Simulations, to examine: between two calls of this batch.
        self.simulations = [Simulation(scene.changed(c) if c else scene) for c in changes]
        #: (k,) names of the inputs, the columns of `inputs`.
        self.names = list(self.simulations[0].inputs.names)
        for number, simulation in enumerate(self.simulations):
            if list(simulation.inputs.names) != self.names:
                refuse(f"set[{number}]", "other inputs than the first", "scenes with the same drives")
        #: (count, k) writable: what is written here is where the drive is when the next step ends, as Inputs.
        self.inputs = np.zeros((len(changes), len(self.names)))
        self._sent = self.inputs.copy()
        self._threads = int(threads)
        self._native = _native.Batch(self.simulations, self._threads)
        self._read_inputs()

    def _read_inputs(self, kept=None, waiting=None):
        self._native.get_inputs(self._sent)
        self.inputs[...] = self._sent
        if kept is not None:
            self.inputs[kept] = waiting

    def __len__(self) -> int:
        return len(self.simulations)

    @property
    def messages(self) -> list[str]:
        """(count,) why each failed at the last advance(); "" if it did not."""
        return self._native.messages

    def advance(self, seconds: float, *, where: ArrayLike | None = None) -> NDArray[np.int8]:
        """All, or those where `where` (count,) is true, continue by so many seconds. The first call also finds the state
        at the start.

        Returns (count,) int8: 0 moved, 1 at its scene's end, 2 failed: it is as after its last accepted step, and
        `messages` gives the reason. Raises InputError, and nothing moves, if an input is out of its range.
        """
        if not isinstance(self.inputs, np.ndarray) or self.inputs.shape != self._sent.shape or self.inputs.dtype != np.float64:
            found = getattr(self.inputs, "dtype", type(self.inputs).__name__)
            refuse("inputs", f"shape {np.shape(self.inputs)} of {found}", f"{self._sent.shape} of doubles")
        self._native.set_inputs(self.inputs, self._sent, where)
        kept = None if where is None else ~np.asarray(where, dtype=bool)
        waiting = self.inputs[kept] if kept is not None else None
        try:
            codes = self._native.advance(seconds, where)
        except Exception:
            self._read_inputs(kept, waiting)
            raise
        # After Ctrl-C members may still be at work: their inputs, which would be waited for, are as they were set.
        self._read_inputs(kept, waiting)
        return codes

    def quantity(self, name: str, out: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """(count,) a column of history.csv after the last step of each."""
        return self._native.quantity(name, out)

    def points(self, body: str, count: int, out: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """(len(self), count, 3) points of a wire or rod, at equal distances along it, from the tip on [m]."""
        return self._native.points(body, count, out)

    def xray(self, camera: Camera, size: tuple[int, int] = (256, 256), out: NDArray[np.uint8] | None = None, *,
             attenuation: float = 2000.0, white: float = 200.0, noise: float = 5.0, seed: int = 0) -> NDArray[np.uint8]:
        """(len(self), height, width) uint8: an image of each as amontons.xray draws it, with the seeds seed, seed + 1, ...

        out: an array of that shape to write to.
        """
        options = _options(camera, size, attenuation, white, noise, seed)
        return _native.xray_of_simulations(self.simulations, *options, self._threads, out)

    def save(self) -> list[bytes]:
        """The state of each, for restore()."""
        return [s.save() for s in self.simulations]

    def restore(self, states: Sequence[bytes], where: ArrayLike | None = None) -> None:
        """Puts back states, of all or of those where `where` is true: a list of len(self), others' entries unused.

        InputError, and all are as they were, where one of them is of another scene.
        """
        if len(states) != len(self):
            refuse("states", f"{len(states)}", f"{len(self)}, one for each simulation")
        chosen = np.ones(len(self), bool) if where is None else np.asarray(where, dtype=bool)
        if chosen.shape != (len(self),):
            refuse("where", f"shape {chosen.shape}", f"({len(self)},)")
        before = self.save()
        try:
            for simulation, state, take in zip(self.simulations, states, chosen):
                if take:
                    simulation.restore(state)
        except Exception:
            for simulation, state in zip(self.simulations, before):
                simulation.restore(state)
            raise
        self._native.note_times()
        self._read_inputs()

    def __repr__(self):
        return f"<Batch of {len(self)} x {self.simulations[0].scene_text.file}>"
