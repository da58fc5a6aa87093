"""Make a scene, run it, read the answer."""
import amontons as am

tube = {"kind": "obstacle", "surface": {"generate": "tube", "radius": 0.004, "centreline": {
    "pieces": [{"length": 0.06}, {"radius": 0.03, "angle": 1.57}, {"length": 0.06}]}}}
wire = {"kind": "beam", "drive": {"insertion": [[0, 0], [8, 0.16]]},
        "segments": [{"length": 0.25, "radius": 4.445e-4, "EI": 5.2e-4, "element": 2.5e-3}]}
scene = am.Scene({"schema": 1, "bodies": {"tube": tube, "wire": wire},
                  "contact": [{"between": ["wire", "tube"], "friction": 0.1}],
                  "time": {"step": 0.02, "end": 8}})
print(scene.check()["predicted"])
summary = am.Simulation(scene).run("out/bend")
print(summary.status, summary.quantities["max_push_force"], "N")
history = am.read_run("out/bend").history
peak = history["push_force"].argmax()
print(history["depth"][peak], history.units["depth"], history["certificate_error"].max())
