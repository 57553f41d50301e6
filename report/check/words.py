"""What the program understood of a scene, in the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Console

from thermospindle.model.errors import listed
from thermospindle.model.units import small_length
from thermospindle.report.text.grid import show_grid

NOTABLE = 0.005
"""Of a stiffness, from which it is worth a sentence that the place of a cage changes it."""
LEFT_OUT = "the motion that the changing stiffness itself makes is left out"


def show_check(console: Console, values: Mapping[str, Any]) -> None:
    """The answer of `check` for a person: sentences, then tables of bearings, shafts and points, then what is assumed and what is odd."""
    console.print(values["title"], style="bold", markup=False, highlight=False)
    for sentence in sentences(values):
        console.print(sentence, markup=False, highlight=False)
    for title, head, rows in grids(values):
        console.print()
        show_grid(console, title, head, rows, words=[h for k, h in enumerate(head) if of_words(rows, k)])
    _list(console, "Assumed, where the scene says nothing", [f"{a['key']}: {a['what']}" for a in values["assumed"]] or ["nothing"])
    _list(console, "Odd", values["odd"] or ["nothing"])


def sentences(values: Mapping[str, Any]) -> list[str]:
    """What the whole is, in a few sentences."""
    turning, standing = values["parts"]["turning"], values["parts"]["standing"]
    low, high = values["temperature_range_C"]
    geared = {name: r for kind in ("shafts", "bodies") for name, p in values[kind].items() if (r := p["speed_ratio"]) not in (0.0, 1.0)}
    turning = [f"{name} (at {geared[name]:g} times the spindle's speed)" if name in geared else name for name in turning]
    found = [f"Turning: {listed(turning) or 'nothing'}" + (f" ({values['turning_mass_kg']:.4g} kg)" if turning else "") + f". Standing: {listed(standing) or 'the ground alone'}."]
    for name, s in values["sets"].items():
        slides = f"; the rings of {listed(s['sprung'])} slide on {_spring(s)}" if s["sprung"] else ""
        found.append(f"Set {name}: {listed(s['bearings'])}, {s['arrangement']}, preload {s['preload_N']:g} N, {s['kind']}{slides}.")
    if values["sets"]:
        found.append(f"Balls with {values['ball_inertia']:.0%} of their inertia." if values["ball_inertia"] else "Balls without inertia: speed changes no bearing.")
    if values["bearings"] and turning and "ring_growth" not in values["effects"]["of_the_scene"] + list(values["effects"]["nothing_to_act_on"]):
        found.append("Rings do not grow by their own rotation; the effect ring_growth takes that in.")
    found += [_rollers(name, b) for name, b in values["bearings"].items() if b["kind"] == "roller row"]
    found += [_passing(name, b["cage_spread"]) for name, b in values["bearings"].items() if b["kind"] == "ball row" and b["cage_spread"] > NOTABLE]
    if values["axial_load_N"]:
        found.append(_axial_load(values))
    found += _across(values, len(turning) > 1)
    if values["unbalance_body"] and len(turning) > 1:
        found.append(f"The unbalance is on {values['unbalance_body']}.")
    h, modes = values["hammer"], values["modes_Hz"]
    points = [name for name, p in values["points"].items() if p["hammer"]]
    found.append(
        f"Hammer on {listed(points)}: {h['band_Hz'][0]:g} to {h['band_Hz'][1]:g} Hz, a pulse of {h['pulse_us']:.3g} us that first vanishes at {h['vanishes_at_Hz']:.0f} Hz; "
        f"steps of {h['step_us']:.3g} us."
    )
    shown = ", ".join(f"{f:.0f}" for f in modes[:8]) + (" ..." if len(modes) > 8 else "")
    found.append(f"At {values['reference_temperature_C']:g} C at rest {len(modes)} modes up to {h['band_Hz'][1]:g} Hz" + (f": {shown} Hz." if modes else "."))
    if hidden := values["modes_unseen"]:
        each = [f"{m['kind']} {m['frequency_Hz']:.0f}" for m in hidden]
        found.append(
            f"No FRF of the hammer test shows one of them, {listed(each)} Hz: it moves no point along its direction, or no hammer drives it."
            if len(each) == 1
            else f"No FRF of the hammer test shows {len(each)} of them, {listed(each)} Hz: they move no point along its direction, or no hammer drives them."
        )
    found.append(f"Meant for {low:g} to {high:g} C" + (f" and {values['nominal_speed_rpm']:g} rpm." if turning else "."))
    effects = values["effects"]
    count = len(effects["can_act"]) + len(effects["nothing_to_act_on"])
    own = f"Effects in it: {listed(effects['of_the_scene'])}. " if effects["of_the_scene"] else ""
    found.append(f"{own}Of {count} effects {len(effects['can_act'])} can act here (spindle effects --scene tells why the others cannot).")
    return found


def grids(values: Mapping[str, Any]) -> list[tuple[str, list[str], list[list[str]]]]:
    """Title, heads and rows of the tables of bearings, shafts, bodies, joints and points; tables without rows are left out."""
    bearings = [
        [
            name, f"{b['z_mm']:g}", f"{b['inner_on']} - {b['outer_on']}", b.get("sense", "-"),
            f"{b['preload_N'] + 0.0:.4g}" if "preload_N" in b else "-", f"{b['contact_angle_deg']:.2f}" if "contact_angle_deg" in b else "-",
            f"{b['load_lines_meet_axis_at_mm']:.1f}" if "contact_angle_deg" in b else "-",
            ", ".join(dict.fromkeys(f"{b[f'radial_stiffness{y}_N_per_um']:.4g}" for y in ("", "_y"))), f"{b['axial_stiffness_N_per_um']:.4g}",
        ]
        for name, b in values["bearings"].items()
    ]  # fmt: skip
    shafts = [
        [
            name, f"{s['z_mm'][0]:g} - {s['z_mm'][1]:g}", _across_axis(s), f"{s['mass_kg']:.4g}",
            str(s["elements"]), s["beam"], "yes" if s["turns"] else "no",
        ]
        for name, s in values["shafts"].items()
    ]  # fmt: skip
    bodies = [
        [name, f"{b['z_mm']:.4g}", f"{b['mass_kg']:.4g}", _by_way(b['inertia_kg_m2'][:2]), f"{b['inertia_kg_m2'][2]:.3g}", "yes" if b["turns"] else "no", " ".join(b["moves"])]
        for name, b in values["bodies"].items()
    ]
    joints = [
        [name, " - ".join(j["between"]), f"{j['z_mm']:g}", *(_by_way(k) for k in (j["stiffness"][:2], j["stiffness"][2:3], j["stiffness"][3:]))]
        for name, j in values["joints"].items()
    ]
    points = [
        [str(p["node"]), name, p["on"], ", ".join(f"{x:g}" for x in p["position_mm"]), p["direction"], "yes" if p["hammer"] else "", f"{p['sensor_mass_g']:g}" if p["sensor_mass_g"] else ""]
        for name, p in values["points"].items()
    ]
    every = [
        ("Bearings at the reference", ["bearing", "z\nmm", "between", "sense", "preload\nN", "angle\ndeg", "meets\naxis, mm", "radial\nN/um", "axial\nN/um"], bearings),
        ("Flexible shafts", ["shaft", "z\nmm", "section\nmm", "mass\nkg", "elements", "beam", "turns"], shafts),
        ("Rigid bodies", ["body", "z\nmm", "mass\nkg", "tilt\nkg m2", "polar\nkg m2", "turns", "moves"], bodies),
        ("Joints", ["joint", "between", "z\nmm", "lateral\nN/m", "axial\nN/m", "tilt\nN m/rad"], joints),
        ("Points", ["node", "point", "on", "x, y, z\nmm", "along", "hammer", "sensor\ng"], points),
    ]
    return [g for g in every if g[2]]


def _axial_load(values: Mapping[str, Any]) -> str:
    """The axial load on what carries the outer rings, and what that is as a force on what carries the inner ones."""
    load, rows = values["axial_load_N"], [b for b in values["bearings"].values() if b["kind"] == "ball row"]
    if not rows:
        return f"External axial load {load:g} N along z changes nothing: no bearing here is a ball row, whose stiffness goes with load."
    outer, inner = (listed(list(dict.fromkeys(b[key] for b in rows))) for key in ("outer_on", "inner_on"))
    return f"External axial load {load:g} N along z on {outer}, which carries the outer rings: for the bearings the same as {-load:g} N on {inner}."


def _across(values: Mapping[str, Any], several: bool) -> list[str]:
    """The radial loads and the weight, and who bears them."""
    loads = [f"{own['force_N'][0]:g}, {own['force_N'][1]:g} N along x, y at z = {own['z_mm']:g} mm" + f" on {own['body']}" * several for own in values["radial_loads"]]
    gx, gy = values["gravity_m_per_s2"]
    weight = f"weight under {gx:g}, {gy:g} m/s2 along x, y" if gx or gy else ""
    if not loads and not weight:
        return []
    shares = [f"{name} {f[0]:+.3g}, {f[1]:+.3g}" for name, b in values["bearings"].items() if (f := b["radial_force_N"])]
    numbers = [name for name, b in values["bearings"].items() if b["kind"] == "numbers"]
    alike = f"; {listed(numbers)}, given by numbers, {'is' if len(numbers) == 1 else 'are'} as stiff under any load" if numbers else ""
    what = f"External radial load{'s' * (len(loads) > 1)} {'; '.join(loads)}" + f", and {weight}" * bool(weight) if loads else weight.capitalize()
    return [f"{what}, borne by {'; '.join(shares) + ' N' if shares else 'joints alone'}{alike}."]


def _rollers(name: str, b: Mapping[str, Any]) -> str:
    rows = "a row of" if b["rows"] == 1 else f"{b['rows']} rows of"
    clear = b["clearance_um"]
    fit = f"pressed by {small_length(-1e-6 * clear, 'um')} across, {b['roller_force_N']:.3g} N each" if clear < 0 else f"with {small_length(1e-6 * clear, 'um')} of clearance across" + (f", the most loaded with {b['roller_force_N']:.3g} N" if b["roller_force_N"] else "")
    spread = (
        f" Taken is the mean over all places of its cage: a shaft at rest has one of them, which is stiffer or softer across by up to {100 * b['cage_spread']:.2g}%."
        if b["cage_spread"] > NOTABLE else ""
    )
    told = f"Rollers of {name}: {rows} {b['rollers']}, {b['roller_diameter_mm']:g} mm and {b['roller_length_mm']:g} mm long, {fit}; free along the axis."
    return told + spread


def _passing(name: str, spread: float) -> str:
    """Of a ball row that a load has displaced so far that its stiffness goes with the place of its cage."""
    return (
        f"Bearing {name}: its stiffness across changes by up to {100 * spread:.2g}% as its balls pass the load; taken is the mean over all places of its cage. "
        f"Lines of runout are those of this stiffness, and {LEFT_OUT}."
    )


def _by_way(values: list[float]) -> str:
    """Stiffness along or about x and y, once where they are the same."""
    shown = [f"{k:.3g}" if k else "-" for k in values]
    return shown[0] if len(set(shown)) == 1 else ", ".join(shown)


def _across_axis(s: Mapping[str, Any]) -> str:
    """Least and largest diameter of a shaft, or the width and height of a rectangular section, wherever it changes."""
    if s["sides_mm"] is None:
        return f"{s['outer_diameter_mm'][0]:g} - {s['outer_diameter_mm'][1]:g}"
    return ", ".join(dict.fromkeys(f"{w:g} x {h:g}" for w, h in s["sides_mm"]))


def _spring(s: Mapping[str, Any]) -> str:
    return "a constant force, which friction holds in vibration and against what `static` adds" if s["rate_N_per_m"] is None else f"a spring of {s['rate_N_per_m']:g} N/m"


def of_words(rows: list[list[str]], k: int) -> bool:
    """Whether a column holds no numbers; dashes and gaps decide nothing."""
    return not any(row[k].lstrip("+-")[:1].isdigit() for row in rows)


def _list(console: Console, title: str, items: list[str]) -> None:
    console.print(f"\n{title}:", style="bold")
    for item in items:
        console.print(f"  - {item}", markup=False, highlight=False)
