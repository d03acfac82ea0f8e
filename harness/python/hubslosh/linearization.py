"""The linear model of an FMU at a point, from its own directional derivatives."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import fmi2
from numpy.typing import ArrayLike, NDArray

from .fmu import Fmu, FmuError, Quantity
from .plant import Instance

Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LinearModel:
    """x' = A x + B u, y = C x + D u: deviations from the point of linearisation, SI units.

    With a ``period``, x_{k+1} = A x_k + B u_k instead: see `sampled`. ``A, B, C, D = model`` works
    as well.
    """

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    states: tuple[str, ...]
    """Names of x."""
    inputs: tuple[str, ...]
    """Names of u."""
    outputs: tuple[str, ...]
    """Names of y."""
    period: float | None = None
    """Sampling period, s; None: continuous time."""

    def __iter__(self) -> Iterator[Matrix]:
        """Yield A, B, C, D."""
        return iter((self.A, self.B, self.C, self.D))

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Eigenvalues of A by magnitude: rad/s in continuous time, otherwise in the z plane."""
        poles = np.linalg.eigvals(self.A).astype(complex)
        return poles[np.argsort(np.abs(poles))]

    def response(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Return C (sI − A)⁻¹ B + D at frequencies in Hz: frequencies × outputs × inputs.

        s = jω, or z = exp(jωT) in its place if the model is sampled.
        """
        s: NDArray[np.complex128] = 2j * np.pi * np.atleast_1d(np.asarray(frequency, float))
        if self.period is not None:
            s = np.exp(s * self.period)
        system = s[:, None, None] * np.eye(len(self.A)) - self.A
        states = np.linalg.solve(system, np.broadcast_to(self.B, (len(s), *self.B.shape)))
        return np.asarray(self.C @ states + self.D, np.complex128)

    def sampled(self, period: float, latency: int = 0) -> "LinearModel":
        """Return the model as a controller sees it that works in cycles of ``period`` seconds.

        The inputs are held for a cycle, ``latency`` cycles after the controller gave them; those on
        the way are further states. The result is exact at the sampling instants.
        """
        from scipy.signal import cont2discrete

        if self.period is not None:
            raise FmuError("the model is sampled already")
        if not (np.isfinite(period) and period > 0):
            raise FmuError(f"period must be a positive number of seconds, not {period}")
        if latency < 0 or latency != int(latency):
            raise FmuError(f"latency must be a whole number of cycles, not {latency}")
        A, B, C, D, _ = cont2discrete((*self,), period, "zoh")
        states = list(self.states)
        for cycle in range(latency):  # the oldest command first: it reaches the plant next
            n, m = B.shape
            A = np.block([[A, B], [np.zeros((m, n + m))]])
            B = np.vstack([np.zeros((n, m)), np.eye(m)])
            C, D = np.hstack([C, D]), np.zeros_like(D)
            states += [f"{name}[-{latency - cycle}]" for name in self.inputs]
        return LinearModel(A, B, C, D, tuple(states), self.inputs, self.outputs, period)

    def to_control(self) -> Any:
        """Return it as ``control.StateSpace``, with names; needs the package control."""
        try:
            import control
        except ModuleNotFoundError:
            raise FmuError("to_control needs the package control: pip install control") from None
        return control.StateSpace(
            *self,
            0 if self.period is None else self.period,
            states=list(self.states),
            inputs=list(self.inputs),
            outputs=list(self.outputs),
        )


def linearize(
    model: str | Path = "HubSlosh",
    parameters: Mapping[str, Quantity] | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    *,
    all_states: bool = False,
) -> LinearModel:
    """Linearise an FMU where its parameters start it, by fmi2GetDirectionalDerivative.

    model, parameters: as for `simulate`; start values among the parameters (``init.omega``) and
    values of inputs (``g_axial``) are the point of linearisation. The FMU must offer Model Exchange
    and directional derivatives.
    inputs, outputs: Real variables by name; by default all inputs and all outputs of that type.
    all_states: keep states that no output depends on, directly or through other states. Without
    them nothing is approximated: modes that are not used, or the work done, leave no trace.

    Warns if no output depends on any input; a hub that dry friction holds does not move. Linearise
    with ``friction.model`` none or viscous, or in motion.
    """
    fmu = Fmu.open(model)
    exchange = fmu.description.modelExchange
    if exchange is None or not exchange.providesDirectionalDerivative:
        raise FmuError(f"{fmu.path} offers no directional derivatives in Model Exchange")
    names_in = _reals(fmu, inputs, "input")
    names_out = _reals(fmu, outputs, "output")
    derivatives = [unknown.variable for unknown in fmu.description.derivatives]
    states = [derivative.derivative for derivative in derivatives]
    references = [fmu.variable(name).valueReference for name in names_out]
    unknown = [v.valueReference for v in derivatives] + references
    known = [v.valueReference for v in states]
    known += [fmu.variable(name).valueReference for name in names_in]

    with Instance(fmu, fmi2.FMU2Model) as instance:
        for name, value in (parameters or {}).items():
            instance.set(name, value)
        instance._call("setupExperiment")
        instance._call("enterInitializationMode")
        instance._call("exitInitializationMode")
        while True:
            again, terminate, *_ = instance._call("newDiscreteStates")
            if terminate:
                raise FmuError(f"{fmu.name} ends the simulation at its start")
            if not again:
                break
        instance._call("enterContinuousTimeMode")
        columns = [instance._call("getDirectionalDerivative", unknown, [k], [1.0]) for k in known]
    jacobian = np.array(columns, float).reshape(len(known), len(unknown)).T
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
            f"no input of {fmu.name} has an effect at this point; is the hub held by dry friction? "
            "Linearise with friction.model none or viscous, or in motion (init.omega)",
            stacklevel=2,
        )
    return kept


def _seen(A: Matrix, C: Matrix) -> NDArray[np.bool_]:
    """Return which states an output depends on, directly or through other states."""
    seen: NDArray[np.bool_] = (C != 0).any(axis=0)
    while True:
        more = seen | (A[seen] != 0).any(axis=0)
        if (more == seen).all():
            return seen
        seen = more


def _reals(fmu: Fmu, names: Sequence[str] | None, causality: str) -> list[str]:
    """Return the Real variables meant."""
    if names is None:
        return [name for name in fmu.names(causality) if fmu.variable(name).type == "Real"]
    problems = []
    for name in names:
        try:
            variable = fmu.variable(name)
        except FmuError as error:
            problems.append(str(error))
            continue
        if variable.type != "Real":
            problems.append(f"{name} is of type {variable.type}, not Real")
        elif causality == "input" and variable.causality != "input":
            allowed = ", ".join(fmu.names("input"))
            problems.append(f"{name} is no input of {fmu.name} (inputs: {allowed})")
    if problems:
        raise FmuError("; ".join(problems))
    return list(names)
