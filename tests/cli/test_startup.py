"""startup and diff: the start-up step by step, compared with an expectation, and two captures side by side."""
import json
import struct
import unittest

from support import APWR, BWR, SCHEMA, SHARED, SOURCE, Bus, CliTest

try:
    import jsonschema
except ImportError:
    jsonschema = None

SAMPLES = SOURCE / "samples" / "captures"
LAB = SHARED / "captures" / "lab"
REAL = SHARED / "captures" / "real"
EXPECTATION_SCHEMA = SCHEMA.parent / "ecaudit-expectation-1.schema.json"
DIFF_SCHEMA = SCHEMA.parent / "ecaudit-diff-1.schema.json"

MODE = ("6060h:0", 0x6060, 0, 7)
PERIOD = ("60C2h:1", 0x60C2, 1, 2)
FACTOR = ("6091h:1", 0x6091, 1, 100)


def validate(document, schema):
    if jsonschema is not None:
        jsonschema.Draft202012Validator(json.loads(schema.read_text())).validate(document)


class StartupBus(Bus):
    """Brings its slave to OP, with downloads of one or four bytes in PREOP."""

    counter = 0

    def download(self, index, subindex, value):
        self.counter = self.counter % 7 + 1
        head = struct.pack("<HHBB", 10, 0, 0, self.counter << 4 | 3)
        size = 0x2F if value <= 0xFF else 0x23  # one byte or four
        request = head + struct.pack("<HBHBI", 0x2000, size, index, subindex, value)
        response = head + struct.pack("<HBHBI", 0x3000, 0x60, index, subindex, 0)
        self.write(0x1000, request)
        self.read(0x1400, response)

    def state(self, state, shown=None):
        self.write(0x0120, bytes([state, 0]))
        self.read(0x0130, bytes([state if shown is None else shown, 0, 0, 0, 0x1D if shown else 0, 0]))


def start(bus, downloads=(MODE, PERIOD, FACTOR), outputs=6, refuses_safeop=False, start_time=1000):
    bus.exchange(BWR, 0, 0x0101, b"\0", b"\0", 1)
    bus.exchange(APWR, 0, 0x0010, b"\x01\x10", b"\x01\x10", 1)
    bus.read(0x0130, bytes([1, 0]))
    bus.write(0x0800, struct.pack("<HHBBBB", 0x1000, 16, 0x26, 0, 1, 0))
    bus.write(0x0808, struct.pack("<HHBBBB", 0x1400, 16, 0x22, 0, 1, 0))
    bus.state(2)
    for _, index, subindex, value in downloads:
        bus.download(index, subindex, value)
    bus.write(0x0810, struct.pack("<HHBBBB", 0x1100, outputs, 0x64, 0, 1, 0))
    bus.write(0x0990, struct.pack("<Q", start_time))
    bus.state(4, 0x12 if refuses_safeop else None)
    if not refuses_safeop:
        bus.state(8)
    for _ in range(5):
        bus.read(0x0130, bytes([0x12 if refuses_safeop else 8, 0]))


def startup_capture(**how) -> bytes:
    bus = StartupBus()
    start(bus, **how)
    return bus.pcap()


def two_startups(**second) -> bytes:
    bus = StartupBus()
    start(bus)
    for state in (4, 2, 1):
        bus.state(state)
    bus.time_ns += 2_000_000_000
    start(bus, **second)
    return bus.pcap()


class StartupTest(CliTest):
    def setUp(self):
        super().setUp()
        self.good = self.file("good.pcap", startup_capture())

    def startup(self, *arguments, status=0, **options):
        done = self.run_program("startup", *arguments, **options)
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.out}\n{done.err}")
        return done

    def saved(self, capture=None) -> dict:
        path = self.dir / "saved.json"
        path.unlink(missing_ok=True)
        self.startup("--save", path, capture or self.good)
        return json.loads(path.read_text())

    def expectation(self, **changes) -> str:
        return self.file("expected.json", json.dumps({**self.saved(), **changes}))

    def findings(self, capture, expectation, *arguments, status=1):
        done = self.startup("--expect", expectation, "--format", "json", *arguments, capture, status=status)
        document = json.loads(done.out)
        validate(document, SCHEMA)
        return document["reports"][0]["findings"]

    def one_finding(self, capture, expectation, *arguments, status=1):
        findings = self.findings(capture, expectation, *arguments, status=status)
        self.assertEqual(len(findings), 1, findings)
        return findings[0]


class StartupShow(StartupTest):
    def test_shows_and_does_not_judge(self):
        for options in ((), ("--slave", "0")):
            done = self.startup("--format", "json", *options, self.faulty)
            document = json.loads(done.out)
            validate(document, SCHEMA)
            report = document["reports"][0]
            self.assertEqual(report["settings"]["judged"], "nothing")
            self.assertIsNone(report["summary"]["verdict"])
            self.assertIsNone(document["summary"]["verdict"])
        self.startup("-o", "st.json", "-o", "st.html", "-o", "st.xml", "-o", "st.sarif", self.faulty)
        page = (self.dir / "st.html").read_text()
        self.assertIn('"verdict":"NOT-JUDGED"', page)
        self.assertNotIn("PASS ", page[:2000])
        self.assertIn('skipped="1"', (self.dir / "st.xml").read_text())
        self.assertIn("ecaudit check evaluates the capture", (self.dir / "st.sarif").read_text())
        self.assertIn("has no verdict, so there is nothing to merge", self.one_error("merge", "st.json"))
        expected = self.expectation()
        self.startup("--expect", expected, "-o", "ex.json", self.good)
        report = json.loads((self.dir / "ex.json").read_text())["reports"][0]
        self.assertEqual((report["settings"]["judged"], report["summary"]["verdict"]), ("expectation", "pass"))
        self.assertEqual(self.run_program("merge", "ex.json").returncode, 0)

    def test_no_startup_in_it(self):
        bus = Bus()
        for _ in range(5):
            bus.read(0x0130, bytes([8, 0]))
        running = self.file("running.pcap", bus.pcap())
        done = self.startup(running, status=2)
        self.assertIn("no start-up in this capture, in OP when it begins", done.out)
        self.assertEqual(done.err, f"ecaudit: {running} holds no start-up\n")

    def test_an_expectation_of_nothing(self):
        path = self.file("nothing.json", '{"schema": "ecaudit.expectation/1", "slaves": []}')
        self.assertIn("nothing can be expected", self.one_error("startup", "--expect", path, self.good))
        path = self.file("strict.json", '{"schema": "ecaudit.expectation/1", "strict": true, "slaves": []}')
        self.startup("--expect", path, self.good, status=1)

    def test_phases_and_steps_by_name(self):
        out = self.startup(self.good).out
        for text in ("All slaves at once", "slave 0 (0x1001): OP reached", "mailbox set-up", "INIT -> PREOP",
                     "PREOP requested", "6060h:0", "= 7", "PREOP -> SAFEOP", "SM2: 0x1100 6 bytes", "SAFEOP -> OP"):
            self.assertIn(text, out)
        # In the order in which it happened.
        places = [out.index(text) for text in ("mailbox set-up", "INIT -> PREOP", "PREOP parameters", "SAFEOP -> OP")]
        self.assertEqual(places, sorted(places))

    def test_json_holds_every_step(self):
        document = json.loads(self.startup("--format", "json", self.good).out)
        validate(document, SCHEMA)
        slave = document["reports"][0]["slaves"][0]["startup"]
        self.assertEqual(slave["reached"], "OP")
        downloads = [(s["index"], s["subindex"], s["data"]) for s in slave["steps"] if s["kind"] == "download"]
        self.assertEqual(downloads, [(0x6060, 0, "07"), (0x60C2, 1, "02"), (0x6091, 1, "64")])
        self.assertEqual([s["state"] for s in slave["steps"] if s["kind"] == "request"], ["PREOP", "SAFEOP", "OP"])
        self.assertEqual([s["address"] for s in document["reports"][0]["bus"]["startup"]["steps"]], [0x0101])
        self.assertEqual(document["reports"][0]["findings"], [])

    def test_what_happens_in_op_adds_nothing(self):
        bus = StartupBus()
        bus.exchange(APWR, 0, 0x0010, b"\x01\x10", b"\x01\x10", 1)
        for state in (1, 2, 4, 8):
            bus.state(state)
        long = self.file("short.pcap", bus.pcap())
        steps = json.loads(self.startup("--format", "json", long).out)["reports"][0]["slaves"][0]["startup"]["steps"]
        for _ in range(50):
            bus.write(0x0420, b"\xe8\x03")
            bus.write(0x0990, bytes(8))
        longer = self.file("long.pcap", bus.pcap())
        self.assertEqual(
            json.loads(self.startup("--format", "json", longer).out)["reports"][0]["slaves"][0]["startup"]["steps"], steps)

    def test_refusal_is_marked(self):
        refused = self.file("refused.pcap", startup_capture(refuses_safeop=True))
        out = self.startup(refused).out
        self.assertIn("PREOP reached, SAFEOP refused with 0x001d", out)
        self.assertRegex(out, r"SAFEOP requested: refused with 0x001d")

    def test_a_capture_of_operation_has_none(self):
        bus = Bus()
        bus.exchange(APWR, 0, 0x0010, b"\x01\x10", b"\x01\x10", 1)
        for _ in range(5):
            bus.read(0x0130, b"\x08\0")
        running = self.file("running.pcap", bus.pcap())
        expected = self.expectation()
        self.assertIn("holds no start-up to compare", self.one_error("startup", "--expect", expected, running))

    def test_other_formats_and_slave(self):
        self.assertIn("<testsuite", self.startup("--format", "junit", self.good).out)
        self.assertIn("has no slave 7", self.one_error("startup", "--slave", "7", self.good))
        self.assertIn("slave 0", self.startup("--slave", "0", self.good).out)

    def test_one_capture(self):
        self.assertIn("--join", self.one_error("startup", self.good, self.good))
        self.assertIn("no such file", self.one_error("startup", "nowhere.pcap"))

    def test_judging_needs_an_expectation(self):
        for option in (("--fail-on", "never"), ("--rule", "startup-value=off"), ("--baseline", "b.json")):
            self.assertIn("--expect", self.one_error("startup", *option, self.good))


class StartupExpect(StartupTest):
    def test_the_next_start_up_is_as_saved(self):
        again = self.file("again.pcap", startup_capture(start_time=987654321))
        out = self.startup("--expect", self.expectation(), again).out
        self.assertTrue(out.startswith("PASS"), out)

    def test_a_changed_parameter_is_one_finding(self):
        changed = self.file("changed.pcap", startup_capture(downloads=(MODE, ("", 0x60C2, 1, 4), FACTOR)))
        finding = self.one_finding(changed, self.expectation())
        self.assertEqual(finding["rule"], "startup-value")
        self.assertEqual(finding["slave"], 0)
        self.assertTrue(finding["evidence"]["expected"].startswith("2"), finding)
        self.assertTrue(finding["evidence"]["actual"].startswith("4"), finding)

    def test_an_expected_number_has_the_form_of_the_actual_one(self):
        # A PDO mapping entry: 0x60770010 is 6077h:0 with 16 bits, and 1618411536 in decimal.
        entry = ("", 0x1600, 1, 0x60400010)
        capture = self.file("mapped.pcap", startup_capture(downloads=(MODE, entry)))
        saved = self.saved(capture)
        for slave in saved["slaves"]:
            for step in slave["steps"]:
                if step.get("download") == "1600h:1":
                    step["value"] = 0x60770010
        expected = self.file("mapped.json", json.dumps(saved))
        finding = self.one_finding(capture, expected)
        self.assertIn("instead of 6077h:0 16 bit", finding["title"])
        self.assertNotIn("1618411536", json.dumps(finding["arguments"]["expected"]))

    def test_a_changed_length_is_named(self):
        changed = self.file("changed.pcap", startup_capture(outputs=8))
        finding = self.one_finding(changed, self.expectation())
        self.assertEqual(finding["title"], "SM2 has length 8 bytes instead of length 6 bytes")

    def test_a_missing_sdo_is_one_finding_at_the_end_of_its_phase(self):
        missing = self.file("missing.pcap", startup_capture(downloads=(MODE, FACTOR)))
        finding = self.one_finding(missing, self.expectation())
        self.assertEqual(finding["rule"], "startup-step-missing")
        self.assertIn("60C2h:1", finding["title"])
        steps = json.loads(self.startup("--format", "json", missing).out)["reports"][0]["slaves"][0]["startup"]["steps"]
        safeop = next(s["frame"] for s in steps if s.get("state") == "SAFEOP")
        self.assertEqual(finding["frame"], safeop)

    def test_a_drive_that_is_never_enabled_is_missing(self):
        good = SAMPLES / "drive-enabled-in-safeop.pcapng"
        self.startup("--save", "enabled.json", good)
        self.startup("--expect", "enabled.json", good)
        done = self.startup("--expect", "enabled.json", "--to", "#266", good, status=1)  # Enable operation is sent in 263
        self.assertTrue(done.out.startswith("UNMET "), done.out)
        self.assertIn("slave 0: enabled is expected and has the status not-reached", done.err)

    def test_a_start_up_shows_the_rungs(self):
        out = self.startup(SAMPLES / "drive-enabled-in-safeop.pcapng").out
        text = " ".join(out.split())
        self.assertIn("Progress slave 0 INIT; in OP before, taken down by the master; drive enabled before, switched off by the master", text)

    def test_a_swapped_order_is_one_finding(self):
        for downloads in ((PERIOD, MODE, FACTOR), (FACTOR, PERIOD, MODE)):
            swapped = self.file("swapped.pcap", startup_capture(downloads=downloads))
            finding = self.one_finding(swapped, self.expectation())
            self.assertEqual(finding["rule"], "startup-order")

    def test_more_than_expected_is_wrong_only_when_strict(self):
        more = self.file("more.pcap", startup_capture(downloads=(MODE, ("", 0x6065, 0, 9), PERIOD, FACTOR)))
        self.assertEqual(self.findings(more, self.expectation(), status=0), [])
        finding = self.one_finding(more, self.expectation(strict=True))
        self.assertEqual(finding["rule"], "startup-step-unexpected")
        self.assertIn("6065h:0", finding["title"])
        self.assertEqual(self.findings(self.good, self.expectation(strict=True), status=0), [])

    def test_limits(self):
        limits = {"init-to-preop": {"limit_ms": 0.5}, "preop-parameters": {"limit_ms": 60000}}
        finding = self.one_finding(self.good, self.expectation(phases=limits), status=0)
        self.assertEqual((finding["rule"], finding["severity"]), ("startup-slow", "warning"))
        self.findings(self.good, self.expectation(phases=limits), "--fail-on", "warning", status=1)

    def test_a_start_up_that_stops_is_one_finding(self):
        refused = self.file("refused.pcap", startup_capture(refuses_safeop=True))
        done = self.startup("--expect", self.expectation(), refused, status=1)
        self.assertIn("The request of SAFEOP was refused with 0x001d", done.out.splitlines()[0])
        self.assertIn("did not happen: request of OP", " ".join(done.out.split()))
        self.assertIn("1 error, 0 warnings", done.out)
        self.assertIn("ecaudit check finds 1 error", done.out)

    def test_a_file_without_outcomes_judges_what_was_sent(self):
        document = self.saved()
        for step in document["slaves"][0]["steps"]:
            step.pop("outcome", None)
        old = self.file("old.json", json.dumps(document))
        self.startup("--expect", old, self.good)
        refused = self.file("refused.pcap", startup_capture(refuses_safeop=True))
        done = self.startup("--expect", old, refused, status=1)
        self.assertIn("Start-up stops before: request of OP", done.out.splitlines()[0])
        # The master went on to the end: all was sent.
        document["slaves"][0]["steps"] = [s for s in document["slaves"][0]["steps"] if s.get("request") != "OP"]
        self.startup("--expect", self.file("old.json", json.dumps(document)), refused)

    def test_a_start_up_that_failed_is_saved_with_a_warning(self):
        refused = self.file("refused.pcap", startup_capture(refuses_safeop=True))
        done = self.startup("--save", "failed.json", refused)
        self.assertIn("slave 0 is saved with a start-up that failed: the request of SAFEOP was refused with 0x001d",
                      done.err)
        self.startup("--expect", "failed.json", refused)
        self.startup("--expect", "failed.json", self.good)
        self.assertEqual(self.startup("--save", "good.json", self.good).err, "")

    def test_of_two_start_ups_it_says_which_one_is_compared(self):
        twice = self.file("twice.pcap", two_startups(downloads=(MODE, ("", 0x60C2, 1, 4), FACTOR)))
        expected = self.expectation()
        once = self.startup("--expect", expected, self.good).out
        self.assertNotIn("again", once)
        text = " ".join(self.startup("--expect", expected, twice).out.split())
        self.assertIn("The master starts slaves again from frame", text)
        report = json.loads(self.startup("--expect", expected, "--format", "json", twice).out)["reports"][0]
        reasons = [entry for entry in report["not_evaluable"] if entry["what"] == "further-startup"]
        self.assertEqual([entry["code"] for entry in reasons], ["not-followed"], report["not_evaluable"])
        frame = f"#{report['slaves'][0]['startup']['again_frame']}"
        self.assertEqual(self.one_finding(twice, expected, "--from", frame)["rule"], "startup-value")
        self.assertIn("again from frame " + frame[1:], " ".join(self.startup(twice).out.split()))
        self.assertIn(f"the start-up before frame {frame[1:]} is saved", self.startup("--save", "one.json", twice).err)

    def test_gates(self):
        changed = self.file("changed.pcap", startup_capture(downloads=(MODE, ("", 0x60C2, 1, 4), FACTOR)))
        expected = self.expectation()
        self.startup("--expect", expected, "--fail-on", "never", changed)
        self.startup("--expect", expected, "--rule", "startup-value=off", changed)
        self.startup("--expect", expected, "--rule", "startup-value=warning", changed)
        self.startup("--expect", expected, "--write-baseline", "known.json", changed, status=1)
        out = self.startup("--expect", expected, "--baseline", "known.json", changed).out
        self.assertIn("1 known from the baseline", out)

    def test_a_slave_that_is_not_there(self):
        document = self.saved()
        document["slaves"].append({"position": 1, "name": "Axis Y", "vendor_id": 106, "product_code": 1, "steps": []})
        finding = self.one_finding(self.good, self.file("two.json", json.dumps(document)))
        self.assertEqual(finding["rule"], "startup-step-missing")
        self.assertIn("slave 1 (Axis Y)", finding["title"])

    def test_another_revision_is_one_of_the_device(self):
        mixed = SAMPLES / "clean-mixed-bus.pcapng"
        document = self.saved(mixed)
        slave = document["slaves"][1]
        slave["revision"] = "0x0000ffff"
        finding = self.one_finding(mixed, self.file("older.json", json.dumps(document)))
        self.assertEqual((finding["rule"], finding["severity"], finding["slave"]), ("startup-value", "error", 1))
        self.assertIn("Revision of the device is 0x00010000 instead of 0x0000ffff", finding["title"])
        self.assertIn("Masters accept a newer revision", finding["message"])
        del slave["revision"]
        self.assertEqual(self.findings(mixed, self.file("any.json", json.dumps(document)), status=0), [])

    def test_a_slave_at_another_place_has_moved(self):
        mixed = SAMPLES / "clean-mixed-bus.pcapng"
        document = self.saved(mixed)
        first, second = document["slaves"][:2]
        first["position"], second["position"] = 1, 0
        finding = self.one_finding(mixed, self.file("swapped.json", json.dumps(document)))
        self.assertEqual(finding["rule"], "startup-order")
        self.assertRegex(finding["title"], r"The expected slave \d is at position \d")
        # One that is not there is said to be missing, and those behind it have not moved.
        first["position"], second["position"] = 0, 1
        document["slaves"][2]["position"] = 3
        document["slaves"].append({"position": 2, "vendor_id": 106, "product_code": 1, "steps": []})
        finding = self.one_finding(mixed, self.file("more.json", json.dumps(document)))
        self.assertEqual((finding["rule"], finding["frame"]), ("startup-step-missing", 1))

    def test_hand_written(self):
        expected = self.file("hand.json", json.dumps({"schema": "ecaudit.expectation/1", "slaves": [{"steps": [
            {"download": "0x6060:0", "value": 7}, {"download": "60C2h:1"}, {"request": "SAFEOP"},
            {"write": 0x0810, "value": "0011 0600 64 00 01 00"}]}]}))
        finding = self.one_finding(self.good, expected)
        # The sync manager comes before the request.
        self.assertEqual(finding["rule"], "startup-order")

    def test_an_eni_is_an_expectation(self):
        def eni(period):
            command = ("<InitCmd><Transition>{}</Transition><Cmd>5</Cmd><Adp>4097</Adp><Ado>{}</Ado><Data>{}</Data>"
                       "</InitCmd>")
            return ("<EtherCATConfig><Config><Slave><Info><Name>Axis</Name><PhysAddr>4097</PhysAddr><AutoIncAddr>0"
                    "</AutoIncAddr></Info><Mailbox><CoE><InitCmds><InitCmd><Transition>PS</Transition><Ccs>1</Ccs>"
                    f"<Index>#x60C2</Index><SubIndex>1</SubIndex><Data>{period:02x}</Data></InitCmd></InitCmds></CoE>"
                    "</Mailbox><InitCmds>"
                    + command.format("IP", 0x0800, "0010100026000100") + command.format("IP", 0x0120, "0200")
                    + command.format("PS", 0x0810, "0011060064000100") + command.format("PS", 0x0120, "0400")
                    + "</InitCmds></Slave></Config></EtherCATConfig>")
        self.assertEqual(self.findings(self.good, self.file("good.xml", eni(2)), status=0), [])
        finding = self.one_finding(self.good, self.file("other.xml", eni(3)))
        self.assertEqual(finding["rule"], "startup-value")


class StartupFiles(StartupTest):
    def test_saved_is_valid_and_leaves_open_what_varies(self):
        document = self.saved()
        validate(document, EXPECTATION_SCHEMA)
        steps = document["slaves"][0]["steps"]
        values = {s.get("write", s.get("download")): s.get("value") for s in steps}
        self.assertIsNone(values["0x0990"])
        self.assertIsNone(values["0x0010"])
        self.assertEqual(values["60C2h:1"], 2)
        self.assertEqual(values["0x0810"], "0011060064000100")

    def test_schema_is_valid(self):
        if jsonschema is None:
            self.skipTest("python3-jsonschema is not installed")
        for schema in (EXPECTATION_SCHEMA, DIFF_SCHEMA):
            jsonschema.Draft202012Validator.check_schema(json.loads(schema.read_text()))

    def test_mistakes_are_named_with_their_place(self):
        def slaves(*steps):
            return {"schema": "ecaudit.expectation/1", "slaves": [{"steps": list(steps)}]}
        cases = [
            ("[]", "neither an ENI nor an expectation"),
            ("{", "not valid JSON"),
            ({"schema": "ecaudit.report/1"}, "neither an ENI nor an expectation"),
            ({"schema": "ecaudit.expectation/1"}, "slaves: must be a list"),
            ({"schema": "ecaudit.expectation/1", "slaves": [], "stict": True}, "stict: unknown key"),
            (slaves({"write": "0x0810", "valu": 1}), "slaves[0].steps[0].valu: unknown key (did you mean 'value'?)"),
            (slaves({"write": "810h"}), "slaves[0].steps[0].write"),
            (slaves({"write": 0x1000}), "slaves[0].steps[0].write"),
            (slaves({"request": "PREOP"}, {"request": "RUN"}), "slaves[0].steps[1].request"),
            (slaves({"download": "6060"}), "slaves[0].steps[0].download"),
            (slaves({"download": "6060h:300"}), "slaves[0].steps[0].download"),
            (slaves({"upload": "6060h:0", "value": "0"}), "slaves[0].steps[0].value"),
            (slaves({"upload": "6060h:0", "value": 1.5}), "slaves[0].steps[0].value"),
            (slaves({"request": "OP", "value": 8}), "slaves[0].steps[0].value"),
            (slaves({"request": "OP", "outcome": "refused"}), "slaves[0].steps[0].outcome"),
            (slaves({"request": "OP", "write": 1}), "slaves[0].steps[0]: must hold exactly one"),
            (slaves({}), "slaves[0].steps[0]: must hold exactly one"),
            ({"schema": "ecaudit.expectation/1", "slaves": [{"position": -1}]}, "slaves[0].position"),
            ({"schema": "ecaudit.expectation/1", "slaves": [], "phases": {"preop": {}}}, "phases.preop: no such phase"),
            ({"schema": "ecaudit.expectation/1", "slaves": [], "phases": {"dc": {"limit_ms": -1}}}, "phases.dc.limit_ms"),
        ]
        for content, message in cases:
            path = self.file("bad.json", content if isinstance(content, str) else json.dumps(content))
            error = self.one_error("startup", "--expect", path, self.good)
            self.assertIn("bad.json", error)
            self.assertIn(message, error)
        self.assertIn("no such file", self.one_error("startup", "--expect", "none.json", self.good))
        empty = self.file("empty.xml", "<EtherCATConfig><Config><Slave/></Config></EtherCATConfig>")
        self.assertIn("no init commands", self.one_error("startup", "--expect", empty, self.good))

    def test_nothing_else_is_overwritten(self):
        other = self.file("notes.txt", "mine")
        self.assertIn("will not be overwritten", self.one_error("startup", "--save", other, self.good))
        self.assertIn("will not be overwritten", self.one_error("startup", "--save", self.good, self.good))
        self.startup("--save", "new.json", self.good)
        self.assertIn("is replaced", self.startup("--save", "new.json", self.good).err)

    def test_a_start_up_that_the_capture_cuts_is_not_as_expected(self):
        expected = self.expectation()
        packets = StartupBus()
        start(packets)
        packets.packets = packets.packets[:24]
        error = self.one_error("startup", "--expect", expected, self.file("cut.pcap", packets.pcap()))
        self.assertIn("holds no whole start-up to compare: it ends while the slaves are started", error)

    def test_a_capture_without_start_up_is_not_saved(self):
        bus = Bus()
        for _ in range(5):
            bus.read(0x0130, b"\x08\0")
        running = self.file("running.pcap", bus.pcap())
        self.assertIn("no start-up that could be saved", self.one_error("startup", "--save", "x.json", running))
        self.assertFalse((self.dir / "x.json").exists())


class StartupCaptures(StartupTest):
    """What one capture is saved as, another one of the same master and devices fulfils."""

    def test_samples_fulfil_what_they_are_saved_as(self):
        for capture in sorted(SAMPLES.glob("*.pcap*")):
            path = self.dir / "sample.json"
            path.unlink(missing_ok=True)
            done = self.run_program("startup", "--save", path, capture)
            if done.returncode == 2:
                continue
            validate(json.loads(path.read_text()), EXPECTATION_SCHEMA)
            done = self.run_program("startup", "--expect", path, "--fail-on", "info", capture)
            self.assertIn(done.returncode, (0, 2), f"{capture}\n{done.out}")

    @unittest.skipUnless(REAL.exists(), "the real captures are absent")
    def test_real_captures_fulfil_what_they_are_saved_as(self):
        saved = 0
        for capture in sorted(REAL.glob("*.pcapng")):
            path = self.dir / "real.json"
            path.unlink(missing_ok=True)
            if self.run_program("startup", "--save", path, capture).returncode == 2:
                continue
            validate(json.loads(path.read_text()), EXPECTATION_SCHEMA)
            self.startup("--expect", path, "--fail-on", "info", capture)
            saved += 1
        self.assertGreaterEqual(saved, 5)

    @unittest.skipUnless(LAB.exists(), "the lab captures are absent")
    def test_other_runs_of_the_same_master_pass(self):
        self.startup("--save", "lab.json", LAB / "startup-ok-1slave.pcapng")
        for name in ("latch", "jitter", "lost-frames", "drive-fault", "watchdog-sm", "mixed-traffic",
                     "startup-ok-1slave-outbound-only", "startup-ok-1slave-return-only",
                     "startup-ok-1slave-spb"):
            self.startup("--expect", "lab.json", LAB / f"{name}.pcapng")

    def deviate(self, capture, document, change):
        """The findings when one step of the expectation is another one."""
        changed = json.loads(json.dumps(document))
        change(changed)
        return self.findings(capture, self.file("changed.json", json.dumps(changed)))

    @unittest.skipUnless(REAL.exists() and LAB.exists(), "the shared captures are absent")
    def test_each_single_deviation_is_exactly_one_finding(self):
        for capture in (REAL / "soem-sdinfo-akd.pcapng", REAL / "replay-dc.pcapng", LAB / "startup-ok-1slave.pcapng",
                        REAL / "replay-ek1914-no-complete-access.pcapng", SAMPLES / "clean-startup.pcapng"):
            path = self.dir / "saved.json"
            path.unlink(missing_ok=True)
            self.startup("--save", path, capture)
            document = json.loads(path.read_text())
            for s, slave in enumerate(document["slaves"]):
                steps = slave["steps"]
                with_value = [i for i, step in enumerate(steps) if step.get("value") is not None]
                for i in (with_value[0], with_value[len(with_value) // 2], with_value[-1]):
                    def other_value(d, i=i):
                        value = d["slaves"][s]["steps"][i]["value"]
                        d["slaves"][s]["steps"][i]["value"] = (
                            value + 1 if isinstance(value, int) else f"{(int(value[:2], 16) + 1) % 256:02x}" + value[2:])
                    found = self.deviate(capture, document, other_value)
                    self.assertEqual([f["rule"] for f in found], ["startup-value"], f"{capture} {steps[i]}")
                    self.assertEqual(found[0]["slave"], slave["position"])
                for i in (0, len(steps) // 2, len(steps) - 1):
                    found = self.deviate(capture, document, lambda d, i=i: d["slaves"][s]["steps"].insert(
                        i, {"download": "2FFFh:1", "value": 1}))
                    self.assertEqual([f["rule"] for f in found], ["startup-step-missing"], f"{capture} {i}")
                for i in range(1, len(steps) - 1, 5):
                    if steps[i] == steps[i + 1] or steps[i].get("write") == "0x0900":
                        continue

                    def swap(d, i=i):
                        own = d["slaves"][s]["steps"]
                        own[i], own[i + 1] = own[i + 1], own[i]
                    found = self.deviate(capture, document, swap)
                    self.assertEqual([f["rule"] for f in found], ["startup-order"], f"{capture} {steps[i]}")

    @unittest.skipUnless(LAB.exists(), "the lab captures are absent")
    def test_another_configuration_of_the_same_master_does_not(self):
        self.startup("--save", "lab.json", LAB / "startup-ok-1slave.pcapng")
        rules = {f["rule"] for f in self.findings(LAB / "startup-ok-1slave-pdo1701.pcapng", "lab.json")}
        self.assertIn("startup-value", rules)


class EsiRequirements(StartupTest):
    ESI = """<EtherCATInfo><Vendor><Id>106</Id><Name>Acme</Name></Vendor><Descriptions><Devices><Device Physics="YY">
      <Type ProductCode="#x5E42" RevisionNo="1">AS</Type><Name>AS</Name>
      <Mailbox><CoE><InitCmd><Transition>PS</Transition><Index>#x6060</Index><SubIndex>0</SubIndex><Data>%s</Data>
      </InitCmd></CoE></Mailbox>%s</Device></Devices></Descriptions></EtherCATInfo>"""

    def expect(self, data, more="", status=0, *arguments):
        path = self.file("device.esi.xml", self.ESI % (data, more))
        done = self.run_program("startup", "--expect", path, *arguments, self.good)
        self.assertEqual(done.returncode, status, f"{done.out}\n{done.err}")
        return done.out

    def test_all_met(self):
        self.assertRegex(self.expect("07"), r"done +download of 6060h:0 Modes of operation \(PS\) = 7")

    def test_another_value(self):
        self.assertRegex(self.expect("08", status=1), r"differs +download of 6060h:0 .* = 8.*; the\s+capture shows 7")

    def test_a_register_that_is_never_written(self):
        out = self.expect("07", "<ESC><Reg0420>2000</Reg0420></ESC>", 1)
        self.assertRegex(out, r"missing +register 0x0420 \(watchdog\) = 0x07d0")
        # Near miss: what the slave controller has after power-on.
        self.expect("07", "<ESC><Reg0420>1000</Reg0420></ESC>")

    def test_json(self):
        document = json.loads(self.expect("08", "", 1, "--format", "json"))
        validate(document, SCHEMA)
        demands = document["reports"][0]["slaves"][0]["esi_demands"]
        self.assertEqual([(d["kind"], d["status"]) for d in demands], [("init-command", "differs")])


def fmmu(start, kind, active=1, length=6):
    return struct.pack("<IHBBHBBBBH", 0x10000, length, 0, 7, start, 0, kind, active, 0, 0)


class EsiBus(StartupBus):
    """Does all that EsiOfEachKind.ESI requires, but for what a test changes. Each write is (register, bytes)."""

    MAILBOX = (struct.pack("<HHBBBB", 0x1000, 16, 0x26, 0, 1, 0), struct.pack("<HHBBBB", 0x1400, 16, 0x22, 0, 1, 0))
    OUTPUTS = struct.pack("<HHBBBB", 0x1800, 6, 0x64, 0, 1, 0)
    INPUTS = struct.pack("<HHBBBB", 0x1C00, 6, 0x20, 0, 1, 0)
    GOOD = {"sm0": (0x0800, MAILBOX[0]), "sm1": (0x0808, MAILBOX[1]), "sm2": (0x0810, OUTPUTS),
            "sm3": (0x0818, INPUTS), "out": (0x0600, fmmu(0x1800, 2)), "in": (0x0610, fmmu(0x1C00, 1)),
            "divider": (0x0400, b"\xe8\x03"), "watchdog": (0x0420, b"\xd0\x07"), "sync": (0x0980, b"\0\x03"),
            "module": 0x11, "so": 1}

    def run(self, waits=None, last=8, **changes):
        """waits: seconds until the master gives up OP, which the slave does not reach."""
        do = {**self.GOOD, **changes}
        self.exchange(BWR, 0, 0x0101, b"\0", b"\0", 1)
        self.exchange(APWR, 0, 0x0010, b"\x01\x10", b"\x01\x10", 1)
        self.read(0x0130, bytes([1, 0]))
        self.writes(do, "sm0", "sm1")
        self.state(2)
        if do["module"] is not None:
            self.download(0xF030, 1, 0x10000 | do["module"])
        self.writes(do, "sm2", "sm3", "out", "in", "divider", "watchdog", "sync")
        if last >= 4:
            self.state(4)
        if do["so"] is not None:
            self.download(0x2010, 1, do["so"])
        if last >= 8:
            self.state(8, 4 if waits else None)
        for _ in range(5):
            self.time_ns += int((waits or 0) * 0.2e9)
            self.read(0x0130, bytes([4 if waits else last, 0]))
        if waits:
            self.write(0x0120, bytes([4, 0]))
            self.read(0x0130, bytes([4, 0]))
        return self

    def writes(self, do, *names):
        for name in names:
            if do[name] is not None:
                self.write(*do[name])


class EsiOfEachKind(StartupTest):
    # Written by hand after ETG.2000.
    ESI = """<EtherCATInfo><Vendor><Id>106</Id><Name>Acme</Name></Vendor><Descriptions><Devices><Device Physics="YY">
      <Type ProductCode="#x5E42" RevisionNo="1">AS</Type><Name>AS</Name>
      <Info><StateMachine><Timeout><PreopTimeout>2000</PreopTimeout><SafeopOpTimeout>9000</SafeopOpTimeout></Timeout>
      </StateMachine></Info>
      <Fmmu>Outputs</Fmmu><Fmmu>Inputs</Fmmu>
      <Sm StartAddress="#x1000" ControlByte="#x26" DefaultSize="16" Enable="1">MBoxOut</Sm>
      <Sm StartAddress="#x1400" ControlByte="#x22" DefaultSize="16" Enable="1">MBoxIn</Sm>
      <Sm StartAddress="#x1800" ControlByte="#x64" DefaultSize="6" Enable="1">Outputs</Sm>
      <Sm StartAddress="#x1C00" ControlByte="#x20" DefaultSize="6" Enable="1">Inputs</Sm>
      <Mailbox><CoE><InitCmd><Transition>SO</Transition><Index>#x2010</Index><SubIndex>1</SubIndex><Data>01</Data>
      </InitCmd></CoE></Mailbox>
      <Dc><OpMode><Name>DC</Name><AssignActivate>#x300</AssignActivate></OpMode></Dc>
      <Slots DownloadModuleIdentList="1"/>
      <ESC><Reg0400>1000</Reg0400><Reg0420>2000</Reg0420></ESC></Device></Devices>
      <Modules><Module><Type ModuleIdent="#x10011">M</Type></Module></Modules></Descriptions></EtherCATInfo>"""

    def demands(self, **changes):
        """Of a start-up: what is not met, as (kind, status, what the capture shows)."""
        path = self.file("device.esi.xml", self.ESI)
        capture = self.file("esi.pcap", EsiBus().run(**changes).pcap())
        done = self.run_program("startup", "--expect", path, "--format", "json", capture)
        document = json.loads(done.out)
        validate(document, SCHEMA)
        rows = document["reports"][0]["slaves"][0]["esi_demands"]
        unmet = [(d["kind"], d["status"], d["seen"]) for d in rows if d["status"] in ("missing", "differs")]
        self.assertEqual(done.returncode, 1 if unmet else 0, done.err)
        self.assertEqual(len(rows), 14)
        return unmet

    def test_all_met(self):
        self.assertEqual(self.demands(), [])

    def test_mailbox_sync_managers(self):
        other = struct.pack("<HHBBBB", 0x1000, 16, 0x36, 0, 1, 0)
        self.assertEqual(self.demands(sm0=(0x0800, other)),
                         [("sync-manager", "differs", "start 0x1000, length 16, control 0x36")])
        self.assertEqual(self.demands(sm1=None), [("sync-manager", "missing", None)])
        # The downloads do not fill this mailbox, so only their answers are seen: their values are not known.
        longer = struct.pack("<HHBBBB", 0x1000, 32, 0x26, 0, 1, 0)
        self.assertEqual(self.demands(sm0=(0x0800, longer)),
                         [("sync-manager", "differs", "start 0x1000, length 32, control 0x26")])

    def test_sync_managers_of_process_data(self):
        buffer = struct.pack("<HHBBBB", 0x1800, 6, 0x66, 0, 1, 0)
        self.assertEqual(self.demands(sm2=(0x0810, buffer)),
                         [("sync-manager", "differs", "start 0x1800, control 0x66")])
        # Near miss: another PDO assigned, so another length.
        longer = struct.pack("<HHBBBB", 0x1C00, 8, 0x20, 0, 1, 0)
        self.assertEqual(self.demands(sm3=(0x0818, longer), **{"in": (0x0610, fmmu(0x1C00, 1, length=8))}), [])

    def test_fmmus(self):
        cases = {"elsewhere": (fmmu(0x1200, 2), "FMMU0 on 0x1200, 6 bytes, write only, outside the sync manager"),
                 "direction": (fmmu(0x1800, 1), "FMMU0 on 0x1800, 6 bytes, read only"),
                 "switched off": (fmmu(0x1800, 2, 0), "FMMU0 on 0x1800, 6 bytes, switched off")}
        for name, (data, seen) in cases.items():
            with self.subTest(name):
                self.assertEqual(self.demands(out=(0x0600, data)), [("fmmu", "differs", seen)])
        self.assertEqual(self.demands(**{"in": None}), [("fmmu", "missing", None)])

    def test_fmmus_as_a_master_likes(self):
        # Near misses: another number, one for both directions, in parts, the state of the mailbox beside it.
        self.assertEqual(self.demands(out=(0x0620, fmmu(0x1800, 2))), [])
        self.assertEqual(self.demands(out=(0x0600, fmmu(0x1800, 3))), [])
        self.assertEqual(self.demands(out=(0x0600, fmmu(0x1800, 2, length=2) + fmmu(0x1802, 2, length=4)),
                                      **{"in": (0x0620, fmmu(0x1C00, 1))}), [])
        self.assertEqual(self.demands(**{"in": (0x0610, fmmu(0x080D, 1, length=1) + fmmu(0x1C00, 1))}), [])
        # The state of the mailbox is not the inputs.
        self.assertEqual(self.demands(**{"in": (0x0610, fmmu(0x080D, 1, length=1))}), [("fmmu", "missing", None)])

    def test_watchdogs(self):
        self.assertEqual(self.demands(watchdog=None), [("watchdog", "missing", None)])
        self.assertEqual(self.demands(watchdog=(0x0420, b"\xe8\x03")), [("watchdog", "differs", "0x03e8")])
        self.assertEqual(self.demands(divider=None), [("watchdog", "missing", None)])
        self.assertEqual(self.demands(divider=(0x0400, b"\xc2\x09")), [("watchdog", "differs", "0x09c2")])

    def test_activation(self):
        self.assertEqual(self.demands(sync=(0x0980, b"\0\x07")), [("activation", "differs", "0x0700")])
        self.assertEqual(self.demands(sync=None), [("activation", "missing", None)])
        # Near miss: only the byte that matters is written.
        self.assertEqual(self.demands(sync=(0x0981, b"\x03")), [])

    def test_modules(self):
        self.assertEqual(self.demands(module=None), [("modules", "missing", None)])
        self.assertEqual(self.demands(module=0x12),
                         [("modules", "differs", "module 0x10012, which the ESI does not list")])

    def test_init_command_before_op(self):
        self.assertEqual(self.demands(so=None), [("init-command", "missing", None)])
        self.assertEqual(self.demands(so=2), [("init-command", "differs", "0x02")])
        # Near miss: OP is not requested, so it is not due.
        self.assertEqual(self.demands(so=None, last=4), [])

    def test_wait(self):
        [(kind, status, seen)] = self.demands(waits=2)
        self.assertEqual((kind, status, seen[:14]), ("timeout", "differs", "given up after"))
        self.assertEqual(self.demands(waits=10), [])

    def test_alike_slaves_share_a_list(self):
        esi = self.file("device.esi.xml", self.ESI)
        bus = EsiBus()
        slaves = [EsiBus().run(watchdog=None if n != 2 else EsiBus.GOOD["watchdog"]) for n in range(4)]
        for position, slave in enumerate(slaves):
            for time_ns, frame in slave.packets:
                frame = bytearray(frame)
                # Station addresses and positions count on; a broadcast is sent once for each.
                if frame[16] in (4, 5):
                    frame[18:20] = struct.pack("<H", 0x1001 + position)
                elif frame[16] == 2:
                    step = 1 if frame[6] & 2 else 0
                    frame[18:20] = struct.pack("<H", (step * 4 - position) & 0xFFFF)
                    frame[26] += position
                elif frame[16] == 8 and frame[6] & 2:
                    frame[18:20] = struct.pack("<H", 4)
                bus.packets.append((time_ns + position * 1_000_000_000, bytes(frame)))
        capture = self.file("alike.pcap", bus.pcap())
        done = self.run_program("startup", "--expect", esi, capture)
        self.assertEqual(done.returncode, 1, done.out)
        self.assertEqual(done.out.count("Required by the ESI of"), 2, done.out)
        self.assertIn("Required by the ESI of slaves 0-1, 3 (frames of slave 0)", done.out)
        self.assertIn("Required by the ESI of slave 2\n", done.out)
        self.assertEqual(done.err.count("register 0x0420"), 1, done.err)
        self.assertRegex(done.err, r"slaves 0-1, 3: the ESI requires register 0x0420")


class EsiOfOtherProtocols(StartupTest):
    # Written by hand after ETG.2000: Mailbox/SoE, EoE and AoE with InitCmd.
    AOE = struct.pack("<6sH6sHHHIII", bytes(6), 0x1001, bytes(6), 0x2000, 3, 4, 14, 0, 7) + \
        struct.pack("<IIIH", 0x4020, 8, 2, 0x1234)
    ESI = """<EtherCATInfo><Vendor><Id>106</Id><Name>Acme</Name></Vendor><Descriptions><Devices><Device Physics="YY">
      <Type ProductCode="#x5E42" RevisionNo="1">AS</Type><Name>AS</Name><Mailbox>
      <AoE><InitCmd><Transition>PS</Transition><Data>%s</Data></InitCmd></AoE>
      <EoE><InitCmd><Transition>IP</Transition><Type>2</Type><Data>00</Data></InitCmd></EoE>
      <SoE ChannelCount="2"><InitCmd Chn="1"><Transition>PS</Transition><IDN>32</IDN><Data>0B00</Data></InitCmd>
      <InitCmd><Transition>SO</Transition><IDN>#x80C8</IDN><Data>0102030405</Data></InitCmd></SoE></Mailbox></Device>
      </Devices></Descriptions></EtherCATInfo>""" % AOE.hex()
    # drive, IDN, value
    MODE, TEXT = (1, 32, b"\x0b\0"), (0, 0x80C8, bytes([1, 2, 3, 4, 5]))

    def ask(self, bus, protocol, request, response):
        bus.counter = bus.counter % 7 + 1
        for address, payload, send in ((0x1000, request, bus.write), (0x1400, response, bus.read)):
            if payload is not None:
                head = struct.pack("<HHBB", len(payload), 0, 0, bus.counter << 4 | protocol)
                send(address, (head + payload).ljust(64, b"\0"))

    def soe(self, bus, write, error=None, elements=0x40):
        if write is not None:
            drive, idn, value = write
            head = struct.pack("<BBH", 3 | drive << 5, elements, idn)
            flag = 0 if error is None else 0x10
            answer = struct.pack("<BBH", 4 | flag | drive << 5, elements, idn)
            self.ask(bus, 5, head + value, answer + (b"" if error is None else struct.pack("<H", error)))

    def capture(self, mode=MODE, text=TEXT, aoe=AOE, eoe=0, more=(), **how):
        bus = StartupBus()
        bus.exchange(BWR, 0, 0x0101, b"\0", b"\0", 1)
        bus.exchange(APWR, 0, 0x0010, b"\x01\x10", b"\x01\x10", 1)
        bus.read(0x0130, bytes([1, 0]))
        bus.write(0x0800, struct.pack("<HHBBBB", 0x1000, 64, 0x26, 0, 1, 0))
        bus.write(0x0808, struct.pack("<HHBBBB", 0x1400, 64, 0x22, 0, 1, 0))
        bus.state(2)
        if eoe is not None:
            self.ask(bus, 2, struct.pack("<BBH", 2, 1, 0) + bytes(12), struct.pack("<BBH", 3, 1, eoe))
        for write in more:
            self.soe(bus, write)
        self.soe(bus, mode, **how)
        if aoe is not None:
            answer = bytearray(aoe[:32])
            answer[18:24] = struct.pack("<HI", 5, 4)
            self.ask(bus, 1, aoe, bytes(answer) + bytes(4))
        bus.state(4)
        self.soe(bus, text)
        bus.state(8)
        for _ in range(5):
            bus.read(0x0130, b"\x08\0")
        return self.file("mailboxes.pcap", bus.pcap())

    def demands(self, **changes):
        esi = self.file("device.esi.xml", self.ESI)
        done = self.run_program("startup", "--expect", esi, "--format", "json", self.capture(**changes))
        document = json.loads(done.out)
        validate(document, SCHEMA)
        rows = document["reports"][0]["slaves"][0]["esi_demands"]
        self.assertEqual([d["kind"] for d in rows], ["init-command"] * 4)
        open_ones = [(d["what"], d["status"], d["seen"]) for d in rows if d["status"] != "met"]
        unmet = any(status in ("missing", "differs") for _, status, _ in open_ones)
        self.assertEqual(done.returncode, 1 if unmet else 0, done.err)
        return open_ones

    def test_all_met(self):
        self.assertEqual(self.demands(), [])
        text = self.startup("--expect", self.file("device.esi.xml", self.ESI), self.capture()).out
        for line in (r"SoE write of S-0-0032, drive 1 \(PS\) = 11 \(0x000b\)", r"EoE set IP request \(IP\) \(#",
                     r"AoE write \(PS\) \(#", r"SoE write of P-0-0200 \(SO\) = 0102030405"):
            self.assertRegex(text, "done +" + line)

    def test_soe(self):
        what = "SoE write of S-0-0032, drive 1 (PS)"
        self.assertEqual(self.demands(mode=None), [(what, "missing", None)])
        self.assertEqual(self.demands(mode=(1, 32, b"\x03\0")), [(what, "differs", "3 (0x0003)")])
        # The other drive of the same slave; the name of the parameter instead of its value.
        self.assertEqual(self.demands(mode=(0, 32, b"\x0b\0")), [(what, "missing", None)])
        self.assertEqual(self.demands(elements=0x02), [(what, "missing", None)])
        self.assertEqual(self.demands(error=0x7002), [(what, "differs", "an error of the slave, 0x7002")])
        # Near misses: the last value counts, and without a channel in the ESI any drive may have the parameter.
        self.assertEqual(self.demands(more=[(1, 32, b"\x03\0")]), [])
        self.assertEqual(self.demands(text=(1, *self.TEXT[1:])), [])

    def test_eoe(self):
        what = "EoE set IP request (IP)"
        self.assertEqual(self.demands(eoe=None), [(what, "missing", None)])
        self.assertEqual(self.demands(eoe=0x0201), [(what, "differs", "an error of the slave, 0x0201")])

    def test_aoe(self):
        what = "AoE write (PS)"
        self.assertEqual(self.demands(aoe=None), [(what, "missing", None)])
        # Another access may be the one that is meant, with other addresses.
        self.assertEqual(self.demands(aoe=self.AOE[:-1] + b"\x13"), [(what, "unknown", None)])

    def test_hostile_files(self):
        capture = self.capture()
        for old, new, message in (("<IDN>32<", "<IDN>65536<", "65536"), ('Chn="1"', 'Chn="-1"', "-1"),
                                  ("<Data>0B00<", "<Data>0B0<", "hexadecimal"), ("<Type>2<", "<Type>x<", "x")):
            esi = self.file("bad.esi.xml", self.ESI.replace(old, new))
            self.assertIn(message, self.one_error("startup", "--expect", esi, capture))
        # An AMS header that announces more than there is, or is cut, is no message to compare with.
        announced = bytearray(self.AOE)
        announced[20:24] = b"\xff" * 4
        for data in (announced, self.AOE[:31], b""):
            esi = self.file("cut.esi.xml", self.ESI.replace(self.AOE.hex(), bytes(data).hex()))
            out = self.startup("--expect", esi, capture).out
            self.assertRegex(out, r"unknown +AoE message \(PS\)")


class Diff(StartupTest):
    def diff(self, a, b, *arguments, status=1):
        done = self.run_program("diff", *arguments, a, b)
        self.assertEqual(done.returncode, status, f"{done.out}\n{done.err}")
        return done

    def test_equal_but_for_what_varies(self):
        again = self.file("again.pcap", startup_capture(start_time=5))
        self.assertTrue(self.diff(self.good, again, status=0).out.startswith("SAME"))

    def test_the_difference_stands_in_the_first_lines(self):
        bad = self.file("bad.pcap", startup_capture(outputs=8, refuses_safeop=True))
        lines = self.diff(self.good, bad).out.splitlines()
        self.assertTrue(lines[0].startswith("DIFFERENT"), lines[0])
        first = "\n".join(lines[:9])
        self.assertIn("A OP reached", first)
        self.assertIn("SAFEOP refused with 0x001d", first)
        self.assertIn("write of SM2", first)
        self.assertIn("length 8 bytes", "\n".join(lines[:11]))

    def test_json(self):
        bad = self.file("bad.pcap", startup_capture(downloads=(MODE, FACTOR)))
        document = json.loads(self.diff(self.good, bad, "--format", "json").out)
        validate(document, DIFF_SCHEMA)
        self.assertTrue(document["different"])
        steps = [d for d in document["differences"] if d["counts"]]
        self.assertEqual(len(steps), 1, steps)
        self.assertIn("60C2h:1", steps[0]["what"])
        self.assertEqual((steps[0]["a"], steps[0]["b"]), ("done", "not done"))

    def test_what_the_refusal_is_about_leads(self):
        good, bad = SAMPLES / "clean-startup.pcapng", SAMPLES / "pdo-unsupported.pcapng"
        for a, b in ((good, bad), (bad, good)):
            out = self.diff(a, b).out
            lead = out.split("SAFEOP refused with 0x0017: what it is about, the likeliest reason first\n")[1]
            lead, rest = lead.split("\n\n", 1)
            headings = [line for line in lead.splitlines() if line.startswith("  slave")]
            self.assertEqual(len(headings), 3, lead)
            self.assertIn("pdo-unsupported", headings[0])  # the refusal follows from this finding
            self.assertIn("write of SM2", headings[1])
            self.assertIn("download of 1C12h:0", headings[2])
            self.assertRegex(rest, r"\n\d+ further differences not shown; --all shows them\n")
            self.assertNotIn("What else", out)

    def test_all_prints_the_rest(self):
        good, bad = SAMPLES / "clean-startup.pcapng", SAMPLES / "pdo-unsupported.pcapng"
        out = self.diff(good, bad, "--all").out
        self.assertIn("SAFEOP refused with 0x0017: what it is about", out)
        self.assertIn("What else is done differently", out)
        self.assertNotIn("--all shows them", out)
        # What the master does after the refusal is no reason of it.
        lead, rest = out.split("What else is done differently")
        self.assertNotIn("all 0", lead)
        self.assertIn("all 0", rest)

    def test_relevant_settings_in_json(self):
        document = json.loads(self.diff(SAMPLES / "clean-startup.pcapng", SAMPLES / "pdo-unsupported.pcapng",
                                        "--format", "json").out)
        validate(document, DIFF_SCHEMA)
        self.assertEqual(document["failed"], "SAFEOP refused with 0x0017")
        self.assertEqual([d["relevant"] for d in document["differences"] if d["relevant"]], [True] * 3)
        self.assertGreater(len(document["differences"]), 10)

    def test_without_a_refusal_nothing_is_folded(self):
        out = self.diff(SAMPLES / "clean-startup.pcapng", SAMPLES / "pdo-length-mismatch.pcapng").out
        self.assertIn("\nDifferences\n", out)
        self.assertNotIn("not shown", out)

    def test_a_refusal_in_both_leads_nothing(self):
        self.assertNotIn("what it is about",
                         self.diff(SAMPLES / "pdo-unsupported.pcapng", SAMPLES / "pdo-assign-order.pcapng").out)

    def test_slaves_before_all_else(self):
        samples = SOURCE / "samples" / "captures"
        out = self.diff(samples / "clean-startup.pcapng", samples / "clean-mixed-bus.pcapng").out
        self.assertEqual(out.splitlines()[3], "Slaves")
        self.assertRegex("\n".join(out.splitlines()[4:7]), r"bus: slaves on the bus\n +A 1 slave\n +B \d slaves")
        for line in out.splitlines():
            self.assertLessEqual(len(line), 110 if "/" in line else 80, line)

    def test_what_nobody_took_is_not_done(self):
        document = json.loads(self.diff(SOURCE / "samples" / "captures" / "clean-startup.pcapng",
                                        SOURCE / "samples" / "captures" / "master-igh.pcapng", "--format", "json").out)
        for difference in document["differences"]:
            self.assertNotEqual(difference["a"], difference["b"])
            if "not taken by the slave" in difference["a"] + difference["b"]:
                self.assertFalse(difference["counts"])

    def test_what_nobody_compared_is_said(self):
        twice = self.file("twice.pcap", two_startups())
        self.assertIn("B starts slaves again from frame", self.diff(self.good, twice, status=0).out)
        self.assertNotIn("again", self.diff(self.good, self.good, status=0).out)

    def test_files(self):
        self.diff(self.good, self.good, "-o", "json=d.json", status=0)
        validate(json.loads((self.dir / "d.json").read_text()), DIFF_SCHEMA)

    def test_usage(self):
        self.assertIn("two captures", self.one_error("diff", self.good))
        self.assertIn("two captures", self.one_error("diff", "--join", self.good, self.good))
        self.assertIn("no such file", self.one_error("diff", self.good, "nowhere.pcap"))

    def test_nothing_compared_is_not_the_same(self):
        samples = SOURCE / "samples" / "captures"
        self.assertIn("nothing to compare", self.one_error("diff", samples / "mid-run.pcapng", samples / "mid-run.pcapng"))
        # Two slaves where there was one are a difference, whatever else the captures show.
        self.assertIn("slaves on the bus", self.diff(samples / "clean-startup.pcapng", samples / "mid-run.pcapng").out)


class DiffCaptures(Diff):
    @unittest.skipUnless(LAB.exists() and REAL.exists(), "the shared captures are absent")
    def test_an_akd_that_works_and_one_that_is_refused(self):
        out = self.diff(LAB / "soem-slaveinfo-akd.pcapng", REAL / "soem-sdinfo-akd.pcapng").out
        first = "\n".join(out.splitlines()[:18])
        self.assertIn("A 2 slaves", first)
        self.assertIn("SAFEOP refused with 0x001d", first)
        self.assertIn("write of SM2", "\n".join(out.splitlines()[:24]))

    @unittest.skipUnless(LAB.exists(), "the lab captures are absent")
    def test_containers_of_one_run_are_the_same(self):
        for name in ("startup-ok-1slave-vlan", "startup-ok-1slave-udp", "startup-ok-1slave-tap2if"):
            self.diff(LAB / "startup-ok-1slave.pcapng", LAB / f"{name}.pcapng", status=0)

    @unittest.skipUnless(LAB.exists(), "the lab captures are absent")
    def test_one_direction_of_one_run_is_the_same(self):
        whole = LAB / "startup-ok-1slave.pcapng"
        for name in ("startup-ok-1slave-outbound-only", "startup-ok-1slave-return-only"):
            one = LAB / f"{name}.pcapng"
            for a, b in ((whole, one), (one, whole)):
                self.assertTrue(self.diff(a, b, status=0).out.startswith("SAME"))
        out = self.diff(whole, LAB / "startup-ok-1slave-outbound-only.pcapng", status=0).out
        self.assertIn("does not show commands to the drive", out)
        self.assertNotIn("sent to all slaves at once", out)  # broadcasts are compared
