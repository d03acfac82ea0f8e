"""Arguments of a wrong type raise errors of this package, and no TypeError of another package."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import hubslosh
from hubslosh import FmuError, Loop, attitude, plot

GAINS = [[1.0, 1.0]]
ZERO_TO_ONE = {"a": (0, 1)}
VISCOUS = {"friction.model": "viscous"}
TABLE = pd.DataFrame({"run": [0, 1], "x": [1.0, 2.0]})
RESPONSE = pd.DataFrame({"frequency": np.arange(1, 50.0), "real": 1.0, "imag": np.arange(49.0)})
SWEEP = pd.DataFrame({"time": np.arange(100) * 0.02, "tau_cmd": np.sin(np.arange(100))})

# Calls with one mistake each. The argument is the result of the fixture `given`.
WRONG = [
    lambda g: hubslosh.simulate(g.fmu, parameters=5),
    lambda g: hubslosh.simulate(g.fmu, parameters=[1]),
    lambda g: hubslosh.simulate(g.fmu, inputs=5),
    lambda g: hubslosh.simulate(g.fmu, inputs={"time": [0, 1]}),
    lambda g: hubslosh.simulate(g.fmu, stop="10"),
    lambda g: hubslosh.simulate(g.fmu, step=[1]),
    lambda g: hubslosh.simulate(g.fmu, outputs=5),
    lambda g: hubslosh.simulate(g.fmu, outputs=[5]),
    lambda g: hubslosh.simulate(5),
    lambda g: hubslosh.simulate(g.fmu, tolerance="x"),
    lambda g: hubslosh.simulate(g.fmu, parameters={5: 1}),
    lambda g: hubslosh.simulate(g.fmu, parameters={"tank.h": [1, 2]}),
    lambda g: hubslosh.simulate(g.fmu, parameters={"tank.h": None}),
    lambda g: hubslosh.simulate(g.fmu, parameters={"tank.h": (1, 2, 3)}),
    lambda g: hubslosh.simulate(g.fmu, parameters={"tank.h": ("x", "mm")}),
    lambda g: hubslosh.linearize(g.fmu, inputs=5),
    lambda g: hubslosh.linearize(g.fmu, outputs=[1]),
    lambda g: hubslosh.linearize(5),
    lambda g: hubslosh.linearize(g.fmu, parameters=5),
    lambda g: hubslosh.frequency_response(5),
    lambda g: hubslosh.frequency_response(g.run, input=5),
    lambda g: hubslosh.frequency_response(g.run, band=5),
    lambda g: hubslosh.frequency_response(g.run, resolution="x"),
    lambda g: hubslosh.frequency_response(g.run, band=("a", "b")),
    lambda g: hubslosh.fit(5),
    lambda g: hubslosh.fit(RESPONSE, poles="3"),
    lambda g: hubslosh.fit(RESPONSE, poles=3, zeros=1.5),
    lambda g: hubslosh.fit(RESPONSE, [3]),
    lambda g: plot.time_histories(5),
    lambda g: plot.time_histories(g.run, 5),
    lambda g: plot.path(5),
    lambda g: plot.monte_carlo(5),
    lambda g: plot.closed_loop(5),
    lambda g: plot.margins(5),
    lambda g: plot.bode([1]),
    lambda g: g.model.sampled("x"),
    lambda g: g.model.sampled(0.1, "x"),
    lambda g: g.model.sampled(0.1, delay="x"),
    lambda g: g.model.response("x"),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, "x", g.fmu),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, 1, g.fmu, substeps="x"),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, 1, g.fmu, latency="x"),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, 1, g.fmu, delay="x"),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, 1, g.fmu, measured=5),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, 1, g.fmu, command=5),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, 1, g.fmu, command=[]),
    lambda g: hubslosh.closed_loop(5, 0.1, 1, g.fmu),
    lambda g: hubslosh.closed_loop(GAINS, None, 1, g.fmu),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, 1, 5),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, 1, g.fmu, parameters=5),
    lambda g: hubslosh.closed_loop([[1, "x"]], 0.1, 1, g.fmu),
    lambda g: hubslosh.closed_loop(None, 0.1, 1, g.fmu),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, 1, g.fmu, reference=5),
    lambda g: hubslosh.closed_loop(GAINS, 0.1, 1, g.fmu, tolerance="x"),
    lambda g: Loop(GAINS, 0.1, g.fmu).simulate(1, 5),
    lambda g: hubslosh.closed_loop([[1, 1], [1]], 0.1, 1, g.fmu),
    lambda g: hubslosh.closed_loop(
        GAINS,
        0.1,
        1,
        g.fmu,
        inputs=5,
    ),
    lambda g: hubslosh.margins(5),
    lambda g: hubslosh.margins(Loop(GAINS, "x", g.fmu)),
    lambda g: hubslosh.margins(Loop(GAINS, 0.1, g.fmu), 5),
    lambda g: hubslosh.margins(g.model, {"a": 1}),
    lambda g: hubslosh.monte_carlo(5, 1),
    lambda g: hubslosh.monte_carlo(ZERO_TO_ONE, "x"),
    lambda g: hubslosh.monte_carlo({"a": 5}, 1),
    lambda g: hubslosh.monte_carlo({"a": "xy"}, 1),
    lambda g: hubslosh.monte_carlo(ZERO_TO_ONE, 1, 1, lambda v: None),
    lambda g: hubslosh.monte_carlo(ZERO_TO_ONE, 1, 1, lambda v: {"x": "y"}),
    lambda g: hubslosh.monte_carlo(ZERO_TO_ONE, 1, 1, lambda v: {"x": 1}, folder=5),
    lambda g: hubslosh.monte_carlo(ZERO_TO_ONE, 1, 1, lambda v: {"x": 1}, workers="x"),
    lambda g: hubslosh.monte_carlo(ZERO_TO_ONE, 1, 1, lambda v: {"x": 1}, client=5),
    lambda g: hubslosh.quantiles(5),
    lambda g: hubslosh.quantiles(TABLE, 5),
    lambda g: hubslosh.quantiles(TABLE, at="x"),
    lambda g: hubslosh.quantiles(TABLE, at=5),
    lambda g: hubslosh.quantiles(TABLE, confidence="x"),
    lambda g: attitude.slew("x", 1),
    lambda g: attitude.slew(1, "x"),
    lambda g: attitude.slew(1, 1, axis=5),
    lambda g: attitude.slew(1, 1, axis=(0, 0, 0)),
    lambda g: attitude.angles("x"),
    lambda g: attitude.axis_angle("x", 1),
    lambda g: attitude.error([1, 0, 0, 0], 5),
    lambda g: attitude.slew(1, 1, inertia="x"),
    lambda g: attitude.axis_angle((0, 0, 1), "x"),
    lambda g: hubslosh.read_parameters(5),
    lambda g: hubslosh.to_csv(5, "a.csv"),
    lambda g: hubslosh.draw(5, 1),
    lambda g: hubslosh.draw(ZERO_TO_ONE, "x"),
]


@pytest.fixture(scope="module")
def given(fmu: Path) -> SimpleNamespace:
    """Return what the calls with wrong arguments need: an FMU, a run and a linear model."""
    model = hubslosh.linearize(fmu, VISCOUS, "tau_cmd", "omega")
    return SimpleNamespace(run=hubslosh.simulate(fmu, VISCOUS, SWEEP), model=model, fmu=fmu)


def test_wrong_arguments_are_reported_by_messages_of_the_package(given: SimpleNamespace) -> None:
    """Each call in the list `WRONG` has one mistake and raises `FmuError`, no error of NumPy."""
    for call in WRONG:
        with pytest.raises(FmuError) as error:
            call(given)
        assert "there is no FMU" not in str(error.value)  # would hide the error that is tested


def test_a_single_name_and_a_file_of_parameters_are_accepted(
    given: SimpleNamespace, tmp_path: Path
) -> None:
    """A name gives the same bits as a list with this name, a file the same bits as a mapping."""
    file = tmp_path / "bench.toml"
    file.write_text('"friction.model" = "viscous"\n"hub.I" = 0.5\n')
    values = VISCOUS | {"hub.I": 0.5}
    one, many = (
        hubslosh.closed_loop(GAINS, 0.1, 1, given.fmu, parameters, outputs=outputs)
        for parameters, outputs in ((str(file), "omega"), (values, ["omega"]))
    )
    pd.testing.assert_frame_equal(one, many, check_exact=True)
    assert list(one) == ["time", "tau_cmd", "omega"]
    model = hubslosh.linearize(given.fmu, file, "tau_cmd", "omega")
    assert (model.A == hubslosh.linearize(given.fmu, values, ["tau_cmd"], ["omega"]).A).all()


def test_masked_arrays_are_refused(given: SimpleNamespace) -> None:
    """Otherwise NumPy would silently use the values under the mask."""
    one = np.ma.array([1.0, 99.0, 3.0], mask=[False, True, False])
    matrix = np.ma.array(np.diag([3.0, 3.0, 3.0]), mask=np.eye(3) > 0)
    calls = [
        lambda: hubslosh.closed_loop(one[1:], 0.1, 1, given.fmu),
        lambda: hubslosh.closed_loop(lambda t, y: one[1:2], 0.1, 1, given.fmu),
        lambda: hubslosh.margins(Loop([one[:2]], 0.1, given.fmu, VISCOUS)),
        lambda: given.model.response(one),
        lambda: hubslosh.Craft(1.0, matrix),
        lambda: hubslosh.Craft(1.0, (1.0, 1.0, 1.0), one),
        lambda: hubslosh.Craft(1.0, (1.0, 1.0, 1.0), thrust=one),
        lambda: hubslosh.Craft(
            1.0, (1.0, 1.0, 1.0), tanks={"a": hubslosh.MountedTank({"density": 1.0}, one)}
        ),
        lambda: attitude.axis_angle(one, 1.0),
        lambda: attitude.slew(1, 1, inertia=matrix),
        lambda: hubslosh.quantiles(TABLE, at=one / 100),
    ]
    for k, call in enumerate(calls):
        with pytest.raises(FmuError, match="a masked array has no value at"):
            pytest.fail(f"call {k} returned {call()!r}")
    # a masked array without masked values is accepted
    free = np.ma.array([0.1, 0.2], mask=False)
    assert given.model.response(free) == pytest.approx(given.model.response([0.1, 0.2]))
