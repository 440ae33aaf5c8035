"""batch and merge: many captures, one report each, one summary."""
import base64
import hashlib
import html
import json
import os
import pathlib
import pty
import re
import shutil
import signal
import subprocess
import time
import unittest
import urllib.parse
import xml.etree.ElementTree as ET

from support import (PROGRAM, SCHEMA, SHARED, SOURCE, WINDOWS, Bus, CliTest, faulty_bus, faulty_capture,
                     foreign_capture, healthy_capture, read_terminal)
from test_ci_formats import JUNIT_SCHEMA, sarif_errors
from test_report import strict

try:
    import jsonschema
except ImportError:
    jsonschema = None

SUMMARY_SCHEMA = SOURCE / "cli" / "report" / "ecaudit-summary-1.schema.json"
FORMATS = {"text": "txt", "json": "json", "junit": "xml", "sarif": "sarif"}


class BatchTest(CliTest):
    def setUp(self):
        super().setUp()
        for path in (self.healthy, self.faulty):
            os.remove(path)
        self.file("in/a/good.pcap", healthy_capture())
        self.file("in/a/trace.pcap", faulty_capture())
        self.file("in/b/trace.pcap", healthy_capture())
        self.file("in/notes.txt", "no capture")

    def batch(self, *arguments, status, **options):
        done = self.run_program("batch", *arguments, **options)
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.out}\n{done.err}")
        return done

    def merge(self, *arguments, status):
        done = self.run_program("merge", *arguments)
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.out}\n{done.err}")
        return done

    def summary(self, *arguments, status):
        document = json.loads(self.batch("--format", "json", *arguments, status=status).out)
        if jsonschema is not None:
            schema = json.loads(SUMMARY_SCHEMA.read_text())
            jsonschema.Draft202012Validator.check_schema(schema)
            for one in (schema, strict(schema)):
                errors = [f"{'/'.join(map(str, e.absolute_path))}: {e.message}"
                          for e in jsonschema.Draft202012Validator(one).iter_errors(document)]
                self.assertEqual(errors, [])
        return document

    def reports(self, folder="ecaudit-reports"):
        """Content of each report by its file name."""
        return {p.name: p.read_bytes() for p in (self.dir / folder).iterdir()}

    @staticmethod
    def outputs(prefix):
        """Options that write the summary in each format, and the files they make."""
        options = [part for name, ending in FORMATS.items() for part in ("-o", f"{name}={prefix}.{ending}")]
        return options, [f"{prefix}.{ending}" for ending in FORMATS.values()]

    def contents(self, names):
        return [(self.dir / name).read_bytes() for name in names]


class Batch(BatchTest):
    def test_folders_are_searched_and_the_order_is_by_path(self):
        summary = self.summary("in", status=1)
        self.assertEqual([c["path"] for c in summary["captures"]],
                         ["in/a/good.pcap", "in/a/trace.pcap", "in/b/trace.pcap"])
        self.assertEqual([c["status"] for c in summary["captures"]], ["pass", "fail", "pass"])
        self.assertEqual(summary["summary"]["failed"], 1)
        self.assertEqual(summary["summary"]["verdict"], "fail")

    def test_each_report_is_what_check_says(self):
        summary = self.summary("in", status=1)
        self.assertEqual(set(self.reports()), {c["report"] for c in summary["captures"]})
        for capture in summary["captures"]:
            report = json.loads(self.reports()[capture["report"]])
            self.assertRegex(report.pop("made_from")["settings"], "^[0-9a-f]{16}$")
            checked = json.loads(self.run_program("check", "--format", "json", capture["path"]).out)
            self.assertEqual(report, checked)

    @unittest.skipIf(jsonschema is None, "python3-jsonschema is not installed")
    def test_reports_are_valid(self):
        self.file("in/broken.pcap", b"no packets")
        self.batch("in", status=2)
        schema = json.loads(SCHEMA.read_text())
        for content in self.reports().values():
            for one in (schema, strict(schema)):
                errors = [e.message for e in jsonschema.Draft202012Validator(one).iter_errors(json.loads(content))]
                self.assertEqual(errors, [])

    def test_names_of_reports_depend_on_the_path_only(self):
        self.batch("in", status=1)
        together = self.reports()
        names = sorted(re.sub("-[0-9a-f]{12}.json$", "", n) for n in together)
        self.assertEqual(names, ["good.pcap", "trace.pcap", "trace.pcap"])
        self.batch("in/b/../b/trace.pcap", "--output-dir", "alone", status=0)
        (name, content), = self.reports("alone").items()
        self.assertEqual(together[name], content)

    def test_wildcards_files_and_repetitions(self):
        summary = self.summary("in/*/trace.pcap", "in/a/trace.pcap", "./in/a", status=1)
        self.assertEqual([c["path"] for c in summary["captures"]],
                         ["in/a/good.pcap", "in/a/trace.pcap", "in/b/trace.pcap"])
        self.assertIn("nothing matches in/x*.pcap", self.one_error("batch", "in/x*.pcap"))

    def test_endings_of_captures(self):
        for name in ("x.pcapng", "x.PCAP", "x.cap", "x.pcap12", "x.pcap.gz", "x.pcapng.zst"):
            self.file("endings/" + name, b"")
        for name in ("x.json", "x.pcapx", "pcap", ".pcap", ".hidden.pcap", "x.gz", ".git/x.pcap"):
            self.file("endings/" + name, b"")
        summary = self.summary("endings", status=2)
        self.assertEqual([c["path"] for c in summary["captures"]], sorted(
            "endings/" + n for n in ("x.pcapng", "x.PCAP", "x.cap", "x.pcap12", "x.pcap.gz", "x.pcapng.zst")))
        # A file that is named is a capture, whatever its ending.
        self.file("named.bin", healthy_capture())
        self.assertEqual(self.summary("named.bin", status=0)["summary"]["passed"], 1)

    def test_join(self):
        content = healthy_capture()
        middle = 24 + (16 + 60) * 10
        first = self.file("ring/t_00001_20190501120000.pcap", content[:middle])
        second = self.file("ring/t_00002_20190501120001.pcap", content[:24] + content[middle:])
        self.file("ring/other.pcap", content)
        summary = self.summary("ring", "--join", status=0)
        self.assertEqual([c["path"] for c in summary["captures"]],
                         ["ring/other.pcap", "ring/t_00001_20190501120000.pcap, ring/t_00002_20190501120001.pcap"])
        alone, joined = summary["captures"]
        self.assertEqual(joined["packets"], alone["packets"])
        self.assertEqual(len(self.summary("ring", status=0)["captures"]), 3)
        self.batch("ring", "--join", status=0)
        self.assertIn("2 of them done before", self.batch("ring", "--join", "--skip-done", status=0).err)
        os.utime(second, (2e9, 2e9))
        self.assertIn("1 of them done before", self.batch("ring", "--join", "--skip-done", status=0).err)
        os.utime(first, (1e9, 1e9))  # neither the size nor the latest change: the same content as far as can be told
        self.assertIn("2 of them done before", self.batch("ring", "--join", "--skip-done", status=0).err)

    def test_nothing_there(self):
        self.file("empty/readme.txt", "")
        self.assertEqual(self.one_error("batch", "empty"), "no capture in empty")
        self.assertIn("no PATH given", self.one_error("batch"))
        self.assertIn("does not read standard input", self.one_error("batch", "-"))

    def test_a_damaged_capture_does_not_stop_the_others(self):
        self.file("in/a/broken.pcap", b"this is no capture at all")
        self.file("in/b/cut.pcap", healthy_capture()[:-7])
        self.file("in/b/foreign.pcap", foreign_capture())
        summary = self.summary("in", "nowhere.pcap", "--rule=frame-lost=off", status=2)
        status = {c["path"]: c["status"] for c in summary["captures"]}
        self.assertEqual(status["in/a/broken.pcap"], "unreadable")
        self.assertEqual(status["nowhere.pcap"], "unreadable")
        self.assertEqual(status["in/b/foreign.pcap"], "nothing-to-check")
        self.assertEqual(status["in/a/good.pcap"], "pass")
        by_path = {c["path"]: c for c in summary["captures"]}
        self.assertIn("not a capture", by_path["in/a/broken.pcap"]["error"])
        self.assertFalse(by_path["in/b/cut.pcap"]["complete"])
        self.assertEqual(summary["summary"]["unreadable"], 2)
        self.assertEqual(summary["summary"]["captures"], 7)
        done = self.batch("in", "nowhere.pcap", status=2)
        self.assertIn("no such file: nowhere.pcap", done.err)
        self.assertIn("ERROR in/a/broken.pcap is not a capture", done.out)

    @unittest.skipIf(os.geteuid() == 0, "permissions do not bind root")
    def test_unreadable_folder(self):
        os.chmod(self.dir / "in" / "b", 0)
        self.addCleanup(os.chmod, self.dir / "in" / "b", 0o755)
        summary = self.summary("in", status=2)
        self.assertEqual(summary["summary"]["unreadable"], 1)

    def test_exit_status(self):
        self.batch("in/b", status=0)
        self.batch("in", status=1)
        self.batch("in", "--fail-on", "never", status=0)
        self.assertEqual(self.summary("in/b", "nowhere.pcap", status=2)["summary"]["verdict"], "incomplete")

    def test_text_summary(self):
        out = self.batch("in", status=1).out
        self.assertTrue(out.startswith("FAIL 3 captures, 1 failed: "), out)
        self.assertRegex(out, r"(?m)^  error +al-refused +1 capture$")
        self.assertRegex(out, r"(?m)^  FAIL in/a/trace.pcap: slave 0")
        self.assertLess(out.index("FAIL in/a/trace.pcap"), out.index("PASS in/a/good.pcap"))
        self.assertTrue(self.batch("in/b", status=0).out.startswith("PASS 1 capture, none failed: "))

    def test_standard_error_says_where_the_reports_are(self):
        self.assertEqual(self.batch("in", status=1).err, "ecaudit: 3 reports in ecaudit-reports\n")

    def test_summary_formats(self):
        options, files = self.outputs("sum")
        done = self.batch("in", *options, status=1)
        self.assertTrue(done.out.startswith("FAIL 3 captures"))
        text, document, junit, sarif = self.contents(files)
        self.assertEqual(text.decode(), done.out)
        self.assertEqual(json.loads(document)["schema"], "ecaudit.summary/1")
        self.assertEqual([s.get("name") for s in ET.fromstring(junit)],
                         ["in/a/good.pcap", "in/a/trace.pcap", "in/b/trace.pcap"])
        self.assertEqual(sarif_errors(json.loads(sarif)), [])
        self.assertEqual({r["ruleId"] for r in json.loads(sarif)["runs"][0]["results"]},
                         {f["rule"] for c in json.loads(document)["captures"] for f in c["findings"]})

    def test_output_folder(self):
        for arguments in (("--output-dir", "deep/er/out"), ("-o", "slash/"), ("-o", "in/a")):
            self.batch("in/b", *arguments, status=0)
            names = [n for n in self.reports(arguments[1]) if n.endswith(".json")]
            self.assertEqual(len(names), 1, arguments)
        self.file("taken", "a file")
        self.assertIn("cannot make the folder taken", self.one_error("batch", "in", "--output-dir", "taken"))

    def test_the_summary_does_not_overwrite_captures(self):
        self.assertIn("will not be overwritten", self.one_error("batch", "in", "-o", "in/a/good.pcap"))

    def test_a_report_does_not_overwrite_a_capture(self):
        self.batch("in/b", status=0)
        (name,) = self.reports()
        path = self.dir / "ecaudit-reports" / name
        path.write_bytes(healthy_capture())
        done = self.run_program("batch", "in/b")
        self.assertEqual(done.returncode, 2)
        self.assertIn("will not be overwritten", done.err)
        self.assertEqual(path.read_bytes(), healthy_capture())

    def test_jobs(self):
        for text in ("0", "-1", "x", "", "1.5", "100000"):
            self.assertIn("--jobs", self.one_error("batch", "in", f"--jobs={text}"))
        one = self.batch("in", "--jobs", "1", status=1)
        reports = self.reports()
        for jobs in ("2", "7"):
            self.assertEqual(self.batch("in", "--jobs", jobs, status=1).out, one.out)
            self.assertEqual(self.reports(), reports)

    def test_options_of_check_reach_each_capture(self):
        summary = self.summary("in", "--rule=al-refused=warning", "--slave=0", "--from=#3", "--to=#12", "--isolate",
                               "--profile=generic", "--fail-on=never", status=0)
        found = {f["rule"]: f["severity"] for c in summary["captures"] for f in c["findings"]}
        self.assertNotIn("error", [s for r, s in found.items() if r == "al-refused"])
        for content in self.reports().values():
            report = json.loads(content)["reports"][0]
            self.assertEqual(report["settings"]["rules"], {"al-refused": "warning"})
            self.assertEqual(report["capture"]["ethercat_frames"], 10)
        self.assertIn("unknown rule", self.one_error("batch", "in", "--rule=nope=off"))

    def test_slave_that_is_nowhere(self):
        # As in check: wrong usage when no capture has it.
        done = self.batch("in/b", "--slave=9", status=2)
        self.assertIn("has none of the slaves of --slave", done.err)

    def test_baseline(self):
        self.batch("in", "--write-baseline", "known.json", status=1)
        self.run_program("check", "in/a/good.pcap", "in/a/trace.pcap", "in/b/trace.pcap", "--write-baseline", "same.json")
        self.assertEqual((self.dir / "known.json").read_bytes(), (self.dir / "same.json").read_bytes())
        summary = self.summary("in", "--baseline", "known.json", status=0)
        self.assertGreater(summary["summary"]["known"], 0)
        self.assertEqual(summary["rules"], [])

    def test_configuration_files(self):
        self.file("in/a/.ecaudit.json", '{"fail_on": "never"}')
        summary = self.summary("in", status=0)
        self.assertEqual([c["fail_on"] for c in summary["captures"]], ["never", "never", "error"])
        # One folder with wrong settings does not keep the others from being checked.
        for content, why in (("{", "not valid JSON"), ('{"rules": {"al-refusd": "off"}}', "unknown rule 'al-refusd'"),
                             ('{"baseline": "none.json"}', "no such file")):
            self.file("in/b/.ecaudit.json", content)
            summary = self.summary("in", status=2)
            status = {c["path"]: c["status"] for c in summary["captures"]}
            self.assertEqual(status["in/b/trace.pcap"], "unreadable")
            self.assertEqual(status["in/a/good.pcap"], "pass")
            self.assertIn(why, next(c["error"] for c in summary["captures"] if c["path"] == "in/b/trace.pcap"))
        # What is wrong on the command line is wrong for all, and so is a file that it names.
        self.assertIn("unknown rule 'nope'", self.one_error("batch", "in", "--rule", "nope=off"))
        self.file("bad.json", "{")
        self.assertIn("not valid JSON", self.one_error("batch", "in", "--config", "bad.json"))

    def test_a_wrong_command_line_leaves_no_folder(self):
        for wrong in (("nosuch",), ("in", "-o", "jsn=s.json"), ("in", "--format", "nope")):
            self.one_error("batch", "--output-dir", "new", *wrong)
            self.assertFalse((self.dir / "new").exists(), wrong)
        self.assertIn("no such file: nosuch", self.one_error("batch", "nosuch"))
        self.assertFalse((self.dir / "ecaudit-reports").exists())
        (self.dir / "old").mkdir()
        self.one_error("batch", "--output-dir", "old", "in", "--format", "nope")
        self.assertTrue((self.dir / "old").exists())

    def test_many_quiet_captures_are_counted(self):
        for i in range(45):
            self.file(f"in/many/{i:02}.pcap", healthy_capture())
        out = self.batch("in", status=1).out
        self.assertIn("FAIL in/a/trace.pcap", out)
        self.assertIn("and 47 captures without findings", out)
        self.assertNotIn("in/many/00.pcap", out)

    def test_progress_on_a_terminal_only(self):
        # A capture that arrives slowly.
        pipe = self.dir / "slow.pcap"
        os.mkfifo(pipe)
        leader, follower = pty.openpty()
        with subprocess.Popen([PROGRAM, "batch", "in", pipe, "--jobs", "1"], stdout=subprocess.DEVNULL, stderr=follower,
                              stdin=subprocess.DEVNULL, cwd=self.dir) as child:
            os.close(follower)
            content = healthy_capture()
            with open(pipe, "wb") as slow:
                slow.write(content[:24] + content[24:] * 50)
                slow.flush()
                time.sleep(1.6)
                slow.write(content[24:])
            seen = read_terminal(leader)
            child.wait()
        self.assertRegex(seen, rb"3 of 4 captures  .*[1-9]\d* frames, \d+ frames/s")
        self.assertTrue(seen.replace(b"\r", b"").endswith(b"\x1b[Kecaudit: 4 reports in ecaudit-reports\n"), seen)

    def big_captures(self, n):
        """A folder with captures that take a while: one file under n names."""
        content = healthy_capture()
        first = self.file("big/0.pcap", content[:24] + content[24:] * 2000)
        for i in range(1, n):
            os.link(first, self.dir / f"big/{i}.pcap")
        return "big"

    def test_interrupted(self):
        folder = self.big_captures(30)
        for number in (signal.SIGINT, signal.SIGTERM):
            for _ in range(10):  # on a busy machine the signal may come too late
                shutil.rmtree(self.dir / "ecaudit-reports", ignore_errors=True)
                with subprocess.Popen([PROGRAM, "batch", folder, "--jobs", "2", "-o", "json=s.json"],
                                      stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=self.dir) as child:
                    self.wait_for_reports(2)
                    asked = time.monotonic()
                    child.send_signal(number)
                    out, err = child.communicate(timeout=60)
                self.assertLess(time.monotonic() - asked, 5)
                if len(self.reports()) < 30:
                    break
            self.assertEqual(child.returncode, 130, err)
            self.assertRegex(err.decode(), r"interrupted, \d+ not checked: go on with --skip-done")
            summary = json.loads((self.dir / "s.json").read_text())["summary"]
            self.assertEqual(summary["captures"] + summary["not_reached"], 30)
            self.assertEqual(summary["verdict"], "incomplete")
            self.assertEqual(len(self.reports()), summary["captures"])
            self.assertIn(b"INCOMPLETE", out)

    def wait_for_reports(self, n, folder="ecaudit-reports"):
        for _ in range(3000):
            path = self.dir / folder
            if path.is_dir() and sum(p.suffix == ".json" for p in path.iterdir()) >= n:
                return
            time.sleep(0.01)
        self.fail("no reports appear")

    def test_killed_and_resumed_gives_the_same(self):
        folder = self.big_captures(20)
        self.file("big/fault.pcap", faulty_capture())
        options, whole = self.outputs("whole")
        self.batch(folder, "--output-dir", "whole", *options, status=1)
        for _ in range(10):  # on a busy machine the kill may come too late
            shutil.rmtree(self.dir / "part", ignore_errors=True)
            with subprocess.Popen([PROGRAM, "batch", folder, "--jobs", "2", "--output-dir", "part"],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=self.dir) as child:
                self.wait_for_reports(3, "part")
                child.kill()
            before = len([n for n in self.reports("part") if n.endswith(".json")])
            if before < 21:
                break
        self.assertLess(before, 21)
        # What a kill leaves in the middle of writing.
        name = next(n for n in self.reports("whole") if n not in self.reports("part"))
        self.file(f"part/{name}.a1B2c3", "{")
        self.file("part/other.json.a1B2c3", "not ours")
        options, resumed = self.outputs("resumed")
        done = self.batch(folder, "--skip-done", "--output-dir", "part", *options, status=1)
        self.assertIn(f"{before} of them done before", done.err)
        (self.dir / "part/other.json.a1B2c3").unlink()
        self.assertEqual(self.reports("part"), self.reports("whole"))
        self.assertEqual(self.contents(resumed), self.contents(whole))


class Fleet(CliTest):
    """Captures of many machines: what they have in common, and a page to look at."""

    def setUp(self):
        super().setUp()
        content = pathlib.Path(self.faulty).read_bytes()
        # The same fault a day later on another machine, a healthy one, and one that cannot be read.
        later = Bus()
        later.time_ns += 86_400 * 10**9
        first = later.time_ns
        bus = faulty_bus(later)
        self.file("in/monday/a.pcap", content)
        # Markup in a name; those of Windows have none of < >.
        self.tuesday = "in/tuesday/&b.pcap" if WINDOWS else "in/tuesday/<b>.pcap"
        self.file(self.tuesday, bus.pcap())
        self.file("in/good.pcap", healthy_capture())
        self.file("in/broken.pcap", b"no capture")
        self.first = first

    def batch(self, *arguments):
        done = self.run_program("batch", *arguments, "in")
        if "built without HTML reports" in done.err:
            self.skipTest("built without HTML reports")
        self.assertIn(done.returncode, (1, 2), done.err)
        return done

    def test_captures_with_the_same_first_cause(self):
        done = self.batch("-o", "json=s.json", "-o", "-")
        causes = json.loads((self.dir / "s.json").read_text())["causes"]
        self.assertEqual(len(causes), 1)
        cause = causes[0]
        self.assertEqual((cause["rule"], cause["captures"]), ("al-illegal-transition", 2))
        self.assertEqual(sorted(cause["paths"]), ["in/monday/a.pcap", self.tuesday])
        self.assertTrue(cause["first_time"].startswith("2019-05-01"))
        self.assertTrue(cause["last_time"].startswith("2019-05-02"))
        text = " ".join(done.out.split())
        self.assertIn("2 captures: error al-illegal-transition: ", text)
        self.assertIn("first seen 2019-05-01, last 2019-05-02", text)
        merged = self.run_program("merge", "-o", "json=m.json", "-o", "-", "ecaudit-reports")
        self.assertEqual(json.loads((self.dir / "m.json").read_text())["causes"], causes)
        self.assertIn("first seen 2019-05-01, last 2019-05-02", " ".join(merged.out.split()))

    def test_pages_and_their_index(self):
        self.batch("-o", "html=pages", "-o", "json=s.json")
        index = (self.dir / "pages" / "index.html").read_text()
        captures = {c["path"]: c for c in json.loads((self.dir / "s.json").read_text())["captures"]}
        links = re.findall(r'<a href="([^"]+)">([^<]+)</a>', index)
        self.assertEqual({html.unescape(text) for _, text in links},
                         {path for path, c in captures.items() if c["status"] != "unreadable"})
        for link, text in links:
            page = (self.dir / "pages" / urllib.parse.unquote(link)).read_text()
            self.assertIn("<!doctype html>", page)
            self.assertEqual(captures[html.unescape(text)]["page"], urllib.parse.unquote(link))
        self.assertIsNone(captures["in/broken.pcap"]["page"])
        self.assertNotIn(pathlib.Path(self.tuesday).name, index)
        self.assertEqual(len(re.findall(r"<tr data-verdict", index)), 4)

    def test_text_and_index_have_one_order(self):
        samples = SOURCE / "samples" / "captures"
        for name in ("no-ethercat", "clean-startup", "mid-run", "coarse-timestamps", "duplicate-address"):
            self.file(f"in/{name}.pcapng", (samples / f"{name}.pcapng").read_bytes())
        self.run_program("batch", "in")
        done = self.run_program("merge", "--quiet", "-o", "-", "-o", "html=all.html", "ecaudit-reports")
        verdicts = [line.split()[0] for line in done.out.splitlines()[1:]]
        rows = re.findall(r'<tr data-verdict="([^"]+)"', (self.dir / "all.html").read_text())
        self.assertEqual([v.lower().replace("error", "unreadable") for v in verdicts], rows, done.out)
        self.assertEqual(rows[0], "fail")
        self.assertEqual(rows[-1], "pass")

    def test_index_is_complete_in_itself(self):
        self.batch("-o", "html=pages")
        index = (self.dir / "pages" / "index.html").read_text()
        policy = re.search(r'Content-Security-Policy" content="([^"]*)"', index)[1]
        self.assertNotIn("unsafe", policy)
        for tag in ("script", "style"):
            texts = re.findall(rf"<{tag}>(.*?)</{tag}>", index, re.S)
            self.assertEqual(len(texts), 1)
            digest = base64.b64encode(hashlib.sha256(texts[0].encode()).digest()).decode()
            self.assertIn(f"{tag}-src 'sha256-{digest}'", policy)
        self.assertEqual(re.findall(r'(?:src|action)="(?!data:)[^"]*"', index), [])

    def test_pages_that_are_there_are_kept(self):
        self.batch("-o", "html=pages")
        done = self.batch("--skip-done", "-o", "html=pages")
        self.assertIn("3 of them done before", done.err)
        for page in (self.dir / "pages").glob("a.pcap*.html"):
            page.unlink()
        self.assertIn("2 of them done before", self.batch("--skip-done", "-o", "html=pages").err)
        self.assertEqual(len(list((self.dir / "pages").glob("a.pcap*.html"))), 1)

    def test_merge_makes_an_index(self):
        self.batch("-o", "html=pages")
        self.run_program("merge", "-o", "html=all.html", "ecaudit-reports")
        index = (self.dir / "all.html").read_text()
        self.assertEqual(len(re.findall(r"<tr data-verdict", index)), 4)
        self.assertEqual(re.findall(r"<a href", index), [])


class SkipDone(BatchTest):
    def done_before(self, *arguments, status=1):
        """How many reports a second run with these arguments keeps."""
        err = self.batch("--skip-done", *arguments, status=status).err
        match = re.search(r"(\d+) of them done before", err)
        return int(match[1]) if match else 0

    def test_done_reports_are_kept(self):
        first = self.batch("in", status=1).out
        reports = self.reports()
        times = {p.name: p.stat().st_mtime_ns for p in (self.dir / "ecaudit-reports").iterdir()}
        self.assertEqual(self.batch("in", "--skip-done", status=1).out, first)
        self.assertEqual(self.done_before("in"), 3)
        self.assertEqual(times, {p.name: p.stat().st_mtime_ns for p in (self.dir / "ecaudit-reports").iterdir()})
        self.assertEqual(self.reports(), reports)

    def test_without_the_option_all_is_done_anew(self):
        self.batch("in", status=1)
        self.assertNotIn("done before", self.batch("in", status=1).err)

    def test_new_captures_are_added(self):
        self.batch("in", status=1)
        self.file("in/new.pcap", healthy_capture())
        self.assertEqual(self.done_before("in"), 3)
        self.assertEqual(len(self.reports()), 4)

    def test_changed_capture_is_done_anew(self):
        self.batch("in", status=1)
        path = self.dir / "in/a/good.pcap"
        stamp = path.stat()
        self.file("in/a/good.pcap", faulty_capture())  # another size
        self.assertEqual(self.done_before("in"), 2)
        os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns + 1))  # the same size, another time
        self.assertEqual(self.done_before("in"), 2)
        self.assertEqual(self.done_before("in"), 3)

    def test_other_settings_are_done_anew(self):
        self.file("known.json", '{"schema": "ecaudit.baseline/1", "findings": []}')
        for options in (["--rule=al-refused=warning"], ["--fail-on=warning"], ["--profile=generic"], ["--slave=0"],
                        ["--profile=0=generic"], ["--parameter=PTBASE=8"],
                        ["--parameter=0:PTBASE=8"], ["--from=#2"], ["--to=100"], ["--baseline=known.json"]):
            self.batch("in", status=1)
            self.assertEqual(self.done_before("in", *options), 0, options)
            self.assertEqual(self.done_before("in", *options), 3, options)

    def test_content_of_named_files_counts(self):
        self.file("known.json", '{"schema": "ecaudit.baseline/1", "findings": []}')
        self.batch("in", "--baseline=known.json", status=1)
        self.batch("in", "--output-dir=x", "--write-baseline=known.json", status=1)
        self.assertEqual(self.done_before("in", "--baseline=known.json", status=0), 0)
        self.file(".ecaudit.json", "{}")
        self.assertEqual(self.done_before("in", "--baseline=known.json", status=0), 0)
        self.file(".ecaudit.json", '{"limits": {"al-timeout.down": 1}}')
        self.assertEqual(self.done_before("in", "--baseline=known.json", status=0), 0)
        self.assertEqual(self.done_before("in", "--baseline=known.json", status=0), 3)

    def test_what_is_no_whole_report_is_done_anew(self):
        self.batch("in", status=1)
        whole = self.reports()
        name = next(n for n in whole if n.startswith("good"))
        text = whole[name].decode()
        other = next(n for n in whole if n.startswith("trace"))
        damaged = ["", "{", text[:-20], "{}", "[]", "3", text.replace("ecaudit.report/1", "ecaudit.report/2"),
                   text.replace('"version": "', '"version": "9'), text.replace('"findings"', '"finding"'),
                   text.replace('"known": 0', '"known": 0').replace('"complete": true', '"complete": "yes"'),
                   whole[other].decode()]
        for content in damaged:
            self.assertNotEqual(content, text)
            self.file(f"ecaudit-reports/{name}", content)
            self.assertEqual(self.done_before("in"), 2, content[:100])
            self.assertEqual(self.reports(), whole)

    def test_unreadable_captures_are_tried_again(self):
        self.file("in/late.pcap", b"")
        self.batch("in", status=2)
        self.assertEqual(self.done_before("in", status=2), 3)
        self.file("in/late.pcap", healthy_capture())
        self.assertEqual(self.done_before("in"), 3)
        self.assertEqual(self.done_before("in"), 4)


class BatchSlaves(BatchTest):
    def test_slaves_that_are_not_there(self):
        for _ in range(2):  # the second time from the reports
            done = self.run_program("batch", "--skip-done", "--slave", "9", "in/a")
            self.assertEqual((done.returncode, done.out), (2, ""), done.err)
            self.assertIn("has none of the slaves of --slave", done.err)
            self.assertIn("no capture has a slave of --slave", done.err)
        done = self.batch("--slave", "0", "--slave", "9", "in/b", status=0)
        self.assertIn("has no slave 9", done.err)
        done = self.batch("--profile", "4=generic", "--parameter", "4:PTBASE=1", "in/b", status=0)
        self.assertIn("has no slave 4: the profile and the parameters given for it are not used", done.err)


class Merge(BatchTest):
    def test_the_same_as_the_batch(self):
        self.file("in/a/broken.pcap", b"this is no capture at all")
        self.file("in/b/foreign.pcap", foreign_capture())
        options, batch = self.outputs("batch")
        first = self.batch("in", *options, status=2)
        options, merged = self.outputs("merged")
        for paths in (["ecaudit-reports"], ["ecaudit-reports/*.json"], sorted(map(str, (
                self.dir / "ecaudit-reports").iterdir()), reverse=True)):
            again = self.merge(*paths, *options, status=2)
            self.assertEqual(again.out, first.out)
            self.assertEqual(self.contents(merged), self.contents(batch))

    def test_reports_of_check(self):
        self.run_program("check", "-o", "json=one.json", "in/a/good.pcap", "in/a/trace.pcap", "nowhere.pcap")
        self.run_program("check", "-o", "json=two.json", "in/b/trace.pcap")
        document = json.loads(self.merge("one.json", "two.json", "--format", "json", status=2).out)
        self.assertEqual([c["path"] for c in document["captures"]],
                         ["in/a/good.pcap", "in/a/trace.pcap", "in/b/trace.pcap", "nowhere.pcap"])
        self.assertEqual([c["report"] for c in document["captures"]], ["one.json", "one.json", "two.json", "one.json"])

    def test_a_capture_told_twice(self):
        self.run_program("check", "-o", "json=one.json", "in/a/trace.pcap")
        self.run_program("check", "-o", "json=two.json", "in/a/trace.pcap", "in/b/trace.pcap")
        done = self.merge("one.json", "two.json", "--format", "json", status=1)
        self.assertEqual(len(json.loads(done.out)["captures"]), 2)
        self.assertIn("in/a/trace.pcap has the same result in one.json and two.json: counted once", done.err)
        # Judged in another way it is another result.
        self.run_program("check", "-o", "json=three.json", "--rule", "al-refused=off", "in/a/trace.pcap")
        done = self.merge("one.json", "three.json", "--format", "json", status=1)
        self.assertEqual(len(json.loads(done.out)["captures"]), 2)

    def test_parts_make_the_whole(self):
        options, whole = self.outputs("whole")
        self.batch("in", *options, status=1)
        self.batch("in/a", "--output-dir", "host1", status=1)
        self.batch("in/b", "--output-dir", "host2", status=0)
        options, merged = self.outputs("merged")
        self.merge("host2", "host1", *options, status=1)
        self.assertEqual(self.contents(merged), self.contents(whole))

    def test_fail_on(self):
        self.batch("in", status=1)
        self.merge("ecaudit-reports", "--fail-on", "never", status=0)
        self.assertIn("--fail-on is 'x'", self.one_error("merge", "ecaudit-reports", "--fail-on", "x"))

    def test_baseline(self):
        self.batch("in", "--write-baseline", "known.json", status=1)
        self.merge("ecaudit-reports", "--write-baseline", "merged.json", status=1)
        self.assertEqual((self.dir / "merged.json").read_bytes(), (self.dir / "known.json").read_bytes())
        done = self.merge("ecaudit-reports", "--baseline", "known.json", status=0)
        self.assertIn("known from the baseline", done.out)
        self.assertIn("no such file", self.one_error("merge", "ecaudit-reports", "--baseline", "none.json"))

    def test_other_documents(self):
        self.batch("in", "-o", "json=ecaudit-reports/summary.json", status=1)
        done = self.merge("ecaudit-reports", status=1)
        self.assertIn("is a summary, not a report", done.err)
        self.assertTrue(done.out.startswith("FAIL 3 captures"))
        for content, message in (("{", "x.json:1:2: not valid JSON"), ("{}", "not a report of ecaudit"),
                                 ("[]", "not a report of ecaudit"),
                                 ('{"schema": "ecaudit.report/2"}', "another version of the report, ecaudit.report/2"),
                                 ('{"schema": "ecaudit.baseline/1"}', "no report but ecaudit.baseline/1"),
                                 ('{"schema": "ecaudit.report/1"}', "not a complete report"),
                                 ('{"schema": "ecaudit.report/1", "tool": {"version": "0"}, "reports": [{}]}',
                                  "not a complete report")):
            self.file("x.json", content)
            self.assertIn(message, self.one_error("merge", "ecaudit-reports/*.pcap-*.json", "x.json"))
        self.assertIn("no such file", self.one_error("merge", "none.json"))
        self.assertIn("no report in in", self.one_error("merge", "in"))
        self.assertIn("no REPORT given", self.one_error("merge"))

    def test_every_field_that_is_read_may_be_wrong(self):
        # Reports are input: whatever stands in them, there is one line and no crash.
        self.batch("in/a/trace.pcap", status=1)
        (content,) = self.reports().values()
        document = json.loads(content)

        def walk(node, path):
            for key, value in list(node.items()) if isinstance(node, dict) else list(enumerate(node)):
                yield path + [key]
                if isinstance(value, (dict, list)):
                    yield from walk(value, path + [key])

        paths = [p for p in walk(document, []) if p[:1] in (["tool"], ["made_from"], ["unreadable"]) or
                 p[:1] == ["reports"] and (len(p) < 4 or p[2] in ("capture", "settings", "findings", "not_evaluable", "required") and
                                           (len(p) < 5 or p[3] == 0))]
        self.assertGreater(len(paths), 60)
        for path in paths:
            for wrong in (None, -1, 1e300, "\x00\u009b", [], {"x": 1}, [[1]], True):
                broken = json.loads(content)
                at = broken
                for key in path[:-1]:
                    at = at[key]
                at[path[-1]] = wrong
                self.file("x.json", json.dumps(broken))
                done = self.run_program("merge", "x.json")
                self.assertIn(done.returncode, (0, 1, 2), (path, wrong, done.err))
                if done.returncode == 2 and not done.out:
                    self.assertEqual(done.err.count("\n"), 1, (path, wrong, done.err))
                if len(path) > 5:
                    break

    def test_reports_of_another_version_of_the_program(self):
        self.batch("in", status=1)
        (name, content), *_ = self.reports().items()
        self.file(f"ecaudit-reports/{name}", content.replace(b'"version": "', b'"version": "9.'))
        self.assertRegex(self.merge("ecaudit-reports", status=1).err, r"made by ecaudit [0-9.]+, 9\.[0-9.]+, this is")

    def test_reports_before_the_program_recorded_rules_and_unreadable_captures(self):
        self.batch("in", status=1)
        before = self.merge("ecaudit-reports", status=1).out
        for name, content in self.reports().items():
            document = json.loads(content)
            del document["made_from"], document["unreadable"], document["reports"][0]["settings"]["rules"]
            self.file(f"ecaudit-reports/{name}", json.dumps(document))
        self.assertEqual(self.merge("ecaudit-reports", status=1).out, before)


class OverEverything(BatchTest):
    """Over everything there is."""

    def setUp(self):
        super().setUp()
        self.folders = [p for p in (SOURCE / "samples", SHARED / "captures") if p.is_dir()]


class BatchCaptures(OverEverything):
    def test_workers_resumption_and_merging_change_nothing(self):
        first_options, first = self.outputs("first")
        done = self.run_program("batch", *self.folders, "--jobs", "1", "--output-dir", "first", *first_options)
        self.assertIn(done.returncode, (1, 2), done.err)
        second_options, second = self.outputs("second")
        self.run_program("batch", *self.folders, "--jobs", "2", "--output-dir", "second", *second_options)
        self.assertEqual(self.reports("second"), self.reports("first"))
        self.assertEqual(self.contents(second), self.contents(first))
        # Some of the reports are lost.
        for name in list(self.reports("second"))[::3]:
            (self.dir / "second" / name).unlink()
        again = self.run_program("batch", *self.folders, "--skip-done", "--output-dir", "second", *second_options)
        self.assertIn("of them done before", again.err)
        self.assertEqual(self.reports("second"), self.reports("first"))
        self.assertEqual(self.contents(second), self.contents(first))
        # What is read back from the reports is what the analysis gave.
        merged_options, merged = self.outputs("merged")
        self.run_program("merge", "first", *merged_options)
        self.assertEqual(self.contents(merged), self.contents(first))
        if shutil.which("xmllint") is not None:
            checked = subprocess.run(["xmllint", "--noout", "--schema", JUNIT_SCHEMA, self.dir / "first.xml"],
                                     capture_output=True, text=True)
            self.assertEqual(checked.returncode, 0, checked.stderr)
        self.assertEqual(sarif_errors(json.loads((self.dir / "first.sarif").read_text())), [])

    def test_summary_is_valid(self):
        summary = self.summary(*self.folders, status=2 if SHARED.is_dir() else 1)
        counted = summary["summary"]
        self.assertEqual(counted["captures"], len(summary["captures"]))
        self.assertEqual(counted["captures"], counted["passed"] + counted["limited"] + counted["failed"] +
                         counted["unreadable"] + counted["nothing_to_check"])
        for severity in ("error", "warning", "info"):
            self.assertEqual(counted[severity + "s"], sum(c[severity + "s"] for c in summary["captures"]))
        for rule in summary["rules"]:
            with_rule = [c for c in summary["captures"] if rule["rule"] in {f["rule"] for f in c["findings"]}]
            self.assertEqual(rule["captures"], len(with_rule))

    def whole_batch(self):
        """One batch over the samples, for comparison, and captures.txt that lists them."""
        folder = SOURCE / "samples" / "captures"
        options, whole = self.outputs("whole")
        self.run_program("batch", folder, "--output-dir", "whole", *options)
        captures = sorted(str(p) for p in folder.iterdir() if p.suffix in (".pcap", ".pcapng"))
        self.file("captures.txt", "\n".join(captures) + "\n")
        return whole

    def merged_like(self, whole):
        options, merged = self.outputs("merged")
        self.run_program("merge", "reports", *options)
        self.assertEqual(self.reports("reports"), self.reports("whole"))
        self.assertEqual(self.contents(merged), self.contents(whole))

    def test_the_recipe_of_an_array_of_jobs(self):
        # docs/batch.md, what each task of the Slurm array runs.
        whole = self.whole_batch()
        task = """awk -v n=3 -v i="$SLURM_ARRAY_TASK_ID" 'NR % n == i' captures.txt |
                  xargs -d '\\n' "$ECAUDIT" batch --jobs "$SLURM_CPUS_PER_TASK" --skip-done --output-dir reports -o /dev/null
                  [ $? -le 123 ]"""
        for i in range(3):
            done = subprocess.run(["bash", "-c", task], cwd=self.dir, capture_output=True, text=True,
                                  env=os.environ | {"SLURM_ARRAY_TASK_ID": str(i), "SLURM_CPUS_PER_TASK": "2",
                                                    "ECAUDIT": PROGRAM})
            self.assertEqual(done.returncode, 0, done.stderr)
        self.merged_like(whole)

    @unittest.skipIf(shutil.which("parallel") is None, "GNU parallel is not installed")
    def test_the_recipe_with_gnu_parallel(self):
        # docs/batch.md. Two "hosts" that are this machine (":"), as no other is at hand in a test.
        whole = self.whole_batch()
        spread = subprocess.run(
            ["parallel", "--will-cite", "--sshlogin", "1/:,1/:", "--workdir", self.dir, "-N", "8", "-a", "captures.txt",
             f"{PROGRAM} batch --jobs 1 --skip-done --output-dir reports -o /dev/null {{}} || [ $? -eq 1 ]"],
            cwd=self.dir, capture_output=True, text=True, timeout=300, env=os.environ | {"HOME": str(self.dir)})
        self.assertEqual(spread.returncode, 0, spread.stderr)
        self.merged_like(whole)
