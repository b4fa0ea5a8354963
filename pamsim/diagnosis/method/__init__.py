"""The method of a diagnosis: it is handed a simulator and imports no engine."""
