"""The stubs state what the native module has: each name, argument and property."""

import ast
import importlib.util
import os
import re
import subprocess
import sys
import tempfile
import unittest

import amontons as am
from amontons import _native
from scenes import Case, main


def declared():
    """{"Contacts": {"of": ["self", "a", "b"], ...}, "": {functions}} of _native.pyi."""
    with open(os.path.join(os.path.dirname(am.__file__), "_native.pyi"), encoding="utf-8") as stream:
        tree = ast.parse(stream.read())
    found = {"": {}}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            found[""][node.name] = [a.arg for a in node.args.args]
        if isinstance(node, ast.ClassDef) and node.name != "_Pybind11Type":
            found[node.name] = {}
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    found[node.name][member.name] = [a.arg for a in member.args.args]
    return found


def arguments(function):
    """Their number, as pybind11's first line of the docstring reports."""
    line = (function.__doc__ or "").splitlines()[0]
    inside = line[line.index("(") + 1:line.rindex(") ->")] if ") ->" in line else ""
    return len(re.findall(r"\w+: ", inside))


class StubsTest(Case):
    def test_names_of_the_module_and_its_classes_are_declared_and_no_others(self):
        stubs = declared()
        classes = {n: c for n, c in vars(_native).items() if isinstance(c, type)}
        functions = {n for n, f in vars(_native).items() if callable(f) and not isinstance(f, type)}
        self.assertEqual(set(stubs) - {""}, set(classes))
        self.assertEqual(set(stubs[""]), functions)
        kept = {"__init__", "__len__", "__bool__"}
        for name, c in classes.items():
            members = {n for n in vars(c) if not n.startswith("_") or n in kept}
            self.assertEqual({n for n in stubs[name] if n != "__init__" or n in members}, members - ({"__init__"} - set(stubs[name])), name)

    def test_functions_take_as_many_arguments_as_declared(self):
        stubs = declared()
        for name, names in stubs[""].items():
            self.assertEqual(len(names), arguments(getattr(_native, name)), name)
        for name, members in stubs.items():
            for member, names in members.items():
                function = getattr(getattr(_native, name), member, None) if name else None
                if callable(function) and function.__doc__ and "Overloaded" not in function.__doc__ and member != "__init__":
                    self.assertEqual(len(names), arguments(function), f"{name}.{member}")

    @unittest.skipUnless(importlib.util.find_spec("mypy"), "no mypy")
    def test_mypy_and_its_stubtest_find_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            allowed, settings = os.path.join(folder, "allowed"), os.path.join(folder, "mypy.ini")
            with open(allowed, "w", encoding="utf-8") as stream:
                # What pybind11 does not report: arguments of constructors, and its own mark of a class.
                stream.write(r"amontons\._native\.\w+\.__init__" "\n" r".*\.__pybind11_module_local.*" "\n")
            with open(settings, "w", encoding="utf-8") as stream:
                # Optional packages; and classes that are gymnasium's where that is there.
                stream.write("[mypy]\nignore_missing_imports = True\n[mypy-amontons.gym.*]\nignore_errors = True\n"
                             "[mypy-amontons.examples.*]\nignore_errors = True\n")  # as they stand in the documents
            for tool in (["mypy.stubtest", "amontons._native", "--concise", "--allowlist", allowed, "--mypy-config-file", settings],
                         ["mypy", "-p", "amontons", "--config-file", settings, "--cache-dir", os.path.join(folder, "cache")]):
                result = subprocess.run([sys.executable, "-m", *tool], cwd=folder, capture_output=True, text=True,
                                        env=dict(os.environ, MYPYPATH=os.path.dirname(os.path.dirname(am.__file__))))
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


if __name__ == "__main__":
    main()
