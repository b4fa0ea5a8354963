"""Where simulation and data disagree, which effect is missing, and how sure that is.

`pamsim.diagnosis.diagnose` chooses by the kind of data. Each kind has its files:

====================  ==================  =======================  =======================
what                  recordings          table of angles at rest  length-pressure loop
====================  ==================  =======================  =======================
data and rig          recordings.py       table_at_rest.py         length_pressure_loop.py
by_link/              diagnose_links.py   diagnose_rest.py         diagnose_rest.py
fits                  link_fit.py         rest_fit.py              rest_fit.py
data no fit has seen  held_out.py         left_out.py              left_out.py
../comparison/        chain_simulator.py  rest_simulator.py        loop_simulator.py
====================  ==================  =======================  =======================

They share the rule of the verdict, and the result with its sentence and its JSON:

==================================================  ==============================
what recordings are and could show, before all      check.py
recordings set beside a rig                         compared_recordings.py
which trials or parts of them no fit sees           held_out_split.py
trials cut into parts, for want of repeats          ../comparison/trial_parts.py
noise floor, from repeats or within trials          ../comparison/noise_floor.py
excess per channel and protocol, residual maps      method/where.py
the same with the arm driven by measured pressures  measured_pressures.py
p-value of a better held-out prediction             method/evidence.py
p-value of lack of fit, from repeats                method/lack_of_fit.py
what varies from trial to trial, projected out      method/trial_variation.py
models that predict as well                         method/rivals.py
the verdict from all of that                        method/verdict.py
thresholds of the verdict                           method/verdict_thresholds.py
size of an effect, whichever form it has            physical_size.py
the tests that such a size is found by              virtual_tests.py
how large an absent effect could be                 method/absent_limits.py
next experiment, and the menu                       method/next_experiment.py
held-out error before and after the repair          method/gap.py
the result and its JSON                             result.py
==================================================  ==============================
"""
