"""Every threshold on which a verdict rests, for recordings, tables at rest and loops.

Losses are mean squares over the noise variance of a recording: 1 is a perfect model's. Differences
of losses are in the same unit.
"""

from __future__ import annotations

SIGNIFICANCE = 0.05
"""p-value, corrected for all effects that were tried, below which an effect may be claimed."""

LEAST_GAIN = 0.01
"""Fall of the held-out loss below which an effect is not claimed: a candidate that happens to lie
nearer the true cause does predict a little better."""

FORM_GAIN = 0.005
"""Fall of the fitted trials' mean loss from which another form of an effect is preferred to the
one that is tried first."""

PARTNER_SHARE = 0.5
"""Share of what the best smaller model leaves that a further effect must remove: one that removes
less stands in for an error of the first one's formula."""

FORM_ERROR = 0.05
"""Share of what the base model misses that the formula of an effect may leave: a further effect
must remove more."""

ADEQUATE = 0.97
"""Share of what the base model misses that a named effect must explain, where a significant
remainder is left. The rest is what its formula may be off by; of two effects, each may be."""

MOST = 0.5
"""Share of what the base model misses that a named effect must explain in any case."""

TIE_ERRORS = 2.0
"""Standard errors of a loss difference within which another model predicts as well."""

TIE_LOSS = 0.002
"""Loss difference that never separates two models."""

TIE_SHARE = 0.5
"""Share of the best model's gain that a rival must reach."""

SAME_SIGNATURE, SAME_SIGNATURE_LOSS = 0.95, 0.1
"""Similarity of two signatures from which losses do not separate the effects, as long as the rival
is behind by less than this share of the best model's gain."""

RIVAL_REJECTED, RIVAL_FITS = 0.01, 0.1
"""p-values of lack of fit: a rival below the first is rejected if another model is above the
second."""

LACK_OF_FIT, LACK_OF_FIT_LOSS = 0.001, 0.005
"""p-value and size of a remainder that all repeats share, from which it counts. Numerical errors of
a good simulation reach this size."""

LACK_OF_FIT_SHORT = 0.01
"""The same p-value for what explains less than `ADEQUATE`: other causes of a similar shape leave a
few per cent."""

LEFT_FOR_RARE = 0.05
"""p-value of lack of fit of the best single effect below which the rare effects are tried too."""

LACK_OF_FIT_PATTERNS, LACK_OF_FIT_WEAKEST = 1.6, 0.02
"""Few repeats have few sign patterns. The p-value from which a remainder counts is at least this
many times the smallest that they can reach, so that the most extreme pattern alone always counts,
and at most the second number: repeats that cannot reach it are no test."""

REMAINDER_ERRORS, REMAINDER_LOSS, LARGE_REMAINDER_LOSS = 3.0, 0.02, 0.1
"""Standard errors and loss beyond which a remainder is significant, and loss beyond which the
verdict mentions it even if repeats do not share it."""

GAP_P_VALUE, GAP_LOSS = 1e-3, 0.1
"""p-value and loss of the base model's excess over the noise from which a gap is certain although
no effect is claimed; of one cell only if a residual map is significant, too."""

UNPROVEN_LOSS = 0.5
"""Excess over the noise from which a gap that is not significant makes a recording inconclusive."""

KNOWN_NUISANCE = 0.05
"""Share of the rig's own value to which a nuisance parameter is known: a limit of an absent effect
that holds only if it is refitted farther is none."""

FAR_NUISANCE = 0.25
"""Share of the rig's own value by which a nuisance parameter, known to a few per cent, may be
refitted without the verdict saying so: beyond, it may stand in for what is missing."""

UNREPEATED_GAP, UNREPEATED_GAIN = 10.0, 1.0
"""The same as `GAP_LOSS` and `LEAST_GAIN` where parts of trials are judged for want of repeats, in
units of the noise that is left beside the model. All parts of one trial agree on what varies from
trial to trial: 0.3 % in a rig's parameters leave 1 of the noise variance on average, and 5 in the
forces of fast inputs."""
