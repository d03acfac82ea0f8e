"""Slosh modes of a tank of any shape, at any tilt, by linear potential flow in three dimensions.

This module is for tanks that ``hubslosh tank`` does not cover, because they are neither bodies of
revolution nor boxes: horizontal cylinders, sectors, tanks under a lateral component of gravity, and
CAD solids. It needs the extra ``fem`` (gmsh for the mesh, scikit-fem for the finite elements).

The liquid Q has the wetted wall W and the free surface F at z = z_F, normal to the specific force.
n is the normal out of the liquid, and λ = ω²/g:

    Δφ = 0 in Q,   ∂φ/∂n = 0 on W,   ∂φ/∂z = λ φ on F
    weak:          ∫_Q ∇φ·∇v = λ ∫_F φ v

The tank has six motions j: three displacements and three rotations about O. N_j = n·e_j or n·(e_j ×
r) is the velocity of the wall along n, where the surface is replaced by a rigid lid. Ψ_j is the
potential with ∂Ψ_j/∂n = N_j. By Green's identity

    B_nj = ∫_F φ_n Ψ_j = (1/λ_n) ∫_(W+F) φ_n N_j,        N_n = ∫_F φ_n²
    mass matrix of mode n:                     ρ λ_n B_nj B_nk/N_n
  mass matrix of liquid under a rigid lid:   ρ ∫ Ψ_j N_k

A mode with a displacement, A = (B_n1, B_n2), is a mass m = ρ λ |A|²/N on a pendulum of length 1/λ
that swings along A/|A|. Its height and its arm about the vertical through O follow from the
rotations. A mode without displacement only twists. Sources: H. N. Abramson (ed.), NASA SP-106, ch.
6; Moiseyev and Rumyantsev, Dynamic Stability of Bodies Containing Fluid (1968).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .arguments import array, not_positive, parse_share, refuse, vector
from .fmu import FmuError
from .tanks import SIX_AXES, _from_z, prefix_of

if TYPE_CHECKING:
    import pandas as pd

    from .fmu import Value

# Shapes and the names of their dimensions; ``angle`` is in degrees, all others are in m.
SHAPES: dict[str, tuple[str, ...]] = {
    "cylinder": ("radius", "height"),
    "horizontal_cylinder": ("radius", "length"),
    "sphere": ("radius",),
    "box": ("length", "width", "height"),
    "sector": ("inner_radius", "radius", "angle", "height"),
    "step": (),
}

OF_A_MODE = ("mass", "length", "hinge", "wave")  # Columns of `modes` that are parameters of FMUs

_MASSLESS = 1e-6  # Slosh mass, as a fraction of the liquid, below which a mode only twists
_EQUAL = 3e-4  # Relative difference up to which two λ count as equal, because of the mesh's errors


@dataclass(frozen=True, eq=False)
class LiquidModes:
    """Slosh modes of a tank at one fill, as `liquid_modes` returns them.

    The axes have their origin at O of the tank's shape (see `liquid_modes`), and their z axis along
    the specific force. If the specific force is along the tank's z axis, these are the tank's axes.

    Attributes
    ----------
    mass : float
        Mass of the liquid, kg.
    center : tuple of float
        Centre of mass of the liquid, m.
    surface : float
        Height of the free surface, m.
    gravity : float
        Magnitude of the specific force, m/s².
    lid_inertia : ndarray, shape (3, 3)
        Inertia about O of the liquid under a rigid lid in a tank that rotates, kg·m².
    all : DataFrame
        All computed modes, including modes that `modes` leaves out; the columns are the same as in
        `modes`.
    error : DataFrame
        Relative differences of ``frequency`` and ``mass`` of each mode between two meshes.

    Examples
    --------
    >>> import hubslosh
    >>> box = {"box": {"length": 1.0, "width": 0.6, "height": 1.0}}
    >>> found = hubslosh.liquid_modes(box, 0.5, modes=2, resolution=4)
    >>> round(found.mass), found.modes["frequency"].round(2).tolist()
    (300, [0.85, 1.14])
    """

    mass: float
    center: tuple[float, float, float]
    surface: float
    gravity: float
    lid_inertia: "np.ndarray"
    all: "pd.DataFrame" = field(repr=False)
    error: "pd.DataFrame" = field(repr=False)

    def __repr__(self) -> str:
        from .short import rows

        return f"LiquidModes of {self.mass:.6g} kg, {self.gravity:.4g} m/s²\n{rows(self.modes)}"

    @property
    def modes(self) -> "pd.DataFrame":
        """Slosh modes as pendulums, one in each row, in order of frequency.

        Columns: ``frequency`` (Hz); slosh ``mass`` (kg); ``direction`` of the motion of the slosh
        mass, deg from x towards y, -90 to 90; ``length`` of the pendulum (m); heights ``bob`` of
        the slosh mass and ``hinge`` of the hinge (m); ``arm``, the distance from the vertical
        through O to the line on which the slosh mass moves (m); ``twist``, the inertia about this
        vertical that the mode moves (kg·m²). A mode that only twists has a mass of about 0; its
        direction, arm and heights are NaN.
        """
        return self.all

    @cached_property
    def rest(self) -> dict[str, float]:
        """Fixed mass (kg) and its height (m) for motions of the tank along x and along y.

        Keys: ``m_0_x``, ``H_0_x``, ``m_0_y``, ``H_0_y``. The values for x and y differ, because a
        slosh mass that swings only along y belongs to the fixed mass for motions along x.
        """
        found = {}
        for name, part in zip("xy", _directions(self.all), strict=True):
            moving = self.all["mass"].to_numpy() * part**2
            height = np.nan_to_num(self.all["bob"].to_numpy())
            left = self.mass - moving.sum()
            found[f"m_0_{name}"] = float(left)
            found[f"H_0_{name}"] = float((self.mass * self.center[2] - moving @ height) / left)
        return found

    def table(self, direction: str = "y", modes: int = 1) -> "dict[str, Value]":
        """Return the modes along x or y as parameters ``slosh.table`` of HubSlosh.

        On the hub, this direction of the tank is tangential, and the tank's O is at the distance
        ``tank.r`` from the axis of the hub.

        Parameters
        ----------
        direction : str
            "x" or "y".
        modes : int
            Number of modes, at most 10.

        Returns
        -------
        dict
            Values in SI units by the names of HubSlosh's parameters.

        Raises
        ------
        FmuError
            If a mode moves along x and y at once, or an argument is not allowed.

        Examples
        --------
        >>> import hubslosh
        >>> box = {"box": {"length": 1.0, "width": 0.6, "height": 1.0}}
        >>> found = hubslosh.liquid_modes(box, 0.5, modes=2, resolution=4)
        >>> round(found.table("y")["slosh.table.length[1]"], 2)
        0.19
        """
        if direction not in ("x", "y"):
            raise FmuError(f'direction must be "x" or "y", not {direction!r}')
        along = np.abs(_directions(self.all)["xy".index(direction)])
        moving = self.all["mass"].to_numpy() > _MASSLESS * self.mass
        mixed = moving & (along > 1e-3) & (along < 1 - 1e-3)
        if mixed.any():
            which = ", ".join(str(n + 1) for n in np.flatnonzero(mixed))
            raise FmuError(
                f"modes {which} move along x and y at once, but the table of HubSlosh has only one "
                "axis"
            )
        chosen = self.all[moving & (along > 0.5)]
        if not 1 <= modes <= min(len(chosen), 10):
            raise FmuError(f"modes must be 1 to {min(len(chosen), 10)} here, not {modes!r}")
        values: dict[str, Value] = {
            "slosh.source": "table",
            "slosh.modes": modes,
            "slosh.table.one_axis": True,
            "slosh.table.m_liq": self.mass,
            "slosh.table.g_ref": self.gravity,
            "tank.I_own": float(
                self.lid_inertia[2, 2] - self.mass * (self.center[0] ** 2 + self.center[1] ** 2)
            ),
        }
        for n, (_, mode) in enumerate(chosen.head(modes).iterrows(), 1):
            values |= {f"slosh.table.{key}[{n}]": float(mode[key]) for key in OF_A_MODE}
        return values

    def parameters(
        self,
        number: int = 1,
        *,
        model: str = "Spacecraft",
        modes: int | None = None,
        position: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> "dict[str, Value]":
        """Return the parameters of an FMU's tank with this liquid, for example for `simulate`.

        Each mode is planar with its own direction, and its damping ratio is 0. The tank's axis
        passes through the centre of mass of the liquid; r_n is the position of slosh mass m_n from
        this centre. The fixed mass m_0 is a rigid body at r_0 with the inertia J_0. It is chosen so
        that fixed mass and slosh masses together have the mass m, the centre of mass and the
        inertia J of the liquid under a rigid lid::

            m_0 = m − Σ m_n,   m_0 r_0 = −Σ m_n r_n,
            J_0 = J − Σ m_n (|r_n|² 1 − r_n⊗r_n) − m_0 (|r_0|² 1 − r_0⊗r_0)

        Parameters
        ----------
        number : int
            Number of the tank on Spacecraft, 1 to 4.
        model : str
            "Spacecraft", or "SloshTank", which has one tank.
        modes : int, optional
            Number of modes, 1 to 3; the modes with the largest slosh masses are kept. By default 3,
            or all modes with a slosh mass if there are fewer than 3.
        position : sequence of float, shape (3,)
            Position of the tank's O in body axes, m. Its axes are parallel to the body axes.

        Returns
        -------
        dict
            Values in SI units by the names of the FMU's parameters.

        Raises
        ------
        FmuError
            If an argument is not allowed.

        Examples
        --------
        >>> import hubslosh
        >>> box = {"box": {"length": 1.0, "width": 0.6, "height": 1.0}}
        >>> found = hubslosh.liquid_modes(box, 0.5, modes=2, resolution=4)
        >>> values = found.parameters(position=(0, 0, 0.2))
        >>> values["tank[1].modes"], round(values["tank[1].mass[1]"])
        (2, 142)
        """
        if model not in SIX_AXES:
            raise FmuError(f"model must be {' or '.join(SIX_AXES)}, not {model!r}")
        name, place = prefix_of(model, number), vector(position, 3, "position")
        moving = self.all[self.all["mass"] > _MASSLESS * self.mass]
        most = min(3, len(moving))
        count = most if modes is None else modes
        if not (isinstance(count, int) and 1 <= count <= most):
            raise FmuError(f"modes must be 1 to {most} here, not {modes!r}")
        kept = moving.sort_values("mass", ascending=False, kind="stable").head(count)
        center = np.array(self.center)
        along = np.array(_directions(kept))
        arm = kept["arm"].to_numpy() - (center[0] * along[1] - center[1] * along[0])
        masses, height = kept["mass"].to_numpy(), kept["bob"].to_numpy() - center[2]
        bobs = np.array([arm * along[1], -arm * along[0], height])
        m_0 = self.mass - masses.sum()
        r_0 = -(bobs @ masses) / m_0

        def points_inertia(m: np.ndarray, r: np.ndarray) -> np.ndarray:
            return np.einsum("n,in,in->", m, r, r) * np.eye(3) - np.einsum("n,in,jn->ij", m, r, r)

        inertia = self.lid_inertia - points_inertia(np.array([self.mass]), center[:, None])
        left = (
            inertia - points_inertia(masses, bobs) - points_inertia(np.array([m_0]), r_0[:, None])
        )
        axis = (place[0] + center[0], place[1] + center[1], place[2])
        values: dict[str, Value] = {
            **{f"{name}.position[{i}]": float(x) for i, x in enumerate(axis, 1)},
            f"{name}.m_0": float(m_0), f"{name}.H_0": float(center[2] + r_0[2]),
            f"{name}.r_0[1]": float(r_0[0]), f"{name}.r_0[2]": float(r_0[1]),
            f"{name}.I_0": float(left[0, 0]), f"{name}.dI_y": float(left[1, 1] - left[0, 0]),
            f"{name}.I_z": float(left[2, 2]), f"{name}.I_xy": float(left[0, 1]),
            f"{name}.I_xz": float(left[0, 2]), f"{name}.I_yz": float(left[1, 2]),
            f"{name}.g_ref": self.gravity, f"{name}.modes": count,
        }  # fmt: skip
        for n, (_, mode) in enumerate(kept.iterrows(), 1):
            values |= {f"{name}.{key}[{n}]": float(mode[key]) for key in OF_A_MODE} | {
                f"{name}.direction[{n},1]": float(along[0, n - 1]),
                f"{name}.direction[{n},2]": float(along[1, n - 1]),
                f"{name}.arm[{n}]": float(arm[n - 1]),
                f"{name}.zeta[{n}]": 0.0,
            }
        return values


def liquid_modes(
    shape: Mapping[str, Any],
    fill: float | str,
    *,
    density: float = 1000.0,
    modes: int = 6,
    specific_force: float | Sequence[float] = 9.80665,
    resolution: int = 16,
) -> LiquidModes:
    """Compute the slosh modes of a tank of any shape by finite elements in three dimensions.

    A call takes 5 to 60 s. `tank` is faster for bodies of revolution and boxes along their axis.
    Needs ``pip install hubslosh[fem]``.

    Parameters
    ----------
    shape : mapping
        One shape with its dimensions, m, such as
        ``{"horizontal_cylinder": {"radius": 0.5, "length": 2}}``: ``cylinder`` (radius, height),
        ``horizontal_cylinder`` (radius, length; its axis is x), ``sphere`` (radius), ``box``
        (length, width, height along x, y, z), ``sector`` (inner_radius, radius, angle in deg,
        height; x bisects it). O is the lowest point or the middle of the lowest plane; of a
        sector, the point where its axis meets the floor. ``{"step": "tank.step"}`` reads the
        inside of a tank as a solid from a CAD file, m, with O and axes as in the file.
    fill : float or str
        Height of the surface above the lowest point along the specific force, m, or ``"60%"`` of
        the volume.
    density : float
        Density of the liquid, kg/m³.
    modes : int
        Number of modes, 1 to 40.
    specific_force : float or sequence of float, shape (3,)
        Specific force along the tank's z, or its components in the tank's axes, m/s². For a tank
        at rest it points upwards and has the magnitude of gravity.
    resolution : int
        Number of elements across the surface, 4 to 40, in the finer of two meshes. The
        difference of the meshes is `LiquidModes.error`.

    Returns
    -------
    LiquidModes
        Mass properties and modes of the liquid.

    Raises
    ------
    FmuError
        If an argument is not allowed, gmsh or scikit-fem is not installed, or no mesh can be
        made of the liquid.

    Examples
    --------
    >>> import hubslosh
    >>> box = {"box": {"length": 1.0, "width": 0.6, "height": 1.0}}
    >>> found = hubslosh.liquid_modes(box, "50%", modes=2, resolution=4)
    >>> found.modes["direction"].round().abs().tolist()
    [0.0, 90.0]
    """
    import pandas as pd

    name, size = _check_shape(shape)
    force = np.atleast_1d(array(specific_force))
    force = np.array([0.0, 0.0, force[0]]) if force.shape == (1,) else force
    if force.shape != (3,) or not np.isfinite(force).all() or not np.linalg.norm(force) > 0:
        raise FmuError("specific_force must be one number or three numbers, m/s², and not 0")
    if not (isinstance(resolution, int) and 4 <= resolution <= 40):
        raise FmuError(f"resolution must be 4 to 40 elements, not {resolution!r}")
    if not (isinstance(modes, int) and 1 <= modes <= 40):
        raise FmuError(f"modes must be 1 to 40, not {modes!r}")
    refuse(not_positive("density", density, "kg/m³"))
    gravity = float(np.linalg.norm(force))
    tank = _Tank(name, size, _level(force))
    meshes = (max(3.0, resolution / 1.5), float(resolution))
    surface = _surface(tank, fill, meshes[0])

    def solve(mesh: Any) -> LiquidModes:
        return _solve(mesh, surface, density, gravity, modes)

    coarse, fine = (_on_a_mesh(tank, surface, elements, solve) for elements in meshes)
    error = pd.DataFrame({
        key: np.abs(coarse.all[key] - fine.all[key]).to_numpy()
        / (fine.mass if key == "mass" else fine.all[key])
        for key in ("frequency", "mass")
    })  # fmt: skip
    return LiquidModes(fine.mass, fine.center, fine.surface, gravity, fine.lid_inertia, fine.all,
                       error)  # fmt: skip


def _check_shape(shape: Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
    if not (isinstance(shape, Mapping) and len(shape) == 1 and next(iter(shape)) in SHAPES):
        raise FmuError(
            f"shape must be one of {', '.join(SHAPES)} with its dimensions, not {shape!r}"
        )
    [(name, given)] = shape.items()
    if name == "step":
        if not Path(given).is_file():
            raise FmuError(f"{given}: no such file")
        return name, {"file": str(given)}
    wanted = SHAPES[name]
    if not isinstance(given, Mapping) or set(given) != set(wanted):
        raise FmuError(f"{name} expects {', '.join(wanted)}, not {given!r}")
    size = {key: float(value) for key, value in given.items()}
    for key, value in size.items():
        least = 0.0 if key == "inner_radius" else np.nextafter(0.0, 1.0)
        if not least <= value < np.inf:
            raise FmuError(f"{key} of the {name} must be positive, not {value!r}")
    if name == "sector":
        if size["inner_radius"] >= size["radius"]:
            raise FmuError("inner_radius of the sector must be smaller than its radius")
        if size["angle"] >= 360:
            raise FmuError("angle of the sector must be less than 360 degrees")
    return name, size


def _level(force: np.ndarray) -> np.ndarray:
    """Return the rotation matrix that brings the specific force ``force`` (3) to the z axis.

    It is the shortest rotation. In the rotated tank the free surface is level.
    """
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(_from_z(force), scalar_first=True).as_matrix()).T


def _heights(
    occ: Any, solid: int, name: str, size: Mapping[str, Any], level: np.ndarray
) -> tuple[float, float]:
    """Return the heights of the lowest and the highest point of the rotated tank, m.

    ``name`` and ``size`` are the tank's shape and dimensions, ``level`` is the rotation, and
    ``solid`` is the tank in gmsh's kernel ``occ``. The heights are computed from corners and rims,
    because OpenCASCADE's bounding boxes of curved surfaces are too large. For a CAD file, its
    bounding box is used all the same.
    """
    if name == "sphere":
        center = level @ [0, 0, size["radius"]]
        return float(center[2] - size["radius"]), float(center[2] + size["radius"])
    if name == "step":
        box = occ.getBoundingBox(3, solid)
        return float(box[2]), float(box[5])
    if name == "box":
        a, b = size["length"] / 2, size["width"] / 2
        rim = np.array([[a, a, -a, -a], [b, -b, b, -b]])
    else:
        half = np.radians(size.get("angle", 360)) / 2
        # with so many points, chords deviate from the arc by at most 1e-8 of the radius
        turn = np.linspace(-half, half, 20001)
        circle = np.array([np.cos(turn), np.sin(turn)])
        rim = np.hstack([size["radius"] * circle, size.get("inner_radius", 0) * circle])
    if name == "horizontal_cylinder":
        ends = [np.vstack([np.full_like(rim[0], x), rim[0], size["radius"] + rim[1]])
                for x in (-size["length"] / 2, size["length"] / 2)]  # fmt: skip
    else:
        ends = [np.vstack([rim, np.full_like(rim[0], z)]) for z in (0, size["height"])]
    heights = level[2] @ np.hstack(ends)
    return float(heights.min()), float(heights.max())


def _solid(occ: Any, name: str, size: Mapping[str, Any]) -> int:
    """Create the tank of the shape ``name`` and the dimensions ``size`` in gmsh's kernel ``occ``.

    Return the tag of the solid, which is the tank's interior in tank axes.
    """
    if name == "cylinder":
        return int(occ.addCylinder(0, 0, 0, 0, 0, size["height"], size["radius"]))
    if name == "horizontal_cylinder":
        radius, length = size["radius"], size["length"]
        tag = occ.addCylinder(-length / 2, 0, radius, length, 0, 0, radius)
        # turn the seam of the cylinder away from the surface of a half-full tank, because Boolean
        # operations fail if the seam lies in the surface
        occ.rotate([(3, tag)], 0, 0, radius, 1, 0, 0, 0.7)
        return int(tag)
    if name == "sphere":
        return int(occ.addSphere(0, 0, size["radius"], size["radius"]))
    if name == "box":
        a, b = size["length"], size["width"]
        return int(occ.addBox(-a / 2, -b / 2, 0, a, b, size["height"]))
    if name == "sector":
        angle = np.radians(size["angle"])
        outer = occ.addCylinder(0, 0, 0, 0, 0, size["height"], size["radius"], angle=angle)
        occ.rotate([(3, outer)], 0, 0, 0, 0, 0, 1, -angle / 2)
        if size["inner_radius"] > 0:
            inner = occ.addCylinder(0, 0, 0, 0, 0, size["height"], size["inner_radius"])
            [(_, outer)], _ = occ.cut([(3, outer)], [(3, inner)])
        return int(outer)
    solids = [tag for dimension, tag in occ.importShapes(size["file"]) if dimension == 3]
    if len(solids) != 1:
        raise FmuError(f"{size['file']}: expects one solid, the tank's inside, not {len(solids)}")
    return int(solids[0])


class _Tank(NamedTuple):
    """A tank's shape and dimensions, and the rotation that puts the specific force along z."""

    name: str
    size: Mapping[str, Any]
    level: np.ndarray

    @contextmanager
    def solid(self) -> "Iterator[tuple[Any, int, Sequence[float], float]]":
        """Yield the module gmsh, the rotated tank as a solid, its bounding box and its volume.

        The volume is computed before the rotation, because OpenCASCADE computes the volume of round
        shapes exactly only if they are not rotated.
        """
        try:
            import gmsh
            import skfem  # noqa: F401, part of the same extra
        except (ImportError, OSError) as error:
            raise FmuError(
                f"{error}: slosh modes in three dimensions need two packages: pip install gmsh "
                "scikit-fem (gmsh also needs the system library libGLU, in Debian libglu1-mesa)"
            ) from None

        gmsh.initialize(interruptible=False)
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.option.setString("Geometry.OCCTargetUnit", "M")
            occ = gmsh.model.occ
            solid = _solid(occ, self.name, self.size)
            volume = float(occ.getMass(3, solid))
            turn = np.eye(4)
            turn[:3, :3] = self.level
            occ.affineTransform([(3, solid)], turn.ravel().tolist())
            occ.synchronize()
            yield gmsh, solid, occ.getBoundingBox(3, solid), volume
        except FmuError:
            raise
        except Exception as error:  # gmsh raises plain exceptions
            raise FmuError(f"the liquid cannot be meshed: {error}") from None
        finally:
            gmsh.finalize()


def _on_a_mesh(
    tank: _Tank, surface: float | None, elements: float, do: "Callable[[Any], Any]"
) -> Any:
    """Call ``do`` with a mesh, and again with finer meshes while elements are too distorted.

    The mesh fills the tank up to the height ``surface`` (m), or the whole tank if None, with
    ``elements`` elements across the surface.
    """
    for again in range(4):
        mesh = _mesh(tank, surface, elements * 1.05**again)
        try:
            return do(mesh)
        except Exception as error:  # scikit-fem raises it for an element that is too distorted
            reason = error
    raise FmuError(f"no usable mesh ({reason}); try another resolution")


def _mesh(tank: _Tank, surface: float | None, elements: float) -> Any:
    """Return a mesh of curved tetrahedra of the liquid below the height ``surface``.

    ``elements`` is the number of elements across the surface. If ``surface`` is None, the whole
    tank is meshed.
    """
    from skfem import MeshTet2

    with tank.solid() as (gmsh, solid, box, _):
        if surface is None:
            liquid, flat = solid, []
            extent = np.array([box])
        else:
            liquid = _cut(gmsh.model.occ, solid, box, surface)
            gmsh.model.occ.synchronize()
            faces = gmsh.model.getEntities(2)
            flat = [tag for _, tag in faces if _is_at(gmsh, tag, surface, box)]
            if not flat:
                raise FmuError("there is no free surface: the tank is empty or full")
            extent = np.array([gmsh.model.occ.getBoundingBox(2, tag) for tag in flat])
        across = float(min(extent[:, 3].max() - extent[:, 0].min(),
                           extent[:, 4].max() - extent[:, 1].min()))  # fmt: skip
        _set_sizes(gmsh, flat, across / elements)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        tags, points, _ = gmsh.model.mesh.getNodes()
        index = np.zeros(int(tags.max()) + 1, int)
        index[tags] = np.arange(len(tags))
        kinds, _, nodes = gmsh.model.mesh.getElements(3, liquid)
        cells = index[nodes[list(kinds).index(11)].reshape(-1, 10)]  # 11: tetrahedra of 10 nodes
    # put gmsh's nodes on the edges in the order of scikit-fem: 01, 12, 02, 03, 13, 23
    cells = cells[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
    used, cells = np.unique(cells, return_inverse=True)
    locations = np.ascontiguousarray(points.reshape(-1, 3)[used].T)
    return MeshTet2(locations, np.ascontiguousarray(cells.reshape(-1, 10).T))


def _surface(tank: _Tank, fill: float | str, elements: float) -> float:
    """Return the height of the free surface at ``fill``, m, in axes in which the surface is level.

    OpenCASCADE's volumes of cut or rotated round tanks are wrong by up to a hundredth, so they only
    give a first guess. Then the volume of the mesh is compared with the volume of the upright tank.
    ``elements`` is the number of elements across the surface.
    """
    part = parse_share(fill)
    if isinstance(fill, str) and fill.strip().endswith("%") and not (part and part < 1):
        raise FmuError(f"fill must be between 0% and 100% of the volume, not {fill!r}")
    with tank.solid() as (gmsh, solid, box, whole):
        occ = gmsh.model.occ
        low, high = _heights(occ, solid, tank.name, tank.size, tank.level)
        if part is None:
            if isinstance(fill, bool | str) or not 0 < float(fill) < high - low:
                raise FmuError(
                    f"fill must be a height between 0 and {high - low:.6g} m, or a share of the "
                    f'volume, such as "60%", not {fill!r}'
                )
            return low + float(fill)

        def excess(height: float) -> float:
            [(_, copy)] = occ.copy([(3, solid)])
            rest = _cut(occ, copy, box, height)
            volume = float(occ.getMass(3, rest))
            occ.remove([(3, rest)], recursive=True)
            return volume - part * whole

        from scipy.optimize import brentq

        edge = 1e-4 * (high - low)
        surface = float(brentq(excess, low + edge, high - edge, xtol=1e-4 * (high - low)))

    if tank.name == "step":
        whole = _on_a_mesh(tank, None, 1.5 * elements, _volume)
    for _ in range(5):
        volume, area = _on_a_mesh(tank, surface, elements, partial(_volume_and_area, surface))
        step = (part * whole - volume) / area
        surface += step
        if abs(step) < 1e-4 * (high - low):
            break  # the remaining error is at most a hundredth of this step
    return surface


def _volume(mesh: Any) -> float:
    from skfem import Basis, ElementTetP2, Functional

    basis = Basis(mesh, ElementTetP2(), intorder=4)
    return float(Functional(lambda w: np.ones_like(w.x[0])).assemble(basis))


def _on_surface(mesh: Any, surface: float) -> np.ndarray:
    """Return the boundary facets of ``mesh`` at the height ``surface``, m."""
    outside = mesh.boundary_facets()
    heights = mesh.p[2, mesh.facets[:, outside]]
    tall = mesh.p[2].max() - mesh.p[2].min()
    return outside[np.all(np.abs(heights - surface) < 1e-7 * tall, axis=0)]


def _volume_and_area(surface: float, mesh: Any) -> tuple[float, float]:
    """Return the volume of ``mesh``, m³, and the area of its free surface, m².

    The surface is at the height ``surface``, m. Its facets count as plane triangles, so that the
    area lacks a narrow strip at the rim.
    """
    a, b, c = (mesh.p[:2, corner] for corner in mesh.facets[:, _on_surface(mesh, surface)])
    (x, y), (u, v) = b - a, c - a
    return _volume(mesh), float(np.abs(x * v - y * u).sum() / 2)


def _cut(occ: Any, solid: int, box: Sequence[float], surface: float) -> int:
    """Cut away the tank above the height ``surface``; return the tag of the liquid's solid.

    The tank is ``solid`` in gmsh's kernel ``occ``, and ``box`` is its bounding box.
    """
    margin = max(box[3] - box[0], box[4] - box[1], box[5] - box[2])
    lid = occ.addBox(
        box[0] - margin, box[1] - margin, surface, *(3 * margin,) * 2, box[5] - surface + margin
    )
    left, _ = occ.cut([(3, solid)], [(3, lid)])
    if len(left) != 1:
        raise FmuError(
            f"the liquid is in {len(left)} parts that do not touch; give each part as a tank of "
            "its own"
        )
    return int(left[0][1])


def _is_at(gmsh: Any, tag: int, surface: float, box: Sequence[float]) -> bool:
    if gmsh.model.getType(2, tag) != "Plane":
        return False
    near = 1e-6 * (box[5] - box[2])
    height = gmsh.model.occ.getCenterOfMass(2, tag)[2]
    normal = gmsh.model.getNormal(tag, [0.5, 0.5])
    return abs(height - surface) < near and abs(abs(normal[2]) - 1) < 1e-6


def _set_sizes(gmsh: Any, flat: list[int], size: float) -> None:
    """Make elements smallest at the edge of the free surface, and larger away from it.

    ``size`` is the element size on the surface, m, whose faces in gmsh are ``flat``. Larger
    elements suffice elsewhere, because the modes decay with the distance from the free surface. If
    ``flat`` is empty, all elements have the same size.
    """
    fields = gmsh.model.mesh.field
    if flat:
        edges = gmsh.model.getBoundary([(2, tag) for tag in flat], oriented=False)
        lines = sorted({tag for _, tag in edges})
        distance = fields.add("Distance")
        fields.setNumbers(distance, "SurfacesList", flat)
        fields.setNumbers(distance, "CurvesList", lines)
        fields.setNumber(distance, "Sampling", 60)
        away = fields.add("MathEval")
        fields.setString(away, "F", f"{size!r} + 0.1*F{distance}")
        edge = fields.add("Distance")
        fields.setNumbers(edge, "CurvesList", lines)
        fields.setNumber(edge, "Sampling", 200)
        fine = fields.add("MathEval")
        fields.setString(fine, "F", f"{0.6 * size!r} + 0.4*F{edge}")
        sizes = fields.add("Min")
        fields.setNumbers(sizes, "FieldsList", [away, fine])
    else:
        sizes = fields.add("MathEval")
        fields.setString(sizes, "F", f"{size!r}")
    fields.setAsBackgroundMesh(sizes)
    for key in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{key}", 0)


def _solve(mesh: Any, surface: float, density: float, gravity: float, count: int) -> LiquidModes:
    """Return the slosh modes of the liquid that ``mesh`` fills, without an estimate of errors.

    The free surface is at the height ``surface``, m; ``density`` is in kg/m³, ``gravity`` is the
    specific force, m/s², and ``count`` the number of modes.
    """
    import pandas as pd
    from scipy.sparse.linalg import LinearOperator, eigsh, splu
    from skfem import Basis, ElementTetP2, FacetBasis, Functional, LinearForm
    from skfem.models.poisson import laplace, mass

    element = ElementTetP2()
    volume = Basis(mesh, element, intorder=4)
    facets = (mesh.boundary_facets(), _on_surface(mesh, surface))
    wet, lid = (FacetBasis(mesh, element, facets=f, intorder=5) for f in facets)

    def integral(basis: Any, f: "Callable[[np.ndarray], np.ndarray]") -> float:
        return float(Functional(lambda w: f(w.x)).assemble(basis))

    q = integral(volume, lambda x: np.ones_like(x[0]))
    center = np.array([integral(volume, lambda x, i=i: x[i]) / q for i in range(3)])

    def along(j: int) -> "Callable[[Any], Any]":
        """Return N_j, the wall's velocity along its normal n per unit motion of the tank.

        The motion is a displacement along x, y or z (j = 0 to 2) or a rotation (j = 3 to 5).
        """
        if j < 3:
            return lambda w: w.n[j]
        a, b = (j - 2) % 3, (j - 1) % 3  # e_j × r has the component r_a along b and −r_b along a
        return lambda w: w.n[b] * w.x[a] - w.n[a] * w.x[b]

    normal = [along(j) for j in range(6)]
    flux = [LinearForm(lambda v, w, f=f: v * f(w)).assemble(wet) for f in normal]
    s, m = laplace.assemble(volume).tocsc(), mass.assemble(lid).tocsc()

    # solve M x = μ (S + M) x, μ = 1/(1 + λ); the first solution, μ = 1, is a constant potential
    both = splu((s + m).tocsc())
    size = s.shape[0]
    inverse = LinearOperator((size, size), matvec=both.solve)
    start = np.random.default_rng(1).standard_normal(size)
    mu, x = eigsh(m, count + 1, s + m, Minv=inverse, which="LA", v0=m @ start, tol=1e-12)
    order = np.argsort(-mu)[1:]
    lambdas, phi = 1 / mu[order] - 1, x[:, order]

    norm = np.einsum("in,in->n", phi, m @ phi)
    phi, norm = phi / np.sqrt(norm), np.ones(count)
    lambdas, phi = _aligned(lambdas, phi, np.array([phi.T @ f for f in flux[:2]]).T)
    b = np.array([phi.T @ f for f in flux]).T / lambdas[:, None]  # modes × motions
    rows = [
        _mode(density, gravity, lam, bn, nn, q * density)
        for lam, bn, nn in zip(lambdas, b, norm, strict=True)
    ]
    table = pd.DataFrame(rows)
    # wave height at the highest place of the surface per angle of the pendulum, A φ(wall)/N
    on_lid = np.unique(volume.get_dofs(facets[1]).flatten())
    crest = np.abs(phi[on_lid]).max(axis=0)
    table["wave"] = np.hypot(b[:, 0], b[:, 1]) * crest / norm
    units = dict.fromkeys(("length", "bob", "hinge", "arm"), "m")
    table.attrs["units"] = {"frequency": "Hz", "mass": "kg", "twist": "kg.m2", "direction": "deg",
                            "wave": "m/rad", **units}  # fmt: skip

    # Ψ of the rotations solves S Ψ = ∫ v N up to a constant, so the first value is set to 0
    psi = np.zeros((3, size))
    held = splu(s[1:, 1:].tocsc())
    for k in range(3):
        load = flux[3 + k] - flux[3 + k].mean()
        psi[k, 1:] = held.solve(load[1:])
    inertia = density * np.array([[p @ f for f in flux[3:]] for p in psi])
    return LiquidModes(
        q * density, (float(center[0]), float(center[1]), float(center[2])), surface, gravity,
        (inertia + inertia.T) / 2, table, pd.DataFrame(),
    )  # fmt: skip


def _aligned(lambdas: np.ndarray, phi: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotate pairs of modes of equal frequency so that they move along x and along y.

    The eigensolver returns such a pair in arbitrary directions, which depend on the mesh.
    ``lambdas`` are the eigenvalues, the columns of ``phi`` the modes, and the rows of ``a`` their
    coupling with displacements of the tank along x and y, of unit norm.
    """
    lambdas, phi = lambdas.copy(), phi.copy()
    large = np.hypot(*a.T) > 1e-3 * np.hypot(*a.T).max()
    for n in range(len(lambdas) - 1):
        pair = slice(n, n + 2)
        if lambdas[n + 1] - lambdas[n] < _EQUAL * lambdas[n] and large[pair].all():
            c, s = a[pair, 0] / np.linalg.norm(a[pair, 0])
            turn = np.array([[c, -s], [s, c]])
            phi[:, pair] = phi[:, pair] @ turn
            lambdas[pair] = np.diag(turn.T @ np.diag(lambdas[pair]) @ turn)
    return lambdas, phi


def _mode(
    density: float, gravity: float, lam: float, b: np.ndarray, norm: float, liquid: float
) -> dict[str, float]:
    """Return the pendulum that acts on the tank like one slosh mode.

    ``density`` is in kg/m³, and ``gravity`` is the specific force, m/s². ``lam`` is the eigenvalue
    ω²/g, 1/m; ``b`` couples the mode with the tank's six motions; ``norm`` is the mode's norm over
    the free surface; ``liquid`` is the mass of the liquid, kg.
    """
    a = np.hypot(b[0], b[1])
    mass = density * lam * a**2 / norm
    twist = density * lam * b[5] ** 2 / norm
    row = {"frequency": np.sqrt(gravity * lam) / (2 * np.pi), "mass": mass, "length": 1 / lam}
    if mass < _MASSLESS * liquid:
        nothing = dict.fromkeys(("direction", "bob", "hinge", "arm"), np.nan)
        return {**row, **nothing, "twist": twist}
    e = b[:2] / a
    # choose one of two opposite directions by the sign of the x component; of a motion along y by
    # the sign of the y component, because the x component is an error of the mesh
    if e[1] < 0 if abs(e[0]) < 1e-3 else e[0] < 0:
        e, a = -e, -a
    # a momentum e at (p, H) has the angular momentum (−H e_y, H e_x, p_x e_y − p_y e_x) about O
    bob = (b[4] * e[0] - b[3] * e[1]) / a
    return {
        **row, "direction": float(np.degrees(np.arctan2(e[1], e[0]))), "bob": bob,
        "hinge": bob + 1 / lam, "arm": b[5] / a, "twist": twist,
    }  # fmt: skip


def _directions(modes: "pd.DataFrame") -> tuple[np.ndarray, np.ndarray]:
    """Return the components along x and along y of the direction of each mode."""
    turn = np.radians(np.nan_to_num(modes["direction"].to_numpy()))
    return np.cos(turn), np.sin(turn)
