/// The EEPROM of a slave (SII, slave information interface) as far as the capture shows it: words, and their meaning.
///
///   word 0x00 | 0x08     | 0x10   | 0x14       0x18     | 0x1C      | 0x3E          | 0x40
///   PDI, CRC  | identity | delays | mailboxes (BOOT, std) | protocols | size, version | categories: type, words, data
///   ...
///
/// Sources: esc-reference 11.1; ETG.1000.6 and ETG.2010 layouts as used by public stacks.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/bytes.h"

namespace ecaudit::esc {

/// Words 0-0xFFFF, each known or unknown. Memory is taken in pages of 256 words, 136 KiB at most.
class SiiImage {
 public:
  static constexpr std::uint32_t kWords = 0x10000;

  enum class Change : std::uint8_t {
    kNone,      ///< the word was known and is the same, or lies outside the image
    kLearned,   ///< it was unknown
    kReplaced,  ///< it was known with another value
  };

  SiiImage() = default;
  SiiImage(SiiImage&&) noexcept = default;
  SiiImage& operator=(SiiImage&&) noexcept = default;
  SiiImage(const SiiImage& other);
  SiiImage& operator=(const SiiImage& other);
  ~SiiImage() = default;

  /// An image with the words in `bytes` (low byte first) from word 0 on; an odd last byte is ignored.
  [[nodiscard]] static SiiImage FromBytes(ByteSpan bytes);

  Change Set(std::uint32_t word, std::uint16_t value);
  /// Set() need not take memory for it.
  [[nodiscard]] bool HasRoom(std::uint32_t word) const { return word >= kWords || FindPage(word) != nullptr; }
  void Forget(std::uint32_t word);
  void Clear() { pages_.clear(); }

  [[nodiscard]] std::optional<std::uint16_t> Word(std::uint32_t word) const;
  /// Two words, the low one first.
  [[nodiscard]] std::optional<std::uint32_t> DoubleWord(std::uint32_t word) const;
  [[nodiscard]] std::uint32_t KnownWords() const;
  [[nodiscard]] std::uint32_t KnownWords(std::uint32_t first, std::uint32_t count) const;
  /// The bytes of `count` words; nothing unless all are known.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> Bytes(std::uint32_t first, std::uint32_t count) const;

 private:
  static constexpr std::uint32_t kPageWords = 256;
  struct Page {
    std::array<std::uint16_t, kPageWords> words{};
    std::bitset<kPageWords> known;
  };
  [[nodiscard]] const Page* FindPage(std::uint32_t word) const;

  std::vector<std::unique_ptr<Page>> pages_;  ///< index = word / kPageWords; short when the upper pages are unknown
};

/// CRC-8 (polynomial 0x07, start 0xFF) as in the low byte of word 7, over words 0-6.
[[nodiscard]] std::uint8_t SiiChecksum(ByteSpan bytes);

enum class SiiChecksumState : std::uint8_t {
  kUnknown,  ///< words 0-7 are not all known
  kRight,
  kWrong,
  kDisabled,  ///< word 7 is 0x88A4, which switches the check off
};

/// Where a mailbox lies in ESC memory by the EEPROM; both 0 when the slave has none.
struct SiiMailbox {
  std::uint16_t offset = 0;
  std::uint16_t size = 0;
  friend bool operator==(const SiiMailbox&, const SiiMailbox&) = default;
};

/// Bits of SiiHeader::protocols.
enum SiiProtocol : std::uint16_t {
  kSiiAoe = 0x01,
  kSiiEoe = 0x02,
  kSiiCoe = 0x04,
  kSiiFoe = 0x08,
  kSiiSoe = 0x10,
  kSiiVoe = 0x20,
};
/// "CoE, FoE"; "none" for 0; bits without a name as "0x0040".
[[nodiscard]] std::string SiiProtocolNames(std::uint16_t protocols);

/// Words 0-0x3F. "Receive" is the slave's view: master to slave.
struct SiiHeader {
  std::optional<std::uint16_t> pdi_control;          ///< for 0x0140 and 0x0141
  std::optional<std::uint16_t> pdi_configuration;    ///< for 0x0150 and 0x0151
  std::optional<std::uint16_t> sync_pulse_10ns;      ///< for 0x0982
  std::optional<std::uint16_t> pdi_configuration_2;  ///< for 0x0152
  std::optional<std::uint16_t> alias;                ///< for 0x0012, at power-on
  std::optional<std::uint16_t> checksum;             ///< word 7
  SiiChecksumState checksum_state = SiiChecksumState::kUnknown;
  std::optional<std::uint32_t> vendor_id;
  std::optional<std::uint32_t> product_code;
  std::optional<std::uint32_t> revision;
  std::optional<std::uint32_t> serial;
  std::optional<SiiMailbox> bootstrap_receive;
  std::optional<SiiMailbox> bootstrap_send;
  std::optional<SiiMailbox> standard_receive;
  std::optional<SiiMailbox> standard_send;
  std::optional<std::uint16_t> protocols;  ///< SiiProtocol bits
  std::optional<std::uint32_t> size_bytes;
  std::optional<std::uint16_t> version;
};

enum class SiiCategoryType : std::uint16_t {
  NOP = 0,
  STRINGS = 10,
  DATA_TYPES = 20,
  GENERAL = 30,
  FMMU = 40,
  SYNC_MANAGER = 41,
  FMMU_EXTENDED = 42,
  SYNC_UNIT = 43,
  TX_PDO = 50,
  RX_PDO = 51,
  DC = 60,
  END = 0xFFFF,
};
/// First vendor-specific category type; MKD keeps its model name in 0x0800 and its firmware version in 0x0801.
inline constexpr std::uint16_t kSiiVendorCategory = 0x0800;
/// "strings", "TxPDO", "vendor 0x0800", "category 77".
[[nodiscard]] std::string SiiCategoryName(std::uint16_t type);

/// What one word means: "station alias", "category strings"; empty where nothing shows it.
[[nodiscard]] std::string SiiWordName(const SiiImage& image, std::uint32_t word);
/// The parts that `count` words from `first` on belong to: "configuration, identity"; empty where nothing shows it.
[[nodiscard]] std::string SiiPartNames(const SiiImage& image, std::uint32_t first, std::uint32_t count);

/// One category as the chain of headers shows it.
struct SiiCategory {
  enum class Coverage : std::uint8_t {
    kUnknown,   ///< the header is known, no word of the data
    kPartial,   ///< some words are known: not decoded, except strings and general as far as they go
    kComplete,  ///< decoded
  };
  std::uint16_t type = 0;        ///< without bit 15, which marks a vendor's own content
  bool vendor_flag = false;      ///< bit 15 of the type
  std::uint32_t first_word = 0;  ///< of the data
  std::uint16_t words = 0;
  Coverage coverage = Coverage::kUnknown;
  bool malformed = false;  ///< complete, but a record inside reaches past its end; what lies before it is decoded
};

/// Where the chain of categories stops.
enum class SiiChainEnd : std::uint8_t {
  kUnknownWord,  ///< a category header is unknown: the capture does not show what follows
  kEndMark,      ///< 0xFFFF: all categories were seen
  kBeyondImage,  ///< a length reaches past word 0xFFFF: damaged or not an SII
};

/// CoE details of the general category.
enum SiiCoeDetail : std::uint8_t {
  kSiiSdo = 0x01,
  kSiiSdoInfo = 0x02,
  kSiiPdoAssign = 0x04,
  kSiiPdoConfiguration = 0x08,
  kSiiUploadAtStart = 0x10,
  kSiiCompleteAccess = 0x20,
};

/// Category 30. Fields are unknown where only parts of it were read.
struct SiiGeneral {
  std::optional<std::uint8_t> group_string;  ///< numbers of strings, 0: none
  std::optional<std::uint8_t> image_string;
  std::optional<std::uint8_t> order_string;
  std::optional<std::uint8_t> name_string;
  std::optional<std::uint8_t> coe_details;  ///< SiiCoeDetail bits
  std::optional<std::uint8_t> foe_details;  ///< bit 0: FoE
  std::optional<std::uint8_t> eoe_details;  ///< bit 0: EoE
  std::optional<std::uint8_t> flags;  ///< bit 0 SAFEOP supported, 1 no LRW, 2 mailbox link layer, 3/4 identification
  std::optional<std::int16_t> ebus_current_ma;  ///< negative: feeds in
  std::optional<std::uint16_t> physical_ports;  ///< 4 bits a port: 0 none, 1 MII, 3 EBUS
  [[nodiscard]] bool Coe(SiiCoeDetail bit) const { return coe_details && (*coe_details & bit) != 0; }
  [[nodiscard]] bool no_lrw() const { return flags && (*flags & 0x02U) != 0; }
};

/// Category 40, one byte each.
enum class SiiFmmuUse : std::uint8_t { UNUSED = 0, OUTPUTS = 1, INPUTS = 2, MAILBOX_STATE = 3 };

/// Category 41, eight bytes each.
struct SiiSyncManager {
  std::uint16_t start = 0;
  std::uint16_t length = 0;
  std::uint8_t control = 0;  ///< as register 0x0804
  std::uint8_t status = 0;
  std::uint8_t enable = 0;  ///< bit 0 enable, 1 fixed content, 2 virtual, 3 in OP only
  std::uint8_t type = 0;    ///< 0 unused, 1 mailbox out, 2 mailbox in, 3 outputs, 4 inputs
  friend bool operator==(const SiiSyncManager&, const SiiSyncManager&) = default;
};

/// Categories 50 and 51.
struct SiiPdoEntry {
  std::uint16_t index = 0;  ///< 0: padding
  std::uint8_t subindex = 0;
  std::uint8_t name_string = 0;
  std::uint8_t data_type = 0;  ///< index of the data type object (0x0006 UNSIGNED16, ...)
  std::uint8_t bits = 0;
  std::uint16_t flags = 0;
};
struct SiiPdo {
  std::uint16_t index = 0;
  std::uint8_t sync_manager = 0;  ///< 0xFF: not assigned by default
  std::uint8_t synchronization = 0;
  std::uint8_t name_string = 0;
  std::uint16_t flags = 0;
  std::vector<SiiPdoEntry> entries;
  [[nodiscard]] std::uint32_t Bits() const;
};

/// Category 60, 24 bytes each: one operation mode.
struct SiiDcMode {
  std::uint32_t cycle0_ns = 0;
  std::uint32_t shift0_ns = 0;
  std::uint32_t shift1_ns = 0;
  std::int16_t sync1_cycle_factor = 0;
  std::uint16_t assign_activate = 0;
  std::int16_t sync0_cycle_factor = 0;
  std::uint8_t name_string = 0;
  std::uint8_t description_string = 0;
};

/// A category >= 0x0800, or one that has no meaning here (data types, sync units, ...).
struct SiiRawCategory {
  std::uint16_t type = 0;
  std::vector<std::uint8_t> bytes;
};

struct SiiContents {
  SiiHeader header;
  SiiChainEnd chain_end = SiiChainEnd::kUnknownWord;
  std::uint32_t chain_end_word = 0;  ///< where the unknown word, the end mark or the bad header stands
  std::vector<SiiCategory> categories;

  std::vector<std::string> strings;  ///< as stored; strings[0] is number 1. Only the leading ones when partly known
  std::optional<SiiGeneral> general;
  std::vector<SiiFmmuUse> fmmus;
  std::vector<SiiSyncManager> sync_managers;
  std::vector<SiiPdo> tx_pdos;
  std::vector<SiiPdo> rx_pdos;
  std::vector<SiiDcMode> dc_modes;
  std::vector<SiiRawCategory> raw;

  /// First category of that type in the chain; null when the chain does not show one (it may follow its end).
  [[nodiscard]] const SiiCategory* Find(SiiCategoryType type) const;
  /// True when everything of that type is known: the chain was seen to its end mark and each such category is complete.
  [[nodiscard]] bool Complete(SiiCategoryType type) const;
  /// String by number; "" for 0, and for a string that is unknown or missing.
  [[nodiscard]] std::string_view String(unsigned number) const;
  /// Name of the slave: the string the general category names; where that index is unknown the first string, which
  /// public masters show; "" when neither is known.
  [[nodiscard]] std::string_view Name() const;
  /// Text of a vendor category without trailing zeros and blanks, "" when unknown. Printable() it before showing.
  [[nodiscard]] std::string VendorText(std::uint16_t type) const;
};

enum class SiiDepth : std::uint8_t {
  kWhole,
  kChain,  ///< where categories lie, not what they hold: costs a read of each category's header
};

/// Reads what the known words of `image` show. Any content is accepted.
[[nodiscard]] SiiContents ParseSii(const SiiImage& image, SiiDepth depth = SiiDepth::kWhole);

}  // namespace ecaudit::esc
