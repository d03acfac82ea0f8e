"""A sampled controller in closed loop with an FMU."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .fmu import Fmu, FmuError, Quantity
from .plant import TORQUE, Plant
from .simulation import check_outputs, check_parameters, histories_of, too_many_rows

Law = Callable[[float, NDArray[np.float64]], float]
"""What a controller computes in a cycle: the command from time (s) and measurements."""


def closed_loop(
    law: Law,
    period: float,
    stop: float,
    model: str | Path = "HubSlosh",
    parameters: Mapping[str, Quantity] | None = None,
    *,
    measured: Sequence[str] = ("theta", "omega"),
    command: str = TORQUE,
    latency: int = 0,
    inputs: pd.DataFrame | None = None,
    outputs: Sequence[str] | None = None,
    substeps: int = 1,
    tolerance: float | None = None,
) -> pd.DataFrame:
    """Simulate an FMU under a sampled controller from time 0 to ``stop``, s.

    In every cycle of ``period`` seconds ``law`` is called with the time and the values of
    ``measured``. The command that it returns is set ``latency`` cycles later and held for one
    cycle; until the first arrives, the input ``command`` is 0. A continuous design sees a delay of
    ``latency + 1/2`` cycles, the half being the hold's.

    inputs: histories of other inputs, as for `simulate`; straight lines between the rows, followed
    from substep to substep. substeps: rows of the result per cycle.
    model, parameters, outputs, tolerance: as for `simulate`.

    Returns a table with the columns ``time``, ``command`` (as it is from that time on), the inputs
    and ``outputs``; its last row ends the last whole cycle. Units are in ``.attrs["units"]``.

    Raises FmuError with everything that is wrong with the arguments, or with what the FMU says.
    """
    fmu = Fmu.open(model)
    problems = [
        f"{name} must be a positive number of seconds, not {value}"
        for name, value in (("period", period), ("stop", stop))
        if not (np.isfinite(value) and value > 0)
    ]
    problems += [
        f"{name} must be a whole number from {least} on, not {value}"
        for name, value, least in (("latency", latency, 0), ("substeps", substeps, 1))
        if value < least or value != int(value)
    ]
    histories = histories_of(fmu, inputs, False, problems)
    if command not in fmu.names("input"):
        allowed = ", ".join(fmu.names("input"))
        problems.append(f"the command {command} is no input of {fmu.name} (inputs: {allowed})")
    if inputs is not None and command in inputs:
        problems.append(f"{command} is the law's command; inputs may not have it")
    check_parameters(fmu, parameters or {}, {**histories, command: None}, problems)
    columns = fmu.names("output") if outputs is None else list(outputs)
    check_outputs(fmu, columns, problems)
    check_outputs(fmu, list(measured), problems)
    if not problems:
        problems += too_many_rows(0.0, stop, period / substeps)
    if problems:
        raise FmuError("; ".join(problems))

    steps = max(round(stop / period), 1) * substeps
    time = np.arange(steps + 1) * (period / substeps)
    given = {name: history.after(time) for name, history in histories.items()}
    now = 0.0
    commands, recorded = np.empty(steps + 1), np.empty((steps + 1, len(columns)))
    on_the_way = deque([0.0] * latency)
    start = {name: float(values[0]) for name, (values, _) in given.items()}
    with Plant(model, parameters, tolerance=tolerance, inputs={command: 0.0, **start}) as plant:
        for k in range(steps):
            recorded[k] = plant.get(columns)
            if k % substeps == 0:
                on_the_way.append(float(law(float(time[k]), np.array(plant.get(measured)))))
                now = on_the_way.popleft()
                plant.set(command, now)
            commands[k] = now
            for name, (values, slopes) in given.items():
                plant.set(name, values[k])
                if slopes[k]:
                    plant.set_slope(name, slopes[k])
            plant.step(float(time[k + 1]))
        recorded[-1], commands[-1] = plant.get(columns), now
    table = pd.DataFrame(
        {"time": time, command: commands}
        | {name: values for name, (values, _) in given.items()}
        | dict(zip(columns, recorded.T, strict=True)),
        copy=False,
    )
    units = {name: fmu.unit(name) for name in table.columns if name != "time"}
    table.attrs["units"] = {"time": "s"} | units
    return table
