"""Diagnosis link by link: fit, search and judgement of effects on the residuals of all links."""
