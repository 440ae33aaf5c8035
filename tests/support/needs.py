"""tests/needs.txt: which tests may skip, and what they need. The tests in C++ read it in named_skips.cpp."""
import fnmatch
import pathlib

TESTS = pathlib.Path(__file__).resolve().parents[1]
FILE = TESTS / "needs.txt"


def read(text: str) -> list:
    """Pairs of a need and the test that has it, PROGRAM.SUITE.NAME; `*` stands for any characters."""
    needs = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        if len(words) != 2 or words[1].count(".") < 2:
            raise ValueError(f"line {number}: a line is NEED PROGRAM.SUITE.NAME")
        needs.append(tuple(words))
    return needs


def problem_of_skip(test: str, needs: list, shared: pathlib.Path) -> str:
    """Why the skipped test should not have skipped; empty when it may."""
    own = [need for need, pattern in needs if fnmatch.fnmatchcase(test, pattern)]
    if not own:
        return f"{test} skips, and tests/needs.txt does not say what it needs"
    if set(own) == {"shared"} and shared.exists():
        return f"{test} skips although {shared} is there"
    return ""


def left_out(system: str | None) -> dict:
    """The tests that cannot run on a system, and why: tests/SYSTEM/skipped.txt, "SUITE.NAME  reason", `*` as above."""
    if not system:
        return {}
    lines = (TESTS / system / "skipped.txt").read_text().splitlines()
    return dict(line.split(maxsplit=1) for line in lines if line and not line.startswith("#"))


def why_left_out(test: str, patterns: dict) -> str:
    return next((why for pattern, why in patterns.items() if fnmatch.fnmatchcase(test, pattern)), "")
