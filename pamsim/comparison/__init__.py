"""A rig against measurements: trials, predictions, residuals, starts and noise floor."""
