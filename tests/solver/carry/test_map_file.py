import io
import pickle
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surfaces import spherical_cap

from solver import Alignment, AlignSettings, Correspondence, TriangleMesh, align, correspond, load_map, save_map

FIELDS = ("face", "barycentric", "matched", "confidence", "source_triangles", "source_size")


@pytest.fixture(scope="module")
def aligned() -> tuple[Alignment, Correspondence]:
    mesh, truth = spherical_cap(10, 1.5, jitter=0.3)
    bumps = 1 + 0.2 * np.cos(5 * truth.real + 1) + 0.2 * np.sin(4 * truth.imag)
    mesh = type(mesh)(mesh.vertices * bumps[:, None], mesh.faces, "bumpy")
    alignment = align(mesh, mesh, AlignSettings(samples=20, targets=60, reflect="never"))
    return alignment, correspond(alignment)


@pytest.fixture(scope="module")
def written(aligned, tmp_path_factory):
    path = tmp_path_factory.mktemp("maps") / "map.npz"
    save_map(path, *aligned)
    return path


@pytest.fixture
def arrays(written):
    with np.load(written) as stored:
        return dict(stored)


def test_a_map_comes_back_as_it_was_written(aligned, written):
    found = load_map(written)
    for name in FIELDS:
        assert np.array_equal(getattr(found, name), getattr(aligned[1], name))


def test_the_file_holds_what_the_interface_promises(aligned, written):
    with np.load(written) as stored:
        alignment = aligned[0]
        assert np.array_equal(stored["source_disc"], alignment.source.disc)
        assert np.array_equal(stored["target_disc"], alignment.target.disc)
        assert complex(stored["z"]) == alignment.mobius.z
        assert float(stored["theta"]) == alignment.mobius.theta
        assert bool(stored["reflected"]) == alignment.mobius.reflected
        assert str(stored["source_fingerprint"]) == alignment.source.mesh.fingerprint
        assert str(stored["target_fingerprint"]) == alignment.target.mesh.fingerprint


def test_a_foreign_or_absent_file_is_refused_by_name(tmp_path):
    other = tmp_path / "other.npz"
    other.write_text("no archive")
    with pytest.raises(ValueError, match=r"other\.npz' is not a map"):
        load_map(other)
    np.savez(other, faces=np.zeros(3))
    with pytest.raises(ValueError, match="is not a map"):
        load_map(other)
    with other.open("wb") as file:
        np.save(file, np.zeros(3))
    with pytest.raises(ValueError, match="is not a map"):
        load_map(other)
    with pytest.raises(FileNotFoundError):
        load_map(tmp_path / "absent.npz")


# which meshes it is of


def reordered(mesh: TriangleMesh) -> TriangleMesh:
    order = np.random.default_rng(0).permutation(len(mesh.vertices))
    return TriangleMesh(mesh.vertices[order], np.argsort(order)[mesh.faces], "reordered")


def moved(mesh: TriangleMesh) -> TriangleMesh:
    vertices = mesh.vertices.copy()
    vertices[3, 1] = np.nextafter(vertices[3, 1], 9)
    return TriangleMesh(vertices, mesh.faces, "moved")


def turned(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, np.roll(mesh.faces, 1, axis=1), "turned")


@pytest.mark.parametrize("change", [reordered, moved, turned])
@pytest.mark.parametrize("role", ["source", "target"])
def test_a_map_of_other_meshes_is_refused_by_their_fingerprints(aligned, written, change, role):
    mesh = aligned[0].source.mesh
    assert len(load_map(written, mesh, mesh).face) == len(mesh.vertices)
    with pytest.raises(ValueError, match=rf"map\.npz' was made for another {role} than '{change.__name__}'"):
        load_map(written, **{role: change(mesh)})


def test_a_map_of_a_mesh_put_in_order_is_one_of_the_mesh_as_it_came(aligned, tmp_path):
    mesh = aligned[0].source.mesh
    own = TriangleMesh(np.vstack([mesh.vertices, [[9, 9, 9]]]), mesh.faces, "own")
    save_map(tmp_path / "map.npz", *aligned, source=own)
    load_map(tmp_path / "map.npz", own, mesh)
    with pytest.raises(ValueError, match="another source"):
        load_map(tmp_path / "map.npz", mesh, mesh)


def test_a_map_of_an_earlier_version_is_not_taken_for_one_of_given_meshes(aligned, arrays, tmp_path):
    mesh = aligned[0].source.mesh
    without = {name: array for name, array in arrays.items() if "fingerprint" not in name}
    np.savez(tmp_path / "old.npz", **without)
    with pytest.raises(ValueError, match=r"old\.npz' does not say which meshes it was made for"):
        load_map(tmp_path / "old.npz", mesh, mesh)
    assert np.array_equal(load_map(tmp_path / "old.npz").face, arrays["face"])


# damage

WRONG = {
    "numbers that are none": {"barycentric": lambda x: x * np.nan},
    "negative coordinates": {"barycentric": lambda x: -5 * x},
    "coordinates of another sum": {"barycentric": lambda x: x / 2},
    "endless coordinates": {"barycentric": lambda x: np.where(x > 0.5, np.inf, x)},
    "coordinates without a point": {"face": lambda x: np.where(np.arange(len(x)) == 4, -1, x)},
    "confidence above 1": {"confidence": lambda x: x + 9},
    "no confidence": {"confidence": lambda x: x * np.nan},
    "matched without a point": {
        "face": lambda x: 0 * x - 1,
        "barycentric": lambda x: 0 * x,
        "matched": lambda x: x | True,
    },
    "a triangle too far": {"face": lambda x: x + 10**6},
    "a vertex too far": {"source_triangles": lambda x: x + 10**6},
    "a negative vertex": {"source_triangles": lambda x: -x},
    "a size of two": {"source_size": lambda x: np.array([1, 2])},
    "an endless size": {"source_size": lambda x: np.array(np.inf)},
    "faces in two dimensions": {"face": lambda x: x[:, None]},
    "faces with fractions": {"face": lambda x: x + 0.5},
    "texts": {"face": lambda x: x.astype(str)},
    "one vertex less": {"face": lambda x: x[1:]},
    "no vertex": {name: lambda x: x[:0] for name in ("face", "barycentric", "matched", "confidence")},
    "no triangle": {"source_triangles": lambda x: x[:0]},
    "numbers for flags": {"matched": lambda x: x.astype(float)},
}


@pytest.mark.parametrize("what", WRONG)
def test_wrong_numbers_are_refused(arrays, tmp_path, what):
    changed = {name: change(arrays[name]) for name, change in WRONG[what].items()}
    np.savez(tmp_path / "map.npz", **arrays | changed)
    with pytest.raises(ValueError, match=r"map\.npz' is damaged: ['\w]"):
        load_map(tmp_path / "map.npz")


class Trap:
    """What a pickle would run."""

    sprung = False

    def __reduce__(self):
        return setattr, (Trap, "sprung", True)


def test_a_pickle_is_never_opened(arrays, tmp_path):
    np.savez(tmp_path / "map.npz", **arrays | {"face": np.array([Trap()], object)})
    with pytest.raises(ValueError, match="is damaged"):
        load_map(tmp_path / "map.npz")
    (tmp_path / "pickle.npz").write_bytes(pickle.dumps(Trap()))
    with pytest.raises(ValueError, match="is not a map"):
        load_map(tmp_path / "pickle.npz")
    assert not Trap.sprung


@pytest.mark.parametrize("header", ["honest", "small"])
def test_a_bomb_is_not_unpacked(aligned, arrays, tmp_path, header):
    """A gigabyte of zeros in a megabyte, in a file of a map that fits, or of a mesh that it does not fit."""
    path, mesh = tmp_path / "bomb.npz", aligned[0].source.mesh
    count = len(mesh.vertices) if header == "small" else 1 << 30
    first = io.BytesIO()
    np.lib.format.write_array_header_1_0(first, {"descr": "|b1", "fortran_order": False, "shape": (count,)})
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w") as member:
                if name == "matched":
                    member.write(first.getvalue())
                    for _ in range(1 << 10):
                        member.write(bytes(1 << 20))
                else:
                    np.lib.format.write_array(member, array)
    assert path.stat().st_size < 1 << 24
    with pytest.raises(ValueError, match="is damaged"):
        load_map(path, mesh, mesh)


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_any_damage_is_a_sentence_or_does_no_harm(written, tmp_path_factory, data):
    """Bytes changed, left out or put in at random: a ValueError that names the file, or the very same map."""
    whole = written.read_bytes()
    start = data.draw(st.integers(0, len(whole) - 1))
    length = data.draw(st.sampled_from([0, 1, 1, 1, 7, 1000, len(whole)]))
    between = data.draw(st.binary(max_size=8))
    damaged = written.with_name("damaged.npz")
    damaged.write_bytes(whole[:start] + between + whole[start + length :])
    said = ""
    try:
        found = load_map(damaged)
    except ValueError as error:
        found, said = load_map(written), str(error)
    assert not said or "damaged.npz" in said
    assert all(np.array_equal(getattr(found, name), getattr(load_map(written), name)) for name in FIELDS)
