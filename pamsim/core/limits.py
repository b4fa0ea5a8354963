"""The largest input that is read or computed: what is beyond is broken, or a slip.

Each limit keeps a refusal within a second and a gigabyte; docs/files.md lists them.
"""

TOML_BYTES = 4 << 20
"""Of a TOML file: it is read at a few megabytes a second. A shipped rig's has 6 kB."""

MJCF_BYTES = 64 << 20
"""Of an MJCF, in which meshes may stand as text."""

MJCF_PARTS = 10_000
"""Elements of an MJCF, repeated ones counted as often as MuJoCo makes them: 10,000 bodies take it
12 s, and the time grows with the square."""

MJCF_NUMBERS = 100_000
"""Numbers for which an MJCF asks in one place: keyframes, user data, the dimension of a sensor."""

MJCF_PIXELS = 1 << 24
"""Of a texture, and points of a height field."""

JSON_BYTES = 256 << 20
"""Of a checkpoint or result."""

TABLE_BYTES = 256 << 20
"""Of a table in text. Larger logs: Parquet or ``.npz``, a third the size."""

TABLE_COLUMNS = 1_000
TABLE_CELLS = 20_000_000
"""Rows times columns of a table, of any format: 33 min at 1 kHz with ten columns. Each takes about
100 bytes while the table is read."""

NAME_CHARACTERS = 200
"""Of a column's name, which may hold a number."""

LINE_CHARACTERS = 100_000
"""Of a line of a table in text; Python's reader refuses cells of 131,072."""

ARRAY_BYTES = 1 << 30
"""That a file's compressed arrays may unfold to."""

QUANTITY_CHARACTERS = 200
"""Of a number with its unit: the search through thousands of digits takes minutes."""

RUN_SAMPLES = 10_000_000
"""Of one simulated run: nearly three hours at 1 kHz."""

RUN_STEPS = 1_000_000_000
"""Time steps of one simulated run, which take more than half an hour."""

SWEEP_RUNS = 10_000_000
"""Rows of a sweep's table."""

HEAVIEST_LOAD = 100.0
"""On a recorded arm [kg]: more than arms of such muscles lift."""
