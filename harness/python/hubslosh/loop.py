"""A sampled controller in closed loop with an FMU."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .arguments import array, caller, column_of, floats, names_of, not_numbers, out_of_range, refuse
from .feedback import Feedback, Linear
from .fmu import Fmu, FmuError, FmuWarning, Parameters, did_you_mean
from .linearization import LinearModel, linearize, split_delay
from .plant import TORQUE
from .run import Run
from .short import names
from .simulation import (
    History,
    check_outputs,
    check_parameters,
    histories_of,
    outputs_of,
    parameters_of,
    record_run,
    too_many_rows,
    without_replaced,
)
from .wheels import (
    ALL,
    MOMENTUM,
    Wheel,
    columns_of,
    momentum,
    rows_of,
    saturated,
    speed_name,
    torque_names,
    units_of,
    wrong_wheels,
)
from .wheels import TORQUE as BODY_TORQUE

# Controller function: from time (s) and measurements to the command, or to a sequence with one
# number for each command.
Law = Callable[[float, NDArray[np.float64]], Any]

QUATERNION = tuple(f"q[{i}]" for i in range(1, 5))  # Attitude of Spacecraft, scalar first


@dataclass(frozen=True, eq=False)
class Loop:
    """A sampled controller around an FMU, for `closed_loop` (simulation) and `margins`.

    Parameters
    ----------
    controller : callable, array_like, LinearModel or system of python-control
        A function of time (s) and the values of ``measured`` that returns a command, or one for
        each of several commands. Or a linear controller of the error, reference − measured: a
        matrix of gains (commands × measured), a `LinearModel`, or a state space or transfer
        function of python-control. A discrete controller must have the period of the loop; a
        continuous one is discretised by Tustin's rule, which moves a frequency f to
        atan(π f T)/(π T).
    period : float
        Period of the controller's cycle, s.
    model : str or Path
        Name or file of the FMU, as for `simulate`.
    parameters : mapping, str or Path, optional
        Parameters of the FMU, as for `simulate`.
    measured : str or sequence of str
        Measured variables of the FMU; ``"omega"`` of Spacecraft is all three components.
    command : str or sequence of str
        Inputs of the FMU that the controller commands. A command is added to the value that the
        parameters give its input, for example to the thrust of a craft.
    latency : int
        Delay from measurement to command, whole cycles.
    delay : float
        Delay in addition to ``latency``, s; it need not be a whole number of cycles. Each command
        is held until the next command acts; for a controller designed in continuous time, this has
        the effect of half a cycle of additional delay.
    wheels : mapping of Wheel
        Reaction wheels by name, for Spacecraft; `Craft.loop` passes the wheels of the craft. The
        torques of the wheels can be commanded: ``"z.torque"`` is the torque of wheel z on the
        craft, N·m, and ``"wheels"`` stands for the torques of all wheels in order.
    tanks : tuple of str
        Names of the craft's tanks, which `margins` uses in the names of slosh modes; `Craft.loop`
        passes these names.

    Examples
    --------
    >>> import hubslosh
    >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1, parameters={"friction.model": "none"})
    >>> loop.names
    (['theta', 'omega'], ['tau_cmd'])
    """

    controller: Any
    period: float
    model: str | Path = "HubSlosh"
    parameters: Parameters | str | Path | None = None
    measured: Sequence[str] | str = ("theta", "omega")
    command: Sequence[str] | str = TORQUE
    latency: int = 0
    delay: float = 0.0
    wheels: Mapping[str, Wheel] = field(default_factory=dict)
    tanks: tuple[str, ...] = ()

    def __repr__(self) -> str:
        measured, command = (names_of(of, "", []) for of in (self.measured, self.command))
        given = self.parameters
        known = (
            f"{len(given)} parameters" if isinstance(given, Mapping) else given or "no parameters"
        )
        shape = getattr(self.controller, "shape", None)
        law = f"{shape[0]} × {shape[1]} gains" if shape and len(shape) == 2 else None
        law = law or type(self.controller).__name__
        late = f"{self.delay:g} s" + (f" and {self.latency} cycles" if self.latency else "")
        return (
            f"Loop around {Path(self.model).stem} with {known}\n"
            f"  controller: {law}, every {self.period} s, delay {late}\n"
            f"  measured: {names(measured)}\n"
            f"  command: {names(command)}"
        )

    def problems(self) -> list[str]:
        """Return everything that is wrong with the loop.

        Returns
        -------
        list of str
            One sentence for each problem; empty if there is none.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Loop([[4.0]], 0.1, measured="theta").problems()
        []
        """
        return self._examine()[0]

    def _examine(self) -> tuple[list[str], LinearModel | None]:
        """Return error messages about the loop, and its controller as a linear model or None.

        The controller is None if it is a function.
        """
        controller = None
        found = out_of_range(period=self.period, latency=self.latency, delay=self.delay)
        fmu = Fmu.open(self.model)
        if wrong := wrong_wheels(self.wheels):
            return found + wrong, None
        names_of(self.command, "command", found)
        commands = self.names[1]
        turned = self._turned
        allowed = [*fmu.names("input"), *torque_names(self.wheels)]
        if turned and not {*MOMENTUM} <= {*fmu.names("input")}:
            found.append(f"wheels are for Spacecraft: {fmu.name} has no input h_wheels[1]")
        for name in commands:
            if name in turned:
                continue
            if turned and name in MOMENTUM:
                found.append(f"the command {name} is set by the reaction wheels: leave it out")
            elif name not in allowed:
                hint = did_you_mean(name, allowed)
                found.append(
                    f"the command {name} is not an input of {fmu.name} "
                    f"(inputs: {', '.join(allowed)}){hint}"
                )
            elif fmu.kind(name) != "Real":
                found.append(f"the command {name} is of type {fmu.kind(name)}, not Real")
        measured = fmu.components(names_of(self.measured, "measured", found))
        check_outputs(fmu, measured, found, real=True)
        twice = [name for name in dict.fromkeys(commands) if commands.count(name) > 1]
        found += [f"the command {name} is given twice" for name in twice]
        if not commands:
            found.append("command is empty: name at least one input of the FMU")
        if not found:
            try:
                controller = _linear(self.controller, self.period, measured, commands)
            except FmuError as error:
                found.append(str(error))
        return found, controller

    def check(self) -> None:
        """Raise an error if anything is wrong with the loop.

        Raises
        ------
        FmuError
            With everything that is wrong.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Loop([[4.0, 2.0]], 0.1).check()
        """
        refuse(self.problems())

    @property
    def names(self) -> tuple[list[str], list[str]]:
        """Names of the measured variables, and names of the commanded inputs."""
        fmu = Fmu.open(self.model)
        measured, command = names_of(self.measured, "", []), names_of(self.command, "", [])
        commands: list[str] = []
        for name in fmu.components(command):
            commands += torque_names(self.wheels) if name == ALL and self.wheels else [name]
        return fmu.components(measured), commands

    @property
    def _turned(self) -> dict[str, Wheel]:
        """The wheels that the controller commands, each by the name of its torque."""
        if not self.wheels:
            return {}
        commands = self.names[1]
        return {name: of for name, of in torque_names(self.wheels).items() if name in commands}

    def _units(self) -> dict[str, str]:
        """Units of torques and speeds of the wheels, which are no variables of the FMU."""
        return units_of(torque_names(self.wheels))

    @property
    def _acting_inputs(self) -> list[str]:
        """Inputs of the FMU on which the commands act: a wheel acts as a torque on the craft."""
        turned, commands = self._turned, self.names[1]
        if not turned:
            return commands
        inputs = [name for name in commands if name not in turned]
        inputs += [name for name in BODY_TORQUE if name not in inputs]
        return sorted(inputs, key=Fmu.open(self.model).names("input").index)

    def linear(self) -> LinearModel | None:
        """Return the controller as a sampled linear model.

        Returns
        -------
        LinearModel or None
            The controller with the loop's period; None if the controller is a function.

        Raises
        ------
        FmuError
            If the controller's size or period does not fit the loop.

        Examples
        --------
        >>> import hubslosh
        >>> hubslosh.Loop([[4.0, 2.0]], 0.1).linear().D
        array([[4., 2.]])
        """
        measured, command = self.names
        return _linear(self.controller, self.period, measured, command)

    def _must_be_linear(self) -> LinearModel:
        """Return the controller as a linear model; raise FmuError if the loop has problems."""
        found, controller = self._examine()
        refuse(found)
        if controller is None:
            raise FmuError(
                "the loop gain needs a linear controller: a matrix of gains, a LinearModel, or a "
                "state space or transfer function of python-control"
            )
        return controller

    @property
    def whole_delay(self) -> tuple[int, float]:
        """Delay from measurement to command: whole cycles, and the remaining seconds."""
        cycles, rest = split_delay(self.delay, self.period)
        return cycles + int(self.latency), rest

    def plant(self, parameters: Parameters | None = None) -> LinearModel:
        """Return the FMU's linear model from commands to measurements, in continuous time.

        Parameters
        ----------
        parameters : mapping, optional
            Further parameters, such as ``{"friction.model": "viscous"}``, which override the
            parameters of the loop.

        Returns
        -------
        LinearModel
            The model, SI units.

        Raises
        ------
        FmuError
            If the FMU offers no derivatives, or a parameter is wrong.

        Examples
        --------
        >>> import hubslosh
        >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1)
        >>> loop.plant({"friction.model": "viscous"}).outputs
        ('theta', 'omega')
        """
        return self._plant(parameters_of(parameters))

    def _plant(self, parameters: Parameters, *, all_states: bool = False) -> LinearModel:
        """Return the linear model from commands to measurements at ``parameters``.

        If ``all_states``, states that do not affect the measurements are kept, see `linearize`.
        """
        measured, command = self.names
        every = parameters_of(self.parameters) | dict(parameters)
        if not (turned := self._turned):
            return linearize(self.model, every, command, measured, all_states=all_states)
        plain = [name for name in command if name not in turned]
        inputs = list(dict.fromkeys([*plain, *BODY_TORQUE, *MOMENTUM]))
        model = linearize(self.model, every, inputs, measured, all_states=all_states)
        return self._with_wheels(model, command, all_states=all_states)

    def _with_wheels(
        self, model: LinearModel, inputs: list[str], *, all_states: bool = False
    ) -> LinearModel:
        """Return ``model`` with ``inputs``, among which can be torques of reaction wheels.

        ``model`` must have the inputs torque and h_wheels, and each of ``inputs`` that is not the
        torque of a wheel. The momentum of a wheel acts on a craft that turns, so that the wheel's
        speed is then a state. For ``all_states`` see `linearize`.
        """
        turned = self._turned
        torque, h = (
            [model.inputs.index(name) for name in names] for names in (BODY_TORQUE, MOMENTUM)
        )
        speeds, by_speed = [], []
        for name, wheel in turned.items():
            column = np.vstack([model.B, model.D])[:, h] @ wheel.direction * wheel.inertia
            if column.any() or all_states:
                speeds.append(name)
                by_speed.append(column)
        n, m = len(model.A), len(speeds)
        B, D = np.zeros((n + m, len(inputs))), np.zeros((len(model.C), len(inputs)))
        for j, name in enumerate(inputs):
            if name not in turned:
                B[:n, j], D[:, j] = (of[:, model.inputs.index(name)] for of in (model.B, model.D))
                continue
            B[:n, j], D[:, j] = (
                of[:, torque] @ turned[name].direction for of in (model.B, model.D)
            )
            if name in speeds:
                B[n + speeds.index(name), j] = -1 / turned[name].inertia
        A, C = np.zeros((n + m, n + m)), np.zeros((len(model.C), n + m))
        A[:n, :n], C[:, :n] = model.A, model.C
        for k, column in enumerate(by_speed, n):
            A[:n, k], C[:, k] = column[:n], column[n:]
        states = (*model.states, *map(speed_name, speeds))
        return LinearModel(A, B, C, D, states, tuple(inputs), model.outputs)

    def gain(self, parameters: Parameters | None = None, *, more_delay: float = 0.0) -> LinearModel:
        """Return the loop gain L, opened at the commands; the closed loop satisfies u = -L u.

        The loop gain includes the delay, and is exact at the sampling instants.

        Parameters
        ----------
        parameters : mapping, optional
            Further parameters, which override the parameters of the loop.
        more_delay : float
            Delay in addition to the delay of the loop, s.

        Returns
        -------
        LinearModel
            The loop gain in discrete time.

        Raises
        ------
        FmuError
            If the controller is a function, or anything is wrong with the loop.

        Examples
        --------
        >>> import hubslosh
        >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1, parameters={"friction.model": "viscous"})
        >>> loop.gain().period
        0.1
        """
        K = self._must_be_linear()
        return self._gain(self.plant(parameters), K, more_delay)

    def _gain(self, plant: LinearModel, K: LinearModel, more_delay: float = 0.0) -> LinearModel:
        cycles, rest = split_delay(self.delay + more_delay, self.period)
        # the simulation, too, measures outputs just before the command changes
        P = plant._delayed(self.period, cycles + int(self.latency), rest)
        return replace(P._then(K, "controller."), outputs=plant.inputs, period=self.period)

    def simulate(
        self,
        stop: float,
        parameters: Parameters | None = None,
        *,
        reference: pd.DataFrame | None = None,
        inputs: pd.DataFrame | None = None,
        outputs: Sequence[str] | str | None = None,
        substeps: int = 1,
        tolerance: float | None = None,
    ) -> Run:
        """Simulate the loop from time 0 on.

        Parameters
        ----------
        stop : float
            Time at which the last whole cycle ends, s.
        parameters : mapping, optional
            Further parameters, which override the parameters of the loop.
        reference : DataFrame, optional
            Reference of a linear controller, as for `closed_loop`.
        inputs : DataFrame, optional
            Histories of other inputs, as for `closed_loop`; they replace constants among the
            parameters of the loop, such as the thrust of a craft.
        outputs : str or sequence of str, optional
            Variables to record, as for `simulate`.
        substeps : int
            Rows of the result per cycle.
        tolerance : float, optional
            Relative tolerance of the FMU's solver; by default the FMU chooses it.

        Returns
        -------
        Run
            The table of `closed_loop`.

        Raises
        ------
        FmuError
            With everything that is wrong with the arguments, or with the FMU's message.

        Examples
        --------
        >>> import hubslosh
        >>> loop = hubslosh.Loop([[4.0, 2.0]], 0.1, parameters={"friction.model": "none"})
        >>> run = loop.simulate(10, {"init.theta": (5, "deg")}, outputs=["theta"])
        >>> round(abs(float(run["theta"].iloc[-1])), 3)
        0.0
        """
        fmu = Fmu.open(self.model)
        problems = out_of_range(period=self.period, stop=stop, substeps=substeps)
        problems += [p for p in self.problems() if p not in problems]
        problems += not_numbers(tolerance=tolerance)
        histories = histories_of(fmu, inputs, False, problems)
        measured, command = self.names
        if isinstance(inputs, pd.DataFrame):
            problems += [
                f"inputs has {name}, which the controller commands: leave it out"
                for name in command
                if name in inputs
            ]
        turned = {} if problems else self._turned
        plain = [name for name in command if name not in turned]
        problems += [
            f"inputs has {name}, which the reaction wheels set: leave it out"
            for name in MOMENTUM
            if turned and name in histories
        ]
        further = parameters_of(parameters)
        every = without_replaced(parameters_of(self.parameters) | further, inputs, further)
        check_parameters(fmu, every, histories, problems)
        columns = outputs_of(fmu, outputs, every, problems)
        check_outputs(fmu, columns, problems)
        if not problems:
            problems += too_many_rows(0.0, stop, self.period / substeps)
        refuse(problems)

        constants = self._constants(every)
        every = {name: value for name, value in every.items() if name not in plain}
        cycles = max(round(stop / self.period), 1)
        grid = np.arange(cycles * substeps + 1) * (self.period / substeps)
        latency, rest = self.whole_delay
        points, switch, wanted = _points(grid, substeps, self.period, rest)
        parts = (len(points) - 1) // cycles
        controller, seen = self._controller(
            cycles, grid[:-1:substeps], reference, measured, constants
        )
        feedback = Feedback(
            controller, seen, command, cycles=cycles, parts=parts, switch=switch,
            latency=min(latency, cycles), wheels=rows_of(turned, command),
            momentum=self._momentum(fmu, every),
        )  # fmt: skip

        def computed() -> dict[str, NDArray[np.float64]]:
            """Return the histories of commands, wheel torques and wheel speeds after the run."""
            commands = feedback.commands
            commands[: feedback.latency * parts + switch] = list(constants.values())
            commands[-1] = commands[-2]
            return dict(zip(command, commands.T, strict=True)) | columns_of(turned, feedback)

        run = record_run(
            self.model, every, points, histories, columns, wanted=wanted, tolerance=tolerance,
            constants={name: constants[name] for name in plain}, feedback=feedback,
            units=self._units(), computed=computed,
        )  # fmt: skip
        for text in saturated(turned, feedback, points):
            warnings.warn(text, FmuWarning, stacklevel=caller())
        return run

    def _constants(self, parameters: Parameters) -> dict[str, float]:
        """Return, for each command by name, the constant that is added to it.

        The constant is the value of the commanded input in ``parameters``, such as the thrust of a
        craft, and 0 if ``parameters`` does not have this input.
        """
        fmu, turned = Fmu.open(self.model), self._turned
        return {
            name: 0.0 if name in turned else float(fmu.convert(name, parameters.get(name, 0.0)))
            for name in self.names[1]
        }

    def _momentum(self, fmu: Fmu, parameters: Parameters) -> tuple[float, float, float]:
        """Return the angular momentum of all wheels at the start of a run, body axes, N·m·s (3).

        It follows from the start speeds of the loop's wheels, unless ``parameters`` sets h_wheels,
        for example because there are further wheels.
        """
        if not self._turned:
            return (0.0, 0.0, 0.0)
        own = dict(zip(MOMENTUM, momentum(self.wheels).tolist(), strict=True))
        x, y, z = (float(fmu.convert(name, parameters.get(name, own[name]))) for name in MOMENTUM)
        return x, y, z

    def _controller(
        self,
        cycles: int,
        time: NDArray[np.float64],
        reference: pd.DataFrame | None,
        measured: list[str],
        constants: dict[str, float],
    ) -> tuple[Any, list[str]]:
        """Return the controller of a run, and the variables that it measures.

        The run has ``cycles`` cycles, which begin at the times in ``time``, s. ``reference`` has
        the wanted values of ``measured``. ``constants`` has, for each command in its order, the
        constant that is added to it.
        """
        model, command = self.linear(), list(constants)
        if model is None:
            if reference is not None:
                raise FmuError(
                    "reference= is only for linear controllers; a controller function computes its "
                    "own reference"
                )
            return _checked_law(self.controller, constants), measured
        table = _reference(reference, measured, command)
        attitude = all(name in table for name in QUATERNION)
        # the attitude error needs the scalar part, which a controller seldom measures
        seen = measured + [n for n in QUATERNION if attitude and n not in measured]
        if attitude and any(n not in Fmu.open(self.model).variables for n in QUATERNION):
            raise FmuError(f"{Path(self.model).name} has no quaternion q[1], …, q[4]")
        rows = {name: history.after(time)[0] for name, history in table.items()}
        A, B, C, D = (np.asarray(m, float) for m in model)
        B, D = (np.pad(m, ((0, 0), (0, len(seen) - len(measured)))) for m in (B, D))

        def columns(names: list[str]) -> NDArray[np.float64]:
            return np.column_stack([rows.get(name, np.zeros(cycles)) for name in names])

        wanted, quaternion = columns(seen), None
        if attitude:
            quaternion = [seen.index(name) for name in QUATERNION]
            wanted[:, quaternion] /= np.linalg.norm(wanted[:, quaternion], axis=1)[:, None]
        forward = columns(command) + list(constants.values())
        linear = Linear(A, B, C, D, wanted, forward, quaternion)
        return linear, seen


def closed_loop(
    controller: Any,
    period: float,
    stop: float,
    model: str | Path = "HubSlosh",
    parameters: Parameters | str | Path | None = None,
    *,
    measured: Sequence[str] | str = ("theta", "omega"),
    command: Sequence[str] | str = TORQUE,
    latency: int = 0,
    delay: float = 0.0,
    reference: pd.DataFrame | None = None,
    inputs: pd.DataFrame | None = None,
    outputs: Sequence[str] | str | None = None,
    substeps: int = 1,
    tolerance: float | None = None,
) -> Run:
    """Simulate an FMU under a sampled controller from time 0 on.

    In every cycle the controller receives the values of ``measured``. Its command acts ``delay``
    seconds and ``latency`` cycles later and is held for one cycle. Until the first command acts,
    commands are 0. A command is added to the value that ``parameters`` give its input. With a
    linear controller the whole loop is compiled code; a function is called once per cycle.

    Parameters
    ----------
    controller : callable, array_like, LinearModel or system of python-control
        Controller, as for `Loop`.
    period : float
        Period of the controller's cycle, s.
    stop : float
        Time at which the last whole cycle ends, s.
    model : str or Path
        Name or file of the FMU, as for `simulate`.
    parameters : mapping, str or Path, optional
        Parameters of the FMU, as for `simulate`.
    measured : str or sequence of str
        Measured variables, as for `Loop`.
    command : str or sequence of str
        Commanded inputs, as for `Loop`.
    latency : int
        Delay from measurement to command, whole cycles.
    delay : float
        Delay in addition to ``latency``, s.
    reference : DataFrame, optional
        For a linear controller: a table with the column ``time`` (s). A column with the name of a
        measured variable has its reference, which otherwise is 0; a column with the name of a
        command is added to this command as feedforward. Values between the rows are interpolated
        linearly. If the table has the four columns q[1], …, q[4], the error of q[2], q[3], q[4] is
        the vector part of q⁻¹ ⊗ q_reference: about half the remaining rotation about each body
        axis.
    inputs : DataFrame, optional
        Histories of other inputs, as for `simulate`, interpolated linearly between the rows.
    outputs : str or sequence of str, optional
        Variables to record, as for `simulate`.
    substeps : int
        Rows of the result per cycle.
    tolerance : float, optional
        Relative tolerance of the FMU's solver; by default the FMU chooses it.

    Returns
    -------
    Run
        A table with the columns ``time``, the commanded inputs (values from this time on), the
        inputs and ``outputs``. Units are in ``.attrs["units"]``. ``.out_of_range`` lists the tanks
        that left the range of their model, with the reason, the first time, and the share of the
        time.

    Raises
    ------
    FmuError
        With everything that is wrong with the arguments, or with the FMU's message.

    Examples
    --------
    >>> import hubslosh
    >>> start = {"friction.model": "none", "init.theta": (5, "deg")}
    >>> run = hubslosh.closed_loop([[4.0, 2.0]], 0.1, 10, parameters=start, outputs=["theta"])
    >>> round(abs(float(run["theta"].iloc[-1])), 3)
    0.0
    """
    loop = Loop(controller, period, model, None, measured, command, latency, delay)
    return loop.simulate(
        stop, parameters, reference=reference, inputs=inputs, outputs=outputs, substeps=substeps,
        tolerance=tolerance,
    )  # fmt: skip


def _points(
    grid: NDArray[np.float64], substeps: int, period: float, rest: float
) -> tuple[NDArray[np.float64], int, NDArray[np.bool_] | None]:
    """Return the times at which a run exchanges values with the FMU, s, and two more results.

    Each cycle of ``period`` (s) has ``substeps`` rows, whose times are in ``grid``. A command
    begins to act ``rest`` seconds after the start of a cycle, 0 ≤ rest < period. The second result
    is the index, within a cycle, of the time at which it begins to act; the third is a mask of the
    times that are rows of the result, or None if all are.
    """
    place = rest / period * substeps
    nearest = round(place)
    if abs(place - nearest) < 1e-9 * substeps:
        return grid, nearest % substeps, None
    switch = int(place) + 1
    cycles = grid[:-1].reshape(-1, substeps)
    points = np.insert(cycles, switch, cycles[:, 0] + rest, axis=1)
    wanted = np.ones(points.size + 1, bool)
    wanted[switch :: substeps + 1] = False
    return np.append(points.ravel(), grid[-1]), switch, wanted


def _checked_law(
    law: Law, constants: dict[str, float]
) -> Callable[[int, float, list[float]], list[float]]:
    """Return a function that calls the controller ``law`` and checks the commands it returns.

    ``constants`` has, by the name of each command, the constant that is added to this command.
    """
    command, added = list(constants), np.array(list(constants.values()))
    one = f"a finite number for {command[0]}"
    several = f"{len(command)} finite numbers ({', '.join(command)})"
    expected = one if len(command) == 1 else several

    def call(cycle: int, time: float, measured: list[float]) -> list[float]:
        returned = law(time, np.array(measured))
        values = np.atleast_1d(array(returned))
        if values.shape != (len(command),) or not np.isfinite(values).all():
            raise FmuError(
                f"the controller returned {returned!r} at t = {time:g} s; it must return {expected}"
            )
        return (values + added).tolist()

    return call


def _reference(
    reference: pd.DataFrame | None, measured: list[str], command: list[str]
) -> dict[str, History]:
    """Return each column of the table ``reference`` as a time history, by the column's name.

    Allowed columns are time, the variables ``measured`` and ``command``, and q[1] to q[4].
    """
    if reference is None:
        return {}
    allowed = [*measured, *command, *QUATERNION]
    if not isinstance(reference, pd.DataFrame) or "time" not in reference.columns:
        raise FmuError(
            "reference must be a pandas.DataFrame with the column time and any of "
            f"{', '.join([*measured, *command])}"
        )
    problems = []
    time = reference["time"].to_numpy(float)
    if len(time) < 2 or not np.isfinite(time).all() or (np.diff(time) < 0).any():
        problems.append("time in reference must be two or more finite numbers in ascending order")
    histories = {}
    for name in reference.columns:
        if name == "time":
            continue
        if name not in allowed:
            hint = did_you_mean(str(name), allowed)
            problems.append(f"reference has {name}, which is neither measured nor a command{hint}")
            continue
        if (values := column_of(reference, name, "reference", problems)) is not None:
            histories[str(name)] = values
    some = [name for name in QUATERNION if name in histories]
    if 0 < len(some) < 4 and any(name not in measured for name in some):
        problems.append(f"reference has {', '.join(some)} of q[1], …, q[4]: all four are needed")
    refuse(problems)
    return {name: History(time, values, None, False) for name, values in histories.items()}


def _linear(
    controller: Any, period: float, measured: list[str], command: list[str]
) -> LinearModel | None:
    """Return ``controller`` as a linear model sampled with ``period`` (s); None for a function.

    ``measured`` and ``command`` are the names of the inputs and outputs that it must have.
    """
    if isinstance(controller, LinearModel):
        model = controller
    elif hasattr(controller, "dt") and hasattr(controller, "ninputs"):
        model = _from_control(controller)
    elif callable(controller):
        return None
    else:
        gains = array(controller)
        if not gains.size or gains.ndim > 2:
            raise FmuError(
                "the controller must be a function of time and measurements, a matrix of gains, a "
                f"LinearModel or a system of python-control, not {type(controller).__name__}"
            )
        gains, none = np.atleast_2d(gains), np.zeros((0, 0))
        B, C = np.zeros((0, gains.shape[1])), np.zeros((len(gains), 0))
        model = LinearModel(none, B, C, gains, (), (), (), period)
    found = model.D.shape
    if found != (len(command), len(measured)):
        raise FmuError(
            f"the controller has {found[1]} inputs and {found[0]} outputs; it needs "
            f"{len(measured)} ({', '.join(measured)}) and {len(command)} ({', '.join(command)})"
        )
    if not all(np.isfinite(floats(m)).all() for m in model):
        raise FmuError("the controller has numbers that are not finite")
    if model.period is None:
        return _tustin(model, period)
    if abs(model.period - period) > 1e-9 * period:
        raise FmuError(
            f"the controller is sampled with {model.period:g} s, the loop with {period:g} s"
        )
    return model


def _tustin(model: LinearModel, period: float) -> LinearModel:
    """Return a continuous controller discretised by Tustin's rule, s = 2/T (z − 1)/(z + 1)."""
    if len(model.A) and np.abs(np.linalg.eigvals(model.A) * period - 2).min() < 1e-9:
        raise FmuError(
            f"the controller has a pole at 2/period = {2 / period:g} rad/s, which Tustin's rule "
            "cannot discretise; give it in discrete time"
        )
    A, B, C, D = model
    if len(A):
        given = tuple((matrix.shape, matrix.tobytes()) for matrix in model)
        A, B, C, D = (matrix.copy() for matrix in _bilinear(given, period))
    return LinearModel(A, B, C, D, model.states, model.inputs, model.outputs, period)


@lru_cache(maxsize=16)
def _bilinear(
    given: tuple[tuple[tuple[int, ...], bytes], ...], period: float
) -> tuple[NDArray[np.float64], ...]:
    """Return A, B, C, D of a system discretised by SciPy with the period ``period``, s.

    ``given`` has the shape and the bytes of each matrix, because the cache of results needs
    arguments that can be hashed. A call can take as long as all margins of a loop, because SciPy's
    threads wait for each other.
    """
    from scipy.signal import cont2discrete

    matrices = tuple(np.frombuffer(numbers).reshape(shape) for shape, numbers in given)
    return tuple(cont2discrete(matrices, period, "bilinear")[:4])


def _from_control(system: Any) -> LinearModel:
    import control

    try:
        state_space = control.ss(system)
    except Exception as error:  # python-control raises several types
        raise FmuError(
            "the controller has no state space (an improper transfer function, such as s, has "
            f"none): {error}"
        ) from None
    A, B, C, D = (np.asarray(getattr(state_space, m), float) for m in "ABCD")
    period = system.dt
    if len(A) and (period is None or period is True):
        raise FmuError(
            "the controller's time base is not specified: dt=0 is continuous time, dt=0.1 a period "
            "of 0.1 s"
        )
    if not len(A):
        period = 0
    states = tuple(str(name) for name in state_space.state_labels)
    return LinearModel(
        A, B, C, D, states, tuple(state_space.input_labels), tuple(state_space.output_labels),
        float(period) or None,
    )  # fmt: skip
