"""Search from one state: which twist reaches the carotid?"""
import amontons as am

sim = am.Simulation("examples/catheter/scene.json", set={"time.end": 1000})
sim.advance(7.5)
state = sim.save()
for twist in (0.0, 1.5708, 3.1416, 4.7124):
    trial = sim.fork()                       # the same walls, its own future
    trial.inputs["wire.twist"] = twist
    trial.advance(9.5)
    trial.inputs["wire.insertion"] = 0.300
    trial.advance(17)
    print(f"{twist:.2f} rad: {trial.branch or 'none':16s} depth {1e3 * trial.record.quantities['depth']:.0f} mm")
assert sim.save() == state                   # trials leave no trace
