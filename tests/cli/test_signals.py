"""signals: process data by name. Values are checked against Wireshark's bytes and what the lab's master noted."""
import csv
import io
import json
import os
import shutil
import struct
import subprocess
import threading
import unittest

from support import BRD, FPRD, FPWR, LRW, SHARED, SOURCE, APWR, Bus, CliTest

LAB = SHARED / "captures" / "lab"
SAMPLES = SOURCE / "samples" / "captures"
ALL_LRW = "ecat.cmd==12"


def entry(index, sub, bits, name, data_type):
    return (f"<Entry><Index>#x{index:04X}</Index><SubIndex>{sub}</SubIndex><BitLen>{bits}</BitLen>"
            f"<Name>{name}</Name><DataType>{data_type}</DataType></Entry>")


def esi(rx, tx):
    """One product of a vendor of our own."""
    return ("<EtherCATInfo><Vendor><Id>#x999</Id></Vendor><Descriptions><Devices><Device>"
            '<Type ProductCode="1" RevisionNo="1">Drive</Type>'
            f'<RxPdo Sm="2"><Index>#x1600</Index>{rx}</RxPdo><TxPdo Sm="3"><Index>#x1A00</Index>{tx}</TxPdo>'
            "</Device></Devices></Descriptions></EtherCATInfo>")


def drive_bus(outputs=6, inputs=4) -> Bus:
    """One slave whose outputs lie at 0x10000 and inputs behind them."""
    bus = Bus()
    bus.exchange(BRD, 0, 0x0130, b"\0\0", b"\x02\0", 1)
    bus.exchange(APWR, 0, 0x0010, b"\x01\x10", b"\x01\x10", 1)
    bus.write(0x0600, bytes(256))
    bus.write(0x0810, struct.pack("<HHBBBB", 0x1100, outputs, 0x64, 0, 1, 0))
    bus.write(0x0818, struct.pack("<HHBBBB", 0x1140, inputs, 0x20, 0, 1, 0))
    bus.write(0x0600, struct.pack("<IHBBHBBBxxx", 0x10000, outputs, 0, 7, 0x1100, 0, 2, 1))
    bus.write(0x0610, struct.pack("<IHBBHBBBxxx", 0x10000 + outputs, inputs, 0, 7, 0x1140, 0, 1, 1))
    return bus


def exchange(bus, outputs, inputs, wkc=3):
    bus.exchange(LRW, 0, 1, outputs + bytes(len(inputs)), outputs + inputs, wkc)


class SignalTest(CliTest):
    def signals(self, *arguments, status=0, **options):
        done = self.run_program("signals", *arguments, **options)
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.err}")
        return done

    def table(self, *arguments, **options):
        """(header, rows) of the CSV."""
        rows = list(csv.reader(io.StringIO(self.signals(*arguments, **options).out)))
        for row in rows:
            self.assertEqual(len(row), len(rows[0]))
        return rows[0], rows[1:]

    def columns(self, *arguments, **options):
        """The rows as dictionaries."""
        header, rows = self.table(*arguments, **options)
        self.assertEqual(len(set(header)), len(header), "a header stands twice")
        return [dict(zip(header, row)) for row in rows]

    def setUp(self):
        super().setUp()
        bus = drive_bus()
        for i in range(10):
            control = 6 if i < 5 else 15
            status = 0x0231 if i < 7 else 0x0237
            exchange(bus, struct.pack("<Hi", control, -100 * (i // 2)), struct.pack("<Hbb", status, 0, -8))
        self.capture = self.file("drive.pcap", bus.pcap())
        self.esi = self.file("drive.xml", esi(
            entry(0x6040, 0, 16, "", "UINT") + entry(0x607A, 0, 32, "", "DINT"),
            entry(0x6041, 0, 16, "", "UINT") + "<Entry><Index>0</Index><BitLen>8</BitLen></Entry>"
            + entry(0x2ABC, 3, 8, 'Mode, "as wired"; \u00e4', "SINT")))


class SignalTable(SignalTest):
    def test_values_by_name(self):
        rows = self.columns(self.capture, "--esi", self.esi)
        self.assertEqual(list(rows[0]), ["time_s", "frame", "S0.Control word", "S0.Target position", "S0.Status word",
                                         'S0.Mode, "as wired"; \u00e4'])
        self.assertEqual(len(rows), 10)
        self.assertEqual([r["S0.Control word"] for r in rows], ["6"] * 5 + ["15"] * 5)
        self.assertEqual([int(r["S0.Target position"]) for r in rows], [-100 * (i // 2) for i in range(10)])
        self.assertEqual([int(r["S0.Status word"]) for r in rows], [0x0231] * 7 + [0x0237] * 3)
        self.assertEqual({r['S0.Mode, "as wired"; \u00e4'] for r in rows}, {"-8"})
        self.assertEqual([int(r["frame"]) for r in rows], list(range(16, 35, 2)))  # the returned copies
        self.assertEqual(rows[0]["time_s"], "0.007020000")

    def test_unknown_mapping_is_raw_and_says_why(self):
        done = self.signals(self.capture)
        rows = list(csv.DictReader(io.StringIO(done.out)))
        self.assertEqual(rows[0]["S0.outputs (hex)"], "060000000000")
        self.assertEqual(rows[9]["S0.inputs (hex)"], "370200f8")
        self.assertIn("S0 outputs: raw bytes, since the assignment 1C12h is not in the capture", done.err)
        self.assertIn("S0 inputs: raw bytes, since the assignment 1C13h is not in the capture", done.err)

    def test_a_name_that_matches_nothing_is_said(self):
        done = self.signals(self.capture, "--esi", self.esi, "--signal", "6040h,nosuch")
        self.assertIn("no signal matches 'nosuch'", done.err)
        self.assertNotIn("'6040h'", done.err)

    def test_states(self):
        rows = self.columns(self.capture, "--esi", self.esi, "--states", "--signal", "6040h,6041h")
        self.assertEqual([r["S0.Status word state"] for r in rows], ["Ready to switch on"] * 7 + ["Operation enabled"] * 3)
        self.assertEqual(rows[0]["S0.Control word command"], "Shutdown")
        self.assertIn("Enable operation", rows[9]["S0.Control word command"])

    def test_states_of_a_device_without_status_word(self):
        bus = drive_bus()
        for status in (0x20000010, 0x20000110, 0x20008010):
            exchange(bus, bytes(6), struct.pack("<I", status))
        capture = self.file("supply.pcap", bus.pcap())
        described = self.file("supply.xml", esi(entry(0x3000, 0, 16, "clear faults", "UINT") +
                                                entry(0x6300, 1, 32, "outputs", "UDINT"),
                                                entry(0x1002, 0, 32, "status", "UDINT")))
        options = ("--esi", described, "--profile", "kollmorgen-mkd-c", "--signal", "1002h")
        rows = self.columns(capture, *options, "--states")
        name = next(name for name in rows[0] if name.endswith(" meaning"))
        self.assertEqual([row[name] for row in rows],
                         ["bits 4-6 CPS.ACTIVE = 1, bit 29 state of hardware enable",
                          "bits 4-6 CPS.ACTIVE = 1, bit 8 warning active on MKD-C, bit 29 state of hardware enable",
                          "bits 4-6 CPS.ACTIVE = 1, bit 15 fault active on MKD-C, bit 29 state of hardware enable"])
        self.assertEqual(len(self.table(capture, *options)[0]), 3)
        lines = [json.loads(line) for line in
                 self.signals(capture, *options, "--states", "--format", "jsonl").out.splitlines()]
        self.assertEqual([line.get("kind") for line in lines[:2]], ["signal", "meaning"])
        self.assertEqual(lines[2]["values"][name], rows[0][name])

    def test_signals_are_chosen_by_name_and_object(self):
        def header(*patterns):
            options = [o for p in patterns for o in ("--signal", p)]
            return self.table(self.capture, "--esi", self.esi, *options)[0][2:]
        self.assertEqual(header("target*"), ["S0.Target position"])
        self.assertEqual(header("607Ah"), ["S0.Target position"])
        self.assertEqual(header("0x607a:0"), ["S0.Target position"])
        self.assertEqual(header("604?"), ["S0.Control word", "S0.Status word"])
        self.assertEqual(header("s0.status WORD", "607a"), ["S0.Target position", "S0.Status word"])
        self.assertEqual(len(header("*")), 4)
        message = self.one_error("signals", self.capture, "--esi", self.esi, "--object", "velocity*")
        self.assertIn("no signal matches --signal; there are Control word, Target position, Status word", message)
        self.assertIn("--signal is 'a,,b'", self.one_error("signals", self.capture, "--signal", "a,,b"))

    def test_changes(self):
        rows = self.columns(self.capture, "--esi", self.esi, "--changes", "--signal", "6040h,6041h")
        self.assertEqual([(r["S0.Control word"], int(r["S0.Status word"])) for r in rows],
                         [("6", 0x0231), ("15", 0x0231), ("15", 0x0237)])

    def test_every(self):
        rows = self.columns(self.capture, "--esi", self.esi, "--every", "4")
        self.assertEqual([int(r["S0.Target position"]) for r in rows], [0, -200, -400])
        for wrong in ("0", "-1", "x", "1.5", ""):
            self.assertIn("--every", self.one_error("signals", self.capture, f"--every={wrong}"))

    def test_range(self):
        rows = self.columns(self.capture, "--esi", self.esi, "--from", "#20", "--to", "#25")
        self.assertEqual([r["frame"] for r in rows], ["20", "22", "24"])
        rows = self.columns(self.capture, "--esi", self.esi, "--from", "0.0085", "--to", "0.0105")
        self.assertEqual([r["frame"] for r in rows], ["20", "22"])

    def test_slave(self):
        self.assertEqual(len(self.columns(self.capture, "--esi", self.esi, "--slave", "0x1001")), 10)
        self.assertIn("has no slave 3", self.one_error("signals", self.capture, "--slave", "3"))

    def test_inputs_that_the_slave_did_not_give_stay_empty(self):
        bus = drive_bus()
        exchange(bus, bytes(6), b"\x37\x02\0\0")
        exchange(bus, bytes(6), b"\x37\x02\0\0", wkc=2)
        exchange(bus, bytes(6), b"\x37\x02\0\0", wkc=0)
        path = self.file("wkc.pcap", bus.pcap())
        rows = self.columns(path, "--esi", self.esi, "--signal", "604?")
        self.assertEqual([r["S0.Status word"] for r in rows], [str(0x0237), "", ""])
        self.assertEqual([r["S0.Control word"] for r in rows], ["0"] * 3)
        # Becoming unknown is a change.
        rows = self.columns(path, "--esi", self.esi, "--changes")
        self.assertEqual([r["S0.Status word"] for r in rows], [str(0x0237), ""])

    def test_new_mapping_has_columns_of_its_own(self):
        bus = drive_bus()
        exchange(bus, bytes(6), b"\x37\x02\0\0")
        # The mapping in the file is for 4 bytes: with 6 it must be another one.
        bus.write(0x0818, struct.pack("<HHBBBB", 0x1140, 6, 0x20, 0, 1, 0))
        bus.write(0x0610, struct.pack("<IHBBHBBBxxx", 0x10006, 6, 0, 7, 0x1140, 0, 1, 1))
        exchange(bus, bytes(6), b"\1\2\3\4\5\6")
        done = self.signals(self.file("two.pcap", bus.pcap()), "--esi", self.esi)
        rows = list(csv.DictReader(io.StringIO(done.out)))
        self.assertEqual([r["S0.Status word"] for r in rows], [str(0x0237), ""])
        self.assertEqual([r["S0.inputs (hex)"] for r in rows], ["", "010203040506"])
        self.assertIn("sync manager 3 is set to 6 bytes", done.err)

    def test_same_object_twice(self):
        twice = self.file("twice.xml", esi(entry(0x6040, 0, 16, "", "UINT") * 2 + entry(0x607A, 0, 16, "", "INT"),
                                           entry(0x6041, 0, 16, "", "UINT") * 2))
        header = self.table(self.capture, "--esi", twice)[0]
        self.assertEqual(header[2:], ["S0.Control word (1600h)", "S0.Control word (1600h) #2", "S0.Target position",
                                      "S0.Status word (1A00h)", "S0.Status word (1A00h) #2"])

    def test_scale(self):
        # 3406h:1 of the MKD-N counts thousandths.
        path = self.file("scale.xml", esi(entry(0x3406, 1, 32, "", "UDINT") + entry(0x6040, 0, 16, "", "UINT"),
                                          entry(0x6041, 0, 32, "", "UDINT")))
        bus = drive_bus()
        exchange(bus, struct.pack("<IH", 1500, 6), bytes(4))
        capture = self.file("scale.pcap", bus.pcap())
        options = [capture, "--esi", path, "--profile", "kollmorgen-mkd-n", "--signal", "3406h"]
        self.assertEqual(self.table(*options)[1][0][2], "1500")
        self.assertEqual(self.table(*options, "--scaled")[1][0][2], "1.5")

    def test_process_data_by_address(self):
        bus = drive_bus()
        bus.exchange(FPWR, 0x1001, 0x1100, struct.pack("<Hi", 15, 7), struct.pack("<Hi", 15, 7), 1)
        bus.exchange(FPRD, 0x1001, 0x1140, bytes(4), b"\x37\x02\0\xf8", 1)
        rows = self.columns(self.file("direct.pcap", bus.pcap()), "--esi", self.esi, "--signal", "604?,607A")
        self.assertEqual([(r["S0.Control word"], r["S0.Target position"], r["S0.Status word"]) for r in rows],
                         [("15", "7", ""), ("", "", str(0x0237))])

    def test_capture_without_process_data(self):
        done = self.signals(self.healthy)
        self.assertEqual(done.out, "time_s,frame\n")
        self.assertIn("no process data", done.err)


class SignalStreams(SignalTest):
    def test_json_lines_say_the_same(self):
        header, rows = self.table(self.capture, "--esi", self.esi, "--states")
        lines = [json.loads(line) for line in
                 self.signals(self.capture, "--esi", self.esi, "--states", "--format", "jsonl").out.splitlines()]
        columns = [line for line in lines if "column" in line]
        self.assertEqual([c["column"] for c in columns], header[2:])
        self.assertEqual(lines[:len(columns)], columns, "columns come first")
        control = columns[0]
        self.assertEqual((control["slave"], control["station_address"], control["direction"], control["pdo"],
                          control["index"], control["subindex"], control["bits"], control["type"], control["source"]),
                         (0, 0x1001, "rx", 0x1600, 0x6040, 0, 16, "UNSIGNED16", "default"))
        for row, line in zip(rows, lines[len(columns):], strict=True):
            self.assertEqual(row[1], str(line["frame"]))
            self.assertAlmostEqual(float(row[0]), line["time_s"], places=9)
            self.assertEqual(list(line["values"]), header[2:])
            self.assertEqual([str(v) for v in line["values"].values()], row[2:])

    def test_json_lines_of_raw_bytes_hold_the_reason(self):
        lines = [json.loads(line) for line in self.signals(self.capture, "--format", "jsonl").out.splitlines()]
        self.assertEqual(lines[0]["kind"], "raw")
        self.assertIn("1C12h is not in the capture", lines[0]["reason"])
        self.assertEqual(lines[2]["values"]["S0.outputs (hex)"], "060000000000")

    def test_standard_input_and_pipes_read_like_files(self):
        expected = self.signals(self.capture, "--esi", self.esi).out
        with open(self.capture, "rb") as stream:
            self.assertEqual(self.signals("-", "--esi", self.esi, input=stream.read()).out, expected)
        pipe = str(self.dir / "pipe")
        os.mkfifo(pipe)
        content = open(self.capture, "rb").read()

        def feed():
            with open(pipe, "wb") as out:
                out.write(content)

        feeder = threading.Thread(target=feed)
        feeder.start()
        self.assertEqual(self.signals(pipe, "--esi", self.esi).out, expected)
        feeder.join(timeout=60)
        self.assertNotIn("/dev/fd", self.one_error("signals", "-", input=b"text, no packets"))

    def test_rows_that_cannot_be_kept_are_read_once_more(self):
        bus = drive_bus()
        for n in range(4000):
            exchange(bus, struct.pack("<HI", n // 900, n * 7919), struct.pack("<HH", n // 500, n), 3 if n % 50 else 1)
        capture = self.file("long.pcap", bus.pcap())
        for arguments in ((), ("--esi", self.esi, "--states"), ("--changes", "--format", "jsonl"), ("--every", "7")):
            kept = self.signals(capture, *arguments)
            self.assertGreater(len(kept.out.splitlines()), 500)
            # Without a place for a temporary file the capture is read twice; small captures need none.
            again = self.signals(capture, *arguments, env={**os.environ, "TMPDIR": "/nonexistent"})
            self.assertEqual(again.out, kept.out)
            self.assertEqual(again.err, kept.err)

    def test_several_outputs(self):
        self.signals(self.capture, "-o", "csv=a.csv", "-o", "jsonl=b.jsonl", "-o", "c.csv")
        table = (self.dir / "a.csv").read_text()
        self.assertTrue(table.startswith("time_s,frame,"))
        self.assertEqual((self.dir / "c.csv").read_text(), table)
        self.assertEqual(len((self.dir / "b.jsonl").read_text().splitlines()), 12)

    def test_failure_leaves_no_file(self):
        self.one_error("signals", self.capture, "--signal", "nothing", "-o", "a.csv")
        self.assertFalse((self.dir / "a.csv").exists())

    def test_closed_pipe_is_no_error(self):
        done = subprocess.run(f"'{os.environ['ECAUDIT']}' signals '{self.capture}' | head -1", shell=True,
                              capture_output=True, text=True, timeout=60, cwd=self.dir)
        self.assertEqual(done.stdout.count("\n"), 1)
        self.assertNotIn("error", done.stderr)


class SignalSamples(SignalTest):
    """Our own captures with the descriptions that lie beside them."""

    DESCRIPTIONS = SOURCE / "samples" / "descriptions"

    def test_start_up_by_name_with_the_esi(self):
        rows = self.columns(SAMPLES / "clean-startup.pcapng", "--esi", self.DESCRIPTIONS / "drive.esi.xml", "--states")
        states = [r["S0.Status word state"] for r in rows]
        steps = [a for a, b in zip(states, [None] + states) if a != b]
        self.assertEqual(steps[:4], ["Switch on disabled", "Ready to switch on", "Switched on", "Operation enabled"])
        # The drive is moved: the position that it reports is what was commanded before.
        commanded = [int(r["S0.Interpolated position command"]) for r in rows]
        reported = [int(r["S0.Position actual internal value"]) for r in rows]
        self.assertGreater(max(commanded), 0)
        self.assertTrue(set(reported) <= set(commanded))

    def test_mid_run_by_name_with_the_eni(self):
        rows = self.columns(SAMPLES / "mid-run.pcapng", "--eni", self.DESCRIPTIONS / "two-axes.eni.xml", "--states")
        self.assertEqual(len(rows), 160)
        # Axis X has variables in the process image of the file, axis Y has none.
        self.assertEqual({r["Axis X.Status word state"] for r in rows} | {r["S1.Status word state"] for r in rows},
                         {"Operation enabled"})

    def test_mid_run_with_the_esi_is_inferred_where_one_arrangement_fits(self):
        capture = SAMPLES / "mid-run.pcapng"
        done = self.signals(capture, "--esi", self.DESCRIPTIONS / "drive.esi.xml")
        self.assertIn("places of the process data inferred: 2 devices of drive.esi.xml in LRW 0x00000000: outputs of "
                      "all, then inputs of all", done.err)
        by_eni = self.signals(capture, "--eni", self.DESCRIPTIONS / "two-axes.eni.xml")
        self.assertEqual(done.out.splitlines()[1:], by_eni.out.splitlines()[1:])

    def test_variables_of_the_eni_name_and_select_columns(self):
        done = self.signals(SAMPLES / "mid-run.pcapng", "--eni", self.DESCRIPTIONS / "two-axes.eni.xml",
                            "--signal", "axis x.set*", "--signal", "S1.Control word")
        self.assertEqual(done.out.splitlines()[0].split(",")[2:], ["Axis X.Set position", "S1.Control word"])

    def test_what_several_arrangements_fit_stays_raw(self):
        # Nothing moves and there is no status word: outputs first or inputs first?
        still = self.file("still.xml", esi(entry(0x7000, 1, 48, "", "UDINT"), entry(0x6000, 1, 48, "", "UDINT")))
        bus = Bus()
        for _ in range(40):
            bus.exchange(LRW, 0, 1, bytes(12), bytes(12), 3)
        done = self.signals(self.file("still.pcap", bus.pcap()), "--esi", still)
        self.assertNotIn("inferred", done.err)
        self.assertIn("LRW 0x00010000 12 bytes", done.out.splitlines()[0])

    def test_device_that_does_not_fit_the_length_stays_raw(self):
        done = self.signals(SAMPLES / "mid-run.pcapng", "--esi", self.file("other.xml", esi(
            entry(0x6040, 0, 16, "", "UINT"), entry(0x6041, 0, 16, "", "UINT"))))
        self.assertNotIn("inferred", done.err)
        self.assertIn("LRW 0x00000000 24 bytes", done.out.splitlines()[0])

    def test_every_sample_is_written(self):
        for path in sorted(SAMPLES.glob("*.pcap*")):
            with self.subTest(sample=path.name):
                header, rows = self.table(path, "--states")
                self.assertEqual(header[0], "time_s")
                done = self.signals(path, "--format", "jsonl")
                for line in done.out.splitlines():
                    json.loads(line)


@unittest.skipUnless(LAB.is_dir(), "the lab captures are not here")
class SignalCaptures(SignalTest):
    """Lab captures: what Wireshark shows, and what the master noted while it ran."""

    def truth(self, name):
        return json.loads((LAB / f"{name}.truth.json").read_text())

    @staticmethod
    def entries(pdo):
        with open(SHARED / "reference" / "fixed_pdos.csv", newline="") as table:
            return [r for r in csv.DictReader(table) if r["family"] == "akd_b" and r["pdo_index"] == pdo]

    @unittest.skipUnless(shutil.which("tshark"), "tshark is not installed")
    def test_values_are_those_of_wireshark(self):
        path = LAB / "startup-ok-1slave.pcapng"
        out = subprocess.run(["tshark", "-r", str(path), "-Y", "ecat.cmd==12", "-T", "fields", "-e", "frame.number",
                              "-e", "ecat.data"], capture_output=True, text=True, timeout=300, check=True).stdout
        data = {int(line.split("\t")[0]): bytes.fromhex(line.split("\t")[1]) for line in out.splitlines()}
        layout = [(0, e) for e in self.entries("0x1720")] + [(12, e) for e in self.entries("0x1B20")]
        header, rows = self.table(path)
        self.assertEqual(len(header) - 2, len(layout))
        self.assertEqual(len(rows), 5148)
        for row in rows:
            payload = data[int(row[1])]
            for cell, (base, e) in zip(row[2:], layout):
                at = base + int(e["byte_offset"])
                value = int.from_bytes(payload[at:at + int(e["bits"]) // 8], "little")
                self.assertEqual(int(cell) & ((1 << int(e["bits"])) - 1), value, (row[1], e["signal_name"]))

    def test_words_and_positions_are_those_the_master_saw(self):
        rows = self.columns(LAB / "latch.pcapng")
        latch, control = "S0.Latch status", "S0.Latch control word"
        position, captured = "S0.Position actual internal value", "S0.captured position, latch 1"
        statuses = [e for e in self.truth("latch")["master_log"] if e["ev"] == "latch_status"]
        self.assertGreater(len(statuses), 10)
        for e in statuses:
            row = rows[e["lrw_no"] - 1]
            self.assertEqual(int(row[latch]), int(e["value"], 0), e)
            self.assertEqual(int(row[position]), e["act_pos"], e)
            if int(e["value"], 0) < 0x0300:  # latch 2 has its own object, which this PDO does not hold
                self.assertEqual(int(row[captured]), e["latch_pos"], e)
        for e in self.truth("latch")["master_log"]:
            if e["ev"] == "latch_control":
                self.assertEqual(int(rows[e["lrw_no"] - 1][control]), int(e["value"], 0), e)

    def test_drive_states_of_three_slaves(self):
        states = {0x0250: "Switch on disabled", 0x0231: "Ready to switch on", 0x0233: "Switched on",
                  0x1237: "Operation enabled"}
        rows = self.columns(LAB / "startup-ok-3slaves.pcapng", "--states")
        seen = 0
        for e in self.truth("startup-ok-3slaves")["master_log"]:
            for slave in range(3):
                word = e.get(f"statusword{slave + 1}") or e.get(f"slave{slave + 1}")
                if e["ev"] not in ("statusword", "controlword") or word is None:
                    continue
                row = rows[e["cycle"] - 1]
                self.assertEqual(int(row[f"S{slave}.Status word"]), int(word, 0), e)
                self.assertEqual(row[f"S{slave}.Status word state"], states[int(word, 0)], e)
                seen += 1
        self.assertGreaterEqual(seen, 6)

    def test_dc_time_stands_beside_the_values(self):
        rows = self.columns(LAB / "dc.pcapng")
        times = [int(r["dc_time_ns"]) for r in rows if r["dc_time_ns"]]
        self.assertGreater(len(times), 5000)
        self.assertTrue(all(a < b for a, b in zip(times, times[1:])))
        # 1 kHz: the reference clock and the capture agree to a few per cent over the whole run.
        seconds = [float(r["time_s"]) for r in rows if r["dc_time_ns"]]
        self.assertAlmostEqual((times[-1] - times[0]) / 1e9 / (seconds[-1] - seconds[0]), 1.0, places=2)

    def test_mid_run_with_the_esi(self):
        def pdo(tag, manager, index):
            entries = "".join(entry(int(e["object_index"], 0), e["subindex"], e["bits"], e["signal_name"],
                                    "UINT" if e["bits"] == "16" else "DINT") for e in self.entries(index))
            return f'<{tag} Sm="{manager}"><Index>#{index[1:]}</Index>{entries}</{tag}>'
        path = self.file("akd.xml", '<EtherCATInfo><Vendor><Id>106</Id></Vendor><Descriptions><Devices><Device>'
                         '<Type ProductCode="4279108" RevisionNo="3">AKD</Type>'
                         f'{pdo("RxPdo", 2, "0x1720")}{pdo("TxPdo", 3, "0x1B20")}</Device></Devices></Descriptions>'
                         '</EtherCATInfo>')
        done = self.signals(LAB / "mid-run.pcapng", "--esi", path, "--states")
        self.assertIn("2 devices of akd.xml", done.err)
        rows = list(csv.DictReader(io.StringIO(done.out)))
        self.assertEqual({row["S0.Status word state"] for row in rows} | {row["S1.Status word state"] for row in rows},
                         {"Operation enabled"})
        # The lab's axes move: 100 increments a cycle, the reported position two cycles behind.
        positions = [int(row["S1.Position actual internal value"]) for row in rows]
        self.assertTrue(all(0 <= b - a <= 1000 for a, b in zip(positions, positions[1:])))
        self.assertGreater(positions[-1], positions[0])

    def test_mid_run_without_files_is_raw(self):
        done = self.signals(LAB / "mid-run.pcapng")
        self.assertIn("LRW 0x00000000 90 bytes: raw bytes, since no FMMU setting in the capture maps these addresses",
                      done.err)
        self.assertIn("--eni", done.err)
        rows = list(csv.DictReader(io.StringIO(done.out)))
        self.assertEqual(len(rows[5]["LRW 0x00000000 90 bytes returned (hex)"]), 180)

    def test_mid_run_by_name_with_the_eni(self):
        def pdo(tag, manager, index):
            entries = "".join(entry(int(e["object_index"], 0), e["subindex"], e["bits"], e["signal_name"],
                                    "UINT" if e["bits"] == "16" else "DINT") for e in self.entries(index))
            return f'<{tag} Sm="{manager}"><Index>#{index[1:]}</Index>{entries}</{tag}>'
        slaves = "".join(
            f"<Slave><Info><Name>Axis {k}</Name><PhysAddr>{0x1001 + k}</PhysAddr><AutoIncAddr>{-k & 0xFFFF}</AutoIncAddr>"
            f"<VendorId>106</VendorId><ProductCode>4279108</ProductCode></Info><ProcessData>"
            f"<Send><BitStart>{96 * k}</BitStart><BitLength>96</BitLength></Send>"
            f"<Recv><BitStart>{192 + 256 * k}</BitStart><BitLength>256</BitLength></Recv>"
            f"{pdo('RxPdo', 2, '0x1720')}{pdo('TxPdo', 3, '0x1B20')}</ProcessData></Slave>" for k in range(2))
        eni = self.file("net.xml", f"<EtherCATConfig><Config>{slaves}<Cyclic><Frame><Cmd><Cmd>12</Cmd><Addr>0</Addr>"
                        "<DataLength>90</DataLength><Cnt>6</Cnt><InputOffs>0</InputOffs><OutputOffs>0</OutputOffs>"
                        "</Cmd></Frame></Cyclic></Config></EtherCATConfig>")
        raw = list(csv.DictReader(io.StringIO(self.signals(LAB / "mid-run.pcapng").out)))
        rows = self.columns(LAB / "mid-run.pcapng", "--eni", eni, "--states")
        self.assertEqual(len(rows), len(raw))
        for row, bytes_of in zip(rows, raw):
            data = bytes.fromhex(bytes_of["LRW 0x00000000 90 bytes returned (hex)"])
            for k in range(2):
                self.assertEqual(int(row[f"S{k}.Control word"]), int.from_bytes(data[12 * k:12 * k + 2], "little"))
                at = 24 + 32 * k
                self.assertEqual(int(row[f"S{k}.Position actual internal value"]),
                                 int.from_bytes(data[at:at + 4], "little", signed=True))
                self.assertEqual(int(row[f"S{k}.Status word"]), int.from_bytes(data[at + 24:at + 26], "little"))
        self.assertEqual({row["S1.Status word state"] for row in rows}, {"Operation enabled"})
        only = self.table(LAB / "mid-run.pcapng", "--eni", eni, "--slave", "1")[0]
        self.assertTrue(all(name.startswith("S1.") for name in only[2:]), only)


if __name__ == "__main__":
    unittest.main()
