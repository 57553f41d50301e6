"""What the workbench leaves behind: the scene, a report of it beside the tests, and a script that does the same without the page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from pprint import pformat

from thermospindle.diagnosis.add import check_place, scene_with
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.model.errors import BadInput
from thermospindle.model.scene.reading import SCENES
from thermospindle.report.folder import mark, whole_folder
from thermospindle.report.workbench.bench import Bench, Errors, built
from thermospindle.report.workbench.state import Setting, Step
from thermospindle.sim.effects.own import OwnEffect

SOURCE = "set on the workbench"


def save(bench: Bench, s: Setting, errors: Errors, ladder: tuple[Step, ...], out: Path, progress: Callable[[str], None] = lambda done: None) -> list[str]:
    """Write `scene/`, `workbench.py` and, where there is a campaign, `report/` into the folder
    `out`, whole or not at all; what was written.

    `BadInput` where something stands there that spindle did not write, or nothing was changed.
    """
    if not s.effects and not s.deviations:
        raise BadInput("nothing was changed yet; add an effect or move a tolerance before saving")
    check_place(bench.scene, out)
    written = ["scene", "workbench.py"]
    with whole_folder(out) as folder:
        (folder / "scene").mkdir()
        tests = [t.id for t in bench.shown if t.id not in s.left_out] if bench.campaign else []
        catalogue = (*bench.effects, *(a.definition for a in bench.spindle.effects if a.definition))
        scene_with(bench.scene, s.effects, s.deviations, tests, SOURCE, folder / "scene", out / "scene", catalogue)
        (folder / "workbench.py").write_text(script(bench, s), encoding="utf-8")
        progress("scene and script written, now computing the FRFs of the report")
        if bench.campaign:
            from thermospindle.report.page.compare import (
                write_comparison,  # matplotlib and rerun take their time to load: not to open the page
            )

            (folder / "report").mkdir()
            spindle = built(bench, s)
            found = compare(spindle, bench.campaign, bench.observations)
            progress("FRFs computed, now drawing")
            write_comparison(found, spindle, folder / "report", name=bench.campaign.name, progress=progress)
            written.append("report")
        asked = {"verb": "workbench", "scene": bench.scene, "campaign": bench.campaign.folder if bench.campaign else None}
        steps = [{"step": r.name, "fitted": r.fitted, "left_out": r.left_out} for r in ladder]
        mark(folder, asked, {"fitted": errors.fitted, "left_out": errors.left_out, "ladder": steps})
    return written


def script(bench: Bench, s: Setting) -> str:
    """A Python script that builds the same spindle and prints the same errors."""
    folder, files = bench.scene.resolve().parent, [str(f.resolve()) for f in bench.effect_files]
    scene = folder.name if folder.parent == SCENES.resolve() else str(folder)
    lines = [
        '"""What was set on the workbench of Thermospindle, without its page."""',
        "",
        "from pathlib import Path",
        "",
        "import thermospindle as ts",
        "",
        f"SCENE = Path({scene!r})",
    ]
    if bench.campaign:
        lines += [f"CAMPAIGN = Path({str((bench.campaign.folder or Path()).resolve())!r})", f"LEFT_OUT = {sorted(s.left_out)!r}"]
    lines += ["", f"spindle = ts.load(SCENE{f', {files!r}' if files else ''})"]
    if s.deviations:
        lines += [f"spindle = ts.deviate(\n    spindle,\n    {_dictionary(s.deviations)},\n)"]
    for name, values in s.effects.items():
        file = own.file.resolve() if isinstance(own := bench.effect(name), OwnEffect) and own.file else None
        said = f"Path({str(file)!r})" if file else repr(name)
        lines += [f"spindle = ts.add(spindle, {said}, {', '.join(f'{k}={v!r}' for k, v in values.items())})"]
    if bench.campaign:
        lines += [
            "",
            "found = ts.compare(spindle, CAMPAIGN)",
            "fitted = [t.test.id for t in found.tests if t.test.id not in LEFT_OUT]",
            'print(f"fitted tests: rms error {found.rms_of(fitted):.9g} standard errors")',
            "if LEFT_OUT:",
            '    print(f"left-out tests: rms error {found.rms_of(LEFT_OUT):.9g} standard errors")',
        ]
    else:
        lines += [
            "",
            f"for temperature in {[float(t) for t in bench.spindle.temperatures]!r}:",
            "    for mode in ts.modes(ts.point(spindle, temperature), highest_Hz=spindle.hammer.band[1]):",
            '        print(f"{temperature:g} C: {mode.kind:8} {mode.frequency:.6f} Hz")',
        ]
    return "\n".join(lines) + "\n"


def _dictionary(values: object) -> str:
    return pformat(dict(values), width=120).replace("\n", "\n    ")  # type: ignore[call-overload]
