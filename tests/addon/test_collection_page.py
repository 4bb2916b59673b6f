"""The page of a collection: a tree in which nothing lies on anything else, and names that fit."""

from itertools import pairwise

import pytest

pytest.importorskip("bpy", reason="Blender's module bpy is not installed")

from mobius_extension.mobius_addon.collection.paths import places, short


@pytest.mark.parametrize("seed", range(5))
def test_every_specimen_has_a_place_of_its_own(seed: int) -> None:
    import random

    rng = random.Random(seed)
    routes = {0: [0]}
    for number in range(1, 300):
        routes[number] = [*routes[rng.randrange(max(0, number - 9 * seed - 1), number)], number]
    found = places(routes, 0)
    assert set(found) == set(routes)
    assert found[0][0] == 0
    assert all(found[number][0] == len(path) - 1 for number, path in routes.items())
    columns: dict[int, list[float]] = {}
    for column, row in found.values():
        columns.setdefault(column, []).append(row)
    for rows in columns.values():
        rows.sort()
        assert all(below - above >= 1 for above, below in pairwise(rows))


def test_a_path_may_be_as_long_as_there_are_specimens() -> None:
    routes = {number: list(range(number + 1)) for number in range(3000)}
    assert places(routes, 0)[2999] == (2999, 0.0)


def test_a_long_name_keeps_its_beginning_and_its_end() -> None:
    assert short("tooth", 5) == "tooth"
    for most in (3, 4, 9, 10):
        assert len(short("a specimen of a long name", most)) == most
    assert short("AMNH-M-76882_M786", 9) == "AMNH…M786"
