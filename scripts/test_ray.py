#!/usr/bin/env python3
"""Checks `cluster_ray.py` on a real Ray of this machine: `python scripts/test_ray.py [PROGRAM]`.

Without PROGRAM a stand-in makes the files, of which one kills its Ray worker in the middle of a
shard and one itself. With PROGRAM, a `scan2params`, a batch of seven scans and then 72 drapes are done
by it in two shards, the worker of the second is killed, and the bytes are held against those of one run
(ten CPU-minutes).
"""

import hashlib
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

SCRIPT = pathlib.Path(__file__).parent / "cluster_ray.py"

STAND_IN = f"""#!{sys.executable}
import os, pathlib, signal, sys
flags = [w for w in sys.argv[2:] if w != "--quiet"]
words = dict(zip(flags[::2], flags[1::2]))
out = pathlib.Path(words["--out"])
out.mkdir(parents=True, exist_ok=True)
(out / "manifest.json").write_text(words["--seed"])
shard, of = map(int, words.get("--shard", "0/1").split("/"))
for number in range(shard, -(-int(words["--count"]) // 64), of):
    path = out / f"drapes-{{number:06}}.parquet"
    if not path.exists():
        path.write_text(f"{{words['--seed']}} {{number}}")
    for once, victim in (("--kill-worker", os.getppid), ("--kill-self", os.getpid)):
        mark = pathlib.Path(words.get(once, "/nowhere"))
        if number == (4 if once == "--kill-worker" else 3) and mark.exists():
            mark.unlink()
            os.kill(victim(), signal.SIGKILL)
            import time
            time.sleep(60)
"""


def digest(folder):
    files = sorted(folder.glob("drapes-*.parquet"))
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def driver(program, out, shards, *arguments, cwd=None):
    command = [sys.executable, SCRIPT, "--out", out, "--shards", str(shards), "--program", program, "--", *arguments]
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, cwd=cwd)


def with_stand_in(folder):
    program = folder / "stand-in"
    program.write_text(STAND_IN)
    program.chmod(0o755)
    # other bytes than those of an earlier test: what is kept on this machine is named by them
    seed = str(time.time_ns())
    marks = [folder / "kill-worker", folder / "kill-self"]
    for mark in marks:
        mark.touch()
    arguments = ["generate", "--count", "600", "--seed", seed, "--kill-worker", str(marks[0]), "--kill-self", str(marks[1])]
    done = driver(program, folder / "many", 3, *arguments)
    assert done.returncode == 0, done.stdout + done.stderr
    assert not any(mark.exists() for mark in marks), "nothing was killed"
    subprocess.run([program, *arguments, "--out", folder / "one"], check=True)
    one = digest(folder / "one")
    assert len(one) == 10 and digest(folder / "many") == one
    # again: what is there is not made, what is missing is
    (folder / "many" / "drapes-000005.parquet").unlink()
    done = driver(program, folder / "many", 3, *arguments)
    assert done.returncode == 0 and "1 of 3 shards to do" in done.stdout, done.stdout + done.stderr
    assert digest(folder / "many") == one
    done = driver(program, folder / "bad", 3, "generate", "--count", "600")
    assert done.returncode != 0 and "3 shards failed" in done.stderr, done.stdout + done.stderr
    done = driver(folder / "none", folder / "bad", 3, "generate", "--count", "600")
    assert done.returncode == 2 and "no such program" in done.stderr, done.stderr


def worker_is_killed(pattern, after_s, run):
    """What `run` returns; the worker whose program's command has `pattern` is killed once, when that is under way."""
    killed = []

    def kill():
        while not killed:
            time.sleep(0.2)
            found = subprocess.run(["pgrep", "-f", pattern], capture_output=True, text=True)
            for pid in found.stdout.split():
                time.sleep(after_s)
                try:
                    status = pathlib.Path(f"/proc/{pid}/stat").read_text()
                except OSError:
                    continue
                parent = int(status.rsplit(")", 1)[1].split()[1])
                os.kill(parent, signal.SIGKILL)
                killed.append(parent)

    threading.Thread(target=kill, daemon=True).start()
    done = run()
    assert killed, "no worker was killed"
    return done


def with_drapes(program, folder):
    arguments = ["generate", "--count", "72", "--prior", "measured", "--seed", str(time.time_ns() % 10**6)]
    run = lambda: driver(program, folder / "many", 2, *arguments)
    done = worker_is_killed("generate .* --shard 1/2", 10, run)
    assert done.returncode == 0, done.stdout + done.stderr
    subprocess.run([program, *arguments, "--out", folder / "one"], check=True)
    one = digest(folder / "one")
    assert len(one) == 2 and digest(folder / "many") == one, (one, digest(folder / "many"))


def with_batch(program, folder):
    fixtures = pathlib.Path(__file__).resolve().parent.parent / "fixtures/scans"
    (folder / "scans").mkdir()
    for k in range(6):
        shutil.copy(fixtures / "stiff_structured-light.ply", folder / f"scans/{k}.ply")
    (folder / "scans/7.ply").write_text("damaged")
    arguments = ["batch", "scans", "--density", "260", "--quick"]
    run = lambda: driver(program, folder / "many", 2, *arguments, cwd=folder)
    done = worker_is_killed("batch scans .* --shard 1/2", 5, run)
    assert done.returncode == 3 and "1 of 7 scans have no estimate" in done.stderr, done.stdout + done.stderr
    subprocess.run([program, *arguments, "--out", "one"], cwd=folder)
    # journals and results.jsonl have times in them
    read = lambda out: {
        str(path.relative_to(out)): path.read_bytes() for path in out.rglob("*") if path.is_file() and path.suffix != ".jsonl"
    }
    one, many = read(folder / "one"), read(folder / "many")
    assert len(one) > 20 and one.keys() == many.keys(), (one.keys() ^ many.keys())
    other = [name for name in one if one[name] != many[name]]
    assert not other, other


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        if len(sys.argv) > 1:
            with_batch(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(name))
            with_drapes(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(name))
        else:
            with_stand_in(pathlib.Path(name))
    print("ok")
