r"""Uncertain models of Spacecraft for robust control: a linear fractional transformation (M, Δ).

Derivation, in body axes. X = [a; w'] has the specific force a at O and the angular acceleration w'.
h_w is the angular momentum of the wheels, w the angular velocity, and W = w× its matrix. A tank has
its origin at d, its axis along e, and the axes E = (x, y) across e; e × E = E S with
S = [0 -1; 1 0]. A slosh mode has the mass m, the natural frequency ω (in a fixed tank under the
present specific force) and the damping ratio ζ. Its slosh mass, the bob, is at rest in the tank at
r = d + b e. At the operating point, the specific force at the bob is A = a + w' × r + W W r with
X = γ X_f + X_c, where X_c is the acceleration that rotation alone causes, X_f is the acceleration
due to force and torque, and the uncertain factor γ multiplies X_f. M_tot is the mass matrix of
craft and liquid about O.

    g = e·A = γ g_f + g_c - b |w_E|²        β = E^T A       w_E = E^T w,  w_e = e·w,  w_e' = e·w'
    κ = S^T E^T w'                          G_r = -(W r)× - W r×   change of W W r by δw

Mass, centre and inertia of the whole liquid are known, so that a slosh mass m at the bob reduces
the rigid liquid by the same mass there (SP-106). The equations of a mode, relative to rigid liquid
and with s = m · displacement, are:

    α   = E^T (δa + δw' × r + G_r δw)                   acceleration of the bob across e
    s'' = -R - w_e' S s - (w_E w_E^T - |w|² 1) s - 2 w_e S s'
    R   = m α + ν + n,    ν = ω (ω s + 2 ζ s')          force of the bob beyond rigid liquid
    p   = β·s/l + (κ - w_e w_E)·s + 2 S^T w_E·s'        from the rod's tension m g
    M_tot δX = [δf; δτ - δw × h_w] - gyroscopic terms + Σ [E R + e p; r × (E R + e p) + g E S s]
    1/l = (1 - ρ) ω²/g                                  ρ = k/(m ω²): share of a centring stiffness,
                                                        which does not change with ω

In liquid that turns with its tank at the rate V, a mode with the gyroscopic coefficient C and the
stiffness ε has n = [2 (1 - C) V w_e + ε V²] s - (1 - C) (V' S s + 2 V S s'); otherwise n = 0. The
angular momentum L of the liquid follows the equations of spin.rs, without uncertain parameters.

A mode of an appendage has the participation u = [p; l] about O and, at the operating point, the
displacement η_0. With y = p η and D, the derivative of the inertia about O by η:

    η'' = -u·δX + w·D δw - ω (ω η + 2 ζ η')    M_tot has the first moment p η_0, inertia D η_0
    M_tot δX = … - u η'' - [w' × y + W W y; y × a + D w' η + W D w η] - [2 W p; W l + D w] η'

The equations of the tanks are Newton's law of the bob, linearised after the force of the rod is
eliminated (book, Spacecraft: equations). Because m scales the state s, m multiplies only α. For a
dry craft with the mass m_b, the centre of mass r_b and the inertia J, M_tot X = m_b [A; r_b × A] +
[0; J w'] + the share of the liquid, with A = a + w' × r_b. The number of products with an uncertain
parameter is the number of its repetitions in Δ. In a craft that does not spin these are: m 2, ζ 2,
ω 4, b 4 and γ 2 for each mode; dry mass 3; a moment of inertia 1; a product of inertia 2; a
coordinate of r_b 4. If a free surface is not at rest, ω and b may have 1 or 2 more; in a craft that
spins, b and inertias may have 1 or 2 more. Finally, each repeated block is reduced to its
controllable and observable part, which does not change the model.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import check_ranges, floats, names_of, out_of_range, range_ends
from .certificate import (
    SIZES,
    Certificate,
    ExhaustedError,
    Search,
    UnstableError,
    WorstCase,
)
from .delta_search import DeltaSearch
from .fmu import FmuError, Parameters, Quantity, did_you_mean
from .linearization import LinearModel
from .loop import Loop
from .operating_point import warn_of_attitude, warn_of_rotation
from .plant import Plant, read_vector
from .progress import Progress
from .quantities import KINDS, TURN, full_name, rigid_rest, short_name, slosh_mass_error
from .short import names
from .simulation import parameters_of
from .stability import minimal
from .wheels import MOMENTUM, TORQUE

if TYPE_CHECKING:
    import pandas as pd

    from .program import Identification

Matrix = NDArray[np.float64]

S = np.array([[0.0, -1.0], [1.0, 0.0]])
OUTPUTS = (*(f"q[{i}]" for i in (2, 3, 4)), *(f"omega[{i}]" for i in (1, 2, 3)))
INPUTS = (*(f"force[{i}]" for i in (1, 2, 3)), *(f"torque[{i}]" for i in (1, 2, 3)))
AXES = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
FACTOR = "acceleration"  # Factor of the craft's acceleration; 1 is the acceleration as given
UNITS = {"frequency": "Hz", "zeta": "1", "mass": "kg", "bob": "m", FACTOR: "1"}
# Smallest values of quantities, relative to the middle of their ranges. The values are above 0,
# because rounding could turn 0 into a negative number.
_LEAST = {"zeta": 1e-9} | dict.fromkeys(
    ("frequency", "mass", FACTOR, "craft.mass", "craft.Jxx", "craft.Jyy", "craft.Jzz"), 0.01
)  # fmt: skip
ALONE = 1e-12  # Relative size below which a coefficient is a rounding error and counts as 0


@dataclass(frozen=True)
class _Bob:
    """A slosh mode: numbers of tank and mode, and pendulum length (m).

    ``stiffness`` is the centring stiffness divided by the slosh mass, 1/s².
    """

    tank: int
    mode: int
    length: float
    stiffness: float
    swirl: tuple[float, float, float]
    """2 (1 - C) V w_e + ε V², (1 - C) V' and 2 (1 - C) V of liquid that spins; otherwise 0."""

    def name(self, kind: str) -> str:
        return f"tank[{self.tank}].{kind}[{self.mode}]"


@dataclass(frozen=True)
class _Tank:
    """A tank: its origin (m), its axes (columns x, y, e), and parameters of its rigid liquid.

    The FMU's damping ratios are given for the specific force ``g_ref``, m/s².
    """

    number: int
    origin: Matrix
    axes: Matrix
    m_0: float
    H_0: float
    I_0: float
    more_y: float
    """Parameter ``dI_y`` of the tank."""
    g_ref: float


@dataclass(frozen=True)
class _Spin:
    """Liquid that spins, in tank axes, with the angular momentum L.

    If w is the angular velocity of the tank, I⁻¹ L - Γ w is the angular velocity of the liquid
    relative to the tank. The friction torque at the wall is K times this relative velocity.
    """

    inverse: Matrix
    coupling: Matrix
    friction: Matrix
    momentum: Matrix

    def rate(self, w: Matrix) -> Matrix:
        """Return the derivative of the liquid's angular momentum, tank axes.

        ``w`` is the tank's angular velocity, rad/s.
        """
        slip = self.slip(w)
        found: Matrix = _cross(slip) @ self.momentum - self.friction @ slip
        return found

    def slip(self, w: Matrix) -> Matrix:
        """Return the liquid's angular velocity relative to the tank, tank axes, rad/s.

        ``w`` is the tank's angular velocity.
        """
        found: Matrix = self.inverse @ self.momentum - self.coupling @ w
        return found


@dataclass(frozen=True)
class _Mode:
    """A mode of an appendage: participation factors u, displacement η at the operating point.

    ``body`` is the derivative of the craft's 6 × 6 mass matrix with respect to η.
    """

    number: int
    u: Matrix
    body: Matrix
    eta: float

    def name(self, kind: str) -> str:
        return f"appendage[{self.number}].{kind}"


@dataclass(frozen=True)
class _Craft:
    """Spacecraft at its operating point: values that may be uncertain, and constants."""

    values: dict[str, float]
    tanks: dict[int, _Tank]
    bobs: tuple[_Bob, ...]
    liquid: Matrix
    """Mass matrix about O of all liquid as rigid bodies."""
    wrench: Matrix
    wheels: Matrix
    omega: Matrix
    spins: dict[int, _Spin]
    modes: tuple[_Mode, ...]

    def deformed(self) -> Matrix:
        """Return the change of the 6 × 6 mass matrix due to the deflection of the appendages."""
        return sum((mode.eta * mode.body for mode in self.modes), np.zeros((6, 6)))

    def pull(self, values: Mapping[str, float]) -> Matrix:
        """Return force and torque about O with which deflected appendages pull the craft."""
        pulls = (
            (TURN * values[mode.name("frequency")]) ** 2 * mode.eta * mode.u for mode in self.modes
        )
        return sum(pulls, np.zeros(6))

    def dry(self, values: Mapping[str, float]) -> tuple[float, Matrix, Matrix]:
        """Return mass, centre of mass and inertia of the dry craft from uncertain parameters."""
        J = np.zeros((3, 3))
        for name, (i, j) in AXES.items():
            J[i, j] = J[j, i] = values[f"craft.J{name}"]
        return values["craft.mass"], np.array([values[f"craft.r[{i}]"] for i in (1, 2, 3)]), J

    def rigid(self) -> Matrix:
        """Return the mass matrix of craft and liquid as one rigid body."""
        return _rigid(*self.dry(self.values)) + self.liquid

    def load(self, values: Mapping[str, float], *, moving: bool = True) -> Matrix:
        """Return force and torque about O (6 numbers) that rotation without acceleration needs.

        They balance the gyroscopic and centrifugal loads of craft and liquid. If ``moving`` is
        False, craft and liquid count as one rigid body.
        """
        w = self.omega
        rigid = _rigid(*self.dry(values)) + self.liquid
        load = _gyroscopic(rigid + moving * self.deformed(), w)
        load[3:] += _cross(w) @ self.wheels
        for number, spin in self.spins.items():
            axes = self.tanks[number].axes
            kept, rate = (spin.coupling @ of for of in (spin.momentum, spin.rate(axes.T @ w)))
            load[3:] += axes @ (rate + np.cross(axes.T @ w, kept))
        for bob in self.bobs if moving else ():
            arm = self.arm(bob, values)
            inwards = arm[:3].T @ self.specific(np.zeros(6), self.place(bob, values))
            load -= values[bob.name("mass")] * arm @ inwards
        for mode in self.modes if moving else ():
            load += mode.u * (w @ mode.body[3:, 3:] @ w) / 2
        return load

    def accelerations(self) -> tuple[Matrix, Matrix]:
        """Return the craft's acceleration with rigid liquid, and with liquid that can slosh.

        Each acceleration has six numbers: specific force at O, then angular acceleration.
        """
        whole = np.linalg.solve(self.rigid(), self.wrench - self.load(self.values, moving=False))
        load = self.wrench + self.pull(self.values) - self.load(self.values)
        return whole, np.linalg.solve(self.mass_matrix(self.values), load)

    def specific(self, X: Matrix, place: Matrix) -> Matrix:
        """Return the specific force (m/s²) at the position ``place`` of the craft.

        ``X`` has the specific force at O, then the angular acceleration.
        """
        found: Matrix = (
            X[:3] + np.cross(X[3:], place) + np.cross(self.omega, np.cross(self.omega, place))
        )
        return found

    def place(self, bob: _Bob, values: Mapping[str, float]) -> Matrix:
        """Return the position of a slosh mass at rest."""
        tank = self.tanks[bob.tank]
        found: Matrix = tank.origin + values[bob.name("bob")] * tank.axes[:, 2]
        return found

    def arm(self, bob: _Bob, values: Mapping[str, float]) -> Matrix:
        """Return the matrix (6 × 2) of the directions in which a slosh mass can move.

        Its transpose maps the craft's acceleration (specific force at O, angular acceleration) to
        the two components of the slosh mass's acceleration across the tank's axis.
        """
        E = self.tanks[bob.tank].axes[:, :2]
        return np.vstack([E, _cross(self.place(bob, values)) @ E])

    def mass_matrix(self, values: Mapping[str, float]) -> Matrix:
        """Return the mass matrix (6 × 6) of the parts that follow the craft's acceleration.

        Slosh masses follow it only along the axes of their tanks, because they are free to move
        across; the share of each appendage mode is left out.
        """
        M = _rigid(*self.dry(values)) + self.liquid + self.deformed()
        for mode in self.modes:
            M = M - np.outer(mode.u, mode.u)
        for bob in self.bobs:
            arm = self.arm(bob, values)
            M = M - values[bob.name("mass")] * arm @ arm.T
        return M


def _cross(v: ArrayLike) -> Matrix:
    """Return the matrix of the cross product v ×."""
    x, y, z = np.asarray(v, float)
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _twice(w: Matrix) -> Matrix:
    """Return the matrix (6 × 6) that maps six numbers [u; v] to [w × u; w × v]."""
    return np.kron(np.eye(2), _cross(w))


def _gyroscopic(M: Matrix, w: Matrix) -> Matrix:
    """Return gyroscopic force and torque about O of a rigid body with the mass matrix M (6 × 6).

    ``w`` is its angular velocity, rad/s.
    """
    found: Matrix = _twice(w) @ M[:, 3:] @ w
    return found


def _gyroscopic_slope(M: Matrix, w: Matrix) -> Matrix:
    """Return the derivative of `_gyroscopic` with respect to w (6 × 3), for the mass matrix M."""
    momentum = (M[:, 3:] @ w).reshape(2, 3)
    found: Matrix = _twice(w) @ M[:, 3:] - np.vstack([_cross(of) for of in momentum])
    return found


def _rigid(mass: float, center: Matrix, own: Matrix) -> Matrix:
    """Return the mass matrix (6 × 6) of a rigid body about O.

    Its centre of mass is at ``center``, m; ``own`` is its inertia about this centre, kg·m².
    """
    C = mass * _cross(center)
    return np.block([[mass * np.eye(3), -C], [C, own - C @ _cross(center)]])


def _read(
    model: str | Path, parameters: Parameters, held: tuple[Matrix, Matrix] | None = None
) -> _Craft:
    """Read the craft and its liquid from the FMU ``model`` with the given parameters.

    ``held`` has accelerations as `_Craft.accelerations` returns them, which replace the craft's own
    accelerations in the computation of damping ratios and frequencies.
    """
    with Plant(model, parameters) as plant:

        def get(*names: str) -> Matrix:
            return np.array(plant.get(names))

        vector = partial(read_vector, plant)
        if plant.fmu.name != "Spacecraft":
            raise FmuError(f"uncertain models exist only for Spacecraft, not for {plant.fmu.name}")
        free = (get("mount_kind")[0] or get("mount")[0]) == 1
        problems = [] if free else ["the craft is on a pivot: mount must be free"]
        if vector("q", 4)[1:].any():
            problems.append("the attitude must be that of the axes: init.q 1, 0, 0, 0")
        omega = vector("omega")
        values = dict(zip(
            names := ["craft.mass", *(f"craft.r[{i}]" for i in (1, 2, 3)),
                      *(f"craft.J{axes}" for axes in AXES)],
            get(*names).tolist(), strict=True,
        ))  # fmt: skip
        values[FACTOR] = 1.0
        liquid, tanks, bobs, spins = np.zeros((6, 6)), {}, [], {}
        drags: list[tuple[_Bob, float, float, int]] = []
        for number in range(1, int(get("tanks")[0]) + 1):
            of = f"tank[{number}]"
            modes = int(get(f"{of}.modes")[0])
            each = [f"{of}.p[{n},{i}]" for n in range(1, modes + 1) for i in (1, 2)]
            each += [f"{of}.p_dot[{n},{i}]" for n in range(1, modes + 1) for i in (1, 2, 3)]
            each += [f"{of}.direction[{n},{i}]" for n in range(1, modes + 1) for i in (1, 2)]
            each += [f"{of}.{law}[{n}]" for n in range(1, modes + 1)
                     for law in ("zeta_amplitude", "zeta_breaking")]  # fmt: skip
            if (
                get(f"{of}.diameter", f"{of}.fill.points", *each).any()
                or vector(f"{of}.r_0", 2).any()
            ):
                problems.append(
                    f"{of} must be axially symmetric and at rest: no diameter, fill table, planar "
                    "modes, r_0, or damping that grows with the amplitude"
                )
                continue
            w, *v = vector(f"{of}.q", 4) / np.linalg.norm(vector(f"{of}.q", 4))
            axes = np.eye(3) + 2 * w * _cross(v) + 2 * _cross(v) @ _cross(v)
            m_0, H_0, I_0, I_z, dI_y, xy, xz, yz, g_ref, floor, law, kind = get(*(
                f"{of}.{name}" for name in ("m_0", "H_0", "I_0", "I_z", "dI_y", "I_xy", "I_xz",
                                            "I_yz", "g_ref", "g_floor", "damping_law",
                                            "damping_law_kind")
            )).tolist()  # fmt: skip
            tank = _Tank(number, vector(f"{of}.position"), axes, m_0, H_0, I_0, dI_y, g_ref)
            tanks[number] = tank
            own = axes @ np.array([[I_0, xy, xz], [xy, I_0 + dI_y, yz], [xz, yz, I_z]]) @ axes.T
            liquid += _rigid(m_0, tank.origin + H_0 * axes[:, 2], own)
            axial, across, gamma = get(f"{of}.spin_inertia", f"{of}.spin_inertia_across",
                                       f"{of}.spin_coupling")  # fmt: skip
            V = V_d = 0.0
            if axial:
                inertia = np.array([across or axial, across or axial, axial])
                decay = vector(f"{of}.spin_decay", 2)[[1, 1, 0]]
                spin = _Spin(np.diag(1 / inertia), np.diag([gamma, gamma, 1.0]),
                             np.diag(decay * inertia), vector(f"{of}.spin"))  # fmt: skip
                spins[number] = spin
                V, V_d = (float(of[2]) / axial for of in (spin.momentum, spin.rate(axes.T @ omega)))
            for n in range(1, modes + 1):
                m, length, f, hinge, k, zeta, C, stiffness = get(*(
                    f"{of}.{name}[{n}]"
                    for name in ("mass", "length", "frequency", "hinge", "k", "zeta",
                                 "gyroscopic", "gyroscopic_stiffness")
                )).tolist()  # fmt: skip
                if f > 0:
                    length = g_ref / ((TURN * f) ** 2 - k / m)
                # the parameter gyroscopic_stiffness is ε + 1 - 2 C; a pendulum has C = ε = 1
                swirl = (2 * (1 - C) * float(axes[:, 2] @ omega) + (stiffness + 2 * C - 1) * V) * V
                if (C, stiffness) == (1.0, 0.0):
                    swirl = 0.0
                bob = _Bob(number, n, length, k / m, (swirl, (1 - C) * V_d, 2 * (1 - C) * V))
                bobs.append(bob)
                values |= {bob.name("mass"): m, bob.name("bob"): hinge - length}
                at = tank.origin + (hinge - length) * axes[:, 2]
                liquid += _rigid(m, at, np.zeros((3, 3)))
                drags.append((bob, zeta, floor or 1e-4 * g_ref, int(kind or law)))
        modes = []
        for number in range(1, int(get("appendages")[0]) + 1):
            of = f"appendage[{number}]"
            participation = vector(f"{of}.participation", 6)
            place = vector(f"{of}.position")
            if not participation.any():
                continue
            eta, eta_dot, frequency, zeta = get(*(
                f"{of}.{name}" for name in ("eta", "eta_dot", "frequency", "zeta")
            )).tolist()  # fmt: skip
            if eta_dot:
                problems.append(f"{of} must be at rest: eta_dot_0 = 0")
            p = participation[:3]
            u = np.concatenate([p, participation[3:] + np.cross(place, p)])
            growth = 2 * (p @ place) * np.eye(3) - np.outer(p, place) - np.outer(place, p)
            body = np.block([[np.zeros((3, 3)), -_cross(p)], [_cross(p), growth]])
            modes.append(mode := _Mode(number, u, body, eta))
            values |= {mode.name("frequency"): frequency, mode.name("zeta"): zeta}
        if problems:
            raise FmuError("; ".join(problems))
        wrench = np.concatenate([vector("force"), vector("torque")])
        found = _Craft(values, tanks, tuple(bobs), liquid, wrench, vector("h_wheels"), omega, spins,
                       tuple(modes))  # fmt: skip
    # in damping.rs, the damping force depends on the acceleration of craft and liquid as one rigid
    # body
    whole, moving = held or found.accelerations()
    for bob, zeta, floor, law in drags:
        tank = tanks[bob.tank]
        # The damping force depends on the specific force at the hinge, the frequency on the
        # specific force at the bob. The two differ only if the craft spins.
        at, e = found.place(bob, values), tank.axes[:, 2]
        hinge = at + bob.length * e
        rest, g = (float(e @ found.specific(*of)) for of in ((whole, hinge), (moving, at)))
        above = (rest + np.hypot(rest, floor)) / 2
        reference = tank.g_ref / bob.length + bob.stiffness
        w2 = g / bob.length + bob.stiffness
        if not w2 > 0 or g < -ALONE * tank.g_ref:
            raise FmuError(
                f"tank[{bob.tank}]: {g:.3g} m/s² along its axis does not hold liquid at its bottom"
            )
        power = {1: 0.25, 2: 0.5, 3: 0.0}[law]
        c_m = 2 * zeta * np.sqrt(reference)
        c_m *= ((above / bob.length + bob.stiffness) / reference) ** power
        values[bob.name("frequency")] = float(np.sqrt(w2)) / TURN
        values[bob.name("zeta")] = float(c_m / (2 * np.sqrt(w2)))
    return found


def _slope(ends: tuple[Matrix, Matrix], size: Matrix, step: float) -> Matrix:
    """Return (ends[1] - ends[0])/step; differences that are rounding errors count as 0.

    ``size`` is the size of the numbers, to which rounding errors are relative.
    """
    rise = ends[1] - ends[0]
    rise[np.abs(rise) <= ALONE * size] = 0.0
    found: Matrix = rise / step
    return found


def _derivative(craft: _Craft, step: float, ends: tuple[_Craft, _Craft]) -> dict[str, float]:
    """Return the derivative of each uncertain parameter with respect to one FMU parameter.

    The FMU parameter belongs to a tank, such as the length of a pendulum. ``ends`` has the craft
    before and after a change of this FMU parameter by ``step``. A change of the rigid liquid counts
    as a change of the dry craft, because only the sum of both acts.
    """
    of_bobs = [bob.name(kind) for bob in craft.bobs for kind in KINDS]
    values, *at = (np.array([c.values[of] for of in of_bobs]) for c in (craft, *ends))
    found = dict(zip(of_bobs, _slope((at[0], at[1]), np.abs(values), step).tolist(), strict=True))
    M = craft.rigid()
    size = np.sqrt(np.outer(np.diag(M), np.diag(M)))
    slope = _slope((ends[0].rigid(), ends[1].rigid()), size, step)
    # M = [m, -C; C, J - C r×] with C = m r×
    mass, r, _ = craft.dry(craft.values)
    by_m, moment = slope[0, 0], np.array([slope[5, 1], slope[3, 2], slope[4, 0]])
    by_r = (moment - by_m * r) / mass
    crossed = _cross(moment) @ _cross(r) + mass * _cross(r) @ _cross(by_r)
    by_J = slope[3:, 3:] + crossed
    by_J[np.abs(by_J) <= 1e-9 * (np.abs(slope[3:, 3:]) + np.abs(crossed))] = 0.0
    found |= {"craft.mass": float(by_m)}
    found |= {f"craft.r[{i + 1}]": float(by_r[i]) for i in range(3)}
    return found | {f"craft.J{axes}": float(by_J[at]) for axes, at in AXES.items()}


def _root(matrix: Matrix) -> Matrix:
    """Return L with L L^T = matrix, with a column for each principal axis of the correlations.

    Raises ValueError if the matrix is not a covariance.
    """
    variances = np.diag(matrix)
    if not (np.isfinite(matrix).all() and (variances >= 0).all()):
        raise ValueError
    scale = np.where(variances > 0, np.sqrt(variances), 1.0)
    lengths, axes = np.linalg.eigh((matrix + matrix.T) / 2 / np.outer(scale, scale))
    if lengths.min() < -1e-12 * np.abs(lengths).max():
        raise ValueError
    kept = lengths > 1e-15 * lengths.max()
    found: Matrix = scale[:, None] * axes[:, kept] * np.sqrt(lengths[kept])
    return found


# Tank parameters of the FMU that can be converted to uncertain parameters, to first order.
OF_TANK = re.compile(r"tank\[\d\]\.(m_0|H_0|I_0|I_z|(mass|length|frequency|hinge|zeta)\[\d\])")


def _converted(
    model: str | Path, given: Parameters, craft: _Craft, table: "pd.DataFrame"
) -> tuple["pd.DataFrame", list[str]]:
    """Return derivatives of uncertain parameters, and error messages.

    The derivatives are with respect to the FMU parameters that the rows of ``table`` name, for
    example because `identify` has estimated them. ``craft`` was read from the FMU ``model`` with
    the parameters ``given``.
    """
    import pandas as pd

    slopes: dict[str, dict[str, float]] = {}
    problems, held = [], craft.accelerations()
    for name in (str(name) for name in table.index):
        if name.startswith("craft.") and name in craft.values:
            slopes[name] = {name: 1.0}
            continue
        if not OF_TANK.fullmatch(name):
            problems.append(
                f"{name} cannot be converted to an uncertain parameter (allowed: parameters of "
                "craft, and of a tank m_0, H_0, I_0, I_z, mass, length, frequency, hinge, zeta)"
            )
            continue
        with Plant(model, given) as plant:
            value = float(plant.get([name])[0])
        step = max(1e-4 * abs(value), 1e-7)
        # step only upwards if a step downwards would make a positive value negative
        points = value - step if value > step or value < 0 else value, value + step
        # frequency = 0 means that the frequency follows from the length, so it is skipped
        if not (value == 0 and ".frequency[" in name):
            low, high = (_read(model, {**given, name: x}, held) for x in points)
            slopes[name] = _derivative(craft, points[1] - points[0], (low, high))
        if not any(slopes.get(name, {}).values()):
            problems.append(f"{name} = {value:g} has no effect at this point")
    found = pd.DataFrame(slopes).fillna(0.0)
    return found.loc[found.any(axis="columns")], problems


class _Equations:
    """Linear equations in which each product with an uncertain parameter adds a row to Δ.

    Such a row is called a channel. A signal is a row of coefficients of states, inputs, the craft's
    acceleration X and channels.
    """

    def __init__(self, width: int, values: Mapping[str, float], spread: "pd.DataFrame") -> None:
        self.values, self.spread = values, spread.to_numpy()
        self.index = {name: i for i, name in enumerate(spread.index)}
        self.width, self.channels = width, [(0, np.zeros(0))][:0]
        self.most = width + 30 * max(np.count_nonzero(self.spread), 1) * (1 + len(values) // 4)

    def unit(self, first: int, count: int) -> Matrix:
        """Return ``count`` signals: rows of an identity matrix that begin at row ``first``."""
        return np.eye(count, self.most, first)

    def times(self, name: str, signal: Matrix) -> Matrix:
        """Return the product of the parameter ``name`` and the rows of ``signal``.

        If the parameter is uncertain, each row that is not 0 adds a channel (a row) to Δ.
        """
        product = self.values[name] * signal
        if name in self.index:
            for j in np.flatnonzero(self.spread[self.index[name]]):
                for row, of in zip(product, signal, strict=True):
                    if of.any():
                        row[self.width + len(self.channels)] += self.spread[self.index[name], j]
                        self.channels.append((int(j), of))
        return product


def _partitioned(
    craft: _Craft, values: Mapping[str, float], spread: "pd.DataFrame", X_f: Matrix, X_c: Matrix
) -> tuple[Matrix, list[int], tuple[str, ...]]:
    """Return M from (states, channels, all inputs) to (derivatives, channels, all outputs).

    A channel is a row of Δ. ``craft`` is the craft at its operating point. Its acceleration there
    is γ X_f + X_c: X_f is due to force and torque, X_c is due to rotation, and γ is an uncertain
    factor. ``values`` are its parameters at Δ = 0, and ``spread`` has the change of
    each parameter (row) with each δ (column). Also return the number of channels of each column of
    ``spread``, and the names of the states.
    """
    states = [*OUTPUTS, *(
        f"tank[{bob.tank}].{of}[{bob.mode},{i}]"
        for bob in craft.bobs for of in ("p", "p_dot") for i in (1, 2)
    ), *(mode.name(of) for mode in craft.modes for of in ("eta", "eta_dot")),
      *(f"tank[{number}].spin[{i}]" for number in craft.spins for i in (1, 2, 3))]  # fmt: skip
    n, m, unknown = len(states), len(INPUTS), 6 + len(craft.bobs)
    eq = _Equations(n + m + unknown, values, spread)
    x, u, X = eq.unit(0, n), eq.unit(n, m), eq.unit(n + m, 6)
    a, w_d, w, omega = X[:3], X[3:], x[3:6], craft.omega
    W = _cross(omega)

    def inwards(place: Matrix) -> Matrix:
        """Return the derivative of the acceleration w × (w × place) by the angular velocity w."""
        return -_cross(W @ place) - W @ _cross(place)

    def grown(signal: Matrix) -> Matrix:
        """Return ``signal`` times the factor γ of the acceleration due to force and torque.

        If rotation causes no acceleration, γ multiplies both sides of the pendulum's equation for
        y. Then γ has its nominal value here, which needs fewer channels of Δ.
        """
        return eq.times(FACTOR, signal) if omega.any() or X_c.any() else values[FACTOR] * signal

    rates = [(w - W @ x[:3]) / 2, w_d]
    load = u.copy()
    load[3:] += _cross(craft.wheels) @ w
    quotients = []
    for k, bob in enumerate(craft.bobs):
        tank = craft.tanks[bob.tank]
        E, e, d = tank.axes[:, :2], tank.axes[:, 2], _cross(tank.origin)
        s, s_d = x[6 + 4 * k : 8 + 4 * k], x[8 + 4 * k : 10 + 4 * k]
        w_E, w_e, flat = E.T @ omega, e @ omega, np.eye(2)
        at = np.array([X_f[:3] - d @ X_f[3:], X_c[:3] - d @ X_c[3:] + W @ W @ tank.origin])
        (g_f, g_c), (beta_f, beta_c) = at @ e, at @ E
        kappa_f, kappa_c = (S.T @ E.T @ of[3:] for of in (X_f, X_c))
        mass, frequency, zeta, height = (bob.name(kind) for kind in ("mass", *KINDS[:2], "bob"))
        turned = eq.times(height, S.T @ E.T @ w_d + E.T @ inwards(e) @ w)
        drive = eq.times(mass, E.T @ (a - d @ w_d + inwards(tank.origin) @ w) + turned)
        first = TURN * eq.times(frequency, s)
        nu = TURN * eq.times(frequency, first + 2 * eq.times(zeta, s_d))
        scaled = eq.times(FACTOR, s)
        stiff, twist, drift = bob.swirl
        R = drive + nu + (stiff * flat - twist * S) @ s - drift * S @ s_d
        turning = (e @ X_c[3:]) * S + np.outer(w_E, w_E) - omega @ omega * flat
        rates += [s_d, -R - (e @ X_f[3:]) * S @ scaled - turning @ s - 2 * w_e * S @ s_d]
        pull = kappa_f @ scaled + (kappa_c - w_e * w_E) @ s + 2 * (S.T @ w_E) @ s_d
        # β = γ by_γ + β_c + b by_b; if β is not 0, the rod of the pendulum is not along e
        b, factor, by_b = values[height], values[FACTOR], kappa_c + w_e * w_E
        g = factor * g_f + g_c - b * (w_E @ w_E)
        size = ALONE * (np.abs(at).sum() + abs(b) * (omega @ omega))
        by = {FACTOR: beta_f + b * kappa_f, height: factor * kappa_f + by_b}
        leaning = [factor * by[FACTOR] + beta_c + b * by_b]
        leaning += [of for name, of in by.items() if name in eq.index]
        y = ratio = eq.unit(n + m + 6 + k, 1)
        if g > size and np.abs(leaning).max() > size:
            # y = (1 - ρ) ω² β·s/g
            share = 1 - bob.stiffness / (TURN * craft.values[frequency]) ** 2
            beta = grown(beta_f[None] @ first + eq.times(height, kappa_f[None] @ first))
            beta += beta_c[None] @ first + eq.times(height, by_b[None] @ first)
            ratio = g_f * grown(y) + g_c * y - (w_E @ w_E) * eq.times(height, y)
            ratio -= TURN * eq.times(frequency, share * beta)
            pull = pull + y[0]
        quotients.append(ratio)
        force = E @ R + np.outer(e, pull)
        load[:3] += force
        twisted = eq.times(height, R - (w_E @ w_E) * s)
        load[3:] += d @ force + E @ S @ (twisted + g_f * scaled + g_c * s)
    first = 6 + 4 * len(craft.bobs)
    for k, flexing in enumerate(craft.modes):
        s, s_d = (x[first + 2 * k + i][None] for i in (0, 1))
        frequency, zeta = (flexing.name(kind) for kind in KINDS[:2])
        stiff = TURN * eq.times(frequency, s) + 2 * eq.times(zeta, s_d)
        body, u_ = flexing.body, flexing.u
        R = u_[None] @ X - (body[3:, 3:] @ omega)[None] @ w + TURN * eq.times(frequency, stiff)
        rates += [s_d, -R]
        load += u_[:, None] @ R - (body @ X_f)[:, None] @ eq.times(FACTOR, s)
        load -= (body @ X_c + _gyroscopic(body, omega))[:, None] @ s
        load -= np.concatenate([2 * W @ u_[:3], W @ u_[3:] + body[3:, 3:] @ omega])[:, None] @ s_d
    first += 2 * len(craft.modes)
    for k, (number, spin) in enumerate(craft.spins.items()):
        axes, kept = craft.tanks[number].axes, spin.coupling @ spin.momentum
        L, w_t = x[first + 3 * k : first + 3 * k + 3], axes.T @ w
        slip = spin.inverse @ L - spin.coupling @ w_t
        at_point = _cross(spin.slip(axes.T @ omega))
        rate = at_point @ L - (_cross(spin.momentum) + spin.friction) @ slip
        rates.append(rate)
        turned = spin.coupling @ rate - _cross(kept) @ w_t
        load[3:] -= axes @ (turned + _cross(axes.T @ omega) @ spin.coupling @ L)
    known = craft.liquid + craft.deformed()
    wet = known @ X + _gyroscopic_slope(known, omega) @ w
    # dry craft: one product with a parameter for each term in which it appears
    accelerated = a.copy()
    turn = [_cross(np.eye(3)[i]) for i in range(3)]
    for i in range(3):
        moved = inwards(np.eye(3)[i]) @ w - turn[i] @ w_d
        accelerated += eq.times(f"craft.r[{i + 1}]", moved)
    weight = eq.times("craft.mass", accelerated)
    wet[:3] += weight
    for i in range(3):
        wet[3:] += eq.times(f"craft.r[{i + 1}]", turn[i] @ weight)
    for axes, (i, j) in AXES.items():
        J = np.zeros((6, 6))
        J[3 + i, 3 + j] = J[3 + j, 3 + i] = 1.0
        wet += eq.times(f"craft.J{axes}", J @ X + _gyroscopic_slope(J, omega) @ w)
    # solve the equations for X and y, and eliminate both
    balance = np.vstack([load - wet, *quotients])
    at = slice(n + m, n + m + unknown)
    solved = np.linalg.solve(-balance[:, at], balance)
    order = np.argsort([j for j, _ in eq.channels], kind="stable")
    z = [eq.channels[i][1] for i in order]
    rows = np.vstack([*rates, *(row[None] for row in z), x[:6]])
    rows = rows + rows[:, at] @ (solved - eq.unit(n + m, unknown))
    columns = [*range(n), *(eq.width + order), *range(n, n + m)]
    counts = [sum(j == of for j, _ in eq.channels) for of in range(spread.shape[1])]
    return rows[:, columns], counts, tuple(states)


def _connected(M: Matrix, inside: int) -> NDArray[np.bool_]:
    """Return a mask of the first ``inside`` signals: those between an input and an output.

    Such a signal depends on an input of M and affects an output of M, directly or through others.
    """
    size = np.abs(M).max(axis=1, keepdims=True)
    joined = np.abs(M) > 1e-14 * size
    reached = joined[:inside, inside:].any(axis=1)
    seen = joined[inside:, :inside].any(axis=0)
    for _ in range(inside):
        reached |= joined[:inside, :inside][:, reached].any(axis=1)
        seen |= joined[:inside, :inside][seen].any(axis=0)
    found: NDArray[np.bool_] = reached & seen
    return found


def _reduced(M: Matrix, first: int, counts: list[int]) -> tuple[Matrix, list[int]]:
    """Return M with the smallest number of copies of each uncertain parameter, and these numbers.

    ``counts`` has the present numbers; the copies begin at the row and column ``first`` of M. A
    repeated real block is like a block of integrators, so that it can be reduced to its
    controllable and observable part. Each block is reduced with the others unchanged.
    """
    counts = list(counts)
    for k in range(len(counts)):
        at = first + sum(counts[:k])
        of = np.zeros(len(M), bool), np.zeros(M.shape[1], bool)
        for axis in of:
            axis[at : at + counts[k]] = True
        z, w = of
        model = LinearModel(M[np.ix_(z, w)], M[np.ix_(z, ~w)], M[np.ix_(~z, w)],
                            M[np.ix_(~z, ~w)], (), (), ())  # fmt: skip
        A, B, C, D = minimal(model)
        counts[k] = len(A)
        upper = np.hstack([B[:, :at], A, B[:, at:]])
        rest = np.hstack([D[:, :at], C, D[:, at:]])
        M = np.vstack([rest[:at], upper, rest[at:]])
    return M, counts


@dataclass(frozen=True, eq=False)
class UncertainModel:
    """Spacecraft with uncertain parameters as a linear fractional transformation y = F_u(M, Δ) u.

    `uncertain` and `Craft.uncertain` return an instance. Δ is real and diagonal. Each δ named in
    ``deltas`` has ``|δ| ≤ 1``, and ``counts`` has the number of its copies on the diagonal of Δ.
    The parameters are ``center`` + ``spread`` · δ.

    Attributes
    ----------
    M : LinearModel
        The known part of the model. Its inputs are the outputs of Δ, followed by u; its outputs are
        the inputs of Δ, followed by y.
    spread : DataFrame
        Change of each parameter (row) with each δ (column), SI units.
    center : dict of str to float
        Parameters at Δ = 0, SI units.
    counts : tuple of int
        Number of copies of each δ in Δ.
    model : str or Path
        Name of the FMU, or its file.
    given : dict
        Parameters of the FMU at its operating point.
    tanks : tuple of str
        Names of the craft's tanks. `delta` also accepts quantities with these names, for example
        ``main.frequency[1]`` instead of ``tank[1].frequency[1]``.

    Examples
    --------
    >>> import hubslosh
    >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
    >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.8), modes=1, nu=0.9e-6)}
    >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
    >>> model = craft.uncertain("50%", {"main.frequency[1]": "10%", "main.zeta[1]": "interval"})
    >>> model.deltas, model.order
    (('tank[1].frequency[1]', 'tank[1].zeta[1]'), 6)

    Parameters and linear model at the upper end of the frequency's range:

    >>> end = {"tank[1].frequency[1]": 1.0}
    >>> model.delta(end).tolist(), round(model.values(end)["tank[1].frequency[1]"], 4)
    ([1.0, 0.0], 0.2403)
    >>> model.at(end).modes()["frequency"].round(4).tolist()
    [0.2673, 0.2681]
    >>> model.parameters(end)["tank[1].modes"]
    1

    A loop with a delay of 1 s is stable, but not for every value within the ranges:

    >>> import numpy as np
    >>> loop = craft.loop(np.hstack([20 * np.eye(3), 80 * np.eye(3)]), 0.1, "50%", delay=1.0)
    >>> round(model.worst_case(loop).size, 3)
    0.787
    >>> model.certify(loop).size > 0.75
    True
    >>> model.closed(loop, [0.1, 0.2]).shape, model.mu_upper(loop, [0.1, 0.2]) < 1
    ((2, 6, 6), array([ True,  True]))

    Files for other tools:

    >>> model.to_mat("model.mat"), model.to_json("model.json")
    (None, None)
    >>> model.as_dict()["repetition"], model.to_control().nstates
    ([4, 2], 10)
    """

    M: LinearModel
    spread: "pd.DataFrame"
    center: "dict[str, float]"
    counts: tuple[int, ...]
    model: str | Path
    given: "dict[str, Quantity]"
    _craft: _Craft
    _values: "dict[str, float]"
    _X_f: Matrix
    _X_c: Matrix
    tanks: tuple[str, ...] = ()

    @property
    def deltas(self) -> tuple[str, ...]:
        """Names of the δ in Δ.

        The names are the parameters with ranges, then ``axis[n]`` for the principal axes of a
        covariance.
        """
        return tuple(str(name) for name in self.spread.columns)

    @property
    def order(self) -> int:
        """Number of rows of Δ, in which a parameter may occur several times."""
        return sum(self.counts)

    def __repr__(self) -> str:
        M, width = self.M, self.order
        copies = names([
            f"{short_name(n, self.tanks)} × {c}"
            for n, c in zip(self.deltas, self.counts, strict=True)
        ])  # fmt: skip
        return (
            f"UncertainModel, {len(M.A)} states, Δ of {width}: {copies}\n"
            f"  inputs: {names(M.inputs[width:])}\n  outputs: {names(M.outputs[width:])}"
        )

    def delta(self, delta: Mapping[str, float] | ArrayLike) -> Matrix:
        """Return values of δ, given by name or as a sequence, as a vector.

        Parameters
        ----------
        delta : mapping or array_like, shape (len(deltas),)
            Values of δ by the names in `deltas`, where a missing name means 0; or a sequence in the
            order of `deltas`. ±1 is an end of the parameter's range.

        Returns
        -------
        ndarray, shape (len(deltas),)
            The numbers in the order of `deltas`.

        Raises
        ------
        FmuError
            If a name is not among `deltas`, or the numbers are too few, too many or not finite.
        """
        if isinstance(delta, Mapping):
            given = {full_name(name, self.tanks): x for name, x in delta.items()}
            if unknown := [name for name in given if name not in self.deltas]:
                hint = did_you_mean(unknown[0], self.deltas)
                raise FmuError(f"Δ has no {', '.join(unknown)}{hint}")
            return np.array([float(given.get(name, 0.0)) for name in self.deltas])
        found = floats(delta)
        if found.shape != (len(self.counts),) or not np.isfinite(found).all():
            raise FmuError(f"Δ must be {len(self.counts)} finite numbers, not {delta!r}")
        return found

    def values(self, delta: Mapping[str, float] | ArrayLike) -> "dict[str, float]":
        """Return the uncertain parameters at Δ.

        Parameters
        ----------
        delta : mapping or array_like
            Δ, as for `delta`.

        Returns
        -------
        dict of str to float
            Values in SI units by name.
        """
        change = self.spread.to_numpy() @ self.delta(delta)
        return {name: self.center[name] + float(x)
                for name, x in zip(self.spread.index, change, strict=True)}  # fmt: skip

    def at(self, delta: Mapping[str, float] | ArrayLike) -> LinearModel:
        """Return the linear model at Δ.

        The model equals the result of `linearize` with the parameters that `parameters` returns,
        except for rounding errors. A component of a quaternion, or of a pendulum's direction, that
        follows from the unit norm is not a state of the model.

        Parameters
        ----------
        delta : mapping or array_like
            Δ, as for `delta`.

        Returns
        -------
        LinearModel
            The model from u to y.
        """
        plant, scale = self._plants(self.delta(delta)), self._scale(delta)
        return replace(plant, A=plant.A * scale / scale[:, None], B=plant.B / scale[:, None],
                       C=plant.C * scale)  # fmt: skip

    def _plants(self, deltas: Matrix) -> LinearModel:
        """Return the linear model at the Δ ``deltas``, or a stack of models if ``deltas`` has rows.

        The states are those of M, whose slosh states are scaled differently from the FMU's.
        """
        width, (A, B, C, D), n = self.order, self.M, len(self.M.A)
        D_x = np.repeat(deltas, self.counts, axis=-1)
        seen = np.hstack([C[:width], D[:width, width:]])
        seen = np.broadcast_to(seen, (*D_x.shape[:-1], *seen.shape))
        closing = np.linalg.solve(np.eye(width) - D[:width, :width] * D_x[..., None, :], seen)
        every = np.block([[A, B[:, width:]], [C[width:], D[width:, width:]]])
        every = every + np.vstack([B[:, :width], D[width:, :width]]) @ (D_x[..., None] * closing)
        return LinearModel(
            every[..., :n, :n], every[..., :n, n:], every[..., n:, :n], every[..., n:, n:],
            self.M.states, self.M.inputs[width:], self.M.outputs[width:],
        )  # fmt: skip

    def _scale(self, delta: Mapping[str, float] | ArrayLike) -> Matrix:
        """Return the ratio of each state of M to the FMU's state of the same name, at ``delta``.

        For a slosh mode the ratio is the slosh mass times the pendulum length; for others it is 1.
        """
        values = self._values | self.values(delta)
        sizes = {
            (bob.tank, bob.mode): values[bob.name("mass")] * self._length(bob, values)
            for bob in self._craft.bobs
        }
        found = [re.fullmatch(r"tank\[(\d)\]\.p(?:_dot)?\[(\d),\d\]", state)
                 for state in self.M.states]  # fmt: skip
        return np.array([sizes[int(of[1]), int(of[2])] if of else 1.0 for of in found])

    def _ratio(self, bob: _Bob, values: Mapping[str, float]) -> float:
        """Return the frequency of a slosh mode in ``values`` divided by its nominal value."""
        return values[bob.name("frequency")] / self._craft.values[bob.name("frequency")]

    def _acceleration(self, values: Mapping[str, float]) -> Matrix:
        """Return specific force at O and angular acceleration of the craft with ``values``."""
        return values[FACTOR] * self._X_f + self._X_c

    def _length(self, bob: _Bob, values: Mapping[str, float]) -> float:
        """Return the pendulum length (m) of the mode ``bob`` at the frequency in ``values``.

        It is chosen so that the specific force and the centring stiffness keep their shares of the
        restoring force.
        """
        craft, axis = self._craft, self._craft.tanks[bob.tank].axes[:, 2]
        before, now = (
            axis @ craft.specific(self._acceleration(of), craft.place(bob, of))
            for of in (craft.values, values)
        )
        # without a specific force the length has no effect
        grown = now / before if before > ALONE * craft.tanks[bob.tank].g_ref else 1.0
        return float(bob.length * grown / self._ratio(bob, values) ** 2)

    def parameters(
        self, delta: Mapping[str, float] | ArrayLike, *, commanded: bool = False
    ) -> "dict[str, Quantity]":
        """Return the parameters of Spacecraft at Δ, for `linearize` and `simulate`.

        Force and torque are set so that the acceleration at the operating point does not change;
        the damping forces do not change, either. The rigid liquid changes with the slosh masses and
        their heights; if its own inertia would become negative, as in a sphere, the inertia of the
        dry craft is reduced instead.

        Parameters
        ----------
        delta : mapping or array_like
            Δ, as for `delta`.
        commanded : bool
            Leave the torque out, for a `Loop` that commands it.

        Returns
        -------
        dict
            Values in SI units by the names of the FMU's parameters.
        """
        craft, values = self._craft, self._values | self.values(delta)
        new: dict[str, Quantity] = dict(self.given)
        new |= {name: values[name] for name in craft.values if name.startswith("craft.")}
        wrench = craft.mass_matrix(values) @ self._acceleration(values) + craft.load(values)
        wrench, J = wrench - craft.pull(values), craft.dry(values)[2]
        for mode in craft.modes:
            new |= {mode.name(kind): values[mode.name(kind)] for kind in KINDS[:2]}
        new |= {name: float(x) for name, x in zip(INPUTS, wrench, strict=True)}
        if commanded:
            new = {name: x for name, x in new.items() if not name.startswith("torque[")}
        for number, tank in craft.tanks.items():
            of = f"tank[{number}]"
            points = [
                (sign * known[bob.name("mass")], known[bob.name("bob")])
                for bob in craft.bobs if bob.tank == number
                for sign, known in ((1, craft.values), (-1, values))
            ]  # fmt: skip
            m_0, H_0, I_0, lent = rigid_rest(tank.m_0, tank.H_0, tank.I_0, tank.more_y, points)
            J += lent * tank.axes[:, :2] @ tank.axes[:, :2].T
            new |= {f"{of}.m_0": m_0, f"{of}.H_0": H_0, f"{of}.I_0": I_0}
            new |= {f"{of}.damping_law": "constant", f"{of}.damping_law_kind": 0}
        new |= {f"craft.J{axes}": float(J[at]) for axes, at in AXES.items()}
        for bob in craft.bobs:
            tank, m = craft.tanks[bob.tank], values[bob.name("mass")]
            length = self._length(bob, values)
            w = TURN * values[bob.name("frequency")]
            k = bob.stiffness * self._ratio(bob, values) ** 2
            zeta = values[bob.name("zeta")] * w / np.sqrt(tank.g_ref / length + k)
            new |= {
                bob.name("mass"): m, bob.name("length"): length, bob.name("frequency"): 0.0,
                bob.name("hinge"): values[bob.name("bob")] + length, bob.name("k"): k * m,
                bob.name("zeta"): float(zeta),
            }  # fmt: skip
        return new

    def _around(self, loop: Loop) -> tuple["UncertainModel", LinearModel]:
        """Return this model with the commands of a loop as inputs, and the loop's controller.

        If the loop commands a wheel, its torque T acts on the craft, which turns at w. The
        momentum h of the wheel, with the derivative -T, causes the further torque -w × h. Raises
        FmuError if the loop does not fit the model.
        """
        K, M, width = loop._must_be_linear(), self.M, self.order
        measured, inputs = loop.names[0], loop._acting_inputs
        if (measured, inputs) != (list(M.outputs[width:]), list(M.inputs[width:])):
            wanted = repr(inputs) if loop._turned else "loop.names[1]"
            raise FmuError(
                f"the loop measures {', '.join(measured)} and commands {', '.join(inputs)}, but "
                f"the outputs of the uncertain model are {', '.join(M.outputs[width:])}, and its "
                f"inputs {', '.join(M.inputs[width:])}. They must be the same in the same order: "
                f"create the model with uncertain(…, inputs={wanted}, outputs=loop.names[0])"
            )
        if not loop._turned:
            return self, K
        torque = [M.inputs.index(name) for name in TORQUE]
        B, D = (np.hstack([of, of[:, torque] @ -_cross(self._craft.omega)]) for of in (M.B, M.D))
        M = replace(M, B=B, D=D, inputs=(*M.inputs, *MOMENTUM))
        M = loop._with_wheels(M, [*M.inputs[:width], *loop.names[1]])
        return replace(self, M=M), K

    def closed(self, loop: Loop, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Return the response N of the closed loop from the outputs to the inputs of Δ.

        The zero-order hold also produces images of each frequency around multiples of the sampling
        rate. Their part of the loop gain is computed with Δ = 0, because it is small: 1e-6 at the
        slosh frequencies of the book's example.

        Parameters
        ----------
        loop : Loop
            Loop with a linear controller that measures the model's outputs and commands its inputs.
            A model with the three components of torque among its inputs also takes a loop that
            commands wheels; the momentum that they gain is included.
        frequency : array_like, shape (n,)
            Frequencies, Hz, above 0 and below half the sampling rate.

        Returns
        -------
        ndarray of complex, shape (n, order, order)
            N at each frequency.

        Raises
        ------
        FmuError
            If the loop does not fit the model.
        """
        model, K = self._around(loop)
        f = np.atleast_1d(floats(frequency))
        w = TURN * f
        late = loop.delay + loop.latency * loop.period
        hold = np.sinc(w * loop.period / TURN) * np.exp(-1j * w * (loop.period / 2 + late))
        gains = K.response(f) * hold[:, None, None]
        n, P = model.order, model.M.response(f)
        gain = loop._gain(model.at(np.zeros(len(self.counts))), K)
        across = np.eye(gains.shape[1]) + gain.response(f)
        found: NDArray[np.complex128] = P[:, :n, :n] - P[:, :n, n:] @ np.linalg.solve(
            across, gains @ P[:, n:, :n]
        )
        return found

    def mu_upper(self, loop: Loop, frequency: ArrayLike) -> Matrix:
        """Return an upper bound of µ of the closed loop at each frequency.

        D and G scalings with a full block for each parameter (Fan, Tits and Doyle 1991) prove that
        the loop has no pole at this frequency for all Δ up to a certain size. The bound is 1
        divided by the largest such size, and at least 0.001. Quantities such as damping ratios stay
        at 0 or above. The bound holds only at the given frequencies, and not between them; use
        `certify` for all frequencies.

        Parameters
        ----------
        loop : Loop
            Loop, as for `closed`.
        frequency : array_like, shape (n,)
            Frequencies, as for `closed`, Hz.

        Returns
        -------
        ndarray, shape (n,)
            Upper bounds, at most 0.5 % above the smallest bounds that such scalings give.

        Raises
        ------
        FmuError
            If the loop does not fit the model, or the package clarabel is missing.
        """
        from .scalings import Scalings

        scalings, size, found = Scalings(self.counts), 1.0, []
        for N in self.closed(loop, frequency):
            size = scalings.largest(N, self._least, size)
            found.append(1 / size)
        return np.array(found)

    def certify(
        self,
        loop: Loop,
        largest: float = 3.0,
        *,
        gap: float = 1.04,
        most: int = 1000,
        worst: WorstCase | None = None,
        progress: Progress = None,
    ) -> Certificate:
        """Prove that the loop is stable for all Δ up to a size close to the worst case.

        The proof holds for all frequencies, not only for a grid, because each pair of D and G
        scalings is valid on an interval of frequency. Where no scalings exist for the whole box of
        Δ, the box is divided. The certified size is the size of the worst case divided by ``gap``,
        or ``largest`` if no worst case was found. If this size cannot be proved, a smaller size is
        tried. Needs the package clarabel: ``pip install 'hubslosh[robust]'``.

        Parameters
        ----------
        loop : Loop
            Loop, as for `closed`.
        largest : float
            Largest ``|δ|`` to search and to certify.
        gap : float
            Ratio of the size of the worst case to the size to certify; above 1.
        most : int
            Largest number of convex problems to solve for each size.
        worst : WorstCase, optional
            Result of `worst_case` for this loop; by default `worst_case` is called.
        progress : bool or callable, optional
            Shows a line on stderr, as for `worst_case`; during the proof it shows the proved share.

        Returns
        -------
        Certificate
            Certified size, worst case, and the scalings.

        Raises
        ------
        FmuError
            If the loop does not fit the model or is unstable at Δ = 0, a number is out of range,
            or the package clarabel is missing.
        """
        check_ranges(most=most)
        if not gap > 1:
            raise FmuError(f"gap = {gap!r} must be above 1, such as 1.05")
        (model, K), least = self._around(loop), self._least
        delta_search = DeltaSearch(model, loop, K, progress)
        search = Search(
            lambda f: self.closed(loop, f), delta_search.poles, self.counts, loop.period, progress
        )
        if worst is None:
            worst = delta_search.worst(largest)
        elif worst.delta and not delta_search.is_limit(self.delta(worst.delta)):
            raise FmuError(
                "worst is not a worst case of this loop, because the loop is not at the limit of "
                "stability at its Δ: give the result of worst_case of the same model and loop"
            )
        data: dict[str, NDArray[Any]] = {}
        size, solved = 0.0, 0
        for factor in SIZES:
            while True:
                known = worst.size / gap if np.isfinite(worst.size) else largest
                tried = min(known, largest) / factor
                box = np.maximum(-tried, least), np.full(len(least), tried)
                search.scalings.solved = 0
                try:
                    data, size = search.certify(*box, most), tried
                except UnstableError as found:
                    smaller = delta_search.limit(found.delta)
                    if smaller is not None and smaller.size < worst.size:
                        worst = delta_search.smallest([], smaller, smaller.size)
                        continue
                except ExhaustedError:
                    pass
                finally:
                    search.line.close()
                    solved += search.scalings.solved
                break
            if size:
                data |= model._checked(loop, K) | {"size": np.array(size)}
                break
        ends = {name: float(x) for name, x in zip(self.deltas, least, strict=True)
                if np.isfinite(x)}  # fmt: skip
        return Certificate(size, worst, ends, data, solved)

    def _checked(self, loop: Loop, K: LinearModel) -> "dict[str, NDArray[Any]]":
        """Return the matrices of M, of the controller ``K`` and of the loop gain at Δ = 0, by name.

        Also return bounds and copies of each δ, and the loop's period and delay, s. A certificate
        is checked with these numbers.
        """
        gain = loop._gain(self.at(np.zeros(len(self.counts))), K)
        systems = {"M": self.M, "K": K, "L": gain}
        found = {f"{name}_{part}": matrix for name, system in systems.items()
                 for part, matrix in zip("ABCD", system, strict=True)}  # fmt: skip
        late = loop.delay + loop.latency * loop.period
        return found | {
            "least": self._least, "counts": np.array(self.counts), "deltas": np.array(self.deltas),
            "period": np.array(loop.period), "delay": np.array(late),
        }  # fmt: skip

    @property
    def _least(self) -> Matrix:
        """Lower bound of each δ, or -inf.

        At the bound a damping ratio is almost 0; a mass, moment of inertia or frequency is 1 % of
        its nominal value.
        """
        found = np.full(len(self.deltas), -np.inf)
        for k, name in enumerate(self.deltas):
            if name in self.spread.index and (share := _LEAST.get(_kind(name))) is not None:
                found[k] = (share - 1) * self.center[name] / self.spread.loc[name, name]
        return found

    def worst_case(
        self, loop: Loop, largest: float = 3.0, *, progress: Progress = None
    ) -> WorstCase:
        """Search for the smallest real Δ that brings the loop to the limit of stability.

        The search uses the exact sampled loop with its delay. For each lightly damped pole, it
        moves each δ in the direction that reduces the damping of the pole, up to ``|δ| = largest``,
        until these directions repeat. It also tries the lines from 0 to each corner of the ranges
        (or to 64 corners if there are more), random Δ, and Δ at which two uncertain frequencies are
        equal. Then it searches for smaller unstable Δ in boxes that shrink. Damping ratios stay at
        0 or above. If an unstable Δ is found, 1 divided by its size is a lower bound of µ. If none
        is found, the loop may still be unstable for some Δ: only `certify` proves stability.

        Parameters
        ----------
        loop : Loop
            Loop, as for `closed`.
        largest : float
            Largest ``|δ|`` to search.
        progress : bool or callable, optional
            Shows a line on stderr with the smallest size so far and the remaining time, by default
            on a terminal and in a notebook; or a function that takes the line.

        Returns
        -------
        WorstCase
            Δ, its size and the parameters there.

        Raises
        ------
        FmuError
            If the loop does not fit the model or is unstable at Δ = 0, or ``largest`` is out of
            range.
        """
        check_ranges(largest=largest)
        model, K = self._around(loop)
        return DeltaSearch(model, loop, K, progress).worst(largest)

    def _of_kind(self, kind: str) -> list[int]:
        """Return the indices of the δ of one kind of quantity, such as "zeta"."""
        return [k for k, name in enumerate(self.deltas) if _kind(name) == kind]

    def as_dict(self) -> "dict[str, Any]":
        """Return the content of the files that `to_mat` and `to_json` write.

        Returns
        -------
        dict
            Matrices ``A``, ``B``, ``C``, ``D`` of M, ``size_of_delta``, names of ``states``,
            ``inputs`` and ``outputs``, the blocks of Δ (``deltas``, ``repetition``, ``middle``,
            ``radius``), ``parameters`` with ``center``, ``low`` and ``high``, and ``spread``.
        """
        M, width = self.M, self.order
        ends = {name: [self.center[name] - x, self.center[name] + x]
                for name, x in zip(self.spread.index, np.abs(self.spread).sum(axis=1),
                                   strict=True)}  # fmt: skip
        alone = self.spread.columns.isin(self.spread.index)
        middle = [self.center.get(name, 0.0) if own else 0.0
                  for name, own in zip(self.deltas, alone, strict=True)]  # fmt: skip
        radius = [float(self.spread.loc[name, name]) if own else 1.0
                  for name, own in zip(self.deltas, alone, strict=True)]  # fmt: skip
        return {
            "A": M.A, "B": M.B, "C": M.C, "D": M.D, "size_of_delta": width,
            "states": list(M.states), "inputs": list(M.inputs[width:]),
            "outputs": list(M.outputs[width:]),
            "deltas": list(self.deltas), "repetition": list(self.counts), "middle": middle,
            "radius": radius, "parameters": list(self.spread.index),
            "center": [self.center[name] for name in self.spread.index],
            "low": [low for low, _ in ends.values()], "high": [high for _, high in ends.values()],
            "spread": self.spread.to_numpy(),
        }  # fmt: skip

    def to_mat(self, path: str | Path) -> None:
        """Write M, the blocks of Δ, names and ranges for MATLAB or Octave; see `read_lft.m`.

        Parameters
        ----------
        path : str or Path
            File to write, .mat (version 5).

        Raises
        ------
        FmuError
            If the name does not end in .mat, or the file cannot be written.
        """
        from .files import to_mat

        to_mat(self, path)

    def to_json(self, path: str | Path) -> None:
        """Write the content of `as_dict` as JSON.

        Parameters
        ----------
        path : str or Path
            File to write, .json.

        Raises
        ------
        FmuError
            If the name does not end in .json, or the file cannot be written.
        """
        from .temporary import write_file

        every = {key: value.tolist() if hasattr(value, "tolist") else value
                 for key, value in self.as_dict().items()}  # fmt: skip
        write_file(path, ".json", lambda: json.dumps(every, indent=1, ensure_ascii=False) + "\n")

    def to_control(self) -> Any:
        """Convert M to python-control; dots in names become underscores.

        Returns
        -------
        control.StateSpace
            M, with the signals of Δ first.

        Raises
        ------
        FmuError
            If the package control is not installed.
        """
        M = self.M
        named = [tuple(name.replace(".", "_") for name in of)
                 for of in (M.states, M.inputs, M.outputs)]  # fmt: skip
        return LinearModel(*M, *named).to_control()


def _kind(name: str) -> str:
    """Return the kind of a quantity without tank and number: "zeta" for "tank[1].zeta[1]"."""
    return re.sub(r"^(tank|appendage)\[\d\]\.|\[\d\]$", "", name)


def _unknown(name: str, values: Mapping[str, float]) -> str:
    """Return an error message with advice for a name that is no uncertain parameter.

    ``values`` has all parameters that can be uncertain, for the proposal of a similar name.
    """
    if instead := slosh_mass_error(name):
        return f"{name} {instead}"
    return f"{name} is no uncertain parameter{did_you_mean(name, values)}"


def uncertain(
    parameters: Parameters | str | Path | None,
    ranges: Mapping[str, Any] | None = None,
    inputs: Sequence[str] | str = "torque",
    outputs: Sequence[str] | str = ("q[2]", "q[3]", "q[4]", "omega"),
    *,
    covariance: "pd.DataFrame | Identification | None" = None,
    sigmas: float = 2.0,
    model: str | Path = "Spacecraft",
) -> UncertainModel:
    """Return a linear model of Spacecraft with uncertain parameters, exact for every value.

    The craft must be free and at rest, and its tanks axially symmetric. Warns with FmuWarning if
    its thrust turns the craft faster and faster; `Craft.uncertain` trims the craft first.

    Uncertain parameters are:

    * ``tank[1].frequency[1]``, Hz, in a fixed tank under the present thrust; the height of the
      slosh mass and the share of a centring stiffness do not change;
    * ``tank[1].zeta[1]``;
    * ``tank[1].mass[1]`` and ``tank[1].bob[1]``, the height of the slosh mass on the tank's axis;
      mass, centre of mass and inertia of the whole liquid do not change;
    * ``craft.mass``, ``craft.Jxx``, … and ``craft.r[1]``, … of the dry craft; the acceleration at
      the operating point does not change;
    * ``appendage[1].frequency``, Hz, with the interface fixed, and ``appendage[1].zeta``;
    * ``acceleration``, a factor of the acceleration that force and torque give the craft.

    Parameters
    ----------
    parameters : mapping, str or Path, optional
        Parameters of Spacecraft, as for `linearize`: craft, tanks, force.
    ranges : mapping, optional
        Range of each uncertain parameter by name: (low, high) in SI units, or a share of the value
        such as ``"5%"``, which means ± 5 %.
    inputs : str or sequence of str
        Inputs u: components of force and torque, or "force" and "torque" for all three.
    outputs : str or sequence of str
        Outputs y: components of q and omega.
    covariance : DataFrame or Identification, optional
        Covariance with names of uncertain parameters as index and columns, SI units. Or a result of
        `identify` with ``free=``, whose parameters (``tank[1].length[1]``, ``hinge``, ``m_0``, …)
        are converted to first order, without biases and initial states. The δ of Δ are then
        coordinates along the principal axes of the correlations.
    sigmas : float
        Number of standard deviations along a principal axis that ``δ = ±1`` means.
    model : str or Path
        Name of the FMU, or its file.

    Returns
    -------
    UncertainModel
        The known part M and the uncertain part Δ.

    Raises
    ------
    FmuError
        If the craft is not free and at rest, a tank is not axially symmetric, or a name or a range
        is not allowed.

    Examples
    --------
    >>> import hubslosh
    >>> craft = {"craft.mass": 900.0, "craft.Jxx": 400.0, "tanks": 0}
    >>> model = hubslosh.uncertain(craft, {"craft.Jxx": "10%"}, "torque[1]", "omega[1]")
    >>> model.at({"craft.Jxx": 1.0}).B.round(6).tolist()
    [[0.002273]]
    """
    import pandas as pd

    from .program import Identification

    given = dict(parameters_of(parameters))
    craft = _read(model, given)
    values = dict(craft.values)
    ranges = dict(ranges or {})
    problems = [_unknown(name, values) for name in ranges if name not in values]
    problems += out_of_range(sigmas=sigmas)
    of_axes, root = [], np.zeros((0, 0))
    if covariance is not None:
        is_fit = isinstance(covariance, Identification)
        table = covariance.covariance if is_fit else covariance
        try:
            if is_fit:
                # leave out biases and initial states, which belong to a recording, not to the craft
                kept = [name for name in table.index if not re.search(r"[@(]|^init\.", name)]
                table = table.loc[kept, kept]
            root = _root(table[list(table.index)].to_numpy(float))
        except (KeyError, ValueError, TypeError, np.linalg.LinAlgError):
            wide = [n for n in table.index if is_fit and not np.isfinite(table.loc[n, n])]
            problems.append(
                f"the fit does not determine {', '.join(wide)}: give identify a prior"
                if wide
                else "covariance must be a positive semidefinite table of the same names"
            )
        of_axes = [str(name) for name in table.index]
        twice = set(of_axes)
        if is_fit:
            slopes, more = _converted(model, given, craft, table)
            problems += more
            if not problems:
                root, of_axes = slopes.to_numpy() @ root, [str(name) for name in slopes.index]
            # parameters of the rigid liquid change the dry craft's properties, which may also have
            # ranges
            twice |= {name for name in of_axes if not name.startswith("craft.")}
        else:
            problems += [_unknown(name, values) for name in of_axes if name not in values]
        problems += [f"{name} has a range and a covariance" for name in ranges if name in twice]
    columns: dict[str, Matrix] = {}
    every = list(dict.fromkeys([*ranges, *of_axes]))
    if not every:
        problems.append("nothing is uncertain: give ranges or covariance")
    for k, (name, of) in enumerate(ranges.items()):
        if name not in values:
            continue
        try:
            low, high = range_ends(of, values[name])
        except ValueError as error:
            problems.append(f"{name} {error}")
            continue
        kind = name.split(".")[-1].split("[")[0]
        if low <= 0 and (kind in ("frequency", "mass") or name == FACTOR):
            problems.append(f"{name} = {low:g} is not above 0")
        if low < 0 and kind == "zeta":
            problems.append(f"{name} = {low:g} is below 0")
        values[name] = (low + high) / 2
        columns[name] = np.zeros(len(every))
        columns[name][k] = (high - low) / 2
    for column in () if problems else root.T:
        named = pd.Series(sigmas * column, of_axes).reindex(every, fill_value=0.0)
        columns[f"axis[{len(columns) - len(ranges) + 1}]"] = named.to_numpy()
    chosen = []
    for given_names, allowed, what in ((inputs, INPUTS, "inputs"), (outputs, OUTPUTS, "outputs")):
        listed = names_of(given_names, what, problems)
        parts = {name: [a for a in allowed if a.startswith(f"{name}[")] for name in listed}
        listed = [part for name in listed for part in parts[name] or [name]]
        problems += [f"{name} is not among the {what} ({', '.join(allowed)})"
                     for name in listed if name not in allowed]  # fmt: skip
        chosen.append(listed)
    if problems:
        raise FmuError("; ".join(problems))
    spread = pd.DataFrame(columns, index=every)
    _, X_0 = craft.accelerations()
    warn_of_rotation("the point of an uncertain Spacecraft", X_0[3:])
    warn_of_attitude("the point of an uncertain Spacecraft", chosen[1], craft.omega)
    X_c = -np.linalg.solve(craft.mass_matrix(craft.values), craft.load(craft.values))
    M, counts, states = _partitioned(craft, values, spread, X_0 - X_c, X_c)
    n = len(states)
    rows = [*range(n + sum(counts)), *(n + sum(counts) + OUTPUTS.index(name) for name in chosen[1])]
    M = M[rows][:, [*range(n + sum(counts)),
                    *(n + sum(counts) + INPUTS.index(name) for name in chosen[0])]]  # fmt: skip
    kept = _connected(M, n + sum(counts))
    blocks = np.repeat(np.arange(len(counts)), counts)[kept[n:]]
    states = tuple(name for name, here in zip(states, kept[:n], strict=True) if here)
    n = len(states)
    M = M[np.pad(kept, (0, len(chosen[1])), constant_values=True)]
    M = M[:, np.pad(kept, (0, len(chosen[0])), constant_values=True)]
    M, counts = _reduced(M, n, [int((blocks == k).sum()) for k in range(len(counts))])
    signals = [f"{name}#{k}" for name, c in zip(columns, counts, strict=True)
               for k in range(1, c + 1)]  # fmt: skip
    whole = LinearModel(M[:n, :n], M[:n, n:], M[n:, :n], M[n:, n:], states,
                        (*(f"w:{name}" for name in signals), *chosen[0]),
                        (*(f"z:{name}" for name in signals), *chosen[1]))  # fmt: skip
    center = {name: values[name] for name in every}
    return UncertainModel(whole, spread, center, tuple(counts), model, given, craft, values,
                          X_0 - X_c, X_c)  # fmt: skip
