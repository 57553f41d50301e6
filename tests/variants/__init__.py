"""Effects simulated a second time, by somebody else: simple physics, not the catalogue's formulas, and effects that are in no catalogue.

A diagnosis that only finds what its own formulas made has shown that it can invert itself. The hidden effects of `tests.blind_variants` come
from here instead. Every variant has one parameter, `size`; names are `effect/how`, and `outside/what` where no catalogue has the effect.

==========  =======================================================================
variant     what a variant is, and what several of them are built from
thermal     temperature and expansion
bearings    preload, clearance, contacts, film, bond
structure   joints, shaft, hub, masses
measuring   sensors, hammer, windows
outside     what no catalogue lists
==========  =======================================================================
"""

from tests.variants.bearings import OF_BEARINGS
from tests.variants.measuring import MEASURING
from tests.variants.outside import OUTSIDE
from tests.variants.structure import STRUCTURE
from tests.variants.thermal import THERMAL
from tests.variants.variant import PLAN, Variant

VARIANTS: tuple[Variant, ...] = (*THERMAL, *OF_BEARINGS, *STRUCTURE, *MEASURING, *OUTSIDE)

__all__ = ["PLAN", "VARIANTS", "Variant", "by_name"]


def by_name(name: str) -> Variant:
    for v in VARIANTS:
        if v.name == name:
            return v
    raise ValueError(f"no variant {name!r}; there are {', '.join(v.name for v in VARIANTS)}")
