"""Builds manifests of Specula, and reads and evaluates what its stages write.

for event in specula.build("pipeline.toml"):
    print(event)
light = specula.read_sh("out/studio/sh.safetensors")
radiance = specula.evaluate(light, [0.0, 0.0, 1.0])
"""

from . import events
from .errors import FileError, ProgramNotFound, SpeculaError
from .evaluation import evaluate, harmonics
from .files import BrdfTable, Sh, Shrm, read_sh, read_shrm, read_table
from .program import BuildFailed, ItemsFailed, ManifestInvalid, build, find_program

__all__ = [
    "BrdfTable",
    "BuildFailed",
    "FileError",
    "ItemsFailed",
    "ManifestInvalid",
    "ProgramNotFound",
    "Sh",
    "Shrm",
    "SpeculaError",
    "build",
    "evaluate",
    "events",
    "find_program",
    "harmonics",
    "read_sh",
    "read_shrm",
    "read_table",
]
