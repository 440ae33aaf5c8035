"""Drive families that are added: loading, checking, beginning; and that schema, reader and documents name the same."""
import json
import pathlib
import re
import unittest

from support import SOURCE, CliTest

PROFILES = SOURCE / "decoder" / "device" / "profiles"
PROFILE_SCHEMA = SOURCE / "decoder" / "device" / "ecaudit-profile-1.schema.json"
SAMPLES = SOURCE / "samples" / "captures"
ESI = SOURCE / "samples" / "descriptions" / "drive.esi.xml"

# What is planted into kollmorgen-mkd-n.json, a line each: a part that only this line has, what takes its place, and
# what the check is to say there.
PLANTED = [
    ('"edition": "2020-10"', '"edition": "Oct 2020"', "is no date"),
    ('"from": "INIT", "to": "PREOP", "allowed": true', '"from": "INIT", "to": "PREOP", "allowde": true', "missing"),
    ('"from": "SAFEOP", "to": "PREOP", "allowed": true', '"from": "SAFEOP", "to": "PREOPS", "allowed": true', "is none of"),
    ('"from": "SAFEOP", "to": "OP", "allowed": true', '"from": "SAFEOP", "to": "OP", "allowed": true, "performed": false',
     "can never be reached"),
    ('"from": "OP", "to": "INIT", "allowed": true', '"from": "OP", "to": "INIT", "allowed": false', "may always be"),
    ('"from": "INIT", "to": "OP", "allowed": false, "basis": "printed", "action": "state kept, error bit set", '
     '"refusal_codes": ["0x0011"]',
     '"from": "INIT", "to": "OP", "allowed": false, "basis": "printed", "action": "state kept, error bit set", '
     '"refusal_codes": ["0x0011", "0x0012"]', "no row of \"status_codes\""),
    ('"from": "OP", "to": "BOOT", "allowed": false, "basis": "printed", "action": "state kept, error bit set", '
     '"refusal_codes": ["0x0011"], "source": "MKD, 4.3.3"',
     '"from": "OP", "to": "BOOT", "allowed": false, "basis": "printed", "action": "state kept, error bit set", '
     '"refusal_codes": ["0x0011"]', '"source" is missing'),
    ('"address": "0x0808", "length": 8', '"address": "0x0800", "length": 8', "is already in row"),
    ('"state": "Switched on", "mask": "0x006F", "value": "0x0023"',
     '"state": "Switched on", "mask": "0x006F", "value": "0x0021"', "can never be seen"),
    ('"state": "Fault", "mask": "0x004F", "value": "0x0008"', '"state": "Fault", "mask": "0x004F", "value": "0x0018"',
     'bits outside "mask"'),
    ('"name": "Disable operation", "transitions": [5]', '"name": "Disable operation", "transitions": [55]',
     "no transition 55"),
    ('{ "bit": 12, "name": "Operation mode specific", "meaning": "reserved"',
     '{ "bit": 11, "name": "Operation mode specific", "meaning": "reserved"', "is already in row"),
    ('{ "direction": "rx", "index": "0x1704"', '{ "direction": "rx", "index": "0x1804"', "no RxPDO"),
    ('{ "index": "0x60FF", "sub": 0, "bits": 32, "name": "Velocity command value" }',
     '{ "index": "0x60FF", "sub": 0, "bits": 32, "type": "INT16", "name": "Velocity command value" }', "has 16 bits"),
    ('{ "index": "0x1001", "sub": 0, "type": "U8"', '{ "index": "0x1001", "sub": 0, "type": "U9"', "no data type"),
    ('{ "code": "0x1080", "kind": "warning"', '{ "code": "0x1080", "kind": "waring"', "is none of"),
    ('"lost_faults": ["F125"]', '"lost_faults": ["F1250"]', 'no row of "emergency"'),
    ('"cycle_min_ns": { "value": 250000', '"cycle_min_ns": { "value": 250001', "no multiple"),
    ('{ "number": 3, "use": "process in", "start": "0x1140", "max_length": 64',
     '{ "number": 3, "use": "process in", "start": "0x1140", "max_length": 4', "but PDO"),
    ('"bits": "8-12", "mask": "0x1F00", "value": "0x0300"', '"bits": "8-12", "mask": "0x0F00", "value": "0x0300"',
     "are 0x1f00"),
    ('"category": "float scaling", "name": "var", "value": "scaling depends on other settings", "source": "MKD, 5.3.1"',
     '"category": "float scaling", "name": "var", "value": "scaling depends on other settings", "source": "MDK, 5.3.1"',
     'cites "MDK"'),
    ('"index": "0x2001", "sub": 1, "last_sub": 10, "kind": "fault number"',
     '"index": "0x2001", "sub": 1, "last_sub": 10, "kind": "error code"', '"prefix" belongs to'),
    ('{ "value": 8, "name": "Cyclic synchronous position", "opmode": 2',
     '{ "value": 8, "name": "Cyclic synchronous position", "opmode": "two"', "is not a number"),
]


class Families(CliTest):
    def problems(self, path, status=1) -> list:
        done = self.run_program("profiles", "--check", path, "--format", "json")
        self.assertEqual(done.returncode, status, done.err + done.out)
        self.assertEqual(done.err, "")
        return json.loads(done.out)["files"][0]["problems"]

    def plant(self, text, planted):
        """The text with these mistakes, and the lines they are in."""
        lines = []
        for old, new, _ in planted:
            self.assertEqual(text.count(old), 1, old)
            lines.append(text[:text.index(old)].count("\n") + 1)
            text = text.replace(old, new)
        return text, lines

    def test_the_built_in_families_have_no_mistake(self):
        names = [p.stem for p in sorted(PROFILES.glob("*.json"))]
        self.assertEqual(len(names), 6)
        for name in names:
            self.assertEqual(self.problems(name, status=0), [], name)
            self.assertEqual(self.problems(PROFILES / f"{name}.json", status=0), [], name)

    def test_each_planted_mistake_is_found_alone(self):
        whole = (PROFILES / "kollmorgen-mkd-n.json").read_text()
        self.assertGreaterEqual(len(PLANTED), 20)
        for mistake in PLANTED:
            text, (line,) = self.plant(whole, [mistake])
            found = self.problems(self.file("family.json", text))
            self.assertEqual({p["line"] for p in found}, {line}, (mistake, found))
            self.assertIn(mistake[2], " ".join(p["what"] for p in found))

    def test_all_planted_mistakes_are_found_together(self):
        text, lines = self.plant((PROFILES / "kollmorgen-mkd-n.json").read_text(), PLANTED)
        found = self.problems(self.file("family.json", text))
        by_line = {}
        for problem in found:
            by_line.setdefault(problem["line"], []).append(problem["what"])
        missed = [PLANTED[i] for i, line in enumerate(lines)
                  if not any(PLANTED[i][2] in what for what in by_line.get(line, []))]
        self.assertEqual(missed, [])
        self.assertEqual(set(by_line) - set(lines), set(), found)

    def test_lines_for_editors(self):
        path = self.file("family.json", '{\n  "schema": "ecaudit.profile/1",\n  "id": "x",\n  "titel": "y"\n}\n')
        done = self.run_program("profiles", "--check", path)
        self.assertEqual(done.returncode, 1)
        self.assertIn(f'{path}:4: unknown key "titel"\n', done.out)
        self.assertIn('"title" is missing', done.out)
        self.assertIn('"document" is missing', done.out)
        self.assertTrue(done.out.endswith(f"{path}: 3 mistakes\n"), done.out)

    def test_what_is_no_json(self):
        found = self.problems(self.file("family.json", '{\n "schema": "ecaudit.profile/1",\n "id": x\n}\n'))
        self.assertEqual([p["line"] for p in found], [3])
        self.assertEqual(len(self.problems(self.file("list.json", "[]"))), 1)
        twice = self.problems(self.file("twice.json", '{\n "schema": "ecaudit.profile/1",\n "id": "x",\n "id": "y",\n'
                                                      ' "title": "t",\n "document": "ESI"\n}\n'))
        self.assertEqual([(p["line"], p["what"]) for p in twice], [(4, "the object has this key already")])
        self.assertIn("no such file", self.one_error("profiles", "--check", "nowhere.json"))

    def begin(self, *arguments) -> str:
        done = self.run_program("profiles", "--new", *arguments)
        self.assertEqual(done.returncode, 0, done.err)
        return self.file(f"{arguments[0]}.json", done.out)

    def test_a_beginning_has_no_mistake(self):
        for arguments in (["acme-one"], ["acme-two", "--from", "kollmorgen-akd-2011"], ["acme-three", "--esi", ESI],
                          ["acme-four", "--from", "kollmorgen-akd-2011", "--esi", ESI]):
            path = self.begin(*arguments)
            self.assertEqual(self.problems(path, status=0), [])
            document = json.loads(pathlib.Path(path).read_text())
            self.assertEqual(document["id"], arguments[0])
        self.assertEqual(document["extends"], "kollmorgen-akd-2011")
        self.assertEqual(document["match"]["product_codes"], ["0x00414b44"])
        self.assertEqual([p["index"] for p in document["pdo"]["fixed"]], ["0x1701", "0x1b01"])
        self.assertEqual(len(document["mailbox"]["sync_managers"]), 4)

    def test_beginnings_that_cannot_be(self):
        self.assertIn("lower-case", self.one_error("profiles", "--new", "Acme Drive"))
        self.assertIn("unknown profile 'akx'", self.one_error("profiles", "--new", "acme", "--from", "akx"))
        self.assertIn("belong to --new", self.one_error("profiles", "--esi", ESI))
        self.assertIn("give one of", self.one_error("profiles", "generic", "--new", "acme"))
        self.assertIn("has no product 0x1", self.one_error("profiles", "--new", "a", "--esi", ESI, "--product", "0x1"))
        self.run_program("profiles", "--new", "acme", "-o", "acme.json")
        self.assertIn("exists and may hold work", self.one_error("profiles", "--new", "acme", "-o", "acme.json"))

    def test_a_family_changes_a_report(self):
        # OP requested in INIT: what the manual of this family allows is no finding.
        capture = SAMPLES / "init-to-op-refused.pcapng"
        path = self.begin("acme", "--esi", ESI)
        report = self.report("--profiles", path, capture, "--fail-on", "never", status=0)["reports"][0]
        slave = report["slaves"][0]
        self.assertEqual(slave["profile"], "acme")
        self.assertIn(f"family of {path}", slave["profile_source"])
        self.assertIn("al-illegal-transition", [f["rule"] for f in report["findings"]])
        document = json.loads(pathlib.Path(path).read_text())
        generic = json.loads((PROFILES / "generic.json").read_text())["al"]
        for row in generic["transitions"]:
            if (row["from"], row["to"]) == ("INIT", "OP"):
                row["allowed"] = True
        document["al"] = generic
        allowing = self.file("allowing.json", json.dumps(document))
        report = self.report("--profiles", allowing, capture, "--fail-on", "never", status=0)["reports"][0]
        self.assertNotIn("al-illegal-transition", [f["rule"] for f in report["findings"]])

    def test_the_worked_example_of_the_guide(self):
        family = SOURCE / "samples" / "families" / "acme-servo.json"
        self.assertEqual(self.problems(family, status=0), [])
        capture = SAMPLES / "drive-unsupported-mode.pcapng"
        for given, mode in (((), 9), (("--profiles", family.parent, "--profile", "acme-servo"), 7)):
            report = self.report(*given, capture, "--fail-on", "never", status=0)["reports"][0]
            titles = [f["title"] for f in report["findings"] if f["rule"] == "drive-unsupported-mode"]
            self.assertEqual(titles, [f"Mode of operation {mode} is not in the manual's list"])
        # What --new takes from the ESI is in the result; the rest came from the manual.
        begun = json.loads(self.run_program("profiles", "--new", "acme-servo", "--esi",
                                            SOURCE / "samples" / "descriptions" / "acme-servo.esi.xml").out)
        made = json.loads(family.read_text())
        for section in ("match", "pdo", "dictionary", "mailbox", "facts"):
            self.assertEqual(begun[section], made[section], section)

    def test_an_hour_with_the_drive_of_the_samples(self):
        """As somebody does it who has an ESI, a manual and docs/families.md: begun, checked, loaded, and the report changes."""
        self.run_program("profiles", "--new", "sim-drive", "--esi", ESI, "-o", "sim-drive.json")
        self.assertEqual(self.problems(self.dir / "sim-drive.json", status=0), [])
        family = json.loads((self.dir / "sim-drive.json").read_text().replace('"MANUAL"', '"SIM-2026"'))
        # The two pieces that the guide shows, with the key of this manual.
        guide = (SOURCE / "docs" / "families.md").read_text()
        for key in ('"drive": {', '"al": {'):
            text = re.search(r"```json\n(" + re.escape(key) + r".*?)```", guide, re.S)[1]
            family |= json.loads("{" + text.replace("AS-2024", "SIM-2026") + "}")
        (self.dir / "sim-drive.json").write_text(json.dumps(family))
        self.assertEqual(self.problems(self.dir / "sim-drive.json", status=0), [])
        for capture, without, title in (("emergency", "F417", "Following error of the first axis"),
                                        ("drive-unsupported-mode", "operation 9", "operation 7")):
            for given, said in (((), without), (("--profiles", "sim-drive.json"), title)):
                done = self.run_program("check", *given, SAMPLES / f"{capture}.pcapng")
                self.assertIn(said, done.out)
        self.assertIn("sim-drive (identity in the EEPROM", done.out)

    def test_files_folders_and_settings(self):
        folder = self.dir / "families"
        folder.mkdir()
        first = self.begin("acme")
        (folder / "acme.json").write_text(pathlib.Path(first).read_text())
        second = self.begin("acme-two", "--esi", ESI)
        (folder / "two.json").write_text(pathlib.Path(second).read_text().replace('"generic"', '"acme"'))
        (folder / ".ecaudit.json").write_text("{}")
        listed = json.loads(self.run_program("profiles", "--profiles", folder, "--format", "json").out)["profiles"]
        self.assertEqual([p["id"] for p in listed if p["path"]], ["acme", "acme-two"])
        page = json.loads(self.run_program("profiles", "--profiles", folder, "acme-two", "--format", "json").out)
        self.assertEqual([f["id"] for f in page["files"]], ["acme-two", "acme", "generic"])
        # By name, by the configuration file, and for every command that takes a family.
        self.check("--profiles", folder, "--profile", "acme", self.healthy, status=0)
        self.file(".ecaudit.json", json.dumps({"profiles": "families", "slave_profiles": {"0": "acme"}}))
        self.assertEqual(self.report(self.healthy, status=0)["reports"][0]["slaves"][0]["profile"], "acme")
        self.assertEqual(self.run_program("events", self.healthy).returncode, 0)
        self.file(".ecaudit.json", json.dumps({"profiles": ["families/acme.json"], "profile": "acme-two"}))
        self.assertIn("unknown profile 'acme-two'", self.one_error("check", self.healthy))
        self.assertEqual(self.run_program("explain", "0x0017", "--profiles", folder).returncode, 0)
        self.assertIn("a drive family",
                      self.one_error("check", "--profiles", folder / "acme.json", "--profile", "acme", self.healthy,
                                     "--config", self.file("none.json", "{}"), "-o", folder / "acme.json"))

    def test_families_that_cannot_be_read(self):
        broken = self.file("broken.json", '{"schema": "ecaudit.profile/1", "id": "x", "title": "t", "document": "ESI", '
                                          '"al": {"transitions": [{"from": "INIT"}], "source": "ESI, x"}}')
        self.assertEqual(self.one_error("check", "--profiles", broken, self.healthy),
                         f'{broken}: al.transitions[0]: "to" is missing')
        self.assertIn("no such file", self.one_error("check", "--profiles", "nowhere.json", self.healthy))
        self.assertIn("'profiles' must be", self.one_error(
            "check", "--config", self.file("c.json", '{"profiles": 3}'), self.healthy))

    def test_a_family_takes_the_place_of_a_built_in_one(self):
        text = (PROFILES / "kollmorgen-akd-2011.json").read_text().replace('"Kollmorgen AKD, manual', '"Ours, manual')
        text = text.replace('"extends": "generic"', '"extends": "kollmorgen-akd-2011"')
        path = self.file("ours.json", text)
        listed = self.run_program("profiles", "--profiles", path).out
        self.assertIn("Ours, manual revision D", listed)
        self.assertEqual(listed.count("kollmorgen-akd-2011"), 1)
        page = json.loads(self.run_program("profiles", "--profiles", path, "kollmorgen-akd-2011", "--format", "json").out)
        self.assertEqual([f["title"][:4] for f in page["files"]], ["Ours", "Koll", "Ethe"])


class FamilySchema(unittest.TestCase):
    """The schema for editors and other programs says what the reader reads, and the guide names every key."""

    def setUp(self):
        self.schema = json.loads(PROFILE_SCHEMA.read_text())

    def keys_of_schema(self) -> set:
        keys = set(self.schema["properties"])
        for definition in self.schema["$defs"].values():
            keys |= set(definition.get("properties", {}))
        return keys

    def keys_of_reader(self) -> set:
        keys = set()
        for source in sorted((SOURCE / "decoder" / "device").glob("profile_*.cpp")):
            keys |= set(re.findall(r'object\.(?:Require|Allow|AllowWith)\("(\w+)"', source.read_text()))
        keys |= {"bit7", "bit3", "bit2", "bit1", "bit0"}
        return keys

    def test_same_keys_as_the_reader(self):
        self.assertEqual(self.keys_of_schema() ^ self.keys_of_reader(), set())

    def test_every_key_is_described(self):
        for name, definition in [("profile", self.schema), *self.schema["$defs"].items()]:
            for key, value in definition.get("properties", {}).items():
                self.assertTrue(value.get("description") or "$ref" in value, (name, key))

    def test_the_guide_names_every_key(self):
        guide = (SOURCE / "docs" / "families.md").read_text()
        for key in sorted(self.keys_of_schema()):
            self.assertIn(f"`{key}`", guide)

    def test_the_built_in_families_and_a_beginning_validate(self):
        try:
            import jsonschema
        except ImportError:
            self.skipTest("python3-jsonschema is not installed")
        validator = jsonschema.Draft202012Validator(self.schema)
        jsonschema.Draft202012Validator.check_schema(self.schema)
        for file in sorted(PROFILES.glob("*.json")):
            errors = [f"{file.name}: {list(e.absolute_path)}: {e.message[:200]}"
                      for e in validator.iter_errors(json.loads(file.read_text()))]
            self.assertEqual(errors, [])
        worked = SOURCE / "samples" / "families" / "acme-servo.json"
        self.assertEqual([e.message for e in validator.iter_errors(json.loads(worked.read_text()))], [])


if __name__ == "__main__":
    unittest.main()
