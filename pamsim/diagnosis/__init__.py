"""Where simulation and data disagree, which effects are missing, and how sure that is.

`pamsim.diagnosis.diagnose` chooses by the kind of data. All are searched, judged and stated by the
same files; what a kind of data has of its own stands first:

====================  ==================  =======================  =======================
what                  recordings          table of angles at rest  length-pressure loop
====================  ==================  =======================  =======================
data and rig          recordings.py       table_at_rest.py         length_pressure_loop.py
method in by_link/    diagnose_links.py   diagnose_rest.py         diagnose_rest.py
fits                  link_fit.py         diagnose_rest.py         diagnose_rest.py
data no fit has seen  held_out.py         left_out.py              left_out.py
====================  ==================  =======================  =======================

============================================  ================================
options that a user may choose                options.py
what recordings are and could show            check.py
effects that they could show                  effects_in_data.py
trials that no fit sees                       by_link/judged_units.py
links simulated with measured inputs          ../comparison/chain_simulator.py
rows at rest                                  ../comparison/rest_simulator.py
what separates the branches of a loop         ../comparison/loop_simulator.py
what an effect promises, before any fit       by_link/promise.py
search for effects                            by_link/search.py
judgement on data that no fit has seen        by_link/judge.py
from where on something is claimed, or left   by_link/limits.py
how deep a name holds                         by_link/judged.py
sizes and their intervals                     by_link/sizes.py
the whole chain, before and after             by_link/whole_chain.py
what was found, in the units of the rig       by_link/entries.py
what to measure next                          by_link/next_experiment.py
the result, its JSON and its sentence         by_link/result.py
size of an effect, whichever form it has      physical_size.py
the tests that such a size is found by        virtual_tests.py
a rig taken apart for them, their conditions  bench.py
the rig with the effects                      fitted_rig.py
============================================  ================================
"""
