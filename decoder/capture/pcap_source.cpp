#include "decoder/capture/pcap_source.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include <pcap/pcap.h>

#include "decoder/base/system/streams.h"
#include "decoder/base/text.h"
#include "decoder/capture/byte_order.h"
#include "decoder/capture/capture_stream.h"
#include "decoder/capture/fcs_finder.h"

namespace ecaudit::capture {
namespace {

constexpr std::uint32_t kMicroseconds = 0xA1B2C3D4;
constexpr std::uint32_t kNanoseconds = 0xA1B23C4D;
constexpr std::uint32_t kMicrosecondsLongRecords = 0xA1B2CD34;  // written by an old patched libpcap
constexpr std::size_t kFileHeaderBytes = 24;
constexpr std::size_t kSnapLengthOffset = 16;
constexpr std::size_t kRecordHeaderBytes = 16;
constexpr std::size_t kLongRecordHeaderBytes = 24;
/// Longer packets libpcap takes for damage.
constexpr std::uint32_t kMaxPacketBytes = 262'144;

/// In the field of the link type; the length of the frame check sequence is in the bits above.
constexpr std::uint32_t kFcsLengthPresent = 0x0400'0000;

constexpr std::array kMagics{kMicroseconds, kNanoseconds, kMicrosecondsLongRecords};

class PcapSource final : public FrameSource {
 public:
  PcapSource(std::unique_ptr<InputStream> stream, const std::string& name) : stream_(std::move(stream)) {
    info_.path = name;
    info_.format = FormatName("pcap", stream_->compression());
  }

  /// @return what is wrong with the file header; empty when nothing is
  std::string Start() {
    const ByteSpan header = Slice(stream_->Peek(kFileHeaderBytes), 0, kFileHeaderBytes);
    if (header.size() < kFileHeaderBytes) {
      return stream_->error().empty() ? "file ends inside its pcap file header" : stream_->error();
    }
    if (std::string problem = AskLibpcap(header); !problem.empty()) return problem;
    const std::uint32_t magic = Magic(header);
    order_.big_endian = LittleEndian<std::uint32_t>(header, 0) != magic;
    record_header_bytes_ = magic == kMicrosecondsLongRecords ? kLongRecordHeaderBytes : kRecordHeaderBytes;
    step_ns_ = magic == kNanoseconds ? 1 : 1000;
    Interface interface;
    interface.resolution_ns = step_ns_;
    interface.snap_length = order_.U32(header, kSnapLengthOffset);
    const std::uint32_t link = order_.U32(header, 20);
    interface.link_type = static_cast<std::uint16_t>(link & 0xFFFFU);
    if ((link & kFcsLengthPresent) != 0) fcs_.Declare(link >> 28U);
    info_.interfaces.push_back(std::move(interface));
    stream_->Consume(kFileHeaderBytes);
    return {};
  }

  ReadStatus Next(CapturedFrame& frame) noexcept override {
    if (status_ != ReadStatus::kFrame) return status_;
    stream_->Consume(std::exchange(lent_, 0));
    ByteSpan bytes = stream_->Peek(record_header_bytes_);
    if (bytes.size() < record_header_bytes_) return Stop(bytes.empty());
    std::uint32_t captured = order_.At(bytes.data() + 8);
    std::uint32_t original = order_.At(bytes.data() + 12);
    if (lengths_ == Lengths::kSwapped || (lengths_ == Lengths::kSwappedWhereLonger && captured > original)) {
      std::swap(captured, original);
    }
    if (captured > kMaxPacketBytes) return TooLong(captured);
    const std::size_t size = record_header_bytes_ + captured;
    if (bytes.size() < size) bytes = stream_->Peek(size);
    if (bytes.size() < size) return Stop(false);
    lent_ = size;
    frame.number = ++info_.packets;
    frame.time = TimeNs{order_.At(bytes.data())} * 1'000'000'000 + order_.At(bytes.data() + 4) * step_ns_;
    frame.has_time = true;
    frame.link_type = info_.interfaces[0].link_type;
    frame.interface_index = 0;
    frame.flag = PacketFlag::kNone;
    frame.damaged = false;
    frame.original_length = original;
    frame.bytes = {bytes.data() + record_header_bytes_, captured};
    frame.fcs_bytes = fcs_.In(frame);
    return ReadStatus::kFrame;
  }
  const CaptureInfo& info() const noexcept override { return info_; }
  std::uint64_t bytes_read() const noexcept override { return stream_->bytes_read(); }
  std::uint64_t bytes_total() const noexcept override { return stream_->bytes_total(); }

  static std::uint32_t Magic(ByteSpan head) {
    for (const std::uint32_t magic : kMagics) {
      if (LittleEndian<std::uint32_t>(head, 0) == magic || BigEndian<std::uint32_t>(head, 0) == magic) return magic;
    }
    return 0;
  }

 private:
  /// Versions before 2.4, and one that never was official, wrote both lengths of a packet the other way round.
  enum class Lengths : std::uint8_t { kInOrder, kSwapped, kSwappedWhereLonger };

  /// @return why libpcap does not read a file that begins like this; empty when it does
  std::string AskLibpcap(ByteSpan header) {
    std::array<std::uint8_t, kFileHeaderBytes> copy{};
    std::ranges::copy(header, copy.begin());
    FILE* file = system::OpenBytes(copy);
    if (file == nullptr) return "cannot open a stream";
    std::array<char, PCAP_ERRBUF_SIZE> message{};
    pcap_t* pcap = pcap_fopen_offline(file, message.data());
    if (pcap == nullptr) {
      std::fclose(file);
      return Printable(message.data());
    }
    constexpr int kOfDgUx = 543;
    const int major = pcap_major_version(pcap);
    const int minor = pcap_minor_version(pcap);
    if (major == kOfDgUx || (major == 2 && minor < 3)) lengths_ = Lengths::kSwapped;
    if (major == 2 && minor == 3) lengths_ = Lengths::kSwappedWhereLonger;
    pcap_close(pcap);  // closes the file, too
    return {};
  }

  /// No whole packet comes any more. @param between  the input ends where a packet does
  [[gnu::cold, gnu::noinline]] ReadStatus Stop(bool between) {
    if ((between && stream_->error().empty()) || stream_->stopped()) return status_ = ReadStatus::kEnd;
    return Damaged(stream_->error().empty() ? "file ends inside packet " + std::to_string(info_.packets + 1)
                                            : StreamDamage(*stream_, info_.packets));
  }

  [[gnu::cold, gnu::noinline]] ReadStatus TooLong(std::uint32_t captured) {
    return Damaged("packet " + std::to_string(info_.packets + 1) + " is not valid (captured length " +
                   Grouped(captured) + " bytes)");
  }

  ReadStatus Damaged(std::string message) {
    info_.damage = Damage{std::move(message), stream_->offset(), info_.packets};
    return status_ = ReadStatus::kDamaged;
  }

  std::unique_ptr<InputStream> stream_;
  CaptureInfo info_;
  ReadStatus status_ = ReadStatus::kFrame;
  ByteOrder order_;
  FcsFinder fcs_;
  Lengths lengths_ = Lengths::kInOrder;
  std::size_t record_header_bytes_ = kRecordHeaderBytes;
  TimeNs step_ns_ = 1000;
  std::size_t lent_ = 0;  ///< bytes of the packet that is lent out, consumed by the next call
};

}  // namespace

bool IsPcap(ByteSpan head) {
  return PcapSource::Magic(head) != 0;
}

Result<std::unique_ptr<FrameSource>> OpenPcap(std::unique_ptr<InputStream> stream, const std::string& name) {
  auto source = std::make_unique<PcapSource>(std::move(stream), name);
  const std::string problem = source->Start();
  if (!problem.empty()) return Error{DisplayName(name) + " is not a readable capture: " + problem};
  return std::unique_ptr<FrameSource>(std::move(source));
}

}  // namespace ecaudit::capture
