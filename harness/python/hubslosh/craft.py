"""A spacecraft with tanks: mass properties, parameters of the FMU and control loops at any fill."""

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import native
from .appendages import Appendage
from .arguments import (
    array,
    caller,
    not_positive,
    not_vectors,
    percent_of,
    refuse,
    vector,
    wrong_parts,
)
from .engines import Engine, pulse_history, resultant
from .fmu import Fmu, FmuError, FmuWarning, Parameters, Quantity
from .linearization import LinearModel, linearize
from .loop import Loop
from .operating_point import OperatingPoint, rotation, trim
from .quantities import (
    DELAY,
    NO_MODE,
    OMEGA,
    RESERVED,
    Modes,
    Names,
    apply_changes,
    full_names,
    mode_quantity,
    nominal_value,
    short_name,
)
from .simulation import outputs_of, parameters_of
from .tanks import (
    Tank,
    TankCase,
    _from_z,
    _tank_source,
    amount_of,
    check_fill,
    fill_table,
    is_mass,
    read_drawing,
    solve,
)
from .wheels import MOMENTUM, Wheel, momentum, wrong_wheels

if TYPE_CHECKING:
    import pandas as pd

    from .review import Review
    from .run import Run
    from .sampling import Outcome
    from .uncertainty import UncertainModel
    from .viewing import View

Vector = NDArray[np.float64]

Fill = Any
"""One fill for all tanks, or a fill for each tank, by name or in the order of the tanks. A fill is
a height, m; a share of the volume, such as ``"60%"``; a mass, ``(120, "kg")``; or 0 for empty."""

BEYOND_THIRD_ORDER = re.compile(r"\.(nonlinear_(inertia|stiffness)_2|rotary_inertia(_2)?)\[")
"""Parameters of slosh modes that have no effect in tanks that drain or whose liquid detaches."""

MOST_TANKS = 4
"""Largest number of tanks in the FMU Spacecraft."""

SAME_SPIN = 1e-6
"""Relative difference up to which two spin rates count as equal."""

MOST_MODES = 6
"""Largest number of appendage modes in the FMU Spacecraft."""


@dataclass(frozen=True, eq=False)
class MountedTank:
    """A tank of a `Craft`: its drawing, its position and its liquid.

    Parameters
    ----------
    source : str, Path or mapping
        Drawing: a tank file (.toml), or a dict with its content, as for `tank`. The ``height`` of a
        ``domed_cylinder`` is the height of its cylindrical part, m, without the domes, whose own
        heights are ``bottom`` and ``top``.
    position : sequence of float, shape (3,)
        Position of the origin of the tank's drawing from the craft's origin O, body axes, m. The
        origin of a tank given by ``shape`` is its lowest point.
    axis : sequence of float, shape (3,) or (4,)
        Upward direction of the tank's axis in body axes, of any length; or the tank's attitude
        as a quaternion, scalar first, from tank to body axes.
    modes : int
        Number of slosh modes, 1 to 3.
    nu : float, optional
        Kinematic viscosity, m²/s, for damping ratios; without a viscosity the modes are undamped.
    sigma : float, optional
        Surface tension, N/m, from which the centring stiffnesses of weightless liquid follow.
    contact_angle : float, optional
        Contact angle between surface and wall, deg.
    spin : float, optional
        Rate at which liquid, tank and craft rotate about the tank's axis, rad/s; by default it
        follows from the ``spin`` of the `Craft`. The parameters of the FMU then include the spin
        inertia of the liquid and the gyroscopic coefficients of its modes.

    Examples
    --------
    >>> import hubslosh
    >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
    >>> hubslosh.MountedTank(sphere, (0, 0, 0.2), nu=0.9e-6)
    MountedTank(sphere, 1010 kg/m³, at (0, 0, 0.2) m, axis (0, 0, 1), modes=2)
    """

    source: str | Path | Mapping[str, Any]
    position: Sequence[float]
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    modes: int = 2
    nu: float | None = None
    sigma: float | None = None
    contact_angle: float | None = None
    spin: float | None = None

    @property
    def q(self) -> Vector:
        """Attitude as a unit quaternion, tank to body axes."""
        if len(self.axis) != 4:
            return np.array(_from_z(vector(self.axis, 3, "axis")))
        q = vector(self.axis, 4, "axis")
        return q / np.linalg.norm(q)

    @property
    def rotation(self) -> Vector:
        """Matrix from tank to body axes."""
        from scipy.spatial.transform import Rotation

        return np.asarray(Rotation.from_quat(self.q, scalar_first=True).as_matrix())

    def problems(self) -> list[str]:
        """Return everything that is wrong with the tank, except errors in its drawing.

        Returns
        -------
        list of str
            One sentence for each problem; empty if there is none.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> hubslosh.MountedTank(sphere, (0, 0, 0.2), modes=7).problems()
        ['modes must be 1, 2 or 3, not 7']
        """
        found = []
        for name, lengths in (("position", (3,)), ("axis", (3, 4))):
            try:
                numbers = array(getattr(self, name))
            except FmuError as error:
                found.append(f"{name}: {error}")
                continue
            right = numbers.shape in [(length,) for length in lengths]
            if not right or not np.isfinite(numbers).all() or (name == "axis" and not any(numbers)):
                count = " or ".join(str(length) for length in lengths)
                found.append(f"{name} must be {count} finite numbers, not {getattr(self, name)!r}")
        if self.modes not in (1, 2, 3):
            found.append(f"modes must be 1, 2 or 3, not {self.modes!r}")
        try:
            native.Liquid(1.0, self.nu, self.sigma, self.contact_angle, self.spin)
        except (FmuError, TypeError) as error:
            found.append(str(error))
        return found

    def __repr__(self) -> str:
        return f"MountedTank({self.describe()})"

    def describe(self) -> str:
        """Return a text with the shape of the tank, its position and its number of modes.

        Returns
        -------
        str
            The text.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> hubslosh.MountedTank(sphere, (0, 0, 0.2)).describe()
        'sphere, 1010 kg/m³, at (0, 0, 0.2) m, axis (0, 0, 1), modes=2'
        """
        given = self.source
        if isinstance(given, Mapping):
            drawn = next(iter(given.get("shape", ())), None)
            shape = drawn or next((key for key in _DRAWINGS if key in given), "tank")
            what = f"{shape}, {given.get('density', '?')} kg/m³"
        else:
            what = str(given)
        return f"{what}, at {_row(self.position)} m, axis {_row(self.axis)}, modes={self.modes}"


_DRAWINGS = ("profile", "box", "points", "svg")


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass, centre of mass and inertia of a `Craft` at a fill.

    Attributes
    ----------
    mass : float
        Mass, kg.
    center_of_mass : ndarray, shape (3,)
        Centre of mass from the craft's origin O, body axes, m.
    inertia : ndarray, shape (3, 3)
        Inertia about the centre of mass, body axes, kg·m². Products of inertia are minus the
        integral of x y dm.

    Examples
    --------
    >>> import hubslosh
    >>> dry = hubslosh.Craft(mass=900, inertia=[400, 380, 300])
    >>> dry.mass_properties("50%").mass
    900.0
    """

    mass: float
    center_of_mass: Vector
    inertia: Vector

    def __str__(self) -> str:
        rows = "\n".join(f"  {_row(row, 7)}" for row in self.inertia)
        return (
            f"mass {self.mass:.7g} kg, centre of mass {_row(self.center_of_mass, 6)} m\n"
            f"inertia about it, kg·m²:\n{rows}"
        )


Liquid = Literal["effective", "rigid"]
"""Model of the liquid's inertia: "effective" as under a rigid lid without friction, or "rigid"."""


@dataclass(frozen=True, eq=False, repr=False)
class Craft:
    """A spacecraft with tanks; the fill of the tanks is an argument of its methods.

    Positions are given in body axes with the origin O. All arguments are checked at construction,
    except the drawings of the tanks, which are read when they are first needed. The slosh modes at
    a fill are computed only once.

    Parameters
    ----------
    mass : float
        Dry mass, kg.
    inertia : array_like, shape (3, 3) or (3,)
        Inertia of the dry craft about its centre of mass, body axes, kg·m²: a symmetric matrix,
        whose products of inertia are minus the integral of x y dm, or its diagonal.
    center_of_mass : sequence of float, shape (3,)
        Centre of mass of the dry craft from O, body axes, m.
    tanks : mapping of MountedTank
        Up to four tanks by name. Their order gives the numbers of the FMU's tanks.
    thrust : float or sequence of float, shape (3,)
        Force at O, body axes, N; a number is along z. For engines at other places see ``engines``.
    wheels : mapping of Wheel
        Reaction wheels by name. `loop` and `review` command their torques: ``command="wheels"``, or
        ``"z.torque"`` for one. Their momentum at the start acts in every method.
    gravity : float, optional
        Specific force along the tanks' axes, m/s², for frequencies and damping; by default
        thrust over mass at the fill.
    model : str or Path
        Name or file of the FMU, as for `simulate`.
    engines : mapping of Engine
        Engines by name. The engines that burn act in addition to ``thrust``; O of the FMU then lies
        on the line of action of the resultant force. If canted engines also cause a torque about
        this line, the FMU gets this torque, because no choice of O can remove it.
    appendages : mapping of Appendage
        Flexible appendages by name, with at most six modes in total. ``mass``, ``inertia`` and
        ``center_of_mass`` must include the undeformed appendages.
    spin : float or sequence of float, shape (3,), optional
        Angular velocity of a craft whose liquid rotates with it, body axes, rad/s; a number is
        about z. By default it follows from the ``spin`` of the tanks: set it once, here or there. A
        craft whose liquid is at rest while it begins to turn has ``init.omega`` among its
        parameters instead.

    Raises
    ------
    FmuError
        With everything that is wrong with the arguments.

    Examples
    --------
    >>> import hubslosh
    >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
    >>> craft = hubslosh.Craft(
    ...     mass=900, inertia=[400, 380, 300], thrust=50,
    ...     tanks={"main": hubslosh.MountedTank(sphere, (0, 0, 0.2))})
    >>> print(craft.mass_properties("60%"))
    mass 1062.458 kg, centre of mass (0, 0, 0.0733128) m
    inertia about it, kg·m²:
      (433.8291, 0, 0)
      (0, 413.8291, 0)
      (0, 0, 300)
    """

    mass: float
    inertia: ArrayLike
    center_of_mass: Sequence[float] = (0.0, 0.0, 0.0)
    tanks: Mapping[str, MountedTank] = field(default_factory=dict)
    thrust: float | Sequence[float] = 0.0
    wheels: Mapping[str, Wheel] = field(default_factory=dict)
    gravity: float | None = None
    model: str | Path = "Spacecraft"
    engines: Mapping[str, Engine] = field(default_factory=dict)
    appendages: Mapping[str, Appendage] = field(default_factory=dict)
    spin: float | Sequence[float] | None = None
    _known: dict[Any, Any] = field(default_factory=dict, init=False)
    _said: list[str] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        problems = not_positive("mass", self.mass, "kg")
        if self.gravity is not None:
            problems += not_positive("gravity", self.gravity, "m/s²")
        problems += not_vectors(self, 3, "center_of_mass")
        problems += wrong_wheels(self.wheels)
        wrong = wrong_parts("engine", self.engines, Engine)
        problems += wrong
        for check in (self._inertia, *([] if wrong else [self._force])):
            try:
                check()
            except FmuError as error:
                problems.append(str(error))
        if isinstance(self.tanks, Mapping) and len(self.tanks) > MOST_TANKS:
            problems.append(f"tanks has {len(self.tanks)} tanks (allowed: up to {MOST_TANKS})")
        problems += wrong_parts("tank", self.tanks, MountedTank, RESERVED)
        problems += self._wrong_appendages()
        if not problems:
            problems += self._wrong_spins()
        refuse(problems)

    @property
    def _omega(self) -> Vector:
        """Angular velocity of the craft with its liquid, body axes, rad/s."""
        if self.spin is not None:
            return _along_z(self.spin, "spin")
        turned = [of for of in self.tanks.values() if of.spin is not None]
        if not turned:
            return np.zeros(3)
        # a tank turned upside down spins the other way round
        axes = np.array([of.rotation[:, 2] for of in turned])
        axes *= np.where(axes @ axes[0] < 0, -1.0, 1.0)[:, None]
        found: Vector = np.linalg.lstsq(axes, [float(of.spin or 0) for of in turned])[0]
        return found

    def _spin_of(self, name: str) -> float:
        """Return the craft's angular rate about the axis of the tank ``name``, rad/s, at least 0.

        A rate below 1e-9 of the craft's angular rate is a rounding error and counts as 0.
        """
        omega = self._omega
        rate = abs(float(self.tanks[name].rotation[:, 2] @ omega))
        return rate if rate > 1e-9 * np.linalg.norm(omega) else 0.0

    def _wrong_spins(self) -> list[str]:
        try:
            rates = {name: self._spin_of(name) for name in self.tanks}
        except FmuError as error:
            return [str(error)]
        return [
            f"tank {name}: spin = {of.spin:g} rad/s, but the craft turns at {rates[name]:.6g} "
            "rad/s about this tank's axis, because of the spin of the craft or of other tanks: "
            "give the spin only once"
            for name, of in self.tanks.items()
            if of.spin is not None and abs(rates[name] - of.spin) > SAME_SPIN * of.spin
        ]

    def _wrong_appendages(self) -> list[str]:
        problems = wrong_parts("appendage", self.appendages, Appendage, RESERVED)
        if not isinstance(self.appendages, Mapping):
            return problems
        if isinstance(self.tanks, Mapping):
            problems += [
                f"{name} is a tank and an appendage: give them different names"
                for name in self.appendages
                if name in self.tanks
            ]
        every = [of for of in self.appendages.values() if isinstance(of, Appendage)]
        count = sum(of.count for of in every if not of.problems())
        if count > MOST_MODES:
            problems.append(
                f"appendages have {count} modes in all (allowed: up to {MOST_MODES}): keep the "
                "modes with the largest participation factors"
            )
        return problems

    @property
    def _names(self) -> Names:
        """Names of the tanks; and for each appendage mode of the FMU, the name of its appendage."""
        modes = [name for name, of in self.appendages.items() for _ in range(of.count)]
        return Names.collect(self.tanks, modes)

    def _inertia(self) -> Vector:
        J = array(self.inertia)
        J = np.diag(J) if J.shape == (3,) else J
        if J.shape != (3, 3) or not np.isfinite(J).all() or not (J == J.T).all():
            raise FmuError("inertia must be a symmetric matrix of 3 × 3, or its diagonal")
        moments = np.linalg.eigvalsh(J)
        if moments[0] <= 0 or moments[2] > (moments[0] + moments[1]) * (1 + 1e-9):
            raise FmuError(
                f"inertia has the principal moments {_row(moments)} kg·m², which no body has "
                "(allowed: above 0, each at most the sum of the others; products of inertia are "
                "minus the integral of x y dm)"
            )
        return J

    def _resultant(self) -> tuple[Vector, Vector, Vector]:
        """Return the resultant of thrust and engines: force (N), point (m) and torque (N·m).

        The point is on the line of action of the force. The torque is the part about this line,
        which no choice of the point can remove.
        """
        return resultant(_along_z(self.thrust, "thrust"), self.engines)

    def _force(self) -> Vector:
        return self._resultant()[0]

    def fills(self, fill: Fill) -> dict[str, Any]:
        """Return the fill of each tank by name.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            One fill for all tanks; or one for each, by name or in their order. A fill is a height
            (m), a share of the volume (``"60%"``), a mass (``(120, "kg")``), or 0.

        Returns
        -------
        dict
            Fills by the tanks' names.

        Raises
        ------
        FmuError
            If a tank is missing or unknown.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {name: hubslosh.MountedTank(sphere, (0, 0, 0)) for name in ("fuel", "oxidiser")}
        >>> hubslosh.Craft(900, [400, 380, 300], tanks=tanks).fills(["60%", (100, "kg")])
        {'fuel': '60%', 'oxidiser': (100, 'kg')}
        """
        return self._by_tank(fill, "fill")

    def _by_tank(self, given: Any, what: str) -> dict[str, Any]:
        names = list(self.tanks)
        if isinstance(given, Mapping):
            if set(given) != set(names):
                raise FmuError(f"{what} must have {', '.join(names)}, not {', '.join(given)}")
            return {name: given[name] for name in names}
        single = isinstance(given, str | int | float | np.number) or is_mass(given)
        if single:
            return dict.fromkeys(names, given)
        try:
            values = list(given)
        except TypeError:
            values = []
        if len(values) != len(names):
            raise FmuError(
                f"{what} must be a value, or one for each of {', '.join(names)}, not {given!r}"
            )
        return dict(zip(names, values, strict=True))

    def _drawing(self, name: str) -> Any:
        """Return the shape of the tank ``name`` from its file, which is read only once."""
        key = ("drawing", name)
        if key not in self._known:
            try:
                self._known[key] = read_drawing(_tank_source(self.tanks[name].source))
            except FmuError as error:
                raise FmuError(f"tank {name}: {error}") from None
        return self._known[key]

    def _case(self, name: str, fill: Any, gravity: float) -> TankCase:
        of = self.tanks[name]
        spin = None if fill == "100%" else self._spin_of(name) or None  # a full tank has no surface
        return TankCase(_tank_source(of.source), fill, of.modes, gravity, of.nu, of.sigma,
                        of.contact_angle, spin)  # fmt: skip

    def _solve(self, asked: Sequence[tuple[str, Any, float]]) -> list[Tank | None]:
        """Return a solved tank for each item of ``asked``, or None if the tank is empty.

        An item has the tank's name, its fill, and the specific force along its axis, m/s². Each
        combination is computed only once for this craft. All new combinations are computed in one
        call, on all cores.
        """
        wanted = [key for key in dict.fromkeys(asked) if not _is_empty(key[1])]
        new = [key for key in wanted if key not in self._known]
        problems = []
        cases = [self._case(*key) for key in new]
        found = solve(cases, [self._drawing(key[0]) for key in new]) if new else []
        for key, one in zip(new, found, strict=True):
            try:
                if isinstance(one, FmuError):
                    raise one
                said = one._prepare()
            except FmuError as error:
                problems.append(f"tank {key[0]}: {error}")
                continue
            self._known[key] = one
            self._said.extend(f"tank {key[0]}: {text}" for text in said)
        if problems:
            raise FmuError(problems[0])
        return [None if _is_empty(key[1]) else self._known[key] for key in asked]

    def _capacity(self, name: str) -> Tank:
        """Return the full tank ``name``, whose liquid has the largest possible mass."""
        (full,) = self._solve([(name, "100%", 1.0)])
        assert full is not None
        return full

    def _mass_of(self, name: str, fill: Any) -> float:
        """Return the mass of liquid in the tank ``name`` at ``fill``, kg."""
        if _is_empty(fill):
            return 0.0
        if is_mass(fill):
            return float(fill[0])
        if (percent := percent_of(fill)) is not None:
            return percent / 100 * self._capacity(name).mass
        try:
            return float(self._drawing(name).mass(check_fill(fill)))
        except FmuError as error:
            raise FmuError(f"tank {name}: {error}") from None

    def tank_at(self, fill: Fill) -> dict[str, Tank]:
        """Return the solved tanks at a fill, without empty tanks.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.

        Returns
        -------
        dict of Tank
            Tanks by name, as `tank` returns them.

        Raises
        ------
        FmuError
            If a drawing or a fill is wrong, or the thrust does not hold the liquid at the bottom.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2))}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> round(craft.tank_at("60%")["main"].mass, 2)
        162.46
        """
        return self._at([fill])[0]

    def solve(self, fills: Sequence[Fill]) -> None:
        """Solve the tanks at several fills at once, on all cores.

        Later calls at these fills reuse the slosh modes and return at once.

        Parameters
        ----------
        fills : sequence of fills
            Fills of the craft, each as for `fills`.

        Raises
        ------
        FmuError
            If a drawing or a fill is wrong, or the thrust does not hold the liquid at the bottom.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2))}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> craft.solve(["60%", "70%"])
        """
        self._at(fills)

    def _at(self, fills: Sequence[Fill]) -> list[dict[str, Tank]]:
        every = [self.fills(fill) for fill in fills]
        asked = []
        for of in every:
            for fill in of.values():
                check_fill(fill)
            if self.gravity is None:
                masses = (self._mass_of(name, fill) for name, fill in of.items())
                acceleration = self._force() / (self.mass + sum(masses))
            for name, fill in of.items():
                along = self.gravity or 1.0
                if self.gravity is None and not _is_empty(fill):
                    along = float(self.tanks[name].rotation[:, 2] @ acceleration)
                    if not along > 0:
                        raise FmuError(
                            f"tank {name}: the thrust gives {along:.3g} m/s² along its axis, which "
                            "does not hold liquid at its bottom; give gravity=, m/s²"
                        )
                asked.append((name, fill, along))
        try:
            found = iter(self._solve(asked))
        finally:
            self._warn()
        tanks = [{name: next(found) for name in of} for of in every]
        return [{name: tank for name, tank in of.items() if tank is not None} for of in tanks]

    def _warn(self) -> None:
        """Issue, once, the warnings that arose when slosh modes of tanks were computed."""
        said, self._said[:] = self._said[:], []
        for text in dict.fromkeys(said):
            warnings.warn(text, FmuWarning, stacklevel=caller())

    def mass_properties(self, fill: Fill, liquid: Liquid = "effective") -> MassProperties:
        """Return mass, centre of mass and inertia at a fill, with every surface at rest.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.
        liquid : {"effective", "rigid"}
            "effective": the liquid has the inertia of liquid under a rigid lid without friction, as
            in the FMU; about the axis of a body of revolution this inertia is 0. "rigid": the
            liquid has the inertia of a solid.

        Returns
        -------
        MassProperties
            Mass properties of dry craft and liquid together, body axes; ``print`` shows them.

        Raises
        ------
        FmuError
            If a drawing, a fill or ``liquid`` is wrong.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2))}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> craft.mass_properties("60%").center_of_mass.round(4)
        array([0.    , 0.    , 0.0733])
        """
        if liquid not in ("effective", "rigid"):
            raise FmuError(f'liquid must be "effective" or "rigid", not {liquid!r}')
        parts = [(float(self.mass), vector(self.center_of_mass, 3, ""), self._inertia())]
        for name, found in self.tank_at(fill).items():
            of = self.tanks[name]
            R = of.rotation
            center = vector(of.position, 3, "") + R[:, 2] * float(found.all["z_cg"])
            parts.append((found.mass, center, R @ np.diag(_own_inertia(found, liquid)) @ R.T))
        mass = sum(m for m, _, _ in parts)
        center = sum((m * r for m, r, _ in parts), np.zeros(3)) / mass
        inertia = np.zeros((3, 3))
        for m, r, J in parts:
            d = r - center
            inertia += J + m * ((d @ d) * np.eye(3) - np.outer(d, d))
        return MassProperties(mass, center, (inertia + inertia.T) / 2)

    def parameters(
        self,
        fill: Fill,
        *,
        parameters: Parameters | None = None,
        trimmed: bool = True,
        rigid: bool = False,
        detach: bool = False,
        mass_flow: Any = None,
        between: Sequence[float | str] = ("2%", "98%"),
    ) -> dict[str, Quantity]:
        """Return the parameters of Spacecraft at a fill, with thrust through the centre of mass.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.
        parameters : mapping, optional
            Further parameters, which override those of the craft, with the same names in every
            method. A tank has its name or number: ``NTO.frequency[1]`` or ``tank[1].frequency[1]``
            (Hz, under the present thrust; the height of the slosh mass is kept), ``zeta[1]``,
            ``mass[1]`` (kg) and ``bob[1]`` (height of the slosh mass, m; mass, centre and inertia
            of the whole liquid do not change). ``craft.Jxx``, … and every other parameter of
            the FMU are allowed, too. A mode of an appendage has the appendage's name:
            ``array.frequency[1]`` and ``array.zeta[1]``.
        trimmed : bool
            Trim the craft, see `trim`. False leaves the thrust at O, and warns if this thrust turns
            the craft.
        rigid : bool
            Replace the slosh modes by liquid that does not slosh, with its effective inertia.
        detach : bool
            The liquid can leave the tank's bottom, see `travel`. It then sloshes as a pendulum
            without the coefficients of finite amplitude.
        mass_flow : float, mapping or sequence of float, optional
            Outflow of the tanks, kg/s, see `drain`.
        between : sequence of two fills
            Ends of the fill table of a tank that drains, see `drain`.

        Returns
        -------
        dict
            Values by the FMU's names, for `simulate`, `linearize` and `Loop`.

        Raises
        ------
        FmuError
            If a fill or a parameter is wrong, or options exclude each other.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2))}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> round(craft.parameters("60%")["tank[1].mass[1]"], 2)
        82.38
        """
        point, late = self._point(
            fill, parameters, trimmed=trimmed, rigid=rigid, detach=detach, mass_flow=mass_flow,
            between=between,
        )  # fmt: skip
        if late is not None:
            raise FmuError(f"{DELAY} belongs to a loop, not to the craft: give it to Craft.loop")
        if not trimmed and (text := rotation(f"{self!r}, untrimmed,", point.angular_acceleration)):
            warnings.warn(text, FmuWarning, stacklevel=2)
        return point.parameters

    def trim(self, fill: Fill, parameters: Parameters | None = None) -> OperatingPoint:
        """Return the trimmed operating point; ``print`` shows the remaining accelerations.

        Trimming moves the origin O, where the thrust acts, at right angles to the thrust until the
        thrust acts through the centre of mass; the direction of the thrust does not change. Every
        method of a craft uses this point. Accelerations can remain, for example if further
        parameters contain a constant torque, or if the axis of a tank is not parallel to the
        thrust.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.
        parameters : mapping, optional
            Further parameters, see `parameters`.

        Returns
        -------
        OperatingPoint
            Parameters of the trimmed craft, the displacement of O, and the remaining accelerations.

        Raises
        ------
        FmuError
            If a fill or a parameter is wrong.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0.1, 0, 0.2))}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> craft.trim("60%").shift.round(4) + 0.0
        array([0.0153, 0.    , 0.    ])
        """
        return self._point(fill, parameters)[0]

    def _point(
        self,
        fill: Fill,
        parameters: Parameters | None,
        *,
        trimmed: bool = True,
        **options: Any,
    ) -> tuple[OperatingPoint, float | None]:
        """Return the operating point at ``fill``, and the delay (s) in ``parameters`` or None.

        The point is trimmed if ``trimmed``, so that the thrust acts through the centre of mass. The
        delay is returned separately, because it belongs to the control loop and not to the FMU.
        ``options`` are passed to `_untrimmed`.
        """
        every, modes, late = self._resolve(fill, parameters, **options)
        return self._realised(every, modes, trimmed=trimmed), late

    def _resolve(
        self, fill: Fill, parameters: Parameters | None, **options: Any
    ) -> tuple[dict[str, Quantity], dict[str, Quantity], Any]:
        """Return what ``fill`` and ``parameters`` define, as three parts.

        The parts are: the FMU's parameters without trimming; new values of slosh modes by name,
        such as tank[1].frequency[1], which are no parameters of the FMU; and the loop's delay (s),
        or None if ``parameters`` has no delay. ``options`` are passed to `_untrimmed`.
        """
        every = self._untrimmed(fill, **options)
        given = full_names(parameters_of(parameters), Fmu.open(self.model), self._names)
        late = given.pop(DELAY, None)
        self._check_rates(given)
        modes = {name: given.pop(name) for name in list(given) if mode_quantity(name)}
        return every | given, modes, late

    def _check_rates(self, given: Parameters) -> None:
        """Raise FmuError if ``init.omega`` in ``given`` contradicts the spin of the craft."""
        omega, fmu = self._omega, Fmu.open(self.model)
        spin = float(np.linalg.norm(omega))
        w = [float(fmu.convert(name, given.get(name, omega[i]))) for i, name in enumerate(OMEGA)]
        along = float(omega @ w) / spin if spin else 0.0
        if abs(along - spin) > SAME_SPIN * spin:
            raise FmuError(
                f"init.omega is {along:.6g} rad/s about the axis about which craft and liquid spin "
                f"at {spin:.6g} rad/s: leave out init.omega, or the spin of the craft and its tanks"
            )

    def _realised(
        self,
        every: Parameters,
        modes: Parameters,
        factors: Mapping[str, float] | None = None,
        *,
        trimmed: bool = True,
    ) -> OperatingPoint:
        """Return the operating point of the FMU's parameters ``every``, trimmed if ``trimmed``.

        ``modes`` has new values of slosh modes, for example of tank[1].frequency[1]. ``factors``
        has factors by which the frequencies of slosh modes are multiplied, by the same names.
        """
        model = self.model
        if trimmed:
            point = trim(model, every, list(self.tanks))
        else:
            point = OperatingPoint(model, dict(every), np.zeros(3), None, tuple(self.tanks))
        # quantities of slosh modes do not move the centre of mass, so trimming comes before them
        if modes or factors:
            every = apply_changes(model, point.parameters, modes, factors, self._names)
            point = replace(point, parameters=every)
        return point

    def _untrimmed(
        self,
        fill: Fill,
        *,
        rigid: bool = False,
        detach: bool = False,
        mass_flow: Any = None,
        between: Sequence[float | str] = ("2%", "98%"),
    ) -> dict[str, Quantity]:
        """Return Spacecraft's parameters at ``fill``, with O where the user put it.

        Trimming would move the reference point O. If ``rigid``, tanks have no slosh modes; if
        ``detach``, their liquid can leave the bottom. ``mass_flow`` (kg/s) and ``between`` (two
        fills) make the tanks drain, see `_draining`.
        """
        if detach and (rigid or mass_flow is not None):
            raise FmuError(
                "detach=True cannot be combined with rigid=True or mass_flow=: only sloshing "
                "liquid in a tank that does not drain can leave the bottom"
            )
        if rigid and mass_flow is not None:
            raise FmuError("rigid=True cannot be combined with mass_flow=: draining liquid sloshes")
        F, action, torque = self._resultant()
        r, J = vector(self.center_of_mass, 3, "") - action, self._inertia()
        found: dict[str, Quantity] = {"craft.mass": float(self.mass), "tanks": len(self.tanks)}
        found |= {f"craft.r[{i + 1}]": float(x) for i, x in enumerate(r)}
        pairs = [(i, j) for i in range(3) for j in range(i, 3)]
        found |= {f"craft.J{'xyz'[i]}{'xyz'[j]}": float(J[i, j]) for i, j in pairs}
        found |= {f"force[{i + 1}]": float(x) for i, x in enumerate(F)}
        found |= {f"torque[{i + 1}]": float(x) for i, x in enumerate(torque) if torque.any()}
        omega = self._omega
        found |= {name: float(x) for name, x in zip(OMEGA, omega, strict=True) if omega.any()}
        found |= dict(zip(MOMENTUM, momentum(self.wheels).tolist(), strict=True))
        j = 0
        for appendage in self.appendages.values():
            place = vector(appendage.position, 3, "") - action
            for mode in appendage.modes():
                j += 1
                mode |= {f"position[{i + 1}]": float(x) for i, x in enumerate(place)}
                found |= {f"appendage[{j}].{key}": value for key, value in mode.items()}
        found |= {"appendages": j} if j else {}
        tanks = self.tank_at(fill)
        for number, (name, of) in enumerate(self.tanks.items(), 1):
            prefix, place = f"tank[{number}]", vector(of.position, 3, "") - action
            if name in tanks:
                whole = rigid or not tanks[name].all["modes"]  # a full tank has no surface
                found |= tanks[name].parameters(
                    "Spacecraft", number, position=place.tolist(), rigid=whole
                )
            else:
                empty = dict.fromkeys((f"{prefix}.{key}" for key in ("m_0", "H_0", "I_0")), 0.0)
                found |= empty | {f"{prefix}.modes": 0}
            found |= {f"{prefix}.q[{i + 1}]": float(x) for i, x in enumerate(of.q)}
        if detach:
            numbers = {name: number for number, name in enumerate(self.tanks, 1)}
            for name, travel in self.travel(fill).items():
                if tanks[name].all["modes"]:
                    prefix = f"tank[{numbers[name]}]"
                    found[f"{prefix}.ball.travel"] = travel
                    # the FMU has these coefficients only for liquid that cannot detach
                    third = re.compile(rf"{re.escape(prefix)}\.nonlinear_(inertia|stiffness)\[")
                    found |= {key: 1.0 for key in found if third.match(key)}
                    found = {n: x for n, x in found.items() if not BEYOND_THIRD_ORDER.search(n)}
        if mass_flow is not None:
            tables = self._draining(mass_flow, tanks, between)
            # leave out parameters that the fill table replaces, because the FMU would warn of them
            replaced = {_without_point(name) for name in tables if ".fill." in name}
            draining = {name.partition(".")[0] for name in tables if ".fill." in name}

            def is_replaced(name: str) -> bool:
                own = name.partition(".")[0] in draining
                return name in replaced or (own and bool(BEYOND_THIRD_ORDER.search(name)))

            found = {n: value for n, value in found.items() if not is_replaced(n)} | tables
        return found

    def _draining(
        self, mass_flow: Any, tanks: dict[str, Tank], between: Sequence[float | str]
    ) -> dict[str, Quantity]:
        """Return the parameters with which ``tanks`` drain: fill tables, masses and mass flows.

        ``mass_flow`` is the mass flow out of each tank, kg/s, or one for all. The fill tables hold
        the slosh modes at fills within ``between``, from the lower to the upper fill.
        """
        found: dict[str, Quantity] = {}
        flows = self._by_tank(mass_flow, "mass_flow")
        for number, (name, flow) in enumerate(flows.items(), 1):
            if flow == 0:
                continue
            if name not in tanks:
                raise FmuError(f"tank {name} is empty: it cannot drain")
            tank = tanks[name]
            key = (name, "table", tuple(between), tank.gravity)
            if key not in self._known:
                try:
                    asked = self._case(name, None, tank.gravity)
                    self._known[key], said = fill_table(asked, between)
                except FmuError as error:
                    raise FmuError(f"tank {name}: {error}") from None
                self._said.extend(f"tank {name}: {text}" for text in said)
                self._warn()
            table: dict[str, Quantity] = {
                f"tank[{number}]{key.removeprefix('tank[1]')}": value
                for key, value in self._known[key].items()
            }
            found |= table | {f"tank[{number}].liquid_0": tank.mass}
            found[f"mass_flow[{number}]"] = float(flow)
        return found

    def drain(
        self, mass_flow: Any, fill: Fill, between: Sequence[float | str] = ("2%", "98%")
    ) -> dict[str, Quantity]:
        """Return the parameters of Spacecraft with tanks that drain, starting at a fill.

        The FMU stops with an error when the liquid of a tank falls below the lowest fill of the
        fill table, or rises above the highest. The table has damping ratios and third-order
        coefficients at every fill. At some fills no formula gives the third-order coefficients;
        there the table has values interpolated between fills with known coefficients, or the
        nearest known values, and a warning names these fills.

        Parameters
        ----------
        mass_flow : float, mapping or sequence of float
            Outflow of the tanks, kg/s: one value for all, or one for each, as in `fills`.
        fill : fill, mapping, or sequence of fills
            Fill at the start, as for `fills`.
        between : sequence of two fills
            Ends of the fill table of each tank with outflow. The computation takes some 5 s of CPU
            time, once.

        Returns
        -------
        dict
            Values by the FMU's names.

        Raises
        ------
        FmuError
            If a tank with outflow is empty, or a fill is wrong.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2))}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> craft.drain(0.0, "60%") == craft.parameters("60%")
        True
        """
        return self.parameters(fill, mass_flow=mass_flow, between=between)

    def travel(self, fill: Fill) -> dict[str, float]:
        """Return how far detached liquid can move in each tank that is not empty.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.

        Returns
        -------
        dict of float
            Distance between the liquid's centres of mass at the bottom and at the top of the closed
            tank, m, by name: ``ball.travel`` of the FMU.

        Raises
        ------
        FmuError
            If a drawing or a fill is wrong.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2))}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> round(craft.travel("60%")["main"], 4)
        0.2411
        """
        ways = {}
        for name, tank in self.tank_at(fill).items():
            full = self._capacity(name)
            gas, center = full.mass - tank.mass, float(full.all["z_cg"])
            if gas > 1e-6 * full.mass:
                (below,) = self._solve([(name, (gas, "kg"), tank.gravity)])
                assert below is not None
                center = (full.mass * center - gas * float(below.all["z_cg"])) / tank.mass
            ways[name] = center - float(tank.all["z_cg"])
        return ways

    def linearize(
        self,
        fill: Fill,
        inputs: Sequence[str] | str = "torque",
        outputs: Sequence[str] | str = ("q", "omega"),
        *,
        parameters: Parameters | None = None,
        rigid: bool = False,
    ) -> LinearModel:
        """Return the linear model at a fill, at rest under thrust and trimmed, see `trim`.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.
        inputs : str or sequence of str
            Inputs of the FMU, as for `hubslosh.linearize`.
        outputs : str or sequence of str
            Outputs of the FMU, as for `hubslosh.linearize`.
        parameters : mapping, optional
            Further parameters, see `parameters`.
        rigid : bool
            Replace the slosh modes by liquid that does not slosh.

        Returns
        -------
        LinearModel
            The model in continuous time, SI units.

        Raises
        ------
        FmuError
            If a fill, a name or a parameter is wrong.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2))}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> craft.linearize("60%").modes()["frequency"].round(4).tolist()
        [0.0753, 0.0754, 0.1271, 0.1271]
        """
        point, late = self._point(fill, parameters, rigid=rigid)
        if late is not None:
            raise FmuError(f"{DELAY} belongs to a loop, not to the craft: give it to Craft.loop")
        return linearize(point.model, point.parameters, inputs, outputs)

    def loop(
        self,
        controller: Any,
        period: float,
        fill: Fill,
        *,
        measured: Sequence[str] | str = ("q[2]", "q[3]", "q[4]", "omega"),
        command: Sequence[str] | str = "torque",
        latency: int = 0,
        delay: float = 0.0,
        parameters: Parameters | None = None,
        rigid: bool = False,
        mass_flow: Any = None,
        between: Sequence[float | str] = ("2%", "98%"),
    ) -> Loop:
        """Return the loop of a sampled controller around the trimmed craft at a fill.

        The default measurements ``q[2]``, ``q[3]`` and ``q[4]`` are half the small angles about the
        body axes.

        Parameters
        ----------
        controller : callable, array_like, LinearModel or system of python-control
            Controller, as for `Loop`.
        period : float
            Period of the controller's cycle, s.
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.
        measured : str or sequence of str
            Measured variables, as for `Loop`.
        command : str or sequence of str
            Commanded inputs, as for `Loop`; ``"wheels"`` is the torque of each wheel in order.
        latency : int
            Delay from measurement to command, whole cycles.
        delay : float
            Delay in addition to ``latency``, s.
        parameters : mapping, optional
            Further parameters, see `parameters`; the parameter ``"delay"`` replaces the argument
            ``delay``.
        rigid : bool
            Replace the slosh modes by liquid that does not slosh.
        mass_flow : float, mapping or sequence of float, optional
            Outflow of the tanks during a simulation, kg/s, see `drain`.
        between : sequence of two fills
            Ends of the fill table of a tank that drains.

        Returns
        -------
        Loop
            The loop, for `margins` and `Loop.simulate`.

        Raises
        ------
        FmuError
            If a fill or a parameter is wrong.

        Examples
        --------
        >>> import numpy as np
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2), nu=0.9e-6)}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> gains = np.hstack([2 * 10 * np.eye(3), 80 * np.eye(3)])
        >>> hubslosh.margins(craft.loop(gains, 0.1, "60%")).stable
        True

        An engine whose thrust misses the centre of mass turns the craft. Margins do not depend on
        this torque, because the loop is linearised at the equilibrium, in which the controller
        balances the torque. In a simulation from rest the torque acts as a constant disturbance, so
        that the attitude error approaches torque divided by gain:

        >>> engine = hubslosh.Engine((0.01, 0, 0), (0, 0, 1), 50)
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, engines={"main": engine})
        >>> loop = craft.loop(gains, 0.1, "60%")
        >>> torque = np.cross(-craft.trim("60%").shift, [0, 0, 50])
        >>> torque.round(3)
        array([ 0. , -0.5,  0. ])
        >>> run = loop.simulate(300, {f"torque[{i}]": torque[i - 1] for i in (1, 2, 3)})
        >>> bool(abs(run["q[3]"].iloc[-1] - torque[1] / 20) < 1e-3)
        True
        """
        point, late = self._point(
            fill, parameters, rigid=rigid, mass_flow=mass_flow, between=between
        )
        delay = delay if late is None else late
        return Loop(
            controller, period, point.model, point.parameters, measured, command, latency, delay,
            self.wheels, self._names,
        )  # fmt: skip

    def review(
        self,
        controller: Any,
        period: float,
        fills: Sequence[Fill] = tuple(f"{fill}%" for fill in range(5, 100, 10)),
        *,
        damping: Literal["interval", "nominal"] = "interval",
        frequency: str = "10%",
        inertia: str = "5%",
        uncertain: Mapping[str, Any] | None = None,
        requirements: Mapping[str, Any] | None = None,
        draws: int = 200,
        seed: int = 1,
        measured: Sequence[str] | str = ("q[2]", "q[3]", "q[4]", "omega"),
        command: Sequence[str] | str = "torque",
        latency: int = 0,
        delay: float = 0.0,
        parameters: Parameters | None = None,
    ) -> "Review":
        """Return the design review of a linear sampled controller over fills.

        Each operating point is trimmed, so that it is a steady state. A search finds the worst
        case. To confirm the worst case, the nonlinear FMU is simulated with the gain at the limit
        of stability or, if the worst case is unstable, with the given gain.

        Parameters
        ----------
        controller : array_like, LinearModel or system of python-control
            Linear controller, as for `Loop`.
        period : float
            Period of the controller's cycle, s.
        fills : sequence of fills
            Fills to review, each as for `fills`.
        damping : {"interval", "nominal"}
            "interval" varies the damping of each tank over the confidence interval of the empirical
            formula that computes the damping, and the damping ratios of each appendage by half of
            their values; "nominal" does not vary the damping.
        frequency : str
            Range of the slosh frequencies, and of the frequencies of appendages, as a share of
            their nominal values, such as "10%"; "nominal" does not vary them. All modes of a tank
            or an appendage vary together, and the heights of the slosh masses do not change.
        inertia : str
            Range of the dry craft's inertia as a share, such as "5%", where one factor multiplies
            all components; "nominal" does not vary the inertia. If ``uncertain`` names a component,
            such as ``craft.Jxx``, this argument is ignored.
        uncertain : mapping, optional
            Ranges by name: (low, high) in SI units, or a share of the nominal value such as "5%".
            Names are as for `parameters`, and "delay". The arguments ``frequency`` and ``damping``
            do not vary a frequency or a damping ratio that is named here, or a damping ratio that
            ``parameters`` sets. ``craft.mass`` changes the acceleration.
        requirements : mapping, optional
            Required minimum of each margin: "modulus_margin", "phase_margin" (deg), "gain_margin"
            (dB, for an increase and for a decrease of the gain) and "delay_margin" (s). A number
            applies to all operating points; a mapping can have one number for "nominal", the points
            without deviations, and one for "all" points. An unstable point fails; see
            `Review.requirements`.
        draws : int
            Number of random points over all fills, uniform within the ranges.
        seed : int
            Seed of the draws.
        measured : str or sequence of str
            Measured variables, as for `Loop`.
        command : str or sequence of str
            Commanded inputs, as for `Loop`; ``"wheels"`` is the torque of each wheel in order.
        latency : int
            Delay from measurement to command, whole cycles.
        delay : float
            Delay in addition to ``latency``, s.
        parameters : mapping, optional
            Further parameters, see `parameters`.

        Returns
        -------
        Review
            Margins at every point, the worst case and a suggestion; ``print`` shows a summary.

        Raises
        ------
        FmuError
            If the controller is not linear, or a fill, a range or a parameter is wrong.

        Examples
        --------
        >>> import numpy as np
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2), modes=1, nu=0.9e-6)}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
        >>> gains = np.hstack([2 * 10 * np.eye(3), 80 * np.eye(3)])
        >>> review = craft.review(gains, 0.1, ["50%"], draws=5)
        >>> bool(review.points["stable"].all())
        True
        """
        from .review import review

        return review(
            self, controller, period, fills, damping=damping, frequency=frequency,
            inertia=inertia, uncertain=uncertain, requirements=requirements, draws=draws, seed=seed,
            measured=measured, command=command, latency=latency, delay=delay,
            parameters=parameters,
        )  # fmt: skip

    def uncertain(
        self,
        fill: Fill,
        ranges: Mapping[str, Any],
        *,
        outputs: Sequence[str] | str = ("q[2]", "q[3]", "q[4]", "omega"),
        parameters: Parameters | None = None,
        **options: Any,
    ) -> "UncertainModel":
        """Return the trimmed craft at a fill with uncertain parameters; see `hubslosh.uncertain`.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.
        ranges : mapping
            Ranges by name: (low, high) in SI units, or a share such as "5%" on both sides. Names
            are as for `parameters`. The range of a damping ratio may be "interval", the interval of
            its correlation, if the tank has ``nu``.
        outputs : str or sequence of str
            Components of q and omega.
        parameters : mapping, optional
            Further parameters, see `parameters`.
        **options
            ``inputs``, ``covariance`` and ``sigmas``, as for `hubslosh.uncertain`.

        Returns
        -------
        UncertainModel
            The linear fractional transformation (M, Δ).

        Raises
        ------
        FmuError
            If a fill, a range or a parameter is wrong.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2), modes=1)}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
        >>> craft.uncertain("50%", {"main.frequency[1]": "10%"}).deltas
        ('tank[1].frequency[1]',)
        """
        from .uncertainty import FACTOR, uncertain

        order = self._names
        named: dict[str, Any] = full_names(
            ranges, Fmu.open(self.model), order, [FACTOR]  # type: ignore[arg-type]
        )  # fmt: skip
        if DELAY in named:
            raise FmuError(
                "delay belongs to a loop, not to the craft: give it to Craft.loop, or vary it by "
                "Craft.review"
            )
        named = self._with_intervals(fill, named)
        point, late = self._point(fill, parameters)
        if late is not None:
            raise FmuError(
                "delay belongs to a loop, not to an uncertain model: give it to Craft.loop"
            )
        known = Modes(point.model, point.parameters)
        problems = [
            f"{short_name(name, order)} {problem}" for name in named
            if (mode := mode_quantity(name)) and (problem := known.problem(mode))
        ]  # fmt: skip
        refuse(problems)
        model = uncertain(point.parameters, named, outputs=outputs, model=point.model, **options)
        return replace(model, tanks=order)

    def _with_intervals(self, fill: Fill, ranges: Mapping[str, Any]) -> dict[str, Any]:
        """Return ``ranges``, by full names, with a pair (low, high) in place of "interval".

        "interval" stands for the interval of a damping ratio that the tank solver gives at
        ``fill``.
        """
        tanks, order, found = self.tank_at(fill), self._names, dict(ranges)
        for name, of in ranges.items():
            if isinstance(of, str) and of == "interval":
                mode = mode_quantity(name)
                tank = tanks.get(order[mode.tank - 1]) if mode and mode.tank <= len(order) else None
                table = None if tank is None or mode is None else tank.modes
                if table is None or mode is None or mode.kind != "zeta" or "zeta_low" not in table:
                    raise FmuError(f'{name}: "interval" is for zeta[n] of a tank with nu=')
                row = table.iloc[mode.number - 1]
                found[name] = (float(row["zeta_low"]), float(row["zeta_high"]))
        return found

    def monte_carlo(
        self,
        fill: Fill,
        ranges: Mapping[str, Any],
        runs: int,
        seed: int = 1,
        outcome: "Outcome | None" = None,
        *,
        parameters: Parameters | None = None,
        **options: Any,
    ) -> "pd.DataFrame":
        """Run a Monte Carlo study of the craft at a fill; see `hubslosh.monte_carlo`.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.
        ranges : mapping
            Ranges by name, as for `uncertain`: (low, high), a share such as "10%" of the value at
            the fill, or "interval" for a damping ratio; also a list of values or a distribution of
            ``scipy.stats``. Names are as for `parameters`; other names, such as one for the bias of
            a sensor, can have ranges that are neither shares nor "interval".
        runs : int
            Number of runs.
        seed : int
            Seed of the draws.
        outcome : callable, optional
            Function of the drawn values, a dict by the names in ``ranges``, that returns numbers by
            name. ``craft.loop(law, period, fill, parameters=values)`` takes the values.
        parameters : mapping, optional
            Further parameters, see `parameters`; ``"delay"`` among them is the nominal delay.
        **options
            ``folder``, ``client``, ``workers`` and ``progress``, as for `hubslosh.monte_carlo`.

        Returns
        -------
        DataFrame
            A row for each run, as `hubslosh.monte_carlo` returns it.

        Raises
        ------
        FmuError
            If a fill, a range or a parameter is wrong, or the study fails.

        Examples
        --------
        >>> import numpy as np
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2), modes=1, nu=0.9e-6)}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
        >>> gains = np.hstack([20 * np.eye(3), 80 * np.eye(3)])
        >>> def phase(values):
        ...     loop = craft.loop(gains, 0.1, "50%", parameters=values)
        ...     return {"phase (deg)": hubslosh.margins(loop).phase_margin}
        >>> ranges = {"main.frequency[1]": "10%", "main.zeta[1]": "interval", "craft.Jxx": "5%"}
        >>> table = craft.monte_carlo("50%", ranges, 4, outcome=phase)
        >>> bool((table["phase (deg)"] > 50).all())
        True
        """
        from .sampling import monte_carlo

        every, modes, late = self._resolve(fill, parameters)
        nominal: dict[str, float] = {}
        items = ranges.items() if isinstance(ranges, Mapping) else ()
        texts = [name for name, of in items if isinstance(of, str)]
        if texts:
            given = dict(ranges)
            full = full_names({n: given[n] for n in texts}, Fmu.open(self.model), self._names)
            known = dict(zip(full, texts, strict=True))
            full = self._with_intervals(fill, full)
            given |= {known[name]: of for name, of in full.items()}
            point = Modes(self.model, self._realised(every, modes).parameters)
            for name, of in full.items():
                if isinstance(of, str):
                    value = late if name == DELAY else nominal_value(point, every, name)
                    if value is None:
                        why = (
                            'has no nominal value: give parameters={"delay": …}, s'
                            if name == DELAY
                            else NO_MODE
                        )
                        raise FmuError(f"{known[name]} {why}")
                    nominal[known[name]] = float(value)
            ranges = given
        return monte_carlo(ranges, runs, seed, outcome, nominal=nominal, **options)

    def simulate(
        self,
        fill: Fill,
        inputs: "pd.DataFrame | None" = None,
        stop: float | None = None,
        step: float | None = None,
        outputs: Sequence[str] | str | None = None,
        *,
        parameters: Parameters | None = None,
        **options: Any,
    ) -> "Run":
        """Simulate the trimmed craft, starting at a fill; see `hubslosh.simulate`.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.
        inputs : DataFrame, optional
            Histories of inputs with the column ``time``, as for `hubslosh.simulate`; these columns
            replace thrust and torque of the craft. A column such as ``z.torque`` commands the
            torque of wheel z on the craft, N·m. Each value is held until the next row and is
            limited by the torque and the speed of the wheel; the result then contains the torque
            that acts and the speed of the wheel, such as ``z.torque`` and ``z.speed`` (rad/s).
        stop : float, optional
            End of the simulation, s.
        step : float, optional
            Time between rows, s.
        outputs : str or sequence of str, optional
            Outputs to record.
        parameters : mapping, optional
            Further parameters, see `parameters`.
        **options
            ``start``, ``tolerance`` and ``hold``, as for `hubslosh.simulate`.

        Returns
        -------
        Run
            Time histories of the outputs, SI units.

        Raises
        ------
        FmuError
            If an argument is wrong, or the FMU stops with an error.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2))}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> run = craft.simulate("60%", stop=1, parameters={"init.omega[1]": 0.01})
        >>> float(run["q[1]"].iloc[-1].round(6))
        0.999988
        """
        from .simulation import run_of, without_replaced

        mine = self.parameters(fill, parameters=parameters)
        momentum = tuple(float(mine[name]) for name in MOMENTUM)  # type: ignore[arg-type]
        given = without_replaced(mine, inputs, parameters_of(parameters))
        times, hold = (options.pop("start", None), stop, step), options.pop("hold", False)
        return run_of(
            self.model, given, inputs, times, outputs, options.pop("tolerance", None), hold,
            self.wheels, momentum, **options,
        )  # fmt: skip

    def pulses(self, fill: Fill, firing: Mapping[str, Any], stop: float) -> "pd.DataFrame":
        """Return the history of force and torque of engines that fire in pulses.

        Pulses can have any length, also shorter than a cycle of a controller, because the table has
        a row at each edge of a pulse. Simulate the trimmed craft with this table and ``hold=True``,
        as in the example.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.
        firing : mapping
            Pulses by engine: (start, end) of each pulse, s, in any order, without overlap. Engines
            that are not named burn all the time if they burn at the operating point, otherwise
            never.
        stop : float
            End of the history, s.

        Returns
        -------
        DataFrame
            Columns ``time`` (s), ``force[1]`` to ``force[3]`` (N) and ``torque[1]`` to
            ``torque[3]`` (N·m), body axes.

        Raises
        ------
        FmuError
            If a fill, an engine or a pulse is wrong.

        Examples
        --------
        >>> import hubslosh
        >>> roll = hubslosh.Engine((0.5, 0, 0), (0, 1, 0), 22, burns=False)
        >>> craft = hubslosh.Craft(900, [400, 380, 300], engines={"roll": roll})
        >>> table = craft.pulses(0, {"roll": [(0.25, 0.27)]}, stop=1)
        >>> table[["time", "torque[3]"]].values.tolist()
        [[0.0, 0.0], [0.25, 11.0], [0.27, 0.0], [1.0, 0.0]]
        >>> run = craft.simulate(0, table, stop=1, hold=True)
        >>> round(float(run["omega[3]"].iloc[-1]), 9)
        0.000733333
        """
        shift = self.trim(fill).shift
        F, action, torque = self._resultant()
        # in the FMU, trimming moves O, and with it the line of action of the engines that burn
        wrenches = {
            name: engine.wrench(action if engine.burns else action + shift)
            for name, engine in self.engines.items()
        }
        on = [name for name, engine in self.engines.items() if engine.burns]
        return pulse_history(np.concatenate([F, torque]), wrenches, on, firing, stop)

    def export(
        self, folder: str | Path, fill: Fill, *, parameters: Parameters | None = None
    ) -> dict[str, Path]:
        """Write the trimmed craft at a fill, at rest, as files for other tools.

        ``craft.fmu`` has the binary of the craft's model, and only the variables of the craft's
        tanks and modes; its start values are the craft's values, so that a host needs to set
        nothing. ``craft.ssv`` holds these values, and ``craft.ssp`` holds FMU and values as a
        system (SSP 1.0). ``craft.mat`` has the linear model from ``torque`` to ``q`` and ``omega``,
        the parameters and the inputs; if the craft spins, the model has no ``q``, because the
        attitude is not steady. ``craft_simulink.m`` builds a Simulink model from the FMU and
        ``craft.mat``.

        Parameters
        ----------
        folder : str or Path
            Folder for the files, created if missing; existing files of these names are replaced.
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.
        parameters : mapping, optional
            Further parameters, see `parameters`.

        Returns
        -------
        dict of Path
            Paths of the files by kind: "fmu", "ssv", "ssp", "mat" and "script".

        Raises
        ------
        FmuError
            If a fill or a parameter is wrong, or a file cannot be written.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2))}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=50)
        >>> files = craft.export("for_others", "60%")
        >>> hubslosh.simulate(files["fmu"], stop=1).shape
        (51, 30)
        """
        from .export import export

        given = self.parameters(fill, parameters=parameters)
        outputs = ["omega"] if self._omega.any() else ["q", "omega"]
        linear = self.linearize(fill, outputs=outputs, parameters=parameters)
        return export(folder, self.model, given, linear)

    def columns(self, fill: Fill) -> list[str]:
        """Return the names of the variables that `view` needs to draw craft and liquid.

        Parameters
        ----------
        fill : fill, mapping, or sequence of fills
            Fill of the tanks, as for `fills`.

        Returns
        -------
        list of str
            Names for ``outputs`` of `simulate` and `closed_loop`.

        Raises
        ------
        FmuError
            If a fill is wrong.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Craft(900, [400, 380, 300]).columns("50%")[:4]
        ['q[1]', 'q[2]', 'q[3]', 'q[4]']
        """
        fmu = Fmu.open(self.model)
        names = outputs_of(fmu, None, self.parameters(fill), [])
        drawn = ("q[", "tank[")
        return [name for name in names if name.startswith(drawn)]

    def view(self, run: "pd.DataFrame", out: str | Path | None = None, **options: Any) -> "View":
        """Show a run in 3-D with the shapes of the tanks from their drawings.

        Parameters
        ----------
        run : DataFrame
            A run of Spacecraft with the parameters of this craft.
        out : str or Path, optional
            Also write the page to this .html file.
        **options
            ``model``, ``parameters``, ``start``, ``stop`` and ``program``, as for `hubslosh.view`.

        Returns
        -------
        View
            The page; a notebook shows it.

        Raises
        ------
        FmuError
            If the run lacks columns that are needed to draw it; `columns` returns the names of
            these columns.

        Examples
        --------
        >>> import hubslosh
        >>> sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
        >>> tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2), modes=1)}
        >>> craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
        >>> run = hubslosh.simulate("Spacecraft", craft.parameters("50%"), stop=1)
        >>> craft.view(run, "craft.html").path.name
        'craft.html'
        """
        from .viewing import view

        sources: dict[int, Any] = {}
        for number, (name, mounted) in enumerate(self.tanks.items(), 1):
            given = mounted.source
            sources[number] = {"name": name, **given} if isinstance(given, Mapping) else given
        return view(run, out, tanks=sources, **options)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out results that can be computed again, so that a pickled craft is small."""
        return {**self.__dict__, "_known": {}, "_said": []}

    def __repr__(self) -> str:
        modes = f", appendages: {', '.join(self.appendages)}" if self.appendages else ""
        return f"Craft({self.mass:g} kg dry, tanks: {', '.join(self.tanks) or 'none'}{modes})"

    def __str__(self) -> str:
        J, F = self._inertia(), self._force()
        burning = [name for name, engine in self.engines.items() if engine.burns]
        products = f"Jxy, Jxz, Jyz {_row((J[0, 1], J[0, 2], J[1, 2]))}"
        lines = [
            f"Craft of {self.mass:g} kg dry, centre of mass {_row(self.center_of_mass)} m",
            f"inertia Jxx, Jyy, Jzz {_row(np.diag(J))}, {products} kg·m²",
            f"thrust {_row(F)} N" + (f" by {', '.join(burning)}" if burning else ""),
        ]
        if (omega := self._omega).any():
            lines.append(f"spin {_row(omega)} rad/s")
        if pulsed := [name for name in self.engines if name not in burning]:
            lines.append(f"thrusters that fire in pulses: {', '.join(pulsed)}")
        lines += [
            f"tank {number} {name}: {tank.describe()}"
            for number, (name, tank) in enumerate(self.tanks.items(), 1)
        ]
        lines += [f"wheel {name}: {of.describe()}" for name, of in self.wheels.items()]
        lines += [f"appendage {name}: {of.describe()}" for name, of in self.appendages.items()]
        return "\n".join(lines)


def _along_z(given: Any, name: str) -> Vector:
    """Return ``given`` as a vector; a number is the component along z, so 5 is (0, 0, 5).

    ``name`` is the field's name in error messages.
    """
    along_z = isinstance(given, int | float | np.number)
    return vector([0.0, 0.0, given] if along_z else given, 3, name)


def _without_point(name: str) -> str:
    """Return the constant parameter that an entry of the fill table replaces.

    For example, "tank[1].fill.mass[2,3]" replaces "tank[1].mass[2]", because the fill table gives
    the mass of mode 2 at several fills (the last index).
    """
    prefix, key = name.split(".fill.")
    if key.startswith("liquid["):
        return f"{prefix}.m_0"
    key = re.sub(r",\d+\]$", "]", key)
    return f"{prefix}.{key if key[:2] not in ('H_', 'I_') else key.partition('[')[0]}"


def _row(numbers: Any, digits: int = 6) -> str:
    return f"({', '.join(f'{float(x):.{digits}g}' for x in np.asarray(numbers, float))})"


def _is_empty(fill: Any) -> bool:
    return bool(amount_of(fill) == 0)


def _own_inertia(tank: Tank, liquid: Liquid) -> Vector:
    """Return a liquid's moments of inertia about its centre of mass, tank axes, kg·m² (3).

    If ``liquid`` is "rigid", they are the moments of a solid of the liquid's shape. If it is
    "effective", they are the moments of liquid without friction under a rigid lid, which follows
    rotations of the tank only in part.
    """
    kind = "eff" if liquid == "effective" else "frozen"
    axes = tank.all.get("axes")  # of a box: motion along y turns about x
    across = [float((axes[of] if axes else tank.all)[f"I_{kind}_cg"]) for of in "yx"]
    about = tank.all["I_frozen_axis"] if kind == "frozen" else tank.all.get("I_eff_axis", 0.0)
    return np.array([*across, float(about)])
