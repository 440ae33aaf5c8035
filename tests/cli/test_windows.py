"""--from, --to, --around: the whole capture is evaluated, and a window shows every finding whose frames lie in it."""
import json
import pathlib
import unittest

from support import SHARED, SOURCE, CliTest

SAMPLES = SOURCE / "samples" / "captures"
REFUSED = SAMPLES / "init-to-op-refused.pcapng"
LAB = SHARED / "captures" / "lab"
MOST_WINDOWS = 4  # of one capture


def key(finding) -> tuple:
    return finding["rule"], finding["slave"], finding["frame"], finding["title"], finding["count"]


class Windows(CliTest):
    def findings(self, capture, *options):
        done = self.run_program("check", "--format", "json", *options, capture)
        self.assertIn(done.returncode, (0, 1), f"{capture} {options}: {done.err}")
        return json.loads(done.out)["reports"][0]

    def holds(self, capture):
        """The law: what lies in a window is in its report, as it is in the report of the whole capture."""
        whole = self.findings(capture)["findings"]
        step = max(1, len(whole) // MOST_WINDOWS)
        for at in sorted({f["frame"] for f in whole if f["frame"] is not None})[::step][:MOST_WINDOWS]:
            frames = range(max(1, at - 20), at + 21)
            part = self.findings(capture, "--from", f"#{frames[0]}", "--to", f"#{frames[-1]}")
            there = {key(f) for f in part["findings"]}
            missing = [f for f in whole if key(f) not in there and f["frame"] is not None
                       and any(n in frames for n in [f["frame"], f["last_frame"], *f["related_frames"]])]
            self.assertEqual(missing, [], f"{capture} {frames}")
            outside = part["settings"]["range"]["outside"]
            self.assertEqual(len(there) + sum(outside.values()), len(whole), f"{capture} {frames}")

    def test_samples_lose_no_finding(self):
        for path in sorted(SAMPLES.glob("*.pcapng")):
            with self.subTest(capture=path.name):
                self.holds(path)

    def test_lab_captures_lose_no_finding(self):
        if not LAB.is_dir():
            self.skipTest("the lab captures are not beside the project")
        for path in sorted(LAB.glob("*.pcapng")):
            if path.name.startswith(("empty", "garbage")):
                continue
            with self.subTest(capture=path.name):
                self.holds(path)

    def fails(self, capture, *options):
        done = self.run_program("check", "--quiet", *options, capture)
        return done.returncode == 1

    def is_no_pass_of_what_isolate_shows(self, capture):
        """The law: an error that a range shows by itself may not be a PASS where the whole capture is evaluated."""
        whole = self.findings(capture)
        last = whole["capture"]["packets"]
        starts = {1 + last * part // 4 for part in range(4)}
        starts |= {f["last_frame"] + 1 for f in whole["findings"] if f["severity"] == "error" and f["frame"]}
        for start in sorted(starts)[:MOST_WINDOWS + 2]:
            for end in {last, min(last, start + max(10, last // 8))}:
                window = ("--from", f"#{start}", "--to", f"#{end}")
                if start <= last and self.fails(capture, *window, "--isolate"):
                    self.assertTrue(self.fails(capture, *window), f"{capture} {window}")

    def test_no_pass_of_an_error_that_stands(self):
        for path in sorted(SAMPLES.glob("*.pcapng")):
            with self.subTest(capture=path.name):
                self.is_no_pass_of_what_isolate_shows(path)

    def test_a_condition_shows_as_long_as_it_lasts(self):
        for name, options, rule in (
                ("drive-in-fault", ("--from", "#250", "--to", "#260"), "drive-fault"),
                ("broadcast-shows-all-fall", ("--from", "#487"), "al-unexpected-change"),
                ("branch-slave-leaves", ("--from", "#567"), "bus-slave-count-changed")):
            with self.subTest(name):
                part = self.findings(SAMPLES / f"{name}.pcapng", *options)
                self.assertIn(rule, [f["rule"] for f in part["findings"]])
                self.assertEqual(part["summary"]["verdict"], "fail")

    def named(self, report):
        """The ids that a report names."""
        ids = {f["caused_by"] for f in report["findings"]}
        for slave in report["slaves"]:
            for ladder in (slave["progress"], *(axis["progress"] for axis in slave["axes"])):
                ids |= {rung["finding"] for rung in ladder}
        return ids - {None}

    def test_every_id_that_a_report_names_is_in_it(self):
        some = False
        for path in sorted(SAMPLES.glob("*.pcapng")):
            whole = self.findings(path)
            ids = {f["id"]: key(f) for f in whole["findings"]}
            frames = sorted({f["frame"] for f in whole["findings"] if f["frame"] is not None})
            windows = [("--from", f"#{at}", "--to", f"#{at}") for at in frames[:2] + frames[-1:]]
            windows += [("--slave", str(s["position"])) for s in whole["slaves"][:2]]
            for options in ((), *windows):
                with self.subTest(capture=path.name, options=options):
                    part = self.findings(path, *options)
                    there = {f["id"]: key(f) for f in part["findings"]}
                    self.assertLessEqual(self.named(part), set(there))
                    # And they are those of the whole capture, which slice uses.
                    self.assertEqual({i: ids[i] for i in there}, there)
                    some = some or bool(self.named(part))
        self.assertTrue(some)

    def test_slice_finds_what_a_window_shows(self):
        capture = SAMPLES / "sdo-aborts.pcapng"
        finding, *_ = self.findings(capture, "--from", "#163", "--to", "#163")["findings"]
        self.assertNotEqual(finding["id"], "f1")
        done = self.run_program("slice", "--finding", finding["id"], "-o", "part.pcapng", capture)
        self.assertEqual(done.returncode, 0, done.err)
        comment = f"{finding['id']} error {finding['rule']}"
        self.assertIn(comment.encode(), (self.dir / "part.pcapng").read_bytes())

    def test_merge_reads_the_ids_of_a_window(self):
        capture = SAMPLES / "pdo-assign-order.pcapng"
        last = max((f for f in self.findings(capture)["findings"] if f["caused_by"]), key=lambda f: f["frame"])
        self.check("--from", f"#{last['frame']}", "-o", "part.json", capture, status=1)
        done = self.run_program("merge", "part.json", "-o", "junit=-")
        self.assertIn(last["rule"], done.out)
        self.assertIn("consequence", done.out.lower())

    def test_a_baseline_is_of_whole_captures(self):
        self.check("--write-baseline", "known.json", REFUSED, status=1)
        before = (self.dir / "known.json").read_text()
        self.check("--to", "#100", "-o", "part.json", REFUSED, status=0)
        for options in (("--slave", "0"), ("--from", "#1"), ("--to", "#100"), ("--around", "#100")):
            for command in (("check",), ("batch", "--output-dir", "r")):
                error = self.one_error(*command, "--write-baseline", "known.json", *options, REFUSED)
                self.assertIn(f"--write-baseline does not work with {options[0]}", error)
        error = self.one_error("merge", "--write-baseline", "known.json", "part.json")
        self.assertIn("shows a part of the capture (--to #100)", error)
        self.assertEqual((self.dir / "known.json").read_text(), before)

    def test_the_first_line_is_of_the_range(self):
        line = self.check("--to", "#100", SAMPLES / "drive-in-fault.pcapng", status=0).out.splitlines()[0]
        self.assertEqual(line, "PASS drive-in-fault.pcapng: no findings in the range (outside it: 1 error) "
                               "(limited by --to #100)")

    def test_slaves_that_are_not_selected_are_known(self):
        text = self.check("--slave", "1", SAMPLES / "restart-wrong-cycle.pcapng", status=1).out
        self.assertIn("; 1 slave;", text)

    def test_causes_come_with_what_they_caused(self):
        whole = self.findings(SAMPLES / "pdo-assign-order.pcapng")["findings"]
        caused = [f for f in whole if f["caused_by"] is not None]
        self.assertTrue(caused)
        by_id = {f["id"]: f for f in whole}
        last = max(caused, key=lambda f: f["frame"])
        part = self.findings(SAMPLES / "pdo-assign-order.pcapng", "--from", f"#{last['frame']}")["findings"]
        self.assertIn(key(by_id[last["caused_by"]]), [key(f) for f in part])

    def test_a_drive_fault_shows_in_any_window_around_it(self):
        if not LAB.is_dir():
            self.skipTest("the lab captures are not beside the project")
        for window in ("1.5", "0.5", "0.01"):
            done = self.check("--around", "#3560", "--window", window, LAB / "drive-fault.pcapng", status=1)
            self.assertIn("Fault", done.out.splitlines()[0])

    def test_what_lies_outside_is_counted(self):
        whole = self.findings(REFUSED)["findings"]
        first = min(n for f in whole for n in [f["frame"], *f["related_frames"]])
        part = self.findings(REFUSED, "--to", f"#{first - 1}")
        self.assertEqual(part["findings"], [])
        self.assertEqual(part["summary"]["verdict"], "pass")
        self.assertEqual(sum(part["settings"]["range"]["outside"].values()), len(whole))
        text = self.check("--to", f"#{first - 1}", REFUSED, status=0).out
        self.assertIn("outside it: ", text)
        self.check("--to", f"#{first - 1}", REFUSED, "-o", "part.json", status=0)
        self.assertIn("outside it: ", self.run_program("merge", "part.json").out)

    def test_the_rest_of_the_report_is_of_the_whole_capture(self):
        whole = self.findings(REFUSED)
        part = self.findings(REFUSED, "--from", "#20", "--to", "#21")
        for section in ("capture", "bus", "slaves", "coverage"):
            self.assertEqual(part[section], whole[section], section)

    def test_isolate_evaluates_the_range_alone(self):
        part = self.findings(REFUSED, "--from", "#20", "--to", "#40", "--isolate")
        self.assertEqual(part["capture"]["packets"], 21)
        self.assertEqual(part["settings"]["range"]["isolated_by"], "--isolate")
        text = self.check("--from", "#100", "--isolate", "--fail-on=never", REFUSED, status=0).out
        self.assertIn("packets outside it were not evaluated (--isolate)", " ".join(text.split()))
        self.assertNotIn("from before the master starts", text)
        self.assertIn("--isolate belongs to --from", self.one_error("check", "--isolate", REFUSED))

    def test_a_start_up_reads_the_range_alone_and_says_so(self):
        text = self.run_program("startup", "--from", "#20", REFUSED).out
        self.assertIn("packets outside it were not evaluated (startup)", " ".join(text.split()))

    def test_times_have_no_digits_below_a_nanosecond(self):
        # Frame 7 is 3.060 ms after the first one, and the window is 0.1 ms.
        part = self.findings(self.healthy, "--around", "#7", "--window", "0.0001")["settings"]["range"]
        self.assertEqual((part["from_s"], part["to_s"]), (0.0029, 0.0031))
        text = self.check("--around", "#7", "--window", "0.0001", self.healthy, status=0).out
        self.assertIn("limited by --from 0.0029 --to 0.0031", text)

    def test_a_clock_time_before_the_capture(self):
        done = self.check("--from", "11:59", self.healthy, status=0)
        self.assertIn("--from is 60.000 s before the first packet, which is of 2019-05-01T12:00:00", done.err)
        self.assertEqual(self.check("--from", "12:00:00.001", self.healthy, status=0).err, "")
        for options in (("--to", "11:59"), ("--around", "11:59")):
            error = self.one_error("check", *options, self.healthy)
            self.assertIn("s before the first packet, which is of 2019-05-01T12:00:00", error)
        done = self.run_program("batch", "--from", "11:59", "--output-dir", "reports", self.healthy)
        self.assertIn("--from is 60.000 s before the first packet", done.err)
        self.assertIn("before the first packet", self.run_program("decode", "--from", "11:59", self.healthy).err)

    def test_a_batch_evaluates_whole_captures_too(self):
        first = min(n for f in self.findings(REFUSED)["findings"] for n in [f["frame"], *f["related_frames"]])
        for options, outside in (((), True), (("--isolate",), False)):
            done = self.run_program("batch", "--to", f"#{first - 1}", *options, "--output-dir", "reports", REFUSED)
            self.assertEqual(done.returncode, 0, done.err)
            self.assertEqual("outside it: " in " ".join(done.out.split()), outside)


if __name__ == "__main__":
    unittest.main()
