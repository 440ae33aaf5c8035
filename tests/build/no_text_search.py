"""Sentences come last: no code looks into a title, a message, a next step or the text of a reason. What tells findings
apart are kinds, codes and arguments.

usage: no_text_search.py SOURCE_DIR. Exit status 1 where code compares or searches one, each with its line.
"""
import pathlib
import re
import sys

FOLDERS = ["analyzers", "cli"]
RENDERER = {"cli/report/sentences.cpp"}
FIELD = r"(?:\b|->|\.)(?:title|message|next|next_step|reason|reservations?|brief)\b"
# Searching and cutting, and comparing with a text. A text may be empty, or equal another one as a whole (nothing to add).
SEARCH = re.compile(FIELD + r"\.(?:find\w*|starts_with|ends_with|substr|compare|replace|erase|contains)\(")
COMPARE = re.compile(FIELD + r"\s*[!=]=\s*(?:\"|std::string|k[A-Z])|(?:\"|\bk[A-Z]\w*)\s*[!=]=\s*[\w.>\-\[\]]*" + FIELD)
RENDERED = re.compile(r"(?:TitleOf|MessageOf|SentencesOf|TextOf)\([^()]*\)(?:\.\w+)?\.(?:find\w*|starts_with|ends_with|substr|compare|contains)\(")


def main() -> None:
    root = pathlib.Path(sys.argv[1])
    wrong = files = 0
    for path in sorted(p for folder in FOLDERS for ending in ("h", "cpp") for p in root.glob(f"{folder}/**/*.{ending}")):
        name = path.relative_to(root).as_posix()
        if name in RENDERER:
            continue
        files += 1
        text = re.sub(r'R"\((.*?)\)"', lambda m: '""' + "\n" * m.group(1).count("\n"), path.read_text(), flags=re.S)
        for number, line in enumerate(text.split("\n"), 1):
            code = line.split("//")[0]
            code = re.sub(r"\berror(\(\)|\b)(\.|->)message\b", "", code)  # of the system, not of a finding
            if any(pattern.search(code) for pattern in (SEARCH, COMPARE, RENDERED)):
                print(f"{name}:{number}: {code.strip()}")
                wrong += 1
    if wrong or files == 0:
        sys.exit(1)
    print(f"no_text_search: {files} files checked")


if __name__ == "__main__":
    main()
