"""Linear models of FMUs at an operating point, from the FMUs' directional derivatives."""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import native
from .arguments import MOST_STATES, check_ranges, floats, names_of, refuse
from .fmu import Fmu, FmuError, Parameters
from .operating_point import is_spacecraft, warn_of_attitude, warn_of_rotation
from .plant import Instance
from .simulation import check_outputs, parameters_of

if TYPE_CHECKING:
    import pandas as pd

Matrix = NDArray[np.float64]


def _check_states(states: int, cycles: int, period: float) -> None:
    """Raise FmuError if a model that stores delayed commands has too many states.

    ``states`` is its number of states; the delay is ``cycles`` control cycles of ``period`` (s).
    """
    if states > MOST_STATES:
        raise FmuError(
            f"a delay of {cycles * period:g} s is {cycles} cycles of {period:g} s, and the "
            f"delayed commands make {states} states (allowed: {MOST_STATES}): give a shorter "
            "delay or latency, or a longer period"
        )


def split_delay(delay: float, period: float) -> tuple[int, float]:
    """Return a delay as a number of whole cycles and the remaining seconds.

    If the remainder is less than 1e-9 of a cycle, it comes from rounding and is returned as 0.
    """
    check_ranges(delay=delay)
    cycles = int(np.floor(delay / period + 1e-9))
    rest = round(float(delay / period - cycles), 12)
    return cycles, rest * period if rest > 1e-9 else 0.0


@dataclass(frozen=True, eq=False)
class LinearModel:
    """A linear model x' = A x + B u, y = C x + D u of deviations from an operating point.

    If ``period`` is given, the model is in discrete time, x_{k+1} = A x_k + B u_k; see `sampled`.
    All values are in SI units. ``A, B, C, D = model`` unpacks the matrices.

    Parameters
    ----------
    A : ndarray, shape (n, n)
        Effect of the states on their derivatives.
    B : ndarray, shape (n, m)
        Effect of the inputs on the states' derivatives.
    C : ndarray, shape (p, n)
        Effect of the states on the outputs.
    D : ndarray, shape (p, m)
        Effect of the inputs on the outputs.
    states : tuple of str
        Names of x.
    inputs : tuple of str
        Names of u.
    outputs : tuple of str
        Names of y.
    period : float, optional
        Sampling period, s; None is continuous time.

    Examples
    --------
    A double integrator of 40 kg·m² from torque to angle:

    >>> import numpy as np
    >>> from hubslosh import LinearModel
    >>> A, B = np.array([[0.0, 1], [0, 0]]), np.array([[0.0], [1 / 40]])
    >>> C, D = np.array([[1.0, 0]]), np.zeros((1, 1))
    >>> model = LinearModel(A, B, C, D, ("theta", "omega"), ("tau_cmd",), ("theta",))
    >>> model
    LinearModel, continuous: 2 states (theta, omega), 1 inputs (tau_cmd), 1 outputs (theta)
    """

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    period: float | None = None

    def __iter__(self) -> Iterator[Matrix]:
        """Yield A, B, C, D, so that ``A, B, C, D = model`` works."""
        return iter((self.A, self.B, self.C, self.D))

    def __repr__(self) -> str:
        from .short import names

        time = "continuous" if self.period is None else f"sampled with {self.period:g} s"
        sizes = ", ".join(
            f"{len(of)} {what} ({names(of)})" if of else f"0 {what}"
            for what, of in {
                "states": self.states, "inputs": self.inputs, "outputs": self.outputs,
            }.items()
        )  # fmt: skip
        return f"LinearModel, {time}: {sizes}"

    def __str__(self) -> str:
        from .short import rows

        modes = self.modes().assign(states=lambda table: table["states"].map(", ".join))
        return f"{self!r}\n{rows(modes) if len(modes) else 'no oscillatory modes'}"

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Eigenvalues of A in order of magnitude, rad/s; of a sampled model, in the z plane."""
        poles = np.linalg.eigvals(self.A).astype(complex)
        return poles[np.argsort(np.abs(poles))]

    def response(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Return the frequency response C (sI − A)⁻¹ B + D.

        Parameters
        ----------
        frequency : array_like, shape (n,)
            Frequencies, Hz, where s = 2πj · frequency. The response of a sampled model is evaluated
            at z = exp(s · period) instead of s.

        Returns
        -------
        ndarray of complex, shape (n, p, m)
            Response from each of m inputs to each of p outputs, SI units.

        Raises
        ------
        FmuError
            If the frequencies are not numeric.

        Examples
        --------
        >>> import hubslosh
        >>> model = hubslosh.linearize(
        ...     parameters={"friction.model": "viscous"}, inputs="tau_cmd", outputs="omega")
        >>> abs(model.response([0.5, 2.0])[:, 0, 0]).round(3)
        array([0.74, 0.15])
        """
        try:
            s: NDArray[np.complex128] = 2j * np.pi * np.atleast_1d(floats(frequency))
        except (TypeError, ValueError):
            raise FmuError(f"frequency must be numbers, Hz, not {frequency!r}") from None
        if self.period is not None:
            s = np.exp(s * self.period)
        return self._at(s)

    def _at(self, s: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Return the transfer function (output × input) at each point of ``s``.

        The points are in the s plane or, for a sampled model, in the z plane.
        """
        system = s[:, None, None] * np.eye(len(self.A)) - self.A
        states = np.linalg.solve(system, np.broadcast_to(self.B, (len(s), *self.B.shape)))
        return np.asarray(self.C @ states + self.D, np.complex128)

    def _then(self, other: "LinearModel", prefix: str) -> "LinearModel":
        """Return this model in series with ``other``, which receives this model's outputs.

        The names of the states of ``other`` get the prefix ``prefix``.
        """
        nothing = np.zeros((self.A.shape[-1], len(other.A)))
        return LinearModel(
            _block([[self.A, nothing], [other.B @ self.C, other.A]]),
            _block([[self.B], [other.B @ self.D]]),
            _block([[other.D @ self.C, other.C]]),
            other.D @ self.D,
            (*self.states, *(f"{prefix}{name}" for name in other.states)),
            self.inputs,
            other.outputs,
            self.period,
        )

    def sampled(self, period: float, latency: int = 0, delay: float = 0.0) -> "LinearModel":
        """Return the model in discrete time, as a sampled controller sees it.

        Each input is held for one cycle and acts after the delay; inputs that do not act yet are
        further states. The result is exact at the sampling instants. An output that depends
        directly on an input has the value just after the new input acts.

        Parameters
        ----------
        period : float
            Period of the cycle, s.
        latency : int
            Delay from command to plant in whole cycles.
        delay : float
            Delay in addition to ``latency``, s; it need not be a whole number of cycles.

        Returns
        -------
        LinearModel
            The model in discrete time, with ``period``.

        Raises
        ------
        FmuError
            If the model is sampled already, a number is out of range, or the delay would make more
            than 1000 states.

        Examples
        --------
        >>> import hubslosh
        >>> model = hubslosh.linearize(
        ...     parameters={"friction.model": "viscous"}, inputs="tau_cmd", outputs="omega")
        >>> sampled = model.sampled(0.1, delay=0.04)
        >>> sampled.period, sampled.states[-1]
        (0.1, 'tau_cmd[-1]')
        """
        from scipy.signal import cont2discrete

        if self.period is not None:
            raise FmuError("the model is sampled already")
        check_ranges(period=period, latency=latency)
        cycles, rest = split_delay(delay, period)
        cycles += int(latency)
        _check_states(len(self.A) + self.B.shape[1] * (cycles + 1), cycles, period)
        if rest:
            return self._delayed(period, cycles, rest)
        A, B, C, D, _ = cont2discrete((*self,), period, "zoh")
        states = list(self.states)
        for cycle in range(cycles):  # oldest command first, because it reaches the plant next
            n, m = B.shape
            A = np.block([[A, B], [np.zeros((m, n + m))]])
            B = np.vstack([np.zeros((n, m)), np.eye(m)])
            C, D = np.hstack([C, D]), np.zeros_like(D)
            states += [f"{name}[-{cycles - cycle}]" for name in self.inputs]
        return LinearModel(A, B, C, D, tuple(states), self.inputs, self.outputs, period)

    def _delayed(self, period: float, cycles: int, rest: float) -> "LinearModel":
        """Return the model in discrete time with a delay of its inputs.

        The delay is ``cycles`` cycles of ``period`` (s) and ``rest`` seconds, 0 ≤ rest < period. In
        cycle k the command of cycle k - cycles - 1 acts for ``rest`` seconds, then the command of
        cycle k - cycles (Åström and Wittenmark, Computer-Controlled Systems, section 2.4). An
        output that depends directly on an input has the value just before a new command acts,
        because this is what the controller measures.
        """
        n, m = self.B.shape[-2:]
        _check_states(n + m * (cycles + 1), cycles, period)
        (step, full), (_, later) = _held(self, period), _held(self, period - rest)
        if not np.isfinite(step).all():
            fastest = float(np.linalg.eigvals(self.A).real.max())
            raise FmuError(
                f"the model cannot be sampled with a period of {period:g} s: a mode grows by "
                f"{fastest:.3g} 1/s"
            )
        on_the_way = m * (cycles + 1)  # delayed commands, the oldest first
        # the new input comes after the delayed commands
        effect = np.zeros((*self.A.shape[:-2], n + on_the_way, n + on_the_way + m))
        effect[..., :n, :n], effect[..., :n, n : n + m] = step, full - later
        effect[..., :n, n + m : n + 2 * m] = later
        effect[..., n:, n + m :] = np.eye(on_the_way)
        C = _block([[self.C, self.D, np.zeros((self.C.shape[-2], m * cycles))]])
        states = [f"{u}[-{k}]" for k in range(cycles + 1, 0, -1) for u in self.inputs]
        return LinearModel(
            effect[..., : n + on_the_way],
            effect[..., n + on_the_way :],
            C,
            np.zeros_like(self.D),
            (*self.states, *states),
            self.inputs,
            self.outputs,
            period,
        )

    def modes(self, below: float = 1.0) -> "pd.DataFrame":
        """Return the oscillatory modes in order of frequency.

        Parameters
        ----------
        below : float
            Damping ratio below which a mode is listed.

        Returns
        -------
        DataFrame
            Columns: ``frequency``, the undamped frequency, Hz; ``zeta``, the damping ratio; and
            ``states``, the names of the states that take part most. Their participation factors
            (Pérez-Arriaga, Verghese and Schweppe 1982) are at least a fifth of the largest, and the
            largest comes first.

        Examples
        --------
        >>> import hubslosh
        >>> model = hubslosh.linearize(parameters={"friction.model": "viscous"})
        >>> model.modes()[["frequency", "zeta"]].round(4)
           frequency    zeta
        0      2.456  0.0034
        """
        return mode_table(self._modes(below))

    def _modes(self, below: float) -> list[tuple[float, float, tuple[str, ...]]]:
        """Return frequency (Hz), damping ratio and most active states of each oscillatory mode.

        Modes with a damping ratio of at least ``below`` are left out.
        """
        poles, left, right = eigenvectors(self)
        rows = []
        for k, pole in enumerate(poles):
            if self.period is not None:
                pole = np.log(pole) / self.period if pole else -np.inf
            if not pole.imag > 0 or -pole.real >= below * abs(pole):
                continue
            if self.period is not None and pole.imag * self.period > np.pi * (1 - 1e-9):
                continue  # a negative real pole of a sampled model is no oscillatory mode
            share = np.abs(left[:, k] * right[:, k])
            most = [i for i in np.argsort(-share, kind="stable") if share[i] > 0.2 * share.max()]
            names = tuple(self.states[i] for i in most)
            rows.append((abs(pole) / (2 * np.pi), -pole.real / abs(pole), names))
        rows.sort(key=lambda row: row[0])
        return rows

    def to_control(self) -> Any:
        """Return the model as ``control.StateSpace``, with its names; needs the package control.

        Returns
        -------
        control.StateSpace
            The same matrices, in continuous time or with the period.

        Raises
        ------
        FmuError
            If the package control is not installed.

        Examples
        --------
        >>> import hubslosh
        >>> model = hubslosh.linearize(parameters={"friction.model": "viscous"}, outputs="omega")
        >>> model.to_control().output_labels
        ['omega']
        """
        return control_package().StateSpace(
            *self,
            0 if self.period is None else self.period,
            states=list(self.states),
            inputs=list(self.inputs),
            outputs=list(self.outputs),
        )


def control_package() -> Any:
    """Return the module python-control, or raise FmuError if it is not installed."""
    try:
        import control
    except ModuleNotFoundError:
        raise FmuError("to_control needs the package control: pip install control") from None
    return control


def mode_table(rows: list[tuple[float, float, tuple[str, ...]]]) -> "pd.DataFrame":
    """Return a table of oscillatory modes, as `LinearModel.modes` returns it.

    Each row has frequency (Hz), damping ratio and the states that take part.
    """
    import pandas as pd

    table = pd.DataFrame(rows, columns=["frequency", "zeta", "states"])
    table.attrs["units"] = {"frequency": "Hz", "zeta": "1"}
    return table


@lru_cache(maxsize=32)
def eigenvectors(model: LinearModel) -> tuple[Any, Any, Any]:
    """Return the eigenvalues of a model's matrix A, and its left and right eigenvectors."""
    from scipy.linalg import eig

    found: tuple[Any, Any, Any] = eig(model.A, left=True)
    return found


@lru_cache(maxsize=32)
def _held(model: LinearModel, time: float) -> tuple[Matrix, Matrix]:
    """Return exp(A t), and the states (rows) at t after a unit step of each input (column).

    ``time`` is t, s, after the step, and A the matrix of ``model``.
    """
    n, m = model.B.shape[-2:]
    whole = exponential(_block([[model.A, model.B], [np.zeros((m, n + m))]]) * time)
    return whole[..., :n, :n], whole[..., :n, n:]


def _block(rows: list[list[Matrix]]) -> Matrix:
    """Return the matrix of the blocks in ``rows``, or a stack of matrices if a block is a stack."""
    stack = max((block.shape[:-2] for row in rows for block in row), key=len)
    size = sum(row[0].shape[-2] for row in rows), sum(block.shape[-1] for block in rows[0])
    found, y = np.empty((*stack, *size)), 0
    for row in rows:
        x, below = 0, y + row[0].shape[-2]
        for block in row:
            found[..., y:below, x : x + block.shape[-1]] = block
            x += block.shape[-1]
        y = below
    return found


def exponential(A: Matrix) -> Matrix:
    """Return the exponential of a matrix, or of each matrix of a stack.

    SciPy's function is not used: for 25 states on two cores it takes 30 times as much CPU time,
    because its threads wait for each other.
    """
    found = native.exponential(np.ascontiguousarray(A, float), A.shape[-1])
    return np.frombuffer(found).reshape(A.shape).copy()


def linearize(
    model: str | Path = "HubSlosh",
    parameters: Parameters | str | Path | None = None,
    inputs: Sequence[str] | str | None = None,
    outputs: Sequence[str] | str | None = None,
    *,
    all_states: bool = False,
) -> LinearModel:
    """Linearise an FMU at its initial state, by its directional derivatives.

    A hub of HubSlosh that dry friction holds at rest does not respond to small torques. Therefore
    linearise it with ``friction.model`` "none" or "viscous", or in motion. The function warns if no
    output depends on any input, and if Spacecraft has an angular acceleration at this point.

    Parameters
    ----------
    model : str or Path
        Name or file of the FMU, as for `simulate`. It must offer Model Exchange and directional
        derivatives.
    parameters : mapping, str or Path, optional
        Parameters, as for `simulate`. Start values (``init.omega``) and values of inputs
        (``g_axial``) among them define the point of linearisation.
    inputs : str or sequence of str, optional
        Names of Real inputs or of vectors of inputs; by default all Real inputs.
    outputs : str or sequence of str, optional
        Names of Real variables or of vectors (``"omega"``); by default all Real outputs.
    all_states : bool
        Keep states on which no output depends, directly or through other states, such as unused
        modes and the work done. By default these states are left out, which does not change the
        outputs.

    Returns
    -------
    LinearModel
        The model in continuous time, SI units.

    Raises
    ------
    FmuError
        If the FMU offers no derivatives, or a name or value is wrong.

    Examples
    --------
    >>> import hubslosh
    >>> model = hubslosh.linearize(
    ...     parameters={"friction.model": "viscous"}, inputs="tau_cmd", outputs="omega")
    >>> A, B, C, D = model
    >>> A.shape, model.modes()["frequency"].round(2).tolist()
    ((3, 3), [2.46])
    """
    fmu = Fmu.open(model)
    if not fmu.native.differentiates:
        raise FmuError(f"{fmu.path} offers no directional derivatives in Model Exchange")
    parameters = parameters_of(parameters)
    names_in = _reals(fmu, inputs, "input")
    names_out = _reals(fmu, outputs, "output")
    pairs = fmu.native.derivatives
    states = [fmu.by_reference.get(state) for _, state in pairs]
    if None in states:
        raise FmuError(f"{fmu.name} has arrays of states; only scalar states are linearised")
    unknown = [derivative for derivative, _ in pairs]
    unknown += [fmu.variable(name).reference for name in names_out]
    known = [state for _, state in pairs] + [fmu.variable(name).reference for name in names_in]
    with Instance(fmu, exchange=True) as instance:
        for name, value in parameters.items():
            instance.set(name, value)
        columns = instance.native.jacobian(unknown, known)
        if is_spacecraft(fmu):
            turning = instance.get([f"omega_dot[{i}]" for i in (1, 2, 3)])
            warn_of_rotation(f"this point of {fmu.name}", turning)
            omega = instance.get([f"omega[{i}]" for i in (1, 2, 3)])
            warn_of_attitude(f"this point of {fmu.name}", names_out, omega)
    jacobian = np.frombuffer(columns).reshape(len(known), len(unknown)).T
    n = len(states)
    A, B, C, D = jacobian[:n, :n], jacobian[:n, n:], jacobian[n:, :n], jacobian[n:, n:]
    seen = np.ones(n, bool) if all_states else _seen(A, C)
    kept = LinearModel(
        A[np.ix_(seen, seen)],
        B[seen],
        C[:, seen],
        D,
        tuple(state.name for state, keep in zip(states, seen, strict=True) if keep),
        tuple(names_in),
        tuple(names_out),
    )
    if not (kept.B.any() or kept.D.any()):
        warnings.warn(
            f"no input of {fmu.name} has an effect at this point; does dry friction hold the hub? "
            "Linearise with friction.model none or viscous, or in motion (init.omega)",
            stacklevel=2,
        )
    return kept


def _seen(A: Matrix, C: Matrix) -> NDArray[np.bool_]:
    """Return a mask of the states on which the outputs depend, directly or through other states."""
    seen: NDArray[np.bool_] = (C != 0).any(axis=0)
    while True:
        more = seen | (A[seen] != 0).any(axis=0)
        if (more == seen).all():
            return seen
        seen = more


def _reals(fmu: Fmu, names: Sequence[str] | str | None, causality: str) -> list[str]:
    """Return ``names`` as a list, after checking that they are Real variables of the FMU.

    If ``names`` is None, return all Real variables with ``causality`` ("input" or "output").
    """
    if names is None:
        return [name for name in fmu.names(causality) if fmu.kind(name) == "Real"]
    problems: list[str] = []
    names = fmu.components(names_of(names, f"{causality}s", problems))
    check_outputs(fmu, names, problems, real=True, inputs=causality == "input")
    refuse(problems)
    return list(names)
