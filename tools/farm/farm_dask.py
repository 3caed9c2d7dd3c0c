"""Renders a picture in parts with Dask, and merges them. Called again it renders the parts that are missing.

With --regress the parts are those of regression renders, and the exit code is that of `pointillist regress merge`: 1 changed, 2 broken.

The states or results are collected in a folder of this machine: the workers need the program and the scene under the same names, but no common
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
    parser.add_argument("--regress", action="store_true", help="the parts are those of regression renders")
    parser.add_argument(
        "-d", "--directory", type=Path, required=True, help="the states of the parts, and the pictures; or results of parts and of all"
    )
    parser.add_argument("--of", type=int, required=True, help="number of parts")
    parser.add_argument("--scheduler", help="address of a running scheduler [default: workers on this machine]")
    parser.add_argument("--workers", type=int, default=1, help="workers on this machine, if no scheduler is named")
    parser.add_argument("--retries", type=int, default=3, help="how often a part that failed is tried again")
    parser.add_argument("--merge-every", type=float, default=60, help="seconds between two reports of the error")
    parser.add_argument("scene", help="the scene; with --regress the folder of scenes")
    parser.add_argument("options", nargs=argparse.REMAINDER, help="options of `pointillist shard` or `pointillist regress run`")
    return parser.parse_args()


class Picture:
    """A picture: each part is a state."""

    def __init__(self, known, program):
        self.part = [program, "shard", str(Path(known.scene).resolve()), *known.options, "--of", str(known.of), "--quiet"]
        self.directory = known.directory
        pictures = [word for end in ("exr", "png") for word in ("-o", str(known.directory / f"picture.{end}"))]
        self.merge = [program, "merge", str(known.directory), *pictures]
        # Says the error of what is there so far.
        self.look = [program, "merge", str(known.directory), "--allow-missing"]

    def words(self, number, output):
        """The command that renders a part into `output`."""
        return [*self.part, "--number", str(number), "-o", str(output)]

    def is_done(self, number):
        return (self.directory / f"{number}.state").exists()

    def keep(self, number, data):
        """Writes a state that is there as a whole or not at all."""
        part = self.directory / f".{number}.state.part"
        part.write_bytes(data)
        os.replace(part, self.directory / f"{number}.state")


class Regression:
    """Regression renders: each part is a folder of results, which travels as the bytes of its files by name."""

    look = None

    def __init__(self, known, program):
        # Options of the merge; the parts are to know device and cases, too.
        shared = argparse.ArgumentParser(prog="tools/farm/dask --regress", allow_abbrev=False, add_help=False)
        for name in ("--results", "--html", "--junit", "--json", "--annotations", "--fail-on-slower"):
            shared.add_argument(name)
        shared.add_argument("--device")
        shared.add_argument("--case", action="append")
        shared.add_argument("--quiet", "-q", action="store_true")
        of_merge, of_parts = shared.parse_known_args(known.options)
        del of_merge.quiet
        for option in ("--fresh", "--shard", "--for-merge"):
            if any(word.split("=")[0] == option for word in of_parts):
                shared.error(f"{option} is no option here: shards are numbered by --of. To begin anew, remove {known.directory}")
        of_merge.results = of_merge.results or str(known.directory / "results")
        both, reports = [], []
        for name, value in vars(of_merge).items():
            given = [] if value is None else value if isinstance(value, list) else [value]
            words = both if name in ("device", "case") else reports
            words += [f"--{name.replace('_', '-')}={one}" for one in given]
        self.directory, self.of = known.directory, known.of
        self.part = [program, "regress", "run", str(Path(known.scene).resolve()), *of_parts, *both, "--for-merge", "--quiet"]
        folders = [str(known.directory / str(number)) for number in range(1, known.of + 1)]
        self.merge = [program, "regress", "merge", known.scene, *folders, *both, *reports]

    def words(self, number, output):
        """The command that renders a part into `output`."""
        return [*self.part, "--shard", f"{number}/{self.of}", "--results", str(output)]

    def is_done(self, number):
        """A part that has its mark has come to its end in an earlier call, and is not merged yet."""
        mark = self.directory / str(number) / f".unfinished-{number}-of-{self.of}"
        return mark.is_file() and mark.read_text().startswith("waits for")

    def keep(self, number, data):
        """Writes a folder that is there as a whole or not at all."""
        folder, part = self.directory / str(number), self.directory / f".{number}.part"
        shutil.rmtree(part, ignore_errors=True)
        for name, content in data.items():
            (part / name).parent.mkdir(parents=True, exist_ok=True)
            (part / name).write_bytes(content)
        shutil.rmtree(folder, ignore_errors=True)
        os.replace(part, folder)


def render(work, number):
    """Renders a part on a worker and returns the bytes of its state, or of the files of its results by name."""
    # A worker that dies takes the program with it, so that no core is lost to a part that nobody waits for.
    ends = ["setpriv", "--pdeathsig", "KILL"] if shutil.which("setpriv") else []
    # Dask removes what dead workers leave there.
    with tempfile.TemporaryDirectory(dir=get_worker().local_directory) as folder:
        output = Path(folder) / "part"
        done = subprocess.run([*ends, *work.words(number, output)], capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"part {number}: {done.stderr.strip()}")
        if output.is_file():
            return output.read_bytes()
        return {str(file.relative_to(output)): file.read_bytes() for file in output.rglob("*") if file.is_file()}


def fail(why):
    """Ends with the exit code of what is broken; 1 would mean that something has changed."""
    print(f"tools/farm/dask: {why}", file=sys.stderr)
    sys.exit(2)


def main():
    known = arguments()
    if known.regress and not os.path.isdir(known.scene):
        fail(f"{known.scene} is no folder of scenes")
    if not os.access(known.scene, os.R_OK):
        fail(f"cannot read the scene {known.scene}")
    program = os.environ.get("POINTILLIST", str(ROOT / "target/release/pointillist"))
    work = (Regression if known.regress else Picture)(known, program)
    known.directory.mkdir(parents=True, exist_ok=True)
    missing = [number for number in range(1, known.of + 1) if not work.is_done(number)]
    failed = []
    with contextlib.ExitStack() as stack:
        local = lambda: stack.enter_context(LocalCluster(n_workers=known.workers, threads_per_worker=1, dashboard_address=None))
        client = stack.enter_context(Client(known.scheduler or local()))
        print(f"{len(missing)} parts, {len(client.scheduler_info(n_workers=-1)['workers'])} workers", flush=True)
        numbers = {client.submit(render, work, number, retries=known.retries, pure=False): number for number in missing}
        told = time.monotonic()
        for batch in as_completed(list(numbers)).batches():
            # A result that cannot be fetched ends this program, which can be called again. `as_completed(with_results=True)` instead waited
            # for ever for 1,387 of 10^5 results on a machine under load.
            done = [future for future in batch if future.status != "error"]
            for some in (done[at : at + 16] for at in range(0, len(done), 16)):
                for future, result in zip(some, client.gather(some)):
                    work.keep(numbers[future], result)
            for future in batch:
                number = numbers.pop(future)
                if future.status == "error":
                    failed.append(number)
                    print(f"part {number} failed: {future.exception()}", file=sys.stderr, flush=True)
                future.release()
            if work.look and time.monotonic() - told > known.merge_every and len(failed) + len(numbers) < len(missing):
                told = time.monotonic()
                subprocess.run(work.look)
    if failed:
        fail(f"parts that failed: {sorted(failed)}; the same command goes on")
    sys.exit(subprocess.run(work.merge).returncode)


if __name__ == "__main__":
    main()
