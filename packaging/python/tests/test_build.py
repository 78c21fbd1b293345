"""Builds by the program, its events and its errors."""

from __future__ import annotations

import dataclasses
import json
import os
import sys
import sysconfig
import time
from pathlib import Path
from typing import Any

import pytest
from conftest import ROOT

import specula
from specula import events

MANIFEST = """schema = 1
[stage]
environment = { kind = "import-environment", source = "studio.exr", resolution = 16 }
lighting = { kind = "project-sh", input = "environment", degree = 2 }
sh = { kind = "export-sh", input = "lighting", path = "sh" }
material = { kind = "import-material", source = "materials/*.toml" }
brdf = { kind = "project-brdf", input = "material", degree = [4, 0] }
"""


@pytest.fixture
def manifest(tmp_path: Path) -> Path:
    (tmp_path / "studio.exr").write_bytes((ROOT / "assets/environments/studio.exr").read_bytes())
    (tmp_path / "materials").mkdir()
    (tmp_path / "materials/chalk.toml").write_text('model = "lambert"\nalbedo = 0.5\n')
    (tmp_path / "pipeline.toml").write_text(MANIFEST)
    return tmp_path / "pipeline.toml"


def test_events_are_those_of_the_schema() -> None:
    schema = json.loads((ROOT / "docs/events.schema.json").read_bytes())
    of_watch = {"watching", "noticed", "rebuild-loop", "accepted"}
    described = {}
    for event in schema["oneOf"]:
        properties = dict(event["properties"])
        if "$ref" in event:
            properties |= schema["$defs"][event["$ref"].rsplit("/")[-1]]["properties"]
        described[properties.pop("event")["const"]] = properties
    assert set(events.CLASSES) == set(described) - of_watch
    assert events.VERSION == 2
    words = {
        "boolean": "bool",
        "integer": "int",
        "number": "float",
        "string": "str",
        "array": "tuple",
        "null": "None",
    }
    for name, of in events.CLASSES.items():
        fields = {field.name: str(field.type) for field in dataclasses.fields(of)}
        assert fields.pop("time") == "int"
        assert set(fields) == set(described[name]), name
        for key, field in described[name].items():
            if isinstance(field.get("type"), (str, list)):
                types = [field["type"]] if isinstance(field["type"], str) else field["type"]
                found = fields[key].split("[")[0] if "array" in types else fields[key]
                assert sorted(found.split(" | ")) == sorted(words[word] for word in types), (name, key)


def test_a_build_yields_what_happens(manifest: Path) -> None:
    seen = list(specula.build(manifest))
    assert isinstance(seen[0], events.Planned) and (seen[0].stages, seen[0].items) == (5, 5)
    finished = [event for event in seen if isinstance(event, events.Finished)]
    assert {str(event.item) for event in finished} == {
        "environment [studio]",
        "lighting [studio]",
        "sh [studio]",
        "material [chalk]",
        "brdf [chalk]",
    }
    (published,) = [event for event in seen if isinstance(event, events.Published)]
    assert (published.file, published.bytes) == ("sh.json", (manifest.parent / "out/sh.json").stat().st_size)
    started = next(event for event in seen if isinstance(event, events.Started))
    assert started.reasons == ({"reason": "never-built"},)
    ended = seen[-1]
    assert isinstance(ended, events.Ended) and (ended.ran, ended.failed, ended.cancelled) == (5, 0, False)
    assert specula.read_sh(manifest.parent / "out/sh.json").degree == 2
    again = list(specula.build(manifest, ["brdf"], jobs=1))
    assert [type(event) for event in again] == [
        events.Planned,
        events.UpToDate,
        events.UpToDate,
        events.Ended,
    ]
    forced = list(specula.build(str(manifest), ["brdf [chalk]"], force=True, dry_run=True))
    assert sum(isinstance(event, events.Started) for event in forced) == 1


def test_failed_items_end_in_an_error_with_the_message_of_the_program(manifest: Path) -> None:
    (manifest.parent / "materials/odd.toml").write_text('model = "fong"\n')
    seen: list[events.Event] = []
    with pytest.raises(
        specula.ItemsFailed, match=r"material \[odd\] failed: .*odd.toml:1:9: there is no model"
    ) as caught:
        for event in specula.build(manifest):
            seen.append(event)
    assert (caught.value.exit_code, [str(failed.item) for failed in caught.value.failures]) == (
        1,
        ["material [odd]"],
    )
    (skipped,) = [event for event in seen if isinstance(event, events.Skipped)]
    assert str(skipped.because) == "material [odd]" and isinstance(seen[-1], events.Ended)


def test_an_invalid_manifest_is_an_error_with_its_places(manifest: Path) -> None:
    manifest.write_text(MANIFEST + 'odd = { kind = "nothing" }\n')
    with pytest.raises(specula.ManifestInvalid, match="pipeline.toml:8:16: ") as caught:
        list(specula.build(manifest))
    (error,) = caught.value.diagnostics.errors
    assert (caught.value.exit_code, error.line, error.column) == (3, 8, 16)
    with pytest.raises(specula.ManifestInvalid, match="absent.toml"):
        list(specula.build(manifest.with_name("absent.toml")))


def test_other_failures_have_the_message_and_the_help_of_the_program(manifest: Path) -> None:
    with pytest.raises(specula.BuildFailed, match='stage "lightning".*\nhint: .*lighting') as caught:
        list(specula.build(manifest, ["lightning"]))
    assert caught.value.exit_code == 2 and caught.value.help is not None
    with pytest.raises(specula.BuildFailed, match="--jobs"):
        list(specula.build(manifest, jobs=0))


@pytest.mark.skipif(sys.platform == "win32", reason="a shell script")
def test_closing_the_generator_stops_the_program(manifest: Path) -> None:
    script = '#!/bin/sh\necho $$ > pid.tmp\nmv pid.tmp "$1"\nexec sleep 600\n'
    path = manifest.parent / "slow"
    path.write_text(script)
    path.chmod(0o755)
    pid = manifest.parent / "pid"
    stage = f'slow = {{ kind = "exec", command = ["{path}", "{pid}", "{{output}}"], '
    stage += 'output = { type = "file", format = "png" } }\n'
    manifest.write_text("schema = 1\n[stage]\n" + stage)
    building = specula.build(manifest)
    assert isinstance(next(building), events.Planned)
    assert any(isinstance(event, events.Started) for event in building)
    while not pid.exists():
        time.sleep(0.01)
    building.close()
    with pytest.raises(ProcessLookupError):
        while True:
            os.kill(int(pid.read_text()), 0)
            time.sleep(0.01)
    with pytest.raises(StopIteration):
        next(building)


def _program(path: Path, text: str = "exit 0") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


@pytest.mark.skipif(sys.platform == "win32", reason="shell scripts")
def test_the_program_is_the_named_one_or_that_of_the_environment_or_of_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def scripts(*arguments: Any, **_: Any) -> str:
        return str(tmp_path / ("user" if len(arguments) > 1 else "environment"))

    monkeypatch.setattr(sysconfig, "get_path", scripts)
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    named = _program(tmp_path / "named")
    monkeypatch.delenv("SPECULA_PROGRAM")
    with pytest.raises(specula.ProgramNotFound, match="or on PATH; SPECULA_PROGRAM may name it"):
        specula.find_program()
    for folder in ("path", "user", "environment"):
        made = _program(tmp_path / folder / "specula")
        assert specula.find_program() == made
    monkeypatch.setenv("SPECULA_PROGRAM", str(named))
    assert specula.find_program() == named
    assert specula.find_program(tmp_path / "path/specula") == tmp_path / "path/specula"
    with pytest.raises(specula.ProgramNotFound, match="absent is not a program"):
        next(specula.build("pipeline.toml", program=tmp_path / "absent"))


@pytest.mark.skipif(sys.platform == "win32", reason="shell scripts")
def test_a_program_that_says_something_else_is_an_error(tmp_path: Path) -> None:
    def run(text: str) -> list[events.Event]:
        return list(specula.build("pipeline.toml", program=_program(tmp_path / "other", text)))

    with pytest.raises(specula.SpeculaError, match="expected an event as a line of JSON, found 'hello'"):
        run("echo hello")
    with pytest.raises(specula.SpeculaError, match="events have version 3, this package reads version 2"):
        run("""echo '{"v":3,"time":1,"event":"planned"}'""")
    with pytest.raises(specula.SpeculaError, match="expected an event .*KeyError"):
        run("""echo '{"v":2,"time":1,"event":"planned"}'""")
    assert run("""echo '{"v":2,"time":1,"event":"new-one"}'""") == []
    with pytest.raises(specula.BuildFailed, match="panicked") as caught:
        run("echo panicked >&2; exit 101")
    assert caught.value.exit_code == 101
    with pytest.raises(specula.BuildFailed, match="ended with the exit code 7"):
        run("exit 7")
