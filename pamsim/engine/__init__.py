"""MuJoCo: rigs, the native callback, simulation."""
