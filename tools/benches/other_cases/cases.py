"""Concealed cases of a second generator, which shares nothing with `gmhm prove` but the equations of the kinds.

    python3 tools/benches/other_cases/cases.py --program target/release/gmhm --sort joint --cases 60 --seed 21

Sorts of cases:
  joint    a joint log of 15 to 25 s at 1 kHz beside a rigid-body simulation; two to four effects, each 5 to 8 % off its textbook shape
  counted  the same at 125 Hz to 1 kHz, the angle counted by an encoder of 14, 17 or 20 bits
  gear     a gear of 24 sliders and one effect of 0.15 N·m in noise of 0.08 N·m; the base model is what `gmhm fit` makes of the recording

Needs NumPy and SciPy. All data are synthetic. The script writes the cases below --out, runs the program on them, and prints what was named and how much of the missing torque is explained on a
second motion that the program did not see.
"""

import argparse
import json
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt, lfilter

RATIO = 100.0
JOINT_KINDS = [
    "coulomb_friction", "viscous_friction", "stribeck_friction", "load_dependent_friction", "position_dependent_friction", "presliding_friction",
    "gravity_load", "inertia", "torque_scale", "time_skew", "torque_ripple",
]
DRY = ["coulomb_friction", "stribeck_friction", "presliding_friction"]
GEAR_KINDS = [
    "kinematic_error", "torque_ripple", "gravity_load", "coulomb_friction", "viscous_friction", "sensor_drift", "time_skew", "viscous_damping",
    "stiffness_asymmetry", "encoder_eccentricity", None,
]
RATED_RAD = 1.168e-3
# Effects of this share of the missing torque, alone and beside the others, have to be named.
LARGE = 0.08


def spread(x):
    return float(np.std(x))


def coloured(random, rows, pole):
    noise = lfilter([1.0], [1.0, -pole], random.normal(size=rows + 500))[500:]
    return noise / spread(noise)


def joint_motion(random, seconds, period_s, centre):
    """Sines, moves from point to point with rests, filtered noise, or strokes of even speed."""
    t = np.arange(0.0, seconds, period_s)
    style = random.integers(4)
    if style == 0:
        lowest = random.uniform(0.08, 0.2)
        q = sum(random.normal() / k * np.sin(2 * np.pi * k * lowest * t + random.uniform(0, 6.3)) for k in range(1, 6))
        q *= random.uniform(0.5, 1.5) / np.abs(q).max()
    elif style == 2:
        b, a = butter(3, random.uniform(0.3, 1.2) * 2 * period_s)
        q = filtfilt(b, a, random.normal(size=len(t)))
        q *= random.uniform(0.6, 1.4) / np.abs(q).max()
    else:
        pieces, at, rows = [], 0.0, 0
        while rows < len(t):
            if style == 1:
                to = random.uniform(-1.3, 1.3)
                s = np.linspace(0, 1, max(int(max(1.9 * abs(to - at) / random.uniform(0.4, 1.5), 0.4) / period_s), 4))
                pieces += [at + (to - at) * (10 * s**3 - 15 * s**4 + 6 * s**5), np.full(int(random.uniform(0, 0.6) / period_s), to)]
            else:
                to = random.uniform(0.3, 1.3) * (1 if at <= 0 else -1)
                speed = random.choice([0.1, 0.3, 0.6, 1.0, 1.5]) * random.uniform(0.8, 1.2)
                pieces.append(np.linspace(at, to, max(int(abs(to - at) / speed / period_s), 10)))
            at, rows = to, sum(map(len, pieces))
        q = np.concatenate(pieces)[: len(t)]
        if style == 3:
            b, a = butter(2, 8.0 * period_s)
            q = filtfilt(b, a, q)
    q = q + centre
    v = np.gradient(q, period_s)
    return t, q, v, np.gradient(v, period_s)


def rigid_body(arm, t, q, v, a):
    """Gravity of two links, inertia that a second joint changes, coupling."""
    other = 0.4 * np.sin(2 * np.pi * arm["other_hz"] * t + arm["phase"])
    other_velocity = np.gradient(other, t)
    gravity = arm["near_nm"] * np.sin(q + arm["tilt"]) + arm["far_nm"] * np.sin(q + other + arm["tilt"])
    inertia = (arm["inertia"] + arm["coupled"] * np.cos(other)) * a + arm["coupling"] * np.gradient(other_velocity, t)
    return gravity + inertia + arm["centrifugal"] * v * other_velocity * np.sin(other)


def direction(random, v):
    width = 10 ** random.uniform(-3, -1.3)
    return [np.tanh(v / width), v / (np.abs(v) + width), 2 / np.pi * np.arctan(v / width), np.clip(v / width, -1, 1)][random.integers(4)]


def dahl(q, radius):
    state, last, out = 0.0, q[0], np.empty_like(q)
    for i, angle in enumerate(q):
        step, last = angle - last, angle
        state = min(max(state + step / radius * (1 - state * np.sign(step)), -1.0), 1.0)
        out[i] = state
    return out


def joint_effect(kind, random, q, v, a, simulated):
    """An effect of size one, and for friction of the position its direction."""
    if kind == "coulomb_friction":
        return direction(random, v) * (1 + 0.05 * np.tanh(np.abs(v) / 0.5))
    if kind == "viscous_friction":
        return np.sign(v) * np.abs(v) ** random.uniform(0.65, 1.2) * (1 + 0.05 * np.sin(3 * np.abs(v)))
    if kind == "stribeck_friction":
        width = random.uniform(0.05, 0.2)
        dry = direction(random, v) * (1 + random.uniform(0.5, 1.0) * np.exp(-((np.abs(v) / width) ** random.uniform(0.8, 2))))
        return dry + random.uniform(0.05, 0.3) * v
    if kind == "load_dependent_friction":
        return np.abs(simulated) ** random.uniform(0.93, 1.07) * direction(random, v)
    if kind == "position_dependent_friction":
        order = random.choice([1, 2, 3])
        return (np.cos(order * q + random.uniform(0, 6.3)) + 0.07 * np.cos(2 * order * q)) * direction(random, v)
    if kind == "presliding_friction":
        radius = 10 ** random.uniform(-2.3, -1)
        return 0.8 * dahl(q, radius) + 0.2 * dahl(q, 2 * radius)
    if kind == "gravity_load":
        phase = random.uniform(0, 6.3)
        return np.sin(q + phase) + 0.05 * np.sin(2 * q + phase)
    if kind == "inertia":
        return a * (1 + 0.07 * np.sin(q))
    if kind == "torque_scale":
        return simulated * (1 - 0.08 * np.abs(simulated) / np.abs(simulated).max())
    order = random.choice([1, 2, 4]) * RATIO
    return np.sin(order * q + random.uniform(0, 6.3)) * (1 + 0.07 * np.sin(q)) + 0.05 * np.sin(3 * order * q)


def left_beside(columns, part):
    """What a constant and some columns leave of a part, rms."""
    x = np.column_stack([np.ones(len(part)), *columns])
    return spread(part - x @ np.linalg.lstsq(x, part, rcond=None)[0])


def joint_case(random, folder, counted):
    while True:
        kinds = [str(k) for k in random.choice(JOINT_KINDS, random.integers(2, 5), replace=False)]
        if sum(k in DRY for k in kinds) < 2 and not {"stribeck_friction", "viscous_friction"} <= set(kinds):
            break
    period_s = 1 / random.choice([125.0, 250.0, 500.0, 1000.0]) if counted else 1e-3
    count = 2 * np.pi / 2.0 ** random.choice([14, 17, 20]) if counted else 0.0
    seeds = {k: int(random.integers(1 << 40)) for k in [*kinds, "direction"]}
    arm = {
        "near_nm": random.uniform(5, 40), "far_nm": random.uniform(0, 15), "tilt": random.uniform(-0.5, 0.5), "inertia": random.uniform(0.5, 4),
        "coupled": random.uniform(0, 1), "coupling": random.uniform(0, 1), "centrifugal": random.uniform(-1, 1), "other_hz": random.uniform(0.1, 0.5),
        "phase": random.uniform(0, 6.3),
    }
    shares = {k: random.uniform(0.25, 1.0) for k in kinds}
    size, centre, base_friction = random.uniform(0.1, 0.35), random.uniform(-1, 1), random.uniform(1.2, 2.5)
    signs = {k: random.choice([-1, 1]) if k in ("torque_scale", "inertia") else 1 for k in kinds}
    pole, noise_share, offset = random.choice([0, 0.5, 0.9, 0.98]), random.uniform(0.01, 0.03), random.uniform(-0.5, 0.5)
    scales, key = {}, {}
    for name in ["seen", "unseen"]:
        t, q, v, a = joint_motion(random, random.uniform(15, 25), period_s, centre)
        simulated = rigid_body(arm, t, q, v, a)
        parts = {}
        for kind in kinds:
            if kind != "time_skew":
                part = joint_effect(kind, np.random.default_rng(seeds[kind]), q, v, a, simulated)
                scales.setdefault(kind, signs[kind] * shares[kind] * size * spread(simulated) / spread(part))
                parts[kind] = scales[kind] * part
        if "position_dependent_friction" in parts:
            # Friction brakes at every position: it varies about another dry friction by less than that.
            dry = next((k for k in DRY if k in parts), None)
            if dry is None:
                of_direction = direction(np.random.default_rng(seeds["direction"]), v)
                scales.setdefault("dry", base_friction * abs(scales["position_dependent_friction"]))
                parts["coulomb_friction"], dry = scales["dry"] * of_direction, "coulomb_friction"
            else:
                scales.setdefault("fraction", min(1.0, 0.6 * np.abs(parts[dry]).max() / np.abs(parts["position_dependent_friction"]).max()))
                parts["position_dependent_friction"] = scales["fraction"] * parts["position_dependent_friction"]
        torque = simulated + sum(parts.values())
        if "time_skew" in kinds:
            scales.setdefault("delay_s", min(max(shares["time_skew"] * size * spread(simulated) / spread(np.gradient(torque, period_s)), 0.002), 0.019))
            late = np.interp(t - 0.93 * scales["delay_s"], t, torque)
            keep = np.exp(-period_s / (0.07 * scales["delay_s"]))
            late = lfilter([1 - keep], [1, -keep], late - late[0]) + late[0]
            parts["time_skew"], torque = late - torque, late
        missing = torque - simulated
        if name == "seen":
            scales["noise"] = noise_share * spread(missing)
            key = joint_key(parts, missing, v)
        recorded = torque + scales["noise"] * coloured(random, len(t), pole) + offset
        angle = np.round(q / count) * count if counted else q
        write(folder / f"{name}.csv", {"time_s": t, "theta_out_rad": angle, "torque_nm": recorded, "torque_sim_nm": simulated})
        np.save(folder / f"{name}_missing.npy", missing)
    return key


def joint_key(parts, missing, v):
    """The effects that have to be named, and those that may be."""
    whole = spread(missing)
    hidden = {}
    for kind, part in parts.items():
        own = left_beside([other for name, other in parts.items() if name != kind], part)
        if kind == "stribeck_friction":
            # Where the dip hardly shows it is Coulomb friction to anybody.
            dip = min(left_beside([np.tanh(v / width), v], part) for width in np.geomspace(3e-4, 1, 15))
            if dip < LARGE * whole:
                kind = "coulomb_friction"
        hidden[kind] = min(spread(part), own) / whole
    accepted = {"coulomb_friction", "viscous_friction", "stribeck_friction"} if "stribeck_friction" in parts else set()
    return {"hidden": hidden, "accepted": sorted(accepted), "noise": None}


def gear_motion(random, period_s, speed):
    t = np.arange(0.0, 60.0, period_s)
    if random.integers(2) == 0:
        b, a = butter(3, random.uniform(0.1, 0.3) * 2 * period_s)
        x = filtfilt(b, a, random.normal(size=len(t) + 4000))[2000:-2000]
        theta = RATED_RAD * x / np.abs(x).max()
    else:
        swell = 1 - 0.7 * np.abs(np.sin(np.pi * t / t[-1] * random.integers(1, 4)))
        theta = RATED_RAD * swell * np.sin(2 * np.pi * random.uniform(0.1, 0.2) * t)
    # What a gear remembers from before a recording nobody can know: each starts from rest.
    theta *= 1 - np.exp(-t)
    b, a = butter(2, 0.4 * period_s)
    v = filtfilt(b, a, speed * np.sign(np.sin(2 * np.pi * t / random.uniform(8, 15))) * random.uniform(0.5, 1)) + 0.3 * speed * np.sin(0.7 * t)
    return t, theta, np.cumsum(v) * period_s + random.uniform(0, 6), v


def sliders(theta, radii, torques):
    stretch, last, out = np.zeros_like(radii), 0.0, np.empty_like(theta)
    for i, deflection in enumerate(theta):
        stretch, last = np.clip(stretch + deflection - last, -radii, radii), deflection
        out[i] = torques @ (stretch / radii)
    return out


def gear_case(random, folder, kind):
    radii = np.geomspace(3e-5, 2.5 * RATED_RAD, 24)
    torques = random.uniform(0, 1, 24) * np.geomspace(1, 2, 24)
    torques *= random.uniform(3, 5) / torques.sum()
    stiffness, cubic = random.uniform(1.0e4, 1.4e4), random.uniform(0, 0.75e9)
    pole, speed, phase, order = random.choice([0, 0.5, 0.9]), random.uniform(0.05, 0.2), random.uniform(0, 6.28), random.choice([1.0, 2.0, 4.0])
    scale = None
    for name in ["seen", "unseen"]:
        t, theta, q_out, v = gear_motion(random, 0.01, speed)
        torque = stiffness * theta + cubic * theta**3 + sliders(theta, radii, torques)
        q_in = RATIO * (q_out + theta)
        in_torque = {
            "torque_ripple": np.sin(order * q_in + phase), "gravity_load": np.sin(q_out + phase), "coulomb_friction": -np.tanh(v / 0.003),
            "viscous_friction": -v, "sensor_drift": t, "viscous_damping": np.gradient(theta, t), "stiffness_asymmetry": theta**2,
            "time_skew": -np.gradient(torque, t),
        }
        in_deflection = {"kinematic_error": np.sin(order * q_in + phase), "encoder_eccentricity": np.sin(q_out + phase)}
        measured = theta
        if kind in in_torque:
            scale = scale or 0.15 / spread(in_torque[kind])
            torque = torque + scale * in_torque[kind]
        elif kind in in_deflection:
            scale = scale or 0.15 / stiffness / spread(in_deflection[kind])
            measured = theta + scale * in_deflection[kind]
        noise = 0.08 * coloured(random, len(t), pole) if name == "seen" else 0.0
        jitter = 1e-6 * random.normal(size=len(t)) if name == "seen" else 0.0
        write(folder / f"{name}.csv", {"time_s": t, "theta_in_rad": RATIO * (q_out + measured) + jitter, "theta_out_rad": q_out, "torque_nm": torque + noise})
        np.save(folder / f"{name}_missing.npy", torque)
    hidden = {"nonlocal_memory": 1.0} | ({kind: 1.0} if kind else {})
    return {"hidden": hidden, "accepted": ["load_dependent_memory"], "noise": 0.08}


def write(path, columns):
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.10g")


def ask(program, folder, sort):
    """The answer of the program, and what it leaves of the missing torque on the second motion."""
    def run(*words):
        done = subprocess.run([program, *words, "-q"], cwd=folder, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{folder}: {' '.join(words)}: {done.stderr.strip()}")

    if sort == "gear":
        run("fit", "seen.csv", "--ratio", "100", "--torque-side", "output", "-o", "base.toml")
        run("diagnose", "base.toml", "seen.csv", "-o", "found.toml", "--json", "found.json")
        run("predict", "base.toml", "unseen.csv", "-o", "base.csv")
    else:
        run("diagnose", "seen.csv", "--torque-side", "motor", "--ratio", "100", "-o", "found.toml", "--json", "found.json")
    run("predict", "found.toml", "unseen.csv", "-o", "found.csv")
    read = lambda name: np.genfromtxt(folder / name, delimiter=",", names=True)
    found, truth = read("found.csv"), np.load(folder / "unseen_missing.npy")
    if sort == "gear":
        left, before = spread(truth - found["torque_model_nm"]), spread(truth - read("base.csv")["torque_model_nm"])
    else:
        left, before = spread(truth - found["torque_model_nm"] + found["torque_sim_nm"]), spread(truth)
    return json.loads((folder / "found.json").read_text())["effects"], left / before


def score(key, effects):
    """Effects that had to be named, those that were, and names without an effect. A class counts for one effect."""
    free = [[e["name"], *e["equivalents"]] for e in effects if e["name"] != "unknown"]
    wanted, hits = 0, 0
    for kind, share in sorted(key["hidden"].items(), key=lambda item: -item[1]):
        names = {kind} | (set(key["accepted"]) if kind == "nonlocal_memory" else set())
        match = next((c for c in free if c[0] in names), None) or next((c for c in free if names & set(c)), None)
        if match:
            free.remove(match)
        if share >= LARGE:
            wanted, hits = wanted + 1, hits + (match is not None)
    return wanted, hits, [c[0] for c in free if c[0] not in key["accepted"]]


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--program", default="target/release/gmhm", type=lambda path: str(Path(path).resolve()))
    options.add_argument("--sort", choices=["joint", "counted", "gear"], default="joint")
    options.add_argument("--cases", type=int, default=60)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--out", type=Path, default=Path("target/other_cases"))
    options.add_argument("--jobs", type=int, default=2)
    asked = options.parse_args()

    def one(index):
        random = np.random.default_rng([asked.seed, index])
        folder = asked.out / f"{asked.sort}_{asked.seed}_{index:03d}"
        folder.mkdir(parents=True, exist_ok=True)
        if asked.sort == "gear":
            key = gear_case(random, folder, GEAR_KINDS[index % len(GEAR_KINDS)])
        else:
            key = joint_case(random, folder, asked.sort == "counted")
        effects, left = ask(asked.program, folder, asked.sort)
        return folder.name, key, effects, left, score(key, effects)

    print(f"{asked.cases} cases of sort {asked.sort}, seed {asked.seed}")
    wanted = hits = wrong = 0
    explained = []
    with ThreadPoolExecutor(asked.jobs) as pool:
        for name, key, effects, left, (own_wanted, own_hits, own_wrong) in pool.map(one, range(asked.cases)):
            wanted, hits, wrong = wanted + own_wanted, hits + own_hits, wrong + len(own_wrong)
            explained.append(1 - left**2)
            if own_hits < own_wanted or own_wrong or left > 0.3:
                said = ", ".join("/".join([e["name"], *e["equivalents"]]) for e in effects)
                print(f"{name}: hidden {', '.join(f'{k} {s:.2f}' for k, s in key['hidden'].items())}; named {said or 'nothing'}; wrong {own_wrong}; explained {explained[-1]:.3f}")
    print(f"named {hits} of {wanted} = {hits / wanted:.3f}; wrong names a case {wrong / asked.cases:.3f}; explained on another motion: median {np.median(explained):.3f}, mean {np.mean(explained):.3f}, least {min(explained):.3f}")


if __name__ == "__main__":
    main()
