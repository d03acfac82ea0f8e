"""Proves that the loop of the satellite is stable for certain changes of slosh and inertia."""

import warnings

import telecom

import hubslosh

RANGES = {
    "NTO.frequency[1]": "10%", "MMH.frequency[1]": (0.11, 0.14), "NTO.zeta[1]": "interval",
    "craft.Jxx": "5%",
}  # fmt: skip


def certificate(fill: str, of: hubslosh.Craft | None = None) -> hubslosh.Certificate:
    """Return the proof of stability for all uncertain parameters at a fill of both tanks.

    ``of`` is the craft, by default this satellite.
    """
    loop = telecom.loop(fill, of)
    model = (of or telecom.craft).uncertain(fill, RANGES, outputs=loop.names[0])
    return model.certify(loop, largest=9)


if __name__ == "__main__":
    warnings.filterwarnings("ignore", "tank NTO: damping", hubslosh.FmuWarning)
    found = certificate("60%")
    print(found, found.worst, sep="\n")
    found.save("certificate.npz")
