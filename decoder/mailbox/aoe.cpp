#include "decoder/mailbox/aoe.h"

#include <algorithm>

#include "decoder/base/names.h"

namespace ecaudit::mailbox {
namespace {

AmsNetId NetId(ByteSpan payload, std::size_t offset) {
  AmsNetId id{};
  const ByteSpan bytes = Slice(payload, offset, id.size());
  std::ranges::copy(bytes, id.begin());
  return id;
}

std::optional<std::uint32_t> Dword(ByteSpan data, std::size_t offset) {
  if (!Fits(data, offset, 4)) return std::nullopt;
  return LittleEndian<std::uint32_t>(data, offset);
}

}  // namespace

std::string Name(AdsCommand command) {
  static constexpr Named<AdsCommand> kNames[] = {
      {AdsCommand::kReadDeviceInfo, "read device info"},
      {AdsCommand::kRead, "read"},
      {AdsCommand::kWrite, "write"},
      {AdsCommand::kReadState, "read state"},
      {AdsCommand::kWriteControl, "write control"},
      {AdsCommand::kAddNotification, "add device notification"},
      {AdsCommand::kDeleteNotification, "delete device notification"},
      {AdsCommand::kNotification, "device notification"},
      {AdsCommand::kReadWrite, "read write"},
  };
  const std::string_view name = NameIn(kNames, command);
  return !name.empty() ? std::string(name) : "command " + std::to_string(static_cast<unsigned>(command));
}

std::string Text(const AmsNetId& id) {
  std::string text;
  for (const std::uint8_t byte : id) {
    if (!text.empty()) text += '.';
    text += std::to_string(byte);
  }
  return text;
}

AmsHeader ParseAms(ByteSpan payload) {
  AmsHeader header;
  header.target = NetId(payload, 0);
  header.target_port = LittleEndian<std::uint16_t>(payload, 6);
  header.source = NetId(payload, 8);
  header.source_port = LittleEndian<std::uint16_t>(payload, 14);
  header.command = static_cast<AdsCommand>(LittleEndian<std::uint16_t>(payload, 16));
  header.state_flags = LittleEndian<std::uint16_t>(payload, 18);
  header.length = LittleEndian<std::uint32_t>(payload, 20);
  header.error = LittleEndian<std::uint32_t>(payload, 24);
  header.invoke_id = LittleEndian<std::uint32_t>(payload, 28);
  header.data = Slice(payload, kAmsHeaderBytes, header.length);
  header.too_short = payload.size() < kAmsHeaderBytes;
  return header;
}

AdsParameters ParseAds(const AmsHeader& header) {
  AdsParameters ads;
  const ByteSpan data = header.data;
  const bool read = header.command == AdsCommand::kRead || header.command == AdsCommand::kReadWrite;
  const bool write = header.command == AdsCommand::kWrite || header.command == AdsCommand::kReadWrite;
  if (header.response()) {
    ads.result = Dword(data, 0);
    if (read) {
      ads.read_length = Dword(data, 4);
      ads.data = Slice(data, 8, ads.read_length.value_or(0));
    }
    return ads;
  }
  if (!read && !write) return ads;
  ads.index_group = Dword(data, 0);
  ads.index_offset = Dword(data, 4);
  if (read) ads.read_length = Dword(data, 8);
  if (write) {
    const std::size_t at = read ? 12 : 8;
    ads.write_length = Dword(data, at);
    ads.data = Slice(data, at + 4, ads.write_length.value_or(0));
  }
  return ads;
}

std::vector<std::uint8_t> AccessBytes(const AdsParameters& parameters) {
  std::vector<std::uint8_t> bytes;
  for (const std::uint32_t word : {parameters.index_group.value_or(0), parameters.index_offset.value_or(0)}) {
    for (unsigned shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(word >> shift));
  }
  bytes.insert(bytes.end(), parameters.data.begin(), parameters.data.end());
  return bytes;
}

}  // namespace ecaudit::mailbox
