#include "samples/builder/scripted_master.h"

#include <algorithm>
#include <utility>

namespace ecaudit::samples {
namespace {

constexpr TimeNs kRoom = 150'000;  // an acyclic frame starts only if the next process-data frame is further away

Datagram Make(Cmd command, std::uint16_t adp, std::uint16_t ado, Bytes data) {
  Datagram d;
  d.command = command;
  d.adp = adp;
  d.ado = ado;
  d.data = std::move(data);
  return d;
}

std::uint16_t AutoIncrement(std::size_t position) {
  return static_cast<std::uint16_t>(0x10000U - position);
}

}  // namespace

MasterHabits SoemHabits() {
  return {};
}

MasterHabits TwinCatHabits() {
  MasterHabits habits;
  habits.mac = {0x00, 0x00, 0x00, 0x00, 0x00, 0x00};
  habits.first_station = 0x03E9;
  habits.logical_base = 0x01000000;
  habits.always_acknowledges = false;
  habits.counts_index_per_datagram = true;
  return habits;
}

ScriptedMaster::ScriptedMaster(SimulatedBus& bus, Recorder& recorder, TimeNs start, MasterHabits habits)
    : bus_(bus), recorder_(recorder), habits_(habits), now_(start) {}

// ---------------------------------------------------------------------------------------------- time

void ScriptedMaster::WaitUntil(TimeNs time) {
  while (running_) {
    const auto change = changes_.find(cycle_number_);
    const TimeNs shift = change == changes_.end() ? 0 : change->second.shift;
    const TimeNs due = first_cycle_ + cycles_since_start_ * task_.cycle + shift;
    if (due > time) break;
    now_ = std::max(now_, due + jitter_.Next(habits_.wake_jitter));
    RunCycle();
  }
  now_ = std::max(now_, time);
}

// Process data have priority: an acyclic frame waits when the next cycle is near.
void ScriptedMaster::MakeRoom() {
  if (!running_) return;
  const TimeNs due = first_cycle_ + cycles_since_start_ * task_.cycle;
  if (now_ + kRoom > due) WaitUntil(due);
  now_ = std::max(now_, ready_at_);
}

// ---------------------------------------------------------------------------------------------- frames

void ScriptedMaster::NumberDatagrams(std::vector<Datagram>& datagrams) {
  if (!habits_.counts_index_per_datagram) {
    for (Datagram& d : datagrams) d.index = index_;
    index_ = static_cast<std::uint8_t>((index_ + 1) % 16);
    return;
  }
  // As TwinCAT: the first datagram of a frame counts 0x80-0xEE, the others carry 0.
  index_ = static_cast<std::uint8_t>(index_ < 0x80 || index_ >= 0xEE ? 0x80 : index_ + 1);
  datagrams.front().index = index_;
}

std::optional<std::vector<Datagram>> ScriptedMaster::SendOnce(const std::vector<Datagram>& datagrams, FrameIds& ids) {
  EtherCatFrame frame;
  frame.source = habits_.mac;
  frame.datagrams = datagrams;
  ids = {};
  ids.sent = recorder_.Frame(frame, now_, false);
  SimulatedBus::Result result = bus_.Pass(std::move(frame), now_);
  if (lose_next_ > 0) {
    --lose_next_;
    return std::nullopt;
  }
  if (circulate_next_) {
    circulate_next_ = false;
    for (Datagram& d : result.frame.datagrams) d.circulating = true;
  }
  ids.returned = recorder_.Frame(result.frame, result.at, true);
  if (double_next_) {
    double_next_ = false;
    ids.again = recorder_.Frame(result.frame, result.at + 12'000, true);
    result.at += 12'000;
  }
  now_ = result.at;
  ready_at_ = now_ + habits_.think_time;
  return std::move(result.frame.datagrams);
}

std::vector<Answer> ScriptedMaster::Exchange(std::vector<Datagram> datagrams) {
  MakeRoom();
  NumberDatagrams(datagrams);
  std::vector<Answer> answers(datagrams.size());
  for (int attempt = 0; attempt < habits_.attempts; ++attempt) {
    FrameIds ids;
    std::optional<std::vector<Datagram>> back = SendOnce(datagrams, ids);
    for (std::size_t i = 0; i < answers.size(); ++i) {
      answers[i].frame = ids;
      answers[i].lost = !back;
      if (!back) continue;
      answers[i].data = std::move((*back)[i].data);
      answers[i].wkc = (*back)[i].wkc;
      answers[i].adp = (*back)[i].adp;
    }
    if (back) break;
    Wait(habits_.frame_timeout);
  }
  Wait(habits_.think_time);
  return answers;
}

Answer ScriptedMaster::One(Cmd command, std::uint16_t adp, std::uint16_t ado, Bytes data) {
  return Exchange({Make(command, adp, ado, std::move(data))}).front();
}
Answer ScriptedMaster::Aprd(std::size_t position, std::uint16_t ado, std::size_t length) {
  return One(Cmd::APRD, AutoIncrement(position), ado, Bytes(length, 0));
}
Answer ScriptedMaster::Apwr(std::size_t position, std::uint16_t ado, Bytes data) {
  return One(Cmd::APWR, AutoIncrement(position), ado, std::move(data));
}
Answer ScriptedMaster::Fprd(std::uint16_t station, std::uint16_t ado, std::size_t length) {
  return One(Cmd::FPRD, station, ado, Bytes(length, 0));
}
Answer ScriptedMaster::Fpwr(std::uint16_t station, std::uint16_t ado, Bytes data) {
  return One(Cmd::FPWR, station, ado, std::move(data));
}
Answer ScriptedMaster::Brd(std::uint16_t ado, std::size_t length) {
  return One(Cmd::BRD, 0, ado, Bytes(length, 0));
}
Answer ScriptedMaster::Bwr(std::uint16_t ado, Bytes data) {
  return One(Cmd::BWR, 0, ado, std::move(data));
}

PacketId ScriptedMaster::Foreign(Bytes packet) {
  MakeRoom();
  const PacketId id = recorder_.Raw(std::move(packet), now_);
  Wait(habits_.think_time);
  return id;
}

// ---------------------------------------------------------------------------------------------- cyclic task

void ScriptedMaster::StartCyclic(CyclicTask task) {
  task_ = std::move(task);
  first_cycle_ = now_ + task_.cycle;
  cycles_since_start_ = 0;
  running_ = true;
}

void ScriptedMaster::Cycles(int count) {
  for (int i = 0; i < count && running_; ++i) {
    const int number = cycle_number_;
    while (cycle_number_ == number) {
      const auto change = changes_.find(number);
      WaitUntil(first_cycle_ + cycles_since_start_ * task_.cycle +
                (change == changes_.end() ? 0 : change->second.shift));
    }
  }
}

void ScriptedMaster::SetOutputs(std::size_t position, Bytes outputs) {
  outputs_[position] = std::move(outputs);
}

Bytes ScriptedMaster::inputs(std::size_t position) const {
  const Image& image = image_.at(position);
  if (last_image_.size() < image.input_offset + image.input_bytes) return Bytes(image.input_bytes, 0);
  const auto begin = last_image_.begin() + static_cast<std::ptrdiff_t>(image.input_offset);
  return {begin, begin + image.input_bytes};
}

void ScriptedMaster::RunCycle() {
  if (task_.before_cycle) task_.before_cycle(cycle_number_);
  CycleChange change;
  if (const auto found = changes_.find(cycle_number_); found != changes_.end()) change = found->second;
  ++cycle_number_;
  ++cycles_since_start_;
  if (change.skip) return;

  std::size_t size = 0;
  for (const Image& image : image_) size += std::size_t{image.output_bytes} + image.input_bytes;
  Datagram lrw = Make(Cmd::LRW, 0, 0, Bytes(size, 0));
  lrw.set_logical(habits_.logical_base);
  for (const auto& [position, bytes] : outputs_) {
    if (position >= image_.size()) continue;
    for (std::size_t i = 0; i < bytes.size() && i < image_[position].output_bytes; ++i) {
      lrw.data[image_[position].output_offset + i] = bytes[i];
    }
  }
  std::vector<Datagram> datagrams;
  if (task_.distributes_time && task_.time_in_front)
    datagrams.push_back(Make(Cmd::ARMW, 0, reg::kSystemTime, Bytes(8, 0)));
  const std::size_t process_data = datagrams.size();
  datagrams.push_back(std::move(lrw));
  if (task_.distributes_time && !task_.time_in_front)
    datagrams.push_back(Make(Cmd::FRMW, station(0), reg::kSystemTime, Bytes(8, 0)));
  if (task_.reads_al_status) datagrams.push_back(Make(Cmd::BRD, 0, reg::kAlStatus, Bytes(2, 0)));
  NumberDatagrams(datagrams);
  if (change.lose) ++lose_next_;
  if (change.twice) double_next_ = true;
  if (change.circulating) circulate_next_ = true;
  if (const std::optional<std::vector<Datagram>> back = SendOnce(datagrams, last_cyclic_)) {
    last_image_ = (*back)[process_data].data;
    last_cyclic_wkc_ = (*back)[process_data].wkc;
  }
}

}  // namespace ecaudit::samples
