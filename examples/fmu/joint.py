"""A flexible joint: an exported gear between a motor under position control and a link with a load, coupled in FMPy.

    gmhm export gear.toml --to fmu -o gear.fmu
    python joint.py gear.fmu

The motor steps to a position while the link carries a load. The gear winds up by the load, with hysteresis: the link comes to rest short of the motor's position.
"""

import sys

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

RATIO = 100.0
STEP = 1e-4  # s
MOTOR_INERTIA = 2e-5  # kg m^2, at the motor
LINK_INERTIA = 0.3  # kg m^2
LINK_DAMPING = 8.0  # N m s/rad
STIFFNESS, DAMPING = 2.0, 0.02  # of the position control, N m/rad and N m s/rad at the motor


class Gear:
    """The FMU: torque of a deflection."""

    def __init__(self, path):
        description = read_model_description(path)
        place = {v.name: v.valueReference for v in description.modelVariables}
        self.input, self.output = [place["deflection_rad"]], [place["torque_nm"]]
        identifier = description.coSimulation.modelIdentifier
        self.fmu = FMU2Slave(guid=description.guid, unzipDirectory=extract(path), modelIdentifier=identifier, instanceName="gear")
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def torque(self, time, deflection):
        """The torque at the end of a step that leads to the deflection."""
        self.fmu.setReal(self.input, [deflection])
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=STEP)
        return self.fmu.getReal(self.output)[0]


def simulate(path, load, seconds=2.0):
    """Motor angle, link angle and gear torque over time, the load in N m on the link."""
    gear = Gear(path)
    motor = link = motor_rate = link_rate = torque = 0.0
    rows = []
    for k in range(int(seconds / STEP)):
        time = k * STEP
        aim = RATIO * 0.05 * min(1.0, time / 0.2)
        drive = STIFFNESS * (aim - motor) - DAMPING * motor_rate
        motor_rate += STEP * (drive - torque / RATIO) / MOTOR_INERTIA
        link_rate += STEP * (torque - load - LINK_DAMPING * link_rate) / LINK_INERTIA
        motor += STEP * motor_rate
        link += STEP * link_rate
        torque = gear.torque(time, motor / RATIO - link)
        rows.append((time + STEP, motor, link, torque))
    gear.fmu.terminate()
    gear.fmu.freeInstance()
    return np.array(rows)


def main():
    for load in (5.0, 15.0):
        rows = simulate(sys.argv[1], load)
        _, motor, link, torque = rows[-1]
        twist = motor / RATIO - link
        print(f"load {load:.0f} N m: at rest the gear carries {torque:.3f} N m, wound up by {1e3 * twist:.3f} mrad; most {rows[:, 3].max():.1f} N m")
        assert abs(torque - load) < 0.01, "the joint is not at rest"


if __name__ == "__main__":
    main()
