"""The history of the benchmarks: a line of JSON for each run, the newest last, and a table of the newest."""

import json
import os
import platform
import subprocess
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

from cases import ROOT

RESULTS = ROOT / "benchmarks" / "results"
CPUINFO = Path("/proc/cpuinfo")
PACKAGES = ("numpy", "warp-lang", "vtk", "scikit-image")


def processor() -> str:
    """Return the processor's name, or only its architecture where the system tells no more."""
    if CPUINFO.exists():  # Linux
        lines = CPUINFO.read_text().splitlines()
        names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    else:
        names = [platform.processor()]
    return next(filter(None, names), platform.machine())


def machine() -> dict:
    """Return the day, the commit, the processor and the versions that a figure belongs to."""
    git = ["git", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(git, capture_output=True, text=True, cwd=ROOT, check=False).stdout
    return {
        "date": date.today().isoformat(),
        "processor": f"{processor()}, {os.cpu_count()} cores",
        "commit": commit.strip(),
        "python": platform.python_version(),
        **{name: version(name) for name in PACKAGES},
    }


def record(name: str, found: dict[str, Any], title: str = "", table: str = "") -> None:
    """Append a run to the history of its name; replace the table if there is one."""
    facts = machine()
    RESULTS.mkdir(exist_ok=True)
    with (RESULTS / f"{name}.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps(facts | found) + "\n")
    if table:
        head = "\n".join(f"- {key}: {value}" for key, value in facts.items())
        (RESULTS / f"{name}.md").write_text(f"# {title}\n\n{head}\n\n{table}\n", encoding="utf-8")
