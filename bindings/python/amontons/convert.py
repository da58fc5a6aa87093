"""Bodies as meshes of pyvista and meshio, which are installed apart."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from .errors import ModuleMissing

_VTK_TYPES = {"T4": 10, "T10": 24, "H8": 12}
_MESHIO_NAMES = {"T4": "tetra", "T10": "tetra10", "H8": "hexahedron"}


def _need(name, how):
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ModuleMissing(f"this needs {name}, which is not here: {how}", name=name) from error


def _parts(body):
    """Points, fields of points and of cells, and the cells: {"T4": (m, 4), ...}, {"triangle": (m, 3)} or {"line": (n,)}."""
    points = np.array(body.points)
    of_cells = {name: np.array(f) for name, f in getattr(body, "cell_fields", {}).items()}
    fields = {name: np.array(f) for name, f in body.fields.items()}
    if not hasattr(body, "cells"):
        return points, fields, of_cells, {"line": np.arange(len(points), dtype=np.int64)}
    cells = {name: np.array(c, dtype=np.int64) for name, c in body.cells.items()}
    return points, fields, of_cells, cells or {"triangle": np.array(body.triangles, dtype=np.int64)}


def to_pyvista(body: Any) -> Any:
    """Of a solid a pyvista.UnstructuredGrid, else a pyvista.PolyData: copies, with all fields."""
    pyvista = _need("pyvista", "pip install pyvista")
    points, fields, of_cells, cells = _parts(body)
    if "line" in cells:
        mesh = pyvista.PolyData()
        mesh.points = points
        if len(points) > 1:
            mesh.lines = np.concatenate([[len(points)], cells["line"]])
    elif "triangle" in cells:
        corners = cells["triangle"]
        mesh = pyvista.PolyData(points, np.column_stack([np.full(len(corners), 3), corners]).ravel())
    else:
        rows = [np.column_stack([np.full(len(c), c.shape[1]), c]).ravel() for c in cells.values()]
        kinds = [np.full(len(c), _VTK_TYPES[name], dtype=np.uint8) for name, c in cells.items()]
        mesh = pyvista.UnstructuredGrid(np.concatenate(rows), np.concatenate(kinds), points)
    for name, values in fields.items():
        mesh.point_data[name] = values
    for name, values in of_cells.items():
        mesh.cell_data[name] = values
    return mesh


def to_meshio(body: Any) -> Any:
    """A meshio.Mesh: a copy, with all fields."""
    meshio = _need("meshio", "apt-get install python3-meshio, or pip install meshio")
    points, fields, of_cells, cells = _parts(body)
    if "line" in cells:
        numbers = cells["line"]
        blocks = [("line", np.column_stack([numbers[:-1], numbers[1:]]))]
    else:
        blocks = [(_MESHIO_NAMES.get(name, name), c) for name, c in cells.items()]
    first = np.cumsum([0] + [len(c) for _, c in blocks])
    return meshio.Mesh(points, blocks, point_data=fields, cell_data={
        name: [values[a:b] for a, b in zip(first, first[1:])] for name, values in of_cells.items()})
