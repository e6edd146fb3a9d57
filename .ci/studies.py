"""Every study in its quick version, two at a time: .ci/studies.py FOLDER STUDY .. prints the seconds of each.

The processes are copies of one that has the imports done. A study that fails fails this; one that takes longer than
SLOW has a line in its docstring or comment that says why: "Quick: ..". One that does not end with status 0 says
so: "ends with status N".
"""

import contextlib
import io
import multiprocessing
import os
import re
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

SLOW = 20.0  # s
IMPORTS = [
    "bayesub.study.run.run",
    "bayesub.study.run.runs",
    "bayesub.report.report",
    "bayesub.inference.sampling",
]


def run(study: str, folder: str) -> tuple[str, int, float, str]:
    """Exit status, seconds and what was printed of one study."""
    from bayesub.cli.app import main

    sys.argv = ["bayesub", "run", study, "--quick", "-o", f"{folder}/{study}"]
    began, said = time.perf_counter(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            main()
            status = 0
        except SystemExit as end:
            status = end.code or 0
    return study, status, time.perf_counter() - began, said.getvalue()


def main(folder: str, *given: str) -> int:
    """Run the studies, those first that say why they take long; how many failed."""
    studies = sorted(given, key=lambda study: "Quick: " not in Path(study).read_text())
    os.environ |= {"NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(IMPORTS)
    failed = 0
    with ProcessPoolExecutor(2, mp_context=context, max_tasks_per_child=1) as pool:
        for study, status, seconds, said in pool.map(run, studies, [folder] * len(studies)):
            wanted = int((re.search(r"ends with status (\d+)", Path(study).read_text()) or [0, 0])[1])
            print(f"{seconds:7.1f} s  {study}{'' if status == wanted else f'  FAILED: status {status}'}", flush=True)
            if status != wanted:
                failed += 1
                print(said)
            if seconds > SLOW and "Quick: " not in Path(study).read_text():
                print(f"           takes longer than {SLOW:.0f} s and does not say why ('Quick: ..')")
    return failed


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]) > 0)
