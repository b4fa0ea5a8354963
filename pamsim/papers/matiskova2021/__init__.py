"""Matiskova et al. 2021: the antagonistic MAS-20 actuator."""
