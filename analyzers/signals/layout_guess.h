/// in: datagrams with process data in which no slave's place is known, and the one device that the user's ESI files
/// describe.  out: an ENI with the places, if exactly one arrangement of a number of these devices fits everything
/// seen.
///
/// A capture that starts mid-run holds neither FMMUs nor mapping. Masters pack the data of their slaves in order;
/// length and working counter show how many devices there are, and the bytes which arrangement it is: outputs come back
/// as they were sent, and status words show a drive state. What several arrangements fit stays unknown.
///
/// Source: esc-reference 2.1 (working counter), 13 (how masters build the process image).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/options/device_files.h"
#include "decoder/device/drive_profile.h"
#include "decoder/track/events.h"

namespace ecaudit::signals {

class LayoutGuess {
 public:
  /// Fewer exchanges are no evidence.
  static constexpr std::uint64_t kLeastFrames = 16;

  /// @param files  null: nothing will be found; must not hold an ENI
  explicit LayoutGuess(const DeviceFiles* files);

  /// Takes a datagram in which no slave has a place; only those of which both copies are captured count.
  void Add(const track::LogicalAccess& access);

  struct Found {
    std::shared_ptr<const DeviceFiles> files;  ///< those given, and an ENI with the places
    std::string what;  ///< "2 devices of drive.xml in LRW 0x00000000, outputs of all, then inputs"
  };
  [[nodiscard]] std::optional<Found> Find() const;

 private:
  enum class Order : std::uint8_t { kOutputsInputs, kInputsOutputs, kOutputsInputsEach, kInputsOutputsEach };
  struct Arrangement {
    Order order = Order::kOutputsInputs;
    std::vector<std::uint32_t> outputs;  ///< byte in the datagram, by device
    std::vector<std::uint32_t> inputs;
  };
  [[nodiscard]] std::vector<Arrangement> Candidates(std::uint16_t length, std::uint16_t wkc) const;
  [[nodiscard]] bool Fits(const Arrangement& arrangement, const track::LogicalAccess& access) const;

  const DeviceFiles* files_;
  const DeviceFiles::Esi* file_ = nullptr;
  const device::DeviceDescription* device_ = nullptr;
  const device::DriveProfile* drive_ = nullptr;
  std::uint32_t output_bytes_ = 0;
  std::uint32_t input_bytes_ = 0;
  std::optional<std::uint32_t> status_word_;  ///< byte in the inputs of a device

  bool several_ = false;  ///< datagrams of several kinds: not understood
  std::uint32_t address_ = 0;
  std::uint16_t length_ = 0;
  std::uint16_t wkc_ = 0;  ///< the highest: all devices took part
  std::uint64_t frames_ = 0;
  std::vector<Arrangement> left_;
};

}  // namespace ecaudit::signals
