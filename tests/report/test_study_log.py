"""The Rerun log of a study: what is one condition is one colour."""

import numpy as np

from thermospindle.report.log.study import log


def test_a_mode_that_one_condition_has_is_coloured_as_it_everywhere(monkeypatch):
    """Modes that exist at 60 C alone had the colour of 20 C."""
    drawn: dict[tuple[str, str], object] = {}
    monkeypatch.setattr(log, "curve_look", lambda colour, condition, _: (tuple(colour), condition))
    monkeypatch.setattr(log, "log_curve", lambda _, entity, times, values, look: drawn.update({(entity, look[1]): look[0]}))
    values = (np.arange(3), np.arange(3.0))
    log._log_series(None, {"mode 1, Hz": {"20 C": values, "60 C": values}, "mode 7, Hz": {"60 C": values}, "preload": {"20 C": values}})
    cold, hot = ({colour for (_, at), colour in drawn.items() if at == condition} for condition in ("20 C", "60 C"))
    assert len(cold) == len(hot) == 1
    assert cold != hot
