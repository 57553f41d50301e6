"""Words of the terminal as a page sets them."""

import re

import pytest

from tests.conftest import ROOT
from thermospindle.report.typeset import plain, plain_error, prose, signed, unit_cell, with_error

ROWS = [
    pytest.param("moves -27.0 +- 1.4 Hz", "moves −27.0 ± 1.4\u00a0Hz", id="signs and units"),
    pytest.param("error 1.47 -> 1.38", "error 1.47 → 1.38", id="arrow"),
    pytest.param("<b> & 'on'", "&lt;b&gt; &amp; &#39;on&#39;", id="escaped"),
    pytest.param("a pulse of 99.3 us, loose by 2 um, 3 N/um, us um", "a pulse of 99.3 µs, loose by 2 µm, 3\u00a0N/µm, us um", id="micro"),
    pytest.param("from 20 C to 44.1 C at C3", "from 20\u00a0°C to 44.1\u00a0°C at C3", id="degrees"),
    pytest.param("by -3 %: `draft --size -3 <x>` +- 1", "by −3\u00a0%: <code>draft --size -3 &lt;x&gt;</code> ± 1", id="code stays as typed"),
    pytest.param("20 (fo-fc) - fo, T20_n-1", "20 (fo-fc) - fo, T20_n-1", id="names stay"),
]


@pytest.mark.parametrize(("plain", "told"), ROWS)
def test_prose(plain, told):
    assert prose(plain) == told


def test_no_negative_zero():
    assert signed(-0.04) == signed(0.04) == signed(-0.0) == "+0.0"
    assert signed(-0.06) == "−0.1"


@pytest.mark.parametrize(
    ("value", "error", "told"),
    [
        (-0.001385, 0.0075, "-0.0014 +- 0.0075"),
        (0.02328, 45.2, "0 +- 45"),
        (12.0934, 0.512, "12.09 +- 0.51"),
        (1234.5, 1499.0, "1234 +- 1499"),
        (-1e-4, 0.5, "0.00 +- 0.50"),
        (0.123456, 0.0, "0.1235"),
    ],
)
def test_a_number_has_the_digits_that_its_error_leaves(value, error, told):
    assert plain_error(value, error) == told


@pytest.mark.parametrize(
    ("pair", "told"),
    [
        ((-0.004, 0.5), "0.0 <small>± 0.5</small>"),
        ((-27.04, 1.4), "−27.0 <small>± 1.4</small>"),
        ((1234.5, 30.0), "1234 <small>± 30</small>"),
        ((-0.01, 0.0), "0.0"),
        ((0.0123456, 3e-6), "0.012346 <small>± 0.000003</small>"),
        (None, "–"),
    ],
)
def test_a_number_of_a_page_has_the_digits_that_its_error_leaves(pair, told):
    assert str(with_error(pair)) == told


@pytest.mark.parametrize(("unit", "told"), [("1", ""), ("C", "°C"), ("um", "µm"), ("urad/(N m) per nm/N", "µrad/(N m) per nm/N"), ("N/um", "N/µm"), ("mm", "mm")])
def test_units_in_cells_have_their_signs(unit, told):
    assert unit_cell(unit) == told


def test_odds_have_no_powers_of_ten():
    assert [plain(x, 2) for x in (437.2, 3.21, 99_600.0)] == ["440", "3.2", "100000"]


def test_no_text_has_a_signed_nought_below_zero():
    """A difference of nothing is +0.0 wherever a sign is asked: the format's z says so."""
    texts = [file for file in sorted((ROOT / "report").rglob("*")) if file.suffix in (".py", ".j2")]
    assert len(texts) > 50
    assert [f"{file.name}: {found}" for file in texts for found in re.findall(r"\{[^{}]*:\+\.\d+f\}", file.read_text(encoding="utf-8"))] == []
