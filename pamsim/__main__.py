"""``python -m pamsim`` and the console script: the command line, in a process of its own."""

import atexit
import contextlib
import os
import signal
import sys
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any, NoReturn

_INTERRUPTED = 130  # as in pamsim.cli.main, whose import may be what is interrupted
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def program() -> None:
    """As `pamsim.cli.main.main`, also interrupted in one line while that is imported.

    Nothing interrupts the interpreter in its own end.
    """
    interrupted = False

    def end(*_: object) -> None:
        nonlocal interrupted
        interrupted = True
        raise KeyboardInterrupt

    for number in _SIGNALS:
        signal.signal(number, end)
    if hasattr(signal, "pthread_sigmask"):  # not on Windows, where glfw starts no process
        sys.meta_path.insert(0, _GlfwFinder())
    try:
        from pamsim.cli.main import main

        main()
    except SystemExit as ended:
        if ended.code == _INTERRUPTED:
            _leave()
        raise
    except BaseException:
        if not interrupted:
            raise
        print("pamsim: interrupted", file=sys.stderr)
        _leave()
    finally:
        _undisturbed()


class _GlfwFinder:
    """Has signals wait until glfw is imported, as MuJoCo does.

    That asks for a version in a process of its own. Ctrl-C in a terminal reaches this one, too, and
    it would print a traceback.
    """

    def find_spec(self, name: str, path: Any, target: object = None) -> ModuleSpec | None:
        """The module that starts the process, in which no signal is delivered; None for others."""
        spec = PathFinder.find_spec(name, path) if name == "glfw.library" else None
        if spec is None or spec.loader is None:
            return None
        usual = spec.loader.exec_module

        def exec_module(module: ModuleType) -> None:
            before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
            try:
                usual(module)
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)

        spec.loader.exec_module = exec_module
        return spec


def _undisturbed() -> None:
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def _leave() -> NoReturn:
    """End as interrupted, and finalise nothing.

    An import may have been interrupted: Python would print what its half-made objects raise as they
    are deleted, abort where a thread still prints, or report the signal instead of the code.
    """
    _undisturbed()
    atexit._run_exitfuncs()  # pyright: ignore[reportPrivateUsage, reportAttributeAccessIssue]
    with contextlib.suppress(OSError):  # nobody reads
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(_INTERRUPTED)


if __name__ == "__main__":
    program()
