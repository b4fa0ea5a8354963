"""What every room may use: errors, units, parameters, experiments, recordings."""
