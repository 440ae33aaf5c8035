"""Texts in plain technical English: no word of glossary.txt in documents, help, comments and messages, no name made of such
words, and no "1 frames" in reports.

usage: glossary.py SOURCE_DIR PROGRAM PLACE...
    PLACE: a file or folder below SOURCE_DIR: *.md in full, *.h and *.cpp their comments, names and sentences; -FILE is left out.

glossary_exceptions.txt holds places that are not clean yet, with their number of hits. The test fails if a number is too low,
and if it is too high: it has to shrink with the hits.
Exit status 1 with a line for each hit.
"""
import collections
import pathlib
import re
import subprocess
import sys

TOKEN = re.compile(r'#include[^\n]*|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*.*?\*/', re.S)
# Names of types, functions and variables that would talk or listen.
NAME = re.compile(r"\b(?:Tells?|Told|Telling|Says?|Said|Hears?|Heard|Judg(?:e|es|ed|ing)|Nobody|Somebody|Whoever|Is(?:Guest|Stranger))(?:[A-Z]\w*)?\b(?=[ ({;])")
# Quoted texts, code, paths and option values (slaves=N,state=OP,judged) keep their words.
QUOTED = re.compile(r'"[^"]*"|`[^`]*`|\b\w+=[\w,=]+|\b\w+/[\w/]+\.(?:h|cpp)\b')
RAW = re.compile(r'R"(\w*)\((.*)\)\1"', re.S)
VALUES = re.compile(r"\b\w+=[\w,=]+")
# "1 frames"; not "1 ms", "1 is", "0.1 errors" or "slave 1 has".
PLURAL = re.compile(r"(?<![\w.,:#/-])(?<!slave )(?<!port )(?<!interface )(?<!state )(?<!mode )1 ([a-z]{3,}[^s\W]s)\b")
SINGULAR = {"has", "was", "does", "goes", "its", "bus", "status", "samples/", "always", "backwards"}


def read_glossary(path: pathlib.Path):
    """Patterns with their replacements, longer patterns first."""
    rows = []
    for line in path.read_text().splitlines():
        if line and not line.startswith("#"):
            pattern, replacement = line.split(" => ")
            rows.append((re.compile(r"\b(?:" + pattern.replace(" ", r"\s+") + r")\b", re.I), replacement))
    return rows


def prose_of_markdown(text: str) -> str:
    """Without code; line numbers stay."""
    text = re.sub(r"^```.*?^```", lambda m: "\n" * m.group().count("\n"), text, flags=re.S | re.M)
    return re.sub(r"`[^`\n]*`|\]\([^)]*\)", "", text)


def prose_of_code(text: str):
    """Comments and sentences (text with blanks) at their line numbers, and the rest, which is code."""
    prose, code, end = [], [], 0
    for match in TOKEN.finditer(text):
        code.append(text[end:match.start()])
        end = match.end()
        token = match.group()
        lines = "\n" * token.count("\n")
        keep = ""
        if token.startswith(("//", "/*")):
            keep = QUOTED.sub(lambda m: "\n" * m.group().count("\n"), token)
        elif token.startswith('"') and " " in token.strip('" '):
            keep = VALUES.sub("", token[1:-1].replace("\\n", " "))
        elif raw := RAW.fullmatch(token):  # sentences and pages of rules
            keep = VALUES.sub("", prose_of_markdown(raw.group(2)))
        prose.append("\n" * code[-1].count("\n") + keep)
        code.append(lines)
        if keep.count("\n") < token.count("\n"):
            prose.append(lines[keep.count("\n"):])
    code.append(text[end:])
    return "".join(prose), "".join(code)


def hits(text: str, glossary):
    """(line, what was found, what to write instead)"""
    found = []
    taken = set()
    for pattern, replacement in glossary:
        for match in pattern.finditer(text):
            if match.start() not in taken:
                taken.add(match.start())
                found.append((text.count("\n", 0, match.start()) + 1, " ".join(match.group().split()), replacement))
    return sorted(found)


def help_of(program: str):
    """The help of the program and of each command, by its name."""
    def text(*words):
        return subprocess.run([program, *words], capture_output=True, text=True, check=True).stdout

    pages = {"ecaudit --help": text("--help")}
    for command in re.findall(r"^  (\w+)(?= )", pages["ecaudit --help"].split("\nCommands:\n")[1], re.M):
        if command != "ecaudit":
            pages[f"ecaudit {command} --help"] = text(command, "--help")
    if len(pages) < 10:
        sys.exit("the commands of the program were not found in its help")
    return pages


def plurals(program: str, source: pathlib.Path):
    """Lines of reports with a plural after 1."""
    captures = sorted((source / "samples" / "captures").glob("*.pcap*"))
    done = subprocess.run([program, "check", *map(str, captures)], capture_output=True, text=True)
    texts = [("report of the samples", done.stdout)]
    if not done.stdout:
        sys.exit("no report of the samples: " + done.stderr)
    texts += [(str(p.relative_to(source)), p.read_text(errors="replace"))
              for p in sorted((source / "tests" / "golden").rglob("*.txt"))]
    for name, text in texts:
        for match in PLURAL.finditer(text):
            if match.group(1) not in SINGULAR:
                begin = text.rfind("\n", 0, match.start()) + 1
                line = text[begin:text.find(chr(10), match.end())].strip()
                if not line.startswith("$ "):  # the command above a golden report
                    yield f"{name}: {line}"


def main() -> None:
    source, program = pathlib.Path(sys.argv[1]), sys.argv[2]
    places = [place for place in sys.argv[3:] if not place.startswith("-")]
    left_out = {place[1:] for place in sys.argv[3:] if place.startswith("-")}
    here = pathlib.Path(__file__).parent
    glossary = read_glossary(here / "glossary.txt")
    # The check itself has to find something.
    sample = "nobody tells it: the 1 frames stand behind a hole"
    if len(hits(sample, glossary)) != 4 or not PLURAL.search(sample) or not NAME.search("void TellAll(int"):
        sys.exit("the glossary finds nothing")

    allowed = {}
    for line in (here / "glossary_exceptions.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            number, path = line.split(maxsplit=1)
            allowed[path] = int(number)

    files = []
    for place in places:
        path = source / place
        files += [path] if path.is_file() else [p for s in ("*.md", "*.h", "*.cpp") for p in path.rglob(s)]
    found = collections.defaultdict(list)
    for path in sorted(set(files)):
        name = path.relative_to(source).as_posix()
        if name in left_out:
            continue
        text = path.read_text()
        if path.suffix == ".md":
            found[name] += hits(prose_of_markdown(text), glossary)
            continue
        prose, code = prose_of_code(text)
        found[name] += hits(prose, glossary)
        found[name] += [(code.count("\n", 0, m.start()) + 1, m.group(), "a name for what it does: Report, Add, Subscribe, ...")
                        for m in NAME.finditer(code)]
    for name, text in help_of(program).items():
        found[name] += hits(VALUES.sub("", text), glossary)

    bad = False
    for name, list_ in found.items():
        limit = allowed.pop(name, 0)
        if len(list_) > limit:
            bad = True
            for line, word, replacement in list_:
                print(f"{name}:{line}: \"{word}\": {replacement}")
        elif len(list_) < limit:
            bad = True
            print(f"{name}: only {len(list_)} left: lower its number in tests/build/glossary_exceptions.txt")
    for name in allowed:
        if any(name == p or name.startswith(p.rstrip("/") + "/") for p in places):
            bad = True
            print(f"{name}: is gone: remove it from tests/build/glossary_exceptions.txt")
    for line in plurals(program, source):
        bad = True
        print(f"plural after 1: {line}")
    if bad or not files:
        sys.exit(1)
    print(f"glossary: {len(files)} files and {len(help_of(program))} pages of help checked")


if __name__ == "__main__":
    main()
