"""gymnasium's classes where it is installed, and what stands in for them where it is not."""

import numpy as np

try:
    import gymnasium
    from gymnasium.spaces import Box, Dict
    from gymnasium.vector import AutoresetMode

    Env, VectorEnv = gymnasium.Env, gymnasium.vector.VectorEnv
    NEXT_STEP, DISABLED = AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED
    HAS_GYMNASIUM = True
except ImportError:
    from ._spaces import Box, Dict

    HAS_GYMNASIUM = False
    NEXT_STEP, DISABLED = "NextStep", "Disabled"

    class Env:
        """What an environment has beyond reset and step."""

        metadata = {"render_modes": []}
        render_mode = None
        spec = None
        _np_random = None
        _np_random_seed = None

        def reset(self, *, seed=None, options=None):
            if seed is not None:
                self._seed(seed)

        def _seed(self, seed):
            sequence = np.random.SeedSequence(seed)
            self._np_random = np.random.Generator(np.random.PCG64(sequence))
            self._np_random_seed = sequence.entropy

        @property
        def np_random(self):
            if self._np_random is None:
                self._seed(None)
            return self._np_random

        @property
        def np_random_seed(self):
            if self._np_random_seed is None:
                self._seed(None)
            return self._np_random_seed

        @property
        def unwrapped(self):
            return self

        def render(self):
            raise NotImplementedError

        def close(self):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_):
            self.close()

    class VectorEnv:
        """The same of many."""

        metadata = {}
        render_mode = None
        spec = None
        closed = False

        @property
        def unwrapped(self):
            return self

        def close(self, **_):
            self.closed = True

        def __enter__(self):
            return self

        def __exit__(self, *_):
            self.close()


def batched(space, count):
    """The space of `count` values of one."""
    if isinstance(space, Dict):
        return Dict({key: batched(s, count) for key, s in space.spaces.items()})
    repeat = (count,) + (1,) * len(space.shape)
    return Box(np.tile(space.low, repeat), np.tile(space.high, repeat), dtype=space.dtype)
