"""From a laboratory's own files to a verdict: imported as a user would, diagnosed by the verb, on
FRFs whose lines and noise are not the program's own."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import SCENE
from tests.virtual_campaign import drawn, noisy
from thermospindle.cli import main
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.model.units import RPM
from thermospindle.report.verbs import diagnose as verb
from thermospindle.sim.campaign.campaign import Noise
from thermospindle.sim.effects import by_name
from thermospindle.sim.operating import operating_point

RESPONSES, HAMMERS = (1, 2, 4, 6), (1, 2)
LAG = 0.3  # of the hub behind the chamber, hidden
TESTS = ((20.0, 0.0), (40.0, 0.0), (60.0, 0.0), (60.0, 7200.0))


def exact(spindle: Spindle, frequency: Array, seed: int, tests: Sequence[tuple[float, float]], lag: float = LAG) -> list[ComplexArray]:
    """Mobilities (responses, hammers, n) of a spindle off its drawing, with a hub that lags."""
    errors, effect, built = drawn(spindle, len(tests), seed), by_name("soak_lag"), spindle
    for parameter, error in zip(toleranced(spindle), errors.build, strict=True):
        built = parameter.apply(built, error)
    nodes = [p.node for p in spindle.points]
    chosen = np.ix_([nodes.index(n) for n in RESPONSES], [spindle.hammer.hammer_nodes.index(n) for n in HAMMERS])
    effects = [(effect, effect.typical() | {"hub_share": lag})] if lag else []
    found = []
    for (temperature, rpm), warmer in zip(tests, errors.warmer, strict=True):
        point = operating_point(built, Condition(temperature + warmer, rpm * RPM), effects)
        found.append(point.frf(frequency)[chosen] * np.exp(errors.gain[[nodes.index(n) for n in RESPONSES]])[:, None, None])
    return found


def written(folder: Path, frequency: Array, measured: Sequence[ComplexArray], unit: str, tests: Sequence[tuple[float, float]]) -> Path:
    """Text files of a laboratory, one a test, and the mapping that tells what they do not; the
    campaign that `spindle import` makes of them."""
    mapping = 'spindle = "hdd_2003"\n'
    for k, ((temperature, rpm), value) in enumerate(zip(tests, measured, strict=True)):
        heads, columns = ["Frequency [Hz]"], [frequency]
        for i, response in enumerate(RESPONSES):
            for j, hammer in enumerate(HAMMERS):
                heads += [f"H({response},{hammer}) {part} [{unit}]" for part in ("real", "imag")]
                columns += [value[i, j].real, value[i, j].imag]
        np.savetxt(folder / f"lab{k}.csv", np.array(columns).T, "%.9g", ",", header=",".join(heads), comments="")
        mapping += f'[[files]]\nfile = "lab{k}.csv"\ntest = "lab{k}"\n[[tests]]\nid = "lab{k}"\ntemperature_C = {temperature}\nspeed_rpm = {rpm}\n'
    (folder / "lab.toml").write_text(mapping, encoding="utf-8")
    files = [str(folder / f"lab{k}.csv") for k in range(len(tests))]
    assert main(["import", *files, "--scene", str(SCENE), "--mapping", str(folder / "lab.toml"), "--out", str(folder / "campaign")]) == 0
    return folder / "campaign"


def diagnosed(campaign: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    capsys.readouterr()
    assert main(["diagnose", str(SCENE), str(campaign), "--json"]) == 0
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


def integrated(spindle: Spindle, random: np.random.Generator) -> tuple[Array, list[ComplexArray], str]:
    """Accelerometers whose signals were integrated: the noise of an acceleration, the same at every line, falls as the frequency rises."""
    frequency = np.arange(400.0, 6000.1, 8.0)
    s = 2j * np.pi * frequency
    return frequency, [noisy(h * s, random, Noise(0.004, 0.0005)) / s for h in exact(spindle, frequency, 3, TESTS)], "(m/s)/N"


def acceleration(spindle: Spindle, random: np.random.Generator) -> tuple[Array, list[ComplexArray], str]:
    """Accelerances as an accelerometer gives them, in g."""
    frequency = np.arange(400.0, 6000.1, 8.0)
    s = 2j * np.pi * frequency
    return frequency, [noisy(h * s, random, Noise(0.004, 0.0005)) / 9.80665 for h in exact(spindle, frequency, 3, TESTS)], "g/N"


def sweep(spindle: Spindle, random: np.random.Generator) -> tuple[Array, list[ComplexArray], str]:
    """A stepped sine whose lines stand in equal ratios."""
    frequency = np.geomspace(400.0, 6000.0, 900)
    return frequency, [noisy(h, random) for h in exact(spindle, frequency, 4, TESTS)], "(m/s)/N"


@pytest.mark.slow
@pytest.mark.parametrize("laboratory", [integrated, acceleration, sweep], ids=lambda f: f.__name__)
def test_a_hub_that_lags_is_named_from_their_files(
    laboratory: Callable[..., tuple[Array, list[ComplexArray], str]], spindle: Spindle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frequency, measured, unit = laboratory(spindle, np.random.default_rng(5))
    answer = diagnosed(written(tmp_path, frequency, measured, unit, TESTS), capsys)
    assert (answer["verdict"], answer["effects"]) == ("identified", ["soak_lag"])
    share = answer["candidates"][0]["parameters"]["soak_lag.hub_share"]
    assert share["value"] == pytest.approx(LAG, abs=max(4 * share["sd"], 0.03))
    error = answer["error"]
    assert error["after"] < 1.5
    assert error["held_out_gain"] > 100
    assert error["held_out_after"] < 1.2 < error["held_out_before"]  # four tests alone leave drift enough to hide the lag in what is fitted
    assert answer["warnings"] == []


def test_lines_of_the_running_speed_are_said_and_cost_nothing(spindle: Spindle, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Unbalance stands at multiples of the speed in the FRFs of one test: the verb names them and
    the test, and the verdict is as if they were not."""
    lag = by_name("soak_lag")
    monkeypatch.setattr(verb, "with_effects", lambda scene, files: (spindle, (lag,)))
    tests = ((20.0, 0.0), (60.0, 7200.0))
    frequency, random = np.arange(400.0, 3000.1, 8.0), np.random.default_rng(6)
    measured = [noisy(h, random) for h in exact(spindle, frequency, 2, tests, lag=0.0)]
    hit = np.isclose(frequency % 120.0, 0.0)
    measured[1][:, :, hit] += 0.3 * np.abs(measured[1]).max()
    answer = diagnosed(written(tmp_path, frequency, measured, "(m/s)/N", tests), capsys)
    (warning,) = answer["warnings"]
    assert "tests.lab1: lines of the running speed stand in the FRFs, at" in warning
    assert (answer["verdict"], answer["effects"]) == ("none", [])
    assert answer["error"]["before"] < 1.5


@pytest.mark.slow
def test_a_sensor_that_one_test_has_reversed_is_said_beside_the_verdict(
    spindle: Spindle, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Glued on the other way between cold and hot: whatever the verdict, it is of a mistake in measuring."""
    lag = by_name("soak_lag")
    monkeypatch.setattr(verb, "with_effects", lambda scene, files: (spindle, (lag,)))
    tests = ((20.0, 0.0), (60.0, 7200.0))
    frequency, random = np.arange(400.0, 3000.1, 8.0), np.random.default_rng(6)
    measured = [noisy(h, random) for h in exact(spindle, frequency, 2, tests, lag=0.0)]
    measured[1][3] *= -1
    (warning,) = diagnosed(written(tmp_path, frequency, measured, "(m/s)/N", tests), capsys)["warnings"]
    assert warning.startswith(f"test lab1: the FRFs of response {RESPONSES[3]} (seat90) have the other sign")
