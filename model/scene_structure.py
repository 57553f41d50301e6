"""The form of a scene file: the bodies of the structure and the joints between them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from model import machine as m
from model.file_table import MM, Finite, Name, NotNegative, Positive, Share, Table


class StructureBody(Table):
    name: Name
    mass_kg: Positive | None = None
    tilt_inertia_kg_m2: tuple[Positive, Positive] | None = None
    polar_inertia_kg_m2: Positive | None = None
    z_mm: Finite | None = None
    regions: list[str] = Field(default_factory=list)
    moves: list[Literal["x", "y", "z", "tilt_x", "tilt_y"]] = Field(min_length=1)
    turns: bool = False

    @model_validator(mode="after")
    def _inertia_given_once(self) -> StructureBody:
        if bool(self.regions) == (self.mass_kg is not None):
            raise ValueError("a body takes its inertia either from regions or from mass_kg and z_mm")
        if not self.regions and self.z_mm is None:
            raise ValueError("a body given by mass_kg needs z_mm")
        if not self.regions and {"tilt_x", "tilt_y"} & set(self.moves) and self.tilt_inertia_kg_m2 is None:
            raise ValueError("a body that tilts needs tilt_inertia_kg_m2")
        if self.turns and set(self.moves) != set(m.MOVES):
            raise ValueError("a body that turns must move in x, y, z, tilt_x and tilt_y")
        return self

    def body(self) -> m.Body:
        ix, iy = self.tilt_inertia_kg_m2 or (0.0, 0.0)
        inertia = (ix, iy, self.polar_inertia_kg_m2 or ix + iy)
        moves = tuple(name for name in m.MOVES if name in self.moves)
        return m.Body(self.name, self.mass_kg or 0.0, inertia, (self.z_mm or 0.0) * MM, moves, self.turns, tuple(self.regions))


class StructureJoint(Table):
    name: Name
    group: Name
    between: tuple[str, str]
    z_mm: Finite
    axial_stiffness_N_per_m: NotNegative = 0.0
    lateral_stiffness_N_per_m: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    tilt_stiffness_N_m_per_rad: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    damping_ratio: Share

    def joint(self) -> m.Joint:
        stiffness = (*self.lateral_stiffness_N_per_m, self.axial_stiffness_N_per_m, *self.tilt_stiffness_N_m_per_rad)
        return m.Joint(self.name, self.group, self.between, self.z_mm * MM, stiffness, self.damping_ratio)


class Structure(Table):
    inner_body: str
    outer_body: str
    damping_frequency_Hz: Positive
    bodies: list[StructureBody] = Field(min_length=2)
    joints: list[StructureJoint] = Field(min_length=1)

    def structure(self) -> m.Structure:
        bodies = tuple(b.body() for b in self.bodies)
        return m.Structure(bodies, tuple(j.joint() for j in self.joints), self.inner_body, self.outer_body, self.damping_frequency_Hz)
