#include "cli/stream/signal_columns.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>

#include "analyzers/model/drive_axes.h"
#include "analyzers/objects/object_words.h"
#include "analyzers/signals/signal_value.h"
#include "cli/report/layout.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

using device::PdoDirection;

constexpr std::size_t kMaxPassedOver = 8;

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

/// Who a part belongs to.
void SetSlave(const model::ImagePart& part, const track::Network& network, const SlaveNames& names,
              SignalColumn& column) {
  if (part.slave != kNoSlave) {
    const bus::SlaveAddress& address = network.slaves()[part.slave];
    if (const SlavePos* position = address.position.if_known()) column.position = *position;
    if (const StationAddress* station = address.station.if_known()) column.station = *station;
  } else if (part.model->eni != nullptr) {
    column.position = part.model->eni->position();
    column.station = part.model->eni->station_address;
  }
  column.slave = column.position ? names.Short(*column.position) : column.station ? Hex(*column.station) : "S?";
  column.slave_name = part.model->name;
}

std::string Key(const SignalColumn& c) {
  std::string key = c.slave;
  const auto number = [&key](std::uint32_t value) { key.append(1, ' ').append(std::to_string(value)); };
  number(static_cast<std::uint32_t>(c.kind));
  number(static_cast<std::uint32_t>(c.direction));
  number(c.pdo);
  number(std::uint32_t{c.index} << 8U | c.subindex);
  number(c.bits);
  number(c.repetition);
  if (c.kind == ColumnKind::kDatagram) key.append(1, ' ').append(c.name);
  return key;
}

std::string BaseHeader(const SignalColumn& c, bool scaled) {
  std::string header = !c.variable.empty() ? c.variable : c.slave.empty() ? c.name : c.slave + "." + c.name;
  if (c.kind == ColumnKind::kRaw) return header + " (hex)";
  if (c.kind == ColumnKind::kDatagram)
    return header + (c.direction == PdoDirection::kRx ? " sent (hex)" : " returned (hex)");
  if (c.kind != ColumnKind::kSignal) return header;
  // A number that still has its scale on it is none of that unit.
  if (!c.unit.empty() && (scaled || c.scale.empty() || c.divisor == 1.0)) header += " [" + c.unit + "]";
  return header;
}

}  // namespace

bool MatchesPattern(std::string_view pattern, std::string_view text) {
  // The last * seen takes one character more whenever what follows it does not fit.
  std::size_t p = 0;
  std::size_t t = 0;
  std::size_t star = std::string_view::npos;
  std::size_t resume = 0;
  while (t < text.size()) {
    if (p < pattern.size() && (pattern[p] == '?' || (pattern[p] != '*' && pattern[p] == text[t]))) {
      ++p;
      ++t;
    } else if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      resume = t;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      t = ++resume;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

Result<std::vector<std::string>> SignalChoice::ParsePatterns(const std::vector<std::string>& texts) {
  std::vector<std::string> patterns;
  for (const std::string& text : texts) {
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(',', begin), text.size());
      std::string pattern = LowerCase(std::string_view(text).substr(begin, end - begin));
      if (pattern.empty()) return Error{"--signal is '" + text + "' but must be names or objects such as 6041h"};
      patterns.push_back(std::move(pattern));
      begin = end + 1;
    }
  }
  return patterns;
}

std::vector<std::string> SignalColumns::unmatched() const {
  std::vector<std::string> patterns;
  for (std::size_t i = 0; i < matched_.size(); ++i) {
    if (!matched_[i]) patterns.push_back(choice_.patterns[i]);
  }
  return patterns;
}

bool SignalColumns::Wants(const SignalColumn& column) {
  if (choice_.patterns.empty()) return true;
  std::vector<std::string> names{LowerCase(column.name)};
  if (!column.slave.empty()) names.push_back(LowerCase(column.slave) + "." + names.front());
  if (!column.variable.empty()) names.push_back(LowerCase(column.variable));
  if (column.index != 0) {
    const std::string hex = LowerCase(Hex(column.index));
    const std::string sub = ":" + std::to_string(column.subindex);
    for (const std::string& object : {hex, hex.substr(2) + "h", hex.substr(2)}) {
      names.push_back(object);
      names.push_back(object + sub);
    }
  }
  bool wanted = false;
  for (std::size_t i = 0; i < choice_.patterns.size(); ++i) {
    const bool matches =
        std::ranges::any_of(names, [&](const std::string& name) { return MatchesPattern(choice_.patterns[i], name); });
    if (matches) matched_[i] = wanted = true;
  }
  if (wanted) return true;
  if (passed_over_.size() < kMaxPassedOver && std::ranges::find(passed_over_, column.name) == passed_over_.end()) {
    passed_over_.push_back(column.name);
  }
  return false;
}

std::uint32_t SignalColumns::Find(SignalColumn column) {
  const auto [found, added] = by_key_.try_emplace(Key(column), static_cast<std::uint32_t>(columns_.size()));
  if (!added) {
    // What becomes known later counts for the whole column.
    if (found->second == PartColumns::kNone || finished_) return found->second;
    SignalColumn& known = columns_[found->second];
    if (known.name_inferred && !column.name_inferred) {
      known.name = column.name;
      known.name_inferred = false;
    }
    if (known.type == mailbox::DataType::kUnknown) known.type = column.type;
    return found->second;
  }
  if (finished_ || columns_.size() >= kMaxColumns) {
    full_ = !finished_;
    found->second = PartColumns::kNone;
    return PartColumns::kNone;
  }
  columns_.push_back(std::move(column));
  return found->second;
}

const PartColumns& SignalColumns::Of(const model::ImagePart& part, const track::Network& network) {
  if (parts_.size() >= kMaxParts && !parts_.contains(part.serial)) parts_.clear();
  const auto [entry, added] = parts_.try_emplace(part.serial);
  PartColumns& result = entry->second;
  if (!added) return result;

  SignalColumn common;
  SetSlave(part, network, names_, common);
  common.direction = part.direction;
  common.source = part.layout->source;
  if (part.places.empty()) {
    common.kind = ColumnKind::kRaw;
    common.name = part.direction == PdoDirection::kRx ? "outputs" : "inputs";
    common.reason = !part.reason.empty()           ? part.reason
                    : !part.layout->reason.empty() ? part.layout->reason
                                                   : "no PDO is assigned";
    if (Wants(common)) result.raw = Find(std::move(common));
    return result;
  }
  std::map<std::tuple<std::uint16_t, std::uint32_t, std::uint16_t>, std::uint16_t> seen;
  for (std::size_t i = 0; i < part.places.size(); ++i) {
    const model::ImagePart::Place& place = part.places[i];
    const model::Signal& signal = part.layout->signals[place.signal];
    SignalColumn column = common;
    column.pdo = signal.pdo;
    column.index = signal.index;
    column.subindex = signal.subindex;
    column.bits = signal.bits;
    column.repetition = seen[{signal.pdo, place.object, signal.bits}]++;
    column.name = report::OneLine(signal.name);
    column.name_inferred = signal.name_inferred;
    column.variable = report::OneLine(signal.variable);
    if (column.name.empty()) column.name = ObjectName(signal.index, signal.subindex);
    column.type = signal.type;
    column.unit = report::OneLine(signal.unit);
    column.scale = report::OneLine(signal.scale);
    if (choice_.scaled) column.divisor = signals::DivisorOf(signal.scale).value_or(1.0);
    if (!Wants(column)) continue;
    PartColumns::Signal filled;
    filled.place = static_cast<std::uint32_t>(i);
    const auto axis = model::DriveAxes::AxisOfWord(signal.index, signal.subindex, signal.bits);
    const bool word = axis.has_value();
    const bool described = !word && events::HasWords(*part.model->profile, signal.index, signal.subindex);
    const bool status = word && signal.index == model::ObjectOfAxis(model::kStatusWord, *axis);
    if (choice_.states && ((word && part.model->profile->drive) || described)) {
      SignalColumn extra = column;
      extra.kind = described ? ColumnKind::kMeaning : status ? ColumnKind::kDriveState : ColumnKind::kDriveCommand;
      const std::string_view what = described ? " meaning" : status ? " state" : " command";
      extra.name += what;
      if (!extra.variable.empty()) extra.variable += what;
      filled.column = Find(std::move(column));
      filled.extra = Find(std::move(extra));
    } else {
      filled.column = Find(std::move(column));
    }
    if (filled.column != PartColumns::kNone) result.signals.push_back(filled);
  }
  return result;
}

std::uint32_t SignalColumns::OfDatagram(const track::LogicalAccess& access, bool returned, const std::string& reason) {
  SignalColumn column;
  column.kind = ColumnKind::kDatagram;
  column.name =
      std::string(wire::Name(access.command)) + " " + Hex(access.address, 8) + " " + Count(access.length, "byte");
  column.direction = returned ? PdoDirection::kTx : PdoDirection::kRx;
  column.reason = reason;
  if (!Wants(column)) return PartColumns::kNone;
  return Find(std::move(column));
}

void SignalColumns::Finish() {
  std::vector<std::uint32_t> order(columns_.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto rank = [this](std::uint32_t i) {
    const SignalColumn& c = columns_[i];
    const bool datagram = c.kind == ColumnKind::kDatagram;
    return std::tuple(datagram, !c.position, c.position.value_or(c.station.value_or(0)),
                      datagram ? c.name : std::string(), c.direction);
  };
  std::ranges::stable_sort(order, [&](std::uint32_t a, std::uint32_t b) { return rank(a) < rank(b); });
  std::vector<SignalColumn> sorted;
  place_.resize(columns_.size());
  for (const std::uint32_t i : order) {
    place_[i] = static_cast<std::uint32_t>(sorted.size());
    sorted.push_back(std::move(columns_[i]));
  }
  columns_ = std::move(sorted);
  for (auto& [key, column] : by_key_) {
    if (column != PartColumns::kNone) column = place_[column];
  }

  const auto count = [this] {
    std::map<std::string, std::size_t> headers;
    for (const SignalColumn& column : columns_) ++headers[column.header];
    return headers;
  };
  for (SignalColumn& column : columns_) column.header = BaseHeader(column, choice_.scaled);
  const auto twice = count();
  for (SignalColumn& column : columns_) {
    if (twice.at(column.header) > 1 && column.pdo != 0) column.header += " (" + ObjectName(column.pdo) + ")";
  }
  std::map<std::string, std::size_t> used;
  for (SignalColumn& column : columns_) {
    const std::size_t number = ++used[column.header];
    if (number > 1) column.header += " #" + std::to_string(number);
  }
  finished_ = true;
}

}  // namespace ecaudit::cli
