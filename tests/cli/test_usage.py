"""Command lines: help, version, mistakes."""
import gzip
import itertools
import json
import os
import pathlib
import re
import signal
import subprocess
import threading
import unittest

from support import PROGRAM, CliTest, foreign_capture, healthy_capture, read_terminal


class Usage(CliTest):
    def test_version(self):
        done = self.run_program("--version")
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.out, r"^ecaudit \d+\.\d+\.\d+\n")
        for line in ("commit     ", "compiler   ", "libraries  libpcap "):
            self.assertIn("\n" + line, done.out)

    def test_help_lists_every_command_that_exists(self):
        done = self.run_program("--help")
        self.assertEqual(done.returncode, 0)
        commands = re.findall(r"^  ([a-z]+)[ A-Z\[\].]*   ", done.out, re.M)
        self.assertIn("check", commands)
        for command in commands:
            page = self.run_program(command, "--help")
            self.assertEqual(page.returncode, 0, command)
            self.assertIn(f"ecaudit {command}", page.out)
            for line in page.out.splitlines():
                self.assertLessEqual(len(line), 120, line)

    def test_help_goes_to_standard_output_only(self):
        self.assertEqual(self.run_program("check", "--help").err, "")

    def test_no_command(self):
        self.assertIn("ecaudit --help", self.one_error())

    def test_no_command_on_a_terminal(self):
        leader, terminal = os.openpty()
        done = subprocess.run([PROGRAM], stdout=terminal, stderr=terminal, stdin=subprocess.DEVNULL)
        os.close(terminal)
        page = read_terminal(leader).decode()
        self.assertEqual(done.returncode, 2)
        commands = re.findall(r"^  ecaudit ([a-z]+) ", page, re.M)
        self.assertEqual(commands, ["check", "batch", "explain"])
        self.assertIn("ecaudit --help", page)
        for name in re.search(r"register: (.*)", page).group(1).strip().split(", "):
            self.assertEqual(self.run_program("explain", name).returncode, 0, name)

    def test_unknown_command(self):
        self.assertEqual(self.one_error("chek"), "unknown command 'chek' (did you mean 'check'?)")
        self.assertIn("--help", self.one_error("wibble"))

    def test_help_and_version_as_words(self):
        for words, same in ((["help"], ["--help"]), (["version"], ["--version"]), (["help", "check"], ["check", "--help"])):
            self.assertEqual(self.run_program(*words).out, self.run_program(*same).out)
        self.assertIn("unknown command 'chek'", self.one_error("help", "chek"))

    def test_a_capture_without_a_command(self):
        self.assertEqual(self.one_error(self.healthy),
                         f"no command given; to check the capture: ecaudit check {self.healthy}")
        self.assertIn("ecaudit batch", self.one_error(str(self.dir)))

    def test_a_part_of_several_names_lists_them(self):
        for command in (["profiles", "akd"], ["check", "--profile", "AKD", self.healthy]):
            self.assertIn("(did you mean 'kollmorgen-akd-2010' or 'kollmorgen-akd-2011'?)", self.one_error(*command))

    def test_option_before_the_command(self):
        self.assertIn("a command comes first", self.one_error("--format", "json"))

    def test_unknown_option(self):
        self.assertEqual(self.one_error("check", "--profil=generic", self.healthy),
                         "unknown option '--profil' (did you mean '--profile' or '--profiles'?)")

    def test_missing_capture(self):
        self.assertIn("no CAPTURE given", self.one_error("check"))

    def test_option_without_its_value(self):
        self.assertIn("option --fail-on needs a value", self.one_error("check", self.healthy, "--fail-on"))
        self.assertIn("option --fail-on needs a value", self.one_error("check", "--fail-on=", self.healthy))

    def test_capture_named_like_a_command(self):
        self.file("rules", healthy_capture())
        self.check("rules", status=0)

    def test_capture_named_like_an_option(self):
        self.file("-x.pcap", healthy_capture())
        self.check("--", "-x.pcap", status=0)

    def test_repeated_value_the_last_counts(self):
        self.check("--fail-on", "error", "--fail-on", "never", self.faulty, status=0)


class Messages(CliTest):
    """Exit status 2 with exactly one clear line."""

    def test_missing_file(self):
        self.assertEqual(self.one_error("check", "nowhere.pcap"), "no such file: nowhere.pcap")

    def test_directory(self):
        self.assertIn("is a folder, not a capture", self.one_error("check", str(self.dir)))

    def test_empty_file(self):
        self.assertIn("empty", self.one_error("check", self.file("empty.pcap", b"")))

    def test_text_file(self):
        self.assertIn("not a capture", self.one_error("check", self.file("notes.txt", "just text\n" * 100)))

    def test_compressed_text_file(self):
        self.assertIn("not a capture", self.one_error("check", self.file("notes.gz", gzip.compress(b"just text\n" * 99))))

    @unittest.skipIf(os.geteuid() == 0, "permissions do not bind root")
    def test_unreadable_file(self):
        os.chmod(self.healthy, 0)
        self.assertIn("ermission denied", self.one_error("check", self.healthy))

    def test_unknown_profile(self):
        self.assertEqual(self.one_error("check", "--profile", "foo", self.healthy),
                         "unknown profile 'foo' (see 'ecaudit profiles')")
        self.assertIn("did you mean 'kollmorgen-akd-201",
                      self.one_error("check", "--profile", "0=kollmorgen-akd-201", self.healthy))

    def test_unknown_rule(self):
        self.assertEqual(self.one_error("check", "--rule", "al-refusd=off", self.healthy),
                         "unknown rule 'al-refusd' (did you mean 'al-refused'?)")

    def test_unknown_severity(self):
        self.assertIn("unknown severity 'fatal'", self.one_error("check", "--rule", "al-refused=fatal", self.healthy))
        self.assertIn("must be ID=SEVERITY", self.one_error("check", "--rule", "al-refused", self.healthy))
        self.assertIn("must be error, warning, info or never", self.one_error("check", "--fail-on", "err", self.healthy))

    def test_a_folder_is_for_batch(self):
        for command in ("check", "startup"):
            self.assertEqual(self.one_error(command, self.dir), f"{self.dir} is a folder, not a capture; to check all "
                             f"captures in it: ecaudit batch {self.dir}")

    def test_a_file_that_begins_like_an_option(self):
        self.file("-a.pcapng", pathlib.Path(self.healthy).read_bytes())
        self.assertEqual(self.one_error("check", "-a.pcapng"),
                         "'-a.pcapng' begins like an option; to name the file: ./-a.pcapng")
        self.check("./-a.pcapng", status=0)
        self.check("--", "-a.pcapng", status=0)
        self.assertIn("unknown option", self.one_error("check", "-b.pcapng", self.healthy))

    def test_version_names_the_libraries_that_run(self):
        page = self.run_program("--version").out
        self.assertRegex(page, r"(?m)^libraries  libpcap \S+, zlib \S+, zstd \S+, Qt \S+, ")
        self.assertRegex(page, r"(?m)^runs with  libpcap \d\S+, zlib \d\S+, zstd \d\S+, Qt \d\S+$")

    def test_bad_slave(self):
        for text in ("-1", "0x", "70000", "0x12345", "1.5"):
            self.assertIn("is not a slave", self.one_error("check", f"--slave={text}", self.healthy))
        self.assertIn("has no slave 7", self.one_error("check", "--slave", "7", self.healthy))

    def test_values_for_a_slave_that_is_not_there(self):
        given = ("--profile", "9=generic", "--parameter", "9:PTBASE=1", "--parameter", "0x1F00:PTBASE=1")
        done = self.run_program("check", *given, self.healthy)
        self.assertEqual(done.returncode, 0, done.err)
        for slave in ("9", "0x1f00"):
            self.assertEqual(done.err.count(f"has no slave {slave}: the profile and the parameters given for it"), 1,
                             done.err)
        self.assertEqual(self.run_program("check", "--profile", "0=generic", self.healthy).err, "")

    def test_bad_range(self):
        for text in ("x", "-1", "#0", "#", "#1.5", "nan", "inf", "1e999"):
            self.assertIn("--from is", self.one_error("check", f"--from={text}", self.healthy))
        self.assertIn("--from is later than --to", self.one_error("check", "--from", "5", "--to", "3", self.healthy))
        self.assertIn("--from is later than --to", self.one_error("check", "--from", "#5", "--to", "#3", self.healthy))

    def test_unknown_format(self):
        self.assertEqual(self.one_error("check", "--format", "jsn", self.healthy),
                         "unknown format 'jsn' (did you mean 'json'?)")
        self.assertIn("unknown format 'jsn'", self.one_error("check", "-o", "jsn=x.json", self.healthy))

    def test_a_range_beside_the_capture(self):
        for options in (("--from", "#99999"), ("--from", "999"), ("--to", "0.5", "--from", "0.4")):
            typed = " ".join(options) if options[0] == "--from" else "--from 0.4 --to 0.5"
            for command in ("check", "startup", "events", "signals"):
                error = self.one_error(command, *options, self.faulty)
                self.assertEqual(error, f"{self.faulty}: no packet of the capture lies in the range {typed}")
            done = self.run_program("decode", *options, self.faulty)
            self.assertEqual(done.returncode, 2)
            self.assertIn("no packet of the capture lies in the range", done.err)
        self.assertIn("lies in the range", self.one_error("diff", "--from", "999", self.healthy, self.faulty))
        done = self.run_program("decode", "--frames", "99999", self.faulty)
        self.assertEqual((done.returncode, "lies in the range --from #99999 --to #99999" in done.err), (2, True))
        self.check("--from", "#99999", self.faulty, "-o", "json=r.json", status=2)
        self.assertIn("lies in the range", json.loads((self.dir / "r.json").read_text())["unreadable"][0]["message"])
        done = self.run_program("batch", "--from", "999", self.faulty)
        self.assertEqual(done.returncode, 2)
        self.assertIn("lies in the range --from 999", done.err)
        # A file without any packet is not blamed on the range.
        empty = self.file("none.pcap", healthy_capture()[:24])
        self.assertIn("no EtherCAT frame among 0 packets", self.check("--from", "1", empty, status=0).err)

    def test_some_of_several_slaves_missing(self):
        done = self.check("--slave", "0", "--slave", "7", self.healthy, status=0)
        self.assertEqual(done.err, f"ecaudit: warning: {self.healthy} has no slave 7\n")

    def test_slice_wants_one_of_two(self):
        for given in ((), ("--finding", "f1", "--frames", "3-5")):
            error = self.one_error("slice", self.faulty, *given, "-o", "x.pcapng")
            self.assertEqual("not both" in error, bool(given), error)

    def test_full_needs_a_profile(self):
        self.assertIn("needs the NAME", self.one_error("profiles", "--full"))

    def test_control_characters_do_not_reach_the_terminal(self):
        self.assertNotIn("\x1b", self.one_error("check", "\x1b[31mred.pcap"))


class Input(CliTest):
    def test_standard_input(self):
        done = self.run_program("check", "-", input=healthy_capture())
        self.assertEqual(done.returncode, 0, done.err)

    def test_standard_input_once(self):
        self.assertIn("only once", self.one_error("check", "-", "-"))

    def test_standard_input_without_capture(self):
        done = self.run_program("check", "-", input=b"text, not packets")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(done.err.count("\n"), 1, done.err)

    def test_gzip_reads_alike(self):
        packed = self.file("packed.pcap.gz", gzip.compress(healthy_capture()))
        plain_report = self.report(self.healthy, status=0)["reports"][0]
        packed_report = self.report(packed, status=0)["reports"][0]
        for report in (plain_report, packed_report):
            del report["capture"]["path"], report["capture"]["format"]
        self.assertEqual(plain_report, packed_report)

    def test_several_captures(self):
        report = self.report(self.healthy, self.faulty, status=1)
        self.assertEqual([r["summary"]["verdict"] for r in report["reports"]], ["pass", "fail"])
        self.assertEqual(report["summary"]["captures"], 2)
        self.assertEqual(report["summary"]["verdict"], "fail")

    def test_an_unreadable_capture_does_not_hide_the_others(self):
        done = self.check("--format", "json", "nowhere.pcap", self.faulty, status=2)
        self.assertIn('"captures": 1', done.out)
        self.assertEqual(done.err, "ecaudit: no such file: nowhere.pcap\n")

    def test_text_names_what_could_not_be_read(self):
        out = self.check(self.healthy, "nowhere.pcap", status=2).out
        self.assertTrue(out.startswith("PASS "), out)
        self.assertTrue(out.endswith("\nERROR nowhere.pcap: no such file: nowhere.pcap\n"), out)

    def test_files_tell_when_nothing_could_be_read(self):
        for name in ("json", "junit", "sarif", "text"):
            error = self.one_error("check", "nowhere.pcap", "-o", f"{name}=report", "--write-baseline", "known.json")
            self.assertEqual(error, "no such file: nowhere.pcap")
            self.assertIn("no such file: nowhere.pcap", (self.dir / "report").read_text(), name)
        self.assertFalse((self.dir / "known.json").exists())

    def test_standard_output_gets_the_same_document(self):
        for command in ("check", "startup"):
            for name in ("json", "junit", "sarif", "github", "gitlab"):
                done = self.run_program(command, "nowhere.pcap", "-o", f"{name}=report", "-o", f"{name}=-")
                self.assertEqual((done.returncode, done.err), (2, "ecaudit: no such file: nowhere.pcap\n"))
                self.assertEqual(done.out, (self.dir / "report").read_text(), name)
                self.assertIn("no such file", done.out)
                self.assertEqual(self.run_program(command, "nowhere.pcap", "--format", name).out, done.out)

    def test_what_cannot_be_read_is_no_pass(self):
        for captures in (("nowhere.pcap",), ("nowhere.pcap", self.healthy)):
            summary = json.loads(self.check("--format", "json", *captures, status=2).out)["summary"]
            self.assertEqual(summary["verdict"], "incomplete")
        self.assertEqual(json.loads(self.check("--format", "json", "nowhere.pcap", self.faulty, status=2).out)
                         ["summary"]["verdict"], "fail")
        last = self.check("nowhere.pcap", self.healthy, self.healthy, status=2).out.splitlines()[-1]
        self.assertTrue(last.startswith("INCOMPLETE 2 captures, 0 failed, 1 could not be read"), last)

    def test_joined_captures(self):
        report = self.report("--join", self.healthy, self.faulty, status=1)
        self.assertEqual(len(report["reports"]), 1)
        packets = [self.report(c, "--fail-on", "never", status=0)["reports"][0]["capture"]["packets"]
                   for c in (self.healthy, self.faulty)]
        self.assertEqual(report["reports"][0]["capture"]["packets"], sum(packets))

    def test_standard_input_from_a_file_is_joined(self):
        for order in (("-", self.healthy), (self.healthy, "-")):
            with open(self.faulty, "rb") as given:
                done = self.run_program("check", "--format", "json", "--join", *order, stdin=given)
            self.assertEqual(done.returncode, 1, done.err)
            joined = json.loads(done.out)["reports"][0]["capture"]
            parts = [self.report(c, "--fail-on", "never", status=0)["reports"][0]["capture"]["packets"]
                     for c in (self.healthy, self.faulty)]
            self.assertEqual(joined["packets"], sum(parts))
            self.assertIsNone(joined["damage"])
        self.assertIn("standard input is empty", self.one_error("check", "--join", "-", self.healthy))

    def test_no_ethercat_for_startup_and_diff(self):
        path = self.file("foreign.pcap", foreign_capture())
        self.assertEqual(self.one_error("startup", path), f"{path}: no EtherCAT frame among 3 packets")
        self.assertEqual(self.one_error("diff", self.healthy, path), f"{path}: no EtherCAT frame among 3 packets")

    def test_no_ethercat(self):
        path = self.file("foreign.pcap", foreign_capture())
        done = self.check(path, status=0)
        self.assertTrue(done.out.startswith(f"NOTHING-TO-CHECK {path}: no EtherCAT frame among 3 packets\n"), done.out)
        self.assertIn("no EtherCAT frame", done.err)
        report = self.report(path, status=0)["reports"][0]
        self.assertEqual(report["capture"]["packets"], 3)
        self.assertEqual(report["capture"]["ethercat_frames"], 0)
        self.assertEqual(report["slaves"], [])

    def test_truncated_capture_is_read_up_to_the_damage(self):
        path = self.file("cut.pcap", healthy_capture()[:-7])
        report = self.report(path, "--fail-on", "never", status=0)["reports"][0]
        self.assertFalse(report["capture"]["complete"])
        self.assertIsNotNone(report["capture"]["damage"])
        self.assertGreater(report["capture"]["ethercat_frames"], 0)

    def test_range(self):
        whole = self.report(self.healthy, status=0)["reports"][0]["capture"]["ethercat_frames"]
        part = self.report(self.healthy, "--from", "#3", "--to", "#10", "--isolate",
                           status=0)["reports"][0]["capture"]
        self.assertLess(part["ethercat_frames"], whole)
        self.assertEqual(part["ethercat_frames"], 8)

    def test_clock_times(self):
        # The capture begins on 2019-05-01 at 12:00:00 UTC, a packet every 20 us or 980 us.
        def frames(*given, env=None):
            done = subprocess.run([PROGRAM, "decode", "--format", "jsonl", *given, self.healthy], capture_output=True,
                                  text=True, cwd=self.dir, env={**os.environ, "TZ": "UTC", **(env or {})})
            self.assertEqual(done.returncode, 0, done.stderr)
            return [json.loads(line)["frame"] for line in done.stdout.splitlines()]

        whole = frames()
        self.assertEqual(frames("--from", "12:00:00.002", "--to", "12:00:00.004"), frames("--from", "0.002", "--to", "0.004"))
        self.assertEqual(frames("--from", "11:59"), whole)
        self.assertEqual(frames("--to", "2019-05-01T12:00:00.002Z"), frames("--to", "0.002"))
        self.assertEqual(frames("--to", "2019-05-01 14:00:00.002+02:00"), frames("--to", "0.002"))
        berlin = {"TZ": "CET-1CEST,M3.5.0,M10.5.0/3"}
        self.assertEqual(frames("--time=local", "--to", "14:00:00.002", env=berlin), frames("--to", "0.002"))
        self.assertEqual(frames("--around", "#7", "--window", "0.001"), [5, 6, 7, 8, 9])
        self.assertEqual(frames("--around", "12:00:00.003", "--window=0.001"), frames("--from", "0.002", "--to", "0.004"))
        self.assertEqual(frames("--around", "0.003"), whole)
        part = self.report(self.healthy, "--from", "12:00:00.002", status=0)["reports"][0]
        self.assertEqual(part["settings"]["range"]["from_s"], 0.002)
        for given in (("--from", "14:00"), ("--to", "2018-01-01")):
            self.assertIn("lies in the range", self.check(self.healthy, *given, status=2).err)
        for given in (("--around", "#7", "--from", "1"), ("--window", "1"), ("--around", "#7", "--window", "x"),
                      ("--from", "12:00:00.004", "--to", "12:00:00.002"), ("--around", "#7000"), ("--from", "25:00")):
            done = self.check(self.healthy, *given, status=2)
            self.assertEqual((done.out, len(done.err.splitlines())), ("", 1), done.err)
        content = pathlib.Path(self.healthy).read_bytes()
        done = subprocess.run([PROGRAM, "check", "--from", "12:00:01", "-"], input=content, capture_output=True)
        self.assertEqual(done.returncode, 2)
        self.assertIn(b"can be read only once", done.stderr)
        done = subprocess.run([PROGRAM, "decode", "--format=jsonl", "--to", "12:00:00.002", "-"], input=content, capture_output=True)
        self.assertEqual([json.loads(line)["frame"] for line in done.stdout.splitlines()], frames("--to", "0.002"))

    def test_what_was_left_out_is_said(self):
        given = ("--slave", "0", "--from", "#3", "--to", "1.5")
        limits = "limited by --slave 0 --from #3 --to 1.5"
        text = self.check(self.healthy, *given, status=0).out
        self.assertIn(limits, "\n".join(text.splitlines()[:4]))
        self.assertIn(limits, text.split("Capture")[-1])
        settings = self.report(self.healthy, *given, status=0)["reports"][0]["settings"]
        self.assertEqual(settings["slaves"], ["0"])
        self.assertEqual(settings["range"], {
            "from_s": None, "to_s": 1.5, "from_frame": 3, "to_frame": None, "isolated_by": None,
            "outside": {"errors": 0, "warnings": 0, "infos": 0}})
        self.check(self.healthy, *given, "-o", "a.json", "-o", "html=a.html", "-o", "junit=a.xml", status=0)
        for name in ("a.html", "a.xml"):
            self.assertIn(limits[11:], (self.dir / name).read_text())
        merged = self.run_program("merge", "a.json")
        self.assertIn(limits, merged.out)
        self.assertIn("limited by --to #4", "\n".join(self.check(self.faulty, "--to", "#4", status=0).out.splitlines()[:4]))
        plain = self.report(self.healthy, status=0)["reports"][0]["settings"]
        self.assertEqual((plain["slaves"], plain["range"], plain["judged"]), ([], None, "all"))
        self.assertNotIn("limited", self.check(self.healthy, status=0).out)

    def test_interrupted(self):
        # Packets without end, until the program is told to stop.
        header, packets = healthy_capture()[:24], healthy_capture()[24:]
        with subprocess.Popen([PROGRAM, "check", "-"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, cwd=self.dir) as child:

            reads = threading.Event()

            def feed():
                try:
                    child.stdin.write(header)
                    for n in itertools.count():
                        child.stdin.write(packets)
                        if n == 1000:  # more than pipes hold
                            reads.set()
                except BrokenPipeError:
                    pass

            feeder = threading.Thread(target=feed)
            feeder.start()
            self.assertTrue(reads.wait(timeout=60))
            child.send_signal(signal.SIGINT)
            out, err = child.stdout.read(), child.stderr.read()
            child.wait(timeout=60)
            feeder.join(timeout=60)
            try:
                child.stdin.close()
            except BrokenPipeError:
                pass
        self.assertEqual(child.returncode, 130, err)
        self.assertIn(b"interrupted", err)
        self.assertIn(b"the report covers only", out)
        self.assertNotIn(b"damaged", out)
