#include "tests/property/zoo.h"

#include <utility>

#include "tests/fuzz/memory_file.h"

namespace ecaudit::test {
namespace {

using samples::MasterWay;

/// Numbers below a limit, the same every time.
class Dice {
 public:
  unsigned Throw(std::size_t sides) {
    state_ = state_ * 1'664'525U + 1'013'904'223U;
    return static_cast<unsigned>((state_ >> 16U) % sides);
  }
  bool OneIn(unsigned sides) { return Throw(sides) == 0; }
  const MasterWay& AnyWay() { return samples::MasterWays()[Throw(samples::MasterWays().size())].way; }

 private:
  std::uint32_t state_ = 1;
};

std::string Describe(const MasterWay& way) {
  const auto number = [](auto value) { return std::to_string(static_cast<int>(value)); };
  const samples::Grouping& group = way.grouping;
  std::string text = "indices " + number(way.numbering.all.first) + "-" + number(way.numbering.all.last) + " others " +
                     number(way.numbering.others);
  if (way.numbering.cyclic) text += way.numbering.in_process_data ? " cyclic in process data" : " cyclic apart";
  if (way.numbering.while_scanning) text += " none while scanning";
  if (way.padding.even) text += ", even";
  if (way.padding.least != 0) text += ", least " + number(way.padding.least);
  if (way.padding.ethernet_size != 0) text += ", 60 bytes";
  text += ", addressing " + number(way.addressing);
  if (way.clears_stations) text += ", clears stations";
  if (group.apart_by_direction) text += ", by direction";
  if (group.apart_by_slave) text += ", by slave";
  if (group.own_frames) text += ", own frames";
  if (group.status_behind_others) text += ", status behind others";
  text +=
      ", time " + number(way.time.command) + (way.time.in_front ? " in front " : " behind ") + number(way.time.bytes);
  text += ", mail " + number(way.mail);
  if (!way.counts_mail) text += " uncounted";
  if (way.writes_last_byte_of_mail) text += " in two";
  if (way.always_acknowledges) text += ", acknowledges";
  if (way.requests_by_broadcast) text += ", broadcasts requests";
  if (way.renumbers_repetitions) text += ", renumbers repetitions";
  return text + ", MAC " + number(way.mac[0]);
}

}  // namespace

std::vector<ZooMaster> ZooMasters(int mixed) {
  std::vector<ZooMaster> masters;
  for (const samples::NamedWay& one : samples::MasterWays()) masters.push_back({std::string(one.name), one.way});
  Dice dice;
  for (int i = 0; i < mixed; ++i) {
    MasterWay way = dice.AnyWay();
    way.mac = dice.AnyWay().mac;
    way.numbering = dice.AnyWay().numbering;
    way.padding = dice.AnyWay().padding;
    way.addressing = dice.AnyWay().addressing;
    way.first_station = dice.AnyWay().first_station;
    way.clears_stations = dice.OneIn(2);
    way.logical_base = dice.AnyWay().logical_base;
    way.grouping = {.apart_by_direction = dice.OneIn(2),
                    .apart_by_slave = dice.OneIn(2),
                    .own_frames = dice.OneIn(2),
                    .status_behind_others = dice.OneIn(4)};
    way.time = dice.AnyWay().time;
    way.mail = dice.AnyWay().mail;
    way.counts_mail = !dice.OneIn(3);
    way.writes_last_byte_of_mail = dice.OneIn(3);
    way.always_acknowledges = dice.OneIn(2);
    way.requests_by_broadcast = dice.OneIn(3);
    way.reads_status_code = dice.OneIn(2);
    way.renumbers_repetitions = dice.OneIn(3);
    masters.push_back({"mixed " + std::to_string(i) + ": " + Describe(way), way});
  }
  return masters;
}

WireCapture CaptureOf(const samples::Story& story, std::string name) {
  const samples::Bytes file = story.capture.Encode();
  const fuzz::MemoryFile memory({reinterpret_cast<const char*>(file.data()), file.size()});
  WireCapture capture = LoadCapture(memory.path()).value_or(WireCapture{});
  capture.name = std::move(name);
  return capture;
}

}  // namespace ecaudit::test
