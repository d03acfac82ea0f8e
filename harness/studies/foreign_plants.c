/* Slosh bench with effects that HubSlosh does not have; foreign_plants.py compiles and calls it.
 *
 * The hub (inertia I_a, angle theta) carries the motor, the gyro and the bearing's dry friction. A second body (I_b, angle
 * phi) is connected to it by a shaft with a spring, a damper and backlash. The tank is on the hub or on the second body.
 * Linear slosh is a pendulum for each mode with the angle a,
 *     I w' = N + r sum m (g a + 2 zeta wn l a'),   a'' = -2 zeta wn a' - g a / l - r w' / l,
 * planar and spherical slosh are the pendulum without linearisation (one mode). The fourth-order Runge-Kutta method
 * integrates; the instants at which the hub stops and breaks away are found by bisection.
 */
#include <math.h>
#include <string.h>

enum { LINEAR, PLANAR, SPHERICAL };
enum { THETA, W, PHI, V, MODE, N = MODE + 8 };

/* SI units */
struct bench {
    double I_a, I_b;           /* including the rigid liquid */
    double stiffness, shaft_damping, play;
    double r, g, m[2], l[2], zeta[2];
    double b, c, d, omega_s, asymmetry;
    double drag;               /* N.m.s2, factor of the square of the rate */
    double cable;              /* N.m/rad */
    double imbalance;          /* N.m, factor of the sine of the angle */
    double periodic;           /* fraction of the dry friction that varies as the cosine of the angle */
    double drift;              /* fraction by which the friction grows until the end */
    double zeta_amplitude;     /* growth of the damping ratio with the slosh angle, 1/rad */
    double hardening;          /* growth of the stiffness with the square of the slosh angle, 1/rad2 */
    double leak_I, leak_m, leak_l; /* relative growth of I_a, m and l until the end */
    double duration;
    int liquid, modes, has_second, tank_on_second;
};

struct now {
    const struct bench *p;
    double u[3], t, h;         /* torque at the beginning, the middle and the end of a step, and the step */
    int stuck;
    double sign;
};

static double torque(const struct now *n, double t)
{
    double x = (t - n->t) / n->h;
    return n->u[0] * (1 - x) * (1 - 2 * x) + n->u[1] * 4 * x * (1 - x) + n->u[2] * x * (2 * x - 1);
}

/* Returns the dry friction at a rate in the direction of sign, per N.m of its law; it drifts and varies with the angle. */
static double grows(const struct bench *p, double t, double theta)
{
    return (1 + p->drift * t / p->duration) * (1 + p->periodic * cos(theta));
}

static double holds(const struct bench *p, double t, double theta, double sign)
{
    return grows(p, t, theta) * (p->c + p->d) * (1 + p->asymmetry * sign);
}

/* Slosh on a body of inertia I with the rate w on which the torque T acts. Writes the derivatives of the modes; returns the
 * body's acceleration, or, if the body is held, the torque on it. */
static double slosh(const struct bench *p, double part, const double *y, double w, double I, double T, int held, double *dy)
{
    double r = p->r, g = p->g;
    if (p->liquid == SPHERICAL) {
        double m = p->m[0], l = p->l[0], k = 2 * p->zeta[0] * sqrt(g / l);
        double x = y[0], q = y[1], xd = y[2], qd = y[3], s = sqrt(l * l - x * x - q * q);
        double zd = (x * xd + q * qd) / s, v2 = xd * xd + qd * qd + zd * zd;
        double ux = 2 * w * qd + w * w * (r + x), uy = -2 * w * xd + w * w * q;
        double inward = (x * ux + q * uy + g * s + v2) / (l * l);
        double fx = ux - x * inward - k * xd, fy = uy - q * inward - k * qd;
        double all = T + m * (q * fx - (r + x) * fy) - 2 * w * m * ((r + x) * xd + q * qd);
        double wd = held ? 0 : all / (I + m * r * r * q * q / (l * l));
        dy[0] = xd, dy[1] = qd;
        dy[2] = fx + wd * (q + x * r * q / (l * l));
        dy[3] = fy + wd * (-(r + x) + q * r * q / (l * l));
        return held ? all : wd;
    }
    if (p->liquid == PLANAR) {
        double m = p->m[0], l = p->l[0], k = 2 * p->zeta[0] * sqrt(g / l);
        double s = sin(y[0]), c = cos(y[0]), ad = y[1];
        double all = T + m * (-2 * l * l * s * c * w * ad + r * l * s * ad * ad
                              + r * c * (g * s + k * l * ad - l * w * w * s * c));
        double wd = held ? 0 : all / (I + m * (r * r + l * l) * s * s);
        dy[0] = ad;
        dy[1] = -r / l * c * wd - g / l * s + w * w * s * c - k * ad;
        return held ? all : wd;
    }
    double all = T, wd;
    for (int i = 0; i < p->modes; i++) {
        double m = p->m[i] * (1 + p->leak_m * part), l = p->l[i] * (1 + p->leak_l * part), wn = sqrt(g / l);
        double a = y[2 * i], ad = y[2 * i + 1];
        double zeta = p->zeta[i] + p->zeta_amplitude * sqrt(a * a + ad * ad / (wn * wn));
        /* acceleration of the pendulum with its hinge at rest */
        dy[2 * i + 1] = -2 * zeta * wn * ad - g / l * a * (1 + p->hardening * a * a);
        all -= r * m * l * dy[2 * i + 1];
    }
    wd = held ? 0 : all / I;
    for (int i = 0; i < p->modes; i++) {
        double l = p->l[i] * (1 + p->leak_l * part);
        dy[2 * i] = y[2 * i + 1];
        dy[2 * i + 1] -= r / l * wd;
    }
    return held ? all : wd;
}

/* Writes the derivatives; returns the torque on the hub at rest. */
static double rates(const struct now *n, double t, const double *y, double *dy)
{
    const struct bench *p = n->p;
    double w = n->stuck ? 0 : y[W], part = t / p->duration, T = torque(n, t), shaft = 0, I = p->I_a * (1 + p->leak_I * part);
    memset(dy, 0, N * sizeof *dy);
    T -= p->cable * y[THETA] + p->imbalance * sin(y[THETA]);
    if (p->has_second) {
        double twist = y[PHI] - y[THETA];
        twist = twist > p->play ? twist - p->play : twist < -p->play ? twist + p->play : 0;
        shaft = p->stiffness * twist;
        if (p->play == 0 || twist != 0) shaft += p->shaft_damping * (y[V] - w);
    }
    if (!n->stuck) {
        double curve = p->c + p->d * exp(-(w / p->omega_s) * (w / p->omega_s));
        T -= grows(p, t, y[THETA]) * n->sign * (1 + p->asymmetry * n->sign) * curve
             + (1 + p->drift * part) * p->b * w + p->drag * w * fabs(w);
    }
    double driving;
    if (p->tank_on_second) {
        dy[V] = slosh(p, part, y + MODE, y[V], p->I_b, -shaft, 0, dy + MODE);
        driving = T + shaft;
        dy[W] = driving / I;
    } else {
        if (p->has_second) dy[V] = -shaft / p->I_b;
        driving = slosh(p, part, y + MODE, w, I, T + shaft, n->stuck, dy + MODE);
        dy[W] = driving;
    }
    if (n->stuck) dy[W] = 0;
    dy[THETA] = w;
    dy[PHI] = y[V];
    return driving;
}

static void advance(const struct now *n, double t, double h, const double *from, double *to)
{
    double k[4][N], y[N];
    const double at[4] = {0, 0.5, 0.5, 1};
    for (int s = 0; s < 4; s++) {
        for (int i = 0; i < N; i++) y[i] = s ? from[i] + at[s] * h * k[s - 1][i] : from[i];
        rates(n, t + at[s] * h, y, k[s]);
    }
    for (int i = 0; i < N; i++) to[i] = from[i] + h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
}

/* Returns true if the hub has stopped or broken away between the start of the step and this state. */
static int changes(const struct now *n, double t, const double *y)
{
    double dy[N];
    if (!n->stuck) return y[W] * n->sign < 0;
    double driving = rates(n, t, y, dy);
    return fabs(driving) > holds(n->p, t, y[THETA], driving > 0 ? 1 : -1);
}

/* Integrates from rest over steps with their beginnings and lengths, and writes angle and rate at the end of each. Returns 0,
 * or 1 if a value is not finite. */
int simulate(const struct bench *p, long steps, const double *begin, const double *length, const double *u, double *angle,
             double *rate)
{
    double y[N] = {0}, next[N], dy[N];
    struct now n = {p, {0}, 0, 1, 1, 1};
    for (long k = 0; k < steps; k++) {
        memcpy(n.u, u + 3 * k, sizeof n.u);
        n.t = begin[k], n.h = length[k];
        double t = n.t, end = n.t + n.h;
        for (int tries = 0; t < end; tries++) {
            if (tries < 50 && n.stuck && changes(&n, t, y)) { /* the torque has jumped, or the hub just passed zero */
                n.sign = rates(&n, t, y, dy) > 0 ? 1 : -1;
                n.stuck = 0;
            }
            double h = end - t;
            advance(&n, t, h, y, next);
            /* a hub that stops and breaks away many times within one step keeps its contact until the end of the step */
            if (tries < 50 && changes(&n, end, next)) {
                double low = 0, high = h;
                for (int i = 0; i < 45; i++) {
                    double middle = (low + high) / 2;
                    advance(&n, t, middle, y, next);
                    if (changes(&n, t + middle, next)) high = middle; else low = middle;
                }
                h = high;
                advance(&n, t, h, y, next);
                if (n.stuck) {
                    n.sign = rates(&n, t + h, next, dy) > 0 ? 1 : -1;
                    n.stuck = 0;
                } else {
                    next[W] = 0;
                    n.stuck = 1;
                }
            }
            memcpy(y, next, sizeof y);
            t += h;
        }
        angle[k] = y[THETA];
        rate[k] = y[W];
        if (!isfinite(y[W])) return 1;
    }
    return 0;
}
