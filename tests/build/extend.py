"""Adds a rule, an event, a collector, a family, a format of reports, one of streams and a command to a copy of the tree by the steps of
docs/architecture.md ("Where things go") and nothing else, builds it, and looks whether each is there.

usage: extend.py SOURCE_DIR WORK_DIR COMPILER
"""
import os
import pathlib
import shutil
import subprocess
import sys

# File, the line before the new one, the new line.
LINES = [
    ("analyzers/CMakeLists.txt", "  collect/al_history.cpp", "  collect/broadcast_counter.cpp"),
    ("analyzers/collect/collectors.cpp", '#include "analyzers/collect/al_history.h"',
     '#include "analyzers/collect/broadcast_counter.h"'),
    ("analyzers/collect/collectors.cpp", "  collectors.push_back(std::make_unique<AlHistory>(model, observation.pipeline(), bus));",
     "  collectors.push_back(std::make_unique<BroadcastCounter>(bus));"),
    ("decoder/device/profiles.qrc", "    <file>profiles/generic.json</file>",
     "    <file>profiles/sample-drive.json</file>"),
    ("cli/report/CMakeLists.txt", "add_library(ecaudit_report STATIC", "  count_writer.cpp"),
    ("cli/report/formats.cpp", '#include "cli/report/formats.h"', '#include "cli/report/count_writer.h"'),
    ("cli/report/formats.cpp", '    Format{"sarif", ".sarif", &WriteSarifOf, &WriteSarifPlain, false, nullptr, true},',
     '    Format{"count", ".txt", &WriteCount, nullptr},'),
    ("cli/CMakeLists.txt", "  stream/columns.cpp", "  stream/count_rows.cpp"),
    ("cli/stream/stream_formats.h", "[[nodiscard]] StreamFormat CsvFormat();", "[[nodiscard]] StreamFormat CountFormat();"),
    ("cli/stream/stream_formats.cpp", "      CsvFormat(),", "      CountFormat(),"),
    ("cli/CMakeLists.txt", "  commands/explain.cpp", "  commands/greet.cpp"),
    ("cli/commands/command.h", "[[nodiscard]] std::unique_ptr<Command> MakeExplainCommand();",
     "std::unique_ptr<Command> MakeGreetCommand();"),
    ("cli/commands/commands.cpp", "  commands.push_back(MakeExplainCommand());",
     "  commands.push_back(MakeGreetCommand());"),
]


def add_line(path: pathlib.Path, before: str, new: str) -> None:
    lines = path.read_text().split("\n")
    at = [i for i, line in enumerate(lines) if line.rstrip() == before]
    if len(at) != 1:
        sys.exit(f"{path}: the line {before!r} stands there {len(at)} times")
    lines.insert(at[0] + 1, new)
    path.write_text("\n".join(lines))


def run(*words: str, allowed: tuple = (0, 1)) -> str:
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode not in allowed:
        sys.exit(f"{' '.join(words)}: exit status {done.returncode}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")
    return done.stdout


def main() -> None:
    source, work = map(pathlib.Path, sys.argv[1:3])
    tree, build = work / "tree", work / "build"
    shutil.rmtree(tree, ignore_errors=True)
    for folder in ("decoder", "analyzers", "cli", "samples", ".ci"):
        shutil.copytree(source / folder, tree / folder)
    for file in ("CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md"):
        shutil.copy(source / file, tree / file)
    shutil.copytree(pathlib.Path(__file__).parent / "extension", tree, dirs_exist_ok=True)
    for file, before, new in LINES:
        add_line(tree / file, before, new)

    run("cmake", "-D", f"ROOT={tree}", "-P", str(tree / ".ci/check_layers.cmake"))
    run("cmake", "-S", str(tree), "-B", str(build), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Debug",
        "-DCMAKE_CXX_FLAGS_DEBUG=-O0", f"-DCMAKE_CXX_COMPILER={sys.argv[3]}", "-DECAUDIT_UNITY_BATCH=32", "-DECAUDIT_TESTS=OFF",
        allowed=(0,))
    jobs = os.environ.get("CTEST_PARALLEL_LEVEL", "2")
    built = subprocess.run(["cmake", "--build", str(build), "--target", "ecaudit", "-j", jobs], capture_output=True,
                           text=True)
    if built.returncode != 0:
        sys.exit("the extended tree does not build:\n" + built.stdout[-6000:])

    program = str(build / "cli/ecaudit")
    capture = str(tree / "samples/captures/clean-startup.pcapng")
    text = run(program, "check", capture)
    wanted = [
        ("rule", "many-broadcasts", run(program, "rules")),
        ("event, heard by the rule", "Ten broadcasts", text),
        ("collector", " broadcasts", text),
        ("family", "sample-drive", run(program, "profiles")),
        ("format", "1 finding in 1 capture", run(program, "check", "--format", "count", capture)),
        ("stream format of signals", " rows of ", run(program, "signals", "--format", "count", capture)),
        ("stream format of events", " events", run(program, "events", "--format", "count", capture)),
        ("stream format of decode", " datagrams", run(program, "decode", "--format", "count", capture)),
        ("stream format in help", "count: their number", run(program, "help", "decode")),
        ("stream format in completion", "count", run(program, "completion", "bash")),
        ("command", "hello", run(program, "greet")),
    ]
    missing = [f"{what}: {word!r} is not in\n{out}" for what, word, out in wanted if word not in out]
    if missing:
        sys.exit("\n".join(missing))
    print("added, built and found: " + ", ".join(what for what, _, _ in wanted))


if __name__ == "__main__":
    main()
