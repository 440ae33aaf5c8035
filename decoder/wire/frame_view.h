/// in: CapturedFrame.  out: FrameView, the EtherCAT part of it cut into datagrams. Nothing is copied or allocated.
///
///   bytes: | Ethernet 14 | VLAN tags 4 each | IPv4 + UDP 28+ | EtherCAT header 2 | datagram | datagram | padding |
///   datagram:      | cmd 1 | index 1 | address 4 | length+flags 2 | irq 2 | data n | wkc 2 |
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <span>
#include <string_view>

#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"
#include "decoder/base/wrapping.h"
#include "decoder/capture/frame_source.h"
#include "decoder/wire/command.h"

namespace ecaudit::wire {

/// In a source address: the bit that every ESC sets in frames that pass it (locally administered).
inline constexpr std::uint64_t kMacBit = std::uint64_t{1} << 41U;
/// Bytes before the data of a datagram, and of the working counter after it.
inline constexpr std::size_t kDatagramHeaderBytes = 10;
inline constexpr std::size_t kWorkingCounterBytes = 2;

/// One datagram; borrows the packet's bytes. All getters are plain loads: FrameView checked the lengths, and once is
/// enough for what is read a dozen times a frame.
class DatagramView {
 public:
  /// @param bytes header, data and working counter of exactly this datagram: at least 12 bytes
  DatagramView(ByteSpan bytes, std::uint8_t ordinal) : bytes_(bytes), ordinal_(ordinal) {
    assert(bytes.size() >= kDatagramHeaderBytes + kWorkingCounterBytes);
  }

  [[nodiscard]] std::uint8_t ordinal() const { return ordinal_; }  ///< from 0 in the frame
  [[nodiscard]] Command command() const { return static_cast<Command>(*bytes_.data()); }
  [[nodiscard]] std::uint8_t command_byte() const { return *bytes_.data(); }
  [[nodiscard]] std::uint8_t index() const { return bytes_.data()[1]; }
  [[nodiscard]] std::uint16_t adp() const { return LoadLittleEndian<std::uint16_t>(bytes_.data() + 2); }
  [[nodiscard]] std::uint16_t ado() const { return LoadLittleEndian<std::uint16_t>(bytes_.data() + 4); }
  [[nodiscard]] std::uint32_t logical_address() const { return LoadLittleEndian<std::uint32_t>(bytes_.data() + 2); }
  [[nodiscard]] std::uint16_t length() const { return length_word() & 0x07FFU; }
  [[nodiscard]] bool circulating() const { return (length_word() & 0x4000U) != 0; }
  [[nodiscard]] bool more() const { return (length_word() & 0x8000U) != 0; }
  [[nodiscard]] std::uint16_t irq() const { return LoadLittleEndian<std::uint16_t>(bytes_.data() + 8); }
  [[nodiscard]] ByteSpan data() const {
    return {bytes_.data() + kDatagramHeaderBytes, bytes_.size() - kDatagramHeaderBytes - kWorkingCounterBytes};
  }
  [[nodiscard]] std::uint16_t wkc() const {
    return LoadLittleEndian<std::uint16_t>(bytes_.data() + bytes_.size() - kWorkingCounterBytes);
  }
  [[nodiscard]] ByteSpan bytes() const { return bytes_; }
  /// Command, index, length and address as one number, without what slaves change: a returned datagram has the same as
  /// the one that was sent.
  [[nodiscard]] std::uint64_t KeptHeader() const { return KeptHeaderAt(bytes_.data()); }
  /// The same of a datagram whose header begins at `at`.
  [[nodiscard]] static std::uint64_t KeptHeaderAt(const std::uint8_t* at) {
    return LoadLittleEndian<std::uint64_t>(at) & KeptMask(static_cast<Command>(*at));
  }
  /// The bits of a header's first eight bytes that it keeps.
  [[nodiscard]] static std::uint64_t KeptMask(Command command) {
    constexpr std::uint64_t kPosition = 0xFFFF'0000;  // adp, bytes 2 and 3
    constexpr std::uint64_t kLengthFlags = 0xF800'0000'0000'0000;
    return IncrementsAdp(command) ? ~(kLengthFlags | kPosition) : ~kLengthFlags;
  }

 private:
  [[nodiscard]] std::uint16_t length_word() const { return LoadLittleEndian<std::uint16_t>(bytes_.data() + 6); }

  ByteSpan bytes_;
  std::uint8_t ordinal_;
};

enum class FrameKind : std::uint8_t {
  kOther,          ///< no EtherCAT, or an EtherCAT header type other than 1 (EAP, mailbox gateway, ...)
  kEtherCat,       ///< all datagrams are consistent
  kMalformed,      ///< EtherCAT, but inconsistent: see problem(); the datagrams before the problem are readable
  kCut,            ///< cut by the snap length: the datagrams before the cut are readable
  kDamagedOnWire,  ///< probe (ESL record) or capture saw a CRC or alignment error: not to be trusted
};

/// Why a frame is kMalformed.
enum class FrameProblem : std::uint8_t {
  kNone,
  kNoHeader,              ///< no room for the two bytes of the EtherCAT header
  kLengthBeyondFrame,     ///< the EtherCAT length announces more than the packet holds
  kDatagramBeyondLength,  ///< a datagram's length reaches past the EtherCAT length
  kMoreWithoutDatagram,   ///< the more flag is set on the last datagram that fits
  kUnknownCommand,        ///< a command byte outside 0-14
  kNoDatagram,            ///< EtherCAT length 0
  kByteOrder,             ///< EtherCAT header, or that and the lengths of all datagrams, are big-endian
};

/// One sentence part for each problem, for example "the EtherCAT length reaches past the end of the frame".
[[nodiscard]] std::string_view Describe(FrameProblem problem);

enum class Encapsulation : std::uint8_t { kEthernet, kUdp };

/// What a probe adds to each frame: Beckhoff ET2000/CU2508 (16 bytes before or after it), or Hilscher netANALYZER (4
/// bytes before it, without time).
struct EslRecord {
  bool present = false;
  bool crc_error = false;
  bool alignment_error = false;
  bool has_time = false;
  std::uint8_t port = 0;      ///< 0-11; meaningful only when present
  std::uint64_t time_ns = 0;  ///< clock of the probe
};

/// All of a FrameView but where its datagrams lie, to be copied as a whole.
struct FrameFields {
  ByteSpan bytes_;
  FrameRef ref_;
  std::uint64_t source_mac_ = 0;
  std::uint64_t key_ = 0;
  EslRecord esl_;
  FrameKind kind_ = FrameKind::kOther;
  FrameProblem problem_ = FrameProblem::kNone;
  Encapsulation encapsulation_ = Encapsulation::kEthernet;
  capture::PacketFlag flag_ = capture::PacketFlag::kNone;
  std::uint16_t interface_index_ = 0;
  std::uint16_t padding_ = 0;
  std::uint8_t vlan_tags_ = 0;
  std::uint8_t ethercat_type_ = 0;
  bool has_header_ = false;
  bool cut_before_type_ = false;
  bool other_link_ = false;
  bool whole_ = false;  ///< of a malformed frame: only its EtherCAT length is wrong
  std::uint8_t count_ = 0;
};

class FrameView : private FrameFields {
 public:
  static constexpr std::size_t kMaxDatagrams = 170;  ///< 2047 / 12

  /// Cuts `frame` into datagrams. Never fails: kind() shows what it is.
  /// The view borrows frame.bytes and is valid as long as they are.
  static FrameView Parse(const capture::CapturedFrame& frame) noexcept;
  static FrameView Parse(capture::CapturedFrame&&) = delete;

  FrameView() = default;

  [[nodiscard]] FrameKind kind() const { return kind_; }
  [[nodiscard]] FrameProblem problem() const { return problem_; }
  [[nodiscard]] const FrameRef& ref() const { return ref_; }
  [[nodiscard]] std::uint16_t interface_index() const { return interface_index_; }
  [[nodiscard]] capture::PacketFlag flag() const { return flag_; }
  [[nodiscard]] Encapsulation encapsulation() const { return encapsulation_; }
  [[nodiscard]] std::uint8_t vlan_tags() const { return vlan_tags_; }
  /// Source MAC as a number, first byte on the wire in bits 47-40; 0 when the link type has none. Where a slave
  /// exchanged source and destination, that of the master as slaves return it: see mac_bit().
  [[nodiscard]] std::uint64_t source_mac() const { return source_mac_; }
  /// Locally-administered bit of the source MAC: every ESC sets it, so "has passed a slave" - unless the master's own
  /// address has it.
  [[nodiscard]] bool mac_bit() const { return (source_mac_ & kMacBit) != 0; }
  /// The source address, the same before and after it passed slaves.
  [[nodiscard]] std::uint64_t sender() const { return source_mac_ & ~kMacBit; }
  [[nodiscard]] const EslRecord& esl() const { return esl_; }
  /// Type nibble of the EtherCAT header: 1 commands, 4 network variables, 5 mailbox gateway; 0 when there is no header.
  [[nodiscard]] std::uint8_t ethercat_type() const { return ethercat_type_; }
  [[nodiscard]] bool has_ethercat_header() const { return has_header_; }
  /// Cut by the snap length so early that it is unknown whether it is EtherCAT; kind() is kOther then.
  [[nodiscard]] bool cut_before_type() const { return cut_before_type_; }
  /// What looks like an EtherCAT frame is in it, but its link type is none that is read; kind() is kOther then.
  [[nodiscard]] bool other_link() const { return other_link_; }

  /// Bytes that the EtherCAT length covers after the last datagram: TwinCAT rounds it up to an even number, others
  /// write the same for all small frames. Slaves do not examine them. padding_bytes() only for a view over
  /// the whole packet.
  [[nodiscard]] std::size_t padding() const { return padding_; }
  [[nodiscard]] ByteSpan padding_bytes() const {
    return bytes_.subspan(used_bytes(), std::min<std::size_t>(padding_, bytes_.size() - used_bytes()));
  }

  /// True when the EtherCAT length exceeds the frame, and nothing else is wrong. Some masters write the length of the
  /// whole Ethernet frame there; slaves stop where the more flag is clear.
  [[nodiscard]] bool IsWholeButForLength() const { return whole_ && kind_ == FrameKind::kMalformed; }
  /// Such a frame is well formed: slaves took part in others like it.
  void AcceptLength() {
    if (!IsWholeButForLength()) return;
    kind_ = FrameKind::kEtherCat;
    problem_ = FrameProblem::kNone;
  }

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] DatagramView operator[](std::size_t i) const {
    if (i >= count_) [[unlikely]]
      __builtin_trap();  // offsets after are not set
    const std::uint16_t* const begin = offsets_.data() + i;
    return {ByteSpan(bytes_.data() + *begin, static_cast<std::size_t>(begin[1] - begin[0])),
            static_cast<std::uint8_t>(i)};
  }
  /// The datagrams as they stand in the packet, without EtherCAT header and padding.
  [[nodiscard]] ByteSpan payload() const {
    return count_ == 0 ? ByteSpan{}
                       : bytes_.subspan(offsets_[0], static_cast<std::size_t>(offsets_[count_] - offsets_[0]));
  }
  [[nodiscard]] ByteSpan bytes() const { return bytes_; }
  /// Identifies the frame by what slaves never change: commands, indices, lengths and addresses (without the position
  /// counter of position-addressed and broadcast commands). Equal for the outbound and returned copy of one frame.
  [[nodiscard]] std::uint64_t key() const { return key_; }
  /// The key of a frame's first datagrams, and the kept header of the next one: that with this. Begins with their
  /// number.
  [[nodiscard]] static std::uint64_t MixKey(std::uint64_t key, std::uint64_t kept_header) noexcept {
    constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15U, kSpread = 0xFF51AFD7ED558CCDU, kShift = 64;
    key ^= WrappingSum(WrappingSum(kept_header, kGolden), WrappingSum(WrappingProduct(key, kShift), key >> 2U));
    return WrappingProduct(key, kSpread);
  }
  /// As many of bytes() as the view needs to read its datagrams: at most about 2,200.
  [[nodiscard]] std::size_t used_bytes() const { return count_ == 0 ? 0 : offsets_[count_]; }

  /// Becomes the same view over a copy of the packet's bytes; `copy` must hold the same bytes, at least used_bytes() of
  /// them.
  void Rebase(const FrameView& from, ByteSpan copy) { Restore(from.fields(), from.offsets_.data(), copy); }

  /// Becomes the view of another packet, of plain Ethernet, which is cut at the same places. @param key of that one
  void MoveTo(const capture::CapturedFrame& frame, std::uint64_t key) {
    ref_ = frame.ref();
    interface_index_ = frame.interface_index;
    flag_ = frame.flag;
    bytes_ = frame.bytes;
    key_ = key;
  }

  /// What has to be kept, beside a copy of bytes(), to have the view again.
  [[nodiscard]] const FrameFields& fields() const { return *this; }
  [[nodiscard]] std::span<const std::uint16_t> offsets() const {
    return std::span(offsets_).first(count_ == 0 ? 0 : count_ + std::size_t{1});
  }
  /// Becomes the view that `fields` and `offsets` were taken from, over a copy of the packet's bytes.
  void Restore(const FrameFields& fields, const std::uint16_t* offsets, ByteSpan copy) {
    static_cast<FrameFields&>(*this) = fields;
    constexpr std::uint8_t kFew = 8;
    if (count_ > kFew) {
      std::copy_n(offsets, count_ + std::size_t{1}, offsets_.begin());
    } else if (count_ > 0) {  // nearly always: no call
      std::uint16_t* to = offsets_.data();
      for (const std::uint16_t* const end = offsets + count_ + 1; offsets != end; ++offsets) *to++ = *offsets;
    }
    bytes_ = copy;
  }

 private:
  void Fail(FrameProblem problem) noexcept;
  bool ParseOddDatagrams(std::size_t& at, std::size_t announced_end) noexcept;
  void ParseDatagrams(std::size_t offset, bool cut) noexcept;
  [[nodiscard]] std::uint64_t KeyOfDatagrams() const noexcept;

  std::array<std::uint16_t, kMaxDatagrams + 1> offsets_;  // deliberately not zeroed: only [0, count_] is read
};

}  // namespace ecaudit::wire
