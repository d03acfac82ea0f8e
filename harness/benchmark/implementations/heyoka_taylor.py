"""Computes the cases by heyoka's Taylor integrator, with other equations than those of the pages.

    python3 heyoka_taylor.py RESULTS_FOLDER [CASE ...]

Bench and waves: Lagrange's equations, differentiated by heyoka. Six axes: the unknowns include the
inertial velocities of the bobs and the tensions of the rods. Draining: balances of linear and
angular momentum, differentiated by heyoka.
"""

import heyoka as hy
import numpy as np

import cases

Matrix = list[list]
BREAKS_AWAY = 1e-4
"""Time after the beginning of sliding in which no stop of the hub is searched, s."""


def dot(a, b):
    return sum((x * y for x, y in zip(a, b, strict=True)), 0.0)


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def add(*vectors):
    return [sum(parts, 0.0) for parts in zip(*vectors, strict=True)]


def scale(factor, a):
    return [factor * x for x in a]


def is_zero(x) -> bool:
    """Return True for the number 0."""
    return isinstance(x, (int, float)) and x == 0.0


def solve(matrix: Matrix, right: list) -> list:
    """Solve linear equations by Gaussian elimination without pivoting.

    ``matrix`` and ``right`` have expressions or numbers as elements.
    """
    n = len(right)
    a = [[*row, b] for row, b in zip(matrix, right, strict=True)]
    for i in range(n):
        for k in range(i + 1, n):
            if is_zero(a[k][i]):
                continue
            factor = a[k][i] / a[i][i]
            a[k][i] = 0.0
            for j in range(i + 1, n + 1):
                if not is_zero(a[i][j]):
                    a[k][j] = a[k][j] - factor * a[i][j]
    x = [0.0] * n
    for i in reversed(range(n)):
        known = a[i][n] - dot(a[i][i + 1 : n], x[i + 1 :]) if i + 1 < n else a[i][n]
        x[i] = known / a[i][i]
    return x


def names(*groups: str) -> list:
    """Return variables by name; "a:3" stands for a_0, a_1, a_2."""
    made = []
    for each in groups:
        name, _, count = each.partition(":")
        made += [f"{name}_{i}" for i in range(int(count or 1))]
    return [hy.expression(name) for name in made]


def attitude(q, w, a):
    """Return q' for the quaternion q at the rate ``w``, and ``a`` in inertial axes."""
    s, v = q[0], q[1:]
    q_d = [-0.5 * dot(v, w), *(0.5 * x for x in add(scale(s, w), cross(v, w)))]
    t = scale(2.0, cross(v, a))
    return q_d, add(a, scale(s, t), cross(v, t))


# ------------------------------------------------------------------------------ bench, friction


def lagrange(lagrangian, force, coordinates, rates):
    """Return matrix and right-hand side of Lagrange's equations, linear in the accelerations.

    ``force`` has the generalised forces.
    """
    matrix, right = [], []
    for q, v, f in zip(coordinates, rates, force, strict=True):
        momentum = hy.diff(lagrangian, v)
        matrix.append([hy.diff(momentum, other) for other in rates])
        drift = sum(
            (hy.diff(momentum, c) * r for c, r in zip(coordinates, rates, strict=True)),
            hy.expression(0.0),
        )
        right.append(f + hy.diff(lagrangian, q) - drift)
    return matrix, right


class Bench:
    """Hub and slosh mass (bob) of the bench, with dry friction.

    The coordinates are theta and alpha, or theta and the stereographic coordinates of the slosh
    mass.
    """

    def __init__(self, case: str):
        """Create an integrator for each contact: sliding forwards, sliding backwards, sticking."""
        p = cases.parameters(case)
        self.spherical = case == "bench_spherical"
        c = 2 * p["zeta"] * p["m"] * np.sqrt(p["g"] / p["l"])
        fixed = p["I"] + p["m_0"] * p["r"] ** 2
        m, l, r, g = p["m"], p["l"], p["r"], p["g"]
        tau, sign = hy.par[0], hy.par[1]
        if self.spherical:
            theta, x, y, w, x_d, y_d = names("theta", "x", "y", "w", "u", "v")
            k = 2.0 / (1.0 + x * x + y * y)
            bob = [k * x, k * y, 1.0 - k]
            bob_d = [hy.diff(b, x) * x_d + hy.diff(b, y) * y_d for b in bob]
            place = [r + l * bob[0], l * bob[1], l * bob[2]]
            swing = scale(l, bob_d)
            velocity = [swing[0] - w * place[1], swing[1] + w * place[0], swing[2]]
            energy = 0.5 * m * dot(velocity, velocity) - m * g * place[2]
            coordinates, rates = [theta, x, y], [w, x_d, y_d]
            # damping by Rayleigh's dissipation function; its reaction is internal to the system
            rayleigh = 0.5 * c * dot(swing, swing)
        else:
            theta, x, w, x_d = names("theta", "x", "w", "u")
            energy = 0.5 * m * (r * w + l * x_d) * (r * w + l * x_d) - 0.5 * m * g * l * x * x
            coordinates, rates = [theta, x], [w, x_d]
            rayleigh = 0.5 * c * l * l * x_d * x_d
        energy = energy + 0.5 * fixed * w * w
        dry = p["c_f"] + p["d_f"] * hy.exp(-w * w / p["omega_s"] ** 2)
        force = [tau - p["b"] * w - sign * dry, *(-hy.diff(rayleigh, v) for v in rates[1:])]
        matrix, right = lagrange(energy, force, coordinates, rates)
        free = solve(matrix, right)
        held = solve([row[1:] for row in matrix[1:]], right[1:])
        # torque that holds a hub at rest
        held_load = right[0] - dot(matrix[0][1:], held)
        load = hy.subs(held_load, {w: hy.expression(0.0), sign: hy.expression(0.0)})
        most = p["c_f"] + p["d_f"]
        sliding = [*zip(coordinates, rates, strict=True), *zip(rates, free, strict=True)]
        still = hy.expression(0.0)
        sticking = [
            (theta, still), *zip(coordinates[1:], rates[1:], strict=True),
            (w, still), *zip(rates[1:], (hy.subs(h, {w: still}) for h in held), strict=True),
        ]  # fmt: skip
        down = hy.event_direction.negative
        up = hy.event_direction.positive
        self.n = len(coordinates)
        zeros = np.zeros(2 * self.n)
        leave = [
            hy.t_event(load - most, direction=up), hy.t_event(-load - most, direction=up)
        ]  # fmt: skip
        options = {"tol": 1e-16, "compact_mode": True}
        self.slide = {
            side: hy.taylor_adaptive(
                sliding, zeros, pars=[0, 0], t_events=[hy.t_event(w, direction=way)], **options
            )
            for side, way in ((1, down), (-1, up))
        }
        # separate integrator without events for the start of sliding, where the event at rate 0
        # would end it at once
        self.leave = hy.taylor_adaptive(sliding, zeros, pars=[0, 0], **options)
        self.stick = hy.taylor_adaptive(sticking, zeros, pars=[0], t_events=leave, **options)
        self.load = hy.cfunc([load], [*coordinates, *rates])
        self.most = most
        self.p = p

    def start(self):
        p = self.p
        if not self.spherical:
            return np.array([0.0, p["alpha_0"], 0.0, 0.0])
        x, y = p["p_x_0"], p["p_y_0"]
        k = 1 + np.sqrt(1 - x * x - y * y)
        return np.array([0.0, x / k, y / k, 0.0, 0.0, 0.0])

    def columns(self, y):
        if not self.spherical:
            return [y[0], y[2], y[1]]
        k = 2 / (1 + y[1] ** 2 + y[2] ** 2)
        return [y[0], y[3], k * y[1], k * y[2]]

    def run(self, case: str):
        times, rows = cases.row_times(case), []
        y, n = self.start(), self.n
        sign, breaks_away = 0, False
        for begin, end, (tau,) in cases.segments(case):
            stops = np.hstack([times[(times > begin + 1e-9) & (times < end - 1e-9)], end])
            if np.any(np.abs(times - begin) < 1e-9):
                rows.append([begin, *self.columns(y)])
            t = begin
            if y[n] == 0.0:
                sign = self.contact(y, tau)
            for stop in stops:
                while t < stop:
                    ta = self.slide[sign] if sign else self.stick
                    until = stop
                    if breaks_away:
                        ta, until, breaks_away = self.leave, min(stop, t + BREAKS_AWAY), False
                    ta.time = t
                    ta.state[:] = y
                    ta.pars[:] = [tau, sign][: len(ta.pars)]
                    if ta is not self.leave:
                        ta.reset_cooldowns()
                    outcome = ta.propagate_until(until, max_delta_t=0.02)[0]
                    t, y = ta.time, ta.state.copy()
                    if outcome == hy.taylor_outcome.time_limit:
                        t = until
                        continue
                    number = (
                        -int(outcome.value) - 1 if int(outcome.value) < 0 else int(outcome.value)
                    )
                    if sign:
                        y[n] = 0.0
                        sign = self.contact(y, tau)
                    else:
                        sign, breaks_away = 1 if number == 0 else -1, True
                if stop < end - 1e-9:
                    rows.append([stop, *self.columns(y)])
        rows.append([times[-1], *self.columns(y)])
        return np.array(rows)

    def contact(self, y, tau: float) -> int:
        """Return 0 if a hub at rest sticks under the torque ``tau``, or the sign of its sliding."""
        load = self.load(y, pars=np.array([tau]))[0]
        return 0 if abs(load) <= self.most else int(np.sign(load))


# --------------------------------------------------------------------------------------- six axes


def rigid_rows(p: dict, first, origin) -> Matrix:
    """Return the mass matrix of a rigid body about O: six rows for force and torque.

    ``p`` is the mass, ``first`` the mass times the centre of mass, and ``origin`` the inertia about
    O.
    """
    x, y, z = first
    mass = p
    top = [[mass, 0.0, 0.0, 0.0, z, -y], [0.0, mass, 0.0, -z, 0.0, x], [0.0, 0.0, mass, y, -x, 0.0]]
    low = [[0.0, -z, y, *origin[0]], [z, 0.0, -x, *origin[1]], [-y, x, 0.0, *origin[2]]]
    return [*top, *low]


def craft_system(p: dict):
    """Return the equations of motion of a craft with pendulums.

    Force and torque are parameters of the equations.
    """
    q, w, v = names("q:4"), names("w:3"), names("v:3")
    force, torque = hy.par[0], hy.par[3]
    force, torque = [hy.par[i] for i in range(3)], [hy.par[i] for i in range(3, 6)]
    mass, s = p["mass"], p["center"]
    origin = cases.inertia(p) + mass * (s @ s * np.eye(3) - np.outer(s, s))
    count = len(p["tank"])
    matrix = [
        [*row, *[0.0] * count] for row in rigid_rows(mass, (mass * s).tolist(), origin.tolist())
    ]
    angular = [dot(row, w) for row in origin.tolist()]
    right = [
        *add(force, scale(-mass, cross(w, cross(w, s.tolist())))),
        *add(torque, scale(-1.0, cross(w, angular))),
    ]
    bobs = []
    for i, tank in enumerate(p["tank"]):
        d, u = names(f"p{i}:3"), names(f"u{i}:3")
        m, l, k, e = tank["m"], tank["l"], tank["k"], tank["axis"].tolist()
        hinge = tank["hinge"].tolist()
        d_d = add(u, scale(-1.0, cross(w, d)))
        across = add(d, scale(-dot(e, d), e))
        drag = (
            add(scale(tank["c"] * l, d_d), scale(k * l, across)) if k else scale(tank["c"] * l, d_d)
        )
        lever = cross(hinge, d)
        swirl = cross(w, cross(w, hinge))
        # eliminate the tension of each rod by |p| = 1, which gives p.(u' + w x u) = -|u|^2
        row = [m * x for x in [*d, *lever]] + [0.0] * count
        row[6 + i] = 1.0
        held = m * (l * dot(u, u) - dot(d, swirl))
        held = held - k * l * dot(across, across) if k else held
        for j, x in enumerate([*d, *lever]):
            matrix[j][6 + i] = -x
        place = add(hinge, scale(l, d))
        right = [r + x for r, x in zip(right, [*drag, *cross(place, drag)], strict=True)]
        bobs.append((row, held, d, u, d_d, swirl, drag, tank))
    for row, held, *_ in bobs:
        matrix.append(row)
        right.append(held)
    solved = solve(matrix, right)
    a, w_d, tensions = solved[:3], solved[3:6], solved[6:]
    q_d, v_d = attitude(q, w, a)
    equations = [*zip(q, q_d, strict=True), *zip(w, w_d, strict=True), *zip(v, v_d, strict=True)]
    for (_, _, d, u, d_d, swirl, drag, tank), tension in zip(bobs, tensions, strict=True):
        m, l, hinge = tank["m"], tank["l"], tank["hinge"].tolist()
        at_hinge = add(a, cross(w_d, hinge), swirl)
        pulled = add(scale(tension / m, d), scale(1 / m, drag), at_hinge)
        u_d = add(scale(-1 / l, pulled), scale(-1.0, cross(w, u)))
        equations += [*zip(d, d_d, strict=True), *zip(u, u_d, strict=True)]
    start = [1.0, 0.0, 0.0, 0.0, *p["omega_0"], 0.0, 0.0, 0.0]
    for tank in p["tank"]:
        start += [*tank["p_0"], *(tank["p_dot_0"] + np.cross(p["omega_0"], tank["p_0"]))]
    return equations, start


def draining_system(p: dict):
    """Return the equations of the craft that drains, from linear and angular momentum about O.

    P = m V + w x S + K + m_b rho', H = S x V + I w + L + m_b rho x rho',
    P' = F - f (V + w x r_o), H' = tau - f r_o x (V + w x r_o) - V x P; in body axes, derivatives
    have the additional terms - w x P and - w x H.
    """
    q, w, vi = names("q:4"), names("w:3"), names("v:3")
    d, d_d, (liquid,) = names("p:3"), names("pd:3"), names("liquid")
    vb = names("vb:3")  # velocity of O in body axes; the equations do not depend on it
    force, torque = [hy.par[i] for i in range(3)], [hy.par[i] for i in range(3, 6)]
    f, l, mu = p["flow"], p["l"], p["mu"]
    e, place = [0.0, 0.0, 1.0], p["position"].tolist()
    out = add(place, scale(p["outlet"], e))
    m, m_d = mu * liquid, -mu * f
    rigid, rigid_d = (1 - mu) * liquid, -(1 - mu) * f
    height, height_d = p["H_b"] + p["H_M"] * liquid, -p["H_M"] * f
    h, h_d = p["h_b"] + p["h_M"] * liquid + l, -p["h_M"] * f
    s = add(place, scale(height, e))
    rho = add(place, scale(h, e), scale(l, d))
    rho_d = add(scale(h_d, e), scale(l, d_d))
    first = add((p["mass"] * p["center"]).tolist(), scale(rigid, s), scale(m, rho))
    total = p["mass"] + liquid
    dry = cases.inertia(p) + p["mass"] * (
        p["center"] @ p["center"] * np.eye(3) - np.outer(p["center"], p["center"])
    )
    spin = [dot(row, w) for row in dry.tolist()]
    own = [p["iota"] * liquid * w[0], p["iota"] * liquid * w[1], 0.0]
    about = [scale(mass, cross(x, cross(w, x))) for mass, x in ((rigid, s), (m, rho))]
    b = h + l * d[2]
    j = rigid_d * height + rigid * height_d + m_d * b + f * p["outlet"]
    aside = [m_d * l * d[0], m_d * l * d[1], 0.0]
    flow = add(scale(j, e), aside)
    turning = add(cross(place, scale(j, e)), cross(add(place, scale(b, e)), aside))
    momentum = add(scale(total, vb), cross(w, first), flow, scale(m, rho_d))
    angular = add(cross(first, vb), spin, own, *about, turning, scale(m, cross(rho, rho_d)))
    outlet_v = add(vb, cross(w, out))
    leaving = scale(f, outlet_v)
    p_rate = add(force, scale(-1.0, leaving), scale(-1.0, cross(w, momentum)))
    h_rate = add(
        torque, scale(-1.0, cross(out, leaving)),
        scale(-1.0, cross(w, angular)), scale(-1.0, cross(vb, momentum)),
    )  # fmt: skip
    balances, wanted = [*momentum, *angular], [*p_rate, *h_rate]
    matrix, right = [], []
    known = [*zip(d, d_d, strict=True), (liquid, hy.expression(-f))]
    for balance, rate in zip(balances, wanted, strict=True):
        balance = hy.expression(balance)
        per = [hy.diff(balance, x) for x in [*vb, *w, *d_d]]
        drift = sum((hy.diff(balance, x) * x_d for x, x_d in known), hy.expression(0.0))
        matrix.append([*per, 0.0])
        right.append(rate - drift)
    # the bob: m (V' + w x V + w' x rho + ...) = -T p - damping; unknowns are V', w', p'' and T. The
    # equations are the same in every inertial frame, so that V can be set to 0
    for i in range(3):
        row = [0.0] * 10
        row[i] = m
        row[6 + i] = m * l
        row[9] = d[i]
        unit = [[0.0, rho[2], -rho[1]], [-rho[2], 0.0, rho[0]], [rho[1], -rho[0], 0.0]]
        for k in range(3):
            if not is_zero(unit[i][k]):
                row[3 + k] = m * unit[i][k]
        swirl = add(cross(w, cross(w, rho)), scale(2.0, cross(w, rho_d)))
        matrix.append(row)
        right.append(-m * swirl[i] - m * p["gamma"] * l * d_d[i])
    matrix.append([0.0] * 6 + [*d, 0.0])
    right.append(-dot(d_d, d_d))
    # the equations of the bobs come first, so that no pivot of the elimination is 0
    order = [6, 7, 8, 9, *range(6)]
    columns = [6, 7, 8, 9, *range(6)]
    still = {x: hy.expression(0.0) for x in vb}
    matrix = [[matrix[i][k] for k in columns] for i in order]
    right = [hy.subs(hy.expression(right[i]), still) for i in order]
    matrix = [
        [x if is_zero(x) else hy.subs(hy.expression(x), still) for x in row] for row in matrix
    ]
    solved = solve(matrix, right)
    d_dd, a, w_d = solved[:3], solved[4:7], solved[7:]
    q_d, v_d = attitude(q, w, a)
    equations = [
        *zip(q, q_d, strict=True), *zip(w, w_d, strict=True), *zip(vi, v_d, strict=True),
        *zip(d, d_d, strict=True), *zip(d_d, d_dd, strict=True), (liquid, hy.expression(-f)),
    ]  # fmt: skip
    start = [1.0, 0.0, 0.0, 0.0, *p["omega_0"], 0.0, 0.0, 0.0, *p["p_0"], *p["p_dot_0"], p["M_0"]]
    return equations, start


def craft(case: str):
    """Return the rows of a case in six axes."""
    p = cases.parameters(case)
    equations, start = (draining_system if case == "draining" else craft_system)(p)
    ta = hy.taylor_adaptive(equations, start, pars=[0.0] * 6, tol=1e-16, compact_mode=True)
    times, rows = cases.row_times(case), []
    count = 1 if case == "draining" else len(p["tank"])

    def row(t):
        y = ta.state
        rows.append([t, *y[4:10], *(x for i in range(count) for x in y[10 + 6 * i : 13 + 6 * i])])

    def pieces():
        if case != "spinner":
            yield from cases.segments(case)
            return
        for k in range(round(p["end"] / p["every"])):
            error = np.array([0, 0, p["spin"]]) - ta.state[4:7]
            torque = np.clip(p["K"] * error, -p["most"], p["most"])
            yield k * p["every"], (k + 1) * p["every"], np.hstack([np.zeros(3), torque])

    for begin, end, wrench in pieces():
        ta.time = begin
        ta.pars[:] = wrench
        for t in times[(times >= begin - 1e-9) & (times < end - 1e-9)]:
            ta.propagate_until(max(t, begin))
            row(t)
        ta.propagate_until(end)
    row(times[-1])
    return np.array(rows)


def linearisation():
    """Return the frequency responses of the nonlinear equations, differentiated by heyoka."""
    p = cases.parameters("linearisation")
    equations, start = craft_system(cases.linearised_craft())
    variables = [x for x, _ in equations]
    rates = [hy.expression(rate) for _, rate in equations]
    inputs = [hy.par[4], hy.par[0]]
    jacobian = hy.cfunc(
        [hy.diff(rate, x) for rate in rates for x in [*variables, *inputs]], variables
    )(np.array(start), pars=np.array([0, 0, p["thrust"], 0, 0.0]))
    jacobian = jacobian.reshape(len(rates), -1)
    n = len(rates)
    a, b = jacobian[:, :n], jacobian[:, n:]
    # the specific force at O is the derivative of the velocity without the change of attitude
    at = [str(x) for x in variables].index("v_0")
    c = a[at].copy()
    c[:4] = 0.0
    rows = []
    for frequency in cases.frequencies():
        x = np.linalg.solve(1j * frequency * np.eye(n) - a, b)
        rate, force = x[5, 0], c @ x[:, 1] + b[at, 1]
        rows.append([frequency, rate.real, rate.imag, force.real, force.imag])
    return np.array(rows)


# ------------------------------------------------------------------------------ finite amplitude


def wave(s, kappa, g, l):
    """Return the Lagrangian of a slosh mass on its surface, divided by m l², coordinates and rates.

    s and kappa are the coefficients of third order, g the specific force, and l the length.
    """
    x, y, x_d, y_d = names("x", "y", "u", "v")
    u = x * x + y * y
    rise = 1.0 - hy.sqrt(1.0 - u) + (kappa - 1) / 8 * u * u
    rise_d = hy.diff(rise, x) * x_d + hy.diff(rise, y) * y_d
    inner = x * x_d + y * y_d
    motion = [x_d, y_d, rise_d]
    lagrangian = 0.5 * (dot(motion, motion) + (s - 1) * inner * inner) - g / l * rise
    return lagrangian, motion, [x, y], [x_d, y_d]


def backbones():
    """Return the frequency of free waves at each amplitude of the case "backbones".

    Planar waves are integrated over a quarter period; in circular waves forces balance.
    """
    rows = []
    s, kappa = hy.par[0], hy.par[1]
    lagrangian, _, places, rates = wave(s, kappa, 1.0, 1.0)
    matrix, right = lagrange(lagrangian, [hy.expression(0.0)] * 2, places, rates)
    equations = [*zip(places, rates, strict=True),
                 *zip(rates, solve(matrix, right), strict=True)]  # fmt: skip
    event = hy.t_event(places[0])
    ta = hy.taylor_adaptive(equations, np.zeros(4), pars=[0.0, 0.0], t_events=[event], tol=1e-16,
                            compact_mode=True)  # fmt: skip
    rate_of = hy.cfunc([e for _, e in equations], [*places, *rates])
    for number, (_, degrees, *pair) in enumerate(cases.inputs_of_backbones(), 1):
        largest = np.sin(np.radians(degrees))
        ta.time = 0.0
        ta.state[:] = [largest, 0, 0, 0]
        ta.pars[:] = pair
        ta.reset_cooldowns()
        ta.propagate_until(100.0)

        # x'' is linear in the squared speed, and equals -speed^2/A on a circle of radius A
        def radial(speed, largest=largest, pair=pair):
            return rate_of(np.array([largest, 0, 0, speed]), pars=np.array(pair))[2]

        at_rest, faster = radial(0.0), radial(1.0)
        square = -at_rest / (faster - at_rest + 1 / largest)
        rows.append([number, np.pi / 2 / ta.time, np.sqrt(square) / largest])
    return np.array(rows)


def forced():
    """Return cosine and sine amplitude of the liquid's centre in the case "forced".

    They are fitted to the last 15 of 150 periods.
    """
    p = cases.parameters("forced")
    natural = np.sqrt(p["g"] / p["l"])
    lagrangian, motion, places, rates = wave(p["s"], p["kappa"], p["g"], p["l"])
    w, stroke = hy.par[0], hy.par[1]
    rayleigh = p["zeta"] * natural * dot(motion, motion)
    push = -stroke * w * w / p["l"] * hy.cos(w * hy.time)
    force = [push - hy.diff(rayleigh, rates[0]), -hy.diff(rayleigh, rates[1])]
    matrix, right = lagrange(lagrangian, force, places, rates)
    equations = [*zip(places, rates, strict=True),
                 *zip(rates, solve(matrix, right), strict=True)]  # fmt: skip
    ta = hy.taylor_adaptive(equations, np.zeros(4), pars=[0.0, 0.0], tol=1e-16, compact_mode=True)
    rows = []
    for number, forcing in enumerate(p["forcing"], 1):
        omega = forcing["ratio"] * natural
        ta.time = 0.0
        ta.state[:] = [0.0, p["across"], 0.0, 0.0]
        ta.pars[:] = [omega, forcing["stroke"]]
        at = 2 * np.pi / omega * np.hstack([0, 135 + np.arange(15 * 64 + 1) / 64])
        found = ta.propagate_grid(at)[-1]
        x = 1e3 * p["share"] * p["l"] * found[1:-1, 0]
        turned = omega * at[1:-1]
        rows.append([number, 2 * np.mean(x * np.cos(turned)), 2 * np.mean(x * np.sin(turned))])
    return np.array(rows)


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
