"""The workbench's settings as plain values: actions, undo, redo, the ladder, ends of sliders. No page, nothing computed."""

from dataclasses import replace

import pytest

from thermospindle.report.workbench import state
from thermospindle.report.workbench.state import Session, Setting
from thermospindle.sim.effects import by_name

BOND, LOSS = by_name("bond_softening"), by_name("preload_loss")


def test_an_effect_comes_with_typical_values_and_its_size_to_be_fitted():
    s = state.add_effect(Setting(), BOND)
    assert s.effects == {"bond_softening": BOND.typical()}
    assert s.free == {"bond_softening.hot_compliance"}
    assert state.add_effect(s, BOND) is s


def test_given_values_are_kept_within_the_limits():
    s = state.add_effect(Setting(), LOSS, {"loss": 7.0})
    assert s.effects["preload_loss"] == {"loss": 0.8, "thermal_share": 0.5, "set": -1.0}


def test_an_action_leaves_the_setting_before_it_as_it_was():
    first = state.add_effect(Setting(), LOSS)
    then = state.set_deviation(state.set_value(first, "preload_loss", "loss", 0.3), "preload", 0.02)
    assert first.effects["preload_loss"]["loss"] == 0.15
    assert first.deviations == {}
    assert then.effects["preload_loss"]["loss"] == 0.3
    assert then.deviations == {"preload": 0.02}
    assert state.set_deviation(then, "preload", 0.0).deviations == {}


@pytest.mark.parametrize(
    "action",
    [
        lambda s: state.set_value(s, "preload_loss", "loss", 0.15),
        lambda s: state.set_deviation(s, "preload", 0.0),
        lambda s: state.leave_out(s, []),
        lambda s: state.set_free(s, "preload_loss.loss", True),
        lambda s: state.remove_effect(s, "shear"),
    ],
)
def test_what_changes_nothing_gives_the_same_object(action):
    s = state.add_effect(Setting(), LOSS)
    assert action(s) is s


def test_an_unknown_parameter_is_an_error():
    with pytest.raises(KeyError):
        state.set_value(state.add_effect(Setting(), LOSS), "preload_loss", "los", 0.1)


def test_removed_effects_leave_nothing_to_be_fitted():
    s = state.set_free(state.add_effect(Setting(), LOSS), "preload", True)
    s = state.remove_effect(state.set_free(s, "preload_loss.thermal_share", True), "preload_loss")
    assert s == Setting(free=frozenset({"preload"}))


def test_named_values_go_where_they_belong():
    s = state.set_named(state.add_effect(Setting(), LOSS), {"preload_loss.loss": 0.4, "hub mass": -0.01})
    assert (s.effects["preload_loss"]["loss"], s.deviations) == (0.4, {"hub mass": -0.01})


def test_undo_and_redo_walk_through_what_was_done():
    session = Session()
    settings = [state.set_deviation(Setting(), "preload", x) for x in (0.01, 0.02, 0.03)]
    for s in settings:
        session = state.do(session, s)
    back = state.undo(state.undo(session))
    assert back.now == settings[0]
    assert state.redo(state.redo(back)) == session
    assert state.redo(session) is session
    assert state.undo(state.undo(back)) == state.undo(back)
    assert state.undo(back).now == Setting()


def test_keys_pressed_in_a_row_are_one_step():
    session = state.do(Session(), state.set_deviation(Setting(), "preload", 0.01))
    again = state.amend(state.amend(session, state.set_deviation(Setting(), "preload", 0.02)), state.set_deviation(Setting(), "preload", 0.03))
    assert again.now.deviations == {"preload": 0.03}
    assert state.undo(again).now == Setting()
    assert state.amend(again, again.now) is again
    assert state.undo(state.amend(Session(), again.now)).now == Setting(), "the first step is one in any case"


def test_something_new_after_undo_ends_what_could_be_redone():
    session = state.undo(state.do(Session(), state.set_deviation(Setting(), "preload", 0.01)))
    session = state.do(session, state.set_deviation(Setting(), "hub mass", 0.01))
    assert session.future == ()
    assert state.do(session, session.now) is session


def test_undo_remembers_so_many():
    session = Session()
    for k in range(state.MOST + 50):
        session = state.do(session, state.set_deviation(Setting(), "preload", 1e-4 * (k + 1)))
    assert len(session.past) == state.MOST


def test_steps_are_kept_once_and_taken_up_again():
    session = state.keep(Session(), 98.6, None)
    assert state.keep(session, 98.6, None) is session
    session = state.do(session, state.add_effect(Setting(), BOND))
    session = state.keep(session, 0.7, 0.9)
    assert [r.name for r in session.ladder] == ["1: the scene as it was opened", "2: bond_softening 12.5"]
    again = state.take_up(session, 0)
    assert again.now == Setting()
    assert state.undo(again).now == session.now
    assert again.ladder == session.ladder


def test_words_of_a_setting():
    s = state.add_effect(Setting(deviations={"preload": -0.03}), LOSS)
    assert state.words(s) == "preload_loss 0.15, preload -3.00%"
    assert state.words(replace(s, deviations={"a": 0.1, "b": 0.1, "c": 0.1})) == "preload_loss 0.15, 3 tolerances"


@pytest.mark.parametrize("effect", ["bond_softening", "preload_loss", "magnetic_pull", "ball_inertia", "added_disk"])
def test_sliders_hold_neutral_and_typical_within_the_limits(effect):
    for p in by_name(effect).parameters:
        low, high = state.span(p)
        assert p.limits[0] <= low <= min(p.neutral, p.typical) <= max(p.neutral, p.typical) <= high <= p.limits[1]
        assert low < high
        assert state.span(p, p.limits[1])[1] == p.limits[1]


def test_the_slider_of_a_tolerance_reaches_three_standard_deviations_and_what_was_fitted():
    assert state.span_of_tolerance(0.03) == (-0.09, 0.09)
    assert state.span_of_tolerance(0.03, 0.2) == (-0.09, 0.2)
    assert state.span_of_tolerance(0.9) == state.FURTHEST
