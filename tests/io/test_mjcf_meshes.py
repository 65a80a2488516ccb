"""Meshes of MJCF: drawn where MuJoCo draws them, of its colours, and as heavy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.errors import FileFormatError, LeftOutWarning
from fivebar_pin.io import _meshes

mujoco = pytest.importorskip("mujoco")
from mujoco_twin import Twin  # noqa: E402

# a wedge with a dent, of numbers that single precision holds: neither convex nor round
POINTS = np.array([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0], [0, 0, 2], [4, 0, 2], [1, 1, 1]]) / 16.0
FACES = [(0, 2, 1), (0, 3, 2), (0, 1, 5), (0, 5, 4), (0, 4, 3), (1, 2, 5), (4, 5, 6), (5, 2, 6), (2, 3, 6), (3, 4, 6)]


def obj(folder: Path, name: str = "wedge.obj") -> Path:
    lines = [f"v {x} {y} {z}" for x, y, z in POINTS] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES]
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")
    return path


def stl(folder: Path) -> Path:
    record = np.zeros(len(FACES), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")]))
    record["corners"] = POINTS[np.array(FACES)]
    path = folder / "wedge.stl"
    path.write_bytes(b" " * 80 + np.uint32(len(FACES)).tobytes() + record.tobytes())
    return path


def model(folder: Path, mesh: str, geom: str = 'type="mesh" mesh="m"', more: str = "", body: str = "") -> Path:
    path = folder / "m.xml"
    path.write_text(
        f'<mujoco>{more}<asset><mesh name="m" {mesh}/></asset><worldbody><body name="a" pos="0.1 0 0">'
        f'<joint name="j" axis="1 2 3"/><geom pos="0.25 0.5 0" euler="10 20 30" {geom}/>{body}</body></worldbody>'
        "</mujoco>"
    )
    return path


def weighs_as_in_mujoco(path: Path, rtol: float = 1e-13) -> Twin:
    """Mass, centre and principal moments agree; their axes as far as MuJoCo's own eigenvalues of a tensor go."""
    twin = Twin(path)
    twin.assert_same(rtol=1e-8)
    ours, m = twin.chain.model.inertias[1], twin.model
    assert ours.mass == pytest.approx(m.body_mass[1], rel=rtol)
    np.testing.assert_allclose(ours.lever, m.body_ipos[1], rtol=0.0, atol=rtol)
    np.testing.assert_allclose(np.linalg.eigvalsh(ours.inertia), np.sort(m.body_inertia[1]), rtol=10.0 * rtol)
    return twin


INLINE = 'vertex="{}" face="{}"'.format(
    " ".join(str(x) for x in POINTS.ravel()), " ".join(str(x) for f in FACES for x in f)
)
UNDRAWN = pytest.mark.filterwarnings("ignore:.*mesh 'm', which has no file:fivebar_pin.errors.LeftOutWarning")


@UNDRAWN
@pytest.mark.parametrize("rule", ["", 'inertia="legacy"', 'inertia="exact"', 'inertia="convex"', 'inertia="shell"'])
@pytest.mark.parametrize("how", ["", 'scale="1 -2 0.5"', 'scale="2 2 1" refpos="0.125 0.25 0.5" refquat="1 1 0 0"'])
def test_a_mesh_is_as_heavy_as_in_mujoco(tmp_path: Path, rule: str, how: str) -> None:
    for geom in ("", 'density="500"', 'mass="3"'):
        weighs_as_in_mujoco(model(tmp_path, f"{INLINE} {rule} {how}", f'type="mesh" mesh="m" {geom}'))


@pytest.mark.parametrize("make", [obj, stl])
def test_meshes_are_read_from_their_files(tmp_path: Path, make) -> None:
    twin = weighs_as_in_mujoco(model(tmp_path, f'file="{make(tmp_path).name}"'))
    (drawn,) = twin.chain.visuals
    assert drawn.mesh == str(tmp_path / make(tmp_path).name)


@UNDRAWN
def test_points_without_triangles_are_their_convex_hull(tmp_path: Path) -> None:
    weighs_as_in_mujoco(model(tmp_path, INLINE.split(" face")[0]))


@UNDRAWN
@pytest.mark.parametrize("around", ["true", "false"])
@pytest.mark.parametrize("kind", ["sphere", "capsule", "cylinder", "ellipsoid", "box"])
def test_a_shape_fitted_to_a_mesh_is_that_of_mujoco(tmp_path: Path, kind: str, around: str) -> None:
    more = f'<compiler fitaabb="{around}"/>'
    path = model(tmp_path, INLINE, f'type="{kind}" mesh="m" fitscale="1.5" group="4"', more)
    weighs_as_in_mujoco(path, rtol=1e-9)  # MuJoCo measures along axes that it knows to 1e-10
    path.write_text(path.read_text().replace('group="4"', ""))
    if kind != "ellipsoid":
        (drawn,), m = fb.load(path).visuals, mujoco.MjModel.from_xml_path(str(path))
        sizes = np.array(drawn.size) * {"box": [0.5] * 3, "sphere": [1.0]}.get(kind, [1.0, 0.5])
        np.testing.assert_allclose(sizes, m.geom_size[0, : len(sizes)], rtol=1e-9)
        np.testing.assert_allclose(drawn.placement[:3, 3], m.geom_pos[0], rtol=1e-9)
        assert np.linalg.det(drawn.placement[:3, :3]) == pytest.approx(1.0)


# a post along z and a needle across it, longer than the post
POST = np.array(
    [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-2, 2)] + [[8, 0, 0], [0, 0, 0], [0, 1, 0], [0, 0, 1]]
)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = [t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))] + [
    (8, 10, 11),
    (9, 11, 10),
    (8, 11, 9),
    (8, 9, 10),
]


def test_no_capsule_fits_a_mesh_that_is_wider_than_long(tmp_path: Path) -> None:
    points = " ".join(str(x) for x in (POST / 32.0).ravel())
    mesh = f'vertex="{points}" face="{" ".join(str(x) for t in TRIANGLES for x in t)}" inertia="exact"'
    path = model(tmp_path, mesh, 'type="capsule" mesh="m"', '<compiler fitaabb="true"/>')
    with pytest.raises(ValueError, match="must be positive"):
        mujoco.MjModel.from_xml_path(str(path))
    with pytest.raises(FileFormatError, match="mesh 'm', which is wider than long, so that no capsule fits; state"):
        fb.load(path)


@pytest.mark.parametrize(
    ("compiler", "file", "stands"),
    [
        ('meshdir="parts"', "wedge.obj", "parts/wedge.obj"),
        ('meshdir="parts" assetdir="other"', "wedge.obj", "parts/wedge.obj"),
        ('assetdir="parts"', "sub/wedge.obj", "parts/sub/wedge.obj"),
        ('strippath="true" meshdir="parts"', "away/wedge.obj", "parts/wedge.obj"),
        ("", "sub\\wedge.obj", "sub/wedge.obj"),
    ],
)
def test_mesh_folders_are_those_of_mujoco(tmp_path: Path, compiler: str, file: str, stands: str) -> None:
    path = obj(tmp_path, stands)
    twin = Twin(model(tmp_path, f'file="{file}"', more=f"<compiler {compiler}/>"))
    assert twin.chain.visuals[0].mesh == str(path)


def test_a_mesh_may_lie_beside_the_included_file_that_names_it(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    path = obj(tmp_path / "sub")
    model(tmp_path / "sub", f'file="{path.name}"')
    (tmp_path / "main.xml").write_text('<mujoco><include file="sub/m.xml"/></mujoco>')
    assert Twin(tmp_path / "main.xml").chain.visuals[0].mesh == str(path)
    obj(tmp_path)
    assert Twin(tmp_path / "main.xml").chain.visuals[0].mesh == str(tmp_path / path.name)


@pytest.mark.parametrize(
    "how", ["", 'scale="2 3 -4"', 'scale="2 2 2" refpos="1 2 3" refquat="1 2 3 4"', 'scale="2 2 3" refquat="1 0 0 1"']
)
def test_a_mesh_is_drawn_at_its_place_and_size(tmp_path: Path, how: str) -> None:
    """Scaled and placed, its points are MuJoCo's."""
    path = model(tmp_path, f'file="{obj(tmp_path).name}" {how}')
    (drawn,) = fb.load(path).visuals
    ours = POINTS * drawn.size @ drawn.placement[:3, :3].T + drawn.placement[:3, 3]
    m = mujoco.MjModel.from_xml_path(str(path))
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, m.geom_quat[0])
    theirs = m.mesh_vert @ R.reshape(3, 3).T + m.geom_pos[0]
    for point in theirs:
        assert np.linalg.norm(ours - point, axis=1).min() < 1e-6
    again = fb.load(fb.save(fb.load(path), tmp_path / "again", formats=("mjcf",))[0]).visuals[0]
    assert again.size == drawn.size
    np.testing.assert_allclose(again.placement, drawn.placement, atol=1e-14)


@pytest.mark.parametrize(
    ("mesh", "told"),
    [
        ('file="none.obj"', r"mesh 'm', which cannot be read \(there is no such file\)"),
        (f'file="{"x" * 300}.obj"', r"mesh 'm', which cannot be read \(there is no such file\)"),
        ('file="pointer.stl"', "mesh 'm', which is a git-lfs pointer, not the mesh; run git lfs pull"),
        ('file="wedge.msh"', "mesh 'm', which is not drawn: of .dae, .obj, .stl files alone"),
        (INLINE, "mesh 'm', which has no file and is not drawn"),
        ('builtin="sphere" params="1"', "mesh 'm', which has no file and no points"),
        ('file="wedge.obj" scale="1 2 3" refquat="1 1 0 1"', "mesh 'm', which is scaled along turned axes"),
    ],
)
def test_a_mesh_that_cannot_be_drawn_is_told_once(tmp_path: Path, mesh: str, told: str) -> None:
    obj(tmp_path), obj(tmp_path, "wedge.msh")
    (tmp_path / "pointer.stl").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    body = '<geom type="mesh" mesh="m" mass="0"/>'
    path = model(tmp_path, mesh, 'type="mesh" mesh="m" mass="0"', body=body + '<geom size="0.1"/>')
    with pytest.warns(LeftOutWarning, match=f"left out: {told}") as caught:
        chain = fb.load(path)
    assert str(caught[0].message).count("'m'") == 1
    assert [visual.shape for visual in chain.visuals] == ["sphere"]


@pytest.mark.parametrize(
    ("mesh", "geom", "message"),
    [
        ('file="none.obj"', "mesh", "has its mass from mesh 'm', which cannot be read (there is no such file"),
        ('file="pointer.stl"', "mesh", "which is a git-lfs pointer, not the mesh; run git lfs pull; state <inertial>"),
        ('file="junk.stl"', "mesh", "which cannot be read ("),
        ('file="none.obj"', "box", "has its mass from mesh 'm', which cannot be read (there is no such file"),
        ('vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="0 1 2 0 3 1 0 2 3 1 3 2" inertia="exact"', "mesh", "faced inwards"),
        ('vertex="0 0 0 1 0 0 0 1 0 1 1 0"', "mesh", "has no convex hull, as its points lie in a plane"),
        ('vertex="0 0 0 1"', "mesh", "mesh 'm': vertex and face must hold three numbers for each"),
        ('vertex="0 0 0 1 0 0" face="0 1 2"', "mesh", "mesh 'm': face must name points by whole numbers from 0 to 1"),
        ('vertex="0 0 0 1 0 0 2 0 0" face="0 1 0.5"', "mesh", "face must name points by whole numbers"),
        ('vertex="0 0 0 1 0 0 2 0 0" face="0 1 -1"', "mesh", "face must name points by whole numbers"),
        (f'{INLINE} inertia="solid"', "mesh", "Unknown inertia 'solid'; known: convex, exact, legacy, shell"),
        (f'{INLINE} scal="1"', "mesh", "Unknown attribute of <mesh> 'scal'"),
        (f'{INLINE}/><mesh name="m" {INLINE}', "mesh", "mesh 'm': is defined twice"),
    ],
)
@UNDRAWN
def test_a_mass_from_a_mesh_that_has_none_is_refused_by_name(
    tmp_path: Path, mesh: str, geom: str, message: str
) -> None:
    (tmp_path / "pointer.stl").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    (tmp_path / "junk.stl").write_text("junk\n")
    path = model(tmp_path, mesh, f'type="{geom}" mesh="m"')
    with pytest.raises(FileFormatError) as caught:
        fb.load(path)
    assert message in str(caught.value)


def test_a_mesh_that_may_not_be_read_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def closed(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(_meshes, "open", closed, raising=False)
    path = model(tmp_path, f'file="{obj(tmp_path).name}"', 'type="mesh" mesh="m" mass="0"', body='<geom size="0.1"/>')
    with pytest.warns(LeftOutWarning, match=r"mesh 'm', which cannot be read \(Permission denied\)"):
        fb.load(path)


def test_a_shape_fitted_to_a_mesh_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    """Where it is drawn: a hidden one of no mass needs no mesh."""
    path = model(tmp_path, 'file="none.obj"', 'type="box" mesh="m" mass="0"', body='<geom size="0.1"/>')
    with pytest.warns(LeftOutWarning, match=r"left out: mesh 'm', which cannot be read \(there is no such file"):
        fb.load(path)
    path.write_text(path.read_text().replace('mass="0"', 'mass="0" group="3"'))
    assert [visual.shape for visual in fb.load(path).visuals] == ["sphere"]


COLOURS = """<mujoco><default><material rgba="0.1 0.2 0.3 1"/><default class="red"><geom rgba="1 0 0 1"/></default>
<default class="hidden"><geom group="3"/></default></default>
<asset><material name="blue" rgba="0 0 1 1"/><material name="plain"/></asset><worldbody><body><joint/>
<geom size="0.1"/><geom size="0.1" material="blue"/><geom size="0.1" material="plain"/>
<geom size="0.1" material="blue" class="red"/><geom size="0.1" material="blue" rgba="0.5 0.5 0.5 1"/>
<geom size="0.1" class="hidden"/><geom size="0.1" group="2" rgba="0 1 0 0.5"/><geom size="0.1" rgba=""/></body>
</worldbody></mujoco>"""


def test_geoms_have_the_colours_of_mujoco_and_hidden_groups_are_not_drawn(tmp_path: Path) -> None:
    (tmp_path / "m.xml").write_text(COLOURS)
    m = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    grey = np.array([0.5, 0.5, 0.5, 1.0], np.float32)
    theirs = [
        m.mat_rgba[m.geom_matid[g]] if m.geom_matid[g] >= 0 and np.array_equal(m.geom_rgba[g], grey) else m.geom_rgba[g]
        for g in range(m.ngeom)
        if m.geom_group[g] <= 2
    ]
    np.testing.assert_allclose([visual.rgba for visual in fb.load(tmp_path / "m.xml").visuals], theirs, atol=1e-7)
    (tmp_path / "m.xml").write_text(COLOURS.replace('material="plain"', 'material="plane"'))
    with pytest.raises(FileFormatError, match=r"Unknown material 'plane'; known: blue, plain. Did you mean 'plain'\?"):
        fb.load(tmp_path / "m.xml")
