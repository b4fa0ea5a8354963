"""Many simulations or diagnoses over varied parameters, inputs, effects and rigs, in one table."""
