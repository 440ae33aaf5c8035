"""What one vendor or one family does is data (decoder/device/profiles/*.json). The code names neither families nor their
parameters nor their objects: a rule that asks "is it an AKD" is wrong for the next drive. Names may stand in comments, in
citations and in the documentation of the rules.

The words come from the profiles, so that a new family is watched from its first day: the parts of their ids, the
parameters of the vendor's tool ("FBUS.SYNCDIST", "PTBASE") and the manufacturer's objects (2000h to 5FFFh).

usage: vendor_names.py PROFILES_DIR ROOT. Looks at ROOT/{decoder,analyzers,cli}. Exit status 1 where a name stands, each
with file and line.
"""
import json
import pathlib
import re
import sys

LIBRARIES = ["decoder", "analyzers", "cli"]
# Makers without a profile.
OTHER_MAKERS = ["beckhoff", "copley", "elmo", "omron", "panasonic", "yaskawa"]

# The list of the manuals, which is what citations refer to.
CITATIONS = {"decoder/device/source_documents.cpp"}
# Numbers that are no objects: error codes of SoE, bits of registers, ranges of characters.
OTHER_NUMBERS = {"decoder/mailbox/soe.cpp", "decoder/track/sii_tracker.h", "cli/report/layout.cpp"}

TOKEN = re.compile(r"""
    (?P<comment>//[^\n]*|/\*.*?\*/)
  | (?P<raw>R"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)")
  | (?P<string>"(?:[^"\\\n]|\\.)*")
  | (?P<character>'(?:[^'\\\n]|\\.)+')
  | (?P<code>[A-Za-z_0-9]['\w]*|.)
""", re.X | re.S)

# Fields of the rules that are documentation: what follows them, up to the next comma, is no logic.
DOCUMENTATION = re.compile(r"\.(?:doc|source)\s*=\s*\Z")
# "MKD, 4.6; MKD, 5.3" and "TI, AKD 4.2.1": where something stands.
CITATION = re.compile(r'"(?:[A-Z][A-Z0-9-]*[,;]? )+\d+(?:\.\d+)*(?:; (?:[A-Z][A-Z0-9-]*[,;]? )+\d+(?:\.\d+)*)*"')

IN_TEXT = re.compile(r"\b[2-5][0-9A-F]{3}h\b")
NUMBER = re.compile(r"\A0x([2-5][0-9A-Fa-f]{3})\Z")


def walk(value, key=None):
    """All (key, text) of a document."""
    if isinstance(value, dict):
        for name, member in value.items():
            yield from walk(member, name)
    elif isinstance(value, list):
        for member in value:
            yield from walk(member, key)
    else:
        yield key, str(value)


class Names:
    def __init__(self, profiles: pathlib.Path):
        parts, keywords, self.objects = set(OTHER_MAKERS), set(), set()
        files = sorted(profiles.glob("*.json"))
        for file in files:
            profile = json.loads(file.read_text())
            if "extends" in profile:
                parts |= {part for part in profile["id"].split("-") if len(part) > 1 and not part.isdigit()}
            for key, text in walk({name: profile.get(name) for name in ("dictionary", "drive", "latch", "sync")}):
                if key in ("keyword", "parameter"):
                    keywords |= set(re.findall(r"\b[A-Z][A-Z0-9]*(?:\.[A-Z0-9]+)+\b", text))
                if key == "keyword" and "." not in text and text.isupper():
                    keywords.add(text)
                if key in ("index", "control_object", "status_object") and (number := NUMBER.match(text)):
                    self.objects.add(int(number[1], 16))
        # "FBUS." and "CAP0" are as telling as each of their parameters.
        units = {word.split(".")[0] for word in keywords if "." in word}
        keywords |= {unit for unit in units if re.search(r"\d", unit)}
        self.words = parts | keywords | units
        families = "|".join(sorted(map(re.escape, parts)))
        parameters = "|".join(sorted(map(re.escape, keywords), key=len, reverse=True))
        groups = "|".join(sorted(units, key=len, reverse=True))
        # In text and in names: "kollmorgen", "IsAkd", "kMkdFaults".
        self.family = re.compile(rf"(?<![A-Za-z])(?:{families})(?![a-z])", re.I)
        self.camel = re.compile("|".join(sorted(part.capitalize() for part in parts)) + r"(?![a-z])")
        self.parameter = re.compile(rf"\b(?:{parameters})\b|\b(?:{groups})\.(?=[A-Z])")

    def in_text(self, text: str):
        for pattern in (self.family, self.parameter, IN_TEXT):
            yield from pattern.findall(text)

    def in_code(self, token: str, numbers: bool):
        yield from self.family.findall(token)
        yield from self.camel.findall(token)
        number = NUMBER.match(token.replace("'", ""))
        if numbers and number and int(number[1], 16) in self.objects:
            yield token


def found(text: str, names: Names, numbers: bool):
    """(line, name) of everything that is neither comment nor documentation."""
    documentation = False
    before = ""
    for token in TOKEN.finditer(text):
        kind, value = token.lastgroup, token.group()
        kind = "raw" if kind == "mark" else kind
        if kind in ("string", "raw"):
            documentation = documentation or DOCUMENTATION.search(before) is not None
            where = () if documentation or CITATION.fullmatch(value) else names.in_text(value)
        elif kind == "code":
            # Strings that follow each other are one.
            documentation = documentation and value.isspace()
            where = names.in_code(value, numbers)
        else:
            where = ()
        for name in where:
            yield text.count("\n", 0, token.start()) + 1, name
        if kind != "comment":
            before = (before + value)[-40:]


def main() -> None:
    profiles, root = map(pathlib.Path, sys.argv[1:])
    names = Names(profiles)
    files, wrong = 0, 0
    for path in sorted(p for top in LIBRARIES for p in root.glob(f"{top}/**/*") if p.suffix in (".cpp", ".h")):
        relative = path.relative_to(root).as_posix()
        files += 1
        if relative in CITATIONS:
            continue
        for line, name in found(path.read_text(), names, relative not in OTHER_NUMBERS):
            wrong += 1
            print(f"{relative}:{line}: {name} belongs into a profile")
    if wrong or files == 0 or not names.words:
        sys.exit(1)
    print(f"vendor names: {len(names.words)} words and {len(names.objects)} objects in none of {files} files")


if __name__ == "__main__":
    main()
