"""The law of the silent loss: damage a capture, and each certain finding is still there, or the report says why not."""
import json
import random
import struct
import unittest

from support import SOURCE, CliTest
from test_hostile import block, option

SAMPLES = SOURCE / "samples" / "captures"
# Findings of this group say that something of the capture cannot be judged.
CAPTURE_RULES = {"capture-truncated", "capture-snaplen", "capture-one-direction", "capture-spliced",
                 "capture-timestamps", "bus-second-master"}
# So do these: frames that nobody could read, or that never came back.
UNREADABLE = {"frame-malformed", "frame-lost"}
ETHERCAT = b"\x88\xa4"
USER_LINK = 147
ROOM = 4  # packets around what a finding shows that belong to it


class Packet:
    def __init__(self, time_ns, data, number, original=None):
        self.time_ns, self.data, self.number = time_ns, data, number
        self.original = len(data) if original is None else original
        self.link, self.interface, self.flags = 1, 0, None

    def copy(self, **changes):
        packet = Packet(self.time_ns, self.data, self.number, self.original)
        packet.link, packet.interface, packet.flags = self.link, self.interface, self.flags
        for name, value in changes.items():
            setattr(packet, name, value)
        if "data" in changes:
            packet.original = len(packet.data)
        return packet

    def is_ethercat(self):
        return self.data[12:14] == ETHERCAT


def read(content: bytes) -> list:
    """The packets of a capture of one Ethernet interface; none where it is another one."""
    packets = []
    if content[:4] == b"\x0a\x0d\x0d\x0a":
        if content[8:12] != b"\x4d\x3c\x2b\x1a":
            return []
        at, scale = 0, []
        while at + 12 <= len(content):
            kind, length = struct.unpack_from("<II", content, at)
            if length < 12 or at + length > len(content):
                return []
            if kind == 1:
                if struct.unpack_from("<H", content, at + 8)[0] != 1:
                    return []
                resolution, option_at = 1000, at + 16
                while option_at + 4 <= at + length - 4:
                    code, size = struct.unpack_from("<HH", content, option_at)
                    if code == 0:
                        break
                    if code == 9:
                        resolution = {6: 1000, 9: 1}.get(content[option_at + 4], 0)
                    option_at += 4 + (size + 3) // 4 * 4
                scale.append(resolution)
            elif kind == 6:
                interface, high, low, captured, original = struct.unpack_from("<IIIII", content, at + 8)
                if interface != 0 or scale[0] == 0:
                    return []
                data = content[at + 28:at + 28 + captured]
                packets.append(Packet((high << 32 | low) * scale[0], data, len(packets) + 1, original))
            elif kind not in (0x0A0D0D0A, 5, 4):
                return []
            at += length
        return packets
    fraction = {b"\xd4\xc3\xb2\xa1": 1000, b"\x4d\x3c\xb2\xa1": 1}.get(content[:4])
    if fraction is None or struct.unpack_from("<I", content, 20)[0] != 1:
        return []
    at = 24
    while at + 16 <= len(content):
        seconds, part, captured, original = struct.unpack_from("<IIII", content, at)
        if at + 16 + captured > len(content):
            return []
        data = content[at + 16:at + 16 + captured]
        packets.append(Packet(seconds * 10**9 + part * fraction, data, len(packets) + 1, original))
        at += 16 + captured
    return packets


def written(packets) -> bytes:
    """pcapng with an interface for each kind of link and each number."""
    out = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    interfaces = sorted({(p.interface, p.link) for p in packets})
    for _, link in interfaces:
        out += block(1, struct.pack("<HHI", link, 0, 0) + option(9, b"\x09"))
    for p in packets:
        body = struct.pack("<IIIII", interfaces.index((p.interface, p.link)), p.time_ns >> 32, p.time_ns & 0xFFFFFFFF,
                           len(p.data), p.original) + p.data + b"\0" * (-len(p.data) % 4)
        if p.flags is not None:
            body += option(2, struct.pack("<I", p.flags)) + option(0, b"")
        out += block(6, body)
    return out


def tagged(packet, tags: bytes):
    return packet.copy(data=packet.data[:12] + tags + packet.data[12:]) if packet.is_ethercat() else packet


def in_udp(packet):
    """EtherCAT over UDP, as some masters send it through switches; MAC addresses stay."""
    if not packet.is_ethercat():
        return packet
    payload = packet.data[14:]
    udp = struct.pack(">HHHH", 0x88A4, 0x88A4, 8 + len(payload), 0) + payload
    ip = struct.pack(">BBHHHBBHII", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0, 0x0A000001, 0xFFFFFFFF) + udp
    return packet.copy(data=packet.data[:12] + b"\x08\x00" + ip)


def flipped(packet, chance):
    data = bytearray(packet.data)
    data[chance.randrange(14, len(data))] ^= 1 << chance.randrange(8)
    return packet.copy(data=bytes(data))


def noise(packets, chance):
    """Other packets in between, as a mirror port has them."""
    out = []
    for p in packets:
        out.append(p)
        if chance.random() < 0.5:
            frame = b"\xff" * 6 + b"\x02" * 6 + b"\x08\x06" + chance.randbytes(46)
            out.append(Packet(p.time_ns + 1, frame, 0))
    return out


def foreign_master(packets, chance):
    """Another master, on a bus without faults, whose frames are seen as well: all they show is not analysed."""
    out = []
    for n, p in enumerate(packets):
        out.append(p)
        if n % 3 != 0:
            continue
        for returned in (0, 1):
            datagram = struct.pack("<BBHHHH", 7, n & 0xFF, returned, 0x0130, 2, 0) + bytes([returned, 0])
            datagram += struct.pack("<H", returned)
            source = bytes([0x40 | 2 * returned, 0x99, 0x98, 0x97, 0x96, 0x95])
            frame = b"\xff" * 6 + source + ETHERCAT + struct.pack("<H", len(datagram) | 0x1000) + datagram
            out.append(Packet(p.time_ns + 1 + returned, frame.ljust(60, b"\0"), 0))
    return out


def later(packets, chance):
    """Each return behind the next outbound frame, as where a master sends before the last frame is back."""
    out, held = [], None
    for p in packets:
        back = p.data[6] >> 1 & 1
        if back and held is None:
            held = p
            continue
        out.append(p)
        if not back and held is not None:
            out.append(held.copy(time_ns=p.time_ns + 1))
            held = None
    return out + ([held] if held is not None else [])


def missing_run(packets, chance):
    length = chance.randint(2, 200)
    first = chance.randrange(max(1, len(packets) - length))
    return packets[:first] + packets[first + length:]


def missing(packets, chance, count):
    first = chance.randrange(max(1, len(packets) - count + 1))
    return packets[:first] + packets[first + count:]


def half_on(packets, link):
    middle = len(packets) // 2
    return packets[:middle] + [p.copy(link=link, interface=1) for p in packets[middle:]]


def by_interface(packets, first):
    """A tap with an interface a direction. `first`: which of them comes first where stamps are close together."""
    out = [p.copy(interface=(p.data[6] >> 1 & 1) ^ first) for p in packets]
    return sorted(out, key=lambda p: (p.time_ns // 1000, p.interface))


# Name, what is done, and whether nothing is lost by it: then each finding has to be there as before.
DAMAGES = (
    ("as it was", lambda p, r: p, True),
    ("one tag", lambda p, r: [tagged(q, b"\x81\x00\x00\x05") for q in p], True),
    ("six tags", lambda p, r: [tagged(q, b"\x81\x00\x00\x05" * 6) for q in p], True),
    ("provider tags", lambda p, r: [tagged(q, b"\x88\xa8\x00\x05\x81\x00\x00\x06") for q in p], True),
    ("over UDP", lambda p, r: [in_udp(q) for q in p], True),
    ("among other packets", noise, True),
    ("marked good", lambda p, r: [q.copy(flags=1) for q in p], True),
    ("each packet twice", lambda p, r: [q for p_ in p for q in (p_, p_.copy(time_ns=p_.time_ns + 10))], False),
    ("marked bad", lambda p, r: [q.copy(flags=1 << 24) for q in p], False),
    ("some marked bad", lambda p, r: [q.copy(flags=1 << 24 if r.random() < 0.3 else None) for q in p], False),
    ("some bits flipped", lambda p, r: [flipped(q, r) if r.random() < 0.05 else q for q in p], False),
    ("second half of another link type", lambda p, r: half_on(p, USER_LINK), False),
    ("first half of another link type", lambda p, r: half_on(p[len(p) // 2:] + p[:len(p) // 2], USER_LINK), False),
    ("cut at the end", lambda p, r: p[:len(p) * 2 // 3], False),
    ("begins later", lambda p, r: p[len(p) // 3:], False),
    ("a hole", lambda p, r: p[:len(p) // 3] + p[len(p) // 2:], False),
    ("the end first", lambda p, r: p[len(p) // 2:] + p[:len(p) // 2], False),
    ("a packet in five missing", lambda p, r: [q for q in p if r.random() >= 0.2], False),
    ("outbound only", lambda p, r: [q for q in p if not q.data[6] >> 1 & 1], False),
    ("returned only", lambda p, r: [q for q in p if q.data[6] >> 1 & 1], False),
    ("cut packets", lambda p, r: [q.copy(data=q.data[:40], original=q.original) for q in p], False),
    ("an interface a direction", lambda p, r: by_interface(p, 0), False),
    ("an interface a direction, returns first", lambda p, r: by_interface(p, 1), False),
    ("another master", foreign_master, False),
    ("returns behind the next frame", later, False),
    *((f"a run of packets missing, {n}", missing_run, False) for n in range(4)),
    *((f"a pair missing, {n}", lambda p, r: missing(p, r, 2), False) for n in range(3)),
    *((f"one missing, {n}", lambda p, r: missing(p, r, 1), False) for n in range(3)),
)


def slave_of(finding):
    return finding["station_address"] if finding["station_address"] is not None else finding["slave"]


def profile_of(report, finding):
    return next((s["profile"] for s in report["slaves"] if s["station_address"] == finding["station_address"]), None)


class SilentLoss(CliTest):
    def certain(self, report):
        return [f for f in report["findings"] if f["severity"] in ("error", "warning") and
                f["confidence"] == "observed" and f["rule"] not in CAPTURE_RULES]

    def excused(self, finding, was, now, left) -> bool:
        """@param left numbers of the packets that the damage left as they were"""
        rule, slave = finding["rule"], finding["slave"]
        same = [slave_of(f) for f in now["findings"] if f["rule"] == rule]
        if same and (slave is None or None in same or slave_of(finding) in same):
            return True
        if now["summary"]["verdict"] == "limited" or any(n["rule"] == rule for n in now["not_evaluable"]):
            return True
        coverage = next(c for c in now["coverage"]["rules"] if c["rule"] == rule)
        if coverage["partly"] + coverage["not_judged"] > 0:
            return True
        if any(f["rule"] in CAPTURE_RULES | UNREADABLE for f in now["findings"]):
            return True
        # The report says of which family a slave is taken to be, and why.
        if slave is not None and profile_of(was, finding) != profile_of(now, finding):
            return True
        # Nobody can know what was there once where nothing is left of it.
        shown = [n for n in (finding["frame"], finding["last_frame"], *finding["related_frames"]) if n is not None]
        around = range(min(shown) - ROOM, max(shown) + ROOM + 1) if shown else ()
        return any(n not in left for n in around if n in self.numbers)

    def test_each_certain_finding_is_there_or_it_is_said_why_not(self):
        sources = []
        for path in sorted(SAMPLES.iterdir()):
            packets = read(path.read_bytes()) if path.suffix in (".pcap", ".pcapng") else []
            if packets:
                sources.append((path.stem, packets))
        self.assertGreater(len(sources), 40)
        for name, damage, lossless in DAMAGES:
            paths, kept, lost = [], [], []
            for stem, packets in sources:
                damaged = damage(packets, random.Random(f"{name} {stem}"))
                kept.append({p.number: p.data for p in damaged if p.flags is None or p.flags == 1})
                paths.append(self.file(f"{name}/{stem}.pcapng", written(damaged)))
            reports = self.reports(paths)
            if name == "as it was":
                before = reports
                self.assertGreater(sum(len(self.certain(r)) for r in before), 60)
            for (stem, packets), left, was, now in zip(sources, kept, before, reports):
                self.numbers = {p.number for p in packets}
                # Bytes may be wrapped, but stand at the end of the packet as they were.
                untouched = {p.number for p in packets if left.get(p.number, b"").endswith(p.data[14:])}
                for finding in self.certain(was):
                    if lossless:
                        same = [f["slave"] for f in now["findings"] if f["rule"] == finding["rule"]]
                        kept_it = finding["slave"] in same
                    else:
                        kept_it = self.excused(finding, was, now, untouched)
                    if not kept_it:
                        lost.append(f"{stem}: {finding['rule']}: {finding['title']}")
            with self.subTest(damage=name):
                self.assertEqual(lost, [])

    def reports(self, paths):
        out = self.dir / "all.json"
        self.run_program("check", "--format", "json", "-o", out, *paths)
        return json.loads(out.read_text())["reports"]


if __name__ == "__main__":
    unittest.main()
