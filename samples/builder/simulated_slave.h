/// One slave: an Esc, and the application behind it (AL state machine, mailbox, process data, drive).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/ids.h"
#include "samples/builder/coe_server.h"
#include "samples/builder/drive_model.h"
#include "samples/builder/esc.h"
#include "samples/builder/object_dictionary.h"
#include "samples/builder/sii_image.h"

namespace ecaudit::samples {

/// AL states (esc-reference 5.1).
enum class Al : std::uint8_t { kInit = 1, kPreop = 2, kBoot = 3, kSafeop = 4, kOp = 8 };

/// What the slave does with a request instead of what its manual says.
struct AlOverride {
  enum class Action : std::uint8_t { kRefuse, kIgnore, kAccept };
  std::uint8_t from = 0;  ///< 0: from any state
  std::uint8_t to = 0;    ///< 0: to any state
  Action action = Action::kRefuse;
  std::uint16_t code = 0;
  int times = -1;  ///< -1: always
};

struct AlBehaviour {
  TimeNs read_time = 250'000;  ///< until the application reads AL Control
  TimeNs preop_time = 4'000'000;
  TimeNs safeop_time = 3'000'000;
  TimeNs op_time = 2'000'000;
  TimeNs down_time = 600'000;
  std::uint16_t unknown_state_code = 0x0011;  ///< the manual has no 0x0012
  std::uint16_t mailbox_code = 0x0017;        ///< refusal of INIT to PREOP for a bad SM0 or SM1
  std::uint16_t process_data_code = 0x0017;   ///< refusal of PREOP to SAFEOP for a bad SM2 or SM3
};

struct SlaveDescription {
  std::string name{};
  EscDescription esc{};
  SiiContent sii{};
  AlBehaviour al{};
  CoeBehaviour coe{};
  bool is_drive = false;
  bool has_latches = false;
  std::uint16_t outputs_start = 0;  ///< SM2 with a mailbox, else none
  std::uint16_t inputs_start = 0;
  /// If SM3 has one buffer: how often the application fills it; 0: never.
  TimeNs fills_inputs_every = 0;
  ObjectDictionary objects{};
};

class SimulatedSlave {
 public:
  SimulatedSlave(SlaveDescription description, TimeNs power_on);
  SimulatedSlave(const SimulatedSlave&) = delete;
  SimulatedSlave& operator=(const SimulatedSlave&) = delete;

  /// Lets the application work up to `now`.
  void Advance(TimeNs now);
  void Process(Datagram& datagram, const Passage& passage) { esc_.Process(datagram, passage); }

  [[nodiscard]] const SlaveDescription& description() const { return description_; }
  [[nodiscard]] Esc& esc() { return esc_; }
  [[nodiscard]] ObjectDictionary& objects() { return objects_; }
  [[nodiscard]] CoeServer& coe() { return coe_; }
  [[nodiscard]] DriveModel& drive() { return drive_; }
  [[nodiscard]] std::uint8_t state() const { return esc_.Word(reg::kAlStatus) & 0x0FU; }
  /// Bytes of the PDOs assigned in `assignment` (1C12h or 1C13h).
  [[nodiscard]] std::uint16_t ProcessDataBytes(std::uint16_t assignment) const;

  void Override(AlOverride one) { overrides_.push_back(one); }
  /// At `at` the slave changes AL Status by itself.
  void ChangeStatusAt(TimeNs at, std::uint16_t status, std::uint16_t code) { planned_ = Planned{at, status, code}; }

 private:
  struct Planned {
    TimeNs at = 0;
    std::uint16_t status = 0;
    std::uint16_t code = 0;
  };

  void HandleAlControl(TimeNs at, std::uint16_t control);
  void Enter(TimeNs at, std::uint16_t status, std::uint16_t code);
  [[nodiscard]] std::uint16_t CheckTransition(std::uint8_t from, std::uint8_t to) const;
  [[nodiscard]] bool MailboxSyncManagersGood() const;
  [[nodiscard]] bool ProcessSyncManagersGood() const;
  void CheckWatchdog(TimeNs now);
  void ExchangeProcessData(TimeNs now);
  std::uint32_t CheckDownload(std::uint16_t index, std::uint8_t subindex, ByteView value) const;

  SlaveDescription description_;
  Esc esc_;
  ObjectDictionary objects_;
  CoeServer coe_;
  DriveModel drive_;
  std::vector<AlOverride> overrides_;
  std::optional<Planned> planned_;
  TimeNs op_since_ = 0;
  std::optional<TimeNs> outputs_seen_;
  TimeNs inputs_filled_ = 0;
};

}  // namespace ecaudit::samples
