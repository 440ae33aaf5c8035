#!/usr/bin/env python3
"""Runs the golden cases: each folder here is a case, whose output must be what the folder says.

usage: tests/golden/run.py [--bless] [--program PATH] [CASE...]

  --bless         write the expectations from what the program prints today
  --program PATH  default: $ECAUDIT, or the newest build/*/cli/ecaudit

tests/README.md ("Golden cases") describes the files of a case.
"""
import argparse
import difflib
import json
import os
import pathlib
import shlex
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
CAPTURE_SUFFIXES = (".pcap", ".pcapng", ".gz", ".zst")
# How a command prints JSON. Commands that are not named here have text only.
JSON_FORMAT = {"check": "json", "startup": "json", "diff": "json", "explain": "json", "rules": "json",
               "profiles": "json", "decode": "jsonl", "events": "jsonl", "signals": "jsonl"}
DIFF_LINES = 200
LINE_WIDTH = 120
# Of an object or list that holds no other one.
LEAF_WIDTH = 200


class CaseError(Exception):
    """The case itself is wrong; no output can be compared."""


def commands(case: pathlib.Path) -> list:
    """The command lines of a case, each a list of arguments after "ecaudit"."""
    file = case / "cmd"
    if file.exists():
        lines = [shlex.split(line, comments=True) for line in file.read_text().splitlines()]
        lines = [line for line in lines if line]
        if not lines:
            raise CaseError(f"{file}: no command line")
        return lines
    captures = sorted(p.name for p in case.iterdir() if p.suffix in CAPTURE_SUFFIXES)
    if len(captures) != 1:
        raise CaseError(f"{case}: {len(captures)} captures and no file cmd, which says what to run")
    return [["check", captures[0]]]


def from_root(case: pathlib.Path, word: str, root: pathlib.Path) -> str:
    """A file of the case by its path from the root, where the program runs; all else as it is."""
    option, equals, value = word.partition("=") if word.startswith("--") else ("", "", word)
    if value and not value.startswith("-") and (case / value).is_file():
        value = str((case / value).relative_to(root))
    return option + equals + value


def run_program(program: str, words: list, root: pathlib.Path):
    """What it prints and its exit status. A crash is an error of the case: no expectation can hold it."""
    environment = {"PATH": os.environ.get("PATH", ""), "LANG": "C.UTF-8", "TZ": "UTC", "NO_COLOR": "1", "COLUMNS": "80"}
    for name, value in os.environ.items():
        if name.endswith("SAN_OPTIONS"):
            environment[name] = value
    done = subprocess.run([program, *words], cwd=root, env=environment, stdin=subprocess.DEVNULL, capture_output=True,
                          timeout=300)
    out, err = done.stdout.decode(errors="replace"), done.stderr.decode(errors="replace")
    if done.returncode not in (0, 1, 2):
        raise CaseError(f"ecaudit {shlex.join(words)}: exit status {done.returncode}\n{err}")
    return out, err, done.returncode


def normal(value, path=()):
    """JSON without what varies between builds: the version, and the last digits of numbers."""
    if isinstance(value, dict):
        return {key: normal(item, (*path, key)) for key, item in value.items()}
    if isinstance(value, list):
        return [normal(item, path) for item in value]
    if path == ("tool", "version"):
        return "VERSION"
    return float(f"{value:.9g}") if isinstance(value, float) else value


def json_lines(value, path="", indent="", before="", after=""):
    """Yields (path, line): what fits in a line is one line, so that a difference is as short as what changed."""
    whole = json.dumps(value, ensure_ascii=False)
    is_object = isinstance(value, dict)
    parts = list(value.values()) if is_object else value if isinstance(value, list) else []
    width = LINE_WIDTH if any(isinstance(part, (dict, list)) and part for part in parts) else LEAF_WIDTH
    if not parts or len(indent + before + whole + after) <= width:
        yield path, indent + before + whole + after
        return
    yield path, indent + before + ("{" if is_object else "[")
    items = value.items() if is_object else enumerate(value)
    for number, (key, item) in enumerate(items, 1):
        name = f"{json.dumps(key)}: " if is_object else ""
        place = (f"{path}.{key}" if path else key) if is_object else f"{path}[{key}]"
        yield from json_lines(item, place, indent + "  ", name, "" if number == len(value) else ",")
    yield path, indent + ("}" if is_object else "]") + after


def json_text(value) -> str:
    return "".join(line + "\n" for _, line in json_lines(value))


def outputs(case: pathlib.Path, program: str, root: pathlib.Path):
    """The text of all command lines, and the JSON: of one command line its document, of several a list; None for none."""
    text, documents = "", []
    for line in commands(case):
        words = [from_root(case, word, root) for word in line]
        out, err, status = run_program(program, words, root)
        text += f"$ ecaudit {shlex.join(words)}\n{out}"
        text += "" if out.endswith("\n") or not out else "\n"
        text += f"[standard error]\n{err}" if err else ""
        text += f"[exit status {status}]\n"
        form = JSON_FORMAT.get(words[0])
        if form is None or status == 2 or any(word.split("=")[0] == "--format" for word in words):
            continue
        out, _, _ = run_program(program, [*words, "--format", form], root)
        try:
            parsed = json.loads(out) if form == "json" else [json.loads(row) for row in out.splitlines()]
        except json.JSONDecodeError as error:
            raise CaseError(f"ecaudit {shlex.join(words)} --format {form}: no JSON: {error}") from error
        documents.append(normal(parsed))
    if not documents:
        return text, None
    return text, documents[0] if len(documents) == 1 else documents


def shortened(lines: list) -> str:
    left = len(lines) - DIFF_LINES
    return "\n".join(lines[:DIFF_LINES] + ([f"... and {left} lines more"] if left > 0 else []))


def text_difference(name: str, expected: str, actual: str) -> str:
    return shortened(list(difflib.unified_diff(expected.splitlines(), actual.splitlines(), f"{name} (expected)",
                                               f"{name} (actual)", lineterm="")))


def json_difference(name: str, expected, actual) -> str:
    """As text_difference(), but each part is headed by its place in the document: reports[0].findings[2]."""
    old, new = list(json_lines(expected)), list(json_lines(actual))
    matcher = difflib.SequenceMatcher(None, [line for _, line in old], [line for _, line in new], autojunk=False)
    lines = [f"--- {name} (expected)", f"+++ {name} (actual)"]
    for what, a, b, c, d in matcher.get_opcodes():
        if what == "equal":
            continue
        place = (old[a:b] or new[c:d])[0][0]
        lines.append(f"@@ {place} @@")
        lines += [f"-{line}" for _, line in old[a:b]] + [f"+{line}" for _, line in new[c:d]]
    return shortened(lines)


def problems(case: pathlib.Path, program: str, root: pathlib.Path, bless: bool = False) -> list:
    """What is wrong with the case, each as text; with `bless` its expectations are written first."""
    found = []
    origin = case / "ORIGIN"
    if not origin.exists() or not origin.read_text().strip():
        found.append(f"{origin} is missing: say there in a line where the capture comes from, and under which licence")
    try:
        text, document = outputs(case, program, root)
    except CaseError as error:
        return [*found, str(error)]
    text_file, json_file = case / "expected.txt", case / "expected.json"
    if bless:
        text_file.write_text(text)
        if document is None:
            json_file.unlink(missing_ok=True)
        else:
            json_file.write_text(json_text(document))
    if not text_file.exists() or (document is not None and not json_file.exists()):
        return [*found, f"{case}: expected.txt or expected.json is missing: run with --bless, and read what it writes"]
    expected = text_file.read_text()
    if expected != text:
        found.append(text_difference(f"{case.name}/expected.txt", expected, text))
    if document is None:
        if json_file.exists():
            found.append(f"{json_file}: no command of this case prints JSON")
        return found
    try:
        expected = json.loads(json_file.read_text())
    except json.JSONDecodeError as error:
        return [*found, f"{json_file}: {error}"]
    if expected != document:
        found.append(json_difference(f"{case.name}/expected.json", expected, document))
    return found


def all_cases(folder: pathlib.Path) -> list:
    return sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith((".", "_")))


def newest_program() -> str:
    built = sorted(ROOT.glob("build/*/cli/ecaudit"), key=lambda p: p.stat().st_mtime)
    if not built:
        sys.exit("no program in build/*/cli: build it, or name it by --program")
    return str(built[-1])


def main(arguments: list, folder: pathlib.Path = HERE, root: pathlib.Path = ROOT) -> int:
    parser = argparse.ArgumentParser(description="Runs the golden cases; see tests/README.md.")
    parser.add_argument("--bless", action="store_true", help="write the expectations from what the program prints today")
    parser.add_argument("--program", default=os.environ.get("ECAUDIT"))
    parser.add_argument("cases", nargs="*", metavar="CASE", help="only these folders")
    options = parser.parse_args(arguments)
    program = os.path.abspath(options.program or newest_program())
    cases = [folder / pathlib.Path(name).name for name in options.cases] or all_cases(folder)
    if not cases:
        print(f"no case in {folder}")
        return 1
    failed = 0
    for case in cases:
        if not case.is_dir():
            print(f"FAIL {case.name}\n{case} is no folder")
            failed += 1
            continue
        before = {file: file.read_text() for file in (case / "expected.txt", case / "expected.json") if file.exists()}
        found = problems(case, program, root, options.bless)
        for file in (case / "expected.txt", case / "expected.json"):
            if options.bless and (file.read_text() if file.exists() else None) != before.get(file):
                print(f"wrote {file.relative_to(root)}")
        failed += bool(found)
        print("\n".join([f"{'FAIL' if found else 'ok  '} {case.name}", *found]))
    print(f"{len(cases)} {'case' if len(cases) == 1 else 'cases'}, {failed} failed")
    if failed and not options.bless:
        print("If the new output is right: tests/run.sh --bless [CASE...], and commit what changes.")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
