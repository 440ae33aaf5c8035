/// The EtherCAT slave controller of a simulated slave: register memory, sync managers, FMMUs, EEPROM interface and
/// distributed clock, as seen from the wire and from the slave's processor (PDI). Numbers: esc-reference chapters 2
/// to 7.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/base/ids.h"
#include "samples/builder/dc_clock.h"
#include "samples/builder/frame_builder.h"
#include "samples/builder/wire_bytes.h"

namespace ecaudit::samples {

inline constexpr TimeNs kMs = 1'000'000;

/// Register addresses that the builder uses by name.
namespace reg {
inline constexpr std::uint16_t kInformation = 0x0000;
inline constexpr std::uint16_t kStationAddress = 0x0010;
inline constexpr std::uint16_t kAlias = 0x0012;
inline constexpr std::uint16_t kDlControl = 0x0100;
inline constexpr std::uint16_t kDlStatus = 0x0110;
inline constexpr std::uint16_t kAlControl = 0x0120;
inline constexpr std::uint16_t kAlStatus = 0x0130;
inline constexpr std::uint16_t kAlStatusCode = 0x0134;
inline constexpr std::uint16_t kPdiControl = 0x0140;
inline constexpr std::uint16_t kEventMask = 0x0200;
inline constexpr std::uint16_t kEventRequest = 0x0210;
inline constexpr std::uint16_t kRxErrors = 0x0300;
inline constexpr std::uint16_t kLostLinks = 0x0310;
inline constexpr std::uint16_t kWatchdogDivider = 0x0400;
inline constexpr std::uint16_t kWatchdogPdi = 0x0410;
inline constexpr std::uint16_t kWatchdogProcessData = 0x0420;
inline constexpr std::uint16_t kWatchdogStatus = 0x0440;
inline constexpr std::uint16_t kEepromConfig = 0x0500;
inline constexpr std::uint16_t kEepromControl = 0x0502;
inline constexpr std::uint16_t kEepromAddress = 0x0504;
inline constexpr std::uint16_t kEepromData = 0x0508;
inline constexpr std::uint16_t kFmmu = 0x0600;
inline constexpr std::uint16_t kSyncManager = 0x0800;
inline constexpr std::uint16_t kReceiveTime = 0x0900;
inline constexpr std::uint16_t kSystemTime = 0x0910;
inline constexpr std::uint16_t kReceiveTimeEpu = 0x0918;
inline constexpr std::uint16_t kTimeOffset = 0x0920;
inline constexpr std::uint16_t kTimeDelay = 0x0928;
inline constexpr std::uint16_t kTimeDifference = 0x092C;
inline constexpr std::uint16_t kSpeedCounterStart = 0x0930;
inline constexpr std::uint16_t kFilterDepth = 0x0934;
inline constexpr std::uint16_t kCyclicUnit = 0x0980;
inline constexpr std::uint16_t kSyncActivation = 0x0981;
inline constexpr std::uint16_t kSyncStart = 0x0990;
inline constexpr std::uint16_t kSync0Cycle = 0x09A0;
inline constexpr std::uint16_t kSync1Cycle = 0x09A4;
}  // namespace reg

struct EscDescription {
  /// Registers 0x0000-0x0009: type, revision, build, FMMUs, SMs, RAM in KiB, ports, features. Default: as an AKD
  /// answers.
  std::array<std::uint8_t, 10> information{0x04, 0x02, 0x43, 0x00, 3, 4, 4, 0x0F, 0x84, 0x01};
  bool device_emulation = false;                    ///< no processor: AL Control is copied to AL Status
  bool eeprom_emulated = false;                     ///< bit 5 of 0x0502, and one read gives 4 bytes instead of 8
  bool receive_times_only = false;                  ///< DC without system time
  std::int64_t clock_ppb = 0;                       ///< deviation of the oscillator, parts in 10^9
  std::uint64_t clock_at_power_on = 1'000'000'000;  ///< local time when the simulation starts, ns
  TimeNs eeprom_read_time = 300'000;
  Bytes eeprom{};
};

/// Where a frame is on its way: `back` is when it passes this slave again on the way to the master; equal to `arrival`
/// for the last slave of the line.
struct Passage {
  TimeNs arrival = 0;
  TimeNs back = 0;
};

struct SyncManagerSettings {
  std::uint16_t start = 0;
  std::uint16_t length = 0;
  std::uint8_t control = 0;
  bool enabled = false;

  [[nodiscard]] bool mailbox() const { return (control & 0x03U) == 2; }
  [[nodiscard]] bool master_writes() const { return (control & 0x0CU) == 4; }
  [[nodiscard]] bool watchdog_trigger() const { return (control & 0x40U) != 0; }
};

class Esc {
 public:
  /// @param power_on  start of the simulation
  Esc(EscDescription description, TimeNs power_on);

  // --- the wire
  /// Lets one datagram pass: reads, writes, working counter, address counter, event field.
  void Process(Datagram& datagram, const Passage& passage);

  // --- the processor of the slave
  [[nodiscard]] std::uint8_t Byte(std::uint16_t address) const { return memory_[address]; }
  [[nodiscard]] std::uint16_t Word(std::uint16_t address) const { return LoadLe<std::uint16_t>(memory_, address); }
  void SetByte(std::uint16_t address, std::uint8_t value) { memory_[address] = value; }
  void SetWord(std::uint16_t address, std::uint16_t value) { StoreLe(memory_, address, value); }

  /// When the master wrote AL Control, until TakeAlControl() is called.
  [[nodiscard]] std::optional<TimeNs> al_control_written() const { return al_control_written_; }
  std::uint16_t TakeAlControl();
  void SetAlStatus(std::uint16_t status, std::uint16_t code);

  [[nodiscard]] int sync_manager_count() const { return memory_[5]; }
  [[nodiscard]] SyncManagerSettings sync_manager(int n) const;
  /// When the mailbox of sync manager `n` (written by the master) became full; empty while it is not.
  [[nodiscard]] std::optional<TimeNs> mailbox_filled(int n) const { return sm_state_.at(Index(n)).filled; }
  [[nodiscard]] bool mailbox_full(int n) const { return sm_state_.at(Index(n)).full; }
  /// Reads and empties a full mailbox that the master wrote.
  Bytes TakeMailbox(int n);
  /// Fills an empty mailbox that the master reads; false when it is full or not configured.
  bool PutMailbox(int n, ByteView content);
  /// When the master read the mailbox empty last.
  [[nodiscard]] TimeNs mailbox_read(int n) const { return sm_state_.at(Index(n)).emptied; }
  /// The last complete process data the master wrote, and when.
  [[nodiscard]] const Bytes& outputs(int n) const { return sm_state_.at(Index(n)).committed; }
  [[nodiscard]] std::optional<TimeNs> outputs_written(int n) const { return sm_state_.at(Index(n)).written; }
  void ForgetOutputs(int n) { sm_state_.at(Index(n)).written.reset(); }
  /// New process data for the master to read; cut or zero-filled to the length of the sync manager.
  void PutInputs(int n, ByteView data);
  /// Bit 0 of the PDI control byte: the slave locks the sync manager.
  void LockSyncManager(int n, bool locked);
  /// True when the master toggled the repeat bit and it was not acknowledged yet.
  [[nodiscard]] bool RepeatRequested(int n) const;
  void AcknowledgeRepeat(int n);

  /// Physical link of a port; port 0 is towards the master. Losing it counts at 0x0310 + port.
  void SetLink(int port, bool up);
  /// IN and OUT are swapped: the frame passes port 1 on its way out, and is processed when it comes back at port 0.
  void SwapPorts() { ports_swapped_ = true; }
  /// Adds to an error counter, which stops at 255.
  void CountErrors(std::uint16_t address, int count);

  [[nodiscard]] std::int64_t SystemTime(TimeNs now) const { return clock_.SystemTime(now, Offset()); }
  [[nodiscard]] const Bytes& eeprom() const { return description_.eeprom; }

 private:
  struct SmState {
    bool full = false;
    bool open = false;
    bool inputs_valid = false;
    std::uint8_t buffer = 3;  // last written of three; 3: none
    std::optional<TimeNs> filled;
    std::optional<TimeNs> written;
    TimeNs emptied = 0;
    Bytes committed;
  };
  struct Fmmu {
    std::uint64_t logical_bit = 0;
    std::uint64_t bits = 0;
    std::uint64_t physical_bit = 0;
    bool read = false;
    bool write = false;
    bool active = false;
  };

  static std::size_t Index(int n) { return static_cast<std::size_t>(n); }
  [[nodiscard]] std::uint16_t Sm(int n) const { return static_cast<std::uint16_t>(reg::kSyncManager + 8 * n); }
  [[nodiscard]] std::int64_t Offset() const;
  [[nodiscard]] bool Readable(std::uint16_t address) const;
  [[nodiscard]] bool Writable(std::uint16_t address) const;
  [[nodiscard]] bool Implemented(std::uint16_t address) const;
  [[nodiscard]] int SyncManagerAt(std::uint16_t address) const;
  [[nodiscard]] Fmmu ReadFmmu(int n) const;

  void Refresh(TimeNs now);
  bool Read(std::uint16_t address, std::span<std::uint8_t> out, bool combine, const Passage& passage);
  bool ReadSyncManager(int n, std::size_t first, std::span<std::uint8_t> out, bool combine, TimeNs now);
  bool Write(std::uint16_t address, ByteView data, ByteView mask, const Passage& passage);
  bool WriteSyncManager(int n, std::size_t first, ByteView data, ByteView mask, TimeNs now);
  bool WriteRegister(std::uint16_t address, std::uint8_t value, std::uint8_t mask);
  void AfterWrite(std::uint16_t first, std::uint16_t last, const Passage& passage);
  void EepromCommand(TimeNs now);
  void ProcessLogical(Datagram& datagram, const Passage& passage);

  EscDescription description_;
  Bytes memory_;
  std::array<SmState, 16> sm_state_;
  DcClock clock_;
  std::optional<TimeNs> al_control_written_;
  TimeNs eeprom_done_ = 0;
  bool ports_swapped_ = false;
  std::array<std::uint8_t, 16> sm_activate_before_{};
};

}  // namespace ecaudit::samples
