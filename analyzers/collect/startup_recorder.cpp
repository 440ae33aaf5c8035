#include "analyzers/collect/startup_recorder.h"

#include <algorithm>
#include <utility>

#include "analyzers/collect/mailbox_settings.h"
#include "analyzers/collect/startup_outcomes.h"
#include "analyzers/compare/startup_registers.h"
#include "analyzers/words/al_text.h"
#include "analyzers/words/drive_text.h"
#include "analyzers/words/step_text.h"
#include "decoder/base/text.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_map.h"
#include "decoder/mailbox/sdo.h"
#include "decoder/track/datagram_pair.h"

namespace ecaudit::startup {
namespace {

constexpr std::uint8_t kBoot = static_cast<std::uint8_t>(esc::AlState::BOOT);
constexpr std::uint8_t kOp = static_cast<std::uint8_t>(esc::AlState::OP);
/// Bits of the control word that command the state machine (CIA402, control word).
constexpr std::uint16_t kCommandBits = 0x008F;
/// Steps that a value read back is looked for among, the newest first.
constexpr std::size_t kReadBackReach = 64;

std::size_t At(StartupPhase phase) {
  return static_cast<std::size_t>(phase);
}

/// The phase that a request for `wanted` belongs to: the one that leads out of the state in which the slave is, however
/// far the master wants to go. A way down is gone up again: it belongs to the phase out of the state it leads to.
StartupPhase PhaseOfRequest(std::uint8_t wanted, std::uint8_t state) {
  if (wanted == kInit) return StartupPhase::kScan;
  if (state == 0) {  // not known: the state below, which is what the standard asks for
    if (wanted >= kOp) return StartupPhase::kSafeopToOp;
    return wanted >= kSafeop ? StartupPhase::kPreopToSafeop : StartupPhase::kInitToPreop;
  }
  const std::uint8_t from = std::min(wanted, state);
  if (from >= kSafeop) return StartupPhase::kSafeopToOp;
  return from >= kPreop ? StartupPhase::kPreopToSafeop : StartupPhase::kInitToPreop;
}

/// The state a phase leads to.
std::uint8_t GoalOf(StartupPhase phase) {
  if (phase == StartupPhase::kInitToPreop) return kPreop;
  return phase == StartupPhase::kPreopToSafeop ? kSafeop : kOp;
}

/// Giving up what was reached, and acknowledging an error, is no way on: a phase does not last until then.
bool LeadsOn(StartupPhase phase, std::uint32_t wanted) {
  return phase == StartupPhase::kScan || wanted >= GoalOf(phase);
}

StartupPhase PhaseOfMailbox(std::uint8_t state) {
  return state >= kSafeop ? StartupPhase::kSafeopToOp : StartupPhase::kPreopParameters;
}

StartupOutcome OutcomeOf(track::Acceptance acceptance) {
  switch (acceptance) {
    case track::Acceptance::kAccepted:
    case track::Acceptance::kAssumed:
      return StartupOutcome::kDone;
    case track::Acceptance::kRefused:
      return StartupOutcome::kRefused;
    case track::Acceptance::kUnknown:
      break;
  }
  return StartupOutcome::kUnknown;
}

bool IsEarly(StartupPhase phase) {
  return phase <= StartupPhase::kEeprom;
}

}  // namespace

StartupRecorder::StartupRecorder(const model::BusModel& model, const Pipeline& pipeline, EventBus& bus)
    : model_(model), room_(pipeline, kAtOnce, kBytesAStep) {
  bus.ListenTo<track::AlRequest, track::AlStatusRead, track::AlPoll, track::Answered, mailbox::SdoTransfer,
               mailbox::MailboxUnanswered, model::AlAnswered, model::AlErrorCode, model::AlOverdue, model::AlGivenUp,
               model::DriveCommanded, model::DriveStateChanged, mailbox::SoeMessage, mailbox::EoeControl,
               mailbox::AoeMessage, mailbox::MailboxErrorReply>(Stage::kBeforeModel, *this);
  // The EEPROM's words and the registers as the access left them.
  bus.ListenTo<track::EepromRead, track::EepromWrite, track::SlaveAccess>(Stage::kAfterModel, *this);
}

StartupRecorder::Story& StartupRecorder::Get(SlaveId slave) {
  while (stories_.size() <= slave) {
    stories_.emplace_back();
    last_shown_.push_back(0);
  }
  return stories_[slave];
}

void StartupRecorder::Story::SetState(std::uint8_t now, FrameNo frame) {
  if (state == now) return;
  changes[change_count++ % changes.size()] = {frame, now};
  state = now;
}

std::uint8_t StartupRecorder::Story::StateAt(FrameNo frame) const {
  std::uint8_t before = 0;
  for (std::size_t back = 1; back <= changes.size() && back <= change_count; ++back) {
    const auto& [since, then] = changes[(change_count - back) % changes.size()];
    if (since <= frame) return then;
    before = then;
  }
  // Older than what is kept: the oldest known will do.
  return change_count > changes.size() ? before : 0;
}

void StartupRecorder::Extend(Record& record, StartupPhase phase, const FrameRef& first, const FrameRef& last) {
  Phase& p = record.phases[At(phase)];
  if (!p.first.seen() || first.number < p.first.number) p.first = first;
  if (last.number > p.last.number) p.last = last;
  if (last.number > record.end.number) record.end = last;
  ++p.accesses;
}

void StartupRecorder::Add(Record& record, StartupStep step, ByteSpan data) {
  if (record.steps.size() >= kMaxSteps || all_steps_ >= kMaxAllSteps || !room_.HasRoomFor(all_steps_)) {
    ++record.left_out;
    return;
  }
  step.size = data.size();
  if (TakeBytes(record, data.size())) {
    step.data.assign(data.begin(), data.end());
  } else {
    record.dropped_bytes += data.size();
  }
  ++all_steps_;
  // It grows by half. Doubled, it would stay mostly empty, which counts with thousands of slaves.
  if (const std::size_t kept = record.steps.size(); kept == record.steps.capacity()) {
    record.steps.reserve(kept + kept / 2 + 1);
  }
  record.steps.push_back(std::move(step));
}

/// Whether the record may keep this many bytes more.
bool StartupRecorder::TakeBytes(Record& record, std::size_t count) {
  if (record.bytes + count > kMaxBytes || all_bytes_ + count > kMaxAllBytes) return false;
  record.bytes += count;
  all_bytes_ += count;
  return true;
}

void StartupRecorder::BeginAnew(Story& story) {
  Record next;
  for (const StartupStep& step : story.record.steps) {
    if (!IsEarly(step.phase)) continue;
    next.steps.push_back(step);
    next.bytes += step.data.size() + step.read_back.size();
  }
  all_steps_ += next.steps.size();
  all_bytes_ += next.bytes;
  for (std::size_t p = 0; p <= At(StartupPhase::kEeprom); ++p) next.phases[p] = story.record.phases[p];
  next.end = story.record.end;
  if (!story.best) {
    story.best = std::make_unique<Record>(std::move(story.record));
  } else {
    if (story.record.highest > story.best->highest) std::swap(*story.best, story.record);
    all_steps_ -= story.record.steps.size() + story.record.settings.size();
    all_bytes_ -= story.record.bytes;
  }
  story.record = std::move(next);
  ++story.again;
}

/// That a frame was lost shows when later ones came back, and the master may have gone on with these: its request has
/// its place before them. It is one with those for the same state right before or after it, for masters repeat it.
bool StartupRecorder::TookItsPlace(Story& story, const track::AlRequest& request) {
  const FrameNo frame = request.frame().number;
  if (request.acceptance != track::Acceptance::kUnknown) return false;
  if (story.in_operation && frame >= story.operation_since) return false;
  StartupStep* before = nullptr;
  StartupStep* behind = nullptr;
  for (StartupStep& step : story.record.steps) {
    if (step.key.kind != StartupKey::Kind::kRequest) continue;
    if (step.frame.number < frame && (before == nullptr || step.frame.number > before->frame.number)) before = &step;
    if (step.frame.number > frame && (behind == nullptr || step.frame.number < behind->frame.number)) behind = &step;
  }
  if (behind == nullptr) return false;  // it is the newest
  const std::uint8_t wanted = request.control.state();
  if (behind->key.address == wanted) {
    behind->frame = request.frame();
    ++behind->count;
    Extend(story.record, behind->phase, request.frame(), request.frame());
  } else if (before != nullptr && before->key.address == wanted && before->last.number > frame) {
    ++before->count;
  } else {
    StartupStep step;
    step.key.kind = StartupKey::Kind::kRequest;
    step.key.address = wanted;
    step.phase = PhaseOfRequest(wanted, story.StateAt(frame));
    step.frame = step.last = request.frame();
    step.outcome = StartupOutcome::kUnknown;
    step.broadcast = request.broadcast;
    Add(story.record, std::move(step), {});
  }
  return true;
}

StartupStep* StartupRecorder::LastRequest(Record& record) {
  const auto step = std::find_if(record.steps.rbegin(), record.steps.rend(), [](const StartupStep& candidate) {
    return candidate.key.kind == StartupKey::Kind::kRequest;
  });
  return step == record.steps.rend() ? nullptr : &*step;
}

void StartupRecorder::On(const track::AlRequest& request) {
  Story& story = Get(request.slave);
  last_shown_[request.slave] = 0;
  const std::uint8_t wanted = request.control.state();
  story.asked = std::max(story.asked, request.returned.seen() ? request.returned.number : request.sent.number);
  if (!story.first_state) story.first_state = wanted;
  if (TookItsPlace(story, request)) return;
  if (story.in_operation) {
    if (wanted < kOp) story.enabled = story.left_operation = true;
    if (story.left_operation && wanted == kInit) story.to_init = request.frame();
    if (story.left_operation && wanted == kPreop && story.state <= kInit) {
      ++story.again;
      // It begins in INIT: scan, addresses and mailbox come before the request of PREOP.
      if (!story.again_frame.seen()) story.again_frame = story.to_init.seen() ? story.to_init : request.frame();
    }
    return;
  }
  if (wanted == kInit && std::max(story.record.highest, story.state) >= kPreop) {
    BeginAnew(story);
    if (!story.again_frame.seen()) story.again_frame = request.frame();
  }
  std::uint8_t state = request.returned.seen() ? story.state : story.StateAt(request.frame().number);
  if (StartupStep* const before = LastRequest(story.record)) {
    if (before->key.address == wanted && (IsOpen(before->outcome) || wanted == kInit)) {
      // A master that writes its request until the state follows makes one step.
      Extend(story.record, before->phase, request.frame(), request.frame());
      ++before->count;
      before->last = request.frame();
      return;
    }
    // A master that does not look takes it that the state was reached.
    const FrameNo looked = model_.network().state(request.slave).al_status.since();
    if (before->outcome == StartupOutcome::kUnknown && looked < before->last.number)
      state = static_cast<std::uint8_t>(before->key.address);
  }
  const StartupPhase phase = PhaseOfRequest(wanted, state);
  if (LeadsOn(phase, wanted) || !story.record.phases[At(phase)].first.seen()) {
    Extend(story.record, phase, request.frame(), request.frame());
  }
  story.record.end = request.frame();
  StartupStep step;
  step.key.kind = StartupKey::Kind::kRequest;
  step.key.address = wanted;
  step.phase = phase;
  step.frame = step.last = request.frame();
  step.outcome =
      request.acceptance == track::Acceptance::kRefused ? StartupOutcome::kRefused : StartupOutcome::kUnknown;
  step.broadcast = request.broadcast;
  Add(story.record, std::move(step), {});
  if (request.acceptance != track::Acceptance::kAssumed) return;
  // No answers in the capture: what was requested is taken as reached, or nothing would show where the start-up ends.
  story.SetState(wanted, request.frame().number);
  if (wanted >= kPreop) scan_done_ = true;
  if (wanted != kOp) return;
  story.in_operation = bus_done_ = true;
  story.operation_since = request.frame().number;
}

void StartupRecorder::On(const track::AlPoll& poll) {
  const std::uint8_t state = poll.status.state();
  const bool all_told = std::ranges::all_of(
      poll.slaves, [&](SlaveId slave) { return slave < last_shown_.size() && last_shown_[slave] == state; });
  if (!all_told) poll.each_wanted = true;
}

void StartupRecorder::On(const track::AlStatusRead& read) {
  Story& story = Get(read.slave);
  const std::uint8_t state = read.status.state();
  if (!story.first_state) story.first_state = state;
  // Slaves act on a request when its frame has passed: what the same frame reads is the state before.
  if (read.frame.number <= story.asked) return;
  story.SetState(state, read.frame.number);
  if (story.in_operation) {
    last_shown_[read.slave] = state == kOp ? kOp : std::uint8_t{0};
    if (state != kOp) story.enabled = story.left_operation = true;
    return;
  }
  StartupStep* const step = LastRequest(story.record);
  if (step != nullptr && step->key.address == state && IsOpen(step->outcome)) {
    step->outcome = StartupOutcome::kDone;
    step->last = read.frame;
    Phase& phase = story.record.phases[At(step->phase)];
    if (LeadsOn(step->phase, step->key.address)) Extend(story.record, step->phase, read.frame, read.frame);
    story.record.end = read.frame;
    phase.reached = std::max(phase.reached, state);  // what is given up again was reached
  }
  if (state != kBoot) story.record.highest = std::max(story.record.highest, state);
  if (state >= kPreop) scan_done_ = true;
  last_shown_[read.slave] = state;
  if (state == kOp) {
    story.in_operation = true;
    story.operation_since = read.frame.number;
    bus_done_ = true;
  }
}

void StartupRecorder::On(const model::AlAnswered& event) {
  if (event.outcome != model::AlAnswered::Outcome::kRefused) return;
  Story& story = Get(event.slave);
  if (story.in_operation) return;
  StartupStep* const step = LastRequest(story.record);
  if (step == nullptr || step->key.address != event.request.control.state()) return;
  step->outcome = StartupOutcome::kRefused;
  step->code = event.code.value_or(0);
  step->last = event.frame;
  Extend(story.record, step->phase, event.frame, event.frame);
  Phase& phase = story.record.phases[At(step->phase)];
  phase.refused = event.request.control.state();
  phase.code = event.code.value_or(0);
  phase.reached = 0;
}

void StartupRecorder::NotFollowed(Story& story, std::uint8_t wanted, const FrameRef& last_look) {
  if (story.in_operation) return;
  MarkNotFollowed(story.record.steps, wanted, last_look);
  // That it was given up may show by the request that begins another attempt.
  if (story.best) MarkNotFollowed(story.best->steps, wanted, last_look);
}

void StartupRecorder::On(const model::AlOverdue& event) {
  NotFollowed(Get(event.slave), event.request.control.state(), event.frame);
}

void StartupRecorder::On(const model::AlGivenUp& event) {
  NotFollowed(Get(event.slave), event.request.control.state(), event.frame);
}

void StartupRecorder::On(const model::AlErrorCode& event) {
  Story& story = Get(event.slave);
  if (story.in_operation) return;
  StartupStep* const step = LastRequest(story.record);
  if (step == nullptr || step->outcome != StartupOutcome::kRefused || step->code != 0) return;
  step->code = event.code;
  step->last = event.frame;
  Extend(story.record, step->phase, event.frame, event.frame);
  story.record.phases[At(step->phase)].code = event.code;
}

void StartupRecorder::On(const track::SlaveAccess& access) {
  if (access.address >= esc::kProcessRam) return;
  if (access.broadcast) {
    if (bus_done_ || access.written.empty()) return;
    if (access.frame().number == broadcast_frame_ && access.datagram == broadcast_datagram_) return;
    broadcast_frame_ = access.frame().number;
    broadcast_datagram_ = access.datagram;
    Write(bus_, access, 0);
    return;
  }
  Story& story = Get(access.slave);
  if (story.in_operation) return;
  if (!access.written.empty()) {
    Write(story.record, access, story.state);
  } else if (const auto phase = PhaseOfRead(access.address, story.state); phase && access.done()) {
    Extend(story.record, *phase, access.frame(), access.frame());
  }
  if (!access.read.empty() && access.done()) ReadBack(story.record, access);
}

void StartupRecorder::On(const track::Answered& event) {
  if (bus_done_ || !wire::IsBroadcast(event.command) || event.address >= esc::kProcessRam) return;
  const FrameRef& sent = event.sent.seen() ? event.sent : event.returned;
  if (!wire::Writes(event.command)) {
    if (!scan_done_ && (event.address <= 0x000F || event.address == 0x0130)) {
      Extend(bus_, StartupPhase::kScan, sent, sent);
    }
    return;
  }
  // Once a slave is known the accesses of the slaves show the same.
  if (model_.network().slaves().size() != 0) return;
  track::SlaveAccess access;
  access.sent = event.sent;
  access.returned = event.returned;
  access.address = event.address;
  access.written = event.sent.seen() ? event.sent_data : event.returned_data;
  access.broadcast = true;
  access.acceptance = !event.returned.seen() ? track::Acceptance::kAssumed
                      : event.wkc == 0       ? track::Acceptance::kRefused
                                             : track::Acceptance::kAccepted;
  if (event.address == esc::kAlControl && !access.written.empty()) {
    Extend(bus_, StartupPhase::kScan, sent, sent);
    return;
  }
  Write(bus_, access, 0);
}

void StartupRecorder::Write(Record& record, const track::SlaveAccess& access, std::uint8_t state) {
  const FrameRef& frame = access.sent.seen() ? access.sent : access.returned;
  if (!Configures(access.address, access.written, state)) {
    const StartupPhase phase = PhaseOfWrite(access.address, access.written, state);
    // EEPROM commands are part of a phase without being steps.
    if (phase == StartupPhase::kEeprom) Extend(record, phase, frame, access.frame());
    return;
  }
  if (access.broadcast) {
    WriteUnit(record, access, access.address, access.written, PhaseOfWrite(access.address, access.written, 0));
    return;
  }
  CutIntoUnits(access.address, access.written, [&](EscAddress address, ByteSpan data) {
    WriteUnit(record, access, address, data, PhaseOfWrite(address, data, state));
  });
}

void StartupRecorder::WriteUnit(Record& record, const track::SlaveAccess& access, EscAddress address, ByteSpan data,
                                StartupPhase phase) {
  const FrameRef& frame = access.sent.seen() ? access.sent : access.returned;
  // What goes on cyclically (distribution of the system time) ends no phase.
  const bool distributes = access.command == wire::Command::ARMW || access.command == wire::Command::FRMW;
  if (!distributes || record.highest < kSafeop) Extend(record, phase, frame, access.frame());
  StartupStep step;
  step.key.address = address;
  step.phase = phase;
  step.frame = frame;
  step.last = access.frame();
  step.outcome = OutcomeOf(access.acceptance);
  step.broadcast = access.broadcast;
  step.volatile_value = IsVolatile(address, data.size());
  bool newest = true;
  for (auto known = record.steps.rbegin(); known != record.steps.rend(); ++known) {
    if (known->key != step.key) {
      newest = false;
      continue;
    }
    const bool same = known->size == data.size() && SameValue(step.key, known->data, data);
    const bool repeats = known->phase == phase && known->outcome == step.outcome &&
                         (step.volatile_value || (same && (newest || phase <= StartupPhase::kEeprom)));
    if (!repeats) break;
    ++known->count;
    known->last = step.last;
    return;
  }
  Add(record, std::move(step), data);
}

void StartupRecorder::ReadBack(Record& record, const track::SlaveAccess& access) {
  std::size_t looked = 0;
  for (auto step = record.steps.rbegin(); step != record.steps.rend() && looked < kReadBackReach; ++step, ++looked) {
    if (step->key.kind != StartupKey::Kind::kWrite || step->read_back_frame.seen() || step->volatile_value ||
        step->data.empty()) {
      continue;
    }
    const ByteSpan bytes = access.Covered(access.read, static_cast<EscAddress>(step->key.address), step->data.size());
    if (bytes.empty() || !TakeBytes(record, bytes.size())) continue;
    step->read_back.assign(bytes.begin(), bytes.end());
    step->read_back_frame = access.frame();
  }
}

void StartupRecorder::On(const track::EepromRead& event) {
  Story& story = Get(event.slave);
  if (story.in_operation) return;
  story.record.phases[At(StartupPhase::kEeprom)].words += event.words.size();
}

void StartupRecorder::On(const track::EepromWrite& event) {
  Story& story = Get(event.slave);
  if (story.in_operation) return;
  StartupStep step;
  step.key.kind = StartupKey::Kind::kEeprom;
  step.key.address = event.address;
  step.phase = StartupPhase::kEeprom;
  step.frame = event.command;
  step.last = event.frame.seen() ? event.frame : event.command;
  step.outcome = event.confirmed ? StartupOutcome::kDone : StartupOutcome::kUnknown;
  std::array<std::uint8_t, 2> bytes{};
  if (event.word) {
    bytes = {static_cast<std::uint8_t>(*event.word & 0xFFU), static_cast<std::uint8_t>(*event.word >> 8U)};
  }
  Add(story.record, std::move(step), event.word ? ByteSpan(bytes) : ByteSpan());
}

void StartupRecorder::On(const mailbox::MailboxUnanswered& event) {
  Story& story = Get(event.slave);
  story.unanswered = event;
  MarkUnanswered(story.record.steps, event);
}

void StartupRecorder::On(const mailbox::SdoTransfer& transfer) {
  Story& story = Get(transfer.slave);
  if (!transfer.has_object || transfer.service == mailbox::SdoService::kUnknown) return;
  const FrameRef& frame = transfer.request.seen() ? transfer.request : transfer.last;
  if (story.in_operation && frame.number >= story.operation_since) return;
  const FrameRef& last = transfer.last.seen() ? transfer.last : frame;
  const std::uint8_t state = story.StateAt(frame.number);
  const bool upload = transfer.service == mailbox::SdoService::kUpload;
  StartupStep step;
  step.key = {upload ? StartupKey::Kind::kUpload : StartupKey::Kind::kDownload, transfer.complete_access,
              transfer.subindex, transfer.index};
  step.phase = PhaseOfMailbox(state);
  step.frame = frame;
  step.last = last;
  switch (transfer.outcome) {
    case mailbox::SdoOutcome::kCompleted:
      step.outcome = StartupOutcome::kDone;
      break;
    case mailbox::SdoOutcome::kAborted:
      step.outcome = StartupOutcome::kRefused;
      step.code = transfer.abort_code;
      break;
    case mailbox::SdoOutcome::kMailboxError:
      step.outcome = StartupOutcome::kRefused;
      break;
    default:
      step.outcome = StartupOutcome::kUnknown;
      break;
  }
  Extend(story.record, step.phase, frame, last);

  if (upload && step.outcome == StartupOutcome::kDone) {
    for (auto written = story.record.steps.rbegin(); written != story.record.steps.rend(); ++written) {
      if (written->key.kind != StartupKey::Kind::kDownload || written->key.address != transfer.index ||
          written->key.subindex != transfer.subindex || written->key.complete_access != transfer.complete_access) {
        continue;
      }
      if (written->read_back_frame.seen() || !TakeBytes(story.record, transfer.data.size())) break;
      written->read_back.assign(transfer.data.begin(), transfer.data.end());
      written->read_back_frame = last;
      break;
    }
  }
  // A master that reads an object until it has a certain value makes one step, and one that tries a download again.
  bool newest = true;
  for (auto known = story.record.steps.rbegin(); known != story.record.steps.rend(); ++known) {
    const bool alike = known->outcome == step.outcome || (IsOpen(known->outcome) && IsOpen(step.outcome));
    if (known->key == step.key && known->phase == step.phase && alike &&
        (upload ||
         (newest && known->size == transfer.data.size() && SameValue(step.key, known->data, transfer.data)))) {
      ++known->count;
      known->last = last;
      return;
    }
    if (!upload && known->key.kind == StartupKey::Kind::kDownload) break;
    if (known->key.kind == StartupKey::Kind::kDownload) newest = false;
    if (known->phase != step.phase && upload) break;
  }
  Add(story.record, std::move(step), transfer.data);
  // Which of the two is reported first does not matter.
  if (story.unanswered.request.frame.number >= frame.number) MarkUnanswered(story.record.steps, story.unanswered);
}

template <typename Message>
void StartupRecorder::AddSetting(const Message& message) {
  Story& story = Get(message.slave);
  if (story.in_operation && message.frame.number >= story.operation_since) return;
  Record& record = story.record;
  MarkAnswered(record.settings, message);
  std::optional<MailboxSetting> setting = SettingOf(message);
  if (!setting) return;
  if (record.settings.size() >= kMaxSettings || all_steps_ >= kMaxAllSteps || !room_.HasRoomFor(all_steps_)) {
    ++record.left_out;
    return;
  }
  ++all_steps_;
  if (!TakeBytes(record, setting->data.size())) setting->data.clear();
  record.settings.push_back(std::move(*setting));
}

void StartupRecorder::On(const mailbox::MailboxErrorReply& reply) {
  MarkAnswered(Get(reply.slave).record.settings, reply);
}

void StartupRecorder::On(const model::DriveCommanded& event) {
  if (event.axis > 0) return;  // steps are those of the first axis
  Story& story = Get(event.slave);
  if (story.enabled || (!story.in_operation && story.state < kSafeop)) return;
  const std::uint16_t bits = event.word & kCommandBits;
  // Outputs that are still 0 command nothing.
  if (!story.drive_commanded && bits == 0) return;
  story.drive_commanded = true;
  if (event.state) story.drive_shows = event.state;
  StartupStep step;
  step.key.kind = StartupKey::Kind::kDrive;
  step.key.address = bits;
  step.phase = StartupPhase::kDriveEnable;
  step.frame = step.last = event.frame;
  const auto& drive = model_.slave(event.slave).profile->drive;
  step.name = drive ? CommandName(*drive, event.path, event.before, event.word) : "control word";
  step.text = "control word " + Hex(event.word);
  Extend(story.record, step.phase, event.frame, event.frame);
  if (Enables(step.key) && event.state != device::DriveState::kOperationEnabled) {
    step.outcome = StartupOutcome::kUnknown;
  }
  if (!story.record.steps.empty() && story.record.steps.back().key == step.key) {
    ++story.record.steps.back().count;
    return;
  }
  Add(story.record, std::move(step), {});
}

void StartupRecorder::On(const model::DriveStateChanged& event) {
  if (event.axis > 0) return;
  Story& story = Get(event.slave);
  if (story.enabled || !story.drive_commanded) return;
  Extend(story.record, StartupPhase::kDriveEnable, event.frame, event.frame);
  story.drive_shows = event.to;
  if (event.to != device::DriveState::kOperationEnabled) return;
  for (StartupStep& step : story.record.steps) {
    if (Enables(step.key) && step.outcome == StartupOutcome::kUnknown) step.outcome = StartupOutcome::kDone;
  }
  story.record.phases[At(StartupPhase::kDriveEnable)].enabled = true;
  if (story.in_operation) story.enabled = true;
}

void StartupRecorder::Describe(StartupStep& step, SlaveId slave) const {
  const model::SlaveModel* model = slave < model_.size() ? &model_.slave(slave) : nullptr;
  const bool sdo = step.key.kind == StartupKey::Kind::kDownload || step.key.kind == StartupKey::Kind::kUpload;
  if (step.name.empty()) step.name = StepName(step.key, static_cast<std::size_t>(step.size), model);
  if (step.text.empty()) step.text = StepValue(step.key, step.data, model);
  if (!step.read_back.empty() && !SameValue(step.key, step.data, step.read_back)) {
    step.read_text = StepValue(step.key, step.read_back, model);
  }
  if (sdo && step.outcome == StartupOutcome::kUnknown) step.note = "no answer in the capture";
  // That of a drive has the drive state.
  if (step.key.kind == StartupKey::Kind::kDrive) return;
  if (step.outcome == StartupOutcome::kUnanswered) step.note = sdo ? "not answered" : "not followed";
  if (step.outcome != StartupOutcome::kRefused) return;
  if (sdo) {
    step.note = step.code == 0 ? "refused by a mailbox error" : "aborted with " + Hex(step.code, 8);
    const std::string_view reason = mailbox::AbortCodeText(step.code);
    if (step.code != 0 && !reason.empty()) step.note += " " + std::string(reason);
  } else if (step.key.kind == StartupKey::Kind::kRequest) {
    step.note = "refused";
    if (step.code != 0 && model != nullptr) {
      step.note += " with " + CodeText(static_cast<std::uint16_t>(step.code), *model->profile);
    }
  } else {
    step.note = "not taken";
  }
}

StartupSummary StartupRecorder::Finish(Record& record, SlaveId slave) const {
  StartupSummary summary;
  summary.steps = std::move(record.steps);
  summary.mailbox_settings = std::move(record.settings);
  std::ranges::stable_sort(summary.steps,
                           [](const StartupStep& a, const StartupStep& b) { return a.frame.number < b.frame.number; });
  for (StartupStep& step : summary.steps) Describe(step, slave);
  summary.steps_left_out = record.left_out;
  summary.dropped_bytes = record.dropped_bytes;
  summary.reached = record.highest;
  summary.end = record.end;
  for (std::size_t p = 0; p < kStartupPhases; ++p) {
    const Phase& phase = record.phases[p];
    if (!phase.first.seen()) continue;
    StartupPhaseSummary& out = summary.phases.emplace_back();
    out.phase = static_cast<StartupPhase>(p);
    out.first = phase.first;
    out.last = phase.last;
    out.accesses = phase.accesses;
    if (phase.first.has_time && phase.last.has_time) out.duration = phase.last.time - phase.first.time;
    if (phase.words > 0) out.result = Count(phase.words, "word") + " read";
    if (phase.enabled) out.result = "Operation enabled";
    // What was refused because it skipped a state is overcome when the state after this phase is reached.
    if (phase.refused != 0 && phase.reached < std::min(phase.refused, GoalOf(out.phase))) {
      out.failed = true;
      out.result = esc::StateName(phase.refused) + " refused";
      if (phase.code != 0 && slave < model_.size()) {
        out.result += " with " + CodeText(phase.code, *model_.slave(slave).profile);
      }
    } else if (phase.reached != 0 && out.phase != StartupPhase::kScan) {
      out.result = esc::StateName(phase.reached) + " reached";
    }
  }
  std::ranges::stable_sort(summary.phases, [](const StartupPhaseSummary& a, const StartupPhaseSummary& b) {
    return a.first.number < b.first.number;
  });
  summary.seen = !summary.steps.empty();
  return summary;
}

StartupSummary StartupRecorder::SummariseSlave(SlaveId slave, const FrameRef& capture_end) {
  if (slave >= stories_.size()) return {};
  Story& story = stories_[slave];
  if (slave < model_.size()) {
    const model::AlMachine& al = model_.slave(slave).al;
    if (al.waits_for() != nullptr && StoppedLooking(al.wait(), capture_end)) {
      NotFollowed(story, al.waits_for()->control.state(), al.wait().last_poll);
    }
  }
  if (!story.left_operation && story.drive_shows) MarkDriveOutcome(story.record.steps, *story.drive_shows, capture_end);
  const bool earlier = story.best && story.best->highest >= story.record.highest;
  StartupSummary summary = Finish(earlier ? *story.best : story.record, slave);
  summary.first_state = story.first_state;
  summary.again = story.again;
  summary.again_frame = story.again_frame;
  summary.ended = story.in_operation;
  return summary;
}

void StartupRecorder::Summarise(AnalysisResult& result) {
  result.bus.startup = SummariseBus();
  for (SlaveSummary& slave : result.slaves) slave.startup = SummariseSlave(slave.id, result.capture.last);
}

StartupSummary StartupRecorder::SummariseBus() {
  return Finish(bus_, kNoSlave);
}

}  // namespace ecaudit::startup
