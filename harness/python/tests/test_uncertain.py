"""Uncertain models equal linear models of the FMU; simulations confirm worst cases."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import option
from scipy.io import loadmat
from scipy.optimize import brentq

import hubslosh
from hubslosh import FmuError, Identification, Loop, UncertainModel, linearize, uncertain
from hubslosh.delta_search import DeltaSearch
from hubslosh.scalings import SMALLEST, mu_upper

TURN = 2 * np.pi
READ_LFT = Path(__file__).resolve().parents[2] / "hosts"
MEASURED = [f"q[{i}]" for i in (2, 3, 4)] + [f"omega[{i}]" for i in (1, 2, 3)]
TORQUE = [f"torque[{i}]" for i in (1, 2, 3)]

POINT = {
    "craft.mass": 900.0, "craft.r[1]": 0.02, "craft.r[2]": -0.03, "craft.r[3]": 0.9,
    "craft.Jxx": 600.0, "craft.Jyy": 500.0, "craft.Jzz": 400.0, "craft.Jxy": -9.0,
    "craft.Jxz": 12.0, "craft.Jyz": 5.0, "tanks": 2, "force[1]": 3.0, "force[3]": 420.0,
    "torque[2]": 4.0, "h_wheels[1]": 2.0, "h_wheels[3]": -5.0,
    "tank[1].position[1]": 0.1, "tank[1].position[2]": 0.4, "tank[1].modes": 2,
    "tank[1].g_ref": 0.3, "tank[1].k[1]": 2.0, "tank[1].zeta[1]": 0.004,
    "tank[2].position[2]": -0.5, "tank[2].position[3]": 0.2, "tank[2].q[2]": 0.05,
    "tank[2].q[3]": -0.03, "tank[2].g_ref": 0.3, "tank[2].frequency[1]": 0.21,
    "tank[2].damping_law": "constant_ratio", "tank[2].dI_y": 0.6, "tank[2].I_xy": 0.2,
}  # fmt: skip
"""Craft with two tanks off the axis, one tilted; the force turns it, so no surface is at rest."""

RANGES = {
    "tank[1].frequency[1]": "12%", "tank[1].zeta[1]": "50%", "tank[1].mass[1]": "10%",
    "tank[1].bob[1]": (-0.13, -0.09), "tank[1].frequency[2]": "8%", "tank[2].zeta[1]": "60%",
    "tank[2].frequency[1]": (0.19, 0.24), "tank[2].mass[1]": "7%", "tank[2].bob[1]": "10%",
    "craft.mass": "6%", "craft.Jxx": "9%", "craft.Jzz": "5%", "craft.Jxy": (-20.0, 5.0),
    "craft.r[1]": (-0.01, 0.05), "craft.r[3]": "4%", "acceleration": "5%",
}  # fmt: skip


@pytest.fixture
def spacecraft(fmu: Path) -> Path:
    return fmu.with_name("Spacecraft.fmu")


def difference(model: UncertainModel, delta: np.ndarray, spacecraft: Path) -> float:
    """Return how far ``model`` at Δ is from `linearize`.

    The result is the largest difference relative to the largest element of its matrix.
    """
    mine = model.at(delta)
    theirs = linearize(spacecraft, model.parameters(delta), list(mine.inputs), list(mine.outputs))
    kept = [theirs.states.index(state) for state in mine.states]
    # states of the FMU that are left out have no effect: they follow from the norms of q and p
    matrices = theirs.A[np.ix_(kept, kept)], theirs.B[kept], theirs.C[:, kept], theirs.D
    errors = [np.abs(a - b).max() / max(np.abs(b).max(), 1e-300)
              for a, b in zip(mine, matrices, strict=True)]  # fmt: skip
    return max(errors)


def test_every_draw_is_the_linear_model_of_the_fmu(spacecraft: Path) -> None:
    """The draws agree to 1e-9 at the ends of the ranges, beyond them, and at 40 points within."""
    model = uncertain(POINT, RANGES, ("torque", "force"), model=spacecraft)
    random = np.random.default_rng(3)
    count = len(RANGES)
    deltas = [np.zeros(count), np.ones(count), -np.ones(count), 1.5 * (-1.0) ** np.arange(count)]
    for delta in [*deltas, *random.uniform(-1, 1, (40, count))]:
        assert difference(model, delta, spacecraft) < 1e-11
    # the uncertain parameters change the matrices
    assert np.abs(model.at(deltas[1]).A - model.at(deltas[0]).A).max() > 1e-3
    # the parameters at Δ = 0 are the middles of the ranges
    assert model.values(deltas[0])["tank[2].frequency[1]"] == pytest.approx(0.215, rel=1e-12)


def test_the_number_of_copies_of_each_parameter_in_delta_equals_the_derivation(
    spacecraft: Path,
) -> None:
    """The numbers of copies of each parameter are those of a free surface at rest.

    With inputs and outputs of only one axis, a mode needs half as many copies.
    """
    still = {"tank[1].g_ref": 0.3, "force[3]": 470.0, "tank[1].position[3]": -0.3}
    ranges = {f"tank[1].{kind}[1]": "5%" for kind in ("frequency", "zeta", "mass", "bob")}
    ranges |= {"craft.mass": "5%", "craft.Jxx": "5%", "craft.Jxy": (-5, 5), "acceleration": "5%"}
    model = uncertain(still, ranges, model=spacecraft)
    assert dict(zip(model.deltas, model.counts, strict=True)) == {
        "tank[1].frequency[1]": 4, "tank[1].zeta[1]": 2, "tank[1].mass[1]": 2, "tank[1].bob[1]": 4,
        # the tank is on the axis, so that a torque moves no mass along it
        "craft.mass": 2, "craft.Jxx": 1, "craft.Jxy": 2, "acceleration": 2,
    }  # fmt: skip
    del ranges["craft.Jxy"], ranges["craft.Jxx"]
    pitch = uncertain(still, ranges, "torque[2]", ["q[3]", "omega[2]"], model=spacecraft)
    assert pitch.counts == (2, 1, 1, 2, 1, 1)


def test_surface_tension_without_gravity_gives_a_stable_mode(spacecraft: Path) -> None:
    """Without thrust, the frequency follows from the centring stiffness for any pendulum length."""
    start = {"tank[1].k[1]": 3.0, "tank[1].g_ref": 1e-3}
    ranges = {"tank[1].frequency[1]": "20%", "tank[1].mass[1]": "5%"}
    model = uncertain(start, ranges, model=spacecraft)
    assert model.center["tank[1].frequency[1]"] == pytest.approx(
        np.sqrt(3.0 / 128.211) / TURN, rel=1e-9
    )
    for delta in ([1.0, -1.0], [-0.4, 0.3]):
        assert difference(model, np.array(delta), spacecraft) < 1e-11


def test_a_covariance_gives_one_uncertainty_for_each_principal_axis(spacecraft: Path) -> None:
    """Each principal axis ends at ±2 standard deviations, where the quadratic form is 4."""
    names = ["tank[1].frequency[1]", "craft.Jxx"]
    matrix = pd.DataFrame([[4e-6, 1.2e-2], [1.2e-2, 100.0]], names, names)
    of_fit = {"correlations": [dict.fromkeys(names)], "covariance": matrix.to_numpy().tolist()}
    found = Identification({}, {}, None, {}, True, True, (), of_fit)
    pd.testing.assert_frame_equal(found.covariance, matrix)
    model = uncertain(POINT, {"tank[1].mass[1]": "5%"}, covariance=matrix, model=spacecraft)
    assert model.deltas == ("tank[1].mass[1]", "axis[1]", "axis[2]")
    for delta in np.eye(3)[1:]:
        off = [model.values(delta)[name] - model.center[name] for name in names]
        assert off @ np.linalg.solve(matrix.to_numpy(), off) == pytest.approx(4, rel=1e-6)
        assert difference(model, delta, spacecraft) < 1e-11


STILL = {
    "craft.mass": 900.0, "craft.r[3]": 0.9, "craft.Jxx": 600.0, "craft.Jyy": 500.0,
    "force[3]": 470.0, "tank[1].position[3]": -0.3, "tank[1].g_ref": 1.7, "tank[1].k[1]": 2.0,
    "tank[1].zeta[1]": 0.004, "tank[1].H_0": 0.1,
}  # fmt: skip
"""Craft with one tank on the axis. Its damping depends on the acceleration, which is not g_ref."""


def fit(names: list[str], matrix: np.ndarray) -> Identification:
    """Return a result of `identify` in which ``names`` have the covariance ``matrix``."""
    of_fit = {"correlations": [dict.fromkeys(names)], "covariance": matrix.tolist()}
    return Identification({}, {}, None, {}, True, True, (), of_fit)


def test_parameters_of_an_identification_become_uncertain_parameters(spacecraft: Path) -> None:
    """The derivatives of the response by each entry of Δ equal those of the linearised FMU.

    They are central differences with an error of 1e-5 of the largest. The thrust of each craft is
    chosen so that the acceleration is the same.
    """
    names = ["tank[1].length[1]", "tank[1].hinge[1]", "tank[1].zeta[1]", "tank[1].mass[1]",
             "tank[1].m_0", "tank[1].H_0", "tank[1].I_0", "craft.mass", "craft.Jxx"]  # fmt: skip
    weights = ["craft.mass", "tank[1].m_0", "tank[1].mass[1]"]
    with hubslosh.Plant(spacecraft, STILL) as plant:
        value = np.array(plant.get(names))
        g = STILL["force[3]"] / sum(plant.get(weights))

    def response(off: np.ndarray) -> np.ndarray:
        there = STILL | dict(zip(names, (value + off).tolist(), strict=True))
        with hubslosh.Plant(spacecraft, there) as plant:
            there |= {"force[3]": g * sum(plant.get(weights))}
        return linearize(spacecraft, there, TORQUE, MEASURED).response([0.05, 0.17, 0.3])

    random = np.random.default_rng(5).standard_normal((12, len(names) + 1))
    deviation = 0.01 * np.append(value, 1.0)
    covariance = np.corrcoef(random, rowvar=False) * np.outer(deviation, deviation)
    # the bias of a gyro is no parameter of the craft
    found = fit([*names, "bias(omega[1])@1"], covariance)
    model = uncertain(STILL, covariance=found, outputs=MEASURED, model=spacecraft)
    assert len(model.deltas) == len(names)
    step = 1e-3
    slopes = np.array([
        response(off) - response(-off) for off in step * np.diag(deviation[:-1])
    ])  # fmt: skip
    mine = np.array([
        model.at(w * step).response([0.05, 0.17, 0.3])
        - model.at(-w * step).response([0.05, 0.17, 0.3])
        for w in np.eye(len(names))
    ])  # fmt: skip
    # each axis is a principal axis of the correlations, two standard deviations long
    correlations = np.corrcoef(random, rowvar=False)[:-1, :-1]
    expected = 4 * np.einsum("i...,ij,j...->...", slopes, correlations, slopes)
    squares = np.einsum("i...,i...->...", mine, mine)
    assert np.abs(squares - expected).max() < 1e-5 * np.abs(expected).max()


def test_an_identified_pendulum_length_gives_the_frequency_with_its_standard_deviation(
    spacecraft: Path, request: pytest.FixtureRequest
) -> None:
    """The frequency is within 4 σ of the true value.

    The standard deviations of frequency and height of the slosh mass follow from formulas.
    """
    time = np.arange(0.0, 60.0, 0.2)
    torque = pd.DataFrame({"time": time, "torque[2]": np.where(time < 2, 5.0, 0.0)})
    flight = hubslosh.simulate(spacecraft, STILL, torque, outputs=["omega[2]"])
    flight["omega[2]"] += 1e-6 * np.random.default_rng(1).standard_normal(len(flight))
    free = {"tank[1].length[1]": 0.27, "tank[1].zeta[1]": 0.003}
    found = hubslosh.identify(
        pd.DataFrame(flight), fmu=spacecraft, free=free, inputs=["torque[2]"],
        outputs=["omega[2]"], settings=STILL, program=option(request, "--hubslosh"),
    )  # fmt: skip
    assert found.fits, found.verdict
    point = STILL | {name: e.value for name, e in found.parameters.items()}
    model = uncertain(point, covariance=found, model=spacecraft)
    with hubslosh.Plant(spacecraft, point) as plant:
        length, g = plant.get(["tank[1].length[1]", "specific_force[3]"])
    f = model.center["tank[1].frequency[1]"]
    deviation = np.sqrt(found.covariance.loc["tank[1].length[1]", "tank[1].length[1]"])
    slopes = {"frequency[1]": g / (8 * np.pi**2 * f * length**2), "bob[1]": 1.0}
    for kind, slope in slopes.items():
        size = np.linalg.norm(model.spread.loc[f"tank[1].{kind}"])
        assert size == pytest.approx(2 * slope * deviation, rel=1e-6)
    truth = uncertain(STILL, {"craft.Jxx": "1%"}, model=spacecraft)
    off = f - truth._values["tank[1].frequency[1]"]
    assert abs(off) < 4 * slopes["frequency[1]"] * deviation


def test_an_identification_that_cannot_be_converted_is_refused(spacecraft: Path) -> None:
    """Refused are a tank's position, a frequency without effect, and undetermined parameters."""
    for name, words in [
        ("tank[1].position[3]", r"tank\[1\].position\[3\] cannot be converted"),
        ("tank[1].frequency[1]", r"frequency\[1\] = 0 has no effect"),
    ]:
        with pytest.raises(FmuError, match=words):
            uncertain(STILL, covariance=fit([name], np.eye(1)), model=spacecraft)
    with pytest.raises(FmuError, match=r"does not determine craft\.Jxx: give identify a prior"):
        uncertain(STILL, covariance=fit(["craft.Jxx"], np.full((1, 1), np.inf)), model=spacecraft)
    with pytest.raises(FmuError, match="range and a covariance"):
        found = fit(["tank[1].length[1]"], 1e-6 * np.eye(1))
        uncertain(STILL, {"tank[1].frequency[1]": "5%"}, covariance=found, model=spacecraft)


def test_saved_files_restore_the_uncertain_model(spacecraft: Path, tmp_path: Path) -> None:
    """The files are read by scipy and json; python-control gets the model itself."""
    model = uncertain(POINT, RANGES, model=spacecraft)
    hubslosh.to_mat(model, tmp_path / "craft.mat")
    read = loadmat(tmp_path / "craft.mat", simplify_cells=True)
    model.to_json(tmp_path / "craft.json")
    written = json.loads((tmp_path / "craft.json").read_text(encoding="utf-8"))
    for key in "ABCD":
        matrix = getattr(model.M, key)
        assert (read[key] == matrix).all() and (np.array(written[key]) == matrix).all()
    assert list(read["deltas"]) == list(model.deltas) == written["deltas"]
    assert read["repetition"].tolist() == list(model.counts)
    assert written["low"][written["parameters"].index("craft.r[1]")] == pytest.approx(-0.01)
    system = model.to_control()
    assert system.ninputs == model.order + 3 and (system.A == model.M.A).all()


@pytest.mark.octave
def test_octave_reads_the_mat_file_of_an_uncertain_model(spacecraft: Path, tmp_path: Path) -> None:
    """Octave runs the part of read_lft.m that needs no toolbox."""
    model = uncertain(POINT, RANGES, model=spacecraft)
    hubslosh.to_mat(model, tmp_path / "craft.mat")
    delta = np.linspace(-1, 1, len(RANGES))
    code = (
        f"addpath('{READ_LFT}'); G = read_lft('craft.mat', {delta.tolist()}); "
        "A = G.A; B = G.B; C = G.C; D = G.D; save('-v6', 'out.mat', 'A', 'B', 'C', 'D');"
    )
    subprocess.run(["octave-cli", "--eval", code], cwd=tmp_path, check=True, capture_output=True)
    read, mine, scale = loadmat(tmp_path / "out.mat"), model.at(delta), model._scale(delta)
    assert read["A"] * scale / scale[:, None] == pytest.approx(mine.A, rel=1e-9, abs=1e-12)
    assert read["C"] * scale == pytest.approx(mine.C, rel=1e-9, abs=1e-15)


def test_models_families_and_parameters_are_written_to_mat_files(
    spacecraft: Path, tmp_path: Path
) -> None:
    """Names are cell arrays, and a family of models has a third dimension."""
    models = {g: linearize(spacecraft, POINT | {"force[3]": g}, "torque", "omega")
              for g in (300.0, 400.0)}  # fmt: skip
    hubslosh.to_mat(models[300.0], tmp_path / "one.mat")
    one = loadmat(tmp_path / "one.mat", simplify_cells=True)
    assert (one["A"] == models[300.0].A).all() and one["period"] == 0
    assert list(one["inputs"]) == TORQUE
    for family in (models, list(models.values())):
        hubslosh.to_mat(family, tmp_path / "family.mat")
        read = loadmat(tmp_path / "family.mat", simplify_cells=True)
        assert (read["A"][:, :, 1] == models[400.0].A).all()
    hubslosh.to_mat({"tank[1].h": (50, "mm"), "mount": "free"}, tmp_path / "values.mat")
    read = loadmat(tmp_path / "values.mat", simplify_cells=True)
    assert read["tank_1_h"] == 50 and read["units"]["tank_1_h"] == "mm" and read["mount"] == "free"
    other = replace(models[300.0], outputs=("a", "b", "c"))
    with pytest.raises(FmuError, match="must have the same outputs"):
        hubslosh.to_mat([models[300.0], other], tmp_path / "x.mat")


@pytest.mark.filterwarnings("ignore:at the start a tank leaves its range")
def test_all_wrong_arguments_of_uncertain_are_reported_at_once(spacecraft: Path) -> None:
    """One message lists wrong names, ranges and signals.

    Craft for which uncertain models do not exist are also refused.
    """
    ranges = {"tank[1].frequence[1]": "5%", "craft.mass": (2, 1), "tank[1].zeta[1]": "150%"}
    with pytest.raises(FmuError) as told:
        uncertain(POINT, ranges, outputs=["theta"], model=spacecraft)
    for text in ("did you mean tank[1].frequency[1]", "craft.mass cannot be (2, 1)",
                 "tank[1].zeta[1] = -0.", "theta is not among the outputs"):  # fmt: skip
        assert text in str(told.value)
    for change, text in {
        "mount": ("pivot", "on a pivot"), "init.q[2]": (0.1, "attitude must be"),
        "tank[1].r_0[1]": (0.1, "axially symmetric"), "force[3]": (-100.0, "does not hold"),
    }.items():  # fmt: skip
        with pytest.raises(FmuError, match=text[1]):
            uncertain(POINT | {change: text[0]}, {"craft.mass": "5%"}, model=spacecraft)


@pytest.fixture
def danger(spacecraft: Path) -> tuple[UncertainModel, Loop]:
    """Return a model and a loop in which the slosh mass may be in the danger zone.

    The danger zone is between centre of mass and centre of percussion.
    """
    start = {
        "craft.mass": 900.0, "craft.r[3]": 0.0, "force[3]": 450.0, "tank[1].position[3]": 0.0,
        "tank[1].g_ref": 0.35, "tank[1].zeta[1]": 0.002,
    }  # fmt: skip
    ranges = {"tank[1].frequency[1]": "10%", "tank[1].zeta[1]": "40%", "tank[1].mass[1]": "10%",
              "craft.Jxx": "10%"}  # fmt: skip
    gains = np.hstack([40 * np.eye(3), 200 * np.eye(3)])
    loop = Loop(gains, 0.1, spacecraft, start, MEASURED, TORQUE, delay=0.22)
    return uncertain(start, ranges, model=spacecraft), loop


def test_the_nonlinear_fmu_is_at_the_limit_of_stability_at_the_worst_case(
    danger: tuple[UncertainModel, Loop],
) -> None:
    """At a slightly larger Δ the motion grows, at a smaller Δ it decays.

    The frequency agrees to 1 %.
    """
    model, loop = danger
    worst = model.worst_case(loop)
    assert 0.1 < worst.size < 3 and worst.mu == pytest.approx(1 / worst.size)
    for share, grows in ((0.97, False), (1.03, True)):
        delta = {name: share * x for name, x in worst.delta.items()}
        start = model.parameters(delta, commanded=True) | {
            "tank[1].p_0[1,2]": 0.01,
            "tank[1].p_0[1,3]": -1.0,
        }
        assert hubslosh.margins(replace(loop, parameters=start)).stable is not grows
        run = replace(loop, parameters=start).simulate(2000, outputs=["omega[1]"])
        time, rate = run["time"].to_numpy(), run["omega[1]"].to_numpy()
        early, late = (np.abs(rate[(time > a) & (time < a + 200)]).max() for a in (600, 1800))
        assert bool(late > early) is grows
        rate = rate - rate.mean()
        rises = time[1:][(rate[1:] > 0) & (rate[:-1] <= 0) & (time[1:] > 1000)]
        assert 1 / np.diff(rises).mean() == pytest.approx(worst.frequency, rel=0.01)


def test_bounds_of_mu_enclose_the_worst_case(danger: tuple[UncertainModel, Loop]) -> None:
    """At the frequency of the worst case, the upper bound of µ is just above the lower bound."""
    model, loop = danger
    worst = model.worst_case(loop)
    upper = model.mu_upper(loop, [worst.frequency])[0]
    # the upper bound ignores changes with Δ of the images of the hold, which are 1e-5 here
    assert worst.mu < upper * (1 + 1e-4)
    assert upper < 1.05 * worst.mu


def test_the_upper_bound_of_mu_for_one_repeated_parameter_is_exact() -> None:
    """I - δ N is singular if 1/δ is a real eigenvalue of N.

    The error of the bound is at most 2 %, because the scaling D must stay away from singular
    matrices.
    """
    random = np.random.default_rng(4)
    for n in (1, 2, 3, 4, 5):
        similar = random.normal(size=(n, n)) + 1j * random.normal(size=(n, n))
        for real in (random.normal(size=1), np.zeros(0)):
            values = np.append(real, random.normal(size=n - len(real)) + 1j)
            matrix = similar @ np.diag(values) @ np.linalg.inv(similar)
            exact = max(np.abs(real), default=SMALLEST)
            assert exact * (1 - 1e-9) <= mu_upper(matrix, [n]) <= max(1.02 * exact, 0.02)


def test_a_lower_bound_of_a_parameter_lowers_the_bound_of_mu() -> None:
    """1 + 2 δ is singular only at δ = -0.5, which a damping ratio cannot reach."""
    matrix = np.array([[-2.0]])
    for least, exact in ((-np.inf, 2.0), (-0.6, 2.0), (-0.5, 2.0), (-0.4, SMALLEST)):
        bound = mu_upper(matrix, [1], np.array([least]))
        assert exact * (1 - 1e-9) <= bound <= 1.006 * exact


def test_the_upper_bound_of_mu_for_two_parameters_is_near_the_true_value() -> None:
    """The first parameter occurs three times in Δ, the second once.

    For each value of the first parameter, the value of the second parameter at which I - N Δ is
    singular is known.
    """
    random = np.random.default_rng(8)
    ratios = []
    for _ in range(12):
        matrix = random.normal(size=(4, 4)) + 0.3j * random.normal(size=(4, 4))
        matrix[:, 1] *= 1e3  # badly scaled
        matrix[1] /= 1e3

        def seen(first: float, N: np.ndarray = matrix) -> complex:
            """Return 1/δ of the second parameter at which I - N Δ is singular.

            ``first`` is 1/δ of the first parameter.
            """
            closing = np.linalg.solve(np.eye(3) - N[:3, :3] * first, N[:3, 3])
            return complex(N[3, 3] + first * N[3, :3] @ closing)

        nodes = np.linspace(-3, 3, 4001)
        values = np.array([seen(x) for x in nodes])
        smallest = np.inf
        for k in np.flatnonzero(values.imag[1:] * values.imag[:-1] < 0):
            if abs(values[k + 1] - values[k]) > 0.1 * abs(values[k]):
                continue  # a pole
            x = brentq(lambda x: seen(x).imag, nodes[k], nodes[k + 1])
            smallest = min(smallest, max(abs(x), 1 / abs(seen(x).real)))
        bound = mu_upper(matrix, [3, 1])
        if np.isfinite(smallest):
            assert bound * (1 + 1e-6) >= 1 / smallest
            ratios.append(bound * smallest)
    assert len(ratios) > 6 and np.median(ratios) < 1.05


def test_the_error_about_missing_clarabel_says_how_to_install_it(
    danger: tuple[UncertainModel, Loop], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The solver clarabel is an optional dependency."""
    monkeypatch.setitem(sys.modules, "clarabel", None)
    model, loop = danger
    for call in (lambda: model.mu_upper(loop, [0.1]), lambda: model.certify(loop)):
        with pytest.raises(FmuError, match=r"pip install 'hubslosh\[robust\]'"):
            call()


def test_no_random_craft_within_a_stability_certificate_is_unstable(
    danger: tuple[UncertainModel, Loop],
) -> None:
    """Random draws and corners are stable; just beyond the worst case the loop is unstable.

    Damping ratios stay at 0 or above.
    """
    model, loop = danger
    found = model.certify(loop)
    assert 1 < found.gap < 1.0401 and found.mu == pytest.approx(1 / found.size)
    assert f"{found.gap:.3f} times as much" in repr(found)
    assert list(found.least) == list(model.deltas)
    low = np.maximum(-found.size, list(found.least.values()))
    random = np.random.default_rng(2)
    inside = random.uniform(low, found.size, (300, len(low)))
    corners = np.where(random.random((100, len(low))) < 0.5, low, found.size)
    for delta in (*inside, *corners):
        poles = model.at(delta)
        assert np.abs(hubslosh.stability._closed(loop._gain(poles, loop.linear()))).max() < 1 + 1e-9
    beyond = {name: 1.001 * x for name, x in found.worst.delta.items()}
    start = model.parameters(beyond, commanded=True)
    assert not hubslosh.margins(replace(loop, parameters=start)).stable
    with pytest.raises(FmuError, match="gap = 1 must be above 1"):
        model.certify(loop, gap=1)


def test_poles_for_many_deltas_at_once_equal_those_of_single_loops(
    danger: tuple[UncertainModel, Loop],
) -> None:
    """The search computes many Δ in stacked matrices; delays may have any length."""
    model, given = danger
    for delay, latency in ((0.0, 0), (0.04, 0), (given.period, 1), (0.13, 2)):
        loop = replace(given, delay=delay, latency=latency)
        law = loop.linear()
        search = DeltaSearch(model, loop, law)
        deltas = np.random.default_rng(3).uniform(-1, 1, (70, len(model.deltas)))
        deltas = np.maximum(deltas, search.least)
        for delta, poles in zip(deltas, search.poles(deltas), strict=True):
            exact = hubslosh.stability._closed(loop._gain(model.at(delta), law))
            for pole in exact[np.abs(exact) > 0.5]:
                assert np.abs(poles - pole).min() < 1e-12


def test_a_stability_certificate_reuses_a_given_worst_case(
    danger: tuple[UncertainModel, Loop],
) -> None:
    """A worst case of another loop is refused; progress shows sizes, shares and the time left."""
    model, loop = danger
    lines: list[str] = []
    worst = model.worst_case(loop, progress=lines.append)
    assert any(re.fullmatch(r"worst case: .* so far, about \d+ s left", line) for line in lines)
    lines.clear()
    found = model.certify(loop, worst=worst, progress=lines.append)
    assert found.worst is worst and found.size == model.certify(loop).size
    assert lines and all(re.search(r"\d+ % proved, about \d+ s left", line) for line in lines)
    assert "100 % proved, about 0 s left" in lines[-1]
    with pytest.raises(FmuError, match="worst is not a worst case of this loop"):
        model.certify(replace(loop, delay=loop.delay + 0.02), worst=worst)


def test_margins_and_worst_cases_print_the_names_of_the_tanks(spacecraft: Path) -> None:
    """Tanks have the names that the user gave them in every printed result."""
    sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
    tanks = {"NTO": hubslosh.MountedTank(sphere, (0, 0, 0.8), modes=1, nu=0.9e-6)}
    craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500, model=spacecraft)
    loop = craft.loop(np.hstack([20 * np.eye(3), 80 * np.eye(3)]), 0.1, "50%", delay=1.0)
    model = craft.uncertain("50%", {"NTO.frequency[1]": "10%", "NTO.zeta[1]": "interval"})
    worst = model.worst_case(loop)
    review = craft.review(loop.controller, 0.1, ["50%"], draws=5)
    for text in (str(hubslosh.margins(loop)), repr(model), repr(worst), str(review)):
        assert "NTO" in text and "tank[" not in text and "tank 1" not in text
    assert "NTO.frequency[1] = " in repr(worst)


def test_a_stability_certificate_that_fails_is_reported(
    danger: tuple[UncertainModel, Loop], tmp_path: Path
) -> None:
    """One convex problem, the limit in this test, is not enough to certify any size."""
    model, loop = danger
    found = model.certify(loop, most=1)
    assert found.size == 0 and found.mu == found.gap == np.inf
    assert "none was found with" in repr(found) and "WorstCase" in repr(found)
    with pytest.raises(FmuError, match="the certificate proves nothing"):
        found.save(tmp_path / "none.npz")


def test_the_error_about_a_loop_that_does_not_fit_the_model_lists_both_names(
    danger: tuple[UncertainModel, Loop],
) -> None:
    """The message lists the signals of both, and the call that creates a model that fits."""
    model, loop = danger
    other = replace(loop, command="force")
    with pytest.raises(FmuError) as told:
        model.worst_case(other)
    for text in (
        "commands force[1], force[2], force[3], but", "its inputs torque[1], torque[2], torque[3]",
        "uncertain(…, inputs=loop.names[1], outputs=loop.names[0])",
    ):  # fmt: skip
        assert text in str(told.value)
    start = dict(loop.parameters)
    fits = uncertain(
        start, {"craft.Jxx": "10%"}, model=loop.model, inputs=other.names[1],
        outputs=other.names[0],
    )  # fmt: skip
    with pytest.raises(FmuError, match="unstable at Δ = 0"):  # the loop fits, but is unstable
        fits.worst_case(other)
