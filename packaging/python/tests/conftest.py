"""Projects that the tests build, with the program that SPECULA_PROGRAM names or a build of this checkout."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
from numpy.typing import NDArray

ROOT = Path(__file__).parents[3]


def _skip(reason: str) -> NoReturn:
    """Skips a test, or fails it if no test may be skipped."""
    if "SPECULA_REQUIRE" in os.environ:
        pytest.fail(reason)
    pytest.skip(reason)


def _folder(variable: str) -> Path:
    folder = os.environ.get(variable)
    return Path(folder) if folder is not None else _skip(f"{variable} is unset")


# The stages before those that export.
GOLD_UNDER_STUDIO = """
[stage]
environment = { kind = "import-environment", source = "studio.exr", resolution = 32 }
lighting = { kind = "project-sh", input = "environment" }
material = { kind = "import-material", source = "gold.toml" }
brdf = { kind = "project-brdf", input = "material", degree = [12, 2] }
reflection = { kind = "convolve", inputs = { lighting = "lighting", brdf = "brdf" } }
table = { kind = "tabulate-brdf", input = "material", degree = 2, resolution = 8 }
"""


@pytest.fixture(scope="session")
def corpus() -> Path:
    """The photographs."""
    return _folder("SPECULA_CORPUS")


@pytest.fixture(scope="session")
def reference() -> Path:
    """The values that other code computed."""
    return _folder("SPECULA_REFERENCE")


@pytest.fixture(scope="session", autouse=True)
def program() -> Path:
    """The program."""
    named = os.environ.setdefault("SPECULA_PROGRAM", str(ROOT / "target/debug/specula"))
    if not Path(named).exists():
        _skip(f"there is no program {named}")
    return Path(named)


Build = Callable[[Path, str], Path]


@pytest.fixture(scope="session")
def build(program: Path) -> Build:
    """Writes a manifest into a folder, builds it without this package, and returns its `out`."""

    def build(folder: Path, manifest: str) -> Path:
        (folder / "pipeline.toml").write_text("schema = 1\n" + manifest)
        command = [str(program), "build", "--quiet", "--manifest", str(folder / "pipeline.toml")]
        run = subprocess.run(command, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        return folder / "out"

    return build


def write_pfm(path: Path, pixels: NDArray[np.float64]) -> None:
    """Writes a picture, whose first row is at the top."""
    height, width, _ = pixels.shape
    path.write_bytes(f"PF\n{width} {height}\n-1.0\n".encode() + pixels[::-1].astype("<f4").tobytes())
