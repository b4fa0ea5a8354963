"""Where simulation and data disagree, which effect is missing, and how sure that is.

Everything here works on residuals of a simulator that it is handed; it knows no engine.
"""
