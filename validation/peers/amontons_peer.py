"""A case of solids.py by amontons run: scene, run, and what it found."""
import glob
import json
import os
import resource
import subprocess

from fe_meshes import last_file, read_vtk
from solids import loads_of

AXES = "xyz"


def scene(problem):
    bodies = {}
    for name, b in problem["bodies"].items():
        bodies[name] = {
            "kind": "solid", "mesh": b["mesh"].msh, "youngs_modulus": b["youngs_modulus"],
            "poisson_ratio": b["poisson_ratio"], "hold": [{"set": s, AXES[k]: 0} for s, k in b["hold"]],
            "loads": [{"set": s, "traction": t} for s, t in loads_of(b)]}
    contact = []
    if problem["contact"]:
        slave, master = problem["contact"]["slave"], problem["contact"]["master"]
        if master is None:
            bodies["plane"] = {"kind": "obstacle", "surface": {"generate": "plane"}}
            master = ("plane", "")
        contact = [{"between": [slave[0], master[0]], "surfaces": [slave[1], master[1]],
                    "friction": problem["contact"]["friction"], "sliding": "small"}]
    return {"schema": 1, "title": "side by side", "bodies": bodies, "contact": contact,
            "time": {"step": 1, "end": 1},
            "output": {"picture": False, "plots": False, "every": 1000}}


def solve(program, problem, folder):
    path = os.path.join(folder, "scene.json")
    json.dump(scene(problem), open(path, "w"))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, "run", path, "--quiet", "--json", "--threads", "1", "--output",
                           folder + "/result"], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise RuntimeError((done.stderr.strip().splitlines() or ["no word"])[-1][:200])
    if json.loads(done.stdout)["certificate"]["uncertified_steps"] != 0:
        raise RuntimeError("a step without certificate")
    answer = {"u": {}, "p": [], "seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime}
    for pvd in glob.glob(folder + "/result/*.pvd"):
        if pvd.endswith("contacts.pvd"):
            contacts = read_vtk(last_file(pvd)[0])
            answer["p"] = list(zip(contacts["points"], contacts["pressure"], contacts["area"]))
            continue
        for path in last_file(pvd):
            body = read_vtk(path) if path.endswith(".vtu") else {}
            for name in problem["bodies"]:
                if "displacement" in body and os.path.basename(path).startswith(name):
                    answer["u"][name] = [([a - b for a, b in zip(x, u)], u)
                                         for x, u in zip(body["points"], body["displacement"])]
    return answer
