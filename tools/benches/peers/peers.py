"""Fits the columns of a CSV file by common optimisers and prints one JSON object a solver.

Columns: theta, theta^3, theta^5, e, h, torque. Unknowns: c1, c2, c3, alpha, beta, omega, in the box given on the command
line; a constant offset is taken out of every residual. Usage: peers.py FILE SEEDS EVALUATIONS low high low high ...
"""

import json
import logging
import os
import sys
import time

# One thread each: waiting threads of the linear algebra would count as time.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np  # noqa: E402
from scipy.optimize import differential_evolution, least_squares  # noqa: E402

logging.disable(logging.CRITICAL)
import pyswarms  # noqa: E402  (it configures logging when imported)

data = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
seeds, evaluations = int(sys.argv[2]), int(sys.argv[3])
box = np.array(sys.argv[4:], dtype=float).reshape(-1, 2)
columns, torque = data[:, :5], data[:, 5]


def residual(x):
    c1, c2, c3, alpha, beta, omega = x
    speed = beta * beta + omega * omega + 1e-300
    r = torque - columns @ np.array([c1, c2, c3, alpha * beta / speed, alpha * omega / speed])
    return r - r.mean()


def sse(x):
    r = residual(x)
    return float(r @ r)


def run_least_squares(seed):
    # One start: the stiffness of the largest torque, no hysteresis to speak of, moved a little by the seed.
    jitter = 1.0 + 0.1 * np.random.default_rng(seed).standard_normal(6)
    start = np.array([np.ptp(torque) / np.ptp(columns[:, 0]), 0, 0, 1e-3 * box[3, 1], 0.1 * box[4, 1], 0.1 * box[5, 1]])
    # In units of the box: finite differences of the raw unknowns, 1e9 times apart, would vanish.
    unit = box[:, 1]
    start = np.clip(start * jitter, box[:, 0], box[:, 1]) / unit
    scaled = least_squares(lambda x: residual(x * unit), start, bounds=(box[:, 0] / unit, box[:, 1] / unit), x_scale="jac")
    return scaled.x * unit


def run_differential_evolution(seed):
    size = 15 * 6
    return differential_evolution(sse, box, maxiter=evaluations // size - 1, popsize=15, tol=0, polish=False, rng=seed).x


def run_pyswarms(seed):
    np.random.seed(seed)
    options = {"c1": 0.5, "c2": 0.3, "w": 0.9}
    swarm = pyswarms.single.GlobalBestPSO(40, 6, options, bounds=(box[:, 0], box[:, 1]))
    _, best = swarm.optimize(lambda xs: np.array([sse(x) for x in xs]), evaluations // 40, verbose=False)
    return best


for name, solver in [
    ("SciPy least_squares", run_least_squares),
    ("SciPy differential_evolution", run_differential_evolution),
    ("pyswarms GlobalBestPSO", run_pyswarms),
]:
    seconds, found = [], []
    for seed in range(seeds):
        clock = time.process_time()
        best = solver(seed)
        seconds.append(time.process_time() - clock)
        found.append(sse(best))
    print(json.dumps({"solver": name, "seconds": seconds, "sse": found}))
