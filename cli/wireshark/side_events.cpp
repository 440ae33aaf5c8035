#include "cli/wireshark/side_events.h"

#include <algorithm>
#include <optional>
#include <set>

#include "cli/stream/json_line.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

/// "S0", "0x1001", "" for the whole bus: as `signals` names slaves.
std::string SlaveName(const std::optional<SlavePos>& position, const std::optional<StationAddress>& station,
                      const SlaveNames& names) {
  if (position) return names.Short(*position);
  return station ? Hex(*station) : std::string();
}

/// A value as a field of a line; empty when it is null, or there is none.
std::string FieldText(const EventRecord& row, std::string_view key) {
  const RowField* const field = row.fields.Find(key);
  std::string text;
  if (field == nullptr) return text;
  switch (field->kind) {
    case RowField::Kind::kNull:
      break;
    case RowField::Kind::kNatural:
      AppendNumber(text, field->natural);
      break;
    case RowField::Kind::kInteger:
      AppendNumber(text, field->integer);
      break;
    case RowField::Kind::kReal:
      AppendJsonNumber(text, field->real);
      break;
    case RowField::Kind::kBool:
      text = field->natural != 0 ? "true" : "false";
      break;
    case RowField::Kind::kBytes:
      AppendHexBytes(text, row.fields.BytesOf(*field));
      break;
    case RowField::Kind::kText:
    case RowField::Kind::kJson:
      return SideField(row.fields.TextOf(*field));
  }
  return text;
}

bool IsTrue(const EventRecord& row, std::string_view key) {
  const RowField* const field = row.fields.Find(key);
  return field != nullptr && field->kind == RowField::Kind::kBool && field->natural != 0;
}

/// 0: not in the capture.
FrameNo FrameOf(const EventRecord& row, std::string_view key) {
  const RowField* const field = row.fields.Find(key);
  return field != nullptr && field->kind == RowField::Kind::kNatural ? field->natural : 0;
}

}  // namespace

void SideOrder::Add(FrameNo frame, std::string line) {
  if (frame == 0) return;
  if (frame < written_) {
    ++too_late_;
    return;
  }
  if (wait_ == 0) return Write(frame, line);
  newest_ = std::max(newest_, frame);
  waiting_.insert({frame, number_++, std::move(line)});
  while (waiting_.size() > kMostWaiting || (!waiting_.empty() && waiting_.begin()->frame + wait_ < newest_)) {
    WriteFirst();
  }
}

void SideOrder::WriteFirst() {
  Write(waiting_.begin()->frame, waiting_.begin()->line);
  waiting_.erase(waiting_.begin());
}

void SideOrder::Write(FrameNo frame, std::string_view line) {
  write_(frame, line);
  written_ = frame;
}

void SideOrder::End() {
  while (!waiting_.empty()) WriteFirst();
}

void SideEvents::Row(const EventRecord& row) {
  const FrameNo frame = row.frame.number;
  const std::string slave = SlaveName(row.slave, row.station, names_);
  const std::string number = std::to_string(frame);
  if (row.type == EventType::kAlState) {
    const std::string state = FieldText(row, "state");
    states_.Add(frame, number + '\t' + slave + '\t' +
                           (state.empty() ? "?" : state + (IsTrue(row, "error") ? "+ERR" : "")) + '\t' +
                           FieldText(row, "status_code_text"));
  }
  std::string rest = '\t' + std::string(Name(row.type)) + '\t' + slave + '\t' + SideField(row.text);
  if (row.type != EventType::kSdo) {
    sdo_and_others_.Add(frame, number + rest);
    return;
  }
  for (const char* key :
       {"service", "index", "subindex", "request_frame", "response_frame", "abort_code", "duration_ms", "text"}) {
    rest += '\t' + FieldText(row, key);
  }
  // Once in each of its frames.
  for (const FrameNo at : std::set<FrameNo>{frame, FrameOf(row, "request_frame"), FrameOf(row, "response_frame")}) {
    sdo_and_others_.Add(at, std::to_string(at) + rest);
  }
}

void SideEvents::Write(SideSection section, FrameNo frame, std::string_view line) {
  FrameNo& written = written_[static_cast<std::size_t>(section)];
  if (frame != written) side_.EndFrame(section);
  if (side_.begins_block(section)) side_.BeginBlock(section, frame);
  side_.Line(section, line);
  written = frame;
}

void SideEvents::WriteState(FrameNo frame, std::string_view line) {
  FrameNo& written = written_[static_cast<std::size_t>(SideSection::kAl)];
  if (frame != written) side_.EndFrame(SideSection::kAl);
  if (side_.begins_block(SideSection::kAl)) {
    side_.BeginBlock(SideSection::kAl, frame);
    for (const auto& [slave, last] : last_state_lines_) side_.Context(SideSection::kAl, last);
  }
  side_.Line(SideSection::kAl, line);
  written = frame;
  const std::size_t slave = line.find('\t') + 1;
  last_state_lines_.insert_or_assign(std::string(line.substr(slave, line.find('\t', slave) - slave)),
                                     std::string(line));
}

void SideEvents::On(const sync::PhaseMeasured& event) {
  if (event.slave >= network_.slaves().size()) return;
  const bus::SlaveAddress& address = network_.slaves()[event.slave];
  const SlavePos* const position = address.position.if_known();
  const StationAddress* const station = address.station.if_known();
  if (position == nullptr && station == nullptr) return;
  const std::string slave = SlaveName(position != nullptr ? std::optional(*position) : std::nullopt,
                                      station != nullptr ? std::optional(*station) : std::nullopt, names_);
  clocks_.Add(event.frame.number,
              std::to_string(event.frame.number) + '\t' + slave + '\t' + std::to_string(event.phase));
}

void SideEvents::End() {
  states_.End();
  sdo_and_others_.End();
  clocks_.End();
}

}  // namespace ecaudit::cli
