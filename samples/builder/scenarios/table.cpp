#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

constexpr Scenario kScenarios[] = {
    // --- nothing wrong
    {"clean-startup", "One drive from the scan to OP, enabled and moved in about 100 cycles of 1 ms, and back to INIT.",
     "Clean.", CleanStartup},
    {"clean-mixed-bus", "A terminal without processor between two drives; it echoes the acknowledge bit in AL Status.",
     "Clean; the echoed bit is no error.", CleanMixedBus},
    {"clean-twincat-habits",
     "Two drives and a master that works like TwinCAT: AL requests without acknowledge bit, 2 ms.", "Clean.",
     CleanTwinCatHabits},
    {"mid-run", "Two drives in OP; the capture begins long after the start-up.",
     "Clean; says what it could not evaluate.", MidRun},
    // --- AL state machine
    {"init-to-op-refused", "INIT to OP requested, refused with 0x0011, acknowledged, then done step by step.",
     "The illegal request, and the refusal it causes.", InitToOpRefused},
    {"refusal-never-acknowledged",
     "INIT to SAFEOP refused; the master then asks for PREOP three times, without acknowledging.",
     "The illegal request, its refusal, and three requests without acknowledge.", RefusalNeverAcknowledged},
    {"falls-out-of-op",
     "The master pauses its process data for 130 ms; the drive's watchdog of 100 ms takes it to SAFEOP+ERR.",
     "The gap exceeds the watchdog, and so the state falls with code 0x001B.", FallsOutOfOp},
    {"two-slaves-one-refuses",
     "Broadcast request of SAFEOP; the second drive refuses with 0x0017 for an SM2 of 8 bytes.",
     "Slave 1 only: SM2 length 8 instead of 6, and the refusal it causes.", TwoSlavesOneRefuses},
    {"bad-mailbox-config", "PREOP refused with 0x0017: SM0 has 64 bytes, the EEPROM says 128.",
     "The mailbox configuration, and the refusal it causes.", BadMailboxConfig},
    {"al-timeout",
     "The drive never answers a request of PREOP, although the master polls for 3.6 s; the second request works.",
     "The first request timed out.", AlTimeout},
    {"wrong-status-code", "INIT to OP is refused with 0x0017 instead of 0x0011.",
     "The illegal request, its refusal, and the code that does not belong to it.", WrongStatusCode},
    {"undocumented-status-code", "SAFEOP is refused with 0x001D, which the manual does not list.",
     "The refusal, and the code that the manual does not know.", UndocumentedStatusCode},
    {"accepted-illegal", "PREOP to OP is requested, and the drive goes there.",
     "The illegal request, and that the drive accepted it.", AcceptedIllegal},
    {"invalid-request", "State 5 is requested and refused.", "The invalid request, and its refusal.", InvalidRequest},
    {"unexpected-error-unread", "The drive falls from OP to SAFEOP+ERR; the master reads AL Status, never the code.",
     "The state fell unexpectedly; the reason is not in the capture.", UnexpectedErrorUnread},
    // --- mailbox
    {"sdo-aborts",
     "Four downloads in PREOP are aborted: a read-only object, a wrong size, and twice an unknown object.",
     "Each abort, and where the reason is known, that before it.", SdoAborts},
    {"mailbox-no-response", "The drive never takes a request out of its mailbox; the next one is refused.",
     "No response, the out mailbox full; the refused request follows from it.", MailboxNoResponse},
    {"emergency", "The drive sends an emergency 0x7305 in PREOP, later one that says it is free of errors.",
     "The emergency.", Emergencies},
    {"foe-unsupported", "A FoE request to a drive whose EEPROM lists CoE only.",
     "The protocol, and the mailbox error it causes.", FoeUnsupported},
    {"mailbox-counter", "The drive leaves out one number of its mailbox counter.", "The number left out.",
     MailboxCounterSkipped},
    // --- bus
    {"lost-frames", "Four returned process-data frames are missing.", "Four lost frames, folded into one finding.",
     LostFrames},
    {"duplicated-frames", "Three frames come back twice.", "Three duplicates, folded into one finding.",
     DuplicatedFrames},
    {"circulating", "Six frames come back with the circulating bit set.", "Circulating frames, one finding.",
     Circulating},
    {"wkc-link-break", "Three drives in OP; the cable to the third is out for 40 cycles.",
     "Working counter 6 instead of 9, slave 2 missing; slave count 2 instead of 3.", WkcLinkBreak},
    {"duplicate-address", "Two drives get the station address 0x1001; the master then corrects one of them.",
     "The address given twice.", DuplicateAddress},
    {"slave-count-changes", "Three drives in OP; two of them disappear for good.",
     "Slave count 1 instead of 3; working counter 3 instead of 9.", SlaveCountChanges},
    {"link-errors", "The error counters of slave 1, port 1 rise between two reads.", "Link errors at slave 1.",
     LinkErrors},
    {"read-only-write", "The master writes AL Status 0x0130.", "The write of a read-only register.", ReadOnlyWrite},
    // --- PDO mapping
    {"pdo-assign-order",
     "The master writes 1C12h:1 while 1C12h:0 is 1; the drive keeps its PDO, and SAFEOP is refused for the length of "
     "SM2.",
     "The order, the SM2 length that follows from it, and the refusal that follows from that.", PdoAssignOrder},
    {"pdo-unsupported",
     "PDO 1799h is assigned, which the drive does not have; SAFEOP is refused for the length of SM2.",
     "The PDO, the SM2 length that follows from it, and the refusal that follows from that.", PdoUnsupported},
    {"pdo-odd-mapping", "Three bytes of inputs are mapped freely; the device, like a Kollmorgen MKD-C, refuses SAFEOP.",
     "The odd length of the Tx mapping, and the refusal it causes.", PdoOddMapping},
    // --- captures
    {"outbound-only", "A healthy run of which only the outbound frames were captured.",
     "No errors or warnings; one direction, and what could not be evaluated.", OutboundOnly},
    {"returned-only", "The same, only the returned frames.",
     "No errors or warnings; one direction, and what could not be evaluated.", ReturnedOnly},
    {"truncated", "A healthy run; the file ends inside its last packet.", "Truncated; everything before it is clean.",
     Truncated},
    {"snaplen", "A healthy run, packets cut at 64 bytes.", "Cut packets; nothing malformed.", SnapLength},
    {"coarse-timestamps", "A healthy run with microsecond stamps, equal for both copies of a frame.",
     "Timing by stamps is not evaluable; else clean.", CoarseTimestamps},
    {"pcap-microseconds", "A healthy run as classic pcap.", "Clean.", PcapMicroseconds},
    {"two-interfaces", "A healthy run captured by a tap: outbound on interface 0, returned on interface 1.", "Clean.",
     TwoInterfaces},
    {"esl-probe", "A healthy run through a probe that adds 16 bytes with port and time to each frame.", "Clean.",
     EslProbe},
    {"vlan-tagged", "A healthy run with VLAN tags.", "Clean.", VlanTagged},
    {"udp-encapsulated", "A healthy run in UDP packets, port 34980.", "Clean.", UdpEncapsulated},
    {"no-ethercat", "Twenty ARP and UDP packets.", "No EtherCAT in the file.", NoEtherCat},
    {"foreign-traffic", "ARP and UDP packets between the EtherCAT frames of a start-up to PREOP.",
     "Clean; the foreign packets are counted.", ForeignTraffic},
    {"malformed", "Seven kinds of broken EtherCAT frames, sent by the master itself.", "Each malformed frame.",
     Malformed},
};

}  // namespace

std::span<const Scenario> AllScenarios() {
  return kScenarios;
}

}  // namespace ecaudit::samples
