/// Reads the section "al" of a profile.
#include <algorithm>

#include "decoder/base/sort_by_key.h"
#include "decoder/base/text.h"
#include "decoder/device/profile_sections.h"

namespace ecaudit::device {

static void Read(const Cursor& cursor, AlTransition& out) {
  ObjectReader object(cursor);
  object.Require("from", out.from);
  object.Require("to", out.to);
  object.Require("allowed", out.allowed);
  object.Allow("performed", out.performed);
  object.Require("basis", out.basis);
  object.Allow("action", out.action);
  object.Allow("requirement", out.requirement);
  object.Allow("refusal_codes", out.refusal_codes);
  object.Allow("tolerated_codes", out.tolerated_codes);
  FinishRow(object, cursor, out.note, out.source);
}

/// "INIT>PREOP"
static void Read(const Cursor& cursor, AlStatusCode::Transition& out) {
  std::string text;
  Read(cursor, text);
  if (cursor.failed()) return;
  const std::size_t arrow = text.find('>');
  const std::uint8_t from = esc::StateFromName(text.substr(0, arrow));
  const std::uint8_t to = arrow == std::string::npos ? std::uint8_t{0} : esc::StateFromName(text.substr(arrow + 1));
  if (!esc::IsAlState(from) || !esc::IsAlState(to)) {
    return cursor.Fail("\"" + Printable(text) + "\" is not a transition (expected \"INIT>PREOP\")");
  }
  out = {static_cast<esc::AlState>(from), static_cast<esc::AlState>(to)};
}

static void Read(const Cursor& cursor, AlStatusCode& out) {
  ObjectReader object(cursor);
  object.Require("code", out.code);
  object.Require("name", out.name);
  object.Allow("any_transition", out.any_transition);
  object.Allow("transitions", out.transitions);
  object.Allow("states", out.states);
  object.Allow("exclusive", out.exclusive);
  object.Allow("resulting_state", out.resulting_state);
  object.Allow("result", out.result);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, SpontaneousAlChange& out) {
  ObjectReader object(cursor);
  object.Require("from", out.from);
  object.Require("to", out.to);
  object.Require("codes", out.codes);
  object.Require("cause", out.cause);
  object.Require("basis", out.basis);
  FinishRow(object, cursor, out.note, out.source);
}

void Read(const Cursor& cursor, AlDescription& out) {
  ObjectReader object(cursor);
  object.Allow("transitions", out.transitions);
  object.Allow("spontaneous", out.spontaneous);
  object.Allow("status_codes", out.status_codes);
  object.Allow("status_codes_complete", out.status_codes_complete);
  object.Allow("vendor_codes_from", out.vendor_codes_from);
  FinishRow(object, cursor, out.note, out.source);
  if (cursor.failed()) return;

  const auto pair = [](const AlTransition& t) {
    return static_cast<std::uint64_t>(t.from) << 8U | static_cast<std::uint64_t>(t.to);
  };
  SortByKey(out.transitions, pair);
  const auto twice =
      std::ranges::adjacent_find(out.transitions, [&](const auto& a, const auto& b) { return pair(a) == pair(b); });
  if (twice != out.transitions.end()) {
    return cursor.Fail("transition " + std::string(esc::StateName(twice->from)) + " to " +
                       std::string(esc::StateName(twice->to)) + " is listed twice");
  }
  SortByKey(out.status_codes, [](const AlStatusCode& code) { return code.code; });
  const auto same =
      std::ranges::adjacent_find(out.status_codes, [](const auto& a, const auto& b) { return a.code == b.code; });
  if (same != out.status_codes.end()) cursor.Fail("AL status code " + Hex(same->code) + " is listed twice");
}

}  // namespace ecaudit::device
