"""An independent plant: a rig's physics in other equations and with another integrator.

It shares no law with the package, neither kernel nor engine: from a rig it takes the numbers alone.
With nothing hidden it agrees with the engine; with an effect hidden by a formula that the library
does not contain it makes recordings to which no diagnosis can be tuned.

`records` lists what describes a rig, `read_rig` reads it, `muscle`, `air` and `joint` hold the
laws, `rates` puts them together, `integrate` solves them, `run` makes a recording of an experiment.
`hidden` are effects by other formulas, `inputs` what no diagnosis proposes, `hide` records both.
"""
