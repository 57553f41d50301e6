"""The form of a scene file: the bodies of the structure and the joints between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field, Strict, model_validator

from thermospindle.model import structure as m
from thermospindle.model.scene.fields import Both, Name, NotNegative, Once, Place, Positive, Share, Table, TwoNames, one_damping
from thermospindle.model.shaft import Shaft
from thermospindle.model.units import MM

Mass = Annotated[float, Field(ge=1e-9, le=1e9)]
Inertia = Annotated[float, Field(ge=1e-14, le=1e12)]  # MuJoCo wants more than 1e-15


class StructureBody(Table):
    name: Name
    mass_kg: Mass | None = None
    tilt_inertia_kg_m2: Annotated[tuple[Inertia, Inertia], Strict(False)] | None = None
    polar_inertia_kg_m2: Inertia | None = None
    z_mm: Place | None = None
    regions: list[str] = Field(default_factory=list)
    moves: Annotated[list[Literal["x", "y", "z", "tilt_x", "tilt_y"]], Field(min_length=1), Once]
    turns: bool = False
    role: Literal["base", "seat", "shaft", "hub", "housing"] | None = None
    speed_ratio: Annotated[float, Field(ge=-100, le=100)] = 1.0

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
        if self.turns and not self.regions and self.polar_inertia_kg_m2 is None:
            raise ValueError("a body that turns needs polar_inertia_kg_m2, which makes its gyroscopic moment")
        if self.tilt_inertia_kg_m2 is not None and self.polar_inertia_kg_m2 is not None:
            low, middle, high = sorted((*self.tilt_inertia_kg_m2, self.polar_inertia_kg_m2))
            if high > (low + middle) * (1 + 1e-9):
                raise ValueError(
                    f"no body has tilt_inertia_kg_m2 = {list(self.tilt_inertia_kg_m2)} with polar_inertia_kg_m2 = "
                    f"{self.polar_inertia_kg_m2:g}; each of the three must be at most the sum of the others"
                )
        return self

    def body(self) -> m.Body:
        ix, iy = self.tilt_inertia_kg_m2 or (0.0, 0.0)
        inertia = (ix, iy, self.polar_inertia_kg_m2 or ix + iy)  # nothing feels the polar one of a body that does not turn
        moves = tuple(name for name in m.MOVES if name in self.moves)
        return m.Body(
            name=self.name,
            mass=self.mass_kg or 0.0,
            inertia=inertia,
            z=(self.z_mm or 0.0) * MM,
            moves=moves,
            turns=self.turns,
            regions=tuple(self.regions),
            role=self.role or "",
            speed_ratio=self.speed_ratio,
        )


class StructureJoint(Table):
    name: Name
    group: Name
    between: TwoNames
    z_mm: Place
    axial_stiffness_N_per_m: NotNegative = 0.0
    lateral_stiffness_N_per_m: Both = (0.0, 0.0)
    tilt_stiffness_N_m_per_rad: Both = (0.0, 0.0)
    damping_ratio: Share | None = None
    loss_factor: Share | None = None
    role: Literal["mount", "plate", "flange", "holder"] | None = None
    material: str = ""

    @model_validator(mode="after")
    def _damped_once(self) -> StructureJoint:
        one_damping(self.damping_ratio, self.loss_factor)
        return self

    def joint(self) -> m.Joint:
        stiffness = (*self.lateral_stiffness_N_per_m, self.axial_stiffness_N_per_m, *self.tilt_stiffness_N_m_per_rad)
        return m.Joint(
            name=self.name,
            group=self.group,
            bodies=self.between,
            z=self.z_mm * MM,
            stiffness=stiffness,
            damping_ratio=self.damping_ratio or 0.0,
            loss_factor=self.loss_factor or 0.0,
            role=self.role or "",
            material=self.material,
        )


class Structure(Table):
    inner_body: str | None = None
    outer_body: str | None = None
    damping_frequency_Hz: Positive
    bodies: list[StructureBody] = Field(default_factory=list)
    joints: list[StructureJoint] = Field(default_factory=list)

    def structure(self, shafts: Sequence[Shaft] = ()) -> m.Structure:
        """With joints on the nodes of `shafts` where they name those; nodes and elements come in `model.rotor.beam`."""
        by_name = {s.name: s for s in shafts}

        def body(name: str, z: float) -> str:
            return by_name[name].node_at(z) if name in by_name else name

        joints = (j.joint() for j in self.joints)
        return m.Structure(
            bodies=tuple(b.body() for b in self.bodies),
            joints=tuple(replace(j, bodies=(body(j.bodies[0], j.z), body(j.bodies[1], j.z))) for j in joints),
            damping_frequency=self.damping_frequency_Hz,
            inner_body=self.inner_body or "",
            outer_body=self.outer_body or "",
            shafts=tuple(shafts),
        )
