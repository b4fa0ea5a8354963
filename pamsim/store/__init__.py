"""Files on disk, and nothing else: rigs, printed tables, recordings, results."""
