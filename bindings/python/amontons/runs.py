"""Result folders of runs, read without VTK."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ._arguments import refuse
from ._vtk_xml import Piece, read_vtk


# Columns of whole numbers.
_COUNTS = ("step", "iterations", "factorisations", "retries", "contacts", "closed", "sweeps", "new_operator", "products")


class History(Mapping[str, np.ndarray]):
    """A table of a run, history.csv above all: name to (rows,) array; `units` has the units, by name."""

    def __init__(self, rows, file=""):
        self.units = {}
        self._columns = {}
        for k, head in enumerate(rows[0]):
            name, _, unit = head.partition(" [")
            texts = []
            for line, row in enumerate(rows[1:], 2):
                if len(row) != len(rows[0]):
                    refuse(f"line {line}", f"{len(row)} values", f"{len(rows[0])}, as the head has", file)
                texts.append(row[k])
            self.units[name] = unit.rstrip("]")
            try:
                column = np.array([float(t) for t in texts])
            except ValueError:
                column = np.array(texts)
            if name in _COUNTS and column.dtype.kind == "f":
                column = column.astype(np.int64)
            column.flags.writeable = False
            self._columns[name] = column

    def __getitem__(self, name):
        return self._columns[name]

    def __iter__(self):
        return iter(self._columns)

    def __len__(self):
        return len(self._columns)

    def __repr__(self):
        return f"<History: {len(next(iter(self._columns.values())))} rows, {', '.join(self)}>"


def _read_history(file):
    try:
        with open(file, newline="", encoding="utf-8") as stream:
            rows = list(csv.reader(stream))
    except OSError as error:
        refuse("", error.strerror, "the history of a run", file)
    if not rows or rows[0][:1] != ["step"]:
        refuse("", "another table", "the history of a run, whose first column is step", file)
    return History(rows, file)


class Frame(Mapping[str, Piece]):
    """What was written at one time: names of bodies, and "contacts", to Pieces. Read at first use."""

    def __init__(self, folder, time, files):
        self.time = time  #: [s]
        self._folder, self._files = folder, files

    def __getitem__(self, name):
        return read_vtk(os.path.join(self._folder, self._files[name]))

    def __iter__(self):
        return iter(self._files)

    def __len__(self):
        return len(self._files)

    def __repr__(self):
        return f"<Frame at {self.time:g} s: {', '.join(self)}>"


class _Frames(Sequence[Frame]):
    def __init__(self, folder, file):
        import xml.etree.ElementTree as tree
        path = os.path.join(folder, file)
        try:
            sets = tree.parse(path).getroot().iter("DataSet")
        except (OSError, tree.ParseError) as error:
            refuse("", str(error), "the collection of a run", path)
        frames = {}
        for one in sets:
            frames.setdefault(float(one.get("timestep")), {})[one.get("name")] = one.get("file")
        self._frames = [Frame(folder, time, files) for time, files in sorted(frames.items())]

    def __getitem__(self, index):
        return self._frames[index]

    def __len__(self):
        return len(self._frames)


class Run:
    """The results of a run. history, manifest, frames and contacts are read at first use."""

    def __init__(self, folder):
        self.folder = os.fspath(folder)
        if not os.path.isfile(os.path.join(self.folder, "manifest.json")):
            refuse("", "no manifest.json", "the folder of a run", self.folder)
        self._known = {}

    def _once(self, name, make):
        if name not in self._known:
            self._known[name] = make()
        return self._known[name]

    @property
    def manifest(self) -> dict[str, Any]:
        """manifest.json as a dict (docs/outputs.md)."""
        def read():
            file = os.path.join(self.folder, "manifest.json")
            with open(file, encoding="utf-8") as stream:
                try:
                    return json.load(stream)
                except ValueError as error:  # no JSON, or no UTF-8
                    refuse("", str(error), "JSON, as a run writes it", file)
        return self._once("manifest", read)

    @property
    def history(self) -> History:
        """History: name to (steps,) array, with `units`."""
        return self._once("history", lambda: _read_history(os.path.join(self.folder, "history.csv")))

    @property
    def frames(self) -> Sequence[Frame]:
        """Frames in the order of time."""
        def find():
            for file in self.manifest["files"]:
                if file.endswith(".pvd") and file != "contacts.pvd":
                    return _Frames(self.folder, file)
            refuse("files", "no collection of frames", "a run that wrote one", os.path.join(self.folder, "manifest.json"))
        return self._once("frames", find)

    def contacts(self, time: float) -> Piece:
        """The contacts of the last frame at or before a time [s], as a Piece: points and point_fields."""
        earlier = [f for f in self.frames if f.time <= time * (1 + 1e-12)]
        if not earlier:
            refuse("time", f"{time}", f"at or after {self.frames[0].time} [s]", self.folder)
        return earlier[-1]["contacts"]

    def __repr__(self):
        return f"<Run {self.folder}: {self.manifest['status']}, {self.manifest['steps']} steps>"


def read_run(folder: str | os.PathLike) -> Run:
    """The results in a folder that `amontons run` or Simulation.run has written. InputError if it is none."""
    return Run(folder)
