"""What headings, units and names of files tell."""

from __future__ import annotations

import pytest

from thermospindle.sim.importing import units
from thermospindle.sim.importing.files.labels import role_of
from thermospindle.sim.importing.names import conditions_of, plain


@pytest.mark.parametrize(
    ("text", "found"),
    [("m/s^2/N", ("accelerance", 1.0)), ("(1/N)*(m/s²)", ("accelerance", 1.0)), ("(m/s²)(N)", ("accelerance", 1.0)), ("1/kg", ("accelerance", 1.0)),
     ("mm/s/N", ("mobility", 1e-3)), ("µm/kN", ("receptance", 1e-9)), ("N/m", None), ("V/N", None), ("m/s�/N", ("accelerance", 1.0))],
)  # fmt: skip
def test_units_of_frfs(text, found):
    assert units.of_frf(text) == (found if found is None else (found[0], pytest.approx(found[1])))


@pytest.mark.parametrize(
    ("heading", "kind", "part", "ends", "unit"),
    [
        ("H(3,1) real [g/N]", "H", "real", ("3", "1"), "g/N"), ("Re H(3:+X, 1)", "H", "real", ("3:+X", "1"), ""), ("FRF(hub, seat) dB", "H", "decibel", ("hub", "seat"), ""),
        ("Magnitude", "H", "magnitude", ("", ""), ""), ("Coherence(3,1)", "coherence", "", ("3", "1"), ""), ("Frequency (Hz)", "frequency", "", ("", ""), "Hz"),
        ("force [N]", "force", "", ("", ""), "N"), ("force 1:-X [N]", "force", "", ("", "1:-X"), "N"), ("acceleration 3:+Y [m/s2]", "response", "", ("3:+Y", ""), "m/s2"),
        ("response 3Z", "response", "", ("3:+Z", ""), ""), ("acc_3", "response", "", ("3", ""), ""), ("acceleration 3 [g]", "response", "", ("3", ""), "g"), ("Time [s]", "time", "", ("", ""), "s"),
        ("frequency_kHz", "frequency", "", ("", ""), "kHz"), ("f_Hz", "frequency", "", ("", ""), "Hz"), ("time_ms", "time", "", ("", ""), "ms"),
        ("hub/seat mag [um/N]", "H", "magnitude", ("hub", "seat"), "um/N"), ("3+Z/1+Z Phase (deg)", "H", "phase", ("3:+Z", "1:+Z"), "deg"),
        ("Acceleration/Force Magnitude [g/N]", "H", "magnitude", ("", ""), "g/N"), ("H(3,1) mag [dB]", "H", "decibel", ("3", "1"), ""),
        ("H(3,1) [dB re 1 µm/N]", "H", "decibel", ("3", "1"), "µm/N"), ("H(3,1) dB (dB ref 1e-6 m/N)", "H", "decibel", ("3", "1"), "m/N"),
        ("FRF-2 real", "H", "real", ("FRF-2", ""), ""), ("H21", "H", "complex", ("2", "1"), ""), ("H_12_3 imag [g/N]", "H", "imaginary", ("12", "3"), "g/N"),
    ],
)  # fmt: skip
def test_headings(heading, kind, part, ends, unit):
    role = role_of(heading)
    assert role is not None
    assert (role.kind, role.part, role.unit) == (kind, part, unit)
    assert (role.response.label, role.reference.label) == ends


def test_what_0_dB_are_of_a_unit_counts():
    assert (role_of("H(3,1) [dB re 1e-6 m/N]").level, role_of("H(3,1) [dB re 1 µm/N]").level) == (1e-6, 1.0)


@pytest.mark.parametrize(
    ("name", "told"),
    [("Spindel_20C_0rpm", (20, 0)), ("T60_n7200", (60, 7200)), ("warm 41.5deg 3600 rpm", (41.5, 3600)), ("20_C_standstill", (20, 0)), ("test_4", (None, None)),
     ("run_20_0", (None, None)), ("n3_T20", (20, None)), ("n10_T20_n7200", (20, None)), ("20C_warmed_to_60C_n0", (None, 0))],
)  # fmt: skip
def test_what_names_tell(name, told):
    found = conditions_of(plain(name))
    assert (found.get("temperature_C"), found.get("speed_rpm")) == told
