"""Fits of a diagnosis on disk, so that an interrupted one goes on where it stopped."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Iterator, Mapping, MutableMapping
from pathlib import Path
from typing import Any

import numpy as np

from pamsim.core.encoding import CheckpointFile
from pamsim.core.errors import InputError
from pamsim.core.files import complete_file

FILE, ARRAYS = "fits.json", "fits"
_FORMAT = 2


class RememberedFits(MutableMapping[str, Mapping[str, Any]]):
    """A mapping whose every new entry is on disk before the next fit begins.

    An entry is JSON-safe but for its ``jacobian``, an array, which is kept in a file of its own.

    Args:
        folder: of the diagnosis.
        settings: JSON-safe; fits of other settings are not taken up.
        resume: True to go on with what is there.

    Raises:
        InputError: on resuming if there is nothing, or it belongs to another diagnosis.
    """

    def __init__(self, folder: Path, settings: Any, *, resume: bool = False) -> None:
        text = json.dumps([_FORMAT, settings], sort_keys=True, default=str)
        self._settings = hashlib.sha256(text.encode()).hexdigest()
        self._folder = folder
        self._file = CheckpointFile(folder / FILE)
        self._fits: dict[str, Mapping[str, Any]] = {}
        if not resume:
            self._file.clear()
            for old in (folder / ARRAYS).glob("*.npy"):
                old.unlink()
            return
        state = self._file.load()
        if state is None:
            raise InputError(f"`resume`: {folder} holds no interrupted diagnosis")
        if state.get("settings") != self._settings:
            raise InputError(
                f"`resume`: {folder / FILE} is of other data, another rig, other options or"
                " versions; start without `resume`"
            )
        self._fits = dict(state["fits"])

    def __getitem__(self, key: str) -> Mapping[str, Any]:
        fit = self._fits[key]
        file = self._folder / fit["jacobian"]
        try:
            jacobian = np.load(file, allow_pickle=False)
        except (OSError, ValueError, EOFError) as error:
            raise InputError(
                f"`resume`: cannot read {file}: {error}; start without `resume`"
            ) from None
        return {**fit, "jacobian": jacobian}

    def __setitem__(self, key: str, value: Mapping[str, Any]) -> None:
        name = f"{ARRAYS}/{hashlib.sha256(key.encode()).hexdigest()[:16]}.npy"
        content = io.BytesIO()  # by numpy itself, a full disk would be an error without its reason
        np.save(content, value["jacobian"], allow_pickle=False)
        with complete_file(self._folder / name) as part:
            part.write_bytes(content.getbuffer())
        self._fits[key] = {**value, "jacobian": name}
        self._file.save({"settings": self._settings, "fits": self._fits})

    def __delitem__(self, key: str) -> None:
        del self._fits[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._fits)

    def __len__(self) -> int:
        return len(self._fits)
