"""Python's values as the engine takes them."""

import json
import os
from collections.abc import Mapping
from typing import NoReturn

from .errors import InputError


def refuse(place: str, found: str, allowed: str, file: str = "") -> NoReturn:
    """Raises InputError for one thing that is wrong."""
    where = ": ".join(part for part in (file, place) if part)
    error = InputError(f"{where}: found {found}, allowed: {allowed}")
    error.issues = [{"file": file, "place": place, "found": found, "allowed": allowed}]
    raise error


def plain(value):
    """For json: numpy's numbers and arrays, tuples and paths as what they are in a file."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError


def to_json(value, place):
    """@raises InputError: no JSON, or a number that is not finite"""
    try:
        return json.dumps(value, default=plain, allow_nan=False, separators=(",", ":"))
    except TypeError:
        refuse(place, f"a {type(value).__name__} that is no JSON", "numbers, texts, lists, dicts and numpy's arrays")
    except ValueError as error:
        refuse(place, str(error), "finite numbers, without loops")


def overrides(values):
    """["PATH=VALUE"] of {"PATH": value}."""
    if not isinstance(values, Mapping):
        refuse("set", f"a {type(values).__name__}", '{"PATH": value}, such as {"time.end": 2}')
    for path in values:
        if not isinstance(path, str) or not path or "=" in path:  # where the value begins
            refuse("set", repr(path), 'the path of a field, such as "time.end"')
    return [f"{path}={to_json(value, path)}" for path, value in values.items()]
