"""Python's values as the engine takes them."""

import json
import math
import os
from collections.abc import Mapping
from typing import NoReturn

import numpy as np

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


def _refuse_what_is_no_json(value, place, file, around=()):
    """Refuses the first part of a value that json does not take, by its place."""
    if isinstance(value, (float, np.floating)) and not math.isfinite(value):
        refuse(place, f"{value}", "a finite number", file)
    if value is None or isinstance(value, (str, int, float)):
        return
    if any(value is other for other in around):
        refuse(place, "a loop: a part that holds itself", "parts without loops", file)
    if isinstance(value, Mapping):
        for key, part in value.items():
            if not isinstance(key, (str, int, float, type(None))):
                refuse(place, f"a key that is a {type(key).__name__}", "texts as keys", file)
            _refuse_what_is_no_json(part, f"{place}/{key}", file, (*around, value))
    elif isinstance(value, (list, tuple)):
        for k, part in enumerate(value):
            _refuse_what_is_no_json(part, f"{place}/{k}", file, (*around, value))
    else:
        try:
            part = plain(value)
        except TypeError:
            refuse(place, f"a {type(value).__name__} that is no JSON", "numbers, texts, lists, dicts and numpy's arrays", file)
        _refuse_what_is_no_json(part, place, file, (*around, value))


def to_json(value, place, file=""):
    """@raises InputError: no JSON, or a number that is not finite"""
    try:
        return json.dumps(value, default=plain, allow_nan=False, separators=(",", ":"))
    except (TypeError, ValueError) as error:
        _refuse_what_is_no_json(value, place, file)
        refuse(place, str(error), "numbers, texts, lists, dicts and numpy's arrays", file)


def overrides(values):
    """["PATH=VALUE"] of {"PATH": value}."""
    if not isinstance(values, Mapping):
        refuse("set", f"a {type(values).__name__}", '{"PATH": value}, such as {"time.end": 2}')
    for path in values:
        if not isinstance(path, str) or not path or "=" in path:  # where the value begins
            refuse("set", repr(path), 'the path of a field, such as "time.end"')
    return [f"{path}={to_json(value, path)}" for path, value in values.items()]
