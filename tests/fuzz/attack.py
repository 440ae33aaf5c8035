#!/usr/bin/env python3
"""Damages captures packet by packet and field by field, and in every third round the other files that the program reads
(settings, baselines, expectations, reports, descriptions, families), and runs the whole program on them. Seeds are
fixed: what fails comes again. What ends the program by a signal, with status 3, or not in time is kept.

  attack.py PROGRAM --minutes 10 --keep FOLDER [--seed N] [--runs N] CAPTURE...
"""
import argparse
import copy
import json
import os
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile
import time

AT_ONCE = 20
LONGEST_RUN_S = 120
COMMANDS = (["check", "--format", "json"], ["check"], ["events", "--format", "jsonl"], ["startup", "--format", "json"],
            ["signals", "--format", "jsonl"], ["decode", "--format", "jsonl"])
REGISTERS = (0x0010, 0x0012, 0x0110, 0x0120, 0x0130, 0x0134, 0x0300, 0x0400, 0x0420, 0x0502, 0x0508, 0x0600, 0x0620,
             0x0800, 0x0810, 0x0900, 0x0910, 0x0920, 0x0928, 0x092C, 0x0980, 0x0990, 0x09A0, 0x09A4, 0x0F80, 0x1000)
EDGES = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x100, 0x7FFF, 0x8000, 0xFFFE, 0xFFFF)


class Packet:
    """One record or block of a file: where its packet's bytes lie in it."""

    def __init__(self, piece: bytes, at: int, length: int):
        self.piece, self.at, self.length = bytearray(piece), at, length

    def copy(self):
        return Packet(bytes(self.piece), self.at, self.length)

    def datagrams(self):
        """Offset in the piece, and length of the data, of each EtherCAT datagram."""
        data = self.piece[self.at:self.at + self.length]
        at = 12
        while data[at:at + 2] in (b"\x81\x00", b"\x88\xa8"):
            at += 4
        if data[at:at + 2] != b"\x88\xa4":
            return []
        at += 4
        found = []
        while at + 12 <= len(data):
            word = struct.unpack_from("<H", data, at + 6)[0]
            size = 12 + (word & 0x7FF)
            if at + size > len(data):
                break
            found.append((self.at + at, word & 0x7FF))
            at += size
            if not word & 0x8000:
                break
        return found


def read(capture: bytes):
    """What stands in front of the first packet, and the packets."""
    head, packets = [], []
    if capture[:4] == b"\x0a\x0d\x0d\x0a":
        order = "<" if capture[8:12] == b"\x4d\x3c\x2b\x1a" else ">"
        at = 0
        while at + 12 <= len(capture):
            kind, length = struct.unpack_from(order + "II", capture, at)
            if length < 12 or length % 4 or at + length > len(capture):
                break
            piece = capture[at:at + length]
            if kind == 6:
                packets.append(Packet(piece, 28, struct.unpack_from(order + "I", piece, 20)[0]))
            elif not packets:
                head.append(piece)
            at += length
        return b"".join(head), packets
    order = "<" if capture[:4] in (b"\xd4\xc3\xb2\xa1", b"\x4d\x3c\xb2\xa1") else ">"
    at = 24
    while at + 16 <= len(capture):
        length = struct.unpack_from(order + "I", capture, at + 8)[0]
        if at + 16 + length > len(capture):
            break
        packets.append(Packet(capture[at:at + 16 + length], 16, length))
        at += 16 + length
    return capture[:24], packets


def change_field(packet: Packet, chance: random.Random) -> None:
    datagrams = packet.datagrams()
    if not datagrams:
        return
    at, length = chance.choice(datagrams)
    raw = packet.piece
    kind = chance.randrange(9)
    if kind == 0:
        raw[at] = chance.randrange(16)
    elif kind == 1:
        raw[at + 1] = chance.choice((0, 1, 15, 16, 127, 128, 254, 255))
    elif kind == 2:
        struct.pack_into("<H", raw, at + 2, chance.choice(EDGES))
    elif kind == 3:
        struct.pack_into("<H", raw, at + 4, chance.choice(REGISTERS))
    elif kind == 4:
        struct.pack_into("<H", raw, at + 10 + length, chance.choice(EDGES))
    elif kind == 5:
        struct.pack_into("<H", raw, at + 8, chance.choice(EDGES))
    elif length > 0:  # data: one word, or all of it
        if kind == 6:
            raw[at + 10 + chance.randrange(length)] = chance.choice((0, 1, 0x7F, 0x80, 0xFF, chance.randrange(256)))
        elif kind == 7:
            raw[at + 10:at + 10 + length] = bytes([chance.choice((0, 0xFF, 0x80))]) * length
        else:
            raw[at + 10:at + 10 + length] = chance.randbytes(length)


def damage(packets: list, chance: random.Random) -> list:
    start = chance.choice((0, 0, chance.randrange(max(1, len(packets)))))
    window = packets[start:start + chance.choice((4, 12, 60, 300, 1500))]
    out = [p.copy() for p in window]
    for _ in range(chance.choice((1, 1, 2, 3))):
        kind = chance.randrange(7)
        if kind == 0:
            out = [p for p in out if chance.random() >= 0.3]
        elif kind == 1:
            out = [q for p in out for q in ([p] if chance.random() >= 0.1 else [p, p.copy()])]
        elif kind == 2:
            for _ in range(max(1, len(out) // 20)):
                if out:
                    change_field(chance.choice(out), chance)
        elif kind == 3:
            for _ in range(max(1, len(out) // 20)):
                if out:
                    p = chance.choice(out)
                    p.piece[p.at + chance.randrange(max(1, p.length))] ^= 1 << chance.randrange(8)
        elif kind == 4:
            for _ in range(len(out) // 8):
                at = chance.randrange(max(1, len(out) - 1))
                out[at:at + 2] = reversed(out[at:at + 2])
        elif kind == 5 and out:  # one packet many times
            at = chance.randrange(len(out))
            out[at:at] = [out[at].copy() for _ in range(chance.choice((2, 20, 200)))]
        else:  # behind one another: another recording
            more = packets[chance.randrange(max(1, len(packets))):][:100]
            out += [p.copy() for p in more]
    return out


def change_block(head: bytes, chance: random.Random) -> bytes:
    """A length, a link type or an option in front of the packets."""
    if not head or chance.random() < 0.8:
        return head
    head = bytearray(head)
    at = chance.randrange(max(1, len(head) - 4))
    if chance.random() < 0.5:
        head[at] = chance.choice((0, 1, 4, 0x7F, 0x80, 0xFF))
    else:
        struct.pack_into("<I", head, at & ~3 if len(head) > 8 else 0, chance.choice((0, 1, 12, 28, 0xFFFF, 0x7FFFFFFF)))
    return bytes(head)


NUMBERS = (0, 1, -1, 255, 256, 65535, 65536, 2**31 - 1, 2**31, 2**32, 2**53, 2**63 - 1, 2**64 - 1, -2**63, 1e308, -0.0,
           1e-320, 0.5)
TEXTS = ("", "0x", "0xFFFFFFFFFFFFFFFFF", "-1", "=cmd", "\x1b[31m", "\u0000", "\u202e", "../../etc/passwd", "a" * 5000,
         "é" * 300, "{}", "*", "%s%n", "al-refused", "error", "2011-02-30", "99999999999999999999")


def places(node, found):
    if isinstance(node, dict):
        found += [(node, key) for key in node]
        for value in node.values():
            places(value, found)
    elif isinstance(node, list):
        found += [(node, n) for n in range(len(node))]
        for value in node[:200]:
            places(value, found)
    return found


def change_json(text: str, chance: random.Random) -> str:
    """Some values become others, of another type, are gone, are there twice or a thousand times, or deep."""
    document = json.loads(text)
    for _ in range(chance.choice((1, 1, 2, 5))):
        where = places(document, [])
        if not where:
            break
        parent, key = chance.choice(where)
        kind = chance.randrange(9)
        if kind == 0:
            parent[key] = chance.choice(NUMBERS)
        elif kind == 1:
            parent[key] = chance.choice(TEXTS)
        elif kind == 2:
            parent[key] = chance.choice((None, True, [], {}, [[]], [None], {"": None}))
        elif kind == 3:
            del parent[key]
        elif kind == 4 and isinstance(parent, list):
            parent[key:key] = [copy.deepcopy(parent[key]) for _ in range(chance.choice((1, 3, 1000)))]
        elif kind == 5 and isinstance(parent, dict):
            parent[chance.choice(TEXTS)] = parent.pop(key)
        elif kind == 6:
            other, name = chance.choice(where)
            if not isinstance(other[name], (dict, list)):
                parent[key] = other[name]
        elif kind == 7:
            value = parent[key]
            for _ in range(chance.choice((1, 20, 400))):
                value = [value]
            parent[key] = value
        elif isinstance(parent[key], list):
            chance.shuffle(parent[key])
    return json.dumps(document, ensure_ascii=chance.random() < 0.5)


def change_xml(text: str, chance: random.Random) -> str:
    """Numbers and texts become others, elements are gone, twice, elsewhere or not closed."""
    for _ in range(chance.choice((1, 1, 2, 5))):
        elements = [m.span() for m in re.finditer(r"<(\w+)[^<>]*>[^<>]*</\1>", text)]
        values = [m.span() for m in re.finditer(r"(?<=>)[^<>\s][^<>]*(?=<)|(?<=\")[^\"<>]*(?=\")", text)]
        if not elements or not values:
            break
        begin, end = chance.choice(elements)
        kind = chance.randrange(7)
        if kind <= 2:
            begin, end = chance.choice(values)
            value = chance.choice([*TEXTS, *map(str, NUMBERS), "#x7FFFFFFF", "#xFFFFFFFFFF", "0,1,2", "true",
                                   "&amp;" * 20])
            text = text[:begin] + value.replace("<", "").replace("\0", "") + text[end:]
        elif kind == 3:
            text = text[:begin] + text[end:]
        elif kind == 4:
            text = text[:end] + text[begin:end] * chance.choice((1, 50)) + text[end:]
        elif kind == 5:
            at, _ = chance.choice(elements)
            text = text[:at] + text[begin:end] + text[at:]
        else:
            begin = chance.randrange(len(text))
            text = text[:begin] + text[begin + chance.randrange(40):]
    return text


def change_file(content: bytes, chance: random.Random) -> bytes:
    if chance.random() < 0.15:  # no structure at all
        raw = bytearray(content)
        for _ in range(chance.choice((1, 3, 20))):
            raw[chance.randrange(len(raw))] = chance.randrange(256)
        return bytes(raw[:chance.randrange(1, len(raw) + 1)] if chance.random() < 0.3 else raw)
    text = content.decode(errors="replace")
    changed = change_xml(text, chance) if text.lstrip("\ufeff \n").startswith("<") else change_json(text, chance)
    return changed.encode(errors="replace")


def other_files(program: str, captures: list, folder: str) -> list:
    """Files that are read besides captures: the command that reads one, and what a sound one holds."""
    def made(name, *arguments):
        path = os.path.join(folder, name)
        last = 1 if arguments[0] == "startup" else 6
        subprocess.run([program, *(path if a == "{}" else a for a in arguments), *captures[:last]],
                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        return pathlib.Path(path).read_bytes() if os.path.exists(path) else b""

    seeds = [
        (["check", "--config", "{}"], json.dumps({
            "rules": {"al-refused": "off", "sdo-abort": "info"}, "fail_on": "warning", "limits": {"jitter_us": 10},
            "suppress": [{"rule": "al-refused", "slave": 0, "reason": "known", "until": "2031-01-01"}]}).encode()),
        (["check", "--baseline", "{}"], made("baseline.json", "check", "--write-baseline", "{}")),
        (["merge", "{}"], made("report.json", "check", "--format", "json", "-o", "{}")),
        (["startup", "--expect", "{}"], made("expectation.json", "startup", "--save", "{}")),
    ]
    root = pathlib.Path(__file__).resolve().parents[2]
    for pattern, command in (("tests/fuzz/corpus/fuzz_eni/*", ["check", "--eni", "{}"]),
                             ("tests/fuzz/corpus/fuzz_esi/*", ["check", "--esi", "{}"]),
                             ("samples/descriptions/*.xml", ["check", "--esi", "{}"]),
                             ("samples/descriptions/*.xml", ["check", "--eni", "{}"]),
                             ("samples/families/*.json", ["check", "--profiles", "{}"])):
        seeds += [(command, path.read_bytes()) for path in sorted(root.glob(pattern))]
    return [(command, content) for command, content in seeds if content]


def sound(program: str, command: list, files: list) -> str:
    """What is wrong; empty: nothing."""
    try:
        done = subprocess.run([program, *command, *files], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, timeout=LONGEST_RUN_S)
    except subprocess.TimeoutExpired:
        return "does not end"
    if done.returncode in (0, 1, 2) and b"runtime error" not in done.stderr:
        return ""
    return f"status {done.returncode}: {done.stderr.decode(errors='replace')[-2000:]}"


def attack_others(options, others: list, made: int, folder: str) -> int:
    failures = 0
    for n in range(AT_ONCE):
        chance = random.Random(f"{options.seed} {made} other {n}")
        command, content = chance.choice(others)
        path = pathlib.Path(folder) / f"{made + n}-{command[1].strip('-{}') or command[0]}.file"
        try:
            path.write_bytes(change_file(content, chance))
        except (ValueError, RecursionError):
            continue
        files = [] if command[0] == "merge" else [chance.choice(options.captures)]
        arguments = [str(path) if a == "{}" else a for a in command]
        if wrong := sound(options.program, arguments, files):
            failures += 1
            os.makedirs(options.keep, exist_ok=True)
            kept = pathlib.Path(options.keep) / path.name
            kept.write_bytes(path.read_bytes())
            print(f"{' '.join(command)} {' '.join(files)} {kept}\n  {wrong}", flush=True)
        path.unlink()
    return failures


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("captures", nargs="+")
    parser.add_argument("--minutes", type=float, default=1)
    parser.add_argument("--runs", type=int, default=0, help="so many damaged captures, if they take less time")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", default="attack-failures")
    options = parser.parse_args()
    sources = [(path, *read(pathlib.Path(path).read_bytes()[:4 << 20])) for path in sorted(options.captures)]
    sources = [source for source in sources if source[2]]
    end = time.monotonic() + options.minutes * 60
    made = failures = rounds = 0
    with tempfile.TemporaryDirectory(prefix="ecaudit-attack-") as folder:
        others = other_files(options.program, sorted(options.captures), folder)
        while time.monotonic() < end and (not options.runs or made < options.runs):
            files = []
            for n in range(AT_ONCE):
                chance = random.Random(f"{options.seed} {made + n}")
                path, head, packets = chance.choice(sources)
                name = os.path.join(folder, f"{made + n}-{pathlib.Path(path).name}")
                damaged = b"".join(bytes(p.piece) for p in damage(packets, chance))
                pathlib.Path(name).write_bytes(change_block(head, chance) + damaged)
                files.append(name)
            made += AT_ONCE
            if others and rounds % 3 == 2:
                failures += attack_others(options, others, made, folder)
            command = COMMANDS[rounds % len(COMMANDS)]
            rounds += 1
            one_by_one = command[0] in ("events", "signals", "decode")
            for group in [[f] for f in files] if one_by_one else [files]:
                if not sound(options.program, command, group):
                    continue
                for file in group:
                    if wrong := sound(options.program, command, [file]):
                        failures += 1
                        os.makedirs(options.keep, exist_ok=True)
                        kept = pathlib.Path(options.keep) / pathlib.Path(file).name
                        kept.write_bytes(pathlib.Path(file).read_bytes())
                        print(f"{' '.join(command)} {kept}\n  {wrong}", flush=True)
            for file in files:
                os.remove(file)
    print(f"seed {options.seed}: {made} damaged captures, {failures} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
