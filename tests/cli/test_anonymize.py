"""`anonymize`: what names people, places and devices is nowhere in the copy, and the copy is judged as the capture is."""
import json
import os
import struct
import unittest

from support import SHARED, SOURCE, CliTest, Bus, faulty_capture, healthy_capture

SAMPLES = SOURCE / "samples" / "captures"


def packets(path) -> list:
    """Bytes of all packets of a pcapng (little endian, as we write) or classic pcap file of this machine's order."""
    data = path.read_bytes()
    found = []
    if data[:4] == b"\x0a\x0d\x0d\x0a":
        at = 0
        while at + 12 <= len(data):
            kind, length = struct.unpack_from("<II", data, at)
            if kind == 6:
                size, = struct.unpack_from("<I", data, at + 20)
                found.append((struct.unpack_from("<II", data, at + 12), data[at + 28:at + 28 + size]))
            at += length
    return found


class Anonymize(CliTest):
    def anonymize(self, capture, *arguments):
        copy = self.dir / "copy.pcapng"
        done = self.run_program("anonymize", capture, "-o", copy, "--force", *arguments)
        self.assertEqual(done.returncode, 0, f"{capture}: {done.err}")
        self.assertFalse((self.dir / "copy.pcapng.unchecked").exists())
        return copy, done.out

    def facts(self, capture) -> list:
        done = self.run_program("check", "--format", "json", "--fail-on", "never", capture)
        self.assertEqual(done.returncode, 0, done.err)
        report = json.loads(done.out)["reports"][0]
        return sorted((f["rule"], f["severity"], str(f["slave"]), f["frame"], f["last_frame"], f["count"])
                      for f in report["findings"] if f["rule"] not in ("capture-truncated", "bus-switch"))

    def secrets_of(self, capture) -> set:
        """What the program itself reads in the capture as names: strings of EEPROMs and objects, serial numbers."""
        secrets = set()
        done = self.run_program("events", "--format", "jsonl", "--type", "eeprom,sdo", capture)
        for line in done.out.splitlines():
            event = json.loads(line)
            if event["event"] == "sdo" and event.get("index") in (0x1008, 0x1009, 0x100A) and event.get("data"):
                secrets.add(bytes.fromhex(event["data"]).rstrip(b"\0 "))
        done = self.run_program("check", "--format", "json", "--fail-on", "never", capture)
        for slave in json.loads(done.out)["reports"][0]["slaves"]:
            serial = (slave.get("identity") or {}).get("serial") or 0
            if 0xFFFF < serial < 0xFFFFFFFF:  # the last one is a blank EEPROM
                secrets.add(struct.pack("<I", serial))
            if slave.get("name"):
                secrets.add(slave["name"].encode())
        return {s for s in secrets if len(s) >= 4}

    def check_copy(self, capture):
        copy, _ = self.anonymize(capture)
        self.assertEqual(self.facts(copy), self.facts(capture), capture)
        whole = copy.read_bytes()
        for secret in self.secrets_of(capture):
            self.assertNotIn(secret, whole, capture)
        return copy

    def test_every_sample(self):
        captures = sorted(p for p in SAMPLES.iterdir() if p.suffix in (".pcap", ".pcapng"))
        self.assertGreater(len(captures), 60)
        for capture in captures:
            copy = self.check_copy(capture)
            before, after = packets(capture), packets(copy)
            if capture.suffix == ".pcapng" and capture.name != "truncated.pcapng":
                self.assertEqual([(t, len(b)) for t, b in before], [(t, len(b)) for t, b in after], capture)
            for _, packet in after:
                if packet[:4] != b"\x01\x01\x05\x10":
                    self.assertIn(packet[6:11].hex(), ("00005e0053", "02005e0053", "01005e0053", "03005e0053",
                                                       "0000000000", "0200000000"), capture)

    @unittest.skipUnless((SHARED / "captures").is_dir(), "the captures of real devices are not here")
    def test_captures_of_real_devices(self):
        for capture in sorted((SHARED / "captures" / "real").glob("*.pcapng")):
            self.check_copy(capture)
        for name in ("sdo-mix", "soem-slaveinfo-akd", "soem-eepromtool-read", "kickcat-ingenia-info", "mixed-traffic",
                     "startup-ok-1slave-udp", "startup-ok-1slave-cooked", "foe-unsupported",
                     "garbage-flipped-startup-ok-1slave"):
            self.check_copy(SHARED / "captures" / "lab" / f"{name}.pcapng")

    def eeprom(self, serial) -> Bus:
        bus = Bus()
        bus.exchange(7, 0, 0x0130, b"\0\0", b"\x01\0", 1)
        for word, data in ((0x08, b"\xff" * 8), (0x0C, b"\xff" * 4 + serial)):
            ask = struct.pack("<HI", 0x0100, word)
            bus.exchange(5, 0x1001, 0x0502, ask, ask, 1)
            bus.exchange(4, 0x1001, 0x0502, bytes(14), struct.pack("<HI", 0x0040, word) + data, 1)
        return bus

    def test_blank_serial_number(self):
        # 0xFFFFFFFF is no number of a device, but a part of what "blank" needs. One other bit makes it a number.
        blank = self.file("blank.pcap", self.eeprom(b"\xff" * 4).pcap())
        copy = self.check_copy(blank)
        self.assertEqual([rule for rule, *_ in self.facts(copy)], ["eeprom-invalid"])
        self.assertIn(b"\xff" * 8, copy.read_bytes())
        number = self.file("number.pcap", self.eeprom(b"\xff\xff\xff\x7f").pcap())
        copy = self.check_copy(number)
        self.assertIn(b"\xff" * 4 + bytes(4), copy.read_bytes())
        self.assertNotIn(b"\xff\xff\xff\x7f", copy.read_bytes())

    def mailbox(self, protocol, payload, length=64) -> bytes:
        return (struct.pack("<HHBB", len(payload), 0, 0, protocol | 0x10) + payload).ljust(length, b"\0")

    def test_contents_of_mailboxes(self):
        bus = Bus()
        bus.exchange(7, 0, 0x0130, b"\0\0", b"\x02\0", 1)
        secrets = [b"AxisOfMachine7", b"secretfile.bin", b"FIRMWARE-CONTENT", b"GET /payroll HTTP", b"VendorText"]
        sdo = struct.pack("<HBHBI", 3 << 12, 0x41, 0x1008, 0, len(secrets[0])) + secrets[0]
        bus.exchange(4, 0x1001, 0x1C00, bytes(64), self.mailbox(3, sdo), 1)
        for protocol, payload in ((4, b"\x02\0\x01\x02\x03\x04" + secrets[1]),
                                  (4, b"\x03\0\x01\0\0\0" + secrets[2]),
                                  (2, struct.pack("<HH", 0x0100, 0x0001) + secrets[3]),
                                  (15, b"\x01\0\0\0\x02\0" + secrets[4])):
            message = self.mailbox(protocol, payload)
            bus.exchange(5, 0x1001, 0x1800, message, message, 1)
        path = self.file("mailbox.pcap", bus.pcap())
        for secret in secrets:
            self.assertIn(secret, (self.dir / "mailbox.pcap").read_bytes())
        copy, out = self.anonymize(path)
        whole = copy.read_bytes()
        for secret in secrets:
            self.assertNotIn(secret, whole)
        self.assertNotIn(b"\x01\x02\x03\x04", whole)  # the password
        for what in ("MAC address", "SDO value", "EoE message", "FoE message", "other mailbox message"):
            self.assertIn(what, out)

    def test_mailboxes_among_the_process_data(self):
        # The master maps the mailbox into an FMMU and reads it with LRD, as some do.
        bus = Bus()
        bus.exchange(7, 0, 0x0130, b"\0\0", b"\x02\0", 1)
        manager = struct.pack("<HHBBBB", 0x1C00, 64, 0x22, 0, 1, 0)
        bus.exchange(5, 0x1001, 0x0808, manager, manager, 1)
        fmmu = struct.pack("<IHBBHBBBxxx", 0x00010000, 64, 0, 7, 0x1C00, 0, 1, 1)
        bus.exchange(5, 0x1001, 0x0610, fmmu, fmmu, 1)
        secret = b"AxisOfMachine7"
        sdo = struct.pack("<HBHBI", 3 << 12, 0x41, 0x1008, 0, len(secret)) + secret
        bus.exchange(10, 0, 1, bytes(64), self.mailbox(3, sdo), 1)
        path = self.file("mapped.pcap", bus.pcap())
        self.assertIn(secret, (self.dir / "mapped.pcap").read_bytes())
        copy, out = self.anonymize(path)
        self.assertNotIn(secret, copy.read_bytes())
        self.assertIn("SDO value", out)

    def test_bits_behind_a_message(self):
        # What a broken cable flips behind a message makes both copies differ; that they do stays.
        bus = Bus()
        bus.exchange(7, 0, 0x0130, b"\0\0", b"\x02\0", 1)
        sdo = struct.pack("<HBHBI", 2 << 12, 0x40, 0x1008, 0, 0)
        message = self.mailbox(3, sdo)
        flipped = message[:40] + b"\x08" + message[41:]
        bus.exchange(5, 0x1001, 0x1800, flipped, message, 1)
        copy, _ = self.anonymize(self.file("flipped.pcap", bus.pcap()))
        sent, returned = [packet for _, packet in packets(copy)][-2:]
        self.assertNotEqual(sent[26:90], returned[26:90])

    def test_other_traffic_and_comments(self):
        copy = self.check_copy(SAMPLES / "foreign-traffic.pcapng")
        kinds = {packet[12:14].hex() for _, packet in packets(copy)}
        self.assertEqual(kinds, {"88a4", "88b5"})
        for _, packet in packets(copy):
            if packet[12:14].hex() == "88b5":
                self.assertEqual(packet[14:].strip(b"\0"), b"")
        annotated = self.dir / "annotated.pcapng"
        self.run_program("annotate", SAMPLES / "al-timeout.pcapng", "-o", annotated)
        self.assertIn(b"al-timeout", annotated.read_bytes())
        copy, _ = self.anonymize(annotated)
        self.assertNotIn(b"al-timeout", copy.read_bytes())

    def test_what_cannot_be(self):
        self.assertIn("-o PATH", self.one_error("anonymize", self.healthy))
        self.assertIn("give -o the name of a file", self.one_error("anonymize", self.healthy, "-o", "-"))
        self.assertIn("not standard input", self.one_error("anonymize", "-", "-o", "x.pcapng"))
        self.assertIn("reads one capture", self.one_error("anonymize", self.healthy, self.faulty, "-o", "x.pcapng"))
        self.assertIn("no such file", self.one_error("anonymize", "nowhere.pcap", "-o", "x.pcapng"))
        self.file("there.pcapng", b"x")
        self.assertIn("give --force", self.one_error("anonymize", self.healthy, "-o", "there.pcapng"))
        self.assertIn("a capture", self.one_error("anonymize", self.healthy, "-o", self.healthy, "--force"))
        self.assertFalse((self.dir / "x.pcapng").exists())


if __name__ == "__main__":
    unittest.main()
