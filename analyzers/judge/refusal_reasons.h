/// Why a slave refused a state or left it: what the capture shows of the settings that its AL status code is about.
///
/// One table (refusal/code_table.h) has a row for each code: the checks that can show its reason, one question each
/// (refusal/checks.h). What is wrong becomes a note of the finding (refusal/reasons.h). What is right is one note for
/// all of it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/judge/refusal/reasons.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/result/finding.h"
#include "analyzers/result/setting_range.h"
#include "decoder/base/ids.h"

namespace ecaudit {

/// The code of a refusal, or of a state that a slave left by itself.
struct RefusalCase {
  SlaveId slave = kNoSlave;
  std::uint16_t code = 0;      ///< AL status code (0x0134)
  std::uint8_t requested = 0;  ///< 0: the slave left its state by itself
  FrameNo request = 0;         ///< the last frame with the request; 0: none
  FrameNo shown = 0;           ///< the frame that shows the error
  FrameNo held_since = 0;      ///< without request: the first frame that showed the state before
  std::optional<TimeNs> time;  ///< without request: of the frame that shows the error
};

struct RefusalReasons {
  const Word* reason = nullptr;  ///< the likeliest of them, for the title; null: nothing is wrong
  std::uint8_t slot = 0;         ///< of a modular device that it is about; 0: none
  std::optional<Value> value;    ///< of the setting that is the reason
  bool inferred = false;         ///< `reason` is only a possible one: the slave may have refused for another
  std::vector<Note> notes;       ///< what is wrong, and what is right
};

/// What the capture shows of the settings that the code is about, for the finding about it.
[[nodiscard]] RefusalReasons FindRefusalReasons(const RuleContext& context, const RefusalCase& refused);
/// Adds them, with {reason} and its {reason_value} for the title and the flags {reason_inferred} and {checked}
/// (settings of the code are right). A finding whose reason is inferred is inferred itself.
void AddTo(Finding& finding, const RefusalReasons& reasons);

/// The registers and objects that a refusal of the state with this code (0: not read) is about: those that the checks
/// of its row look at. A code without a row is about what a slave checks at the request.
[[nodiscard]] std::vector<SettingRange> SettingsOfRefusal(std::uint16_t code, std::uint8_t requested);

/// The codes that have a row, for documentation and tests.
[[nodiscard]] std::vector<std::uint16_t> CodesWithReasons();

}  // namespace ecaudit
