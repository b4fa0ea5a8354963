"""Compiled code that cannot be read is compiled again."""

from __future__ import annotations

import os
import subprocess
import sys

CODE = """
from pamsim.numba_cache import numba

@numba.njit(cache=True)
def twice(x):
    return 2.0 * x

print(twice(2.0), dict(twice.stats.cache_hits))
"""


def test_a_damaged_file_of_the_cache_is_made_again(tmp_path):
    (tmp_path / "twice.py").write_text(CODE, encoding="utf-8")
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}

    def found_in_cache():
        command = [sys.executable, str(tmp_path / "twice.py")]
        done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        result, _, hits = done.stdout.partition(" ")
        assert result == "4.0"
        return "1" in hits

    assert not found_in_cache()
    for end, size in (("nbi", 12), ("nbc", 200)):  # index and code
        (file,) = tmp_path.rglob(f"*.{end}")
        os.truncate(file, size)
        assert not found_in_cache(), end
    assert found_in_cache()
