"""The largest input that is read or computed: what is beyond is broken, or a slip.

Each limit keeps a refusal within a second and a gigabyte; docs/files.md lists them.
"""

# Bytes of files.
TOML_BYTES = 4 << 20  # read at a few megabytes a second; a shipped rig's has 6 kB
CODE_BYTES = 1 << 20  # an effects.py: seconds to compile; weights belong in a file beside it
MJCF_BYTES = 64 << 20  # meshes may stand in it as text
JSON_BYTES = 256 << 20
TABLE_BYTES = 256 << 20  # in text; larger logs: Parquet or .npz, a third the size
ARRAY_BYTES = 1 << 28  # that arrays may unfold to, copies of which must fit into a gigabyte

# What an MJCF asks for. 10,000 bodies take MuJoCo 12 s, and the time grows with the square.
MJCF_PARTS = 10_000  # elements, repeated ones counted as often as they are made
MJCF_NUMBERS = 100_000  # in one place: keyframes, user data, the dimension of a sensor
MJCF_PIXELS = 1 << 24  # of a texture, and points of a height field

# Tables of any format. A cell takes about 100 bytes while it is read.
TABLE_COLUMNS = 1_000
TABLE_CELLS = 20_000_000  # 33 min at 1 kHz with ten columns
NAME_CHARACTERS = 200  # of a column, whose name may hold a number
LINE_CHARACTERS = 100_000  # Python's reader refuses cells of 131,072

QUANTITY_CHARACTERS = 200  # number and unit: the search through thousands of digits takes minutes

# Of one simulated run, and rows of a sweep.
RUN_SAMPLES = 10_000_000  # nearly three hours at 1 kHz
RUN_STEPS = 1_000_000_000  # more than half an hour of computing
SWEEP_RUNS = 10_000_000

HEAVIEST_LOAD = 100.0  # on a recorded arm [kg]: more than arms of such muscles lift
