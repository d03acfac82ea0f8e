"""Simulation of an FMU in one call: from parameters and input histories to a table."""

from collections.abc import Callable, Container, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from . import native
from .arguments import column_of, names_of, not_numbers, refuse
from .feedback import Feedback
from .fmu import (
    INTEGERS,
    Fmu,
    FmuError,
    Parameters,
    Quantity,
    did_you_mean,
    read_parameters,
)
from .plant import TORQUE, Plant
from .run import Noted, Run
from .wheels import Wheel, columns_of, follow, torques_of, units_of

Real = NDArray[np.float64]

# Columns of a torque history (``hubslosh torque``) that contain the slope of an input, each with
# the name of this input.
SLOPES = {"tau_slope": TORQUE}

DEFAULT_STEP = 0.02  # Step if neither the rows of the inputs nor the FMU specify one, s

MOST_ROWS = 20_000_000  # Largest size of a table; the same as in ``harness/files/src/budget.rs``


class History:
    """An input over time, interpolated linearly between rows or held from row to row.

    Two rows with the same time are a jump.
    """

    def __init__(self, time: Real, values: Real, slopes: Real | None, hold: bool) -> None:
        self.time = time
        self.native = native.History(time, values, slopes, hold)

    def after(self, t: Real) -> tuple[Real, Real]:
        """Return the input and its derivative just after each of the ascending times ``t``."""
        values, slopes = self.native.after(np.ascontiguousarray(t, float))
        return np.frombuffer(values).copy(), np.frombuffer(slopes).copy()


def simulate(
    model: str | Path = "HubSlosh",
    parameters: Parameters | str | Path | None = None,
    inputs: pd.DataFrame | None = None,
    stop: float | None = None,
    step: float | None = None,
    outputs: Sequence[str] | str | None = None,
    *,
    start: float | None = None,
    tolerance: float | None = None,
    hold: bool = False,
) -> Run:
    """Simulate an FMU by its own solver (Co-Simulation) and return its outputs over time.

    In each row of the result, the inputs are the values that act from the time of the row on, and
    the outputs are the values just before these inputs act. Therefore, if an output depends
    directly on an input, a jump of the input appears in the output one row later.
    ``.attrs["rows"]`` and ``.attrs["inputs"]`` also state this.

    Parameters
    ----------
    model : str or Path
        Name of an FMU of this package (see `fmu_path`), such as "HubSlosh" or, of FMI 3.0,
        "HubSlosh-fmi3"; or the file of any FMU 2.0 or 3.0 for Co-Simulation. The FMI 2.0 and 3.0
        versions of an FMU give bit-identical results if inputs are held; with interpolated inputs
        the last digits may differ.
    parameters : mapping, str or Path, optional
        Values of parameters and inputs by name, in SI units or with one of the variable's own
        units, ``{"tank.h": (50, "mm")}``; enumerations by item or number. Or a file of
        parameters, see `read_parameters`.
    inputs : DataFrame, optional
        A table with the column ``time`` (s, in ascending order; two rows with the same time are a
        jump) and one column for each input, interpolated linearly between the rows. Values are in
        SI units, or in the units of ``inputs.attrs["units"]``, such as ``{"wheel_speed": "rpm"}``,
        if the FMU declares the unit for the input. ``tau_slope``, which ``hubslosh torque`` writes,
        is the slope of ``tau_cmd``.
    stop : float, optional
        Time of the last row, s; by default the last time of the inputs or, without inputs, the
        default of the FMU.
    step : float, optional
        Time between the rows of the result, s. By default the result has the rows of the inputs or,
        without inputs, the default step of the FMU. The FMU always steps to every row of the
        inputs.
    outputs : str or sequence of str, optional
        Names of variables or vectors (``"omega"``) to record. By default all outputs and, for
        Spacecraft and SloshTank, the variables from which `view` draws the run: the slosh angles of
        the tanks in use, and the liquid of tanks that drain.
    start : float, optional
        Time of the first row, s; by default the first time of the inputs or, without inputs, the
        default of the FMU.
    tolerance : float, optional
        Relative tolerance of the FMU's solver; by default the FMU chooses it.
    hold : bool
        True: each input keeps its value until the next row. False: inputs are interpolated linearly
        between the rows; if the FMU cannot interpolate its inputs, this is possible only for
        inputs that are constant.

    Returns
    -------
    Run
        A pandas table with the columns ``time``, the inputs and ``outputs``; enumerations are
        numbers. Units are in ``.attrs["units"]``, and the simulated FMU and its parameters in
        ``.attrs["model"]`` and ``.attrs["parameters"]``. ``.out_of_range`` lists the tanks that
        left the range of their model, with the reason, the first time, and the share of the time.
        ``.view()`` shows the run in 3-D.

    Raises
    ------
    FmuError
        With everything that is wrong with the arguments, or with the FMU's message.

    Examples
    --------
    A torque turns the bench for a second. Then the liquid swings, and the hub with it:

    >>> import pandas as pd
    >>> import hubslosh
    >>> torque = pd.DataFrame({"time": [0, 1, 1, 3], "tau_cmd": [0.3, 0.3, 0, 0]})
    >>> run = hubslosh.simulate(
    ...     parameters={"slosh.model": "spherical", "tank.h": (50, "mm")},
    ...     inputs=torque, step=1.0, outputs=["omega", "slosh_angle"])
    >>> run[["time", "tau_cmd", "omega", "slosh_angle"]].round(3)
       time  tau_cmd  omega  slosh_angle
    0   0.0      0.3  0.000        0.000
    1   1.0      0.0  0.755       -0.015
    2   2.0      0.0  0.666       -0.010
    3   3.0      0.0  0.596        0.013
    """
    return run_of(model, parameters, inputs, (start, stop, step), outputs, tolerance, hold)


def run_of(
    model: str | Path,
    parameters: Parameters | str | Path | None,
    inputs: pd.DataFrame | None,
    times: tuple[float | None, float | None, float | None],
    outputs: Sequence[str] | str | None,
    tolerance: float | None,
    hold: bool,
    wheels: Mapping[str, Wheel] = MappingProxyType({}),
    momentum: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Run:
    """Simulate as `simulate` does; columns of ``inputs`` can also command reaction wheels.

    ``times`` are start, stop and step, s. ``momentum`` is the angular momentum of all wheels at the
    start, N·m·s.
    """
    fmu, (start, stop, step) = Fmu.open(model), times
    parameters = parameters_of(parameters)
    problems: list[str] = []
    turned: dict[str, Wheel] = {}
    if wheels and isinstance(inputs, pd.DataFrame):
        turned = torques_of(inputs, wheels, problems)
    histories = histories_of(fmu, inputs, hold, problems, turned)
    torques = {name: histories.pop(name) for name in turned if name in histories}
    rows = next(iter((histories | torques).values())).time if histories or torques else None
    if rows is None and inputs is not None and not problems and "time" in inputs:
        rows = inputs["time"].to_numpy(float)
    check_parameters(fmu, parameters, histories, problems)
    columns = outputs_of(fmu, outputs, parameters, problems)
    check_outputs(fmu, columns, problems)
    if wrong := not_numbers(start=start, stop=stop, step=step, tolerance=tolerance):
        raise FmuError("; ".join(problems + wrong))
    defaults = zip(fmu.native.experiment, (0.0, 1.0, DEFAULT_STEP), strict=True)
    suggested = [default if own is None else own for own, default in defaults]
    if start is None:
        start = suggested[0] if rows is None else float(rows[0])
    if stop is None:
        stop = start + suggested[1] if rows is None else float(rows[-1])
    if step is None and rows is None:
        step = suggested[2]
    if not (np.isfinite([start, stop]).all() and stop > start):
        problems.append(f"stop must be later than start, {start} s, not {stop} s")
    if step is not None and not (np.isfinite(step) and step > 0):
        problems.append(f"step must be a positive number of seconds, not {step}")
    if tolerance is not None and not (np.isfinite(tolerance) and tolerance > 0):
        problems.append(f"tolerance must be a positive number, not {tolerance}")
    if not problems and step is not None:
        problems += too_many_rows(start, stop, step)
    refuse(problems)

    inputs_given = [(name, history.native) for name, history in histories.items()]
    native.check_interpolation(fmu.native, inputs_given, "hold=True")
    times, rows_wanted = native.communication_points(start, stop, step, rows)
    points = np.frombuffer(times).copy()
    wanted = None if rows_wanted is None else np.frombuffer(rows_wanted, bool)
    feedback = None
    if turned:
        commands = np.column_stack([of.after(points)[0] for of in torques.values()])
        feedback = follow(commands[:-1], turned, momentum)
    table = record_run(
        model, parameters, points, histories, columns, wanted=wanted, start=start, stop=stop,
        tolerance=tolerance, feedback=feedback, units=units_of(turned),
        computed=lambda: {} if feedback is None else columns_of(turned, feedback),
    )  # fmt: skip
    table.attrs["rows"], table.attrs["inputs"] = native.pairing(hold)
    return table


def record_run(
    model: str | Path,
    parameters: Parameters,
    points: Real,
    histories: Mapping[str, History],
    columns: Sequence[str],
    *,
    wanted: NDArray[np.bool_] | None,
    start: float = 0.0,
    stop: float | None = None,
    tolerance: float | None = None,
    constants: Mapping[str, float] = MappingProxyType({}),
    feedback: Feedback | None = None,
    units: Mapping[str, str] = MappingProxyType({}),
    computed: Callable[[], dict[str, Real]] = dict,
) -> Run:
    """Simulate an FMU through the times ``points`` with inputs ``histories``, and return its table.

    * ``wanted``: mask of the rows to return; None returns all.
    * ``constants``: values at the start of the inputs that ``feedback`` sets later.
    * ``computed``: function that is called after the run and returns further columns by name, such
      as the commands of the controller; ``units`` has the units of columns that are not variables
      of the FMU.

    The variables that state why a tank is out of range are always recorded, but are columns of the
    table only if ``columns`` names them.
    """
    fmu = Fmu.open(model)
    limits = native.limit_columns(fmu.native)
    values = {name: history.after(points) for name, history in histories.items()}
    given = {name: value for name, (value, _) in values.items()}
    # Set slopes only if an input has one. This saves calls, and also allows FMUs that cannot
    # interpolate inputs.
    sloped = any(slope.any() for _, slope in values.values())
    slopes = {name: slope for name, (_, slope) in values.items()} if sloped else None
    known = given.keys() | constants.keys()
    asked = [name for name in dict.fromkeys([*columns, *limits]) if name not in known]
    inputs = dict(constants) | {name: value[0] for name, value in given.items()}
    with Plant(
        fmu, parameters, tolerance=tolerance, start=start, stop=stop, inputs=inputs
    ) as plant:
        found = plant.run(points, given, slopes, asked, feedback, wanted)
    every = {"time": points} | computed() | given | found
    if wanted is not None:
        every = {name: of[wanted] for name, of in every.items()}
    read = {
        name: np.ascontiguousarray(every[name], float)
        for name in ("time", *limits)
        if name in every
    }
    shown = {name: of for name, of in every.items() if name in columns or name not in limits}
    table = Run(shown, copy=False)
    units = {"time": "s", **units}
    table.attrs["units"] = Noted(
        (name, units[name] if name in units else fmu.unit(name)) for name in table.columns
    )
    table.attrs |= {"model": str(model), "parameters": Noted(parameters)}
    table.attrs["out_of_range"] = native.out_of_range(fmu.native, read)
    return table


def parameters_of(
    parameters: Parameters | str | Path | None,
) -> dict[str, Quantity]:
    """Return a dictionary of parameters; a string or a path is read as a parameter file.

    See `hubslosh.read_parameters` for the formats of the file.
    """
    if isinstance(parameters, str | Path):
        return dict(read_parameters(Path(parameters)))
    if parameters is None:
        return {}
    if not isinstance(parameters, Mapping):
        raise FmuError(
            'parameters must be values by name, such as {"tank.h": 0.1}, or the file of a '
            f"parameter set, not {parameters!r}"
        )
    return dict(parameters)


def without_replaced(
    parameters: Parameters, inputs: pd.DataFrame | None, given: Container[str]
) -> dict[str, Quantity]:
    """Return parameters without the constants that a history in ``inputs`` replaces.

    Parameters in ``given``, which the user gives together with ``inputs``, are kept, so that
    `check_parameters` refuses values that are given twice.
    """
    columns = getattr(inputs, "columns", ())
    return {n: value for n, value in parameters.items() if n not in columns or n in given}


def outputs_of(
    fmu: Fmu,
    outputs: Sequence[str] | str | None,
    parameters: Parameters,
    problems: list[str],
) -> list[str]:
    """Return the names of the variables to record.

    If ``outputs`` is None, these are all outputs and the variables from which `view` draws the run.
    """
    if outputs is not None:
        return fmu.components(names_of(outputs, "outputs", problems))

    def number(name: str) -> int:
        if name not in fmu.variables:
            return 0
        try:
            return int(fmu.convert(name, parameters.get(name, fmu.variables[name].start)))
        except (FmuError, TypeError):
            return 0  # `check_parameters` reports what is wrong with the parameter

    tanks = ["tank", *(f"tank[{i}]" for i in range(1, max(number("tanks"), 1) + 1))]
    drawn = [
        f"{tank}.angle_{axis}[{n}]"
        for tank in tanks
        for n in range(1, max(number(f"{tank}.modes"), 1) + 1)
        for axis in "xy"
    ]
    drawn += [f"{tank}.liquid" for tank in tanks if number(f"{tank}.fill.points") > 1]
    names = fmu.names("output")
    return names + [name for name in drawn if name in fmu.variables and name not in names]


def too_many_rows(start: float, stop: float, step: float) -> list[str]:
    """Return a list with an error message if there are more than `MOST_ROWS` rows, else []."""
    rows = (stop - start) / step
    if rows <= MOST_ROWS:
        return []
    span = f"{stop - start:g} s in steps of {step:g} s"
    return [f"{span} are {rows:.3e} rows (allowed: at most {MOST_ROWS})"]


def histories_of(
    fmu: Fmu,
    inputs: pd.DataFrame | None,
    hold: bool,
    problems: list[str],
    torques: Container[str] = (),
) -> dict[str, History]:
    """Return the history of each column of ``inputs`` by its name.

    ``torques`` are the names of torques of reaction wheels, which are allowed, too; they are held
    from row to row. Everything that is wrong with ``inputs`` is appended to ``problems``.
    """
    if inputs is None:
        return {}
    if not isinstance(inputs, pd.DataFrame):
        problems.append(
            "inputs must be a pandas.DataFrame with the column time and one for each input, "
            f"not {type(inputs).__name__}"
        )
        return {}
    known = fmu.names("input")
    slopes = {column: name for column, name in SLOPES.items() if name in known}
    wrong = [
        str(c) for c in inputs.columns if c not in ("time", *known, *slopes) and c not in torques
    ]
    if wrong:
        hints = ", ".join(f"{name}{_hint(name, known)}" for name in wrong)
        problems.append(
            f"inputs has columns that are no inputs of {fmu.name}: {hints}; "
            f"inputs are {', '.join(known) or 'none'}"
        )
    columns: dict[str, Real] = {}
    for name in inputs.columns:
        if name in wrong:
            continue
        if (values := column_of(inputs, name, "inputs", problems)) is not None:
            columns[name] = values
    if "time" not in inputs.columns:
        problems.append("inputs has no column named time")
    if len(inputs) < 2:
        problems.append(f"inputs needs two rows or more, not {len(inputs)}")
    for name, unit in dict(inputs.attrs.get("units", {})).items():
        if name in columns and name not in slopes and name not in torques:
            try:
                base = (1.0, 0.0) if (name, unit) == ("time", "s") else fmu.scale(name, unit)
                columns[name] = (columns[name] - base[1]) / base[0]
                for column in (c for c, of in slopes.items() if of == name and c in columns):
                    columns[column] = columns[column] / base[0]
            except (FmuError, ValueError) as error:
                problems.append(f"the unit of {name} in inputs: {error}")
    time = columns.pop("time", None)
    if time is not None:
        back = np.flatnonzero(np.diff(time) < 0)
        if len(back):
            problems.append(f"time in inputs goes back after row {back[0]}, {time[back[0]]} s")
    for column, name in slopes.items():
        if column in columns and name not in columns:
            problems.append(f"inputs has {column} but not {name}")
    for name, values in columns.items():
        kind = "Real" if name in slopes or name in torques else fmu.kind(name)
        if kind == "String":
            problems.append(f"the input {name} is a string; only numbers can be given over time")
        if kind in ("Integer", "Enumeration"):
            whole = (values == np.round(values)) & (abs(values) <= INTEGERS[-1])
            if not whole.all():
                row = np.flatnonzero(~whole)[0]
                problems.append(
                    f"the column {name} of inputs is {values[row]} in row {row} (allowed: whole "
                    f"numbers up to ±{INTEGERS[-1]})"
                )
    if problems or time is None:
        return {}
    slope_of = {name: columns.pop(column) for column, name in slopes.items() if column in columns}
    return {
        name: History(
            time, values, slope_of.get(name), hold or name in torques or fmu.kind(name) != "Real"
        )
        for name, values in columns.items()
    }


def _hint(name: str, known: Sequence[str]) -> str:
    hint = did_you_mean(name, known).removeprefix("; ")
    return f" ({hint})" if hint else ""


def check_parameters(
    fmu: Fmu,
    parameters: Parameters,
    histories: Mapping[str, History],
    problems: list[str],
) -> None:
    """Append to ``problems`` everything that is wrong with the parameters.

    For example, ``parameters`` must not set an input that has a history in ``histories``.
    """
    for name, value in parameters.items():
        try:
            variable = fmu.variable(name)
            fmu.convert(name, value)
        except FmuError as error:
            problems.append(str(error))
            continue
        if variable.causality == "structuralParameter":
            problems.append(
                f"{name} changes the size of arrays, which this package does not support; use the "
                f"FMU without -arrays in its name, or hubslosh run --set {name}={value}"
            )
        elif variable.causality not in ("parameter", "input") or variable.variability == "constant":
            problems.append(
                f"{name} is computed by the FMU ({variable.causality}); it cannot be set"
            )
        elif name in histories:
            problems.append(f"{name} is given twice, in parameters and in inputs")


def check_outputs(
    fmu: Fmu,
    names: Sequence[str],
    problems: list[str],
    *,
    real: bool = False,
    inputs: bool = False,
) -> None:
    """Append to ``problems`` everything that is wrong with the names of numeric variables.

    If ``real`` is true, the variables must be of type Real; if ``inputs`` is true, they must be
    inputs.
    """
    allowed = fmu.names("input")
    for name in dict.fromkeys(names):
        try:
            kind = fmu.kind(name)
        except FmuError as error:
            problems.append(str(error))
            continue
        if list(names).count(name) > 1:
            problems.append(f"{name} is named twice")
        if kind == "String":
            problems.append(f"{name} is a string; only numbers can be recorded")
        elif real and kind != "Real":
            problems.append(f"{name} is of type {kind}, not Real")
        elif inputs and name not in allowed:
            problems.append(
                f"{name} is not an input of {fmu.name} (inputs: {', '.join(allowed) or 'none'})"
            )
