"""What a profile states is used: each field that profiles are read into is read again by code that judges, decodes or
explains. Readers, checks of profiles and the listing of `ecaudit profiles` do not count.

A field counts as read only in an access whose type is known: `row.field`, where `row` is declared with the struct, is an
element of a list of such structs, or comes from a field or function that returns one. So a common name (`name`, `bits`)
is not read because another struct has a field like it. A method reads the fields in its body where code calls it.

What only `ecaudit explain` prints is in EXPLAINED_ONLY, and in docs/sources.md.

usage: facts_read.py SOURCE_DIR [--invent]. Exit status 1 where a field is not read and is in no list, or is listed
without need. --invent: adds fields with usual names to each struct, and fails where one of them counts as read.
"""
import bisect
import pathlib
import re
import sys

# Only these describe what a family states; the other headers of the folder are about files.
HEADERS = ["al_description", "device_description", "documented_facts", "drive_profile", "emergency_codes",
           "latch_description", "mailbox_description", "object_bits", "object_dictionary", "pdo_description",
           "register_bits", "register_right", "sync_description"]
FOLDERS = ["analyzers", "cli", "decoder"]
# They copy, check and list everything.
NO_READERS = re.compile(r"decoder/device/(?:profile_(?!registry)|esi_|eni_|json_)|cli/commands/profile")
# They print every row, whether something else uses it or not.
EXPLAINERS = re.compile(r"cli/lookup/|cli/commands/explain")
# Each row has them, and all rows are listed with them.
OF_EACH_ROW = {"note", "source"}

# Field: why nothing reads it.
NOT_READ = {
    "MailboxDescription::sdo_information": "of ESI files; no manual states it, and no rule needs it",
    "PdoContent::mandatory": "of ESI files; no manual states it",
    "PdoContent::excludes": "of ESI files; no manual states it",
}
# Field: how profiles and docs/sources.md call it.
EXPLAINED_ONLY = {
}
# Usual names for --invent.
INVENTED = ["name", "text", "bits", "value", "mask", "size", "rules", "meaning", "limit", "first", "state", "index",
            "level", "condition", "kind", "bytes", "rule", "word", "key"]

FIELD = re.compile(r"^  (?!friend|using|static|struct|enum|\[\[|//)([\w:<>, ]+?) (\w+(?:, \w+)*)(?: = [^;]+| ?\{[^;]*\})?;",
                   re.M)
WORD = re.compile(r"[A-Za-z_]\w*")
KEYWORDS = {"return", "const", "else", "new", "delete", "case", "goto", "throw", "using", "typename", "class", "struct",
            "enum", "public", "private", "namespace", "template", "operator", "constexpr", "static", "inline", "if",
            "for", "while", "switch", "sizeof", "auto", "co_return", "explicit", "virtual", "friend", "this", "default"}
# A type, and the name that it declares.
DECLARATION = re.compile(r"(?<![\w.>:])(?!(?:" + "|".join(KEYWORDS - {"auto"}) + r")\b)"
                         r"((?:[A-Za-z_]\w*::)*[A-Za-z_]\w*(?:<[^;(){}]*?>)?)(?:\s*(?:const\b|[&*]))*\s*"
                         r"(?<=[\s&*])([A-Za-z_]\w*)\s*(?=[;,)={(\[]|:(?!:))")


def cleaned(text: str) -> str:
    """Without comments, and with empty strings."""
    text = re.sub(r'R"\(.*?\)"', '""', text, flags=re.S)
    return re.sub(r'//[^\n]*|"(?:\\.|[^"\\\n])*"', lambda m: '""' if m.group()[0] == '"' else "", text)


def structs(text: str) -> dict:
    """Name of each struct with its fields and their types."""
    found = {}
    for match in re.finditer(r"^(?:struct|class) (\w+) \{\n(.*?)^\};", text, re.M | re.S):
        body = re.sub(r"^  (?:struct|enum class) \w+[^{;]*\{.*?^  \};", "", match.group(2), flags=re.M | re.S)
        found[match.group(1)] = {name: field.group(1) for field in FIELD.finditer(body)
                                 for name in field.group(2).split(", ")}
    return found


def end_of(text: str, at: int) -> int:
    """The place after the bracket that closes the one at `at`."""
    depth = 0
    for place in range(at, len(text)):
        depth += (text[place] in "([{") - (text[place] in ")]}")
        if depth == 0:
            return place + 1
    return len(text)


def methods(text: str, known: dict) -> dict:
    """(struct, method): (what it returns, its body), as far as the text has them."""
    found = {}
    for match in re.finditer(r"^(?:struct|class) (\w+) \{\n(.*?)^\};", text, re.M | re.S):
        if match.group(1) not in known:
            continue
        for one in re.finditer(r"^  (?:\[\[nodiscard\]\] |explicit )*([\w:<>*& ,]+?[\s&*])(\w+)\([^)]*\) const( \{)?",
                               match.group(2), re.M):
            # Parameters are declared before the body.
            body = match.group(2)[one.start():end_of(match.group(2), one.end() - 1)] if one.group(3) else ""
            found[match.group(1), one.group(2)] = (one.group(1), body)
    return found


def outside_bodies(text: str, known: dict) -> tuple:
    """(struct, method): body of each method of a source file; and the text without them."""
    found = {}
    rest = text
    for match in re.finditer(r"^[^\n;{}]*?\b(\w+)::(\w+)\([^;{]*\{", text, re.M):
        if match.group(1) in known:
            body = text[match.start():end_of(text, match.end() - 1)]
            found.setdefault((match.group(1), match.group(2)), []).append(body)
            rest = rest.replace(body, "")
    return found, rest


class Reader:
    """Finds the accesses to fields in a text."""

    def __init__(self, known: dict, returns: dict, shared: dict, others: set):
        self.known = known
        self.returns = returns
        self.shared = shared
        self.others = others
        self.aliases = {}

    def mentioned(self, kind: str) -> frozenset:
        return frozenset(self.aliases.get(word, word) for word in WORD.findall(kind)
                         if self.aliases.get(word, word) in self.known)

    def read(self, text: str, owner: str = "") -> set:
        """(struct, field or method) that the text accesses. `owner`: the text is the body of its method."""
        self.text = text
        self.owner = owner
        self.found = set()
        self.names = {}  # name: places and types
        self.aliases = dict(re.findall(r"\busing (\w+) = (?:\w+::)*(\w+);", text))
        for match in DECLARATION.finditer(text):
            kind, name = match.group(1), match.group(2)
            if name in KEYWORDS:
                continue
            if kind == "auto":
                types = self.of_auto(match)
            else:
                types = self.mentioned(kind)
                if types == frozenset() and text[match.end()] == "(":
                    continue  # a call in a macro, or a function of another kind
            self.names.setdefault(name, []).append((match.start(2), types))
        at = 0
        while match := WORD.search(text, at):
            at = self.chain(match.start())[1]
        return self.found

    def of_auto(self, declaration) -> frozenset:
        """What is behind `auto name = ...` and `auto name : ...`; of a parameter, what the statement went through."""
        text = self.text
        after = text[declaration.end()]
        if after in "=:":
            at = declaration.end() + 1
            end = at
            depth = 0
            while end < len(text) and depth >= 0 and not (depth == 0 and text[end] == ";"):
                depth += (text[end] in "([{") - (text[end] in ")]}")
                end += 1
            return self.of_expression(at, end)
        begin = max(text.rfind(mark, 0, declaration.start()) for mark in (";", "{", "}"))
        begin = max(text.rfind(mark, 0, begin) for mark in (";", "}")) if begin > 0 and text[begin] == "{" else begin
        return self.of_expression(max(begin, 0), declaration.start())

    def of_expression(self, at: int, end: int) -> frozenset:
        """All that its parts may be. What a function is called with counts for those of std only (find_if)."""
        types = frozenset()
        while (match := WORD.search(self.text, at, end)):
            part, after_first, after = self.chain(match.start())
            standard = self.text.endswith("std::", 0, match.start())
            at = after_first if standard or match.group() in KEYWORDS else after
            types |= part
        return types

    def of_name(self, name: str, at: int) -> frozenset:
        if self.owner and (name in self.known[self.owner] or (self.owner, name) in self.returns):
            local = [types for place, types in self.names.get(name, []) if place <= at]
            return local[-1] if local else self.member(frozenset([self.owner]), name, False)
        places = self.names.get(name)
        if places:
            before = bisect.bisect_right([place for place, _ in places], at)
            if before > 0:
                return places[before - 1][1]
        return self.of_shared(name, self.text.startswith("(", at + len(name)))

    def member(self, types: frozenset, name: str, called: bool) -> frozenset:
        result = frozenset()
        of_these = False
        for kind in types:
            if (kind, name) in self.returns:
                of_these = True
                self.found.add((kind, name))
                result |= self.mentioned(self.returns[kind, name])
            elif name in self.known[kind] and not called:
                of_these = True
                self.found.add((kind, name))
                result |= self.mentioned(self.known[kind][name])
        if of_these:
            return result
        # Of a container or pointer; else a member of another class that holds one.
        return types if types else self.of_shared(name, called)

    def of_shared(self, name: str, called: bool) -> frozenset:
        """Many classes have a function of that name: only where all of them return such structs."""
        return frozenset() if called and name in self.others else self.shared.get(name, frozenset())

    def chain(self, at: int) -> tuple:
        """Follows `name.member->member(...)[...]`. @return what it is, the places after its first name and its end."""
        text = self.text
        match = WORD.match(text, at)
        name, place = match.group(), match.end()
        after_first = place
        if text.startswith("::", place):
            inner = WORD.match(text, place + 2)
            if inner and name in self.known and inner.group() in self.known[name]:
                self.found.add((name, inner.group()))
            return frozenset(), after_first, after_first
        before = text[:at].rstrip()[-2:]
        if before.endswith(".") or before == "->":
            return frozenset(), after_first, after_first
        types = self.of_name(name, at)
        while place < len(text):
            if text[place] in "([":
                place = end_of(text, place)
                continue
            link = re.compile(r"\s*(?:\.|->)\s*([A-Za-z_]\w*)").match(text, place)
            if not link:
                break
            place = link.end()
            types = self.member(types, link.group(1), text.startswith("(", place))
        return types, after_first, place


def readings(root: pathlib.Path, invented: list) -> tuple:
    """All fields, and those that are read: by whom at least ("used" or "explained")."""
    known = {}
    heads = {}
    for header in HEADERS:
        path = root / "decoder/device" / f"{header}.h"
        if path.exists():
            heads[header] = cleaned(path.read_text())
            known.update(structs(heads[header]))
    for fields in known.values():
        for name in invented:
            fields.setdefault(name, "int")
    returns = {}
    bodies = {}
    for text in heads.values():
        for key, (kind, body) in methods(text, known).items():
            returns[key] = kind
            bodies.setdefault(key, []).append(body)
    texts = {}
    for path in sorted(p for folder in FOLDERS for ending in ("h", "cpp") for p in root.glob(f"{folder}/**/*.{ending}")):
        name = path.relative_to(root).as_posix()
        if NO_READERS.match(name) or (path.suffix == ".h" and path.stem in heads):
            continue
        texts[name] = cleaned(path.read_text())
        if path.stem in heads and path.parent.name == "device":
            outside, texts[name] = outside_bodies(texts[name], known)
            for key, found in outside.items():
                bodies.setdefault(key, []).extend(found)
    # What other classes and functions hold or return: `slave.profile`, `latch_`.
    shared = {}
    others = set()
    for name, text in texts.items():
        if name.endswith(".h"):
            for match in DECLARATION.finditer(text):
                types = frozenset(word for word in WORD.findall(match.group(1)) if word in known)
                if types:
                    shared[match.group(2)] = shared.get(match.group(2), frozenset()) | types
                elif text[match.end()] == "(":
                    others.add(match.group(2))
    reader = Reader(known, returns, shared, others)
    inside = {key: set().union(*(reader.read(body, key[0]) for body in found)) for key, found in bodies.items()}
    read = {}
    for kind in ("explained", "used"):
        open_ = []
        for name, text in texts.items():
            if (kind == "explained") == bool(EXPLAINERS.match(name)):
                open_ += reader.read(text)
        while open_:
            access = open_.pop()
            if read.get(access) != kind:
                read[access] = kind
                open_ += inside.get(access, ())
    return known, read


def problems_of(root: pathlib.Path) -> list:
    known, read = readings(root, [])
    fields = [f"{struct}::{field}" for struct, all_ in sorted(known.items()) for field in all_ if field not in OF_EACH_ROW]
    by = {name: read.get(tuple(name.split("::"))) for name in fields}
    problems = [f"{name}: profiles state it, and nothing reads it" for name in fields
                if by[name] is None and name not in NOT_READ]
    problems += [f"{name}: only explain prints it, and EXPLAINED_ONLY lacks it" for name in fields
                 if by[name] == "explained" and name not in EXPLAINED_ONLY]
    if not (root / "decoder/device/device_description.h").exists():
        return problems
    problems += [f"{name}: is read, but listed as not read" for name in NOT_READ if by.get(name) is not None]
    problems += [f"{name}: is no field that only explain prints" for name in EXPLAINED_ONLY if by.get(name) != "explained"]
    document = (root / "docs/sources.md").read_text()
    problems += [f"{name}: docs/sources.md lacks `{word}`" for name, word in EXPLAINED_ONLY.items()
                 if f"`{word}`" not in document]
    return problems


def invented_but_read(root: pathlib.Path) -> list:
    """Invented fields that count as read although no code can read them."""
    real, _ = readings(root, [])
    known, read = readings(root, INVENTED)
    return [f"{struct}::{field}: is invented, and counts as read" for struct, fields in sorted(known.items())
            for field in fields if field not in real[struct] and (struct, field) in read]


def main() -> None:
    root = pathlib.Path(sys.argv[1])
    problems = invented_but_read(root) if "--invent" in sys.argv else problems_of(root)
    for problem in problems:
        print(problem)
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
