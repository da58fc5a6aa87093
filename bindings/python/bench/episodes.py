#!/usr/bin/env python3
"""Steps a second and core of amontons.gym over random episodes with reset by restore. Processor time.

    PYTHONPATH=build/release/lib/python3/site-packages python3 bindings/python/bench/episodes.py [episodes [start_depth [observation]]]

The arch and wire of examples/catheter, target random, actions uniform over the whole action space.
"""

import sys
import time

import numpy as np

import amontons.gym as gym

EPISODES = int(sys.argv[1]) if len(sys.argv) > 1 else 200
START = float(sys.argv[2]) if len(sys.argv) > 2 else 0.12
OBSERVATION = sys.argv[3] if len(sys.argv) > 3 else "tracking"


def main():
    env = gym.NavigationEnv(target="random", start_depth=START, observation=OBSERVATION)
    rng = np.random.default_rng(0)
    env.reset(seed=0)
    spent, resets, depths, errors = [], [], [], []
    failed = reached = uncertified = 0
    for _ in range(EPISODES):
        began = time.process_time()
        env.reset()
        resets.append(time.process_time() - began)
        over = False
        while not over:
            action = rng.uniform(-1, 1, env.action_space.shape)
            began = time.process_time()
            _, _, terminated, truncated, info = env.step(action)
            spent.append(time.process_time() - began)
            over = terminated or truncated
            failed += info["failed"]
            reached += terminated
            uncertified += not info["certified"]
            depths.append(info["depth"])
            errors.append(info["certificate_error"])
    print(f"{EPISODES} episodes, {len(spent)} steps, {len(spent) / sum(spent):.0f} a second; mean depth {1e3 * np.mean(depths):.0f} mm; "
          f"{reached} targets reached; {failed} steps failed and reported, {uncertified} without a certificate, largest error {max(errors):.1e}; "
          f"step {1e3 * np.median(spent):.2f} ms in the median, {1e3 * max(spent):.0f} at most; reset {1e3 * np.median(resets):.2f}")


if __name__ == "__main__":
    main()
