"""What a profile states is used: each field that profiles are read into is read again by code that judges, decodes or
explains. Readers, checks of profiles and the listing of `ecaudit profiles` do not count.

A field counts as read where a file has `.field` or `->field` and also names the struct, a list of such rows, or a list
that holds those. So a common name (`name`, `bits`) is seldom read because another struct has a field like it.
What this does not see: a field with a common name that only a file about the same rows could read. Structs that
are used under short names (`size`, `rule`) are hit by this most.

usage: facts_read.py SOURCE_DIR. Exit status 1 where a field is not read and is not in NOT_READ, or is there in vain.
"""
import pathlib
import re
import sys

# Only these describe what a family states; the other headers of the folder are about files.
HEADERS = ["al_description", "device_description", "documented_facts", "drive_profile", "emergency_codes",
           "latch_description", "mailbox_description", "object_bits", "object_dictionary", "pdo_description",
           "register_bits", "register_right", "sync_description"]
FOLDERS = ["analyzers", "cli", "decoder"]
# They copy, check and list everything.
NO_READERS = re.compile(r"decoder/device/(?:profile_(?!registry)|esi_|eni_|json_|xml_)|cli/commands/profile")
# The root, and what its holders call it.
ROOT = "DeviceDescription"
ROOT_NAMES = {"DeviceDescription", "profile", "family", "families"}
# Each row has them, and all rows are listed with them.
OF_EACH_ROW = {"note", "source"}

# Field: why nothing reads it.
NOT_READ = {
    "MailboxDescription::sdo_information": "of ESI files; no manual states it, and no rule needs it",
    "PdoContent::mandatory": "of ESI files; no manual states it",
    "PdoContent::excludes": "of ESI files; no manual states it",
}

FIELD = re.compile(r"^  (?!friend|using|static|struct|enum|\[\[|//)([\w:<>, ]+?) (\w+(?:, \w+)*)(?: = [^;]+| ?\{[^;]*\})?;",
                   re.M)


def structs(text: str) -> dict:
    """Name of each struct with its fields and their types."""
    found = {}
    text = re.sub(r"//.*", "", text)
    for match in re.finditer(r"^(?:struct|class) (\w+) \{\n(.*?)^\};", text, re.M | re.S):
        body = re.sub(r"^  (?:struct|enum class) \w+[^{;]*\{.*?^  \};", "", match.group(2), flags=re.M | re.S)
        found[match.group(1)] = {name: field.group(1) for field in FIELD.finditer(body)
                                 for name in field.group(2).split(", ")}
    return found


def anchors(known: dict) -> dict:
    """Words by which a file shows that it deals with a struct: its name, and fields that hold such rows."""
    words = {name: {name} for name in known}
    words[ROOT] = set(ROOT_NAMES)
    for owner, fields in known.items():
        for field, kind in fields.items():
            for inner in re.findall(r"\w+", kind):
                if inner in known and inner != owner:
                    words[inner] |= {field, field.removesuffix("s")}
    return words


def unread(root: pathlib.Path) -> list:
    known = {}
    own = {}
    for header in HEADERS:
        path = root / "decoder/device" / f"{header}.h"
        if not path.exists():
            continue
        for name, fields in structs(path.read_text()).items():
            known[name] = fields
            # Functions of the struct name its fields without a dot.
            own[name] = path.read_text() + (path.with_suffix(".cpp").read_text() if path.with_suffix(".cpp").exists() else "")
    words = anchors(known)
    texts = []
    for path in sorted(p for folder in FOLDERS for ending in ("h", "cpp") for p in root.glob(f"{folder}/**/*.{ending}")):
        name = path.relative_to(root).as_posix()
        if not NO_READERS.match(name) and not (name.endswith(".h") and path.stem in HEADERS):
            texts.append(re.sub(r"//.*", "", path.read_text()))
    missing = []
    for struct, fields in sorted(known.items()):
        files = [text for text in texts if any(re.search(rf"\b{word}\b", text) for word in words[struct])]
        for field in fields:
            if field in OF_EACH_ROW:
                continue
            # `row.field`, also of a row in the same file; or in a function of the struct.
            used = re.compile(rf"(?:\.|->){field}\b(?!\()|::{field}\b")
            inside = re.compile(rf"(?<![\w.>\"]){field}\b")
            bodies = "".join(re.findall(rf"^[^\n;]*\b{struct}::\w+\([^;{{]*\{{.*?^\}}", own[struct], re.M | re.S))
            bodies += "".join(re.findall(r"\) const \{.*?\}\n", own[struct], re.S))
            if not any(used.search(text) for text in files) and not inside.search(bodies):
                missing.append(f"{struct}::{field}")
    return missing


def main() -> None:
    root = pathlib.Path(sys.argv[1])
    missing = unread(root)
    problems = [f"{name}: profiles state it, and nothing reads it" for name in missing if name not in NOT_READ]
    if (root / "decoder/device/device_description.h").exists():
        problems += [f"{name}: is read, but listed as not read" for name in NOT_READ if name not in missing]
    for problem in problems:
        print(problem)
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
