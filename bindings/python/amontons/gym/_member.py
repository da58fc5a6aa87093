"""One simulation of an environment: its episode, what is seen of it and what it earns."""

import numpy as np

from .. import InputError, Simulation
from .._arguments import refuse
from ..image import Camera, xray
from ..scene import Scene
from . import arches, tasks
from ._base import Box, Dict

POINTS = 5  # of tracking, of each instrument
POINT_SPACING = 0.010  # m along the instrument, from its tip
REACHED = 0.005  # m from the target, as stEVE_bench's threshold
PER_MM = 0.01  # reward for each millimetre of way that is left less
MOST_STEPS = 200  # of an episode
MOST_DRAWS = 100  # of an arch that no scene takes
TRIANGLES = 0.003  # m: of the wall that is shown and reported of alone; what the instruments touch is the vessel itself
SHORTEST = 64  # parts of a control step: there a lost balance is followed once, and what that does not end is a jam
PARTS = ("image", "tracking", "target", "rotation", "last_action")
ALWAYS = {"image": ("image", "target", "last_action"), "tracking": ("tracking", "target", "rotation", "last_action")}
INFO = ("depth", "push_force", "torque", "max_wall_force", "certificate_error", "energy_missed", "way_left")


class Options:
    """What NavigationEnv and NavigationVectorEnv are made with, checked. @raises InputError"""

    def __init__(self, task="catheter_navigation", *, target=None, arch_types=None, observation="tracking", image_size=84,
                 force_penalty=0.0, contrast=0.0, noise=5.0, max_steps=MOST_STEPS, max_failures=3, force_limit=2.0, start_depth=0.0, episodes_between_arch_change=1):
        named = tasks.TASKS.get(task) if isinstance(task, str) else task
        default = "left_carotid" if named is tasks.TASKS["catheter_navigation"] else "random"
        self.task = tasks.task_of(task, default if target is None else target, arch_types)
        parts = ALWAYS.get(observation, observation) if isinstance(observation, str) else tuple(observation)
        if isinstance(parts, str) or not parts or any(p not in PARTS for p in parts) or len(set(parts)) != len(parts):
            refuse("observation", repr(observation), '"image", "tracking", or some of ' + ", ".join(PARTS))
        self.parts = tuple(sorted(parts))  # the order of gymnasium's Dict
        for name, value, least, most in (("image_size", image_size, 8, 4096), ("max_steps", max_steps, 1, 100000), ("max_failures", max_failures, 1, 10**9),
                                         ("episodes_between_arch_change", episodes_between_arch_change, 1, 10**9)):
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not least <= value <= most:
                refuse(name, repr(value), f"a whole number from {least} to {most}")
        for name, value, most in (("force_penalty", force_penalty, 1e6), ("contrast", contrast, 1e4), ("noise", noise, 255),
                                  ("start_depth", start_depth, 0.3), ("force_limit", force_limit, np.inf)):
            if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not 0 <= value <= most:
                refuse(name, repr(value), f"0 to {most:g}")
        self.image_size, self.max_steps, self.max_failures = int(image_size), int(max_steps), int(max_failures)
        self.force_limit = float(force_limit)
        self.force_penalty, self.contrast, self.noise = float(force_penalty), float(contrast), float(noise)
        self.start_depth, self.arch_change = float(start_depth), int(episodes_between_arch_change)
        self.draws = self.task.types not in (None, ("mean",))
        self.surface = arches.mean_arch() if self.task.types == ("mean",) else tasks.DEMO_ARCH
        known = {n for order in arches.ORDER.values() for n, _ in order} if self.draws else {b["name"] for b in self.surface["branches"]}
        if not known & set(self.task.targets):
            refuse("target", ", ".join(self.task.targets), "random, or one of " + ", ".join(sorted(known)))
        self.speeds = np.array([i.speeds for i in self.task.instruments])

    @property
    def action_space(self):
        return Box(-1.0, 1.0, self.speeds.shape, dtype=np.float32)

    @property
    def observation_space(self):
        n = len(self.speeds)
        box = lambda *shape: Box(-1.0, 1.0, shape, dtype=np.float32)
        all = {"image": Box(0, 255, (self.image_size, self.image_size, 1), dtype=np.uint8), "tracking": box(n * POINTS, 2),
               "target": box(2), "rotation": box(n, 2), "last_action": box(n, 2)}
        return Dict({p: all[p] for p in self.parts})

    def scene(self, surface):
        """The Scene of the instruments in a vessel."""
        bodies = {"aorta": {"kind": "obstacle", "surface": {"resolution": TRIANGLES, **surface}}}
        for i in self.task.instruments:
            bodies[i.name] = {
                "kind": "beam", "segments": [dict(s) for s in i.segments],
                "introducer": {"at": [0, 0, 0], "direction": [0, 0, 1], "normal": [1, 0, 0], "length": 0.060},
                "drive": {"insertion": self.start_depth if i is self.task.instruments[0] else 0.0, "twist": 0.0}}
        names = [i.name for i in self.task.instruments]
        contact = [{"between": [i.name, "aorta"], "friction": i.friction} for i in self.task.instruments]
        contact += [{"between": [a, b], "friction": self.task.between} for a, b in zip(names, names[1:])]
        return Scene({"schema": 1, "bodies": bodies, "contact": contact, "accuracy": {"contact": 1e-8},
                      "time": {"kind": "quasi_static", "step": tasks.CONTROL_STEP, "smallest_step": tasks.CONTROL_STEP / SHORTEST,
                               "end": 1e6 * tasks.CONTROL_STEP, "balance": "course"}})

    def camera(self, lines):
        """Of the fluoroscope: it points along y at the middle of the vessel."""
        width, around, up = self.task.view
        middle = 0.5 * (lines.points.min(axis=0) + lines.points.max(axis=0))
        away = np.array([np.sin(around) * np.cos(up), -np.cos(around) * np.cos(up), np.sin(up)])
        return Camera(tuple(middle + away), tuple(middle), width)


class Anatomy:
    """A vessel, a simulation in it as an episode begins, and what is known of it beforehand."""

    def __init__(self, options, surface, simulation=None, state=None):
        self.surface, self.lines = surface, arches.centrelines(surface)
        self.simulation, self.state = simulation, state
        if simulation is None:
            self.simulation = Simulation(options.scene(surface))
            self.simulation.step()
            self.state = self.simulation.save()
        self.camera = options.camera(self.lines)
        self.targets = [k for k, name in enumerate(self.lines.names) if name in options.task.targets]
        ray = np.subtract(self.camera.target, self.camera.source)
        ahead = ray / np.linalg.norm(ray)
        right = np.cross(ahead, self.camera.up)
        right /= np.linalg.norm(right)
        self._axes, self._distance = np.stack([right, np.cross(right, ahead), ahead]), np.linalg.norm(ray)
        self.shade = self._shade(options) if options.contrast > 0 and "image" in options.parts else None

    def twin(self, options):
        """The same vessel with a simulation of its own."""
        return Anatomy(options, self.surface, self.simulation.fork(), self.state)

    def seen(self, points):
        """(n, 2) where points (n, 3) are in the image: right and up, -1 to 1; beyond its edge: at it."""
        x = (points - np.asarray(self.camera.source)) @ self._axes.T
        flat = x[:, :2] * (self._distance / x[:, 2:]) / (0.5 * self.camera.width)
        return np.clip(flat, -1, 1).astype(np.float32)

    def _shade(self, options):
        """(h, w) what contrast medium in the vessel leaves of the grey."""
        size, left = (options.image_size, options.image_size), np.ones((options.image_size,) * 2)
        for line in range(len(self.lines.names)):
            mine = self.lines.line == line
            for a in range(0, int(mine.sum()) - 1, 4):
                part = np.flatnonzero(mine)[a:a + 5]
                seen = xray(self.lines.points[part], self.camera, size, attenuation=options.contrast, white=255, noise=0,
                            radius=float(self.lines.radius[part].mean()))
                left *= seen / 255
        return left


class Member:
    """An episode at a time. The caller moves `simulation` between act() and judge()."""

    def __init__(self, options, fixed=None):
        self.options, self.anatomy, self.episode = options, None, -1
        self._fixed = fixed
        self.tip_name = options.task.instruments[0].name
        self.prefix = self.tip_name + "_" if len(options.speeds) > 1 else ""

    @property
    def simulation(self):
        return self.anatomy.simulation

    def begin(self, rng, first):
        """A new episode; `first` after a seed. Returns True if the simulation is another object than before."""
        o = self.options
        self.rng = rng
        self.episode = 0 if first else self.episode + 1
        before = self.anatomy
        if not o.draws:
            if self.anatomy is None:
                self.anatomy = self._fixed or Anatomy(o, o.surface)
        elif self.anatomy is None or self.episode % o.arch_change == 0:
            self.anatomy = self._draw(rng)
        self.simulation.restore(self.anatomy.state)
        self.line = int(rng.choice(self.anatomy.targets)) if len(self.anatomy.targets) > 1 else self.anatomy.targets[0]
        lines = self.anatomy.lines
        hidden = float(lines.radius[(lines.line == 0)].mean())
        fraction = rng.uniform(0.2, 0.9) if len(o.task.targets) > 1 else 0.5
        self.goal_along = hidden + fraction * (lines.length(self.line) - hidden)
        self.goal = lines.at(self.line, self.goal_along)
        self.goal_seen = self.anatomy.seen(self.goal[None])[0]
        self.last_action = np.zeros(o.speeds.shape, np.float32)
        self.count, self.jammed = 0, 0
        self.seed = int(rng.integers(2**62))
        self.names = [(i.name + ".insertion", i.name + ".twist") for i in o.task.instruments]
        self.inputs = np.array([[self.simulation.inputs[n] for n in pair] for pair in self.names])
        self.before = None
        self.way = self._way()
        return self.anatomy is not before

    def _draw(self, rng):
        o = self.options
        (least, most), thickness = o.task.scales
        for _ in range(MOST_DRAWS):
            kind = o.task.types[int(rng.integers(len(o.task.types)))]
            scale = dict(width=rng.uniform(least, most), height=rng.uniform(least, most), diameter=rng.uniform(*thickness))
            try:
                surface = arches.draw_arch(kind, rng, **scale) if kind != "mean" else arches.mean_arch()
                anatomy = Anatomy(o, surface)
            except InputError:
                continue  # its branches leave no room for one another, or for the instrument
            if anatomy.targets:
                return anatomy
        refuse("target, arch_types", ", ".join(o.task.targets) + " in " + ", ".join(o.task.types), "branches that these arches have")

    def tip(self):
        return self.simulation.record.beams[self.tip_name].points[-1]

    def _way(self):
        lines = self.anatomy.lines
        self.place = lines.place(self.tip())
        return lines.way(self.place, (self.line, self.goal_along))

    def _left(self):
        """Whether the tip is through the open end of a branch."""
        line, along = self.place
        return line > 0 and along >= self.anatomy.lines.length(line)

    def act(self, action):
        """Leads the drives to where the action has them at the end of the control step. @raises InputError"""
        action = np.asarray(action, dtype=float)
        if action.shape != self.options.speeds.shape or not np.isfinite(action).all():
            refuse("action", f"shape {action.shape}" if action.shape != self.options.speeds.shape else "numbers that are not finite",
                   f"{self.options.speeds.shape} finite numbers")
        action = np.clip(action, -1, 1)
        self.last_action = action.astype(np.float32)
        to = self.inputs + action * self.options.speeds * tasks.CONTROL_STEP
        sim = self.simulation
        self.before = sim.save()
        energy = sim.record.energy
        self.spent = (energy.work, energy.elastic, energy.friction, energy.released)
        for k, pair in enumerate(self.names):
            least, most = sim.inputs.ranges[pair[0]]
            to[k, 0] = min(max(to[k, 0], least), most)
            for n, value in zip(pair, to[k]):
                sim.inputs[n] = value
        self.to = to

    def judge(self, failure):
        """(reward, terminated, truncated, info) of the control step; one that failed is taken back."""
        o, sim = self.options, self.simulation
        self.count += 1
        snapped = missed = 0.0
        if failure:
            sim.restore(self.before)
            self.jammed += 1
        else:
            self.jammed = 0
            self.inputs = self.to
            e = sim.record.energy
            work, elastic, friction, released = np.subtract((e.work, e.elastic, e.friction, e.released), self.spent)
            snapped, missed = released, work - elastic - friction - released
        way = self._way()
        reached = bool(np.linalg.norm(self.tip() - self.goal) <= REACHED)
        info = self.info()
        info.update(snapped=bool(snapped > 0), energy_missed=float(missed), failed=bool(failure), failure=failure or "", way_left=way)
        reward = float(reached) + 1e3 * PER_MM * (self.way - way) - o.force_penalty * info["max_wall_force"]
        self.way = way
        info["jammed"] = self.jammed >= o.max_failures or info["push_force"] > o.force_limit
        info["left_vessel"] = self._left()
        over = self.count >= o.max_steps or info["jammed"] or info["left_vessel"]
        return reward, reached, over and not reached, info

    def info(self):
        """Of the last accepted step. Forces [N], torque [N m], lengths [m], energy [J]."""
        record = self.simulation.record
        q, p = record.quantities, self.prefix
        forces = [q[(i.name + "_" if p else "") + "clustered_force"] for i in self.options.task.instruments]
        return {"depth": q[p + "depth"], "push_force": q[p + "push_force"], "torque": q[p + "torque"],
                "max_wall_force": max(forces), "certificate_error": record.certificate.error,
                "certified": bool(record.certificate.certified), "branch": self.simulation.branch,
                "target": self.anatomy.lines.names[self.line], "way_left": self.way, "snapped": False, "energy_missed": 0.0,
                "failed": False, "failure": "", "jammed": False, "left_vessel": False}

    def image(self):
        """(h, w, 1) uint8 as the fluoroscope takes it now; the same until the next control step."""
        size = (self.options.image_size,) * 2
        shot = np.random.SeedSequence([self.seed, self.count]).generate_state(1, np.uint64)[0]
        seen = xray(self.simulation, self.anatomy.camera, size, noise=self.options.noise, seed=int(shot))
        if self.anatomy.shade is not None:
            seen = np.rint(seen * self.anatomy.shade).astype(np.uint8)
        return seen[:, :, None]

    def observe(self):
        """What observation_space holds."""
        see = {"image": self.image, "target": lambda: self.goal_seen.copy(), "last_action": lambda: self.last_action.copy(),
               "rotation": lambda: np.stack([np.cos(self.inputs[:, 1]), np.sin(self.inputs[:, 1])], axis=1).astype(np.float32),
               "tracking": self._tracking}
        return {p: see[p]() for p in self.options.parts}

    def _tracking(self):
        beams = self.simulation.record.beams
        found = []
        for i in self.options.task.instruments:
            x = beams[i.name].points[::-1]
            s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
            at = np.arange(POINTS) * POINT_SPACING  # from the tip; what is in the introducer: at its end
            found.append(np.stack([np.interp(at, s, x[:, k]) for k in range(3)], axis=1))
        return self.anatomy.seen(np.concatenate(found))
