#include "analyzers/collect/fault_words.h"

#include <string>

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit {
namespace {

using device::DriveState;

/// Bit 9: the drive takes commands from the bus, as drives in process data do. It distinguishes most other words.
constexpr std::uint16_t kRemote = 0x0200;

}  // namespace

FaultWords::FaultWords(EventBus& bus) {
  const device::DeviceDescription* generic = device::BuiltinProfile("generic");
  if (generic == nullptr || !generic->drive) return;
  drive_ = &*generic->drive;
  bus.ListenTo<model::ProcessDataUnplaced>(Stage::kBeforeModel, *this);
}

bool FaultWords::InFault(std::uint16_t word) const {
  if ((word & kRemote) == 0) return false;
  const auto state = drive_->StateOf(word);
  return state && (*state == DriveState::kFault || *state == DriveState::kFaultReactionActive);
}

void FaultWords::On(const model::ProcessDataUnplaced& event) {
  const track::LogicalAccess& access = event.access;
  if (!access.returned.seen() || access.circulating || access.assumed || access.wkc == 0 ||
      access.command == wire::Command::LWR || access.returned_data.size() < access.length) {
    return;
  }
  for (std::size_t d = 0; d < used_; ++d) {
    const Datagram& known = datagrams_[d];
    if (known.address != access.address || known.command != access.command || known.length != access.length) continue;
    for (std::size_t i = 0; i < found_; ++i) {
      if (words_[i].datagram == d) FollowWord(words_[i], access);
    }
    return;
  }
  Begin(access);
}

void FaultWords::Begin(const track::LogicalAccess& access) {
  if (used_ == kMostDatagrams) return;
  datagrams_[used_] = {access.command, access.address, access.length};
  for (std::size_t at = 0; at + 2 <= access.returned_data.size() && found_ < kMost; ++at) {
    const std::uint16_t word = LittleEndian<std::uint16_t>(access.returned_data, at);
    if (!InFault(word)) continue;
    words_[found_++] = {.datagram = static_cast<std::uint8_t>(used_),
                        .at = static_cast<std::uint16_t>(at),
                        .value = word,
                        .left = false,
                        .dropped = false,
                        .cycles = 1,
                        .first = access.frame(),
                        .last = access.frame()};
  }
  ++used_;
}

void FaultWords::FollowWord(Word& word, const track::LogicalAccess& access) const {
  if (word.dropped || word.left) return;
  const std::uint16_t now = LittleEndian<std::uint16_t>(access.returned_data, word.at);
  if (InFault(now)) {
    word.value = now;
    ++word.cycles;
    word.last = access.frame();
    return;
  }
  if (now == 0) return;  // what the master sent: the slave did not take part
  // A fault is left by its reset only, and that leads to one state.
  word.left = drive_->StateOf(now) == DriveState::kSwitchOnDisabled;
  word.dropped = !word.left;
}

void FaultWords::Summarise(AnalysisResult& result) {
  for (std::size_t i = 0; i < found_; ++i) {
    const Word& word = words_[i];
    if (word.dropped || word.cycles < kLeastCycles) continue;
    const Datagram& datagram = datagrams_[word.datagram];
    result.cut = std::string(wire::Name(datagram.command)) + " " + Hex(datagram.address, 8) +
                 " holds process data of which it is not known whose they are, and from frame " +
                 std::to_string(word.first.number) + " to " + std::to_string(word.last.number) + " the word at byte " +
                 std::to_string(word.at) + " reads like the status word of a drive in Fault (" + Hex(word.value, 4) +
                 ")";
    return;
  }
}

}  // namespace ecaudit
