/// out of mailbox/: what was said through the mailboxes, as plain structs, and the interface that takes them.
///
/// All spans and string_views are valid during the call only; who needs them longer copies them.
/// Frames: a request is cited by its outbound copy, an answer by its returned copy, where those are captured.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"
#include "decoder/base/known.h"
#include "decoder/mailbox/header.h"

namespace ecaudit::mailbox {

/// How the counter of a message follows the one before it in the same direction.
enum class CounterStep : std::uint8_t {
  kUnknown,  ///< first message seen, or messages may have been missed since the last one
  kUnused,   ///< 0, now or before: the sender does not count
  kNext,     ///< as it should be
  kSame,     ///< not advanced
  kSkipped,  ///< advanced by more than one
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
  Problem problem = Problem::kNone;
  /// kObserved: the working counter says it was written or read. kInferred: taken as done (outbound-only capture), or
  /// the mailbox was recognised by its contents. kUnknown: the frame never returned.
  Certainty certainty = Certainty::kObserved;
  bool assumed = false;          ///< outbound-only capture: no answer can be expected in the capture
  bool window_inferred = false;  ///< the sync manager's configuration was not seen
  /// Out: the slave ignores it, it repeats the request before. In: the slave's answer to a repeat request, seen before.
  bool repeated = false;
  CounterStep counter_step = CounterStep::kUnknown;
  /// In: the counter equals that of the latest request, as slaves that echo it do instead of counting themselves.
  bool counter_echoes_request = false;

  [[nodiscard]] const FrameRef& frame() const {
    const FrameRef& preferred = direction == Direction::kOut ? sent : returned;
    return preferred.seen() ? preferred : direction == Direction::kOut ? returned : sent;
  }
};

enum class SdoService : std::uint8_t {
  kUnknown,   ///< the initiate was not captured and nothing else tells
  kDownload,  ///< master writes
  kUpload,    ///< master reads
};

enum class SdoTransferKind : std::uint8_t {
  kUnknown,    ///< no data seen (aborted or unanswered upload)
  kExpedited,  ///< up to 4 bytes in the initiate
  kNormal,     ///< all data behind the initiate
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
  kNotCaptured,   ///< the answers are not in the capture (outbound only): result unknown
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
  std::uint32_t excess = 0;                    ///< bytes behind the announced size in the initiate, not part of data

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

/// Takes the events of all slaves. What a user does not override is dropped.
class MailboxSink {
 public:
  MailboxSink() = default;
  MailboxSink(const MailboxSink&) = delete;
  MailboxSink& operator=(const MailboxSink&) = delete;
  virtual ~MailboxSink() = default;

  virtual void On(const MailboxMessage&) {}
  virtual void On(const SdoTransfer&) {}
  virtual void On(const SdoUnexpected&) {}
};

}  // namespace ecaudit::mailbox
