"""One scene, sixteen coefficients of friction, all cores; then error against run time."""
import amontons as am
import numpy as np

mus = np.linspace(0, 0.3, 16)
batch = am.Batch("examples/double-u/scene.json", 16, set=[{"contact.0.friction": m} for m in mus])
peak = np.zeros(16)
for _ in range(150):
    state = batch.advance(0.1)
    assert (state != 2).all(), batch.messages
    peak = np.maximum(peak, batch.quantity("push_force"))
for m, f in zip(mus, peak):
    print(f"mu {m:.2f}  {f:.3f} N")
study = am.study("examples/double-u/scene.json", sweep={"time.step": [0.04, 0.02, 0.01]},
                 quantity="max_push_force", reference="finest", output="out/steps")
print(study.order, [(r["time.step"], r["error"], r["seconds"]) for r in study.rows])
