"""A second opinion: every datagram and every SDO object that Wireshark sees, in the same captures."""
import json
import shutil
import subprocess
import unittest

from support import SHARED, SOURCE, CliTest

COMMANDS = ["NOP", "APRD", "APWR", "APRW", "FPRD", "FPWR", "FPRW", "BRD", "BWR", "BRW", "LRD", "LWR", "LRW", "ARMW",
            "FRMW"]
LOGICAL = ("LRD", "LWR", "LRW")
FIELDS = ["frame.number", "ecat.cmd", "ecat.idx", "ecat.adp", "ecat.ado", "ecat.lad", "ecat.subframe.length",
          "ecat.int", "ecat.cnt"]
SDO_FIELDS = ["ecat_mailbox.coe.sdoidx", "ecat_mailbox.coe.sdosub"]


def numbers(text):
    return [int(value, 0) for value in text.split(",")] if text else []


def tshark(path, display_filter, fields):
    arguments = ["tshark", "-r", str(path), "-Y", display_filter, "-T", "fields", "-E", "occurrence=a"]
    for field in fields:
        arguments += ["-e", field]
    out = subprocess.run(arguments, capture_output=True, text=True, timeout=300).stdout
    for line in out.splitlines():
        yield (line.split("\t") + [""] * len(fields))[:len(fields)]


def datagrams_of_wireshark(path):
    """(frame, command, index, address, length, interrupt field, working counter); None where Wireshark shows none."""
    for frame, *values in tshark(path, "ecat", FIELDS):
        commands, index, adp, ado, logical, length, irq, wkc = map(numbers, values)
        for k, command in enumerate(commands):
            name = COMMANDS[command] if command < len(COMMANDS) else str(command)
            if name in LOGICAL:
                address = logical.pop(0) if logical else None
            else:
                address = (adp.pop(0), ado.pop(0)) if adp and ado else None
            yield (int(frame), name, index[k], address, *(values[k] if k < len(values) else None
                                                          for values in (length, irq, wkc)))


@unittest.skipIf(shutil.which("tshark") is None, "tshark is not installed")
class Agreement(CliTest):
    def ours(self, command, path, *arguments):
        done = self.run_program(command, "--format", "jsonl", *arguments, path)
        self.assertEqual(done.returncode, 0, done.err)
        return map(json.loads, done.out.splitlines())

    def assert_agreement(self, path, sdos=True):
        ours = [(d["frame"], d["command"], d["index"],
                 d["logical"] if d["command"] in LOGICAL else (d["adp"], d["ado"]), d["length"], d["irq"], d["wkc"])
                for d in self.ours("decode", path)]
        theirs = list(datagrams_of_wireshark(path))
        for mine, other in zip(ours, theirs):
            if mine != other and any(b is not None and a != b for a, b in zip(mine, other)):
                self.fail(f"{path}: ecaudit {mine}, Wireshark {other}")
        self.assertEqual(len(ours), len(theirs), path)
        if not sdos:
            return
        # A message that came back with working counter 0 was not taken: it began no transfer.
        counters = {}
        for index, sub, source, wkc in tshark(path, SDO_FIELDS[0], [*SDO_FIELDS, "eth.src", "ecat.cnt"]):
            key = (int(index.split(",")[0], 0), int(sub.split(",")[0] or "0", 0))
            returned = bool(source) and int(source.split(",")[0][:2], 16) & 2 != 0
            counters.setdefault(key, []).append(sum(numbers(wkc)) if returned else None)
        objects = {key for key, seen in counters.items() if any(seen) or all(wkc is None for wkc in seen)}
        found = {(e["index"], e["subindex"]) for e in self.ours("events", path, "--type", "sdo")}
        self.assertLessEqual(objects, found, path)

    def assert_all_agree(self, paths, **options):
        for path in paths:
            with self.subTest(path.name):
                self.assert_agreement(path, **options)


def captures(folder):
    """Those that are no damaged files."""
    found = sorted(p for p in folder.glob("*.pcap*") if p.suffix in (".pcap", ".pcapng"))
    return [p for p in found if p.name.split("-")[0] not in ("truncated", "garbage", "empty") and
            p.name != "truncated.pcapng"]


class WiresharkSamples(Agreement):
    def test_samples(self):
        paths = captures(SOURCE / "samples" / "captures")
        self.assertGreater(len(paths), 20)
        self.assert_all_agree(paths)


class WiresharkCaptures(Agreement):
    def setUp(self):
        super().setUp()
        if not (SHARED / "captures").is_dir():
            self.skipTest("captures not beside the project")

    def test_real(self):
        self.assert_all_agree(captures(SHARED / "captures" / "real"))

    def test_lab(self):
        paths = captures(SHARED / "captures" / "lab")
        self.assertGreater(len(paths), 40)
        self.assert_all_agree(paths)

    def test_flipped_bits(self):
        # Requests whose return was altered on the wire are not trusted, so their transfers are not all found.
        self.assert_agreement(SHARED / "captures" / "lab" / "garbage-flipped-startup-ok-1slave.pcapng", sdos=False)
