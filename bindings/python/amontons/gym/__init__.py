"""Environments of catheters and guidewires that report the forces on the wall, for gymnasium and without it.

    >>> import amontons.gym
    >>> envs = amontons.gym.NavigationVectorEnv(2, target="left_carotid", start_depth=0.1)
    >>> observation, info = envs.reset(seed=1)
    >>> observation["tracking"].shape, info["branch"].tolist()
    ((2, 5, 2), ['', ''])

`import amontons` does not open this package. Where gymnasium is installed, importing it registers the environments of
IDS there: gymnasium.make("amontons/CatheterNavigation-v0").
"""

from . import arches, tasks
from ._base import HAS_GYMNASIUM
from .arches import draw_arch, mean_arch
from .environment import IDS, NavigationEnv, NavigationVectorEnv, make, register
from .tasks import TASKS, Instrument, Task

__all__ = ["HAS_GYMNASIUM", "IDS", "Instrument", "NavigationEnv", "NavigationVectorEnv", "TASKS", "Task", "arches", "draw_arch", "make",
           "mean_arch", "register", "tasks"]

if HAS_GYMNASIUM:
    register()
