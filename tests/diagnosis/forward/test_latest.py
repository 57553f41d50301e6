"""What is kept of what was worked out last."""

import pytest

from thermospindle.diagnosis.forward.latest import Latest


def test_what_was_not_asked_for_the_longest_gives_way():
    worked_out, kept = [], Latest(2)

    def asked(key):
        return kept.of(key, lambda: worked_out.append(key) or 10 * key)

    assert [asked(key) for key in (1, 2, 1, 3, 1, 2)] == [10, 20, 10, 30, 10, 20]
    assert worked_out == [1, 2, 3, 2]


def test_what_cannot_be_worked_out_is_not_kept():
    kept = Latest(2)
    with pytest.raises(ZeroDivisionError):
        kept.of("a", lambda: 1 / 0)
    assert kept.of("a", lambda: 1.0) == 1.0
