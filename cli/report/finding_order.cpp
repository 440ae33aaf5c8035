#include "cli/report/finding_order.h"

#include <utility>

namespace ecaudit::report {

std::vector<OrderedFinding> OrderForReading(const CaptureReport& capture) {
  std::vector<ReadingNode> nodes;
  for (std::size_t i = 0; i < capture.result.findings.size(); ++i) {
    const Finding& f = capture.result.findings[i];
    nodes.push_back({f.severity, f.first.number, f.caused_by, capture.IsKnown(i), f.aside});
  }
  return ReadingOrder(std::move(nodes));
}

std::vector<OrderedFinding> OrderForReading(const CaptureDigest& capture) {
  std::vector<ReadingNode> nodes;
  for (const FindingDigest& f : capture.findings) {
    nodes.push_back({f.severity, f.frame, f.caused_by, f.known, f.aside});
  }
  return ReadingOrder(std::move(nodes));
}

}  // namespace ecaudit::report
