"""Environments of catheters: spaces, rewards, the same bits for a seed, failures that are reported."""

import doctest
import os
import subprocess
import sys
import time
import unittest.mock

import numpy as np

import amontons as am
import amontons.gym as gym
from amontons.gym import _member, _spaces, arches, environment, tasks
from gym_checker import check_environment, check_vector_environment
from scenes import Case, main

ALL = ("image", "tracking", "target", "rotation", "last_action")
R, DOWN, AT = 0.038, 0.120, {"brachiocephalic": 0.036, "left_carotid": 0.052, "left_subclavian": 0.068}


def bits(seen, reward, info):
    return [{k: v.tobytes() for k, v in seen.items()}, float(reward), {k: v for k, v in info.items()}]


def part(all, i):
    return {k: v[i] for k, v in all.items()}


def walk(env, seed, steps):
    """Bits of a random walk."""
    seen, info = env.reset(seed=seed)
    actions = np.random.default_rng(seed).uniform(-0.3, 1, (steps, *env.action_space.shape)).astype(np.float32)
    all = [bits(seen, 0, info)]
    for action in actions:
        seen, reward, *_, info = env.step(action)
        all.append(bits(seen, reward, info))
    return all


def mean_scene(self, surface, scene=_member.Options.scene):
    """What is refused once fails: no step may be shorter."""
    return scene(self, surface).changed({"time.balance": "mean", "time.smallest_step": tasks.CONTROL_STEP})


class GymTest(Case):
    def test_environments_satisfy_what_gymnasium_requires(self):
        check_environment(gym.NavigationEnv(observation=ALL, image_size=32, max_steps=10, start_depth=0.1, render_mode="rgb_array"))
        for task in ("basic_wire_nav", "arch_variety", "dual_device_nav"):
            check_environment(gym.NavigationEnv(task, max_steps=5), steps=12)
        for autoreset in ("next_step", "disabled"):
            steps = 15 if autoreset == "next_step" else 6
            check_vector_environment(gym.NavigationVectorEnv(3, observation=ALL, image_size=16, max_steps=6, autoreset=autoreset), steps)

    def test_the_checker_finds_what_is_wrong(self):
        class Wrong(gym.NavigationEnv):
            def step(self, action):
                seen, reward, *rest = super().step(action)
                seen["tracking"] = seen["tracking"] + 3
                return seen, reward, *rest

        class Forgetful(gym.NavigationEnv):
            def reset(self, *, seed=None, options=None):
                return super().reset(seed=None)

        for wrong in (Wrong, Forgetful):
            with self.assertRaises(AssertionError):
                check_environment(wrong())

    def test_a_seed_has_the_same_bits_alone_and_among_others_for_any_number_of_threads(self):
        for options in ({"observation": ALL, "image_size": 24, "start_depth": 0.12}, {"task": "arch_variety", "start_depth": 0.1}):
            steps, count = 12, 3
            alone = [walk(gym.NavigationEnv(**options), 40 + i, steps) for i in range(count)]
            self.assertEqual(walk(gym.NavigationEnv(**options), 40, steps), alone[0])
            self.assertNotEqual(alone[0], alone[1])
            actions = [np.random.default_rng(40 + i).uniform(-0.3, 1, (steps, 1, 2)).astype(np.float32) for i in range(count)]
            for threads in (1, 2, 5):
                envs = gym.NavigationVectorEnv(count, threads=threads, **options)
                seen, info = envs.reset(seed=40)
                for i in range(count):
                    self.assertEqual(bits(part(seen, i), 0, {k: info[k][i] for k in info if k[0] != "_"}), alone[i][0])
                for k in range(steps):
                    seen, reward, *_, info = envs.step(np.stack([a[k] for a in actions]))
                    for i in range(count):
                        self.assertEqual(bits(part(seen, i), reward[i], {n: info[n][i] for n in info if n[0] != "_"}), alone[i][k + 1])

    def test_the_remaining_path_is_that_of_the_drawing(self):
        for name, at in AT.items():
            env = gym.NavigationEnv(target=name)
            _, info = env.reset(seed=0)
            m = env._member
            branch = next(b for b in tasks.DEMO_ARCH["branches"] if b["name"] == name)
            # The middle of the branch beyond the mean radius of the aorta; its own way from the aorta's middle line.
            phi = np.pi - at / R
            root = np.array([R * (1 - np.cos(phi)), 0, DOWN + R * np.sin(phi)])
            to_goal = m.goal - root
            along = np.linalg.norm(to_goal)
            tangent, outward = np.array([np.sin(phi), 0, np.cos(phi)]), np.array([-np.cos(phi), 0, np.sin(phi)])
            self.assertAlmostEqual(np.dot(to_goal / along, -tangent), np.cos(branch["angle"]), 9)
            self.assertAlmostEqual(np.dot(to_goal / along, outward), np.sin(branch["angle"]), 9)
            self.assertTrue(0.3 < along / (0.012 + branch["length"]) < 0.7)
            # From the inlet: the straight part, the arch up to the branch, the branch.
            by_hand = DOWN + R * np.pi - at + along
            self.assertAlmostEqual(info["way_left"], by_hand, 4)
            # A tip at any place of a path made by hand, spacing of the lines apart.
            for x, left in ((np.array([0.002, 0.001, 0.08]), 0.04 + R * np.pi - at + along),
                            (np.array([R, 0.003, DOWN + R]), abs(R * np.pi / 2 - at) + along),
                            (root + 0.75 * to_goal, 0.25 * along), (root + 1.2 * to_goal, 0.2 * along)):
                lines = m.anatomy.lines
                self.assertAlmostEqual(lines.way(lines.place(x), (m.line, m.goal_along)), left, delta=1e-4)

    def test_the_reward_of_a_path_led_into_each_branch(self):
        half_turn = 3.2
        for name, bend in PATHS.items():
            env = gym.NavigationEnv(target=name, force_penalty=0.2)
            _, info = env.reset(seed=0)
            start, total, forces, turned, reached, truncated = info["way_left"], 0.0, 0.0, 0.0, False, False
            while not (reached or truncated):
                # The tip bent inwards up to `bend`, then half a turn, then on.
                turn = 0.0 if info["depth"] < bend else np.clip((half_turn - turned) / (3.14 / 7.5), -1, 1)
                turned += turn * 3.14 / 7.5
                _, reward, reached, truncated, info = env.step([[0.5 if abs(turn) < 1e-9 else 0, turn]])
                total += reward
                forces += info["max_wall_force"]
                self.assertFalse(info["failed"], info["failure"])
                self.assertLess(info["certificate_error"], 1e-8)
            self.assertTrue(reached, name)
            # 10 for each metre of the way, 1 at the target; all that the steps earned lies between the ends.
            tip, goal = env.simulation.record.beams["wire"].points[-1], env._member.goal
            self.assertLessEqual(np.linalg.norm(tip - goal), 5e-3)
            self.assertEqual(info["branch"], name)
            lines, line = env._member.anatomy.lines, env._member.line
            axis = goal - lines.at(line, 0.02)
            left = abs(np.dot(tip - goal, axis)) / np.linalg.norm(axis)
            self.assertAlmostEqual(total, 1 + 10 * (start - left) - 0.2 * forces, 4)
            self.assertGreater(forces, 0)

    def test_a_step_that_fails_is_reported_and_the_state_stays(self):
        with unittest.mock.patch.object(_member.Options, "scene", mean_scene):
            env, envs = gym.NavigationEnv(start_depth=0.15, max_failures=99), gym.NavigationVectorEnv(2, start_depth=0.15, max_failures=99)
            failures = 0
            seen, _ = env.reset(seed=2)
            envs.reset(seed=[2, 3])  # jams end no episode here
            for action in np.random.default_rng(1).uniform(-1, 1, (40, 1, 2)):
                before, sight = env.simulation.save(), seen["tracking"]
                seen, reward, terminated, truncated, info = env.step(action)
                _, many, *_, infos = envs.step(np.stack([action, 0 * action]))
                self.assertEqual((reward, info["failure"]), (many[0], infos["failure"][0]))
                self.assertFalse(infos["failed"][1])
                self.assertEqual(info["failed"], info["failure"] != "")
                if info["failed"]:
                    failures += 1
                    self.assertEqual(env.simulation.save(), before)
                    np.testing.assert_array_equal(seen["tracking"], sight)
                    self.assertIn("step", info["failure"])
            self.assertGreater(failures, 0)

    def test_longer_steps_reach_the_balance_that_short_ones_reach(self):
        ends = []
        for step, balance in ((0.01, "mean"), (tasks.CONTROL_STEP, "course")):
            scene = am.Scene(os.path.join(os.environ["AMONTONS_SOURCES"], "examples/catheter/scene.json")).changed(
                {"time.step": step, "time.balance": balance})
            sim = am.Simulation(scene)
            sim.advance(7.5)
            ends.append((sim.record.step, sim.record.quantities["push_force"], sim.branch))
        self.assertLess(5 * ends[1][0], ends[0][0])
        self.assertAlmostEqual(ends[1][1], ends[0][1], delta=0.02 * abs(ends[0][1]) + 1e-4)
        for scene, place in (({"bodies": {"b": {"kind": "rigid", "mass": 1, "shape": {"generate": "ball", "radius": 1}}},
                               "time": {"step": 1, "end": 2, "kind": "dynamic", "balance": "course"}}, "/time/balance"),):
            with self.refused(place):
                am.Scene({"schema": 1, **scene})

    def test_episodes_end_and_begin_again(self):
        envs = gym.NavigationVectorEnv(2, max_steps=3)
        envs.reset(seed=0)
        push = np.tile(np.array([[[1, 0]]]), (2, 1, 1))
        for k in range(3):
            _, _, terminated, truncated, info = envs.step(push)
        self.assertEqual((terminated.tolist(), truncated.tolist()), ([False, False], [True, True]))
        self.assertGreater(info["depth"][0], 0.019)
        _, reward, terminated, truncated, info = envs.step(push)
        self.assertEqual((reward.tolist(), truncated.tolist(), info["depth"].tolist()), ([0, 0], [False, False], [0, 0]))
        envs = gym.NavigationVectorEnv(2, max_steps=3, autoreset="disabled")
        envs.reset(seed=0)
        for k in range(3):
            envs.step(push)
        with self.refused("actions"):
            envs.step(push)
        with self.refused("options.reset_mask"):
            envs.reset(options={"reset_mask": np.zeros(2, bool)})
        _, info = envs.reset(options={"reset_mask": np.array([True, False])})
        self.assertEqual(info["depth"][0], 0)
        self.assertGreater(info["depth"][1], 0.019)
        self.assertEqual(info["_depth"].tolist(), [True, False])

    def test_a_jam_ends_an_episode(self):
        env = gym.NavigationEnv(start_depth=0.15, force_limit=0.05)
        env.reset(seed=0)
        pushes = []
        for _ in range(60):
            *_, terminated, truncated, info = env.step([[1, 0.1]])
            pushes.append(info["push_force"])
            self.assertEqual(truncated, pushes[-1] > 0.05)
            self.assertEqual(info["jammed"], truncated)
            if truncated:
                break
        self.assertGreater(pushes[-1], 0.05)

    def test_the_open_end_of_a_branch_ends_an_episode(self):
        env = gym.NavigationEnv(target="left_carotid", start_depth=0.1)
        _, info = env.reset(seed=0)
        while True:
            *_, terminated, truncated, info = env.step([[1, 0.2]])  # into the left subclavian
            if terminated or truncated:
                break
        self.assertTrue(truncated and info["left_vessel"] and not info["jammed"])
        self.assertEqual(info["branch"], "left_subclavian")
        m = env._member
        beyond = (m.tip() - m.anatomy.lines.at(3, 0.07)) @ (m.anatomy.lines.at(3, 0.08) - m.anatomy.lines.at(3, 0.07)) / 0.01
        self.assertTrue(-1e-4 < beyond - (m.anatomy.lines.length(3) - 0.07) < 0.05 / 7.5 + 1e-3, beyond)

    def test_resetting_takes_less_than_a_millisecond(self):
        env = gym.NavigationEnv()
        env.reset(seed=0)
        env.step([[1, 0]])
        spent = []
        for _ in range(20):
            start = time.process_time()
            env._member.simulation.restore(env._member.anatomy.state)
            spent.append(time.process_time() - start)
        self.assertLess(min(spent), 1e-3)

    def test_arches_are_drawn_about_their_means(self):
        rng = np.random.default_rng(0)
        for kind in gym.arches.TYPES:
            found = [gym.draw_arch(kind, rng) for _ in range(12)]
            names = {tuple(b["name"] for b in s["branches"]) for s in found}
            allowed = {tuple(n for n, _ in order) for k, order in arches.ORDER.items() if k.rstrip("ab") == kind}
            self.assertTrue(names <= allowed, kind)
            inlet = [1e3 * s["descending_diameter"][0] for s in found]
            self.assertLess(abs(np.mean(inlet) - 17), 4 / np.sqrt(12))
            self.assertGreater(np.std(inlet), 0.3)
        self.assertEqual(gym.draw_arch("I", np.random.default_rng(3)), gym.draw_arch("I", np.random.default_rng(3)))
        at = [1e3 * b["at"] for b in gym.mean_arch("I")["branches"]]
        np.testing.assert_allclose(at, [36, 52, 80])
        for kind in ("VIII", "3"):
            with self.refused("kind"):
                gym.draw_arch(kind, rng)

    def test_an_arch_of_type_three_has_a_vertebral_artery(self):
        rng = np.random.default_rng(0)
        found = [next(b for b in gym.draw_arch("III", rng)["branches"] if b["name"] == "left_vertebral") for _ in range(60)]
        wide, long = ([1e3 * np.ravel(b[k])[0] for b in found] for k in ("diameter", "length"))
        # As published: 4.36 (deviation 0.93) and 82.4 (10.9) mm; what does not fit is drawn again.
        self.assertLess(abs(np.mean(wide) - 4.36), 4 * 0.93 / np.sqrt(60))
        self.assertLess(abs(np.mean(long) - 82.4), 4 * 10.9 / np.sqrt(60))
        np.testing.assert_allclose([1e3 * b["at"] for b in gym.mean_arch("III")["branches"]], [36, 52, 66, 80])
        env = gym.NavigationEnv("arch_variety", arch_types="III", target="left_vertebral", start_depth=0.12)
        for seed in range(3):
            _, info = env.reset(seed=seed)
            self.assertEqual(info["target"], "left_vertebral")
            _, _, _, _, info = env.step([[1, 0]])
            self.assertTrue(info["certified"])

    def test_arches_that_are_drawn_are_vessels(self):
        options = _member.Options("arch_variety", arch_types=arches.TYPES)
        refused = 0
        for seed in range(60):
            rng = np.random.default_rng(seed)
            surface = arches.draw_arch(arches.TYPES[seed % len(arches.TYPES)], rng, width=rng.uniform(0.8, 1.2), height=rng.uniform(0.8, 1.2), diameter=0.85)
            try:
                am.Simulation(options.scene(surface))
            except am.InputError:
                refused += 1
        self.assertLess(refused, 3)  # a reset that draws a second one takes longer

    def test_lines_are_in_the_middle_of_the_vessel(self):
        env = gym.NavigationEnv("basic_wire_nav")
        env.reset(seed=0)
        x = np.asarray(env.simulation.bodies["aorta"].points)
        lines = env._member.anatomy.lines
        off = np.concatenate([np.min(np.linalg.norm(x[a:a + 500, None] - lines.points, axis=2) - lines.radius, axis=1)
                              for a in range(0, len(x), 500)])
        # Blends and spacing apart, each point of the wall is a radius from a line, none is nearer to one.
        self.assertGreater(np.mean(np.abs(off) < 4e-4), 0.9)
        self.assertLess(np.abs(off).max(), 3e-3)

    def test_the_image_contains_the_wire_where_tracking_places_it(self):
        env = gym.NavigationEnv(observation=ALL, image_size=160, noise=0.0, start_depth=0.15)
        seen, _ = env.reset(seed=0)
        image = seen["image"][:, :, 0]
        column, row = np.rint(79.5 + 80 * seen["tracking"][:, 0]).astype(int), np.rint(79.5 - 80 * seen["tracking"][:, 1]).astype(int)
        for r, c in zip(row, column):
            self.assertLess(image[r - 1:r + 2, c - 1:c + 2].min(), 190)
        self.assertEqual(image[0, 0], 200)
        self.assertLess(np.mean(image < 200), 0.1)
        dark = gym.NavigationEnv(observation="image", image_size=160, noise=0.0, start_depth=0.15, contrast=20.0).reset(seed=0)[0]["image"]
        self.assertLess(dark[row[0], column[0] + 3], image[row[0], column[0] + 3])

    def test_what_is_not_allowed_is_refused(self):
        for place, options in (("task", {"task": "surgery"}), ("target", {"target": "left_leg"}), ("observation", {"observation": "smell"}),
                               ("image_size", {"image_size": 2.5}), ("force_penalty", {"force_penalty": -1}), ("arch_types", {"arch_types": "VIII"}),
                               ("start_depth", {"start_depth": np.nan}), ("max_steps", {"max_steps": 0}), ("render_mode", {"render_mode": "human"})):
            for make in (gym.NavigationEnv, lambda **o: gym.NavigationVectorEnv(2, **o)):
                with self.refused(place):
                    make(**options)
        env = gym.NavigationEnv()
        env.reset(seed=0)
        for action in (np.zeros(2), [[np.nan, 0]], [[1, 0, 0]]):
            with self.refused("action"):
                env.step(action)
        with self.refused("seed"):
            env.reset(seed=-1)
        self.assertEqual(env.step([[7, 0]])[4]["depth"], env.simulation.record.quantities["depth"])  # as 1
        self.assertAlmostEqual(env.simulation.record.quantities["insertion"], 0.05 / 7.5, 12)

    def test_examples_in_docstrings(self):
        tried = [doctest.testmod(module) for module in (gym, environment)]
        self.assertEqual([r.failed for r in tried], [0, 0])
        self.assertGreaterEqual(sum(r.attempted for r in tried), 7)

    def test_program_6_runs_without_gymnasium_as_with_it(self):
        with open(os.path.join(os.path.dirname(am.__file__), "examples", "6_train.py"), encoding="utf-8") as stream:
            code = stream.read()
        call = 'gym.make_vec("amontons/CatheterNavigation-v0", num_envs=8, vectorization_mode="vector_entry_point",'
        self.assertIn(call, code)
        code = code.replace(call, "amontons.gym.NavigationVectorEnv(8,").replace("import gymnasium as gym\n", "").replace("range(200)", "range(20)")
        subprocess.run([sys.executable, "-B", "-W", "error", "-c", code], check=True, stdout=subprocess.DEVNULL)

    def test_without_gymnasium_only_make_and_register_are_missing(self):
        code = ("import sys; sys.modules['gymnasium'] = None\nimport amontons, amontons.gym as g\n"
                "for f in (g.register, lambda: g.make('amontons/CatheterNavigation-v0')):\n"
                "    try: f()\n    except amontons.ModuleMissing as e: assert 'pip install gymnasium' in str(e)\n    else: raise SystemExit(1)\n"
                "e = g.NavigationEnv(); e.reset(seed=0); e.step(e.action_space.sample())\n")
        subprocess.run([sys.executable, "-B", "-W", "error", "-c", code], check=True)
        code = "import sys, amontons; assert not any(m.startswith(('gymnasium', 'amontons.gym')) for m in sys.modules)"
        subprocess.run([sys.executable, "-B", "-c", code], check=True)

    def test_spaces_are_those_of_gymnasium(self):
        box = _spaces.Box(-1.0, 1.0, (2, 3), seed=1)
        self.assertTrue(box.contains(box.sample()) and not box.contains(2 * np.ones((2, 3), np.float32)))
        self.assertFalse(box.contains(np.zeros((3, 2), np.float32)) or box.contains(np.zeros((2, 3), np.float64)) or box.contains([0]))
        self.assertEqual(box, _spaces.Box(-np.ones((2, 3)), np.ones((2, 3))))
        self.assertNotEqual(box, _spaces.Box(-1.0, 1.0, (3, 2)))
        whole = _spaces.Box(0, 3, (500,), np.uint8, seed=1).sample()
        self.assertEqual(set(whole.tolist()), {0, 1, 2, 3})
        self.assertEqual(list(_spaces.Dict({"b": box, "a": box})), ["a", "b"])
        if not gym.HAS_GYMNASIUM:
            self.skipTest("lacks gymnasium: no check_env, no make")
        import gymnasium
        from gymnasium.utils.env_checker import check_env
        for ours, theirs in ((_spaces.Box(-1.0, 1.0, (2, 3), seed=1), gymnasium.spaces.Box(-1.0, 1.0, (2, 3), seed=1)),
                             (_spaces.Dict({"b": _spaces.Box(0, 1, (2,)), "a": _spaces.Box(0, 1, (3,))}, seed=2),
                              gymnasium.spaces.Dict({"b": gymnasium.spaces.Box(0, 1, (2,)), "a": gymnasium.spaces.Box(0, 1, (3,))}, seed=2))):
            for _ in range(2):
                np.testing.assert_equal(ours.sample(), theirs.sample())
        for name in gym.IDS:
            check_env(gymnasium.make(name).unwrapped, skip_render_check=True)


PATHS = {"brachiocephalic": 0.204, "left_carotid": 0.186, "left_subclavian": 0.18}  # m

if __name__ == "__main__":
    main()
