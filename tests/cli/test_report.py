"""Reports: formats, files, judgement."""
import csv
import fcntl
import json
import os
import pathlib
import pty
import re
import shutil
import struct
import subprocess
import termios
import unittest

from support import PROGRAM, SCHEMA, SHARED, SOURCE, CliTest, healthy_capture, read_terminal, screen

try:
    import jsonschema
except ImportError:
    jsonschema = None

SAMPLES = SOURCE / "samples" / "captures"


class Formats(CliTest):
    def test_text_begins_with_the_verdict(self):
        done = self.check(self.faulty, status=1)
        first = done.out.splitlines()[0]
        self.assertTrue(first.startswith(f"FAIL {pathlib.Path(self.faulty).name}: slave 0"), first)
        self.assertRegex(first, r"\((frame |#)\d+( at|,) \d+\.\d{3} s\)$")
        self.assertLessEqual(len(first), 100)
        self.assertEqual(done.err, "")

    def test_first_lines_tell_what_where_when_and_how_much(self):
        for capture in sorted(SAMPLES.glob("*.pcap*")):
            lines = self.run_program("check", capture).out.splitlines()
            self.assertLessEqual(len(lines[0]), 100, lines[0])
            if lines[0].startswith("NOTHING-TO-CHECK"):
                continue
            self.assertRegex(lines[1], r"^\d+ errors?, \d+ warnings?, \d+ infos?")
            self.assertIn("evaluated: ", "\n".join(lines[2:6]))

    def test_findings_first_with_the_ids_of_slice(self):
        for name in ("falls-out-of-op", "two-slaves-one-refuses", "init-to-op-refused"):
            capture = SAMPLES / f"{name}.pcapng"
            text = self.check(capture, status=1).out
            self.assertLess(text.index("\nFindings\n"), text.index("\nSlaves\n"))
            self.assertLess(text.index("\nSlaves\n"), text.index("\nCapture\n"))
            shown = re.findall(r"^ +(f\d+) (?:consequence: )?(?:error|warning|info) (\S+)", text, re.M)
            findings = self.report(capture, status=1)["reports"][0]["findings"]
            self.assertEqual(shown, [(f["id"], f["rule"]) for f in findings])
            self.assertEqual([f["id"] for f in findings], [f"f{i + 1}" for i in range(len(findings))])
            self.run_program("slice", capture, "--finding", shown[-1][0], "-o", f"{name}.pcapng")
            comments = (self.dir / f"{name}.pcapng").read_bytes()
            self.assertIn(f"{shown[-1][0]} ".encode(), comments)
            self.assertIn(shown[-1][1].encode(), comments)

    def test_quiet_is_one_line_a_capture(self):
        self.assertEqual(len(self.check(self.faulty, "--quiet", status=1).out.splitlines()), 1)
        out = self.check(self.faulty, self.healthy, "--quiet", status=1).out.splitlines()
        self.assertEqual([line.split()[0] for line in out], ["FAIL", "PASS", "FAIL"])

    def test_clock_times(self):
        # The packets of these captures begin on 2019-05-01 at 12:00:00 UTC.
        text = self.check(self.faulty, "--time", "utc", status=1).out
        self.assertRegex(text.splitlines()[0], r"(frame |#)\d+( at|,) 12:00:00\.\d{3}\)$")
        self.assertRegex(text, r"frame \d+ at 12:00:00\.\d{6}")
        done = subprocess.run([PROGRAM, "check", "--time=local", self.faulty], capture_output=True, text=True,
                              cwd=self.dir, env={**os.environ, "TZ": "CET-1CEST,M3.5.0,M10.5.0/3"})
        self.assertIn("at 14:00:00.", done.stdout)
        self.assertIn(" from 2019-05-01 14:00:00 +02:00", done.stdout)
        self.assertIn("--time is 'noon'", self.check(self.faulty, "--time=noon", status=2).err)

    def test_clean_text(self):
        done = self.check(self.healthy, status=0)
        self.assertTrue(done.out.startswith(f"PASS {self.healthy}: "), done.out)
        self.assertEqual(done.err, "")

    def test_text_does_not_count_what_the_capture_does_not_show(self):
        captures = pathlib.Path(SOURCE) / "samples" / "captures"
        first = self.check(captures / "mid-run.pcapng", status=0).out.splitlines()[0]
        self.assertNotIn("0 slaves", first)
        self.assertIn("no slave is known", first)
        self.assertNotIn("frames lost", self.check(captures / "outbound-only.pcapng", status=0).out)
        self.assertNotIn("frames lost", self.check(captures / "returned-only.pcapng", status=0).out)

    def test_json_is_one_document(self):
        report = self.report(self.faulty, status=1)
        self.assertEqual(report["schema"], "ecaudit.report/1")
        findings = report["reports"][0]["findings"]
        self.assertGreaterEqual(len(findings), 1)
        self.assertEqual([f["id"] for f in findings], [f"f{i + 1}" for i in range(len(findings))])
        refused = [f for f in findings if f["rule"] == "al-refused"]
        self.assertEqual(len(refused), 1, findings)
        self.assertEqual(refused[0]["slave"], 0)
        self.assertEqual(refused[0]["station_address"], 0x1001)
        self.assertEqual(refused[0]["evidence"].get("al_status_code", 0x11), 0x11)

    def test_text_and_json_tell_the_same(self):
        text = self.check(self.faulty, status=1).out
        for finding in self.report(self.faulty, status=1)["reports"][0]["findings"]:
            self.assertIn(f"{finding['severity']} {finding['rule']}", text)
            self.assertIn(f"frame {finding['frame']}", text)

    def test_seconds_count_from_the_first_packet_of_the_file(self):
        capture = pathlib.Path(SOURCE) / "samples" / "captures" / "init-to-op-refused.pcapng"
        whole = {f["frame"]: f["time_s"] for f in self.report(capture, status=1)["reports"][0]["findings"]}
        part = self.report(capture, "--from", "#105", status=1)["reports"][0]["findings"]
        self.assertGreaterEqual(len(part), 1)
        for finding in part:
            self.assertEqual(finding["time_s"], whole[finding["frame"]])

    def test_two_runs_give_the_same_bytes(self):
        self.assertEqual(self.check(self.faulty, "--format", "json", status=1).out,
                         self.check(self.faulty, "--format", "json", status=1).out)

    @unittest.skipIf(shutil.which("tshark") is None, "tshark is not installed")
    def test_filters_are_valid_and_show_the_frames(self):
        for finding in self.report(self.faulty, status=1)["reports"][0]["findings"]:
            shown = subprocess.run(["tshark", "-r", self.faulty, "-Y", finding["wireshark_filter"], "-T", "fields",
                                    "-e", "frame.number"], capture_output=True, text=True, check=True).stdout.split()
            self.assertIn(str(finding["frame"]), shown)
            for frame in finding["related_frames"]:
                self.assertIn(str(frame), shown)


class Outputs(CliTest):
    def test_path_takes_the_place_of_standard_output(self):
        done = self.check(self.faulty, "-o", "out.txt", status=1)
        self.assertEqual(done.out, "")
        self.assertTrue((self.dir / "out.txt").read_text().startswith("FAIL "))

    def test_ending_names_the_format(self):
        self.check(self.faulty, "-o", "out.json", status=1)
        self.assertEqual(json.loads((self.dir / "out.json").read_text())["schema"], "ecaudit.report/1")

    def test_format_beats_the_ending(self):
        self.check(self.faulty, "--format", "text", "-o", "out.json", status=1)
        self.assertTrue((self.dir / "out.json").read_text().startswith("FAIL "))

    def test_named_formats_come_in_addition(self):
        done = self.check(self.faulty, "-o", "json=a.json", "-o", "text=b.txt", status=1)
        self.assertTrue(done.out.startswith("FAIL "))
        self.assertEqual(json.loads((self.dir / "a.json").read_text())["schema"], "ecaudit.report/1")
        self.assertEqual((self.dir / "b.txt").read_text(), done.out)

    def test_dash_is_standard_output(self):
        done = self.check(self.faulty, "-o", "json=-", status=1)
        self.assertEqual(json.loads(done.out)["schema"], "ecaudit.report/1")

    def test_options_may_follow_or_precede_the_capture(self):
        self.check("-o", "json=a.json", self.faulty, status=1)
        self.assertTrue((self.dir / "a.json").exists())

    def test_an_earlier_report_is_replaced_without_leftovers(self):
        self.check(self.faulty, "-o", "out.json", status=1)
        before = sorted(p.name for p in self.dir.iterdir())
        self.check(self.healthy, "-o", "out.json", status=0)
        self.assertEqual(before, sorted(p.name for p in self.dir.iterdir()))
        self.assertEqual(json.loads((self.dir / "out.json").read_text())["summary"]["verdict"], "pass")

    def test_a_capture_is_never_overwritten(self):
        content = pathlib.Path(self.healthy).read_bytes()
        other = self.file("report.json", content)
        for path in (self.healthy, other, os.path.join(self.dir, ".", "healthy.pcap")):
            self.assertIn("will not be overwritten", self.one_error("check", "-o", path, self.faulty))
            self.assertEqual(pathlib.Path(path).read_bytes(), content)
        self.assertIn("will not be overwritten", self.one_error("check", "--write-baseline", other, self.faulty))

    def test_same_file_twice(self):
        self.assertIn("two outputs", self.one_error("check", "-o", "text=a", "-o", "json=./a", self.faulty))

    def test_missing_folder_and_directory_are_found_before_the_work(self):
        self.assertIn("no directory", self.one_error("check", "-o", "no/such/report.json", self.faulty))
        self.assertIn("is a directory", self.one_error("check", "-o", str(self.dir), self.faulty))

    @unittest.skipUnless(os.path.exists("/dev/full"), "this system has no /dev/full")
    def test_full_disk(self):
        self.assertIn("No space left", self.one_error("check", "-o", "/dev/full", self.faulty))
        with open("/dev/full", "wb") as full:
            done = self.run_program("check", self.faulty, stdout=full)
        self.assertEqual(done.returncode, 2)
        self.assertIn("cannot write to standard output", done.err)

    def test_closed_pipe_is_quiet_and_files_are_written(self):
        read_end, write_end = os.pipe()
        os.close(read_end)
        done = self.run_program("check", "-o", "json=a.json", self.faulty, stdout=write_end)
        os.close(write_end)
        self.assertEqual(done.err, "")
        self.assertEqual(done.returncode, 1)
        self.assertTrue((self.dir / "a.json").exists())


class Files(CliTest):
    """What a command line reads, or writes already, is never written to."""

    ENI = ("<EtherCATConfig><Config><Slave><Info><Name>Axis</Name><PhysAddr>4097</PhysAddr><AutoIncAddr>0</AutoIncAddr>"
           "<VendorId>1</VendorId><ProductCode>2</ProductCode><RevisionNo>3</RevisionNo><SerialNo>0</SerialNo></Info>"
           "</Slave></Config></EtherCATConfig>")

    def refused(self, path, *arguments):
        before = pathlib.Path(path).read_bytes()
        error = self.one_error(*arguments)
        self.assertEqual(pathlib.Path(path).read_bytes(), before, arguments)
        return error

    def test_settings_are_not_replaced_by_reports(self):
        eni = self.file("machine.eni.xml", self.ENI)
        self.check("--eni", eni, self.faulty, "--fail-on", "never", status=0)
        link = str(self.dir / "link.xml")
        os.symlink(eni, link)
        hard = str(self.dir / "hard.xml")
        os.link(eni, hard)
        for path in (eni, link, hard, os.path.join(self.dir, ".", "machine.eni.xml")):
            self.assertIn("is read as the ENI file", self.refused(eni, "check", "--eni", eni, "-o", f"junit={path}",
                                                                  self.faulty))
        config = self.file("c.json", '{"fail_on": "never"}')
        self.assertIn("is read as the configuration file",
                      self.refused(config, "check", "--config", config, "-o", config, self.faulty))
        found = self.file(".ecaudit.json", '{"fail_on": "never"}')
        for command in (("check", "-o", f"json={found}"), ("decode", "-o", f"jsonl={found}"),
                        ("batch", "-o", f"json={found}"), ("slice", "--frames", "1-3", "--force", "-o", found),
                        ("diff", self.healthy, "-o", found), ("signals", "-o", f"csv={found}")):
            self.assertIn("is read as the configuration file", self.refused(found, *command, self.faulty))

    def test_baselines(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        known = str(self.dir / "known.json")
        self.assertIn("is read as the baseline",
                      self.refused(known, "check", "--baseline", known, "-o", known, self.faulty))
        other = self.file("drive.esi.xml", "<EtherCATInfo/>")
        self.assertIn("exists and is not a baseline; it will not be overwritten",
                      self.refused(other, "check", "--write-baseline", other, self.faulty))
        self.assertIn("two outputs have the same path x.json",
                      self.one_error("check", "--write-baseline", "x.json", "-o", "x.json", self.faulty))
        self.assertFalse((self.dir / "x.json").exists())
        self.file("empty.json", "")
        self.check(self.faulty, "--write-baseline", "empty.json", status=1)

    def test_expectations(self):
        expected = self.file("e.json", '{"schema": "ecaudit.expectation/1", "strict": true, "slaves": []}')
        for output in (("-o", expected), ("--write-baseline", expected), ("--save", expected)):
            self.assertIn("is read as the expectation",
                          self.refused(expected, "startup", "--expect", expected, *output, self.faulty))
        self.assertIn("two outputs have the same path m.json",
                      self.one_error("startup", "--save", "m.json", "-o", "m.json", self.faulty))

    def test_reports_to_merge(self):
        self.check(self.faulty, "-o", "r1.json", status=1)
        path = str(self.dir / "r1.json")
        self.assertEqual(self.refused(path, "merge", path, "-o", path),
                         f"{path} is read as a report; name another output file")
        self.assertIn("is read as a report", self.refused(path, "merge", path, "--write-baseline", path))

    def test_reports_of_batch(self):
        self.run_program("batch", self.faulty, "--output-dir", "out")
        report = next((self.dir / "out").glob("*.json"))
        self.assertIn("two outputs", self.refused(report, "batch", self.faulty, "--output-dir", "out", "-o",
                                                  f"json={report}"))

    def test_standard_output_is_no_file(self):
        for command in (("check", "--write-baseline", "-"), ("startup", "--save", "-")):
            self.assertIn("- is standard output", self.one_error(*command, self.faulty))
        self.assertFalse((self.dir / "-").exists())
        self.assertIn("two outputs have standard output as their path",
                      self.one_error("check", "-o", "json=-", "-o", "junit=-", self.faulty))

    def test_a_link_to_nothing_is_followed(self):
        os.symlink("real.json", self.dir / "link.json")
        self.check(self.faulty, "-o", "link.json", status=1)
        self.assertTrue((self.dir / "link.json").is_symlink())
        self.assertEqual(json.loads((self.dir / "real.json").read_text())["schema"], "ecaudit.report/1")
        os.symlink("other.json", self.dir / "second.json")
        self.assertIn("two outputs",
                      self.one_error("check", "-o", "json=second.json", "-o", "text=other.json", self.faulty))

    def test_an_ending_of_another_format_needs_the_format_named(self):
        for command, path in (("signals", "x.json"), ("decode", "x.json"), ("events", "x.html"), ("diff", "x.xml")):
            captures = (self.healthy, self.faulty) if command == "diff" else (self.faulty,)
            self.assertIn(f"no format of this command has the ending {os.path.splitext(path)[1]}",
                          self.one_error(command, *captures, "-o", path))
            self.assertFalse((self.dir / path).exists())
        self.run_program("signals", self.faulty, "--format", "csv", "-o", "x.json")
        self.check(self.faulty, "-o", "report", status=1)

    def test_one_copy_goes_to_one_file(self):
        self.assertIn("give -o once", self.one_error("slice", self.faulty, "--frames", "1-3", "-o", "a.pcapng", "-o",
                                                     "b.pcapng"))

    def test_a_file_is_joined_once(self):
        os.symlink(self.faulty, self.dir / "again.pcap")
        for second in (self.faulty, "again.pcap"):
            for command in (("check",), ("decode",), ("startup",), ("slice", "--frames", "1-3", "-o", "s.pcapng")):
                self.assertIn("is joined twice", self.one_error(*command, "--join", self.faulty, second))


class Fields(CliTest):
    """What the JSON report has for every slave and rule, also where there is nothing to tell."""

    def test_drive_and_clocks_are_null_where_there_are_none(self):
        for slave in self.report(self.healthy, status=0)["reports"][0]["slaves"]:
            for field in ("drive", "dc", "latch", "touch_probe", "startup"):
                self.assertIn(field, slave)
            self.assertIsNone(slave["drive"])

    def test_a_rule_not_judged_says_of_whom(self):
        entries = self.report(SAMPLES / "two-slaves-one-refuses.pcapng", "--fail-on", "never",
                              status=0)["reports"][0]["not_evaluable"]
        scopes = {entry["scope"] for entry in entries}
        self.assertIn("all-slaves", scopes)
        for entry in entries:
            self.assertEqual(entry["slave"] is not None, entry["scope"] == "slave", entry)


class Gate(CliTest):
    def test_fail_on(self):
        self.check(self.faulty, status=1)
        self.check(self.faulty, "--fail-on", "error", status=1)
        self.check(self.faulty, "--fail-on", "warning", status=1)
        self.check(self.faulty, "--fail-on", "never", status=0)
        self.check(self.healthy, "--fail-on", "warning", status=0)

    def rules(self, *arguments, status):
        findings = self.report(self.faulty, *arguments, status=status)["reports"][0]["findings"]
        return {f["rule"]: f["severity"] for f in findings}

    def test_rule_off(self):
        before = self.rules(status=1)
        self.assertIn("al-refused", before)
        off = [f"--rule={rule}=off" for rule in before]
        self.assertEqual(self.rules(*off, status=0), {})

    def test_rule_severity(self):
        found = self.rules(status=1)
        softer = [f"--rule={rule}=warning" for rule in found]
        after = self.rules(*softer, status=0)
        self.assertEqual(set(after.values()), {"warning"})
        self.rules(*softer, "--fail-on", "warning", status=1)

    def test_the_last_setting_of_a_rule_counts(self):
        self.assertNotIn("al-refused", self.rules("--rule=al-refused=error", "--rule=al-refused=off", status=1))

    def test_slave(self):
        by_position = self.report(self.faulty, "--slave", "0", status=1)
        by_address = self.report(self.faulty, "--slave", "0x1001", status=1)
        self.assertEqual(by_position["reports"][0]["settings"].pop("slaves"), ["0"])
        self.assertEqual(by_address["reports"][0]["settings"].pop("slaves"), ["0x1001"])
        self.assertEqual(by_position, by_address)


class NamesAndPaths(CliTest):
    def test_quiet_and_join_print_the_path_as_given(self):
        folder = "of/a/" + "very-" * 20 + "long-name"
        here = self.file(f"{folder}/one/run.pcap", pathlib.Path(self.healthy).read_bytes())
        there = self.file(f"{folder}/two/run.pcap", pathlib.Path(self.healthy).read_bytes())
        lines = self.check("--quiet", here, there, status=0).out.splitlines()
        self.assertEqual([line.split(":")[0] for line in lines[:2]], [f"PASS {here}", f"PASS {there}"])
        joined = self.check("--join", here, self.faulty, status=1).out.splitlines()[0]
        self.assertTrue(joined.startswith(f"FAIL {here}, {self.faulty}: "), joined)

    def test_slaves_by_what_reports_print(self):
        capture = SOURCE / "samples" / "captures" / "two-slaves-one-refuses.pcapng"
        whole = self.report(capture, "--fail-on=never", status=0)["reports"][0]
        slave = whole["slaves"][1]
        names = [str(slave["position"]), f"0x{slave['station_address']:04x}", f"{slave['station_address']:x}"]
        same = [s for s in whole["slaves"] if s["name"] == slave["name"]]
        findings = [self.report(capture, "--fail-on=never", "--slave", name, status=0)["reports"][0]["findings"]
                    for name in names]
        self.assertTrue(all(f == findings[0] for f in findings), names)
        if slave["name"]:
            named = self.report(capture, "--fail-on=never", "--slave", slave["name"].upper(), status=0)["reports"][0]
            self.assertLessEqual({s["position"] for s in same}, {s["position"] for s in named["slaves"]})

    def test_a_slave_that_is_not_there(self):
        error = self.one_error("check", "--slave", "1", self.healthy)
        self.assertEqual(error, f"{self.healthy} has no slave 1; slaves count from 0, and there is 0 (0x1001)")
        self.assertIn("has no slave AKX; slaves count from 0", self.one_error("check", "--slave", "AKX", self.healthy))
        self.assertIn("takes positions and addresses", self.one_error("events", "--slave", "AKD", self.healthy))
        self.assertEqual(self.run_program("events", "--slave", "1001", self.healthy).returncode, 0)
        self.assertEqual(self.run_program("decode", "--slave", "1001", self.healthy).returncode, 0)

    def test_endings_in_any_case(self):
        for name, start in (("a.HTM", "<!doctype html>"), ("b.htm", "<!doctype html>"), ("a.JSON", "{"), ("a.Xml", "<?xml")):
            done = self.run_program("check", "-o", name, self.healthy)
            if "without HTML reports" in done.err:
                continue
            self.assertEqual(done.returncode, 0, done.err)
            self.assertTrue((self.dir / name).read_text().lower().startswith(start), name)
        self.assertIn("no format of this command has the ending .csv", self.one_error("check", "-o", "a.CSV", self.healthy))


class CountFrom(CliTest):
    """Slaves numbered from 1, as people count them."""
    two = SOURCE / "samples" / "captures" / "two-slaves-one-refuses.pcapng"
    number_alone = re.compile(r"\bslave (\d+)(?! \(position)", re.IGNORECASE)

    def outputs(self, *options):
        """What people read, by format."""
        texts = {}
        for form in ("text", "markdown", "junit", "github", "gitlab", "sarif"):
            texts[form] = self.run_program("check", "--format", form, *options, self.two).out
        texts["startup"] = self.run_program("startup", *options, self.two).out
        texts["diff"] = self.run_program("diff", *options, self.two, SOURCE / "samples" / "captures" / "clean-startup.pcapng").out
        return texts

    def test_number_and_position_stand_together(self):
        for form, text in self.outputs("--count-from", "1").items():
            flat = " ".join(text.split())
            self.assertRegex(flat, r"slave [12] \(position [01]", form)
            self.assertNotRegex(flat, r"(?i)slave 0\b", form)
            for number, position in re.findall(r"slave (\d+) \(position (\d+)", flat):
                self.assertEqual(int(number), int(position) + 1, form)
            # The first line and the notes of a range may lack the room.
            alone = [m for m in self.number_alone.findall(flat)]
            self.assertLessEqual(len(alone), 2, form)

    def test_from_zero_is_the_default(self):
        self.assertEqual(self.outputs("--count-from", "0"), self.outputs())

    def test_json_keeps_positions(self):
        plain = self.report(self.two, status=1)["reports"][0]
        counted = self.report("--count-from", "1", self.two, status=1)["reports"][0]
        self.assertEqual(counted["settings"].pop("count_from"), 1)
        self.assertNotIn("count_from", plain["settings"])
        for key in ("position", "station_address", "al", "startup"):
            self.assertEqual([s[key] for s in plain["slaves"]], [s[key] for s in counted["slaves"]])
        for key in ("slave", "identity", "rule", "kind", "frame"):
            self.assertEqual([f[key] for f in plain["findings"]], [f[key] for f in counted["findings"]])
        self.assertEqual(plain["bus"]["topology"], counted["bus"]["topology"])
        for name in ("events", "signals"):
            lines = [self.run_program(name, "--format", "jsonl", *options, self.two).out.splitlines()
                     for options in ((), ("--count-from", "1"))]
            self.assertEqual(*[[json.loads(line).get("slave") for line in text] for text in lines], name)

    def test_slave_takes_the_number(self):
        first = self.report("--slave", "0", self.two, "--fail-on=never", status=0)["reports"][0]["findings"]
        counted = self.report("--count-from", "1", "--slave", "1", self.two, "--fail-on=never", status=0)["reports"][0]
        self.assertEqual([f["identity"] for f in first], [f["identity"] for f in counted["findings"]])
        self.assertEqual(counted["settings"]["slaves"], ["1"])
        self.assertIn("'0' is not a slave: with --count-from 1 the first slave is 1",
                      self.one_error("check", "--count-from", "1", "--slave", "0", self.two))
        self.assertIn("has no slave 3; slaves count from 1, and there is 1 (position 0",
                      self.one_error("check", "--count-from", "1", "--slave", "3", self.two))
        self.assertIn("--count-from is '2' but must be 0 or 1", self.one_error("check", "--count-from", "2", self.two))

    def test_rows_of_events_and_signals(self):
        rows = self.run_program("events", "--count-from", "1", "--slave", "2", self.two).out.splitlines()[1:]
        self.assertTrue(rows)
        self.assertEqual({row.split()[2] for row in rows if row.split()[2] != "all"}, {"2"})
        drives = SOURCE / "samples" / "captures" / "drive-fault.pcapng"
        plain, counted = [self.run_program("signals", *options, drives).out.splitlines()[0]
                          for options in ((), ("--count-from", "1"))]
        self.assertIn("S0.", plain)
        self.assertEqual(plain.replace("S0.", "S1."), counted)

    def test_batch_and_merge(self):
        done = self.run_program("batch", "--count-from", "1", "-o", "-", "-o", "markdown=all.md", self.two)
        self.assertRegex(done.out, r"slave \d( \(position \d|:)", done.err)
        self.assertRegex((self.dir / "all.md").read_text(), r"slave \d \(position \d")
        merged = self.run_program("merge", "ecaudit-reports")
        self.assertRegex(merged.out, r"slave \d \(position \d", merged.err)

    def test_the_configuration_sets_it(self):
        capture = self.file("a.pcapng", self.two.read_bytes())
        self.file(".ecaudit.json", '{"count_from": 1}')
        self.assertIn("slave 1 (position 0", self.run_program("check", capture).out)
        self.assertNotIn("(position 0", self.run_program("check", "--count-from", "0", capture).out)


class Baseline(CliTest):
    def test_known_findings_do_not_count(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        baseline = json.loads((self.dir / "known.json").read_text())
        self.assertEqual(baseline["schema"], "ecaudit.baseline/1")
        report = self.report(self.faulty, "--baseline", "known.json", "--fail-on", "info", status=0)["reports"][0]
        self.assertTrue(all(f["known"] for f in report["findings"]))
        self.assertEqual(report["summary"]["known"], len(report["findings"]))
        self.assertEqual(report["summary"]["errors"], 0)
        text = self.check(self.faulty, "--baseline", "known.json", status=0).out
        self.assertIn("known from the baseline", text)

    def test_new_findings_count(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        baseline = json.loads((self.dir / "known.json").read_text())
        baseline["findings"] = [f for f in baseline["findings"] if f["rule"] != "al-refused"]
        self.file("known.json", json.dumps(baseline))
        self.check(self.faulty, "--baseline", "known.json", status=1)

    def test_refreshing_keeps_known_findings(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        before = (self.dir / "known.json").read_bytes()
        self.check(self.faulty, "--baseline", "known.json", "--write-baseline", "known.json", status=0)
        self.assertEqual((self.dir / "known.json").read_bytes(), before)

    def test_reasons_and_last_days(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        baseline = json.loads((self.dir / "known.json").read_text())
        for entry in baseline["findings"]:
            entry.update(reason="spare axis, see ticket 17", expires="2999-12-31")
        self.file("known.json", json.dumps(baseline))
        done = self.check(self.faulty, "--baseline", "known.json", status=0)
        self.assertIn("(spare axis, see ticket 17; until 2999-12-31)", " ".join(done.out.split()))
        report = self.report(self.faulty, "--baseline", "known.json", status=0)["reports"][0]
        self.assertEqual({f["known_because"] for f in report["findings"]},
                         {"spare axis, see ticket 17; until 2999-12-31"})
        for entry in baseline["findings"]:
            entry["expires"] = "2019-05-01"
        self.file("known.json", json.dumps(baseline))
        done = self.check(self.faulty, "--baseline", "known.json", status=1)
        self.assertIn("warning: known.json: al-refused of slave 0 was accepted until 2019-05-01 only", done.err)
        # Brought up to date: the reason stays, the day that is over goes.
        self.check(self.faulty, "--baseline", "known.json", "--write-baseline", "known.json", status=1)
        entries = json.loads((self.dir / "known.json").read_text())["findings"]
        self.assertTrue(all(e["reason"] == "spare axis, see ticket 17" and "expires" not in e for e in entries))
        self.check(self.faulty, "--baseline", "known.json", status=0)
        done = self.run_program("batch", "--baseline", "known.json", "-o", "json=s.json", self.faulty)
        self.assertEqual(done.returncode, 0, done.err)

    def test_entries_that_match_nothing_are_reported(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        baseline = json.loads((self.dir / "known.json").read_text())
        self.assertEqual(baseline["findings"][0]["captures"], ["faulty.pcap"])
        baseline["findings"].append({"rule": "al-timeout", "slave": 0, "identity": "repaired long ago"})
        baseline["findings"].append({"rule": "al-timeouts", "slave": 0, "identity": "mistyped"})
        self.file("known.json", json.dumps(baseline))
        for command in (("check",), ("batch", "--output-dir", "r")):
            done = self.run_program(*command, "--baseline", "known.json", self.faulty)
            self.assertEqual(done.returncode, 0, done.err)
            self.assertIn("known.json: 2 entries match no finding: al-timeout of slave 0", done.err)
            self.assertIn("known.json: 'al-timeouts' is no rule (did you mean 'al-timeout'?)", done.err)
        done = self.run_program("merge", "--baseline", "known.json", "r")
        self.assertIn("known.json: 2 entries match no finding", done.err)

    def test_another_machine_is_not_excused(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        other = self.file("mill.pcap", pathlib.Path(self.faulty).read_bytes())
        done = self.check(other, "--baseline", "known.json", status=1)
        self.assertIn("known.json: all entries are for other devices or captures", done.err)
        akd = SOURCE / "samples" / "captures" / "init-to-op-refused.pcapng"
        self.check(akd, "--write-baseline", "akd.json", status=1)
        self.assertTrue(json.loads((self.dir / "akd.json").read_text())["findings"][0]["devices"])
        self.check(self.file("renamed.pcapng", akd.read_bytes()), "--baseline", "akd.json", status=0)

    def test_missing_or_wrong_file(self):
        self.assertIn("no such file", self.one_error("check", "--baseline", "none.json", self.faulty))
        self.file("bad.json", "{")
        self.assertIn("not valid JSON", self.one_error("check", "--baseline", "bad.json", self.faulty))
        self.file("other.json", '{"schema": "ecaudit.report/1"}')
        self.assertIn("is not a baseline", self.one_error("check", "--baseline", "other.json", self.faulty))


class Config(CliTest):
    def test_found_beside_the_capture_or_above(self):
        self.file("project/.ecaudit.json", '{"fail_on": "never"}')
        self.file("project/deep/er/x.pcap", pathlib.Path(self.faulty).read_bytes())
        report = self.report("project/deep/er/x.pcap", status=0)["reports"][0]
        self.assertEqual(report["settings"]["fail_on"], "never")
        self.assertTrue(report["settings"]["config"].replace("\\", "/").endswith("project/.ecaudit.json"))
        self.assertIn("settings from", self.check("project/deep/er/x.pcap", status=0).out)

    def test_each_capture_has_its_own(self):
        self.file("a/.ecaudit.json", '{"fail_on": "never"}')
        self.file("a/x.pcap", pathlib.Path(self.faulty).read_bytes())
        report = self.report("a/x.pcap", self.faulty, status=1)["reports"]
        self.assertEqual([r["summary"]["verdict"] for r in report], ["pass", "fail"])

    def test_named(self):
        self.file("c.json", '{"rules": {"al-refused": "off"}}')
        rules = [f["rule"] for f in self.report("--config", "c.json", self.faulty, status=1)["reports"][0]["findings"]]
        self.assertNotIn("al-refused", rules)

    def test_command_line_wins(self):
        self.file(".ecaudit.json", '{"fail_on": "never", "profile": "kollmorgen-mkd-n"}')
        report = self.report(self.faulty, "--fail-on", "error", "--profile", "generic", status=1)["reports"][0]
        self.assertEqual(report["slaves"][0]["profile"], "generic")

    def test_profiles(self):
        self.file(".ecaudit.json", '{"profile": "kollmorgen-mkd-n", "slave_profiles": {"0x1001": "pilz-pmcprotego-d"}}')
        report = self.report(self.faulty, "--fail-on", "never", status=0)["reports"][0]
        self.assertEqual(report["slaves"][0]["profile"], "pilz-pmcprotego-d")

    def test_a_key_that_stands_twice(self):
        self.file("twice.json", '{"fail_on": "never", "rules": {"al-refused": "off", "al-refused": "info"}}')
        self.assertIn("the key 'al-refused' appears twice", self.one_error("check", "--config", "twice.json", self.faulty))
        # The same key in two objects is two settings.
        self.file("once.json", '{"parameters": {"PTBASE": 1}, "limits": {}, "slave_profiles": {}}')
        self.check("--config", "once.json", "--fail-on", "never", self.faulty, status=0)

    def test_a_folder_in_its_place(self):
        path = self.file("x/x.pcap", pathlib.Path(self.faulty).read_bytes())
        (self.dir / "x" / ".ecaudit.json").mkdir()
        self.assertIn("is a directory", self.one_error("check", path))
        (self.dir / "x" / ".ecaudit.json").rmdir()
        os.symlink("nowhere.json", self.dir / "x" / ".ecaudit.json")
        self.assertIn("no such file", self.one_error("check", path))

    def test_parameters(self):
        # The process data of this sample come every millisecond: 16 times 62.5 us.
        capture = self.file("run.pcapng", (SOURCE / "samples/captures/sync-frames-missing.pcapng").read_bytes())

        def rules(*options):
            report = self.report(capture, "--fail-on", "never", *options, status=0)
            return [f["rule"] for f in report["reports"][0]["findings"]]
        self.assertEqual(rules("--parameter", "FBUS.SAMPLEPERIOD=16"), ["sync-lost"])
        self.assertIn("sync-cycle-mismatch", rules("--parameter", "FBUS.SAMPLEPERIOD=32"))
        self.assertEqual(rules("--parameter", "0x2002:FBUS.SAMPLEPERIOD=32"), ["sync-lost"])
        self.assertEqual(rules("--parameter", "FBUS.PARAM04=0"), [])
        self.file(".ecaudit.json", '{"parameters": {"0:FBUS.SAMPLEPERIOD": 32}}')
        self.assertIn("sync-cycle-mismatch", rules())

    def test_baseline_is_relative_to_the_file(self):
        self.check(self.faulty, "--write-baseline", "known.json", status=1)
        self.file(".ecaudit.json", '{"baseline": "known.json"}')
        self.check(self.faulty, status=0, cwd="/")

    def test_mistakes_are_errors(self):
        for content, message in (('{"rule": {}}', "unknown key 'rule' (did you mean 'rules'?)"),
                                 ('{"rules": {"nope": "off"}}', "unknown rule 'nope'"),
                                 ('{"rules": {"al-refused": "loud"}}', "unknown severity 'loud'"),
                                 ('{"parameters": {"FBUS.SYNCDIS": 1}}', "unknown parameter 'FBUS.SYNCDIS'"),
                                 ('{"parameters": {"PTBASE": "8"}}', "must be a whole number"),
                                 ('{"profile": "akd"}', "unknown profile 'akd'"),
                                 ('{"fail_on": "often"}', "--fail-on is 'often'"),
                                 ('{"fail_on": 3}', "'fail_on' must be a string"),
                                 ("{", "not valid JSON")):
            self.file(".ecaudit.json", content)
            error = self.one_error("check", self.healthy)
            self.assertIn(".ecaudit.json", error)
            self.assertIn(message, error)
        self.assertIn("no such file", self.one_error("check", "--config", "none.json", self.healthy))


class Catalogue(CliTest):
    def rules(self):
        return json.loads(self.run_program("rules", "--format", "json").out)["rules"]

    def test_rules(self):
        rules = self.rules()
        self.assertIn("al-refused", [r["id"] for r in rules])
        text = self.run_program("rules").out
        for rule in rules:
            self.assertRegex(text, rf"(?m)^  {rule['id']} +{rule['severity']} +\S")

    def test_every_rule_explains_itself(self):
        for rule in self.rules():
            page = self.run_program("explain", rule["id"])
            self.assertEqual(page.returncode, 0)
            self.assertTrue(page.out.startswith(f"{rule['id']} ({rule['severity']})"), page.out)
            self.assertEqual(json.loads(self.run_program("explain", rule["id"], "--format", "json").out), rule)

    def test_unknown_rule(self):
        self.assertEqual(self.one_error("explain", "al-refusd"), "unknown rule 'al-refusd' (did you mean 'al-refused'?)")
        self.assertIn("no WHAT given", self.one_error("explain"))

    def test_unknown_format(self):
        self.assertIn("unknown format 'xml'", self.one_error("rules", "--format", "xml"))

    def test_findings_name_rules_of_the_catalogue(self):
        ids = {r["id"] for r in self.rules()}
        report = self.report(self.faulty, status=1)["reports"][0]
        self.assertLessEqual({f["rule"] for f in report["findings"]}, ids)
        self.assertLessEqual({n["rule"] for n in report["not_evaluable"]}, ids)


class Profiles(CliTest):
    NAMES = {"generic", "kollmorgen-akd-2010", "kollmorgen-akd-2011", "kollmorgen-mkd-c", "kollmorgen-mkd-n",
             "pilz-pmcprotego-d"}

    def test_list(self):
        listed = json.loads(self.run_program("profiles", "--format", "json").out)["profiles"]
        self.assertEqual({p["id"] for p in listed}, self.NAMES)
        text = self.run_program("profiles").out
        for name in self.NAMES:
            self.assertRegex(text, rf"(?m)^{name} ")

    def test_each(self):
        for name in self.NAMES:
            page = self.run_program("profiles", name)
            self.assertEqual(page.returncode, 0)
            self.assertTrue(page.out.startswith(f"{name}: "))
            profile = json.loads(self.run_program("profiles", name, "--format", "json").out)
            self.assertEqual(profile["id"], name)
            self.assertEqual(profile["files"][0]["id"], name)
            self.assertEqual(profile["files"][-1]["id"], "generic")
            self.assertIn("INIT -> PREOP", page.out)

    @unittest.skipUnless((SHARED / "reference").is_dir(), "the tables of the manuals are not here")
    def test_full_page_holds_every_row_of_the_manuals(self):
        page = self.run_program("profiles", "kollmorgen-mkd-n", "--full").out
        flat = re.sub(r"\s+", " ", page)
        with open(SHARED / "reference" / "object_dictionary_mkd_n.csv", newline="") as table:
            objects = list(csv.DictReader(table))
        self.assertGreater(len(objects), 700)
        for row in objects:
            self.assertIn(row["index"], flat)
        keys = {"fbus_params": lambda r: r["parameter"], "eeprom": lambda r: r["key"],
                "emcy_codes": lambda r: r["error_code"].lower()}
        for name, key in keys.items():
            with open(SHARED / "reference" / f"{name}.csv", newline="") as table:
                rows = [r for r in csv.DictReader(table) if r["family"] in ("mkd", "mkd_n", "mkd-drive")]
            self.assertTrue(rows, name)
            for row in rows:
                self.assertIn(key(row), flat)
        self.assertIn("Fieldbus parameters", page)
        self.assertIn("EEPROM", page)
        self.assertIn("Emergency codes", page)
        # What is long stands there only when asked for.
        short = self.run_program("profiles", "kollmorgen-mkd-n").out
        self.assertIn("Fieldbus parameters", short)
        self.assertNotIn("Emergency codes\n", short)
        self.assertLess(len(short), len(page) / 3)

    def test_unknown(self):
        self.assertEqual(self.one_error("profiles", "genric"), "unknown profile 'genric' (did you mean 'generic'?)")


class Terminal(CliTest):
    def on_terminal(self, *arguments, columns=0, **environment):
        """What the program prints when its standard output is a terminal."""
        leader, follower = pty.openpty()
        fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("HHHH", 0, columns, 0, 0))
        env = {k: v for k, v in os.environ.items() if k != "NO_COLOR"} | {"TERM": "xterm"} | environment
        with subprocess.Popen([PROGRAM, "check", self.faulty, *arguments], stdout=follower, stderr=subprocess.PIPE,
                              stdin=subprocess.DEVNULL, env=env, cwd=self.dir) as child:
            os.close(follower)
            out = read_terminal(leader)
            child.stderr.read()
        return screen(out)

    def test_colours_on_a_terminal(self):
        self.assertIn(b"\x1b[1;31mFAIL", self.on_terminal())

    def test_colours_by_option(self):
        self.assertIn("\x1b[1;31mFAIL", self.check(self.faulty, "--color=always", status=1).out)
        self.assertNotIn(b"\x1b", self.on_terminal("--color=never"))
        self.assertIn(b"\x1b", self.on_terminal("--color", "auto"))
        self.check(self.faulty, "--color=always", "-o", "text=a.txt", status=1)
        self.assertNotIn("\x1b", (self.dir / "a.txt").read_text())
        for given in (("--color=sometimes",), ("--color=always", "--no-color")):
            done = self.check(self.faulty, *given, status=2)
            self.assertEqual((done.out, len(done.err.splitlines())), ("", 1))

    def test_lines_fit(self):
        for line in self.check(SAMPLES / "falls-out-of-op.pcapng", status=1).out.splitlines()[1:]:
            self.assertLessEqual(len(line), 80, line)

    def test_the_first_line_fits(self):
        for columns in (60, 80, 100):
            first = self.on_terminal("--color=never", columns=columns).decode().splitlines()[0]
            self.assertLessEqual(len(first), columns, first)
            self.assertIn("OP requested in INIT: not allowed", first)

    def test_colours_switched_off(self):
        for arguments, environment in (((), {"NO_COLOR": "1"}), (("--no-color",), {}), ((), {"TERM": "dumb"})):
            self.assertNotIn(b"\x1b", self.on_terminal(*arguments, **environment))

    def test_empty_no_color_means_colours(self):
        self.assertIn(b"\x1b[", self.on_terminal(NO_COLOR=""))

    def test_no_colours_in_pipes_and_files(self):
        self.assertNotIn("\x1b", self.check(self.faulty, status=1).out)
        self.on_terminal("-o", "text=a.txt")
        self.assertNotIn(b"\x1b", (self.dir / "a.txt").read_bytes())


def strict(schema):
    """The schema with every object closed, so that a field nobody documented is found."""
    if isinstance(schema, dict):
        closed = {key: strict(value) for key, value in schema.items()}
        if "properties" in schema and schema.get("type") == "object":
            closed.setdefault("additionalProperties", False)
        return closed
    return [strict(item) for item in schema] if isinstance(schema, list) else schema


@unittest.skipIf(jsonschema is None, "python3-jsonschema is not installed")
class Reports(CliTest):
    """Every report over every capture at hand is valid, and its numbers agree with each other."""

    def setUp(self):
        super().setUp()
        schema = json.loads(SCHEMA.read_text())
        jsonschema.Draft202012Validator.check_schema(schema)
        self.validators = [jsonschema.Draft202012Validator(schema), jsonschema.Draft202012Validator(strict(schema))]

    def validate(self, path):
        done = self.run_program("check", "--format", "json", path)
        self.assertIn(done.returncode, (0, 1, 2), f"{path}: {done.err}")
        document = json.loads(done.out)
        for validator in self.validators:
            errors = [f"{'/'.join(map(str, e.absolute_path))}: {e.message}" for e in validator.iter_errors(document)]
            self.assertEqual(errors, [], path)
        if done.returncode == 2:
            self.assertEqual(done.err.count("\n"), 1, f"{path}: {done.err}")
            self.assertEqual((document["reports"], document["summary"]["verdict"]), ([], "incomplete"), path)
            return
        report = document["reports"][0]
        findings = report["findings"]
        for severity in ("error", "warning", "info"):
            count = sum(f["severity"] == severity for f in findings)
            self.assertEqual(report["summary"][severity + "s"], count, path)
        self.assertEqual(done.returncode, 1 if report["summary"]["verdict"] == "fail" else 0, path)
        ids = [f["id"] for f in findings]
        positions = {s["position"] for s in report["slaves"]}
        for finding in findings:
            self.assertIn(finding["caused_by"], [None, *ids], path)
            self.assertNotEqual(finding["caused_by"], finding["id"], path)
            self.assertIn(finding["slave"], {None} | positions, path)
            if finding["frame"] is not None:
                self.assertLessEqual(finding["frame"], finding["last_frame"], path)
                self.assertLessEqual(finding["last_frame"], report["capture"]["packets"], path)
        for slave in report["slaves"]:
            for step in (slave["startup"] or {"steps": []})["steps"]:
                if "alike" in step:
                    self.assertIn(slave["position"], report["alike_steps"][step["alike"]]["slaves"], path)

    def validate_all(self, folder):
        captures = sorted(p for p in folder.rglob("*") if p.suffix in (".pcap", ".pcapng", ".gz", ".zst"))
        if not captures:
            self.skipTest(f"no captures in {folder}")
        for path in captures:
            with self.subTest(path.name):
                self.validate(path)

    def test_steps_told_once_are_those_of_each_slave(self):
        def reported(*arguments):
            done = self.run_program("check", "--format", "json", SAMPLES / "two-slaves-one-refuses.pcapng", *arguments)
            return json.loads(done.out)["reports"][0]

        both = reported()
        self.assertTrue(both["alike_steps"])
        for slave in both["slaves"]:
            alone = reported("--slave", str(slave["position"]))
            self.assertEqual(alone["alike_steps"], [])
            told = [{**(both["alike_steps"][step["alike"]] if "alike" in step else {}), **step}
                    for step in slave["startup"]["steps"]]
            for step in told:
                step.pop("alike", None)
                step.pop("slaves", None)
            self.assertEqual(told, alone["slaves"][0]["startup"]["steps"])

    def test_made_here(self):
        self.validate(self.healthy)
        self.validate(self.faulty)
        self.validate(self.file("cut.pcap", healthy_capture()[:-7]))

    def test_samples(self):
        self.validate_all(SOURCE / "samples")

    def test_shared_captures(self):
        self.validate_all(SHARED / "captures")
