//! The virtual test bench: motor, gear, torque sensor, two encoders and a brake, as a program.
