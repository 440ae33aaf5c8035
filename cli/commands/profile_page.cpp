#include "cli/commands/profile_page.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/report/layout.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::cli {
namespace {

using device::Access;
using device::Basis;
using report::OneLine;
using report::Style;
using Json = nlohmann::ordered_json;

std::string_view Name(Basis basis) {
  switch (basis) {
    case Basis::kPrinted:
      return "printed";
    case Basis::kStandard:
      return "standard";
    case Basis::kInferred:
      return "inferred";
  }
  return "inferred";
}

std::string_view Name(Access access) {
  switch (access) {
    case Access::kUnknown:
      return "unknown";
    case Access::kNone:
      return "none";
    case Access::kRead:
      return "read";
    case Access::kWrite:
      return "write";
    case Access::kReadWrite:
      return "read-write";
  }
  return "unknown";
}

std::string Pair(esc::AlState from, esc::AlState to) {
  return std::string(esc::StateName(from)) + " -> " + std::string(esc::StateName(to));
}

std::string Codes(const std::vector<std::uint16_t>& codes) {
  std::string text;
  for (const std::uint16_t code : codes) text += (text.empty() ? "" : ", ") + Hex(code);
  return text;
}

/// Left-justified to `width` columns, and not broken when the line is wrapped.
std::string Padded(std::string_view text, std::size_t width) {
  std::string out(text);
  const std::size_t columns = report::Columns(out);
  out.append(columns < width ? width - columns : 1, ' ');
  std::replace(out.begin(), out.end(), ' ', report::kHardSpace);
  return out;
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
    std::string line = Padded(Pair(t.from, t.to), 18) + Padded(t.allowed ? "allowed" : "refused", 9);
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
            (al.status_codes_complete ? " (the manual supports no others)" : " (others are possible)"));
  for (const device::AlStatusCode& code : al.status_codes) {
    std::string line = Padded(Hex(code.code), 8) + OneLine(code.name);
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

void AppendRegisters(const std::vector<device::RegisterRight>& registers, report::TextBuilder& text) {
  if (registers.empty()) return;
  text.Line();
  text.Line(text.Styled("Registers", Style::kBold) + " (access of the master / of the drive)");
  for (const device::RegisterRight& r : registers) {
    std::string line = Padded(Hex(r.address) + "+" + std::to_string(r.length), 13) +
                       Padded(std::string(Name(r.ecat)) + " / " + std::string(Name(r.drive)), 25) + OneLine(r.name);
    if (!r.note.empty()) line += "; " + OneLine(r.note);
    text.Paragraph(line + " [" + OneLine(r.source) + "]", 2, 40);
  }
}

template <typename T>
Json OrNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json OrNull(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json States(const std::vector<esc::AlState>& states) {
  Json json = Json::array();
  for (const esc::AlState state : states) json.push_back(esc::StateName(state));
  return json;
}

Json TransitionJson(const device::AlTransition& t) {
  Json json;
  json["from"] = esc::StateName(t.from);
  json["to"] = esc::StateName(t.to);
  json["allowed"] = t.allowed;
  json["performed"] = t.performed;
  json["basis"] = Name(t.basis);
  json["action"] = OrNull(t.action);
  json["requirement"] = OrNull(t.requirement);
  json["refusal_codes"] = t.refusal_codes;
  json["tolerated_codes"] = t.tolerated_codes;
  json["note"] = OrNull(t.note);
  json["source"] = OrNull(t.source);
  return json;
}

Json StatusCodeJson(const device::AlStatusCode& code) {
  Json json;
  json["code"] = code.code;
  json["name"] = code.name;
  json["any_transition"] = code.any_transition;
  json["transitions"] = Json::array();
  for (const auto& [from, to] : code.transitions) {
    Json pair;
    pair["from"] = esc::StateName(from);
    pair["to"] = esc::StateName(to);
    json["transitions"].push_back(std::move(pair));
  }
  json["states"] = States(code.states);
  json["exclusive"] = code.exclusive;
  json["note"] = OrNull(code.note);
  json["source"] = OrNull(code.source);
  return json;
}

Json RegisterJson(const device::RegisterRight& r) {
  Json json;
  json["address"] = r.address;
  json["length"] = r.length;
  json["name"] = r.name;
  json["master"] = Name(r.ecat);
  json["drive"] = Name(r.drive);
  json["note"] = OrNull(r.note);
  json["source"] = OrNull(r.source);
  return json;
}

Json MatchJson(const device::IdentityMatch& match) {
  Json json;
  json["vendor_id"] = OrNull(match.vendor_id);
  json["product_codes"] = match.product_codes;
  json["revision_min"] = OrNull(match.revision_min);
  json["revision_max"] = OrNull(match.revision_max);
  json["models"] = match.models;
  json["note"] = OrNull(match.note);
  json["source"] = OrNull(match.source);
  return json;
}

}  // namespace

std::string ProfileText(const device::DeviceDescription& profile, bool color) {
  report::TextBuilder text(color);
  text.Line(text.Styled(profile.id, Style::kBold) + ": " + OneLine(profile.title));
  text.Line();
  text.Field("manual", OneLine(profile.document) + (profile.edition.empty() ? "" : ", " + OneLine(profile.edition)), 0);
  text.Field("identity", IdentityText(profile.match), 0);
  text.Field("extends", OneLine(profile.extends), 0);
  text.Field("note", OneLine(profile.note), 0);
  text.Field("AL", OneLine(profile.al.note), 0);
  AppendTransitions(profile.al, text);
  AppendStatusCodes(profile.al, text);
  AppendRegisters(profile.registers, text);
  return text.Take();
}

std::string ProfileJson(const device::DeviceDescription& profile) {
  Json json;
  json["schema"] = "ecaudit.profile-page/1";
  json["id"] = profile.id;
  json["title"] = profile.title;
  json["edition"] = OrNull(profile.edition);
  json["document"] = OrNull(profile.document);
  json["extends"] = OrNull(profile.extends);
  json["note"] = OrNull(profile.note);
  json["match"] = MatchJson(profile.match);
  json["al"]["note"] = OrNull(profile.al.note);
  json["al"]["status_codes_complete"] = profile.al.status_codes_complete;
  json["al"]["transitions"] = Json::array();
  for (const auto& t : profile.al.transitions) json["al"]["transitions"].push_back(TransitionJson(t));
  json["al"]["status_codes"] = Json::array();
  for (const auto& code : profile.al.status_codes) json["al"]["status_codes"].push_back(StatusCodeJson(code));
  json["registers"] = Json::array();
  for (const auto& r : profile.registers) json["registers"].push_back(RegisterJson(r));
  return json.dump(2) + "\n";
}

}  // namespace ecaudit::cli
