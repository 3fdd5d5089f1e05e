#!/bin/sh
# Makes the recordings and the parameter block of this folder anew. They are synthetic: a bench simulated on the gear of true_gear.toml.
cd "$(dirname "$0")" || exit 1
gmhm simulate true_gear.toml --experiment cycle --duration 40 --cycles 1 --sample-rate 10 --seed 1 -o cycle.csv
gmhm simulate true_gear.toml --experiment amplitudes --duration 60 --sample-rate 20 --seed 2 -o amplitudes.csv
gmhm simulate true_gear.toml --experiment running --duration 15 --sample-rate 100 --hide kinematic_error=0.15 --hide coulomb_friction=0.3 --seed 3 -o running.csv
gmhm pack true_gear.toml -o params.bin
