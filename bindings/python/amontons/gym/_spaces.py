"""Spaces as gymnasium has them, for where it is not installed: what this package needs, with the same behaviour."""

import numpy as np


class Space:
    """A set of values with a shape and a dtype, and a generator of its own."""

    def __init__(self, shape, dtype, seed=None):
        self._shape = None if shape is None else tuple(shape)
        self.dtype = None if dtype is None else np.dtype(dtype)
        self._np_random = None
        if seed is not None:
            self.seed(seed)

    @property
    def shape(self):
        return self._shape

    @property
    def np_random(self):
        if self._np_random is None:
            self.seed()
        return self._np_random

    def seed(self, seed=None):
        """Seeds sample(); returns the seed."""
        sequence = np.random.SeedSequence(seed)
        self._np_random = np.random.Generator(np.random.PCG64(sequence))
        return sequence.entropy

    def __contains__(self, x):
        return self.contains(x)


class Box(Space):
    """Arrays of one shape with low <= x <= high."""

    def __init__(self, low, high, shape=None, dtype=np.float32, seed=None):
        shape = np.broadcast(low, high).shape if shape is None else shape
        super().__init__(shape, dtype, seed)
        self.low = np.broadcast_to(np.asarray(low, self.dtype), self._shape).copy()
        self.high = np.broadcast_to(np.asarray(high, self.dtype), self._shape).copy()

    def sample(self):
        """Uniform between the bounds."""
        if self.dtype.kind in "iu":
            return self.np_random.integers(self.low, self.high, endpoint=True, dtype=self.dtype)
        return self.np_random.uniform(self.low, self.high).astype(self.dtype)

    def contains(self, x):
        return (isinstance(x, np.ndarray) and np.can_cast(x.dtype, self.dtype) and x.shape == self._shape
                and bool(np.all(x >= self.low)) and bool(np.all(x <= self.high)))

    def __eq__(self, other):
        return (isinstance(other, Box) and self._shape == other._shape and self.dtype == other.dtype
                and np.array_equal(self.low, other.low) and np.array_equal(self.high, other.high))

    __hash__ = None

    def __repr__(self):
        return f"Box({self.low.min()}, {self.high.max()}, {self._shape}, {self.dtype})"


class Dict(Space):
    """A dict with a space for each key, in the order of the keys."""

    def __init__(self, spaces, seed=None):
        self.spaces = dict(sorted(dict(spaces).items()))
        super().__init__(None, None, seed)

    def seed(self, seed=None):
        """Seeds all: of one number each gets one of its own. Returns them by key."""
        if seed is None:
            return {key: space.seed() for key, space in self.spaces.items()}
        super().seed(seed)
        own = self.np_random.integers(np.iinfo(np.int32).max, size=len(self.spaces))
        return {key: space.seed(int(s)) for (key, space), s in zip(self.spaces.items(), own)}

    def sample(self):
        return {key: space.sample() for key, space in self.spaces.items()}

    def contains(self, x):
        return isinstance(x, dict) and x.keys() == self.spaces.keys() and all(s.contains(x[k]) for k, s in self.spaces.items())

    def __getitem__(self, key):
        return self.spaces[key]

    def keys(self):
        return self.spaces.keys()

    def items(self):
        return self.spaces.items()

    def __iter__(self):
        return iter(self.spaces)

    def __len__(self):
        return len(self.spaces)

    def __eq__(self, other):
        return isinstance(other, Dict) and self.spaces == other.spaces

    __hash__ = None

    def __repr__(self):
        return "Dict(" + ", ".join(f"{k}: {s!r}" for k, s in self.spaces.items()) + ")"
