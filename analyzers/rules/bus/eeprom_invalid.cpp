#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/shared_notes.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/time.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/sii.h"
#include "decoder/track/access.h"
#include "decoder/track/network.h"

namespace ecaudit::eeprom_invalid {
namespace {

constexpr FindingKind kBlank{
    .name = "blank",
    .title = "EEPROM is blank: all {words} that the master read are {blank_word}",
    .message =
        R"(The master read {words} of the EEPROM from {first_frame} to {frame}, and all of them are {blank_word}.[ The
status 0x0502 shows in {error_frame}: {errors}.][{?not_operational} DL Status (0x0110) bit 0 is 0: the slave controller has
loaded no EEPROM.] Without the EEPROM the slave controller has no configuration and no interface to its processor, so the slave
cannot leave INIT.)",
    .next =
        R"(Write the EEPROM image of the device (from its ESI file), then switch the slave off and on.[{?zeros} If the words
are still 0, check the chip and its wiring.])"};

constexpr FindingKind kBusy{
    .name = "stays-busy",
    .title = "EEPROM stays busy: no word was read in {busy_ms}",
    .message =
        R"(The master reads the EEPROM from {first_frame} on. In all {polls} up to {frame} the status 0x0502 shows busy (bit
15).[{?emulated} The EEPROM is emulated (bit 5): the processor of the slave has to answer, and does not.] So the master gets
neither the identity nor the mailbox settings of the slave.)",
    .next =
        R"(Check that the firmware of the slave runs[{?emulated} and answers EEPROM commands][{!emulated}, and the EEPROM
chip and its wiring].)"};

constexpr FindingKind kBusyAtWord{
    .name = "busy-at-word",
    .title = "EEPROM stays busy[ at word {word}]: not read in {busy_ms}",
    .message =
        R"(The master reads the EEPROM until {read_until_frame}. The read command[ for word {word}] in {command_frame} never ends: in
all {polls} from {first_frame} to {frame} the status 0x0502 shows busy (bit 15).[ Other words took {usual_ms} at
most.][{?emulated} The EEPROM is emulated (bit 5): the processor of the slave has to answer, and does not.] So the
master has not all that it needs of the EEPROM.)",
    .next =
        R"([{?emulated}Check the EEPROM emulation in the firmware of the slave: it must answer each command, also while it is
busy with something else.][{!emulated}Check that the processor of the slave runs if it emulates the EEPROM, or else the EEPROM
chip and its wiring.])"};

constexpr FindingKind kNotLoaded{
    .name = "not-loaded",
    .title = "EEPROM configuration not loaded by the slave controller (0x0502)",
    .message =
        R"(The EEPROM status (0x0502) shows in {frame}: {errors}.[{?not_operational} DL Status (0x0110) bit 0 is 0, too.]
Without the EEPROM the slave controller has no configuration and no interface to its processor.)",
    .next =
        R"(Read words 0 to 7 of the EEPROM and check the checksum in word 7. Write the EEPROM image of the device, then
switch the slave off and on.)"};

constexpr FindingKind kChecksum{
    .name = "checksum-wrong",
    .title = "EEPROM checksum is {checksum} instead of {checksum_needed}",
    .message =
        R"(Words 0 to 6 of the EEPROM, read until {frame}, need the checksum {checksum_needed}. The low byte of word 7 is
{checksum}. With a wrong checksum the slave controller loads none of its configuration.)",
    .next = "Write the EEPROM image of the device with the right checksum, then switch the slave off and on."};

constexpr FindingKind kNoMailboxWords{
    .name = "no-mailbox-words",
    .title = "EEPROM words 0x0018 to 0x001B (mailbox) are 0, but it names {protocols}",
    .message =
        R"(The EEPROM, read until {frame}, has 0 in words 0x0018 to 0x001B (offset and size of the mailboxes). But word
0x001C names {protocols}[, and its sync manager category has SM{sync_manager} with {bytes} for a mailbox]. A master that
uses these words sets no mailbox, and the slave refuses PREOP.)",
    .next = "Correct words 0x0018 to 0x001B of the EEPROM, or let the master use the ESI file."};

constexpr FindingKind kDamaged{
    .name = "categories-damaged",
    .title = "EEPROM categories damaged: bad length at word {word}",
    .message =
        R"(The chain of categories in the EEPROM, read until {frame}, has a header at word {word} whose length reaches
beyond the EEPROM. What follows (PDOs, sync managers, clocks) cannot be read.)",
    .next = "Write the EEPROM image of the device (from its ESI file), then switch the slave off and on."};

constexpr const FindingKind* kKinds[] = {&kBlank,    &kBusy,           &kBusyAtWord, &kNotLoaded,
                                         &kChecksum, &kNoMailboxWords, &kDamaged};

constexpr Word kChecksumError{"checksum-error", "checksum error (bit 11)"};
constexpr Word kConfigurationMissing{"not-loaded", "configuration not loaded (bit 12)"};

constexpr Word kIdentityWords{"eeprom-identity", "the identity in the EEPROM (words 0x0008 to 0x000B)"};

// What it explains has to be reported.
constexpr std::string_view kAfter[] = {"al-refused", "al-timeout", "sm-mailbox-config", "sm-overlap"};

constexpr RuleInfo kInfo{.id = "eeprom-invalid",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .subject = Subject::kEeprom,
                         .title = "The EEPROM of a slave is blank, damaged or not loaded",
                         .needs = "the words of the EEPROM that the master reads, and its status 0x0502",
                         .source = "ETG1000.4, slave information interface; ETG2010, configuration area",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether the EEPROM of a slave can be what the device needs:

- blank: all words that were read are 0xFFFF, or all are 0
- busy: the status 0x0502 stays busy (bit 15), and no word was read
- busy at a word: other words were read, but one read command never ends
- not loaded: the status 0x0502 shows a checksum error (bit 11) or a configuration that is not loaded (bit 12)
- a wrong checksum in word 7
- mailbox words 0x0018 to 0x001B that are 0, although the EEPROM names protocols and has a mailbox
- categories whose length reaches beyond the EEPROM

## Why it matters
The slave controller loads its configuration from the EEPROM, and masters set up mailboxes and process data by it.
A slave with a blank EEPROM answers frames, but never leaves INIT, and nothing in the AL status gives the reason.

## How it is decided
The words that the master read in the capture, and the last status 0x0502, count. Each slave has one finding, the first
of the list above.

- The words of at least one read command (8 bytes) and the identity (words 0x0008 to 0x000B) must be known for "blank".
- "Busy" needs 10 reads of the status in at least 50 ms, and no word that was read before.
- "Busy at a word" needs the same of one read command, or 15 ms if another command follows. The word is never read in
  the capture.
- An EEPROM that the processor of the slave emulates (0x0502 bit 5) has no status and no checksum to evaluate.
- A checksum after a write of the master belongs to eeprom-written.
- If the slave reaches PREOP or a higher state nevertheless, the finding is an info. Slaves that echo every state do not
  count, but those that exchange process data.
- Refusals, time-outs and sync manager findings of the slave have this finding as their cause.

## Example
tests/rules/eeprom-invalid/violates.trace

## What to do
Write the EEPROM image of the device, and switch the slave off and on. Compare it with the ESI file.
)"};

constexpr std::uint16_t kNotUsable = track::kEepromChecksumError | track::kEepromNotLoaded;
constexpr std::uint16_t kEmulated = 0x0020;  // of 0x0502
constexpr std::uint16_t kBusyBit = 0x8000;   // of 0x0502
constexpr std::size_t kEnoughBusy = 10;
constexpr TimeNs kLongBusy = 50'000'000;
constexpr std::uint32_t kIdentity = 0x0008;
constexpr std::uint32_t kConfigurationWords = 8;

class EepromInvalid final : public Rule {
 public:
  EepromInvalid() : Rule(kInfo) {
    Subscribe<track::EepromRead>(&EepromInvalid::On);
    Subscribe<track::EepromError>(&EepromInvalid::On);
    Subscribe<track::EepromWrite>(&EepromInvalid::On);
    Subscribe<track::SlaveAccess>(&EepromInvalid::On, MemoryRange::Of(esc::kEepromControl, 2));
    Subscribe<model::AlAnswered>(&EepromInvalid::On);
  }

  void On(const track::EepromRead& e) {
    Slave& slave = slaves_[e.slave];
    if (!slave.first.seen()) slave.first = e.command.seen() ? e.command : e.frame;
    slave.last = e.frame;
    const auto all = [&](unsigned value) {
      return std::ranges::all_of(e.words, [value](auto word) { return word == value; });
    };
    slave.blank = slave.blank && all(0xFFFF);
    slave.zeros = slave.zeros && all(0);
  }
  void On(const track::SlaveAccess& e) {
    if (e.broadcast || !e.done()) return;
    if (const ByteSpan command = e.Covered(e.written, esc::kEepromControl, 2); !command.empty()) Begin(e, command);
    const ByteSpan status = e.Covered(e.read, esc::kEepromControl, 2);
    if (status.empty()) return;
    Slave& slave = slaves_[e.slave];
    if ((LittleEndian<std::uint16_t>(status, 0) & kBusyBit) == 0) {
      const bool timed = slave.command.seen() && slave.command.has_time && e.frame().has_time;
      if (timed) slave.longest_ns = std::max(slave.longest_ns, Elapsed(slave.command.time, e.frame().time));
      slave.command = {};
      slave.busy = slave.command_busy = {};
      return;
    }
    slave.busy.Add(e.frame());
    slave.command_busy.Add(e.frame());
  }
  void On(const track::EepromError& e) {
    if (e.write || (e.bits & kNotUsable) == 0) return;
    Slave& slave = slaves_[e.slave];
    const auto bits = static_cast<std::uint16_t>(e.bits & kNotUsable);
    if (std::exchange(slave.errors, bits) != bits) slave.error = e.frame;
  }
  void On(const track::EepromWrite& e) { slaves_[e.slave].written = true; }
  void On(const model::AlAnswered& e) {
    const std::uint8_t state = e.request.control.state();
    const bool reached = e.outcome != model::AlAnswered::Outcome::kRefused;
    if (!reached || state == static_cast<std::uint8_t>(esc::AlState::INIT)) return;
    if (context().slave(e.slave).al.echoes()) return;
    Slave& slave = slaves_[e.slave];
    if (slave.reached.seen()) return;
    slave.reached = e.frame;
    slave.state = state;
  }

  void Finish() override {
    for (auto& [id, slave] : slaves_) {
      KeepBusy(slave, kLongBusy);
      // A slave controller that still loads its EEPROM shows these bits, too: the last status counts.
      slave.errors &= context().network().state(id).sii.status().value_or(0);
      Evaluate(id, slave);
    }
    (void)NotEvaluableWithoutReturns();
  }

 private:
  /// Reads of the status, without one that is not busy.
  struct Busy {
    std::size_t reads = 0;
    FrameRef since, until;

    void Add(const FrameRef& frame) {
      if (reads++ == 0) since = frame;
      until = frame;
    }
    [[nodiscard]] TimeNs length() const { return Elapsed(since.time, until.time); }
    [[nodiscard]] bool Lasts(TimeNs enough) const {
      return reads >= kEnoughBusy && since.has_time && until.has_time && length() >= enough;
    }
  };
  /// A read command that never ended.
  struct Stuck {
    FrameRef command;
    Busy busy;
    std::optional<std::uint32_t> word;
  };
  struct Slave {
    FrameRef first, last;  ///< of the reads
    Busy busy;
    FrameRef command;  ///< the last read command, until it ends
    Busy command_busy;
    std::optional<std::uint32_t> word;  ///< of the last command, if the same write has it
    TimeNs longest_ns = 0;              ///< of the commands that ended
    std::optional<Stuck> stuck;
    bool blank = true;         ///< all words that were read are 0xFFFF
    bool zeros = true;         ///< likewise 0
    std::uint16_t errors = 0;  ///< EepromErrorBit, as shown last
    FrameRef error;
    bool written = false;
    FrameRef reached;  ///< it left INIT
    std::uint8_t state = 0;
  };

  /// A command: one before that still was busy never ended.
  void Begin(const track::SlaveAccess& e, ByteSpan command) {
    constexpr std::uint16_t kCommands = 0x0700, kReadCommand = 0x0100;
    constexpr EscAddress kWordAddress = esc::kEepromControl + 2;
    constexpr TimeNs kGivenUp = 15'000'000;
    Slave& slave = slaves_[e.slave];
    KeepBusy(slave, kGivenUp);
    const bool reads = (LittleEndian<std::uint16_t>(command, 0) & kCommands) == kReadCommand;
    slave.command = reads ? e.frame() : FrameRef{};
    slave.command_busy = {};
    slave.word.reset();
    const ByteSpan word = e.Covered(e.written, kWordAddress, 4);
    if (!word.empty()) slave.word = LittleEndian<std::uint32_t>(word, 0);
  }

  /// Keeps the read command that was busy for the longest time, and never ended.
  static void KeepBusy(Slave& slave, TimeNs enough) {
    const Busy& busy = slave.command_busy;
    if (!slave.command.seen() || !busy.Lasts(enough)) return;
    if (slave.stuck && slave.stuck->busy.length() >= busy.length()) return;
    slave.stuck = {slave.command, busy, slave.word};
  }

  void Evaluate(SlaveId id, const Slave& slave) {
    const track::SlaveState& state = context().network().state(id);
    const esc::SiiImage& image = state.sii.image();
    const bool emulated = (state.sii.status().value_or(0) & kEmulated) != 0;
    std::optional<Finding> finding;
    const bool identity_known = image.KnownWords(kIdentity, 4) == 4;
    const Busy& busy = slave.busy;
    const bool long_busy = busy.Lasts(kLongBusy);
    if (long_busy && !slave.last.seen() && image.KnownWords() == 0) {
      finding = Found(kBusy, id, busy.until);
      finding->Set("busy_ms", arg::Ms(busy.length()))
          .Set("first_frame", arg::Frame(busy.since.number))
          .Set("polls", arg::Count(busy.reads, "read"))
          .Set("emulated", arg::Flag(emulated));
      AddRelated(*finding, busy.since.number);
    } else if ((slave.blank || slave.zeros) && slave.last.seen() && identity_known) {
      finding = Found(kBlank, id, slave.last);
      finding->Set("words", arg::Count(image.KnownWords(), "word"))
          .Set("first_frame", arg::Frame(slave.first.number))
          .Set("blank_word", arg::Hex(slave.zeros ? 0U : 0xFFFFU))
          .Set("zeros", arg::Flag(slave.zeros));
      AddRelated(*finding, slave.first.number);
      if (slave.errors != 0) finding->Set("error_frame", arg::Frame(slave.error.number));
    } else if (slave.blank && slave.last.seen() && slave.errors == 0) {
      NotEvaluable(id, ReasonCode::kNotRead, kIdentityWords);
      return;
    } else if (slave.errors != 0 && !emulated) {
      finding = Found(kNotLoaded, id, slave.error);
    } else if (slave.last.seen()) {
      finding = FindInContents(id, slave, esc::ParseSii(image), image, emulated);
      if (!finding) finding = FindStuck(id, slave, image, emulated);
    }
    if (!finding) return;
    if (slave.errors != 0) SetErrors(*finding, slave.errors);
    const auto dl_status = state.registers.Value<std::uint8_t>(esc::kDlStatus, Certainty::kObserved);
    finding->Set("not_operational", arg::Flag(dl_status && (*dl_status & 1U) == 0));
    const model::SlaveModel& model = context().slave(id);
    const bool exchanged = model.inputs.exchanged + model.outputs.exchanged > 0;
    const bool works = slave.reached.seen() || exchanged;
    if (slave.reached.seen()) {
      finding->Add(kStateReached,
                   {{"state", arg::State(slave.state)}, {"reached_frame", arg::Frame(slave.reached.number)}});
    }
    const FindingIndex index = Report(0, works ? Severity::kInfo : Severity::kError, std::move(*finding));
    if (!works) NameConsequences(id, index);
  }

  std::optional<Finding> FindInContents(SlaveId id, const Slave& slave, const esc::SiiContents& sii,
                                        const esc::SiiImage& image, bool emulated) const {
    const esc::SiiHeader& header = sii.header;
    if (header.checksum_state == esc::SiiChecksumState::kWrong && !emulated && !slave.written) {
      const auto bytes = image.Bytes(0, kConfigurationWords - 1);
      Finding finding = Found(kChecksum, id, slave.last);
      finding.Set("checksum", arg::Hex(header.checksum.value_or(0) & 0xFFU, 2))
          .Set("checksum_needed", arg::Hex(bytes ? esc::SiiChecksum(*bytes) : 0, 2));
      return finding;
    }
    const bool no_words = header.standard_receive && header.standard_send && header.standard_receive->size == 0 &&
                          header.standard_send->size == 0;
    if (no_words && header.protocols.value_or(0) != 0) {
      Finding finding = Found(kNoMailboxWords, id, slave.last);
      finding.Set("protocols", arg::Text(esc::SiiProtocolNames(*header.protocols)));
      for (std::size_t n = 0; n < sii.sync_managers.size(); ++n) {
        constexpr std::uint8_t kMailboxOut = 1;  // type
        const esc::SiiSyncManager& entry = sii.sync_managers[n];
        if (entry.type != kMailboxOut || entry.length == 0) continue;
        finding.Set("sync_manager", arg::Number(static_cast<std::int64_t>(n)))
            .Set("bytes", arg::Count(entry.length, "byte"));
        break;
      }
      return finding;
    }
    if (sii.chain_end != esc::SiiChainEnd::kBeyondImage) return std::nullopt;
    Finding finding = Found(kDamaged, id, slave.last);
    finding.Set("word", arg::Hex(sii.chain_end_word));
    return finding;
  }

  std::optional<Finding> FindStuck(SlaveId id, const Slave& slave, const esc::SiiImage& image, bool emulated) const {
    if (!slave.stuck) return std::nullopt;
    const Stuck& stuck = *slave.stuck;
    if (stuck.word && image.KnownWords(*stuck.word, 1) == 1) return std::nullopt;
    Finding finding = Found(kBusyAtWord, id, stuck.busy.until);
    finding.Set("busy_ms", arg::Ms(stuck.busy.length()))
        .Set("command_frame", arg::Frame(stuck.command.number))
        .Set("first_frame", arg::Frame(stuck.busy.since.number))
        .Set("read_until_frame", arg::Frame(slave.last.number))
        .Set("polls", arg::Count(stuck.busy.reads, "read"))
        .Set("emulated", arg::Flag(emulated));
    if (stuck.word) finding.Set("word", arg::Hex(*stuck.word));
    if (slave.longest_ns > 0) finding.Set("usual_ms", arg::Ms(slave.longest_ns));
    AddRelated(finding, stuck.command.number);
    AddRelated(finding, stuck.busy.since.number);
    return finding;
  }

  static void SetErrors(Finding& finding, std::uint16_t bits) {
    std::vector<Value> errors;
    if ((bits & track::kEepromChecksumError) != 0) errors.push_back(arg::Of(kChecksumError));
    if ((bits & track::kEepromNotLoaded) != 0) errors.push_back(arg::Of(kConfigurationMissing));
    finding.Set("errors", arg::List(std::move(errors)));
  }

  /// What the slave refuses, never reaches, and what the master set by such an EEPROM.
  void NameConsequences(SlaveId id, FindingIndex cause) const {
    if (cause == kNoFinding) return;
    for (Finding& finding : context().store.findings()) {
      const bool follows = std::find(std::begin(kAfter), std::end(kAfter), finding.rule) != std::end(kAfter);
      if (follows && finding.slave == id && finding.caused_by == kNoFinding) finding.caused_by = cause;
    }
  }

  std::map<SlaveId, Slave> slaves_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<EepromInvalid>};

}  // namespace
}  // namespace ecaudit::eeprom_invalid
