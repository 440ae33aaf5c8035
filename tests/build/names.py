"""Files of a library are compiled several at a time (CMakeLists.txt, ECAUDIT_UNITY), in batches that shift when a file is
added: names in their anonymous namespaces must differ, functions at least in what they take.

usage: names.py SOURCE_DIR. Exit status 1 where names stand twice, each with its files.
"""
import collections
import pathlib
import re
import sys

LIBRARIES = ["decoder", "cli/report", "cli", "analyzers/rules", "analyzers", "samples"]

TYPE = re.compile(r"(?:class|struct|enum class) (\w+)")
CONSTANT = re.compile(r"(?:static |inline )?(?:constexpr|const) .*?\b(k[A-Z]\w*)\s*[\[{=;(]")
FUNCTION = re.compile(r"[\w:<>,&*\[\] ]+?[&* ](\w+)(\([^{;]*)")


def names(text: str):
    """Of everything at the outermost level of the anonymous namespace, with the namespace around it."""
    text = re.sub(r'R"\(.*?\)"', '""', text, flags=re.S)
    around = re.search(r"^namespace ([\w:]+) \{", text, re.M)
    around = around.group(1) if around else ""
    inside = False
    for line in text.split("\n"):
        if line == "namespace {":
            inside = True
        elif line == "}  // namespace":
            inside = False
        elif inside and line[:1] not in ("", " ", "}", "/", "#") and not line.startswith(("using", "template")):
            line = line.split("//")[0]
            for pattern in (TYPE, CONSTANT):
                if match := pattern.match(line):
                    yield around, match.group(1), ""
                    break
            else:
                if match := FUNCTION.match(line):
                    yield around, match.group(1), re.sub(r"\s*\w+\s*([,)]|$)", r"\1", match.group(2))


def main() -> None:
    root = pathlib.Path(sys.argv[1])
    seen = collections.defaultdict(set)
    files = 0
    for path in sorted({p for top in LIBRARIES for p in root.glob(f"{top}/**/*.cpp")}):
        relative = path.relative_to(root).as_posix()
        library = next(name for name in LIBRARIES if relative.startswith(name + "/"))
        files += 1
        for name in names(path.read_text()):
            seen[(library, *name)].add(relative)
    twice = {key: where for key, where in seen.items() if len(where) > 1}
    for (_, around, name, _), where in sorted(twice.items()):
        print(f"{around}: {name} stands in {', '.join(sorted(where))}")
    if twice or files == 0:
        sys.exit(1)
    print(f"names: {files} files checked")


if __name__ == "__main__":
    main()
