"""The events of a build, as docs/events.md describes them: each is a class with the fields of the event."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .errors import SpeculaError

__all__ = [
    "Diagnostic",
    "Diagnostics",
    "Ended",
    "Event",
    "Failed",
    "Finished",
    "Item",
    "Leftovers",
    "ManifestWarnings",
    "Note",
    "Planned",
    "Progress",
    "Published",
    "Removed",
    "SharedCache",
    "Skipped",
    "Started",
    "TaskTimed",
    "UpToDate",
    "Waiting",
    "Warning",
]

#: The version of the format that this package reads.
VERSION = 2


@dataclass(frozen=True)
class Item:
    """An item: its stage, and the parts of its key by their names."""

    stage: str
    key: Mapping[str, str]

    def __str__(self) -> str:
        """`map [sky, gold]`, as the program prints it."""
        return f"{self.stage} [{', '.join(self.key.values())}]" if self.key else self.stage


@dataclass(frozen=True)
class Diagnostic:
    """An error or a warning in a text file; `line` and `column` count from 1, and are absent if the file as a
    whole is meant."""

    message: str
    line: int | None
    column: int | None
    span: tuple[int, int] | None
    expected: str | None
    help: str | None


@dataclass(frozen=True)
class Diagnostics:
    """The first errors of a file, and the number of the others."""

    file: str
    errors: tuple[Diagnostic, ...]
    more: int

    def __str__(self) -> str:
        """A line for each error, with its place."""
        lines = []
        for error in self.errors:
            place = "" if error.line is None else f":{error.line}:{error.column}"
            texts = [text for text in (error.message, error.expected, error.help) if text is not None]
            lines.append(f"{self.file}{place}: {'; '.join(texts)}")
        return "\n".join(lines + ([f"... and {self.more} more"] if self.more else []))


@dataclass(frozen=True)
class Event:
    """Something that happened during a build, at `time`, in milliseconds since 1970-01-01 00:00 UTC."""

    time: int


@dataclass(frozen=True)
class Planned(Event):
    """The graph is loaded."""

    dry_run: bool
    stages: int
    items: int


@dataclass(frozen=True)
class ManifestWarnings(Event):
    """The manifest is valid, but a person should look at something."""

    diagnostics: Diagnostics


@dataclass(frozen=True)
class Waiting(Event):
    """Another process has the folder locked; the build waits for it."""

    holder: str
    limit_milliseconds: float | None


@dataclass(frozen=True)
class UpToDate(Event):
    """The item's result is in the cache; `host` is the shared cache that had it."""

    item: Item
    host: str | None


@dataclass(frozen=True)
class SharedCache(Event):
    """The server of the shared cache cannot be used, or only in part."""

    host: str
    message: str


@dataclass(frozen=True)
class Started(Event):
    """An item starts to run; `reasons` are as the schema of the events has them, each with a key `reason`."""

    item: Item
    reasons: tuple[Mapping[str, Any], ...]
    host: str | None


@dataclass(frozen=True)
class Progress(Event):
    """An item is still running, and this share of its work is done."""

    item: Item
    share: float


@dataclass(frozen=True)
class TaskTimed(Event):
    """A worker spent time on an item: `work` is `fetch`, `run` or `publish`."""

    item: Item
    work: str
    worker: int
    start_milliseconds: float
    milliseconds: float


@dataclass(frozen=True)
class Warning(Event):
    """A warning of a running item."""

    item: Item
    message: str


@dataclass(frozen=True)
class Note(Event):
    """A fact about a running item's result."""

    item: Item
    message: str


@dataclass(frozen=True)
class Finished(Event):
    """An item ran successfully; `changed` says whether its result differs from the last one."""

    item: Item
    milliseconds: float
    changed: bool


@dataclass(frozen=True)
class Failed(Event):
    """An item failed: what happened with its causes, and what to do."""

    item: Item
    error: tuple[str, ...]
    help: str | None


@dataclass(frozen=True)
class Skipped(Event):
    """An item did not run because another one failed, or because the build was stopped."""

    item: Item
    because: Item | None


@dataclass(frozen=True)
class Published(Event):
    """A complete file appeared in `out`."""

    item: Item
    file: str
    bytes: int
    restored: bool


@dataclass(frozen=True)
class Removed(Event):
    """A file was removed from `out`; `because` is as the schema of the events has it, with a key `cause`."""

    item: Item
    file: str
    because: Mapping[str, Any]


@dataclass(frozen=True)
class Leftovers(Event):
    """A folder has files that earlier builds published and no manifest exports any more."""

    folder: str
    files: int
    published_by: tuple[str, ...]
    manifest: str


@dataclass(frozen=True)
class Ended(Event):
    """The build ended: what it did, in numbers."""

    ran: int
    ran_elsewhere: int
    up_to_date: int
    shared: int
    shared_traffic: Mapping[str, int] | None
    failed: int
    system_errors: int
    skipped: int
    kept: int
    published: int
    removed: int
    cancelled: bool
    milliseconds: float


@dataclass(frozen=True)
class Rejected(Event):
    """The manifest, or a file that it names, has errors; the last event."""

    diagnostics: Diagnostics


@dataclass(frozen=True)
class BuildError(Event):
    """The build as a whole cannot continue; the last event."""

    error: tuple[str, ...]
    help: str | None


def _kebab(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "-", name).lower()


#: The classes by the names of the events.
CLASSES: Mapping[str, type[Event]] = {_kebab(of.__name__): of for of in Event.__subclasses__()}


def _value(of: type[Event], name: str, value: Any) -> Any:
    """The value of a field, made of its JSON."""
    if name == "item" or (of is Skipped and name == "because" and value is not None):
        return Item(value["stage"], value["key"])
    if name == "diagnostics":
        names = [field.name for field in dataclasses.fields(Diagnostic)]
        errors = [Diagnostic(**{key: error[key] for key in names}) for error in value["errors"]]
        return Diagnostics(value["file"], tuple(errors), value["more"])
    return tuple(value) if isinstance(value, list) else value


def parse(line: bytes) -> Event | None:
    """The event of a line; nothing for an event that a newer program added."""
    try:
        fields = json.loads(line)
        version, of = fields["v"], CLASSES.get(fields["event"])
        if version != VERSION:
            raise SpeculaError(
                f"the program's events have version {version}, this package reads version {VERSION}"
            )
        if of is None:
            return None
        names = [field.name for field in dataclasses.fields(of)]
        return of(**{name: _value(of, name, fields[name]) for name in names})
    except (ValueError, KeyError, TypeError) as error:
        shown = line[:200].decode(errors="replace").strip()
        raise SpeculaError(f"expected an event as a line of JSON, found {shown!r} ({error!r})") from error
