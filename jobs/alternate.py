#!/usr/bin/env python3
"""Two builds of the program on one deck, in turn: the least processor time of each, and their ratio.

    jobs/alternate.py OLD NEW DECK [--runs 7] [--ranks 1] [--phase solve ...] [-- --set key=value ...]

A host that changes its speed within minutes makes times taken one after the other worthless; runs in
turn meet the same hours, and the least of several is the one that was disturbed least. What comes
after `--` goes to both programs. Beside the processor time of all ranks: wall time of the phases as
`summary.json` has them, and whether the residuals of the two are the same to the last digit. On
several ranks waiting for each other is processor time too.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

PHASES = ["locate", "assemble", "solve", "update", "total"]
MPI = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OMP_NUM_THREADS": "1",
}


def processor_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(program, args, out):
    """Seconds by name: processor time, and wall time of each phase."""
    command = [] if args.ranks == 1 else ["mpirun", "-n", str(args.ranks)]
    command += [program, args.deck, "--out", str(out), "--force", *args.rest]
    before = processor_seconds()
    done = subprocess.run(command, env=os.environ | MPI, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)} failed:\n{done.stderr[-2000:]}")
    times = {"processor": processor_seconds() - before}
    wall = json.loads((out / "summary.json").read_text())["wall_seconds"]
    return times | {phase: wall[phase] for phase in args.phase}


def main():
    own, rest = sys.argv[1:], []
    if "--" in own:
        cut = own.index("--")
        own, rest = own[:cut], own[cut + 1 :]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", help="the program before")
    parser.add_argument("new", help="the program after")
    parser.add_argument("deck")
    parser.add_argument("--runs", type=int, default=7, help="of each program")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--phase", nargs="+", choices=PHASES, default=PHASES)
    args = parser.parse_args(own)
    args.rest = rest
    least = {"old": {}, "new": {}}
    with tempfile.TemporaryDirectory() as folder:
        outs = {name: Path(folder) / name for name in least}
        for turn in range(args.runs):
            # Who goes first alternates too.
            for name in ["old", "new"][:: 1 if turn % 2 == 0 else -1]:
                times = run(getattr(args, name), args, outs[name])
                for key, seconds in times.items():
                    least[name][key] = min(seconds, least[name].get(key, seconds))
        both = [out / "residuals.csv" for out in outs.values()]
        texts = [path.read_bytes() if path.exists() else b"" for path in both]
    print(f"{args.deck} {' '.join(rest)}: {args.ranks} rank(s), least of {args.runs} runs in turn, s")
    print("| | old | new | old / new |\n|---|---|---|---|")
    for key, old in least["old"].items():
        new = least["new"][key]
        ratio = f"{old / new:.3f}" if new > 0 else "-"
        print(f"| {key} | {old:.3f} | {new:.3f} | {ratio} |")
    print(f"residuals: {'the same' if texts[0] == texts[1] else 'not the same'}")


if __name__ == "__main__":
    main()
