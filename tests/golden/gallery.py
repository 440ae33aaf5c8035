#!/usr/bin/env python3
"""Writes docs/gallery.md: questions of engineers, each with a sample capture, the first line of its report, and what to do.
Without --bless it compares: the page must be what the program prints today.

usage: tests/golden/gallery.py [--bless] [--program PATH]

  --bless         write the page
  --program PATH  default: $ECAUDIT, or the newest build/*/cli/ecaudit
"""
import argparse
import difflib
import json
import os
import pathlib
import re
import sys

import run

PAGE = run.ROOT / "docs" / "gallery.md"
SAMPLES = run.ROOT / "samples"
# Question, capture.
ROWS = [
    ("Why is a state refused?", "two-slaves-one-refuses"),
    ("Why does the master wait for OP?", "op-waits-for-process-data"),
    ("Why did the slave leave OP?", "falls-out-of-op"),
    ("Why is the axis not enabled?", "drive-never-enabled"),
    ("Why did the drive fault?", "sync-lost-fault"),
    ("Which fault is it?", "drive-fault"),
    ("Why do set points not arrive?", "pdo-length-mismatch"),
    ("Why does the drive reject the mapping?", "pdo-unsupported"),
    ("Why does the mailbox not answer?", "foe-unsupported"),
    ("Where is the cable broken?", "wkc-link-break"),
    ("Who else writes to the slaves?", "second-master"),
    ("Why is the latched position lost?", "latch-lost-disarming"),
]
HEAD = """# Gallery

Questions, sample captures that answer them, and the first line of each report. `tests/golden/gallery.py --bless` writes
this page from what the program prints; a test compares.

"""


def what_happens(capture: str) -> str:
    """The description of a sample in the table of all samples."""
    found = re.search(rf"^\| `{capture}\.pcapng` \| \d+ \| (.+?) \| ", (SAMPLES / "README.md").read_text(), re.M)
    if not found:
        raise run.CaseError(f"samples/README.md does not describe {capture}")
    return found.group(1)


def row(program: str, question: str, capture: str) -> str:
    path = f"samples/captures/{capture}.pcapng"
    first_line = run.run_program(program, ["check", path], run.ROOT)[0].splitlines()[0]
    report = json.loads(run.run_program(program, ["check", "--format", "json", path], run.ROOT)[0])["reports"][0]
    # The line may shorten the title.
    words = re.sub(r"\W+", " ", first_line)
    cause = next((f for f in report["findings"] if re.sub(r"\W+", " ", f["title"])[:24] in words), None)
    if cause is None or not cause["next_step"]:
        raise run.CaseError(f"{path}: the first line shows no finding with a remedy: {first_line}")
    return (f"## {question}\n\n{what_happens(capture)}\n\n```\n$ ecaudit check {path}\n{first_line}\n...\n```\n\n"
            f"Do: {cause['next_step']} (Rule [`{cause['rule']}`](rules.md#{cause['rule']}).)\n")


def main() -> int:
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("--bless", action="store_true")
    parser.add_argument("--program", default=os.environ.get("ECAUDIT"))
    options = parser.parse_args()
    program = str(pathlib.Path(options.program or run.newest_program()).resolve())
    page = HEAD + "\n".join(row(program, *entry) for entry in ROWS)
    if options.bless:
        PAGE.write_text(page)
        return 0
    today = PAGE.read_text() if PAGE.exists() else ""
    sys.stdout.writelines(difflib.unified_diff(today.splitlines(True), page.splitlines(True), "docs/gallery.md", "printed"))
    return 0 if today == page else 1


if __name__ == "__main__":
    sys.exit(main())
