#!/usr/bin/env python3
"""Random steps of the environments of amontons.gym: none may crash, see or earn what is not finite, leave the vessel,
or end without a certificate and not report it.

    PYTHONPATH=build/release/lib/python3/site-packages python3 validation/gym_stress.py [steps [seed]]

Exit code 1, with what was found, where one does. Bias of the push and depth at the start change from round to round, so
that some walk near the arch and some push until they jam.
"""

import sys
import time

import numpy as np

import amontons.gym as gym

# (task, options, share of the steps)
ROUNDS = (("catheter_navigation", {"target": "random", "start_depth": 0.12}, 0.35),
          ("catheter_navigation", {"target": "left_carotid", "observation": "image", "image_size": 32, "start_depth": 0.18}, 0.15),
          ("basic_wire_nav", {"start_depth": 0.12}, 0.15),
          ("arch_variety", {"start_depth": 0.1, "arch_types": gym.arches.TYPES}, 0.25),
          ("dual_device_nav", {"start_depth": 0.05}, 0.10))
OUTSIDE = 3e-3  # m beyond the wall: what the rounded edges between vessels leave of the plain tubes that it is searched for in


BEYOND = 8e-3  # m through a branch's open end, where the wall continues straight: a control step of push, and no farther


def tubes(lines):
    """Points and radii of the plain tubes, those of branches longer by BEYOND."""
    points, radii = [lines.points[::3]], [lines.radius[::3]]
    for line in range(1, len(lines.names)):
        mine = lines.line == line
        end, before = lines.points[mine][-1], lines.points[mine][-2]
        ahead = np.linspace(0, BEYOND, 5)
        points.append(end + ahead[:, None] * (end - before) / np.linalg.norm(end - before))
        radii.append(np.full(5, lines.radius[mine][-1]))
    return np.concatenate(points), np.concatenate(radii)


def outside(member, known={}):
    """How far beyond the wall of plain tubes the worst point of an instrument is [m]."""
    if known.get("of") is not member.anatomy:
        known.update(of=member.anatomy, tubes=tubes(member.anatomy.lines))
    points, radii = known["tubes"]
    worst = -np.inf
    for beam in member.simulation.record.beams.values():
        off = np.linalg.norm(beam.points[:, None] - points, axis=2) - radii
        worst = max(worst, float(off.min(axis=1).max()))
    return worst


def main():
    steps, seed = (int(a) for a in (sys.argv[1:] + ["100000", "0"][len(sys.argv) - 1:])[:2])
    wrong, all = [], 0
    for number, (task, options, share) in enumerate(ROUNDS):
        rng = np.random.default_rng([seed, number])
        env = gym.NavigationEnv(task, **options)
        began, count, episodes, failed, ends, worst, far, depth = time.process_time(), 0, 0, 0, 0, 0.0, -np.inf, 0.0
        over = True
        while count < share * steps:
            if over:
                env.reset(seed=int(rng.integers(2**31)))
                episodes += 1
                least = rng.choice([-1.0, -0.6, -0.3])
            action = rng.uniform(-1, 1, env.action_space.shape)
            action[:, 0] = rng.uniform(least, 1, len(action))
            seen, reward, terminated, truncated, info = env.step(action)
            count += 1
            over = terminated or truncated
            ends += terminated
            failed += info["failed"]
            depth += info["depth"]
            off = outside(env._member)
            worst, far = max(worst, info["certificate_error"]), max(far, off)
            where = f"{task}, step {count}: "
            if not all_finite(seen, reward, info):
                wrong.append(where + "not finite")
            if not env.observation_space.contains(seen):
                wrong.append(where + "outside the observation space")
            if not info["certified"] and not info["failed"]:
                wrong.append(where + f"no certificate: {info['certificate_error']:.2e}")
            if off > OUTSIDE:
                wrong.append(where + f"{1e3 * off:.2f} mm outside the vessel")
            if count % 5000 == 0:
                print(f"... {task}: {count} steps, {len(wrong)} wrong", flush=True)
            if info["failed"] != (info["failure"] != ""):
                wrong.append(where + "a failure without a reason")
        spent = time.process_time() - began
        all += count
        print(f"{task:20s} {count} steps of {episodes} episodes, {ends} at the target, mean depth {1e3 * depth / count:.0f} mm, {failed} failed and reported, "
              f"largest error {worst:.2e}, {1e3 * far:+.2f} mm beyond the plain tubes at most, {count / spent:.0f} a second of processor time", flush=True)
    print(f"{all} steps, {len(wrong)} wrong")
    print("\n".join(wrong[:20]))
    return 1 if wrong else 0


def all_finite(seen, reward, info):
    numbers = [reward] + [v for v in info.values() if isinstance(v, float)]
    return np.isfinite(numbers).all() and all(np.isfinite(v).all() for v in seen.values())


if __name__ == "__main__":
    sys.exit(main())
