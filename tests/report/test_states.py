"""What titles say of a state of equilibrium."""

import pytest

from thermospindle.model.bearing.pair import IN_CONTACT
from thermospindle.report.text.states import of_bearings


@pytest.mark.parametrize(("status", "told"), [(IN_CONTACT, "bearings in contact"), ("lower and upper bearing lost contact", "lower and upper bearing lost contact")])
def test_a_title_names_bearings_once(status, told):
    assert of_bearings(status) == told
