#include "samples/builder/scripted_master.h"

#include <algorithm>
#include <utility>

namespace ecaudit::samples {
namespace {

constexpr TimeNs kNextFrame = 8'000;  // the driver, between two frames of one cycle
constexpr TimeNs kRoom = 150'000;     // an acyclic frame starts only if the next process-data frame is further away

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

ScriptedMaster::ScriptedMaster(SimulatedBus& bus, Recorder& recorder, TimeNs start, const MasterWay& way)
    : bus_(bus), recorder_(recorder), way_(way), now_(start) {
  recorder_.around.minimum_bytes = way_.padding.ethernet_size;
}

// ---------------------------------------------------------------------------------------------- time

void ScriptedMaster::WaitUntil(TimeNs time) {
  while (running_) {
    const auto change = changes_.find(cycle_number_);
    const TimeNs shift = change == changes_.end() ? 0 : change->second.shift;
    const TimeNs due = first_cycle_ + cycles_since_start_ * task_.cycle + shift;
    if (due > time) break;
    now_ = std::max(now_, due + jitter_.Next(way_.wake_jitter));
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

void ScriptedMaster::NumberDatagrams(Datagrams& datagrams, bool cyclic) {
  const Numbering& numbering = way_.numbering;
  if (scanning_ && numbering.while_scanning) {
    for (Datagram& d : datagrams) d.index = *numbering.while_scanning;
    return;
  }
  const bool apart = cyclic && numbering.cyclic;
  const Numbering::Counter& counter = apart ? *numbering.cyclic : numbering.all;
  std::optional<std::uint8_t>& last = apart ? cyclic_index_ : index_;
  const auto next = [&] {
    last = !last || *last >= counter.last ? counter.first : static_cast<std::uint8_t>(*last + 1);
    return *last;
  };
  const std::uint8_t first = next();
  std::size_t numbered = 0;
  for (std::size_t i = 0; apart && numbering.in_process_data && i < datagrams.size(); ++i) {
    if (CmdIsLogical(datagrams[i].command)) numbered = i;
  }
  for (std::size_t i = 0; i < datagrams.size(); ++i) {
    if (i == numbered || numbering.others == Numbering::Others::kSame) {
      datagrams[i].index = first;
    } else {
      datagrams[i].index = numbering.others == Numbering::Others::kCounted ? next() : std::uint8_t{0};
    }
  }
}

std::optional<ScriptedMaster::Datagrams> ScriptedMaster::SendOnce(const Datagrams& datagrams, FrameIds& ids) {
  EtherCatFrame frame;
  frame.source = way_.mac;
  frame.datagrams = datagrams;
  const std::size_t used = EncodeDatagrams(datagrams).size();
  frame.padding = std::max<std::size_t>(used + (way_.padding.even ? used % 2 : 0), way_.padding.least) - used;
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
  ready_at_ = now_ + way_.think_time;
  return std::move(result.frame.datagrams);
}

std::vector<Answer> ScriptedMaster::Exchange(std::vector<Datagram> datagrams) {
  MakeRoom();
  std::vector<Answer> answers(datagrams.size());
  if (way_.grouping.status_behind_others) datagrams.push_back(Make(Cmd::BRD, 0, reg::kAlStatus, Bytes(2, 0)));
  NumberDatagrams(datagrams, false);
  for (int attempt = 0; attempt < way_.attempts; ++attempt) {
    if (attempt > 0 && way_.renumbers_repetitions) NumberDatagrams(datagrams, false);
    FrameIds ids;
    std::optional<Datagrams> back = SendOnce(datagrams, ids);
    for (std::size_t i = 0; i < answers.size(); ++i) {
      answers[i].frame = ids;
      answers[i].lost = !back;
      if (!back) continue;
      answers[i].data = std::move((*back)[i].data);
      answers[i].wkc = (*back)[i].wkc;
      answers[i].adp = (*back)[i].adp;
    }
    if (back) break;
    Wait(way_.frame_timeout);
  }
  Wait(way_.think_time);
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

Datagram ScriptedMaster::Addressed(std::size_t position, bool write, std::uint16_t ado, Bytes data) const {
  if (way_.addressing == Addressing::kPosition) {
    return Make(write ? Cmd::APWR : Cmd::APRD, AutoIncrement(position), ado, std::move(data));
  }
  const auto alias = aliases_.find(position);
  const std::uint16_t address =
      way_.addressing == Addressing::kAlias && alias != aliases_.end() ? alias->second : station(position);
  return Make(write ? Cmd::FPWR : Cmd::FPRD, address, ado, std::move(data));
}

Answer ScriptedMaster::Read(std::size_t position, std::uint16_t ado, std::size_t length) {
  return Exchange({Addressed(position, false, ado, Bytes(length, 0))}).front();
}

Answer ScriptedMaster::Write(std::size_t position, std::uint16_t ado, Bytes data) {
  return Exchange({Addressed(position, true, ado, std::move(data))}).front();
}

Datagram ScriptedMaster::TimeDatagram() const {
  const Bytes data(way_.time.bytes, 0);
  if (way_.time.command == Cmd::ARMW) return Make(Cmd::ARMW, AutoIncrement(0), reg::kSystemTime, data);
  Datagram d = Addressed(0, false, reg::kSystemTime, data);
  d.command = way_.addressing == Addressing::kPosition ? Cmd::ARMW : Cmd::FRMW;
  return d;
}

PacketId ScriptedMaster::Foreign(Bytes packet) {
  MakeRoom();
  const PacketId id = recorder_.Raw(std::move(packet), now_);
  Wait(way_.think_time);
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
  if (change.skip && !change.frame) return;

  std::vector<Datagrams> frames;
  if (way_.grouping.own_frames) {
    for (Datagram& d : ProcessDatagrams()) frames.push_back({std::move(d)});
  } else {
    frames.push_back(ProcessDatagrams());
  }
  if (task_.distributes_time) {
    Datagrams& with_time = way_.time.in_front ? frames.front() : frames.back();
    with_time.insert(way_.time.in_front ? with_time.begin() : with_time.end(), TimeDatagram());
  }
  if (task_.reads_al_status) frames.back().push_back(Make(Cmd::BRD, 0, reg::kAlStatus, Bytes(2, 0)));
  const std::size_t changed = change.frame.value_or(0);
  last_cyclic_wkc_ = 0;
  // The frames leave behind each other; none waits for the one before to come back.
  TimeNs leaves = now_;
  TimeNs back_at = now_;
  for (Datagrams& frame : frames) {
    if (&frame == &frames[std::min(changed, frames.size() - 1)]) {
      if (change.skip) continue;
      if (change.lose) ++lose_next_;
      if (change.twice) double_next_ = true;
      if (change.circulating) circulate_next_ = true;
    }
    NumberDatagrams(frame, true);
    now_ = leaves;
    FrameIds ids;
    if (const std::optional<Datagrams> back = SendOnce(frame, ids)) TakeProcessData(*back);
    if (&frame == &frames.front()) last_cyclic_ = ids;
    leaves += kNextFrame + static_cast<TimeNs>(EncodeDatagrams(frame).size()) * kByteTime;
    back_at = std::max(back_at, now_);
  }
  now_ = back_at;
}

std::vector<Datagram> ScriptedMaster::ProcessDatagrams() const {
  Bytes outputs;
  for (const Image& image : image_) {
    outputs.resize(std::max<std::size_t>({outputs.size(), std::size_t{image.output_offset} + image.output_bytes,
                                          std::size_t{image.input_offset} + image.input_bytes}),
                   0);
  }
  for (const auto& [position, bytes] : outputs_) {
    if (position >= image_.size()) continue;
    for (std::size_t i = 0; i < bytes.size() && i < image_[position].output_bytes; ++i) {
      outputs[image_[position].output_offset + i] = bytes[i];
    }
  }
  Datagrams datagrams;
  const auto add = [&](Cmd command, std::size_t from, std::size_t to) {
    if (from >= to) return;
    Bytes data(to - from, 0);
    if (command != Cmd::LRD) {
      std::copy(outputs.begin() + static_cast<std::ptrdiff_t>(from), outputs.begin() + static_cast<std::ptrdiff_t>(to),
                data.begin());
    }
    datagrams.push_back(Make(command, 0, 0, std::move(data)));
    datagrams.back().set_logical(way_.logical_base + static_cast<std::uint32_t>(from));
  };
  const auto add_range = [&](std::size_t out_from, std::size_t out_to, std::size_t in_from, std::size_t in_to) {
    if (way_.grouping.apart_by_direction) {
      add(Cmd::LWR, out_from, out_to);
      add(Cmd::LRD, in_from, in_to);
    } else {
      add(Cmd::LRW, out_from < out_to ? out_from : in_from, in_from < in_to ? in_to : out_to);
    }
  };
  if (way_.grouping.apart_by_slave) {
    for (const Image& image : image_) {
      add_range(image.output_offset, image.output_offset + image.output_bytes, image.input_offset,
                image.input_offset + image.input_bytes);
    }
  } else {
    std::size_t inputs = 0;
    for (const Image& image : image_) inputs += image.output_bytes;
    add_range(0, inputs, inputs, outputs.size());
  }
  return datagrams;
}

void ScriptedMaster::TakeProcessData(const Datagrams& back) {
  for (const Datagram& d : back) {
    if (!CmdIsLogical(d.command)) continue;
    last_cyclic_wkc_ = static_cast<std::uint16_t>(last_cyclic_wkc_ + d.wkc);
    if (!CmdReads(d.command)) continue;
    const std::size_t at = d.logical() - way_.logical_base;
    if (last_image_.size() < at + d.data.size()) last_image_.resize(at + d.data.size(), 0);
    std::copy(d.data.begin(), d.data.end(), last_image_.begin() + static_cast<std::ptrdiff_t>(at));
  }
}

}  // namespace ecaudit::samples
