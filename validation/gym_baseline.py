#!/usr/bin/env python3
"""A baseline agent on numpy alone: the cross-entropy method on a linear policy, with its learning curve.

    PYTHONPATH=build/release/lib/python3/site-packages python3 validation/gym_baseline.py [--rounds 10] [--svg FILE]

The agent sees tracking, target, rotation and its last action, and gives tanh of a linear map of them. In each round
POPULATION maps are drawn about a mean, each plays one episode, and the mean and deviation move to the best of them.
Beside the returns it reports the largest certified force on the wall. Source: Mannor, Rubinstein, Gat 2003.
"""

import argparse
import sys
import time

import numpy as np

import amontons.gym as gym

POPULATION, BEST = 48, 8
STEPS = 120  # of an episode


def features(seen):
    """(n, k) of what the policies see, and a constant."""
    flat = [seen[key].reshape(len(seen[key]), -1) for key in ("tracking", "target", "rotation", "last_action")]
    return np.concatenate([*flat, np.ones((len(flat[0]), 1))], axis=1)


def play(envs, policies, seed):
    """Returns, whether the target was reached, and the largest force on the wall, of an episode of each policy."""
    seen, info = envs.reset(seed=[seed] * envs.num_envs)
    returns, alive = np.zeros(envs.num_envs), np.ones(envs.num_envs, bool)
    reached, force, error = np.zeros(envs.num_envs, bool), np.zeros(envs.num_envs), 0.0
    for _ in range(STEPS):
        x = features(seen)
        action = np.tanh(np.einsum("nk,nka->na", x, policies)).reshape(envs.action_space.shape)
        action[~alive] = 0
        seen, reward, terminated, truncated, info = envs.step(action)
        returns += np.where(alive, reward, 0)
        force = np.where(alive, np.maximum(force, info["max_wall_force"]), force)
        error = max(error, info["certificate_error"][alive].max(initial=0))
        reached |= alive & terminated
        alive &= ~(terminated | truncated)
        if not alive.any():
            break
    return returns, reached, force, error


def main():
    parser = argparse.ArgumentParser(description="A baseline agent of amontons.gym.")
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--target", default="left_subclavian")
    parser.add_argument("--force-penalty", type=float, default=0.02)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--svg", help="writes the learning curve")
    o = parser.parse_args()
    rng = np.random.default_rng(o.seed)
    envs = gym.NavigationVectorEnv(POPULATION, target=o.target, start_depth=0.12, max_steps=STEPS + 1, force_penalty=o.force_penalty)
    envs.reset(seed=0)
    k = features(envs.reset(seed=0)[0]).shape[1]
    mean, deviation, rows = np.zeros((k, 2)), np.ones((k, 2)), []
    for round in range(o.rounds):
        began = time.process_time()
        policies = mean + deviation * rng.normal(size=(POPULATION, k, 2))
        policies[0] = mean
        returns, reached, force, error = play(envs, policies, round)
        best = np.argsort(-returns)[:BEST]
        mean, deviation = policies[best].mean(axis=0), policies[best].std(axis=0) + 0.1 * 0.8**round
        rows.append((returns.mean(), returns.max(), reached.mean(), force.mean(), force[best].mean()))
        print(f"round {round:2d}: return {returns.mean():+.2f}, best {returns.max():+.2f}, {reached.mean():4.0%} at the target, "
              f"largest force on the wall {force.mean():.3f} N, of the best {force[best].mean():.3f} N, error {error:.0e}, "
              f"{time.process_time() - began:.1f} s", flush=True)
    if o.svg:
        with open(o.svg, "w", encoding="utf-8") as stream:
            stream.write(curve(np.array(rows)))


def curve(rows):
    """Two plots, one above the other, as SVG."""
    parts = ['<svg xmlns="http://www.w3.org/2000/svg" width="640" height="440" font-family="sans-serif" font-size="13">',
             '<rect width="640" height="440" fill="white"/>']
    plots = (("return", 20, ((rows[:, 1], "#0b5394", "best"), (rows[:, 0], "#999999", "mean"))),
             ("largest force on the wall [N]", 230, ((rows[:, 4], "#b45f06", "of the best"), (rows[:, 3], "#999999", "mean"))))
    for title, top, lines in plots:
        low, high = min(0, *(y.min() for y, _, _ in lines)), max(y.max() for y, _, _ in lines) * 1.05
        place = lambda y: top + 20 + 140 * (high - y) / (high - low)
        parts.append(f'<text x="70" y="{top + 12}">{title}</text><path d="M70 {top + 20}V{top + 160}H610" fill="none" stroke="black"/>')
        for y in np.linspace(low, high, 5):
            parts.append(f'<text x="64" y="{place(y) + 4:.1f}" text-anchor="end">{y:.2g}</text>')
        for number, (y, colour, name) in enumerate(lines):
            x = 70 + 540 * np.arange(len(y)) / max(1, len(y) - 1)
            parts.append(f'<polyline fill="none" stroke="{colour}" stroke-width="2" points="' +
                         " ".join(f"{a:.1f},{place(b):.1f}" for a, b in zip(x, y)) + '"/>')
            parts.append(f'<text x="{430 + 90 * number}" y="{top + 12}" fill="{colour}">{name}</text>')
    parts.append(f'<text x="340" y="420" text-anchor="middle">round of {POPULATION} episodes (1 to {len(rows)})</text></svg>\n')
    return "\n".join(parts)


if __name__ == "__main__":
    sys.exit(main())
