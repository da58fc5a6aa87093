#!/usr/bin/env python3
"""What a new anatomy costs the environments of amontons.gym: its reset, and what the first episode in it costs above a second one.

    PYTHONPATH=build/release/lib/python3/site-packages python3 bindings/python/bench/arches.py [arches [start_depth [types]]]

The arches are of types I to VII in turn, drawn with the factors of the task (widths and heights 0.7 to 1.3, diameters 0.85).
An episode has at most 200 steps, pushes from -0.3 to 1 of the greatest, turns of any size. The second episode takes the same
actions to the same target; its cost is subtracted. Processor time.
"""

import sys
import time

import numpy as np

import amontons.gym as gym

ARCHES = int(sys.argv[1]) if len(sys.argv) > 1 else 100
START = float(sys.argv[2]) if len(sys.argv) > 2 else 0.0
TYPES = sys.argv[3].split(",") if len(sys.argv) > 3 else gym.arches.TYPES


def episode(env, seed):
    """Processor time of each step [s]."""
    rng, spent = np.random.default_rng(seed), []
    while True:
        action = rng.uniform(-1, 1, env.action_space.shape)
        action[:, 0] = rng.uniform(-0.3, 1, len(action))
        began = time.process_time()
        *_, terminated, truncated, _ = env.step(action)
        spent.append(time.process_time() - began)
        if terminated or truncated:
            return np.array(spent)


def main():
    envs = {kind: gym.NavigationEnv("arch_variety", arch_types=(kind,), start_depth=START, episodes_between_arch_change=2) for kind in TYPES}
    found = {kind: [] for kind in TYPES}
    for seed in range(ARCHES):
        kind = TYPES[seed % len(TYPES)]
        env = envs[kind]
        began = time.process_time()
        env.reset(seed=seed)
        reset = time.process_time() - began
        target = env._member.line, env._member.goal_along, env._member.goal
        first = episode(env, seed)
        env.reset()
        env._member.line, env._member.goal_along, env._member.goal = target
        second = episode(env, seed)
        count = min(len(first), len(second))
        more = first[:count] - second[:count]
        found[kind].append((reset, more.sum(), reset + more.sum(), more.max()))
    print(f"{'':12s}arches  ms in the median, of nine in ten and at most: reset | first episode above the second | both | a single step above the second")
    for name, rows in [(kind, found[kind]) for kind in TYPES if found[kind]] + [("all", [row for kind in TYPES for row in found[kind]])]:
        columns = (" ".join(f"{1e3 * x:6.1f}" for x in np.percentile(values, [50, 90, 100])) for values in zip(*rows))
        print(f"{name:12s}{len(rows):6d}  " + " | ".join(columns), flush=True)


if __name__ == "__main__":
    main()
