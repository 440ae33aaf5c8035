#include "decoder/esc/sii.h"

#include <algorithm>

#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::esc {
namespace {

constexpr std::uint32_t kFirstCategory = 0x40;
constexpr std::uint16_t kChecksumDisabled = 0x88A4;
constexpr std::size_t kPdoRecord = 8;  // header and entry alike
constexpr std::size_t kDcRecord = 24;

SiiHeader ParseHeader(const SiiImage& image) {
  const auto mailbox = [&image](std::uint32_t word) -> std::optional<SiiMailbox> {
    const auto offset = image.Word(word);
    const auto size = image.Word(word + 1);
    if (!offset || !size) return std::nullopt;
    return SiiMailbox{*offset, *size};
  };
  SiiHeader header;
  header.pdi_control = image.Word(0);
  header.pdi_configuration = image.Word(1);
  header.sync_pulse_10ns = image.Word(2);
  header.pdi_configuration_2 = image.Word(3);
  header.alias = image.Word(4);
  header.checksum = image.Word(7);
  header.vendor_id = image.DoubleWord(0x08);
  header.product_code = image.DoubleWord(0x0A);
  header.revision = image.DoubleWord(0x0C);
  header.serial = image.DoubleWord(0x0E);
  header.bootstrap_receive = mailbox(0x14);
  header.bootstrap_send = mailbox(0x16);
  header.standard_receive = mailbox(0x18);
  header.standard_send = mailbox(0x1A);
  header.protocols = image.Word(0x1C);
  if (const auto kbit = image.Word(0x3E)) header.size_bytes = (std::uint32_t{*kbit} + 1) * 128;
  header.version = image.Word(0x3F);

  const auto checked = image.Bytes(0, 7);
  if (checked && header.checksum) {
    if (*header.checksum == kChecksumDisabled) {
      header.checksum_state = SiiChecksumState::kDisabled;
    } else {
      const bool right = SiiChecksum(*checked) == (*header.checksum & 0xFFU);
      header.checksum_state = right ? SiiChecksumState::kRight : SiiChecksumState::kWrong;
    }
  }
  return header;
}

/// One byte of a category; the image is asked because general and strings are read as far as they are known.
std::optional<std::uint8_t> ByteOf(const SiiImage& image, const SiiCategory& category, std::size_t offset) {
  if (offset >= std::size_t{category.words} * 2) return std::nullopt;
  const auto word = image.Word(category.first_word + static_cast<std::uint32_t>(offset / 2));
  if (!word) return std::nullopt;
  return static_cast<std::uint8_t>(offset % 2 == 0 ? *word & 0xFFU : *word >> 8U);
}

std::optional<std::uint16_t> WordOf(const SiiImage& image, const SiiCategory& category, std::uint32_t offset) {
  if (offset >= category.words) return std::nullopt;
  return image.Word(category.first_word + offset);
}

void ParseStrings(const SiiImage& image, SiiCategory& category, std::vector<std::string>& strings) {
  const auto count = ByteOf(image, category, 0);
  if (!count) return;
  std::size_t at = 1;
  for (unsigned i = 0; i < *count; ++i) {
    const auto length = ByteOf(image, category, at);
    std::string text;
    for (std::size_t k = 0; length && k < *length; ++k) {
      const auto byte = ByteOf(image, category, at + 1 + k);
      if (!byte) break;
      text.push_back(static_cast<char>(*byte));
    }
    if (!length || text.size() != *length) {
      category.malformed = category.coverage == SiiCategory::Coverage::kComplete;
      return;
    }
    at += 1 + text.size();
    strings.push_back(std::move(text));
  }
}

SiiGeneral ParseGeneral(const SiiImage& image, const SiiCategory& category) {
  SiiGeneral general;
  general.group_string = ByteOf(image, category, 0);
  general.image_string = ByteOf(image, category, 1);
  general.order_string = ByteOf(image, category, 2);
  general.name_string = ByteOf(image, category, 3);
  general.coe_details = ByteOf(image, category, 5);
  general.foe_details = ByteOf(image, category, 6);
  general.eoe_details = ByteOf(image, category, 7);
  general.flags = ByteOf(image, category, 0x0B);
  if (const auto current = WordOf(image, category, 6)) general.ebus_current_ma = static_cast<std::int16_t>(*current);
  general.physical_ports = WordOf(image, category, 8);
  return general;
}

bool ParsePdos(ByteSpan bytes, std::vector<SiiPdo>& pdos) {
  std::size_t at = 0;
  while (Fits(bytes, at, kPdoRecord)) {
    SiiPdo pdo;
    pdo.index = LittleEndian<std::uint16_t>(bytes, at);
    const std::size_t entries = bytes[at + 2];
    pdo.sync_manager = bytes[at + 3];
    pdo.synchronization = bytes[at + 4];
    pdo.name_string = bytes[at + 5];
    pdo.flags = LittleEndian<std::uint16_t>(bytes, at + 6);
    at += kPdoRecord;
    if (!Fits(bytes, at, entries * kPdoRecord)) return false;
    pdo.entries.reserve(entries);
    for (std::size_t i = 0; i < entries; ++i, at += kPdoRecord) {
      pdo.entries.push_back({LittleEndian<std::uint16_t>(bytes, at), bytes[at + 2], bytes[at + 3], bytes[at + 4],
                             bytes[at + 5], LittleEndian<std::uint16_t>(bytes, at + 6)});
    }
    pdos.push_back(std::move(pdo));
  }
  return at == bytes.size();
}

bool ParseSyncManagers(ByteSpan bytes, std::vector<SiiSyncManager>& sync_managers) {
  for (std::size_t at = 0; Fits(bytes, at, 8); at += 8) {
    sync_managers.push_back({LittleEndian<std::uint16_t>(bytes, at), LittleEndian<std::uint16_t>(bytes, at + 2),
                             bytes[at + 4], bytes[at + 5], bytes[at + 6], bytes[at + 7]});
  }
  return bytes.size() % 8 == 0;
}

bool ParseDcModes(ByteSpan bytes, std::vector<SiiDcMode>& modes) {
  for (std::size_t at = 0; Fits(bytes, at, kDcRecord); at += kDcRecord) {
    SiiDcMode mode;
    mode.cycle0_ns = LittleEndian<std::uint32_t>(bytes, at);
    mode.shift0_ns = LittleEndian<std::uint32_t>(bytes, at + 4);
    mode.shift1_ns = LittleEndian<std::uint32_t>(bytes, at + 8);
    mode.sync1_cycle_factor = static_cast<std::int16_t>(LittleEndian<std::uint16_t>(bytes, at + 12));
    mode.assign_activate = LittleEndian<std::uint16_t>(bytes, at + 14);
    mode.sync0_cycle_factor = static_cast<std::int16_t>(LittleEndian<std::uint16_t>(bytes, at + 16));
    mode.name_string = bytes[at + 18];
    mode.description_string = bytes[at + 19];
    modes.push_back(mode);
  }
  return bytes.size() % kDcRecord == 0;
}

void ParseCategory(const SiiImage& image, SiiCategory& category, SiiContents& contents) {
  const auto type = static_cast<SiiCategoryType>(category.type);
  if (type == SiiCategoryType::STRINGS) {
    // String numbers continue over several such categories only if the earlier ones are known to their ends.
    const bool counted = std::ranges::all_of(contents.categories, [](const SiiCategory& c) {
      return c.type != static_cast<std::uint16_t>(SiiCategoryType::STRINGS) ||
             (c.coverage == SiiCategory::Coverage::kComplete && !c.malformed);
    });
    if (counted) ParseStrings(image, category, contents.strings);
    return;
  }
  if (type == SiiCategoryType::GENERAL) {
    if (!contents.general) contents.general = ParseGeneral(image, category);
    return;
  }
  const auto bytes = image.Bytes(category.first_word, category.words);
  if (!bytes) return;
  switch (type) {
    case SiiCategoryType::FMMU:
      for (const std::uint8_t use : *bytes) contents.fmmus.push_back(static_cast<SiiFmmuUse>(use));
      return;
    case SiiCategoryType::SYNC_MANAGER:
      category.malformed = !ParseSyncManagers(*bytes, contents.sync_managers);
      return;
    case SiiCategoryType::TX_PDO:
      category.malformed = !ParsePdos(*bytes, contents.tx_pdos);
      return;
    case SiiCategoryType::RX_PDO:
      category.malformed = !ParsePdos(*bytes, contents.rx_pdos);
      return;
    case SiiCategoryType::DC:
      category.malformed = !ParseDcModes(*bytes, contents.dc_modes);
      return;
    default:
      contents.raw.push_back({category.type, *bytes});
      return;
  }
}

}  // namespace

SiiImage::SiiImage(const SiiImage& other) {
  *this = other;
}

SiiImage& SiiImage::operator=(const SiiImage& other) {
  if (this == &other) return *this;
  pages_.clear();
  pages_.reserve(other.pages_.size());
  for (const auto& page : other.pages_) pages_.push_back(page ? std::make_unique<Page>(*page) : nullptr);
  return *this;
}

SiiImage SiiImage::FromBytes(ByteSpan bytes) {
  SiiImage image;
  for (std::size_t at = 0; Fits(bytes, at, 2) && at / 2 < kWords; at += 2) {
    image.Set(static_cast<std::uint32_t>(at / 2), LittleEndian<std::uint16_t>(bytes, at));
  }
  return image;
}

SiiImage::Change SiiImage::Set(std::uint32_t word, std::uint16_t value) {
  if (word >= kWords) return Change::kNone;
  const std::size_t index = word / kPageWords;
  if (index >= pages_.size()) pages_.resize(index + 1);
  auto& page = pages_[index];
  if (!page) page = std::make_unique<Page>();
  const std::size_t at = word % kPageWords;
  const bool known = page->known[at];
  const bool same = known && page->words[at] == value;
  page->known[at] = true;
  page->words[at] = value;
  if (!known) return Change::kLearned;
  return same ? Change::kNone : Change::kReplaced;
}

void SiiImage::Forget(std::uint32_t word) {
  const std::size_t index = word / kPageWords;
  if (index < pages_.size() && pages_[index]) pages_[index]->known[word % kPageWords] = false;
}

const SiiImage::Page* SiiImage::FindPage(std::uint32_t word) const {
  const std::size_t index = word / kPageWords;
  return index < pages_.size() ? pages_[index].get() : nullptr;
}

std::optional<std::uint16_t> SiiImage::Word(std::uint32_t word) const {
  const Page* page = FindPage(word);
  if (page == nullptr || !page->known[word % kPageWords]) return std::nullopt;
  return page->words[word % kPageWords];
}

std::optional<std::uint32_t> SiiImage::DoubleWord(std::uint32_t word) const {
  if (word >= kWords - 1) return std::nullopt;
  const auto low = Word(word);
  const auto high = Word(word + 1);
  if (!low || !high) return std::nullopt;
  return std::uint32_t{*high} << 16U | *low;
}

std::uint32_t SiiImage::KnownWords() const {
  std::size_t known = 0;
  for (const auto& page : pages_) known += page ? page->known.count() : 0;
  return static_cast<std::uint32_t>(known);
}

std::uint32_t SiiImage::KnownWords(std::uint32_t first, std::uint32_t count) const {
  if (first >= kWords) return 0;
  const std::uint32_t end = first + std::min(count, kWords - first);
  std::uint32_t known = 0;
  for (std::uint32_t word = first; word < end; ++word) known += Word(word).has_value() ? 1 : 0;
  return known;
}

std::optional<std::vector<std::uint8_t>> SiiImage::Bytes(std::uint32_t first, std::uint32_t count) const {
  if (first > kWords || count > kWords - first || KnownWords(first, count) != count) return std::nullopt;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(std::size_t{count} * 2);
  for (std::uint32_t word = first; word < first + count; ++word) {
    const std::uint16_t value = Word(word).value_or(0);
    bytes.push_back(static_cast<std::uint8_t>(value & 0xFFU));
    bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
  }
  return bytes;
}

std::uint8_t SiiChecksum(ByteSpan bytes) {
  unsigned crc = 0xFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x80U) != 0 ? (crc << 1U ^ 0x07U) & 0xFFU : crc << 1U;
  }
  return static_cast<std::uint8_t>(crc);
}

std::string SiiProtocolNames(std::uint16_t protocols) {
  constexpr std::array<std::string_view, 6> kNames = {"AoE", "EoE", "CoE", "FoE", "SoE", "VoE"};
  if (protocols == 0) return "none";
  std::string text;
  const auto append = [&text](std::string_view name) {
    if (!text.empty()) text += ", ";
    text += name;
  };
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if ((protocols >> i & 1U) != 0) append(kNames[i]);
  }
  const auto rest = static_cast<std::uint16_t>(protocols & ~0x3FU);
  if (rest != 0) append(Hex(rest));
  return text;
}

std::string SiiCategoryName(std::uint16_t type) {
  static constexpr Named<SiiCategoryType> kNames[] = {
      {SiiCategoryType::NOP, "no content"},
      {SiiCategoryType::STRINGS, "strings"},
      {SiiCategoryType::DATA_TYPES, "data types"},
      {SiiCategoryType::GENERAL, "general"},
      {SiiCategoryType::FMMU, "FMMU"},
      {SiiCategoryType::SYNC_MANAGER, "sync managers"},
      {SiiCategoryType::FMMU_EXTENDED, "extended FMMU"},
      {SiiCategoryType::SYNC_UNIT, "sync units"},
      {SiiCategoryType::TX_PDO, "TxPDO"},
      {SiiCategoryType::RX_PDO, "RxPDO"},
      {SiiCategoryType::DC, "DC"},
      {SiiCategoryType::END, "end"},
  };
  const std::string_view name = NameIn(kNames, static_cast<SiiCategoryType>(type));
  if (!name.empty()) return std::string(name);
  return type >= kSiiVendorCategory ? "vendor " + Hex(type) : "category " + std::to_string(type);
}

std::uint32_t SiiPdo::Bits() const {
  std::uint32_t bits = 0;
  for (const SiiPdoEntry& entry : entries) bits += entry.bits;
  return bits;
}

const SiiCategory* SiiContents::Find(SiiCategoryType type) const {
  for (const SiiCategory& category : categories) {
    if (category.type == static_cast<std::uint16_t>(type)) return &category;
  }
  return nullptr;
}

bool SiiContents::Complete(SiiCategoryType type) const {
  return chain_end == SiiChainEnd::kEndMark && std::ranges::all_of(categories, [type](const SiiCategory& category) {
           return category.type != static_cast<std::uint16_t>(type) ||
                  category.coverage == SiiCategory::Coverage::kComplete;
         });
}

std::string_view SiiContents::String(unsigned number) const {
  return number == 0 || number > strings.size() ? std::string_view{} : std::string_view(strings[number - 1]);
}

std::string_view SiiContents::Name() const {
  return String(general && general->name_string ? *general->name_string : 1);
}

std::string SiiContents::VendorText(std::uint16_t type) const {
  for (const SiiRawCategory& category : raw) {
    if (category.type != type) continue;
    std::string text(category.bytes.begin(), category.bytes.end());
    while (!text.empty() && (text.back() == '\0' || text.back() == ' ')) text.pop_back();
    return text;
  }
  return {};
}

SiiContents ParseSii(const SiiImage& image, SiiDepth depth) {
  SiiContents contents;
  if (depth == SiiDepth::kWhole) contents.header = ParseHeader(image);
  std::uint32_t word = kFirstCategory;
  while (true) {
    contents.chain_end_word = word;
    const auto type = image.Word(word);
    if (type == static_cast<std::uint16_t>(SiiCategoryType::END)) {
      contents.chain_end = SiiChainEnd::kEndMark;
      break;
    }
    const auto words = image.Word(word + 1);
    if (!type || !words) {
      contents.chain_end = word + 1 >= SiiImage::kWords ? SiiChainEnd::kBeyondImage : SiiChainEnd::kUnknownWord;
      break;
    }
    SiiCategory category;
    category.type = *type & 0x7FFFU;
    category.vendor_flag = (*type & 0x8000U) != 0;
    category.first_word = word + 2;
    category.words = *words;
    if (category.first_word + category.words > SiiImage::kWords) {
      contents.chain_end = SiiChainEnd::kBeyondImage;
      break;
    }
    word = category.first_word + category.words;
    if (category.type == static_cast<std::uint16_t>(SiiCategoryType::NOP))
      continue;  // an erased EEPROM has 32 Ki of them
    if (depth == SiiDepth::kChain) {
      contents.categories.push_back(category);
      continue;
    }
    const std::uint32_t known = image.KnownWords(category.first_word, category.words);
    if (known == category.words) {
      category.coverage = SiiCategory::Coverage::kComplete;
    } else if (known != 0) {
      category.coverage = SiiCategory::Coverage::kPartial;
    }
    ParseCategory(image, category, contents);
    contents.categories.push_back(category);
  }
  return contents;
}

namespace {

/// The words before the categories: what each is, and the part it belongs to.
struct SiiPart {
  std::uint32_t first, end;
  std::string_view name;
  std::string_view part;
};
constexpr std::array<SiiPart, 17> kSiiParts = {{{0x00, 0x01, "PDI control", "configuration"},
                                                {0x01, 0x02, "PDI configuration", "configuration"},
                                                {0x02, 0x03, "length of the SYNC pulse", "configuration"},
                                                {0x03, 0x04, "PDI configuration 2", "configuration"},
                                                {0x04, 0x05, "station alias", "configuration"},
                                                {0x05, 0x07, "reserved configuration", "configuration"},
                                                {0x07, 0x08, "checksum of the configuration", "configuration"},
                                                {0x08, 0x0A, "vendor id", "identity"},
                                                {0x0A, 0x0C, "product code", "identity"},
                                                {0x0C, 0x0E, "revision", "identity"},
                                                {0x0E, 0x10, "serial number", "identity"},
                                                {0x10, 0x14, "delays", "delays"},
                                                {0x14, 0x18, "bootstrap mailboxes", "bootstrap mailboxes"},
                                                {0x18, 0x1C, "standard mailboxes", "standard mailboxes"},
                                                {0x1C, 0x1D, "mailbox protocols", "mailbox protocols"},
                                                {0x3E, 0x3F, "size", "size and version"},
                                                {0x3F, 0x40, "version", "size and version"}}};

std::string CategoryText(std::uint16_t type) {
  const std::string name = SiiCategoryName(type);
  return name.starts_with("category") ? name : "category " + name;
}

}  // namespace

std::string SiiWordName(const SiiImage& image, std::uint32_t word) {
  for (const SiiPart& part : kSiiParts) {
    if (word >= part.first && word < part.end) return std::string(part.name);
  }
  if (word < kFirstCategory) return "reserved";
  for (const SiiCategory& category : ParseSii(image, SiiDepth::kChain).categories) {
    if (word + 2 >= category.first_word && word < category.first_word + category.words) {
      return CategoryText(category.type);
    }
  }
  return {};
}

std::string SiiPartNames(const SiiImage& image, std::uint32_t first, std::uint32_t count) {
  const std::uint32_t end = first + count;
  std::string text;
  const auto add = [&text](std::string_view part) { text.append(text.empty() ? "" : ", ").append(part); };
  std::string_view before;
  for (const SiiPart& part : kSiiParts) {
    if (first >= part.end || end <= part.first || part.part == before) continue;
    add(before = part.part);
  }
  if (end <= kFirstCategory) return text;
  const SiiContents contents = ParseSii(image, SiiDepth::kChain);
  for (const SiiCategory& category : contents.categories) {
    if (first < category.first_word + category.words && end > category.first_word - 2) add(CategoryText(category.type));
  }
  if (contents.chain_end == SiiChainEnd::kEndMark && first <= contents.chain_end_word &&
      end > contents.chain_end_word) {
    add("end of categories");
  }
  return text;
}

}  // namespace ecaudit::esc
