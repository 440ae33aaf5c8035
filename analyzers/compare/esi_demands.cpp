#include "analyzers/compare/esi_demands.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "analyzers/words/step_text.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/device/device_description.h"
#include "decoder/esc/al.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/mailbox/aoe.h"
#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/soe.h"

namespace ecaudit::startup {
namespace {

using Kind = EsiDemand::Kind;
using Status = EsiDemand::Status;

constexpr EscAddress kManagerBase = 0x0800;
constexpr EscAddress kFmmuBase = 0x0600;
constexpr EscAddress kManagerBytes = 8, kFmmuBytes = 16;
constexpr EscAddress kMemory = 0x1000;  // process data and mailboxes lie from here on
constexpr unsigned kMostManagers = 16, kMostFmmus = 16;
constexpr std::uint16_t kModuleIdents = 0xF030;
constexpr std::size_t kMostDemands = 200;  // of a slave
constexpr std::uint8_t kAtOp = static_cast<std::uint8_t>(esc::AlState::OP);
constexpr std::uint8_t kAtSafeop = static_cast<std::uint8_t>(esc::AlState::SAFEOP);
constexpr std::uint8_t kAtPreop = static_cast<std::uint8_t>(esc::AlState::PREOP);

/// What the ESC has after power-on. Source: ESC datasheet, watchdogs.
std::uint16_t ResetValue(EscAddress address) {
  return address == esc::kWatchdogDivider ? 0x09C2 : 0x03E8;
}

struct Written {
  std::uint8_t value = 0;
  FrameNo frame = 0;
};

class Demands {
 public:
  Demands(const model::SlaveModel& slave, const EsiEvidence& evidence)
      : slave_(slave), device_(*slave.profile), evidence_(evidence) {
    Collect(evidence.bus, true);
    Collect(evidence.own, false);
    for (const MailboxSetting& setting : evidence.own.mailbox_settings) {
      if (setting.frame.number <= evidence.until) settings_.push_back(&setting);
    }
    // The state of before is known only of a start-up from INIT on, of which all is kept.
    whole_ = requested_.contains(kAtPreop) && evidence.own.steps_left_out == 0 && !evidence.lossy;
  }

  std::vector<EsiDemand> Run() {
    SyncManagers(true);
    Timeout(kAtPreop, device_.esi->timeouts.preop);
    InitCommands("IP", kAtSafeop);
    MailboxCommands("IP", kAtSafeop);
    Modules();
    InitCommands("PS", kAtSafeop);
    MailboxCommands("PS", kAtSafeop);
    SyncManagers(false);
    Fmmus();
    Watchdogs();
    Activation();
    Timeout(kAtSafeop, device_.esi->timeouts.safeop_op);
    InitCommands("SO", kAtOp);
    MailboxCommands("SO", kAtOp);
    Timeout(kAtOp, device_.esi->timeouts.safeop_op);
    return std::move(all_);
  }

 private:
  void Collect(const StartupSummary& startup, bool of_bus) {
    for (const StartupStep& step : startup.steps) {
      if (step.frame.number > evidence_.until) continue;
      switch (step.key.kind) {
        case StartupKey::Kind::kWrite:
          if (step.outcome != StartupOutcome::kRefused) Write(step);
          break;
        case StartupKey::Kind::kRequest:
          requested_.insert(static_cast<std::uint8_t>(step.key.address));
          if (!of_bus) requests_.push_back(&step);
          break;
        case StartupKey::Kind::kDownload:
          downloads_.push_back(&step);
          break;
        case StartupKey::Kind::kEeprom:
        case StartupKey::Kind::kUpload:
        case StartupKey::Kind::kDrive:
          break;
      }
    }
  }

  void Write(const StartupStep& step) {
    for (std::size_t i = 0; i < step.data.size(); ++i) {
      const auto address = static_cast<EscAddress>(step.key.address + i);
      Written& byte = registers_[address];
      if (byte.frame <= step.frame.number) byte = {step.data[i], step.frame.number};
    }
  }

  [[nodiscard]] const Written* Byte(EscAddress address) const {
    const auto at = registers_.find(address);
    return at == registers_.end() ? nullptr : &at->second;
  }
  /// Little endian; nothing where a byte of it was never written.
  [[nodiscard]] std::optional<std::uint16_t> Word(EscAddress address) const {
    const Written* low = Byte(address);
    const Written* high = Byte(static_cast<EscAddress>(address + 1));
    if (low == nullptr || high == nullptr) return std::nullopt;
    return static_cast<std::uint16_t>(low->value | high->value << 8U);
  }
  [[nodiscard]] FrameNo FrameOf(EscAddress address) const {
    const Written* byte = Byte(address);
    return byte == nullptr ? 0 : byte->frame;
  }

  /// A state, or one above it: a master may skip what is between.
  [[nodiscard]] bool IsDue(std::uint8_t before) const {
    return std::ranges::any_of(requested_, [before](std::uint8_t state) {
      return esc::IsAlState(state) && state != static_cast<std::uint8_t>(esc::AlState::BOOT) && state >= before;
    });
  }
  /// What is not seen: missing where the capture shows all of the start-up.
  [[nodiscard]] Status NotSeen(std::uint8_t before) const {
    return !IsDue(before) ? Status::kNotDue : whole_ ? Status::kMissing : Status::kUnknown;
  }

  EsiDemand& Add(Kind kind, std::uint8_t before, std::string what) {
    EsiDemand& demand = all_.emplace_back();
    demand.kind = kind;
    demand.before = before;
    demand.what = std::move(what);
    return demand;
  }

  // ----- SDO

  void InitCommands(std::string_view transition, std::uint8_t before) {
    for (const device::EsiInitCommand& command : device_.esi->init_commands) {
      const auto& transitions = command.transitions;
      if (std::ranges::find(transitions, transition) == transitions.end()) continue;
      if (all_.size() >= kMostDemands) return;
      StartupKey key;
      key.kind = StartupKey::Kind::kDownload;
      key.complete_access = command.complete_access;
      key.address = command.index;
      key.subindex = command.subindex;
      EsiDemand& demand =
          Add(Kind::kInitCommand, before,
              StepNoun(key, StepName(key, command.data.size(), &slave_)) + " (" + std::string(transition) + ")");
      demand.wanted = StepValue(key, command.data, &slave_);
      demand.by_sdo = true;
      const StartupStep* same = LastDownload([&](const StartupStep& step) { return step.key == key; });
      if (same != nullptr) {
        Compare(*same, command, key, demand);
        continue;
      }
      // The whole object at once, or entry by entry: its values are not compared.
      const StartupStep* other = LastDownload([&](const StartupStep& step) {
        const bool covers =
            command.complete_access || (step.key.complete_access && step.key.subindex <= command.subindex);
        return step.key.address == command.index && covers && step.outcome == StartupOutcome::kDone;
      });
      demand.status = other != nullptr ? Status::kMet : NotSeen(before);
      if (other != nullptr) demand.frame = other->frame.number;
    }
  }

  template <typename Fits>
  [[nodiscard]] const StartupStep* LastDownload(Fits&& fits) const {
    const StartupStep* last = nullptr;
    for (const StartupStep* step : downloads_) {
      if (fits(*step)) last = step;
    }
    return last;
  }

  void Compare(const StartupStep& step, const device::EsiInitCommand& command, const StartupKey& key,
               EsiDemand& demand) const {
    demand.frame = step.frame.number;
    if (step.outcome != StartupOutcome::kDone) {
      demand.seen = step.note;
      demand.status = step.outcome == StartupOutcome::kUnknown ? Status::kUnknown : Status::kDiffers;
      return;
    }
    const bool kept = !step.data.empty() && step.data.size() == step.size;  // else only the answer is known
    const bool same = !kept || command.data.empty() || step.data == command.data;
    demand.status = same ? Status::kMet : Status::kDiffers;
    if (!same) demand.seen = StepValue(key, step.data, &slave_);
  }

  // ----- SoE, EoE, AoE

  void MailboxCommands(std::string_view transition, std::uint8_t before) {
    for (const device::EsiMailboxCommand& command : device_.esi->mailbox_commands) {
      const auto& transitions = command.transitions;
      if (std::ranges::find(transitions, transition) == transitions.end()) continue;
      if (all_.size() >= kMostDemands) return;
      EsiDemand& demand = Add(Kind::kInitCommand, before, MailboxNoun(command) + " (" + std::string(transition) + ")");
      // The addresses of an installation are its own.
      const bool compared = command.protocol == mailbox::Protocol::kSoE && !command.data.empty();
      if (compared) demand.wanted = ValueText(command.data);
      const MailboxSetting* last = nullptr;
      bool other = false;  // of the protocol
      for (const MailboxSetting* setting : settings_) {
        if (setting->protocol != command.protocol) continue;
        other = true;
        if (Fits(*setting, command)) last = setting;
      }
      if (last == nullptr) {
        // AoE: who is addressed, and so which message it is, is not for sure.
        const bool unsure = other && command.protocol == mailbox::Protocol::kAoE;
        demand.status = unsure ? Status::kUnknown : NotSeen(before);
        continue;
      }
      demand.frame = last->frame.number;
      demand.status = last->outcome == StartupOutcome::kRefused   ? Status::kDiffers
                      : last->outcome == StartupOutcome::kUnknown ? Status::kUnknown
                                                                  : Status::kMet;
      if (last->outcome == StartupOutcome::kRefused) demand.seen = "an error of the slave, " + Hex(last->code);
      if (demand.status == Status::kMet && compared && !last->data.empty() && last->data != command.data) {
        demand.status = Status::kDiffers;
        demand.seen = ValueText(last->data);
      }
    }
  }
  [[nodiscard]] static bool Fits(const MailboxSetting& setting, const device::EsiMailboxCommand& command) {
    if (setting.number != command.number) return false;
    if (command.protocol == mailbox::Protocol::kAoE) return setting.data == command.data;
    return command.protocol != mailbox::Protocol::kSoE || !command.drive || setting.drive == *command.drive;
  }
  [[nodiscard]] static std::string MailboxNoun(const device::EsiMailboxCommand& command) {
    switch (command.protocol) {
      case mailbox::Protocol::kSoE:
        return "SoE write of " + mailbox::IdnName(command.number) +
               (command.drive ? ", drive " + std::to_string(*command.drive) : std::string());
      case mailbox::Protocol::kEoE:
        return "EoE " + mailbox::Name(static_cast<mailbox::EoeType>(std::min<std::uint16_t>(command.number, 15)));
      default:
        return "AoE " + (command.number == 0 ? std::string("message")
                                             : mailbox::Name(static_cast<mailbox::AdsCommand>(command.number)));
    }
  }
  /// 1, 2 or 4 bytes as a number, the lowest byte first.
  [[nodiscard]] static std::string ValueText(const std::vector<std::uint8_t>& data) {
    constexpr std::size_t kMostShown = 16;
    if (data.size() > 4 || data.size() == 3) {
      const std::size_t shown = std::min(data.size(), kMostShown);
      return HexBytes(ByteSpan(data).first(shown)) + (shown < data.size() ? "..." : "");
    }
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < data.size(); ++i) value |= std::uint32_t{data[i]} << (8 * i);
    return std::to_string(value) + " (" + Hex(value, static_cast<int>(2 * data.size())) + ")";
  }

  void Modules() {
    if (!device_.esi->slot_rules || !device_.esi->slot_rules->download_idents) return;
    EsiDemand& demand = Add(Kind::kModules, kAtSafeop, "download of the module list F030h");
    const StartupStep* list = LastDownload([](const StartupStep& step) { return step.key.address == kModuleIdents; });
    if (list == nullptr) {
      demand.status = NotSeen(kAtSafeop);
      return;
    }
    demand.frame = list->frame.number;
    demand.status = list->outcome == StartupOutcome::kDone      ? Status::kMet
                    : list->outcome == StartupOutcome::kUnknown ? Status::kUnknown
                                                                : Status::kDiffers;
    if (list->outcome != StartupOutcome::kDone) {
      demand.seen = list->note;
      return;
    }
    for (const StartupStep* step : downloads_) {
      if (step->key.address != kModuleIdents || step->outcome != StartupOutcome::kDone) continue;
      if (const std::string foreign = ForeignModule(*step); !foreign.empty()) {
        demand.status = Status::kDiffers;
        demand.seen = foreign;
        demand.frame = step->frame.number;
        return;
      }
    }
  }
  /// A module that the ESI does not have; nothing where it lists none at all, or the value is not whole.
  [[nodiscard]] std::string ForeignModule(const StartupStep& step) const {
    const auto& modules = device_.esi->slot_rules->modules;
    if (modules == nullptr || modules->empty() || step.data.size() != step.size) return {};
    if (step.key.subindex == 0 && !step.key.complete_access) return {};  // the number of them
    // Complete access from subindex 0: the count and a padding byte come first.
    for (std::size_t at = step.key.subindex == 0 ? 2 : 0; at + 4 <= step.data.size(); at += 4) {
      std::uint32_t ident = 0;
      for (std::size_t i = 0; i < 4; ++i) ident |= std::uint32_t{step.data[at + i]} << (8 * i);
      if (ident != 0 && device_.esi->slot_rules->Find(ident) == nullptr)
        return "module " + Hex(ident) + ", which the ESI does not list";
    }
    return {};
  }

  // ----- registers

  /// Start and control byte; the length of mailboxes only, that of process data follows from the assigned PDOs.
  void SyncManagers(bool mailbox) {
    for (const device::SyncManagerRule& rule : device_.mailbox.sync_managers) {
      if (rule.use == device::SyncManagerUse::kUnused || rule.mailbox_mode != mailbox || rule.number >= kMostManagers) {
        continue;
      }
      if (!rule.start || !rule.control) continue;  // not from an ESI, or it states no more
      const auto base = static_cast<EscAddress>(kManagerBase + rule.number * kManagerBytes);
      const auto start = Word(base);
      const auto length = Word(static_cast<EscAddress>(base + 2));
      const Written* control = Byte(static_cast<EscAddress>(base + 4));
      // A direction without process data needs none.
      if (!mailbox && ((length && *length == 0) || (!length && IsZero(rule.lengths)))) continue;
      const std::uint8_t before = mailbox ? kAtPreop : kAtSafeop;
      EsiDemand& demand = Add(Kind::kSyncManager, before, "SM" + std::to_string(rule.number) + " (" + Hex(base) + ")");
      const auto text = [&](std::uint32_t at, const std::optional<std::uint32_t>& bytes, std::uint8_t byte) {
        return "start " + Hex(static_cast<std::uint16_t>(at)) +
               (mailbox && bytes ? ", length " + std::to_string(*bytes) : std::string()) + ", control " + Hex(byte, 2);
      };
      const std::optional<std::uint32_t> wanted_length =
          rule.lengths.size() == 1 ? std::optional(rule.lengths.front()) : std::nullopt;
      demand.wanted = text(*rule.start, wanted_length, *rule.control);
      if (!start || !length || control == nullptr) {
        demand.status = NotSeen(before);
        continue;
      }
      demand.frame = control->frame;
      const bool same = *start == *rule.start && control->value == *rule.control &&
                        (!mailbox || !wanted_length || *length == *wanted_length);
      demand.status = same ? Status::kMet : Status::kDiffers;
      if (!same)
        demand.seen =
            text(*start, wanted_length ? std::optional<std::uint32_t>(*length) : std::nullopt, control->value);
    }
  }
  [[nodiscard]] static bool IsZero(const std::vector<std::uint32_t>& lengths) {
    return std::ranges::all_of(lengths, [](std::uint32_t length) { return length == 0; });
  }

  struct Area {
    std::uint32_t first = 0, end = 0;
    [[nodiscard]] bool Meets(const Area& other) const { return first < other.end && other.first < end; }
  };
  /// Process data that the sync managers of this direction hold, as the master set them up.
  [[nodiscard]] std::vector<Area> AreasOf(device::SyncManagerUse use, std::uint8_t usual) const {
    std::vector<Area> areas;
    const auto add = [&](std::uint8_t number) {
      const auto base = static_cast<EscAddress>(kManagerBase + number * kManagerBytes);
      const auto start = Word(base);
      const auto length = Word(static_cast<EscAddress>(base + 2));
      if (start && length && *length > 0) areas.push_back({*start, std::uint32_t{*start} + *length});
    };
    const auto& rules = device_.mailbox.sync_managers;
    bool described = false;
    for (const device::SyncManagerRule& rule : rules) {
      if (rule.use != use || rule.number >= kMostManagers) continue;
      described = true;
      add(rule.number);
    }
    if (!described) add(usual);
    return areas;
  }

  /// Which FMMU a master takes for a direction is its own matter.
  void Fmmus() {
    constexpr std::uint8_t kReads = 0x01, kWrites = 0x02;
    FmmuOf(device::FmmuUse::kOutputs, "outputs", kWrites, AreasOf(device::SyncManagerUse::kProcessOut, 2));
    FmmuOf(device::FmmuUse::kInputs, "inputs", kReads, AreasOf(device::SyncManagerUse::kProcessIn, 3));
  }
  void FmmuOf(device::FmmuUse use, std::string_view noun, std::uint8_t bit, const std::vector<Area>& areas) {
    const auto& uses = device_.esi->fmmus;
    if (std::ranges::find(uses, use) == uses.end() || areas.empty()) return;
    EsiDemand& demand = Add(Kind::kFmmu, kAtOp, "an FMMU for the " + std::string(noun));
    for (unsigned n = 0; n < kMostFmmus; ++n) {
      const auto base = static_cast<EscAddress>(kFmmuBase + n * kFmmuBytes);
      const auto length = Word(static_cast<EscAddress>(base + 4));
      const auto start = Word(static_cast<EscAddress>(base + 8));
      const Written* type = Byte(static_cast<EscAddress>(base + 11));
      const Written* active = Byte(static_cast<EscAddress>(base + 12));
      if (!length || !start || type == nullptr || active == nullptr) continue;
      const Area mapped{*start, std::uint32_t{*start} + *length};
      const bool there = std::ranges::any_of(areas, [&](const Area& area) { return area.Meets(mapped); });
      const bool direction = (type->value & bit) != 0;
      const bool on = (active->value & 1U) != 0;
      if (there && direction && on) {
        demand.status = Status::kMet;
        demand.seen.clear();
        demand.frame = type->frame;
        return;
      }
      // Registers, such as the state of the mailbox, are mapped for their own sake.
      const bool meant = there ? direction || on : direction && on && *start >= kMemory;
      if (!meant || !demand.seen.empty()) continue;
      demand.seen = "FMMU" + std::to_string(n) + " on " + Hex(*start) + ", " + Count(*length, "byte") +
                    (!on      ? ", switched off"
                     : !there ? ", " + DirectionText(type->value) + ", outside the sync manager"
                              : ", " + DirectionText(type->value));
      demand.frame = active->frame;
    }
    demand.status = !demand.seen.empty() && IsDue(kAtOp) ? Status::kDiffers : NotSeen(kAtOp);
    if (demand.status != Status::kDiffers) demand.seen.clear();
  }
  [[nodiscard]] static std::string DirectionText(std::uint8_t type) {
    switch (type & 3U) {
      case 1:
        return "read only";
      case 2:
        return "write only";
      case 3:
        return "read and write";
      default:
        return "without direction";
    }
  }

  void Watchdogs() {
    for (const auto& [address, value] : device_.esi->watchdogs) {
      EsiDemand& demand = Add(Kind::kWatchdog, kAtSafeop, "register " + Hex(address) + " (watchdog)");
      demand.wanted = Hex(value);
      const auto written = Word(address);
      demand.frame = FrameOf(address);
      if (written) {
        demand.status = *written == value ? Status::kMet : Status::kDiffers;
        if (*written != value) demand.seen = Hex(*written);
      } else {
        demand.status = ResetValue(address) == value && whole_ ? Status::kMet : NotSeen(kAtSafeop);
      }
    }
  }

  /// Low byte: 0x0980, high byte: 0x0981, of one of the operation modes.
  void Activation() {
    const std::vector<device::DcMode>& modes = device_.esi->dc_modes;
    if (modes.empty()) return;
    constexpr std::size_t kNamed = 4;
    EsiDemand& demand = Add(Kind::kActivation, kAtSafeop, "AssignActivate (0x0980, 0x0981)");
    for (std::size_t i = 0; i < modes.size() && i < kNamed; ++i) {
      demand.wanted += (i == 0 ? "" : " or ") + Hex(static_cast<std::uint16_t>(modes[i].assign_activate));
      if (!modes[i].name.empty()) demand.wanted += " (" + Printable(modes[i].name) + ")";
    }
    if (modes.size() > kNamed) demand.wanted += " or " + Count(modes.size() - kNamed, "other mode");
    const Written* assignment = Byte(esc::kCyclicUnitControl);
    const Written* activation = Byte(esc::kDcActivation);
    const auto offered = [&](std::optional<std::uint8_t> low, std::uint8_t high) {
      return std::ranges::any_of(modes, [&](const device::DcMode& mode) {
        return (!low || (mode.assign_activate & 0xFFU) == *low) && (mode.assign_activate >> 8U & 0xFFU) == high;
      });
    };
    if (activation == nullptr) {
      demand.status = whole_ && offered(0, 0) ? Status::kMet : NotSeen(kAtSafeop);
      return;
    }
    const std::optional<std::uint8_t> low = assignment != nullptr ? std::optional(assignment->value) : std::nullopt;
    demand.frame = activation->frame;
    // Switched off: 0x0980 does not matter.
    const bool fits = offered(activation->value == 0 ? std::nullopt : low, activation->value);
    demand.status = fits ? Status::kMet : IsDue(kAtSafeop) ? Status::kDiffers : Status::kNotDue;
    if (!fits) demand.seen = Hex(static_cast<std::uint16_t>(low.value_or(0) | activation->value << 8U));
  }

  // ----- times

  /// How long the master has to wait for a state.
  void Timeout(std::uint8_t state, const std::optional<TimeNs>& allowed) {
    if (allowed.value_or(0) <= 0) return;
    EsiDemand& demand = Add(Kind::kTimeout, state, "wait for " + esc::StateName(state));
    demand.wanted = "up to " + Duration(*allowed);
    demand.status = IsDue(state) ? Status::kUnknown : Status::kNotDue;
    for (std::size_t i = 0; i < requests_.size(); ++i) {
      const StartupStep& request = *requests_[i];
      if (request.key.address != state) continue;
      demand.frame = request.frame.number;
      if (request.outcome == StartupOutcome::kDone || request.outcome == StartupOutcome::kRefused) {
        demand.status = Status::kMet;  // there was an answer to wait for no longer
        continue;
      }
      if (request.outcome != StartupOutcome::kUnanswered) continue;
      const FrameRef& end = i + 1 < requests_.size() ? requests_[i + 1]->frame : request.last;
      if (!end.has_time || !request.frame.has_time) continue;
      const TimeNs waited = Elapsed(request.frame.time, end.time);
      demand.status = waited >= *allowed ? Status::kMet : Status::kDiffers;
      demand.seen = waited >= *allowed ? std::string() : "given up after " + Duration(waited);
    }
  }

  const model::SlaveModel& slave_;
  const device::DeviceDescription& device_;
  const EsiEvidence& evidence_;
  bool whole_ = false;
  std::map<EscAddress, Written> registers_;
  std::set<std::uint8_t> requested_;
  std::vector<const StartupStep*> requests_, downloads_;
  std::vector<const MailboxSetting*> settings_;
  std::vector<EsiDemand> all_;
};

}  // namespace

std::vector<EsiDemand> EsiDemandsOf(const model::SlaveModel& slave, const EsiEvidence& evidence) {
  if (slave.profile == nullptr || !slave.profile->esi || !evidence.own.seen) return {};
  return Demands(slave, evidence).Run();
}

}  // namespace ecaudit::startup
