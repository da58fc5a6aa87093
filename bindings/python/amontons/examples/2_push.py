"""Lead the wire by hand, step by step."""
import amontons as am
import numpy as np

sim = am.Simulation("examples/catheter/scene.json", set={"time.end": 60})
rows, worst = [], 0.0
while sim.time < 10:
    sim.inputs["wire.insertion"] = 0.02 * (sim.time + 0.02)
    sim.inputs["wire.twist"] = 0.5 * np.sin(sim.time)
    record = sim.step()
    c = record.contacts
    worst = max(worst, c.clustered_force.max(initial=0.0))
    sliding = c.force[(c.status == 2) & c.of("wire", "aorta")]
    rows.append([record.time, record.quantities["depth"], record.quantities["push_force"], len(sliding)])
    assert record.certificate.error <= record.certificate.tolerance
np.savetxt("push.csv", rows, delimiter=",", header="time [s],depth [m],push_force [N],sliding")
print(f"the wall bears {worst:.3f} N at most; branch {sim.branch or 'none'}")
