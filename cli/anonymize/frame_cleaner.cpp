#include "cli/anonymize/frame_cleaner.h"

#include <algorithm>

#include "decoder/base/bytes.h"
#include "decoder/mailbox/header.h"
#include "decoder/wire/command.h"
#include "decoder/wire/link_header.h"

namespace ecaudit::cli::anonymize {
namespace {

constexpr std::uint16_t kProcessRam = 0x1000;
constexpr std::uint16_t kEepromData = 0x0508;
constexpr std::size_t kEepromDataBytes = 8;
constexpr std::uint8_t kBlank = 0xFF;
constexpr std::uint32_t kSerialBegin = 0x1C;  // bytes of the EEPROM
constexpr std::uint32_t kSerialEnd = 0x20;
/// Identification of the ESC's licensee, and memory for the user's own marks.
constexpr std::uint16_t kChipIdentity = 0x0E00;
constexpr std::uint16_t kChipIdentityEnd = 0x0F00;
constexpr std::uint16_t kUserRam = 0x0F80;
/// EtherType for private use (IEEE 802, "local experimental"): what is left of other traffic.
constexpr std::uint8_t kOtherType[2] = {0x88, 0xB5};
constexpr std::uint64_t kBroadcast = 0xFFFF'FFFF'FFFF;
/// Slaves set the one, groups have the other: both show something of the bus.
constexpr std::uint64_t kLocalBit = std::uint64_t{1} << 41U;
constexpr std::uint64_t kGroupBit = std::uint64_t{1} << 40U;
/// 00:00:5E:00:53:00, for documents (RFC 7042).
constexpr std::uint64_t kMadeMac = 0x0000'5E00'5300;

Bytes Part(Bytes bytes, std::size_t begin, std::size_t length) {
  begin = std::min(begin, bytes.size());
  return bytes.subspan(begin, std::min(length, bytes.size() - begin));
}

std::uint16_t OnesSum(ByteSpan bytes) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) sum += BigEndian<std::uint16_t>(bytes, i);
  while (sum > 0xFFFF) sum = (sum & 0xFFFFU) + (sum >> 16U);
  return static_cast<std::uint16_t>(sum);
}

}  // namespace

void FrameCleaner::Learn(const capture::CapturedFrame& frame) {
  const wire::FrameView view = wire::FrameView::Parse(frame);
  for (std::size_t i = 0; i < view.size(); ++i) {
    const wire::DatagramView datagram = view[i];
    if (wire::IsLogical(datagram.command())) {
      for (const MappedMailboxes::Place& place : mapped_.In(datagram)) {
        const ByteSpan message = datagram.data().subspan(place.begin, place.length);
        if (!mailbox::LooksLikeMessage(message, place.direction)) continue;
        std::vector<std::uint8_t> copy(message.begin(), message.end());
        mailboxes_.Clean(place.slave, place.direction, copy, {});
      }
      continue;
    }
    eeprom_.Subscribe(datagram);
    mapped_.Subscribe(datagram, eeprom_.SlaveOf(datagram));
    eeprom_.Learn(datagram);
    const bool in = !wire::Writes(datagram.command());
    if (datagram.ado() < kProcessRam || (in && datagram.wkc() == 0)) continue;
    const auto direction = in ? mailbox::Direction::kIn : mailbox::Direction::kOut;
    if (!mailbox::LooksLikeMessage(datagram.data(), direction)) continue;
    std::vector<std::uint8_t> copy(datagram.data().begin(), datagram.data().end());
    mailboxes_.Clean(eeprom_.SlaveOf(datagram), direction, copy, {});
  }
}

void FrameCleaner::EndLearning() {
  eeprom_.EndLearning(secrets_);
  mapped_ = {};
  learned_ = secrets_;
  removed_ = {};
}

void FrameCleaner::Clean(const capture::CapturedFrame& frame, std::vector<std::uint8_t>& bytes) {
  const wire::FrameView view = wire::FrameView::Parse(frame);
  CleanHeaders(frame, view, bytes);
  if (view.size() == 0) return;
  const std::uint8_t* const begin = frame.bytes.data();
  for (std::size_t i = 0; i < view.size(); ++i) {
    const wire::DatagramView datagram = view[i];
    const auto at = static_cast<std::size_t>(datagram.data().data() - begin);
    if (wire::IsLogical(datagram.command())) {
      for (const MappedMailboxes::Place& place : mapped_.In(datagram)) {
        const Bytes message = Part(bytes, at + place.begin, place.length);
        if (!mailbox::LooksLikeMessage(message, place.direction)) continue;
        mailboxes_.Clean(place.slave, place.direction, message, learned_);
      }
      continue;
    }
    eeprom_.Subscribe(datagram);
    mapped_.Subscribe(datagram, eeprom_.SlaveOf(datagram));
    CleanDatagram(datagram, Part(bytes, at, datagram.data().size()));
  }
  // After the last whole datagram: padding, or in a broken or cut frame the header of one more.
  const std::size_t record = view.esl().present && view.bytes().data() == begin ? 16 : 0;
  std::size_t rest = static_cast<std::size_t>(view.bytes().data() - begin) + view.used_bytes();
  if (view.kind() != wire::FrameKind::kEtherCat) rest += wire::kDatagramHeaderBytes;
  const std::size_t end = bytes.size() - std::min(record, bytes.size());
  if (rest < end) Clear(Part(bytes, rest, end - rest));
}

void FrameCleaner::CleanDatagram(const wire::DatagramView& datagram, Bytes data) {
  const std::uint16_t ado = datagram.ado();
  const std::uint32_t end = ado + static_cast<std::uint32_t>(data.size());
  if (ado < kChipIdentityEnd && end > kChipIdentity) {
    const std::uint32_t first = std::max<std::uint32_t>(ado, kChipIdentity);
    Clear(Part(data, first - ado, std::min<std::uint32_t>(end, kChipIdentityEnd) - first));
  }
  if (ado < kProcessRam && end > kUserRam) {
    Clear(Part(data, std::max<std::uint32_t>(ado, kUserRam) - ado, data.size()));
  }
  if (ado < kEepromData + kEepromDataBytes && end > kEepromData) CleanEeprom(datagram, data);
  if (ado < kProcessRam) return;
  const bool write = wire::Writes(datagram.command());
  const auto direction = write ? mailbox::Direction::kOut : mailbox::Direction::kIn;
  if (mailbox::LooksLikeMessage(data, direction)) {
    return mailboxes_.Clean(eeprom_.SlaveOf(datagram), direction, data, learned_);
  }
  const mailbox::Header header = mailbox::ParseHeader(data);
  const bool vendors = header.protocol == mailbox::Protocol::kVoE && !header.reserved_bit && header.length > 0 &&
                       header.length + mailbox::kHeaderBytes <= data.size() && header.address == 0;
  if (vendors) return mailboxes_.Clean(eeprom_.SlaveOf(datagram), direction, data, learned_);
  // A broken message, part of one, or what was left in the master's buffer.
  constexpr std::size_t kLongEnoughForText = 6;
  BlotRuns(data, kLongEnoughForText, secrets_);
}

void FrameCleaner::CleanEeprom(const wire::DatagramView& datagram, Bytes data) {
  const std::uint32_t slave = eeprom_.SlaveOf(datagram);
  const std::optional<std::uint32_t> word = eeprom_.WordAsked(slave);
  const auto is_serial = [&](std::size_t i) {
    const std::uint64_t byte = 2 * std::uint64_t{word.value_or(0)} + i;
    return word && byte >= kSerialBegin && byte < kSerialEnd;
  };
  const auto byte_at = [&](std::size_t i) -> std::uint8_t* {
    const std::uint32_t address = kEepromData + static_cast<std::uint32_t>(i);
    if (address < datagram.ado() || address - datagram.ado() >= data.size()) return nullptr;
    return &data[address - datagram.ado()];
  };
  // Of a blank EEPROM all words are 0xFFFF. That is no serial number, and the findings depend on it.
  bool serial_is_blank = true;
  for (std::size_t i = 0; i < kEepromDataBytes; ++i) {
    const std::uint8_t* byte = byte_at(i);
    if (byte != nullptr && is_serial(i) && *byte != kBlank) serial_is_blank = false;
  }
  for (std::size_t i = 0; i < kEepromDataBytes; ++i) {
    std::uint8_t* const place = byte_at(i);
    if (place == nullptr) continue;
    std::uint8_t& byte = *place;
    const std::optional<bool> secret =
        word ? eeprom_.IsSecret(slave, 2 * *word + static_cast<std::uint32_t>(i)) : std::nullopt;
    if (secret != true) continue;
    const bool serial = is_serial(i);
    if (byte == 0 || (serial && serial_is_blank)) continue;
    const bool letter =
        (byte >= '0' && byte <= '9') || (byte >= 'A' && byte <= 'Z') || (byte >= 'a' && byte <= 'z') || byte >= 0x80;
    const bool sign = byte >= 0x20 && byte <= 0x7E;
    byte = serial ? std::uint8_t{0} : letter ? std::uint8_t{'x'} : sign ? byte : std::uint8_t{0};
    if (i % 2 == 0) ++removed_.eeprom_words;
  }
  if (word && eeprom_.IsSecret(slave, 2 * *word)) return;
  // It is unknown what is there: text shows by itself.
  const std::size_t first = kEepromData > datagram.ado() ? static_cast<std::size_t>(kEepromData - datagram.ado()) : 0;
  BlotRuns(Part(data, first, kEepromDataBytes), 4, secrets_);
}

void FrameCleaner::CleanMac(Bytes mac) {
  if (mac.size() < 6) return Clear(mac);
  std::uint64_t value = 0;
  for (const std::uint8_t byte : mac.first(6)) value = value << 8U | byte;
  // A master that has no address of its own (TwinCAT) identifies no device.
  if (value == kBroadcast || (value & ~kLocalBit) == 0) return;
  const auto [known, added] = macs_.try_emplace(value & ~kLocalBit, static_cast<std::uint32_t>(macs_.size() & 0xFFFFU));
  const std::uint64_t made = (kMadeMac + known->second) | (value & (kLocalBit | kGroupBit));
  for (std::size_t i = 0; i < 6; ++i) mac[i] = static_cast<std::uint8_t>(made >> (40 - 8 * i));
  if (added) {
    std::string original;
    std::string other_side;
    for (std::size_t i = 0; i < 6; ++i) {
      original += static_cast<char>(value >> (40 - 8 * i));
      other_side += static_cast<char>((value ^ kLocalBit) >> (40 - 8 * i));
    }
    // Addresses like 01:01:01:01:01:01 stand in process data by chance.
    if (std::set<char>(original.begin(), original.end()).size() >= 4) secrets_.insert({original, other_side});
  }
}

void FrameCleaner::CleanHeaders(const capture::CapturedFrame& frame, const wire::FrameView& view, Bytes bytes) {
  const std::optional<wire::LinkHeader> link = wire::LinkHeaderOf(frame.link_type);
  if (!link) {
    ++removed_.other_packets;
    return Clear(bytes);
  }
  const std::size_t record_in_front = static_cast<std::size_t>(view.bytes().data() - frame.bytes.data());
  if (link->destination) CleanMac(Part(bytes, record_in_front + *link->destination, 6));
  CleanMac(Part(bytes, record_in_front + link->source, 6));
  const bool empty = view.size() == 0;
  if (view.encapsulation() == wire::Encapsulation::kUdp && !empty) {
    CleanUdp(bytes, record_in_front + view.offsets()[0] - 2);
  }
  if (!empty) return;
  // No datagram: other traffic, or EtherCAT that is broken or cut at its very beginning.
  std::size_t kept = record_in_front + link->payload + 4 * std::size_t{view.vlan_tags()};
  if (view.kind() != wire::FrameKind::kOther || view.has_ethercat_header()) {
    const std::size_t udp = view.encapsulation() == wire::Encapsulation::kUdp ? 28 : 0;
    kept += udp + 2 + wire::kDatagramHeaderBytes;
    if (view.kind() == wire::FrameKind::kOther) kept -= wire::kDatagramHeaderBytes;
    if (udp != 0) CleanUdp(bytes, kept - 2 - (view.kind() == wire::FrameKind::kOther ? 0 : wire::kDatagramHeaderBytes));
  } else {
    ++removed_.other_packets;
    if (view.vlan_tags() == 0 || !view.cut_before_type()) {
      const std::size_t type = view.vlan_tags() == 0 ? record_in_front + link->type : kept - 2;
      const Bytes place = Part(bytes, type, 2);
      if (place.size() == 2) std::copy(std::begin(kOtherType), std::end(kOtherType), place.begin());
    }
  }
  const std::size_t record = view.esl().present && record_in_front == 0 ? 16 : 0;
  const std::size_t end = bytes.size() - std::min(record, bytes.size());
  if (kept < end) Clear(Part(bytes, kept, end - kept));
}

/// @param ethercat  where the EtherCAT header begins; UDP and a plain IP header stand before it
void FrameCleaner::CleanUdp(Bytes bytes, std::size_t ethercat) {
  if (ethercat < 28 || ethercat > bytes.size()) return;
  const Bytes ip = bytes.subspan(ethercat - 28, 20);
  const bool was_right = OnesSum(ip) == 0xFFFF;
  for (const std::size_t at : {std::size_t{12}, std::size_t{16}}) {
    const auto address = BigEndian<std::uint32_t>(ip, at);
    if (address == 0xFFFF'FFFF || address == 0) continue;
    const auto [known, added] =
        ip_addresses_.try_emplace(address, static_cast<std::uint8_t>(ip_addresses_.size() % 250 + 1));
    const std::uint8_t made[4] = {192, 0, 2, known->second};
    std::copy(std::begin(made), std::end(made), ip.begin() + static_cast<std::ptrdiff_t>(at));
  }
  if (was_right) {
    ip[10] = ip[11] = 0;
    const auto sum = static_cast<std::uint16_t>(~OnesSum(ip));
    ip[10] = static_cast<std::uint8_t>(sum >> 8U);
    ip[11] = static_cast<std::uint8_t>(sum);
  }
  // Without a checksum: it covered addresses and data.
  bytes[ethercat - 2] = bytes[ethercat - 1] = 0;
}

}  // namespace ecaudit::cli::anonymize
