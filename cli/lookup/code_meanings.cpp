/// AL states and status codes, SDO aborts, mailbox errors, emergencies.
#include <algorithm>
#include <cctype>

#include "analyzers/words/drive_error_codes.h"
#include "cli/lookup/meanings.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/sdo.h"

namespace ecaudit::cli::lookup {
namespace {

using device::AlStatusCode;
using device::DeviceDescription;
using device::EmergencyCode;
using device::EmergencyKind;

std::string Pair(esc::AlState from, esc::AlState to) {
  return std::string(esc::StateName(from)) + " -> " + std::string(esc::StateName(to));
}

void Join(std::string& text, std::string_view part, std::string_view separator) {
  if (part.empty()) return;
  if (!text.empty()) text += separator;
  text += part;
}

/// "Invalid sync manager configuration; may refuse INIT -> PREOP, PREOP -> SAFEOP; in OP"
std::string CodeText(const AlStatusCode& code) {
  std::string text = code.name;
  std::string requests;
  for (const auto& [from, to] : code.transitions) Join(requests, Pair(from, to), ", ");
  if (code.any_transition) requests = "any request";
  if (!requests.empty()) Join(text, (code.exclusive ? "refuses only " : "may refuse ") + requests, "; ");
  std::string states;
  for (const esc::AlState state : code.states) Join(states, esc::StateName(state), ", ");
  if (!states.empty()) Join(text, "may appear by itself in " + states, "; ");
  if (code.resulting_state) {
    Join(text, "the slave is then in " + std::string(esc::StateName(*code.resulting_state)), "; ");
  } else if (!code.result.empty()) {
    Join(text, "the slave is then in: " + code.result, "; ");
  }
  return text;
}

std::string_view Name(EmergencyKind kind) {
  switch (kind) {
    case EmergencyKind::kNone:
      return "no error";
    case EmergencyKind::kFault:
      return "fault";
    case EmergencyKind::kWarning:
      return "warning";
  }
  return "";
}

std::string CodeRange(const EmergencyCode& row) {
  return row.code == row.last_code ? Hex(row.code) : Hex(row.code) + "-" + Hex(row.last_code);
}

Statement RowStatement(const EmergencyCode& row, bool with_code) {
  std::string text = with_code || row.code != row.last_code ? CodeRange(row) + " " : "";
  if (!row.id.empty()) text += row.id + " ";
  text += "(" + std::string(Name(row.kind)) + "): " + row.text;
  return {{}, text, row.note, row.source};
}

bool SameNumber(std::string_view id, char letter, std::uint32_t number) {
  if (id.size() < 2) return false;
  if (letter != 0 &&
      std::tolower(static_cast<unsigned char>(letter)) != std::tolower(static_cast<unsigned char>(id.front()))) {
    return false;
  }
  std::string_view digits = id.substr(1);
  while (digits.size() > 1 && digits.front() == '0') digits.remove_prefix(1);
  return digits == std::to_string(number);
}

}  // namespace

void AddAlStatusCode(std::uint16_t code, const Families& families, std::vector<Meaning>& out) {
  Meaning meaning{.kind = "AL status code", .name = Hex(code), .details = {}, .statements = {}};
  const std::string_view name = esc::AlStatusCodeName(code);
  if (!name.empty()) meaning.name += " " + std::string(name);
  bool listed = !name.empty();
  AddStatements(families, meaning, [&](const DeviceDescription& family) -> std::optional<Statement> {
    if (const AlStatusCode* row = family.al_status_code(code)) {
      listed = true;
      return Statement{{}, CodeText(*row), row->note, row->source};
    }
    return std::nullopt;
  });
  if (!listed) return;
  for (const DeviceDescription* family : families) {
    if (family->DocumentsAlStatusCode(code)) continue;
    meaning.statements.push_back({family->id, "not in its list", {}, family->al.source});
  }
  meaning.details.emplace_back("where",
                               "register 0x0134 (AL Status Code), valid while the error bit of AL Status 0x0130 "
                               "is set");
  if (const std::string_view causes = UsualCauses(code); !causes.empty()) {
    meaning.details.emplace_back("usual causes", std::string(causes));
  }
  meaning.details.emplace_back("see also", "ecaudit explain al-refused, al-wrong-status-code, al-unexpected-change");
  out.push_back(std::move(meaning));
}

void AddAlState(std::string_view given, const Families& families, std::vector<Meaning>& out) {
  constexpr std::string_view kError = "+ERR";
  const bool error = given.ends_with(kError);
  const std::string_view name = error ? given.substr(0, given.size() - kError.size()) : given;
  const std::uint8_t value = esc::StateFromName(name);
  if (!esc::IsAlState(value)) return;
  const auto state = static_cast<esc::AlState>(value);
  Meaning meaning{.kind = "AL state", .name = std::string(given), .details = {}, .statements = {}};
  if (error) {
    meaning.details.emplace_back("error",
                                 "bit 4 of AL Status 0x0130 is set: the slave refused a request or left a state by "
                                 "itself; AL Status Code 0x0134 has the reason. It follows requests again after the "
                                 "master acknowledges (bit 4 of AL Control 0x0120)");
  }
  meaning.details.emplace_back(
      "value", Hex(value | (error ? 0x10U : 0U), 2) + " in bits 3:0 of AL Control 0x0120 and AL Status 0x0130");
  const auto works = [&]() -> std::string_view {
    switch (state) {
      case esc::AlState::INIT:
        return "neither mailbox nor process data; registers and EEPROM only";
      case esc::AlState::PREOP:
        return "the mailbox (SDO and other protocols); no process data";
      case esc::AlState::BOOT:
        return "the mailbox for the download of firmware (FoE) only";
      case esc::AlState::SAFEOP:
        return "the mailbox and the inputs; the outputs stay in a safe state";
      case esc::AlState::OP:
        return "the mailbox, the inputs and the outputs";
    }
    return "";
  };
  meaning.details.emplace_back("works", std::string(works()));
  AddStatements(families, meaning, [&](const DeviceDescription& family) -> std::optional<Statement> {
    std::string to;
    std::string refused;
    std::string source;
    for (const device::AlTransition& row : family.al.transitions) {
      if (row.from != state || row.to == state) continue;
      Join(row.allowed ? to : refused, esc::StateName(row.to), ", ");
      if (source.empty()) source = row.source;
    }
    if (source.empty()) return std::nullopt;
    std::string text = to.empty() ? "" : "may be asked for " + to;
    Join(text, refused.empty() ? "" : "not for " + refused, ", ");
    return Statement{{}, text, {}, source};
  });
  out.push_back(std::move(meaning));
}

void AddSdoAbort(std::uint32_t code, std::vector<Meaning>& out) {
  const std::string_view text = mailbox::AbortCodeText(code);
  if (text.empty()) return;
  Meaning meaning{
      .kind = "SDO abort code", .name = Hex(code, 8) + " " + std::string(text), .details = {}, .statements = {}};
  meaning.details.emplace_back("where",
                               "the last four bytes of an SDO abort, instead of the answer to an upload or a download");
  meaning.details.emplace_back("see also", "ecaudit explain sdo-abort; ecaudit events --type sdo CAPTURE");
  meaning.statements.push_back({"standard", std::string(text), {}, "ETG1000.6, table 41"});
  out.push_back(std::move(meaning));
}

void AddMailboxError(std::uint16_t detail, std::vector<Meaning>& out) {
  const std::string_view text = mailbox::MailboxErrorText(detail);
  if (text.empty()) return;
  Meaning meaning{
      .kind = "mailbox error", .name = Hex(detail) + " " + std::string(text), .details = {}, .statements = {}};
  meaning.details.emplace_back("where", "detail of a mailbox error reply (mailbox type 0)");
  meaning.statements.push_back({"standard", std::string(text), {}, "ETG1000.4, mailbox error service data"});
  out.push_back(std::move(meaning));
}

void AddEmergency(std::uint16_t code, const Families& families, std::vector<Meaning>& out) {
  Meaning meaning{.kind = "emergency error code", .name = Hex(code), .details = {}, .statements = {}};
  AddStatements(families, meaning, [&](const DeviceDescription& family) -> std::optional<Statement> {
    const EmergencyCode* row = family.emergency_code(code);
    if (row == nullptr) return std::nullopt;
    return RowStatement(*row, false);
  });
  if (const std::string_view text = DriveErrorText(code); !text.empty()) {
    meaning.name += " " + std::string(text);
    meaning.statements.insert(meaning.statements.begin(), {"standard", std::string(text), {}, "CIA402, object 603Fh"});
  }
  if (meaning.statements.empty()) return;
  meaning.details.emplace_back("where", "first two bytes of a CoE emergency; also object 603Fh of a CiA 402 drive");
  out.push_back(std::move(meaning));
}

void AddDriveNumber(char letter, std::uint32_t number, const Families& families, std::vector<Meaning>& out) {
  Meaning meaning{.kind = "number that a drive shows", .name = {}, .details = {}, .statements = {}};
  meaning.name = (letter == 0 ? "" : std::string(1, letter)) + std::to_string(number);
  for (const DeviceDescription* family : families) {
    if (!family->emergency) continue;
    for (const EmergencyCode& row : family->emergency->codes) {
      if (!SameNumber(row.id, letter, number)) continue;
      Statement statement = RowStatement(row, true);
      statement.family = family->id;
      meaning.statements.push_back(std::move(statement));
    }
  }
  if (meaning.statements.empty()) return;
  meaning.details.emplace_back("where", "the display of the drive; on the bus the emergency error code beside it");
  out.push_back(std::move(meaning));
}

}  // namespace ecaudit::cli::lookup
