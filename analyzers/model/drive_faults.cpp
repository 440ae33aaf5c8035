#include "analyzers/model/drive_faults.h"

#include "analyzers/objects/relatives.h"
#include "decoder/base/bytes.h"

namespace ecaudit::model {
namespace {

using Source = DriveFaultExplained::Source;

/// An emergency that is older does not explain a fault.
constexpr std::int64_t kEmergencyBeforeFault_ns = 1'000'000'000;

}  // namespace

void DriveFaults::OnFault(const FrameRef& frame) {
  fault_ = frame;
  if (emergency_) {
    const bool timed = frame.has_time && emergency_frame_.has_time;
    if (!timed || frame.time - emergency_frame_.time <= kEmergencyBeforeFault_ns) {
      Explain(Source::kEmergency, 0, emergency_->error_code, emergency_frame_);
    }
  }
  if (error_code_ && *error_code_ != 0) Explain(Source::kErrorCode, error_object_, *error_code_, frame);
}

void DriveFaults::OnEmergency(const mailbox::Emergency& emergency) {
  if (emergency.data.error_code == 0) {
    emergency_.reset();
    return;
  }
  const events::EmergencyInfo info = events::FindEmergency(family_, emergency.data.error_code);
  if (info.code != nullptr && info.code->kind != device::EmergencyKind::kFault) return;
  emergency_ = emergency.data;
  emergency_frame_ = emergency.frame;
  Explain(Source::kEmergency, 0, emergency.data.error_code, emergency.frame);
}

void DriveFaults::OnErrorCode(std::uint16_t code, std::uint16_t object, const FrameRef& frame) {
  if (error_code_ == code) return;
  error_code_ = code;
  error_object_ = object;
  if (code != 0) Explain(Source::kErrorCode, object, code, frame);
}

void DriveFaults::OnUpload(const mailbox::SdoTransfer& transfer, std::uint16_t object, const FrameRef& frame) {
  const device::FaultObject* row = family_->drive->FindFaultObject(object, transfer.subindex);
  if (row == nullptr || transfer.size * 8 != row->bits) return;
  const bool is_number = row->kind == device::FaultValue::kFaultNumber;
  const std::uint32_t value = is_number && row->bits == 32 ? LittleEndian<std::uint32_t>(transfer.data, 0)
                                                           : LittleEndian<std::uint16_t>(transfer.data, 0);
  if (value != 0) Explain(is_number ? Source::kFaultNumber : Source::kErrorCode, object, value, frame);
}

void DriveFaults::Explain(Source source, std::uint16_t object, std::uint32_t code, const FrameRef& frame) {
  if (fault_.seen()) sink_.Publish(DriveFaultExplained{slave_, axis_, frame, fault_, source, object, code});
}

}  // namespace ecaudit::model
