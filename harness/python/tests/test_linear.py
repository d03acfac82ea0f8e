"""Linear models and frequency responses, compared with closed forms and with each other."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.linalg import expm

from hubslosh import FmuError, Plant, fit, frequency_response, linearize, simulate
from hubslosh.linearization import exponential

VISCOUS = {"friction.model": "viscous"}
FRICTION_B = 0.03793  # N·m·s/rad, the default of friction.b


def test_antiresonance_and_static_gain_equal_closed_forms(fmu: Path) -> None:
    """The zeros from torque to rate are the slosh mode on a fixed hub.

    At 0 Hz the rate is the torque divided by the friction coefficient. The tolerance is 1e-12,
    because only rounding errors differ.
    """
    model = linearize(fmu, VISCOUS, ["tau_cmd"], ["omega"])
    assert model.states == ("omega", "slosh.q_tangential[1]", "slosh.v_tangential[1]")
    with Plant(fmu, VISCOUS) as plant:
        frequency, zeta = plant.get(["slosh.frequency[1]", "slosh.damping[1]"])
    A, B, C, _ = model  # noqa: N806
    # for D = 0 and C B ≠ 0, the zeros are the eigenvalues of A − B C A/(C B), without one at 0
    zeros = np.linalg.eigvals(A - B @ C @ A / (C @ B))
    zeros = zeros[np.abs(zeros) > 1e-6]
    assert np.abs(zeros) == pytest.approx([2 * np.pi * frequency] * 2, rel=1e-12)
    assert -zeros.real / np.abs(zeros) == pytest.approx([zeta] * 2, rel=1e-10)
    assert model.response(0.0)[0, 0, 0] == pytest.approx(1 / FRICTION_B, rel=1e-12)


def test_unused_states_do_not_appear_in_linear_models(fmu: Path) -> None:
    """By default the model has only states on which an output depends.

    With all states the frequency response is the same.
    """
    few = linearize(fmu, VISCOUS)
    every = linearize(fmu, VISCOUS, all_states=True)
    assert len(few.states) < len(every.states)
    frequency = [0.1, 2.3, 2.5, 10.0]
    assert np.allclose(few.response(frequency), every.response(frequency), rtol=1e-9, atol=1e-12)


def test_the_matrix_exponential_equals_that_of_scipy() -> None:
    """Stiff, large and defective matrices agree to 1e-12 of the largest element."""
    random = np.random.default_rng(5)
    cases = [random.normal(size=(n, n)) * size for n in (1, 6, 25) for size in (1e-6, 0.3, 8.0)]
    cases += [np.diag(np.ones(5), 1), np.zeros((3, 3)), np.diag([-300.0, -1.0, 0.0])]
    for matrix in cases:
        exact = expm(matrix)
        assert np.abs(exponential(matrix) - exact).max() < 1e-12 * np.abs(exact).max()


def test_linear_models_convert_to_python_control(fmu: Path) -> None:
    """The converted model has the same names and poles."""
    model = linearize(fmu, VISCOUS, ["tau_cmd"], ["omega"])
    system = model.to_control()
    assert system.input_labels == ["tau_cmd"] and system.output_labels == ["omega"]
    assert np.sort_complex(system.poles()) == pytest.approx(np.sort_complex(model.poles))


def test_linearising_a_stuck_hub_raises_a_warning(fmu: Path) -> None:
    """Dry friction holds the hub at rest, so that small torques have no effect."""
    with pytest.warns(UserWarning, match="does dry friction hold the hub"):
        model = linearize(fmu, {"friction.model": "stribeck"}, ["tau_cmd"], ["omega"])
    assert not model.B.any()


def test_wrong_names_raise_errors_with_suggestions(fmu: Path) -> None:
    """The message lists all wrong names, with a similar name for each."""
    with pytest.raises(FmuError, match=r"no variable tau; .*omega is not an input of HubSlosh"):
        linearize(fmu, VISCOUS, inputs=["tau", "omega"])
    with pytest.raises(FmuError, match="stuck is of type Boolean"):
        linearize(fmu, VISCOUS, outputs=["stuck"])


@pytest.fixture(scope="module")
def sweep(fmu: Path) -> pd.DataFrame:
    """Return a simulated sweep from 2 to 2.8 Hz in 900 s that begins at rest."""
    time = np.arange(45001) * 0.02
    rate = np.log(2.8 / 2.0) / 900
    torque = 0.05 * np.sin(2 * np.pi * 2.0 * np.expm1(rate * time) / rate)
    inputs = pd.DataFrame({"time": time, "tau_cmd": torque})
    return simulate(fmu, VISCOUS, inputs, outputs=["omega"])


@pytest.mark.parametrize("hold", [False, True])
def test_the_frequency_response_estimated_from_a_sweep_equals_the_linear_model(
    fmu: Path, sweep: pd.DataFrame, hold: bool
) -> None:
    """Antiresonance and resonance agree to one line of the spectrum, 1/900 Hz.

    Between them, the estimate has an error of some thousandths, because the time history ends
    before the motion, and of 2 % at the resonance because of smoothing. A held torque also excites
    the images 50 Hz ± f, 100 Hz ± f, …, whose response is aliased to f: 0.01 of the response, and
    0.12 at the antiresonance. With linear interpolation this error is the square of these numbers.
    """
    if hold:
        sweep = simulate(fmu, VISCOUS, sweep[["time", "tau_cmd"]], outputs=["omega"], hold=True)
    found = frequency_response(sweep, band=(2.05, 2.75), hold=hold)
    model = linearize(fmu, VISCOUS, ["tau_cmd"], ["omega"])
    exact = model.response(f := found["frequency"].to_numpy())[:, 0, 0]
    if hold:

        def part(g: np.ndarray) -> np.ndarray:
            """Return the response at ``g`` (Hz) times the spectrum of a held torque there."""
            share = np.sinc(g * 0.02) * np.exp(-1j * np.pi * g * 0.02)
            return model.response(g)[:, 0, 0] * share

        images = sum(part(f + 50 * k) for k in range(-20, 21) if k)
        exact += images / np.sinc(f * 0.02) * np.exp(1j * np.pi * f * 0.02)
    error = np.abs(found["real"] + 1j * found["imag"] - exact) / np.abs(exact)
    assert error.median() < 0.005
    assert error.max() < 0.03
    for where in (np.argmin, np.argmax):
        assert abs(int(where(found["gain"])) - int(where(np.abs(exact)))) <= 1
    assert found["coherence"].between(0.9, 1).all()


@pytest.mark.parametrize(
    ("change", "arguments", "sentence"),
    [
        (lambda d: d.drop(columns="omega"), {}, "data has no column omega"),
        (lambda d: d.iloc[np.r_[:100, 150:300]], {}, "equal steps; it does not after row 99"),
        (lambda d: d.assign(tau_cmd=0.1), {}, "tau_cmd is constant"),
        (lambda d: d[:10], {}, "16 rows or more, not 10"),
        (lambda d: d, {"resolution": 1e-6}, "resolution must be from"),
        (lambda d: d, {"band": (20, 21)}, "no power between 20 and 21 Hz"),
    ],
)
def test_frequency_responses_that_cannot_be_estimated_raise_errors(
    sweep, change, arguments: dict, sentence: str
) -> None:
    """Each error is one sentence that names the reason."""
    with pytest.raises(FmuError) as told:
        frequency_response(change(sweep), **arguments)
    assert sentence in str(told.value)


def test_a_fit_of_the_exact_response_has_the_poles_and_zeros_of_the_model(fmu: Path) -> None:
    """The tolerance is 1e-6, because the real pole, 0.09 rad/s, is far below the fitted band."""
    model = linearize(fmu, VISCOUS, ["tau_cmd"], ["omega"])
    frequency = np.geomspace(1.25, 3.5, 400)
    exact = model.response(frequency)[:, 0, 0]
    data = pd.DataFrame({"frequency": frequency, "real": exact.real, "imag": exact.imag})
    found = fit(data)
    assert found.fit > 99.9999
    assert found.poles == pytest.approx(model.poles, rel=1e-6)
    with Plant(fmu, VISCOUS) as plant:
        (antiresonance,) = plant.get(["slosh.frequency[1]"])
    assert np.abs(found.zeros) == pytest.approx([2 * np.pi * antiresonance] * 2, rel=1e-6)
    assert np.allclose(found.response(frequency), exact, rtol=1e-6)
    assert np.allclose(found.to_control()(2j * np.pi * frequency), exact, rtol=1e-6)


def test_a_fit_of_a_sweep_finds_antiresonance_and_resonance(fmu: Path) -> None:
    """With a sweep of 50 mN·m in 15 minutes on a viscous bearing, both agree to 2 mHz."""
    time = np.arange(45001) * 0.02
    rate = np.log(2.8 / 2.0) / time[-1]
    torque = 0.05 * np.sin(2 * np.pi * 2.0 * np.expm1(rate * time) / rate)
    inputs = pd.DataFrame({"time": time, "tau_cmd": torque})
    sweep = simulate(fmu, VISCOUS, inputs, outputs=["omega"])
    found = fit(frequency_response(sweep, band=(2.05, 2.75)))
    poles = linearize(fmu, VISCOUS, ["tau_cmd"], ["omega"]).poles
    assert found.fit > 95
    hertz = np.abs([found.zeros[0], found.poles[-1], poles[-1]]) / (2 * np.pi)
    assert hertz[0] == pytest.approx(2.3436, abs=2e-3)
    assert hertz[1] == pytest.approx(hertz[2], abs=2e-3)


def test_wrong_arguments_of_fit_are_reported_in_one_error(fmu: Path) -> None:
    """One message lists all wrong arguments."""
    with pytest.raises(FmuError, match="no column real, imag; poles must be"):
        fit(pd.DataFrame({"frequency": [1.0]}), poles=1, zeros=2)
