#!/usr/bin/env python3
"""Whole programs side by side: libpcap's bare read loop, `ecaudit check`, `ecaudit decode`, tshark.

    cmake --preset release && cmake --build --preset release
    tests/perf/compare.py build/release

Makes the captures it needs, runs every program over the same files in one go and prints how long they take and the CPU
time that they need (user and system; `check` reads in a thread of its own), each the least of several runs. Both as
multiples of the libpcap loop. Wants a machine that does nothing else. Needs 1 GiB in the temporary folder.
"""
import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

GOAL_OVER_LIBPCAP = 4
GOAL_OVER_TSHARK = 40
GOAL_MEMORY_MIB = 64


class Cost:
    """Seconds, CPU seconds and peak memory of one program; the least of several runs (memory: the most)."""

    def __init__(self, command: list[str], runs: int):
        self.seconds = float("inf")
        self.cpu = float("inf")
        self.memory_mib = 0.0
        for _ in range(runs):
            begun = time.perf_counter()
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
            message = process.stderr.read().decode(errors="replace")
            process.stderr.close()
            _, status, usage = os.wait4(process.pid, 0)
            self.seconds = min(self.seconds, time.perf_counter() - begun)
            process.returncode = os.waitstatus_to_exitcode(status)
            if process.returncode != 0:
                sys.exit(f"{' '.join(command)} ended with {process.returncode}: {message.strip()[-500:]}")
            self.cpu = min(self.cpu, usage.ru_utime + usage.ru_stime)
            self.memory_mib = max(self.memory_mib, usage.ru_maxrss / 1024)


class Bench:
    def __init__(self, build: Path, folder: Path, runs: int):
        self.ecaudit = str(build / "cli" / "ecaudit")
        self.loop = str(build / "tests" / "perf" / "ecaudit_pcap_loop")
        self.maker = str(build / "tests" / "perf" / "ecaudit_make_long_capture")
        self.folder = folder
        self.runs = runs
        for program in (self.ecaudit, self.loop, self.maker):
            if not Path(program).exists():
                sys.exit(f"there is no {program}: build the preset release first")

    def capture(self, slaves: int, frames: int, extension: str = "pcapng") -> str:
        path = self.folder / f"{slaves}-{frames}.{extension}"
        if not path.exists():
            subprocess.run([self.maker, str(slaves), str(frames), str(path)], check=True, stdout=subprocess.DEVNULL)
        return str(path)

    def check(self, capture: str) -> Cost:
        return Cost([self.ecaudit, "check", capture], self.runs)


def row(*cells: str) -> None:
    print("| " + " | ".join(cells) + " |", flush=True)


def programs(bench: Bench, frames: int, with_tshark: bool) -> dict[str, float]:
    print(f"\n{frames:,} frames, 3 slaves, all rules on: seconds / CPU seconds, both also as multiples of the libpcap "
          "loop\n")
    row("file", "libpcap loop", "`ecaudit check`", "`ecaudit decode`", "`tshark -T fields`", "tshark / check")
    row("---", "---:", "---:", "---:", "---:", "---:")
    figures = {"over_libpcap": 0.0, "over_tshark": float("inf")}
    for extension in ("pcap", "pcapng"):
        capture = bench.capture(3, frames, extension)
        loop = Cost([bench.loop, capture], bench.runs)
        check = bench.check(capture)
        decode = Cost([bench.ecaudit, "decode", capture], 1)
        times = lambda cost: (f"{cost.seconds:.2f} ({cost.seconds / loop.seconds:.1f}x) / "
                              f"{cost.cpu:.2f} ({cost.cpu / loop.cpu:.1f}x)")
        tshark, faster = "-", "-"
        if with_tshark:
            cost = Cost(["tshark", "-r", capture, "-T", "fields", "-e", "ecat.cmd", "-e", "ecat.ado"], 1)
            tshark, faster = times(cost), f"{cost.seconds / check.seconds:.0f}x"
            figures["over_tshark"] = min(figures["over_tshark"], cost.seconds / check.seconds)
        row(extension, f"{loop.seconds:.3f} / {loop.cpu:.3f}", times(check), times(decode), tshark, faster)
        figures["over_libpcap"] = max(figures["over_libpcap"], check.seconds / loop.seconds)
    return figures


def growth(bench: Bench, frames: int) -> float:
    print("\n`ecaudit check`: cost by length and by slaves\n")
    row("frames", "slaves", "s", "CPU s", "CPU ns a frame", "peak MiB")
    row("---:", "---:", "---:", "---:", "---:", "---:")
    worst = 0.0
    for slaves, length in ((3, frames // 10), (3, frames), (3, frames * 10), (1, frames), (20, frames)):
        capture = bench.capture(slaves, length)
        cost = bench.check(capture)
        row(f"{length:,}", str(slaves), f"{cost.seconds:.2f}", f"{cost.cpu:.2f}", f"{cost.cpu / length * 1e9:.0f}",
            f"{cost.memory_mib:.0f}")
        worst = max(worst, cost.memory_mib)
        if length != frames or slaves != 3:
            Path(capture).unlink()
    return worst


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="build folder, optimised: build/release")
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--runs", type=int, default=5, help="of libpcap and check; the least counts (default 5)")
    parser.add_argument("--no-tshark", action="store_true", help="leave out tshark, which takes a minute")
    parser.add_argument("--goals", action="store_true", help="exit status 1 when a goal is missed")
    arguments = parser.parse_args()
    with_tshark = not arguments.no_tshark and shutil.which("tshark") is not None

    with tempfile.TemporaryDirectory(prefix="ecaudit-perf-") as folder:
        bench = Bench(arguments.build, Path(folder), arguments.runs)
        figures = programs(bench, arguments.frames, with_tshark)
        memory = growth(bench, arguments.frames)

    print(f"\ncheck takes {figures['over_libpcap']:.1f} times the libpcap loop (goal: {GOAL_OVER_LIBPCAP})"
          + (f", tshark {figures['over_tshark']:.0f} times check (goal: {GOAL_OVER_TSHARK})" if with_tshark else "")
          + f"; at most {memory:.0f} MiB (goal: {GOAL_MEMORY_MIB})")
    missed = (figures["over_libpcap"] > GOAL_OVER_LIBPCAP or memory > GOAL_MEMORY_MIB
              or (with_tshark and figures["over_tshark"] < GOAL_OVER_TSHARK))
    return 1 if arguments.goals and missed else 0


if __name__ == "__main__":
    sys.exit(main())
