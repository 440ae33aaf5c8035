/// in: the accesses to one slave, in order.  out: EEPROM reads, writes and errors, and the EEPROM image they add up to.
///
///   write 0x0502 command (+ 0x0504 word address, + 0x0508 data)  ->  poll 0x0502 until not busy  ->  read 0x0508 data
///
/// Source: esc-reference 4.6, 11.2.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "decoder/base/allowance.h"
#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"
#include "decoder/esc/sii.h"
#include "decoder/track/access.h"

namespace ecaudit::track {

/// Words the master got from the EEPROM. One command gives one or, where the master fetches the data in parts, several.
struct EepromRead {
  SlaveId slave = kNoSlave;
  FrameRef command;           ///< the frame with the read command; not seen when the answer itself named the address
  FrameRef frame;             ///< the frame that brought the words
  std::uint32_t address = 0;  ///< word address of the first word
  std::span<const std::uint16_t> words;  ///< 1-4, valid during the call
};

struct EepromWrite {
  SlaveId slave = kNoSlave;
  FrameRef command;
  FrameRef frame;                       ///< the status that ended it; not seen when `confirmed` is false
  std::uint32_t address = 0;            ///< word address
  std::optional<std::uint16_t> word;    ///< unknown when its bytes were not captured
  bool confirmed = false;               ///< a status without busy and without error was read afterwards
  std::optional<std::uint16_t> before;  ///< what the word was, where that is known
};

/// Bits of EepromError::bits, as in 0x0502.
enum EepromErrorBit : std::uint16_t {
  kEepromChecksumError = 0x0800,
  kEepromNotLoaded = 0x1000,
  kEepromNoAcknowledge = 0x2000,  ///< missing acknowledge or invalid command
  kEepromWriteEnable = 0x4000,    ///< write without enable
};
inline constexpr std::uint16_t kEepromErrorMask = 0x7800;

/// The status 0x0502 shows error bits that it did not show before, or again after a new command.
struct EepromError {
  SlaveId slave = kNoSlave;
  FrameRef command;                      ///< the command it ends; not seen when none was pending
  FrameRef frame;                        ///< the status read
  std::uint16_t bits = 0;                ///< EepromErrorBit
  std::optional<std::uint32_t> address;  ///< word address of the command
  bool write = false;                    ///< the command is a write
};

class SiiListener {
 public:
  virtual ~SiiListener() = default;
  virtual void OnEepromRead(const EepromRead& /*event*/) {}
  virtual void OnEepromWrite(const EepromWrite& /*event*/) {}
  virtual void OnEepromError(const EepromError& /*event*/) {}
  /// The ESC was commanded to load its configuration from the EEPROM again.
  virtual void OnEepromReload(SlaveId /*slave*/, const FrameRef& /*command*/) {}
  /// The EEPROM was given to the slave's processor (`to_pdi`) or taken back.
  virtual void OnEepromOwner(SlaveId /*slave*/, const FrameRef& /*frame*/, bool /*to_pdi*/) {}
};

/// Follows the EEPROM interface of one slave.
///
/// Keeps: the registers of the interface as last written, one command, the image.
/// Unknown: words whose address is uncertain are dropped, so the image holds only what was seen. That is the case after
/// a command that may or may not have been accepted, after the slave's processor got the EEPROM, and for data read
/// while busy or without a status that shows not busy. Broadcast commands count like others; broadcast reads are the OR
/// of all slaves and end the busy state only.
class SiiAssembler {
 public:
  /// @param pages what all slaves share for images; null: no common limit; else must outlive this
  explicit SiiAssembler(SlaveId slave = kNoSlave, Allowance* pages = nullptr) : slave_(slave), pages_(pages) {}

  /// @param listener may be null
  void OnAccess(const SlaveAccess& access, SiiListener* listener);
  /// The slave restarted or a part of the capture is missing: forgets the interface, keeps the image.
  void Forget();
  /// At the end of the capture: hands out a write whose end was not seen.
  void Finish(SiiListener* listener);

  [[nodiscard]] const esc::SiiImage& image() const { return image_; }
  /// Last value of 0x0500 written: bit 0 gives the EEPROM to the slave's processor. Unknown at first.
  [[nodiscard]] std::optional<bool> owned_by_pdi() const { return owned_by_pdi_; }
  /// A command was given and its end not seen yet.
  [[nodiscard]] bool busy() const { return command_.kind != Kind::kNone && !command_.ended; }
  /// Last status 0x0502 seen; bit 5: emulated by the slave's processor, bit 6: eight bytes a read.
  [[nodiscard]] std::optional<std::uint16_t> status() const { return status_; }

 private:
  enum class Kind : std::uint8_t { kNone, kRead, kWrite, kReload, kOther };
  struct Command {
    Kind kind = Kind::kNone;
    FrameRef frame;
    bool assumed = false;  ///< only outbound frames are captured
    bool ended = false;    ///< not busy any more
    bool failed = false;
    std::optional<std::uint32_t> address;
    std::optional<std::uint16_t> data;  ///< of a write
    std::uint8_t delivered = 0;         ///< bit n: word n of a read was handed out
  };

  void OnRead(const SlaveAccess& access, SiiListener* listener);
  void OnStatus(const SlaveAccess& access, std::uint16_t status, SiiListener* listener);
  void OnData(const SlaveAccess& access, bool fresh_status, SiiListener* listener);
  void OnWrite(const SlaveAccess& access, SiiListener* listener);
  void OnOwner(const SlaveAccess& access, std::uint8_t value, SiiListener* listener);
  void Start(const SlaveAccess& access, std::uint8_t command, SiiListener* listener);
  esc::SiiImage::Change Learn(std::uint32_t word, std::uint16_t value);
  void EndWrite(const FrameRef& frame, bool confirmed, SiiListener* listener);
  /// Word address from 0x0504 as last written; unknown when its lower half is.
  [[nodiscard]] std::optional<std::uint32_t> WrittenAddress() const;
  [[nodiscard]] std::optional<std::uint16_t> WrittenData() const;

  SlaveId slave_;
  Allowance* pages_;
  esc::SiiImage image_;
  Command command_;
  std::array<std::uint8_t, 6> written_{};  ///< 0x0504-0x0509 as last written
  std::uint8_t written_known_ = 0;         ///< bit n: byte n of it is known
  std::optional<std::uint16_t> status_;
  std::uint16_t reported_errors_ = 0;
  std::optional<bool> owned_by_pdi_;
};

}  // namespace ecaudit::track
