/// Fuzzes the EEPROM: the parser with whole and with partly known images, and the tracker with a series of accesses.
///
/// Input: one byte that selects the kind, then the image (kind 0), the image with every so-many-th word unknown (1), or
/// accesses (2): | flags | offset from 0x04F8 | length | bytes ... |, flags bit 0 write, 1 read, 3:2 acceptance,
/// 4 broadcast, 5 in the frame of the access before.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "decoder/esc/sii.h"
#include "decoder/track/sii_tracker.h"

namespace ecaudit {
namespace {

void Check(bool condition) {
  if (!condition) std::abort();
}

void UseContents(const esc::SiiImage& image) {
  const esc::SiiContents contents = esc::ParseSii(image);
  std::size_t sink = contents.Name().size();
  for (const esc::SiiCategory& category : contents.categories) {
    Check(category.first_word + category.words <= esc::SiiImage::kWords);
    sink += esc::SiiCategoryName(category.type).size() + contents.VendorText(category.type).size();
  }
  for (unsigned i = 0; i < 256; ++i) sink += contents.String(i).size();
  for (const esc::SiiPdo& pdo : contents.tx_pdos) sink += pdo.Bits();
  if (contents.header.protocols) sink += esc::SiiProtocolNames(*contents.header.protocols).size();
  Check(contents.strings.size() <= esc::SiiImage::kWords && sink < (std::size_t{1} << 40U));
}

class Listener final : public track::SiiListener {
 public:
  void OnEepromRead(const track::EepromRead& event) override { Check(!event.words.empty() && event.words.size() <= 4); }
  void OnEepromError(const track::EepromError& event) override { Check((event.bits & track::kEepromErrorMask) != 0); }
};

void Track(ByteSpan input) {
  track::SiiAssembler assembler(0);
  Listener listener;
  FrameNo frame = 1;
  for (std::size_t at = 0; Fits(input, at, 3);) {
    const unsigned flags = input[at];
    track::SlaveAccess access;
    access.slave = 0;
    if ((flags & 0x20U) == 0) ++frame;
    access.returned.number = frame;
    access.address = static_cast<EscAddress>(0x04F8 + input[at + 1]);
    const ByteSpan bytes = Slice(input, at + 3, input[at + 2] % 32U);
    if ((flags & 1U) != 0) access.written = bytes;
    if ((flags & 2U) != 0) access.read = bytes;
    access.acceptance = static_cast<track::Acceptance>(flags >> 2U & 3U);
    access.broadcast = (flags & 0x10U) != 0;
    assembler.OnAccess(access, &listener);
    at += 3 + bytes.size();
  }
  assembler.Finish(&listener);
  UseContents(assembler.image());
}

}  // namespace
}  // namespace ecaudit

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using ecaudit::ByteSpan;
  if (size < 2) return 0;
  const ByteSpan input(data + 1, size - 1);
  switch (data[0] % 3) {
    case 0:
      ecaudit::UseContents(ecaudit::esc::SiiImage::FromBytes(input));
      break;
    case 1: {
      ecaudit::esc::SiiImage image = ecaudit::esc::SiiImage::FromBytes(input.subspan(1));
      const std::uint32_t step = 2U + input[0];
      for (std::uint32_t word = input[0] / 2U; word < size; word += step) image.Forget(word);
      ecaudit::UseContents(image);
      break;
    }
    default:
      ecaudit::Track(input);
      break;
  }
  return 0;
}
