#include "cli/report/esi_text.h"

#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "decoder/base/names.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::report {
namespace {

constexpr std::size_t kDemandIndent = 2, kStatusColumn = 10;

std::string_view StatusText(EsiDemand::Status status) {
  static constexpr Named<EsiDemand::Status> kNames[] = {
      {EsiDemand::Status::kMet, "done"},        {EsiDemand::Status::kMissing, "missing"},
      {EsiDemand::Status::kDiffers, "differs"}, {EsiDemand::Status::kNotDue, "not due"},
      {EsiDemand::Status::kUnknown, "unknown"},
  };
  static_assert(NamesAll(kNames, EsiDemand::Status::kUnknown));
  return NameIn(kNames, status);
}

/// Equal for demands that differ in their frame only.
std::string KeyOf(const EsiDemand& demand) {
  std::string key{static_cast<char>(demand.kind), static_cast<char>(demand.status), static_cast<char>(demand.before)};
  for (const std::string* text : {&demand.what, &demand.wanted, &demand.seen}) (key += *text) += '\0';
  return key;
}

/// What several slaves have alike, in the order of the first of them.
template <typename T>
class AlikeRows {
 public:
  struct Row {
    const T* first = nullptr;
    std::set<unsigned> positions;
  };
  void Add(std::string key, const T& item, SlavePos position) {
    const std::size_t row = index_.try_emplace(std::move(key), rows_.size()).first->second;
    if (row == rows_.size()) rows_.push_back({&item, {}});
    rows_[row].positions.insert(position);
  }
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }

 private:
  std::vector<Row> rows_;
  std::unordered_map<std::string, std::size_t> index_;
};

}  // namespace

std::string DemandText(const EsiDemand& demand) {
  std::string text = OneLine(demand.what);
  if (demand.kind == EsiDemand::Kind::kTimeout) {
    text += " " + OneLine(demand.wanted);
  } else if (!demand.wanted.empty()) {
    text += " = " + OneLine(demand.wanted);
  }
  if (demand.unmet()) {
    text += demand.seen.empty() ? "; the capture does not show it" : "; the capture shows " + OneLine(demand.seen);
  }
  if (demand.frame != 0) text += " (#" + std::to_string(demand.frame) + ")";
  return text;
}

void WriteEsiDemands(std::span<const SlaveSummary> slaves, const SlaveNames& names, TextBuilder& text) {
  AlikeRows<SlaveSummary> lists;
  for (const SlaveSummary& slave : slaves) {
    if (slave.esi_demands.empty()) continue;
    std::string key;
    for (const EsiDemand& demand : slave.esi_demands) key += KeyOf(demand);
    lists.Add(std::move(key), slave, slave.position);
  }
  for (const auto& [first, positions] : lists.rows()) {
    text.Line();
    text.Paragraph(text.Styled("Required by the ESI of " + names.Of(positions), Style::kBold) +
                       (positions.size() > 1 ? " (frames of " + names.Of(first->position) + ")" : std::string()),
                   0);
    for (const EsiDemand& demand : first->esi_demands) {
      text.Paragraph(Padded(StatusText(demand.status), kStatusColumn) + DemandText(demand), kDemandIndent,
                     kDemandIndent + kStatusColumn);
    }
  }
}

std::vector<std::string> UnmetEsiDemands(std::span<const SlaveSummary> slaves, const SlaveNames& names) {
  AlikeRows<EsiDemand> unmet;
  for (const SlaveSummary& slave : slaves) {
    for (const EsiDemand& demand : slave.esi_demands) {
      if (demand.unmet()) unmet.Add(KeyOf(demand), demand, slave.position);
    }
  }
  std::vector<std::string> lines;
  lines.reserve(unmet.rows().size());
  for (const auto& [demand, positions] : unmet.rows()) {
    lines.push_back(names.Of(positions) + ": the ESI requires " + DemandText(*demand));
  }
  return lines;
}

void PutEsiDemands(JsonObject& out, const SlaveSummary& slave) {
  if (slave.esi_demands.empty()) return;
  out.List("esi_demands", slave.esi_demands, [](JsonObject& json, const EsiDemand& demand) {
    json.Put("kind", Name(demand.kind));
    json.Put("status", Name(demand.status));
    json.Put("before", esc::StateName(demand.before));
    json.Put("what", Printable(demand.what));
    json.TextOrNull("wanted", Printable(demand.wanted));
    json.TextOrNull("seen", Printable(demand.seen));
    json.Frame("frame", demand.frame);
  });
}

}  // namespace ecaudit::report
