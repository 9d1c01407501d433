"""`make fuzz` judges specs for FUZZ_SECONDS (default 60), each in its own process; exit 1 on a fault.

Every second spec is a mutation of a shipped one; the others are random. FUZZ_SEED (default 0) is the seed
of the first spec; each spec has its own seed, which repeats it alone.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import resource
import sys
import tempfile
import time
from collections import Counter, deque
from pathlib import Path

from inputdesign_cli.compute.executor import ONE_THREAD

os.environ.update(ONE_THREAD | os.environ)  # as the command line does, before numpy is imported

import cvxpy  # noqa: F401 (once, before the processes divide)
import yaml

from tests.fuzzing.generation import generated
from tests.fuzzing.judge import judged
from tests.fuzzing.mutations import ROOT, mutated

_HANGS = 90.0  # seconds, beyond all time limits
_MEMORY = 8 * 2**30


def text_of(seed: int) -> str:
    spec = generated(seed // 2) if seed % 2 else mutated(random.Random(seed // 2))
    return yaml.safe_dump(spec, default_flow_style=None, sort_keys=False)


def _work(seed: int) -> tuple[str, str]:
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 (until the process ends)
    return judged(text_of(seed), ROOT / "specs")


def main() -> int:
    seconds, seed = float(os.environ.get("FUZZ_SECONDS", "60")), int(os.environ.get("FUZZ_SEED", "0"))
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    end, running, ends, faults = time.monotonic() + seconds, deque(), Counter(), 0
    count = os.cpu_count() or 1
    with multiprocessing.get_context("fork").Pool(count, maxtasksperchild=1) as pool:
        while running or time.monotonic() < end:
            while len(running) < 4 * count and time.monotonic() < end:
                running.append((seed, pool.apply_async(_work, (seed,))))
                seed += 1
            number, answer = running.popleft()
            try:
                end_of, found = answer.get(_HANGS)
            except multiprocessing.TimeoutError:
                end_of, found = "hangs", "hangs, or its process was killed"
            ends[end_of] += 1
            if found:
                faults += 1
                path = folder / f"{number}.yaml"
                path.write_text(text_of(number), encoding="utf-8")
                print(f"seed {number}, {path}:\n{found}\n", flush=True)
    print(", ".join(f"{count} {name}" for name, count in ends.most_common()))
    print(f"{ends.total()} specs, {faults} faults")
    if not faults:
        folder.rmdir()
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
