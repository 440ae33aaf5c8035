#include "decoder/track/sii_tracker.h"

#include "decoder/esc/register_addresses.h"

namespace ecaudit::track {
namespace {

constexpr EscAddress kCommand = 0x0503;

constexpr std::uint16_t kBusy = 0x8000;
constexpr std::uint16_t kEightBytes = 0x0040;
/// The command failed; the other error bits describe the EEPROM's contents and do not stop a command.
constexpr std::uint16_t kCommandFailed = kEepromNoAcknowledge | kEepromWriteEnable;

bool Touches(const SlaveAccess& access, ByteSpan span, std::uint32_t first, std::uint32_t length) {
  return access.address < first + length && access.address + span.size() > first;
}

}  // namespace

void SiiAssembler::OnAccess(const SlaveAccess& access, SiiListener* listener) {
  if (!Touches(access, access.written, esc::kEepromConfiguration, esc::kEepromEnd - esc::kEepromConfiguration) &&
      !Touches(access, access.read, esc::kEepromConfiguration, esc::kEepromEnd - esc::kEepromConfiguration)) {
    return;
  }
  if (access.done()) {
    OnRead(access, listener);
    OnWrite(access, listener);
    return;
  }
  if (access.acceptance != Acceptance::kUnknown || access.written.empty()) return;
  // It is unknown whether it was done: neither the old nor the new command can be relied on.
  if (Touches(access, access.written, esc::kEepromConfiguration, 1)) owned_by_pdi_.reset();
  if (Touches(access, access.written, esc::kEepromConfiguration, 1) || Touches(access, access.written, kCommand, 1)) {
    EndWrite(access.frame(), false, listener);
    command_ = {};
  }
  for (std::size_t i = 0; i < written_.size(); ++i) {
    if (Touches(access, access.written, static_cast<std::uint32_t>(esc::kEepromAddress + i), 1)) {
      written_known_ = static_cast<std::uint8_t>(written_known_ & ~(1U << i));
    }
  }
}

void SiiAssembler::Forget() {
  command_ = {};
  written_known_ = 0;
  status_.reset();
  owned_by_pdi_.reset();
}

void SiiAssembler::Finish(SiiListener* listener) {
  EndWrite({}, false, listener);
}

void SiiAssembler::OnRead(const SlaveAccess& access, SiiListener* listener) {
  const ByteSpan status = access.Covered(access.read, esc::kEepromControl, 2);
  if (!status.empty()) OnStatus(access, LittleEndian<std::uint16_t>(status, 0), listener);
  if (!access.broadcast) OnData(access, !status.empty(), listener);
}

void SiiAssembler::OnStatus(const SlaveAccess& access, std::uint16_t status, SiiListener* listener) {
  if (access.broadcast) {
    status &= kBusy;  // the other bits may be another slave's
  } else {
    status_ = status;
  }
  if ((status & kBusy) != 0) return;

  const std::uint16_t errors = status & kEepromErrorMask;
  const bool ends = command_.kind != Kind::kNone && !command_.ended;
  if (!access.broadcast) {
    if ((errors & ~reported_errors_) != 0 && listener != nullptr) {
      listener->OnEepromError({slave_, ends ? command_.frame : FrameRef{}, access.frame(), errors,
                               ends ? command_.address : std::nullopt, ends && command_.kind == Kind::kWrite});
    }
    reported_errors_ = errors;
  }
  if (!ends) return;
  const bool failed = (errors & kCommandFailed) != 0;
  if (command_.kind == Kind::kWrite && !failed) return EndWrite(access.frame(), !access.broadcast, listener);
  if (command_.kind == Kind::kWrite && command_.address) image_.Forget(*command_.address);
  command_.ended = true;
  command_.failed = failed;
}

void SiiAssembler::OnData(const SlaveAccess& access, bool fresh_status, SiiListener* listener) {
  if (!Touches(access, access.read, esc::kEepromData, 8)) return;
  // An answer that holds status, address and data (TwinCAT) names its words by itself.
  std::optional<std::uint32_t> shown;
  if (const ByteSpan address = access.Covered(access.read, esc::kEepromAddress, 4); !address.empty()) {
    shown = LittleEndian<std::uint32_t>(address, 0);
  }
  std::optional<std::uint32_t> first;
  if (command_.kind == Kind::kRead) {
    if (!command_.ended || command_.failed) return;
    if (command_.address && shown && *command_.address != *shown) return;
    first = command_.address ? command_.address : shown;
  } else if (command_.kind == Kind::kNone && shown && fresh_status && status_ &&
             (*status_ & (kBusy | kCommandFailed)) == 0) {
    first = shown;
  }
  if (!first) return;

  const std::size_t count = status_ && (*status_ & kEightBytes) != 0 ? 4 : 2;
  std::array<std::uint16_t, 4> words{};
  std::size_t run = 0;  // words gathered, ending before word i
  for (std::size_t i = 0; i <= count; ++i) {
    const ByteSpan bytes =
        i < count ? access.Covered(access.read, static_cast<EscAddress>(esc::kEepromData + 2 * i), 2) : ByteSpan{};
    bool wanted = !bytes.empty() && (command_.delivered >> i & 1U) == 0;
    if (wanted) {
      const std::uint16_t word = LittleEndian<std::uint16_t>(bytes, 0);
      const auto address = static_cast<std::uint32_t>(*first + i);
      const auto change = Learn(address, word);
      if (command_.kind == Kind::kRead) {
        command_.delivered = static_cast<std::uint8_t>(command_.delivered | 1U << i);
      } else {
        wanted = change != esc::SiiImage::Change::kNone;  // polled again: nothing new
      }
      if (wanted) words[run++] = word;
    }
    if (!wanted && run != 0) {
      if (listener != nullptr) {
        listener->OnEepromRead({slave_, command_.frame, access.frame(), static_cast<std::uint32_t>(*first + i - run),
                                std::span<const std::uint16_t>(words).first(run)});
      }
      run = 0;
    }
  }
}

void SiiAssembler::OnWrite(const SlaveAccess& access, SiiListener* listener) {
  bool registers = false;
  for (std::size_t i = 0; i < written_.size(); ++i) {
    const ByteSpan byte = access.Covered(access.written, static_cast<EscAddress>(esc::kEepromAddress + i), 1);
    if (byte.empty()) continue;
    written_[i] = byte[0];
    written_known_ = static_cast<std::uint8_t>(written_known_ | 1U << i);
    registers = true;
  }
  if (const ByteSpan owner = access.Covered(access.written, esc::kEepromConfiguration, 1); !owner.empty()) {
    OnOwner(access, owner[0], listener);
  }
  if (const ByteSpan command = access.Covered(access.written, kCommand, 1); !command.empty()) {
    Start(access, command[0], listener);
  } else if (registers && !command_.ended && access.frame().seen() && access.frame().number == command_.frame.number) {
    // The ESC acts at the end of the frame, with the address and data that later datagrams of it brought.
    command_.address = WrittenAddress();
    if (command_.kind == Kind::kWrite) command_.data = WrittenData();
  }
}

void SiiAssembler::OnOwner(const SlaveAccess& access, std::uint8_t value, SiiListener* listener) {
  const bool to_pdi = (value & 0x01U) != 0;
  if (to_pdi) {
    // From now on the slave's processor may use the same registers.
    EndWrite(access.frame(), false, listener);
    command_ = {};
    written_known_ = 0;
  }
  if (owned_by_pdi_ != to_pdi && listener != nullptr) listener->OnEepromOwner(slave_, access.frame(), to_pdi);
  owned_by_pdi_ = to_pdi;
}

void SiiAssembler::Start(const SlaveAccess& access, std::uint8_t command, SiiListener* listener) {
  reported_errors_ = static_cast<std::uint16_t>(reported_errors_ & ~kCommandFailed);
  const unsigned code = command & 0x07U;
  if (code == 0) return;  // clears the error bits; data and address stay
  EndWrite(access.frame(), false, listener);
  command_ = {};
  command_.frame = access.frame();
  command_.assumed = access.acceptance == Acceptance::kAssumed;
  command_.address = WrittenAddress();
  switch (code) {
    case 1:
      command_.kind = Kind::kRead;
      break;
    case 2:
      command_.kind = Kind::kWrite;
      command_.data = WrittenData();
      break;
    case 4:
      command_.kind = Kind::kReload;
      if (listener != nullptr) listener->OnEepromReload(slave_, access.frame());
      break;
    default:
      command_.kind = Kind::kOther;
      break;
  }
}

esc::SiiImage::Change SiiAssembler::Learn(std::uint32_t word, std::uint16_t value) {
  if (!image_.HasRoom(word) && !TakeFrom(pages_, 1)) return esc::SiiImage::Change::kNone;
  return image_.Set(word, value);
}

void SiiAssembler::EndWrite(const FrameRef& frame, bool confirmed, SiiListener* listener) {
  if (command_.kind != Kind::kWrite || command_.ended) return;
  command_.ended = true;
  if (command_.address) {
    const std::optional<std::uint16_t> before = image_.Word(*command_.address);
    if (command_.data && (confirmed || command_.assumed)) {
      Learn(*command_.address, *command_.data);
    } else {
      image_.Forget(*command_.address);
    }
    if (listener != nullptr) {
      listener->OnEepromWrite({slave_, command_.frame, confirmed ? frame : FrameRef{}, *command_.address, command_.data,
                               confirmed, before});
    }
  }
}

std::optional<std::uint32_t> SiiAssembler::WrittenAddress() const {
  // IgH writes the lower half only. No EEPROM is larger than 64 Ki words, so an upper half never seen is 0.
  if ((written_known_ & 0x03U) != 0x03) return std::nullopt;
  const std::uint32_t upper = (written_known_ & 0x0CU) == 0x0C ? LittleEndian<std::uint16_t>(written_, 2) : 0;
  return upper << 16U | LittleEndian<std::uint16_t>(written_, 0);
}

std::optional<std::uint16_t> SiiAssembler::WrittenData() const {
  if ((written_known_ & 0x30U) != 0x30) return std::nullopt;
  return LittleEndian<std::uint16_t>(written_, 4);
}

}  // namespace ecaudit::track
