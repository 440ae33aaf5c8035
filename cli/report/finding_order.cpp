#include "cli/report/finding_order.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace ecaudit::report {
namespace {

/// What the order depends on.
struct Node {
  Severity severity = Severity::kInfo;
  FrameNo frame = 0;
  std::size_t caused_by = 0;  ///< beyond the end: none
  bool known = false;
};

/// A forest of findings; every finding has at most one cause.
class CauseForest {
 public:
  explicit CauseForest(std::vector<Node> nodes) : findings_(std::move(nodes)) {
    const std::size_t n = findings_.size();
    children_.resize(n);
    worst_.resize(n);
    for (std::size_t i = 0; i < n; ++i) worst_[i] = {findings_[i].severity, findings_[i].frame};
    for (std::size_t i = 0; i < n; ++i) {
      if (findings_[i].known) continue;
      const std::size_t cause = findings_[i].caused_by;
      // A known cause is not shown with the others, so its consequence stands for itself.
      if (cause < n && !findings_[cause].known && !LeadsTo(cause, i)) {
        children_[cause].push_back(i);
      } else {
        roots_.push_back(i);
      }
    }
  }

  std::vector<OrderedFinding> Ordered() {
    for (const std::size_t root : roots_) Worst(root);
    Sort(roots_);
    std::vector<OrderedFinding> out;
    out.reserve(findings_.size());
    for (const std::size_t root : roots_) Append(root, 0, out);
    return out;
  }

 private:
  /// True when following the causes from `from` arrives at `to`: attaching would close a circle.
  [[nodiscard]] bool LeadsTo(std::size_t from, std::size_t to) const {
    std::size_t at = from;
    for (std::size_t steps = 0; at < findings_.size() && steps <= findings_.size(); ++steps) {
      if (at == to) return true;
      at = findings_[at].caused_by;
    }
    return at < findings_.size();
  }

  /// The worst of a cause and all its consequences, and where that begins: a cause may show later than what it causes.
  struct Weight {
    Severity severity = Severity::kInfo;
    FrameNo frame = 0;

    [[nodiscard]] bool Before(const Weight& other) const {
      return std::tuple(other.severity, frame) < std::tuple(severity, other.frame);
    }
  };

  Weight Worst(std::size_t i) {
    for (const std::size_t child : children_[i]) {
      const Weight weight = Worst(child);
      if (weight.Before(worst_[i])) worst_[i] = weight;
    }
    return worst_[i];
  }

  void Sort(std::vector<std::size_t>& indices) const {
    std::sort(indices.begin(), indices.end(), [this](std::size_t a, std::size_t b) {
      if (worst_[a].Before(worst_[b])) return true;
      return !worst_[b].Before(worst_[a]) && std::tuple(findings_[a].frame, a) < std::tuple(findings_[b].frame, b);
    });
  }

  void Append(std::size_t i, int depth, std::vector<OrderedFinding>& out) {
    out.push_back({i, depth});
    Sort(children_[i]);
    for (const std::size_t child : children_[i]) Append(child, depth + 1, out);
  }

  std::vector<Node> findings_;
  std::vector<std::vector<std::size_t>> children_;
  std::vector<Weight> worst_;
  std::vector<std::size_t> roots_;
};

}  // namespace

std::vector<OrderedFinding> OrderForReading(const CaptureReport& capture) {
  std::vector<Node> nodes;
  for (std::size_t i = 0; i < capture.result.findings.size(); ++i) {
    const Finding& f = capture.result.findings[i];
    nodes.push_back({f.severity, f.first.number, f.caused_by, capture.IsKnown(i)});
  }
  return CauseForest(std::move(nodes)).Ordered();
}

std::vector<OrderedFinding> OrderForReading(const CaptureDigest& capture) {
  std::vector<Node> nodes;
  for (const FindingDigest& f : capture.findings) nodes.push_back({f.severity, f.frame, f.caused_by, f.known});
  return CauseForest(std::move(nodes)).Ordered();
}

}  // namespace ecaudit::report
