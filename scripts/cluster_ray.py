#!/usr/bin/env python3
"""`scan2params generate` or `scan2params batch` on the machines of a Ray cluster, a shard a task.

    pip install -r scripts/requirements-ray.txt
    python scripts/cluster_ray.py --out DIR --shards 64 [--address auto] [--cpus 2] \\
        [--program target/release/scan2params] -- generate --count 60000 --prior union --seed 1
    python scripts/cluster_ray.py --out DIR --shards 64 ... -- batch FOLDER --density-csv densities.csv

What stands after `--` goes to `scan2params` as it is. The program is sent to the machines (same system and architecture as
here). A machine or a worker that dies loses what is under way: its shard is done again, elsewhere or there, where it goes on
from what is in the folder. So does the whole when this is called again. The files are those of one run on one machine.

Drapes are made on each machine in a folder below its temporary folder and sent back: the machines need no common file system.
Shards whose files are all in DIR are not made. In the end `scan2params generate` looks through DIR here, and makes what is
missing or damaged. With `--shared` DIR must be one folder for all machines, and shards are made in it.

For `batch` this folder, FOLDER and DIR must be the same for all machines (a common file system). In the end
`scan2params batch --merge` writes the tables; the exit status is its.

Without a cluster Ray starts one on this machine alone. Python's standard library and Ray.
"""

import argparse
import ctypes
import hashlib
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile

# Exit status of a batch of which every scan was done and some have no estimate.
PARTIAL = 3
# Rows of a file, as `chunk_rows` in manifest.json.
CHUNK_ROWS = 64
MANIFEST = "manifest.json"


def option(arguments, name):
    """The value of a flag among `arguments`, written as two words or with `=`."""
    for k, word in enumerate(arguments):
        if word == name and k + 1 < len(arguments):
            return arguments[k + 1]
        if word.startswith(name + "="):
            return word.split("=", 1)[1]
    return None


def files_of(shard, shards, count):
    """Names of the files of a shard."""
    return [f"drapes-{number:06}.parquet" for number in range(shard, -(-count // CHUNK_ROWS), shards)]


def with_this_process():
    """A child that is killed when its parent is: else it would hold the shard's lock (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)


def do(program, arguments, shard, shards, out, threads, cwd=None):
    """Does a shard in a folder; raises with what the program said where it fails."""
    flags = ["--out", str(out), "--shard", f"{shard}/{shards}", "--threads", str(threads), "--quiet"]
    command = [program, *arguments, *flags]
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=with_this_process, cwd=cwd)
    if done.returncode not in ((0, PARTIAL) if arguments[0] == "batch" else (0,)):
        raise RuntimeError(f"shard {shard}/{shards}: exit status {done.returncode}\n{done.stderr}")


def installed(content):
    """The path of the program of these bytes on this machine, written where it is not there yet."""
    name = f"scan2params-{hashlib.sha256(content).hexdigest()[:16]}"
    path = pathlib.Path(tempfile.gettempdir()) / name
    if not path.exists():
        part = path.with_name(f"{name}.{os.getpid()}.part")
        part.write_bytes(content)
        part.chmod(0o755)
        part.rename(path)
    return str(path)


def made(content, arguments, shard, shards, count, threads):
    """Makes a shard on the machine that this runs on. Returns its files, the manifest among them."""
    program = installed(content)
    run = json.dumps([hashlib.sha256(content).hexdigest(), arguments, shards])
    name = f"scan2params-generate-{hashlib.sha256(run.encode()).hexdigest()[:16]}"
    folder = pathlib.Path(tempfile.gettempdir()) / name
    do(program, arguments, shard, shards, folder, threads)
    return {name: (folder / name).read_bytes() for name in [MANIFEST, *files_of(shard, shards, count)]}


def keep(files, out):
    """Writes a shard's files into `out`; a manifest that is there stays."""
    for name, content in sorted(files.items()):
        path = out / name
        if name == MANIFEST and path.exists():
            continue
        part = path.with_name(f"{name}.collected")
        part.write_bytes(content)
        part.rename(path)


def missing(out, shards, count):
    """The shards of which some file is not in `out`."""
    return [k for k in range(shards) if any(not (out / name).exists() for name in files_of(k, shards, count))]


def asked(words):
    """The options of this script, and the words for `scan2params`; ends the process where they cannot be meant."""
    own, arguments = (words, []) if "--" not in words else (words[: words.index("--")], words[words.index("--") + 1 :])
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--shards", required=True, type=int)
    parser.add_argument("--address", help="of the cluster; `auto` for the one that this machine is in")
    parser.add_argument("--cpus", type=int, default=1, help="of a shard")
    parser.add_argument("--program", default="target/release/scan2params", type=pathlib.Path)
    parser.add_argument("--shared", action="store_true", help="all machines see the folder; always so for `batch`")
    options = parser.parse_args(own)
    if arguments[:1] not in (["generate"], ["batch"]):
        parser.error("say after `--` what to do: generate --count N ..., or batch FOLDER ...")
    for flag in ("--out", "-o", "--shard", "--merge", "--threads", "--dry-run"):
        if flag in arguments or option(arguments, flag) is not None:
            parser.error(f"{flag} is set here and not after `--`")
    if options.shards < 1:
        parser.error("--shards must be at least 1")
    if arguments[0] == "generate" and not (option(arguments, "--count") or "").isdigit():
        parser.error("say after `--` how many drapes: --count N")
    if not options.program.is_file():
        parser.error(f"{options.program}: no such program; cargo build --release makes it, or --program says where it is")
    return options, arguments


def main(words=None):
    options, arguments = asked(sys.argv[1:] if words is None else words)
    batch = arguments[0] == "batch"
    options.out.mkdir(parents=True, exist_ok=True)
    out = options.out.resolve()
    count = 0 if batch else int(option(arguments, "--count"))

    import ray

    ray.init(address=options.address, log_to_driver=False)
    # a shard of a batch sees by itself what is done
    to_do = list(range(options.shards)) if batch else missing(out, options.shards, count)
    content = ray.put(options.program.read_bytes())
    cwd = os.getcwd()

    # `retry_exceptions`: also where the program was killed and not the worker
    @ray.remote(num_cpus=options.cpus, max_retries=5, retry_exceptions=True)
    def task(content, shard):
        if batch or options.shared:
            do(installed(content), arguments, shard, options.shards, out, options.cpus, cwd if batch else None)
            return {}
        return made(content, arguments, shard, options.shards, count, options.cpus)

    # functions of this file, which the machines do not have, go with the task
    ray.cloudpickle.register_pickle_by_value(sys.modules[__name__])
    waiting = {task.remote(content, shard): shard for shard in to_do}
    print(f"{len(to_do)} of {options.shards} shards to do", flush=True)
    failed = []
    while waiting:
        ready, _ = ray.wait(list(waiting))
        for reference in ready:
            shard = waiting.pop(reference)
            try:
                keep(ray.get(reference), out)
                print(f"shard {shard} done, {len(waiting)} to go", flush=True)
            except (ray.exceptions.RayError, RuntimeError) as error:
                failed.append(shard)
                print(f"shard {shard} failed: {error}", file=sys.stderr, flush=True)
    ray.shutdown()
    if failed:
        sys.exit(f"{len(failed)} shards failed; the same command does them again")
    # drapes: looks through all files, and makes what is missing or damaged
    last = [str(options.program.resolve()), *arguments, "--out", str(out), *(["--merge"] if batch else [])]
    sys.exit(subprocess.run(last).returncode)


if __name__ == "__main__":
    main()
