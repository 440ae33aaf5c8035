/// out of mailbox/: the contents of mailbox messages, as plain structs, and the interface that takes them.
///
/// All spans and string_views are valid during the call only; copy them to keep them longer.
/// Frames: a request is cited by its outbound copy, an answer by its returned copy, where those are captured.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"
#include "decoder/base/known.h"
#include "decoder/mailbox/aoe.h"
#include "decoder/mailbox/coe.h"
#include "decoder/mailbox/emergency.h"
#include "decoder/mailbox/header.h"
#include "decoder/mailbox/soe.h"

namespace ecaudit::mailbox {

/// How the counter of a message follows the one before it in the same direction.
enum class CounterStep : std::uint8_t {
  kUnknown,  ///< first message seen, or messages may have been missed since the last one
  kUnused,   ///< 0, now or before: the sender does not count
  kNext,     ///< as it should be
  kSame,     ///< not advanced
  kSkipped,  ///< advanced by more than one
};

/// Why everything that is open ends.
enum class TransferEnd : std::uint8_t {
  kCaptureEnd,
  kReset,  ///< the mailbox was switched off or reconfigured, or the slave went to INIT
  kGap,    ///< frames are missing from the capture
};

/// One message through a mailbox, complete.
struct MailboxMessage {
  SlaveId slave = kNoSlave;
  Direction direction = Direction::kOut;
  FrameRef sent;      ///< outbound copy of the access that completed it
  FrameRef returned;  ///< returned copy of that access
  FrameRef first;     ///< frame of the access to the first byte, when that was an earlier one; else as frame()
  Header header;
  ByteSpan payload;  ///< service data, at most header.length bytes
  ByteSpan behind;   ///< what was transferred after the message: old contents, or what a wrong length leaves out
  Problem problem = Problem::kNone;
  /// kObserved: the working counter shows it was written or read. kInferred: taken as done (outbound-only capture), or
  /// the mailbox was recognised by its contents. kUnknown: the frame never returned.
  Certainty certainty = Certainty::kObserved;
  bool assumed = false;      ///< outbound-only capture: no answer can be expected in the capture
  bool mailbox_off = false;  ///< written although the sync manager is known to be switched off
  /// Known only after later messages were processed (its frame never returned); nothing was derived from it.
  bool late = false;
  bool window_inferred = false;  ///< the sync manager's configuration was not seen
  /// Out: the slave ignores it, it repeats the request before. In: the slave's answer to a repeat request, seen before.
  bool repeated = false;
  CounterStep counter_step = CounterStep::kUnknown;
  /// In: the counter equals that of the latest request, as slaves that echo it do instead of counting themselves.
  bool counter_echoes_request = false;
  /// Out: how often the slave did not take the same bytes before, since another message was refused.
  std::uint32_t refused_before = 0;

  [[nodiscard]] const FrameRef& frame() const {
    const FrameRef& preferred = direction == Direction::kOut ? sent : returned;
    return preferred.seen() ? preferred : direction == Direction::kOut ? returned : sent;
  }
};

enum class SdoService : std::uint8_t {
  kUnknown,   ///< the initiate was not captured and nothing else shows it
  kDownload,  ///< master writes
  kUpload,    ///< master reads
};

enum class SdoTransferKind : std::uint8_t {
  kUnknown,    ///< no data seen (aborted or unanswered upload)
  kExpedited,  ///< up to 4 bytes in the initiate
  kNormal,     ///< all data after the initiate
  kSegmented,  ///< continued in segments
};

/// "download", "upload", "unknown".
[[nodiscard]] std::string_view Name(SdoService service);
/// "expedited", "normal", "segmented", "unknown".
[[nodiscard]] std::string_view Name(SdoTransferKind kind);

/// How a transfer ended.
enum class SdoOutcome : std::uint8_t {
  kCompleted,
  kAborted,       ///< see abort_code and aborted_by
  kMailboxError,  ///< the slave answered with a mailbox error reply, see mailbox_error
  kSuperseded,    ///< not finished when the master began the next one
  kCaptureEnd,    ///< not finished when the capture ended
  kReset,         ///< not finished when the mailbox was switched off or reconfigured
  kNotCaptured,   ///< the answers are not in the capture (outbound only, or lost): a download is taken for done
  kGap,           ///< frames are missing from the capture: result unknown
};

/// "completed", "aborted", ...
[[nodiscard]] std::string_view Name(SdoOutcome outcome);

/// One SDO transfer, reported when it ends.
struct SdoTransfer {
  SlaveId slave = kNoSlave;
  SdoService service = SdoService::kUnknown;
  SdoTransferKind kind = SdoTransferKind::kUnknown;
  SdoOutcome outcome = SdoOutcome::kCompleted;
  bool complete_access = false;
  bool has_object = false;  ///< index and subindex are known
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  /// Bytes of the object: written or read so far. At most SdoTransferTracker::kMaxStoredBytes; size counts all.
  ByteSpan data;
  std::uint64_t size = 0;
  std::optional<std::uint32_t> declared_size;  ///< as the initiate announced
  bool size_mismatch = false;                  ///< completed with another size than announced
  bool data_gap = false;                       ///< an answer with data is missing from the capture: data is not whole
  std::uint32_t excess = 0;                    ///< bytes after the announced size in the initiate, not part of data

  std::uint32_t abort_code = 0;
  Direction aborted_by = Direction::kIn;              ///< kOut: the master gave up
  std::optional<std::uint32_t> displaced_abort_code;  ///< see SdoMessage
  std::uint16_t mailbox_error = 0;

  FrameRef request;   ///< initiate request, not seen() when it was not captured
  FrameRef response;  ///< last answer: the one that completed or aborted it; not seen() when there was none
  FrameRef last;      ///< last frame of it: the last answer, or the master's last request or abort
  std::optional<TimeNs> duration;             ///< from request to response; absent without both stamps
  Certainty certainty = Certainty::kUnknown;  ///< observed: request and answer seen; unknown: object not known
  bool answered = false;                      ///< the slave answered at least once
  bool answer_lost = false;                   ///< a mailbox read whose frame never returned may have taken the answer
  std::uint32_t segments = 0;                 ///< segment requests
  std::uint32_t toggle_errors = 0;  ///< segments whose toggle bit does not alternate, or answers that do not match it
  FrameRef toggle_error;            ///< the first one
  Direction toggle_error_by = Direction::kOut;
  std::uint32_t unexpected_responses = 0;  ///< answers that did not belong to it while it was open
  bool request_service_mismatch = false;   ///< a request under another CoE service than 2
  bool response_service_mismatch = false;  ///< an answer other than an abort under service 2, as the manuals print it
  FrameRef service_mismatch;               ///< the first such frame

  [[nodiscard]] bool incomplete() const {
    return outcome == SdoOutcome::kSuperseded || outcome == SdoOutcome::kCaptureEnd || outcome == SdoOutcome::kReset;
  }
};

/// An SDO answer that belongs to no outstanding request.
struct SdoUnexpected {
  enum class Reason : std::uint8_t {
    kNoRequest,     ///< nothing is outstanding
    kWrongCommand,  ///< the command does not answer the request
    kWrongObject,   ///< index or subindex differ from the request's
  };
  SlaveId slave = kNoSlave;
  Reason reason = Reason::kNoRequest;
  FrameRef request;  ///< the outstanding request, not seen() when there is none
  FrameRef response;
  std::uint8_t command = 0;  ///< of the answer
  bool has_object = false;   ///< the answer names an object
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint16_t expected_index = 0;  ///< of the request
  std::uint8_t expected_subindex = 0;
  bool abort = false;
  std::uint32_t abort_code = 0;
};

/// "no request is outstanding", ...
[[nodiscard]] std::string_view Describe(SdoUnexpected::Reason reason);

/// A request of the master that the slave has to answer, as far as needed to name it.
struct RequestSummary {
  FrameRef frame;  ///< not seen() when there is none
  Protocol protocol = Protocol::kError;
  std::uint8_t counter = 0;
  std::uint8_t operation = 0;          ///< CoE service, or the operation of the other protocols
  std::uint8_t command = 0;            ///< SDO command byte, or SDO information opcode
  std::optional<std::uint16_t> index;  ///< SDO: object; SoE: IDN
  std::optional<std::uint8_t> subindex;
};

/// A mailbox error reply, and what it answers.
struct MailboxErrorReply {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  std::uint16_t type = 0;    ///< always 1
  std::uint16_t detail = 0;  ///< see MailboxErrorText()
  RequestSummary request;    ///< the outstanding request with the same counter, else the latest one
};

/// The slave did not take a message: its mailbox was still full, or not there (working counter 0).
struct MailboxRefused {
  SlaveId slave = kNoSlave;
  FrameRef sent;
  FrameRef returned;
  Header header;               ///< of the refused message
  bool same_as_last = false;   ///< byte for byte the last message that was written: a repetition
  bool off = false;            ///< the mailbox is known to be switched off
  RequestSummary outstanding;  ///< the latest request still without an answer, if any
  std::uint32_t attempt = 1;   ///< how often it refused these bytes by now, since another message was refused
  FrameNo last_message = 0;    ///< frame of the last message that was written before; 0: none is in the capture
  Protocol last_protocol = Protocol::kError;  ///< of that message

  [[nodiscard]] const FrameRef& frame() const { return sent.seen() ? sent : returned; }
};

/// The out mailbox was full at each look, of a message that is not in the capture, and nothing came out of the other
/// one.
struct MailboxStuck {
  SlaveId slave = kNoSlave;
  FrameRef first, last;  ///< reads of the status of the out mailbox (0x0805)
  /// Nothing was written since, and what was written before is not known; not seen(): that is not known either.
  FrameRef gap;
  std::uint64_t looks = 0;
  bool reset = false;  ///< the mailbox was reset after them

  /// From here on it is known to be full.
  [[nodiscard]] const FrameRef& since() const { return gap.seen() ? gap : first; }
};

/// A mailbox read never returned: what the slave may have put there is missing from the capture.
struct MailboxReadLost {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  RequestSummary outstanding;  ///< the request whose answer it may have taken, if any
};

/// The master asks for the last answer again (bit 1 of 0x080E toggled), or the slave shows that it is back (0x080F).
struct MailboxRepeatRequest {
  enum class Kind : std::uint8_t { kRequested, kAcknowledged };
  SlaveId slave = kNoSlave;
  FrameRef frame;
  Kind kind = Kind::kRequested;
};

/// A request that got its answer.
struct MailboxAnswered {
  SlaveId slave = kNoSlave;
  RequestSummary request;
  FrameRef answer;
  std::uint64_t polls = 0;  ///< times the master looked for the answer and found the mailbox empty
  FrameRef last_poll;       ///< last look that found nothing; not seen() when there was none
  bool read_lost = false;   ///< a mailbox read was lost in between: the answer may have been in it
  FrameRef since;           ///< where the request was written, by the clock as it was set up to the last look
};

/// A request that got no answer: reported when the next request of its kind, the end of the capture or a reset shows
/// that none will come. Not reported where answers are not captured.
struct MailboxUnanswered {
  enum class End : std::uint8_t { kNextRequest, kCaptureEnd, kReset, kGap };
  SlaveId slave = kNoSlave;
  RequestSummary request;
  End end = End::kNextRequest;
  FrameRef ended;           ///< the next request or the reset; not seen() at the end of the capture
  std::uint64_t polls = 0;  ///< times the master looked for the answer and found the mailbox empty
  FrameRef first_poll;
  FrameRef last_poll;                          ///< last look that found nothing; not seen() when there was none
  std::uint32_t parts = 0;                     ///< of the answer that came: it has more
  FrameRef last_part;                          ///< the looks count from there on; not seen() when there was none
  FrameRef since;                              ///< that, or the request, by the clock as it was set since then
  bool not_accepted = false;                   ///< the last read of 0x0805 showed the out mailbox still full
  bool taken = false;                          ///< it was found empty, or took the next request
  bool read_lost = false;                      ///< a mailbox read was lost in between: the answer may have been in it
  Certainty certainty = Certainty::kObserved;  ///< that the slave got the request
};

/// SDO information: an object list, an object or entry description, or an error.
struct SdoInfo {
  enum class Kind : std::uint8_t { kUnknown, kList, kObject, kEntry };
  enum class Outcome : std::uint8_t {
    kCompleted,
    kError,         ///< see abort_code
    kMailboxError,  ///< see mailbox_error
    kSuperseded,    ///< not finished when the next request came
    kCaptureEnd,
    kReset,
    kGap,
    kNotCaptured,  ///< answers are not in the capture
  };
  SlaveId slave = kNoSlave;
  Kind kind = Kind::kUnknown;
  Outcome outcome = Outcome::kCompleted;
  FrameRef request;   ///< not seen() when it was not captured
  FrameRef response;  ///< last fragment; not seen() when there was none
  std::optional<TimeNs> duration;
  std::uint32_t fragments = 0;
  bool fragment_error = false;  ///< fragments left did not count down to 0: the contents are not whole
  bool malformed = false;       ///< fixed fields are missing from the answer

  std::uint16_t list_type = 0;             ///< list: 0 lengths, 1 all, 2 RxPDO, 3 TxPDO, 4 backup, 5 settings
  std::span<const std::uint16_t> indices;  ///< list: objects, or for list type 0 the lengths of lists 1-5

  std::uint16_t index = 0;                   ///< object, entry
  std::uint8_t subindex = 0;                 ///< entry
  std::uint16_t data_type = 0;               ///< object, entry: see DataType
  std::uint8_t max_subindex = 0;             ///< object
  std::uint8_t object_code = 0;              ///< object: see ObjectCodeName()
  std::uint8_t value_info = 0;               ///< entry: which of the optional parts the slave gave
  std::uint16_t bit_length = 0;              ///< entry
  std::uint16_t access = 0;                  ///< entry: see AccessText()
  std::optional<std::uint16_t> unit;         ///< entry
  ByteSpan default_value, minimum, maximum;  ///< entry, empty when not given
  std::string_view name;                     ///< object, entry (untrusted text, not terminated)

  std::uint32_t abort_code = 0;  ///< error; of a malformed one as found after the message (KickCAT does that)
  std::uint16_t mailbox_error = 0;
};

struct Emergency {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  EmergencyData data;
};

/// A process data object sent through the mailbox, or a request for one.
struct CoePdo {
  SlaveId slave = kNoSlave;
  Direction direction = Direction::kOut;
  FrameRef frame;
  CoeService service = CoeService::kTxPdo;
  std::uint16_t number = 0;
  ByteSpan data;
};

enum class EoeType : std::uint8_t {
  kFragment = 0,
  kTimestampResponse = 1,
  kSetIpRequest = 2,
  kSetIpResponse = 3,
  kSetFilterRequest = 4,
  kSetFilterResponse = 5,
  kGetIpRequest = 6,
  kGetIpResponse = 7,
  kGetFilterRequest = 8,
  kGetFilterResponse = 9,
};
/// "set IP request"; "type 10" for a reserved number.
[[nodiscard]] std::string Name(EoeType type);

/// What is inside an Ethernet frame, as far as it could be read. IP addresses have their first number in the most
/// significant byte.
struct EthernetSummary {
  bool valid = false;  ///< there was room for the Ethernet header
  std::array<std::uint8_t, 6> destination{};
  std::array<std::uint8_t, 6> source{};
  std::uint16_t ether_type = 0;  ///< after VLAN tags
  std::optional<std::uint16_t> vlan;
  std::optional<std::uint8_t> ip_protocol;                 ///< 1 ICMP, 6 TCP, 17 UDP
  std::optional<std::uint32_t> source_ip, destination_ip;  ///< IPv4, also inside ARP
  std::optional<std::uint16_t> source_port, destination_port;
};

/// An Ethernet frame tunnelled through the mailbox.
struct EoeFrame {
  enum class Problem : std::uint8_t { kNone, kNoStart, kFragmentMissing, kWrongOffset, kWrongSize, kUnfinished };
  SlaveId slave = kNoSlave;
  Direction direction = Direction::kOut;
  FrameRef first;
  FrameRef last;
  Problem problem = Problem::kNone;
  std::uint8_t port = 0;
  std::uint8_t frame_number = 0;  ///< 0-15
  std::uint32_t fragments = 0;
  std::uint64_t size = 0;  ///< bytes of all fragments
  ByteSpan data;           ///< at most EoeReassembler::kMaxFrameBytes
  bool time_requested = false;
  std::optional<std::uint32_t> timestamp;
  EthernetSummary summary;
};
/// "a fragment is missing"; "" for kNone.
[[nodiscard]] std::string_view Describe(EoeFrame::Problem problem);

/// Settings of the IP interface of a slave; what is not part of the message stays absent.
struct EoeIpParameters {
  std::uint32_t flags = 0;
  std::optional<std::array<std::uint8_t, 6>> mac;
  std::optional<std::uint32_t> ip, subnet_mask, gateway, dns_server;  ///< first number in the most significant byte
  ByteSpan dns_name;  ///< untrusted text without terminator; empty when not given
  bool cut = false;   ///< the flags announce a setting that the data do not reach
};

/// EoE messages other than fragments.
struct EoeControl {
  SlaveId slave = kNoSlave;
  Direction direction = Direction::kOut;
  FrameRef frame;
  FrameRef request;  ///< of a response, when captured
  EoeType type = EoeType::kSetIpRequest;
  std::optional<std::uint16_t> result;  ///< set responses: see EoeResultText()
  std::optional<std::uint32_t> timestamp;
  EoeIpParameters ip;
};

/// One file transfer.
struct FoeTransfer {
  enum class Outcome : std::uint8_t {
    kCompleted,
    kError,         ///< see error_code, error_by
    kMailboxError,  ///< see mailbox_error
    kSuperseded,    ///< not finished when the next one began
    kCaptureEnd,
    kReset,
    kGap,
    kNotCaptured,  ///< answers are not in the capture: result unknown
  };
  SlaveId slave = kNoSlave;
  bool write = false;  ///< master to slave
  Outcome outcome = Outcome::kCompleted;
  std::string_view file_name;  ///< untrusted text; empty when the request was not captured
  std::uint32_t password = 0;
  std::uint64_t bytes = 0;  ///< of the file, as far as transferred
  std::uint32_t packets = 0;
  std::uint32_t repeated_packets = 0;
  std::uint32_t busy = 0;           ///< busy messages
  std::uint32_t packet_errors = 0;  ///< packet numbers or acknowledges out of order
  FrameRef packet_error;            ///< the first one
  std::uint32_t error_code = 0;     ///< see FoeErrorText()
  std::string_view error_text;      ///< untrusted text
  Direction error_by = Direction::kIn;
  std::uint16_t mailbox_error = 0;
  bool answered = false;     ///< the slave sent anything
  bool answer_lost = false;  ///< a mailbox read whose frame never returned may have taken its last message
  FrameRef request;          ///< not seen() when it was not captured
  FrameRef last;
  std::optional<TimeNs> duration;
  Certainty certainty = Certainty::kUnknown;
};

/// One SoE message, put together from its fragments.
struct SoeMessage {
  SlaveId slave = kNoSlave;
  Direction direction = Direction::kOut;
  FrameRef frame;    ///< last fragment
  FrameRef request;  ///< of a response, when captured
  SoeOperation operation = SoeOperation::kReadRequest;
  std::uint8_t drive = 0;
  std::uint8_t elements = 0;  ///< see ElementNames()
  std::uint16_t idn = 0;      ///< see IdnName()
  bool idn_known = true;      ///< false: given up before the last fragment, which names it
  std::uint32_t fragments = 1;
  bool fragment_error = false;              ///< fragments left did not count down to 0: data is not whole
  std::uint64_t size = 0;                   ///< bytes of data
  ByteSpan data;                            ///< without the error code; at most SoeReassembler::kMaxStoredBytes
  std::optional<std::uint16_t> error_code;  ///< see SoeErrorText()
};

struct AoeMessage {
  SlaveId slave = kNoSlave;
  Direction direction = Direction::kOut;
  FrameRef frame;
  FrameRef request;  ///< of a response, when captured
  AmsHeader header;
  AdsParameters parameters;
};

struct VoeMessage {
  SlaveId slave = kNoSlave;
  Direction direction = Direction::kOut;
  FrameRef frame;
  std::uint32_t vendor_id = 0;
  std::uint16_t vendor_type = 0;
  ByteSpan data;
};

}  // namespace ecaudit::mailbox
