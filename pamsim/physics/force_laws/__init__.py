"""Force laws of pneumatic muscles: pure functions with their parameters."""
