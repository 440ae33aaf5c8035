/// in: when a drive goes into a fault and leaves it, emergencies, and what was read of it.  out: DriveFaultExplained.
///
/// keeps: the fault the drive is in, and what may explain the next one.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/model/drive_events.h"
#include "decoder/base/event_sink.h"
#include "decoder/device/device_description.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::model {

class DriveFaults {
 public:
  DriveFaults(SlaveId slave, EventSink& sink, std::uint8_t axis) : slave_(slave), sink_(sink), axis_(axis) {}

  void SetFamily(const device::DeviceDescription& family) { family_ = &family; }
  /// The status word shows a fault, and did not before.
  void OnFault(const FrameRef& frame);
  void OnFaultLeft() { fault_ = {}; }
  void OnEmergency(const mailbox::Emergency& emergency);
  /// The error code in the inputs.
  /// @param object  which object it is, in the first axis' numbers
  void OnErrorCode(std::uint16_t code, std::uint16_t object, const FrameRef& frame);
  /// An upload of an object; those that hold no reason of a fault are ignored.
  /// @param object  its index in the first axis' numbers
  void OnUpload(const mailbox::SdoTransfer& transfer, std::uint16_t object, const FrameRef& frame);

  /// As the inputs showed it last.
  [[nodiscard]] const std::optional<std::uint16_t>& error_code() const { return error_code_; }

 private:
  void Explain(DriveFaultExplained::Source source, std::uint16_t object, std::uint32_t code, const FrameRef& frame);

  SlaveId slave_;
  EventSink& sink_;
  std::uint8_t axis_;
  const device::DeviceDescription* family_ = nullptr;
  FrameRef fault_;  // status word that showed the fault the drive is in; not seen(): it is in none
  std::optional<std::uint16_t> error_code_;
  std::uint16_t error_object_ = 0;
  std::optional<mailbox::EmergencyData> emergency_;  // last one that reports a fault
  FrameRef emergency_frame_;
};

}  // namespace ecaudit::model
