"""Checks an FMU in libcosim, the engine of the Open Simulation Platform, against `gmhm predict`: python cosim.py FOLDER

The folder holds gear.fmu, and predicted.csv: a recording with torque_model_nm. T_A is the torque scale in N m. The engine may report no error.
"""

import csv
import os
import sys
import tempfile
from pathlib import Path

from libcosimpy.CosimEnums import CosimVariableCausality
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

T_A = 30.230289585
LIMIT = 1e-9
COLUMNS = {"velocity_rad_per_s": "velocity_out_rad_per_s"}


def torques(path, rows):
    """The torques of the rows after the first, whose inputs the unit starts with."""
    execution = CosimExecution.from_step_size(round(1e9 * (rows[1]["time_s"] - rows[0]["time_s"])))
    slave = execution.add_local_slave(CosimLocalSlave(str(path), "gear"))
    observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
    execution.add_observer(observer)
    execution.add_manipulator(manipulator)
    variables = list(execution.slave_variables(slave))
    torque = next(v.reference for v in variables if v.name == b"torque_nm")
    inputs = [v for v in variables if v.causality == CosimVariableCausality.INPUT.value]
    references, names = [v.reference for v in inputs], [v.name.decode() for v in inputs]
    columns = [COLUMNS.get(name, name) for name in names]
    for reference, column in zip(references, columns):
        assert execution.real_initial_value(slave, reference, rows[0][column])
    for row in rows[1:]:
        manipulator.slave_real_values(slave, references, [row[column] for column in columns])
        assert execution.step(), "a step fails"
        yield observer.last_real_values(slave, [torque])[0]


def main():
    folder = Path(sys.argv[1])
    with open(folder / "predicted.csv", newline="") as file:
        rows = [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(file)]
    log_output_level(CosimLogLevel.WARNING)
    # The engine writes its messages to the standard output of the process.
    kept = os.dup(1)
    with tempfile.TemporaryFile() as messages:
        os.dup2(messages.fileno(), 1)
        try:
            simulated = list(torques(folder / "gear.fmu", rows))
        finally:
            os.dup2(kept, 1)
            messages.seek(0)
            said = messages.read().decode()
    assert not said, said
    largest = max(abs(torque - row["torque_model_nm"]) for torque, row in zip(simulated, rows[1:], strict=True)) / T_A
    assert largest <= LIMIT, f"{largest:.3e} of T_A"
    print(f"{len(rows)} rows: {largest:.1e} of T_A")


if __name__ == "__main__":
    main()
