"""Contact problems of their own: u = W r + q with Signorini's and Coulomb's laws."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arguments import refuse
from .errors import ModuleMissing


def _numbers(value, place, dimensions):
    """An array of finite or other doubles, of so many dimensions."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            raise TypeError
        array = array.astype(np.float64, copy=False)
    except (TypeError, ValueError):
        dtype = getattr(value, "dtype", None)
        refuse(place, f"a {type(value).__name__}" + (f" of {dtype}" if dtype is not None else ""),
               "real numbers", "contact problem")
    if array.ndim != dimensions:
        refuse(place, f"{array.ndim} dimensions", f"{dimensions}", "contact problem")
    return array


def _columns(matrix, place):
    """("sparse", data, rows, starts, number of rows) of a scipy.sparse matrix."""
    matrix = matrix.tocsc()
    matrix.sort_indices()
    if matrix.dtype.kind not in "fiub":
        refuse(place, f"a matrix of {matrix.dtype}", "real numbers", "contact problem")
    if matrix.nnz > 2**31 - 1:
        refuse(place, f"{matrix.nnz} entries", "at most 2^31 - 1", "contact problem")
    return ("sparse", matrix.data, matrix.indices, matrix.indptr, matrix.shape[0])


def _sparse(data, rows, starts, size):
    """What `W` of a sparse problem is: scipy's matrix, or a dense one where there is no scipy."""
    try:
        from scipy.sparse import csc_matrix
    except ImportError:
        dense = np.zeros((size, len(starts) - 1))
        for column in range(len(starts) - 1):
            part = slice(starts[column], starts[column + 1])
            dense[rows[part], column] = data[part]
        return dense
    return csc_matrix((data, rows, starts), shape=(size, len(starts) - 1))


class ContactProblem:
    """Find reactions r and u = W r + q such that every contact obeys its law.

    W: (m, m) array, a scipy.sparse matrix, or (apply, blocks) with apply(r) -> W r and the contacts' own blocks
    as a scipy.sparse matrix. Rows are contact by contact (n, t1, t2) [m/N]. q: (m,) gap and slip of the free motion
    [m]. mu: (n,), or one number for all. kinds: (n,) of "frictional" (3 rows), "frictionless" (1 row), "bilateral"
    (1 row); default all frictional. level: "position", or "velocity" [m/s, N s].

    Raises InputError with all that is wrong.
    """

    def __init__(self, W: Any, q: ArrayLike, mu: ArrayLike, kinds: Sequence[str] | None = None, level: str = "position"):
        free = _numbers(q, "q", 1)
        names = [] if kinds is None else [str(k) for k in kinds]
        given = np.asarray(mu) if not isinstance(mu, (int, float)) else np.asarray(float(mu))
        contacts = len(names) if names else -(-len(free) // 3)
        friction = _numbers(np.full(contacts, given) if given.ndim == 0 else given, "mu", 1)
        if hasattr(W, "tocsc"):
            form = _columns(W, "W")
        elif isinstance(W, tuple) and len(W) == 2 and callable(W[0]):
            if not hasattr(W[1], "tocsc"):
                refuse("W", f"blocks that are a {type(W[1]).__name__}", "a scipy.sparse matrix", "contact problem")
            form = ("function", W[0], *_columns(W[1], "W")[1:])
        else:
            form = ("dense", _numbers(W, "W", 2))
        self._native = _native.Problem(form, free, friction, names, level)

    @classmethod
    def _of(cls, native):
        problem = cls.__new__(cls)
        problem._native = native
        return problem

    W = property(lambda self: self._native.W, doc="(m, m), read-only; as scipy.sparse where it is sparse")
    q = property(lambda self: self._native.q, doc="(m,), read-only")
    mu = property(lambda self: self._native.mu, doc="(n,), read-only")
    kinds = property(lambda self: self._native.kinds, doc="(n,) texts")
    level = property(lambda self: self._native.level, doc="'position' or 'velocity'")
    #: (m,) of a problem from a step or a file: its reaction; else None.
    reaction: NDArray[np.float64] | None = None
    #: (n,) int32 of a problem from a step: what each contact is there; else None.
    identity: NDArray[np.int32] | None = None
    title = ""

    def __repr__(self):
        return f"<ContactProblem: {len(self.mu)} contacts>"


def _problem(W, q, mu, kinds, level):
    if isinstance(W, ContactProblem):
        if q is not None or mu is not None:
            refuse("q", "values beside a ContactProblem, which has its own", "none", "contact problem")
        return W
    if q is None or mu is None:
        refuse("q" if q is None else "mu", "nothing", "numbers, or a ContactProblem in place of W", "contact problem")
    return ContactProblem(W, q, mu, kinds, level)


def solve(W: Any, q: ArrayLike | None = None, mu: ArrayLike | None = None, *, kinds: Sequence[str] | None = None,
          level: str = "position", tolerance: float = 1e-8, solver: str = "auto", max_iterations: int | None = None,
          max_seconds: float | None = None, warm_start: ArrayLike | None = None, threads: int = 1, analyse: bool = False,
          least_norm: bool = False) -> _native.ContactSolution:
    """Solves u = W r + q with Signorini's and Coulomb's laws.

    W, q, mu, kinds, level: as ContactProblem; or W is one. tolerance: of the natural map's relative error.
    solver: "auto", "nsgs", "anderson", "uzawa", "newton" or "path". max_seconds: wall time. warm_start: (m,) a
    reaction near the solution. analyse: also states whether W is singular or indefinite. least_norm: of several
    reactions the shortest.

    Returns a ContactSolution and never raises for no convergence: `if not solution` is that test, `.status` and
    `.error` give more. Raises InputError with all that is wrong in the input.

    >>> import amontons as am, numpy as np
    >>> s = am.solve(np.eye(3), 10 / np.sqrt(2) * np.array([-1, 1, 0]), 0.5, tolerance=1e-12)
    >>> s.status, (s.reaction.round(4) + 0).tolist()
    ('converged', [7.0711, -3.5355, 0.0])
    """
    problem = _problem(W, q, mu, kinds, level)
    warm = np.empty(0) if warm_start is None else _numbers(warm_start, "warm_start", 1)
    return _native.solve(problem._native, solver, tolerance, max_iterations, max_seconds, warm, threads, bool(analyse),
                         bool(least_norm))


def certify(W: Any, q: ArrayLike | None = None, mu: ArrayLike | None = None, r: ArrayLike | None = None, *,
            kinds: Sequence[str] | None = None, level: str = "position", tolerance: float = 1e-8) -> _native.Certificate:
    """How good a reaction r (m,) is, from the problem alone: a Certificate. W may be a ContactProblem."""
    problem = _problem(W, q, mu, kinds, level)
    if r is None:
        refuse("r", "nothing", "a reaction of the problem's rows", "contact problem")
    return _native.certify(problem._native, _numbers(r, "r", 1), tolerance)


def need_fclib():
    if not _native.find_module("fclib"):
        raise ModuleMissing("contact problems in files need the module fclib: apt-get install libfclib-dev, "
                            "then ./setup.sh install")


def read_fclib(path: str | os.PathLike) -> ContactProblem:
    """The ContactProblem of an FCLib file; of a global one what its bodies leave of it. InputError, ModuleMissing."""
    need_fclib()
    native, r, u, title, description, info = _native.read_fclib(os.fspath(path))
    problem = ContactProblem._of(native)
    problem.reaction, problem.title = r, title
    return problem


def write_fclib(path: str | os.PathLike, problem: ContactProblem, solution: Any = None, *, title: str = "") -> None:
    """Writes a problem, with a ContactSolution or a reaction (m,), as an FCLib file. InputError, WriteError."""
    if not isinstance(problem, ContactProblem):
        refuse("problem", f"a {type(problem).__name__}", "a ContactProblem", "contact problem")
    need_fclib()
    r = u = None
    if solution is not None:
        r = solution.reaction if hasattr(solution, "reaction") else _numbers(solution, "solution", 1)
        u = getattr(solution, "u", None)
        if len(r) != len(problem.q):
            refuse("solution", f"{len(r)} numbers", f"{len(problem.q)}, the rows of the problem", "contact problem")
    _native.write_fclib(os.fspath(path), problem._native, r, u, title or problem.title)


def register_solver(name: str, function: Callable[..., ArrayLike] | None) -> None:
    """Makes a function the contact solver of scenes that name it: {"contact_solver": {"function": name}}.

    name: a text. function: of (W, q, mu), called inside the steps of such scenes by the thread that steps. W: (m, m)
    array [m/N; in motion m/(N s)], q: (m,), mu: (n,), rows contact by contact (n, t1, t2), of frictionless contacts
    with mu 0; where joints or springs are among them also `kinds`: (n,) of "frictional" (3 rows) and "bilateral"
    (1 row). It returns the reactions r, (m,). None takes the name away.

    The answer is certified like our own; one that misses the tolerance, or an exception, refuses the step, and
    SolveFailed gives the reason. Scenes of rods or wires alone have no such problem. Raises InputError for what is no function.

    >>> import amontons as am
    >>> am.register_solver("ours", lambda W, q, mu: am.solve(W, q, mu, tolerance=1e-12).reaction)
    >>> scene = am.Scene({"schema": 1, "gravity": [0, 0, -9.81], "contact_solver": {"function": "ours"}, "bodies": {
    ...     "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
    ...     "box": {"kind": "rigid", "mass": 2, "shape": {"generate": "box", "size": [1, 1, 1]},
    ...             "start": {"place": [0, 0, 0.5]}}},
    ...     "contact": [{"between": ["box", "floor"], "friction": 0.3}], "time": {"step": 1, "end": 1}})
    >>> record = am.Simulation(scene).step()
    >>> round(record.quantities["floor_on_box_force_z"], 6)
    19.62
    >>> am.register_solver("ours", None)
    """
    _native.register_solver(name, function)
