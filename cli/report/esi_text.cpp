#include "cli/report/esi_text.h"

#include <string_view>

#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::report {
namespace {

constexpr std::size_t kDemandIndent = 2, kStatusColumn = 10;

std::string_view StatusText(EsiDemand::Status status) {
  switch (status) {
    case EsiDemand::Status::kMet:
      return "done";
    case EsiDemand::Status::kMissing:
      return "missing";
    case EsiDemand::Status::kDiffers:
      return "differs";
    case EsiDemand::Status::kNotDue:
      return "not due";
    case EsiDemand::Status::kUnknown:
      break;
  }
  return "unknown";
}

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

void WriteEsiDemands(const SlaveSummary& slave, const SlaveNames& names, TextBuilder& text) {
  if (slave.esi_demands.empty()) return;
  text.Line();
  text.Line(text.Styled("Required by the ESI of " + names.Of(slave.position), Style::kBold));
  for (const EsiDemand& demand : slave.esi_demands) {
    text.Paragraph(Padded(StatusText(demand.status), kStatusColumn) + DemandText(demand), kDemandIndent,
                   kDemandIndent + kStatusColumn);
  }
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
