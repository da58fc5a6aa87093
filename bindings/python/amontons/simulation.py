"""Scenes in motion."""

from __future__ import annotations

import dataclasses
import math
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arguments import overrides, refuse
from .contact import ContactProblem, need_fclib
from .errors import SolveFailed
from .runs import read_run
from .scene import Scene


@dataclasses.dataclass(frozen=True)
class RunSummary:
    """What a run came to: names as in manifest.json and `amontons run --json`."""

    status: str  #: "done", "interrupted" or "failed"
    message: str  #: why it ended; "" if nothing to report
    steps: int
    time: float  #: reached [s]
    quantities: Mapping  #: at the end, and largest values
    units: Mapping  #: of the quantities
    texts: Mapping  #: results in words, such as branch
    warnings: list  #: a sentence each
    not_measured: list
    contacts_max: int
    worst_error: float
    worst_penetration: float  #: [m]
    worst_overlap: float  #: [m]; nan: not measured
    uncertified_steps: int
    energy: _native.Energy
    snaps: list  #: dicts of step, time [s], depth [m], released [J]
    seconds: Mapping  #: wall time of each phase
    files: tuple = ()  #: plots and pictures, in the output folder


class Inputs:
    """Drives that are led by hand, by name: inputs["wire.insertion"] = 0.12 is where it is when the next step ends.

    From then on the scene's curve of this drive no longer counts. Those that are not set follow it.
    """

    def __init__(self, simulation, known):
        self._simulation = simulation
        self._number, names, units, ranges = known
        #: All names, in the order of `values`.
        self.names = names
        #: Units, by name.
        self.units = units
        #: (least, largest) value, by name.
        self.ranges = ranges

    @staticmethod
    def _known(simulation):
        """What does not change from one Inputs of a simulation to the next."""
        all = simulation.input_names()
        return ({name: k for k, (name, *_) in enumerate(all)}, tuple(name for name, *_ in all),
                {name: unit for name, unit, *_ in all}, {name: (lower, upper) for name, _, lower, upper in all})

    def _of(self, name):
        number = self._number.get(name)
        if number is None:
            refuse(str(name), "no such input", "one of " + ", ".join(self.names) if self.names else "none in this scene")
        return number

    def __getitem__(self, name: str) -> float:
        return self._simulation.input(self._of(name))

    def __setitem__(self, name: str, value: float) -> None:
        number = self._of(name)
        if not isinstance(value, (int, float, np.integer, np.floating)) and not (
                isinstance(value, np.ndarray) and value.shape == () and value.dtype.kind in "fiu"):
            refuse(name, f"a {type(value).__name__}", "a number")
        self._simulation.set_input(number, float(value))

    @property
    def values(self) -> NDArray[np.float64]:
        """(k,) all of them now, or as they were set; a copy, read-only. Assign an array to set all."""
        now = np.array([self._simulation.input(k) for k in range(len(self.names))])
        now.flags.writeable = False  # a value put into it would lead nothing
        return now

    @values.setter
    def values(self, values: ArrayLike) -> None:
        values = np.asarray(values)
        if values.dtype.kind not in "fiu":
            refuse("inputs.values", f"an array of {values.dtype}", "numbers")
        values = values.astype(float)
        if values.shape != (len(self.names),):
            refuse("inputs.values", f"shape {values.shape}", f"({len(self.names)},)")
        for name, value in zip(self.names, values):
            lower, upper = self.ranges[name]
            if not (math.isfinite(value) and lower <= value <= upper):
                refuse(name, f"{value}", f"a finite number >= {lower} and <= {upper} [{self.units[name]}]")
        for number, value in enumerate(values):
            self._simulation.set_input(number, value)

    def __iter__(self):
        return iter(self.names)

    def __len__(self):
        return len(self.names)

    def __repr__(self):
        return "<Inputs: " + ", ".join(f"{n} [{u}]" for n, u in self.units.items()) + ">"


class _Bodies(Mapping):
    """Bodies by name, in their state at the time of access."""

    def __init__(self, simulation):
        self._simulation = simulation
        self._kinds = dict(_native.body_names(simulation))

    def __getitem__(self, name):
        kind = self._kinds[name]
        if kind in ("beam", "rod"):
            record = self._simulation.record
            if record is None:
                raise RuntimeError(f"{name} has no shape before the first step, which is its state at the start: step()")
            return record.beams[name]
        return _native.body(self._simulation, name)

    def __iter__(self):
        return iter(self._kinds)

    def __len__(self):
        return len(self._kinds)


class Simulation(_native.Stepper):
    """One scene in motion. One thread at a time (RuntimeError); different ones may run side by side.

    scene: a Scene, or what one is made of, with `set`. threads: of the contact solver; the same bits for any
    number. cache: a folder for factors and samples of walls that later simulations read; it must not be shared
    with people who are not trusted.

    >>> import amontons as am
    >>> sim = am.Simulation({"schema": 1, "bodies": {"ball": {"kind": "rigid", "mass": 2,
    ...     "shape": {"generate": "ball", "radius": 0.1}}}, "gravity": [0, 0, -9.81],
    ...     "time": {"kind": "dynamic", "step": 0.1, "end": 1}})
    >>> round(sim.advance(1).quantities["ball_velocity_z"], 12)
    -9.81
    >>> sim.done
    True
    """

    def __init__(self, scene: Scene | str | os.PathLike | Mapping, *, set: Mapping[str, Any] = {}, threads: int = 1,
                 cache: str | os.PathLike | None = None):
        if not isinstance(scene, Scene):
            scene = Scene(scene, set=set)
        elif set:
            scene = scene.changed(set)
        if isinstance(threads, bool) or not isinstance(threads, (int, np.integer)):
            refuse("threads", f"a {type(threads).__name__}", "a whole number")
        super().__init__(scene._text, int(threads), "" if cache is None else os.fspath(cache))

    @property
    def scene(self) -> Scene:
        """The Scene, with all that set() has changed."""
        return Scene._of(self.scene_text)

    @property
    def inputs(self) -> Inputs:
        """Inputs: drives that can be led by hand."""
        # An Inputs that is kept would keep the simulation: a cycle, and its memory until Python searches for cycles.
        if "_known_inputs" not in self.__dict__:
            self._known_inputs = Inputs._known(self)
        return Inputs(self, self._known_inputs)

    @property
    def bodies(self) -> Mapping[str, _native.Body | _native.Beam]:
        """Mapping of names to Body, or of wires and rods to Beam, after the last step."""
        return _Bodies(self)

    def set(self, path: str, value: Any) -> None:
        """Changes the scene between two steps. InputError, and nothing is changed, if the state does not fit then."""
        self.change(overrides({path: value}))
        self.__dict__.pop("_known_inputs", None)

    def fork(self) -> Simulation:
        """A simulation of the same scene and state, with a future of its own."""
        other = Simulation.__new__(Simulation)
        _native.Stepper.__init__(other, self)
        return other

    def contact_problems(self) -> list[ContactProblem]:
        """ContactProblems of the last step, with the step's own `reaction` and the contacts' `identity`."""
        all = []
        for native, reaction, identity in _native.contact_problems(self):
            problem = ContactProblem._of(native)
            problem.reaction, problem.identity = reaction, identity
            all.append(problem)
        return all

    def run(self, output: str | os.PathLike | None = None, *, on_step: Callable[[_native.StepRecord], bool | None] | None = None,
            every: int = 1, resume: bool = False, record: bool = False) -> RunSummary:
        """Steps to the scene's end.

        output: a folder for the files of `amontons run`; None writes none. on_step: called with the StepRecord of
        every `every`-th step, the first included; returning True ends the run. resume: continues from the folder's
        checkpoint. record: keeps every step's contact problem as an FCLib file, in OUTPUT/record (read_fclib).

        Returns a RunSummary. Raises SolveFailed, with `summary` and `record`, when a step fails;
        the files then hold all that was reached. Ctrl-C raises KeyboardInterrupt at once; the run can be resumed,
        also where the last step is still at work and writes the end of the files when it can.
        """
        if on_step is not None and not callable(on_step):
            refuse("on_step", f"a {type(on_step).__name__}", "a function")
        if isinstance(every, bool) or not isinstance(every, (int, np.integer)) or every < 1:
            refuse("every", repr(every), "a whole number >= 1")
        if resume and output is None:
            refuse("resume", "no output", "the folder of the run to continue with")
        if record and output is None:
            refuse("record", "no output", "the folder of the run that is recorded")
        if record:
            need_fclib()
        files = None
        if output is not None:
            output = os.fspath(output)
            files = _native.RunFiles(self, output, bool(resume), bool(record), list(sys.orig_argv))
        reported, self._answer = _native.run(self, files, on_step, int(every))
        summary = RunSummary(**reported)
        if files is not None and summary.status == "done":
            summary = dataclasses.replace(summary, files=self._draw(files, output))
        if summary.status == "failed":
            error = SolveFailed(summary.message)
            error.record, error.summary, error.time, error.step = self.record, summary, summary.time, summary.steps
            raise error
        return summary

    def _draw(self, files, output):
        """Plots and a picture, as far as the scene requests them and the installed programs allow."""
        drawn = []
        options = self.scene["output"]
        if options.get("plots", True):
            drawn += _native.plot_history(output)[0]
        program = _native.program_path()
        if options.get("picture", True) and os.access(program, os.X_OK) and _native.find_module("vtk"):
            collection = next(f for f in read_run(output).manifest["files"] if f.endswith(".pvd") and f != "contacts.pvd")
            name = os.path.splitext(collection)[0]
            picture = os.path.join(output, f"{name}.png")
            environment = dict(os.environ, AMONTONS_MODULES=os.path.dirname(_native.find_module("vtk")))
            process = subprocess.Popen([program, "render", output, "--output", picture, "--quiet"], env=environment,
                                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                code = process.wait()
            except BaseException:
                process.kill()
                raise
            if code == 0:
                drawn.append(os.path.basename(picture))
        if drawn:
            files.add(drawn)
        return tuple(drawn)

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_):
        self.close()

    def __repr__(self):
        return "<Simulation: closed>" if self.closed else f"<Simulation of {self.scene_text.file}: t = {self.time:g} s>"
