"""What the program does in processes of its own: studies and validation."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _native
from ._arguments import refuse, to_json
from ._points import run, run_study
from .errors import InputError, ModuleMissing, SolveFailed
from .scene import Scene


def _program(arguments, may_fail=(), by_functions=False):
    """Runs amontons and gives its answer in JSON.

    by_functions: the points of a study call functions that are registered in this process.
    """
    program = _native.program_path()
    if not os.access(program, os.X_OK):
        raise ModuleMissing(f"the program amontons is not at {program}: ./setup.sh install installs both")
    command = [program, *arguments, "--json"]
    code, output, errors = run_study(command) if by_functions else run(command)
    last = (errors.strip().splitlines() or [""])[-1]
    if code == 2:
        error = InputError(last.removeprefix("error: "))
        try:
            error.issues = json.loads(output)["issues"]
        except (ValueError, KeyError):
            error.issues = [{"file": "", "place": arguments[0], "found": last, "allowed": ""}]
        raise error
    if code == 130:
        raise KeyboardInterrupt
    if code != 0 and code not in may_fail:
        raise SolveFailed(last or f"amontons ended with exit code {code}")
    return json.loads(output)


class Study:
    """What a study found: error against run time and unknowns."""

    def __init__(self, answer):
        #: As `amontons study --json`.
        self.answer = answer
        #: A dict for each combination: its parameters by path, value, error, seconds, unknowns, status, pareto, ...
        self.rows = answer["rows"]
        #: Of the first sweep of positive numbers, where there is one series; else None. See answer["series"].
        self.order = answer["order"]
        self.reference = answer["reference"]

    @property
    def pareto(self) -> list[dict[str, Any]]:
        """Rows that no other is better than in both error and time."""
        return [row for row in self.rows if row["pareto"]]

    def to_pandas(self) -> Any:
        """The rows as a pandas.DataFrame."""
        import pandas
        return pandas.DataFrame(self.rows)

    def __repr__(self):
        return f"<Study: {len(self.rows)} rows, order {self.order}>"


def _names_function(file):
    """Whether a scene's file names a contact solver of this process; the study itself reports its errors."""
    try:
        return _needs_function(Scene(file))
    except InputError:
        return False


def _needs_function(scene):
    return bool(scene.resolved.get("contact_solver", {}).get("function"))


def study(scene: Scene | str | os.PathLike | Mapping, *, sweep: Mapping[str, Sequence], quantity: str,
          reference: str | float = "finest", output: str | os.PathLike | None = None, jobs: int = 1, max_time: float | None = None) -> Study:
    """Runs a scene with every combination of the values, each in a process of its own (docs/studies.md).

    scene: a file, a Scene or a dict; what is no file as it stands is written to OUTPUT.json. sweep:
    {"time.step": [0.1, 0.05]}. quantity: a name of a run's quantities. reference: "finest", a number or a file.
    output: the folder; a study that is there continues. Without one its files are not kept. max_time: wall time of a run [s].

    {"contact_solver.function": ["", "mine"]} compares ours with one of register_solver. Where a scene or the sweep names
    functions, all its runs are made in this process, one after another (jobs: 1), and their times begin with the scene's
    text in memory.

    Returns a Study. Raises InputError, or SolveFailed if no run got there.
    """
    if output is None:
        with tempfile.TemporaryDirectory(prefix="amontons-study-", ignore_cleanup_errors=True) as kept:
            return study(scene, sweep=sweep, quantity=quantity, reference=reference, output=os.path.join(kept, "study"), jobs=jobs, max_time=max_time)
    output = os.fspath(output)
    if not isinstance(sweep, Mapping) or not sweep:
        refuse("sweep", repr(sweep)[:60], '{"PATH": [values]}')
    by_functions = any("contact_solver" in path for path in sweep)
    if not by_functions and not isinstance(scene, (str, os.PathLike)):
        scene = scene if isinstance(scene, Scene) else Scene(scene)
        by_functions = _needs_function(scene)
    elif not by_functions and isinstance(scene, (str, os.PathLike)):
        by_functions = _names_function(os.fspath(scene))
    if by_functions and jobs != 1:
        refuse("jobs", repr(jobs), "1: functions of this process are called one after another")
    arguments = ["study"]
    if isinstance(scene, (str, os.PathLike)):
        arguments.append(os.fspath(scene))
    else:
        scene = scene if isinstance(scene, Scene) else Scene(scene)
        os.makedirs(os.path.dirname(os.path.abspath(output)), exist_ok=True)
        scene.save(output + ".json")
        arguments.append(output + ".json")
    for path, values in sweep.items():
        if isinstance(values, (str, bytes)) or not isinstance(values, (Sequence, np.ndarray)) or len(values) == 0:
            refuse(f"sweep[{path!r}]", repr(values)[:60], "a list of values")
        arguments += ["--sweep", f"{path}=" + ",".join(v if isinstance(v, str) and v else to_json(v, path)
                                                       for v in values)]
    arguments += ["--quantity", quantity, "--reference", str(reference), "--output", output, "--jobs", str(jobs)]
    if max_time is not None:
        arguments += ["--max-time", str(max_time)]
    return Study(_program(arguments, by_functions=by_functions))


def validate(*cases: str | os.PathLike, suite: str | None = None,
             report: str | os.PathLike | None = None) -> list[dict[str, Any]]:
    """Compares with published results; all cases without arguments. suite: "benchmarks", "stability", "random" or "mixed".
    report: a folder for HTML, CSV and plots.

    Returns a list of dicts as `amontons validate --json`; a case that failed is a row that reports it.
    """
    arguments = ["validate", *(os.fspath(c) for c in cases)]
    if suite is not None:
        arguments += ["--suite", suite]
    if report is not None:
        arguments += ["--report", os.fspath(report)]
    return _program(arguments, may_fail=(1,))
