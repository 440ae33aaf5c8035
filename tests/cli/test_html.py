"""HTML reports: what stands in the page. How it behaves in a browser: tests/browser."""
import base64
import csv
import hashlib
import io
import json
import re
import unittest
import zlib

from support import SHARED, SOURCE, CliTest

SAMPLES = SOURCE / "samples" / "captures"
ENI = SOURCE / "samples" / "descriptions" / "two-axes.eni.xml"
MISSING = "this program was built without HTML reports"


class HtmlTest(CliTest):
    def page(self, *arguments):
        done = self.run_program("check", "--format", "html", *arguments)
        if MISSING in done.err:
            self.assertEqual((done.returncode, done.out), (2, ""))
            self.skipTest(MISSING)
        self.assertIn(done.returncode, (0, 1), done.err)
        return done.out

    def data(self, *arguments):
        page = self.page(*arguments)
        data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)[1])
        return json.loads(zlib.decompress(base64.b64decode(data["packed"]))) if "packed" in data else data

    def json_report(self, *arguments):
        return json.loads(self.run_program("check", "--format", "json", *arguments).out)

    def lines(self, command, *arguments):
        done = self.run_program(command, "--format", "jsonl", *arguments)
        self.assertEqual(done.returncode, 0, done.err)
        return [json.loads(line) for line in done.out.splitlines()]


class HtmlPages(HtmlTest):
    def test_by_option_and_by_ending(self):
        self.page(self.faulty)
        for output in ("html=a.html", "b.html"):
            done = self.run_program("check", "-o", output, self.faulty)
            self.assertEqual(done.returncode, 1)
        a, b = ((self.dir / name).read_text() for name in ("a.html", "b.html"))
        self.assertEqual(a, b)
        self.assertTrue(a.startswith("<!doctype html>"))

    def test_holds_the_json_report(self):
        self.assertEqual(self.data(self.faulty, self.healthy)["report"], self.json_report(self.faulty, self.healthy))

    def test_large_reports_are_packed(self):
        captures = [SAMPLES / f"{name}.pcapng" for name in ("clean-mixed-bus", "wkc-link-break", "master-igh", "latch-misuse")] * 4
        page = self.page(*captures)
        self.assertIn('id="data">{"packed":', page)
        self.assertLess(len(page), 400_000)
        self.assertEqual(self.data(*captures)["report"], self.json_report(*captures))

    def test_complete_in_itself(self):
        page = self.page(self.faulty)
        data = re.search(r'<script type="application/json" id="data">.*?</script>', page, re.S)
        rest = page.replace(data[0], "")
        self.assertEqual(re.findall(r'(?:src|href|action)="(?!data:)[^"]*"', rest), [])
        self.assertNotIn("@import", rest)
        self.assertNotRegex(rest, r"url\((?!['\"]?(data:|#))")
        self.assertNotIn("<", data[0][8:-9].split(">", 1)[1])

    def test_policy_names_the_scripts_and_styles_there_are(self):
        page = self.page(self.faulty)
        policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)[1]
        self.assertTrue(policy.startswith("default-src 'none';"))
        self.assertNotIn("unsafe", policy)
        for tag in ("script", "style"):
            texts = re.findall(rf"<{tag}>(.*?)</{tag}>", page, re.S)
            self.assertEqual(len(texts), 1)
            digest = base64.b64encode(hashlib.sha256(texts[0].encode()).digest()).decode()
            self.assertIn(f"{tag}-src 'sha256-{digest}'", policy)

    def test_verdict_and_order_are_those_of_the_text(self):
        data = self.data(self.faulty)["pages"][0]
        first = self.run_program("check", self.faulty).out.splitlines()[0]
        where, what = data["sentence"].split(": ", 1)
        self.assertTrue(first.startswith(f"{data['verdict']} faulty.pcap: {where}: "), first)
        self.assertIn(what.split(" (frame")[0], first)
        self.assertEqual(data["order"], [[0, 0], [1, 1]])

    def test_rule_pages_of_the_rules_that_fired(self):
        data = self.data(self.faulty)
        self.assertEqual(set(data["rules"]), {f["rule"] for f in data["report"]["reports"][0]["findings"]})
        for rule, page in data["rules"].items():
            self.assertIn("## What it checks", page["doc"])
            self.assertIn(page["title"], self.run_program("explain", rule).out)
        self.assertEqual(self.data(self.healthy)["rules"], {})

    def test_title_and_text_without_scripts(self):
        page = self.page(self.faulty)
        self.assertIn("<title>faulty.pcap - ecaudit</title>", page)
        self.assertRegex(page, r"<noscript>\s*<pre>FAIL ")

    def test_slave_option(self):
        data = self.data("--slave", "1", SAMPLES / "two-slaves-one-refuses.pcapng")
        self.assertEqual([s["slave"] for s in data["pages"][0]["timeline"]["slaves"]], [1])

    def test_captures_without_ethercat_and_without_stamps(self):
        self.assertEqual(self.data(SAMPLES / "no-ethercat.pcapng")["pages"][0]["verdict"], "NOTHING-TO-CHECK")
        self.assertEqual(self.data(SAMPLES / "no-ethercat.pcapng")["pages"][0]["timeline"]["slaves"], [])


class HtmlTimeline(HtmlTest):
    """What is drawn, against what the other commands say of the same capture."""

    def timeline(self, *arguments):
        return self.data(*arguments)["pages"][0]["timeline"]

    @staticmethod
    def at(series):
        return series.get("at", range(len(series.get("count") or series["least"])))

    def assert_signals_agree(self, *arguments):
        table = self.run_program("signals", *arguments).out
        rows = list(csv.DictReader(io.StringIO(table)))
        timeline = self.timeline(*arguments)
        columns = {(c["slave"], {"rx": "output", "tx": "input"}.get(c["direction"]), c["index"], c["subindex"]): c["column"]
                   for c in self.lines("signals", *arguments) if c.get("kind") == "signal"}
        variables = {c["variable"] for c in self.lines("signals", *arguments) if c.get("kind") == "signal"}
        compared = 0
        for slave in timeline["slaves"]:
            position = slave["slave"] if slave["slave"] is not None else slave["eni"]["position"]
            for signal in slave["signals"]:
                if signal["scaled"]:
                    continue
                self.assertIn(signal["variable"], variables)
                column = columns[position, signal["direction"], signal["index"], signal["subindex"]]
                measured = [(float(r["time_s"]), float(r[column])) for r in rows if r[column] not in ("", None)]
                series = signal["values"]
                self.assertEqual(min(v for _, v in measured), min(series["least"]), column)
                self.assertEqual(max(v for _, v in measured), max(series.get("most", series["least"])), column)
                bounds = {bucket: (low, high) for bucket, low, high in
                          zip(self.at(series), series["least"], series.get("most", series["least"]))}
                for time, value in measured:
                    bucket = (time - series["start_s"]) / series["width_s"]
                    near = [bounds[b] for b in {int(bucket), int(bucket + 1e-3), int(bucket - 1e-3)} if b in bounds]
                    self.assertTrue(any(low <= value <= high for low, high in near), (column, time, value))
                compared += 1
        self.assertGreater(compared, 3)

    def test_signals(self):
        self.assert_signals_agree("--eni", ENI, SAMPLES / "clean-startup.pcapng")

    def test_signals_of_slaves_that_only_the_eni_knows(self):
        self.assert_signals_agree("--eni", ENI, SAMPLES / "mid-run.pcapng")

    def test_sdo_transfers(self):
        for name in ("sdo-aborts", "pdo-unsupported", "clean-twincat-habits"):
            path = SAMPLES / f"{name}.pcapng"
            ours = [(s["request_frame"], s["response_frame"], s["service"], s["index"], s["subindex"], s["abort_code"],
                     s["name"]) for slave in self.timeline(path)["slaves"] for s in slave["sdos"]]
            events = [(e["request_frame"], e["response_frame"], e["service"], e["index"], e["subindex"],
                       e["abort_code"], e["name"]) for e in self.lines("events", "--type", "sdo", path)]
            self.assertEqual(sorted(ours), sorted(events), name)

    def test_lost_frames_and_mailbox_messages(self):
        path = SAMPLES / "lost-frames.pcapng"
        self.assertEqual(sum(self.timeline(path)["lost"]["count"]), 4)
        path = SAMPLES / "sdo-aborts.pcapng"
        report = self.json_report(path)["reports"][0]["slaves"][0]["mailbox"]
        counts = self.timeline(path)["slaves"][0]["mailbox"]["count"]
        self.assertGreaterEqual(sum(counts), report["requests"] + report["responses"])

    def test_exchange_of_process_data(self):
        # 131.7 ms without process data, then the slave falls out of OP.
        path = SAMPLES / "falls-out-of-op.pcapng"
        finding = next(f for f in self.json_report(path)["reports"][0]["findings"] if f["rule"] == "sync-watchdog-margin")
        lanes = self.timeline(path)["slaves"][0]
        for direction in ("outputs", "inputs"):
            runs = [r for r in lanes[direction]["runs"] if r["kind"] == "taken"]
            self.assertGreater(len(runs), 1)
            pauses = [b["from_s"] - a["to_s"] for a, b in zip(runs, runs[1:])]
            self.assertGreater(max(pauses), 0.1)
            for run in lanes[direction]["runs"]:
                self.assertLessEqual(run["from_s"], run["to_s"])
                self.assertLessEqual(run["frame"], run["last_frame"])
        self.assertGreater(finding["frame"], 0)

    def test_a_slave_that_is_gone(self):
        path = SHARED / "captures" / "lab" / "wkc-error-link-break.pcapng"
        if not path.is_file():
            self.skipTest("captures not beside the project")
        slaves = {s["slave"]: s for s in self.timeline(path)["slaves"]}
        # The working counter is short, and fits the absence of any of the three; a finding names the one.
        for position, slave in slaves.items():
            missing = [r for r in slave["inputs"]["runs"] if r["kind"] != "taken"]
            self.assertEqual([r["kind"] for r in missing], ["missing"] if position == 2 else [])
            self.assertEqual(bool(slave["absent"]), position == 2)
        absent = slaves[2]["absent"][0]
        self.assertGreater(absent["to_s"] - absent["from_s"], 1.5)
        finding = self.json_report(path)["reports"][0]["findings"][0]
        self.assertEqual((finding["rule"], finding["slave"]), ("wkc-mismatch", 2))
        self.assertGreater(finding["last_time_s"] - finding["time_s"], 1.5)

    def test_cycle(self):
        path = SAMPLES / "clean-startup.pcapng"
        series = self.timeline(path)["cycle_us"]
        cycle = self.json_report(path)["reports"][0]["bus"]["cycle"]
        self.assertAlmostEqual(min(series["least"]), cycle["min_us"], places=3)
        self.assertAlmostEqual(max(series.get("most", series["least"])), cycle["max_us"], places=3)


class HtmlCaptures(HtmlTest):
    def setUp(self):
        super().setUp()
        if not (SHARED / "captures").is_dir():
            self.skipTest("captures not beside the project")

    def test_phase_behind_sync0(self):
        path = SHARED / "captures" / "lab" / "dc.pcapng"
        data = self.data(path)
        self.assertTrue(any(s["phase_us"] for s in data["pages"][0]["timeline"]["slaves"]))
        for slave, drawn in zip(data["report"]["reports"][0]["slaves"], data["pages"][0]["timeline"]["slaves"]):
            phase = slave["dc"]["phase"]
            series = drawn["phase_us"]
            self.assertEqual(phase is None, series is None)
            if phase:
                self.assertAlmostEqual(min(series["least"]), phase["min_us"], places=3)
                self.assertAlmostEqual(max(series.get("most", series["least"])), phase["max_us"], places=3)

    def test_every_capture(self):
        for path in sorted((SHARED / "captures").glob("*/*.pcap*")):
            if "truth" in path.name or path.name.startswith("empty-"):
                continue
            with self.subTest(path.name):
                done = self.run_program("check", "-o", "report.html", path)
                if MISSING in done.err:
                    self.skipTest(MISSING)
                self.assertIn(done.returncode, (0, 1, 2), done.err)
                if done.returncode < 2:
                    self.assertLess((self.dir / "report.html").stat().st_size, 10_000_000)
