"""MuJoCo: rigs, the muscles' plugin, simulation."""
