#include "cli/wireshark/side_events.h"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

using Json = nlohmann::json;

std::string TextOf(const Json& event, const char* key) {
  const auto at = event.find(key);
  if (at == event.end() || at->is_null()) return {};
  return SideField(at->is_string() ? at->get<std::string>() : at->dump());
}

/// "S0", "0x1001", "" for the whole bus: as `signals` names slaves.
std::string SlaveOf(const Json& event, const SlaveNames& names) {
  if (const auto position = event.find("slave"); position != event.end() && position->is_number_unsigned()) {
    return names.Short(position->get<unsigned>());
  }
  const auto at = event.find("station_address");
  if (at == event.end() || !at->is_number_unsigned()) return {};
  return Hex(at->get<std::uint64_t>());
}

FrameNo FrameOf(const Json& event, const char* key) {
  const auto at = event.find(key);
  return at != event.end() && at->is_number_unsigned() ? at->get<FrameNo>() : 0;
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
  if (frame != written_) side_.EndFrame(section_);
  if (side_.begins_block(section_)) side_.BeginBlock(section_, frame);
  side_.Line(section_, line);
  written_ = frame;
}

void SideOrder::End() {
  while (!waiting_.empty()) WriteFirst();
}

void SideEvents::Take(std::string_view line) {
  const std::size_t tab = line.find('\t');
  if (tab == std::string_view::npos) return;
  const Json event = Json::parse(line.substr(0, tab), nullptr, false);
  if (!event.is_object()) return;
  const std::string text = SideField(line.substr(tab + 1));
  const FrameNo frame = FrameOf(event, "frame");
  const std::string type = TextOf(event, "event");
  const std::string slave = SlaveOf(event, names_);
  const std::string number = std::to_string(frame);
  if (type == "al-state") {
    const std::string state = TextOf(event, "state");
    const bool error = TextOf(event, "error") == "true";
    TakeState(frame, slave,
              number + '\t' + slave + '\t' + (state.empty() ? "?" : state + (error ? "+ERR" : "")) + '\t' +
                  TextOf(event, "status_code_text"));
  }
  std::string row = '\t' + type + '\t' + slave + '\t' + text;
  if (type != "sdo") {
    sdo_and_others_.Add(frame, number + row);
    return;
  }
  const FrameNo request = FrameOf(event, "request_frame");
  const FrameNo response = FrameOf(event, "response_frame");
  for (const char* key :
       {"service", "index", "subindex", "request_frame", "response_frame", "abort_code", "duration_ms", "text"}) {
    row += '\t' + TextOf(event, key);
  }
  for (const FrameNo at : std::set<FrameNo>{frame, request, response}) {
    if (at != 0) sdo_and_others_.Add(at, std::to_string(at) + row);
  }
}

void SideEvents::TakeState(FrameNo frame, const std::string& slave, std::string row) {
  if (frame < last_state_) {
    ++states_too_late_;
    return;
  }
  if (frame != last_state_) side_.EndFrame(SideSection::kAl);
  last_state_ = frame;
  if (side_.begins_block(SideSection::kAl)) {
    side_.BeginBlock(SideSection::kAl, frame);
    for (const auto& [name, last] : states_) side_.Context(SideSection::kAl, last);
  }
  side_.Line(SideSection::kAl, row);
  states_[slave] = std::move(row);
}

void SideEvents::On(const sync::PhaseMeasured& event) {
  if (event.slave >= network_.slaves().size()) return;
  const bus::SlaveAddress& address = network_.slaves()[event.slave];
  const SlavePos* const position = address.position.if_known();
  const StationAddress* const station = address.station.if_known();
  if (position == nullptr && station == nullptr) return;
  const std::string slave = position != nullptr ? names_.Short(*position) : Hex(*station);
  clocks_.Add(event.frame.number,
              std::to_string(event.frame.number) + '\t' + slave + '\t' + std::to_string(event.phase));
}

void SideEvents::End() {
  sdo_and_others_.End();
  clocks_.End();
}

}  // namespace ecaudit::cli
