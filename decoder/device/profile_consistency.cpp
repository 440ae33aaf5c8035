#include "decoder/device/profile_consistency.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "decoder/base/text.h"
#include "decoder/device/source_documents.h"
#include "decoder/esc/al.h"

namespace ecaudit::device {
namespace {

std::optional<std::int64_t> NumberOf(JsonValue value) {
  if (const auto integer = value.integer()) return integer;
  const std::string_view* text = value.text();
  if (text == nullptr || !text->starts_with("0x")) return std::nullopt;
  std::int64_t number = 0;
  const char* end = text->data() + text->size();
  const auto parsed = std::from_chars(text->data() + 2, end, number, 16);
  return parsed.ptr == end && parsed.ec == std::errc{} ? std::optional(number) : std::nullopt;
}

std::int64_t NumberOr(JsonValue value, std::int64_t otherwise) {
  return NumberOf(value).value_or(otherwise);
}

std::string TextOf(JsonValue value) {
  const std::string_view* text = value.text();
  return text == nullptr ? std::string() : std::string(*text);
}

/// "al.transitions" from the root.
JsonValue At(JsonValue root, std::string_view path) {
  while (!path.empty()) {
    const std::size_t dot = path.find('.');
    root = root.member(path.substr(0, dot));
    path = dot == std::string_view::npos ? std::string_view() : path.substr(dot + 1);
  }
  return root;
}

std::string Row(std::string_view list, std::size_t index) {
  return std::string(list) + "[" + std::to_string(index) + "]";
}

/// First and last of "4-7", or twice 4 of "4".
std::pair<int, int> BitsIn(std::string_view bits) {
  const std::size_t dash = bits.find('-');
  const auto number = [](std::string_view digits) {
    int bit = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), bit);
    return bit;
  };
  const int first = number(bits.substr(0, dash));
  return {first, dash == std::string_view::npos ? first : number(bits.substr(dash + 1))};
}

/// Calls `check(row, path)` for each row of a list.
template <typename Check>
void ForEachRow(JsonValue list, std::string_view path, Check&& check) {
  for (std::size_t i = 0; i < list.size(); ++i) check(list.element(i), Row(path, i));
}

std::string Pair(const esc::AlState from, const esc::AlState to) {
  return std::string(esc::StateName(from)) + " to " + std::string(esc::StateName(to));
}

// --- rows that appear twice

/// By what the rows of a list differ; empty: a row that does not state it.
std::string KeyText(JsonValue row, const std::vector<std::string_view>& keys) {
  std::string text;
  for (const std::string_view key : keys) {
    const JsonValue value = row.member(key);
    const auto number = NumberOf(value);
    if (!number && !value.is_text()) {
      if (key == "sub") {
        text += "/0";
        continue;
      }
      return {};
    }
    text += "/" + (number ? std::to_string(*number) : TextOf(value));
  }
  return text;
}

struct Unique {
  std::string_view list;
  std::string_view what;
  std::vector<std::string_view> keys;
};

// --- checks

class Consistency {
 public:
  Consistency(JsonValue root, const DeviceDescription* description, const ReportProblem& report)
      : root_(root), profile_(description), report_(report) {}

  void Run() {
    CheckHead();
    CheckCitations(root_, "");
    if (profile_ != nullptr) {
      CheckAlTransitions();
      CheckAlReach();
      CheckStatusCodes();
      CheckDriveStates();
      CheckDriveTransitions();
      CheckFaultObjects();
      CheckPdos();
      CheckSyncManagers();
      CheckSync();
    }
    CheckLatch("latch");
    CheckLatch("touch_probe");
    CheckRegisterBits("register_bits");
    CheckRegisterBits("event_bits");
  }

 private:
  void CheckHead() {
    const std::string id = TextOf(root_.member("id"));
    if (!std::ranges::all_of(
            id, [](unsigned char c) { return std::islower(c) != 0 || std::isdigit(c) != 0 || c == '-'; })) {
      report_("id", "a name for the command line has lower-case letters, digits and - only");
    }
    const std::string edition = TextOf(root_.member("edition"));
    const bool year = edition.size() >= 4 && std::all_of(edition.begin(), edition.begin() + 4,
                                                         [](unsigned char c) { return std::isdigit(c) != 0; });
    if (!edition.empty() && (!year || (edition.size() != 4 && edition.size() != 7 && edition.size() != 10) ||
                             (edition.size() > 4 && edition[4] != '-'))) {
      report_("edition",
              "\"" + Printable(edition) + "\" is no date (expected \"2020\", \"2020-10\" or \"2020-10-31\")");
    }
    const JsonValue match = root_.member("match");
    if (match.member("product_codes").size() > 0 && !NumberOf(match.member("vendor_id"))) {
      report_("match.product_codes", "a product code means nothing without \"vendor_id\"");
    }
    const auto from = NumberOf(match.member("revision_min"));
    const auto to = NumberOf(match.member("revision_max"));
    if (from && to && *from > *to) report_("match.revision_max", "lies below \"revision_min\"");
  }

  /// Every citation begins with the key of a known document.
  void CheckCitations(JsonValue value, const std::string& path) {
    if (documents_.empty()) {
      documents_.insert(TextOf(root_.member("document")));
      for (const JsonValue row : root_.member("documents").Elements()) documents_.insert(TextOf(row.member("key")));
    }
    if (value.is_array()) {
      ForEachRow(value, path, [this](JsonValue row, const std::string& at) { CheckCitations(row, at); });
    } else if (value.is_object()) {
      for (const auto& [key, member] : value.Members()) {
        const std::string at = path.empty() ? std::string(key) : path + "." + std::string(key);
        if (key == "source" && member.is_text()) {
          CheckCitation(at, *member.text());
        } else {
          CheckCitations(member, at);
        }
      }
    }
  }

  void CheckCitation(const std::string& path, std::string_view text) {
    while (!text.empty()) {
      const std::size_t end = text.find(';');
      std::string_view one = text.substr(0, end);
      text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
      one.remove_prefix(std::min(one.find_first_not_of(' '), one.size()));
      const std::string_view key = one.substr(0, one.find(','));
      if (documents_.contains(key) || FindSourceDocument(key) != nullptr) continue;
      report_(path, "cites \"" + Printable(key) +
                        "\", which is neither \"document\", nor one of \"documents\", nor a " +
                        "document of docs/sources.md");
    }
  }

  void CheckAlTransitions() {
    const JsonValue rows = At(root_, "al.transitions");
    std::set<std::uint16_t> codes;
    for (const AlStatusCode& code : profile_->al.status_codes) codes.insert(code.code);
    ForEachRow(rows, "al.transitions", [&](JsonValue row, const std::string& path) {
      const auto allowed = row.member("allowed").boolean();
      const JsonValue refusals = row.member("refusal_codes");
      if (allowed == false && row.member("to").is_text("INIT")) {
        report_(path, "INIT may always be requested");
      } else if (allowed == false && refusals.size() == 0) {
        report_(path, "is refused, but \"refusal_codes\" has no code for it");
      }
      if (allowed == false && row.member("performed").boolean() == false) {
        report_(path, "what is refused is not performed anyway: \"performed\" is for what is allowed");
      }
      ForEachRow(refusals, path + ".refusal_codes", [&](JsonValue refusal, const std::string& at) {
        const auto code = NumberOf(refusal);
        if (code && !codes.contains(static_cast<std::uint16_t>(*code))) {
          report_(at, Hex(static_cast<std::uint64_t>(*code)) + " is in no row of \"status_codes\"");
        }
      });
    });
    // Rows that could not be read have been reported.
    if (profile_->al.transitions.size() < rows.size()) return;
    if (rows.size() == 0) return;
    constexpr esc::AlState kStates[] = {esc::AlState::INIT, esc::AlState::PREOP, esc::AlState::BOOT,
                                        esc::AlState::SAFEOP, esc::AlState::OP};
    std::string missing;
    for (const esc::AlState from : kStates) {
      for (const esc::AlState to : kStates) {
        if (profile_->al.Find(from, to) == nullptr) missing += (missing.empty() ? "" : ", ") + Pair(from, to);
      }
    }
    if (!missing.empty()) report_("al.transitions", "no row covers " + missing);
  }

  void CheckAlReach() {
    const JsonValue rows = At(root_, "al.transitions");
    if (rows.size() == 0) return;
    // From the document: a row that could not be read for another reason leads on all the same.
    std::set<esc::AlState> reached{esc::AlState::INIT};
    for (std::size_t before = 0; before != reached.size();) {
      before = reached.size();
      for (const JsonValue row : rows.Elements()) {
        const std::uint8_t from = esc::StateFromName(TextOf(row.member("from")));
        const std::uint8_t to = esc::StateFromName(TextOf(row.member("to")));
        const bool barred = row.member("allowed").boolean() == false || row.member("performed").boolean() == false;
        if (!barred && esc::IsAlState(to) && reached.contains(static_cast<esc::AlState>(from))) {
          reached.insert(static_cast<esc::AlState>(to));
        }
      }
    }
    // BOOT is optional; without the others there is no process data.
    for (const esc::AlState state : {esc::AlState::PREOP, esc::AlState::SAFEOP, esc::AlState::OP}) {
      if (reached.contains(state)) continue;
      // The row that should lead there means it.
      std::string path = "al.transitions";
      for (std::size_t i = 0; i < rows.size() && path == "al.transitions"; ++i) {
        const bool leads = rows.element(i).member("to").is_text(esc::StateName(state));
        const std::uint8_t from = esc::StateFromName(TextOf(rows.element(i).member("from")));
        if (leads && esc::IsAlState(from) && reached.contains(static_cast<esc::AlState>(from)) &&
            static_cast<std::uint8_t>(state) == (from == 4 ? 8 : from * 2)) {
          path = Row("al.transitions", i);
        }
      }
      report_(path, std::string(esc::StateName(state)) + " can never be reached from INIT");
      break;  // those above it follow from that
    }
  }

  void CheckStatusCodes() {
    const JsonValue rows = At(root_, "al.status_codes");
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const JsonValue row = rows.element(i);
      const auto code = NumberOf(row.member("code"));
      if (row.member("exclusive").boolean() != true || !code) continue;
      const std::vector<JsonValue> transitions = row.member("transitions").Elements();
      for (std::size_t t = 0; t < transitions.size(); ++t) {
        const std::string text = TextOf(transitions[t]);
        const std::size_t arrow = std::min(text.find('>'), text.size());
        const std::uint8_t from = esc::StateFromName(text.substr(0, arrow));
        const std::uint8_t to = esc::StateFromName(text.substr(std::min(arrow + 1, text.size())));
        if (!esc::IsAlState(from) || !esc::IsAlState(to)) continue;
        const AlTransition* about = profile_->al.Find(static_cast<esc::AlState>(from), static_cast<esc::AlState>(to));
        if (about == nullptr || Has(about->refusal_codes, *code) || Has(about->tolerated_codes, *code)) continue;
        report_(Row(Row("al.status_codes", i) + ".transitions", t), "the row of this transition does not have " +
                                                                        Hex(static_cast<std::uint64_t>(*code)) +
                                                                        " among its \"refusal_codes\"");
      }
    }
    const JsonValue transitions = At(root_, "al.transitions");
    for (std::size_t i = 0; i < transitions.size(); ++i) {
      const JsonValue row = transitions.element(i);
      if (row.member("basis").is_text("inferred")) continue;
      const std::uint8_t from = esc::StateFromName(TextOf(row.member("from")));
      const std::uint8_t to = esc::StateFromName(TextOf(row.member("to")));
      if (!esc::IsAlState(from) || !esc::IsAlState(to)) continue;
      const JsonValue codes = row.member("refusal_codes");
      for (std::size_t c = 0; c < codes.size(); ++c) {
        const AlStatusCode* code = profile_->al.FindCode(static_cast<std::uint16_t>(NumberOr(codes.element(c), 0)));
        if (code == nullptr || !code->exclusive || code->any_transition ||
            code->AppliesTo(static_cast<esc::AlState>(from), static_cast<esc::AlState>(to))) {
          continue;
        }
        report_(Row(Row("al.transitions", i) + ".refusal_codes", c),
                "the list of status codes binds " + Hex(code->code) + " to other transitions");
      }
    }
  }

  static bool Has(const std::vector<std::uint16_t>& codes, std::int64_t code) {
    return std::ranges::find(codes, code) != codes.end();
  }

  void CheckDriveStates() {
    const JsonValue rows = At(root_, "drive.states");
    std::set<std::string> named;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      named.insert(TextOf(rows.element(i).member("state")));
      const auto mask = NumberOf(rows.element(i).member("mask"));
      const auto value = NumberOf(rows.element(i).member("value"));
      for (std::size_t above = 0; above < i && mask && value; ++above) {
        const auto first_mask = NumberOf(rows.element(above).member("mask"));
        const auto first_value = NumberOf(rows.element(above).member("value"));
        // Every word that shows this state shows the one above, which is asked first; but for patterns of "also".
        if (rows.element(i).member("also").size() > 0 || !first_mask || !first_value ||
            (*first_mask & *mask) != *first_mask || (*value & *first_mask) != *first_value) {
          continue;
        }
        report_(Row("drive.states", i), "can never be seen: each such status word already shows " +
                                            TextOf(rows.element(above).member("state")));
      }
    }
    if (rows.size() > 0 && named.size() < 8) {
      for (unsigned state = 0; state < 8; ++state) {
        const std::string name(DriveStateName(static_cast<DriveState>(state)));
        if (!named.contains(name)) report_("drive.states", "no row for the state " + name);
      }
    }
  }

  void CheckDriveTransitions() {
    if (!profile_->drive) return;
    const DriveProfile& drive = *profile_->drive;
    const JsonValue commands = At(root_, "drive.commands");
    std::set<std::int64_t> commanded;
    for (std::size_t i = 0; i < commands.size(); ++i) {
      const JsonValue numbers = commands.element(i).member("transitions");
      for (std::size_t n = 0; n < numbers.size(); ++n) {
        const auto number = NumberOf(numbers.element(n));
        if (!number) continue;
        commanded.insert(*number);
        if (*number >= 0 && *number < 256 && drive.Find(static_cast<std::uint8_t>(*number)) == nullptr) {
          report_(Row(Row("drive.commands", i) + ".transitions", n),
                  "there is no transition " + std::to_string(*number));
        }
      }
    }
    const JsonValue rows = At(root_, "drive.transitions");
    if (rows.size() == 0) return;
    std::set<DriveState> reached;
    for (const DriveTransition& row : drive.transitions) {
      if (!row.from) reached.insert(row.to);
    }
    for (std::size_t before = 0; before != reached.size();) {
      before = reached.size();
      for (const DriveTransition& row : drive.transitions) {
        if (row.from && reached.contains(*row.from)) reached.insert(row.to);
      }
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (const DriveTransition& row : drive.transitions) {
        if (row.number != NumberOr(rows.element(i).member("number"), -1) || !row.from || reached.contains(*row.from)) {
          continue;
        }
        report_(Row("drive.transitions", i),
                "begins in " + std::string(DriveStateName(*row.from)) + ", which no transition reaches");
      }
    }
  }

  void CheckFaultObjects() {
    if (!profile_->drive) return;
    ForEachRow(At(root_, "drive.fault_objects"), "drive.fault_objects", [&](JsonValue row, const std::string& path) {
      const std::int64_t index = NumberOr(row.member("index"), 0);
      const std::int64_t bits = NumberOr(row.member("bits"), 0);
      const std::string prefix = TextOf(row.member("prefix"));
      if (TextOf(row.member("kind")) != "fault number") {
        if (!prefix.empty()) report_(path, "\"prefix\" belongs to the kind \"fault number\"");
      } else if (!NumbersAreNamed(prefix)) {
        report_(path, "no \"id\" of \"emergency\" is \"" + Printable(prefix) + "\" and a number");
      }
      CheckFaultType(path, index, NumberOr(row.member("sub"), 0), bits);
    });
  }

  /// A family without a list of its own may use the list of a relative.
  [[nodiscard]] bool NumbersAreNamed(const std::string& prefix) const {
    if (!profile_->emergency || At(root_, "emergency.codes").size() == 0) return true;
    const auto& codes = profile_->emergency->codes;
    return std::ranges::any_of(codes, [&](const EmergencyCode& code) {
      return code.id.starts_with(prefix) && code.id.size() > prefix.size() &&
             std::isdigit(static_cast<unsigned char>(code.id[prefix.size()])) != 0;
    });
  }

  /// The dictionary has the object with the same length.
  void CheckFaultType(const std::string& path, std::int64_t index, std::int64_t subindex, std::int64_t bits) {
    if (!profile_->dictionary || index < 0 || index > 0xFFFF || subindex < 0 || subindex > 0xFF) return;
    const DictionaryObject* object =
        profile_->dictionary->Find(static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(subindex));
    if (object == nullptr || object->types.size() != 1 || BitsOf(object->types.front()) == bits) return;
    report_(path, "\"bits\" is " + std::to_string(bits) + ", but the dictionary has " +
                      std::string(DataTypeName(object->types.front())));
  }

  void CheckPdos() {
    ForEachRow(At(root_, "pdo.fixed"), "pdo.fixed", [&](JsonValue pdo, const std::string& path) {
      CheckPdoIndex(pdo, path);
      std::int64_t bits = 0;
      ForEachRow(pdo.member("entries"), path + ".entries", [&](JsonValue entry, const std::string& at) {
        bits += NumberOr(entry.member("bits"), 0);
        CheckEntry(entry, at);
      });
      if (bits % 8 != 0) {
        report_(path, "has " + std::to_string(bits) + " bits, which is no whole number of bytes: an entry of padding " +
                          "(index 0) is missing, or a length is wrong");
      }
      const auto index = NumberOf(pdo.member("index"));
      const auto direction = DirectionOf(pdo);
      if (index && direction && profile_->pdo.selectable_complete && At(root_, "pdo.selectable").size() > 0 &&
          !profile_->pdo.IsAssignable(*direction, static_cast<std::uint16_t>(*index))) {
        report_(path, "is not in \"selectable\", which claims to be complete");
      }
    });
    ForEachRow(At(root_, "pdo.selectable"), "pdo.selectable",
               [this](JsonValue row, const std::string& path) { CheckPdoIndex(row, path); });
    ForEachRow(At(root_, "pdo.cyclic"), "pdo.cyclic",
               [this](JsonValue row, const std::string& path) { CheckEntry(row, path); });
  }

  static std::optional<PdoDirection> DirectionOf(JsonValue row) {
    if (row.member("direction").is_text("rx")) return PdoDirection::kRx;
    if (row.member("direction").is_text("tx")) return PdoDirection::kTx;
    return std::nullopt;
  }

  void CheckPdoIndex(JsonValue row, const std::string& path) {
    const auto index = NumberOf(row.member("index"));
    const auto direction = DirectionOf(row);
    if (!index || !direction) return;
    const bool rx = *direction == PdoDirection::kRx;
    if (*index < (rx ? 0x1600 : 0x1A00) || *index > (rx ? 0x17FF : 0x1BFF)) {
      report_(path, Hex(static_cast<std::uint64_t>(*index)) + " is no " +
                        (rx ? "RxPDO (0x1600 to 0x17ff)" : "TxPDO (0x1a00 to 0x1bff)"));
    }
  }

  void CheckEntry(JsonValue entry, const std::string& path) {
    const auto bits = NumberOf(entry.member("bits"));
    const auto index = NumberOf(entry.member("index"));
    if (!bits || !index) return;
    const DataType type = DataTypeFromName(TextOf(entry.member("type")));
    if (BitsOf(type) != 0 && BitsOf(type) != *bits) {
      report_(path, std::string(DataTypeName(type)) + " has " + std::to_string(BitsOf(type)) + " bits, not " +
                        std::to_string(*bits));
      return;
    }
    if (*index == 0 || !profile_->dictionary || At(root_, "dictionary.objects").size() == 0) return;
    const auto subindex = static_cast<std::uint8_t>(NumberOr(entry.member("sub"), 0));
    const DictionaryObject* object = profile_->dictionary->Find(static_cast<std::uint16_t>(*index), subindex);
    const std::string name = ObjectName(static_cast<std::uint16_t>(*index), subindex);
    if (object == nullptr) {
      if (profile_->dictionary->complete)
        report_(path, name + " is not in the dictionary, which claims to be complete");
      return;
    }
    if (!object->AllowsBits(subindex, static_cast<std::uint32_t>(*bits))) {
      report_(path, "the dictionary gives " + name + " the type " +
                        std::string(DataTypeName(object->TypeOf(subindex))) + ", which has not " +
                        std::to_string(*bits) + " bits");
    }
  }

  void CheckSyncManagers() {
    const JsonValue rows = At(root_, "mailbox.sync_managers");
    struct Area {
      std::int64_t begin;
      std::int64_t end;
      std::int64_t number;
    };
    std::vector<Area> areas;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const JsonValue row = rows.element(i);
      const std::string path = Row("mailbox.sync_managers", i);
      const std::string use = TextOf(row.member("use"));
      const auto start = NumberOf(row.member("start"));
      const auto longest = NumberOf(row.member("max_length"));
      if (start && *start < 0x1000) report_(path, "begins among the registers: memory begins at 0x1000");
      std::int64_t shortest = 0;
      const JsonValue lengths = row.member("lengths");
      for (std::size_t n = 0; n < lengths.size(); ++n) {
        const std::int64_t length = NumberOr(lengths.element(n), 0);
        shortest = shortest == 0 ? length : std::min(shortest, length);
        if (longest && length > *longest) report_(path, "\"lengths\" has more than \"max_length\"");
      }
      const bool process = use.starts_with("process");
      if (process && longest)
        CheckLongestPdo(use == "process out" ? PdoDirection::kRx : PdoDirection::kTx, *longest, path);
      if (!start || shortest == 0) continue;
      const Area area{*start, *start + shortest * (process ? 3 : 1), NumberOr(row.member("number"), -1)};
      for (const Area& other : areas) {
        if (area.begin < other.end && other.begin < area.end) {
          report_(path, "lies in the memory of sync manager " + std::to_string(other.number));
        }
      }
      areas.push_back(area);
    }
  }

  void CheckLongestPdo(PdoDirection direction, std::int64_t longest, const std::string& path) {
    for (const PdoContent& pdo : profile_->pdo.fixed) {
      if (pdo.direction != direction || pdo.bits() <= 8 * longest) continue;
      report_(path, "\"max_length\" is " + std::to_string(longest) + " bytes, but PDO " + Hex(pdo.index) + " has " +
                        std::to_string((pdo.bits() + 7) / 8));
    }
  }

  void CheckSync() {
    const JsonValue sync = root_.member("sync");
    const auto value = [&](std::string_view key) { return NumberOf(sync.member(key).member("value")); };
    const auto base = value("cycle_base_ns");
    const auto least = value("cycle_min_ns");
    if (base && *base <= 0) report_("sync.cycle_base_ns", "a cycle has more than 0 ns");
    if (base && least && *base > 0 && *least % *base != 0) {
      report_("sync.cycle_min_ns", "is no multiple of \"cycle_base_ns\"");
    }
    ForEachRow(sync.member("jitter"), "sync.jitter", [this](JsonValue row, const std::string& path) {
      const auto from = NumberOf(row.member("cycle_min_ns"));
      const auto to = NumberOf(row.member("cycle_max_ns"));
      if (from && to && *from > *to) report_(path, "\"cycle_max_ns\" lies below \"cycle_min_ns\"");
    });
    if (!profile_->emergency || At(root_, "emergency.codes").size() == 0) return;
    for (const std::string_view key : {"lost_faults", "lost_warnings"}) {
      const JsonValue ids = sync.member(key);
      for (std::size_t i = 0; i < ids.size(); ++i) {
        const std::string id = TextOf(ids.element(i));
        const auto& codes = profile_->emergency->codes;
        if (std::ranges::none_of(codes, [&](const EmergencyCode& code) { return code.id == id; })) {
          report_(Row("sync." + std::string(key), i), "no row of \"emergency\" has the id \"" + Printable(id) + "\"");
        }
      }
    }
  }

  void CheckLatch(std::string_view section) {
    const JsonValue latch = root_.member(section);
    std::int64_t known = 0;
    for (const std::string_view word : {"control", "status"}) {
      const JsonValue rows = latch.member(word);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const std::string path = Row(std::string(section) + "." + std::string(word), i);
        const std::int64_t mask = NumberOr(rows.element(i).member("mask"), 0);
        if (word == "control" && rows.element(i).member("reserved").boolean() != true) known |= mask;
        const std::string bits = TextOf(rows.element(i).member("bits"));
        if (bits.empty()) continue;
        const auto [from, to] = BitsIn(bits);
        const int first = std::min(from, 31), last = std::min(to, 31);
        const std::int64_t wanted = ((std::int64_t{2} << last) - 1) & ~((std::int64_t{1} << first) - 1);
        if (mask != wanted) {
          report_(path, "\"mask\" is " + Hex(static_cast<std::uint64_t>(mask)) + ", but bits " + Printable(bits) +
                            " are " + Hex(static_cast<std::uint64_t>(wanted)));
        }
      }
    }
    const JsonValue edges = latch.member("edges");
    for (std::size_t i = 0; i < edges.size() && known != 0; ++i) {
      const std::int64_t enable = NumberOr(edges.element(i).member("enable"), 0);
      if ((enable & ~known) != 0) {
        report_(Row(std::string(section) + ".edges", i),
                "\"enable\" has bits that no row of \"control\" gives a meaning");
      }
    }
  }

  void CheckRegisterBits(std::string_view section) {
    const JsonValue rows = root_.member(section);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto value = NumberOf(rows.element(i).member("value"));
      const std::string bits = TextOf(rows.element(i).member("bits"));
      if (!value || bits.empty()) continue;
      const auto [first, last] = BitsIn(bits);
      if (last >= first && last - first < 16 && *value >= std::int64_t{1} << (last - first + 1)) {
        report_(Row(section, i), std::to_string(*value) + " does not fit into bits " + Printable(bits));
      }
    }
  }

  JsonValue root_;
  const DeviceDescription* profile_;
  const ReportProblem& report_;
  std::set<std::string, std::less<>> documents_;
};

}  // namespace

std::vector<std::string> RowsThatStandTwice(JsonValue root, const ReportProblem& report) {
  static const Unique kLists[] = {{"al.transitions", "this transition", {"from", "to"}},
                                  {"al.status_codes", "this status code", {"code"}},
                                  {"registers", "a register at this address", {"address"}},
                                  {"drive.states", "this state", {"state"}},
                                  {"drive.transitions", "a transition of this number", {"number"}},
                                  {"drive.control_bits", "this bit", {"bit"}},
                                  {"drive.status_bits", "this bit", {"bit"}},
                                  {"drive.modes", "this mode", {"value"}},
                                  {"drive.fault_objects", "this object", {"index", "sub"}},
                                  {"pdo.selectable", "this PDO", {"direction", "index"}},
                                  {"pdo.fixed", "this PDO", {"index"}},
                                  {"mailbox.sync_managers", "this sync manager", {"number"}},
                                  {"mailbox.protocols", "this protocol", {"type"}},
                                  {"emergency.codes", "this code", {"code", "last_code"}}};
  std::vector<std::string> twice;
  const auto look = [&](std::string_view list, std::string_view what, const auto& key_of) {
    const JsonValue rows = At(root, list);
    std::map<std::string, std::size_t> first;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::string key = key_of(rows.element(i));
      if (key.empty()) continue;
      const auto [known, added] = first.try_emplace(key, i);
      if (added) continue;
      twice.push_back(Row(list, i));
      report(twice.back(), std::string(what) + " is already in row " + std::to_string(known->second));
    }
  };
  for (const Unique& list : kLists) {
    look(list.list, list.what, [&](JsonValue row) {
      const bool single_code = list.list == "emergency.codes" && !row.member("last_code").there();
      return single_code ? KeyText(row, {"code", "code"}) : KeyText(row, list.keys);
    });
  }
  look("dictionary.objects", "this object", [](JsonValue row) {
    return row.member("head").boolean() == true ? "head" + KeyText(row, {"index"}) : KeyText(row, {"index", "sub"});
  });
  look("emergency.codes", "this id", [](JsonValue row) {
    const std::string id = TextOf(row.member("id"));
    return id.empty() ? id : "id " + id;
  });
  // The order of the document within a list, list by list: those who cut from the end need no more.
  return twice;
}

void CheckConsistency(JsonValue root, const DeviceDescription* description, const ReportProblem& report) {
  Consistency(root, description, report).Run();
}

}  // namespace ecaudit::device
