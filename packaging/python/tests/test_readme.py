"""The example of README.md runs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from conftest import GOLD_UNDER_STUDIO, ROOT, Build

MANIFEST = GOLD_UNDER_STUDIO + """table_file = { kind = "export-brdf-table", input = "table", path = "{material}/table" }
sh = { kind = "export-sh", input = "lighting", format = "safetensors", path = "{environment}/sh" }
shrm = { kind = "export-shrm", input = "reflection", resolution = 4, path = "{environment}/{material}/shrm" }
[stage.map]
kind = "export-reflection-map"
input = "reflection"
layout = "cube"
resolution = 4
path = "{environment}/{material}/map"
"""


def test_the_example_runs(tmp_path: Path, build: Build) -> None:
    (tmp_path / "studio.exr").write_bytes((ROOT / "assets/environments/studio.exr").read_bytes())
    (tmp_path / "gold.toml").write_text('material = "gold"\nroughness = 0.6\n')
    build(tmp_path, MANIFEST)
    # The last item of the map runs again.
    (tmp_path / "gold.toml").write_text('material = "gold"\nroughness = 0.61\n')
    readme = (ROOT / "packaging/python/README.md").read_text()
    example = readme.split("```python\n")[1].split("```")[0]
    example += "print(radiance.shape, coefficients.shape, value.shape)\n"
    command = [
        sys.executable,
        "-c",
        f"import sys; sys.path.insert(0, {str(ROOT / 'packaging/python/src')!r})\n{example}",
    ]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "map [studio, gold] in " in run.stdout and "(1000, 3) (9, 3) (3,)" in run.stdout, run.stdout
