#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/esc/sii.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::eeprom_written {
namespace {

constexpr FindingKind kWritten{
    .name = "written",
    .title = "EEPROM written: [{targets}][{!targets}{word_count}]",
    .message =
        R"(The master wrote {word_count} of the EEPROM from {frame} to {last_frame}.[ {command_errors:number} write
{command_errors?command|commands} ended with an error in 0x0502, and {command_errors?its word was|their words were} written
later.])",
    .next = "The values stay after power-off. If they are not intended, write the old values.",
    .identity = "word"};
constexpr FindingKind kFailed{
    .name = "write-failed",
    .title = "EEPROM write failed for {failed_words:number} of {word_count}[: {targets}]",
    .message =
        R"(The master wrote {word_count} of the EEPROM from {frame} to {last_frame}. {command_errors:number} write
{command_errors?command|commands} ended with an error in 0x0502, and {failed_words} {failed_words?was|were} not written
later.)",
    .next = "Repeat the failed writes when the slave is ready, with the write enabled (0x0502 bit 0).",
    .identity = "word"};
constexpr FindingKind kChecksumWrong{
    .name = "checksum-wrong",
    .title = "EEPROM written, but its checksum is {checksum} instead of {checksum_needed}",
    .message =
        R"(The master wrote {word_count} of the EEPROM from {frame} to {last_frame}.[ {command_errors:number} write
{command_errors?command|commands} ended with an error in 0x0502[{!failed_words}, and {command_errors?its word was|their words
were} written later][, and {failed_words} {failed_words?was|were} not written later].] Words 0 to 6 now need the checksum
{checksum_needed}, but word 7 is {checksum_word}. At the next power-on the slave loads none of its configuration.)",
    .next = "Write the right checksum before the next power-on.",
    .identity = "word"};
constexpr const FindingKind* kKinds[] = {&kWritten, &kFailed, &kChecksumWrong};

constexpr NoteKind kWordWritten{
    .name = "word",
    .text =
        R"(Word {address}[ was {before} and now has {values}][{!before} was set to {values}][{!values} was written with a
value that is not in the capture].[ This failed: {error}.][{?unconfirmed} The capture does not show the end of the write command.])"};
constexpr NoteKind kMoreWords{.name = "more-words", .text = "{more} {more?was|were} written too."};
constexpr NoteKind kChecksumUnknown{
    .name = "checksum-unknown",
    .text = "Whether the checksum is right is unknown: a part of words 0 to 7 is not in the capture."};
constexpr NoteKind kChecksumMayBeMissed{
    .name = "checksum-write-may-be-missed",
    .text = "Whether the checksum is right is unknown: the capture may miss a write."};
constexpr NoteKind kChecksumOff{.name = "checksum-off",
                                .text = "Word 7 is 0x88a4: this switches the check of the checksum off."};
constexpr NoteKind kChecksumRight{.name = "checksum-right", .text = "The checksum in word 7 is right afterwards."};
constexpr const NoteKind* kNotes[] = {&kWordWritten,         &kMoreWords,   &kChecksumUnknown,
                                      &kChecksumMayBeMissed, &kChecksumOff, &kChecksumRight};

constexpr Word kChecksumWrite{"checksum-write", "a frame that wrote the checksum"};
constexpr Word kConfigurationArea{"eeprom-words-0-to-7", "a part of EEPROM words 0 to 7"};
constexpr Word kWithoutEnable{"write-without-enable", "write without enable"};
constexpr Word kNoAcknowledge{"no-acknowledge", "no acknowledge or invalid command"};

constexpr RuleInfo kInfo{.id = "eeprom-written",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .subject = Subject::kSlave,
                         .title = "EEPROM words of a slave were written",
                         .needs = "the EEPROM interface 0x0500 to 0x050F of the slave",
                         .source = "ETG1000.4, slave information interface; ETG2010, configuration area",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
Write commands to the EEPROM of a slave: which words were written, their meaning, old and new values, and whether the
slave confirmed them. Further, whether the checksum of the configuration (low byte of word 7, over words 0 to 6) is
right afterwards. Each slave has one finding.

## Why it matters
These values stay after power-off: station alias, identity, mailboxes, the configuration of the device. With a wrong
checksum the slave loads none of them at the next power-on: no alias, and often no application.

## How it is decided
It is an error if words 0 to 7 were among those written and the checksum is wrong afterwards. It is an error as well if
a write command ended with an error and the word was not written later. Everything else is an info: the write was
intended.

- Words 0 to 7 must be known, read or written in the capture. If they are not, or if a frame is lost or missing, the
  checksum is not evaluated.
- Word 7 = 0x88A4 switches the check off.
- Commands that failed and were repeated with success are only counted.
- Read commands that fail write nothing and are not evaluated.

## Example
samples/captures/eeprom-checksum.pcapng

## What to do
If an alias was intended, write word 7 as well: CRC-8 with polynomial 0x07 and start value 0xFF over the first 14 bytes.
Correct it before the next power-on. After a missing acknowledge (0x0502 bit 13) repeat the command some milliseconds
later. A write without enable (bit 14) needs bit 0 of 0x0502 in the same access as the command.
)"};

constexpr std::uint32_t kConfigurationWords = 8;
constexpr std::size_t kShown = 8;
constexpr std::size_t kMaxWords = 256;
constexpr std::size_t kMaxValues = 4;
constexpr std::uint16_t kCommandErrors = track::kEepromNoAcknowledge | track::kEepromWriteEnable;

class EepromWritten final : public Rule {
 public:
  EepromWritten() : Rule(kInfo) {
    Subscribe<track::EepromWrite>(&EepromWritten::On);
    Subscribe<track::EepromError>(&EepromWritten::On);
  }

  void On(const track::EepromWrite& e) {
    Slave& slave = Of(e.slave, e.command.seen() ? e.command : e.frame);
    if (e.frame.seen()) slave.last = e.frame;
    ++slave.writes;
    WrittenWord* word = Find(slave, e.address);
    if (word == nullptr) return;
    if (!word->begun) word->before = e.before;
    word->begun = true;
    if (e.word && (word->values.empty() || word->values.back() != *e.word)) {
      if (word->values.size() == kMaxValues) word->values.pop_back();  // the first ones and the last
      word->values.push_back(*e.word);
    }
    word->confirmed = e.confirmed;
    if (e.confirmed) word->failed = 0;
  }

  void On(const track::EepromError& e) {
    if (!e.write || !e.address || (e.bits & kCommandErrors) == 0) return;
    Slave& slave = Of(e.slave, e.command.seen() ? e.command : e.frame);
    slave.last = e.frame;
    ++slave.errors;
    WrittenWord* word = Find(slave, *e.address);
    if (word == nullptr) return;
    word->failed = e.bits;
    if (!word->begun) word->before = context().network().state(e.slave).sii.image().Word(*e.address);
    word->begun = true;
  }

  void Finish() override {
    for (const auto& [id, slave] : slaves_) ReportWrites(id, slave);
    (void)NotEvaluableWithoutReturns();
  }

 private:
  struct WrittenWord {
    std::optional<std::uint16_t> before;
    std::vector<std::uint16_t> values;  ///< as written, one after the other
    std::uint16_t failed = 0;           ///< error bits of the last command, unless it was repeated with success
    bool begun = false;
    bool confirmed = false;
  };
  struct Slave {
    FrameRef first, last;
    std::uint64_t writes = 0;
    std::uint64_t errors = 0;
    std::map<std::uint32_t, WrittenWord> words;
  };

  Slave& Of(SlaveId id, const FrameRef& frame) {
    Slave& slave = slaves_[id];
    if (!slave.first.seen()) slave.first = frame;
    slave.last = frame;
    return slave;
  }

  static WrittenWord* Find(Slave& slave, std::uint32_t address) {
    const auto found = slave.words.find(address);
    if (found != slave.words.end()) return &found->second;
    return slave.words.size() < kMaxWords ? &slave.words[address] : nullptr;
  }

  static const Word& ErrorOf(std::uint16_t bits) {
    return (bits & track::kEepromWriteEnable) != 0 ? kWithoutEnable : kNoAcknowledge;
  }

  static Value AddressOf(std::uint32_t address, const esc::SiiImage& image) {
    return arg::Code(address, esc::SiiWordName(image, address), 2);
  }

  static Arguments Describe(std::uint32_t address, const WrittenWord& word, const esc::SiiImage& image) {
    Arguments arguments{{"address", AddressOf(address, image)}};
    if (word.before) arguments.Set("before", arg::Hex(*word.before));
    std::vector<Value> values;
    for (const std::uint16_t value : word.values) values.push_back(arg::Hex(value));
    if (!values.empty()) arguments.Set("values", arg::List(std::move(values)));
    if (word.failed != 0) {
      arguments.Set("error", arg::Of(ErrorOf(word.failed)));
    } else if (!word.confirmed) {
      arguments.Set("unconfirmed", arg::Flag());
    }
    return arguments;
  }

  /// True if a word may have been written, or may have got another value, and the capture does not show it.
  [[nodiscard]] bool MayMissWrites() const { return LosesAny(context().pairing()) || MissesAny(context().pairing()); }

  void ReportWrites(SlaveId id, const Slave& slave) {
    const esc::SiiImage& image = context().network().state(id).sii.image();
    const esc::SiiHeader header = esc::ParseSii(image).header;
    const bool configuration = !slave.words.empty() && slave.words.begin()->first < kConfigurationWords;
    const bool differs = configuration && header.checksum_state == esc::SiiChecksumState::kWrong;
    const bool may_miss = differs && MayMissWrites();
    const bool wrong = differs && !may_miss;
    const auto failed = static_cast<std::uint64_t>(
        std::ranges::count_if(slave.words, [](const auto& w) { return w.second.failed != 0; }));
    const bool any_failed = failed > 0;
    Finding finding = Found(wrong ? kChecksumWrong : any_failed ? kFailed : kWritten, id, slave.first);
    finding.last = slave.last;
    finding.count = std::max<std::uint64_t>(slave.writes, 1);
    AddWords(finding, slave, image);
    if (slave.errors > 0) finding.Set("command_errors", arg::Count(slave.errors, "write command"));
    if (any_failed) finding.Set("failed_words", arg::Count(failed, "word"));
    if (may_miss) {
      NotEvaluable(id, ReasonCode::kMissesPackets, kChecksumWrite, finding.last.number);
      finding.Add(kChecksumMayBeMissed);
    } else if (configuration) {
      AddChecksum(id, header, image, finding);
    }
    Report(0, wrong || any_failed ? Severity::kError : Severity::kInfo, std::move(finding));
  }

  static void AddWords(Finding& finding, const Slave& slave, const esc::SiiImage& image) {
    constexpr std::size_t kInTitle = 2;
    finding.Set("words", arg::Number(static_cast<std::int64_t>(slave.words.size())))
        .Set("word_count", arg::Count(slave.words.size(), "word"));
    std::vector<Value> targets;
    for (const auto& [address, word] : slave.words) {
      if (finding.notes.size() < kShown) finding.Add(kWordWritten, Describe(address, word, image));
      if (slave.words.size() > kInTitle) continue;
      const std::string name = esc::SiiWordName(image, address);
      targets.push_back(name.empty() ? AddressOf(address, image) : arg::Text(name));
    }
    if (slave.words.size() > kShown) {
      finding.Add(kMoreWords, {{"more", arg::Count(slave.words.size() - kShown, "other word")}});
    }
    if (!targets.empty()) finding.Set("targets", arg::List(std::move(targets)));
    if (slave.words.empty()) return;
    const auto& [address, word] = *slave.words.begin();
    finding.Set("word", arg::Hex(address));
    if (word.before) finding.Set("before", arg::Hex(*word.before));
    if (!word.values.empty()) finding.Set("value", arg::Hex(word.values.back()));
  }

  void AddChecksum(SlaveId id, const esc::SiiHeader& header, const esc::SiiImage& image, Finding& finding) {
    switch (header.checksum_state) {
      case esc::SiiChecksumState::kUnknown:
        NotEvaluable(id, ReasonCode::kNotInCapture, kConfigurationArea, finding.last.number);
        finding.Add(kChecksumUnknown);
        return;
      case esc::SiiChecksumState::kDisabled:
        finding.Add(kChecksumOff);
        return;
      case esc::SiiChecksumState::kRight:
        finding.Add(kChecksumRight);
        return;
      case esc::SiiChecksumState::kWrong:
        break;
    }
    const auto bytes = image.Bytes(0, kConfigurationWords - 1);
    const std::uint16_t checksum = header.checksum.value_or(0);
    finding.Set("checksum", arg::Hex(checksum & 0xFFU, 2))
        .Set("checksum_needed", arg::Hex(bytes ? esc::SiiChecksum(*bytes) : 0, 2))
        .Set("checksum_word", arg::Hex(checksum));
  }

  std::map<SlaveId, Slave> slaves_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<EepromWritten>};

}  // namespace
}  // namespace ecaudit::eeprom_written
