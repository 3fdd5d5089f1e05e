"""Expected columns of `gmhm predict` for each kind of term, by an implementation of its own (NumPy).

Prints the tables of tools/tests/terms_predict.rs: python3 tools/tests/reference/terms.py
"""

import numpy as np

A, ALPHA, BETA, OMEGA = 1.168e-3, 2.6532e6, 422.68, 226.31
C1, C2, C3 = 2.4737e4, 1.0e9, -1.1774e14
E, H = ALPHA * BETA / (BETA**2 + OMEGA**2), ALPHA * OMEGA / (BETA**2 + OMEGA**2)
N = 100.0

T = np.array([0.0, 0.1, 0.25, 0.35, 0.5, 0.6, 0.8, 0.9])
THETA = 1e-3 * np.array([0.1, 0.6, 1.1, 0.7, -0.02, 0.03, -0.9, 0.2])
QO = np.array([0.3, 0.5, 0.9, 1.0, 0.8, 0.75, 0.2, -0.4])
V = np.array([2.0, 2.5, 1.5, -0.02, -1.0, -2.0, 0.05, 0.0])
TEMP = np.array([22.0, 23.0, 25.0, 26.0, 28.0, 29.0, 31.0, 35.0])
QM = N * (THETA + QO)
ACC = np.gradient(V, T)
SIM = np.array([2.0, 12.0, 25.0, 11.0, -4.0, -2.5, -19.0, 7.0])


def elastic(x):
    return C1 * x + C2 * x**3 + C3 * x**5


def gate(x):
    return np.sqrt(max(0.0, 1 - (x / A) ** 2))


class Masing:
    """Turning points as a list of (deflection, y), newest last."""

    def __init__(self, x):
        self.x0, self.x, self.y, self.d, self.turns = x, x, 0.0, 0, []

    def copy(self):
        other = Masing(0.0)
        other.__dict__.update(self.__dict__)
        other.turns = list(self.turns)
        return other

    def step(self, x):
        if x == self.x:
            return self
        d = 1 if x > self.x else -1
        if self.d not in (0, d):
            if not self.turns:
                self.turns.append((2 * self.x0 - self.x, -self.y))
            self.turns.append((self.x, self.y))
        self.d = d
        while len(self.turns) >= 2 and d * (x - self.turns[-2][0]) >= 0:
            self.turns = self.turns[:-2]
        if self.turns:
            s, ys = self.turns[-1]
            u = min(abs(x - s), 2 * A) / A
            self.y = ys + d * H * A * u * (2 - u)
        else:
            u = min(abs(x - self.x0), A) / A
            self.y = d * 2 * H * A * u * (1 - u)
        self.x = x
        return self

    def z(self):
        return -E * self.x * gate(self.x) + self.y

    def torque(self):
        return elastic(self.x) + self.z()


def base(theta):
    m = Masing(theta[0])
    return np.array([m.torque()] + [m.step(x).torque() for x in theta[1:]])


def clearance(measured, b):
    theta, path = [], None
    for x in measured:
        at = (lambda u: Masing(u).torque()) if path is None else (lambda u: path.copy().step(u).torque())
        low, high = x - b, x + b
        if at(low) > 0:
            u = low
        elif at(high) < 0:
            u = high
        else:
            for _ in range(200):
                u = 0.5 * (low + high)
                low, high = (u, high) if at(u) < 0 else (low, u)
        path = Masing(u) if path is None else path.step(u)
        theta.append(u)
    return np.array(theta)


def play(measured, b):
    u, out = measured[0], []
    for x in measured:
        u = min(max(u, x - b), x + b)
        out.append(u)
    return np.array(out)


def stop(r):
    s, out = 0.0, [0.0]
    for step in np.diff(THETA):
        s = min(max(s + step, -r), r)
        out.append(s)
    return np.array(out)


def creep(tau):
    x, out = 0.0, [0.0]
    for step, dt in zip(np.diff(THETA), np.diff(T)):
        x = np.exp(-dt / tau) * x + step * (1 - np.exp(-dt / tau)) * tau / dt
        out.append(x)
    return np.array(out)


def butterfly(r, linear, quadratic):
    """A stop is what a play leaves; the load factor as written in the model."""
    u = np.abs(THETA) / A
    played, out = THETA[0], []
    for x in THETA:
        played = min(max(played, x - r), x + r)
        out.append(x - played)
    return np.maximum(0, 1 - linear - quadratic + linear * u + quadratic * u**2) * np.array(out)


def dahl(r):
    """dD/dq by classical Runge-Kutta along the output."""
    d, out = 0.0, [0.0]
    for step in np.diff(QO):
        sense, count = np.sign(step), 4000
        h = step / count
        slope = lambda d: (1 - d * sense) / r
        for _ in range(count):
            k1 = slope(d)
            k2 = slope(d + 0.5 * h * k1)
            k3 = slope(d + 0.5 * h * k2)
            k4 = slope(d + h * k3)
            d += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        out.append(d)
    return np.array(out)


def resonance(q, rate, orders, cos, sin, hertz, zeta):
    """Complex transfer function of the mode at the frequency of each order."""
    wn, total = 2 * np.pi * hertz, 0
    for k, c, s in zip(orders, cos, sin):
        jw = 1j * k * rate
        total = total + np.real(wn**2 / (jw**2 + 2 * zeta * wn * jw + wn**2) * (c - 1j * s) * np.exp(1j * k * q))
    return total


def parabolic(x):
    """The slope at each middle sample of the parabola through three."""
    return np.gradient(x, T)


BASE = base(THETA)
RATE = np.gradient(THETA, T)
SIGN = lambda s: np.tanh(V / s) if s > 0 else np.sign(V)
WARM = lambda ref: TEMP - ref


def series(q, orders, cos, sin):
    return sum(c * np.cos(k * q) + s * np.sin(k * q) for k, c, s in zip(orders, cos, sin))


def deflection(theta):
    return base(theta) - BASE


def piecewise(k1, k2, k3, t1, t2):
    th1, th2 = t1 / k1, t1 / k1 + (t2 - t1) / k2
    a = np.abs(THETA)
    p = np.where(a < th1, k1 * a, np.where(a < th2, t1 + k2 * (a - th1), t2 + k3 * (a - th2)))
    return np.sign(THETA) * p - k3 * THETA


SIGMA = -1.0
X = THETA / 3e-4
KINDS = [
    ("kinematic_error", "orders = [2, 4.5]\ncos_rad = [5e-5, 1e-5]\nsin_rad = [-2e-5, 3e-5]",
     deflection(THETA - series(QM, [2, 4.5], [5e-5, 1e-5], [-2e-5, 3e-5]))),
    ("torque_ripple", "orders = [1, 2.02]\ncos_nm = [0.5, 0.1]\nsin_nm = [0.2, -0.3]",
     series(QM, [1, 2.02], [0.5, 0.1], [0.2, -0.3])),
    ("kinematic_error", 'angle = "output"\norders = [2, 101.5]\ncos_rad = [5e-5, 1e-5]\nsin_rad = [-2e-5, 3e-5]',
     deflection(THETA - series(QO, [2, 101.5], [5e-5, 1e-5], [-2e-5, 3e-5]))),
    ("torque_ripple", 'angle = "output"\norders = [2, 101.5]\ncos_nm = [0.5, 0.1]\nsin_nm = [0.2, -0.3]',
     series(QO, [2, 101.5], [0.5, 0.1], [0.2, -0.3])),
    ("encoder_eccentricity", "cos_rad = 4e-5\nsin_rad = -6e-5", deflection(THETA - series(QO, [1], [4e-5], [-6e-5]))),
    ("gravity_load", "cos_nm = 3.0\nsin_nm = -1.5", series(QO, [1], [3.0], [-1.5])),
    ("coulomb_friction", "torque_nm = 0.7\nsmoothing_rad_per_s = 0.05", SIGMA * 0.7 * SIGN(0.05)),
    ("coulomb_friction", "torque_nm = 0.7", SIGMA * 0.7 * SIGN(0)),
    ("viscous_friction", "damping_nms_per_rad = 1.25", SIGMA * 1.25 * V),
    ("viscous_friction", "damping_nms_per_rad = 1.25\nexponent = 0.7", SIGMA * 1.25 * np.sign(V) * np.abs(V) ** 0.7),
    ("stribeck_friction",
     "coulomb_nm = 0.5\nstatic_nm = 0.9\nstribeck_velocity_rad_per_s = 0.8\nexponent = 1.5\ndamping_nms_per_rad = 0.3\nsmoothing_rad_per_s = 0.02",
     SIGMA * ((0.5 + 0.4 * np.exp(-np.abs(V / 0.8) ** 1.5)) * SIGN(0.02) + 0.3 * V)),
    ("load_dependent_friction", "mu = 0.03\nsmoothing_rad_per_s = 0.1", SIGMA * 0.03 * np.abs(BASE) * SIGN(0.1)),
    ("position_dependent_friction",
     'angle = "output"\norders = [3]\ncos_nm = [0.4]\nsin_nm = [0.1]\nsmoothing_rad_per_s = 0.1',
     SIGMA * series(QO, [3], [0.4], [0.1]) * SIGN(0.1)),
    ("position_dependent_friction",
     'angle = "motor"\norders = [2]\ncos_nm = [0.4]\nsin_nm = [0.1]\nsmoothing_rad_per_s = 0',
     SIGMA * series(QM, [2], [0.4], [0.1]) * SIGN(0)),
    ("viscous_damping", "damping_nms_per_rad = 150", 150 * RATE),
    ("inertia", "inertia_kgm2 = 0.2", SIGMA * 0.2 * ACC),
    ("soft_windup", 'shape = "tanh"\nstiffness_drop_nm_per_rad = 5000\nwidth_rad = 3e-4', -5000 * 3e-4 * np.tanh(X)),
    ("soft_windup", 'shape = "rational"\nstiffness_drop_nm_per_rad = 5000\nwidth_rad = 3e-4', -1.5 * X / (1 + X**2)),
    ("soft_windup", 'shape = "gaussian"\nstiffness_drop_nm_per_rad = 5000\nwidth_rad = 3e-4', -1.5 * X * np.exp(-X**2 / 2)),
    ("soft_windup",
     'shape = "piecewise"\nk1_nm_per_rad = 16000\nk2_nm_per_rad = 20000\nk3_nm_per_rad = 23000\nt1_nm = 4\nt2_nm = 12',
     piecewise(16000, 20000, 23000, 4, 12)),
    ("stiffness_asymmetry", 'shape = "square"\nstiffness_nm_per_rad2 = 4e5', 4e5 * THETA**2),
    ("stiffness_asymmetry", 'shape = "abs"\nstiffness_nm_per_rad = -300', -300 * np.abs(THETA)),
    ("backlash", 'shape = "clearance"\nhalf_gap_rad = 4e-5', deflection(clearance(THETA, 4e-5))),
    ("backlash", 'shape = "play"\nhalf_gap_rad = 4e-5', deflection(play(THETA, 4e-5))),
    ("nonlocal_memory", "radius_rad = [2e-4, 6e-4]\ntorque_nm = [0.5, 0.8]", 0.5 / 2e-4 * stop(2e-4) + 0.8 / 6e-4 * stop(6e-4)),
    ("creep", "tau_s = [0.4, 20]\nstiffness_nm_per_rad = [500, 200]", 500 * creep(0.4) + 200 * creep(20)),
    ("time_skew", "delay_s = 0.03", np.interp(T - 0.03, T, BASE) - BASE),
    ("time_skew", "delay_s = -0.12", np.interp(T + 0.12, T, BASE) - BASE),
    ("thermal_stiffness", "per_k = 3e-4\nreference_c = 22", -3e-4 * C1 * THETA * WARM(22)),
    ("thermal_zero_drift", "nm_per_k = 0.05\nreference_c = 25", 0.05 * WARM(25)),
    ("thermal_friction", "per_k = 0.02\nreference_c = 22", 0 * T),
    ("sensor_drift", "nm_per_s = 0.4", 0.4 * T),
    ("wear", 'shape = "step"\nstiffness_drop_nm_per_rad = 900\nstart_s = 0.35', -900 * THETA * (T >= 0.35)),
    ("wear", 'shape = "ramp"\nstiffness_drop_nm_per_rad = 900\nstart_s = 0.2\nduration_s = 0.4',
     -900 * THETA * np.clip((T - 0.2) / 0.4, 0, 1)),
    ("unknown", 'coordinate = "output_velocity"\nknots = [-1.5, 0, 2]\nvalues_nm = [1, -1, 0.5]',
     np.interp(V, [-1.5, 0, 2], [1, -1, 0.5])),
    ("unknown", 'coordinate = "motor_angle"\nknots = [0, 2, 4]\nvalues_nm = [1, -1, 0.5]',
     np.interp(QM, [0, 2, 4], [1, -1, 0.5], period=2 * np.pi)),
    ("unknown", 'coordinate = "torque"\nknots = [-10, 10]\nvalues_nm = [-1, 1]', np.interp(BASE, [-10, 10], [-1, 1])),
    ("torque_scale", "gain_error = -0.04", -0.04 * SIM),
    ("load_dependent_memory", "radius_rad = [2e-4, 6e-4]\ntorque_nm = [0.5, 0.8]\nload_linear = 0.9\nload_quadratic = 0.4",
     0.5 / 2e-4 * butterfly(2e-4, 0.9, 0.4) + 0.8 / 6e-4 * butterfly(6e-4, 0.9, 0.4)),
    ("load_dependent_memory", "radius_rad = [3e-4]\ntorque_nm = [0.5]\nload_quadratic = 0.6",
     0.5 / 3e-4 * butterfly(3e-4, 0, 0.6)),
    ("presliding_friction", "torque_nm = 0.7\nradius_rad = 0.15", SIGMA * 0.7 * dahl(0.15)),
    ("encoder_skew", "delay_s = 4e-5", deflection(THETA - 4e-5 * V)),
    ("ripple_resonance", "orders = [1, 2]\ncos_nm = [0.5, 0.1]\nsin_nm = [0.2, -0.3]\nfrequency_hz = 40\ndamping_ratio = 0.1",
     resonance(QM, parabolic(QM), [1, 2], [0.5, 0.1], [0.2, -0.3], 40, 0.1)),
    ("ripple_resonance",
     'angle = "output"\norders = [2, 30]\ncos_nm = [0.5, 0.1]\nsin_nm = [0.2, -0.3]\nfrequency_hz = 8\ndamping_ratio = 0.1',
     resonance(QO, V, [2, 30], [0.5, 0.1], [0.2, -0.3], 8, 0.1)),
]

# Several at once, in file order: each column is its change of the total.
AFTER_ECCENTRICITY = THETA - series(QO, [1], [4e-5], [-6e-5])
RATE_2 = np.gradient(AFTER_ECCENTRICITY, T)
BASE_2 = base(AFTER_ECCENTRICITY)
COULOMB = SIGMA * 0.7 * SIGN(0.05)
LOAD, LOAD_2 = (SIGMA * 0.03 * np.abs(b) * SIGN(0.1) for b in (BASE, BASE_2))
DAMPED, DAMPED_2 = 150 * RATE, 150 * RATE_2
SCALE = np.exp(-0.02 * WARM(22))
TOTAL = BASE_2 + DAMPED_2 + SCALE * (COULOMB + LOAD_2)
COULOMB_2 = SIGMA * 0.2 * SIGN(0)
LAST = TOTAL + SCALE * COULOMB_2
skew = lambda x: np.interp(T - 0.03, T, x)
SEVERAL = [
    COULOMB,
    LOAD,
    DAMPED,
    (SCALE - 1) * (COULOMB + LOAD),
    TOTAL - (BASE + DAMPED + SCALE * (COULOMB + LOAD)),
    skew(TOTAL) - TOTAL,
    skew(LAST) - skew(TOTAL),
]

# A joint log: T_base is gravity and inertia.
GRAVITY = series(QO, [1], [3.0], [-1.5])
INERTIA = 0.2 * ACC
FRICTION = lambda base: 0.03 * np.abs(base) * SIGN(0.1)
# Terms over a simulation's torque: T_base is that torque, without the payload that it lacks.
PAYLOAD = series(QO, [1], [0.8], [0.1])
SIMULATED = [
    PAYLOAD,
    SIGMA * 0.03 * np.abs(SIM) * SIGN(0.1),
    0.02 * SIM,
]
TORQUE = skew(SIM + sum(SIMULATED))
SIMULATED.append(TORQUE - SIM - sum(SIMULATED))

JOINT = [
    GRAVITY,
    FRICTION(GRAVITY),
    INERTIA + FRICTION(GRAVITY + INERTIA) - FRICTION(GRAVITY),
    series(N * QO, [2], [0.3], [0.1]),
]


def numbers(values):
    return ", ".join(f"{v:.10e}" for v in values)


if __name__ == "__main__":
    print("const BASE: Row =", f"[{numbers(BASE)}];")
    for kind, keys, column in KINDS:
        print(f'    ("{kind}", r#"{keys}"#, [{numbers(column)}]),')
    for name, columns in (("SEVERAL", SEVERAL), ("SIMULATED", SIMULATED), ("JOINT", JOINT)):
        print(f"const {name}: [Row; {len(columns)}] = [")
        for column in columns:
            print(f"    [{numbers(column)}],")
        print("];")
