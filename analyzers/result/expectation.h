/// What a start-up has to be like: plain data, from a file that people write or `startup --save` wrote, or from an ENI.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/result/startup_summary.h"

namespace ecaudit::startup {

struct ExpectedStep {
  StartupKey key;
  StartupPhase phase = StartupPhase::kScan;  ///< for texts only: steps are found in whatever phase they happen
  /// Bytes on the wire; unset: any value will do.
  std::optional<std::vector<std::uint8_t>> data;
  /// A number instead of bytes: little endian in however many bytes were written.
  std::optional<std::int64_t> number;
  bool succeeds = false;  ///< the slave has to follow or answer; else what comes of it is open
  std::string name;       ///< what people call it, safe to print
  std::string text;       ///< the value in words; may be empty

  [[nodiscard]] bool any_value() const { return !data && !number; }
};

struct ExpectedSlave {
  SlavePos position = 0;
  std::optional<std::uint32_t> vendor_id, product_code, revision;
  std::string name;
  std::vector<ExpectedStep> steps;
  std::array<std::optional<TimeNs>, kStartupPhases> limits{};  ///< longest durations
};

struct Expectation {
  std::string name;     ///< of the file, for people
  bool strict = false;  ///< steps and slaves that are not listed are wrong
  /// Register writes and SDO transfers are two sequences whose order towards each other is open (an ENI lists them
  /// apart).
  bool separate_mailbox = false;
  std::vector<ExpectedStep> bus;                               ///< sent to all slaves at once
  std::array<std::optional<TimeNs>, kStartupPhases> limits{};  ///< for every slave that has none of its own
  std::vector<ExpectedSlave> slaves;
};

}  // namespace ecaudit::startup
