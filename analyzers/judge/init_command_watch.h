/// in: SDO transfers and answered state requests.  out: which writes that the ESI of a slave asks for did not come.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/model/model_events.h"
#include "analyzers/result/argument.h"
#include "decoder/device/device_description.h"
#include "decoder/mailbox/events.h"

namespace ecaudit {

/// Evaluates only slaves of which the capture shows how they reached PREOP: what came before is not in it.
class InitCommandWatch {
 public:
  void On(const mailbox::SdoTransfer& transfer) {
    const auto run = written_.find(transfer.slave);
    if (run == written_.end() || transfer.service != mailbox::SdoService::kDownload || !transfer.has_object ||
        transfer.outcome != mailbox::SdoOutcome::kCompleted || run->second.size() >= kMostObjects) {
      return;
    }
    run->second.insert(Key(transfer.index, transfer.subindex, transfer.complete_access));
  }

  void On(const model::AlAnswered& answer) {
    const auto state = static_cast<esc::AlState>(answer.request.control.state());
    if (answer.outcome == model::AlAnswered::Outcome::kRefused || state != esc::AlState::PREOP) return;
    if (answer.request.from == static_cast<std::uint8_t>(esc::AlState::INIT)) written_[answer.slave] = {};
  }

  /// Objects and transitions that its ESI asks for and the capture does not show, bounded.
  struct Missing {
    std::vector<Value> commands;  ///< "1C12h:1 (PS)"
    std::size_t more = 0;         ///< that are not named
  };
  [[nodiscard]] Missing MissingBefore(SlaveId slave, const device::DeviceDescription& device,
                                      const model::AlRequestRecord& request) const {
    Missing missing;
    const auto run = written_.find(slave);
    if (!device.esi || run == written_.end()) return missing;
    const std::vector<std::string_view> due = DueBefore(request);
    for (const device::EsiInitCommand& command : device.esi->init_commands) {
      const auto is_due = [&due](const std::string& transition) {
        return std::ranges::find(due, transition) != due.end();
      };
      const auto transition = std::ranges::find_if(command.transitions, is_due);
      if (transition == command.transitions.end()) continue;
      const bool whole =
          run->second.contains(Key(command.index, 0, true)) || run->second.contains(Key(command.index, 1, true));
      if (whole || run->second.contains(Key(command.index, command.subindex, false))) continue;
      if (missing.commands.size() == kMostNamed) {
        ++missing.more;
      } else {
        missing.commands.push_back(arg::Object(command.index, command.subindex, "(" + *transition + ")"));
      }
    }
    return missing;
  }

 private:
  static constexpr std::size_t kMostObjects = 4096;
  static constexpr std::size_t kMostNamed = 4;

  [[nodiscard]] static std::uint32_t Key(std::uint16_t index, std::uint8_t subindex, bool complete_access) {
    return static_cast<std::uint32_t>(index) << 8U | subindex | (complete_access ? 1U << 24U : 0U);
  }
  /// The transitions that a slave has completed, or is in, when it refuses the request.
  [[nodiscard]] static std::vector<std::string_view> DueBefore(const model::AlRequestRecord& request) {
    const auto from = static_cast<esc::AlState>(request.from);
    const auto to = static_cast<esc::AlState>(request.control.state());
    if (from == esc::AlState::PREOP && to == esc::AlState::SAFEOP) return {"IP", "PS"};
    if (from == esc::AlState::SAFEOP && to == esc::AlState::OP) return {"IP", "PS", "SO"};
    return {};
  }

  std::map<SlaveId, std::set<std::uint32_t>> written_;  ///< since PREOP
};

}  // namespace ecaudit
