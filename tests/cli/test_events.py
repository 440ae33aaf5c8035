"""`ecaudit events`: what was reconstructed, one event a line."""
import csv
import gzip
import io
import json
import struct
import subprocess

from support import BRD, BWR, FPWR, PROGRAM, SHARED, SOURCE, Bus, CliTest, scanned_bus

SDO_KEYS = ["service", "transfer", "complete_access", "index", "subindex", "data", "value", "name", "abort_code",
            "abort_text", "request_frame", "response_frame", "duration_ms"]
COE, FOE, EOE, SOE, AOE, VOE = 3, 4, 2, 5, 1, 15
OUT, IN, LENGTH = 0x1000, 0x1080, 128


class MailboxBus:
    """A slave in PREOP with mailboxes of 128 bytes at 0x1000 and 0x1080."""

    def __init__(self):
        self.bus = scanned_bus()
        sync_manager = "<HHBBBB"
        self.bus.write(0x0800, struct.pack(sync_manager, OUT, LENGTH, 0x26, 0, 1, 0)
                       + struct.pack(sync_manager, IN, LENGTH, 0x22, 0, 1, 0))
        self.bus.write(0x0120, b"\2\0")
        self.bus.read(0x0130, b"\2\0")
        self.counter = 0

    def out(self, protocol, payload: bytes, length=None) -> int:
        """Writes a message; the packet that carries it."""
        self.counter = self.counter % 7 + 1
        self.bus.write(OUT, self._message(protocol, payload, length))
        return len(self.bus.packets) - 1

    def answer(self, protocol, payload: bytes, length=None) -> int:
        """The master reads a message; the packet that brings it."""
        self.bus.read(IN, self._message(protocol, payload, length))
        return len(self.bus.packets)

    def _message(self, protocol, payload, length):
        header = struct.pack("<HHBB", len(payload) if length is None else length, 0, 0, protocol | self.counter << 4)
        return (header + payload).ljust(LENGTH, b"\0")

    def sdo(self, request: str, response: str):
        """Two SDO messages in hexadecimal, behind the CoE header."""
        return (self.out(COE, b"\x00\x20" + bytes.fromhex(request)),
                self.answer(COE, b"\x00\x30" + bytes.fromhex(response)))


class Events(CliTest):
    def events(self, *arguments, status=0, **options):
        done = self.run_program("events", *arguments, **options)
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.out}\n{done.err}")
        return done

    def rows(self, *arguments, **options):
        done = self.events("--format", "jsonl", *arguments, **options)
        self.assertEqual(done.err, "")
        rows = [json.loads(line) for line in done.out.splitlines()]
        for row in rows:
            self.assertEqual(list(row)[:4], ["event", "frame", "time_s", "slave"])
        return rows

    def of(self, bus, kind):
        """The events of one type; and the text lines of it."""
        path = self.file("bus.pcap", (bus.bus if isinstance(bus, MailboxBus) else bus).pcap())
        return self.rows("--type", kind, path), self.events("--type", kind, path).out.splitlines()[1:]


class EventBasics(Events):
    def test_states_and_requests(self):
        rows = self.rows("--type", "al-request,al-state", self.faulty)
        self.assertEqual([(r["event"], r["frame"], r["state"]) for r in rows],
                         [("al-state", 6, "INIT"), ("al-request", 7, "OP"), ("al-state", 10, "INIT"),
                          ("al-state", 12, "INIT"), ("al-request", 13, "INIT"), ("al-state", 16, "INIT")])
        request, refused, code = rows[1], rows[2], rows[3]
        self.assertEqual((request["acknowledge"], request["acceptance"], request["slave"]), (False, "accepted", 0))
        self.assertEqual((refused["error"], refused["from"], refused["status_code"]), (True, "INIT", None))
        self.assertEqual(code["status_code"], 0x0011)
        self.assertIn("invalid requested state change", code["status_code_text"])
        self.assertTrue(rows[4]["acknowledge"])
        self.assertEqual((rows[5]["from"], rows[5]["error"]), ("INIT+ERR", False))
        text = self.events("--type", "al-request,al-state", self.faulty).out
        self.assertIn("OP requested", text)
        self.assertIn("INIT -> INIT+ERR", text)

    def test_csv_has_the_events_of_json_and_their_text(self):
        captures = [self.faulty] + [str(SOURCE / "samples" / "captures" / f"{name}.pcapng")
                                    for name in ("drive-fault", "sdo-aborts")]
        for capture in captures:
            with self.subTest(capture):
                choice = ("--type", "register-write,al-state,sdo,drive-state,emergency", capture)
                table = list(csv.DictReader(io.StringIO(self.events("--format", "csv", *choice).out)))
                keys = ("frame", "slave", "station_address", "event")
                self.assertEqual([[cells[key] for key in keys] for cells in table],
                                 [["" if row[key] is None else str(row[key]) for key in keys]
                                  for row in self.rows(*choice)])
                lines = self.events(*choice).out.splitlines()[1:]
                self.assertEqual(len(table), len(lines))
                for cells, line in zip(table, lines):
                    self.assertTrue(line.endswith(cells["text"]), (line, cells))

    def test_formats_are_listed_and_unknown_ones_refused(self):
        for command, names in (("events", "text, csv, jsonl"), ("decode", "text, csv, jsonl"), ("signals", "csv, jsonl")):
            with self.subTest(command):
                self.assertIn(f"unknown format 'wide' ({names})", self.one_error(command, "--format", "wide", self.faulty))
                self.assertIn(f"unknown format 'wide' ({names})", self.one_error(command, "-o", "wide=x", self.faulty))
                listed = self.run_program("help", command).out.split("--format FORMAT")[1].splitlines()[0]
                for name in names.split(", "):
                    self.assertRegex(listed, rf"\b{name}\b")

    def test_register_writes(self):
        rows = self.rows("--type", "register-write", self.faulty)
        self.assertEqual([(r["frame"], r["command"], r["address"], r["register"], r["data"]) for r in rows],
                         [(3, "APWR", 0x0010, "Configured Station Address", "0110"),
                          (7, "FPWR", 0x0120, "AL Control", "0800"), (13, "FPWR", 0x0120, "AL Control", "1100")])
        self.assertEqual({r["acceptance"] for r in rows}, {"accepted"})

    def test_a_broadcast_is_one_event(self):
        bus = Bus()
        bus.exchange(BWR, 0, 0x0200, b"\4\0", b"\4\0", 1)  # nobody is known yet
        bus.exchange(BRD, 0, 0x0130, b"\0\0", b"\1\0", 1)
        bus.exchange(2, 0, 0x0010, b"\x01\x10", b"\x01\x10", 1)
        bus.exchange(BWR, 0, 0x0300, bytes(8), bytes(8), 1)
        rows, text = self.of(bus, "register-write")
        self.assertEqual([(r["frame"], r["address"], r["broadcast"], r["slave"]) for r in rows],
                         [(1, 0x0200, True, None), (5, 0x0010, False, 0), (7, 0x0300, True, None)])
        self.assertIn("all  register-write", text[0])

    def test_in_the_order_of_frames(self):
        captures = sorted((SOURCE / "samples" / "captures").glob("*.pcap*")) + sorted((SHARED / "captures" / "real").glob("*.pcapng"))
        for capture in captures:
            lines = self.events("--format", "jsonl", capture).out.splitlines()
            frames = [json.loads(line)["frame"] or 0 for line in lines]
            self.assertEqual(frames, sorted(frames), capture)

    def test_an_echo_is_no_error(self):
        # A slave without a processor (0x0141 bit 0) copies AL Control into AL Status.
        bus = scanned_bus()
        bus.read(0x0141, b"\1")
        bus.write(0x0120, b"\x11\0")
        bus.read(0x0130, b"\x11\0")
        bus.write(0x0120, b"\2\0")
        bus.read(0x0130, b"\2\0")
        rows, text = self.of(bus, "al-state")
        self.assertEqual([(r["state"], r["error"], r["acknowledge_echoed"], r["from"]) for r in rows],
                         [("INIT", False, False, None), ("INIT", False, True, "INIT"), ("PREOP", False, False, "INIT")])
        self.assertIn("INIT -> INIT (acknowledge echoed)", text[1])
        self.assertIn("INIT (acknowledge echoed) -> PREOP", text[2])
        capture = self.file("echo.pcap", bus.pcap())
        report = json.loads(self.run_program("check", "--format", "json", capture).out)["reports"][0]
        self.assertNotIn("ERR", self.run_program("check", capture).out)
        self.assertEqual([s["acknowledge_echoed"] for s in report["slaves"][0]["al"]["history"] if s["kind"] == "state"],
                         [False, True, False])

    def test_clock_times(self):
        capture = self.file("x.pcap", scanned_bus().pcap())
        rows = [json.loads(line) for line in
                self.events("--format", "jsonl", "--time", "utc", capture).out.splitlines()]
        self.assertTrue(rows[0]["time"].startswith("2019-05-01T12:00:00.00"), rows[0])
        self.assertTrue(rows[0]["time"].endswith("Z"))
        text = self.events("--time=utc", capture).out.splitlines()
        self.assertIn("time UTC", text[0])
        self.assertIn("12:00:00.0", text[1])

    def test_a_write_that_nobody_takes(self):
        bus = scanned_bus()
        bus.exchange(FPWR, 0x1001, 0x0980, b"\0\1", b"\0\1", 0)
        rows, text = self.of(bus, "register-write")
        self.assertEqual(rows[-1]["acceptance"], "refused")
        self.assertIn("(not accepted)", text[-1])

    def test_bits_of_the_event_field(self):
        bus = scanned_bus()
        bus.write(0x0200, b"\4\0")
        bus.read(0x0012, b"\0\0", irq=4)
        bus.read(0x0110, b"\x11\0", irq=4)
        bus.read(0x0012, b"\0\0")
        rows, text = self.of(bus, "ecat-event")
        self.assertEqual([(r["frame"], r["slave"], r["bit"], r["name"], r["set"], r["frames"], r["first_frame"],
                           r["last_frame"], r["confidence"]) for r in rows],
                         [(10, 0, 2, "DL status", True, None, None, None, "observed"),
                          (14, 0, 2, "DL status", False, 2, 10, 12, "observed")])
        self.assertIn("DL status signalled", text[0])
        self.assertIn("DL status no longer signalled, was since #10", text[1])
        report = self.run_program("check", "--format", "json", self.file("bus.pcap", bus.pcap()))
        capture = json.loads(report.out)["reports"][0]
        bit = {"bit": 2, "name": "DL status", "raised": 1, "frames": 2, "first_frame": 10, "last_frame": 12,
               "set_at_start": False, "set_at_end": False}
        self.assertEqual(capture["bus"]["events"], [bit])
        events = capture["slaves"][0]["events"]
        self.assertEqual(events["signalled"], [{**bit, "confidence": "observed"}])
        self.assertEqual(events["ecat_event_mask"], {"value": 4, "known_bits": 0xFFFF, "names": ["DL status"],
                                                     "confidence": "observed", "frame": 8})
        self.assertIsNone(events["al_event_request"])
        self.assertIn("slaves signalled: DL status in 2 frames, #10 to #12 (slave 0)",
                      self.run_program("check", self.file("bus.pcap", bus.pcap())).out)

    def test_bits_of_the_event_field_show_on_request_only(self):
        bus = scanned_bus()
        for _ in range(40):  # a sync manager may raise its bit in every cycle
            bus.read(0x0012, b"\0\0", irq=0x20)
            bus.read(0x0012, b"\0\0")
        path = self.file("bus.pcap", bus.pcap())
        self.assertNotIn("ecat-event", [row["event"] for row in self.rows(path)])
        self.assertNotIn("ecat-event", self.events(path).out)
        self.assertEqual(len(self.rows("--type", "ecat-event", path)), 80)

    def test_text_is_aligned(self):
        lines = self.events(self.faulty).out.splitlines()
        at = lines[0].index("what")
        self.assertEqual(lines[0].split(), ["frame", "time", "s", "slave", "event", "what"])
        for line in lines[1:]:
            self.assertEqual(line[at - 2:at], "  ", line)
            self.assertNotEqual(line[at], " ", line)
        self.assertNotIn("\x1b", "".join(lines))

    def test_text_tells_a_thing_once_json_tells_all(self):
        self.assertNotIn("register-write  AL Control", self.events(self.faulty).out)
        self.assertIn("register-write  AL Control", self.events("--type", "register-write", self.faulty).out)
        writes = [r for r in self.rows(self.faulty) if r["event"] == "register-write"]
        self.assertEqual(writes, self.rows("--type", "register-write", self.faulty))

    def test_type_selects(self):
        everything = self.rows(self.faulty)
        for kinds in (["al-state"], ["al-state", "register-write"]):
            wanted = [r for r in everything if r["event"] in kinds]
            self.assertEqual(self.rows("--type", ",".join(kinds), self.faulty), wanted)
            separate = [word for kind in kinds for word in ("--type", kind)]
            self.assertEqual(self.rows(*separate, self.faulty), wanted)

    def test_unknown_type(self):
        self.assertEqual(self.one_error("events", "--type", "al-stat", self.faulty),
                         "unknown event type 'al-stat' (did you mean 'al-state'?)")
        for kind in ("wibble", "sdo,", ",sdo", "SDO"):
            self.assertIn("unknown event type", self.one_error("events", f"--type={kind}", self.faulty))
        message = self.one_error("events", "--type", "wibblewibble", self.faulty)
        for known in ("register-write", "al-state", "sdo", "eeprom", "emergency"):
            self.assertIn(known, message)

    def test_every_type_of_the_message_is_accepted(self):
        message = self.one_error("events", "--type", "wibblewibble", self.faulty)
        for kind in message[message.index("there are") + 10:-1].split(", "):
            self.rows("--type", kind, self.faulty)

    def test_range_shows_by_the_frame_of_the_event(self):
        self.assertEqual([r["frame"] for r in self.rows("--frames", "7-10", "--type", "al-request,al-state",
                                                        self.faulty)], [7, 10])
        # What is shown inside a range is what is shown without one.
        everything = self.rows(self.faulty)
        for first in range(1, 17):
            wanted = [r for r in everything if first <= r["frame"] <= first + 2]
            self.assertEqual(self.rows("--frames", f"{first}-{first + 2}", self.faulty), wanted)

    def test_slave(self):
        bus = scanned_bus()
        bus.exchange(FPWR, 0x1002, 0x0120, b"\2\0", b"\2\0", 1)
        path = self.file("two.pcap", bus.pcap())
        rows = self.rows("--type", "al-request", path)
        self.assertEqual([(r["slave"], r["station_address"]) for r in rows], [(None, 0x1002)])
        self.assertEqual(self.rows("--type", "al-request", "--slave", "0x1002", path), rows)
        self.assertEqual(self.rows("--type", "al-request", "--slave", "0", path), [])
        self.assertIn("0x1002  al-request", self.events("--type", "al-request", path).out)
        self.assertIn("has no slave 9", self.one_error("events", "--slave", "9", path))

    def test_streams(self):
        content = open(self.faulty, "rb").read()
        expected = self.events("--format", "jsonl", self.faulty).out
        self.assertEqual(self.events("--format", "jsonl", "-", input=content).out, expected)
        self.assertEqual(self.events("--format", "jsonl", self.file("f.gz", gzip.compress(content))).out, expected)
        self.events("-o", "e.jsonl", "-o", "text=e.txt", self.faulty)
        self.assertEqual((self.dir / "e.jsonl").read_text(), expected)
        self.assertEqual((self.dir / "e.txt").read_text(), self.events(self.faulty).out)

    def test_reader_that_leaves_early(self):
        bus = scanned_bus()
        for _ in range(10000):
            bus.write(0x0400, b"\0\0")
        process = subprocess.Popen([PROGRAM, "events", "--format", "jsonl", self.file("long.pcap", bus.pcap())],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        process.stdout.readline()
        process.stdout.close()
        error = process.stderr.read()
        process.stderr.close()
        self.assertEqual((process.wait(60), error), (0, b""))

    def test_mistakes(self):
        self.assertIn("no such file", self.one_error("events", "nowhere.pcap"))
        self.assertIn("unknown profile", self.one_error("events", "--profile", "acme", self.faulty))
        self.assertIn("jsonl", self.one_error("events", "--format", "json", self.faulty))


class EventSdo(Events):
    def test_keys_are_those_of_the_contract(self):
        bus = MailboxBus()
        bus.sdo("4018100100000000", "431810016a000000")
        rows, _ = self.of(bus, "sdo")
        self.assertEqual([k for k in rows[0] if k in SDO_KEYS], SDO_KEYS)

    def test_expedited_upload(self):
        bus = MailboxBus()
        request, response = bus.sdo("4018100100000000", "431810016a000000")
        rows, text = self.of(bus, "sdo")
        row = rows[0]
        self.assertEqual({k: row[k] for k in SDO_KEYS if k != "name"},
                         {"service": "upload", "transfer": "expedited", "complete_access": False, "index": 0x1018,
                          "subindex": 1, "data": "6a000000", "value": 106, "abort_code": None, "abort_text": None,
                          "request_frame": request, "response_frame": response, "duration_ms": 1.02})
        self.assertEqual((row["event"], row["frame"], row["slave"]), ("sdo", response, 0))
        self.assertIn("Vendor ID", row["name"])
        self.assertIn("upload 1018h:1 Identity: Vendor ID = 106 (0x6a), 1.020 ms", text[0])

    def test_string_and_negative_number(self):
        bus = MailboxBus()
        bus.sdo("4008100000000000", "4108100006000000" + b"AKD-06".hex())
        bus.sdo("406c600000000000", "436c6000feffffff")
        rows, text = self.of(bus, "sdo")
        self.assertEqual((rows[0]["transfer"], rows[0]["value"], rows[0]["data"]),
                         ("normal", "AKD-06", b"AKD-06".hex()))
        self.assertEqual((rows[1]["value"], rows[1]["type"]), (-2, "INTEGER32"))
        self.assertIn('= "AKD-06"', text[0])

    def test_pdo_mapping_is_readable(self):
        bus = MailboxBus()
        bus.sdo("40001a0100000000", "43001a0110004160")   # 6041h:0, 16 bit
        bus.sdo("2300160208000000", "6000160200000000")   # a gap of 8 bits
        bus.sdo("40121c0100000000", "4b121c0100160000")
        rows, text = self.of(bus, "sdo")
        self.assertEqual(rows[0]["value"], "6041h:0 16 bit Status word")
        self.assertEqual(rows[1]["value"], "gap of 8 bits")
        self.assertEqual((rows[2]["value"], rows[2]["text"]), (0x1600, "1600h"))
        self.assertIn("TxPDO mapping: Entry 1 = 6041h:0 16 bit Status word", text[0])

    def test_a_mapping_is_told_when_it_is_known_and_when_it_changes(self):
        """1C12h/1600h by the sequence of ETG.1000.6: count 0, entries, count."""
        bus = MailboxBus()
        for request in ("2f 12 1c 00 00000000", "2f 00 16 00 00000000", "23 00 16 01 10 00 40 60",
                        "2f 00 16 00 01000000", "2b 12 1c 01 00 16 0000", "2f 12 1c 00 01000000"):
            bus.sdo(request, "60" + request[2:11] + "00000000")
        rows, lines = self.of(bus, "pdo-mapping")
        self.assertEqual([(r["direction"], r["bytes"], r["pdos"]) for r in rows],
                         [("rx", 0, []), ("rx", 2, [0x1600])])
        self.assertEqual(rows[1]["entries"], [{"pdo": 0x1600, "index": 0x6040, "subindex": 0, "bits": 16,
                                               "bit_offset": 0, "sync_manager": 2, "name": "Control word"}])
        self.assertIn("no PDO assigned", lines[0])
        self.assertIn("2 bytes in 1600h: 6040h:0 16 bit", lines[1])

    def test_complete_access(self):
        bus = MailboxBus()
        data = "0200" + "10004060" + "08006060"
        bus.sdo("5000160000000000", "510016000a000000" + data)
        rows, text = self.of(bus, "sdo")
        self.assertEqual((rows[0]["complete_access"], rows[0]["data"]), (True, data))
        self.assertEqual(rows[0]["value"], [2, "6040h:0 16 bit Control word", "6060h:0 8 bit Modes of operation"])
        self.assertIn("1600h complete RxPDO mapping = 2 entries: 6040h:0 16 bit Control word; 6060h:0", text[0])

    def test_segmented_upload(self):
        bus = MailboxBus()
        bus.sdo("40f02f0000000000", "41f02f0009000000")
        bus.sdo("6000000000000000", "00" + b"ABCDEFG".hex())
        _, last = bus.sdo("7000000000000000", "1b" + b"HI".hex() + "0000000000")
        rows, _ = self.of(bus, "sdo")
        self.assertEqual(len(rows), 1)
        self.assertEqual((rows[0]["transfer"], rows[0]["data"], rows[0]["response_frame"], rows[0]["segments"]),
                         ("segmented", b"ABCDEFGHI".hex(), last, 2))

    def test_abort(self):
        bus = MailboxBus()
        bus.sdo("4018100900000000", "8018100911000906")
        rows, text = self.of(bus, "sdo")
        self.assertEqual((rows[0]["abort_code"], rows[0]["abort_text"]), (0x06090011, "subindex does not exist"))
        self.assertEqual((rows[0]["value"], rows[0]["outcome"], rows[0]["aborted_by"]), (None, "aborted", "slave"))
        self.assertIn("aborted by the slave, 0x06090011 subindex does not exist", text[0])

    def test_the_example_of_the_manuals_decodes_and_is_marked(self):
        # AKD 4.12.3, MKD 4.13.3, Pilz 4.10.3: length 0x0A out, 0x0E in, service 2 in the answer.
        bus = MailboxBus()
        bus.out(COE, bytes.fromhex("0020 2b121c0104170000"), length=0x0A)
        bus.answer(COE, bytes.fromhex("0020 60121c0100000000"), length=0x0E)
        rows, text = self.of(bus, "sdo")
        row = rows[0]
        self.assertEqual((row["service"], row["index"], row["subindex"], row["data"], row["outcome"]),
                         ("download", 0x1C12, 1, "0417", "completed"))
        self.assertEqual(row["text"], "1704h")
        self.assertEqual(len(row["deviations"]), 2, row["deviations"])
        self.assertIn("service 2", row["deviations"][0])
        self.assertIn("length 14", row["deviations"][1])
        for deviation in row["deviations"]:
            self.assertIn(deviation, text[0])

    def test_an_answer_as_the_standard_wants_it_is_not_marked(self):
        bus = MailboxBus()
        bus.sdo("2b121c0104170000", "60121c0100000000")
        self.assertEqual(self.of(bus, "sdo")[0][0]["deviations"], [])

    def test_names_of_a_sister_family_are_marked(self):
        bus = MailboxBus()
        bus.sdo("4001350000000000", "4301350001000000")
        path = self.file("akd.pcap", bus.bus.pcap())
        generic = self.rows("--type", "sdo", path)[0]
        self.assertEqual((generic["name"], generic["name_source"]), (None, None))
        akd = self.rows("--type", "sdo", "--profile", "kollmorgen-akd-2011", path)[0]
        self.assertEqual(akd["name_source"], "inferred")
        self.assertIsNotNone(akd["name"])
        self.assertIn("(inferred)", self.events("--type", "sdo", "--profile", "kollmorgen-akd-2011", path).out)

    def test_untrusted_text_cannot_break_lines(self):
        bus = MailboxBus()
        name = b'a"\\\n\x1b[31m'
        bus.sdo("4008100000000000", "41081000" + struct.pack("<I", len(name)).hex() + name.hex())
        rows, text = self.of(bus, "sdo")
        self.assertEqual(len(rows), 1)
        self.assertEqual(len(text), 1)
        self.assertNotIn("\x1b", text[0])


class EventMailbox(Events):
    def test_messages(self):
        bus = MailboxBus()
        request, response = bus.sdo("4018100100000000", "431810016a000000")
        rows, text = self.of(bus, "mailbox")
        self.assertEqual([(r["kind"], r["direction"], r["frame"], r["protocol"], r["service"], r["length"], r["counter"])
                          for r in rows],
                         [("message", "out", request, "CoE", "SDO request", 10, 1),
                          ("message", "in", response, "CoE", "SDO response", 10, 1)])
        self.assertEqual(rows[0]["data"], "00204018100100000000")
        self.assertIn("-> CoE SDO request: upload 1018h:1", text[0])
        self.assertIn("<- CoE SDO response: upload 1018h:1, 4 bytes", text[1])

    def test_what_a_download_maps(self):
        bus = MailboxBus()
        bus.sdo("23001a0110007760", "60001a0100000000")
        bus.sdo("2b131c01001a0000", "60131c0100000000")
        bus.sdo("40001a0100000000", "43001a0110007760")
        text = self.of(bus, "mailbox")[1]
        self.assertIn("-> CoE SDO request: download 1A00h:1, 4 bytes, maps 6077h:0, 16 bit", text[0])
        self.assertIn("download 1C13h:1, 2 bytes, assigns 1A00h", text[2])
        self.assertIn("<- CoE SDO response: upload 1A00h:1, 4 bytes: 6077h:0, 16 bit", text[5])
        # `decode` shows the message in place of the bytes of the mailbox.
        lines = self.run_program("decode", self.file("bus.pcap", bus.bus.pcap())).out.splitlines()
        sent = [line for line in lines if "maps 6077h:0, 16 bit" in line]
        self.assertEqual(len(sent), 2)  # sent and returned
        self.assertIn("mailbox -> CoE SDO request: download 1A00h:1, 4 bytes", sent[0])
        self.assertEqual(sum("mailbox <- CoE SDO response" in line for line in lines), 3)

    def test_error_reply(self):
        bus = MailboxBus()
        request = bus.out(FOE, b"\1\0\0\0\0\0FILE")
        bus.answer(0, struct.pack("<HH", 1, 2))
        rows, _ = self.of(bus, "mailbox")
        reply = [r for r in rows if r["kind"] == "error-reply"][0]
        self.assertEqual((reply["detail"], reply["error"]), (2, "the mailbox protocol is not supported"))
        self.assertEqual((reply["request"], reply["request_frame"]), ("FoE read request", request))

    def test_no_answer(self):
        bus = MailboxBus()
        request = bus.out(COE, bytes.fromhex("00204018100100000000"))
        rows, text = self.of(bus, "mailbox")
        self.assertEqual((rows[-1]["kind"], rows[-1]["request"], rows[-1]["request_frame"]),
                         ("unanswered", "CoE SDO request 1018h:1", request))
        self.assertIn("got no answer", text[-1])

    def test_emergency(self):
        bus = MailboxBus()
        frame = bus.answer(COE, b"\x00\x10" + struct.pack("<HB5s", 0x7305, 0x20, b"\1\2\3\4\5"))
        path = self.file("emergency.pcap", bus.bus.pcap())
        row = self.rows("--type", "emergency", "--profile", "kollmorgen-mkd-n", path)[0]
        self.assertEqual((row["frame"], row["code"], row["register"], row["data"]), (frame, 0x7305, 0x20, "0102030405"))
        self.assertEqual((row["id"], row["text"], row["inferred"]), ("F417", "broken wire, primary feedback", False))
        akd = self.rows("--type", "emergency", "--profile", "kollmorgen-akd-2011", path)[0]
        self.assertEqual((akd["id"], akd["inferred"]), ("F417", True))
        generic = self.rows("--type", "emergency", path)[0]
        self.assertEqual((generic["id"], generic["inferred"]), (None, False))
        self.assertIn("0x7305 F417 broken wire, primary feedback, error register 0x20",
                      self.events("--type", "emergency", "--profile", "kollmorgen-mkd-n", path).out)

    def test_foe_read(self):
        bus = MailboxBus()
        request = bus.out(FOE, b"\1\0" + struct.pack("<I", 0) + b"app.bin")
        full = LENGTH - 6 - 6
        bus.answer(FOE, b"\3\0" + struct.pack("<I", 1) + bytes(full))
        bus.out(FOE, b"\4\0" + struct.pack("<I", 1))
        bus.answer(FOE, b"\3\0" + struct.pack("<I", 2) + b"end")
        bus.out(FOE, b"\4\0" + struct.pack("<I", 2))
        rows, text = self.of(bus, "foe")
        self.assertEqual([(r["service"], r["file_name"], r["size"], r["packets"], r["outcome"], r["request_frame"])
                          for r in rows], [("read", "app.bin", full + 3, 2, "completed", request)])
        self.assertIn(f'read "app.bin", {full + 3} bytes in 2 packets', text[0])

    def test_foe_error(self):
        bus = MailboxBus()
        bus.out(FOE, b"\2\0" + struct.pack("<I", 0) + b"fw")
        bus.answer(FOE, b"\5\0" + struct.pack("<I", 0x8001) + b"nope")
        rows, text = self.of(bus, "foe")
        self.assertEqual((rows[0]["service"], rows[0]["outcome"], rows[0]["error_code"], rows[0]["error_text"],
                          rows[0]["error_by"]), ("write", "error", 0x8001, "nope", "slave"))
        self.assertIn('"nope"', text[0])

    def test_eoe_names_what_is_inside(self):
        inner = (b"\x02\0\0\0\0\1" + b"\x02\0\0\0\0\2" + b"\x08\x00" + bytes.fromhex("4500001c00000000401100 00")
                 + bytes([192, 168, 0, 1, 192, 168, 0, 2]) + struct.pack(">HHHH", 5000, 53, 8, 0))
        bus = MailboxBus()
        blocks = (len(inner) + 31) // 32
        bus.out(EOE, b"\0\1" + struct.pack("<H", blocks << 6 | 5 << 12) + inner)
        rows, text = self.of(bus, "eoe")
        row = rows[0]
        self.assertEqual((row["source_ip"], row["destination_ip"], row["source_port"], row["destination_port"]),
                         ("192.168.0.1", "192.168.0.2", 5000, 53))
        self.assertEqual((row["size"], row["fragments"], row["frame_number"], row["data"]),
                         (len(inner), 1, 5, inner.hex()))
        self.assertIn("IPv4 UDP 192.168.0.1:5000 -> 192.168.0.2:53", text[0])

    def test_eoe_settings(self):
        bus = MailboxBus()
        request = bus.out(EOE, b"\2\1\0\0" + struct.pack("<I", 0x06) + bytes(6)
                          + bytes([139, 0, 168, 192]) + bytes([0, 255, 255, 255]))
        bus.answer(EOE, b"\3\1\1\2")
        rows, text = self.of(bus, "eoe")
        self.assertEqual(rows[0]["kind"], "set IP request")
        self.assertEqual((rows[1]["kind"], rows[1]["result"], rows[1]["request_frame"]),
                         ("set IP response", 0x0201, request))
        self.assertIn("no IP support", text[1])

    def test_sdo_information(self):
        bus = MailboxBus()
        bus.out(COE, b"\x00\x80" + b"\1\0\0\0" + b"\1\0")
        bus.answer(COE, b"\x00\x80" + b"\2\0\0\0" + struct.pack("<HHH", 1, 0x1000, 0x2001))
        bus.out(COE, b"\x00\x80" + b"\3\0\0\0" + struct.pack("<H", 0x2001))
        bus.answer(COE, b"\x00\x80" + b"\4\0\0\0" + struct.pack("<HHBB", 0x2001, 7, 0, 7) + b"Speed limit")
        bus.out(COE, b"\x00\x80" + b"\5\0\0\0" + struct.pack("<HBB", 0x2001, 0, 0))
        bus.answer(COE, b"\x00\x80" + b"\6\0\0\0" + struct.pack("<HBBHHH", 0x2001, 0, 0, 6, 16, 0x003F) + b"rpm")
        bus.out(COE, b"\x00\x80" + b"\3\0\0\0" + struct.pack("<H", 0x5FFF))
        bus.answer(COE, b"\x00\x80" + b"\7\0\0\0" + struct.pack("<I", 0x06020000))
        bus.sdo("4001200000000000", "4b012000e8030000")
        rows, text = self.of(bus, "sdo-info")
        self.assertEqual([r["kind"] for r in rows], ["list", "object", "entry", "object"])
        self.assertEqual(rows[0]["indices"], [0x1000, 0x2001])
        self.assertEqual((rows[1]["name"], rows[1]["index"], rows[1]["max_subindex"]), ("Speed limit", 0x2001, 0))
        self.assertEqual((rows[2]["name"], rows[2]["type"], rows[2]["bit_length"]), ("rpm", "UNSIGNED16", 16))
        self.assertEqual((rows[3]["outcome"], rows[3]["abort_code"]), ("error", 0x06020000))
        self.assertIn("list of all objects: 2 objects, 1000h 2001h", text[0])
        # The slave's own words name and type the object from then on.
        sdo = self.of(bus, "sdo")[0][0]
        self.assertEqual((sdo["name"], sdo["value"], sdo["name_source"]), ("Speed limit: rpm", 1000, "slave"))

    def test_soe_aoe_voe(self):
        bus = MailboxBus()
        bus.out(SOE, struct.pack("<BBH", 0x01, 0x40, 0x0011))
        bus.answer(SOE, struct.pack("<BBH", 0x02, 0x40, 0x0011) + b"\1\2\3\4")
        bus.out(AOE, bytes([1, 2, 3, 4, 5, 6]) + b"\x10\x27" + bytes([6, 5, 4, 3, 2, 1]) + b"\x01\x80"
                + struct.pack("<HHIII", 2, 4, 12, 0, 7) + struct.pack("<III", 0xF302, 0x10180001, 4))
        bus.out(VOE, struct.pack("<IH", 0x6A, 3) + b"xyz")
        rows, text = self.of(bus, "soe")
        self.assertEqual([(r["operation"], r["idn_name"], r["data"]) for r in rows],
                         [("read request", "S-0-0017", ""), ("read response", "S-0-0017", "01020304")])
        self.assertIn("S-0-0017", text[0])
        rows, text = self.of(bus, "aoe")
        self.assertEqual((rows[0]["command"], rows[0]["target"], rows[0]["target_port"], rows[0]["index_group"]),
                         ("read", "1.2.3.4.5.6", 10000, 0xF302))
        rows, text = self.of(bus, "voe")
        self.assertEqual((rows[0]["vendor_id"], rows[0]["vendor_type"], rows[0]["data"]), (0x6A, 3, b"xyz".hex()))


class EventEeprom(Events):
    def read(self, bus, word, words):
        """Reads 4 bytes at a time, as masters do."""
        for k in range(0, len(words), 2):
            bus.write(0x0502, struct.pack("<HI", 0x0100, word + k))
            bus.read(0x0502, b"\0\0")
            bus.read(0x0508, struct.pack("<HH", *words[k:k + 2]))

    IDENTITY = [0x006A, 0x0000, 0x4B44, 0x0041, 0x0002, 0x0000, 0x1234, 0x0000]

    def test_neighbouring_words_are_one_event(self):
        bus = scanned_bus()
        self.read(bus, 8, self.IDENTITY)
        self.read(bus, 0x18, [0x1800, 0x0400, 0x1C00, 0x0400, 0x000C, 0x0000])
        bus.write(0x0120, b"\2\0")
        rows, text = self.of(bus, "eeprom")
        reads = [r for r in rows if r["action"] == "read"]
        self.assertEqual([(r["address"], r["words"]) for r in reads], [(8, 8), (0x18, 6)])
        self.assertEqual(reads[0]["data"], struct.pack("<8H", *self.IDENTITY).hex())
        self.assertEqual(reads[0]["part"], "identity")
        contents = rows[-1]
        self.assertEqual(contents["action"], "contents")
        self.assertEqual(contents["identity"],
                         {"vendor_id": 0x6A, "product_code": 0x414B44, "revision": 2, "serial": 0x1234})
        self.assertEqual(contents["mailboxes"]["out"], {"start": 0x1800, "length": 0x400})
        self.assertEqual(contents["known_words"], 14)
        self.assertIn("vendor 0x0000006a, product 0x00414b44", text[-1])

    def test_reading_again_tells_nothing_new(self):
        bus = scanned_bus()
        self.read(bus, 8, self.IDENTITY)
        bus.write(0x0120, b"\2\0")
        self.read(bus, 8, self.IDENTITY)
        rows, _ = self.of(bus, "eeprom")
        self.assertEqual([r["action"] for r in rows], ["read", "contents", "read"])

    def test_write_of_the_alias_and_errors(self):
        bus = scanned_bus()
        bus.write(0x0508, b"\x39\x30")
        bus.write(0x0502, struct.pack("<HI", 0x0201, 4))
        bus.read(0x0502, b"\0\0")
        bus.write(0x0502, struct.pack("<HI", 0x0100, 8))
        bus.read(0x0502, b"\0\x20")
        rows, text = self.of(bus, "eeprom")
        self.assertEqual([r["action"] for r in rows], ["write", "error"])
        self.assertEqual((rows[0]["address"], rows[0]["value"], rows[0]["part"], rows[0]["confirmed"]),
                         (4, 12345, "station alias", True))
        self.assertEqual((rows[1]["error_bits"], rows[1]["address"]), (0x2000, 8))
        self.assertIn("write word 0x0004, station alias: 0x3039", text[0])
        self.assertIn("no acknowledge", text[1])


class EventCaptures(Events):
    """Captures of real stacks, against what is known of them."""

    def setUp(self):
        super().setUp()
        if not (SHARED / "captures").is_dir():
            self.skipTest("captures not beside the project")

    def sdos(self, name):
        return self.rows("--type", "sdo", SHARED / "captures" / name)

    def truth(self, name):
        with open(SHARED / "captures" / f"{name}.truth.json") as file:
            return json.load(file)

    @staticmethod
    def number(value):
        return int(value, 0) if isinstance(value, str) else value

    def test_a_real_akd_and_its_mapping(self):
        rows = self.sdos("real/soem-sdinfo-akd.pcapng")
        self.assertEqual(len(rows), 35)
        for row in rows:
            self.assertEqual((row["service"], row["outcome"]), ("upload", "completed"))
            self.assertIsNotNone(row["value"], row)
            self.assertTrue(row["name"], row)
            self.assertGreater(row["duration_ms"], 0)
        values = {(r["index"], r["subindex"]): r["value"] for r in rows}
        # README of the captures: four PDOs of 2+3+6+6 bytes each way, 6040h and 6041h in each of them.
        for first, word in ((0x1600, "6040h:0 16 bit Control word"), (0x1A00, "6041h:0 16 bit Status word")):
            for pdo, size in zip(range(first, first + 4), (2, 3, 6, 6)):
                entries = [values[pdo, k + 1] for k in range(values[pdo, 0])]
                self.assertEqual(entries[0], word)
                self.assertEqual(sum(int(entry.split()[1]) for entry in entries), 8 * size, entries)
                for entry in entries:
                    self.assertRegex(entry, r"^[0-9A-F]{4}h:\d+ \d+ bit \S+")
        self.assertEqual([values[0x1C12, k] for k in range(5)], [4, 0x1600, 0x1601, 0x1602, 0x1603])
        self.assertEqual([values[0x1C13, k] for k in range(5)], [4, 0x1A00, 0x1A01, 0x1A02, 0x1A03])

    def test_the_latches_of_the_lab(self):
        # Its truth file: ten times an enable bit is set (edge 1 rising six times anew, edge 1 falling once), seven edges
        # are captured and read, two selectors and two reserved bits are wrong, one reading is too early, one of old.
        rows = self.rows("--type", "latch", SHARED / "captures/lab/latch.pcapng")
        steps = {}
        for row in rows:
            steps[row["step"]] = steps.get(row["step"], 0) + 1
        self.assertEqual(steps, {"arm": 3, "rearm": 7, "valid": 7, "read": 7, "disarm": 10, "misuse": 6})
        first = [row for row in rows if row["step"] == "read"][0]
        self.assertEqual(first["edge"], "external latch 1 rising")
        # 1B20h of this slave holds 20A6h, which the AKD manual does not give to any edge.
        self.assertEqual(first["read_by"], "selector")
        self.assertEqual(first["position"], 1029900)
        # Status 0x0001 is in LRW 420, sent 201 cycles of 1 ms after LRW 219.
        valid = [row for row in rows if row["step"] == "valid"][0]
        self.assertAlmostEqual(valid["latency_ms"], 201, delta=1)

    def test_words_of_the_eeprom_that_were_read_twice(self):
        # Wireshark: 26 reads of two words each (0x0508), word 0x00a2 in two of them. startup tells 52 words read.
        capture = SHARED / "captures/lab/startup-ok-1slave.pcapng"
        self.assertIn("51 different words", self.run_program("events", "--type", "eeprom", capture).out)
        self.assertIn("52 words read", self.run_program("startup", capture).out)

    def test_broadcasts_of_an_outbound_capture_are_assumed(self):
        # The same run with both directions; only the frame numbers are others.
        def broadcasts(name):
            rows = self.rows("--type", "register-write", SHARED / f"captures/lab/{name}.pcapng")
            return [row for row in rows if row["slave"] is None]
        both = broadcasts("startup-ok-1slave")
        outbound = broadcasts("startup-ok-1slave-outbound-only")
        self.assertGreater(len(both), 10)
        self.assertEqual([(row["address"], row["data"]) for row in outbound], [(row["address"], row["data"]) for row in both])
        self.assertEqual({row["acceptance"] for row in outbound}, {"assumed"})
        self.assertEqual(outbound[0]["frame"], 1)

    def test_the_process_data_of_the_real_akd(self):
        rows = self.rows("--type", "pdo-mapping", SHARED / "captures/real/soem-sdinfo-akd.pcapng")
        self.assertEqual([(r["direction"], r["bytes"], r["source"]) for r in rows],
                         [("rx", 17, "observed"), ("tx", 17, "observed")])
        for row, first, word in zip(rows, (0x1600, 0x1A00), (0x6040, 0x6041)):
            self.assertEqual(row["pdos"], [first + k for k in range(4)])
            self.assertEqual(sum(e["index"] == word for e in row["entries"]), 4)
            self.assertEqual(sum(e["bits"] for e in row["entries"]), 8 * 17)

    def test_terminals_keep_the_default_of_their_eeprom(self):
        rows = self.rows("--type", "pdo-mapping", SHARED / "captures/real/replay-dc.pcapng")
        # An EL2008 and an EL2889-like terminal: 8 and 16 outputs of one bit, on sync manager 0 (and 1).
        outputs = [r for r in rows if r["direction"] == "rx" and r["bytes"]]
        self.assertEqual([(r["slave"], r["source"], len(r["entries"])) for r in outputs],
                         [(1, "default", 8), (2, "default", 16)])

    def test_the_refusal_of_the_real_akd(self):
        rows = self.rows("--type", "al-request,al-state", SHARED / "captures/real/soem-sdinfo-akd.pcapng")
        last = [(r["event"], r["frame"], r["state"]) for r in rows[-3:]]
        self.assertEqual(last, [("al-request", 743, "SAFEOP"), ("al-state", 760, "PREOP"), ("al-state", 6758, "PREOP")])
        self.assertEqual((rows[-2]["status"], rows[-1]["status_code"]), (0x0012, 0x001D))

    def test_all_kinds_of_transfers(self):
        truth = self.truth("lab/sdo-mix")
        expected = [e for e in truth["sdo"] if e["ev"] in ("sdo_read", "sdo_write")]
        rows = self.sdos("lab/sdo-mix.pcapng")
        self.assertEqual(len(rows), len(expected))
        aborts = {self.number(a["packet"]): self.number(a["abort"])
                  for a in truth["capture_check"]["sdo_aborts_per_tshark"]}
        self.assertEqual(len(aborts), 11)
        self.assertEqual({r["response_frame"]: r["abort_code"] for r in rows if r["abort_code"] is not None}, aborts)
        for row, e in zip(rows, expected):
            with self.subTest(e):
                self.assertEqual(row["service"], "upload" if e["ev"] == "sdo_read" else "download")
                self.assertEqual((row["index"], row["complete_access"]), (self.number(e["index"]), bool(e["ca"])))
                self.assertEqual(row["abort_code"] is None, e["ok"])
                # The master rewrites subindex 2 of a complete access to 1: then it knows another length.
                if e["note"] == "CA with subindex 2 (SOEM rewrites to 1)":
                    continue
                self.assertEqual(row["subindex"], e["sub"])
                if e["ev"] == "sdo_write":
                    self.assertEqual(row["size"], e["size"])
                    self.assertEqual(int.from_bytes(bytes.fromhex(row["data"])[:4], "little"),
                                     self.number(e["value_le32"]))
                elif e["ok"]:
                    self.assertEqual(len(row["data"]), 2 * e["size"])
                    self.assertEqual(row["data"][:64], e["data_hex_first32"])

    def test_complete_access_of_a_mapping(self):
        truth = self.truth("lab/soem-slaveinfo-akdca")
        rows = self.sdos("lab/soem-slaveinfo-akdca.pcapng")
        requests = [m for m in truth["mailbox_messages_on_wire"] if m["dir"] == "master->slave" and m["coe_service"] == 2]
        self.assertEqual(len(rows), len(requests))
        self.assertEqual({r["response_frame"]: r["abort_code"] for r in rows if r["abort_code"] is not None},
                         {self.number(a["packet"]): self.number(a["abort"])
                          for a in truth["capture_check"]["sdo_aborts_per_tshark"]})
        mappings = [r for r in rows if r["complete_access"] and r["index"] in (0x1701, 0x1720, 0x1B01, 0x1B20, 0x1600)]
        for row in mappings:
            if row["abort_code"] is None:
                self.assertEqual(len(row["value"]), 1 + row["value"][0])
                for entry in row["value"][1:]:
                    self.assertRegex(entry, r"^([0-9A-F]{4}h:\d+ \d+ bit|gap of)")

    def test_transfers_of_a_real_coupler(self):
        rows = self.sdos("real/replay-ek1914-no-complete-access.pcapng")
        self.assertGreater(len(rows), 70)
        for row in rows:
            self.assertEqual((row["outcome"], row["complete_access"]), ("completed", False), row)
            self.assertEqual(len(row["data"]), 2 * row["declared_size"] if row["declared_size"] else len(row["data"]))
        name = self.sdos("real/replay-ek1914-segmented-upload.pcapng")
        self.assertEqual([(r["index"], r["transfer"], r["value"]) for r in name], [(0x1008, "normal", "EK1914")])

    def test_emergencies(self):
        rows = self.rows("--type", "emergency", SHARED / "captures/lab/mailbox-emergency.pcapng")
        self.assertEqual([(r["frame"], r["code"], r["register"], r["data"]) for r in rows],
                         [(292, 0x7305, 1, "1122334455")])

    def test_states_of_a_drive(self):
        capture = SHARED / "captures/lab/drive-fault.pcapng"
        rows = self.rows("--type", "drive-state", capture)
        truth = json.loads((SHARED / "captures/lab/drive-fault.truth.json").read_text())
        commands = [int(e["value"], 16) for e in truth["master_log"] if e["ev"] == "controlword"]
        self.assertEqual([r["word"] for r in rows if r["kind"] == "command"], commands)
        words = [0x0250]
        for entry in truth["master_log"]:
            word = entry.get("statusword1") or (entry["ev"] == "statusword" and (entry.get("slave1") or entry["value"]))
            if word and int(word, 16) != words[-1]:
                words.append(int(word, 16))
        self.assertEqual([r["word"] for r in rows if r["kind"] == "state"], words)
        fault = [r for r in rows if r["to"] == "Fault"]
        self.assertEqual([(r["frame"], r["from"], r["transitions"], r["command_frame"]) for r in fault],
                         [(3560, "Operation enabled", [13, 14], None)])
        ready = next(r for r in rows if r["to"] == "Ready to switch on")
        self.assertEqual((ready["transitions"], ready["command_frame"]), ([2], 767))
        self.assertTrue(1 < ready["reaction_ms"] < 4, ready)
        text = self.events("--type", "drive-state", capture).out
        self.assertIn("Switch on disabled -> Ready to switch on (status word 0x0231, transition 2)", text)
        self.assertIn("command: Shutdown (control word 0x0006, transition 2)", text)

    def test_what_an_eeprom_tool_read(self):
        rows = self.rows("--type", "eeprom", SHARED / "captures/lab/soem-eepromtool-read.pcapng")
        reads = [r for r in rows if r["action"] == "read"]
        # The whole EEPROM from word 0 on is one event.
        self.assertEqual(reads[-1]["address"], 0)
        self.assertEqual(reads[-1]["words"] % 64, 0)
        contents = rows[-1]
        self.assertEqual((contents["action"], contents["complete"], contents["name"]), ("contents", True, "AKD-EMUL"))
        self.assertEqual(contents["identity"]["vendor_id"], 0x6A)
        self.assertEqual([sm["use"] for sm in contents["sync_managers"]],
                         ["mailbox out", "mailbox in", "outputs", "inputs"])

    def test_nothing_crashes_on_damaged_files(self):
        for path in sorted((SHARED / "captures/lab").glob("garbage-*.pcapng")) + sorted(
                (SHARED / "captures/lab").glob("truncated-*.pcap*")):
            if path.suffix == ".json":
                continue
            done = self.run_program("events", "--format", "jsonl", path)
            self.assertIn(done.returncode, (0, 2), path)
            self.assertLessEqual(done.err.count("\n"), 1, done.err)
            for line in done.out.splitlines():
                json.loads(line)
