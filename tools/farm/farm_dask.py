"""Renders a picture in parts with Dask, and merges them. Called again it renders the parts that are missing.

The states are collected in a folder of this machine: the workers need the program and the scene under the same names, but no common
folder. When a worker dies, the scheduler gives its part to another one, which begins it anew; Dask gives a part up when the fourth worker
has died on it (distributed.scheduler.allowed-failures). The program is $POINTILLIST, or else target/release/pointillist.
"""

import argparse
import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from distributed import Client, LocalCluster, as_completed, get_worker

ROOT = Path(__file__).resolve().parents[2]


def arguments():
    parser = argparse.ArgumentParser(prog="tools/farm/dask", description=__doc__, allow_abbrev=False)
    parser.add_argument("-d", "--directory", type=Path, required=True, help="the states of the parts, and the pictures")
    parser.add_argument("--of", type=int, required=True, help="number of parts")
    parser.add_argument("--scheduler", help="address of a running scheduler [default: workers on this machine]")
    parser.add_argument("--workers", type=int, default=1, help="workers on this machine, if no scheduler is named")
    parser.add_argument("--retries", type=int, default=3, help="how often a part that failed is tried again")
    parser.add_argument("--merge-every", type=float, default=60, help="seconds between two reports of the error")
    parser.add_argument("scene")
    parser.add_argument("options", nargs=argparse.REMAINDER, help="options of `pointillist shard`")
    return parser.parse_args()


def render(program, number, of, words):
    """Renders a part on a worker and returns the bytes of its state."""
    # A worker that dies takes the program with it, so that no core is lost to a part that nobody waits for.
    ends = ["setpriv", "--pdeathsig", "KILL"] if shutil.which("setpriv") else []
    # Dask removes what dead workers leave there.
    with tempfile.TemporaryDirectory(dir=get_worker().local_directory) as folder:
        state = Path(folder) / "part.state"
        command = [*ends, program, "shard", *words, "--of", str(of), "--number", str(number), "-o", str(state), "--quiet"]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"part {number}: {done.stderr.strip()}")
        return state.read_bytes()


def keep(path, data):
    """Writes a file that is there as a whole or not at all."""
    part = path.with_name(f".{path.name}.part")
    part.write_bytes(data)
    os.replace(part, path)


def main():
    known = arguments()
    if not os.access(known.scene, os.R_OK):
        sys.exit(f"tools/farm/dask: cannot read the scene {known.scene}")
    program = os.environ.get("POINTILLIST", str(ROOT / "target/release/pointillist"))
    words = [str(Path(known.scene).resolve()), *known.options]
    known.directory.mkdir(parents=True, exist_ok=True)
    state = lambda number: known.directory / f"{number}.state"
    missing = [number for number in range(1, known.of + 1) if not state(number).exists()]
    failed = []
    with contextlib.ExitStack() as stack:
        local = lambda: stack.enter_context(LocalCluster(n_workers=known.workers, threads_per_worker=1, dashboard_address=None))
        client = stack.enter_context(Client(known.scheduler or local()))
        print(f"{len(missing)} parts, {len(client.scheduler_info(n_workers=-1)['workers'])} workers", flush=True)
        numbers = {
            client.submit(render, program, number, known.of, words, retries=known.retries, pure=False): number
            for number in missing
        }
        told = time.monotonic()
        for batch in as_completed(list(numbers)).batches():
            # A result that cannot be fetched ends this program, which can be called again. `as_completed(with_results=True)` instead waited
            # for ever for 1,387 of 10^5 results on a machine under load.
            done = [future for future in batch if future.status != "error"]
            for some in (done[at : at + 16] for at in range(0, len(done), 16)):
                for future, result in zip(some, client.gather(some)):
                    keep(state(numbers[future]), result)
            for future in batch:
                number = numbers.pop(future)
                if future.status == "error":
                    failed.append(number)
                    print(f"part {number} failed: {future.exception()}", file=sys.stderr, flush=True)
                future.release()
            if time.monotonic() - told > known.merge_every and len(failed) + len(numbers) < len(missing):
                told = time.monotonic()
                subprocess.run([program, "merge", str(known.directory), "--allow-missing"])
    if failed:
        sys.exit(f"tools/farm/dask: parts that failed: {sorted(failed)}; the same command goes on")
    pictures = [word for end in ("exr", "png") for word in ("-o", str(known.directory / f"picture.{end}"))]
    sys.exit(subprocess.run([program, "merge", str(known.directory), *pictures]).returncode)


if __name__ == "__main__":
    main()
