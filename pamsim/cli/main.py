"""The ``pamsim`` command: finds the subcommand, and turns our errors into one line and exit code 2.

Subcommands are imported only when they are run, so that ``pamsim --help`` is immediate. The library
names an argument in backticks, such as `hold_out`; on the command line the flag is shown instead.
"""

from __future__ import annotations

import contextlib
import errno
import gc
import importlib
import os
import re
import signal
import sys
import threading
import traceback
from collections.abc import Generator
from types import FrameType
from typing import Any

import click

from pamsim import __version__
from pamsim.cli.command import verbose
from pamsim.core.errors import PamsimError, nearest

OK, BAD_INPUT, INTERRUPTED = 0, 2, 130

_LATER = 0.05  # until an interruption that had to wait is tried again [s]
_AGAIN = 3.0  # until one that a library may have swallowed is, longer than folders take to be freed
_OBJECTS = 50_000  # that may come to be between two collections, about as many as imports leave

_COMMANDS = {
    "demo": "Hide an effect in recordings of the arm and find it: what pamsim is for, in a minute.",
    "reproduce": "Simulate every printed MAS-20 experiment and compare (the main job).",
    "step": "One step response of any rig: pressures or valves, load, plot, CSV.",
    "identify": "Transfer functions from a recording or a simulation, with intervals and verdict.",
    "fit": "Fit a law to your force, length or pressure data, or rank all laws on them.",
    "list": "The rigs, parameters, laws, effects and inputs that there are, or all about one.",
    "new-rig": "A rig folder to start from, by a template or from your own MJCF.",
    "import": "A recording of your own log: CSV, MAT, npz or Parquet, its columns guessed.",
    "check": "What recordings are, what is implausible in them, and what they could show.",
    "calibrate": "Fit rig parameters to recordings and static tables; writes the new rig.",
    "diagnose": "Find where a rig and recordings disagree, name the missing effect, add it.",
    "hide": "Synthetic recording of a rig with hidden effects, the ground truth in a file apart.",
    "replicate": "Recompute every printed number of the five papers; what agrees, what not.",
    "sweep": "Simulate over varied parameters, inputs, effects or rigs: one table, sensitivities.",
    "train": "A policy for any rig by reinforcement learning (PPO).",
    "render": "A picture of a rig, or a film of a recording, without a screen.",
    "view": "A window on a rig that you drive by sliders, or on a recording.",
}

_MODULES = {"new-rig": "new_rig", "import": "import_log", "list": "catalogs", "simulate": "step"}
"""Module of a command that has not the command's name."""

_ALIASES = ("simulate",)
"""Further names, which the list of commands does not show."""

_LISTED = ("rigs", "params", "models", "effects", "protocols")
"""What ``pamsim list`` lists."""


class NamedGroup(click.Group):
    """A group that suggests the nearest of its commands for a mistyped name."""

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """Find the command of the arguments."""
        known = self.list_commands(ctx)
        if args and args[0] in _LISTED and args[0] not in known:
            raise click.UsageError(f"no command {args[0]!r}; it is `pamsim list {args[0]}`")
        if args and self.get_command(ctx, args[0]) is None and not args[0].startswith("-"):
            raise click.UsageError(f"no command {args[0]!r}; {nearest(args[0], known)}")
        return super().resolve_command(ctx, args)


class _LazyGroup(NamedGroup):
    """A group whose commands live in modules of the same name beside this one."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands, in the order a reader meets them."""
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command, or None."""
        if cmd_name not in _COMMANDS and cmd_name not in _ALIASES:
            return None
        module = _MODULES.get(cmd_name, cmd_name)
        return importlib.import_module(f"pamsim.cli.{module}").command

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; an error of ours is one line, with the command's own flags."""
        try:
            return super().invoke(ctx)
        except PamsimError as error:
            command = self.get_command(ctx, str(ctx.invoked_subcommand))
            if verbose():
                traceback.print_exception(error)
            _echo_error(with_flags(str(error), command))
            ctx.exit(BAD_INPUT)
        except OSError as error:
            if error.errno == errno.EPIPE:
                raise
            where = f"{error.filename}: " if error.filename else ""
            _echo_error(f"{where}{error.strerror or error}")
            ctx.exit(BAD_INPUT)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(_COMMANDS.items()))


def _usage(error: click.UsageError) -> str:
    """What is wrong with a command line, in one line: every option missing, or click's words."""
    text = error.format_message().replace(". (", " (").rstrip(".")
    text = text[:1].lower() + text[1:]
    if error.ctx is None:
        return text
    if isinstance(error, click.MissingParameter) and isinstance(error.param, click.Option):
        words = {word.partition("=")[0] for word in sys.argv[1:]}
        missing = (
            f"{one.opts[0]} ({(one.help or '').rstrip('.')})"
            for one in error.ctx.command.params
            if isinstance(one, click.Option) and one.required and words.isdisjoint(one.opts)
        )
        text = f"missing {', '.join(missing)}"
    elif "unexpected extra argument" in text:  # mostly --pressure 400 100
        text += ": values of a list are joined by commas, as 400,100"
    # Without the name of the program, which is python -m pamsim in some calls.
    command = error.ctx.command_path.removeprefix(error.ctx.find_root().command_path)
    return f"{text}; `pamsim{command} --help` shows all"


def _echo_error(text: str) -> None:
    click.echo(f"pamsim: {click.style('error:', fg='red')} {text}", err=True)


def with_flags(message: str, command: click.Command | None) -> str:
    """Show the flags of a command, or of those of a group, where a message names arguments.

    "`hold_out` leaves nothing to fit" becomes ``--hold-out leaves nothing to fit``; what is no
    parameter of the command keeps its backticks.
    """
    own = command.commands.values() if isinstance(command, click.Group) else (command,)
    flags = {
        parameter.name: parameter.opts[0]
        if isinstance(parameter, click.Option)
        else parameter.human_readable_name
        for one in own
        for parameter in (one.params if one else ())
    }
    return re.sub(r"`(\w+)`", lambda name: flags.get(name[1], name[0]), message)


@click.group(cls=_LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="pamsim")
def cli() -> None:
    """Pneumatic artificial muscles in MuJoCo: simulate, identify, find what the model misses."""


def _in_llvm(frame: FrameType | None) -> bool:
    """Whether a call into LLVM is under way, whose half-made objects would end the process."""
    while frame is not None:
        if frame.f_globals.get("__name__", "").partition(".")[0] == "llvmlite":
            return True
        frame = frame.f_back
    return False


@contextlib.contextmanager
def _interruptible() -> Generator[threading.Event]:
    """SIGINT and SIGTERM raise `KeyboardInterrupt`; the event is set once one has come.

    To be ended is to be interrupted: what is computed is kept, and folders are released.
    """
    ended = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield ended
        return

    def later(seconds: float) -> None:
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, seconds)
        elif seconds == _LATER:  # Windows
            threading.Timer(seconds, signal.raise_signal, [signal.SIGINT]).start()

    def end(_: int, frame: FrameType | None) -> None:
        ended.set()
        waits = _in_llvm(frame)
        later(_LATER if waits else _AGAIN)
        if not waits:
            raise KeyboardInterrupt

    def again(unraisable: Any) -> None:
        """Interrupt once more where a callback of the compiler has swallowed it.

        What fails to be freed after an interruption, such as a half-made image, is not reported.
        """
        if unraisable.exc_type is KeyboardInterrupt:
            later(_LATER)
        elif not ended.is_set():
            hook(unraisable)

    hook, sys.unraisablehook = sys.unraisablehook, again
    known = (getattr(signal, name, None) for name in ("SIGINT", "SIGTERM", "SIGALRM"))
    before = {number: signal.signal(number, end) for number in known if number}
    try:
        yield ended
    finally:
        later(0.0)  # never
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, handler)


def main() -> None:
    """Run the command of the arguments: exit 0 ok, 1 a check failed, 2 bad input, 130 ended."""
    # What is imported stays: to search it for cycles time and again costs a tenth of a second.
    gc.set_threshold(_OBJECTS)
    with _interruptible() as ended:
        try:
            # Without a terminal click prints no colours; NO_COLOR asks for none on one.
            color = False if os.environ.get("NO_COLOR") else None
            code = cli.main(standalone_mode=False, color=color)
        except click.UsageError as error:
            if type(error).__name__ == "NoArgsIsHelpError":  # which click 8.1 has not
                error.show()
            else:
                _echo_error(_usage(error))
            code = BAD_INPUT
        except (Exception, KeyboardInterrupt) as error:
            # An interrupted import raises whatever it likes, such as an ImportError.
            if not isinstance(error, click.Abort | KeyboardInterrupt) and not ended.is_set():
                raise
            click.echo("pamsim: interrupted", err=True)
            code = INTERRUPTED
    sys.exit(code if isinstance(code, int) else OK)
