#include "analyzers/result/reading_order.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace ecaudit {
namespace {

/// A forest of findings; every finding has at most one cause.
class CauseForest {
 public:
  explicit CauseForest(std::vector<ReadingNode> nodes) : findings_(std::move(nodes)) {
    const std::size_t n = findings_.size();
    children_.resize(n);
    worst_.resize(n);
    for (std::size_t i = 0; i < n; ++i) worst_[i] = {findings_[i].severity, findings_[i].aside, findings_[i].frame};
    for (std::size_t i = 0; i < n; ++i) {
      if (findings_[i].left_out) continue;
      const std::size_t cause = findings_[i].caused_by;
      // What is left out is not shown with the others, so its consequence stands for itself.
      if (cause < n && !findings_[cause].left_out && !LeadsTo(cause, i)) {
        children_[cause].push_back(i);
      } else {
        roots_.push_back(i);
      }
    }
  }

  std::vector<ReadingEntry> Ordered() {
    for (const std::size_t root : roots_) Worst(root);
    Sort(roots_);
    std::vector<ReadingEntry> out;
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
    bool aside = false;
    FrameNo frame = 0;

    [[nodiscard]] bool Before(const Weight& other) const {
      return std::tuple(other.severity, aside, frame) < std::tuple(severity, other.aside, other.frame);
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
    std::ranges::sort(indices, [this](std::size_t a, std::size_t b) {
      if (worst_[a].Before(worst_[b])) return true;
      return !worst_[b].Before(worst_[a]) && std::tuple(findings_[a].frame, a) < std::tuple(findings_[b].frame, b);
    });
  }

  void Append(std::size_t i, int depth, std::vector<ReadingEntry>& out) {
    out.push_back({i, depth});
    Sort(children_[i]);
    for (const std::size_t child : children_[i]) Append(child, depth + 1, out);
  }

  std::vector<ReadingNode> findings_;
  std::vector<std::vector<std::size_t>> children_;
  std::vector<Weight> worst_;
  std::vector<std::size_t> roots_;
};

}  // namespace

std::vector<ReadingEntry> ReadingOrder(std::vector<ReadingNode> nodes) {
  return CauseForest(std::move(nodes)).Ordered();
}

}  // namespace ecaudit
