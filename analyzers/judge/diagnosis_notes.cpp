#include "analyzers/judge/diagnosis_notes.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "analyzers/judge/shared_notes.h"
#include "analyzers/model/slave_model.h"

namespace ecaudit {
namespace {

constexpr std::size_t kMostNotes = 3;
constexpr std::string_view kEmergency = "emcy-received";
/// What a slave can have a reason of its own for.
constexpr std::array<std::string_view, 4> kRules{"al-refused", "al-unexpected-change", "al-error-standing",
                                                 "drive-fault"};

bool IsEvent(const Finding& finding) {
  return std::ranges::find(kRules, finding.rule) != kRules.end();
}

/// Another event of the slave came after the finding and before the message was read: the message may be about that.
bool IsLatest(const FindingStore& store, const Finding& finding, FrameNo read) {
  return std::ranges::none_of(store.findings(), [&](const Finding& other) {
    return IsEvent(other) && other.slave == finding.slave && other.rule == finding.rule &&
           other.first.number > finding.last.number && other.first.number <= read;
  });
}

bool IsAbout(const FindingStore& store, const Finding& finding, const model::DiagnosisEntry& entry) {
  if (finding.rule == kEmergency) {
    const Value* code = finding.arguments.Find("error_code");
    const auto stated = entry.message.emergency_code();
    return code != nullptr && stated && code->number == *stated;
  }
  return IsEvent(finding) && entry.message.type() != static_cast<std::uint8_t>(mailbox::DiagnosisType::kInfo) &&
         entry.read.number > finding.first.number && IsLatest(store, finding, entry.read.number);
}

}  // namespace

void AddDiagnosisNotes(const RuleContext& context, FindingStore& store) {
  for (Finding& finding : store.findings()) {
    if (finding.slave == kNoSlave || (finding.rule != kEmergency && !IsEvent(finding))) continue;
    const mailbox::DiagnosisTexts* const texts = context.slave(finding.slave).profile->diagnosis_texts();
    const auto& messages = context.slave(finding.slave).diagnosis.messages();
    std::size_t added = 0;
    // The newest first.
    for (auto entry = messages.rbegin(); entry != messages.rend() && added < kMostNotes; ++entry) {
      const mailbox::DiagnosisMessage& message = entry->message;
      if (message.too_short || message.empty() || !IsAbout(store, finding, *entry)) continue;
      Arguments arguments{{"object", arg::Object(mailbox::kDiagnosisHistory, entry->subindex)},
                          {"read_frame", arg::Frame(entry->read.number)},
                          {"diagnosis", arg::Text(mailbox::DiagnosisText(message, texts))}};
      if (entry->stored_after != 0) {
        arguments.Set("absent_frame", arg::Frame(entry->stored_after));
      } else if (finding.rule != kEmergency) {
        arguments.Set("may_be_older", arg::Flag());
      }
      finding.Add(kSlaveStates, std::move(arguments));
      ++added;
    }
  }
}

}  // namespace ecaudit
