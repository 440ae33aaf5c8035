#include "decoder/esc/register_text.h"

#include <algorithm>
#include <array>
#include <vector>

#include "decoder/base/text.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/al.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::esc {
namespace {

constexpr std::size_t kMaxRegisterValue = 8;  // bytes of the widest register with fields
constexpr std::size_t kMaxDataBytes = 16;     // of raw bytes shown

/// Comma-separated list.
class List {
 public:
  void Add(std::string_view text) {
    if (text.empty()) return;
    if (!text_.empty()) text_ += ", ";
    text_ += text;
  }
  [[nodiscard]] bool empty() const { return text_.empty(); }
  [[nodiscard]] std::string Take() { return std::move(text_); }

 private:
  std::string text_;
};

/// "1.000 ms (1000000 ns)"; below a microsecond just "12 ns".
std::string Nanoseconds(std::uint64_t ns) {
  const std::string exact = std::to_string(ns) + " ns";
  constexpr std::uint64_t kLongest = 1'000'000'000'000;  // longer ones are points in time or junk
  return ns < 1000 || ns > kLongest ? exact : Duration(static_cast<std::int64_t>(ns)) + " (" + exact + ")";
}

/// Sizes without digit groups, as they are compared with configuration files and manuals.
std::string Bytes(std::uint64_t n) {
  return std::to_string(n) + (n == 1 ? " byte" : " bytes");
}

std::string Bits(std::uint64_t value, unsigned width) {
  return Hex(value, static_cast<int>((width + 3) / 4));
}

std::int64_t SignExtend(std::uint64_t value, unsigned width) {
  if (width >= 64) return static_cast<std::int64_t>(value);
  const std::uint64_t sign = std::uint64_t{1} << (width - 1);
  return static_cast<std::int64_t>(WrappingDifference(value ^ sign, sign));
}

std::string EepromCommandText(std::uint64_t command, AccessKind kind) {
  switch (command) {
    case 0:
      return kind == AccessKind::WRITE ? "clear errors" : "";
    case 1:
      return "read";
    case 2:
      return "write";
    case 4:
      return "reload";
    default:
      return "command " + std::to_string(command);
  }
}

std::string WatchdogTimeText(std::uint64_t steps, const RegisterContext& context) {
  if (steps == 0) return "off";
  const std::uint16_t divider = context.watchdog_divider.value_or(kDefaultWatchdogDivider);
  const std::int64_t ns = WatchdogNs(divider, static_cast<std::uint16_t>(steps));
  return Fixed(static_cast<double>(ns) / 1e6, 3) + " ms (" + std::to_string(steps) + " steps" +
         (context.watchdog_divider ? ")" : " of 100 us, the default)");
}

std::string AlStatusCodeText(std::uint16_t code) {
  std::string text = Hex(code);
  const std::string_view name = AlStatusCodeName(code);
  return name.empty() ? text : text + " " + std::string(name);
}

/// Text of one field; "" when it is not worth reporting.
/// @param whole false: `value` is only the lower part of the field
std::string FieldText(const Field& field, std::uint64_t value, bool whole, AccessKind kind,
                      const RegisterContext& context) {
  switch (field.unit) {
    case Unit::FLAG:
      return value != 0 ? std::string(field.name) : "";
    case Unit::NUMBER:
      return std::to_string(value);
    case Unit::SIGNED:
      return std::to_string(SignExtend(value, field.width));
    case Unit::HEX:
      return Bits(value, field.width);
    case Unit::VALUE:
      for (const ValueText& known : field.values) {
        if (known.value == value) return std::string(known.text);
      }
      return Bits(value, field.width);
    case Unit::KIB:
      return std::to_string(value) + " KiB";
    case Unit::BYTES:
      return Bytes(value);
    case Unit::BIT:
      return std::to_string(value);
    case Unit::NS:
      return Nanoseconds(value);
    case Unit::SIGNED_NS:
      return whole ? std::to_string(SignExtend(value, field.width)) + " ns" : Hex(value, 8) + " (lower half)";
    case Unit::DC_TIME:
      return std::to_string(value) + " ns" + (whole ? "" : " (lower half)");
    case Unit::MAGNITUDE_NS: {
      const TimeDifference difference{static_cast<std::uint32_t>(value)};
      return std::to_string(difference.magnitude_ns()) + " ns" + (difference.bit31() ? " (bit 31 set)" : "");
    }
    case Unit::TEN_NS:
      return value == 0 ? "acknowledge mode" : Nanoseconds(PulseLengthNs(static_cast<std::uint16_t>(value)));
    case Unit::WATCHDOG_STEP:
      return std::to_string(value) + " (steps of " + Duration(WatchdogTickNs(static_cast<std::uint16_t>(value))) + ")";
    case Unit::WATCHDOG_TIME:
      return WatchdogTimeText(value, context);
    case Unit::AL_STATE:
      return StateName(static_cast<std::uint8_t>(value));
    case Unit::AL_STATUS:
      return StatusText(static_cast<std::uint16_t>(value));
    case Unit::AL_STATUS_CODE:
      return AlStatusCodeText(static_cast<std::uint16_t>(value));
    case Unit::EEPROM_COMMAND:
      return EepromCommandText(value, kind);
    case Unit::WORD_ADDRESS:
      return "word " + Hex(value);
    case Unit::DATA:
      return "";  // the caller shows the bytes
  }
  return "";
}

std::string DataText(ByteSpan bytes) {
  const bool all_shown = bytes.size() <= kMaxDataBytes;
  return HexBytes(Slice(bytes, 0, kMaxDataBytes)) + (all_shown ? "" : "...");
}

bool AllZero(ByteSpan bytes) {
  return std::ranges::all_of(bytes, [](std::uint8_t byte) { return byte == 0; });
}

/// What is reported about one part of an access: a whole sync manager or FMMU, else one register.
struct Described {
  std::string name;
  std::string value;
  bool zero = false;  ///< nothing but zeros, so it may be drawn together with its neighbours
};

std::string Joined(const std::string& first, const std::string& last) {
  if (first == last) return first;
  const auto is_unit = [](const std::string& name) { return name.starts_with("SM") || name.starts_with("FMMU"); };
  const bool units = is_unit(first) && is_unit(last) && first.find(' ') == std::string::npos;
  return first + (units ? "-" : " - ") + last;
}

/// The sync manager or FMMU that begins at `part` and is covered as far as it has settings; bytes used, else 0.
std::size_t DescribeUnit(const RegisterPart& part, ByteSpan rest, AccessKind kind, Described& out) {
  const RegisterUnit* unit = part.hit.unit;
  if (unit == nullptr || unit->name.empty() || part.hit.offset != 0 || part.hit.reg->address != unit->address) return 0;
  // The reserved end of an FMMU need not be covered.
  const bool is_fmmu = unit->address == kFmmuBase;
  const std::size_t used = std::min<std::size_t>(rest.size(), unit->size);
  if (used < (is_fmmu ? 13U : kSyncManagerBytes)) return 0;
  out.name = std::string(unit->name) + std::to_string(part.hit.number);
  out.zero = AllZero(rest.first(used));
  if (is_fmmu) {
    if (const auto fmmu = Fmmu::Decode(rest)) out.value = Describe(*fmmu);
  } else if (const auto sm = SyncManager::Decode(rest)) {
    out.value = Describe(*sm, kind == AccessKind::READ);
  }
  return used;
}

}  // namespace

std::string Describe(const SyncManager& sm, bool with_status) {
  if (sm == SyncManager{}) return "all 0";
  List list;
  list.Add(Hex(sm.start) + " " + Bytes(sm.length));
  constexpr std::array<std::string_view, 4> kModes = {"buffered", "reserved mode 1", "mailbox", "reserved mode 3"};
  constexpr std::array<std::string_view, 4> kDirections = {"ECAT reads", "ECAT writes", "reserved direction 2",
                                                           "reserved direction 3"};
  list.Add(kModes[static_cast<std::size_t>(sm.mode())]);
  list.Add(kDirections[static_cast<std::size_t>(sm.direction())]);
  if (sm.ecat_irq()) list.Add("ECAT irq");
  if (sm.pdi_irq()) list.Add("PDI irq");
  if (sm.watchdog_trigger()) list.Add("watchdog");
  list.Add(sm.enabled() ? "enabled" : "disabled");
  if (sm.repeat_request()) list.Add("repeat request");
  if (sm.latch_ecat()) list.Add("latch event ECAT");
  if (sm.latch_pdi()) list.Add("latch event PDI");
  if (with_status) {
    if (sm.mailbox()) list.Add(sm.mailbox_full() ? "full" : "empty");
    if (sm.deactivated_by_pdi()) list.Add("deactivated by the PDI");
    if (sm.repeat_acknowledge()) list.Add("repeat acknowledge");
  }
  return list.Take();
}

std::string Describe(const Fmmu& fmmu) {
  if (fmmu == Fmmu{}) return "all 0";
  std::string text = "logical " + Hex(fmmu.logical_start, 8);
  if (fmmu.byte_aligned()) {
    text += " +" + std::to_string(fmmu.length) + " -> " + Hex(fmmu.physical_start);
  } else {
    text += "." + std::to_string(fmmu.logical_start_bit) + " " + Count(fmmu.bit_count(), "bit") + " -> " +
            Hex(fmmu.physical_start) + "." + std::to_string(fmmu.physical_start_bit);
  }
  constexpr std::array<std::string_view, 4> kTypes = {" no direction", " read", " write", " read and write"};
  text += kTypes[fmmu.type & 0x03U];
  return text + (fmmu.active() ? ", active" : ", inactive");
}

std::string DescribeValue(const RegisterHit& hit, ByteSpan bytes, AccessKind kind, const RegisterContext& context) {
  const Register& reg = *hit.reg;
  bytes = Slice(bytes, 0, static_cast<std::size_t>(reg.length - hit.offset));
  if (bytes.empty()) return "";
  if (kind == AccessKind::WRITE) {
    if (reg.access == EcatAccess::WRITE_CLEARS) return "cleared";
    if (reg.address == 0x0900) return "latches the receive times";
  }

  // The register as a number, as far as it is covered.
  std::uint64_t value = 0;
  const std::size_t end = std::min<std::size_t>(hit.offset + bytes.size(), kMaxRegisterValue);
  for (std::size_t i = hit.offset; i < end; ++i) value |= std::uint64_t{bytes[i - hit.offset]} << (8 * i);
  const std::size_t first_bit = std::size_t{hit.offset} * 8;
  const std::size_t end_bit = end * 8;

  List list;
  bool shown = false;           // some field is covered
  std::uint64_t explained = 0;  // bits that belong to a field
  bool data = false;
  for (const Field& field : reg.fields) {
    const std::uint64_t ones = field.width >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << field.width) - 1;
    explained |= ones << field.lsb;
    data = data || field.unit == Unit::DATA;
    const bool whole = field.lsb >= first_bit && static_cast<std::size_t>(field.lsb) + field.width <= end_bit;
    // 64-bit times are often accessed by their lower half: 32-bit ESCs have no other.
    const bool half = field.width == 64 && field.unit != Unit::HEX && first_bit == 0 && end_bit >= 32;
    if (!whole && !half) continue;
    shown = true;
    const std::string text = FieldText(field, value >> field.lsb & ones, whole, kind, context);
    const bool named = !field.name.empty() && field.unit != Unit::FLAG && !text.empty();
    list.Add(named ? std::string(field.name) + " " + text : text);
  }
  if (data) return DataText(bytes);
  const std::size_t reg_bits = std::size_t{reg.length} * 8;
  const std::uint64_t in_register = reg_bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << reg_bits) - 1;
  if (!shown) {
    const std::string place = "byte" + std::string(bytes.size() > 1 ? "s " : " ") + std::to_string(hit.offset) +
                              (bytes.size() > 1 ? "-" + std::to_string(hit.offset + bytes.size() - 1) : "");
    return place + ": " + DataText(bytes);
  }
  if (const std::uint64_t rest = value & ~explained & in_register; rest != 0) {
    list.Add("reserved bits " + Hex(rest, static_cast<int>(reg.length * 2)));
  }
  return list.empty() ? (reg.zero.empty() ? "0" : std::string(reg.zero)) : list.Take();
}

std::string DescribeRegister(const RegisterHit& hit, ByteSpan bytes, AccessKind kind, const RegisterContext& context) {
  if (hit.reg == nullptr) return "";
  return RegisterName(hit) + ": " + DescribeValue(hit, bytes, kind, context);
}

namespace {

/// Texts of one access. Neighbours that show the same, zeros or "cleared", become one.
class Descriptions {
 public:
  void Add(std::string text) {
    if (texts_.size() < kMaxDescribed) {
      texts_.push_back(std::move(text));
    } else {
      ++left_out_;
    }
  }
  void Add(Described unit, bool cleared) {
    const bool continues = !run_.name.empty() && ((run_.zero && unit.zero) || (cleared && run_.value == unit.value));
    if (!continues) End();
    run_last_ = unit.name;
    if (!continues) run_ = std::move(unit);
  }
  /// Another text does not continue what came before.
  void End() {
    if (run_.name.empty()) return;
    const bool several = run_.name != run_last_;
    Add(Joined(run_.name, run_last_) + ": " + (several && run_.zero ? "all 0" : run_.value));
    run_ = {};
  }
  [[nodiscard]] std::string Take() {
    End();
    std::string line;
    for (const std::string& text : texts_) line += (line.empty() ? "" : "; ") + text;
    if (left_out_ != 0) line += "; " + std::to_string(left_out_) + " more";
    return line;
  }

 private:
  std::vector<std::string> texts_;
  std::size_t left_out_ = 0;
  Described run_;
  std::string run_last_;
};

}  // namespace

std::string DescribeAccess(EscAddress address, ByteSpan bytes, AccessKind kind) {
  if (kind == AccessKind::REQUEST) return AccessName(address, bytes.size());
  bytes = Slice(bytes, 0, kAddressSpace - address);

  RegisterContext context;
  if (address <= 0x0400 && Fits(bytes, static_cast<std::size_t>(0x0400 - address), 2)) {
    context.watchdog_divider = LittleEndian<std::uint16_t>(bytes, static_cast<std::size_t>(0x0400 - address));
  }

  Descriptions texts;
  for (std::size_t at = 0; at < bytes.size();) {
    const RegisterPart part = PartAt(address, bytes.size(), at);
    const ByteSpan rest = bytes.subspan(at);
    if (!part.hit) {
      if (part.is_process_ram()) {
        texts.End();
        texts.Add("process RAM " + Hex(part.address) + ", " + Bytes(part.length));
      }
      at += part.length;
      continue;
    }
    Described now;
    std::size_t used = DescribeUnit(part, rest, kind, now);
    bool cleared = false;
    if (used == 0) {
      used = part.length;
      now.name = RegisterName(part.hit);
      now.value = DescribeValue(part.hit, rest, kind, context);
      cleared = kind == AccessKind::WRITE && part.hit.reg->access == EcatAccess::WRITE_CLEARS;
      now.zero = !cleared && part.complete && AllZero(rest.first(part.length));
    }
    texts.Add(std::move(now), cleared);
    at += used;
  }
  std::string line = texts.Take();
  if (line.empty() && !bytes.empty()) line = "reserved, " + Bytes(bytes.size());
  return line;
}

std::string EventBitName(EscAddress address, unsigned bit) {
  if (const RegisterHit hit = RegisterAt(address)) {
    for (const Field& field : hit.reg->fields) {
      if (field.lsb == bit && field.unit == Unit::FLAG) return std::string(field.name);
    }
  }
  return "bit " + std::to_string(bit);
}

std::string DescribeEvents(std::uint16_t irq) {
  if (irq == 0) return "";
  const std::array<std::uint8_t, 2> bytes = {static_cast<std::uint8_t>(irq & 0xFFU),
                                             static_cast<std::uint8_t>(irq >> 8U)};
  return DescribeValue(RegisterAt(esc::kEcatEventRequest), bytes);
}

}  // namespace ecaudit::esc
