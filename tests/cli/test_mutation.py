"""Captures damaged in every way: bits flipped, files cut, packets shuffled. The program must neither crash nor hang, say
what it read, and end with a status that it documents. Seeds are fixed: a failure comes again.

ECAUDIT_MUTATIONS=N tries N seeds for each capture and kind instead of one.
"""
import json
import os
import random
import struct
import subprocess
import unittest

from support import PROGRAM, SHARED, SOURCE, CliTest

SEEDS = int(os.environ.get("ECAUDIT_MUTATIONS", "1"))
PART = 32 * 1024  # of each capture: the start-up is what has most in it
AT_ONCE = 40  # captures in one run of the program
LONGEST_RUN_S = 120


def headers_and_packets(capture: bytes) -> tuple[list[bytes], list[bytes]]:
    """The file as pieces: what stands in front of the first packet, and the packets (or blocks) one by one."""
    pieces = []
    if capture[:4] == b"\x0a\x0d\x0d\x0a":
        order = "<" if capture[8:12] == b"\x4d\x3c\x2b\x1a" else ">"
        at = 0
        while at + 12 <= len(capture):
            length = struct.unpack_from(order + "I", capture, at + 4)[0]
            if length < 12 or length % 4 or at + length > len(capture):
                break
            pieces.append(capture[at:at + length])
            at += length
        first = next((i for i, p in enumerate(pieces) if struct.unpack_from(order + "I", p)[0] in (2, 3, 6)), len(pieces))
        return pieces[:first], pieces[first:]
    order = "<" if capture[:4] in (b"\xd4\xc3\xb2\xa1", b"\x4d\x3c\xb2\xa1") else ">"
    at = 24
    while at + 16 <= len(capture):
        length = 16 + struct.unpack_from(order + "I", capture, at + 8)[0]
        if at + length > len(capture):
            break
        pieces.append(capture[at:at + length])
        at += length
    return [capture[:24]], pieces


def flip(capture: bytes, chance: random.Random) -> bytes:
    damaged = bytearray(capture)
    for _ in range(chance.choice((1, 8, 64, 512))):
        damaged[chance.randrange(len(damaged))] ^= 1 << chance.randrange(8)
    return bytes(damaged)


def cut(capture: bytes, chance: random.Random) -> bytes:
    end = chance.randrange(len(capture))
    start = chance.randrange(end + 1)
    return capture[:start] + capture[end:] if chance.random() < 0.5 else capture[:end]


def shuffle(capture: bytes, chance: random.Random) -> bytes:
    headers, packets = headers_and_packets(capture)
    kind = chance.randrange(3)
    if kind == 0:
        chance.shuffle(packets)
    elif kind == 1:  # neighbours change places
        for _ in range(len(packets) // 4):
            at = chance.randrange(max(1, len(packets) - 1))
            packets[at:at + 2] = reversed(packets[at:at + 2])
    else:  # some are missing, some come again
        packets = [p for p in packets for _ in range(chance.choice((0, 1, 1, 1, 1, 1, 2)))]
    return b"".join(headers + packets)


def captures() -> list:
    found = sorted((SOURCE / "samples" / "captures").glob("*.pcap*"))
    for folder in ("real", "lab"):
        found += sorted((SHARED / "captures" / folder).glob("*.pcap*"))
    return [path for path in found if path.suffix in (".pcap", ".pcapng") and path.stat().st_size > 24]


class Mutation(CliTest):
    def run_on(self, command: list[str], files: list[str]) -> subprocess.CompletedProcess:
        try:
            return subprocess.run([PROGRAM, *command, *files], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, cwd=self.dir, timeout=LONGEST_RUN_S)
        except subprocess.TimeoutExpired:
            self.fail(f"{command} hangs on one of {files}")

    def expect_sound(self, command: list[str], files: list[str], json_report: bool) -> None:
        done = self.run_on(command, files)
        if done.returncode not in (0, 1, 2) and len(files) > 1:
            for file in files:  # which one is it?
                self.expect_sound(command, [file], json_report)
        self.assertIn(done.returncode, (0, 1, 2), f"{command} {files}\n{done.stderr.decode(errors='replace')[-3000:]}")
        errors = done.stderr.decode()
        for line in errors.splitlines():
            self.assertTrue(line.startswith("ecaudit: "), errors[-3000:])
        if done.returncode == 2:
            self.assertTrue(errors, "status 2 says why")
        if json_report and done.stdout:
            report = json.loads(done.stdout)
            self.assertLessEqual(len(report["reports"]), len(files))
            for finding in (f for one in report["reports"] for f in one["findings"]):
                self.assertGreaterEqual(finding["count"], 1)

    def mutate(self, kind) -> None:
        for seed in range(SEEDS):
            files = []
            for number, path in enumerate(captures()):
                chance = random.Random(f"{kind.__name__} {path.name} {seed}")
                whole = path.read_bytes()[:PART]
                files.append(self.file(f"{seed}-{number}-{path.name}", kind(whole, chance)))
            for start in range(0, len(files), AT_ONCE):
                self.expect_sound(["check", "--format", "json"], files[start:start + AT_ONCE], True)
            # The commands that write lines while they read take one capture at a time.
            for number, file in enumerate(files[seed % 12::12]):
                command = ("decode", "events", "signals")[number % 3]
                self.expect_sound([command, "--format", "jsonl", "-o", "/dev/null"], [file], False)

    def test_bits_flipped(self):
        self.mutate(flip)

    def test_cut(self):
        self.mutate(cut)

    def test_packets_shuffled(self):
        self.mutate(shuffle)


if __name__ == "__main__":
    unittest.main()
