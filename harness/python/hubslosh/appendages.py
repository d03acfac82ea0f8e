"""Flexible appendages of a craft, described by fixed-interface modes from a table or a file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import array, floats, not_vectors, refuse
from .fmu import FmuError

if TYPE_CHECKING:
    import pandas as pd

Vector = NDArray[np.float64]

TURN = 2 * np.pi

COLUMNS = ("x", "y", "z", "rx", "ry", "rz")
"""Columns of participation factors in a table of modes: translation, kg^0.5, rotation, kg^0.5·m."""


@dataclass(frozen=True, eq=False)
class Appendage:
    """A flexible appendage of a `Craft`, such as a solar array, described by its modes.

    The modes are computed with the interface to the craft fixed, and normalised to unit modal mass
    (fixed-interface modes of Craig and Bampton). ``mass``, ``inertia`` and ``center_of_mass`` of
    the craft must include the undeformed appendage.

    Parameters
    ----------
    position : sequence of float, shape (3,)
        Position of the interface point from the craft's origin O, body axes, m.
    frequency : float or sequence of float, shape (n,)
        Natural frequencies with the interface fixed, Hz.
    participation : array_like, shape (6,) or (n, 6)
        Participation factors of each mode in body axes. The first three are the integral of the
        mode shape over the mass, kg^0.5; the last three are the integral of the moment of the mode
        shape about the interface point, kg^0.5·m. Their squares are the effective masses and
        inertias.
    zeta : float or sequence of float, shape (n,)
        One damping ratio for all modes, or one for each mode.

    Examples
    --------
    A panel of 40 kg and 30 kg·m² about its hinge, which swings at 0.2 Hz about x; its centre is
    0.8 m beyond the hinge along y:

    >>> import numpy as np
    >>> import hubslosh
    >>> m, d, J = 40.0, 0.8, 30.0
    >>> participation = np.array([0, 0, m * d, J, 0, 0]) / np.sqrt(J)
    >>> panel = hubslosh.Appendage((0, 0.6, 0), 0.2, participation, zeta=0.003)
    >>> craft = hubslosh.Craft(500, [400, 280, 300], appendages={"panel": panel})
    >>> craft.linearize(0).modes()["frequency"].round(4).tolist()
    [0.2341]
    >>> craft.parameters(0, parameters={"panel.frequency[1]": 0.25})["appendage[1].frequency"]
    0.25
    """

    position: Sequence[float]
    frequency: float | Sequence[float] | Vector
    participation: ArrayLike
    zeta: float | Sequence[float] | Vector = 0.005

    @classmethod
    def from_table(
        cls, table: "pd.DataFrame | str | Path", position: Sequence[float], zeta: float = 0.005
    ) -> "Appendage":
        """Return an appendage from a table of modes.

        Parameters
        ----------
        table : DataFrame, str or Path
            Table, or its CSV file, with a row for each mode. Columns: ``frequency`` (Hz), the
            participation factors ``x``, ``y``, ``z`` (kg^0.5) and ``rx``, ``ry``, ``rz`` (kg^0.5·m)
            in body axes, and optionally ``zeta``, the damping ratio of each mode.
        position : sequence of float, shape (3,)
            Position of the interface point from the craft's origin O, body axes, m.
        zeta : float
            Damping ratio of all modes if the table has no column ``zeta``.

        Returns
        -------
        Appendage
            The appendage.

        Raises
        ------
        FmuError
            If a column is missing or unknown, or the file cannot be read.

        Examples
        --------
        >>> import pandas as pd
        >>> import hubslosh
        >>> rows = {"frequency": [0.2, 1.1], "z": [5.8, 1.2], "rx": [5.5, -0.3]}
        >>> table = pd.DataFrame({"x": 0.0, "y": 0.0, "ry": 0.0, "rz": 0.0, **rows})
        >>> hubslosh.Appendage.from_table(table, (0, 0.6, 0))
        Appendage(2 modes, 0.2 to 1.1 Hz, at (0, 0.6, 0) m)
        """
        import pandas as pd

        if isinstance(table, str | Path):
            try:
                table = pd.read_csv(table)
            except (OSError, ValueError) as error:
                raise FmuError(f"the table of modes {table} cannot be read: {error}") from None
        needed = ("frequency", *COLUMNS)
        missing = [name for name in needed if name not in table]
        unknown = [str(name) for name in table if name not in (*needed, "zeta")]
        if missing or unknown:
            raise FmuError(
                f"a table of modes has the columns {', '.join(needed)} and, if they differ, zeta; "
                f"missing: {', '.join(missing) or 'none'}, unknown: {', '.join(unknown) or 'none'}"
            )
        ratios = floats(table["zeta"]) if "zeta" in table else zeta
        participation = floats(table[list(COLUMNS)])
        return cls(position, floats(table["frequency"]), participation, ratios)

    @classmethod
    def from_craig_bampton(
        cls,
        source: str | Path | tuple[ArrayLike, ArrayLike],
        position: Sequence[float],
        zeta: float | Sequence[float] = 0.005,
        *,
        axes: ArrayLike | None = None,
        most: int = 6,
        names: tuple[str, str] = ("mxx", "kxx"),
    ) -> "Appendage":
        """Return an appendage from the mass and stiffness matrix of its Craig–Bampton reduction.

        The first six degrees of freedom are the translation and rotation of the interface point,
        the further ones are modes with unit modal mass. If there are more than ``most`` modes, only
        the modes that move the craft most are kept: the modes with the largest share of the
        effective mass in one of the six directions.

        Parameters
        ----------
        source : str, Path or tuple of array_like
            Output-4 file of Nastran (.op4), which the package pyyeti reads
            (``pip install pyyeti``); or mass and stiffness matrix, each of shape (6 + n, 6 + n),
            kg, m and s.
        position : sequence of float, shape (3,)
            Position of the interface point from the craft's origin O, body axes, m.
        zeta : float or sequence of float
            One damping ratio for all modes, or one for each mode in the file.
        axes : array_like, shape (3, 3), optional
            Matrix from the axes of the file to body axes; by default they are the same.
        most : int
            Largest number of modes to keep.
        names : tuple of str
            Names of mass and stiffness matrix in the file.

        Returns
        -------
        Appendage
            The appendage, its modes by frequency.

        Raises
        ------
        FmuError
            If the file cannot be read, or the matrices are not symmetric, finite and of one size.

        Examples
        --------
        >>> import numpy as np
        >>> import hubslosh
        >>> mass, stiffness = np.diag([40.0, 40, 40, 30, 9, 39, 1]), np.zeros((7, 7))
        >>> mass[2, 6] = mass[6, 2] = 5.8
        >>> stiffness[6, 6] = (2 * np.pi * 0.2) ** 2
        >>> hubslosh.Appendage.from_craig_bampton((mass, stiffness), (0, 0.6, 0))
        Appendage(1 mode, 0.2 Hz, at (0, 0.6, 0) m)
        """
        mass, stiffness = _matrices(source, names)
        n = len(mass) - 6
        own = mass[6:, 6:]
        coupled = np.abs(stiffness[:6]).max() > 1e-6 * np.abs(stiffness).max()
        wrong = [
            text
            for text, is_wrong in (
                ("the mass matrix of the modes must be the unit matrix (unit modal mass)",
                 np.abs(own - np.eye(n)).max() > 1e-6),
                ("the stiffness of the interface must be 0: it has six degrees of freedom that "
                 "move the appendage as a rigid body", coupled),
                ("the stiffness matrix of the modes must be diagonal and above 0",
                 not (np.diag(stiffness)[6:] > 0).all()
                 or np.abs(stiffness[6:, 6:] - np.diag(np.diag(stiffness)[6:])).max()
                 > 1e-6 * np.abs(stiffness).max()),
            )
            if is_wrong
        ]  # fmt: skip
        refuse(wrong)
        turn = np.eye(3) if axes is None else floats(axes)
        if turn.shape != (3, 3) or np.abs(turn @ turn.T - np.eye(3)).max() > 1e-6:
            raise FmuError("axes must be a rotation matrix of 3 × 3")
        participation = mass[6:, :6]
        whole = np.where(np.diag(mass)[:6] > 0, np.diag(mass)[:6], np.inf)
        share = (participation**2 / whole).max(axis=1)
        kept = np.sort(np.argsort(-share, kind="stable")[:most])
        frequency = np.sqrt(np.diag(stiffness)[6:]) / TURN
        order = kept[np.argsort(frequency[kept], kind="stable")]
        ratios = np.broadcast_to(floats(zeta), (n,)) if np.ndim(zeta) else np.full(n, zeta)
        turned = participation.reshape(n, 2, 3) @ turn.T
        return cls(position, frequency[order], turned.reshape(n, 6)[order], ratios[order])

    def problems(self) -> list[str]:
        """Return everything that is wrong with the appendage.

        Returns
        -------
        list of str
            One sentence for each problem; empty if there is none.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Appendage((0, 0, 0), [0.2, 0.0], [[1, 0, 0, 0, 0, 0]] * 2).problems()
        ['frequency must be numbers above 0, Hz, not [0.2, 0.0]']
        """
        found = not_vectors(self, 3, "position")
        frequency, zeta = (_unmasked(x) for x in (self.frequency, self.zeta))
        if frequency.ndim > 1 or not frequency.size or not (frequency > 0).all():
            return [*found, f"frequency must be numbers above 0, Hz, not {self.frequency!r}"]
        n = frequency.size
        if zeta.shape not in ((), (n,)) or not (zeta >= 0).all():
            found.append(f"zeta must be a number, or one for each of {n} modes, 0 or above, not "
                         f"{self.zeta!r}")  # fmt: skip
        participation = _unmasked(self.participation)
        shapes = [(n, 6), *([(6,)] if n == 1 else [])]
        if participation.shape not in shapes or not np.isfinite(participation).all():
            found.append(
                f"participation must be six finite numbers for each of {n} modes (kg^0.5 in "
                "translation, kg^0.5·m in rotation)"
            )
        return found

    @property
    def count(self) -> int:
        """Number of modes."""
        return int(np.size(floats(self.frequency)))

    def modes(self) -> list[dict[str, Any]]:
        """Return the parameters of each mode by their names in the FMU Spacecraft.

        Returns
        -------
        list of dict
            ``frequency`` (Hz), ``zeta`` and ``participation[1]`` to ``[6]`` of each mode.

        Examples
        --------
        >>> import hubslosh
        >>> panel = hubslosh.Appendage((0, 0.6, 0), 0.2, [0, 0, 5.8, 5.5, 0, 0])
        >>> panel.modes()[0]["participation[3]"]
        5.8
        """
        n = self.count
        frequency = floats(self.frequency).reshape(n)
        zeta = np.broadcast_to(floats(self.zeta), (n,))
        participation = floats(self.participation).reshape(n, 6)
        return [
            {"frequency": float(frequency[j]), "zeta": float(zeta[j])}
            | {f"participation[{i + 1}]": float(x) for i, x in enumerate(participation[j])}
            for j in range(n)
        ]

    def __repr__(self) -> str:
        return f"Appendage({self.describe()})"

    def describe(self) -> str:
        """Return a text with the number of modes, their frequencies and the interface point.

        Returns
        -------
        str
            The text.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Appendage((0, 0.6, 0), 0.2, [0, 0, 5.8, 5.5, 0, 0]).describe()
        '1 mode, 0.2 Hz, at (0, 0.6, 0) m'
        """
        ends = sorted({f"{x:.6g}" for x in np.ravel(floats(self.frequency))[[0, -1]]}, key=float)
        place = ", ".join(f"{x:.6g}" for x in floats(self.position))
        modes = "1 mode" if self.count == 1 else f"{self.count} modes"
        return f"{modes}, {' to '.join(ends)} Hz, at ({place}) m"


def _unmasked(given: Any) -> Vector:
    """Return ``given`` as an array, which is empty if an entry is masked or is not a number."""
    try:
        return array(given)
    except FmuError:
        return np.empty(0)


def _matrices(source: Any, names: tuple[str, str]) -> tuple[Vector, Vector]:
    """Return mass and stiffness matrix, after checking that they are square, finite, symmetric.

    ``source`` is a pair of matrices, or the path of a NASTRAN Output-4 file, in which the matrices
    have the ``names``.
    """
    if isinstance(source, str | Path):
        try:
            from pyyeti.nastran import op4
        except ImportError:
            raise FmuError(f"to read {source} install pyyeti: pip install pyyeti") from None
        try:
            every = {str(key).lower(): of for key, of in op4.read(str(source)).items()}
        except (OSError, ValueError, KeyError, IndexError) as error:
            raise FmuError(f"{source} cannot be read as an Output-4 file: {error}") from None
        wanted = [name.lower() for name in names]
        if missing := [name for name in wanted if name not in every]:
            raise FmuError(
                f"{source} has no matrix {', '.join(missing)}; it has {', '.join(every)}: name "
                "mass and stiffness matrix by names="
            )
        source = tuple(every[name] for name in wanted)
    mass, stiffness = (array(matrix) for matrix in source)
    n = len(mass)
    if mass.shape != (n, n) or stiffness.shape != (n, n) or n < 7:
        raise FmuError(
            "mass and stiffness must be square matrices of one size: six degrees of freedom of the "
            "interface, then at least one mode"
        )
    if not all(np.isfinite(m).all() and np.abs(m - m.T).max() <= 1e-6 * np.abs(m).max()
               for m in (mass, stiffness)):  # fmt: skip
        raise FmuError("mass and stiffness matrix must be finite and symmetric")
    return mass, stiffness
