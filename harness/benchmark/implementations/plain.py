"""Computes the cases by SciPy, using only the equations of the pages.

python3 plain.py RESULTS_FOLDER [CASE ...]
"""

import numpy as np
from scipy.integrate import quad, solve_ivp

import cases

TOLERANCE = {"rtol": 3e-14, "atol": 1e-15}
METHOD = "DOP853"


def cross(a, b):
    """Return the cross product of two vectors; np.cross takes longer."""
    return np.array([
        a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    ])  # fmt: skip


def skew(a):
    """Return the matrix of the cross product with ``a``."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def rotation(q):
    """Return the matrix from body to inertial axes of a quaternion, scalar first."""
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def quaternion_rate(q, w):
    """Return q' for the angular velocity ``w``, body axes."""
    s, v = q[0], q[1:]
    return 0.5 * np.hstack([-v @ w, s * w + cross(v, w)])


# ------------------------------------------------------------------------------ bench, friction


class Bench:
    """A hub with dry friction and liquid; `liquid` has the equations of the liquid."""

    def __init__(self, case):
        self.p = cases.parameters(case)
        p = self.p
        self.spherical = case == "bench_spherical"
        self.c = 2 * p["zeta"] * p["m"] * np.sqrt(p["g"] / p["l"])
        self.fixed = p["I"] + p["m_0"] * p["r"] ** 2

    def start(self):
        p = self.p
        if not self.spherical:
            return np.array([0.0, 0.0, p["alpha_0"], 0.0])
        x, y = p["p_x_0"], p["p_y_0"]
        return np.array([0, 0, x, y, -np.sqrt(1 - x * x - y * y), 0, 0, 0])

    def liquid(self, y):
        """Return how the liquid acts on the hub and moves in the state ``y``.

        The results are the inertia J that the liquid adds to the hub, its torque T on the hub, the
        rates of its states without acceleration of the hub, and the change of these rates per
        acceleration of the hub.
        """
        p, c = self.p, self.c
        m, l, r, g, w = p["m"], p["l"], p["r"], p["g"], y[1]
        if not self.spherical:
            al, al_d = y[2:]
            rates = np.array([al_d, -c / m * al_d - g / l * al])
            return 0.0, r * (m * g * al + c * l * al_d), rates, np.array([0, -r / l])
        d, v = y[2:5], y[5:8]
        d_d = v - w * np.array([-d[1], d[0], 0])
        pull = v @ v - g / l * d[2] + r / l * w * w * d[0]
        v_d = -w * np.array([-v[1], v[0], 0]) - pull * d - c / m * d_d
        v_d = v_d + np.array([r / l * w * w, 0, -g / l])
        torque = m * r * l * d[1] * pull + c * l * (
            r * d_d[1] + l * (d[0] * d_d[1] - d[1] * d_d[0])
        )
        per = r / l * np.array([d[1] * d[0], d[1] * d[1] - 1, d[1] * d[2]])
        return m * r * r * d[1] ** 2, torque, np.hstack([d_d, v_d]), np.hstack([np.zeros(3), per])

    def friction(self, w, sign):
        """Return the friction torque at the rate ``w``, with the direction ``sign`` of sliding."""
        p = self.p
        return -p["b"] * w - sign * (p["c_f"] + p["d_f"] * np.exp(-((w / p["omega_s"]) ** 2)))

    def rates(self, y, tau, sign):
        """Return the derivatives of the states under the torque ``tau``.

        ``sign`` is 1 or -1 if the hub slides, 0 if it sticks.
        """
        inertia, torque, free, per = self.liquid(y)
        acceleration = 0.0
        if sign:
            w = y[1]
            acceleration = (tau + torque + self.friction(w, sign)) / (self.fixed + inertia)
        return np.hstack([y[1] if sign else 0.0, acceleration, free + per * acceleration])

    def contact(self, y, tau):
        """Return 0 if a hub at rest sticks under the torque ``tau``, or the sign of its sliding."""
        load = tau + self.liquid(y)[1]
        return 0 if abs(load) <= self.p["c_f"] + self.p["d_f"] else int(np.sign(load))

    def run(self, case):
        """Simulate a case and return its rows; stopping and breaking away are events."""
        times, rows = cases.row_times(case), []
        y, sign = self.start(), 0
        most = self.p["c_f"] + self.p["d_f"]
        for begin, end, (tau,) in cases.segments(case):
            t = begin
            if y[1] == 0.0:
                sign = self.contact(y, tau)
            inside = times[(times >= begin - 1e-9) & (times < end - 1e-9)]
            while t < end:
                if sign:
                    # positive while the hub slides; 0 at the start of sliding
                    def event(t, y, sign=sign):
                        return y[1] * sign

                    event.direction = -1
                    events = [event]
                else:
                    events = []
                    for side in (1, -1):

                        def event(t, y, side=side, tau=tau):
                            return side * (tau + self.liquid(y)[1]) - most

                        event.direction = 1
                        events.append(event)
                for each in events:
                    each.terminal = True
                found = solve_ivp(
                    lambda t, y, sign=sign, tau=tau: self.rates(y, tau, sign), (t, end), y, METHOD,
                    events=events, dense_output=True, max_step=0.02, **TOLERANCE,
                )  # fmt: skip
                reached = found.t[-1]
                among = inside[(inside >= t - 1e-12) & (inside < reached - 1e-12)]
                for at in among:
                    rows.append(np.hstack([at, self.outputs(found.sol(max(at, t)))]))
                inside = inside[inside >= reached - 1e-12]
                t, y = reached, found.y[:, -1]
                if found.status == 1:
                    if sign:
                        y = y.copy()
                        y[1] = 0.0
                        sign = self.contact(y, tau)
                    else:
                        sign = 1 if len(found.t_events[0]) else -1
        rows.append(np.hstack([times[-1], self.outputs(y)]))
        return np.array(rows)

    def outputs(self, y):
        """Return the values of one row of results.csv after the time: the first states."""
        return y[:3] if not self.spherical else y[:4]


# --------------------------------------------------------------------------------------- six axes


def craft_rates(p, y, force, torque):
    """Return the derivatives of the states of a craft with pendulums: q, omega, velocity, p, p'.

    ``p`` has the parameters, and ``y`` the states; force and torque act in body axes.
    """
    q, w = y[:4], y[4:7]
    s, mass = p["center"], p["mass"]
    origin = cases.inertia(p) - mass * skew(s) @ skew(s)
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = mass * np.eye(3)
    matrix[:3, 3:] = -mass * skew(s)
    matrix[3:, :3] = mass * skew(s)
    matrix[3:, 3:] = origin
    right = np.hstack([force - mass * cross(w, cross(w, s)), torque - cross(w, origin @ w)])
    bobs = []
    for i, tank in enumerate(p["tank"]):
        d, d_d = y[10 + 6 * i : 13 + 6 * i], y[13 + 6 * i : 16 + 6 * i]
        m, l, k, e = tank["m"], tank["l"], tank["k"], tank["axis"]
        rho = tank["hinge"] + l * d
        across = d - e * (e @ d)
        drag = tank["c"] * l * d_d + k * l * across
        known = cross(w, cross(w, rho)) + 2 * l * cross(w, d_d)
        u = np.hstack([d, cross(tank["hinge"], d)])
        pull = m * (l * (d_d @ d_d) - d @ known) - k * l * (across @ across)
        matrix += m * np.outer(u, u)
        right += np.hstack([pull * d + drag, pull * cross(tank["hinge"], d) + cross(rho, drag)])
        bobs.append((m, l, d, u, rho, drag, known, pull))
    solved = np.linalg.solve(matrix, right)
    a, w_d = solved[:3], solved[3:]
    rates = [quaternion_rate(q, w), w_d, rotation(q) @ a]
    for i, (m, l, d, u, rho, drag, known, pull) in enumerate(bobs):
        tension = pull - m * (u @ solved)
        rates += [
            y[13 + 6 * i : 16 + 6 * i],
            -(a + cross(w_d, rho) + known + tension / m * d + drag / m) / l,
        ]
    return np.hstack(rates)


def draining_rates(p, y, force, torque):
    """Return the derivatives of the states of a craft that drains; the last is the liquid's mass.

    ``p`` has the parameters, and ``y`` the states; force and torque act in body axes.
    """
    q, w, d, d_d, liquid = y[:4], y[4:7], y[10:13], y[13:16], y[16]
    f, l, e = p["flow"], p["l"], np.array([0.0, 0.0, 1.0])
    place, out = p["position"], p["position"] + p["outlet"] * e
    m, m_d = p["mu"] * liquid, -p["mu"] * f
    rigid, rigid_d = (1 - p["mu"]) * liquid, -(1 - p["mu"]) * f
    height, height_d = p["H_b"] + p["H_M"] * liquid, -p["H_M"] * f
    h, h_d = p["h_b"] + p["h_M"] * liquid + l, -p["h_M"] * f
    s, s_d = place + height * e, height_d * e
    own = p["iota"] * liquid * np.diag([1.0, 1.0, 0.0])
    own_d = -p["iota"] * f * np.diag([1.0, 1.0, 0.0])

    def moment(mass, a, b):  # returns one term of the integral of r x (w x r) over the mass
        return -mass * skew(a) @ skew(b)

    rigid_inertia_d = own_d + moment(rigid_d, s, s) + moment(rigid, s_d, s) + moment(rigid, s, s_d)
    mass = p["mass"] + rigid
    first = p["mass"] * p["center"] + rigid * s
    origin = cases.inertia(p) + moment(p["mass"], p["center"], p["center"])
    origin = origin + own + moment(rigid, s, s)
    hinge = place + h * e
    rho, rho_d = hinge + l * d, h_d * e + l * d_d
    across, across_d = d - e * (e @ d), d_d - e * (e @ d_d)
    b, b_d = h + l * (e @ d), h_d + l * (e @ d_d)
    j = rigid_d * height + rigid * height_d + m_d * b + f * p["outlet"]
    j_d = 2 * rigid_d * height_d + m_d * b_d
    aside, aside_d = m_d * l * across, m_d * l * across_d
    momentum, momentum_d = j * e + aside, j_d * e + aside_d
    foot = place + b * e
    turning = cross(place, j * e) + cross(foot, aside)
    turning_d = cross(place, j_d * e) + cross(foot, aside_d) + cross(b_d * e, aside)
    drag = p["gamma"] * m * l * d_d
    known = cross(w, cross(w, rho)) + 2 * cross(w, rho_d)
    u = np.hstack([d, cross(hinge, d)])
    pull = m * (l * (d_d @ d_d) - d @ known)
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = mass * np.eye(3)
    matrix[:3, 3:] = -skew(first)
    matrix[3:, :3] = skew(first)
    matrix[3:, 3:] = origin
    matrix += m * np.outer(u, u)
    load = force - cross(w, cross(w, first)) + pull * d + drag
    load = load - 2 * cross(w, momentum) - momentum_d - m_d * rho_d
    turn = torque - cross(w, origin @ w) + pull * cross(hinge, d) + cross(rho, drag)
    turn = turn - rigid_inertia_d @ w - m_d * cross(rho, cross(w, rho) + rho_d)
    turn = turn - f * cross(out, cross(w, out)) - cross(w, turning) - turning_d
    solved = np.linalg.solve(matrix, np.hstack([load, turn]))
    a, w_d = solved[:3], solved[3:]
    tension = pull - m * (u @ solved)
    d_dd = -(a + cross(w_d, rho) + known + tension / m * d + drag / m) / l
    return np.hstack([quaternion_rate(q, w), w_d, rotation(q) @ a, d_d, d_dd, -f])


def craft(case):
    """Return the rows of a case in six axes."""
    p = cases.parameters(case)
    tanks = p.get("tank") or [p]
    bobs = [np.hstack([tank["p_0"], tank["p_dot_0"]]) for tank in tanks]
    y = np.hstack([1, 0, 0, 0, p["omega_0"], 0, 0, 0, *bobs])
    rates = craft_rates
    if case == "draining":
        y, rates = np.hstack([y, p["M_0"]]), draining_rates
    times, rows = cases.row_times(case), []

    def row(t, y):
        rows.append(
            np.hstack([t, y[4:10], *(y[10 + 6 * i : 13 + 6 * i] for i in range(len(tanks)))])
        )

    def controlled():
        steps = round(p["end"] / p["every"])
        for k in range(steps):
            wanted = np.array([0, 0, p["spin"]])
            torque = np.clip(p["K"] * (wanted - y[4:7]), -p["most"], p["most"])
            yield k * p["every"], (k + 1) * p["every"], np.hstack([np.zeros(3), torque])

    for begin, end, wrench in controlled() if case == "spinner" else cases.segments(case):
        inside = times[(times >= begin - 1e-9) & (times < end - 1e-9)]
        at = np.unique(np.hstack([begin, np.clip(inside, begin, end), end]))
        found = solve_ivp(
            lambda t, y, wrench=wrench: rates(p, y, wrench[:3], wrench[3:]),
            (begin, end), y, METHOD, at, **TOLERANCE,
        )  # fmt: skip
        for t in inside:
            row(t, found.y[:, np.argmin(np.abs(found.t - t))])
        y = found.y[:, -1]
    row(times[-1], y)
    return np.array(rows)


def linearisation():
    p, rows = cases.parameters("linearisation"), []
    m, l, c, mass, z_c, z_p = (p[name] for name in ("m", "l", "c", "mass", "z_c", "hinge"))
    g, z_b = p["thrust"] / (mass + m), z_p - l
    origin = p["J"] + mass * z_c**2
    for frequency in cases.frequencies():
        s = 1j * frequency
        pull = m * g + c * l * s  # force of the bob on the craft per p_x
        turn = m * g * z_p + c * l * s * z_b
        # unknowns: a_x, omega_y, p_x
        matrix = np.array([
            [mass, mass * z_c * s, -pull],
            [mass * z_c, origin * s, -turn],
            [m, m * z_b * s, m * l * s * s + pull],
        ])  # fmt: skip
        rate = np.linalg.solve(matrix, [0, 1, 0])[1]
        force = np.linalg.solve(matrix, [1, 0, 0])[0]
        rows.append([frequency, rate.real, rate.imag, force.real, force.imag])
    return np.array(rows)


# ------------------------------------------------------------------------------ finite amplitude


def backbones():
    """Return the frequency of free waves at each amplitude of the case "backbones"."""
    rows = []
    for number, (_, degrees, s, kappa) in enumerate(cases.inputs_of_backbones(), 1):
        largest = np.sin(np.radians(degrees))

        def slope(x, kappa=kappa):
            return x / np.sqrt(1 - x * x) + (kappa - 1) / 2 * x**3

        def time(u, s=s, kappa=kappa, largest=largest, slope=slope):  # x = A sin u
            x = largest * np.sin(u)
            inertia = 1 + slope(x) ** 2 + (s - 1) * x * x
            # (rise(A) - rise(x))/(A^2 - x^2), without loss of digits near x = A
            a2, x2 = largest**2, x * x
            fall = 1 / (np.sqrt(1 - x2) + np.sqrt(1 - a2)) + (kappa - 1) / 8 * (a2 + x2)
            return np.sqrt(inertia / (2 * fall))

        quarter = quad(time, 0, np.pi / 2, epsabs=1e-13, epsrel=1e-13)[0]
        rows.append([number, np.pi / 2 / quarter, np.sqrt(slope(largest) / largest)])
    return np.array(rows)


def forced():
    """Return cosine and sine amplitude of the liquid's centre in the case "forced".

    They are fitted to the last 15 of 150 periods.
    """
    p, rows = cases.parameters("forced"), []
    m, l, g, s, kappa = (p[name] for name in ("m", "l", "g", "s", "kappa"))
    natural = np.sqrt(g / l)
    c = 2 * p["zeta"] * m * natural
    for number, forcing in enumerate(p["forcing"], 1):
        w, stroke = forcing["ratio"] * natural, forcing["stroke"]

        def rates(t, y, w=w, stroke=stroke):
            # q is the displacement of the bob over l; z(u) with u = |q|^2 is its height over l
            q, q_d = y[:2], y[2:]
            u = q @ q
            root = np.sqrt(1 - u)
            z1 = 1 / (2 * root) + (kappa - 1) / 4 * u  # dz/du
            z2 = 1 / (4 * root**3) + (kappa - 1) / 4
            v = q @ q_d
            # damping acts on the velocity of p along its surface
            lift = 2 * z1 * v
            n = 4 * z1 * z1 + (s - 1)
            # [1 + n q q^T] q'' = right
            inner = 2 * z1 * (4 * z2 * v * v + 2 * z1 * (q_d @ q_d)) + (s - 1) * (q_d @ q_d)
            slope = 2 * z1 * q
            right = -np.array([stroke * w * w * np.cos(w * t), 0]) / l - g / l * slope
            right = right - c / m * (q_d + slope * lift) - q * inner
            return np.hstack([q_d, right - n * q * (q @ right) / (1 + n * u)])

        start = np.array([0.0, p["across"], 0.0, 0.0])
        period = 2 * np.pi / w
        at = period * np.hstack([0, 135 + np.arange(15 * 64 + 1) / 64])
        found = solve_ivp(rates, (0, at[-1]), start, METHOD, at, rtol=1e-12, atol=1e-14)
        rows.append([number, *fit(at[1:-1], 1e3 * p["share"] * l * found.y[0, 1:-1], w)])
    return np.array(rows)


def fit(t, x, w):
    """Return the coefficients of cos wt and sin wt in x over whole periods."""
    return 2 * np.mean(x * np.cos(w * t)), 2 * np.mean(x * np.sin(w * t))


CASES = {
    "bench_linear": lambda: Bench("bench_linear").run("bench_linear"),
    "bench_spherical": lambda: Bench("bench_spherical").run("bench_spherical"),
    "thrust": lambda: craft("thrust"),
    "weightless": lambda: craft("weightless"),
    "draining": lambda: craft("draining"),
    "spinner": lambda: craft("spinner"),
    "linearisation": linearisation,
    "backbones": backbones,
    "forced": forced,
}


if __name__ == "__main__":
    cases.run(CASES)
