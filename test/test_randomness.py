import itertools

import numpy as np

from formation_gnc.randomness import generator

COUNT = 20_000
NAMES = ("deputy1/sensors", "deputy1/fixes", "deputy2/sensors", "deputy2/fixes", "1", "11")


def test_the_same_seed_and_name_give_the_same_bits_on_every_machine() -> None:
    # NumPy keeps SeedSequence and PCG64 the same for good; recorded once
    assert generator(1, "deputy1/sensors").bit_generator.random_raw(3).tolist() == [
        17401392787255489580,
        12951157486426417272,
        7621976175646578315,
    ]


def test_every_name_and_seed_has_its_own_stream() -> None:
    first = [int(generator(seed, name).bit_generator.random_raw()) for seed in range(50) for name in NAMES]
    assert len(set(first)) == len(first)


def test_streams_are_not_correlated_at_any_small_lag() -> None:
    draws = {name: generator(7, name).standard_normal(COUNT) for name in NAMES}
    for one, other in itertools.combinations(NAMES, 2):
        for lag in range(5):
            a, b = draws[one][: COUNT - lag], draws[other][lag:]
            # of independent streams it is normal with 1 / sqrt(N); 75 draws stay within five of those
            assert abs(np.corrcoef(a, b)[0, 1]) < 5.0 / np.sqrt(COUNT)


def test_streams_are_independent_of_one_another() -> None:
    alone = generator(3, "deputy1/sensors").standard_normal(10)
    busy, idle = generator(3, "deputy1/fixes"), generator(3, "deputy1/sensors")
    mixed = []
    for _ in range(10):
        busy.standard_normal(7)
        mixed.append(idle.standard_normal())
    assert alone.tolist() == mixed
