// The text form of Trace; the language is described in trace_builder.h.
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/support/folders.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::test {

namespace fs = std::filesystem;

/// Reads one line after the other into a Trace. Functions return false after filling error_.
class TraceParser {
 public:
  Result<Trace> Text(std::string_view text);
  Result<Trace> File(const fs::path& path);

 private:
  using Words = std::vector<std::string>;

  bool Fail(std::string message) {
    error_ = std::move(message);
    return false;
  }
  bool Lines(std::string_view text);
  bool LinesOf(const fs::path& path);
  bool Include(const std::string& name);
  bool Statement(const std::string& line);
  bool Directive(const Words& words);
  bool Frame(const Words& words);
  bool OneFrame(const Words& words);
  bool Datagram(const Words& words, TraceFrame& frame);
  bool Address(Cmd command, const std::string& word, TraceDatagram& datagram);
  bool Key(const std::string& key, const std::string& value, TraceFrame& frame, TraceDatagram& datagram,
           std::size_t& length);
  bool At(const std::string& word, TraceFrame& frame, TraceDatagram* datagram);
  bool Number(std::string_view word, std::uint64_t maximum, std::uint64_t& value);
  bool Time(std::string_view word, TimeNs& ns);
  bool Byte(std::string_view word, Bytes& out);

  Trace trace_;
  std::string error_;
  std::vector<fs::path> open_;  // the file that is read, after those that include it
};

namespace {

std::vector<std::string> Split(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

std::optional<Cmd> CommandNamed(std::string name) {
  constexpr std::string_view kNames[] = {"NOP", "APRD", "APWR", "APRW", "FPRD", "FPWR", "FPRW", "BRD",
                                         "BWR", "BRW",  "LRD",  "LWR",  "LRW",  "ARMW", "FRMW"};
  for (char& c : name) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  for (std::size_t i = 0; i < std::size(kNames); ++i) {
    if (kNames[i] == name) return static_cast<Cmd>(i);
  }
  return std::nullopt;
}

}  // namespace

bool TraceParser::Number(std::string_view word, std::uint64_t maximum, std::uint64_t& value) {
  const bool hex = word.starts_with("0x") || word.starts_with("0X");
  const std::string_view digits = hex ? word.substr(2) : word;
  const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), value, hex ? 16 : 10);
  if (digits.empty() || problem != std::errc() || end != digits.data() + digits.size() || value > maximum) {
    return Fail("\"" + std::string(word) + "\" is no number up to " + std::to_string(maximum));
  }
  return true;
}

bool TraceParser::Time(std::string_view word, TimeNs& ns) {
  struct Unit {
    std::string_view name;
    TimeNs factor;
  };
  constexpr Unit kUnits[] = {{"ns", 1}, {"us", 1000}, {"ms", 1'000'000}, {"s", 1'000'000'000}};
  for (const Unit& unit : kUnits) {
    if (!word.ends_with(unit.name)) continue;
    std::uint64_t value = 0;
    const std::string_view digits = word.substr(0, word.size() - unit.name.size());
    if (!digits.empty() && digits.find_first_not_of("0123456789") == std::string_view::npos &&
        Number(digits, 1'000'000'000'000'000ULL / static_cast<std::uint64_t>(unit.factor), value)) {
      ns = static_cast<TimeNs>(value) * unit.factor;
      return true;
    }
  }
  return Fail("\"" + std::string(word) + "\" is no time such as 500us");
}

bool TraceParser::Byte(std::string_view word, Bytes& out) {
  std::uint8_t value = 0;
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value, 16);
  if (word.size() != 2 || problem != std::errc() || end != word.data() + word.size()) {
    return Fail("\"" + std::string(word) + "\" is no byte of two hexadecimal digits");
  }
  out.push_back(value);
  return true;
}

bool TraceParser::Address(Cmd command, const std::string& word, TraceDatagram& datagram) {
  std::uint64_t first = 0;
  std::uint64_t second = 0;
  if (samples::CmdIsLogical(command)) {
    if (!Number(word, 0xFFFFFFFF, first)) return false;
    datagram.adp = static_cast<std::uint16_t>(first & 0xFFFFU);
    datagram.ado = static_cast<std::uint16_t>(first >> 16U);
    return true;
  }
  const std::size_t colon = word.find(':');
  const bool broadcast = command == Cmd::BRD || command == Cmd::BWR || command == Cmd::BRW;
  if (colon == std::string::npos) {
    if (!broadcast) return Fail("\"" + word + "\" is no address of the form FIRST:ESC");
    if (!Number(word, 0xFFFF, second)) return false;
  } else {
    if (!Number(std::string_view(word).substr(0, colon), 0xFFFF, first)) return false;
    if (!Number(std::string_view(word).substr(colon + 1), 0xFFFF, second)) return false;
  }
  const bool position = samples::CmdCountsSlaves(command) && !broadcast;
  datagram.adp = static_cast<std::uint16_t>(position ? 0x10000U - first : first);
  datagram.ado = static_cast<std::uint16_t>(second);
  return true;
}

bool TraceParser::Key(const std::string& key, const std::string& value, TraceFrame& frame, TraceDatagram& datagram,
                      std::size_t& length) {
  if (key == "mark") {
    frame.mark_ = value;
    return true;
  }
  if (key == "rtt") return Time(value, frame.rtt_);
  std::uint64_t number = 0;
  if (!Number(value, key == "idx" ? 0xFF : 0xFFFF, number)) return false;
  const auto word = static_cast<std::uint16_t>(number);
  if (key == "wkc") {
    datagram.wkc = word;
  } else if (key == "swkc") {
    datagram.sent_wkc = word;
  } else if (key == "idx") {
    datagram.index = static_cast<std::uint8_t>(number);
  } else if (key == "irq") {
    datagram.irq = word;
  } else if (key == "sirq") {
    datagram.sent_irq = word;
  } else if (key == "adp") {
    datagram.adp = word;
  } else if (key == "radp") {
    datagram.returned_adp = word;
  } else if (key == "len" && number <= 2047) {
    length = number;
  } else if (key == "vlan") {
    frame.around_.vlan_tags = {word};
  } else if (key == "port" && number < 12) {
    frame.around_.esl = samples::EslTag{.port = static_cast<std::uint8_t>(number)};
  } else {
    return Fail("\"" + key + "=" + value + "\" is not known");
  }
  return true;
}

bool TraceParser::At(const std::string& word, TraceFrame& frame, TraceDatagram* datagram) {
  if (word == "@lost" || word == "@out-only") {
    frame.copies_ = Copies::kOutbound;
  } else if (word == "@returned-only") {
    frame.copies_ = Copies::kReturned;
  } else if (word == "@missed") {
    frame.copies_ = Copies::kNone;
  } else if (word == "@twice") {
    frame.twice_ = true;
  } else if (word == "@no-time") {
    frame.has_time_ = false;
  } else if (word == "@circulating" && datagram != nullptr) {
    datagram->circulating = true;
  } else if (word.starts_with("@cut=")) {
    std::uint64_t number = 0;
    if (!Number(std::string_view(word).substr(5), 0xFFFF, number)) return false;
    frame.cut_ = number;
  } else {
    return Fail("\"" + word + "\" is not known");
  }
  return true;
}

bool TraceParser::Datagram(const Words& words, TraceFrame& frame) {
  if (words.empty()) return Fail("a datagram is missing beside \"&\"");
  const std::optional<Cmd> command = CommandNamed(words[0]);
  if (!command) return Fail("\"" + words[0] + "\" is no command");
  TraceDatagram datagram;
  datagram.command = *command;
  std::size_t next = 1;
  const bool has_address = next < words.size() && (*command != Cmd::NOP || words[next].find(':') != std::string::npos);
  if (!has_address && *command != Cmd::NOP) return Fail("the address is missing");
  if (has_address && !Address(*command, words[next++], datagram)) return false;

  Bytes before;
  Bytes after;
  bool arrow = false;
  bool in_data = true;
  std::size_t length = 0;
  for (; next < words.size(); ++next) {
    const std::string& word = words[next];
    const std::size_t equals = word.find('=');
    if (word[0] == '@') {
      in_data = false;
      if (!At(word, frame, &datagram)) return false;
    } else if (equals != std::string::npos) {
      in_data = false;
      if (!Key(word.substr(0, equals), word.substr(equals + 1), frame, datagram, length)) return false;
    } else if (!in_data) {
      return Fail("\"" + word + "\" stands behind the data");
    } else if (word == "->") {
      if (arrow) return Fail("\"->\" stands there twice");
      arrow = true;
    } else if (word.starts_with("time+")) {
      std::uint64_t value = 0;
      if (!Number(std::string_view(word).substr(5), UINT64_MAX, value)) return false;
      value += static_cast<std::uint64_t>(frame.at_);
      for (unsigned i = 0; i < 8; ++i) (arrow ? after : before).push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    } else if (!Byte(word, arrow ? after : before)) {
      return false;
    }
  }

  const bool returned_only = !samples::CmdWrites(*command) || *command == Cmd::ARMW || *command == Cmd::FRMW;
  if (arrow) {
    datagram.sent = before;
    datagram.returned = after;
  } else if (returned_only && *command != Cmd::NOP) {
    datagram.returned = before;
  } else {
    datagram.sent = before;
    datagram.returned = before;
  }
  datagram.sent.resize(std::max(datagram.sent.size(), length), 0);
  frame.Add(std::move(datagram));
  return true;
}

bool TraceParser::Frame(const Words& words) {
  Words once;
  std::uint64_t times = 1;
  for (const std::string& word : words) {
    if (!word.starts_with("times=")) {
      once.push_back(word);
    } else if (!Number(std::string_view(word).substr(6), 100'000, times)) {
      return false;
    }
  }
  for (std::uint64_t i = 0; i < times; ++i) {
    if (!OneFrame(once)) return false;
  }
  return true;
}

bool TraceParser::OneFrame(const Words& words) {
  const bool relative = words[0][0] == '+';
  TimeNs ns = 0;
  if (!Time(relative ? std::string_view(words[0]).substr(1) : std::string_view(words[0]), ns)) return false;
  if (words.size() < 2) return Fail("the datagram is missing");
  TraceFrame& frame = trace_.New(relative ? trace_.settings_.at_ + ns : ns);

  if (words[1] == "RAW" || words[1] == "OTHER") {
    // An ARP request, the commonest foreign packet on a bus.
    Bytes bytes{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x00, 0x11, 0x22, 0x33, 0x44, 0x55, 0x08, 0x06,
                0x00, 0x01, 0x08, 0x00, 0x06, 0x04, 0x00, 0x01, 0x00, 0x11, 0x22, 0x33, 0x44, 0x55,
                0x0A, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x0A, 0x00, 0x00, 0x02};
    if (words[1] == "RAW") bytes.clear();
    for (std::size_t i = 2; i < words.size(); ++i) {
      if (words[i][0] == '@') {
        if (!At(words[i], frame, nullptr)) return false;
      } else if (words[i].starts_with("mark=")) {
        frame.mark_ = words[i].substr(5);
      } else if (!Byte(words[i], bytes)) {
        return false;
      }
    }
    frame.raw_ = std::move(bytes);
    return true;
  }
  if (words[1] == "RETURN") {
    if (words.size() != 3) return Fail("RETURN takes the mark of one frame");
    for (const TraceFrame& other : trace_.frames_) {
      if (other.mark_ == words[2]) {
        frame.return_of_ = words[2];
        return true;
      }
    }
    return Fail("no frame above is marked \"" + words[2] + "\"");
  }

  Words part;
  for (std::size_t i = 1; i < words.size(); ++i) {
    if (words[i] != "&") {
      part.push_back(words[i]);
      continue;
    }
    if (!Datagram(part, frame)) return false;
    part.clear();
  }
  return Datagram(part, frame);
}

bool TraceParser::Directive(const Words& words) {
  TraceFrame& settings = trace_.settings_;
  const std::string& name = words[0];
  const auto wants = [&](std::size_t count) {
    return words.size() == count + 1 ||
           Fail(name + " takes " + std::to_string(count) + (count == 1 ? " word" : " words"));
  };
  std::uint64_t number = 0;
  if (name == "@slaves") {
    if (words.size() < 2) return Fail("@slaves takes a number");
    if (!Number(words[1], 0xFFFF, number)) return false;
    settings.slaves_ = static_cast<std::uint16_t>(number);
    for (std::size_t i = 2; i < words.size(); ++i) {
      const std::size_t equals = words[i].find('=');
      if (equals == std::string::npos) return Fail("\"" + words[i] + "\" is not of the form key=value");
      trace_.attributes_[words[i].substr(0, equals)] = words[i].substr(equals + 1);
    }
    return true;
  }
  if (name == "@ack") {
    if (words.size() != 2 || !words[1].starts_with("wkc=")) return Fail("@ack takes wkc=N or wkc=auto");
    if (words[1] == "wkc=auto") {
      settings.default_wkc_.reset();
      return true;
    }
    if (!Number(std::string_view(words[1]).substr(4), 0xFFFF, number)) return false;
    settings.default_wkc_ = static_cast<std::uint16_t>(number);
    return true;
  }
  if (name == "@mac") {
    if (!wants(1)) return false;
    Bytes bytes;
    std::string spaced = words[1];
    for (char& c : spaced) c = c == ':' ? ' ' : c;
    for (const std::string& word : Split(spaced)) {
      if (!Byte(word, bytes)) return false;
    }
    if (bytes.size() != settings.mac_.size()) return Fail("\"" + words[1] + "\" is no MAC address");
    std::copy(bytes.begin(), bytes.end(), settings.mac_.begin());
    return true;
  }
  if (name == "@include") return wants(1) && Include(words[1]);
  if (name == "@rtt") return wants(1) && Time(words[1], settings.rtt_);
  if (name == "@resolution") {
    if (!wants(1) || !Time(words[1], settings.resolution_)) return false;
    return settings.resolution_ > 0 || Fail("@resolution takes a time above 0");
  }
  if (name == "@vlan") {
    if (!wants(1) || !Number(words[1], 0xFFFF, number)) return false;
    settings.around_.vlan_tags = {static_cast<std::uint16_t>(number)};
    return true;
  }
  if (!wants(0)) return false;
  if (name == "@out-only") {
    settings.copies_ = Copies::kOutbound;
  } else if (name == "@returned-only") {
    settings.copies_ = Copies::kReturned;
  } else if (name == "@both") {
    settings.copies_ = Copies::kBoth;
  } else if (name == "@no-time") {
    settings.has_time_ = false;
  } else if (name == "@time") {
    settings.has_time_ = true;
  } else if (name == "@two-interfaces") {
    settings.two_interfaces_ = true;
  } else if (name == "@udp") {
    settings.around_.udp = true;
  } else if (name == "@cooked") {
    settings.around_.link = samples::Link::kCooked;
  } else if (name == "@cooked2") {
    settings.around_.link = samples::Link::kCooked2;
  } else if (name == "@ethernet") {
    settings.around_ = {};
  } else {
    return Fail("\"" + name + "\" is no directive");
  }
  return true;
}

bool TraceParser::Statement(const std::string& line) {
  const Words words = Split(line);
  if (words.empty()) return true;
  return words[0][0] == '@' ? Directive(words) : Frame(words);
}

bool TraceParser::Lines(std::string_view text) {
  std::istringstream stream{std::string(text)};
  std::string statement;
  int statement_line = 0;
  int line_number = 0;
  const auto flush = [&] {
    const bool good = Statement(statement);
    statement.clear();
    return good || Fail("line " + std::to_string(statement_line) + ": " + error_);
  };
  bool goes_on = false;
  for (std::string line; std::getline(stream, line);) {
    ++line_number;
    line = line.substr(0, line.find('#'));
    const Words words = Split(line);
    if (words.empty()) continue;
    if (!goes_on && words.front() != "&") {
      if (!flush()) return false;
      statement_line = line_number;
    }
    statement += " " + line;
    goes_on = words.back() == "&";
  }
  return flush();
}

bool TraceParser::LinesOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || fs::is_directory(path)) return Fail("no such file: " + path.string());
  std::ostringstream text;
  text << file.rdbuf();
  open_.push_back(path);
  const bool good = Lines(text.str());
  open_.pop_back();
  return good || Fail(path.string() + ": " + error_);
}

bool TraceParser::Include(const std::string& name) {
  const fs::path common = fs::path(SourceDir()) / "tests" / "rules" / "common";
  fs::path path = open_.empty() ? common / name : open_.back().parent_path() / name;
  if (!fs::exists(path)) path = common / name;
  path = path.lexically_normal();
  if (!fs::exists(path)) {
    const std::string beside = open_.empty() ? "" : "neither beside this file nor ";
    return Fail("no file \"" + name + "\" to include " + beside + "in tests/rules/common");
  }
  const auto begin = std::find_if(open_.begin(), open_.end(), [&](const fs::path& open) {
    std::error_code problem;
    return fs::equivalent(open, path, problem);
  });
  if (begin != open_.end()) {
    std::string circle;
    for (auto file = begin; file != open_.end(); ++file) circle += file->filename().string() + " -> ";
    return Fail("the file includes itself: " + circle + path.filename().string());
  }
  return LinesOf(path);
}

Result<Trace> TraceParser::Text(std::string_view text) {
  if (!Lines(text)) return Error{error_};
  return std::move(trace_);
}

Result<Trace> TraceParser::File(const fs::path& path) {
  if (!LinesOf(path)) return Error{error_};
  return std::move(trace_);
}

Result<Trace> Trace::Parse(std::string_view text) {
  return TraceParser().Text(text);
}

Result<Trace> Trace::Load(const std::string& path) {
  return TraceParser().File(path);
}

}  // namespace ecaudit::test
