"""A case of solids.py by GetFEM, in a process of its own: getfem_peer.py PROBLEM ANSWER (JSON).

Quadratic displacements, linear multipliers on the slave side, the augmented Lagrangian bricks that
integrate over the side. The time is the processor time after the imports, reading the meshes included.
Solved in units of the cells that touch and of the first body's modulus: its criterion adds forces and
the multipliers' equations as they are, and in SI the latter would never count.
"""
import json
import os
import resource
import subprocess
import sys

from common import PYTHON, debian_version

LONGEST = 60 # processor seconds


def version():
    return debian_version("GetFEM", "python3-getfem", "getfem")


def solve(problem, folder, factor):
    """@param factor  the augmentation is this times E / (edge of a cell)"""
    plain = dict(problem, factor=factor, bodies={
        name: {k: v.msh if k == "mesh" else v for k, v in b.items()} for name, b in problem["bodies"].items()})
    question, answer = (os.path.join(folder, f) for f in ("problem.json", "answer.json"))
    json.dump(plain, open(question, "w"))
    limit = lambda: resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))
    done = subprocess.run([PYTHON, __file__, question, answer], capture_output=True, text=True,
                          preexec_fn=limit)
    if done.returncode < 0:
        raise RuntimeError(f"stopped by signal {-done.returncode}, limit {LONGEST} s")
    if done.returncode != 0:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        raise RuntimeError((lines or ["no word"])[-1][:200])
    return json.load(open(answer))


def regions_of(path):
    """Numbers of the named sets in a .msh file of version 2.2."""
    names, lines = {}, iter(open(path))
    for line in lines:
        if line.startswith("$PhysicalNames"):
            for _ in range(int(next(lines))):
                dim, number, name = next(lines).split()
                if dim == "2":
                    names[name.strip('"')] = int(number)
            break
    return names


def main(question, answer):
    import time

    import getfem
    import numpy

    start = time.process_time()
    problem = json.load(open(question))
    model = getfem.Model("real")
    fields, meshes, regions = {}, {}, {}
    size_of_cell = problem["size"]
    modulus = next(iter(problem["bodies"].values()))["youngs_modulus"]
    for i, (name, b) in enumerate(problem["bodies"].items()):
        mesh = meshes[name] = getfem.Mesh("import", "gmsh", b["mesh"])
        mesh.transform(numpy.eye(3) / size_of_cell)
        regions[name] = regions_of(b["mesh"])
        field = fields[name] = getfem.MeshFem(mesh, 3)
        field.set_classical_fem(2)
        integral = getfem.MeshIm(mesh, 4)
        u = f"u{i}"
        model.add_fem_variable(u, field)
        E, nu = b["youngs_modulus"] / modulus, b["poisson_ratio"]
        model.add_initialized_data(f"lambda{i}", E * nu / (1 + nu) / (1 - 2 * nu))
        model.add_initialized_data(f"mu{i}", E / 2 / (1 + nu))
        model.add_isotropic_linearized_elasticity_brick(integral, u, f"lambda{i}", f"mu{i}")
        held = {}
        for set_name, axis in b["hold"]:
            held.setdefault(set_name, []).append(axis)
        for k, (set_name, axes) in enumerate(held.items()):
            if len(axes) == 3:
                model.add_Dirichlet_condition_with_simplification(u, regions[name][set_name])
            else: # the side's normal is that axis
                model.add_normal_Dirichlet_condition_with_multipliers(integral, u, 2, regions[name][set_name])
        for k, load in enumerate(n for n in ("load", "load2") if n in b):
            model.add_initialized_data(f"F{i}_{k}", [t / modulus for t in b[load][1]])
            model.add_source_term_brick(integral, u, f"F{i}_{k}", regions[name][b[load][0]])
    touching = None
    if problem["contact"]:
        contact = problem["contact"]
        slave, side = contact["slave"]
        names = list(problem["bodies"])
        u, mesh, region = f"u{names.index(slave)}", meshes[slave], regions[slave][side]
        size = 3 if contact["friction"] else 1
        whole = getfem.MeshFem(mesh, size)
        whole.set_classical_fem(1)
        kept = whole.basic_dof_on_region(region)
        touching = getfem.MeshFem("partial", whole, kept)
        model.add_fem_variable("stress", touching)
        model.add_initialized_data("r", problem["factor"])
        integral = getfem.MeshIm(mesh, 6)
        more = []
        if contact["friction"]:
            model.add_initialized_data("friction", contact["friction"])
            more = ["friction"]
        if contact["master"] is None:
            height = getfem.MeshFem(mesh, 1)
            height.set_classical_fem(1)
            model.add_initialized_fem_data("height", height, height.eval("z"))
            model.add_integral_contact_with_rigid_obstacle_brick(integral, u, "stress", "height", "r", *more,
                                                                 region, 1)
        else:
            master, other = contact["master"]
            model.add_integral_contact_between_nonmatching_meshes_brick(
                integral, u, f"u{names.index(master)}", "stress", "r", *more, region,
                regions[master][other], 1)
    iterations, converged = model.solve("max_res", 1e-10, "max_iter", 60, "lsearch", "simplest",
                                        "alpha min", 0.8)
    if not converged:
        sys.exit(f"no convergence in {iterations} iterations")
    found = {"u": {}, "p": []}
    for i, (name, field) in enumerate(fields.items()):
        values = size_of_cell * model.variable(f"u{i}").reshape(-1, 3)
        places = size_of_cell * field.basic_dof_nodes().T[::3]
        found["u"][name] = [(x.tolist(), v.tolist()) for x, v in zip(places, values)]
    if touching is not None:
        size = 3 if problem["contact"]["friction"] else 1
        places = size_of_cell * whole.basic_dof_nodes(kept).T[::size]
        values = modulus * model.variable("stress").reshape(-1, size)
        # the normal points out of the body: downwards
        pressure = values[:, 2] if size == 3 else -values[:, 0]
        found["p"] = [(x.tolist(), float(p)) for x, p in zip(places, pressure)]
    found["seconds"] = time.process_time() - start
    found["iterations"] = int(iterations)
    json.dump(found, open(answer, "w"))


if __name__ == "__main__":
    main(*sys.argv[1:])
