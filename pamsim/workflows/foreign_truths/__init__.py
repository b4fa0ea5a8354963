"""Hidden truths that the library cannot state: other formulations of its effects, and outside ones.

They make twin data only; what fits and names never sees them.
"""
