"""Linear models of a recording: fit several, compare them, recommend one."""
