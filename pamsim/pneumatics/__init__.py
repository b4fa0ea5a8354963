"""Air: chambers, orifices, valves."""
