#include "cli/anonymize/eeprom_watch.h"

#include <algorithm>
#include <string>

#include "decoder/base/bytes.h"

namespace ecaudit::cli::anonymize {
namespace {

constexpr std::uint16_t kStationAddress = 0x0010;
constexpr std::uint16_t kControl = 0x0502;
constexpr std::uint16_t kAddress = 0x0504;
constexpr std::uint16_t kData = 0x0508;
constexpr std::uint16_t kBusy = 0x8000;
constexpr std::uint16_t kEightBytes = 0x0040;
constexpr std::uint32_t kSerialWord = 0x0E;
constexpr std::uint16_t kStringsCategory = 10;
constexpr std::uint16_t kVendorCategories = 0x0800;

/// The bytes of register `address` in the datagram; empty where it does not cover `length` of them.
ByteSpan Part(const wire::DatagramView& datagram, std::uint16_t address, std::size_t length) {
  const std::uint16_t begin = datagram.ado();
  const ByteSpan data = datagram.data();
  if (begin > address || begin + data.size() < address + length) return {};
  return data.subspan(static_cast<std::size_t>(address - begin), length);
}

}  // namespace

std::uint32_t EepromWatch::SlaveOf(const wire::DatagramView& datagram) const {
  if (!wire::IsPositionAddressed(datagram.command())) return datagram.adp();
  // Each slave adds one: outbound 0 - position, after all of them that and their number.
  const bool returned = datagram.wkc() != 0;
  const auto position = static_cast<std::uint16_t>((returned ? slaves_ : 0) - datagram.adp());
  const auto station = stations_.find(position);
  return station != stations_.end() ? station->second : kByPosition | position;
}

void EepromWatch::Subscribe(const wire::DatagramView& datagram) {
  ++now_;
  const wire::Command command = datagram.command();
  const bool returned = datagram.wkc() != 0;
  if (wire::IsBroadcast(command) && returned) slaves_ = datagram.adp();
  if (wire::Writes(command)) {
    if (wire::IsPositionAddressed(command) && returned) {
      if (const ByteSpan station = Part(datagram, kStationAddress, 2); !station.empty()) {
        const auto position = static_cast<std::uint16_t>(slaves_ - datagram.adp());
        stations_[position] = LittleEndian<std::uint16_t>(station, 0);
      }
    }
    if (const ByteSpan address = Part(datagram, kAddress, 2); !address.empty()) {
      const ByteSpan whole = Part(datagram, kAddress, 4);
      const Asked asked{whole.empty() ? LittleEndian<std::uint16_t>(address, 0) : LittleEndian<std::uint32_t>(whole, 0),
                        now_};
      if (wire::IsBroadcast(command)) {
        asked_all_ = asked;
      } else {
        asked_[SlaveOf(datagram)] = asked;
      }
    }
  }
  if (wire::Reads(command) && returned) {
    if (const ByteSpan control = Part(datagram, kControl, 2); !control.empty()) {
      eight_bytes_[SlaveOf(datagram)] = (LittleEndian<std::uint16_t>(control, 0) & kEightBytes) != 0;
    }
  }
}

std::optional<std::uint32_t> EepromWatch::WordAsked(std::uint32_t slave) const {
  const auto own = asked_.find(slave);
  if (own != asked_.end() && (!asked_all_ || own->second.when > asked_all_->when)) return own->second.word;
  return asked_all_ ? std::optional(asked_all_->word) : std::nullopt;
}

void EepromWatch::Learn(const wire::DatagramView& datagram) {
  if (!wire::Reads(datagram.command()) || datagram.wkc() == 0 || wire::IsBroadcast(datagram.command())) return;
  if (const ByteSpan control = Part(datagram, kControl, 2); !control.empty()) {
    if ((LittleEndian<std::uint16_t>(control, 0) & kBusy) != 0) return;  // the data are still those before
  }
  const std::uint32_t slave = SlaveOf(datagram);
  const std::optional<std::uint32_t> word = WordAsked(slave);
  if (!word) return;
  const auto eight = eight_bytes_.find(slave);
  const std::size_t words = eight != eight_bytes_.end() && eight->second ? 4 : 2;
  for (std::size_t i = 0; i < words; ++i) {
    const ByteSpan value = Part(datagram, static_cast<std::uint16_t>(kData + 2 * i), 2);
    if (value.empty()) continue;
    images_[slave].words.Set(*word + static_cast<std::uint32_t>(i), LittleEndian<std::uint16_t>(value, 0));
  }
}

void EepromWatch::EndLearning(Secrets& secrets) {
  for (auto& [slave, image] : images_) {
    const esc::SiiContents contents = esc::ParseSii(image.words);
    image.secret.emplace_back(2 * kSerialWord, 2 * kSerialWord + 4);
    for (const esc::SiiCategory& category : contents.categories) {
      const std::uint32_t begin = 2 * category.first_word;
      const std::uint32_t end = begin + 2 * category.words;
      image.known_until = std::max(image.known_until, end);
      if (category.type >= kVendorCategories) image.secret.emplace_back(begin, end);
      if (category.type != kStringsCategory) continue;
      // Number of strings, then for each its length and its characters.
      std::uint32_t at = begin + 1;
      for (const std::string& text : contents.strings) {
        const auto length = static_cast<std::uint32_t>(text.size());
        image.secret.emplace_back(at + 1, std::min(at + 1 + length, end));
        at += 1 + length;
      }
      // What is not known as a string yet, but lies among them.
      if (at < end) image.secret.emplace_back(at, end);
    }
    for (const std::string& text : contents.strings) {
      std::string copy = text;
      BlotText(Bytes(reinterpret_cast<std::uint8_t*>(copy.data()), copy.size()), secrets);
    }
    for (const esc::SiiRawCategory& raw : contents.raw) {
      if (raw.type < kVendorCategories) continue;
      std::vector<std::uint8_t> copy = raw.bytes;
      BlotRuns(copy, kShortestSecret, secrets);
    }
  }
  asked_.clear();
  asked_all_.reset();
  stations_.clear();
  eight_bytes_.clear();
  slaves_ = 0;
}

std::optional<bool> EepromWatch::IsSecret(std::uint32_t slave, std::uint32_t byte) const {
  const auto image = images_.find(slave);
  if (image == images_.end()) return std::nullopt;
  for (const auto& [begin, end] : image->second.secret) {
    if (byte >= begin && byte < end) return true;
  }
  if (byte < 0x80 || byte < image->second.known_until) return false;
  return std::nullopt;
}

}  // namespace ecaudit::cli::anonymize
