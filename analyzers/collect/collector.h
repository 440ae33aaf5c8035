/// What a report shows besides findings: each collector receives events and has a part of the report.
///
/// How to add one: derive from Collector, listen to the bus in the constructor, fill in the report in Summarise(); a
/// line in collectors.cpp makes it.
#pragma once

#include <vector>

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/finding.h"

namespace ecaudit {

class Collector {
 public:
  Collector() = default;
  Collector(const Collector&) = delete;
  Collector& operator=(const Collector&) = delete;
  virtual ~Collector() = default;

  /// @param findings  grow while the capture is read; lives as long as the analysis
  virtual void Follow(const std::vector<Finding>& findings) { static_cast<void>(findings); }
  /// The capture has ended: once, before the rules are asked for what only the whole shows.
  /// @param result  has its slaves, each with its id
  virtual void Summarise(AnalysisResult& result) = 0;
  /// All rules have finished: called once, after Summarise().
  virtual void Conclude() {}
};

}  // namespace ecaudit
