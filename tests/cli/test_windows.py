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
