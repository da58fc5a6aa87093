#!/usr/bin/env python3
"""The server of `amontons studio` from outside: who is answered, with what, and how it ends.

usage: studio_test.py PROGRAM
"""
import contextlib
import http.client
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

import reported_skips

program = ""
SCENE = {
    "schema": 1,
    "bodies": {
        "bed": {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
                "mesh": {"generate": "box", "size": [0.1, 0.04, 0.02], "cells": [5, 2, 1], "element": "H8"},
                "hold": [{"set": "z_min"}]},
        "tool": {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
                 "mesh": {"generate": "box", "size": [0.04, 0.04, 0.04], "cells": [2, 2, 2], "element": "H8"},
                 "start": {"place": [-0.02, 0, 0.0305]}, "hold": [{"set": "z_max"}],
                 "drive": {"z": [[0, 0], [1, -0.002]], "x": [[1, 0], [5, 0.04]]}}},
    "contact": [{"between": ["tool", "bed"], "friction": 0.3}],
    "time": {"step": 0.05, "end": 5},
}
FORCE = "bed_on_tool_force_z"


class Studio:
    """A server, and a page's requests to it."""

    def __init__(self, folder, *arguments, open="scene.json"):
        env = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
        self.process = subprocess.Popen([program, "studio", open, *arguments], cwd=folder, env=env, text=True,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.address = self.process.stdout.readline().strip()
        match = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/#([0-9a-f]{32})", self.address)
        if not match:
            self.process.kill()
            raise AssertionError(self.address + self.process.stderr.read())
        self.port, self.token, self.last = int(match[1]), match[2], 0

    def send(self, method, path, body=None, headers=None, token=True, timeout=60):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout)
        headers = dict(headers or {})
        if token:
            headers.setdefault("Authorization", "Bearer " + self.token)
        connection.request(method, path, body, headers)
        answer = connection.getresponse()
        data = answer.read()
        connection.close()
        return answer.status, data, answer.headers

    def get(self, path):
        status, data, _ = self.send("GET", path)
        if status != 200:
            raise AssertionError((path, status, data))
        return json.loads(data)

    def do(self, what, **fields):
        self.last += 1
        status, data, _ = self.send("POST", "/api/command", json.dumps({"id": self.last, "do": what, **fields}))
        answer = json.loads(data)
        assert status == 200 and answer["id"] == self.last, (status, answer)
        return answer

    def start(self, scene="scene.json", **more):
        assert self.do("start", scene=scene, **more)["ok"]
        self.wait("paused")

    def wait(self, *states, seconds=20):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            engine = self.get("/api/state")["engine"]
            if engine["state"] in states:
                return engine
            time.sleep(0.02)
        raise AssertionError(engine)

    def close(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                raise
        self.process.stdout.close()
        self.process.stderr.close()


class StudioTest(unittest.TestCase):
    def setUp(self):
        self.top = pathlib.Path(tempfile.mkdtemp())
        self.folder = self.top / "work"
        self.folder.mkdir()
        (self.folder / "scene.json").write_text(json.dumps(SCENE))
        (self.top / "secret.json").write_text(json.dumps(SCENE))
        self.studio = None

    def tearDown(self):
        if self.studio:
            self.studio.close()
        shutil.rmtree(self.top)

    def begin(self, *arguments, **how):
        self.studio = Studio(self.folder, *arguments, **how)
        return self.studio

    def raw(self, text, wait=2.0):
        with socket.create_connection(("127.0.0.1", self.studio.port), timeout=wait) as s:
            s.sendall(text.encode("latin-1"))
            data = b""
            try:
                while True:
                    block = s.recv(65536)
                    if not block:
                        break
                    data += block
            except (socket.timeout, ConnectionResetError):
                pass
            return data.decode("latin-1")

    def test_loopback_alone_is_listened_on(self):
        s = self.begin()
        listening = []
        for file in ("/proc/net/tcp", "/proc/net/tcp6"):
            for line in pathlib.Path(file).read_text().splitlines()[1:]:
                place, state = line.split()[1], line.split()[3]
                if int(place.split(":")[1], 16) == s.port and state == "0A":
                    listening.append(place.split(":")[0])
        has6 = pathlib.Path("/proc/net/if_inet6").exists() and \
            any(line.split()[0] == "0" * 31 + "1" for line in pathlib.Path("/proc/net/if_inet6").read_text().splitlines())
        self.assertEqual(sorted(listening), ["0" * 24 + "01000000", "0100007F"] if has6 else ["0100007F"])
        if not has6:
            return
        # By the newer protocol the same is required of every client.
        for host, token, status in ((f"[::1]:{s.port}", s.token, 200), (f"[::1]:{s.port}", "0" * 32, 401),
                                    ("evil.example", s.token, 403), (f"[::2]:{s.port}", s.token, 403)):
            connection = http.client.HTTPConnection("::1", s.port, timeout=10)
            connection.request("GET", "/api/state", headers={"Host": host, "Authorization": "Bearer " + token})
            self.assertEqual(connection.getresponse().status, status, host)
            connection.close()

    def test_everything_of_the_interface_needs_the_whole_token(self):
        s = self.begin()
        paths = ["/api/state", "/api/schema", "/api/list", "/api/file?path=scene.json", "/api/frame?after=0",
                 "/api/events", "/api/none"]
        wrong = [None, "", s.token, "Bearer", "Bearer " + s.token[:-1], "Bearer " + s.token + "0",
                 "Bearer " + "0" * 32, "Basic " + s.token]
        for path in paths:
            for value in wrong:
                headers = {} if value is None else {"Authorization": value}
                self.assertEqual(s.send("GET", path, headers=headers, token=False)[0], 401, (path, value))
        for value in wrong:
            headers = {} if value is None else {"Authorization": value}
            self.assertEqual(s.send("POST", "/api/command", '{"id":1,"do":"stop"}', headers, token=False)[0], 401)
        # Not in the request line, where logs and histories would keep it.
        self.assertEqual(s.send("GET", f"/api/state?token={s.token}", token=False)[0], 401)
        self.assertEqual(s.send("GET", "/api/state")[0], 200)

    def test_tokens_differ_from_server_to_server(self):
        first = self.begin().token
        self.studio.close()
        self.assertNotEqual(self.begin().token, first)

    def test_other_hosts_and_origins_are_refused(self):
        s = self.begin()
        for host in ("evil.example", f"evil.example:{s.port}", "127.0.0.1", f"127.0.0.1:{s.port + 1}",
                     f"127.0.0.1:{s.port}.evil.example", "", f"[::2]:{s.port}"):
            for path in ("/", "/api/state"):
                text = f"GET {path} HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {s.token}\r\nConnection: close\r\n\r\n"
                self.assertIn(" 403 ", self.raw(text).split("\r\n")[0], host)
        none = f"GET / HTTP/1.1\r\nConnection: close\r\n\r\n"
        self.assertIn(" 403 ", self.raw(none).split("\r\n")[0])
        two = f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{s.port}\r\nHost: evil.example\r\nConnection: close\r\n\r\n"
        self.assertIn(" 403 ", self.raw(two).split("\r\n")[0])
        for origin in ("http://evil.example", "null", f"https://127.0.0.1:{s.port}", "http://127.0.0.1", "file://"):
            self.assertEqual(s.send("GET", "/api/state", headers={"Origin": origin})[0], 403, origin)
        for origin in (f"http://127.0.0.1:{s.port}", f"http://localhost:{s.port}"):
            self.assertEqual(s.send("GET", "/api/state", headers={"Origin": origin})[0], 200, origin)
        self.assertEqual(s.send("GET", "/api/state", headers={"Host": f"localhost:{s.port}"})[0], 200)

    def test_headers_of_every_answer_shut_the_page_in(self):
        s = self.begin()
        for path, token in (("/", False), ("/studio.js", False), ("/api/state", True), ("/api/state", False),
                            ("/none", False)):
            _, _, headers = s.send("GET", path, token=token)
            policy = headers["Content-Security-Policy"]
            self.assertIn("default-src 'self'", policy)
            for word in ("unsafe", "http:", "https:", "*"):
                self.assertNotIn(word, policy)
            self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
            self.assertEqual(headers["Cross-Origin-Resource-Policy"], "same-origin")
            for name in headers:
                self.assertFalse(name.lower().startswith("access-control-"), name)
        page = s.send("GET", "/", token=False)[1].decode()
        self.assertNotRegex(page, r"<script(?![^>]*\bsrc=)")  # none inline
        self.assertNotRegex(page, r"(src|href)=.?https?:")
        self.assertIn("three", s.send("GET", "/licences.txt", token=False)[1].decode())

    def test_methods_bodies_and_headers_have_bounds(self):
        s = self.begin()
        for method in ("PUT", "DELETE", "OPTIONS", "PATCH"):
            self.assertIn(s.send(method, "/api/command", "{}")[0], (405, 400), method)
        huge = f"POST /api/command HTTP/1.1\r\nHost: 127.0.0.1:{s.port}\r\nAuthorization: Bearer {s.token}\r\n" \
               f"Content-Length: {(16 << 20) + 1}\r\nConnection: close\r\n\r\n"
        self.assertIn(" 413 ", self.raw(huge + "x" * ((16 << 20) + 1), wait=30).split("\r\n")[0])
        long = f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{s.port}\r\nX: {'y' * 100000}\r\n\r\n"
        self.assertNotIn(" 200 ", self.raw(long))
        line = f"GET /{'y' * 100000} HTTP/1.1\r\nHost: 127.0.0.1:{s.port}\r\n\r\n"
        self.assertNotIn(" 200 ", self.raw(line))
        self.assertEqual(s.send("GET", "/api/state")[0], 200)

    def test_more_connections_than_sixteen_wait_and_none_stays_silent_for_ever(self):
        s = self.begin()
        idle = [socket.create_connection(("127.0.0.1", s.port)) for _ in range(40)]
        try:
            # On a busy machine they are taken late, when the first silent ones are closed again.
            most, until = 0, time.monotonic() + 20
            while most <= 16 and time.monotonic() < until:
                with contextlib.suppress(OSError):  # no more fit into the queue
                    idle.append(socket.create_connection(("127.0.0.1", s.port), timeout=0.05))
                time.sleep(0.05)
                most = max(most, len(os.listdir(f"/proc/{s.process.pid}/task")))
            self.assertGreater(most, 16)  # the bound, and not another one, is what is found
            time.sleep(0.3)
            self.assertLessEqual(len(os.listdir(f"/proc/{s.process.pid}/task")), 16 + 4)
            # The silent ones are closed, some at a time, and requests are answered.
            self.assertEqual(s.send("GET", "/api/state", timeout=60)[0], 200)
        finally:
            for i in idle:
                i.close()

    def test_paths_stay_below_the_folder(self):
        (self.folder / "out.json").symlink_to(self.top / "secret.json")
        (self.folder / "up").symlink_to(self.top)
        (self.folder / "notes.txt").write_text("x")
        s = self.begin()
        for path in ("../secret.json", "%2e%2e/secret.json", "/etc/passwd", str(self.top / "secret.json"), "out.json",
                     "up/secret.json", "notes.txt", "", ".", "scene.json%00.csv", "..%2fsecret.json"):
            self.assertEqual(s.send("GET", "/api/file?path=" + path)[0], 403, path)
            self.assertFalse(s.do("start", scene=path)["ok"])
        self.assertEqual(s.send("GET", "/api/file?path=scene.json")[0], 200)
        self.assertEqual(s.send("GET", "/api/file?path=none.json")[0], 404)
        for path in ("../new.json", "up/new.json", str(self.top / "new.json"), "new.txt", "scene.json", "out.json",
                     "none/new.json"):
            self.assertFalse(s.do("save_scene", path=path, scene={"schema": 1})["ok"], path)
        self.assertEqual(json.loads((self.folder / "scene.json").read_text()), SCENE)
        self.assertEqual(sorted(p.name for p in self.top.iterdir()), ["secret.json", "work"])
        self.assertTrue(s.do("save_scene", path="new.json", scene=SCENE)["ok"])
        self.assertTrue(s.do("save_scene", path="new.json", scene=SCENE)["ok"])  # its own it may write again
        self.assertEqual(json.loads((self.folder / "new.json").read_text()), SCENE)
        self.assertEqual(s.get("/api/list"), {"scenes": ["new.json", "scene.json"], "results": []})

    def test_commands_are_a_closed_list(self):
        s = self.begin()
        s.start()
        for what in ("quit", "frame", "view", "exec", "sh", "", "start;ls", "__proto__"):
            answer = s.do(what)
            self.assertFalse(answer["ok"], what)
        for body in (b"", b"{", b"[]", b"null", b"\xff\xfe", b'"run"', b"[" * 100000, b'{"id":1}', b'{"do":"run"}',
                     b'{"id":{},"do":"run"}', b'{"id":1,"do":5}', b'{"id":1,"do":"start","set":5,"scene":[]}'):
            status, data, _ = s.send("POST", "/api/command", body)
            self.assertEqual(status, 200, body[:40])
            self.assertFalse(json.loads(data)["ok"], body[:40])
        # Nothing of a request becomes an option or a command of the shell.
        for bad in ("--help", "x", 5, None):
            self.assertFalse(s.do("start", scene="scene.json", set=[bad])["ok"])
        self.assertTrue(s.do("start", scene="scene.json", set=["title=$(touch pwned)`touch pwned`"])["ok"])
        s.wait("paused")
        self.assertFalse((self.folder / "pwned").exists())

    def test_a_scene_is_run_changed_and_continued(self):
        s = self.begin()
        s.start()
        self.assertTrue(s.do("step", count=21)["ok"])
        soft = s.do("state")["quantities"][FORCE]
        self.assertTrue(s.do("set", path="bodies.bed.youngs_modulus", value=2e5)["ok"])
        fds = f"/proc/{s.get('/api/state')['engine']['pid']}/fd"
        kinds = [os.readlink(f"{fds}/{fd}").split(":")[0] for fd in os.listdir(fds)]
        self.assertEqual(kinds.count("socket"), 0)  # none of a page
        self.assertGreaterEqual(kinds.count("pipe"), 4)
        changed = s.do("step", count=40)
        self.assertNotAlmostEqual(changed["quantities"][FORCE], soft, 2)
        refused = s.do("set", path="bodies.bed.poisson_ratio", value=0.7)
        self.assertFalse(refused["ok"])
        self.assertIn("0.7", json.dumps(refused["issues"]))
        other = s.do("state")["time"]
        self.assertEqual(other, changed["time"])
        s.start(set=["bodies.bed.youngs_modulus=1e5"])
        self.assertAlmostEqual(s.do("step", count=21)["quantities"][FORCE], soft, 12)

    def test_holds_and_sets_change_within_a_run(self):
        scene = json.loads(json.dumps(SCENE))
        for body in scene["bodies"].values():
            body["motion"] = "corotational"
        (self.folder / "large.json").write_text(json.dumps(scene))
        s = self.begin()
        s.start("large.json")
        s.do("step", count=15)
        before = s.do("state")
        for path, value in (("bodies.bed.hold", [{"set": "z_min"}, {"set": "x_max"}]),
                            ("bodies.bed.sets", {"end": {"plane": {"at": [-0.05, 0, 0], "normal": [1, 0, 0]}}})):
            answer = s.do("set", path=path, value=value)
            self.assertTrue(answer["ok"], answer)
            self.assertEqual((answer["time"], answer["step"]["number"]), (before["time"], 14))
        held = s.do("step", count=3)
        self.assertTrue(held["ok"], held)
        # Without sliding a balance is that of its loads and holds, whatever the way to it.
        fresh = subprocess.run([program, "run", "large.json", "-o", "fresh", "--json", "--quiet",
                                f"--set=time.end={held['time']}",
                                '--set=bodies.bed.hold=[{"set":"z_min"},{"set":"x_max"}]'],
                               cwd=self.folder, capture_output=True, text=True, check=True)
        force = json.loads(fresh.stdout)["quantities"][FORCE]
        self.assertLess(abs(held["quantities"][FORCE] - force), 1e-3 * abs(force))
        self.assertTrue(s.do("set", path="bodies.bed.hold", value=[{"set": "z_min"}])["ok"])
        free = s.do("step", count=2)
        self.assertTrue(free["ok"], free)
        # Another mesh is another body: that needs a new start, and nothing has changed.
        other = s.do("set", path="bodies.bed.mesh.cells", value=[6, 2, 1])
        self.assertFalse(other["ok"])
        self.assertEqual(other["issues"][0]["file"], "checkpoint")
        self.assertEqual(s.do("state")["time"], free["time"])

    def test_other_holds_of_a_linear_solid_at_rest_need_a_new_start(self):
        s = self.begin()
        s.start()
        s.do("step", count=15)
        before = s.do("state")
        # As many numbers as before, of another meaning.
        for hold in ([{"set": "x_min"}], [], [{"set": "z_min"}, {"set": "x_max"}]):
            answer = s.do("set", path="bodies.bed.hold", value=hold)
            self.assertFalse(answer["ok"], hold)
            self.assertEqual(answer["issues"][0]["file"], "checkpoint")
        self.assertEqual(s.do("state")["quantities"], before["quantities"])
        self.assertTrue(s.do("step")["ok"])

    def test_what_a_live_run_has_done_is_on_the_disk(self):
        s = self.begin()
        s.start()
        s.do("step", count=20)
        first = self.folder / "out/studio/work-001"
        self.assertEqual(len((first / "history.csv").read_text().splitlines()), 21)
        s.do("set", path="bodies.bed.youngs_modulus", value=2e5)
        s.do("step", count=5)
        second = self.folder / "out/studio/work-002"
        self.assertEqual(len((second / "history.csv").read_text().splitlines()), 6)
        ended = json.loads((first / "manifest.json").read_text())
        self.assertEqual((ended["status"], ended["message"]), ("interrupted", "the scene was changed"))
        self.assertIn("--set=bodies.bed.youngs_modulus=2e+05",
                      [w.replace("200000.0", "2e+05") for w in json.loads((second / "manifest.json").read_text())["command"]])
        time.sleep(0.3)
        s.do("step")  # what is written at times is written again by now
        os.kill(s.get("/api/state")["engine"]["pid"], signal.SIGKILL)
        s.process.kill()
        s.process.wait()
        self.assertEqual(len((second / "history.csv").read_text().splitlines()), 7)
        self.studio.close()
        s = self.begin(open="out/studio/work-002")
        self.assertTrue(s.do("start", folder="out/studio/work-002")["ok"])
        s.wait("paused")
        on = s.do("step")
        self.assertTrue(on["ok"])
        self.assertAlmostEqual(on["time"], 1.25 + (on["step"]["number"] - 25) * 0.05, 9)
        # The manifest's own command continues with it, too.
        s.do("stop")
        command = json.loads((second / "manifest.json").read_text())["command"]
        done = subprocess.run([program, *command[1:], "--resume", "--quiet", "--set=output.plots=false"],
                              cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        times = [float(r.split(",")[1]) for r in (second / "history.csv").read_text().splitlines()[1:]]
        self.assertEqual(times, sorted(times))
        self.assertAlmostEqual(times[-1], 5, 9)
        for bad in ("..", "out", "/etc", 5, None):
            self.assertFalse(s.do("start", folder=bad)["ok"], bad)

    def test_a_run_in_the_hand_reports_its_health(self):
        scene = json.loads(json.dumps(SCENE))
        scene["haptic"] = {"handle": "tool", "kind": "elastic", "simulation_rate": 25}
        (self.folder / "hand.json").write_text(json.dumps(scene))
        s = self.begin("--no-results")
        start = s.get("/api/state")["events"]
        for bad in ("/dev/x", "udp:99999", "recorded:../x.csv", "recorded:none.csv", 5, "simulated;ls"):
            self.assertFalse(s.do("start", scene="hand.json", device=bad)["ok"], bad)
        self.assertTrue(s.do("start", scene="hand.json", device="simulated", virtual_time=True)["ok"])
        connection = http.client.HTTPConnection("127.0.0.1", s.port, timeout=60)
        connection.request("GET", f"/api/events?from={start}", headers={"Authorization": "Bearer " + s.token})
        events = connection.getresponse()

        def next_of(kind):
            while True:
                event = json.loads(events.readline())
                if event["event"] == kind:
                    return event
        health = next_of("haptic")
        for name in ("time", "rate", "ticks", "missed", "missed_by_work", "p99", "energy", "state", "step_rate_aim"):
            self.assertIn(name, health)
        self.assertEqual((health["rate_aim"], health["step_rate_aim"]), (1000, 25))
        self.assertEqual(len(health["device"]), 3)
        answer = s.do("set", path="bodies.bed.youngs_modulus", value=2e5)
        self.assertTrue(answer["pending"])
        reported = next_of("set")
        self.assertTrue(reported["ok"], reported)
        s.do("set", path="bodies.bed.poisson_ratio", value=0.7)
        reported = next_of("set")
        self.assertFalse(reported["ok"])
        self.assertIn("0.7", reported["found"])
        self.assertFalse(s.do("step")["ok"])
        self.assertEqual(s.send("GET", "/api/frame?after=0")[1][:4], b"AMF1")
        begun = time.monotonic()
        s.do("stop")
        self.assertLess(time.monotonic() - begun, 5)
        self.assertEqual(s.wait("stopped")["device"], "simulated")
        connection.close()

    def test_run_pause_and_events(self):
        s = self.begin()
        s.start()
        start = s.get("/api/state")["events"]
        connection = http.client.HTTPConnection("127.0.0.1", s.port, timeout=30)
        connection.request("GET", f"/api/events?from={start}", headers={"Authorization": "Bearer " + s.token})
        events = connection.getresponse()
        self.assertTrue(s.do("run", speed=2)["ok"])  # 5 s of the scene in 2.5 s
        times = []
        begun = time.monotonic()
        while len(times) < 21:
            event = json.loads(events.readline())
            if event["event"] == "step":
                times.append(event["time"])
        self.assertGreater(time.monotonic() - begun, 0.4)
        self.assertEqual(times[:3], [0, 0.05, 0.1])
        paused = s.do("pause")
        self.assertTrue(paused["ok"])
        time.sleep(0.3)
        self.assertEqual(s.do("state")["time"], paused["time"])
        self.assertTrue(s.do("run")["ok"])
        while True:
            event = json.loads(events.readline())
            if event["event"] == "paused":
                break
        self.assertEqual(event["status"], "done")
        connection.close()
        served = s.do("state")["quantities"][FORCE]
        run = subprocess.run([program, "run", "scene.json", "-o", "out", "--json", "--quiet"], cwd=self.folder,
                             capture_output=True, text=True, check=True)
        self.assertEqual(json.loads(run.stdout)["quantities"][FORCE], served)  # bit by bit

    def test_frames_are_made_when_the_last_one_was_fetched(self):
        s = self.begin()
        s.start()
        s.do("step")

        def frame(after):
            status, data, _ = s.send("GET", f"/api/frame?after={after}")
            if status == 204:
                return None
            self.assertEqual((status, data[:4]), (200, b"AMF1"))
            size, = struct.unpack_from("<I", data, 4)
            head = json.loads(data[8:8 + size])
            for a in head["arrays"]:
                bytes_each = {"f32": 4, "i32": 4, "i16": 2}[a["type"]]
                self.assertLessEqual(8 + size + a["offset"] + bytes_each * a["shape"][0] * a["shape"][1], len(data))
            return head
        whole = frame(0)
        self.assertEqual((whole["before"], whole["step"]), (0, 0))
        self.assertIn("bed/triangles", [a["name"] for a in whole["arrays"]])
        begun = time.monotonic()
        self.assertIsNone(frame(whole["seq"]))  # nothing has changed
        self.assertGreater(time.monotonic() - begun, 1.5)
        s.do("step", count=30)
        moved = frame(whole["seq"])
        self.assertEqual((moved["before"], moved["step"]), (whole["seq"], 30))
        self.assertNotIn("bed/triangles", [a["name"] for a in moved["arrays"]])
        for bad in ("", "-1", "x", "1e3", "9" * 30):
            self.assertEqual(s.send("GET", "/api/frame?after=" + bad)[0], 400, bad)

    def test_a_killed_simulation_is_reported_within_a_second_and_resumed(self):
        s = self.begin()
        s.start()
        s.do("step", count=30)
        before = s.do("state")
        time.sleep(0.3)
        pid = s.get("/api/state")["engine"]["pid"]
        os.kill(pid, signal.SIGKILL)
        begun = time.monotonic()
        engine = s.wait("failed", seconds=1)
        self.assertLess(time.monotonic() - begun, 1)
        self.assertIn("signal 9", engine["reason"])
        self.assertEqual(engine["saved_time"], before["time"])
        self.assertFalse(s.do("step")["ok"])
        self.assertTrue(s.do("resume")["ok"])
        s.wait("paused")
        time.sleep(0.2)
        after = s.do("state")
        for name in ("time", "quantities"):
            self.assertEqual(after[name], before[name])
        whole = s.do("step", count=20)["quantities"][FORCE]
        s.start()
        self.assertEqual(s.do("step", count=50)["quantities"][FORCE], whole)

    def test_a_scene_that_is_wrong_is_reported_with_the_reason(self):
        wrong = json.loads(json.dumps(SCENE))
        wrong["bodies"]["bed"]["youngs_modulus"] = -1
        (self.folder / "wrong.json").write_text(json.dumps(wrong))
        s = self.begin()
        self.assertTrue(s.do("start", scene="wrong.json")["ok"])
        self.assertIn("exit code 2", s.wait("failed")["reason"])

    def test_it_ends_with_its_engine(self):
        s = self.begin()
        s.start()
        pid = s.get("/api/state")["engine"]["pid"]
        s.process.kill()  # the server has no time for anything
        s.process.wait()
        end = time.monotonic() + 5
        while time.monotonic() < end and pathlib.Path(f"/proc/{pid}/stat").exists() \
                and pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")")[1].split()[0] != "Z":
            time.sleep(0.05)
        self.assertLess(time.monotonic(), end)

    def test_it_ends_without_a_page(self):
        s = self.begin("--idle", "0.02")  # 1.2 s
        s.get("/api/state")
        begun = time.monotonic()
        s.process.wait(15)
        self.assertGreater(time.monotonic() - begun, 1)
        self.assertEqual(s.process.returncode, 0)

    def test_what_is_no_scene_is_refused(self):
        for name in ("none.json", "."):
            done = subprocess.run([program, "studio", name], cwd=self.folder, capture_output=True, text=True)
            self.assertEqual(done.returncode, 2, name)

    def test_memory_stays_small(self):
        s = self.begin()
        s.start()
        s.do("step", count=50)
        s.send("GET", "/api/frame?after=0")
        text = pathlib.Path(f"/proc/{s.process.pid}/status").read_text()
        self.assertLess(int(re.search(r"VmRSS:\s+(\d+)", text)[1]), 60 * 1024)


if __name__ == "__main__":
    program = str(pathlib.Path(sys.argv.pop(1)).resolve())
    reported_skips.main()
