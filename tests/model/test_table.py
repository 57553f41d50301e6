"""The stiffness table: its CSV reads back, and it answers inside its grid only."""

import json
import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.model.bearing.ball_row import respond
from thermospindle.model.errors import BadInput, NoEquilibrium, OutsideRange
from thermospindle.model.files.stiffness_table import BETWEEN, BY_DIRECTION, COLUMNS, read_table, write_table
from thermospindle.model.machine import Condition
from thermospindle.model.scene.bearing_numbers import Numbers
from thermospindle.model.scene.reading import build, load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point, stiffness_table, unloads


@pytest.fixture(scope="module")
def table(spindle):
    return stiffness_table(spindle, [60.0, 20.0, 40.0, 30.0, 50.0], [0.0, 754.0])


def test_reads_back_what_was_written(table, tmp_path):
    write_table(table, tmp_path / "table.csv")
    again = read_table(tmp_path / "table.csv")
    assert np.array_equal(again.temperature, [20, 30, 40, 50, 60])
    assert again.speed == pytest.approx(table.speed, rel=1e-12)
    assert again.provenance == table.provenance
    assert {"scene_hash", "mujoco", "thermospindle"} <= set(again.provenance)
    for name, columns in table.values.items():
        for column in COLUMNS:
            assert np.array_equal(again.values[name][column], columns[column])
    header = (tmp_path / "table.csv").read_text().splitlines()[2].split(",")
    assert header[:4] == ["bearing", "temperature_C", "speed_rpm", "contact_angle_deg"]


def test_outer_contacts_carry_the_centrifugal_force_too(table, tmp_path):
    """At rest both contacts of a ball carry the same; at 12,000 rpm those of a machine tool's light
    front rows the outer one twice as much. A table without the column is read."""
    at_rest = table.values["upper"]
    assert at_rest["outer_contact_force_N"] == pytest.approx(at_rest["contact_force_N"], rel=1e-12)
    fast = stiffness_table(load(ROOT / "scenes" / "five_bearing"), [20.0], [12000 * RPM]).values["front1"]
    inner, outer = (fast[f"{side}contact_force_N"][0, 0] for side in ("", "outer_"))
    angles = [np.radians(fast[f"{side}contact_angle_deg"][0, 0]) for side in ("", "outer_")]
    assert outer > 2 * inner
    assert outer * np.sin(angles[1]) == pytest.approx(inner * np.sin(angles[0]), rel=0.2)  # axial, but for the friction of the gyroscopic moment
    write_table(table, tmp_path / "new.csv")
    rows = [line.split(",") for line in (tmp_path / "new.csv").read_text(encoding="utf-8").splitlines()[2:]]
    gone = rows[0].index("outer_contact_force_N")
    head = (tmp_path / "new.csv").read_text(encoding="utf-8").splitlines()[:2]
    (tmp_path / "old.csv").write_text("\n".join([*head, *(",".join(c for i, c in enumerate(row) if i != gone) for row in rows)]) + "\n", encoding="utf-8")
    old = read_table(tmp_path / "old.csv").values["upper"]
    assert "outer_contact_force_N" not in old
    assert old["contact_force_N"] == pytest.approx(at_rest["contact_force_N"], rel=1e-12)


def test_a_bearing_under_a_radial_load_is_told_along_x_and_along_y(table, tmp_path, capsys):
    """Derivatives of the forces of its balls; a table of it as a bearing of numbers has them too.
    Without the load no column tells directions apart."""
    assert not any(set(BY_DIRECTION) & set(columns) for columns in table.values.values())
    folder = tmp_path / "pushed"
    folder.mkdir()
    text = (ROOT / "scenes" / "five_bearing" / "spindle.toml").read_text(encoding="utf-8")
    pushed = text.replace("ball_inertia = 1.0", "ball_inertia = 1.0\nradial_load_N = [1200.0, 900.0]\nradial_load_z_mm = 0.0")
    (folder / "spindle.toml").write_text(pushed, encoding="utf-8")
    assert main(["table", str(folder), "--temperatures", "20", "--json", "--out", str(tmp_path / "out")]) == 0
    told = {key: values[0] for key, values in json.loads(capsys.readouterr().out)["bearings"]["front1"].items()}
    state = operating_point(load(folder), Condition(20.0)).state.bearing("front1")
    at, step = np.array(state.displacement), 1e-9

    def force(moved):
        """The mean over sixteen places of the cage, for some balls are let go."""
        found = []
        for turn in 2 * np.pi / state.row.balls * np.arange(16) / 16:
            c, s = np.cos(turn), np.sin(turn)
            turned = np.eye(5)
            turned[:2, :2] = turned[3:, 3:] = [[c, s], [-s, c]]
            found.append(turned.T @ respond(state.row, turned @ moved).force)
        return np.mean(found, axis=0)

    slopes = [(force(at + d) - force(at - d)) / (2 * step) for d in step * np.eye(5)]
    assert told["radial_stiffness_N_per_m"] == pytest.approx(slopes[0][0], rel=1e-5)
    assert told["radial_stiffness_y_N_per_m"] == pytest.approx(slopes[1][1], rel=1e-5)
    assert told["radial_stiffness_xy_N_per_m"] == pytest.approx(slopes[1][0], rel=1e-4)
    assert abs(slopes[0][0] / slopes[1][1] - 1) > 0.01
    assert main(["table", str(folder), "--temperatures", "20"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"radial stiffness along x {slopes[0][0] / 1e6:.2f} N/um, along y {slopes[1][1] / 1e6:.2f} N/um" in said
    assert "radial y" in said
    assert read_table(tmp_path / "out" / "table.csv").values["front1"]["radial_stiffness_y_N_per_m"][0, 0] == told["radial_stiffness_y_N_per_m"]
    stiffness = np.reshape(Numbers(table="table.csv", bearing="front1", damping_ratio=0.0).grid(tmp_path / "out" / "spindle.toml", "table")[2], (5, 5))
    assert stiffness[:2, :2] == pytest.approx(state.stiffness[:2, :2], rel=1e-12)
    assert np.diag(stiffness) == pytest.approx(np.diag(state.stiffness), rel=1e-12)


@pytest.fixture(scope="module")
def grinding(tmp_path_factory):
    """A grinding spindle, 300 N on its wheel: its front row is coupled in every way."""
    folder = tmp_path_factory.mktemp("grinding")
    text = (ROOT / "scenes" / "templates" / "grinding.toml").read_text(encoding="utf-8")
    (folder / "spindle.toml").write_text(f"ball_inertia = 1.0\nradial_load_N = [280.0, -110.0]\nradial_load_z_mm = 8.0\n{text}", encoding="utf-8")
    return folder


def test_a_table_of_a_loaded_bearing_holds_its_whole_stiffness(grinding, tmp_path):
    """Read back as a bearing of numbers it is the same matrix at every condition of the grid;
    without the columns between directions it was another, by up to 0.47 of sqrt(k_ii k_jj) here."""
    spindle, temperatures, speeds = load(grinding), [20.0, 40.0], [0.0, 10_000 * RPM]
    found = stiffness_table(spindle, temperatures, speeds)
    write_table(found, tmp_path / "table.csv")
    assert set(BETWEEN) < set(read_table(tmp_path / "table.csv").values["front"])
    largest = 0.0
    for name in found.values:
        _, _, flat = Numbers(table="table.csv", bearing=name, damping_ratio=0.0).grid(tmp_path / "spindle.toml", "table")
        for i, t in enumerate(temperatures):
            for j, speed in enumerate(speeds):
                own = operating_point(spindle, Condition(t, speed)).state.bearing(name).stiffness
                scale = np.sqrt(np.outer(np.diag(own), np.diag(own)))
                assert np.reshape(flat, (2, 2, 5, 5))[i, j] / scale == pytest.approx(own / scale, abs=1e-12)
                largest = max(largest, max(abs(own[at]) / scale[at] for at in BETWEEN.values()))
    assert largest > 0.4


def test_json_has_what_a_load_couples(grinding, capsys):
    """Force along the first direction of a name for a motion along the second."""
    assert main(["table", str(grinding), "--temperatures", "20", "--json"]) == 0
    told = {key: values[0] for key, values in json.loads(capsys.readouterr().out)["bearings"]["front"].items()}
    state = operating_point(load(grinding), Condition(20.0)).state.bearing("front")
    at, steps = np.array(state.displacement), np.diag([1e-9, 1e-9, 1e-9, 1e-7, 1e-7])
    slopes = np.array([(respond(state.row, at + d).force - respond(state.row, at - d).force) / (2 * d.sum()) for d in steps]).T
    for column, place in BETWEEN.items():
        assert told[column] == pytest.approx(slopes[place], abs=1e-4 * np.sqrt(slopes[place[0], place[0]] * slopes[place[1], place[1]]))
    assert main(["table", str(grinding), "--temperatures", "20"]) == 0
    assert "as k_xz, is in table.csv" in capsys.readouterr().out


def test_centred_rows_have_no_further_columns(table):
    """What sums over the balls round to is nothing."""
    assert not any(set(BETWEEN) & set(columns) for columns in table.values.values())


def test_a_matrix_that_differs_in_tilts_alone_is_told(tmp_path):
    """As stiff along x as along y, but not about them: a table took the one about x for both."""
    matrix = np.diag([2e7, 2e7, 1e7, 5e3, 9e3])
    matrix[3, 4] = matrix[4, 3] = 1e3
    text = (ROOT / "scenes" / "mk7702" / "spindle.toml").read_text(encoding="utf-8")
    raw = tomllib.loads(text)
    name = next(iter(raw["bearings"]))
    raw["bearings"][name]["numbers"] = {"matrix_SI": matrix.tolist(), "damping_ratio": 0.02}
    write_table(stiffness_table(build(raw, ROOT / "scenes" / "mk7702" / "spindle.toml"), [20.0]), tmp_path / "table.csv")
    assert np.reshape(Numbers(table="table.csv", bearing=name, damping_ratio=0.0).grid(tmp_path / "spindle.toml", "table")[2], (5, 5)) == pytest.approx(matrix, rel=1e-15)


def test_answers_between_grid_points(table, spindle):
    exact = stiffness_table(spindle, [45.0])
    for column in ("preload_N", "radial_stiffness_N_per_m", "contact_angle_deg"):
        assert table.at("upper", column, 45.0) == pytest.approx(exact.at("upper", column, 45.0), rel=1e-3)
        assert table.at("upper", column, 40.0) == pytest.approx(table.values["upper"][column][2, 0], rel=1e-12)


@pytest.mark.parametrize(("temperature", "speed", "said"), [(61.0, 0.0, "20 to 60 C"), (19.0, 0.0, "19 C"), (40.0, 800.0, "rpm")])
def test_nothing_outside_the_grid(table, temperature, speed, said):
    with pytest.raises(OutsideRange, match=said):
        table.at("lower", "preload_N", temperature, speed)


def test_says_where_a_bearing_unloads(spindle):
    """Preload falls to nothing between 120 and 180 C; the state just below still carries, the one above does not."""
    table = stiffness_table(spindle, [100.0, 140.0, 180.0])
    where = table.unloads["upper"]
    assert 100 < where < 180
    below, above = (stiffness_table(spindle, [t]).values["upper"]["contact_force_N"][0, 0] for t in (where - 0.01, where + 0.01))
    assert below > 0
    assert above == 0


def test_says_on_which_side_a_bearing_is_loose(spindle):
    """Also where the search for the temperature meets rings that nothing holds, as between 140 and 150 C; and where no temperature was asked
    at which there is contact, of which the lowest one is told. Colder rings that let go get their contact in the warmth."""
    table = stiffness_table(spindle, [140.0, 150.0])
    assert table.unloads["upper"] == pytest.approx(stiffness_table(spindle, [20.0, 150.0]).unloads["upper"], abs=2e-3)
    assert table.loose("upper") == "above"
    none = stiffness_table(spindle, [150.0, 160.0])
    assert (none.unloads["upper"], none.loose("upper")) == (150.0, "throughout")
    assert stiffness_table(spindle, [20.0, 60.0]).loose("upper") == ""
    force = {"contact_force_N": np.array([[0.0], [3.0]])}
    assert replace(none, values={"upper": force}).loose("upper") == "below"


def test_a_state_that_is_not_found_for_another_reason_is_no_contact_lost(monkeypatch):
    """A bearing that loses contact at 57 C, and states of 31 to 33 C that no search finds: 31 C was told."""

    def point(_, condition, *rest):
        if 31 < condition.temperature < 33:
            raise NoEquilibrium("ball centres did not settle")
        pressed = 1e-9 * (57 - condition.temperature) ** 3
        return SimpleNamespace(condition=condition, state=SimpleNamespace(bearing=lambda name: SimpleNamespace(in_contact=pressed > 0, deformation=pressed)))

    ends = [point(None, Condition(t)) for t in (4.0, 60.0)]
    monkeypatch.setattr("thermospindle.sim.operating.operating_point", point)
    with pytest.raises(NoEquilibrium, match="did not settle"):
        unloads(None, ends, "upper")
    ends = [point(None, Condition(t)) for t in (40.0, 60.0)]
    assert unloads(None, ends, "upper") == pytest.approx(57.0, abs=2e-3)


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "# provenance: {}\n# unloads_C: {}\nbearing,temperature_C\nupper,x\n"])
def test_other_files_are_refused(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(BadInput, match="not a stiffness table"):
        read_table(path)


def test_an_endless_cell_is_refused(tmp_path):
    """Longer than what Python's reader of CSV takes."""
    path = tmp_path / "table.csv"
    path.write_text("# provenance: {}\n# unloads_C: {}\nbearing,temperature_C\nupper," + "1" * 200_000)
    with pytest.raises(BadInput, match="not a stiffness table"):
        read_table(path)


def test_no_grid_is_made_of_rows_that_do_not_fill_it(table, tmp_path):
    """A row at each of 30,000 temperatures, each with another speed: a grid of them takes 70 GB."""
    path = tmp_path / "table.csv"
    write_table(table, path)
    lines = path.read_text().splitlines()
    name, _, _, rest = lines[3].split(",", 3)
    path.write_text("\n".join([*lines[:3], *(f"{name},{k},{k},{rest}" for k in range(30_000))]))
    with pytest.raises(BadInput, match="gaps"):
        read_table(path)


@pytest.mark.parametrize(("line", "text"), [(0, "# provenance: 3"), (1, '# unloads_C: ["upper"]'), (1, '# unloads_C: {"upper": "60"}')])
def test_what_a_table_says_of_itself_is_checked(table, tmp_path, line, text):
    path = tmp_path / "table.csv"
    write_table(table, path)
    lines = path.read_text().splitlines()
    lines[line] = text
    path.write_text("\n".join(lines))
    with pytest.raises(BadInput, match="first two lines"):
        read_table(path)


def test_gaps_are_refused(table, tmp_path):
    path = tmp_path / "table.csv"
    write_table(table, path)
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:5] + lines[6:]))
    with pytest.raises(BadInput, match="gaps"):
        read_table(path)
