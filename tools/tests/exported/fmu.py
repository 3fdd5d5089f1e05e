"""Checks FMUs in FMPy against `gmhm predict`: python fmu.py FOLDER

The folder holds gear.fmu, tuned.csv and angles.fmu, the recording rec.csv, and predicted.csv: that recording with torque_model_nm. tuned.csv is the prediction of the gear with
c1 10 % lower and half the Coulomb friction. Of the other laws it holds LAW.fmu and LAW.csv. T_A is the torque scale in N m.
"""

import sys
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

T_A = 30.230289585
LIMIT = 1e-9
LAWS = ("phase", "time")
COLUMNS = {"velocity_rad_per_s": "velocity_out_rad_per_s"}


class Unit:
    """One instance of an FMU, driven by hand."""

    def __init__(self, path):
        self.description = read_model_description(str(path))
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.inputs = [v for v in self.description.modelVariables if v.causality == "input"]
        self.fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=extract(str(path)),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="gear",
        )
        self.fmu.instantiate()

    def start(self, rows, start_values=None):
        self.fmu.setupExperiment(startTime=rows["time_s"][0])
        self.fmu.enterInitializationMode()
        for name, value in (start_values or {}).items():
            self.set(name, value)
        self.feed(rows, 0)
        self.fmu.exitInitializationMode()

    def set(self, name, value):
        self.fmu.setReal([self.variables[name].valueReference], [value])

    def get(self, name):
        return self.fmu.getReal([self.variables[name].valueReference])[0]

    def feed(self, rows, k):
        for v in self.inputs:
            self.fmu.setReal([v.valueReference], [rows[COLUMNS.get(v.name, v.name)][k]])

    def step(self, rows, k):
        """Moves from row k - 1 to row k: the inputs hold at the end of the step."""
        self.feed(rows, k)
        time = rows["time_s"]
        self.fmu.doStep(currentCommunicationPoint=time[k - 1], communicationStepSize=time[k] - time[k - 1])
        return self.get("torque_nm")

    def move(self, rows, k):
        """The same by the inputs of row k - 1 and their derivatives."""
        time = rows["time_s"]
        step = time[k] - time[k - 1]
        self.feed(rows, k - 1)
        for v in self.inputs:
            column = rows[COLUMNS.get(v.name, v.name)]
            self.fmu.setRealInputDerivatives([v.valueReference], [1], [(column[k] - column[k - 1]) / step])
        self.fmu.doStep(currentCommunicationPoint=time[k - 1], communicationStepSize=step)
        return self.get("torque_nm")

    def end(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


def table(path):
    return np.genfromtxt(path, delimiter=",", names=True)


def run(path, rows, start_values=None, moves=False):
    unit = Unit(path)
    unit.start(rows, start_values)
    step = unit.move if moves else unit.step
    torque = [unit.get("torque_nm")] + [step(rows, k) for k in range(1, len(rows))]
    status = unit.fmu.getInteger([unit.variables["status"].valueReference])[0]
    unit.end()
    assert status in (0, 4), status
    return np.array(torque)


def difference(torque, expected, limit=LIMIT):
    largest = np.max(np.abs(torque - expected)) / T_A
    assert largest <= limit, f"{largest:.3e} of T_A"
    return largest


def check_state(path, rows):
    """A state that was taken, written, read and set goes on with the same torques."""
    unit = Unit(path)
    unit.start(rows)
    half, end = len(rows) // 2, len(rows)
    for k in range(1, half):
        unit.step(rows, k)
    state = unit.fmu.getFMUstate()
    first = [unit.step(rows, k) for k in range(half, end)]
    kept = unit.fmu.serializeFMUstate(state)
    unit.fmu.freeFMUstate(state)
    unit.fmu.reset()
    again = unit.fmu.deSerializeFMUstate(kept)
    unit.fmu.setFMUstate(again)
    second = [unit.step(rows, k) for k in range(half, end)]
    unit.fmu.freeFMUstate(again)
    unit.end()
    assert first == second


def main():
    folder = Path(sys.argv[1])
    gear, angles = folder / "gear.fmu", folder / "angles.fmu"
    rows, predicted = table(folder / "rec.csv"), table(folder / "predicted.csv")["torque_model_nm"]
    for path in (gear, angles, *(folder / f"{law}.fmu" for law in LAWS)):
        problems = validate_fmu(str(path))
        assert not problems, problems
    by_hand = difference(run(gear, rows), predicted)
    by_angles = difference(run(angles, rows), table(folder / "angles.csv")["torque_model_nm"])
    tuned = {"c1_nm_per_rad": 0.9 * 2.4737e4, "coulomb_friction_1.torque_nm": 0.15}
    difference(run(gear, rows, tuned), table(folder / "tuned.csv")["torque_model_nm"])
    by_laws = max(difference(run(folder / f"{law}.fmu", rows), table(folder / f"{law}.csv")["torque_model_nm"]) for law in LAWS)
    check_state(gear, rows)

    by_rates = difference(run(gear, rows, moves=True), predicted, 1e-7)

    # The whole simulation by FMPy, which sets the inputs at the beginning of a step: each torque is that of the row before.
    names = [v.name for v in read_model_description(str(gear)).modelVariables if v.causality == "input"]
    signals = np.zeros(len(rows), dtype=[("time", np.float64)] + [(name, np.float64) for name in names])
    signals["time"] = rows["time_s"]
    for name in names:
        signals[name] = rows[COLUMNS.get(name, name)]
    result = simulate_fmu(
        str(gear),
        start_time=rows["time_s"][0],
        stop_time=rows["time_s"][-1],
        output_interval=rows["time_s"][1] - rows["time_s"][0],
        input=signals,
        output=["torque_nm", "status"],
        start_values={name: signals[name][0] for name in names},
    )
    simulated = difference(result["torque_nm"][1:], predicted[:-1])
    print(f"{len(rows)} rows: by hand {by_hand:.1e}, from angles {by_angles:.1e}, other laws {by_laws:.1e}, by input derivatives {by_rates:.1e}, simulate_fmu {simulated:.1e} of T_A")


if __name__ == "__main__":
    main()
