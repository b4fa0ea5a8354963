"""Write a picture to disk."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError


def write_picture(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an image; the format follows the file's ending.

    Args:
        path: ending in .png, .jpg or another that Pillow knows; its folder is created.
        image: (height, width, 3) RGB.

    Raises:
        InputError: if the ending is unknown or the place cannot be written.
    """
    from PIL import Image

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(image).save(path)
    except ValueError:
        raise InputError(f"{path}: unknown picture format; use .png or .jpg") from None
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from None
