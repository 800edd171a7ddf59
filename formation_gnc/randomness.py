"""Every random number of a run comes from its one seed, split by name."""

import numpy as np


def generator(seed: int, name: str) -> np.random.Generator:
    """An independent generator for the stream `name` of a run; the same seed and name give the same bits."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *name.encode()])))
