"""The rotor-base chain as a MuJoCo model.

Every body moves on its own slides and hinges from the world; elements are fixed tendons. A positive 5x5 matrix
between two bodies is exactly one tendon for each eigenvector, with the eigenvalue as stiffness; hammers pull and
vibrometers look along tendons with the point's row; the dampers of loss factors (`loss`) are tendons over the
whole chain. The turning body hangs by a spin hinge on a carrier that does not turn, which keeps spin out of the
bearings and gives MuJoCo's own gyroscopic terms; probes look at the carrier, as a laser fixed in space does.

Bearing elements: "linear" is the 5x5 stiffness; "ball-by-ball" has a spatial tendon for each ball (Hertz force, no push) and a linear
remainder that makes both linearise to the same matrix (see `model.bearing.springs`). Damping is linear in both.
"""

from __future__ import annotations

from xml.etree import ElementTree

import mujoco
import numpy as np

from thermospindle.model.bearing.pair import BearingState, PairState
from thermospindle.model.bearing.springs import ball_springs, tangent
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import Element, Matrices, RotorBase, element_rows, lost, matrices, point_row, rotor_base
from thermospindle.model.rotor.elements import ELEMENTS
from thermospindle.model.rotor.look.dress import dress
from thermospindle.model.types import Array

AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "tilt_x": (1, 0, 0), "tilt_y": (0, 1, 0)}
LEAST_INERTIA = 4e-15  # kg m2, of a body in two: MuJoCo refuses anything below 1e-15
DEAD_LOAD = "dead load"
"""How the names of the actuators begin that hold loaded balls where they are."""
CARRIER_SHARE = 1e-9  # of the turning body's inertia, left on the carrier because MuJoCo wants every moving body to have some


def spec(spindle: Spindle, state: PairState, element: str = "linear", looks: bool = False, chain: RotorBase | None = None) -> mujoco.MjSpec:
    """The MuJoCo specification of a spindle at one operating point, with keyframe "loaded" (turning at its speed).

    `chain` is the spindle's own at `state` by default. `looks` adds what a person wants to see
    (`model.rotor.look`) and changes nothing that moves.
    """
    if element not in ELEMENTS:
        raise ValueError(f"bearing element {element!r} is unknown; allowed are {', '.join(ELEMENTS)}")
    chain = chain or rotor_base(spindle, state)
    slides = {e.name for e in chain.elements if e.slides}  # balls of a ring on a spring stay one element, which knows its ring
    balls = {b.name: b for b in state.bearings if b.name not in slides} if element == "ball-by-ball" else {}
    out = chain_spec(chain, spindle.hammer.step, stiff=tuple(e.name for e in chain.elements if e.name not in balls))
    out.modelname = spindle.name
    for e in chain.elements:
        if e.name in balls:
            _add_balls(out, chain, balls[e.name], e)
    if balls:
        _add_dead_loads(out)
    _add_points(out, spindle, chain)
    if looks:
        dress(out, spindle, state)
    return out


def chain_spec(chain: RotorBase, step: float, stiff: tuple[str, ...] | None = None) -> mujoco.MjSpec:
    """Bodies of a chain with the damping of all elements and the stiffness of those named in `stiff` (all by default)."""
    out = mujoco.MjSpec()
    out.compiler.degree = False
    out.option.gravity = np.zeros(3)
    out.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    out.option.timestep = step
    out.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT)
    _add_bodies(out, chain)
    for e in chain.elements:
        stiffness = e.stiffness if stiff is None or e.name in stiff else np.zeros((5, 5))
        add_matrices(out, e.name, stiffness, e.damping, element_rows(chain, e), chain)
    if any(e.loss_factor for e in chain.elements):
        whole = matrices(chain)
        add_matrices(out, "loss", np.zeros_like(whole.stiffness), lost(chain, np.diag(whole.mass), whole.stiffness), np.eye(len(whole.mass)), chain)
    turning = spin_speeds(chain, chain.speed)
    spin = [turning.get(name, 0.0) for name in joint_names(chain)]
    out.add_key(name="loaded", qpos=np.zeros(len(spin)), qvel=spin)
    return out


def joint_names(chain: RotorBase) -> list[str]:
    """Joint names in MuJoCo's order: the chain's degrees of freedom, each turning body's spin after its own."""
    names = []
    for body in chain.bodies:
        names += [f"{body.name}.{move}" for move in body.moves]
        names += [f"{body.name}.spin"] if body.turns else []
    return names


def _add_bodies(out: mujoco.MjSpec, chain: RotorBase) -> None:
    for body in chain.bodies:
        small = max(1e-3 * body.mass * 0.01**2, 1e-12)  # an inertia for directions that nothing turns in
        turned = ("tilt_x" in body.moves, "tilt_y" in body.moves, body.turns)
        inertia = [max(i, LEAST_INERTIA if turns else small) for i, turns in zip(body.inertia, turned, strict=True)]
        nearest = min(max(inertia[2], abs(inertia[0] - inertia[1])), inertia[0] + inertia[1])
        if body.turns and abs(nearest - inertia[2]) > 1e-9 * inertia[2]:
            raise ValueError(
                f"body {body.name!r} turns and has inertia {inertia[0]:g}, {inertia[1]:g}, {inertia[2]:g} kg m2 about x, y, z, which no body has: "
                "each must be at most the sum of the others"
            )
        inertia[2] = nearest  # MuJoCo wants it possible; nothing feels the polar one of a body that does not turn
        share = max(CARRIER_SHARE, LEAST_INERTIA / 2 / min(body.mass, *inertia)) if body.turns else 1.0
        outer = out.worldbody.add_body(
            name=f"{body.name} carrier" if body.turns else body.name,
            pos=[0, 0, body.z],
            ipos=[0, 0, 0],
            mass=share * body.mass,
            inertia=[share * i for i in inertia],
            explicitinertial=True,
        )
        for move in body.moves:
            slides = move in ("x", "y", "z")
            kind = mujoco.mjtJoint.mjJNT_SLIDE if slides else mujoco.mjtJoint.mjJNT_HINGE
            outer.add_joint(name=f"{body.name}.{move}", type=kind, axis=AXES[move])
        if body.turns:
            rest = [(1 - share) * i for i in inertia]
            inner = outer.add_body(name=body.name, ipos=[0, 0, 0], mass=(1 - share) * body.mass, inertia=rest, explicitinertial=True)
            inner.add_joint(name=f"{body.name}.spin", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])


def add_matrices(out: mujoco.MjSpec, name: str, stiffness: Array, damping: Array, rows: Array, chain: RotorBase) -> None:
    """Fixed tendons that make `stiffness` and `damping` (m, m) between the motions `rows` (m, n).

    One tendon carries both along each eigenvector where they share them, as with proportional damping; else each has its own.
    Tilts are scaled by 1 cm before the eigenvalue problem so that N/m and N m/rad stand at like size.
    """
    scale = np.where(np.max(np.abs(rows[:, _slides(chain)]), axis=1, initial=0.0) > 0, 1.0, 100.0)
    rows = rows / scale[:, None]
    k, c = ((m + m.T) / 2 * np.outer(scale, scale) for m in (stiffness, damping))
    value, vector = np.linalg.eigh(k if k.any() else c)
    along = vector.T @ c @ vector
    if np.abs(along - np.diag(np.diag(along))).max() > 1e-12 * np.abs(along).max():
        add_matrices(out, f"{name}.damping", np.zeros_like(c), c, rows, chain)
        along = np.zeros_like(c)
    sizes = {"stiffness": value if k.any() else np.zeros(len(value)), "damping": np.diag(along)}
    for i, row in enumerate(vector.T @ rows):
        present = {kind: [size[i], 0, 0] for kind, size in sizes.items() if abs(size[i]) > 1e-14 * np.abs(size).max(initial=0.0)}
        if present and row.any():
            _wrap(out.add_tendon(name=f"{name} [{i}]", **present), chain, row)  # no point is called so


def _slides(chain: RotorBase) -> list[int]:
    return [i for i, (_, move) in enumerate(chain.dofs) if not move.startswith("tilt")]


def _wrap(tendon: mujoco.MjsTendon, chain: RotorBase, row: Array) -> None:
    for (body, move), coefficient in zip(chain.dofs, row, strict=True):
        if coefficient != 0.0:
            tendon.wrap_joint(f"{body}.{move}", float(coefficient))


def _add_balls(out: mujoco.MjSpec, chain: RotorBase, bearing: BearingState, element: Element) -> None:
    """A spatial tendon for each ball, and the linear remainder to the element's stiffness."""
    springs = ball_springs(bearing)
    for side, body in (("inner", chain.body(element.a)), ("outer", chain.body(element.b))):
        holder = out.body(f"{body.name} carrier" if body.turns else body.name)
        for j, (x, y, z) in enumerate(getattr(springs, side)):
            holder.add_site(name=f"{bearing.name}.{side}{j}", pos=[x, y, z - body.z], size=[1e-4] * 3, group=4)
    for j in range(len(springs.inner)):
        tendon = out.add_tendon(name=f"{bearing.name}.ball{j}", width=1e-5)
        tendon.springlength, tendon.stiffness = [0, springs.rest], springs.polynomial[j].tolist()
        tendon.wrap_site(f"{bearing.name}.inner{j}")
        tendon.wrap_site(f"{bearing.name}.outer{j}")
    both = [i for name in (element.a, element.b) for i, (body, _) in enumerate(chain.dofs) if body == name]
    rows = element_rows(chain, element)
    wanted = (rows.T @ element.stiffness @ rows)[np.ix_(both, both)]
    remainder = wanted - tangent(springs, chain.body(element.a).z, chain.body(element.b).z)
    add_matrices(out, f"{bearing.name}.remainder", remainder, np.zeros_like(remainder), np.eye(len(chain.dofs))[both], chain)


def _add_dead_loads(out: mujoco.MjSpec) -> None:
    """Constant forces that hold the loaded balls where they are: a magnet's pull or a preload spring, which the linear model need not know."""
    model = out.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    largest = max(abs(model.tendon_stiffness @ np.abs(data.ten_length)), 1e-3)
    for i, force in enumerate(data.qfrc_passive):
        if abs(force) > 1e-9 * largest:
            name = model.joint(model.dof_jntid[i]).name
            load = out.add_actuator(name=f"{DEAD_LOAD} {name}", trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name)
            load.biastype = mujoco.mjtBias.mjBIAS_AFFINE
            load.gainprm[0], load.biasprm[0] = 0.0, -force


def _add_points(out: mujoco.MjSpec, spindle: Spindle, chain: RotorBase) -> None:
    for point in spindle.points:
        body = chain.body(point.body)
        x, y, z = point.position
        holder = out.body(f"{body.name} carrier" if body.turns else body.name)
        holder.add_site(name=point.name, pos=[x, y, z - body.z], size=[4e-4] * 3, rgba=[0.9, 0.2, 0.1, 1.0])
        tendon = out.add_tendon(name=f"point{point.node}")
        _wrap(tendon, chain, point_row(chain, point))
        hammer = out.add_actuator(name=f"hammer{point.node}", trntype=mujoco.mjtTrn.mjTRN_TENDON, target=tendon.name)
        hammer.gainprm[0] = 1.0
        out.add_sensor(
            name=f"vibrometer{point.node}",
            type=mujoco.mjtSensor.mjSENS_TENDONVEL,
            objtype=mujoco.mjtObj.mjOBJ_TENDON,
            objname=tendon.name,
        )


def spin_speeds(chain: RotorBase, speed: float) -> dict[str, float]:
    """Speed (rad/s) of every spin hinge where the spindle turns at `speed`: each turning body has
    its own ratio. In the order of `spin_dofs`."""
    return {f"{body.name}.spin": speed * body.speed_ratio for body in chain.bodies if body.turns}


def spin_dofs(model: mujoco.MjModel) -> list[int]:
    """Indices of the spin hinges among the degrees of freedom."""
    return [i for i in range(model.nv) if model.joint(model.dof_jntid[i]).name.endswith(".spin")]


STEP = 2e-9
"""m for slides, and the same at 1 cm for hinges: of the differences of `linearise`."""


def linearise(model: mujoco.MjModel) -> Matrices:
    """M, C + G, K about the keyframe "loaded", by central differences of MuJoCo's accelerations; spin is left out.

    For linear elements the result is exact to rounding. The force of a ball goes with the power 1.5 of its deformation d,
    and a central difference by a step h is off by (h / d)^2 / 24: of those by `STEP` and by twice as much the extrapolated
    limit is taken (Richardson), which is off by some (h / d)^4, 1e-7 where a ball has all but lost contact, at 0.1 um.
    """
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("loaded").id)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    free = [i for i in range(model.nv) if i not in spin_dofs(model)]
    by_position, by_velocity = np.empty((model.nv, model.nv)), np.empty((model.nv, model.nv))
    for i in free:
        slides = model.jnt_type[model.dof_jntid[i]] == mujoco.mjtJoint.mjJNT_SLIDE
        h = STEP if slides else 100 * STEP
        for state, speed_up, result in ((data.qpos, 1.0, by_position), (data.qvel, 1e4, by_velocity)):
            kept, slopes = state[i], []
            for times in (1.0, 2.0):
                ends = []
                for sign in (1, -1):
                    state[i] = kept + sign * times * h * speed_up
                    mujoco.mj_forward(model, data)
                    ends.append(data.qacc.copy())
                slopes.append((ends[0] - ends[1]) / (2 * times * h * speed_up))
            state[i] = kept
            result[:, i] = (4 * slopes[0] - slopes[1]) / 3
    grid = np.ix_(free, free)
    reduced = mass[grid]
    names = [model.joint(model.dof_jntid[i]).name.rsplit(".", 1) for i in free]
    return Matrices(reduced, -reduced @ by_velocity[grid], -reduced @ by_position[grid], tuple((b, m) for b, m in names))


def xml(out: mujoco.MjSpec) -> str:
    """The specification as XML in full precision; MuJoCo's own writer keeps six digits, too few for groove centres a ball's
    deformation apart.
    """
    model = out.compile()
    root = ElementTree.fromstring(out.to_xml())

    def write(node: ElementTree.Element, key: str, value: np.ndarray | float) -> None:
        if key in node.attrib:
            given = len(node.attrib[key].split())
            node.set(key, " ".join(repr(float(v)) for v in np.atleast_1d(value)[:given]))

    for node in root.iter("body"):
        body = model.body(node.attrib["name"])
        write(node, "pos", body.pos)
        inertial = node.find("inertial")
        if inertial is not None:
            write(inertial, "mass", body.mass)
            write(inertial, "diaginertia", body.inertia)
    for node in root.iterfind(".//body/site"):
        write(node, "pos", model.site(node.attrib["name"]).pos)
    for node in (*root.iter("fixed"), *root.iter("spatial")):
        tendon = model.tendon(node.attrib["name"])
        for key, value, higher in (
            ("stiffness", model.tendon_stiffness[tendon.id], model.tendon_stiffnesspoly[tendon.id]),
            ("damping", model.tendon_damping[tendon.id], model.tendon_dampingpoly[tendon.id]),
            ("springlength", model.tendon_lengthspring[tendon.id], []),
        ):
            write(node, key, np.concatenate([np.atleast_1d(value), np.ravel(higher)]))
        start = model.tendon_adr[tendon.id]
        for wrap, joint in zip(range(start, start + model.tendon_num[tendon.id]), node.findall("joint"), strict=False):
            write(joint, "coef", model.wrap_prm[wrap])
    for node in root.iter("key"):
        write(node, "qvel", model.key(node.attrib["name"]).qvel)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode")
