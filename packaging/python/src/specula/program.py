"""Runs the program `specula`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sysconfig
import tempfile
from collections.abc import Generator, Iterable
from pathlib import Path

from .errors import ProgramNotFound, SpeculaError
from .events import BuildError, Diagnostics, Event, Failed, Rejected, parse

__all__ = ["BuildFailed", "ItemsFailed", "ManifestInvalid", "build", "find_program"]

#: The variable that names the program.
VARIABLE = "SPECULA_PROGRAM"

#: How long a program that was asked to stop may take, in seconds.
PATIENCE = 10.0


class BuildFailed(SpeculaError):
    """A build failed: the message is the program's, `help` says what to do, and `exit_code` is as
    docs/features.md lists it."""

    def __init__(self, message: str, exit_code: int, help: str | None = None) -> None:
        super().__init__(message if help is None else f"{message}\nhint: {help}")
        self.exit_code = exit_code
        self.help = help


class ManifestInvalid(BuildFailed):
    """The manifest, or a file that it names, has errors: `diagnostics` has their places."""

    def __init__(self, diagnostics: Diagnostics, exit_code: int) -> None:
        super().__init__(str(diagnostics), exit_code)
        self.diagnostics = diagnostics


class ItemsFailed(BuildFailed):
    """Items failed; the others are built. `failures` are their events."""

    def __init__(self, failures: tuple[Failed, ...], exit_code: int) -> None:
        texts = []
        for failed in failures:
            help = "" if failed.help is None else f"\nhint: {failed.help}"
            texts.append(f"{failed.item} failed: {': '.join(failed.error)}{help}")
        super().__init__("\n".join(texts), exit_code)
        self.failures = failures


def find_program(program: str | os.PathLike[str] | None = None) -> Path:
    """The program: `program` or else the variable SPECULA_PROGRAM if one is given, else that of this
    environment, else that of PATH.

    Raises ProgramNotFound.
    """
    named = program or os.environ.get(VARIABLE)
    if named:
        found = shutil.which(named)
        if found is None:
            raise ProgramNotFound(f"{os.fspath(named)} is not a program that can be run")
        return Path(found)
    # Where installers put the scripts of a wheel: into the environment, for the user, or beside a --target.
    user = sysconfig.get_path("scripts", sysconfig.get_preferred_scheme("user"))
    folders = [sysconfig.get_path("scripts"), user, str(Path(__file__).parents[1] / "bin"), None]
    for folder in folders:
        found = shutil.which("specula", path=folder)
        if found is not None:
            return Path(found)
    searched = ", ".join(folder for folder in folders if folder is not None)
    raise ProgramNotFound(f"there is no program specula in {searched} or on PATH; {VARIABLE} may name it")


def build(
    manifest: str | os.PathLike[str] = "pipeline.toml",
    stages: Iterable[str] = (),
    *,
    force: bool = False,
    dry_run: bool = False,
    fail_fast: bool = False,
    jobs: int | None = None,
    program: str | os.PathLike[str] | None = None,
) -> Generator[Event, None, None]:
    """Builds a manifest, or the named stages and items (`"map [sky, gold]"`), and yields each event as it
    happens.

    The build runs while the events are read. Closing the generator, or leaving a loop over it that nothing
    else refers to, stops the build at its next step; the next build continues from there.

    Raises, after the last event, ManifestInvalid, ItemsFailed, or BuildFailed for every other reason, and
    ProgramNotFound.
    """
    arguments = [str(find_program(program)), "build", "--json", f"--manifest={os.fspath(manifest)}"]
    arguments += ["--force"] * force + ["--dry-run"] * dry_run + ["--fail-fast"] * fail_fast
    arguments += [] if jobs is None else [f"--jobs={jobs}"]
    arguments += ["--", *stages]
    failures: list[Failed] = []
    end: Rejected | BuildError | None = None
    with tempfile.TemporaryFile() as messages:
        process = subprocess.Popen(
            arguments, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=messages
        )
        assert process.stdout is not None
        try:
            for line in process.stdout:
                event = parse(line)
                if isinstance(event, (Rejected, BuildError)):
                    end = event
                    continue
                if isinstance(event, Failed):
                    failures.append(event)
                if event is not None:
                    yield event
            exit_code = process.wait()
        finally:
            _stop(process)
        messages.seek(0)
        said = messages.read().decode(errors="replace").strip()
    if isinstance(end, Rejected):
        raise ManifestInvalid(end.diagnostics, exit_code)
    if isinstance(end, BuildError):
        raise BuildFailed(": ".join(end.error), exit_code, end.help)
    if failures:
        raise ItemsFailed(tuple(failures), exit_code)
    if exit_code != 0:
        raise BuildFailed(said or f"specula build ended with the exit code {exit_code}", exit_code)


def _stop(process: subprocess.Popen[bytes]) -> None:
    """Stops the program if it still runs."""
    assert process.stdout is not None
    process.stdout.close()
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
