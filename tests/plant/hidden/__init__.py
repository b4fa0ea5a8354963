"""Effects that are hidden in the independent plant, by formulas that the library does not share.

`hidden_effect` defines what an effect is, a file per layer holds them, `catalog` finds them by
name, and `virtual_tests` measures their size in terms that no formula defines, such as a breakaway
torque.
"""
