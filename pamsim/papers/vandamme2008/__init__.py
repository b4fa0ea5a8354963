"""Van Damme et al. 2008: Preisach hysteresis of pleated muscles."""
