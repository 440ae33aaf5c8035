#include "analyzers/model/event_unit.h"

#include <algorithm>

#include "decoder/esc/register_addresses.h"

namespace ecaudit::model {
namespace {

/// What the master reads to answer an event: the slave takes the bit back.
struct Answer {
  unsigned bit;
  EscAddress first, end;
};
constexpr std::array<Answer, 3> kAnswering = {{
    {0, 0x09AE, 0x09D0},  // DC latch: latch status and times
    {2, 0x0110, 0x0112},  // DL Status
    {3, 0x0130, 0x0132},  // AL Status
}};

/// The bytes of a register that a read covered; nothing when it covered none.
std::optional<EventUnit::Reading> ReadPart(const track::SlaveAccess& access, EscAddress address, unsigned bytes) {
  EventUnit::Reading reading;
  for (unsigned i = 0; i < bytes; ++i) {
    const ByteSpan byte = access.Covered(access.read, static_cast<EscAddress>(address + i), 1);
    if (byte.empty()) continue;
    reading.value |= std::uint32_t{byte[0]} << 8U * i;
    reading.read |= std::uint32_t{0xFF} << 8U * i;
  }
  if (reading.read == 0) return std::nullopt;
  reading.frame = access.frame();
  return reading;
}

}  // namespace

void EventUnit::OnSlave(SlaveId slave) {
  if (slaves_.size() <= slave) slaves_.resize(std::size_t{slave} + 1);
}

/// The only slave that can have raised the bit; kNoSlave where there are several, or not all are known.
SlaveId EventUnit::OnlyCandidate(unsigned bit) const {
  const std::uint16_t* count = network_.slave_count().if_known();
  if (count == nullptr) return kNoSlave;
  SlaveId only = kNoSlave;
  unsigned met = 0;
  unsigned candidates = 0;
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (!network_.OnBus(id)) continue;
    ++met;
    const auto mask = network_.state(id).registers.Value<std::uint16_t>(esc::kEcatEventMask, Certainty::kObserved);
    if (mask && (*mask >> bit & 1U) == 0) continue;
    if (++candidates > 1) return kNoSlave;
    only = id;
  }
  return met == *count && candidates == 1 ? only : kNoSlave;
}

SlaveId EventUnit::OnlySlave() const {
  const std::uint16_t* count = network_.slave_count().if_known();
  if (count == nullptr || *count != 1) return kNoSlave;
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    if (network_.OnBus(static_cast<SlaveId>(s))) return static_cast<SlaveId>(s);
  }
  return kNoSlave;
}

void EventUnit::OnField(const track::EventFieldChanged& event) {
  for (unsigned bit = 0; bit < kBits; ++bit) {
    const bool was = (event.before.bits >> bit & 1U) != 0;
    const bool is = (event.bits >> bit & 1U) != 0;
    Pending& pending = pending_[bit];
    if (was) pending.frames += event.before.frames;
    if (was && !is) End(bit, event.before, &event.frame);
    if (was || !is) continue;
    pending = {0, event.frame, OnlyCandidate(bit)};
    Story& story = field_[bit];
    if (story.raised++ == 0) {
      story.first = event.frame;
      story.from_start = event.before.frames == 0;
    }
    EventBitChanged change;
    change.bit = static_cast<std::uint8_t>(bit);
    change.set = true;
    change.frame = event.frame;
    change.slave = pending.slave;
    sink_.Publish(change);
  }
}

/// @param run   the last one with the bit
/// @param gone  the first frame without it; null: the capture ended with it
void EventUnit::End(unsigned bit, const track::EventFieldRun& run, const FrameRef* gone) {
  Pending& pending = pending_[bit];
  Story& story = field_[bit];
  story.frames += pending.frames;
  story.last = run.last;
  story.at_end = gone == nullptr;

  bool inferred = false;
  if (pending.slave == kNoSlave) pending.slave = OnlySlave();  // it may have been met since
  if (pending.slave == kNoSlave && gone != nullptr && !run.all_read) {
    for (std::size_t i = 0; i < kAnswering.size(); ++i) {
      // The frame that reads still carries the bit: the slave takes it back when the frame has passed.
      if (kAnswering[i].bit != bit || readers_[i].frame != run.last.number) continue;
      pending.slave = readers_[i].slave;
      inferred = pending.slave != kNoSlave;
    }
  }
  if (pending.slave != kNoSlave && pending.slave < slaves_.size()) {
    std::vector<Story>& signalled = slaves_[pending.slave].signalled;
    if (signalled.empty()) signalled.resize(kBits);
    Story& of = signalled[bit];
    if (of.raised++ == 0) {
      of.first = pending.first;
      of.from_start = story.raised == 1 && story.from_start;
    }
    of.frames += pending.frames;
    of.last = run.last;
    of.at_end = gone == nullptr;
    of.inferred = of.inferred || inferred;
  }
  if (gone != nullptr) {
    EventBitChanged change;
    change.bit = static_cast<std::uint8_t>(bit);
    change.frame = *gone;
    change.slave = pending.slave;
    change.slave_inferred = inferred;
    change.frames = pending.frames;
    change.first = pending.first;
    change.last = run.last;
    sink_.Publish(change);
  }
  pending = {};
}

void EventUnit::RememberReader(const track::SlaveAccess& access) {
  for (std::size_t i = 0; i < kAnswering.size(); ++i) {
    const Answer& answer = kAnswering[i];
    if (access.address >= answer.end || access.address + access.read.size() <= answer.first) continue;
    Reader& reader = readers_[i];
    const FrameNo frame = access.frame().number;
    const bool several = access.broadcast || (reader.frame == frame && reader.slave != access.slave);
    reader = {frame, several ? kNoSlave : access.slave};
  }
}

void EventUnit::LearnRegisters(const track::SlaveAccess& access) {
  const std::size_t length = std::max(access.written.size(), access.read.size());
  if (access.address + length <= esc::kEcatEventMask) return;
  Slave& slave = slaves_[access.slave];
  const bool tells_mask = !access.Covered(access.written, esc::kEcatEventMask, 2).empty()
                              ? access.acceptance != track::Acceptance::kRefused
                              : !access.broadcast && !access.Covered(access.read, esc::kEcatEventMask, 2).empty();
  if (tells_mask) slave.mask_frame = access.frame();
  if (access.broadcast) return;  // what was read is of all slaves
  const auto learn = [&](std::optional<Reading>& to, EscAddress address, unsigned bytes) {
    if (const auto reading = ReadPart(access, address, bytes)) to = reading;
  };
  learn(slave.al_mask, esc::kAlEventMask, 4);
  learn(slave.ecat_request, esc::kEcatEventRequest, 2);
  learn(slave.al_request, esc::kAlEventRequest, 4);
}

void EventUnit::Finish() {
  const track::EventFieldRun& field = network_.event_field();
  for (unsigned bit = 0; bit < kBits; ++bit) {
    if ((field.bits >> bit & 1U) == 0) continue;
    pending_[bit].frames += field.frames;
    End(bit, field, nullptr);
  }
}

}  // namespace ecaudit::model
