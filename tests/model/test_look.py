"""The cut-away meshes are closed and true to the section, and dressing a MuJoCo model changes nothing but its looks."""

import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.bearing.pair import solve
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.machine import Condition
from thermospindle.model.rotor import mjcf
from thermospindle.model.rotor.chain import rotor_base
from thermospindle.model.rotor.elements import ELEMENTS
from thermospindle.model.rotor.look import colours, dress
from thermospindle.model.rotor.look import meshes as solids
from thermospindle.model.rotor.modes import modes
from thermospindle.model.rotor.section import Cell, cells
from thermospindle.model.scene.reading import load

KEPT = 0.75  # of the circle
ROUND = [Cell("a", (0.0, 1.0), (0.0, 2.0)), Cell("a", (1.0, 2.0), (1.0, 2.0))]  # a shaft with a collar
FRAME = [Cell("a", (1.0 + i, 2.0 + i), (j, j + 1.0)) for i in range(3) for j in range(3) if (i, j) != (1, 1)]


def volume(vertices, triangles) -> float:
    """Divergence theorem; positive when the triangles are seen counterclockwise from outside."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    return float(np.sum(np.cross(a, b) * c) / 6)


def ring_volume(tiles) -> float:
    return sum(np.pi * (t.r[1] ** 2 - t.r[0] ** 2) * (t.z[1] - t.z[0]) for t in tiles)


def assert_closed(triangles) -> None:
    """Every edge belongs to two triangles that run along it in opposite directions."""
    edges = Counter((int(t[i]), int(t[(i + 1) % 3])) for t in triangles for i in range(3))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)


@pytest.fixture(scope="module")
def meshes(spindle):
    return solids.region_meshes(spindle)


@pytest.fixture(scope="module")
def spinning(spindle):
    """At 7200 rpm and the reference temperature."""
    return solve(spindle, Condition(20.0, 7200 * np.pi / 30), {b.name: reference_motion(20.0) for b in spindle.bearings})


def dressed(spindle, state, element="linear"):
    out = mjcf.spec(spindle, state, element)
    dress.dress(out, spindle, state)
    return out


# ---------------------------------------------------------------- meshes


@pytest.mark.parametrize("tiles", [ROUND, FRAME, FRAME[:1]], ids=["on-the-axis", "with-a-hollow", "ring"])
@pytest.mark.parametrize("angles", [solids.CUT, (0.1, 0.2)], ids=["cut-away", "sliver"])
def test_revolved_rectangles_are_closed_and_have_their_volume(tiles, angles):
    vertices, triangles, patches = solids.revolve(tiles, *angles)
    assert_closed(triangles)
    assert volume(vertices, triangles) == pytest.approx((angles[1] - angles[0]) / (2 * np.pi) * ring_volume(tiles), rel=1e-12)
    assert len(patches) == len(triangles)


def test_splitting_a_rectangle_leaves_its_mesh_alone():
    """Lines that other regions draw through a region do not add triangles to it."""
    halves = [Cell("a", (1.0, 2.0), (0.0, 0.3)), Cell("a", (1.0, 2.0), (0.3, 1.0))]
    for one, two in zip(solids.revolve([Cell("a", (1.0, 2.0), (0.0, 1.0))]), solids.revolve(halves), strict=True):
        np.testing.assert_array_equal(one, two)


def test_regions_are_closed_and_fill_their_part_of_the_section(spindle, meshes):
    tiles = [t for part in ("stationary", "rotating") for t in cells([g for g in spindle.regions if g.part == part])]
    assert [m.region for m in meshes] == [g.name for g in spindle.regions]
    for mesh in meshes:
        assert_closed(mesh.triangles)
        own = [t for t in tiles if t.region == mesh.region]
        assert volume(mesh.vertices, mesh.triangles) == pytest.approx(KEPT * ring_volume(own), rel=1e-12), mesh.region
        assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(max(t.z[1] for t in own) - min(t.z[0] for t in own))


@pytest.mark.parametrize("body", ["shaft", "hub"])
def test_meshes_weigh_what_their_body_weighs(spindle, meshes, body):
    density = {g.name: spindle.materials[g.material].density for g in spindle.regions}
    mass = sum(density[m.region] * volume(m.vertices, m.triangles) for m in meshes if m.body == body)
    assert mass == pytest.approx(KEPT * spindle.structure.body(body).mass, rel=1e-12)


def test_the_quarter_cut_away_is_empty_and_no_point_lies_in_it(spindle, meshes):
    gap = solids.CUT[1], solids.CUT[0] + 2 * np.pi
    everything = np.concatenate([m.vertices for m in meshes])
    everything = everything[np.hypot(everything[:, 0], everything[:, 1]) > 0]
    for x, y, _ in [*everything, *(p.position for p in spindle.points)]:
        azimuth = (np.arctan2(y, x) - gap[0]) % (2 * np.pi) + gap[0]
        assert not gap[0] + 1e-9 < azimuth < gap[1] - 1e-9


def test_shading_is_smooth_round_the_axis_and_sharp_elsewhere(meshes):
    for mesh in meshes:
        vertices, triangles, normals = mesh.shaded()
        a, b, c = (vertices[triangles[:, i]] for i in range(3))
        flat = np.cross(b - a, c - a)
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        assert np.min(np.einsum("tci,ti->tc", normals[triangles], flat)) > np.cos(solids.STEP)
        assert volume(vertices, triangles) == pytest.approx(volume(mesh.vertices, mesh.triangles))
        upright = np.abs(flat[:, 2]) < 0.5
        assert np.all(normals[triangles[upright], 2] == 0)


# ---------------------------------------------------------------- bodies and colours


def test_regions_hang_on_the_body_they_move_with(spindle):
    hosts = colours.region_bodies(spindle)
    assert all(hosts[region] == body.name for body in spindle.structure.bodies for region in body.regions)
    assert hosts["base disc"] == hosts["flange boss"] == "seat"  # the shaft's flange joins it to the seat
    assert [m.body for m in solids.plate_meshes(spindle)] == ["base"]
    assert [m.body for m in solids.stripe_meshes(spindle)] == ["hub"]


def test_without_a_seat_regions_are_part_of_the_body_they_touch(spindle):
    structure = replace(spindle.structure, joints=tuple(j for j in spindle.structure.joints if j.name != "flange"))
    hosts = colours.region_bodies(replace(spindle, structure=structure))
    assert hosts["base disc"] == hosts["flange boss"] == "shaft"


def test_regions_that_touch_nothing_stay_with_the_rings_of_their_part(spindle):
    far = [replace(spindle.regions[0], name=part, part=part, r=(0.1, 0.2)) for part in ("stationary", "rotating")]
    hosts = colours.region_bodies(replace(spindle, regions=(*spindle.regions, *far)))
    assert (hosts["stationary"], hosts["rotating"]) == ("shaft", "hub")


def test_the_plate_holds_its_points_on_top(spindle):
    (plate,) = solids.plate_meshes(spindle)
    assert_closed(plate.triangles)
    x, y, z = spindle.point(7).position
    radius = np.hypot(*plate.vertices[:, :2].T)
    assert radius.min() < np.hypot(x, y) < radius.max()
    assert plate.vertices[:, 2].max() == pytest.approx(z)


def test_a_body_whose_points_lie_on_the_axis_is_a_disc_of_its_inertia():
    """A wheel or a collet hit in its middle: a ring as wide as its points would have no width, and MuJoCo refuses it."""
    wheeled = load(ROOT / "scenes" / "templates" / "grinding.toml")
    (plate,) = (m for m in solids.plate_meshes(wheeled) if m.body == "wheel")
    assert_closed(plate.triangles)
    body = wheeled.structure.body("wheel")
    assert np.hypot(*plate.vertices[:, :2].T).max() == pytest.approx(np.sqrt(2 * body.inertia[2] / body.mass), rel=0.01)


def test_touching_regions_of_one_material_differ_in_shade(spindle, meshes):
    tone = {m.region: m.rgba for m in meshes}
    for one, other in (
        ("sleeve", "hub body"),
        ("sleeve", "hub plate"),
        ("base disc", "flange boss"),
        ("shaft", "lower inner ring"),
    ):
        assert tone[one] != tone[other]
    assert tone["hub body"] == tone["hub plate"]  # they do not touch
    assert all(0 <= value <= 1 for rgba in tone.values() for value in rgba)


def test_a_material_without_a_colour_gets_one_of_its_own():
    assert colours.colour("zirconia") == colours.colour("zirconia") != colours.colour("brass")
    assert colours.colour("steel") == colours.COLOURS["steel"]


# ---------------------------------------------------------------- the MuJoCo model


def test_enumerations_are_those_of_mujoco():
    assert mujoco.mjtGeom.mjGEOM_SPHERE == dress.SPHERE
    assert mujoco.mjtGeom.mjGEOM_MESH == dress.MESH
    assert mujoco.mjtTexture.mjTEXTURE_SKYBOX == dress.SKYBOX
    assert mujoco.mjtBuiltin.mjBUILTIN_GRADIENT == dress.GRADIENT


@pytest.mark.parametrize("element", ELEMENTS)
def test_dressing_leaves_masses_and_matrices_bit_for_bit(spindle, spinning, element):
    bare = mjcf.spec(spindle, spinning, element).compile()
    model = dressed(spindle, spinning, element).compile()
    assert model.ngeom > len(spindle.regions)
    for name in ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "dof_M0", "site_pos", "key_qvel"):
        np.testing.assert_array_equal(getattr(model, name), getattr(bare, name), err_msg=name)
    for one, other in zip(mjcf.linearise(bare).__dict__.values(), mjcf.linearise(model).__dict__.values(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_geoms_touch_nothing_and_lie_where_the_section_lies(spindle, cold, meshes):
    model = dressed(spindle, cold).compile()
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for mesh in meshes:
        geom = model.geom(mesh.region)
        assert model.body(geom.bodyid[0]).name == mesh.body
        low, high = in_world(model, data, mesh.region)
        np.testing.assert_allclose([low, high], [mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)], atol=1e-8)


def in_world(model, data, name):
    """Smallest and largest corner of a mesh geom's vertices (m); MuJoCo keeps them about the mesh's own centre."""
    geom = model.geom(name)
    start, count = (int(a[geom.dataid[0]]) for a in (model.mesh_vertadr, model.mesh_vertnum))
    vertices = model.mesh_vert[start : start + count] @ data.geom_xmat[geom.id].reshape(3, 3).T + data.geom_xpos[geom.id]
    return vertices.min(axis=0), vertices.max(axis=0)


def test_the_hub_turns_and_the_balls_do_not_turn_with_it(spindle, cold):
    model = dressed(spindle, cold).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before = data.geom_xpos.copy()
    data.joint("hub.spin").qpos[0] = np.pi / 2
    mujoco.mj_forward(model, data)
    for i in range(model.ngeom):
        quarter = np.array([-before[i, 1], before[i, 0], before[i, 2]])
        turns = model.body(model.geom_bodyid[i]).name == "hub"
        np.testing.assert_allclose(data.geom_xpos[i], quarter if turns else before[i], atol=1e-9)
    assert model.body(model.geom("hub stripe").bodyid[0]).name == "hub"


def test_balls_sit_between_their_grooves(spindle, hot):
    model = dressed(spindle, hot).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for bearing in spindle.bearings:
        balls = [model.geom(f"{bearing.name} ball {j}") for j in range(bearing.balls)]
        at = np.array([data.geom_xpos[ball.id] for ball in balls])
        np.testing.assert_allclose(np.hypot(at[:, 0], at[:, 1]), bearing.pitch_diameter / 2, atol=10e-6)  # grooves differ by 10 um
        np.testing.assert_allclose(at[:, 2], bearing.z, atol=10e-6)
        assert {float(ball.size[0]) for ball in balls} == {bearing.ball_diameter / 2}


def test_balls_that_lost_contact_are_shown_in_another_colour(spindle, cold):
    lower, upper = cold.bearings
    state = replace(cold, bearings=(lower, replace(upper, in_contact=False)))
    model = dressed(spindle, state).compile()
    np.testing.assert_allclose(model.geom("lower ball 0").rgba[:3], colours.BALL, rtol=1e-6)
    np.testing.assert_allclose(model.geom("upper ball 0").rgba[:3], colours.LOOSE_BALL, rtol=1e-6)


# ---------------------------------------------------------------- the file


@pytest.mark.parametrize("element", ELEMENTS)
def test_the_xml_is_one_file_with_the_same_spindle_in_it(spindle, spinning, element, tmp_path):
    out = dressed(spindle, spinning, element)
    text = mjcf.xml(out)
    assert " file=" not in text
    file = tmp_path / "spindle.xml"
    file.write_text(text, encoding="utf-8")
    model, straight = mujoco.MjModel.from_xml_path(str(file)), out.compile()
    assert (model.ngeom, model.nmesh, model.ncam, model.nlight) == (
        straight.ngeom,
        straight.nmesh,
        straight.ncam,
        straight.nlight,
    )
    data, reference = mujoco.MjData(model), mujoco.MjData(straight)
    mujoco.mj_forward(model, data)
    mujoco.mj_forward(straight, reference)
    for mesh in (*solids.region_meshes(spindle), *solids.plate_meshes(spindle), *solids.stripe_meshes(spindle)):
        np.testing.assert_allclose(in_world(model, data, mesh.region), in_world(straight, reference, mesh.region), atol=1e-7)
    np.testing.assert_allclose(data.cam_xmat, reference.cam_xmat, atol=1e-5)
    chain = rotor_base(spindle, spinning)
    found, wanted = ([m.frequency for m in modes(chain, mjcf.linearise(x))] for x in (model, straight))
    np.testing.assert_allclose(found, wanted, rtol=1e-9)


SEEN = """
import sys
try:
    import mujoco
    mujoco.GLContext(8, 8).free()
except Exception:
    sys.exit(77)
model = mujoco.MjModel.from_xml_path(sys.argv[1])
renderer = mujoco.Renderer(model, 300, 400)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer.enable_segmentation_rendering()
for camera in ("front", "close"):
    renderer.update_scene(data, camera)
    seen = {(int(i), int(kind)) for i, kind in renderer.render().reshape(-1, 2)}
    print(",".join(model.geom(i).name for i, kind in seen if kind == mujoco.mjtObj.mjOBJ_GEOM))
"""


def test_the_cameras_see_every_part(spindle, cold, tmp_path):
    """Drawn offscreen in another process, because MuJoCo chooses its OpenGL when it is imported."""
    file = tmp_path / "spindle.xml"
    file.write_text(mjcf.xml(dressed(spindle, cold)), encoding="utf-8")
    run = [sys.executable, "-c", SEEN, str(file)]
    done = subprocess.run(run, env={"MUJOCO_GL": "egl"}, cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False)
    if done.returncode == 77:
        pytest.skip("no OpenGL here")
    assert done.returncode == 0, done.stderr
    front, close = (set(line.split(",")) for line in done.stdout.splitlines())
    parts = {g.name for g in spindle.regions} | {"hub stripe"}
    assert parts | {"base plate"} <= front
    assert parts <= close
    for bearing in spindle.bearings:
        balls = {f"{bearing.name} ball {j}" for j in range(bearing.balls)}
        assert len(balls & front) >= 4
        assert len(balls & close) >= 4
