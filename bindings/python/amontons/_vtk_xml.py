"""VTK's XML files as amontons writes them: arrays raw behind the header, 64-bit sizes, uncompressed."""

import dataclasses
import os
import xml.etree.ElementTree as tree
from collections.abc import Mapping

import numpy as np

from ._arguments import refuse

_TYPES = {"Float64": "<f8", "Float32": "<f4", "Int64": "<i8", "Int32": "<i4", "UInt8": "u1", "Int8": "i1"}


@dataclasses.dataclass(frozen=True)
class Piece:
    """A body, or contacts, in a frame. Arrays are read-only."""

    points: np.ndarray  #: (n, 3) [m]
    point_fields: Mapping  #: name to (n,) or (n, components)
    cell_fields: Mapping
    cells: Mapping  #: "connectivity", "offsets" and, of solids, "types", of lines or polygons
    units: Mapping  #: of the fields


def _array(element, raw, file):
    kind = _TYPES.get(element.get("type"))
    if kind is None:
        refuse(element.get("Name", ""), f"type {element.get('type')}", "one that amontons writes", file)
    if element.get("format") == "ascii":
        values = np.array((element.text or "").split(), dtype=float).astype(kind)
    else:
        offset = int(element.get("offset"))
        size = int.from_bytes(raw[offset:offset + 8], "little")
        data = raw[offset + 8:offset + 8 + size]
        if len(data) != size or size % np.dtype(kind).itemsize:
            refuse(element.get("Name", ""), "an end within its values", "a whole file", file)
        values = np.frombuffer(data, dtype=kind)
    components = int(element.get("NumberOfComponents", 1))
    return values if components == 1 else values.reshape(-1, components)


def read_vtk(path):
    """The one piece of a .vtp or .vtu file. @raises InputError"""
    path = os.fspath(path)
    try:
        with open(path, "rb") as stream:
            whole = stream.read()
    except OSError as error:
        refuse("", error.strerror, "a frame of a run", path)
    head, mark, raw = whole.partition(b"<AppendedData encoding=\"raw\">")
    try:
        root = tree.fromstring(head + (b"</VTKFile>" if mark else b""))
    except tree.ParseError as error:
        refuse("", str(error), "a file that amontons wrote", path)
    if root.get("header_type") != "UInt64" or root.get("compressor"):
        refuse("", "another layout", "a file that amontons wrote", path)
    raw = memoryview(raw)[raw.index(b"_") + 1:] if mark else memoryview(b"")
    fields = {"PointData": {}, "CellData": {}}
    points, cells, units = np.empty((0, 3)), {}, {}
    for group in root[0].iter():
        for element in group.findall("DataArray"):
            name = element.get("Name")
            unit = element.find("InformationKey")
            if group.tag in fields:
                fields[group.tag][name] = _array(element, raw, path)
                units[name] = unit.text or "" if unit is not None else ""
            elif group.tag == "Points":
                points = _array(element, raw, path).reshape(-1, 3)
            elif group.tag in ("Lines", "Polys", "Cells"):
                values = _array(element, raw, path)
                if len(values):
                    cells[name] = values
    return Piece(points, fields["PointData"], fields["CellData"], cells, units)
