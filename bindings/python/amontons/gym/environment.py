"""Environments of one simulation and of many."""

import os

import numpy as np

from .. import SolveFailed, _native
from .._arguments import refuse
from . import _base, tasks
from ._base import DISABLED, HAS_GYMNASIUM, NEXT_STEP, Env, VectorEnv, batched
from ._member import Anatomy, Member, Options

RATE = 1 / tasks.CONTROL_STEP


def _no_seed_but(seed):
    if seed is not None and (isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0):
        refuse("seed", repr(seed), "a whole number >= 0, or None")


class NavigationEnv(Env):
    """A wire, or instruments in one another, that shall reach a place in a branch of an aortic arch.

    task: one of tasks.TASKS or a Task. target: a branch, whose middle is the target, or "random". arch_types: types of
    arches that are drawn, a new one each `episodes_between_arch_change` episodes; default the task's. observation:
    "image", "tracking", or a tuple of image, tracking, target, rotation, last_action. image_size: pixels each way.
    force_penalty: of the reward, for each newton of the largest force on the wall. contrast: attenuation [1/m] of the
    medium in the vessel that the image shows. noise: of the image, standard deviation in greys. start_depth: of the
    first instrument at reset [m].

    An action is (instruments, 2): push and turn, as parts of the speeds of each. A step is 1/7.5 s. The reward is 1 at
    the target, 0.01 for each millimetre that the way there has become shorter, less the penalty. An episode ends at
    the target, after max_steps, or jammed: where the first instrument is pushed with more than force_limit [N], or
    max_failures steps one after the other could not be solved, or through the open end of a branch. `info` has forces as certified: push_force [N], torque
    [N m], max_wall_force [N] (summed over 5 mm), with certificate_error; branch, depth [m], way_left [m], jammed,
    left_vessel, snapped, energy_missed [J]. A step that cannot be solved leaves the state before it: `failed`, and `failure` states
    why. InputError for what is not allowed.

    >>> import amontons.gym
    >>> env = amontons.gym.NavigationEnv(target="left_subclavian")
    >>> observation, info = env.reset(seed=1)
    >>> observation, reward, terminated, truncated, info = env.step([[1, 0]])
    >>> observation["tracking"].shape, round(1e3 * info["depth"], 1), info["certificate_error"] < 1e-8
    ((5, 2), 6.7, True)
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": RATE}

    def __init__(self, task="catheter_navigation", *, render_mode=None, **options):
        if render_mode not in (None, "rgb_array"):
            refuse("render_mode", repr(render_mode), 'None or "rgb_array"')
        self.render_mode = render_mode
        self._options = Options(task, **options)
        self.action_space, self.observation_space = self._options.action_space, self._options.observation_space
        self._member = Member(self._options)
        self._begun = False

    @property
    def simulation(self):
        """The Simulation, to examine; an episode with a new arch has another."""
        self._check_begun()
        return self._member.simulation

    def reset(self, *, seed=None, options=None):
        _no_seed_but(seed)
        super().reset(seed=seed)
        self._member.begin(self.np_random, seed is not None)
        self._begun = True
        return self._member.observe(), self._member.info()

    def step(self, action):
        self._check_begun()
        m = self._member
        m.act(action)
        failure = ""
        try:
            m.simulation.advance(m.simulation.time + tasks.CONTROL_STEP)
        except SolveFailed as error:
            failure = str(error)
        reward, terminated, truncated, info = m.judge(failure)
        return m.observe(), reward, terminated, truncated, info

    def render(self):
        """(h, w, 3) uint8: the fluoroscope's image."""
        self._check_begun()
        return None if self.render_mode is None else np.repeat(self._member.image(), 3, axis=2)

    def _check_begun(self):
        if not self._begun:
            raise RuntimeError("no episode has begun: reset()")


class NavigationVectorEnv(VectorEnv):
    """num_envs of NavigationEnv on threads of C++, each with the bits that it gives alone.

    options: as NavigationEnv. threads: default one for each processor. autoreset: "next_step", where the step after an
    episode's end begins the next one, whatever the action; or "disabled", where reset(options={"reset_mask": mask})
    does. Of one seed, environment i has seed + i. Arrays of `info` have a mask `_NAME` beside them, as gymnasium's.
    """

    def __init__(self, num_envs=1, task="catheter_navigation", *, threads=None, autoreset="next_step", render_mode=None, **options):
        if isinstance(num_envs, bool) or not isinstance(num_envs, (int, np.integer)) or num_envs < 1:
            refuse("num_envs", repr(num_envs), "a whole number >= 1")
        if autoreset not in ("next_step", "disabled"):
            refuse("autoreset", repr(autoreset), '"next_step" or "disabled"')
        if render_mode not in (None, "rgb_array"):
            refuse("render_mode", repr(render_mode), 'None or "rgb_array"')
        threads = len(os.sched_getaffinity(0)) if threads is None else threads
        if isinstance(threads, bool) or not isinstance(threads, (int, np.integer)) or not 1 <= threads <= 1024:
            refuse("threads", repr(threads), "a whole number from 1 to 1024")
        self._options, self._threads, self.num_envs = Options(task, **options), int(threads), int(num_envs)
        self._autoreset = autoreset == "next_step"
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": RATE, "autoreset_mode": NEXT_STEP if self._autoreset else DISABLED}
        self.render_mode = render_mode
        self.single_action_space, self.single_observation_space = self._options.action_space, self._options.observation_space
        self.action_space, self.observation_space = (batched(s, self.num_envs) for s in (self.single_action_space, self.single_observation_space))
        first = None if self._options.draws else Anatomy(self._options, self._options.surface)
        self._members = [Member(self._options, None if first is None else first if i == 0 else first.twin(self._options))
                         for i in range(self.num_envs)]
        self._rngs = [None] * self.num_envs
        self._batch = None
        self._ended = np.zeros(self.num_envs, bool)

    def reset(self, *, seed=None, options=None):
        mask = None if options is None else options.get("reset_mask")
        mask = np.ones(self.num_envs, bool) if mask is None else np.asarray(mask)
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            refuse("options.reset_mask", f"shape {mask.shape} of {mask.dtype}", f"({self.num_envs},) of bool, one true at least")
        if seed is None or isinstance(seed, (int, np.integer)):
            _no_seed_but(seed)
            seeds = [None if seed is None else int(seed) + i for i in range(self.num_envs)]
        else:
            seeds = list(seed)
            if len(seeds) != self.num_envs:
                refuse("seed", f"{len(seeds)} of them", f"one, or {self.num_envs}")
            for s in seeds:
                _no_seed_but(s)
        waiting = [i for i in range(self.num_envs) if not mask[i] and self._rngs[i] is None]
        if waiting:
            refuse("options.reset_mask", f"no episode of {waiting} has begun", "true for those at the first reset")
        for i in np.flatnonzero(mask):
            if seeds[i] is not None or self._rngs[i] is None:
                self._rngs[i] = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seeds[i])))
            self._begin(i, seeds[i] is not None)
        self._ended[mask] = False
        return self._observe(), self._gather([m.info() for m in self._members], mask)

    def _begin(self, i, first):
        if self._members[i].begin(self._rngs[i], first):
            self._batch = None

    def step(self, actions):
        if self._rngs[0] is None:
            raise RuntimeError("no episode has begun: reset()")
        actions = np.asarray(actions, dtype=float)
        if actions.shape != self.action_space.shape:
            refuse("actions", f"shape {actions.shape}", f"{self.action_space.shape}")
        if not np.isfinite(actions).all():
            refuse("actions", "numbers that are not finite", "finite numbers")
        begin = self._ended.copy()
        if begin.any() and not self._autoreset:
            refuse("actions", f"episodes of {np.flatnonzero(begin).tolist()} that have ended", 'reset(options={"reset_mask": ...}) first')
        for i, m in enumerate(self._members):
            if begin[i]:
                self._begin(i, False)
            else:
                m.act(actions[i])
        if self._batch is None:
            self._batch = _native.Batch([m.simulation for m in self._members], self._threads)
        self._batch.note_times()
        state = self._batch.advance(tasks.CONTROL_STEP, ~begin)
        messages = self._batch.messages
        reward, terminated, truncated, infos = np.zeros(self.num_envs), np.zeros(self.num_envs, bool), np.zeros(self.num_envs, bool), []
        for i, m in enumerate(self._members):
            if begin[i]:
                infos.append(m.info())
                continue
            reward[i], terminated[i], truncated[i], info = m.judge(messages[i] if state[i] == 2 else "")
            infos.append(info)
        self._ended = terminated | truncated
        return self._observe(), reward, terminated, truncated, self._gather(infos)

    def _observe(self):
        seen = [m.observe() for m in self._members]
        return {key: np.stack([o[key] for o in seen]) for key in self._options.parts}

    def _gather(self, infos, mask=None):
        all = {}
        for key in infos[0]:
            values = [i[key] for i in infos]
            all[key] = np.array(values, dtype=object if isinstance(values[0], str) else None)
            all["_" + key] = np.ones(self.num_envs, bool) if mask is None else mask.copy()
        return all

    def render(self):
        """A tuple of (h, w, 3) uint8, or None without a render_mode."""
        return None if self.render_mode is None else tuple(np.repeat(m.image(), 3, axis=2) for m in self._members)

    @property
    def simulations(self):
        """The Simulations, to examine."""
        return [m.simulation for m in self._members]


IDS = {"amontons/CatheterNavigation-v0": "catheter_navigation", "amontons/BasicWireNav-v0": "basic_wire_nav",
       "amontons/ArchVariety-v0": "arch_variety", "amontons/DualDeviceNav-v0": "dual_device_nav"}


def _gymnasium():
    if not HAS_GYMNASIUM:
        from .. import ModuleMissing
        raise ModuleMissing("gymnasium is not installed: python3 -m pip install gymnasium; NavigationEnv and "
                            "NavigationVectorEnv work without it")
    return _base.gymnasium


def register():
    """Registers the environments in IDS with gymnasium, once; `import amontons.gym` does it where gymnasium is installed."""
    gymnasium = _gymnasium()
    for name, task in IDS.items():
        if name not in gymnasium.registry:
            gymnasium.register(id=name, entry_point="amontons.gym:NavigationEnv", vector_entry_point="amontons.gym:NavigationVectorEnv",
                               kwargs={"task": task})


def make(id, **options):
    """gymnasium.make of a name in IDS. @raises ModuleMissing"""
    gymnasium = _gymnasium()
    register()
    return gymnasium.make(id, **options)
