"""JUnit XML and SARIF 2.1.0 as CI servers read them."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import unittest
import xml.etree.ElementTree as ET

from support import SHARED, SOURCE, WINDOWS, CliTest, foreign_capture, healthy_capture

try:
    import jsonschema
except ImportError:
    jsonschema = None

JUNIT_SCHEMA = pathlib.Path(__file__).resolve().parent / "junit.xsd"
# tests/support/sarif_schema.sh brings it; the schema of OASIS is not ours to ship.
SARIF_SCHEMA = pathlib.Path(os.environ.get("SARIF_SCHEMA", SOURCE / "build" / "sarif-schema" / "sarif-2.1.0.json"))


def sarif_errors(document):
    """What the schema of SARIF 2.1.0 objects to; nothing when the schema is not here."""
    if jsonschema is None or not SARIF_SCHEMA.is_file():
        return []
    schema = json.loads(SARIF_SCHEMA.read_text())
    validator = jsonschema.validators.validator_for(schema)(schema)
    return [f"{'/'.join(map(str, e.absolute_path))}: {e.message[:200]}" for e in validator.iter_errors(document)]


class Junit(CliTest):
    def junit(self, *arguments, status):
        return ET.fromstring(self.check("--format", "junit", *arguments, status=status).out)

    def validate(self, *arguments):
        if shutil.which("xmllint") is None:
            self.skipTest("xmllint is not installed")
        path = self.dir / "report.xml"
        self.run_program("check", *arguments, "-o", f"junit={path}")
        done = subprocess.run(["xmllint", "--noout", "--schema", JUNIT_SCHEMA, path], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return ET.parse(path).getroot()

    def rules(self):
        return {r["id"] for r in json.loads(self.run_program("rules", "--format", "json").out)["rules"]}

    def test_ending_names_the_format(self):
        self.check(self.faulty, "-o", "out.xml", status=1)
        self.assertEqual(ET.parse(self.dir / "out.xml").getroot().tag, "testsuites")

    def test_one_suite_a_capture_one_case_a_rule(self):
        root = self.junit(self.healthy, self.faulty, status=1)
        self.assertEqual([s.get("name") for s in root], [self.healthy, self.faulty])
        for suite in root:
            names = [case.get("name").split(",")[0] for case in suite.findall("testcase")]
            self.assertEqual(set(names), self.rules())
        self.assertEqual(root[0].get("failures"), "0")
        self.assertGreater(int(root[1].get("failures")), 0)

    def test_failures_are_the_findings_that_count(self):
        for fail_on, counting in (("error", {"error"}), ("warning", {"error", "warning"}), ("never", set())):
            status = 0 if fail_on == "never" else 1
            findings = self.report(self.faulty, "--fail-on", fail_on, status=status)["reports"][0]["findings"]
            expected = {(f["rule"], f["slave"]) for f in findings if f["severity"] in counting}
            suite = self.junit(self.faulty, "--fail-on", fail_on, status=status)[0]
            failed = [c for c in suite.findall("testcase") if c.find("failure") is not None]
            self.assertEqual(len(failed), len(expected))
            for rule, slave in expected:
                place = "bus" if slave is None else f"slave {slave} (0x1001)"
                case = [c for c in failed if c.get("name") == f"{rule}, {place}"]
                self.assertEqual(len(case), 1, rule)
                finding = next(f for f in findings if (f["rule"], f["slave"]) == (rule, slave))
                failure = case[0].find("failure")
                self.assertIn(finding["title"], failure.get("message"))
                self.assertIn(f"frame {finding['frame']}", failure.get("message"))
                self.assertIn(finding["wireshark_filter"], failure.text)
                self.assertIn(f"ecaudit explain {rule}", failure.text)

    def test_what_could_not_be_judged_is_skipped_with_the_reason(self):
        report = self.report(self.healthy, status=0)["reports"][0]
        suite = self.junit(self.healthy, status=0)[0]
        skipped = {c.get("name"): c.find("skipped") for c in suite.findall("testcase") if c.find("skipped") is not None}
        nothing = {r["rule"] for r in report["coverage"]["rules"] if r["judged"] + r["partly"] + r["not_judged"] == 0}
        self.assertEqual(set(skipped), {n["rule"] for n in report["not_evaluable"]} | nothing)
        for entry in report["not_evaluable"]:
            self.assertIn(entry["reason"], skipped[entry["rule"]].text)
        self.assertEqual(int(suite.get("skipped")), len(skipped))

    def test_rule_switched_off_is_skipped(self):
        suite = self.junit(self.faulty, "--rule=al-refused=off", "--fail-on=never", status=0)[0]
        case = [c for c in suite.findall("testcase") if c.get("name") == "al-refused"]
        self.assertEqual(len(case), 1)
        self.assertIn("switched off", case[0].find("skipped").get("message"))

    def test_known_findings_are_told_but_do_not_fail(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        suite = self.junit(self.faulty, "--baseline", "known.json", status=0)[0]
        self.assertEqual(suite.get("failures"), "0")
        self.assertIn("known error al-refused", suite.find("system-out").text)

    def test_unreadable_capture_is_an_error(self):
        root = self.junit("nowhere.pcap", self.healthy, status=2)
        suite = [s for s in root if s.get("name") == "nowhere.pcap"][0]
        self.assertEqual(suite.get("errors"), "1")
        self.assertIn("no such file", suite.find("testcase/error").get("message"))
        self.assertEqual(root.get("errors"), "1")

    def test_capture_without_ethercat_is_skipped(self):
        suite = self.junit(self.file("foreign.pcap", foreign_capture()), status=0)[0]
        self.assertEqual(suite.get("tests"), "1")
        self.assertIn("no EtherCAT frame", suite.find("testcase/skipped").get("message"))

    def test_names_do_not_depend_on_the_capture(self):
        # A CI server follows a test case by class and name.
        self.file("a/x.pcap", healthy_capture())
        names = [c.get("classname") + ":" + c.get("name") for c in self.junit("a/x.pcap", status=0)[0].iter("testcase")]
        self.assertTrue(all(n.startswith("a.x_pcap:") for n in names), names)
        self.assertEqual(len(names), len(set(names)))

    def test_totals_add_up(self):
        root = self.junit(self.healthy, self.faulty, "nowhere.pcap", status=2)
        for suite in root:
            cases = suite.findall("testcase")
            self.assertEqual(int(suite.get("tests")), len(cases))
            for attribute, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
                self.assertEqual(int(suite.get(attribute)), sum(c.find(tag) is not None for c in cases))
        for attribute in ("tests", "failures", "errors"):
            self.assertEqual(int(root.get(attribute)), sum(int(s.get(attribute)) for s in root))

    def test_valid(self):
        foreign = self.file("foreign.pcap", foreign_capture())
        self.validate(self.healthy, self.faulty, foreign, "nowhere.pcap", "--fail-on", "info")

    def test_markup_and_control_characters_in_names(self):
        path = self.file("a&b <\"'\x1b\x01\xff>.pcap", healthy_capture())
        root = self.validate(path)
        self.assertIn("a&b <\"'\\x1b\\x01", root[0].get("name"))

    def test_valid_for_all_captures(self):
        captures = sorted(p for folder in (SOURCE / "samples", SHARED / "captures") for p in folder.rglob("*")
                          if p.suffix in (".pcap", ".pcapng"))
        self.validate(*captures, "--fail-on", "info")


class LineTest(CliTest):
    lines = {}

    def assert_line_of_frame(self, capture, line, frame):
        """`line` of the text of decode is the first one of `frame`, or where it would stand."""
        if capture not in self.lines:
            out = self.run_program("decode", capture).out.splitlines()
            self.lines = {**self.lines, capture: [0] + [int(l.split()[0].split(".")[0]) for l in out[1:]]}
        frames = self.lines[capture]
        if line <= len(frames):
            self.assertGreaterEqual(frames[line - 1], frame, (capture, line, frame))
        self.assertTrue(all(f < frame for f in frames[1:line - 1]), (capture, line, frame))


class Gitlab(LineTest):
    def quality(self, *arguments, status):
        entries = json.loads(self.check("--format", "gitlab", *arguments, status=status).out)
        # What GitLab requires of a code quality report.
        for entry in entries:
            self.assertTrue(entry["description"])
            self.assertTrue(entry["check_name"])
            self.assertIn(entry["severity"], ("info", "minor", "major", "critical", "blocker"))
            self.assertFalse(entry["location"]["path"].startswith("./"))
            self.assertGreaterEqual(entry["location"]["lines"]["begin"], 1)
        prints = [entry["fingerprint"] for entry in entries]
        self.assertEqual(len(prints), len(set(prints)))
        return entries

    def test_entries_are_the_findings(self):
        findings = self.report(self.faulty, status=1)["reports"][0]["findings"]
        entries = self.quality(self.faulty, status=1)
        self.assertEqual([e["check_name"] for e in entries], [f["rule"] for f in findings])
        for entry, finding in zip(entries, findings):
            self.assertIn(finding["title"], entry["description"])
            self.assertEqual(entry["location"]["path"], "faulty.pcap")
            self.assert_line_of_frame(self.faulty, entry["location"]["lines"]["begin"], finding["frame"])
        self.assertEqual([e["fingerprint"] for e in entries],
                         [e["fingerprint"] for e in self.quality("./faulty.pcap", status=1)])

    def test_known_ones_are_left_out_and_the_rest_is_told(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        self.assertEqual(self.quality(self.faulty, "--baseline", "known.json", status=0), [])
        self.assertEqual(self.quality(self.healthy, status=0), [])
        entries = self.quality("nowhere.pcap", self.healthy, "--require=slaves=2", status=2)
        self.assertEqual({(e["check_name"], e["severity"]) for e in entries},
                         {("capture-unreadable", "blocker"), ("requirement", "blocker")})

    def test_of_a_batch_and_of_its_reports(self):
        capture = SOURCE / "samples" / "captures" / "falls-out-of-op.pcapng"
        self.run_program("batch", "-o", "gitlab=a.json", capture)
        self.run_program("merge", "-o", "gitlab=b.json", "ecaudit-reports")
        entries = json.loads((self.dir / "a.json").read_text())
        self.assertGreater(entries[0]["location"]["lines"]["begin"], 1)
        self.assertEqual(entries, json.loads((self.dir / "b.json").read_text()))

    def test_reports_of_a_batch_hold_the_lines(self):
        capture = SOURCE / "samples" / "captures" / "falls-out-of-op.pcapng"
        self.run_program("batch", capture)
        done = self.run_program("batch", "--skip-done", "-o", "gitlab=a.json", capture)
        self.assertIn("1 of them done before", done.err)
        self.assertGreater(json.loads((self.dir / "a.json").read_text())[0]["location"]["lines"]["begin"], 1)


class Github(LineTest):
    def test_annotations(self):
        findings = self.report(self.faulty, status=1)["reports"][0]["findings"]
        lines = self.check("--format", "github", self.faulty, status=1).out.splitlines()
        self.assertEqual(len(lines), len(findings))
        for line, finding in zip(lines, findings):
            found = re.fullmatch(r"::(error|warning|notice) file=([^,:]+),line=(\d+),title=([^,:]+)::(.*)", line)
            self.assertIsNotNone(found, line)
            self.assertEqual(found[1], {"info": "notice"}.get(finding["severity"], finding["severity"]))
            self.assertEqual((found[2], found[4]), ("faulty.pcap", finding["rule"]))
            self.assertIn(finding["title"], found[5])
            self.assert_line_of_frame(self.faulty, int(found[3]), finding["frame"])

    def test_what_ends_a_property_is_escaped(self):
        self.file("a,b:c%d.pcap", pathlib.Path(self.faulty).read_bytes())
        out = self.check("--format", "github", "a,b:c%d.pcap", "--require=state=OP", status=1).out
        for line in out.splitlines():
            self.assertIn(" file=a%2Cb%3Ac%25d.pcap,", line)
        self.assertIn("title=required and missing::state=OP", out)
        self.assertTrue(self.check("--format", "github", "nowhere.pcap", status=2).err)

    def test_nothing_to_tell(self):
        self.assertEqual(self.check("--format", "github", self.healthy, status=0).out, "")


class Markdown(CliTest):
    def markdown(self, *arguments, status) -> str:
        return self.check("--format", "markdown", *arguments, status=status).out

    def rows(self, text) -> list:
        return [re.split(r"(?<!\\) \| |^\| | \|$", line)[1:-1] for line in text.splitlines()
                if line.startswith("| ") and not line.startswith("|  |")]

    def test_findings_in_a_table(self):
        findings = self.report(self.faulty, status=1)["reports"][0]["findings"]
        text = self.markdown(self.faulty, status=1)
        self.assertTrue(text.startswith("## FAIL: "), text)
        rows = [row for row in self.rows(text) if row[0] != ""]
        self.assertEqual(sorted(row[1].lstrip("↳ ").strip("`") for row in rows[-len(findings):]),
                         sorted(f["rule"] for f in findings))
        first = next(f for f in findings if f["severity"] == "error")
        self.assertIn(f"| {first['frame']} (", text)
        self.assertIn("<br>do: ", text)
        self.assertTrue(text.endswith("\necaudit 0.1.0\n"), text)

    def test_ending_and_summary(self):
        self.check(self.healthy, self.faulty, "nowhere.pcap", "-o", "a.md", status=2)
        text = (self.dir / "a.md").read_text()
        self.assertTrue(text.startswith("## ecaudit: 3 captures, "), text)
        for start in ("| PASS | ", "| FAIL | ", "| ERROR | nowhere.pcap | no such file", "### FAIL: "):
            self.assertIn(start, text)
        self.assertNotIn("### PASS", text)
        done = self.run_program("batch", "--format", "markdown", self.healthy, self.faulty)
        self.assertIn("## ecaudit: 2 captures", done.out)

    def test_what_a_device_says_is_no_markup(self):
        # Names of Windows have none of | < > *.
        name = "a`c[x](y)d_e.pcap" if WINDOWS else "a|b`c<img>[x](y)*d_e.pcap"
        self.file(name, pathlib.Path(self.faulty).read_bytes())
        text = self.markdown(name, status=1)
        self.assertNotIn("<img>", text)
        self.assertIn(r"a\`c\[x\](y)d\_e.pcap" if WINDOWS else r"a\|b\`c\<img\>\[x\](y)\*d\_e.pcap", text)

    def test_known_findings_are_counted(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        text = self.markdown(self.faulty, "--baseline", "known.json", status=0)
        self.assertTrue(text.startswith("## PASS: "), text)
        self.assertIn("known from the baseline.", text)
        self.assertNotIn("`al-refused`", text)


class Sarif(LineTest):
    def sarif(self, *arguments, status):
        document = json.loads(self.check("--format", "sarif", *arguments, status=status).out)
        self.assertEqual(sarif_errors(document), [])
        self.assertEqual(document["version"], "2.1.0")
        self.assertEqual(len(document["runs"]), 1)
        return document["runs"][0]

    def test_ending_names_the_format(self):
        self.check(self.faulty, "-o", "out.sarif", status=1)
        self.assertEqual(json.loads((self.dir / "out.sarif").read_text())["version"], "2.1.0")

    def test_results_are_the_findings(self):
        findings = self.report(self.faulty, status=1)["reports"][0]["findings"]
        run = self.sarif(self.faulty, status=1)
        self.assertEqual([r["ruleId"] for r in run["results"]], [f["rule"] for f in findings])
        for result, finding in zip(run["results"], findings):
            rule = run["tool"]["driver"]["rules"][result["ruleIndex"]]
            self.assertEqual(rule["id"], finding["rule"])
            self.assertEqual(result["level"], {"info": "note"}.get(finding["severity"], finding["severity"]))
            self.assertIn(finding["title"], result["message"]["text"])
            location = result["locations"][0]
            artifact = location["physicalLocation"]["artifactLocation"]
            self.assertEqual(run["artifacts"][artifact["index"]]["location"]["uri"], artifact["uri"])
            self.assertEqual(artifact["uri"], "faulty.pcap")
            self.assert_line_of_frame(self.faulty, location["physicalLocation"]["region"]["startLine"], finding["frame"])
            self.assertEqual(location["logicalLocations"][0]["name"],
                             "bus" if finding["slave"] is None else f"slave {finding['slave']}")
            self.assertEqual(result["properties"]["frame"], finding["frame"])
            self.assertEqual(result["properties"]["count"], finding["count"])

    def test_lines_of_what_cannot_be_read_twice(self):
        lines = lambda run: [r["locations"][0]["physicalLocation"]["region"]["startLine"] for r in run["results"]]
        wanted = lines(self.sarif(self.faulty, status=1))
        self.assertGreater(max(wanted), 1)
        done = self.check("--format", "sarif", "-", status=1, input=pathlib.Path(self.faulty).read_bytes())
        self.assertEqual(lines(json.loads(done.out)["runs"][0]), wanted)

    def test_each_result_has_a_line(self):
        # GitHub wants a region of each result (rule GH1003), and shows what has the path of a file in the project.
        shutil.copytree(SOURCE / "samples" / "captures", self.dir / "captures")
        names = [f"captures/{name}.pcapng" for name in ("falls-out-of-op", "malformed", "esl-probe", "snaplen",
                                                        "two-slaves-one-refuses", "foreign-traffic", "two-interfaces")]
        run = self.sarif("--fail-on=never", *names, status=0)
        self.assertGreater(len(run["results"]), 5)
        for result in run["results"]:
            physical = result["locations"][0]["physicalLocation"]
            self.assertIn(physical["artifactLocation"]["uri"], names)
            self.assertGreaterEqual(physical["region"]["startLine"], 1)
            if "frame" in result["properties"]:
                self.assert_line_of_frame(physical["artifactLocation"]["uri"], physical["region"]["startLine"],
                                          result["properties"]["frame"])
        for rule in run["tool"]["driver"]["rules"]:
            self.assertIn("ecaudit decode CAPTURE", rule["help"]["markdown"])

    def test_rules_are_the_catalogue_with_help(self):
        rules = self.sarif(self.healthy, status=0)["tool"]["driver"]["rules"]
        catalogue = json.loads(self.run_program("rules", "--format", "json").out)["rules"]
        self.assertEqual([r["id"] for r in rules], [r["id"] for r in catalogue])
        for rule in rules:
            self.assertIn("What it checks", rule["help"]["markdown"])
            self.assertIn(rule["defaultConfiguration"]["level"], ("error", "warning", "note"))

    def test_fingerprints_are_stable_and_distinct(self):
        first = self.sarif(self.faulty, status=1)["results"]
        again = self.sarif(self.file("other/name.pcap", pathlib.Path(self.faulty).read_bytes()), status=1)["results"]
        prints = [r["partialFingerprints"]["ecauditFinding/v1"] for r in first]
        self.assertEqual(prints, [r["partialFingerprints"]["ecauditFinding/v1"] for r in again])
        self.assertEqual(len(prints), len(set(prints)))
        for text in prints:
            self.assertRegex(text, r"^[0-9a-f]{16}:[1-9][0-9]*$")

    def test_known_findings_are_suppressed(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        results = self.sarif(self.faulty, "--baseline", "known.json", status=0)["results"]
        self.assertTrue(results)
        for result in results:
            self.assertEqual(result["suppressions"][0]["kind"], "external")
            self.assertIn("known.json", result["suppressions"][0]["justification"])
        self.assertFalse(any("suppressions" in r for r in self.sarif(self.faulty, status=1)["results"]))

    def test_what_could_not_be_judged_is_a_notification(self):
        missing = self.report(self.healthy, status=0)["reports"][0]["not_evaluable"]
        invocation = self.sarif(self.healthy, status=0)["invocations"][0]
        self.assertTrue(invocation["executionSuccessful"])
        notes = [n for n in invocation["toolExecutionNotifications"] if n["level"] == "note"]
        self.assertEqual([n["associatedRule"]["id"] for n in notes], [n["rule"] for n in missing])

    def test_unreadable_capture(self):
        invocation = self.sarif("nowhere.pcap", self.healthy, status=2)["invocations"][0]
        self.assertFalse(invocation["executionSuccessful"])
        errors = [n for n in invocation["toolExecutionNotifications"] if n["level"] == "error"]
        self.assertEqual(len(errors), 1)
        self.assertIn("no such file", errors[0]["message"]["text"])

    def test_the_same_capture_twice_is_one_artifact(self):
        self.assertEqual(len(self.sarif(self.faulty, self.faulty, status=1)["artifacts"]), 1)

    def test_uris(self):
        uris = {}
        for name in ("plain.pcap", "with space#1.pcap", "sub/a%b{c}.pcap"):
            self.file(name, pathlib.Path(self.faulty).read_bytes())
            run = self.sarif(name, status=1)
            uris[name] = run["artifacts"][0]["location"]["uri"]
            for uri in re.findall(r'"uri": "([^"]*)"', json.dumps(run)):
                self.assertRegex(uri, r"^(file://)?([A-Za-z0-9._~/-]|%[0-9A-F]{2})+$")
        self.assertEqual(uris["plain.pcap"], "plain.pcap")
        self.assertEqual(uris["with space#1.pcap"], "with%20space%231.pcap")
        self.assertEqual(uris["sub/a%b{c}.pcap"], "sub/a%25b%7Bc%7D.pcap")
        # What lies elsewhere keeps its whole path.
        elsewhere = self.sarif(SOURCE / "samples" / "captures" / "init-to-op-refused.pcapng", status=1)
        self.assertTrue(elsewhere["artifacts"][0]["location"]["uri"].startswith("file:///"))

    @unittest.skipUnless(SARIF_SCHEMA.is_file() and jsonschema, "no SARIF schema: run tests/support/sarif_schema.sh")
    def test_valid_for_all_captures(self):
        captures = sorted(p for folder in (SOURCE / "samples", SHARED / "captures") for p in folder.rglob("*")
                          if p.suffix in (".pcap", ".pcapng"))
        done = self.run_program("check", "--format", "sarif", *captures)
        self.assertEqual(sarif_errors(json.loads(done.out)), [])
