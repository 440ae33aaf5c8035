#include "samples/builder/sii_image.h"

#include <algorithm>

namespace ecaudit::samples {
namespace {

constexpr std::size_t kImageBytes = 2048;
constexpr std::size_t kHeaderBytes = 0x80;

class Strings {
 public:
  /// Number of `text` in the strings category, from 1; 0 for no text.
  std::uint8_t Number(const std::string& text) {
    if (text.empty()) return 0;
    const auto found = std::find(texts_.begin(), texts_.end(), text);
    if (found != texts_.end()) return static_cast<std::uint8_t>(found - texts_.begin() + 1);
    texts_.push_back(text);
    return static_cast<std::uint8_t>(texts_.size());
  }
  [[nodiscard]] Bytes Category() const {
    Bytes out{static_cast<std::uint8_t>(texts_.size())};
    for (const std::string& text : texts_) {
      out.push_back(static_cast<std::uint8_t>(text.size()));
      AppendText(out, text);
    }
    return out;
  }

 private:
  std::vector<std::string> texts_;
};

Bytes General(const SiiContent& content, Strings& strings) {
  Bytes out(32, 0);
  out[0] = strings.Number(content.group);
  out[2] = strings.Number(content.name);
  out[3] = strings.Number(content.name);
  out[5] = content.coe_details;
  return out;
}

Bytes Pdos(const std::vector<SiiPdo>& pdos, Strings& strings) {
  Bytes out;
  for (const SiiPdo& pdo : pdos) {
    AppendLe(out, pdo.index);
    out.push_back(static_cast<std::uint8_t>(pdo.entries.size()));
    out.push_back(pdo.sync_manager);
    out.push_back(0);
    out.push_back(strings.Number(pdo.name));
    AppendLe(out, std::uint16_t{0});
    for (const SiiPdoEntry& entry : pdo.entries) {
      AppendLe(out, entry.index);
      out.push_back(entry.subindex);
      out.push_back(strings.Number(entry.name));
      out.push_back(entry.bits <= 8 ? 0x05 : entry.bits <= 16 ? 0x06 : 0x07);  // UNSIGNED8, 16, 32
      out.push_back(entry.bits);
      AppendLe(out, std::uint16_t{0});
    }
  }
  return out;
}

Bytes SyncManagers(const std::vector<SiiSyncManager>& sync_managers) {
  Bytes out;
  for (const SiiSyncManager& sm : sync_managers) {
    AppendLe(out, sm.start);
    AppendLe(out, sm.length);
    out.insert(out.end(), {sm.control, 0, sm.enable, sm.type});
  }
  return out;
}

void AppendCategory(Bytes& out, std::uint16_t type, Bytes data) {
  if (data.empty()) return;
  if (data.size() % 2 != 0) data.push_back(type == 40 ? 0xFF : 0);
  AppendLe(out, type);
  AppendLe(out, static_cast<std::uint16_t>(data.size() / 2));
  AppendBytes(out, data);
}

}  // namespace

std::uint8_t SiiChecksum(ByteView first_14_bytes) {
  std::uint8_t crc = 0xFF;
  for (std::size_t i = 0; i < 14 && i < first_14_bytes.size(); ++i) {
    crc ^= first_14_bytes[i];
    for (int bit = 0; bit < 8; ++bit) {
      const unsigned shifted = crc * 2U;
      crc = static_cast<std::uint8_t>(((crc & 0x80U) != 0 ? shifted ^ 0x07U : shifted) & 0xFFU);
    }
  }
  return crc;
}

Bytes BuildSii(const SiiContent& content) {
  Bytes image(kHeaderBytes, 0);
  const auto word = [&](std::size_t number, std::uint16_t value) { StoreLe(image, number * 2, value); };
  const auto pair = [&](std::size_t number, std::uint32_t value) { StoreLe(image, number * 2, value); };
  word(0x00, content.pdi_control);
  word(0x04, content.alias);
  word(0x07, SiiChecksum(image));
  pair(0x08, content.vendor_id);
  pair(0x0A, content.product_code);
  pair(0x0C, content.revision);
  pair(0x0E, content.serial);
  word(0x18, content.mailbox_out_start);
  word(0x19, content.mailbox_out_length);
  word(0x1A, content.mailbox_in_start);
  word(0x1B, content.mailbox_in_length);
  word(0x1C, content.mailbox_protocols);
  word(0x3E, kImageBytes * 8 / 1024 - 1);
  word(0x3F, 1);

  // The strings category comes first but is known last.
  Strings strings;
  const Bytes general = General(content, strings);
  const Bytes tx = Pdos(content.tx_pdos, strings);
  const Bytes rx = Pdos(content.rx_pdos, strings);
  AppendCategory(image, 10, strings.Category());
  AppendCategory(image, 30, general);
  AppendCategory(image, 40, content.fmmu_functions);
  AppendCategory(image, 41, SyncManagers(content.sync_managers));
  AppendCategory(image, 50, tx);
  AppendCategory(image, 51, rx);
  AppendLe(image, std::uint16_t{0xFFFF});
  image.resize(std::max(image.size(), kImageBytes), 0xFF);
  return image;
}

}  // namespace ecaudit::samples
