#include "cli/expectation_file.h"

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string_view>
#include <utility>

#include "analyzers/compare/comparison.h"
#include "analyzers/compare/eni_expectation.h"
#include "analyzers/compare/startup_registers.h"
#include "cli/json_file.h"
#include "cli/report/json_text.h"
#include "cli/suggest.h"
#include "cli/version.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"
#include "decoder/device/eni_reader.h"
#include "decoder/esc/al.h"

namespace ecaudit::cli {
namespace {

using report::JsonObject;
using report::JsonText;
using startup::Expectation;
using startup::ExpectedSlave;
using startup::ExpectedStep;

constexpr std::string_view kExpectationSchema = "ecaudit.expectation/1";
/// Far above what a start-up holds; comparing costs memory by the square.
constexpr std::size_t kMaxSteps = 5000;
constexpr std::size_t kMaxSlaves = 4096;
constexpr double kLongestMs = 1e9;
/// The only outcome that can be expected.
constexpr std::string_view kDone = "done";

std::string At(const std::string& where, std::string_view key) {
  return where.empty() ? std::string(key) : where + "." + std::string(key);
}

/// Reads an expectation; stops at the first mistake, which error() shows with its place.
class Reader {
 public:
  [[nodiscard]] const std::optional<std::string>& error() const { return error_; }

  Expectation Read(JsonValue document) {
    Expectation expectation;
    if (!Keys(document, "", {"schema", "comment", "tool", "saved_from", "strict", "phases", "bus", "slaves"})) {
      return expectation;
    }
    if (const JsonValue strict = Find(document, "strict"); strict.there()) {
      if (!strict.boolean()) Fail("strict", "must be true or false");
      expectation.strict = strict.boolean().value_or(expectation.strict);
    }
    Limits(document, "", expectation.limits);
    if (const JsonValue bus = Find(document, "bus"); bus.there()) {
      if (Keys(bus, "bus", {"comment", "steps"})) expectation.bus = Steps(bus, "bus");
    }
    const JsonValue slaves = Find(document, "slaves");
    if (!slaves.is_array() || slaves.size() > kMaxSlaves) {
      Fail("slaves", "must be a list of slaves");
      return expectation;
    }
    for (std::size_t i = 0; i < slaves.size() && !error_; ++i) {
      expectation.slaves.push_back(Slave(slaves.element(i), "slaves[" + std::to_string(i) + "]", i));
    }
    std::ranges::stable_sort(expectation.slaves, {}, &ExpectedSlave::position);
    return expectation;
  }

 private:
  void Fail(const std::string& where, const std::string& what) {
    if (!error_) error_ = where + ": " + what;
  }

  /// The member, unless it is null, which is as good as none.
  static JsonValue Find(JsonValue object, std::string_view key) {
    const JsonValue member = object.member(key);
    return member.is_null() ? JsonValue() : member;
  }

  bool Keys(JsonValue object, const std::string& where, std::initializer_list<std::string_view> known) {
    if (!object.is_object()) {
      Fail(where.empty() ? "the document" : where, "must be an object");
      return false;
    }
    for (const auto& [key, value] : object.Members()) {
      if (std::ranges::find(known, key) != known.end()) continue;
      Fail(At(where, Printable(key)), "unknown key" + Suggestion(key, {known.begin(), known.end()}, ""));
      return false;
    }
    return true;
  }

  /// A number, or text such as "0x0810"; unset and an error when it is neither or too large.
  std::optional<std::uint32_t> Number(JsonValue value, const std::string& where, std::uint32_t most) {
    bool valid = value.natural().has_value();
    std::uint64_t number = value.natural().value_or(0);
    if (value.is_text()) {
      std::string_view text = *value.text();
      const bool hexadecimal = text.starts_with("0x") || text.starts_with("0X");
      if (hexadecimal) text.remove_prefix(2);
      const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number, hexadecimal ? 16 : 10);
      valid = !text.empty() && code == std::errc() && end == text.data() + text.size();
    }
    if (valid && number <= most) return static_cast<std::uint32_t>(number);
    Fail(where, "must be a number up to " + Hex(most) + ", or text such as \"0x0810\"");
    return std::nullopt;
  }

  void Limits(JsonValue object, const std::string& where, std::array<std::optional<TimeNs>, kStartupPhases>& limits) {
    const JsonValue phases = Find(object, "phases");
    if (!phases.there()) return;
    const std::string here = At(where, "phases");
    if (!phases.is_object()) return Fail(here, "must be an object with phases");
    for (const auto& [name, entry] : phases.Members()) {
      const auto phase = ParseStartupPhase(name);
      std::vector<std::string_view> names;
      for (const StartupPhaseName& known : kStartupPhaseNames) names.push_back(known.name);
      if (!phase) return Fail(At(here, Printable(name)), "no such phase" + Suggestion(name, names, ""));
      if (!Keys(entry, At(here, name), {"comment", "limit_ms", "took_ms"})) return;
      const JsonValue limit = Find(entry, "limit_ms");
      if (!limit.there()) continue;
      const double ms = limit.number().value_or(-1);
      if (!(ms >= 0) || ms > kLongestMs) {
        return Fail(At(At(here, name), "limit_ms"), "must be milliseconds, or null for no limit");
      }
      limits[static_cast<std::size_t>(*phase)] = static_cast<TimeNs>(std::llround(ms * 1e6));
    }
  }

  ExpectedSlave Slave(JsonValue object, const std::string& where, std::size_t place) {
    ExpectedSlave slave;
    slave.position = static_cast<SlavePos>(place);
    if (!Keys(object, where,
              {"comment", "position", "name", "vendor_id", "product_code", "revision", "phases", "steps"})) {
      return slave;
    }
    if (const JsonValue position = Find(object, "position"); position.there()) {
      if (const auto number = Number(position, At(where, "position"), 0xFFFF)) {
        slave.position = static_cast<SlavePos>(*number);
      }
    }
    if (const std::string_view* name = object.member("name").text()) slave.name = *name;
    for (const auto& [key, target] :
         {std::pair("vendor_id", &slave.vendor_id), std::pair("product_code", &slave.product_code),
          std::pair("revision", &slave.revision)}) {
      if (const JsonValue value = Find(object, key); value.there()) {
        *target = Number(value, At(where, key), 0xFFFFFFFF);
      }
    }
    Limits(object, where, slave.limits);
    slave.steps = Steps(object, where);
    return slave;
  }

  std::vector<ExpectedStep> Steps(JsonValue object, const std::string& where) {
    std::vector<ExpectedStep> steps;
    const JsonValue list = Find(object, "steps");
    if (!list.there()) return steps;
    if (!list.is_array() || list.size() > kMaxSteps) {
      Fail(At(where, "steps"), "must be a list of at most " + Grouped(kMaxSteps) + " steps");
      return steps;
    }
    std::uint8_t state = static_cast<std::uint8_t>(esc::AlState::INIT);
    for (std::size_t i = 0; i < list.size() && !error_; ++i) {
      steps.push_back(Step(list.element(i), At(where, "steps") + "[" + std::to_string(i) + "]", state));
      if (steps.back().key.kind == StartupKey::Kind::kRequest)
        state = static_cast<std::uint8_t>(steps.back().key.address);
    }
    return steps;
  }

  ExpectedStep Step(JsonValue object, const std::string& where, std::uint8_t state) {
    ExpectedStep step;
    if (!Keys(object, where,
              {"comment", "phase", "write", "eeprom", "request", "download", "upload", "drive", "complete_access",
               "name", "value", "text", "outcome"})) {
      return step;
    }
    std::size_t kinds = 0;
    for (const char* kind : {"write", "eeprom", "request", "download", "upload", "drive"}) {
      kinds += object.member(kind).there() ? 1U : 0U;
    }
    if (kinds != 1) {
      Fail(where, "must hold exactly one of 'write', 'eeprom', 'request', 'download', 'upload' and 'drive'");
      return step;
    }
    if (const std::string_view* name = object.member("name").text()) step.name = Printable(*name);
    Value(object, where, step);
    Key(object, where, step);
    if (const JsonValue outcome = Find(object, "outcome"); outcome.there()) {
      step.succeeds = outcome.is_text(kDone);
      if (!step.succeeds) Fail(At(where, "outcome"), "must be \"done\", or null for any");
    }
    const bool sdo = step.key.kind == StartupKey::Kind::kDownload || step.key.kind == StartupKey::Kind::kUpload;
    if (!error_ && sdo && object.member("complete_access").there()) Complete(object, where, step);
    step.phase = PhaseOf(step, state);
    if (const JsonValue phase = Find(object, "phase"); phase.there()) {
      const auto known = phase.is_text() ? ParseStartupPhase(*phase.text()) : std::nullopt;
      if (!known) Fail(At(where, "phase"), "no such phase");
      if (known) step.phase = *known;
    }
    return step;
  }

  void Complete(JsonValue object, const std::string& where, ExpectedStep& step) {
    const std::optional<bool> complete = object.member("complete_access").boolean();
    if (!complete) return Fail(At(where, "complete_access"), "must be true or false");
    step.key.complete_access = *complete;
  }

  void Key(JsonValue object, const std::string& where, ExpectedStep& step) {
    using Kind = StartupKey::Kind;
    if (const JsonValue write = object.member("write"); write.there()) {
      step.key.kind = Kind::kWrite;
      step.key.address = Number(write, At(where, "write"), 0x0FFF).value_or(0);
    } else if (const JsonValue eeprom = object.member("eeprom"); eeprom.there()) {
      step.key.kind = Kind::kEeprom;
      step.key.address = Number(eeprom, At(where, "eeprom"), 0xFFFFFFFF).value_or(0);
    } else if (const JsonValue drive = object.member("drive"); drive.there()) {
      step.key.kind = Kind::kDrive;
      step.key.address = Number(drive, At(where, "drive"), 0xFFFF).value_or(0) & 0x008FU;
    } else if (const JsonValue request = object.member("request"); request.there()) {
      step.key.kind = Kind::kRequest;
      if (request.is_text()) step.key.address = esc::StateFromName(*request.text());
      // Masters also ask for what is no state.
      if (const auto number = request.natural()) step.key.address = static_cast<std::uint32_t>(*number);
      if (step.key.address == 0 || step.key.address > 0x0F) {
        Fail(At(where, "request"), "must be INIT, PREOP, BOOT, SAFEOP or OP");
      }
    } else {
      const bool upload = object.member("upload").there();
      step.key.kind = upload ? Kind::kUpload : Kind::kDownload;
      const std::string_view key = upload ? "upload" : "download";
      const std::string_view* text = object.member(key).text();
      if (text == nullptr || !ParseObject(*text, step.key)) {
        Fail(At(where, key), "must be an object such as \"1C12h:1\" or \"0x1C12:1\"");
      }
    }
  }

  /// "1C12h:1", "0x1C12:01"; the subindex in decimal.
  static bool ParseObject(std::string_view text, StartupKey& key) {
    const std::size_t colon = text.find(':');
    if (colon == std::string_view::npos) return false;
    std::string_view index = text.substr(0, colon);
    const std::string_view sub = text.substr(colon + 1);
    if (index.ends_with('h') || index.ends_with('H')) {
      index.remove_suffix(1);
    } else if (index.starts_with("0x") || index.starts_with("0X")) {
      index.remove_prefix(2);
    } else {
      return false;
    }
    std::uint16_t number = 0;
    const auto [end, code] = std::from_chars(index.data(), index.data() + index.size(), number, 16);
    const auto [sub_end, sub_code] = std::from_chars(sub.data(), sub.data() + sub.size(), key.subindex, 10);
    key.address = number;
    return !index.empty() && code == std::errc() && end == index.data() + index.size() && !sub.empty() &&
           sub_code == std::errc() && sub_end == sub.data() + sub.size();
  }

  void Value(JsonValue object, const std::string& where, ExpectedStep& step) {
    const JsonValue value = Find(object, "value");
    if (!value.there()) return;
    const std::string here = At(where, "value");
    if (object.member("request").there() || object.member("drive").there()) {
      return Fail(here, "a step of this kind has no value");
    }
    step.number = value.integer();
    if (step.number) return;
    if (value.natural()) return Fail(here, "the number is too large; give the bytes in hexadecimal");
    if (!value.is_text()) return Fail(here, "must be a whole number, bytes in hexadecimal, or null for any");
    std::vector<std::uint8_t> bytes;
    const std::string_view text = *value.text();
    for (std::size_t i = 0; i < text.size();) {
      if (text[i] == ' ') {
        ++i;
        continue;
      }
      std::uint8_t byte = 0;
      const char* last = text.data() + std::min(i + 2, text.size());
      const auto [end, code] = std::from_chars(text.data() + i, last, byte, 16);
      if (code != std::errc() || end != text.data() + i + 2) {
        return Fail(here, "'" + Printable(text) + "' is no list of bytes such as \"0011 0600\"");
      }
      bytes.push_back(byte);
      i += 2;
    }
    step.data = std::move(bytes);
  }

  static StartupPhase PhaseOf(const ExpectedStep& step, std::uint8_t state) {
    constexpr auto kSafeop = static_cast<std::uint8_t>(esc::AlState::SAFEOP);
    switch (step.key.kind) {
      case StartupKey::Kind::kWrite:
        return startup::PhaseOfWrite(static_cast<EscAddress>(step.key.address),
                                     step.data ? ByteSpan(*step.data) : ByteSpan(), state);
      case StartupKey::Kind::kEeprom:
        return StartupPhase::kEeprom;
      case StartupKey::Kind::kRequest:
        if (step.key.address == static_cast<std::uint32_t>(esc::AlState::INIT)) return StartupPhase::kScan;
        if (step.key.address < kSafeop) return StartupPhase::kInitToPreop;
        return step.key.address == kSafeop ? StartupPhase::kPreopToSafeop : StartupPhase::kSafeopToOp;
      case StartupKey::Kind::kDownload:
      case StartupKey::Kind::kUpload:
        return state >= kSafeop ? StartupPhase::kSafeopToOp : StartupPhase::kPreopParameters;
      case StartupKey::Kind::kDrive:
        break;
    }
    return StartupPhase::kDriveEnable;
  }

  std::optional<std::string> error_;
};

Result<std::shared_ptr<const Expectation>> ReadEniExpectation(const std::string& path) {
  const Result<device::EniConfig> eni = device::LoadEniFile(path);
  if (!eni) return eni.error();
  auto expectation =
      std::make_shared<Expectation>(startup::ExpectationOf(*eni, std::filesystem::path(path).filename().string()));
  bool empty = true;
  for (const ExpectedSlave& slave : expectation->slaves) empty = empty && slave.steps.empty();
  if (empty) return Error{Printable(path) + ": the ENI holds no init commands, so nothing can be expected"};
  return std::shared_ptr<const Expectation>(std::move(expectation));
}

/// Any capture would be as expected.
bool ExpectsNothing(const Expectation& e) {
  return !e.strict && e.slaves.empty() && e.bus.empty() &&
         std::ranges::none_of(e.limits, [](const auto& limit) { return limit.has_value(); });
}

/// Short values as people write them; structures of registers and complete access as bytes.
void PutValue(JsonObject& out, const ExpectedStep& step) {
  if (!step.data) return out.Put("value", nullptr);
  std::string written;
  if (step.data->size() <= 4 && !step.key.complete_access) {
    std::uint64_t number = 0;
    for (std::size_t i = step.data->size(); i > 0; --i) number = number << 8U | (*step.data)[i - 1];
    out.Put("value", number);
    written = std::to_string(number);
  } else {
    out.Put("value", HexBytes(*step.data));
    written = "\"" + HexBytes(*step.data) + "\"";
  }
  if (!step.text.empty() && step.text != written) out.Put("text", Printable(step.text));
}

void PutKeyAndValue(JsonObject& out, const ExpectedStep& step) {
  const StartupKey& key = step.key;
  switch (key.kind) {
    case StartupKey::Kind::kWrite:
      out.Put("write", Hex(key.address));
      break;
    case StartupKey::Kind::kEeprom:
      out.Put("eeprom", Hex(key.address));
      break;
    case StartupKey::Kind::kRequest: {
      const auto state = static_cast<std::uint8_t>(key.address);
      // Masters also ask for what is no state.
      if (esc::IsAlState(state)) return out.Put("request", esc::StateName(state));
      return out.Put("request", key.address);
    }
    case StartupKey::Kind::kDownload:
    case StartupKey::Kind::kUpload:
      out.Put(key.kind == StartupKey::Kind::kUpload ? "upload" : "download",
              ObjectName(static_cast<std::uint16_t>(key.address), key.subindex));
      if (key.complete_access) out.Put("complete_access", true);
      break;
    case StartupKey::Kind::kDrive:
      out.Put("drive", Hex(key.address));
      out.Put("name", Printable(step.name));
      return;
  }
  out.Put("name", Printable(step.name));
  PutValue(out, step);
}

void PutStep(JsonObject& out, const ExpectedStep& step) {
  out.Put("phase", Name(step.phase));
  PutKeyAndValue(out, step);
  if (step.succeeds) out.Put("outcome", kDone);
}

void PutPhase(JsonObject& out, const StartupPhaseSummary& phase) {
  out.Put("limit_ms", nullptr);
  if (phase.duration) out.Put("took_ms", std::round(static_cast<double>(*phase.duration) / 1e3) / 1e3);
}

std::string QuotedName(std::string_view text) {
  std::string out;
  AppendJson(out, text);
  return out;
}

/// An object on one line, which `write(JsonObject&, item)` fills.
template <typename Item>
std::string Line(void (*write)(JsonObject&, const Item&), const Item& item) {
  JsonText text(JsonText::Layout::kLine);
  text.Object([&](JsonObject& out) { write(out, item); });
  return text.Take();
}

void AppendSteps(std::string& out, const std::vector<ExpectedStep>& steps, const std::string& indent) {
  out += "\"steps\": [";
  for (std::size_t i = 0; i < steps.size(); ++i) {
    out += (i == 0 ? "\n" : ",\n") + indent + "  " + Line(PutStep, steps[i]);
  }
  out += (steps.empty() ? "]" : "\n" + indent + "]");
}

}  // namespace

Result<std::shared_ptr<const Expectation>> ReadExpectation(const std::string& path) {
  const Result<std::string> text = ReadSmallFile(path);
  if (!text) return text.error();
  std::string_view content = *text;
  if (content.starts_with("\xEF\xBB\xBF")) content.remove_prefix(3);
  const std::size_t first = content.find_first_not_of(" \t\r\n");
  if (first != std::string_view::npos && content[first] == '<') return ReadEniExpectation(path);

  const Result<JsonDocument> document = ReadJsonFile(path);
  if (!document) return document.error();
  if (!document->root().member("schema").is_text(kExpectationSchema)) {
    return Error{Printable(path) + " is neither an ENI nor an expectation (\"schema\": \"" +
                 std::string(kExpectationSchema) + "\")"};
  }
  Reader reader;
  auto expectation = std::make_shared<Expectation>(reader.Read(document->root()));
  if (reader.error()) return Error{Printable(path) + ": " + *reader.error()};
  if (ExpectsNothing(*expectation)) {
    return Error{Printable(path) + ": no slave, step or limit is listed, so nothing can be expected"};
  }
  expectation->name = std::filesystem::path(path).filename().string();
  return std::shared_ptr<const Expectation>(std::move(expectation));
}

bool IsEsi(const std::string& path) {
  constexpr std::size_t kBeginning = 64U << 10U;  // a comment may come first
  if (!system::IsFile(path)) return false;
  std::ifstream file(std::filesystem::path(path), std::ios::binary);
  std::string beginning(kBeginning, '\0');
  file.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  beginning.resize(static_cast<std::size_t>(file.gcount()));
  return beginning.find("<EtherCATInfo") != std::string::npos;
}

std::string WriteExpectation(const AnalysisResult& result) {
  const Expectation expectation = startup::ExpectationOf(result);
  std::string out = "{\n  \"schema\": " + QuotedName(kExpectationSchema) + ",\n";
  out +=
      "  \"comment\": \"name, text and took_ms are for people. A value of null fits any; limit_ms null is no limit. "
      "outcome: without it the slave need not follow. strict: steps that are not listed are wrong.\",\n";
  out += "  \"tool\": " + QuotedName("ecaudit " + std::string(Version())) + ",\n";
  out += "  \"saved_from\": " +
         QuotedName(Printable(std::filesystem::path(result.capture.file.path).filename().string())) + ",\n";
  out += "  \"strict\": false,\n  \"bus\": {";
  AppendSteps(out, expectation.bus, "    ");
  out += "},\n  \"slaves\": [";
  for (std::size_t s = 0; s < expectation.slaves.size(); ++s) {
    const ExpectedSlave& slave = expectation.slaves[s];
    out += s == 0 ? "\n    {" : ",\n    {";
    out += "\"position\": " + std::to_string(slave.position) + ", \"name\": " + QuotedName(Printable(slave.name));
    for (const auto& [key, value] :
         {std::pair("vendor_id", &slave.vendor_id), std::pair("product_code", &slave.product_code),
          std::pair("revision", &slave.revision)}) {
      if (*value) out += ", \"" + std::string(key) + "\": " + QuotedName(Hex(**value, 8));
    }
    out += ",\n     \"phases\": {";
    const std::vector<StartupPhaseSummary>& phases = result.slaves[s].startup.phases;
    for (std::size_t p = 0; p < phases.size(); ++p) {
      out +=
          (p == 0 ? "\n       " : ",\n       ") + QuotedName(Name(phases[p].phase)) + ": " + Line(PutPhase, phases[p]);
    }
    out += "},\n     ";
    AppendSteps(out, slave.steps, "     ");
    out += "}";
  }
  return out + "\n  ]\n}\n";
}

std::optional<Error> CheckSavePath(const std::string& path) {
  return CheckReplaced(path, kExpectationSchema, "an expectation");
}

}  // namespace ecaudit::cli
