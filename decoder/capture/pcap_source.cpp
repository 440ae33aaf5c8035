#include "decoder/capture/pcap_source.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <pcap/pcap.h>

#include "decoder/base/text.h"
#include "decoder/capture/capture_stream.h"

namespace ecaudit::capture {
namespace {

constexpr std::uint32_t kMicroseconds = 0xA1B2C3D4;
constexpr std::uint32_t kNanoseconds = 0xA1B23C4D;
constexpr std::uint32_t kMicrosecondsLongRecords = 0xA1B2CD34;  // written by an old patched libpcap
constexpr std::size_t kFileHeaderBytes = 24;
constexpr std::size_t kSnapLengthOffset = 16;
constexpr std::size_t kRecordHeaderBytes = 16;
constexpr std::size_t kLongRecordHeaderBytes = 24;
constexpr std::size_t kStdioBufferBytes = std::size_t{64} * 1024;

constexpr std::array kMagics{kMicroseconds, kNanoseconds, kMicrosecondsLongRecords};

class PcapSource final : public FrameSource {
 public:
  PcapSource(std::unique_ptr<InputStream> stream, const std::string& name)
      : stream_(std::move(stream)), stdio_buffer_(kStdioBufferBytes) {
    info_.path = name;
    info_.format = FormatName("pcap", stream_->compression());
  }
  ~PcapSource() override {
    if (pcap_ != nullptr) pcap_close(pcap_);  // closes the FILE, too
  }

  /// @return what is wrong with the file header; empty when nothing is
  std::string Start() {
    const ByteSpan header = Slice(stream_->Peek(kFileHeaderBytes), 0, kFileHeaderBytes);
    if (header.size() < kFileHeaderBytes) {
      return stream_->error().empty() ? "file ends inside its pcap file header" : stream_->error();
    }
    const bool big_endian = LittleEndian<std::uint32_t>(header, 0) != Magic(header);
    const auto field = [&](std::size_t offset) {
      return big_endian ? BigEndian<std::uint32_t>(header, offset) : LittleEndian<std::uint32_t>(header, offset);
    };
    Interface interface;
    interface.resolution_ns = Magic(header) == kNanoseconds ? 1 : 1000;
    interface.snap_length = field(kSnapLengthOffset);
    interface.link_type =
        static_cast<std::uint16_t>(field(20) & 0xFFFFU);  // above it: length of the frame check sequence
    record_header_bytes_ = Magic(header) == kMicrosecondsLongRecords ? kLongRecordHeaderBytes : kRecordHeaderBytes;

    // libpcap cuts packets to the snap length of the file header. Where a writer put in less than it captured, all of
    // the packet is wanted nevertheless, as Wireshark shows it: libpcap gets a header without snap length.
    std::copy(header.begin(), header.end(), header_.begin());
    std::fill_n(header_.begin() + kSnapLengthOffset, sizeof(std::uint32_t), std::uint8_t{0});
    stream_->Consume(kFileHeaderBytes);

    FILE* file = fopencookie(this, "rb", {&ReadCookie, nullptr, nullptr, nullptr});
    if (file == nullptr) return "cannot open a stream";
    std::setvbuf(file, stdio_buffer_.data(), _IOFBF, stdio_buffer_.size());
    std::array<char, PCAP_ERRBUF_SIZE> message{};
    pcap_ = pcap_fopen_offline_with_tstamp_precision(file, PCAP_TSTAMP_PRECISION_NANO, message.data());
    if (pcap_ == nullptr) {
      std::fclose(file);
      return stream_->error().empty() ? Printable(message.data()) : stream_->error();
    }
    info_.interfaces.push_back(std::move(interface));
    return {};
  }

  ReadStatus Next(CapturedFrame& frame) noexcept override {
    if (status_ != ReadStatus::kFrame) return status_;
    pcap_pkthdr* header = nullptr;
    const u_char* data = nullptr;
    const int result = pcap_next_ex(pcap_, &header, &data);
    if (result != 1) return Stop(result);
    frame.number = ++info_.packets;
    frame.time = static_cast<TimeNs>(static_cast<std::uint32_t>(header->ts.tv_sec)) * 1'000'000'000 +
                 static_cast<std::uint32_t>(header->ts.tv_usec);
    frame.has_time = true;
    frame.link_type = info_.interfaces[0].link_type;
    frame.interface_index = 0;
    frame.flag = PacketFlag::kNone;
    frame.damaged = false;
    frame.original_length = header->len;
    frame.bytes = {data, header->caplen};
    offset_ += record_header_bytes_ + header->caplen;
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
  static ssize_t ReadCookie(void* cookie, char* buffer, std::size_t size) {
    auto& source = *static_cast<PcapSource*>(cookie);
    const std::span<std::uint8_t> out(reinterpret_cast<std::uint8_t*>(buffer), size);
    const ByteSpan header = Slice(source.header_, source.header_read_, size);
    if (!header.empty()) {
      std::copy(header.begin(), header.end(), out.begin());
      source.header_read_ += header.size();
      return static_cast<ssize_t>(header.size());
    }
    const std::size_t count = source.stream_->Read(out);
    return count == 0 && !source.stream_->error().empty() ? -1 : static_cast<ssize_t>(count);
  }

  ReadStatus Stop(int result) {
    constexpr int kEndOfFile = -2;
    if ((result == kEndOfFile && stream_->error().empty()) || stream_->stopped()) return status_ = ReadStatus::kEnd;
    Damage damage;
    damage.after_frame = info_.packets;
    damage.offset = offset_;
    const std::string next = std::to_string(info_.packets + 1);
    const std::string_view reason = pcap_geterr(pcap_);
    if (!stream_->error().empty()) {
      damage.message = StreamDamage(*stream_, info_.packets);
    } else if (reason.starts_with("truncated")) {
      damage.message = "file ends inside packet " + next;
    } else {
      damage.message = "packet " + next + " is not valid (" + Printable(reason) + ")";
    }
    info_.damage = std::move(damage);
    return status_ = ReadStatus::kDamaged;
  }

  std::unique_ptr<InputStream> stream_;
  std::vector<char> stdio_buffer_;
  std::array<std::uint8_t, kFileHeaderBytes> header_{};  // what libpcap gets instead of the file's own
  std::size_t header_read_ = 0;
  pcap_t* pcap_ = nullptr;
  CaptureInfo info_;
  ReadStatus status_ = ReadStatus::kFrame;
  std::size_t record_header_bytes_ = kRecordHeaderBytes;
  std::uint64_t offset_ = kFileHeaderBytes;
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
