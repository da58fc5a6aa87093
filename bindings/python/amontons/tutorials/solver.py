# %% [markdown]
# # A contact solver of one's own
#
# u = W r + q, and between u and r the laws of Signorini and Coulomb. We write projected Gauss-Seidel, hold it against
# amontons on a problem of a step, use it inside the steps of a scene, and compare error and time.

# %% One contact's block at a time, with De Saxce's shift and the projection on Coulomb's cone.
import amontons as am
import numpy as np


def project(r, mu):
    """The nearest point of the cone |r_t| <= mu r_n."""
    t = np.hypot(r[1], r[2])
    if t <= mu * r[0]:
        return r
    if mu * t <= -r[0]:
        return np.zeros(3)
    n = (r[0] + mu * t) / (1 + mu * mu)
    return np.array([n, mu * n * r[1] / t, mu * n * r[2] / t])


def gauss_seidel(W, q, mu, kinds=None, tolerance=1e-13):
    r = np.zeros(len(q))
    for _ in range(5000):
        before = r.copy()
        for k in range(len(mu)):
            at = slice(3 * k, 3 * k + 3)
            u = W[at] @ r + q[at]
            u[0] += mu[k] * np.hypot(u[1], u[2])
            r[at] = project(r[at] - u / np.linalg.norm(W[at, at], 2), mu[k])
        if np.linalg.norm(r - before) <= tolerance * np.linalg.norm(r):
            break
    return r


# %% A box on a slope: the contact problems of its first steps.
scene = am.Scene({
    "schema": 1, "gravity": [4, 0, -9.81], "bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "box": {"kind": "rigid", "mass": 2, "shape": {"generate": "box", "size": [0.2, 0.2, 0.1]},
                "start": {"place": [0, 0, 0.05]}}},
    "contact": [{"between": ["box", "floor"], "friction": 0.3}],
    "time": {"kind": "dynamic", "step": 0.01, "end": 0.1}})
sim = am.Simulation(scene)
sim.step(3)
problem, = sim.contact_problems()
print(problem)

# %% Both are judged by the same measure, from (W, q, mu, r) alone.
ours = am.solve(problem, tolerance=1e-12)
W = problem.W if isinstance(problem.W, np.ndarray) else problem.W.toarray()
mine = am.certify(problem, r=gauss_seidel(W, problem.q, problem.mu))
print(f"amontons {ours.error:.1e} in {1e3 * ours.seconds:.2f} ms, Gauss-Seidel {mine.error:.1e}")
assert ours and mine.error < 1e-8

# %% Inside the steps: a scene names it. Each answer is certified; one that misses its tolerance refuses the step.
am.register_solver("gauss_seidel", gauss_seidel)
summary = am.Simulation(scene, set={"contact_solver.function": "gauss_seidel"}).run()
print(summary.quantities["box_velocity_x"], "m/s after 0.1 s; a sliding point mass:", 0.1 * (4 - 0.3 * 9.81))

# %% Error against time, beside ours: amontons.study runs functions of this process, too.
study = am.study(scene, sweep={"contact_solver.function": ["", "gauss_seidel"], "time.step": [0.02, 0.01]},
                 quantity="box_velocity_x", reference=0.1 * (4 - 0.3 * 9.81), output="out/solvers")
for row in study.rows:
    print(row["contact_solver.function"] or "amontons", row["time.step"], f"error {row['error']:.1e}, {row['seconds']:.3f} s")
    assert row["status"] == "done" and row["error"] < 1e-6
