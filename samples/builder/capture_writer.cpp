#include "samples/builder/capture_writer.h"

#include <algorithm>

namespace ecaudit::samples {
namespace {

constexpr std::uint32_t kUnlimited = 262144;  // what tcpdump and Wireshark write

class Encoder {
 public:
  explicit Encoder(ByteOrder order) : big_(order == ByteOrder::kBig) {}

  template <typename T>
  void Put(T value) {
    big_ ? AppendBe(bytes, value) : AppendLe(bytes, value);
  }
  void Pad() { bytes.resize((bytes.size() + 3) / 4 * 4, 0); }
  void Data(ByteView data) {
    AppendBytes(bytes, data);
    Pad();
  }
  void Option(std::uint16_t code, ByteView value) {
    Put(code);
    Put(static_cast<std::uint16_t>(value.size()));
    Data(value);
  }
  void Option(std::uint16_t code, const std::string& text) { Option(code, Bytes(text.begin(), text.end())); }
  void EndOfOptions() { Put(std::uint32_t{0}); }
  Encoder Inner() const { return Encoder(big_ ? ByteOrder::kBig : ByteOrder::kLittle); }
  void Block(std::uint32_t type, const Encoder& body) {
    const auto length = static_cast<std::uint32_t>(body.bytes.size() + 12);
    Put(type);
    Put(length);
    AppendBytes(bytes, body.bytes);
    Put(length);
  }

  Bytes bytes;

 private:
  bool big_;
};

constexpr std::uint16_t kOptComment = 1;

std::uint64_t Stamp(TimeNs time, std::uint8_t resolution) {
  auto stamp = static_cast<std::uint64_t>(time);
  for (int digits = 9; digits > resolution; --digits) stamp /= 10;
  return stamp;
}

std::uint32_t OriginalLength(const WrittenPacket& packet) {
  return packet.original_length != 0 ? packet.original_length : static_cast<std::uint32_t>(packet.bytes.size());
}

void PutPacket(Encoder& file, const WrittenCapture& capture, const WrittenPacket& packet) {
  Encoder body = file.Inner();
  if (packet.simple) {
    body.Put(OriginalLength(packet));
    body.Data(packet.bytes);
    file.Block(3, body);
    return;
  }
  const std::uint64_t stamp = Stamp(packet.time, capture.interfaces.at(packet.interface_index).resolution);
  body.Put(packet.interface_index);
  body.Put(static_cast<std::uint32_t>(stamp >> 32U));
  body.Put(static_cast<std::uint32_t>(stamp & 0xFFFFFFFFU));
  body.Put(static_cast<std::uint32_t>(packet.bytes.size()));
  body.Put(OriginalLength(packet));
  body.Data(packet.bytes);
  const bool flags = packet.direction != PacketDirection::kNotRecorded;
  if (!packet.comment.empty()) body.Option(kOptComment, packet.comment);
  if (flags) {
    Encoder value = file.Inner();
    value.Put(std::uint32_t{packet.direction == PacketDirection::kInbound ? 1U : 2U});
    body.Option(2, value.bytes);
  }
  if (flags || !packet.comment.empty()) body.EndOfOptions();
  file.Block(6, body);
}

void PutRecord(Encoder& file, const WrittenPacket& packet, bool nanoseconds) {
  constexpr TimeNs kSecond = 1'000'000'000;
  file.Put(static_cast<std::uint32_t>(packet.time / kSecond));
  file.Put(static_cast<std::uint32_t>(packet.time % kSecond / (nanoseconds ? 1 : 1000)));
  file.Put(static_cast<std::uint32_t>(packet.bytes.size()));
  file.Put(OriginalLength(packet));
  AppendBytes(file.bytes, packet.bytes);
}

}  // namespace

Bytes EncodePcapNg(const WrittenCapture& capture, ByteOrder order) {
  Encoder file(order);
  Encoder section = file.Inner();
  section.Put(std::uint32_t{0x1A2B3C4D});
  section.Put(std::uint16_t{1});
  section.Put(std::uint16_t{0});
  section.Put(~std::uint64_t{0});  // section length not given
  if (!capture.comment.empty()) section.Option(kOptComment, capture.comment);
  section.Option(4, "ecaudit_make_samples");
  section.EndOfOptions();
  file.Block(0x0A0D0D0A, section);

  for (const WrittenInterface& one : capture.interfaces) {
    Encoder body = file.Inner();
    body.Put(one.link_type);
    body.Put(std::uint16_t{0});
    body.Put(one.snap_length);
    if (!one.name.empty()) body.Option(2, one.name);
    body.Option(9, Bytes{one.resolution});
    body.EndOfOptions();
    file.Block(1, body);
  }
  for (const WrittenPacket& packet : capture.packets) PutPacket(file, capture, packet);

  const TimeNs end = capture.packets.empty() ? 0 : capture.packets.back().time;
  for (std::size_t i = 0; i < capture.interfaces.size(); ++i) {
    if (!capture.interfaces[i].dropped) continue;
    Encoder body = file.Inner();
    const std::uint64_t stamp = Stamp(end, capture.interfaces[i].resolution);
    body.Put(static_cast<std::uint32_t>(i));
    body.Put(static_cast<std::uint32_t>(stamp >> 32U));
    body.Put(static_cast<std::uint32_t>(stamp & 0xFFFFFFFFU));
    Encoder value = file.Inner();
    value.Put(*capture.interfaces[i].dropped);
    body.Option(5, value.bytes);
    body.EndOfOptions();
    file.Block(5, body);
  }
  return file.bytes;
}

Bytes EncodePcap(const WrittenCapture& capture, bool nanoseconds, ByteOrder order) {
  const WrittenInterface& first = capture.interfaces.at(0);
  Encoder file(order);
  file.Put(nanoseconds ? std::uint32_t{0xA1B23C4D} : std::uint32_t{0xA1B2C3D4});
  file.Put(std::uint16_t{2});
  file.Put(std::uint16_t{4});
  file.Put(std::uint32_t{0});
  file.Put(std::uint32_t{0});
  file.Put(first.snap_length != 0 ? first.snap_length : kUnlimited);
  file.Put(std::uint32_t{first.link_type});
  for (const WrittenPacket& packet : capture.packets) PutRecord(file, packet, nanoseconds);
  return file.bytes;
}

Bytes EncodePcapNgPackets(const WrittenCapture& capture, ByteOrder order) {
  Encoder file(order);
  for (const WrittenPacket& packet : capture.packets) PutPacket(file, capture, packet);
  return file.bytes;
}

Bytes EncodePcapPackets(const WrittenCapture& capture, bool nanoseconds, ByteOrder order) {
  Encoder file(order);
  for (const WrittenPacket& packet : capture.packets) PutRecord(file, packet, nanoseconds);
  return file.bytes;
}

}  // namespace ecaudit::samples
