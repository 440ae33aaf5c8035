#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/esc/sii.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::eeprom_written {
namespace {

constexpr RuleInfo kInfo{.id = "eeprom-written",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .subject = Subject::kSlave,
                         .title = "EEPROM words of a slave were written",
                         .needs = "the EEPROM interface 0x0500 to 0x050F of the slave",
                         .source = "ETG1000.4, slave information interface; ETG2010, configuration area",
                         .doc = R"(
## What it checks
Write commands to the EEPROM of a slave: which words, what they mean, old and new value, whether the slave confirmed
them, and whether the checksum of the configuration (low byte of word 7, over words 0 to 6) fits afterwards. One
finding a slave.

## Why it matters
What is written there outlives the capture: station alias, identity, mailboxes, the device's configuration. A slave
whose checksum does not fit loads nothing of it at the next power-on: no alias, and often no application.

## How it is decided
An error where words 0 to 7 were among those written and the checksum does not fit afterwards, and where a write
command ended with an error and the word was not written later; everything else is an info: somebody meant to do it.
Words 0 to 7 have to be known, read or written in the capture, to judge the checksum; where they are not, that is said
and nothing else; likewise where a frame of the capture is lost or missing. Word 7 as 0x88A4 switches the check off.
Commands that failed and were repeated with success only count. Read commands that fail write nothing and are no matter
of this rule.

## Example
samples/captures/eeprom-checksum.pcapng

## What to do
Where an alias was meant, write word 7 as well: CRC-8 with polynomial 0x07 and start value 0xFF over the first 14 bytes.
Correct it before the next power-on. A missing acknowledge (0x0502 bit 13) is repeated after some milliseconds; a write
without enable (bit 14) needs bit 0 of 0x0502 in the same access as the command.
)"};

constexpr std::uint32_t kConfigurationWords = 8;
constexpr std::size_t kShown = 8;
constexpr std::size_t kMaxWords = 256;
constexpr std::size_t kMaxValues = 4;
constexpr std::uint16_t kCommandErrors = track::kEepromNoAcknowledge | track::kEepromWriteEnable;

constexpr const char* kMayMissWrites = "frames are lost or missing: one of them may have written the checksum";

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
    Word* word = Find(slave, e.address);
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
    Word* word = Find(slave, *e.address);
    if (word == nullptr) return;
    word->failed = e.bits;
    if (!word->begun) word->before = context().network().state(e.slave).sii.image().Word(*e.address);
    word->begun = true;
  }

  void Finish() override {
    for (const auto& [id, slave] : slaves_) Tell(id, slave);
    (void)NotEvaluableWithoutReturns();
  }

 private:
  struct Word {
    std::optional<std::uint16_t> before;
    std::vector<std::uint16_t> values;  ///< as written, one after the other
    std::uint16_t failed = 0;           ///< error bits of the last command, where it was not repeated with success
    bool begun = false;
    bool confirmed = false;
  };
  struct Slave {
    FrameRef first, last;
    std::uint64_t writes = 0;
    std::uint64_t errors = 0;
    std::map<std::uint32_t, Word> words;
  };

  Slave& Of(SlaveId id, const FrameRef& frame) {
    Slave& slave = slaves_[id];
    if (!slave.first.seen()) slave.first = frame;
    slave.last = frame;
    return slave;
  }

  static Word* Find(Slave& slave, std::uint32_t address) {
    const auto found = slave.words.find(address);
    if (found != slave.words.end()) return &found->second;
    return slave.words.size() < kMaxWords ? &slave.words[address] : nullptr;
  }

  static std::string ErrorText(std::uint16_t bits) {
    if ((bits & track::kEepromWriteEnable) != 0) return "write without enable";
    return "no acknowledge or invalid command";
  }

  static std::string WordText(std::uint32_t address, const Word& word, const esc::SiiImage& image) {
    const std::string meaning = esc::SiiWordName(image, address);
    std::string text = "word " + Hex(address, 2) + (meaning.empty() ? "" : " (" + meaning + ")");
    if (word.before) text += " from " + Hex(*word.before);
    if (word.values.empty()) text += " to a value not in the capture";
    for (std::size_t i = 0; i < word.values.size(); ++i) {
      text += (i == 0 ? " to " : ", then to ") + Hex(word.values[i]);
    }
    if (word.failed != 0) {
      text += ", which failed: " + ErrorText(word.failed);
    } else if (!word.confirmed) {
      text += ", not seen to end";
    }
    return text;
  }

  /// True when a word may have been written, or have got another value, that the capture does not show.
  [[nodiscard]] bool MayMissWrites() const { return LosesAny(context().pairing()) || MissesAny(context().pairing()); }

  void Tell(SlaveId id, const Slave& slave) {
    const esc::SiiImage& image = context().network().state(id).sii.image();
    const esc::SiiHeader header = esc::ParseSii(image).header;
    const bool configuration = !slave.words.empty() && slave.words.begin()->first < kConfigurationWords;
    const bool differs = configuration && header.checksum_state == esc::SiiChecksumState::kWrong;
    const bool may_miss = differs && MayMissWrites();
    const bool wrong = differs && !may_miss;
    const auto failed = static_cast<std::uint64_t>(
        std::count_if(slave.words.begin(), slave.words.end(), [](const auto& w) { return w.second.failed != 0; }));
    Finding finding;
    finding.slave = id;
    finding.first = slave.first;
    finding.last = slave.last;
    finding.count = std::max<std::uint64_t>(slave.writes, 1);
    finding.title = "EEPROM written: ";
    if (slave.words.size() > 2) {
      finding.title += Count(slave.words.size(), "word");
    } else {
      for (const auto& [address, word] : slave.words) {
        const std::string meaning = esc::SiiWordName(image, address);
        finding.title += (address == slave.words.begin()->first ? "" : " and ") +
                         (meaning.empty() ? "word " + Hex(address, 2) : meaning);
      }
    }
    if (failed > 0) finding.title += ", " + std::to_string(failed) + " without success";
    if (wrong) finding.title += ", and the checksum does not fit afterwards";
    finding.message = "The master writes ";
    std::size_t shown = 0;
    for (const auto& [address, word] : slave.words) {
      if (shown++ == kShown) break;
      finding.message += (shown > 1 ? "; " : "") + WordText(address, word, image);
    }
    if (slave.words.size() > kShown) {
      finding.message += "; and " + std::to_string(slave.words.size() - kShown) + " more";
    }
    finding.message +=
        " (frames " + std::to_string(slave.first.number) + " to " + std::to_string(slave.last.number) + "). ";
    if (slave.errors > 0) {
      finding.message += Count(slave.errors, "write command") + " ended with an error in 0x0502" +
                         (failed == 0 ? " and what they were to write was written later. " : ". ");
    }
    if (may_miss) {
      NotEvaluable(id, kMayMissWrites, finding.last.number);
      finding.message += "Whether the checksum fits afterwards is not known: the capture may miss a write. ";
    } else if (configuration) {
      TellChecksum(id, header, image, finding);
    }
    finding.message += wrong        ? "Write the right checksum before the next power-on."
                       : failed > 0 ? "Repeat what failed, with the write enabled and after the slave is ready."
                                    : "It stays beyond this capture; where nobody meant it, write the old values.";
    finding.evidence.push_back(Number("words", static_cast<std::int64_t>(slave.words.size())));
    if (!slave.words.empty()) {
      const auto& [address, word] = *slave.words.begin();
      finding.evidence.push_back(HexNumber("word", address));
      if (word.before) finding.evidence.push_back(HexNumber("before", *word.before));
      if (!word.values.empty()) finding.evidence.push_back(HexNumber("value", word.values.back()));
    }
    if (slave.errors > 0) {
      finding.evidence.push_back(Number("command_errors", static_cast<std::int64_t>(slave.errors)));
    }
    Report(0, wrong || failed > 0 ? Severity::kError : Severity::kInfo, std::move(finding));
  }

  void TellChecksum(SlaveId id, const esc::SiiHeader& header, const esc::SiiImage& image, Finding& finding) {
    switch (header.checksum_state) {
      case esc::SiiChecksumState::kUnknown:
        NotEvaluable(id, "EEPROM words 0 to 7 are not all in the capture, so whether the checksum fits is not known",
                     finding.last.number);
        finding.message +=
            "Whether the checksum fits afterwards is not known: words 0 to 7 are not all in the capture. ";
        return;
      case esc::SiiChecksumState::kDisabled:
        finding.message += "Word 7 is 0x88a4, which switches the check of the checksum off. ";
        return;
      case esc::SiiChecksumState::kRight:
        finding.message += "The checksum in word 7 fits afterwards. ";
        return;
      case esc::SiiChecksumState::kWrong:
        break;
    }
    const auto bytes = image.Bytes(0, kConfigurationWords - 1);
    const std::uint8_t needed = bytes ? esc::SiiChecksum(*bytes) : 0;
    finding.message += "Afterwards words 0 to 6 need the checksum " + Hex(needed, 2) + ", but word 7 is " +
                       Hex(header.checksum.value_or(0)) +
                       ": at the next power-on the slave loads none of its configuration. ";
    finding.evidence.push_back(HexNumber("checksum", header.checksum.value_or(0) & 0xFFU));
    finding.evidence.push_back(HexNumber("checksum_needed", needed));
  }

  std::map<SlaveId, Slave> slaves_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<EepromWritten>};

}  // namespace
}  // namespace ecaudit::eeprom_written
