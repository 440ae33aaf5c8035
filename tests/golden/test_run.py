"""The runner of golden cases itself, with a program that is a few lines of Python."""
import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import run

# Prints its arguments; its version and last digits vary from run to run.
PROGRAM = """#!/usr/bin/env python3
import json, os, sys
words = sys.argv[1:]
if "crash" in words:
    sys.exit(3)
if "wrong" in words:
    sys.stderr.write("ecaudit: wrong\\n")
    sys.exit(2)
if "--format" in words:
    print(json.dumps({"tool": {"version": str(os.getpid())}, "findings": [{"title": "TITLE", "filler": "x" * 200}],
                      "mean": 1.0 + os.getpid() * 1e-13}))
    sys.exit(1)
print("FAIL", *words)
print("TITLE")
sys.exit(1)
"""


class Runner(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="ecaudit-golden-")
        self.addCleanup(temporary.cleanup)
        self.root = pathlib.Path(temporary.name)
        self.folder = self.root / "golden"
        self.program = self.root / "program"
        self.program_finds("first title")

    def program_finds(self, title):
        self.program.write_text(PROGRAM.replace("TITLE", title))
        self.program.chmod(0o755)

    def case(self, name, **files):
        folder = self.folder / name
        folder.mkdir(parents=True)
        for file, text in {"ORIGIN": "our own\n", **files}.items():
            if text is not None:
                (folder / file.replace("_pcap", ".pcap")).write_text(text)
        return folder

    def run_all(self, *arguments):
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            status = run.main(["--program", str(self.program), *arguments], self.folder, self.root)
        return status, out.getvalue()

    def test_a_capture_and_bless_are_enough(self):
        case = self.case("one", a_pcap="x")
        status, out = self.run_all()
        self.assertEqual(status, 1)
        self.assertIn("run with --bless", out)
        status, out = self.run_all("--bless")
        self.assertEqual(status, 0, out)
        self.assertIn("wrote golden/one/expected.txt\nwrote golden/one/expected.json\n", out)
        self.assertEqual((case / "expected.txt").read_text(), "$ ecaudit check golden/one/a.pcap\n"
                         "FAIL check golden/one/a.pcap\nfirst title\n[exit status 1]\n")
        self.assertEqual(json.loads((case / "expected.json").read_text())["tool"], {"version": "VERSION"})
        self.assertEqual(self.run_all(), (0, "ok   one\n1 case, 0 failed\n"))
        self.assertEqual(self.run_all("--bless"), (0, "ok   one\n1 case, 0 failed\n"), "nothing changed")

    def test_a_difference_is_shown_where_it_is(self):
        self.case("one", a_pcap="x")
        self.assertEqual(self.run_all("--bless")[0], 0)
        self.program_finds("second title")
        status, out = self.run_all()
        self.assertEqual(status, 1)
        self.assertIn("-first title\n+second title\n", out)
        self.assertIn("@@ findings[0].title @@\n-      \"title\": \"first title\",\n+      \"title\": \"second title\",\n", out)
        self.assertEqual(self.run_all("--bless")[0], 0)
        self.assertEqual(self.run_all()[0], 0)

    def test_a_case_without_origin_fails(self):
        self.case("none", a_pcap="x", ORIGIN=None)
        self.case("empty", a_pcap="x", ORIGIN="\n")
        self.case("named", a_pcap="x")
        status, out = self.run_all("--bless")
        self.assertEqual(status, 1)
        self.assertEqual(out.count("ORIGIN is missing"), 2)
        self.assertIn("ok   named", out)

    def test_command_lines(self):
        case = self.case("one", cmd="# two\ncheck a.pcap --expect=b.json --rule 'x=y z'\n\nslice other/a.pcap\n",
                         a_pcap="x", **{"b.json": "{}"})
        self.assertEqual(self.run_all("--bless")[0], 0)
        text = (case / "expected.txt").read_text()
        self.assertIn("$ ecaudit check golden/one/a.pcap --expect=golden/one/b.json --rule 'x=y z'\n", text)
        self.assertIn("$ ecaudit slice other/a.pcap\n", text)
        self.assertIsInstance(json.loads((case / "expected.json").read_text()), dict, "slice prints no JSON")
        (case / "cmd").write_text("check a.pcap\ncheck b.json\n")
        self.assertEqual(self.run_all("--bless")[0], 0)
        self.assertEqual(len(json.loads((case / "expected.json").read_text())), 2)
        (case / "cmd").write_text("check a.pcap --format text\n")
        self.assertIn("no command of this case prints JSON", self.run_all()[1])
        self.assertEqual(self.run_all("--bless")[0], 0)
        self.assertFalse((case / "expected.json").exists())

    def test_wrong_usage_can_be_expected_and_a_crash_cannot(self):
        case = self.case("one", cmd="check wrong\n")
        self.assertEqual(self.run_all("--bless")[0], 0)
        self.assertEqual((case / "expected.txt").read_text(),
                         "$ ecaudit check wrong\n[standard error]\necaudit: wrong\n[exit status 2]\n")
        (case / "cmd").write_text("check crash\n")
        status, out = self.run_all("--bless")
        self.assertEqual(status, 1)
        self.assertIn("exit status 3", out)
        self.assertIn("check wrong", (case / "expected.txt").read_text(), "the expectation stays")

    def test_what_to_run_must_be_clear(self):
        self.case("two", a_pcap="x", b_pcap="x")
        self.case("none")
        self.case("empty", cmd="# nothing\n")
        out = self.run_all()[1]
        self.assertIn("two: 2 captures and no file cmd", out)
        self.assertIn("none: 0 captures and no file cmd", out)
        self.assertIn("cmd: no command line", out)
        self.assertIn("3 cases, 3 failed", out)

    def test_named_cases_only(self):
        self.case("one", a_pcap="x")
        self.case("two", a_pcap="x")
        self.assertIn("1 case, 0 failed", self.run_all("--bless", "golden/two/")[1])
        self.assertFalse((self.folder / "one" / "expected.txt").exists())
        status, out = self.run_all("three")
        self.assertEqual(status, 1)
        self.assertIn("three is no folder", out)


if __name__ == "__main__":
    unittest.main()
