"""Necks of closed and open surfaces."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bodies import WAIST, revolved, snowman

from solver import TriangleMesh
from solver.surface.necks import necks


def ball(long: float = 1.0) -> TriangleMesh:
    turn = np.linspace(0, np.pi, 40)
    return revolved(-long * np.cos(turn), np.sin(turn), 40)


@pytest.mark.parametrize("seed", [None, 1, 2])
def test_a_neck_is_cut_along_its_shortest_ring(seed: int | None) -> None:
    mesh = snowman(seed=seed)
    body, head = necks(mesh)
    ring = 48 * 2 * 0.98 * WAIST * np.sin(np.pi / 48)  # a polygon of 48 sides
    for neck in (head, body):
        assert neck.length == pytest.approx(ring, rel=1e-9)
        assert neck.share == pytest.approx(mesh.face_areas[neck.beyond].sum() / mesh.area)
    middle = mesh.vertices[mesh.faces].mean(axis=1)[:, 2]
    assert set(head.beyond[middle > 0.5]) == {True}
    assert set(head.beyond[middle < 0.25]) == {False}
    assert not (head.beyond & body.beyond).any()


@pytest.mark.parametrize("long", [1.0, 0.5, 3.0])
def test_a_ball_has_no_neck(long: float) -> None:
    assert necks(ball(long)) == ()


def test_no_cut_is_shorter() -> None:
    """On a crooked mesh, against all rings of a family of cuts: the level sets of random planes through the neck."""
    rng = np.random.default_rng(5)
    mesh = snowman(rings=40, segments=24, seed=4)
    mesh = TriangleMesh(mesh.vertices * (1 + 0.02 * rng.normal(size=(len(mesh.vertices), 1))), mesh.faces)
    _, head = necks(mesh)
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    sides = np.flatnonzero(mesh.twins > np.arange(len(mesh.twins)))
    length = mesh.edge_lengths.ravel()[sides]
    for _ in range(300):
        plane = np.array([*rng.normal(0, 0.3, 2), 1.0])
        above = middle @ plane > rng.uniform(0.0, 0.8)
        cut = length[above[sides // 3] != above[mesh.twins[sides] // 3]].sum()
        assert head.length <= cut * (1 + 1e-6)


def test_a_body_with_an_opening_has_the_same_neck() -> None:
    mesh = snowman(seed=3)
    middle = mesh.vertices[mesh.faces].mean(axis=1)[:, 2]
    opened = TriangleMesh(mesh.vertices, mesh.faces[middle > -2.5], "Opened")
    whole, open_head = necks(mesh)[-1], necks(opened)[-1]
    assert open_head.length == pytest.approx(whole.length)
    assert open_head.beyond.sum() == whole.beyond.sum()


def test_a_person_has_a_head_hands_and_feet(data_path: Callable[[str], Path]) -> None:
    data = np.load(data_path("heads/mpfb_man_body.npz"))
    corner, sides = data["corner"].reshape(-1, 4), data["sides"]
    assert (sides == 4).all()
    skin = corner[data["part"] == data["part"][0]]
    mesh = TriangleMesh(data["vertices"], np.concatenate([skin[:, [0, 1, 2]], skin[:, [0, 2, 3]]]), "Man")
    found = [(neck.share, *mesh.vertices[mesh.faces[neck.beyond]].mean(axis=(0, 1))) for neck in necks(mesh)]
    group = {str(name): k for k, name in enumerate(data["group_names"])}
    start = data["group_start"]
    for name in ("head", "hand_l", "hand_r", "foot_l", "foot_r"):
        own = data["group_vertex"][start[group[name]] : start[group[name] + 1]]
        centre = data["vertices"][own].mean(axis=0)
        nearest = min(found, key=lambda row: float(np.linalg.norm(np.array(row[1:]) - centre)))
        assert np.linalg.norm(np.array(nearest[1:]) - centre) < 0.05 * mesh.diagonal, name
