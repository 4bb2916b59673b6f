import numpy as np
import pytest
from correspondences import on_itself, sheet

from solver import TriangleMesh
from solver.carry.contacts import brought_together, facing, find_contacts
from solver.carry.gradients import GradientTransfer


def slit(half_gap: float) -> TriangleMesh:
    """A sheet folded to a U: two plates that face each other at 2 * half_gap, joined by a bend."""
    flat = sheet(41, 15)[0]
    s, y = 1.5 * flat.vertices[:, 0], flat.vertices[:, 1]
    bend = half_gap * np.pi / 2
    angle = np.clip(s / bend, -1, 1) * np.pi / 2
    x = -half_gap * np.cos(angle) + np.maximum(np.abs(s) - bend, 0)
    return TriangleMesh(np.stack([x, y, half_gap * np.sin(angle)], axis=1), flat.faces)


def closing(mesh: TriangleMesh, depth: float) -> np.ndarray:
    """The upper plate comes down in the middle of its free end, by up to `depth`."""
    x, y, z = mesh.vertices.T
    upper = 1 / (1 + np.exp(-40 * z / np.ptp(z)))
    down = depth * upper * np.clip((x - 0.2) / 0.6, 0, 1) * np.cos(np.pi / 2 * y) ** 2
    return np.stack([0 * x, 0 * y, -down], axis=1)


def least_clearance(mesh: TriangleMesh, moved: np.ndarray, contacts) -> np.ndarray:
    apart = 0.5 * contacts.opening
    return facing(mesh.vertices, mesh.vertices + moved, mesh.faces, contacts.vertex, apart).clearance


def test_contacts_are_where_plates_meet_and_nowhere_else():
    mesh = slit(0.2)
    moved = closing(mesh, 0.39)
    contacts = find_contacts(mesh.vertices, moved, mesh.faces)
    assert len(contacts.vertex) > 10
    place = mesh.vertices[contacts.vertex]
    assert (place[:, 0] > 0.3).all()
    assert (np.abs(place[:, 1]) < 0.7).all()
    assert contacts.opening == pytest.approx(0.4, rel=0.1)
    # a plate that comes half the way, or moves along with the other, meets nothing
    assert len(find_contacts(mesh.vertices, 0.5 * moved, mesh.faces).vertex) == 0
    assert len(find_contacts(mesh.vertices, np.tile([0.0, 0.0, 0.3], (len(moved), 1)), mesh.faces).vertex) == 0
    assert len(find_contacts(mesh.vertices, 0 * moved, mesh.faces).vertex) == 0


@pytest.mark.parametrize("half_gap", [0.12, 0.3], ids=["would-pass-through", "would-stay-open"])
def test_what_meets_on_the_source_meets_on_the_target_and_does_not_pass_through(half_gap):
    source, target = slit(0.2), slit(half_gap)
    moved = closing(source, 0.39)
    correspondence = on_itself(source, 0)
    transfer = GradientTransfer.of(correspondence, source, target)
    contacts = find_contacts(source.vertices, moved, source.faces)
    # the worst case: copied as it is, 0.39 down into an opening of another width
    carried = moved * float(np.median(transfer.scale))
    before = least_clearance(target, carried, contacts)
    met = brought_together(transfer, carried, moved)
    after = least_clearance(target, met, contacts)
    opening = 2 * half_gap
    assert np.abs(before).max() > 0.3 * opening
    left = np.abs(contacts.clearance / contacts.opening).mean()  # on the source
    assert np.abs(after).mean() / opening < left + 0.05
    assert np.abs(after).mean() < 0.5 * np.abs(before).mean()
    # what does not move still does not
    still = np.linalg.norm(carried, axis=1) < 1e-4
    assert np.linalg.norm(met - carried, axis=1)[still].max() < 0.01 * opening


def test_what_meets_nothing_is_left_alone():
    mesh = slit(0.2)
    moved = closing(mesh, 0.1)
    transfer = GradientTransfer.of(on_itself(mesh, 0), mesh, mesh)
    carried = transfer(moved)
    assert (brought_together(transfer, carried, moved) == carried).all()
    assert (brought_together(transfer, 0 * carried, 0 * moved) == 0).all()


def test_parts_that_lie_beside_each_other_are_left_alone():
    whole = slit(0.2)
    plates = whole.vertices[whole.faces][:, :, 0].min(axis=1) > 0.1  # without the bend that joins them
    mesh = TriangleMesh(whole.vertices, whole.faces[plates])
    moved = closing(mesh, 0.39)
    assert len(find_contacts(mesh.vertices, moved, mesh.faces).vertex) > 10
    assert brought_together(GradientTransfer.of(on_itself(mesh, 0), mesh, mesh), moved, moved) is moved
