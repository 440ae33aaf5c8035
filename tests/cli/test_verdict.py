"""The verdict with what it rests on: pass, limited or fail, how much was judged, and what --require asks for."""
import json
import re
import xml.etree.ElementTree as ET

from support import SOURCE, CliTest, Bus, foreign_capture, scanned_bus
from test_silent_loss import read, written

SAMPLES = SOURCE / "samples" / "captures"
LRW = 12


def process_data_only() -> bytes:
    """Frames with a logical address and nothing else: who they are for, they do not show."""
    bus = Bus()
    for n in range(20):
        bus.exchange(LRW, 0, 1, bytes([n, 0]), bytes([n, 1]), 3)
    return bus.pcap()


class Verdict(CliTest):
    def setUp(self):
        super().setUp()
        self.unknown = self.file("unknown.pcap", process_data_only())
        self.foreign = self.file("foreign.pcap", foreign_capture())

    def one(self, *arguments, status=0):
        return self.report(*arguments, status=status)["reports"][0]

    def test_limited_says_what_is_missing(self):
        done = self.check(self.unknown, status=0)
        self.assertRegex(done.out, r"^LIMITED \S+: no findings in 40 EtherCAT frames; no slave is known\n")
        summary = self.one(self.unknown)["summary"]
        self.assertEqual(summary["verdict"], "limited")
        self.assertEqual("no slave is known", summary["limited_because"])
        self.assertIsNone(self.one(self.healthy)["summary"]["limited_because"])

    def test_a_scan_that_reads_the_state_is_judged(self):
        self.assertEqual(self.one(self.healthy)["summary"]["verdict"], "pass")

    def test_nothing_to_check_is_limited(self):
        self.assertEqual(self.one(self.foreign)["summary"]["verdict"], "limited")
        self.assertTrue(self.check(self.foreign, status=0).out.startswith("NOTHING-TO-CHECK "))

    def test_a_slave_out_of_sight_behind_missing_packets(self):
        packets = read((SAMPLES / "process-data-stop.pcapng").read_bytes())
        left = packets[:len(packets) // 3] + packets[len(packets) // 2:]
        summary = self.one(self.file("hole.pcapng", written(left)))["summary"]
        self.assertEqual(summary["verdict"], "limited")
        self.assertIn("may have changed in a capture gap", summary["limited_because"])

    def test_a_drive_in_op_whose_process_data_are_out_of_sight(self):
        packets = read((SAMPLES / "master-igh.pcapng").read_bytes())
        in_op = 657  # so far
        # Packets are missing where the drives reach SAFEOP: their states are seen afterwards, their FMMUs are not.
        hole = self.file("start.pcapng", written(packets[:417] + packets[440:in_op]))
        report = self.one(hole)
        self.assertEqual({s["al"]["state"] for s in report["slaves"]}, {"OP"})
        self.assertEqual(report["summary"]["verdict"], "limited")
        self.assertIn("the process data of the drive in OP may have changed in a capture gap", report["summary"]["limited_because"])
        self.check(hole, "--require", "judged", status=1)
        # In SAFEOP, and where they run, what is known of the FMMUs stays so.
        for name, first, after in (("safeop.pcapng", 461, 464), ("run.pcapng", 572, 575)):
            summary = self.one(self.file(name, written(packets[:first] + packets[after:in_op])))["summary"]
            self.assertEqual((summary["verdict"], summary["limited_because"]), ("pass", None), name)

    def test_one_direction(self):
        outbound = self.one(SAMPLES / "outbound-only.pcapng")
        self.assertEqual(outbound["summary"]["verdict"], "limited")
        self.assertIn("the capture has no returned frames", outbound["summary"]["limited_because"])
        self.assertEqual(self.one(SAMPLES / "returned-only.pcapng")["summary"]["verdict"], "pass")

    def test_findings_decide_before_knowledge(self):
        done = self.check(SAMPLES / "outbound-only.pcapng", "--fail-on", "info", status=1)
        self.assertTrue(done.out.startswith("FAIL "))
        self.assertEqual(self.one(SAMPLES / "outbound-only.pcapng", "--fail-on", "info", status=1)["summary"]["verdict"],
                         "fail")

    def test_the_worst_of_several_counts(self):
        report = self.report(self.healthy, self.unknown, status=0)
        self.assertEqual(report["summary"]["verdict"], "limited")
        self.assertEqual(self.report(self.healthy, self.unknown, self.faulty, status=1)["summary"]["verdict"], "fail")

    def test_other_formats(self):
        suite = ET.fromstring(self.check("--format", "junit", self.unknown, status=0).out)[0]
        properties = {p.get("name"): p.get("value") for p in suite.find("properties")}
        self.assertEqual(properties["verdict"], "limited")
        run = json.loads(self.check("--format", "sarif", self.unknown, status=0).out)["runs"][0]
        notes = [n["message"]["text"] for n in run["invocations"][0]["toolExecutionNotifications"]]
        self.assertTrue(any(n.startswith("verdict limited: no slave is known") for n in notes))
        self.assertIn('"verdict":"LIMITED"', self.check("-o", "r.html", self.unknown, status=0).out
                      + (self.dir / "r.html").read_text())

    def test_batch_and_merge(self):
        done = self.run_program("batch", "-o", "json=s.json", "-o", "-", self.unknown, self.healthy)
        self.assertEqual(done.returncode, 0, done.err)
        summary = json.loads((self.dir / "s.json").read_text())
        self.assertEqual(summary["summary"]["verdict"], "limited")
        self.assertEqual((summary["summary"]["limited"], summary["summary"]["passed"]), (1, 1))
        status = {c["path"]: c["status"] for c in summary["captures"]}
        self.assertEqual(status, {self.unknown: "limited", self.healthy: "pass"})
        merged = self.run_program("merge", "--format", "json", "ecaudit-reports")
        self.assertEqual(json.loads(merged.out), summary)


class Coverage(CliTest):
    def coverage(self, *arguments, status=0):
        return self.report(*arguments, status=status)["reports"][0]["coverage"]

    def test_each_rule_once_for_a_slave(self):
        rules = {r["id"]: r["group"] for r in json.loads(self.run_program("rules", "--format", "json").out)["rules"]}
        for capture, slaves in ((SAMPLES / "clean-mixed-bus.pcapng", 3), (self.healthy, 1)):
            coverage = self.coverage(capture)
            states = ("judged", "partly", "not_judged", "not_applicable")
            self.assertEqual([r["rule"] for r in coverage["rules"]], sorted(rules))
            for rule in coverage["rules"]:
                whole = sum(rule[s] for s in states)
                bus = rules[rule["rule"]] in ("Capture", "Frame and bus")
                self.assertIn(whole, (1, slaves) if bus else (slaves,), rule)
                self.assertEqual(rule["not_applicable"] > 0, rule["not_applicable_because"] is not None, rule)
                if rule["slaves"] is not None:
                    listed = sorted(p for s in states for p in rule["slaves"][s])
                    self.assertEqual(listed, list(range(slaves)))
            for state in states:
                self.assertEqual(coverage[state], sum(r[state] for r in coverage["rules"]))
                self.assertEqual(coverage[state], sum(c[state] for c in coverage["by_chapter"]))
            self.assertEqual({c["chapter"] for c in coverage["by_chapter"]}, set(rules.values()))
            self.assertEqual(coverage["by_chapter"][0]["chapter"], "Capture")

    def test_what_was_not_judged_says_why(self):
        report = self.report(SAMPLES / "mid-run.pcapng", status=0)["reports"][0]
        said = {n["rule"] for n in report["not_evaluable"]}
        for rule in report["coverage"]["rules"]:
            if rule["not_judged"] + rule["partly"] > 0:
                self.assertIn(rule["rule"], said)

    def test_junit_skips_what_there_was_nothing_to_judge_of(self):
        suite = ET.fromstring(self.check("--format", "junit", self.healthy, status=0).out)[0]
        coverage = {r["rule"]: r for r in self.coverage(self.healthy)["rules"]}
        for case in suite.findall("testcase"):
            rule = coverage[case.get("name")]
            skipped = case.find("skipped")
            self.assertEqual(skipped is None, rule["judged"] > 0 and rule["partly"] + rule["not_judged"] == 0, rule)
        case = next(c for c in suite.findall("testcase") if c.get("name") == "sdo-abort")
        self.assertEqual(case.find("skipped").get("message"), "not applicable: the mailbox is not used")

    def test_two_frames_pass_next_to_nothing(self):
        bus = Bus()
        bus.exchange(LRW, 0, 1, b"\0\0", b"\0\0", 3)
        suite = ET.fromstring(self.check("--format", "junit", self.file("two.pcap", bus.pcap()), status=0).out)[0]
        tests, skipped = int(suite.get("tests")), int(suite.get("skipped"))
        self.assertLess(tests - skipped, 15)

    def test_text_tells_it_in_few_lines(self):
        for capture in (SAMPLES / "clean-mixed-bus.pcapng", SAMPLES / "mid-run.pcapng", self.healthy):
            out = self.check(capture, status=0).out
            lines = out[out.index("\nEvaluated "):].strip("\n").split("\n\n")[0].split("\n")[1:]
            self.assertLessEqual(len(lines), 4, lines)
            coverage = self.coverage(capture)
            applicable = coverage["judged"] + coverage["partly"] + coverage["not_judged"]
            self.assertTrue(lines[0].strip().startswith(f"{coverage['judged']} of {applicable}"), lines)
            self.assertIn(f"\nevaluated: {coverage['judged']} of {applicable}", out)
            sentence = " ".join(out[out.index("\nevaluated: "):].split("\n\n")[0].split())
            if coverage["not_judged"] == 0:
                self.assertNotIn("show enough", sentence)
                continue
            self.assertIn(f"for {coverage['not_judged']} the capture does not show enough (", sentence)
            named = [int(n) for n in re.findall(r": (\d+)(?=[,)])", sentence)]
            self.assertEqual(sum(named), coverage["not_judged"], sentence)
            self.assertLessEqual(len(named), 3, sentence)

    def test_slaves_that_are_left_out_do_not_count(self):
        whole = self.coverage(SAMPLES / "clean-mixed-bus.pcapng")
        one = self.coverage(SAMPLES / "clean-mixed-bus.pcapng", "--slave", "1")
        count = lambda c: sum(c[s] for s in ("judged", "partly", "not_judged", "not_applicable"))
        of_bus = sum(1 for r in whole["rules"] if count(r) == 1)
        self.assertEqual(count(whole) - of_bus, 3 * (count(one) - of_bus))

    def test_start_up_counts_its_own_rules(self):
        self.run_program("startup", "--save", "e.json", "-o", "x.txt", SAMPLES / "clean-startup.pcapng")
        done = self.run_program("startup", "--expect", "e.json", "--format", "json", SAMPLES / "clean-startup.pcapng")
        coverage = json.loads(done.out)["reports"][0]["coverage"]
        self.assertEqual([c["chapter"] for c in coverage["by_chapter"]], ["Start-up"])
        self.assertEqual(coverage["not_applicable"], 0)


class CaptureNext(CliTest):
    def advice(self, *arguments, status=0):
        report = self.report(*arguments, status=status)["reports"][0]
        counts = [a["judgements"] for a in report["capture_next"]]
        self.assertEqual(counts, sorted(counts, reverse=True))
        coverage = report["coverage"]
        self.assertLessEqual(sum(counts), coverage["not_judged"] + coverage["partly"])
        return [a["what"] for a in report["capture_next"]]

    def test_the_most_valuable_first(self):
        self.assertTrue(self.advice(SAMPLES / "mid-run.pcapng")[0].startswith("from before the master starts"))
        self.assertTrue(self.advice(SAMPLES / "outbound-only.pcapng")[0].startswith("both directions"))
        self.assertIn("1C12h", self.advice(SAMPLES / "clean-startup.pcapng")[0])
        self.assertTrue(any("stamps" in a for a in self.advice(SAMPLES / "coarse-timestamps.pcapng")))

    def test_three_lines_at_most(self):
        for capture in (SAMPLES / "clean-startup.pcapng", SAMPLES / "coarse-timestamps.pcapng"):
            out = self.check(capture, status=0).out
            lines = out[out.index("\nWhat to capture next"):].strip("\n").split("\n\n")[0].split("\n")[1:]
            self.assertTrue(all(len(line) <= 80 for line in lines), lines)
            texts = re.sub(r"\n {6}", " ", "\n".join(lines)).split("\n")
            self.assertEqual([text.strip().rsplit(" (", 1)[0] for text in texts], self.advice(capture)[:3])

    def test_of_the_slaves_that_are_selected(self):
        for text in self.advice(SAMPLES / "clean-mixed-bus.pcapng", "--slave", "1"):
            self.assertNotIn("slaves", text.replace("how slaves", ""))


class Require(CliTest):
    def setUp(self):
        super().setUp()
        self.unknown = self.file("unknown.pcap", process_data_only())

    def test_met(self):
        for what in ("slaves=1", "state=INIT", "judged", "slaves=1,state=INIT,judged", "judged,slaves=1"):
            done = self.check(self.healthy, "--require", what, status=0)
            self.assertTrue(done.out.startswith("PASS "), done.out)
            self.assertEqual(done.err, "")

    def test_rungs_of_axes_and_synchronisation(self):
        enabled = SAMPLES / "drive-illegal-command.pcapng"  # enabled in the end
        self.check(enabled, "--require", "axis=enabled", status=0)
        done = self.check(self.healthy, "--require", "axis=enabled", status=1)
        self.assertIn("axis=enabled: ", done.err)
        done = self.check(self.healthy, "--require", "sync=ok", status=1)
        self.assertIn("sync=ok: the capture shows no slave with SYNC0", done.err)
        for wrong in ("axis=moving", "sync=yes", "axis=enabled,axis=enabled"):
            self.check(self.healthy, "--require", wrong, status=2)

    def test_missing_is_said_everywhere(self):
        what = "slaves=2,state=OP,judged"
        done = self.check(self.healthy, "--require", what, status=1)
        first = done.out.splitlines()[0]
        self.assertTrue(first.startswith("UNMET "), first)
        self.assertIn("required and missing: slaves=2", first)
        missing = ["slaves=2: 1 slave answers broadcasts at the end", "state=OP: slave 0 is in INIT at the end"]
        for text in missing:
            self.assertIn(text, " ".join(done.out.split("\n\n")[0].split()))
            self.assertIn(f"ecaudit: {self.healthy}: required and missing: {text}\n", done.err)
        report = self.report(self.healthy, "--require", what, status=1)["reports"][0]
        self.assertEqual(report["required"], {"asked": what, "met": False, "missing": missing})
        self.assertEqual(report["summary"]["verdict"], "pass")
        suite = ET.fromstring(self.check("--format", "junit", self.healthy, "--require", what, status=1).out)[0]
        case = next(c for c in suite.findall("testcase") if c.get("name") == f"required: {what}")
        self.assertEqual(case.find("failure").text, "\n".join(missing))
        self.assertEqual(suite.get("failures"), "1")
        run = json.loads(self.check("--format", "sarif", self.healthy, "--require", what, status=1).out)["runs"][0]
        notes = [n["message"]["text"] for n in run["invocations"][0]["toolExecutionNotifications"] if n["level"] == "error"]
        self.assertEqual(notes, [f"required and missing: {text}" for text in missing])

    def test_limited_is_not_judged(self):
        done = self.check(self.unknown, "--require", "judged", status=1)
        self.assertIn("required and missing: judged: no slave is known", done.err)
        self.assertEqual(self.report(self.unknown, "--require", "judged", status=1)["summary"]["verdict"], "limited")
        self.check(self.unknown, status=0)

    def test_a_pass_of_next_to_nothing_is_not_judged(self):
        # All packets are cut by the snap length: hardly a rule sees what it needs.
        capture = SAMPLES / "snaplen.pcapng"
        report = self.report(capture, "--require", "judged", status=1)["reports"][0]
        coverage = report["coverage"]
        applicable = coverage["judged"] + coverage["partly"] + coverage["not_judged"]
        self.assertEqual(report["summary"]["verdict"], "pass")
        self.assertIn(f"judged=50%: {coverage['judged']} of {applicable} evaluations", report["required"]["missing"][0])
        only = f"only {coverage['judged']} of {applicable} evaluations were possible"
        self.assertIn(only, report["summary"]["reservations"])
        self.assertIn(", but ", self.check(capture, status=0).out.splitlines()[0])
        self.check(capture, "--require", "judged=1%", status=0)
        self.check(SAMPLES / "clean-startup.pcapng", "--require", "judged", status=0)
        self.check(SAMPLES / "clean-startup.pcapng", "--require", "judged=99%", status=1)
        suite = ET.fromstring(self.check("--format", "junit", capture, status=0).out)[0]
        self.assertIn(only, [p.get("value") for p in suite.find("properties") if p.get("name") == "reservation"])
        done = self.run_program("batch", "-o", "json=s.json", capture)
        self.assertIn(only, json.loads((self.dir / "s.json").read_text())["captures"][0]["reservations"], done.err)

    def test_reached_is_at_any_time(self):
        bus = scanned_bus()
        for state in (b"\x02\0", b"\x04\0", b"\x08\0", b"\x01\0"):
            bus.write(0x0120, state)
            bus.read(0x0130, state)
        capture = self.file("stopped.pcap", bus.pcap())
        self.check(capture, "--fail-on=never", "--require", "reached=OP", status=0)
        self.check(capture, "--fail-on=never", "--require", "state=OP", status=1)
        done = self.check(self.healthy, "--require", "reached=OP", status=1)
        self.assertIn("required and missing: reached=OP: slave 0 never shows OP", done.err)

    def test_nothing_asked(self):
        self.assertIsNone(self.report(self.healthy, status=0)["reports"][0]["required"])

    def test_wrong_usage(self):
        for what in ("", "slaves", "slaves=x", "state=RUN", "judged,", "all", "slaves=1,slaves=2"):
            done = self.check(self.healthy, "--require", what, status=2)
            self.assertEqual(done.out, "")
            self.assertEqual(len(done.err.splitlines()), 1, done.err)
            self.assertIn("--require", done.err)
        done = self.run_program("startup", "--require", "judged", self.healthy)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--expect", done.err)

    def test_in_the_configuration_file(self):
        self.file(".ecaudit.json", b'{"require": "state=OP"}')
        self.check(self.healthy, status=1)
        self.check(self.healthy, "--require", "state=INIT", status=0)
        # It judges: commands that do not are left alone.
        done = self.run_program("diff", self.healthy, self.faulty)
        self.assertNotIn("required", done.err)
        self.file(".ecaudit.json", b'{"require": "state=RUN"}')
        done = self.check(self.healthy, status=2)
        self.assertIn(".ecaudit.json: --require is 'state=RUN'", done.err)

    def test_of_the_slaves_that_are_selected(self):
        capture = SAMPLES / "two-slaves-one-refuses.pcapng"
        self.check(capture, "--fail-on=never", "--require", "slaves=2,state=OP", status=1)
        states = {s["position"]: s["al"]["state"] for s in
                  self.report(capture, "--fail-on=never", status=0)["reports"][0]["slaves"]}
        self.check(capture, "--fail-on=never", "--slave", "0", "--require", f"slaves=2,state={states[0]}", status=0)

    def test_start_up(self):
        clean = SAMPLES / "clean-startup.pcapng"
        self.run_program("startup", "--save", "e.json", "-o", "x.txt", clean)
        for what, status in (("slaves=1,state=INIT,judged", 0), ("slaves=2", 1)):
            done = self.run_program("startup", "--expect", "e.json", "--require", what, clean)
            self.assertEqual(done.returncode, status, done.err)

    def test_batch(self):
        done = self.run_program("batch", "--require", "state=OP", "-o", "json=s.json", "-o", "-", self.healthy)
        self.assertEqual(done.returncode, 1)
        self.assertIn("required and missing: state=OP", done.err)
        summary = json.loads((self.dir / "s.json").read_text())
        self.assertEqual((summary["summary"]["verdict"], summary["summary"]["unmet"]), ("fail", 1))
        self.assertEqual(summary["captures"][0]["status"], "unmet")
        # What is required belongs to the settings that a report was made with.
        done = self.run_program("batch", "--skip-done", "--require", "state=INIT", "-o", "-", self.healthy)
        self.assertEqual(done.returncode, 0, done.err)
        self.assertNotIn("done before", done.err)
