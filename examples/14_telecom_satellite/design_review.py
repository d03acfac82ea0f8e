"""Reviews the design of the satellite's loop; prints the summary and writes a page."""

import warnings

import telecom

import hubslosh


def review(fills: list[str] = telecom.FILLS, draws: int = 200) -> hubslosh.Review:
    """Return the design review with uncertain inertia, tank position and delay.

    Inertia varies by 5 %, the position of a tank by 10 mm, and the delay by 50 ms.
    """
    return telecom.craft.review(
        telecom.controller(), telecom.PERIOD, fills, measured=telecom.MEASURED,
        delay=telecom.DELAY, draws=draws,
        uncertain={"craft.Jxx": "5%", "tank[1].position[3]": (0.19, 0.21), "delay": (0.1, 0.15)},
    )  # fmt: skip


if __name__ == "__main__":
    warnings.filterwarnings("ignore", "tank NTO: damping", hubslosh.FmuWarning)
    found = review()
    found.save("review.html")
    print(found)
