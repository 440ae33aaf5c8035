"""What Wireshark shows with the plugin: the values of `signals`, the events and the findings of the report."""
import csv
import io
import json
import os
import shutil
import subprocess
import unittest

from support import SHARED, SOURCE, CliTest

SAMPLES = SOURCE / "samples" / "captures"
PLUGIN = SOURCE / "cli" / "wireshark" / "ecaudit.lua"


class PluginTest(CliTest):
    def setUp(self):
        super().setUp()
        self.home = self.dir / "home"
        self.home.mkdir()
        self.environment = {**os.environ, "HOME": str(self.home), "ECAUDIT_LUA_ERRORS": "1"}
        for name in ("APPDATA", "XDG_CONFIG_HOME", "WIRESHARK_CONFIG_DIR"):
            self.environment.pop(name, None)

    def side_of(self, capture, *arguments):
        """A copy of the capture with its side file."""
        copy = self.dir / capture.name
        shutil.copy(capture, copy)
        done = self.run_program("wireshark", copy, *arguments, env=self.environment)
        self.assertEqual(done.returncode, 0, done.err)
        return copy


class PluginFolders(PluginTest):
    def test_install_writes_plugin_profile_and_lists(self):
        self.side_of(SAMPLES / "drive-fault.pcapng", "--install")
        plugins = self.home / ".local" / "lib" / "wireshark" / "plugins"
        profile = self.home / ".config" / "wireshark" / "profiles" / "ecaudit"
        self.assertEqual((plugins / "ecaudit.lua").read_bytes(), PLUGIN.read_bytes())
        self.assertIn("s0.status_word\tn\tS0.Status word\n", (plugins / "ecaudit-signals.txt").read_text())
        self.assertIn("drive-fault.pcapng.ecaudit\n", (plugins / "ecaudit-captures.txt").read_text())
        self.assertIn("ecaudit.finding", (profile / "colorfilters").read_text())
        (profile / "preferences").write_text("mine")
        self.side_of(SAMPLES / "drive-fault.pcapng", "--install")
        self.assertEqual((profile / "preferences").read_text(), "mine")
        self.assertEqual((plugins / "ecaudit-captures.txt").read_text().count("\n"), 1)

    def test_without_plugin_only_the_side_file_is_written(self):
        self.side_of(SAMPLES / "drive-fault.pcapng")
        self.assertEqual(list(self.home.iterdir()), [])

    def test_only_a_side_file_is_replaced(self):
        copy = self.side_of(SAMPLES / "drive-fault.pcapng")
        self.side_of(SAMPLES / "drive-fault.pcapng")
        other = self.file("notes", "mine")
        self.assertIn("is no side file", self.one_error("wireshark", copy, "-o", other, env=self.environment))
        self.assertIn("one capture", self.one_error("wireshark", copy, copy, env=self.environment))
        self.assertIn("in a file", self.one_error("wireshark", "-", env=self.environment))


@unittest.skipIf(shutil.which("tshark") is None, "tshark is not installed")
class PluginInWireshark(PluginTest):
    def tshark(self, capture, *arguments, side=None):
        command = ["tshark", "-X", f"lua_script:{PLUGIN}", "-X", f"lua_script1:{side or str(capture) + '.ecaudit'}",
                   "-r", str(capture), *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=self.environment)
        errors = [line for line in done.stderr.splitlines() if "ua" in line and "Running as" not in line]
        self.assertEqual(errors, [])
        return done.stdout

    def fields(self, capture, *names, only="", side=None):
        arguments = ["-T", "fields", *(["-Y", only] if only else [])]
        for name in ("frame.number", *names):
            arguments += ["-e", name]
        return [line.split("\t") for line in self.tshark(capture, *arguments, side=side).splitlines()]

    def assert_agreement(self, original):
        capture = self.side_of(original)
        done = self.run_program("check", "--format", "json", capture)
        findings = json.loads(done.out)["reports"][0]["findings"]
        expected = sorted((f["frame"], f["rule"], f["severity"]) for f in findings if f["frame"])
        shown = []
        for frame, rules, severities in self.fields(capture, "ecaudit.finding.rule", "ecaudit.finding.severity",
                                                    only="ecaudit.finding"):
            shown += [(int(frame), *pair) for pair in zip(rules.split(","), severities.split(","))]
        self.assertEqual([e for e in expected if e not in shown], [], original)
        self.assertLessEqual({s[1] for s in shown}, {f["rule"] for f in findings})

        states = {}
        for line in self.run_program("events", "--format", "jsonl", "--type", "al-state", capture).out.splitlines():
            event = json.loads(line)
            if event["slave"] is not None and event.get("state"):
                name = event["state"] + ("+ERR" if event["error"] else "")
                states[event["frame"], f"S{event['slave']}"] = name
        changed = {}
        for frame, text in self.fields(capture, "ecaudit.al.changed", only="ecaudit.al.changed"):
            for item in text.split(","):
                slave, _, state = item.partition(" ")
                changed[int(frame), slave] = state
        self.assertEqual({key: changed.get(key) for key in states}, states, original)

        table = csv.reader(io.StringIO(self.run_program("signals", "--states", "--scaled", capture).out))
        titles = next(table, [])
        if "S0.Status word" not in titles:
            return 0
        column, frame = titles.index("S0.Status word"), titles.index("frame")
        values = [(row[frame], float(row[column])) for row in table if row[column]]
        status = [(row[0], float(row[1])) for row in self.fields(capture, "ecaudit.signal.s0.status_word",
                                                                 only="ecaudit.signal.s0.status_word")]
        self.assertEqual(status, values, original)
        return len(values)

    def test_samples_agree(self):
        rows = 0
        for name in ("drive-fault", "sdo-aborts", "clean-mixed-bus", "falls-out-of-op", "two-slaves-one-refuses"):
            with self.subTest(name):
                rows += self.assert_agreement(SAMPLES / f"{name}.pcapng")
        self.assertGreater(rows, 90)

    def test_shared_captures_agree(self):
        captures = sorted((SHARED / "captures" / "real").glob("*.pcap*"))[:3]
        if not captures:
            self.skipTest("captures not beside the project")
        for path in captures:
            with self.subTest(path.name):
                self.assert_agreement(path)

    def test_an_sdo_transfer_is_shown_in_both_its_frames(self):
        capture = self.side_of(SAMPLES / "sdo-aborts.pcapng")
        events = [json.loads(line) for line in
                  self.run_program("events", "--format", "jsonl", "--type", "sdo", capture).out.splitlines()]
        self.assertGreater(len(events), 3)
        frames = {int(row[0]) for row in self.fields(capture, "ecaudit.sdo", only="ecaudit.sdo")}
        self.assertEqual(frames, {e[key] for e in events for key in ("request_frame", "response_frame")})
        aborts = self.fields(capture, "ecaudit.sdo.index", "ecaudit.sdo.abort_code", only="ecaudit.sdo.abort_code")
        self.assertIn(["127", "0x10f1", "0x06020000"], aborts)

    def test_compressed_captures_have_the_same_numbers(self):
        import gzip
        path = self.dir / "fault.pcapng.gz"
        path.write_bytes(gzip.compress((SAMPLES / "drive-fault.pcapng").read_bytes()))
        self.assertEqual(self.run_program("wireshark", path, env=self.environment).returncode, 0)
        rows = self.fields(path, "ecaudit.finding.rule", only="ecaudit.finding")
        self.assertEqual(rows, [["292", "drive-fault"], ["296", "emcy-received"]])

    def test_expert_information_has_the_severity(self):
        capture = self.side_of(SAMPLES / "drive-fault.pcapng")
        table = self.tshark(capture, "-q", "-z", "expert,error")
        self.assertIn("Errors (2)", table)
        self.assertIn("f1 emcy-received, slave 0 (0x1001): Emergency 0x7305", table)

    def test_only_the_listed_fields_are_built(self):
        capture = self.side_of(SAMPLES / "drive-fault.pcapng")
        names = ("ecaudit.signal.s0.status_word", "ecaudit.al.state", "ecaudit.al.summary", "ecaudit.drive.state",
                 "ecaudit.signal.s0.control_word", "ecaudit.sdo", "ecaudit.finding.rule")
        whole = self.fields(capture, *names)
        self.assertTrue(all(any(row[column] for row in whole) for column in range(len(names) + 1)), whole)
        for listed, kept in (("ecaudit.signal.s0.status_word", {1}), ("ecaudit.al.*, ecaudit.signal.s0.c*", {2, 3, 5}),
                             ("ecaudit.drive.state,ecaudit.sdo", {4, 6}), ("none", set())):
            with self.subTest(listed):
                arguments = ["-o", f"ecaudit.only:{listed}", "-T", "fields", "-e", "frame.number"]
                for name in names:
                    arguments += ["-e", name]
                rows = [line.split("\t") for line in self.tshark(capture, *arguments).splitlines()]
                self.assertEqual(len(rows), len(whole))
                for column in kept | {7}:  # findings are few
                    self.assertEqual([row[column] for row in rows], [row[column] for row in whole], names[column - 1])
                for column in {2, 6} - kept:
                    self.assertEqual({row[column] for row in rows}, {""}, names[column - 1])

    def test_a_filter_and_an_open_tree_show_the_same(self):
        capture = self.side_of(SAMPLES / "drive-fault.pcapng")
        name = "ecaudit.signal.s0.status_word"
        values = {(row[0], row[1]) for row in self.fields(capture, name) if row[1]}
        self.assertGreater(len({value for _, value in values}), 3)
        for value in sorted({value for _, value in values}):
            shown = self.tshark(capture, "-Y", f"{name} == {value}").splitlines()
            self.assertEqual([line.split()[0] for line in shown],
                             sorted((frame for frame, other in values if other == value), key=int), value)

    def test_column_profile_and_colour_filters(self):
        capture = self.side_of(SAMPLES / "drive-fault.pcapng", "--install")

        def installed(*arguments):
            done = subprocess.run(["tshark", "-C", "ecaudit", "-r", str(capture), *arguments], capture_output=True,
                                  text=True, timeout=300, env=self.environment)
            self.assertEqual([line for line in done.stderr.splitlines() if "Running as" not in line], [])
            return done.stdout.splitlines()

        lines = installed()
        self.assertEqual(len(lines), 404)
        # The columns between source and info: AL state, drive state, SDO, finding.
        for text in (" OP ", " Operation enabled ", " Fault ", " S0 ", " f1 Emergency 0x7305"):
            self.assertTrue(any(text in line for line in lines), text)
        found = {}
        for line in (SOURCE / "cli" / "wireshark" / "colorfilters").read_text().splitlines():
            title, expression = line.split("@")[1:3]
            found[title] = installed("-Y", expression, "-T", "fields", "-e", "frame.number")
        self.assertEqual(found["ecaudit: stale side file"], [])
        self.assertEqual(found["ecaudit: error"], ["292", "296"])
        for title in ("ecaudit: error", "ecaudit: drive in Fault", "ecaudit: SDO", "ecaudit: AL state changes"):
            self.assertTrue(found[title], title)

    def test_stale_side_file_is_reported_and_not_used(self):
        capture = self.side_of(SAMPLES / "drive-fault.pcapng")
        shutil.copy(SAMPLES / "sdo-aborts.pcapng", self.dir / "drive-fault.pcapng")
        rows = self.fields(capture, "ecaudit.stale", "ecaudit.finding")
        self.assertIn("bytes when it was written", rows[0][1])
        self.assertIn("bytes when it was written", rows[-1][1])
        self.assertEqual({row[2] for row in rows}, {""})
        # A capture of the same begin elsewhere: its frames differ.
        other = self.dir / "other.pcapng"
        shutil.copy(SAMPLES / "sdo-aborts.pcapng", other)
        shutil.copy(SAMPLES / "drive-fault.pcapng", capture)
        rows = self.fields(other, "ecaudit.stale", side=str(capture) + ".ecaudit")
        self.assertIn("is not the one that was analysed", rows[-1][1])

    def test_missing_side_file_is_silent(self):
        rows = self.fields(SAMPLES / "drive-fault.pcapng", "ecaudit.stale", "ecaudit.al.state", side=self.dir / "none")
        self.assertEqual({tuple(row[1:]) for row in rows}, {("", "")})

    def test_hostile_side_files_raise_no_error(self):
        capture = self.side_of(SAMPLES / "drive-fault.pcapng")
        side = self.dir / "drive-fault.pcapng.ecaudit"
        whole = side.read_bytes()
        at = whole.rindex(b"section\tal\t")
        variants = [b"", b"garbage\n" * 100, whole[:-1], whole[:len(whole) // 2], b"ecaudit-side 9\n",
                    whole.replace(b"\t", b"\n"), whole.replace(b"layout\t0\t", b"layout\t0\t9999999999999999,"),
                    whole[:at] + whole[at:].replace(b"\t", b"\t99999999999999"),
                    whole.replace(b"0000000000000000", b"ffffffffffffffff"),
                    whole.replace(b"column\t", b"column\t9"), whole.replace(b"\t0=", b"\t99999999999999999999=")]
        variants += [whole[:k] + bytes([whole[k] ^ 0x15]) + whole[k + 1:] for k in range(20, len(whole), len(whole) // 12)]
        for number, content in enumerate(variants):
            with self.subTest(number):
                side.write_bytes(content)
                self.assertEqual(len(self.fields(capture, "ecaudit.al.state", "ecaudit.signal")), 404)


del PluginTest
