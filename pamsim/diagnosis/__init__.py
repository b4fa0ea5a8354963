"""Where simulation and data disagree, which effects are missing, and how sure that is.

`pamsim.diagnosis.diagnose` chooses by the kind of data. Recordings are diagnosed link by link:

============================================  ==============================
recordings beside a rig, from first to last   recordings.py
options that a user may choose                options.py
what recordings are and could show            check.py
effects that they could show                  effects_in_data.py
trials that no fit sees                       held_out_split.py
the method in one function                    by_link/diagnose_links.py
fits to the residuals of links                by_link/link_fit.py
what an effect promises, before any fit       by_link/promise.py
search for effects                            by_link/search.py
judgement on trials that no fit has seen      by_link/judge.py
sizes and their intervals                     by_link/sizes.py
what is left in a link                        by_link/remainder.py
the whole chain, before and after             by_link/whole_chain.py
values of the whole rig                       by_link/chain_values.py
what to measure next                          by_link/next_experiment.py
the result, its JSON and its sentence         by_link/result.py
size of an effect, whichever form it has      physical_size.py
the tests that such a size is found by        virtual_tests.py
the rig with the effects                      repaired_rig.py
============================================  ==============================

Tables at rest and length-pressure loops have an older method:

============================================  ==============================
a table of angles at rest                     table_at_rest.py
a length-pressure loop                        length_pressure_loop.py
p-value of a better prediction                method/evidence.py
models of rows and loops                      method/row_model.py
the same of loops                             method/loop_fit.py
the verdict                                   method/verdict.py
the result and its JSON                       result.py
============================================  ==============================
"""
