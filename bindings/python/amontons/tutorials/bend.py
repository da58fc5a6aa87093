# %% [markdown]
# # A wire in a bend
#
# How hard must one push? Without friction the work of the hand becomes bending energy: of each further piece of wire
# that enters a bend, EI / (2 r^2) a metre, r the radius that the wire's middle line takes along the outer wall. So the
# push is EI / (2 r^2) [N], whatever the mesh and the steps are. We make the scene, step it, and examine the result.

# %% A tube of 2 mm that turns by 180 degrees with a radius of 50 mm, and a wire of 0.9 mm.
import amontons as am
import numpy as np

R, tube_radius, wire_radius, EI = 0.05, 0.001, 4.5e-4, 5.2e-4  # [m], [m], [m], [N m^2]
scene = am.Scene({
    "schema": 1,
    "bodies": {
        "tube": {"kind": "obstacle", "surface": {"generate": "tube", "radius": tube_radius, "centreline": {
            "pieces": [{"length": 0.02}, {"radius": R, "angle": 3.1415926}, {"length": 0.02}]}}},
        "wire": {"kind": "beam", "drive": {"insertion": [[0, 0], [10, 0.16]]},
                 "segments": [{"length": 0.2, "radius": wire_radius, "EI": EI, "element": 2.5e-3}]}},
    "contact": [{"between": ["wire", "tube"], "friction": 0}],
    "time": {"step": 0.05, "end": 10}})
print(scene.check()["predicted"])

# %% Step by step: what a step reported stays as it was, so the records can be kept.
records = []
with am.Simulation(scene) as sim:
    while not sim.done:
        records.append(sim.step())
push = np.array([r.quantities["push_force"] for r in records])
depth = np.array([r.quantities["depth"] for r in records])
print(len(records), "steps, the worst certificate", max(r.certificate.error for r in records))

# %% Deep in the bend, where the wire has come to lie along the outer wall, it pushes as the formula states.
deep = (depth > 0.14) & (depth < 0.157)
expected = EI / (2 * (R + tube_radius - wire_radius) ** 2)
print(f"push {push[deep].mean():.4f} N, EI / (2 r^2) = {expected:.4f} N")
assert abs(push[deep].mean() / expected - 1) < 0.01

# %% Where does it touch? On the outer wall: normals point to the wire, which is inside.
last = records[-1].contacts
print(len(last), "contacts,", last.normal_force.sum(), "N in all")
assert (last.normal_force >= 0).all() and (last.gap > -1e-6).all()

# %% With friction, on all cores: the same scene for six coefficients.
mus = np.linspace(0, 0.25, 6)
batch = am.Batch(scene, len(mus), set=[{"contact.0.friction": float(m)} for m in mus])
assert (batch.advance(9) != 2).all(), batch.messages
needed = batch.quantity("push_force")
for mu, force in zip(mus, needed):
    print(f"mu = {mu:.2f}: {force:.3f} N")
assert (np.diff(needed) > 0).all()  # friction requires more
