"""What is beyond `pamsim.core.limits` is refused in one line, before it costs anything."""

from __future__ import annotations

import re
import shutil
import time
from pathlib import Path

import numpy as np
import pyarrow
import pytest
import scipy.io
from pyarrow import parquet

import pamsim
from pamsim.core import limits
from pamsim.core.encoding import read_json
from pamsim.core.errors import InputError
from pamsim.core.toml_tables import read_toml
from pamsim.engine.mjcf import require_size
from pamsim.recordings.rig_file import read_effects, shipped_rigs
from pamsim.recordings.table_reader import read_columns
from tests.unit.core.refusals import refused

PAGE = Path(__file__).parents[3] / "docs" / "files.md"


def test_the_page_lists_every_limit_with_its_value():
    text = PAGE.read_text(encoding="utf-8")
    rows = re.findall(r"^\| .+ \| `([A-Z_]+)` \| ([\d,]+) ?(MiB)?.* \|$", text, re.MULTILINE)
    listed = {
        name: int(number.replace(",", "")) << (20 if unit else 0) for name, number, unit in rows
    }
    stated = {name: value for name, value in vars(limits).items() if name.isupper()}
    assert listed == stated


def test_a_file_that_is_too_large_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "file"
    path.write_bytes(b" " * ((1 << 20) + 1))
    for limit, read in (
        ("pamsim.core.toml_tables.TOML_BYTES", read_toml),
        ("pamsim.core.encoding.JSON_BYTES", lambda path: read_json(path, "any")),
        ("pamsim.recordings.table_reader.TABLE_BYTES", read_columns),
        ("pamsim.engine.mjcf.MJCF_BYTES", require_size),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(limit, 1 << 20)
            with refused("file has more than 1 MiB, the most read"):
                read(path)
    with refused("/dev/zero has more than 4 MiB"):  # a file without end
        read_toml(Path("/dev/zero"))


def test_code_that_is_too_large_is_refused_and_may_begin_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "effects.py"
    path.write_bytes("\ufeffLAWS = []\r\n".encode())
    assert read_effects(tmp_path).laws == ()
    with path.open("r+b") as file:
        file.truncate(1 << 40)  # takes no room on the disk
    with refused("effects.py has more than 1 MiB, the most read"):
        read_effects(tmp_path)


def test_a_table_of_too_many_cells_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("pamsim.recordings.table_reader.TABLE_CELLS", 300)
    text, packed = tmp_path / "log.csv", tmp_path / "log.npz"
    text.write_text("time_s,a,b\n" + "0.1;1,2,3\n" * 100)
    np.savez(packed, a=np.zeros(200), b=np.zeros(200))
    for path in (text, packed):
        with pytest.raises(InputError, match=r"log\.\w+ has about \d+ cells"):
            read_columns(path)


def test_a_table_of_too_many_columns_or_too_long_lines_is_refused(tmp_path):
    path = tmp_path / "log.csv"
    many = limits.TABLE_COLUMNS + 1
    header = ",".join(f"c{i}" for i in range(many))
    path.write_text(header + "\n" + ",".join("1" * many) + "\n")
    with pytest.raises(InputError, match=r"has 1,001 columns; a table has 1,000 at most"):
        read_columns(path)
    path.write_text("time_s,p" + "9" * 5000 + "_kpa\n0.1,1\n0.2,1\n")
    with pytest.raises(InputError, match=r"the name of a column has 5,005 characters"):
        read_columns(path)
    # Longer than a cell that Python's reader takes.
    path.write_text("time_s,a\n0.1," + "1" * 140_000 + "\n0.2,1\n")
    with pytest.raises(InputError, match=r"line 2 has 140,004 characters"):
        read_columns(path)


@pytest.mark.parametrize("ending", ["npz", "parquet", "mat"])
def test_arrays_that_unfold_to_more_than_allowed_are_refused(ending, tmp_path, monkeypatch):
    monkeypatch.setattr("pamsim.recordings.array_files.ARRAY_BYTES", 1 << 20)
    path = tmp_path / f"log.{ending}"
    values = np.zeros(140_000)
    if ending == "npz":
        np.savez_compressed(path, a=values)
    elif ending == "mat":
        scipy.io.savemat(path, {"a": values}, do_compression=True)
    else:
        parquet.write_table(pyarrow.table({"a": values}), path)
    assert path.stat().st_size < 10_000
    with pytest.raises(
        InputError, match=r"its arrays (have 1 MiB, above the limit of 1|are larger)"
    ):
        read_columns(path)


@pytest.fixture
def rig_with(tmp_path):
    """The arm's folder with a text in front of the end of its MJCF."""
    folder = tmp_path / "rig"
    shutil.copytree(shipped_rigs() / "mas20_arm", folder)
    mjcf = folder / "mas20_arm.xml"
    text = mjcf.read_text(encoding="utf-8")

    def put(inside: str) -> Path:
        mjcf.write_text(text.replace("</mujoco>", inside + "</mujoco>"), encoding="utf-8")
        return folder

    return put


CABLE = '<composite prefix="x" type="cable" count="100 100 100" size="1"/>'
LARGE = '<texture name="t" builtin="flat" width="99999" height="99999"/>'
MANY = '<replicate count="3000000"><geom size="1"/></replicate>'
NESTED = '<replicate count="200"><replicate count="200"><site/></replicate></replicate>'
TOO_MUCH = (
    (f"<worldbody>{MANY}</worldbody>", r"asks for 3,000,\d+ elements"),
    (f"<worldbody>{NESTED}</worldbody>", r"asks for 40,\d+ elements"),
    (f"<worldbody><body>{CABLE}</body></worldbody>", r"asks for 1,000,\d+ elements"),
    ('<size nkey="100000000"/>', r"<size> nkey='100000000' is 100,000,000; 100,000 is"),
    ('<size nuser_geom="1e9"/>', r"<size> nuser_geom='1e9' is 1,000,000,000"),
    (f"<asset>{LARGE}</asset>", r"<texture> width times height is 9,999,800,001"),
)


def test_an_mjcf_that_asks_for_too_much_is_refused(rig_with):
    for inside, message in TOO_MUCH:
        folder = rig_with(inside)
        began = time.process_time()
        with pytest.raises(InputError, match=message):
            pamsim.load_rig(folder)
        assert time.process_time() - began < 1.0


def test_included_files_count_and_may_form_a_circle(rig_with):
    folder = rig_with('<include file="more.xml"/>')
    more = folder / "more.xml"
    more.write_text(
        '<mujoco><worldbody><replicate count="20000"><site/></replicate></worldbody></mujoco>'
    )
    with pytest.raises(InputError, match=r"asks for 20,\d+ elements"):
        pamsim.load_rig(folder)
    more.write_text('<mujoco><include file="mas20_arm.xml"/></mujoco>')
    require_size(folder / "mas20_arm.xml")


def test_a_run_of_too_many_samples_or_steps_is_refused():
    with pytest.raises(InputError, match=r"100000 s at 500 Hz are 50,000,000 samples"):
        pamsim.pressure_step((1e5, 1e5), (1e5, 0.0), duration=1e5)
    step = pamsim.pressure_step((1e5, 1e5), (1e5, 0.0), duration=1.0)
    with pytest.raises(InputError, match=r"are 5,000,000,000,000 steps; a run has 1,000,000,000"):
        pamsim.simulate("mas20_arm", step, timestep=1e-12)
