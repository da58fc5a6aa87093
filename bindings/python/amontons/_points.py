"""Points of a study that this process runs, for `amontons study --run-by`: where functions of Python are registered."""

import contextlib
import json
import os
import select
import shlex
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

from . import _native
from .errors import InputError, SolveFailed
from .scene import Scene
from .simulation import Simulation

# What `amontons study` starts for each point: it hands its arguments to the process that waits, and answers for it.
_CLIENT = """#!/bin/sh
exec {python} -I -S -c '
import json, socket, sys
s = socket.socket(socket.AF_UNIX)
s.connect(sys.argv[1])
s.sendall(json.dumps(sys.argv[2:]).encode() + b"\\n")
code, out, err = json.loads(s.makefile().read())
sys.stdout.write(out)
sys.stderr.write(err)
sys.exit(code)
' {path} "$@"
"""


#: Name of the threads that wait for programs that were interrupted.
INTERRUPTED = "amontons_interrupted"


def start(command, **options):
    """A Popen that Ctrl-C reaches by this process alone: interrupt() hands it on, once."""
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, process_group=0, **options)


def interrupt(process):
    """Stops the program; where it does not end at once, a thread waits for it: it may still write what it has begun."""
    process.send_signal(signal.SIGINT)
    try:
        process.wait(0.03)
    except subprocess.TimeoutExpired:
        threading.Thread(target=process.wait, name=INTERRUPTED, daemon=True).start()


def _finished(process, out, err, meanwhile):
    """Exit code, stdout and stderr of a program that writes into two files, once it has ended."""
    try:
        while process.poll() is None:
            meanwhile()
    except BaseException:
        interrupt(process)
        raise
    out.seek(0)
    err.seek(0)
    return process.returncode, out.read(), err.read()


def run(command):
    """Exit code, stdout and stderr of a program.

    Its own waits: after Ctrl-C those of Popen wait for another quarter of a second.
    """
    with tempfile.TemporaryFile("w+", encoding="utf-8") as out, tempfile.TemporaryFile("w+", encoding="utf-8") as err:
        return _finished(start(command, stdout=out, stderr=err), out, err, lambda: time.sleep(0.01))


def _answer(arguments, is_freed):
    """Exit code, stdout and stderr of a point, as `amontons run --json` has them."""
    values = {"--set": []}
    for name, value in zip(arguments[2:], arguments[3:]):
        if name == "--set":
            values["--set"].append(value)
        elif name.startswith("--"):
            values[name] = value
    started, used = time.perf_counter(), time.process_time()
    try:
        with open(arguments[1], encoding="utf-8") as stream:
            scene = Scene._of(_native.SceneText(stream.read(), arguments[1], values["--set"]))
        with Simulation(scene, threads=int(values["--threads"])) as simulation:
            try:
                simulation.run(values["--output"], on_step=lambda record: is_freed())
                code, output = 0, ""
            except SolveFailed as error:
                code, output = 3, f"failed: {error}\n"
            answer = json.loads(simulation._answer)
    except InputError as error:
        return 2, json.dumps({"status": "bad_input", "issues": error.issues}), f"error: {error}\n"
    answer["seconds"]["total"] = time.perf_counter() - started
    answer["cpu_seconds"] = time.process_time() - used
    return code, json.dumps(answer), output


def _serve(connection):
    with contextlib.closing(connection):
        def is_freed():
            return bool(select.select([connection], [], [], 0)[0])
        # The client sends one line and waits; it ends with the time that a point has.
        request = connection.makefile().readline()
        answer = _answer(json.loads(request), is_freed)
        with contextlib.suppress(OSError):
            connection.sendall(json.dumps(answer).encode())


def run_study(command):
    """Runs `amontons study ...` with its points in this process, one after another.

    @return  exit code, stdout, stderr
    """
    with tempfile.TemporaryDirectory(prefix="amontons_", ignore_cleanup_errors=True) as folder, socket.socket(socket.AF_UNIX) as server, \
            open(os.path.join(folder, "out"), "w+", encoding="utf-8") as out, \
            open(os.path.join(folder, "err"), "w+", encoding="utf-8") as err:
        path, client = os.path.join(folder, "points"), os.path.join(folder, "run")
        server.bind(path)
        server.listen()
        server.settimeout(0.05)
        with open(client, "w", encoding="utf-8") as stream:
            stream.write(_CLIENT.format(python=shlex.quote(sys.executable), path=shlex.quote(path)))
        os.chmod(client, 0o700)

        def serve_a_point():
            with contextlib.suppress(TimeoutError):
                connection, _ = server.accept()
                connection.settimeout(None)
                _serve(connection)
        return _finished(start([*command, "--run-by", client], stdout=out, stderr=err), out, err, serve_a_point)
