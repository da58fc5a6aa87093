"""amontons: contact with friction of rigid bodies, solids, rods and wires.

    >>> import amontons as am
    >>> s = am.solve([[1, 0, 0], [0, 1, 0], [0, 0, 1]], [-1, 2, 0], 0.5)
    >>> (s.reaction + 0).tolist()
    [1.0, -0.5, 0.0]

Quantities are in SI units. Names are those of the scene's fields (docs/scene_reference.md) and of history.csv
(docs/outputs.md). Everything that a step reports is read-only and never changes.
"""

from . import _native
from ._native import Beam, Body, Certificate, Contacts, ContactSolution, Energy, StepCertificate, StepRecord
from .batch import Batch
from .commands import Study, study, validate
from .contact import ContactProblem, certify, read_fclib, register_solver, solve, write_fclib
from .errors import InputError, InternalError, ModuleMissing, SolveFailed, WriteError
from .image import Camera, xray
from .runs import Run, read_run
from .scene import Scene
from .simulation import Inputs, RunSummary, Simulation

__version__ = _native.version()
__all__ = [
    "Batch", "Beam", "Body", "Camera", "Certificate", "ContactProblem", "ContactSolution", "Contacts", "Energy", "InputError",
    "Inputs", "InternalError", "ModuleMissing", "Run", "RunSummary", "Scene", "Simulation", "SolveFailed",
    "StepCertificate", "StepRecord", "Study", "WriteError", "build_info", "certify", "read_fclib", "read_run",
    "register_solver", "solve", "study", "validate", "write_fclib", "xray",
]


def build_info() -> dict:
    """Version, `git describe`, compiler, and for each optional module its file or why it is missing."""
    modules = {}
    for name, what in (("vtk", "pictures and .vtp surfaces: libvtk9-dev"),
                       ("fclib", "contact problems in files: libfclib-dev"),
                       ("cgal", "meshing: libcgal-dev"),
                       ("petsc", "solids too large for a factor: petsc-dev")):
        modules[name] = _native.find_module(name) or f"not built ({what})"
    return {"version": __version__, "describe": _native.describe(), "compiler": _native.compiler(),
            "modules": modules, "program": _native.program_path()}
