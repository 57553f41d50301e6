"""Contact pressure of bearings: the most loaded contact of balls, line contacts of rollers."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.model.bearing.hertz import race_contact
from thermospindle.model.bearing.pressure import of_rollers, pressures
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point


def test_at_rest_the_inner_race_is_pressed_more_and_at_speed_the_outer_one() -> None:
    """Both contacts bear the same at rest, where the inner race is bent away from the ball; centrifugal force presses the outer one."""
    spindle = load(ROOT / "scenes" / "five_bearing")
    b = spindle.bearing("front1")
    pressed = []
    for speed in (0.0, 12000 * RPM):
        point = operating_point(spindle, Condition(20.0, speed))
        state = point.state.bearing("front1")
        materials = [(m.youngs_modulus(20.0), m.poisson_ratio) for m in (point.spindle.materials[b.ball_material], point.spindle.materials[b.ring_material])]
        by_race = {}
        for inner, conformity, angle, force in (
            (True, b.inner_conformity, state.contact_angle, state.contact_force),
            (False, b.outer_conformity, state.outer_contact_angle, state.outer_contact_force),
        ):
            long, short = race_contact(b.ball_diameter, conformity, b.pitch_diameter, angle, inner, *materials).half_axes(force)
            by_race[inner] = 1.5 * force / (np.pi * long * short)
        assert pressures(point.spindle, point.state)["front1"] == pytest.approx(max(by_race.values()), rel=1e-12)
        pressed.append(by_race)
    assert pressed[0][True] > pressed[0][False]
    assert pressed[1][True] < pressed[1][False]


def test_line_contacts_of_rollers() -> None:
    """Of steel the half width is 3.35e-3 sqrt(Q / (l rho)) mm (Harris, Rolling Bearing Analysis, ch. 6), and p = 2 Q / (pi l b)."""
    spindle = load(ROOT / "scenes" / "tailstock")
    steel = replace(next(iter(spindle.materials.values())), poisson_ratio=0.3)
    steel = replace(steel, youngs_modulus=lambda temperature: 207e9)
    b = replace(spindle.roller_bearings[0], roller_diameter=10e-3, roller_length=9.6e-3, pitch_diameter=65e-3, roller_material="s", ring_material="s")
    force, curvature = 1589.0, 2 / 10 / (1 - 10 / 65)
    half = 3.35e-3 * np.sqrt(force / (9.6 * curvature))
    assert of_rollers(replace(spindle, materials={"s": steel}), b, force, 20.0) == pytest.approx(2e6 * force / (np.pi * 9.6 * half), rel=2e-3)
    assert of_rollers(replace(spindle, materials={"s": steel}), b, 0.0, 20.0) == 0.0


def test_tables_tell_it_of_what_rolls_and_say_the_limit(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["table", "tailstock", "--temperatures", "20", "40", "--json", "--out", str(tmp_path / "t")]) == 0
    told = json.loads(capsys.readouterr().out)["bearings"]
    assert all(0 < p < 4000 for b in told.values() for p in b["contact_pressure_MPa"])
    assert "contact_pressure_MPa" in (tmp_path / "t" / "table.csv").read_text(encoding="utf-8").splitlines()[2]
    assert main(["table", "tailstock", "--temperatures", "20", "40"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"rear1 {max(told['rear1']['contact_pressure_MPa']):.0f}" in said
    assert "the static limit of ISO 76 is 4200 MPa for ball bearings and 4000 MPa for roller bearings." in said
    assert main(["table", "mk7702", "--temperatures", "20"]) == 0
    assert "pressure" not in capsys.readouterr().out
