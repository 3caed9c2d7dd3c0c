"""Measures the adapters of tools/farm: `tools/bench farm [PART]...`; see tools/farm/README.md for what came out.

Parts: shards (what a part costs beside its samples), merge (states per second, bytes per second, memory), coordinator
(what dealing out a part costs), parallel and dask (parts per second with 1 to 1,000 simulated workers: a stand-in for the program sleeps
and copies a state), slurm (the same for Slurm on this machine, and the time until a part runs again whose node or program was killed),
many (FARM_MANY or else 10^5 parts on FARM_WORKERS or else 1,000 workers that sleep FARM_SLEEP or else 1 s: half an hour), requeue (Slurm with its default times: ten minutes of waiting). Without a word: all but the last two.
"""

import argparse
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PROGRAM = os.environ.get("POINTILLIST", str(ROOT / "target/release/pointillist"))
SCENE = str(ROOT / "scenes/cornell.xml")
MANY = int(os.environ.get("FARM_MANY", "100000"))
WORKERS = int(os.environ.get("FARM_WORKERS", "1000"))
SLEEP = os.environ.get("FARM_SLEEP", "1")

# Sleeps and copies a state, as fast as a process can.
STAND_IN = r"""
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/sendfile.h>
#include <time.h>
#include <unistd.h>
int main(int count, char **word) {
    const char *out = NULL;
    if (count < 2 || strcmp(word[1], "shard") != 0) return 0;
    for (int i = 1; i + 1 < count; i++)
        if (!strcmp(word[i], "-o") || !strcmp(word[i], "--output")) out = word[i + 1];
    double seconds = atof(getenv("FARM_SLEEP"));
    struct timespec wait = {(time_t)seconds, (long)((seconds - (time_t)seconds) * 1e9)};
    nanosleep(&wait, NULL);
    int from = open(getenv("FARM_STATE"), O_RDONLY), to = open(out, O_WRONLY | O_CREAT | O_TRUNC, 0644);
    return from < 0 || to < 0 || sendfile(to, from, NULL, 1 << 30) < 0;
}
"""


def measured(command, **options):
    """Wall seconds, processor seconds and peak memory in MiB of a command that succeeds."""
    began = time.monotonic()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, **options)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        sys.exit(f"{shlex.join(map(str, command))} failed")
    return time.monotonic() - began, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def shards(place):
    """What a part costs beside its samples: start, scene, the first samples for its identity, the state."""
    print("Cost of a part beside its samples: (processor time of all parts − that of one render) / parts; 16 samples per pixel, 1 thread")
    print("  size         render   parts   each, s   in parts of a render   state, kB")
    for scene, side in [("cornell", 64), ("cornell", 256), ("cornell", 512), ("cornell_spheres", 256)]:
        settings = [str(ROOT / f"scenes/{scene}.xml"), "--size", f"{side}x{side}", "--spp", "16", "--threads", "1", "--quiet"]
        picture = place / "whole.exr"
        _, whole, _ = measured([PROGRAM, "render", *settings, "--device", "cpu", "--deterministic", "-o", picture])
        for of in [4, 16]:
            seconds = 0
            for number in range(1, of + 1):
                state = place / f"{number}.state"
                state.unlink(missing_ok=True)
                _, used, _ = measured([PROGRAM, "shard", *settings, "--of", str(of), "--number", str(number), "-o", state])
                seconds += used
            each = (seconds - whole) / of
            size = state.stat().st_size / 1e3
            print(f"  {scene} {side:4} {whole:7.2f} s {of:5} {each:9.3f} {each / whole:14.3f} {size:16.0f}", flush=True)


def merge(place):
    """Throughput and memory of a merge, for more and more states."""
    print("Merge: states per second, their bytes per second, peak memory; picture of 512×512")
    states = place / "states"
    states.mkdir()
    settings = [SCENE, "--size", "512x512", "--spp", "16", "--quiet", "--of", "64"]
    for number in range(1, 65):
        measured([PROGRAM, "shard", *settings, "--number", str(number), "-o", states / f"{number}.state"])
    for count in [1, 2, 4, 16, 64]:
        files = [states / f"{number}.state" for number in range(1, count + 1)]
        size = sum(file.stat().st_size for file in files)
        seconds, _, memory = measured([PROGRAM, "merge", *files, "--quiet", "--allow-missing"])
        print(f"  {count:3} states {size / 1e6:7.1f} MB {seconds:6.2f} s {count / seconds:6.1f}/s {size / seconds / 1e9:6.3f} GB/s {memory:6.0f} MiB")
    seconds, _, memory = measured([PROGRAM, "merge", *files, "--quiet", "-o", place / "a.exr", "-o", place / "a.png", "-o", place / "a.state"])
    print(f"   64 states into .exr, .png and .state {seconds:6.2f} s {memory:6.0f} MiB")
    seconds, _, memory = measured([PROGRAM, "render", *settings[:5], "--quiet", "--device", "cpu", "--deterministic", "-o", place / "a.exr"])
    print(f"  one render of it           {seconds:6.2f} s {memory:6.0f} MiB", flush=True)


def stand_in(place):
    """A program that takes the place of pointillist, and its environment."""
    source, program, state = place / "stand_in.c", place / "stand_in", place / "stand_in.bin"
    source.write_text(STAND_IN)
    subprocess.run(["cc", "-O2", "-o", program, source], check=True)
    measured([PROGRAM, "shard", SCENE, "--size", "16x16", "--spp", "4", "--of", "1", "--number", "1", "--quiet", "-o", f"{state}.state"])
    os.rename(f"{state}.state", state)
    return os.environ | {"POINTILLIST": str(program), "FARM_STATE": str(state), "FARM_SLEEP": SLEEP}


class DaskCluster:
    """A scheduler and workers as a user starts them by hand; many workers are threads of few processes."""

    def __init__(self, place, workers, env):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{port}"
        dask = Path(sys.executable).with_name("dask")
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": env}
        scheduler = [dask, "scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
        processes = min(workers, 2)
        worker = [dask, "worker", self.address, "--nthreads", str(workers // processes), "--no-nanny", "--no-dashboard"]
        self.children = [subprocess.Popen(scheduler, **quiet)]
        self.children += [subprocess.Popen([*worker, "--local-directory", place], **quiet) for _ in range(processes)]

    def __enter__(self):
        from distributed import Client

        with Client(self.address, timeout=60) as client:
            client.wait_for_workers(len(self.children) - 1)
        return self

    def __exit__(self, *_):
        for child in self.children[1:]:
            child.kill()
            child.wait()
        self.children[0].kill()
        _, _, usage = os.wait4(self.children[0].pid, 0)
        self.children[0].returncode = -signal.SIGKILL
        self.processor_seconds = usage.ru_utime + usage.ru_stime


def engine(name, place, workers, count, env):
    """Wall seconds of `count` parts on `workers` simulated workers, and processor seconds of the coordinator."""
    with tempfile.TemporaryDirectory(dir=place) as folder:
        parts = ["-d", folder, "--of", str(count)]
        if name == "parallel":
            # Those of the parts are among them.
            return measured([HERE / "parallel", *parts, "--jobs", str(workers), SCENE], env=env, stderr=subprocess.DEVNULL)[:2]
        cluster = DaskCluster(place, workers, env)
        with cluster:
            options = ["--scheduler", cluster.address, "--merge-every", "3600"]
            seconds, client, _ = measured([HERE / "dask", *parts, *options, SCENE], env=env, stderr=subprocess.DEVNULL)
        return seconds, client + cluster.processor_seconds


def scaling(name, place):
    """Parts per second with more and more workers that sleep."""
    env = stand_in(place)
    print(f"{name}: parts that sleep 1 s on simulated workers, with the start of the engine; efficiency is sleep over workers × wall seconds")
    print("  workers   parts   seconds   parts/s   efficiency")
    for workers in [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1000]:
        count = 8 * workers if workers <= 128 else 4 * workers
        seconds, _ = engine(name, place, workers, count, env)
        print(f"  {workers:7} {count:7} {seconds:9.1f} {count / seconds:9.1f} {count / workers / seconds:12.2f}", flush=True)


def coordinator(place):
    """What dealing out parts costs the machine that does it."""
    env = stand_in(place)
    count, seconds = 200, time.monotonic()
    for _ in range(count):
        subprocess.run([env["POINTILLIST"], "shard", "-o", place / "copy"], env=env | {"FARM_SLEEP": "0"}, check=True)
    print(f"the stand-in alone, without sleep: {1e3 * (time.monotonic() - seconds) / count:.1f} ms", flush=True)
    for name in ["dask", "parallel"]:
        (few, some), (seconds, all_) = (engine(name, place, 16, count, env | {"FARM_SLEEP": "0"}) for count in [100, 2100])
        wall, used = (seconds - few) / 2000, (all_ - some) / 2000
        print(f"{name}: 2,000 parts without sleep, 16 workers: {1 / wall:.0f} parts/s, {1e3 * used:.1f} ms of processor time of the coordinator each", flush=True)


def many(place):
    """10^5 parts through each coordinator."""
    env = stand_in(place)
    for name in ["parallel", "dask"]:
        seconds, _ = engine(name, place, WORKERS, MANY, env)
        rate = f"{seconds:.0f} s, {MANY / seconds:.0f} parts/s"
        print(f"{name}: {MANY:,} parts that sleep {SLEEP} s, {WORKERS:,} workers: {rate}", flush=True)


def loopback(nodes, cpus, defaults, *command):
    """Runs `bench.py COMMAND` in a Slurm cluster of this machine."""
    default = ["--default-times"] if defaults else []
    words = [HERE / "slurm_loopback", "--nodes", str(nodes), "--cpus", str(cpus), *default]
    subprocess.run([*words, sys.executable, __file__, "--inside", *map(str, command)], check=True)


def submit(folder, of, words):
    """Submits a picture in parts, and returns the number of the array."""
    command = [HERE / "slurm", "-d", folder, "--of", str(of), SCENE, *words]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return re.match(r"parts: job (\d+)", said)[1]


def tasks(job):
    """State and node of the tasks of an array, by number."""
    command = ["squeue", "-r", "-h", "-t", "all", "-o", "%K %T %N", "-j", job]
    lines = subprocess.run(command, capture_output=True, text=True).stdout.splitlines()
    return {int(number): (state, node) for number, state, node in (line.split(" ") for line in lines)}


def wait_for(what, limit=1500):
    """Seconds until `what` is true."""
    began = time.monotonic()
    while not what():
        if time.monotonic() - began > limit:
            sys.exit("slurm: what was waited for did not happen")
        time.sleep(0.25)
    return time.monotonic() - began


def requeue_inside(folder):
    """Kills a program, and for another picture a node, in the middle of a part and measures when the part runs again."""
    words = ["--size", "64x64", "--spp", "2000", "--threads", "1", "--state-every", "1"]
    whole = Path(folder) / "whole.exr"
    subprocess.run([PROGRAM, "render", SCENE, *words[:4], "--device", "cpu", "--deterministic", "--quiet", "-o", whole], check=True)
    for what in ["program", "node"]:
        # Fewer parts than nodes, so that a part need not wait for another one to end.
        place = Path(folder) / what
        job = submit(place, 2, words)
        runs = lambda: tasks(job).get(1, ("", ""))[0] == "RUNNING"
        wait_for(lambda: runs() and (place / "1.state").exists())
        if what == "program":
            os.kill(next(int(p.name) for p in Path("/proc").glob("[0-9]*") if is_part(p, place, 1)), signal.SIGKILL)
        else:
            subprocess.run([HERE / "slurm_loopback", "--kill", tasks(job)[1][1]], check=True)
        waited = wait_for(lambda: not runs()), wait_for(runs)
        print(f"  {what} killed: the part is queued again after {waited[0]:.1f} s and runs after {sum(waited):.1f} s", end="", flush=True)
        wait_for((place / "picture.png").exists)
        same = whole.read_bytes() == (place / "picture.exr").read_bytes()
        print(f"; the picture is {'equal to' if same else 'NOT'} that of one render", flush=True)
        if not same:
            sys.exit(1)


def is_part(process, folder, number):
    try:
        words = (process / "cmdline").read_bytes().split(b"\0")
    except OSError:
        return False
    return words[0] == PROGRAM.encode() and f"{folder}/{number}.state".encode() in words


def requeue(place, defaults=True):
    print(f"Slurm with {'its default times' if defaults else 'the times of slurm_loopback'}, three nodes:", flush=True)
    with tempfile.TemporaryDirectory(dir=place) as folder:
        loopback(3, 1, defaults, "requeue", folder)


def rate_inside(folder, count):
    """Seconds of `count` parts, from the submission to the last one."""
    began = time.monotonic()
    job = submit(Path(folder), int(count), [])
    wait_for(lambda: all(state == "COMPLETED" for state, _ in tasks(job).values()))
    print(len(list(Path(folder).glob("*.state"))), time.monotonic() - began, flush=True)


def slurm(place):
    requeue(place, defaults=False)
    env = stand_in(place)
    print("slurm: parts that sleep 1 s on three nodes of this machine with simulated processors")
    print("  workers   parts   seconds   parts/s   efficiency")
    for workers in [3, 12, 48, 192]:
        count = min(8 * workers, 384)
        with tempfile.TemporaryDirectory(dir=place) as folder:
            words = [HERE / "slurm_loopback", "--nodes", "3", "--cpus", str(workers // 3), sys.executable, __file__, "--inside", "rate"]
            done = subprocess.run([*words, folder, str(count)], check=True, stdout=subprocess.PIPE, text=True, env=env)
        made, seconds = done.stdout.split()
        seconds = float(seconds)
        lost = "" if int(made) == count else f" but only {made} states"
        print(f"  {workers:7} {count:7} {seconds:9.1f} {count / seconds:9.1f} {count / workers / seconds:12.2f}{lost}", flush=True)


PARTS = {
    "shards": shards,
    "merge": merge,
    "parallel": lambda place: scaling("parallel", place),
    "dask": lambda place: scaling("dask", place),
    "slurm": slurm,
    "coordinator": coordinator,
    "many": many,
    "requeue": requeue,
}


def main():
    parser = argparse.ArgumentParser(prog="tools/bench farm", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parts = parser.parse_args().parts or ["shards", "merge", "coordinator", "parallel", "dask", "slurm"]
    for part in parts:
        if part not in PARTS:
            parser.error(f"no part {part}")
    for part in parts:
        with tempfile.TemporaryDirectory(prefix="farm.") as place:
            PARTS[part](Path(place))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--inside"]:
        {"requeue": requeue_inside, "rate": rate_inside}[sys.argv[2]](*sys.argv[3:])
    else:
        main()
