# %% [markdown]
# # In the hand
#
# A scene with a "haptic" is felt at 1 kHz while it is simulated at 25 to 100 Hz. The loop runs on threads of C++; Python
# starts it, observes it, and reads the trace. In virtual time every run has the same ticks.

# %% A ball that a simulated hand presses on a floor: two springs in a row, the hand's and the coupling's.
import time

import amontons as am
import amontons.haptic
import numpy as np

scene = am.Scene({
    "schema": 1, "bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.01}, "start": {"place": [0, 0, 0.011]},
                 "drive": {"z": [[0, 0], [0.4, -0.005]]}}},
    "contact": [{"between": ["ball", "floor"], "friction": 0.3}],
    "haptic": {"handle": "ball", "device": "omega.3", "hand": {"stiffness": 1000, "damping": 20}},
    "time": {"step": 0.02, "end": 0.6}})
with am.haptic.Session(scene, virtual_time=True) as session:
    session.start()
    session.wait()
summary, trace = session.summary(), session.trace()
print(summary["ticks"], "ticks,", summary["contacts"]["max"], "contact, fault:", summary["fault"] or "none")

# %% The hand moves to 4 mm below the floor, against half of 1000 N/m.
force = trace["sent_z"]
print(f"{force[-1]:.2f} N")
assert abs(force[-1] - 0.004 * 500) < 0.1
assert np.abs(np.diff(force)).max() < 0.1  # no tick jumps
assert summary["energy_injected"] == 0  # it gives the hand no energy

# %% In real time: examine it while it lasts, change the floor's friction, stop.
session = am.haptic.Session(scene, duration=30)
session.start()
while (now := session.latest()) is None or now.steps < 3:
    time.sleep(0.01)
session.set("contact.0.friction", 0.5)
print(now, "place", now.place, "force", now.force)
session.stop()
print(session.summary()["status"], *session.messages, sep="\n  ")
