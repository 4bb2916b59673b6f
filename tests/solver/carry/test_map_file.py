import numpy as np
import pytest
from surfaces import spherical_cap

from solver import Alignment, AlignSettings, Correspondence, align, correspond, load_map, save_map


@pytest.fixture(scope="module")
def aligned() -> tuple[Alignment, Correspondence]:
    mesh, truth = spherical_cap(10, 1.5, jitter=0.3)
    bumps = 1 + 0.2 * np.cos(5 * truth.real + 1) + 0.2 * np.sin(4 * truth.imag)
    mesh = type(mesh)(mesh.vertices * bumps[:, None], mesh.faces, "bumpy")
    alignment = align(mesh, mesh, AlignSettings(samples=20, targets=60, reflect="never"))
    return alignment, correspond(alignment)


def test_a_map_comes_back_as_it_was_written(aligned, tmp_path):
    save_map(tmp_path / "map.npz", *aligned)
    found = load_map(tmp_path / "map.npz")
    for name in ("face", "barycentric", "matched", "confidence", "source_triangles", "source_size"):
        assert np.array_equal(getattr(found, name), getattr(aligned[1], name))


def test_the_file_holds_what_the_interface_promises(aligned, tmp_path):
    save_map(tmp_path / "map.npz", *aligned)
    with np.load(tmp_path / "map.npz") as stored:
        alignment = aligned[0]
        assert np.array_equal(stored["source_disc"], alignment.source.disc)
        assert np.array_equal(stored["target_disc"], alignment.target.disc)
        assert complex(stored["z"]) == alignment.mobius.z
        assert float(stored["theta"]) == alignment.mobius.theta
        assert bool(stored["reflected"]) == alignment.mobius.reflected


def test_a_foreign_or_damaged_file_is_refused_by_name(aligned, tmp_path):
    other = tmp_path / "other.npz"
    other.write_text("no archive")
    with pytest.raises(ValueError, match=r"other\.npz' is not a map"):
        load_map(other)
    np.savez(other, face=np.zeros(3))
    with pytest.raises(ValueError, match="is not a map"):
        load_map(other)
    save_map(other, *aligned)
    with np.load(other) as stored:
        arrays = dict(stored)
    np.savez(other, **arrays | {"face": arrays["face"] + len(arrays["source_triangles"])})
    with pytest.raises(ValueError, match="is damaged"):
        load_map(other)
    with pytest.raises(FileNotFoundError):
        load_map(tmp_path / "absent.npz")
