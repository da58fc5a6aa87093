"""What gymnasium requires of an environment, for machines without its own check_env."""

import numpy as np


def check(condition, what):
    if not condition:
        raise AssertionError(what)


def same(a, b):
    return a.keys() == b.keys() and all(np.array_equal(a[k], b[k]) for k in a)


def check_observation(space, seen, where):
    check(isinstance(seen, dict) and list(seen) == list(space.spaces), f"{where}: other keys than the space")
    for key, part in space.spaces.items():
        x = seen[key]
        check(isinstance(x, np.ndarray), f"{where}: {key} is no array")
        check(x.dtype == part.dtype and x.shape == part.shape, f"{where}: {key} is {x.shape} of {x.dtype}, not {part}")
        check(np.all(x >= part.low) and np.all(x <= part.high), f"{where}: {key} is outside its space")
    check(space.contains(seen), f"{where}: not in the observation space")


def check_space(space):
    space.seed(3)
    first = space.sample()
    check(space.contains(first), "a sample is not in its space")
    space.seed(3)
    again = space.sample()
    check(same(first, again) if isinstance(first, dict) else np.array_equal(first, again), "a seed gives other samples")


def check_environment(env, steps=25):
    """Raises AssertionError with what an environment of one simulation does not hold. Observations are dicts."""
    check_space(env.action_space)
    check_space(env.observation_space)
    check(isinstance(env.metadata.get("render_modes"), list), "metadata has no list of render_modes")
    try:
        env.step(env.action_space.sample())
        check(False, "a step before the first reset passes")
    except RuntimeError:
        pass
    answer = env.reset(seed=5)
    check(isinstance(answer, tuple) and len(answer) == 2 and isinstance(answer[1], dict), "reset gives no (observation, info)")
    check_observation(env.observation_space, answer[0], "reset")
    check(same(answer[0], env.reset(seed=5)[0]), "reset of one seed sees two things")
    state = env.np_random.bit_generator.state
    env.reset(seed=5)
    check(state == env.np_random.bit_generator.state, "reset of one seed leaves two generators")
    env.reset()
    check(state != env.np_random.bit_generator.state, "reset without a seed begins the generator again")
    kept = env.reset(seed=5)[0]
    copies = {k: v.copy() for k, v in kept.items()}
    env.action_space.seed(7)
    over = False
    for _ in range(steps):
        if over:
            check_observation(env.observation_space, env.reset()[0], "a later reset")
        action = env.action_space.sample()
        before = action.copy()
        answer = env.step(action)
        check(isinstance(answer, tuple) and len(answer) == 5, "step gives no five things")
        seen, reward, terminated, truncated, info = answer
        check_observation(env.observation_space, seen, "step")
        check(isinstance(reward, float) and np.isfinite(reward), f"the reward is {reward!r}")
        check(isinstance(terminated, bool) and isinstance(truncated, bool) and isinstance(info, dict), "step's ends are no bool, info no dict")
        check(np.array_equal(action, before), "the action was written to")
        over = terminated or truncated
    check(same(kept, copies), "an observation has changed after it was given")
    if env.render_mode == "rgb_array":
        picture = env.render()
        check(picture.dtype == np.uint8 and picture.ndim == 3 and picture.shape[2] == 3, "render gives no picture")
    env.close()


def check_vector_environment(envs, steps=25):
    """The same of many."""
    n = envs.num_envs
    check("autoreset_mode" in envs.metadata, "metadata has no autoreset_mode")
    check(envs.action_space.shape == (n, *envs.single_action_space.shape), "the action space is not n of one")
    seen, info = envs.reset(seed=5)
    check_observation(envs.observation_space, seen, "reset")
    for _ in range(steps):
        seen, reward, terminated, truncated, info = envs.step(envs.action_space.sample())
        check_observation(envs.observation_space, seen, "step")
        for x, kind in ((reward, "f"), (terminated, "b"), (truncated, "b")):
            check(x.shape == (n,) and x.dtype.kind == kind, f"{x!r} is no ({n},) of {kind}")
        for key, value in info.items():
            check(value.shape == (n,), f"info {key} is not ({n},)")
            check(key.startswith("_") or info["_" + key].dtype == bool, f"info {key} has no mask")
    envs.close()
