/// Fuzzes the register map and its texts: any bytes at any address. Input: address (2), kind (1), bytes.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "decoder/esc/bit_copy.h"
#include "decoder/esc/datagram_text.h"
#include "decoder/esc/register_image.h"
#include "decoder/esc/register_text.h"

namespace ecaudit {
namespace {

void Check(bool condition) {
  if (!condition) std::abort();
}

void Registers(EscAddress address, unsigned kind, ByteSpan bytes) {
  std::size_t next = 0;
  esc::CutAccess(address, bytes.size(), [&](const esc::RegisterPart& part) {
    Check(part.at == next && part.length > 0);
    next += part.length;
    if (part.hit) Check(!esc::DescribeRegister(part.hit, Slice(bytes, part.at), esc::AccessKind::READ).empty());
  });
  Check(next == bytes.size() || next == esc::kAddressSpace - address);
  const std::string text = esc::DescribeAccess(address, bytes, static_cast<esc::AccessKind>(kind % 3));
  Check(text.size() < 4096);
  for (const char c : text) Check(c >= ' ' && c <= '~');
  Check(!(esc::EveryEscWrites(address, bytes.size()) && esc::NothingToWrite(address, bytes.size())));

  esc::RegisterImage image;
  image.Write(address, bytes, Certainty::kObserved);
  std::array<std::uint8_t, 64> out{};
  const Certainty certainty = image.Read(address, out);
  if (address + out.size() <= esc::RegisterImage::kSize && bytes.size() >= out.size()) {
    Check(certainty == Certainty::kObserved && out[63] == bytes[63]);
  }
  image.Forget(static_cast<EscAddress>(address + 1), bytes.size());

  if (const auto fmmu = esc::Fmmu::Decode(bytes)) {
    const esc::BitRange bits = fmmu->logical_bits();
    Check(fmmu->Overlap(fmmu->logical_start, fmmu->length) == bits || bits.empty());
    if (!bits.empty()) Check(fmmu->ToLogicalBit(*fmmu->ToPhysicalBit(bits.end() - 1)) == bits.end() - 1);
    esc::CopyBits(bytes, fmmu->logical_start_bit, out, fmmu->physical_start_bit, fmmu->bit_count());
  }
  if (const auto sm = esc::SyncManager::Decode(bytes)) Check(!esc::Describe(*sm, true).empty());
}

}  // namespace
}  // namespace ecaudit

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3 || size > 4096) return 0;
  const ecaudit::ByteSpan input(data, size);
  const auto address = ecaudit::LittleEndian<std::uint16_t>(input, 0);
  // Most of the address space is process RAM, which has no registers.
  ecaudit::Registers(static_cast<ecaudit::EscAddress>(address % 8 == 0 ? address : address % 0x1010), input[2],
                     input.subspan(3));
  if (size >= 16) {
    const ecaudit::wire::DatagramView datagram(input.subspan(3), 0);
    if (size >= 3 + 12) (void)ecaudit::esc::DescribeDatagram(datagram, (input[2] & 0x80U) != 0);
  }
  return 0;
}
