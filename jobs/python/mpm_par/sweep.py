"""Runs of one deck with changed keys."""
import itertools
import json
import os
import re
import shutil
import subprocess

from .run import Run


def sweep(deck, keys, out="sweeps", ranks=1, program="mpm-par", words=(), together=1):
    """Runs `deck` for every combination of `keys`, {dotted path: values}, in a directory each below
    `out`; `together` of them at the same time. Returns a list of (settings, Run); runs that are
    there and completed are not run again. Raises RuntimeError with the program's words if one fails."""
    names = list(keys)
    jobs = []
    for values in itertools.product(*keys.values()):
        settings = dict(zip(names, values))
        jobs.append((settings, os.path.join(out, _name(settings))))
    os.makedirs(out, exist_ok=True)
    waiting, running = list(jobs), []
    while waiting or running:
        while waiting and len(running) < together:
            settings, folder = waiting.pop(0)
            if os.path.isdir(folder) and Run(folder).status == "completed":
                continue
            running.append((settings, _start(deck, settings, folder, ranks, program, words)))
        if running:
            settings, process = running.pop(0)
            _, said = process.communicate()
            if process.returncode:
                for _, other in running:
                    other.terminate()
                raise RuntimeError(f"{settings} ended with {process.returncode}:\n{said}")
    return [(settings, Run(folder)) for settings, folder in jobs]


def _start(deck, settings, folder, ranks, program, words):
    launcher = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    command = [*launcher, shutil.which(program) or program, os.fspath(deck), "--out", folder]
    command += ["--force", "--quiet", *words]
    for key, value in settings.items():
        command += ["--set", f"{key}={_toml(value)}"]
    return subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )


def _toml(value):
    """A TOML value: JSON writes numbers, strings, booleans and lists alike."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items()) + " }"
    return json.dumps(value)


def _name(settings):
    words = (f"{key.split('.')[-1]}-{value}" for key, value in settings.items())
    return re.sub(r"[^A-Za-z0-9._+-]+", "_", "_".join(words)) or "run"
