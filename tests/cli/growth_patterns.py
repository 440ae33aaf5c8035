"""Captures of any length that someone makes to cost more than their bytes: each takes how often its pattern comes."""
import struct

from support import APWR, BRD, BWR, FPRD, FPWR, LRW, Bus, scanned_bus
from test_events import COE, EOE, MailboxBus
from test_hostile import block, option


class WideBus(Bus):
    """Many slaves, and frames of several datagrams."""

    def __init__(self, slaves: int):
        super().__init__()
        self.slaves = slaves
        self.together([(BRD, 0, 0x0130, b"\0\0", b"\x02\0", slaves)])
        for begin in range(0, slaves, 50):
            self.together([(APWR, -s, 0x0010, *[struct.pack("<H", 0x1001 + s)] * 2, 1)
                           for s in range(begin, min(begin + 50, slaves))])

    def together(self, datagrams):
        """@param datagrams command, ADP, ADO, data sent and returned, working counter of each"""
        self.index = (self.index + 1) & 0xFF
        for first, returned in ((0x10, False), (0x12, True)):
            body = b""
            for n, (command, adp, ado, sent, back, counter) in enumerate(datagrams):
                data = back if returned else sent
                more = 0x8000 if n + 1 < len(datagrams) else 0
                passed = self.slaves if returned and command in (1, 2, 3, 7, 8, 9) else 0
                body += struct.pack("<BBHHHH", command, self.index, (adp + passed) & 0xFFFF, ado, len(data) | more, 0)
                body += data + struct.pack("<H", counter * returned)
            frame = b"\xff" * 6 + bytes([first]) + b"\x10" * 5 + b"\x88\xa4" + struct.pack("<H", len(body) | 0x1000)
            self.packets.append((self.time_ns, (frame + body).ljust(60, b"\0")))
            self.time_ns += 20_000
        self.time_ns += 960_000


def fmmu(logical, length, physical, reads):
    return struct.pack("<IHBBHBBB", logical, length, 0, 7, physical, 0, 1 if reads else 2, 1) + b"\0\0\0"


def fmmu_changes(count):
    """Every frame maps another slave anew, and exchanges process data."""
    bus = WideBus(1000)
    for n in range(count):
        mapping = fmmu(n * 4 % 4096, 4, 0x1100, n % 2)
        bus.together([(FPWR, 0x1001 + n % 1000, 0x0600, mapping, mapping, 1),
                      (LRW, 0, 0, bytes(64), bytes([n & 0xFF]) * 64, 3)])
    return bus.pcap()


def mapped_bus(slaves):
    bus = WideBus(slaves)
    for s in range(slaves):
        mapping = fmmu(4 * s, 4, 0x1100, 0) + fmmu(4 * s, 4, 0x1180, 1)
        bus.together([(FPWR, 0x1001 + s, 0x0600, mapping, mapping, 1)])
    return bus


def varying_process_data(count):
    """Logical datagrams of ever other addresses and lengths over the data of many slaves."""
    bus = mapped_bus(300)
    for n in range(count):
        length = 8 + n * 7 % 256
        bus.together([(LRW, n * 4 % 1200, 0, bytes(length), bytes([n & 0xFF]) * length, 3 * (length // 4))])
    return bus.pcap()


def shared_process_data(count):
    """Thousands of slaves whose FMMUs lead to the same few bytes, in datagrams of ever other addresses."""
    bus = WideBus(1500)
    for s in range(0, 1500, 20):
        mapping = fmmu(0, 64, 0x1100, 0) + fmmu(0, 64, 0x1180, 1)
        bus.together([(FPWR, 0x1001 + k, 0x0600, mapping, mapping, 1) for k in range(s, s + 20)])
    for n in range(count):
        bus.together([(LRW, (n + k) % 64, 0, b"\0", bytes([n & 0xFF]), 3) for k in range(50)])
    return bus.pcap()


def mapped_and_used(count):
    """Each frame changes how one of many slaves that share a byte is mapped, and exchanges it."""
    bus = WideBus(1500)
    for s in range(0, 1500, 40):
        bus.together([(FPWR, 0x1001 + k, 0x0600, fmmu(0, 1, 0x1100, 0), fmmu(0, 1, 0x1100, 0), 1)
                      for k in range(s, min(s + 40, 1500))])
    for n in range(count):
        bus.together([(FPWR, 0x1001 + n % 1500, 0x0608, bytes([n & 1]), bytes([n & 1]), 1),
                      (LRW, 0, 0, b"\0", bytes([n & 0xFF]), 3)])
    return bus.pcap()


def lost_process_data(count):
    """Each other frame comes back with a working counter of its own."""
    bus = mapped_bus(100)
    for n in range(count):
        bus.together([(LRW, 0, 0, bytes(400), bytes([n & 0xFF]) * 400, n % 301)])
    return bus.pcap()


def distinct_objects(count):
    bus = MailboxBus()
    for n in range(count):
        place = struct.pack("<HB", 0x2000 + n // 200, n % 200).hex()
        bus.sdo("23" + place + struct.pack("<I", n).hex(), "60" + place + "00000000")
    return bus.bus.pcap()


def unfinished_transfers(count):
    """Downloads of a megabyte, each given up for the next one."""
    bus = MailboxBus()
    for n in range(count):
        place = struct.pack("<HB", 0x2000 + n % 4000, n % 200).hex()
        bus.sdo("21" + place + "00001000" + "55" * 80, "60" + place + "00000000")
    return bus.bus.pcap()


def refused_transfers(count):
    bus = MailboxBus()
    for n in range(count):
        place = struct.pack("<HB", 0x2000 + n // 200, n % 200).hex()
        bus.sdo("23" + place + "01000000", "80" + place + "11000906")
    return bus.bus.pcap()


def unfinished_fragments(count):
    """Beginnings of Ethernet frames inside the mailbox, none of which goes on."""
    bus = MailboxBus()
    for n in range(count):
        words = struct.pack("<HH", 0, 47 << 6 | (n & 15) << 12)
        bus.out(EOE, words + bytes(96))
        bus.answer(EOE, words + bytes([n & 0xFF]) * 96)
    return bus.bus.pcap()


def emergencies(count):
    bus = MailboxBus()
    for n in range(count):
        bus.answer(COE, b"\x00\x10" + struct.pack("<HB", 0x1000 + n * 7 % 0xE000, n & 0xFF) + bytes(5))
    return bus.bus.pcap()


def drive_states(count):
    """A status word that is another one each time."""
    bus = MailboxBus()
    for n in range(count):
        word = (0x0250, 0x0231, 0x0233, 0x0237, 0x0218)[n % 5] | n % 2 << 7
        bus.sdo("40416000" + "00000000", "4b416000" + struct.pack("<I", word).hex())
    return bus.bus.pcap()


def al_states(count):
    bus = scanned_bus()
    for n in range(count):
        bus.write(0x0120, bytes([(2, 1)[n % 2], 0]))
        bus.read(0x0130, bytes([(2, 1, 0x12)[n % 3], 0]))
        bus.read(0x0134, struct.pack("<H", n % 64))
    return bus.pcap()


def new_stations(count):
    """Slaves that nobody counted answer under ever new addresses."""
    bus = scanned_bus()
    for n in range(count):
        bus.exchange(FPRD, 0x1002 + n % 60000, 0x0130, b"\0\0", b"\x01\0", 1)
    return bus.pcap()


def error_counters(count):
    bus = WideBus(500)
    for n in range(count):
        bus.together([(FPRD, 0x1001 + n % 500, 0x0300, bytes(20), bytes([n // 500 & 0xFF] * 20), 1)])
    return bus.pcap()


def sections(count):
    bus = scanned_bus()
    out = b""
    for n in range(count):
        time_ns, frame = bus.packets[n % len(bus.packets)]
        out += block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
        out += block(1, struct.pack("<HHI", 1, 0, 0) + option(9, b"\x09"))
        out += block(6, struct.pack("<IIIII", 0, time_ns >> 32, time_ns & 0xFFFFFFFF, len(frame), len(frame)) + frame)
    return out


def other_blocks(count):
    """Name resolution, statistics and blocks of others between the packets, each with a comment."""
    bus = scanned_bus()
    out = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    out += block(1, struct.pack("<HHI", 1, 0, 0) + option(9, b"\x09"))
    for n in range(count):
        time_ns, frame = bus.packets[n % len(bus.packets)]
        comment = option(1, b"comment %d" % n) + option(0, b"")
        out += block(4, struct.pack("<HH", 0, 0) + comment)
        out += block(5, struct.pack("<III", 0, time_ns >> 32, time_ns & 0xFFFFFFFF) + comment)
        out += block(0x0BAD, struct.pack("<I", 32473) + bytes(40))
        out += block(6, struct.pack("<IIIII", 0, time_ns >> 32, time_ns & 0xFFFFFFFF, len(frame), len(frame)) + frame +
                     b"\0" * (-len(frame) % 4) + comment)
    return out


def sync_manager(start, length, control):
    return struct.pack("<HHBBBB", start, length, control, 0, 1, 0)


def set_up_by_broadcast(count):
    """All FMMUs, all sync managers and the clocks of 2,040 slaves, by a few frames."""
    slaves = 2040
    bus = WideBus(slaves)
    for n in range(count):
        units = b"".join(fmmu(0x10000 * (k + 1) + n, 4, 0x1000 + k * 16, k % 2) for k in range(16))
        managers = b"".join(sync_manager(0x1000 + k * 64, 32, (0x20, 0x24)[k % 2]) for k in range(16))
        times = struct.pack("<II", 1_000_000, 500_000)
        bus.together([(BWR, 0, address, data, data, slaves) for address, data in (
            (0x0600, units), (0x0800, managers), (0x0980, b"\0\7"), (0x09A0, times))])
    for state in (2, 4, 8):
        bus.together([(BWR, 0, 0x0120, bytes([state, 0]), bytes([state, 0]), slaves)])
        bus.together([(BRD, 0, 0x0130, bytes(6), bytes([state, 0, 0, 0, 0, 0]), slaves)])
    return bus.pcap()


def operated_bus(slaves, length):
    """Mailboxes and process data of `length` bytes, which all slaves share; SYNC0; in OP."""
    bus = WideBus(slaves)
    managers = (sync_manager(0x1000, 16, 0x26) + sync_manager(0x1080, 16, 0x22) + sync_manager(0x1100, length, 0x64) +
                sync_manager(0x1180, length, 0x20))
    bus.together([(BWR, 0, 0x0800, managers, managers, slaves)])
    mapping = fmmu(0, length, 0x1100, 0) + fmmu(0, length, 0x1180, 1)
    for begin in range(0, slaves, 20):
        bus.together([(FPWR, 0x1001 + s, 0x0600, mapping, mapping, 1) for s in range(begin, min(begin + 20, slaves))])
    for address, data in ((0x09A0, struct.pack("<II", 1_000_000, 0)), (0x0990, struct.pack("<Q", 10**9)),
                          (0x0980, b"\0\3")):
        bus.together([(BWR, 0, address, data, data, slaves)])
    for state in (1, 2, 4, 8):
        bus.together([(BWR, 0, 0x0120, bytes([state, 0]), bytes([state, 0]), slaves)])
        for _ in range(2):
            bus.together([(BRD, 0, 0x0130, bytes(2), bytes([state, 0]), slaves)])
    return bus


def cycles_of_thousands(count):
    """One byte of process data, of 2,000 slaves."""
    bus = operated_bus(2000, 1)
    for n in range(count):
        time = struct.pack("<Q", 10**9 + n * 1_000_000)
        bus.together([(LRW, 0, 0, bytes([n & 0xFF]), bytes([n * 3 & 0xFF]), 6000), (14, 0x1001, 0x0910, time, time, 2000)])
    return bus.pcap()


def crowded_process_data(count):
    """Frames full of small logical datagrams, some of which not all slaves answer."""
    bus = operated_bus(1000, 64)
    for n in range(count):
        bus.together([(LRW, (50 * n + k) * 5 % 64, 0, bytes([k * 7 & 0xFF]), bytes([k * 3 & 0xFF]), 3000 if k % 3 else 2000)
                      for k in range(50)])
    return bus.pcap()


def values_of_thousands(count):
    """Downloads to 1,000 slaves in turn, ever other objects."""
    slaves = 1000
    bus = WideBus(slaves)
    mailboxes = sync_manager(0x1000, 16, 0x26) + sync_manager(0x1080, 16, 0x22)
    bus.together([(BWR, 0, 0x0800, mailboxes, mailboxes, slaves)])
    bus.together([(BWR, 0, 0x0120, b"\2\0", b"\2\0", slaves)])
    bus.together([(BRD, 0, 0x0130, bytes(2), b"\2\0", slaves)])
    datagrams = []
    for n in range(count):
        round_, slave = divmod(n, slaves)
        head = struct.pack("<HHBB", 10, 0, 0, 3 | (round_ % 7 + 1) << 4)
        place = struct.pack("<HB", 0x2000 + round_ // 200, round_ % 200)
        request = head + b"\0\x20\x23" + place + struct.pack("<I", n)
        answer = head + b"\0\x30\x60" + place + bytes(4)
        datagrams += [(FPWR, 0x1001 + slave, 0x1000, request, request, 1),
                      (FPRD, 0x1001 + slave, 0x1080, bytes(16), answer, 1)]
        if len(datagrams) == 50:
            bus.together(datagrams)
            datagrams = []
    return bus.pcap()


SHARED = (shared_process_data, mapped_and_used, cycles_of_thousands, crowded_process_data)
PATTERNS = {fmmu_changes: 1500, varying_process_data: 2000,
            shared_process_data: 20, mapped_and_used: 200, lost_process_data: 1500, distinct_objects: 1500,
            unfinished_transfers: 1500, refused_transfers: 1500, unfinished_fragments: 1500, emergencies: 2500,
            drive_states: 2000, al_states: 2000, new_stations: 4000, error_counters: 4000, sections: 4000,
            other_blocks: 3000, set_up_by_broadcast: 4, cycles_of_thousands: 300, crowded_process_data: 5,
            values_of_thousands: 10_000}
