"""Words of the terminal as a page sets them."""

import pytest

from thermospindle.report.typeset import prose, signed

ROWS = [
    pytest.param("moves -27.0 +- 1.4 Hz", "moves −27.0 ± 1.4\u00a0Hz", id="signs and units"),
    pytest.param("error 1.47 -> 1.38", "error 1.47 → 1.38", id="arrow"),
    pytest.param("<b> & 'on'", "&lt;b&gt; &amp; &#39;on&#39;", id="escaped"),
    pytest.param("20 (fo-fc) - fo, T20_n-1", "20 (fo-fc) - fo, T20_n-1", id="names stay"),
]


@pytest.mark.parametrize(("plain", "told"), ROWS)
def test_prose(plain, told):
    assert prose(plain) == told


def test_no_negative_zero():
    assert signed(-0.04) == signed(0.04) == signed(-0.0) == "+0.0"
    assert signed(-0.06) == "−0.1"
