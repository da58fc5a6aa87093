"""What the scripts beside this one share."""
import subprocess
import sys

PYTHON = "/usr/bin/python3" # the one that Debian's packages are for


def debian_version(name, package, module):
    """@return  "NAME VERSION" of a Python module that a package of Debian brings, "" if it is not there"""
    if subprocess.run([PYTHON, "-c", f"import {module}"], capture_output=True).returncode != 0:
        return ""
    done = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", package], capture_output=True, text=True)
    return f"{name} " + (done.stdout.split("+")[0] or "of unknown version")


def draw(lines):
    """Lines of gnuplot."""
    done = subprocess.run(["gnuplot"], input="\n".join(lines), text=True, capture_output=True)
    if done.returncode != 0:
        print(done.stderr, file=sys.stderr)
