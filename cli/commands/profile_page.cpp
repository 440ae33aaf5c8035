#include "cli/commands/profile_page.h"

#include <set>
#include <string_view>
#include <vector>

#include "cli/commands/profile_details.h"
#include "cli/commands/profile_process.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"
#include "decoder/device/source_documents.h"
#include "decoder/esc/al.h"

namespace ecaudit::cli {
namespace {

using device::Access;
using device::Basis;
using report::OneLine;
using report::Style;

std::string_view Name(Basis basis) {
  static constexpr Named<Basis> kNames[] = {
      {Basis::kPrinted, "printed"},
      {Basis::kStandard, "standard"},
      {Basis::kInferred, "inferred"},
  };
  static_assert(NamesAll(kNames, Basis::kInferred));
  return NameIn(kNames, basis);
}

std::string_view Name(Access access) {
  static constexpr Named<Access> kNames[] = {
      {Access::kUnknown, "unknown"},      {Access::kNone, "none"}, {Access::kRead, "read"}, {Access::kWrite, "write"},
      {Access::kReadWrite, "read-write"},
  };
  static_assert(NamesAll(kNames, Access::kReadWrite));
  return NameIn(kNames, access);
}

std::string Pair(esc::AlState from, esc::AlState to) {
  return std::string(esc::StateName(from)) + " -> " + std::string(esc::StateName(to));
}

std::string Codes(const std::vector<std::uint16_t>& codes) {
  std::string text;
  for (const std::uint16_t code : codes) text += (text.empty() ? "" : ", ") + Hex(code);
  return text;
}

std::string IdentityText(const device::IdentityMatch& match) {
  std::string text;
  if (match.vendor_id) text = "vendor " + Hex(*match.vendor_id, 8);
  for (const std::uint32_t code : match.product_codes) text += ", product " + Hex(code, 8);
  if (match.revision_min) text += ", revision from " + Hex(*match.revision_min, 8);
  if (match.revision_max) text += ", revision up to " + Hex(*match.revision_max, 8);
  for (const std::string& model : match.models) text += (text.empty() ? "model " : ", model ") + OneLine(model) + "...";
  if (!match.note.empty()) text += (text.empty() ? "" : "; ") + OneLine(match.note);
  return text;
}

void AppendTransitions(const device::AlDescription& al, report::TextBuilder& text) {
  text.Line();
  text.Line(text.Styled("AL transitions", Style::kBold));
  for (const device::AlTransition& t : al.transitions) {
    std::string line = report::Padded(Pair(t.from, t.to), 18) + report::Padded(t.allowed ? "allowed" : "refused", 9);
    std::string about;
    const auto add = [&about](std::string_view part) {
      if (part.empty()) return;
      if (!about.empty()) about += "; ";
      about += OneLine(part);
    };
    add(t.action);
    if (!t.requirement.empty()) add("needs: " + t.requirement);
    if (!t.refusal_codes.empty()) add((t.allowed ? "may be refused with " : "with ") + Codes(t.refusal_codes));
    if (!t.tolerated_codes.empty()) add("also seen: " + Codes(t.tolerated_codes));
    add(t.note);
    line += about + " [" + OneLine(t.source) + ", " + std::string(Name(t.basis)) + "]";
    text.Paragraph(line, 2, 29);
  }
}

void AppendStatusCodes(const device::AlDescription& al, report::TextBuilder& text) {
  if (al.status_codes.empty()) return;
  text.Line();
  text.Line(text.Styled("AL status codes", Style::kBold) +
            (al.status_codes_complete ? " (the manual lists no others)" : " (others are possible)"));
  for (const device::AlStatusCode& code : al.status_codes) {
    std::string line = report::Padded(Hex(code.code), 8) + OneLine(code.name);
    std::string where;
    for (const auto& [from, to] : code.transitions) where += (where.empty() ? "" : ", ") + Pair(from, to);
    for (const esc::AlState state : code.states) {
      where += (where.empty() ? "in " : ", in ") + std::string(esc::StateName(state));
    }
    if (code.any_transition) where = "any transition";
    if (!where.empty()) line += "; " + where;
    if (!code.note.empty()) line += "; " + OneLine(code.note);
    text.Paragraph(line + " [" + OneLine(code.source) + "]", 2, 10);
  }
}

/// The registers that the profile's own manual names; the standard's are on the page of the profile it extends.
void AppendRegisters(const device::DeviceDescription& profile, report::TextBuilder& text) {
  std::vector<const device::RegisterRight*> own;
  for (const device::RegisterRight& r : profile.registers) {
    if (profile.extends.empty() || r.source.starts_with(profile.document)) own.push_back(&r);
  }
  if (own.empty()) return;
  text.Line();
  text.Line(text.Styled("Registers", Style::kBold) + " (access of the master / of the drive)");
  for (const device::RegisterRight* r : own) {
    std::string line = report::Padded(Hex(r->address) + "+" + std::to_string(r->length), 13) +
                       report::Padded(std::string(Name(r->ecat)) + " / " + std::string(Name(r->drive)), 25) +
                       OneLine(r->name);
    if (!r->note.empty()) line += "; " + OneLine(r->note);
    text.Paragraph(line + " [" + OneLine(r->source) + "]", 2, 40);
  }
  if (own.size() < profile.registers.size()) {
    text.Paragraph("and " + std::to_string(profile.registers.size() - own.size()) +
                       " registers of the standard: ecaudit profiles " + OneLine(profile.extends),
                   2);
  }
}

}  // namespace

std::string ProfileText(const device::DeviceDescription& profile, bool full, bool color) {
  report::TextBuilder text(color);
  text.Line(text.Styled(profile.id, Style::kBold) + ": " + OneLine(profile.title));
  text.Line();
  const device::SourceDocument* manual = device::FindSourceDocument(profile.document);
  text.Field("manual", OneLine(profile.document) + (manual == nullptr ? "" : ": " + OneLine(manual->title)), 0);
  text.Field("identity", IdentityText(profile.match), 0);
  text.Field("extends", OneLine(profile.extends), 0);
  text.Field("note", OneLine(profile.note), 0);
  text.Field("AL", OneLine(profile.al.note), 0);
  AppendTransitions(profile.al, text);
  AppendStatusCodes(profile.al, text);
  AppendProcessSections(profile, text);
  AppendDetailSections(profile, full, text);
  AppendRegisters(profile, text);
  return text.Take();
}

std::string ProfileJson(const device::DeviceDescription& profile, const device::ProfileRegistry& families) {
  return report::JsonDocumentText([&](report::JsonObject& out) {
    out.Put("schema", "ecaudit.profile-page/1");
    out.Put("id", profile.id);
    out.Put("title", profile.title);
    out.Array("files", [&](report::JsonArray& files) {
      std::set<const device::DeviceDescription*> written;
      for (const device::DeviceDescription* at = &profile; at != nullptr && written.insert(at).second;) {
        const device::DeviceDescription* builtin = device::BuiltinProfile(at->id);
        files.AddDocument(at == builtin ? device::BuiltinProfileText(at->id) : families.Text(at->id));
        // A family may extend the built-in one whose place it takes.
        at = at->extends == at->id ? builtin : families.Find(at->extends);
      }
    });
  });
}

}  // namespace ecaudit::cli
