"""Write pictures and films: by Pillow, MP4 by the ffmpeg of the optional ``imageio-ffmpeg``."""

from __future__ import annotations

import contextlib
import errno
import os
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.core.files import complete_file

Picture = NDArray[np.uint8]

FILM_SUFFIXES = (".gif", ".mp4")

_GIF_FASTEST = 50.0  # that every viewer still shows at the right pace [Hz]
_COLOURS = 255  # one of 256 is left for "as before", which keeps a GIF small
_CRF = "10"  # constant quality of H.264, from 0, without loss, to 51


def write_picture(path: Path, image: Picture) -> None:
    """Write an image (height, width, 3) RGB in the format of the file's ending.

    Raises:
        InputError: for an unknown ending, or a place that cannot be written.
    """
    from PIL import Image

    try:
        with complete_file(path) as part:
            Image.fromarray(image).save(part)
    except ValueError:
        raise InputError(f"{path}: unknown picture format; use .png or .jpg") from None


def check_film(path: Path, fps: float) -> None:
    """Check that a film of some frames per second [Hz] can be written, before any is drawn.

    Raises:
        InputError: for an unknown ending, too many frames per second, no ffmpeg.
    """
    suffix = path.suffix.lower()
    if suffix not in FILM_SUFFIXES:
        raise InputError(f"{path}: unknown film format; use {' or '.join(FILM_SUFFIXES)}")
    if suffix == ".gif" and fps > _GIF_FASTEST:
        raise InputError(
            f"a GIF shows at most {_GIF_FASTEST:g} frames per second, not {fps:g}; write an .mp4"
        )
    if suffix == ".mp4":
        try:
            import imageio_ffmpeg  # noqa: F401
        except ImportError:
            raise InputError(
                f'{path}: an .mp4 needs ffmpeg: pip install "pamsim[video]", or write a .gif'
            ) from None


def write_film(
    path: Path, frames: Iterable[Picture], *, fps: float, palette_from: Sequence[Picture]
) -> None:
    """Write a film, .gif, which then loops, or .mp4; see `pamsim.core.files.complete_file`.

    Frames (height, width, 3) RGB are all of one size; ``fps`` of them are shown per second [Hz].
    ``palette_from`` are some that show all colours of the film, for the one palette of a GIF.

    Raises:
        InputError: as `check_film`, or if the place cannot be written.
    """
    check_film(path, fps)
    with complete_file(path) as part:
        if path.suffix.lower() == ".gif":
            _write_gif(part, frames, fps, palette_from)
        else:
            _write_mp4(part, frames, fps)


def _write_gif(
    path: Path, frames: Iterable[Picture], fps: float, palette_from: Sequence[Picture]
) -> None:
    from PIL import Image

    sheet = Image.fromarray(np.concatenate(list(palette_from)))
    palette = sheet.quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)
    # One palette and no dithering: what stands still has the same pixels in every frame.
    first, *rest = (
        Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)
        for frame in frames
    )
    # GIF counts hundredths of a second; rounding each frame alone would shift the pace.
    ends = np.round(100.0 * np.arange(len(rest) + 2) / fps)
    durations = (10 * np.diff(ends)).astype(int).tolist()
    first.save(path, save_all=True, append_images=rest, duration=durations, loop=0, disposal=1)


def _write_mp4(path: Path, frames: Iterable[Picture], fps: float) -> None:
    import imageio_ffmpeg

    rest = iter(frames)
    first = next(rest)
    height, width = first.shape[:2]
    # The common colour format halves the colours' resolution: sizes must be even.
    padding = ((0, height % 2), (0, width % 2), (0, 0))
    size = f"{width + width % 2}x{height + height % 2}"
    command = [
        *(imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-v", "error"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", str(fps), "-i", "-"),
        *("-pix_fmt", "yuv420p", "-crf", _CRF, str(path)),
    ]
    with (
        tempfile.TemporaryFile() as log,
        # In a session of its own, Ctrl-C does not reach it: what is begun is ended from here.
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stderr=log, start_new_session=True
        ) as ffmpeg,
    ):
        assert ffmpeg.stdin is not None
        try:
            # A broken pipe: it has ended, and why stands in its log.
            with contextlib.suppress(BrokenPipeError):
                for frame in chain([first], rest):
                    ffmpeg.stdin.write(np.pad(frame, padding, mode="edge").tobytes())
            with contextlib.suppress(BrokenPipeError):
                ffmpeg.stdin.close()
        except BaseException:
            ffmpeg.kill()
            raise
        if ffmpeg.wait() != 0:
            log.seek(0)
            raise _error_of(log.read().decode(errors="replace"))


def _error_of(log: str) -> OSError:
    for number in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT):
        if os.strerror(number) in log:
            return OSError(number, os.strerror(number))
    return OSError(f"ffmpeg failed: {' '.join(log.split()[-20:])}")
