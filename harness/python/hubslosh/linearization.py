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

    ``A, B, C, D = model`` works as well.
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

    def __iter__(self) -> Iterator[Matrix]:
        """Yield A, B, C, D."""
        return iter((self.A, self.B, self.C, self.D))

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Eigenvalues of A, rad/s, slowest first."""
        poles = np.linalg.eigvals(self.A).astype(complex)
        return poles[np.argsort(np.abs(poles))]

    def response(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Return C (jωI − A)⁻¹ B + D at frequencies in Hz: frequencies × outputs × inputs."""
        s: NDArray[np.complex128] = 2j * np.pi * np.atleast_1d(np.asarray(frequency, float))
        system = s[:, None, None] * np.eye(len(self.A)) - self.A
        states = np.linalg.solve(system, np.broadcast_to(self.B, (len(s), *self.B.shape)))
        return np.asarray(self.C @ states + self.D, np.complex128)

    def to_control(self) -> Any:
        """Return it as ``control.StateSpace``, with names; needs the package control."""
        try:
            import control
        except ModuleNotFoundError:
            raise FmuError("to_control needs the package control: pip install control") from None
        return control.StateSpace(
            *self, states=list(self.states), inputs=list(self.inputs), outputs=list(self.outputs)
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
