"""The hammer does not hit where the geometry file says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import RotorBase, point_row
from thermospindle.sim.effects.effect import Effect, Measurement, Parameter, Values, direction_parameter, hammer_numbers


def measurement(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase, measurement: Measurement) -> Measurement:
    offset = values["offset"] * 1e-3
    if offset == 0.0:
        return measurement
    direction = np.radians(values["direction"])
    aimed = [spindle.point(node) for node in spindle.hammer.hammer_nodes]
    missed = np.array([point_row(chain, off(p, offset, direction)) - point_row(chain, p) for p in aimed])
    if values["node"]:
        missed[hammer_numbers(spindle) != values["node"]] = 0.0
    return replace(measurement, reference_rows=measurement.reference_rows + missed)


def off(point: Point, offset: float, direction: float) -> Point:
    """The point moved by `offset` (m) on the face it lies on, at `direction` (rad) from the face's first towards its second axis.

    Where the hit is along z the axes are radial and tangential, where it is across z they are z and tangential.
    """
    place, hit = np.array(point.position), np.array(point.direction)
    angle = np.arctan2(place[1], place[0])
    tangential = np.array([-np.sin(angle), np.cos(angle), 0.0])
    first = np.array([np.cos(angle), np.sin(angle), 0.0]) if abs(hit[2]) > 0.5 else np.array([0.0, 0.0, 1.0])
    x, y, z = place + offset * (np.cos(direction) * first + np.sin(direction) * tangential)
    return replace(point, position=(float(x), float(y), float(z)))


EFFECT = Effect(
    name="hammer_position",
    title="The hammer hits beside its node",
    equation=(
        "force row b(p) -> b(p + offset (cos(direction) e_1 + sin(direction) e_2)), e_1 radial (z for hits across the axis), "
        "e_2 tangential: an axial hit at radius r gives force 1 and the moment r across it; "
        "residues A_r = phi_r (b^T phi_r), poles lambda_r as before"
    ),
    parameters=(
        Parameter(
            "offset",
            "mm",
            neutral=0.0,
            typical=2.0,
            prior_sd=1.5,
            limits=(-20.0, 20.0),
            meaning="distance of the mean impact from the node, the same at every node that is missed",
            source="assumed: hits by hand with a 2 to 5 mm tip scatter by a tip's width",
        ),
        direction_parameter(
            60.0, 180.0, "direction of the miss on the struck face: 0 outward (upward on a side face), 90 tangential, counterclockwise"
        ),
        Parameter(
            "node",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=1.0,
            limits=(0.0, 4.0),
            meaning="which hammer node is missed: 0 all of them, 1 the scene's first, or the first that a campaign's tests have, and so on",
            source="assumed: whoever hits beside one hits beside all",
            choices=(0.0, 1.0, 2.0, 3.0, 4.0),
        ),
    ),
    sees=(
        "residues of rocking modes off against axial ones, the same at all response points; reciprocity between hammer nodes fails; "
        "frequencies, damping and shapes are right"
    ),
    resembles=("sensor_gain",),
    valid="one mean position for all hits of a campaign; direction of the hit as drawn",
    measurement=measurement,
)
