#!/usr/bin/env python3
"""What one packet costs in the steady state, function by function, in instructions: the same on a busy machine.

    cmake --preset release && cmake --build --preset release
    tests/perf/instructions.py build/release > now.txt
    tests/perf/instructions.py build/release --program OTHER > other.txt

Runs `ecaudit check` under callgrind (Debian's package valgrind) over a short and a longer capture of drives; the
difference is the steady state. Instructions are not time: what this shows is what became dearer, and where.
`tests/perf/compare.py` measures time.
"""
import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

SHORT, LONG = 10_000, 40_000  # packets; the start-up is over after 1,000
NAMES = re.compile(r"ecaudit::|\(anonymous namespace\)::|std::__cxx11::|^\S*?:(?=\S)|\s*\[[^\]]*\]$|'\d+$")


def costs(program: Path, capture: Path, inclusive: bool) -> dict[str, int]:
    """Instructions by function, and of the whole program as PROGRAM TOTALS."""
    profile = capture.with_suffix(".callgrind")
    if not profile.exists():
        run = subprocess.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={profile}", str(program), "check",
                              str(capture)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if run.returncode not in (0, 1):
            sys.exit(f"{program} ended with {run.returncode}: {run.stderr[-500:]}")
    listed = subprocess.run(["callgrind_annotate", "--threshold=100", f"--inclusive={'yes' if inclusive else 'no'}",
                             str(profile)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=True)
    found: dict[str, int] = {}
    for line in listed.stdout.splitlines():
        row = re.match(r"\s*([\d,]+) \(\s*[\d.]+%\)\s+(.*)", line)
        if row is None:
            continue
        name = NAMES.sub("", row[2])
        cost = int(row[1].replace(",", ""))
        # What one function calls is counted in each of its callers: a sum would count it twice.
        found[name] = max(found.get(name, 0), cost) if inclusive else found.get(name, 0) + cost
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="build folder, optimised: build/release")
    parser.add_argument("--program", type=Path, help="another program than that of the build folder")
    parser.add_argument("--slaves", type=int, default=3)
    parser.add_argument("--kind", default="moving", help="of the drives: moving (default), or an empty word: at rest")
    parser.add_argument("--top", type=int, default=60, help="functions to be listed (default 60)")
    arguments = parser.parse_args()
    program = arguments.program or arguments.build / "cli" / "ecaudit"
    maker = arguments.build / "tests" / "perf" / "ecaudit_make_long_capture"
    with tempfile.TemporaryDirectory(prefix="ecaudit-perf-") as folder:
        captures = []
        for packets in (SHORT, LONG):
            captures.append(Path(folder) / f"{packets}.pcap")
            kind = [arguments.kind] if arguments.kind else []
            subprocess.run([str(maker), str(arguments.slaves), str(packets), str(captures[-1]), *kind], check=True,
                           stdout=subprocess.DEVNULL)
        for inclusive in (False, True):
            short, long = (costs(program, capture, inclusive) for capture in captures)
            rows = sorted(((name, (long[name] - short.get(name, 0)) / (LONG - SHORT)) for name in long),
                          key=lambda row: -row[1])
            print("functions with what they call" if inclusive else "functions by themselves")
            for name, cost in rows[:arguments.top]:
                print(f"{cost:9.1f}  {name[:150]}")
            print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
