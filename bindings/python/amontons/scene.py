"""Scenes: what is simulated."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

from . import _native
from ._arguments import overrides, refuse, to_json


class Scene:
    """A checked scene. Equal input gives an equal scene; SI units, fields as in docs/scene_reference.md.

    source: a file, or a dict as json.load gives it (numpy's numbers and arrays are taken).
    set: {"contact.0.friction": 0.2}: values in place of the source's.
    folder: where relative files are searched for; default the file's folder, of a dict the current one.

    Raises InputError with all that is wrong in `issues`.

    >>> import amontons as am
    >>> scene = am.Scene({"schema": 1, "bodies": {"ball": {"kind": "rigid", "mass": 2,
    ...     "shape": {"generate": "ball", "radius": 0.1}}}, "time": {"kind": "dynamic", "step": 0.1, "end": 1}})
    >>> scene["bodies.ball.mass"], scene["gravity"]
    (2, [0, 0, 0])
    >>> scene.changed({"bodies.ball.mass": 3})["bodies.ball.mass"]
    3
    """

    def __init__(self, source: str | os.PathLike | Mapping, *, set: Mapping[str, Any] = {},
                 folder: str | os.PathLike | None = None):
        if isinstance(source, Mapping):
            text = to_json(source, "", "scene")
            file = "scene" if folder is None else os.path.join(os.fspath(folder), "scene")
        elif isinstance(source, (str, os.PathLike)):
            file = os.fspath(source)
            try:
                with open(file, encoding="utf-8") as stream:
                    text = stream.read()
            except UnicodeDecodeError as error:
                refuse("", f"no UTF-8: {error.reason} at byte {error.start}", "a scene in JSON", file)
            except OSError as error:
                refuse("", error.strerror, "a scene that can be read", file)
            if folder is not None:
                file = os.path.join(os.fspath(folder), os.path.basename(file))
        else:
            refuse("source", f"a {type(source).__name__}", "a file's name or a dict")
        self._text = _native.SceneText(text, file, overrides(set))
        self._resolved: dict[str, Any] | None = None

    @classmethod
    def _of(cls, text):
        scene = cls.__new__(cls)
        scene._text, scene._resolved = text, None
        return scene

    def changed(self, set: Mapping[str, Any]) -> Scene:
        """A copy with other values, as `set` of the constructor; of the text that was read then."""
        return Scene._of(self._text.changed(overrides(set)))

    def check(self) -> dict[str, Any]:
        """What `amontons check --json` states, as a dict: bodies, surfaces, pairs, uses, leaves_out, predicted.

        Makes the bodies and runs nothing. Raises InputError as Simulation would.
        """
        return self._text.check()

    @property
    def resolved(self) -> dict[str, Any]:
        """The scene as a dict with every default filled in; a new one each time."""
        return json.loads(self._text.resolved())

    def __getitem__(self, path: str) -> Any:
        """A value of `resolved` by its path: scene["bodies.wire.segments.0.EI"]."""
        if self._resolved is None:
            self._resolved = self.resolved
        value: Any = self._resolved
        for part in str(path).replace("/", ".").strip(".").split("."):
            try:
                value = value[int(part)] if isinstance(value, list) else value[part]
            except (KeyError, IndexError, ValueError, TypeError):
                raise KeyError(path) from None
        return json.loads(json.dumps(value))

    def save(self, path: str | os.PathLike) -> None:
        """Writes the resolved scene. InputError if files that it names would not be found from there."""
        path = os.fspath(path)
        home = os.path.dirname(os.path.abspath(self._text.file))
        relative = self._text.relative_files()
        if relative and os.path.dirname(os.path.abspath(path)) != home:
            refuse("", f"a folder from which {relative[0]} is not found", f"a file in {home}, or absolute names", path)
        self._text.save(path)

    def __eq__(self, other):
        return isinstance(other, Scene) and self._text.resolved() == other._text.resolved()

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self):
        return _scene_again, (self._text.state(),)

    def __repr__(self):
        return f"<Scene {self._text.file}: {', '.join(self['bodies'])}>"


def _scene_again(state):
    text, file, changes = state
    return Scene._of(_native.SceneText(text, file, changes))
