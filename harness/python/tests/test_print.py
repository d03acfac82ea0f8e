"""Objects of public classes print at most 20 lines."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from conftest import option

import hubslosh
from hubslosh import Estimated, LinearModel, attitude

SPHERE = {"density": 1008.0, "shape": {"sphere": {"radius": 0.35}}}
MOST = 20


@pytest.fixture(scope="module")
def made(
    request: pytest.FixtureRequest, fmu: Path, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Callable]:
    """Return, for each public class by name, a function that creates a large object of it."""
    program, model = option(request, "--hubslosh"), fmu.with_name("Spacecraft.fmu")
    of = hubslosh.MountedTank(SPHERE, (0.1, 0.5, -0.3), nu=9e-7)
    tanks = {f"tank {i}": of for i in range(4)}
    wheels = {f"wheel {i}": hubslosh.Wheel((i, 0, 1), 0.01, 0.2, 400, 50) for i in range(4)}
    craft = hubslosh.Craft(650.0, (95, 80, 90), (0, 0, 0), tanks, 44.0, wheels, 0.05, model)
    fill = ("60%", "60%", "60%", "60%")
    gains = np.hstack([2 * np.eye(3), 40 * np.eye(3)])
    loop = craft.loop(gains, 0.1, fill, delay=0.15)
    rng = np.random.default_rng(1)
    weak = [LinearModel(np.array([[0, 1], [-w * w, -1e-3 * w]]), np.eye(2)[:, 1:], np.eye(2)[1:],
                        np.zeros((1, 1)), ("x", "v"), ("u",), ("y",))
            for w in np.geomspace(1, 100, 30)]  # fmt: skip
    many = LinearModel(
        np.kron(np.eye(30), np.zeros((2, 2))) + _diagonal([one.A for one in weak]),
        np.vstack([one.B for one in weak]), np.hstack([one.C for one in weak]), np.zeros((1, 1)),
        tuple(f"x[{i}]" for i in range(60)), ("u",), ("y",),
    )  # fmt: skip
    runs = pd.DataFrame({f"result {i}": rng.random(50) for i in range(9)})
    estimates = {f"parameter[{i}]": Estimated(1.0, 0.1, 0.1, (0.8, 1.2), "kg") for i in range(30)}
    words = tuple(f"{i} " + 100 * "long word " for i in range(40))
    finding = hubslosh.Finding("zip.names", "error", "a" * 300, "long word " * 100)
    rule = hubslosh.CheckedRule("zip.names", "title", "2.1", (finding,) * 1000, None, 0.1)
    ranges = {
        f"{tank}.{of}[1]": "5%" for tank in tanks for of in ("frequency", "zeta", "mass", "bob")
    }
    table = pd.DataFrame(rng.random((20, 7)), columns=list("abcdefg"))
    run = loop.simulate(8.0, reference=attitude.slew(0.01, 4.0))
    return {
        "Craft": lambda: craft,
        "MountedTank": lambda: of,
        "MassProperties": lambda: craft.mass_properties(fill),
        "OperatingPoint": lambda: craft.trim(fill),
        "Tank": lambda: hubslosh.tank(SPHERE, "50%", modes=20),
        "Loop": lambda: loop,
        "LinearModel": lambda: many,
        "Review": lambda: craft.review(gains, 0.1, [fill], damping="nominal"),
        "UncertainModel": lambda: craft.uncertain(fill, ranges),
        "Engine": lambda: hubslosh.Engine((0, 0, -1), (0, 0, 1), 400),
        "Wheel": lambda: hubslosh.Wheel((0, 0, 1), 0.01, 0.2, 400, 50),
        "Appendage": lambda: hubslosh.Appendage((0, 1, 0), range(1, 7), np.ones((6, 6))),
        "Project": lambda: hubslosh.Project(craft, gains, {"period": 0.1}),
        "Certificate": lambda: craft.uncertain(fill, {"tank 0.zeta[1]": "5%"}).certify(loop, 0.1),
        "WorstCase": lambda: hubslosh.WorstCase({}, 0.5, 0.1, dict.fromkeys(ranges, 1.0)),
        "Margins": lambda: hubslosh.margins(many),
        "Run": lambda: run,
        "TransferFunction": lambda: hubslosh.TransferFunction(rng.random(30), rng.random(31), 99.0),
        "Estimated": lambda: estimates["parameter[0]"],
        "Identification": lambda: hubslosh.Identification(
            estimates, estimates, "spherical", {}, True, True, words, {"all": [1.0] * 10_000}
        ),
        "Finding": lambda: finding,
        "CheckedRule": lambda: rule,
        "Checked": lambda: hubslosh.Checked(Path("a.fmu"), 30_000, 0, (rule,) * 30),
        "LiquidModes": lambda: hubslosh.LiquidModes(
            10.0, (0, 0, 0), 0.1, 9.81, np.eye(3), table, table
        ),
        "Fmu": lambda: hubslosh.Fmu.open(model),
        "Plant": lambda: hubslosh.Plant(model),
        "View": lambda: hubslosh.view(
            run, tmp_path_factory.mktemp("view") / "run.html", program=program
        ),
        "FmuError": lambda: hubslosh.FmuError("wrong"),
        "FmuWarning": lambda: hubslosh.FmuWarning("strange"),
        "RunError": lambda: hubslosh.RunError("stopped", 1.0, {"x": np.zeros(10_000)}),
        "quantiles": lambda: hubslosh.quantiles(runs),
        "monte_carlo": lambda: hubslosh.monte_carlo({"x": (0.0, 1.0)}, 200),
    }


def _diagonal(blocks: list[np.ndarray]) -> np.ndarray:
    whole = np.zeros((2 * len(blocks), 2 * len(blocks)))
    for i, block in enumerate(blocks):
        whole[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = block
    return whole


def test_every_public_object_prints_in_20_lines(made: dict[str, Callable[[], Any]]) -> None:
    """The ``repr`` of each public object is at most as long as a paragraph."""
    public = {n for n in hubslosh.__all__ if inspect.isclass(getattr(hubslosh, n))}
    assert public <= set(made)
    for name, make in made.items():
        thing = make()
        for text in (str(thing), repr(thing)):
            assert 0 < len(text.splitlines()) <= MOST, f"{name}:\n{text}"
            assert max(len(line) for line in text.splitlines()) <= 300, f"{name}:\n{text}"


def test_a_printed_loop_shows_its_smallest_margins(made: dict[str, Callable]) -> None:
    """The text has the verdict, the margins, the worst crossings, and the number left out."""
    found = made["Margins"]()
    text = str(found)
    assert text.startswith("closed loop: ") and "phase margin" in text
    assert len(found.crossings) > 50 and "crossings with larger margins" in text
    least = found.crossings.loc[found.crossings["phase_margin"].abs().idxmin()]
    assert f"{least['frequency']:.4g}" in text
