/// How far a slave or an axis got: a ladder of rungs, from below. Plain data.
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/result/argument.h"
#include "analyzers/result/finding.h"
#include "decoder/base/ids.h"

namespace ecaudit {

enum class RungStatus : std::uint8_t {
  kReached,
  kLost,        ///< reached, and lost again although the master did not ask for that
  kNotReached,  ///< the master asked for it
  kNotAsked,    ///< nothing in the capture asks for it: an idle axis is healthy
  kUnknown,     ///< `why` shows what is missing
};

/// "reached", "lost", "not-reached", "not-asked", "unknown": public interface.
[[nodiscard]] constexpr std::string_view Name(RungStatus status) {
  switch (status) {
    case RungStatus::kReached:
      return "reached";
    case RungStatus::kLost:
      return "lost";
    case RungStatus::kNotReached:
      return "not-reached";
    case RungStatus::kNotAsked:
      return "not-asked";
    case RungStatus::kUnknown:
      break;
  }
  return "unknown";
}

struct Rung {
  const Word* rung = nullptr;  ///< never null
  RungStatus status = RungStatus::kUnknown;
  FrameRef since;  ///< first frame that shows it reached; not seen(): it is not, or no frame shows when
  FrameRef until;  ///< the frame that shows it gone, asked for or not
  const Word* why =
      nullptr;          ///< what holds it, or what is missing to know it; null where a finding reports it, or nothing
  FrameRef held_since;  ///< where what holds it began
  FindingIndex held_by = kNoFinding;
};

struct Ladder {
  std::vector<Rung> rungs;  ///< from below

  [[nodiscard]] bool empty() const { return rungs.empty(); }
  [[nodiscard]] const Rung* Find(std::string_view code) const {
    for (const Rung& rung : rungs) {
      if (rung.rung->code == code) return &rung;
    }
    return nullptr;
  }
  /// The last rung that is reached; null: none is.
  [[nodiscard]] const Rung* Highest() const {
    const Rung* highest = nullptr;
    for (const Rung& rung : rungs) {
      if (rung.status == RungStatus::kReached && !rung.until.seen()) highest = &rung;
    }
    return highest;
  }
  /// The first rung that was wanted and is not there; null: each that was wanted is.
  [[nodiscard]] const Rung* Failed() const {
    for (const Rung& rung : rungs) {
      if (rung.status == RungStatus::kNotReached || rung.status == RungStatus::kLost) return &rung;
    }
    return nullptr;
  }
};

struct AxisLadder {
  std::uint8_t axis = 0;  ///< 0: the first
  Ladder ladder;
};

}  // namespace ecaudit
