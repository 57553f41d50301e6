"""The flange grows away from the shaft when warm: interference goes, and with it contact stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.structure import Joint
from thermospindle.sim.effects.effect import Effect, Parameter, Values
from thermospindle.sim.effects.roles import beyond, joints, lacking, regions

LOOSE = 0.02
"""Share of the contact stiffness that a fit without interference keeps: its screws or adhesive, and dirt."""


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    if values["contact_share"] == 0.0:
        return spindle
    lost = beyond(opening(spindle, condition.temperature) / (values["interference"] * 1e-6), values["closed"]) / (1 - values["closed"])
    added = values["contact_share"] * (1 / max(1 - lost, LOOSE) - 1)

    def loosened(joint: Joint) -> Joint:
        move, tilt = 1 / (1 + values["translation_share"] * added), 1 / (1 + added)
        rubbing = (joint.damping_ratio + values["loss_factor"] / 2 * added) * tilt if added > 0.0 else joint.damping_ratio
        return replace(joint.stiffer(move, tilt), damping_ratio=rubbing)

    structure = spindle.structure
    return replace(spindle, structure=replace(structure, joints=tuple(loosened(j) if j.role == "flange" else j for j in structure.joints)))


def idle(spindle: Spindle) -> str | None:
    if not joints(spindle, "flange"):
        return lacking("joint", "flange")
    found = fit(spindle)
    if found is None:
        return "no region with role 'shaft' stands in the bore of one with role 'support'"
    if found[0].material == found[1].material:
        return f"{found[0].name!r} and {found[1].name!r} are of one material, so their fit does not loosen"
    return None


def sized(spindle: Spindle) -> Mapping[str, float]:
    found = fit(spindle)
    return {} if found is None else {"interference": found[0].r[1] / 2.5e-3}  # of a fit on 5 mm; tolerances grow with the diameter


def opening(spindle: Spindle, temperature: float) -> float:
    """Diametral interference (m) lost between reference and `temperature`: bore growth less shaft growth; 0 without such a fit."""
    found = fit(spindle)
    if found is None:
        return 0.0
    inside, outside = (spindle.materials[g.material].thermal_strain(temperature, spindle.reference_temperature) for g in found)
    return 2 * found[0].r[1] * (outside - inside)


def fit(spindle: Spindle) -> tuple[Region, Region] | None:
    """The shaft's region (inside) and the support's (outside) that share the longest cylinder face, if any do."""
    pairs = [(g, s) for g in regions(spindle, "shaft") for s in regions(spindle, "support") if abs(g.r[1] - s.r[0]) < 1e-9]
    return max((p for p in pairs if _length(p) > 0), key=_length, default=None)


def _length(pair: tuple[Region, Region]) -> float:
    return min(g.z[1] for g in pair) - max(g.z[0] for g in pair)


EFFECT = Effect(
    name="flange_fit_loosening",
    title="The flange loosens on the shaft as it expands",
    equation=(
        "k(T) = k / (1 + a), a = contact_share (1 / rho - 1), rho = 1 - (x -+ closed) / (1 - closed), 1 within +- closed, "
        "x = d (eps_flange - eps_shaft) / interference, for tilts, translation_share a for translations; zeta -> (zeta + eta a / 2) / (1 + a) "
        "where looser; pressure of a press "
        "fit is proportional to its interference (Lame; Timoshenko & Goodier, Theory of Elasticity, 1970), contact stiffness of rough "
        "faces to pressure (Greenwood & Williamson, Contact of nominally flat surfaces, 1966); near rho = 0 the joint gives way"
    ),
    parameters=(
        Parameter(
            "contact_share",
            "1",
            neutral=0.0,
            typical=0.1,
            prior_sd=0.1,
            limits=(0.0, 0.9),
            meaning="share of the flange joint's compliance at the reference temperature that is that of the fit's contact",
            source="assumed: a tenth; joints are known to make up anything to half of a machine structure's compliance",
        ),
        Parameter(
            "interference",
            "um",
            neutral=7.0,
            typical=7.0,
            prior_sd=3.0,
            limits=(2.5, 60.0),
            meaning="interference on the diameter at the reference temperature; the fit is loose when expansion has used it up",
            source="a light press fit on 5 mm: H7/p6 to H7/s6, 0 to 27 um (ISO 286-2)",
        ),
        Parameter(
            "closed",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=0.2,
            limits=(0.0, 0.9),
            meaning="share of the interference that may change before the contact feels it",
            source="assumed: none; a contact pressed flat keeps its stiffness until its pressure is almost gone",
        ),
        Parameter(
            "translation_share",
            "1",
            neutral=1.0,
            typical=1.0,
            prior_sd=1.0,
            limits=(0.0, 1.0),
            meaning="how much of it translations feel: less than tilts where the fit opens at one end",
            source="assumed: all",
        ),
        Parameter(
            "loss_factor",
            "1",
            neutral=0.1,
            typical=0.1,
            prior_sd=0.1,
            limits=(0.0, 1.0),
            meaning="loss factor of the contact's added compliance: it rubs",
            source="bolted and fitted joints 0.01 to 0.2 (Beards, Damping in structural joints, Shock Vib. Digest, 1992)",
        ),
    ),
    sees="modes that strain the flange fall with temperature, more and more towards the fit's end, at any speed alike; rise when cold",
    resembles=("modulus_softening", "mount_compliance", "plate_prestress", "support_anisotropy"),
    valid=(
        "a section that draws both, of unlike expansion (nothing changes otherwise); no slip; without interference, screws and adhesive "
        "keep 2 % of the contact's stiffness"
    ),
    spindle=spindle,
    idle=idle,
    sized=sized,
)
