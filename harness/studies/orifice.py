"""A tank that drains through an orifice, exported as an FMU by PythonFMU.

python -m pythonfmu build -f orifice.py
"""

from math import sqrt

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real


class Orifice(Fmi2Slave):
    """Tank with area · h' = q - c sqrt(h), solved by Runge–Kutta in steps of 10 ms."""

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.area, self.c, self.h, self.q = 1.0, 0.5, 1.0, 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Real("area", initial=Fmi2Initial.exact, **fixed))
        self.register_variable(Real("c", initial=Fmi2Initial.exact, **fixed))
        self.register_variable(Real("q", causality=Fmi2Causality.input))
        output = {"causality": Fmi2Causality.output, "initial": Fmi2Initial.exact}
        self.register_variable(Real("h", **output))

    def rate(self, h: float) -> float:
        """Return the derivative of the level, h', m/s."""
        return (self.q - self.c * sqrt(max(h, 0.0))) / self.area

    def do_step(self, _: float, step: float) -> bool:
        """Advance the tank by ``step``, s."""
        n = max(1, round(step / 0.01))
        d = step / n
        for _ in range(n):
            k1 = self.rate(self.h)
            k2 = self.rate(self.h + d / 2 * k1)
            k3 = self.rate(self.h + d / 2 * k2)
            k4 = self.rate(self.h + d * k3)
            self.h += d / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return True
