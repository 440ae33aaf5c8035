#!/usr/bin/env python3
"""Whole programs side by side: libpcap's bare read loop, `ecaudit check`, `decode`, `signals`, tshark.

    cmake --preset release && cmake --build --preset release
    tests/perf/compare.py build/release

Makes the captures it needs, of drives at rest and of drives that move, runs every program over the same files, bound to
one processor, and prints how long they take and the CPU time that they need (user and system), each the least of several
runs, as multiples of the libpcap loop; at the end the goals of the project and what was reached. Programs take turns, so
that what else the machine does slows all of them. Needs 1 GiB in the temporary folder.
"""
import argparse
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
# 12 columns of the first drive: both words, what they say, positions and others.
SIGNALS = ["--slave", "0", "--states", "--signal",
           "control word,status word,interpolated*,torque offset,physical outputs,position actual*,second position*,"
           "velocity*,digital inputs,following error*"]
SIGNAL_COLUMNS = 12


class Cost:
    """Seconds, CPU seconds and peak memory of one program; the least of several runs (memory: the most)."""

    def __init__(self, command: list[str], runs: int, expected=(0,)):
        self.command = command
        self.expected = expected
        self.seconds = float("inf")
        self.cpu = float("inf")
        self.memory_mib = 0.0
        for _ in range(runs):
            self.run()

    def run(self) -> None:
        begun = time.perf_counter()
        process = subprocess.Popen(self.command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        message = process.stderr.read().decode(errors="replace")
        process.stderr.close()
        _, status, usage = os.wait4(process.pid, 0)
        self.seconds = min(self.seconds, time.perf_counter() - begun)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode not in self.expected:
            sys.exit(f"{' '.join(self.command)} ended with {process.returncode}: {message.strip()[-500:]}")
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

    def capture(self, slaves: int, frames: int, extension: str = "pcapng", kind: str = "") -> str:
        path = self.folder / f"{slaves}{kind}-{frames}.{extension}"
        if not path.exists():
            subprocess.run([self.maker, str(slaves), str(frames), str(path)] + ([kind] if kind else []), check=True,
                           stdout=subprocess.DEVNULL)
        return str(path)

    def run(self, *arguments: str) -> Cost:
        return Cost([self.ecaudit, *arguments], self.runs)

    def output(self, *arguments: str) -> bytes:
        return subprocess.run([self.ecaudit, *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout


class Goals:
    """What is to be reached; printed at the end, in the order of the first mention."""

    def __init__(self):
        self.rows = {}

    def at_most(self, what: str, value: float, goal: float, unit: str, digits: int = 1) -> None:
        if what not in self.rows or value > self.rows[what][0]:
            self.rows[what] = (value, f"≤ {goal:g} {unit}", f"{value:.{digits}f} {unit}", value <= goal)

    def at_least(self, what: str, value: float, goal: float, unit: str) -> None:
        if what not in self.rows or value < self.rows[what][0]:
            self.rows[what] = (value, f"≥ {goal:g} {unit}", f"{value:.0f} {unit}", value >= goal)

    def show(self) -> bool:
        print()
        row("what", "goal", "measured", "reached")
        row("---", "---:", "---:", "---")
        for what, (_, goal, measured, reached) in self.rows.items():
            row(what, goal, measured, "yes" if reached else "no")
        return all(reached for *_, reached in self.rows.values())


def row(*cells: str) -> None:
    print("| " + " | ".join(cells) + " |", flush=True)


def programs(bench: Bench, frames: int, with_tshark: bool, goals: Goals) -> None:
    print(f"\n{frames:,} frames, 3 slaves, all rules on, one processor: seconds / CPU seconds, both also as multiples of "
          "the libpcap loop\n")
    row("file", "drives", "program", "seconds", "x libpcap", "CPU seconds", "x libpcap")
    row("---", "---", "---", "---:", "---:", "---:", "---:")
    for extension in ("pcap", "pcapng"):
        for kind in ("", "moving"):
            capture = bench.capture(3, frames, extension, kind)
            loop = Cost([bench.loop, capture], 0)
            check = Cost([bench.ecaudit, "check", capture], 0)
            jsonl = Cost([bench.ecaudit, "decode", "--format", "jsonl", capture], 0)
            decode = Cost([bench.ecaudit, "decode", capture], 0)
            signals = Cost([bench.ecaudit, "signals", *SIGNALS, capture], 0)
            for _ in range(bench.runs):
                for cost in (loop, check, jsonl, decode, signals):
                    cost.run()

            def show(name: str, cost: Cost) -> None:
                row(extension, kind or "at rest", name, f"{cost.seconds:.3f}", f"{cost.seconds / loop.seconds:.1f}",
                    f"{cost.cpu:.3f}", f"{cost.cpu / loop.cpu:.1f}")

            show("libpcap's read loop", loop)
            show("`ecaudit check`", check)
            show("`ecaudit decode --format jsonl`", jsonl)
            show("`ecaudit decode`", decode)
            show(f"`ecaudit signals`, {SIGNAL_COLUMNS} columns", signals)
            goals.at_most(f"`check` of drives {'that move' if kind else 'at rest'}, processor time", check.cpu / loop.cpu, 5,
                          "× libpcap")
            goals.at_most("`decode --format jsonl`, processor time", jsonl.cpu / loop.cpu, 8, "× libpcap")
            goals.at_most(f"`signals` of one slave, {SIGNAL_COLUMNS} columns, processor time", signals.cpu / loop.cpu, 6,
                          "× libpcap")
            if with_tshark:
                cost = Cost(["tshark", "-r", capture, "-T", "fields", "-e", "ecat.cmd", "-e", "ecat.ado"], 1)
                show("`tshark -T fields`", cost)
                goals.at_least("`check` against `tshark -T fields`", cost.cpu / check.cpu, 25, "×")


def startup(bench: Bench, goals: Goals) -> None:
    """A command over a start-up and nothing else: mostly what every command costs."""
    capture = bench.capture(20, 1)  # 20 drives take about 10,000 packets
    short = str(bench.folder / "startup.pcapng")
    subprocess.run([bench.ecaudit, "slice", "--frames", "1-2000", "-o", short, capture], check=True,
                   stdout=subprocess.DEVNULL)
    cost = Cost([bench.ecaudit, "check", short], 5 * bench.runs, (0, 1))
    version = Cost([bench.ecaudit, "--version"], 5 * bench.runs)
    print(f"\nstart-up only, 2,000 frames: {cost.seconds * 1000:.1f} ms, {cost.cpu * 1000:.1f} ms CPU; of these "
          f"{version.seconds * 1000:.1f} ms to load the program (--version)")
    goals.at_most("start-up only captures (2,000 frames): whole command", cost.seconds * 1000, 10, "ms")


def growth(bench: Bench, frames: int, goals: Goals) -> None:
    print("\n`ecaudit check`: cost by length and by slaves\n")
    row("frames", "slaves", "bytes a frame", "s", "CPU s", "CPU ns a frame", "CPU ns a byte", "peak MiB")
    row("---:", "---:", "---:", "---:", "---:", "---:", "---:", "---:")
    for slaves, length, kind in ((3, frames // 10, ""), (3, frames, ""), (3, frames * 10, ""), (3, frames, "moving"),
                                 (1, frames, ""), (20, frames, ""), (1, frames // 10, "terminals"),
                                 (10, frames // 10, "terminals"),
                                 (100, frames // 10, "terminals"), (1000, frames // 10, "terminals")):
        capture = bench.capture(slaves, length, "pcapng", kind)
        cost = bench.run("check", capture)
        ns, size = cost.cpu / length * 1e9, os.path.getsize(capture) / length
        if kind == "terminals":
            # Without the start-up, whose cost belongs to the slaves, not to the frames.
            before = bench.capture(slaves, 1, "pcapng", kind)
            started = bench.run("check", before)
            size = (os.path.getsize(capture) - os.path.getsize(before)) / length
            ns = (cost.cpu - started.cpu) / length * 1e9
            Path(before).unlink()
        row(f"{length:,}", f"{slaves} {kind}".strip(), f"{size:.0f}", f"{cost.seconds:.2f}", f"{cost.cpu:.2f}",
            f"{ns:.0f}", f"{ns / size:.1f}", f"{cost.memory_mib:.0f}")
        goals.at_most("peak memory", cost.memory_mib, 64, "MiB", 0)
        if kind == "terminals" and slaves == 1:
            one = ns, size
        if kind == "terminals" and slaves == 1000:
            goals.at_most("cost of a frame, 1,000 slaves on one LRW against 1, by the bytes of the frame",
                          (ns / one[0]) / (size / one[1]), 1, "×", 2)
        if length != frames or slaves != 3:
            Path(capture).unlink()


def memory(bench: Bench, goals: Goals) -> None:
    """Of the sample captures and of what the suite of the command line takes for hostile."""
    os.environ["ECAUDIT"] = bench.ecaudit
    sys.path.insert(0, str(SOURCE / "tests" / "cli"))
    import test_growth as hostile
    made = {"eeprom": hostile.eeprom_reads(6000), "broadcasts": hostile.slaves_and_broadcasts(200, 1600),
            "findings": hostile.distinct_findings(6000), "interfaces": hostile.interfaces(16000)}
    paths = sorted((SOURCE / "samples" / "captures").glob("*.pcap*"))
    for name, content in made.items():
        paths.append(bench.folder / f"{name}.pcap")
        paths[-1].write_bytes(content)
    costs = {path: Cost([bench.ecaudit, "check", "--format", "json", str(path)], 1, (0, 1, 2)) for path in paths}
    worst = max(costs, key=lambda path: costs[path].memory_mib)
    print(f"\npeak memory of {len(costs)} captures, samples and hostile ones: {costs[worst].memory_mib:.0f} MiB ({worst.name})")
    goals.at_most("peak memory", costs[worst].memory_mib, 64, "MiB", 0)


def report_size(bench: Bench, goals: Goals) -> None:
    capture = bench.capture(40, 40_000)
    size = len(bench.output("check", "--format", "json", capture)) / 1e6
    print(f"\nreport of 40 drives: {size:.2f} MB")
    goals.at_most("report size, 40 slaves", size, 1, "MB")
    Path(capture).unlink()


def machine() -> str:
    try:
        names = [line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")]
    except OSError:
        names = []
    return f"{names[0] if names else platform.machine()}, one of {os.cpu_count()} processors, {platform.system()}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="build folder, optimised: build/release")
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--runs", type=int, default=5, help="the least counts (default 5)")
    parser.add_argument("--no-tshark", action="store_true", help="leave out tshark, which takes a minute")
    parser.add_argument("--goals", action="store_true", help="exit status 1 when a goal is missed")
    arguments = parser.parse_args()
    with_tshark = not arguments.no_tshark and shutil.which("tshark") is not None

    # Programs inherit it.
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    goals = Goals()
    with tempfile.TemporaryDirectory(prefix="ecaudit-perf-") as folder:
        bench = Bench(arguments.build.resolve(), Path(folder), arguments.runs)
        print(machine())
        programs(bench, arguments.frames, with_tshark, goals)
        startup(bench, goals)
        growth(bench, arguments.frames, goals)
        memory(bench, goals)
        report_size(bench, goals)
    reached = goals.show()
    return 1 if arguments.goals and not reached else 0


if __name__ == "__main__":
    sys.exit(main())
