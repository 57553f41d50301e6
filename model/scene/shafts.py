"""The form of a scene file: flexible shafts, as the diameters, or widths and heights, and lengths of a drawing from one end to the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate, pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, PrivateAttr, Strict, model_validator

from thermospindle.model.scene.fields import Name, NotNegative, Place, Positive, Share, Table, one_damping
from thermospindle.model.scene.section import Section, slabs
from thermospindle.model.shaft import THEORIES, Segment, Shaft, mesh
from thermospindle.model.structure import MOVES
from thermospindle.model.units import MM


def _piece(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if len(numbers) not in (2, 3):
        raise ValueError("a piece is [diameter, length] or [diameter at its start, at its end, length] in mm")
    if not 1e-3 <= numbers[-1] <= 1e4:
        raise ValueError(f"a piece is 0.001 to 10000 mm long, not {numbers[-1]:g}")
    return numbers


Piece = Annotated[tuple[NotNegative, ...], Strict(False), AfterValidator(_piece)]
"""[diameter, length], or [diameter at its start, diameter at its end, length] of a cone, in mm."""

def _side(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if len(numbers) != 2:
        raise ValueError("a piece of a rectangular section is [side, length] in mm, without taper")
    return _piece(numbers)


Side = Annotated[tuple[Positive, ...], Strict(False), AfterValidator(_side)]
"""[side, length] of a rectangular section, in mm."""

COARSE = 0.05
"""Longest element over the shaft's length where nobody says: twenty over a shaft, and the nodes that bearings and points need."""
DRAWN = ("material", "materials", "start_z_mm", "outer_mm", "bore_mm", "mass_outer_mm", "width_mm", "height_mm")
"""What draws a shaft, where regions of the section do not."""
FINEST = 500
"""Elements over a shaft's length that a scene may ask for: matrices are dense, and a frequency is
exact to all digits that are printed long before."""


class ShaftForm(Table):
    name: Name
    material: str = ""
    materials: Annotated[list[str], Field(max_length=300)] = Field(default_factory=list)
    regions: Annotated[list[str], Field(max_length=300)] = Field(default_factory=list)
    mass_regions: Annotated[list[str], Field(max_length=300)] = Field(default_factory=list)
    start_z_mm: Place = 0.0
    outer_mm: Annotated[list[Piece], Field(max_length=300)] = Field(default_factory=list)
    bore_mm: Annotated[list[Piece], Field(max_length=300)] = Field(default_factory=list)
    mass_outer_mm: Annotated[list[Piece], Field(max_length=300)] = Field(default_factory=list)
    width_mm: Annotated[list[Side], Field(max_length=300)] = Field(default_factory=list)
    height_mm: Annotated[list[Side], Field(max_length=300)] = Field(default_factory=list)
    moves: Annotated[list[Literal["x", "y", "z", "tilt_x", "tilt_y"]], Field(min_length=1)] = Field(default=["x", "y", "z", "tilt_x", "tilt_y"])
    turns: bool = False
    speed_ratio: Annotated[float, Field(ge=-100, le=100)] = 1.0
    beam: Literal["timoshenko", "rayleigh", "euler-bernoulli"] = "timoshenko"
    longest_element_mm: Positive | None = None
    damping_ratio: Share | None = None
    loss_factor: Share | None = None
    role: Literal["shaft", "housing"] | None = None
    _drawn_from: tuple[str, ...] = PrivateAttr(())

    @model_validator(mode="after")
    def _drawn_whole(self) -> ShaftForm:
        one_damping(self.damping_ratio, self.loss_factor)
        if self.regions:
            self._section_alone()
            return self
        self._one_section()
        self._one_material()
        length = self.length_mm
        whole, other = ("width_mm", "") if self.width_mm else ("outer_mm", ", with diameter 0 where there is no bore")
        for key in ("bore_mm", "mass_outer_mm", "height_mm"):
            pieces = getattr(self, key)
            own = sum(p[-1] for p in pieces)
            if pieces and abs(own - length) > 1e-6 * length:
                raise ValueError(f"{key} is {own:g} mm long and {whole} {length:g} mm; both must tell the whole shaft{other}")
        for key in ("outer_mm", "mass_outer_mm"):
            for piece in getattr(self, key):
                if min(piece[:-1]) <= 0:
                    raise ValueError(f"{key}: a diameter must be greater than 0, not {min(piece[:-1]):g}")
        if self.longest_element_mm is not None and length > FINEST * self.longest_element_mm:
            raise ValueError(f"longest_element_mm = {self.longest_element_mm:g}: more than {FINEST} elements over {length:g} mm; at least {length / FINEST:.4g} is allowed")
        for segment in self._segments():
            for k in (0, 1):
                if min(segment.outer[k], segment.mass_outer[k]) <= segment.bore[k]:
                    raise ValueError(
                        f"bore_mm: at z_mm = {segment.z[k] / MM:g} the bore of {2 * segment.bore[k] / MM:g} mm leaves nothing of a diameter of "
                        f"{2 * min(segment.outer[k], segment.mass_outer[k]) / MM:g} mm"
                    )
        if self.turns and set(self.moves) != set(MOVES):
            raise ValueError("a shaft that turns must move in x, y, z, tilt_x and tilt_y")
        if ("x" in self.moves) != ("tilt_y" in self.moves) or ("y" in self.moves) != ("tilt_x" in self.moves):
            raise ValueError("a shaft bends in a plane: x goes with tilt_y, and y with tilt_x")
        if self.turns and self.speed_ratio == 0.0:
            raise ValueError("speed_ratio = 0 does not turn; without turns = true the shaft stands")
        return self

    def _section_alone(self) -> None:
        """Refuses a shaft that is drawn twice, by regions of the section and by numbers of its own."""
        told = [key for key in DRAWN if key in self.model_fields_set]
        if told:
            raise ValueError(f"regions and {told[0]}: both told; a shaft of section regions has its heights, diameters and materials from there")

    def from_section(self, section: Section, densities: dict[str, float]) -> ShaftForm:
        """A shaft told by regions as one told by diameters and lengths; any other as it is. Densities (kg/m3) are by material."""
        if not self.regions:
            if self.mass_regions:
                raise ValueError("mass_regions goes with regions; beside outer_mm the diameters that carry mass are mass_outer_mm")
            return self
        cut = slabs(section, densities, self.regions, self.mass_regions, self.turns)
        drawn = {
            "start_z_mm": cut[0].z[0],
            "outer_mm": [[s.outer, s.length] for s in cut],
            "bore_mm": [[s.bore, s.length] for s in cut],
            "mass_outer_mm": [[s.mass_outer, s.length] for s in cut],
            "materials": [s.material for s in cut],
        }
        told = self.model_dump(include=self.model_fields_set - {"regions", "mass_regions"})
        shaft = ShaftForm.model_validate(told | drawn)
        shaft._drawn_from = (*self.regions, *self.mass_regions)
        return shaft

    def _one_section(self) -> None:
        """Refuses a shaft that is neither round nor rectangular, or both, and one that turns and is not as stiff in all directions."""
        if bool(self.outer_mm) == bool(self.width_mm) or bool(self.width_mm) != bool(self.height_mm):
            told = [key for key in ("outer_mm", "width_mm", "height_mm") if getattr(self, key)]
            raise ValueError(
                f"{' and '.join(told) or 'no section'} told; allowed are outer_mm alone, or width_mm (along x) with height_mm (along y) of a rectangular section, "
                "or regions of the drawn section"
            )
        for key in ("bore_mm", "mass_outer_mm"):
            if self.width_mm and getattr(self, key):
                raise ValueError(f"{key} is of a round section; a rectangular one, of width_mm and height_mm, is solid")
        if self.width_mm and self.turns and any(s.sides is None or s.sides[0] != s.sides[1] for s in self._segments()):
            raise ValueError(
                "width_mm and height_mm of a shaft that turns must be the same: a flat one is stiffer one way than the other, which turns with it, "
                "and here stiffness stands still; allowed is a flat shaft without turns = true"
            )

    def _one_material(self) -> None:
        """Refuses a shaft that is neither of one material nor of one for each of its pieces, or both."""
        key, pieces = ("width_mm", self.width_mm) if self.width_mm else ("outer_mm", self.outer_mm)
        if bool(self.material) == bool(self.materials):
            raise ValueError(f"material and materials: {'both' if self.material else 'neither'} told; allowed is material of the whole shaft, or materials with a name for each piece of {key}")
        if self.materials and len(self.materials) != len(pieces):
            raise ValueError(f"materials has {len(self.materials)} names; allowed is one for each of the {len(pieces)} pieces of {key}")

    @property
    def length_mm(self) -> float:
        return sum(p[-1] for p in self.outer_mm or self.width_mm)

    def _segments(self) -> tuple[Segment, ...]:
        """The pieces of all lists, cut where any of them changes; of a rectangular section the radii are half of the width."""
        lists: dict[str, Sequence[tuple[float, ...]]] = {"outer": self.outer_mm or self.width_mm, "bore": self.bore_mm or [(0.0, self.length_mm)]}
        lists["mass_outer"] = self.mass_outer_mm or lists["outer"]
        if self.height_mm:
            lists["height"] = self.height_mm
        spans = {key: _spans(pieces) for key, pieces in lists.items()}
        ends = [b for _, b, _, _ in spans["outer"]]
        cuts = sorted({round(z, 9) for pieces in spans.values() for a, b, _, _ in pieces for z in (a, b)})
        found = []
        for low, high in pairwise(cuts):
            if high - low < 1e-6:
                continue
            at = {key: _at(pieces, low, high) for key, pieces in spans.items()}
            z = (self.start_z_mm + low) * MM, (self.start_z_mm + high) * MM
            sides = (2 * at["outer"][0], 2 * at["height"][0]) if self.height_mm else None
            piece = next((k for k, end in enumerate(ends) if (low + high) / 2 < end), len(ends) - 1)
            found.append(Segment(z, at["outer"], at["bore"], at["mass_outer"], self.material or self.materials[piece], sides))
        return tuple(found)

    def ends(self) -> tuple[float, float]:
        """Heights (m) of its ends."""
        return self.start_z_mm * MM, (self.start_z_mm + self.length_mm) * MM

    def shaft(self, heights: Sequence[float]) -> Shaft:
        """The shaft, with nodes at all of `heights` (m) that lie on it, and where a rectangular section changes."""
        segments, (low, high) = self._segments(), self.ends()
        longest = COARSE * (high - low) if self.longest_element_mm is None else self.longest_element_mm * MM
        shear, rotary = THEORIES[self.beam]
        return Shaft(
            name=self.name,
            segments=segments,
            nodes=mesh(segments, [*heights, *(s.z[1] for s in segments if s.sides)], longest),
            turns=self.turns,
            speed_ratio=self.speed_ratio,
            damping_ratio=self.damping_ratio or 0.0,
            loss_factor=self.loss_factor or 0.0,
            role=self.role or "",
            shear=shear,
            rotary=rotary,
            moves=tuple(name for name in MOVES if name in self.moves),
            regions=self._drawn_from,
        )


def _spans(pieces: Sequence[Sequence[float]]) -> list[tuple[float, float, float, float]]:
    """Start, end (mm from the shaft's start) and radii (m) at both of every piece."""
    ends = list(accumulate(p[-1] for p in pieces))
    return [(end - p[-1], end, p[0] * MM / 2, p[-2] * MM / 2) for p, end in zip(pieces, ends, strict=True)]


def _at(pieces: Sequence[tuple[float, float, float, float]], low: float, high: float) -> tuple[float, float]:
    """Radii (m) at two places within one piece."""
    middle = (low + high) / 2
    a, b, first, last = next((p for p in pieces if p[0] <= middle <= p[1]), pieces[-1])
    return first + (last - first) * (low - a) / (b - a), first + (last - first) * (high - a) / (b - a)


def resolved_body(shafts: Mapping[str, Shaft], name: str, z: float) -> str:
    """The body that a scene means by a name at a height (m): the shaft's node there, or the body itself."""
    return shafts[name].node_at(z) if name in shafts else name
