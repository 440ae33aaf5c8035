#include "cli/stream/eeprom_lines.h"

#include <array>
#include <string_view>

#include <nlohmann/json.hpp>

#include "decoder/base/text.h"
#include "decoder/esc/sii.h"

namespace ecaudit::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kShownBytes = 24;
constexpr std::uint32_t kFirstCategory = 0x40;
constexpr FrameNo kIdleFrames = 64;  // masters ask several slaves in turn

void SetRaw(EventRow& row, std::string_view key, const Json& value) {
  row.json.Key(key) += value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

template <typename T>
Json NumberOrNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

std::string_view Name(esc::SiiChecksumState state) {
  switch (state) {
    case esc::SiiChecksumState::kUnknown:
      return "unknown";
    case esc::SiiChecksumState::kRight:
      return "right";
    case esc::SiiChecksumState::kWrong:
      return "wrong";
    case esc::SiiChecksumState::kDisabled:
      return "disabled";
  }
  return "unknown";
}

std::string_view SyncManagerUse(std::uint8_t type) {
  constexpr std::array<std::string_view, 5> kUses = {"unused", "mailbox out", "mailbox in", "outputs", "inputs"};
  return type < kUses.size() ? kUses[type] : "reserved";
}

std::string_view FmmuUse(esc::SiiFmmuUse use) {
  switch (use) {
    case esc::SiiFmmuUse::UNUSED:
      return "unused";
    case esc::SiiFmmuUse::OUTPUTS:
      return "outputs";
    case esc::SiiFmmuUse::INPUTS:
      return "inputs";
    case esc::SiiFmmuUse::MAILBOX_STATE:
      return "mailbox state";
  }
  return "unused";
}

Json MailboxJson(const std::optional<esc::SiiMailbox>& mailbox) {
  if (!mailbox) return nullptr;
  return {{"start", mailbox->offset}, {"length", mailbox->size}};
}

std::string MailboxText(std::string_view direction, const std::optional<esc::SiiMailbox>& mailbox) {
  if (!mailbox || mailbox->size == 0) return "";
  return std::string(direction) + " " + Hex(mailbox->offset) + " " + Count(mailbox->size, "byte");
}

Json PdosJson(const std::vector<esc::SiiPdo>& pdos, const esc::SiiContents& contents) {
  Json list = Json::array();
  for (const esc::SiiPdo& pdo : pdos) {
    Json entries = Json::array();
    for (const esc::SiiPdoEntry& entry : pdo.entries) {
      entries.push_back({{"index", entry.index},
                         {"subindex", entry.subindex},
                         {"bits", entry.bits},
                         {"name", Printable(contents.String(entry.name_string))}});
    }
    list.push_back({{"index", pdo.index},
                    {"sync_manager", pdo.sync_manager == 0xFF ? Json(nullptr) : Json(pdo.sync_manager)},
                    {"name", Printable(contents.String(pdo.name_string))},
                    {"bits", pdo.Bits()},
                    {"entries", std::move(entries)}});
  }
  return list;
}

std::string PdosText(std::string_view kind, const std::vector<esc::SiiPdo>& pdos) {
  if (pdos.empty()) return "";
  std::string text = std::string(kind) + " ";
  for (std::size_t i = 0; i < pdos.size(); ++i) {
    text += (i == 0 ? "" : " ") + ObjectName(pdos[i].index) + " (" + std::to_string(pdos[i].Bits()) + " bit)";
  }
  return text;
}

/// Comma-separated list; empty parts are left out.
void Add(std::string& text, const std::string& part, std::string_view separator = ", ") {
  if (!part.empty()) text.append(text.empty() ? "" : separator).append(part);
}

std::string ContentsText(const esc::SiiContents& contents) {
  const esc::SiiHeader& header = contents.header;
  std::string text;
  if (header.vendor_id) Add(text, "vendor " + Hex(*header.vendor_id, 8));
  if (header.product_code) Add(text, "product " + Hex(*header.product_code, 8));
  if (header.revision) Add(text, "revision " + Hex(*header.revision, 8));
  if (header.serial) Add(text, "serial " + std::to_string(*header.serial));
  if (!contents.Name().empty()) Add(text, "\"" + Printable(contents.Name()) + "\"");
  if (header.alias && *header.alias != 0) Add(text, "alias " + Hex(*header.alias));
  if (header.checksum_state != esc::SiiChecksumState::kUnknown) {
    Add(text, "checksum " + std::string(Name(header.checksum_state)));
  }
  std::string mailboxes = MailboxText("out", header.standard_receive);
  Add(mailboxes, MailboxText("in", header.standard_send));
  if (!mailboxes.empty()) Add(text, "mailboxes " + mailboxes, "; ");
  if (header.protocols && *header.protocols != 0) Add(text, esc::SiiProtocolNames(*header.protocols));
  for (std::size_t n = 0; n < contents.sync_managers.size(); ++n) {
    const esc::SiiSyncManager& sm = contents.sync_managers[n];
    Add(text,
        "SM" + std::to_string(n) + " " + Hex(sm.start) + " " + Count(sm.length, "byte") + " " +
            std::string(SyncManagerUse(sm.type)),
        n == 0 ? "; " : ", ");
  }
  Add(text, PdosText("RxPDO", contents.rx_pdos), "; ");
  Add(text, PdosText("TxPDO", contents.tx_pdos), "; ");
  return text;
}

/// Vendors keep texts in categories of their own.
Json VendorTexts(const esc::SiiContents& contents) {
  Json texts = Json::object();
  for (const esc::SiiRawCategory& raw : contents.raw) {
    if (raw.type < esc::kSiiVendorCategory) continue;
    const std::string text = contents.VendorText(raw.type);
    if (!text.empty()) texts[Hex(raw.type)] = Printable(text);
  }
  return texts;
}

std::string ErrorNames(std::uint16_t bits) {
  std::string text;
  if ((bits & track::kEepromChecksumError) != 0) Add(text, "checksum error");
  if ((bits & track::kEepromNotLoaded) != 0) Add(text, "configuration not loaded");
  if ((bits & track::kEepromNoAcknowledge) != 0) Add(text, "no acknowledge or invalid command");
  if ((bits & track::kEepromWriteEnable) != 0) Add(text, "write without enable");
  return text;
}

std::string WordRange(std::uint32_t first, std::size_t count) {
  return count == 1 ? "word " + Hex(first) : "words " + Hex(first) + "-" + Hex(first + count - 1);
}

}  // namespace

std::string EepromPartName(const esc::SiiImage& image, std::uint32_t first, std::uint32_t count) {
  struct Part {
    std::uint32_t first, end;
    std::string_view name;
  };
  constexpr std::array<Part, 7> kParts = {{{0x00, 0x08, "configuration"},
                                           {0x08, 0x10, "identity"},
                                           {0x10, 0x14, "delays"},
                                           {0x14, 0x18, "bootstrap mailboxes"},
                                           {0x18, 0x1C, "standard mailboxes"},
                                           {0x1C, 0x1D, "mailbox protocols"},
                                           {0x3E, 0x40, "size and version"}}};
  std::string text;
  const std::uint32_t end = first + count;
  for (const Part& part : kParts) {
    if (first < part.end && end > part.first) Add(text, std::string(part.name));
  }
  if (end <= kFirstCategory) return text;
  const esc::SiiContents contents = esc::ParseSii(image);
  for (const esc::SiiCategory& category : contents.categories) {
    const std::uint32_t header = category.first_word - 2;
    if (first < category.first_word + category.words && end > header) {
      const std::string name = esc::SiiCategoryName(category.type);
      Add(text, name.starts_with("category") ? name : "category " + name);
    }
  }
  if (contents.chain_end == esc::SiiChainEnd::kEndMark && first <= contents.chain_end_word &&
      end > contents.chain_end_word) {
    Add(text, "end of categories");
  }
  return text;
}

EepromLines::Slave& EepromLines::At(SlaveId slave) {
  while (slaves_.size() <= slave) slaves_.emplace_back();
  return slaves_[slave];
}

void EepromLines::On(const track::EepromRead& event) {
  Slave& slave = At(event.slave);
  slave.last_read = event.frame;
  FlushIdle(event.frame.number);
  const std::uint32_t end = slave.address + static_cast<std::uint32_t>(slave.bytes.size() / 2);
  // A master may ask for words that came along with the ones before.
  const bool continues = !slave.bytes.empty() && event.address >= slave.address && event.address <= end;
  if (!continues) {
    Flush(event.slave, slave);
    open_.push_back(event.slave);
    slave.first = event.command.seen() ? event.command : event.frame;
    slave.address = event.address;
  }
  slave.last = event.frame;
  for (std::size_t i = 0; i < event.words.size(); ++i) {
    const std::size_t at = 2 * (event.address - slave.address + i);
    if (at + 2 > slave.bytes.size()) slave.bytes.resize(at + 2);
    slave.bytes[at] = static_cast<std::uint8_t>(event.words[i] & 0xFFU);
    slave.bytes[at + 1] = static_cast<std::uint8_t>(event.words[i] >> 8U);
  }
}

void EepromLines::FlushIdle(FrameNo now) {
  for (std::size_t i = 0; i < open_.size();) {
    const SlaveId id = open_[i];
    if (slaves_[id].last.number + kIdleFrames < now) {
      Flush(id, slaves_[id]);  // takes it out of open_
    } else {
      ++i;
    }
  }
}

void EepromLines::Flush(SlaveId id, Slave& slave) {
  if (slave.bytes.empty()) return;
  std::erase(open_, id);
  if (output_.Wants(EventType::kEeprom, slave.last, id)) {
    const std::size_t words = slave.bytes.size() / 2;
    const std::string part =
        EepromPartName(output_.network().state(id).sii.image(), slave.address, static_cast<std::uint32_t>(words));
    EventRow row(output_, EventType::kEeprom, slave.last, id);
    row.json.Text("action", "read");
    row.json.Number("address", slave.address);
    row.json.Number("words", words);
    row.TextOrNull("part", part);
    row.json.Bytes("data", slave.bytes);
    row.Frame("first_frame", slave.first);
    row.text = "read " + WordRange(slave.address, words) + (part.empty() ? "" : ", " + part) + ": " +
               HexBytes(Slice(slave.bytes, 0, kShownBytes)) + (slave.bytes.size() > kShownBytes ? "..." : "");
  }
  slave.bytes.clear();
}

void EepromLines::On(const track::EepromWrite& event) {
  Slave& slave = At(event.slave);
  Flush(event.slave, slave);
  const FrameRef& frame = event.command.seen() ? event.command : event.frame;
  if (!output_.Wants(EventType::kEeprom, frame, event.slave)) return;
  EventRow row(output_, EventType::kEeprom, frame, event.slave);
  row.json.Text("action", "write");
  row.json.Number("address", event.address);
  row.json.Number("words", 1);
  const std::string part = event.address == 4
                               ? "station alias"
                               : EepromPartName(output_.network().state(event.slave).sii.image(), event.address, 1);
  row.TextOrNull("part", part);
  if (event.word) {
    const std::array<std::uint8_t, 2> bytes = {static_cast<std::uint8_t>(*event.word & 0xFFU),
                                               static_cast<std::uint8_t>(*event.word >> 8U)};
    row.json.Bytes("data", bytes);
  } else {
    row.json.Null("data");
  }
  row.NumberOrNull("value", event.word);
  row.json.Bool("confirmed", event.confirmed);
  row.Frame("confirmed_frame", event.frame);
  row.text = "write " + WordRange(event.address, 1) + (part.empty() ? "" : ", " + part) + ": " +
             (event.word ? Hex(*event.word) : "value not captured");
  if (!event.confirmed) row.Note("end not seen");
}

void EepromLines::On(const track::EepromError& event) {
  Slave& slave = At(event.slave);
  Flush(event.slave, slave);
  if (!output_.Wants(EventType::kEeprom, event.frame, event.slave)) return;
  EventRow row(output_, EventType::kEeprom, event.frame, event.slave);
  row.json.Text("action", "error");
  row.NumberOrNull("address", event.address);
  row.json.Number("error_bits", event.bits);
  row.json.Text("error", ErrorNames(event.bits));
  row.Frame("command_frame", event.command);
  row.text = ErrorNames(event.bits) + (event.address ? ", " + WordRange(*event.address, 1) : "");
  row.style = report::Style::kWarning;
}

void EepromLines::WriteContents(SlaveId id, Slave& slave) {
  if (!slave.last_read.seen()) return;
  const esc::SiiImage& image = output_.network().state(id).sii.image();
  const std::uint32_t known = image.KnownWords();
  if (known == slave.shown_words) return;  // read again what had been read
  slave.shown_words = known;
  if (!output_.Wants(EventType::kEeprom, slave.last_read, id)) return;
  const esc::SiiContents contents = esc::ParseSii(image);
  const esc::SiiHeader& header = contents.header;
  EventRow row(output_, EventType::kEeprom, slave.last_read, id);
  row.json.Text("action", "contents");
  row.json.Number("known_words", known);
  row.json.Bool("complete", contents.chain_end == esc::SiiChainEnd::kEndMark);
  SetRaw(row, "identity",
         {{"vendor_id", NumberOrNull(header.vendor_id)},
          {"product_code", NumberOrNull(header.product_code)},
          {"revision", NumberOrNull(header.revision)},
          {"serial", NumberOrNull(header.serial)}});
  row.TextOrNull("name", contents.Name());
  row.TextOrNull("order", contents.general && contents.general->order_string
                              ? contents.String(*contents.general->order_string)
                              : std::string_view());
  row.NumberOrNull("alias", header.alias);
  row.json.Text("checksum", Name(header.checksum_state));
  SetRaw(row, "mailboxes",
         {{"out", MailboxJson(header.standard_receive)},
          {"in", MailboxJson(header.standard_send)},
          {"bootstrap_out", MailboxJson(header.bootstrap_receive)},
          {"bootstrap_in", MailboxJson(header.bootstrap_send)}});
  row.NumberOrNull("protocols", header.protocols);
  row.NumberOrNull("size_bytes", header.size_bytes);
  Json categories = Json::array();
  for (const esc::SiiCategory& category : contents.categories) {
    categories.push_back({{"type", category.type},
                          {"name", esc::SiiCategoryName(category.type)},
                          {"address", category.first_word},
                          {"words", category.words},
                          {"complete", category.coverage == esc::SiiCategory::Coverage::kComplete},
                          {"malformed", category.malformed}});
  }
  SetRaw(row, "categories", categories);
  Json sync_managers = Json::array();
  for (const esc::SiiSyncManager& sm : contents.sync_managers) {
    sync_managers.push_back({{"start", sm.start},
                             {"length", sm.length},
                             {"control", sm.control},
                             {"enable", sm.enable},
                             {"use", SyncManagerUse(sm.type)}});
  }
  SetRaw(row, "sync_managers", sync_managers);
  Json fmmus = Json::array();
  for (const esc::SiiFmmuUse use : contents.fmmus) fmmus.push_back(FmmuUse(use));
  SetRaw(row, "fmmus", fmmus);
  SetRaw(row, "rx_pdos", PdosJson(contents.rx_pdos, contents));
  SetRaw(row, "tx_pdos", PdosJson(contents.tx_pdos, contents));
  SetRaw(row, "vendor_texts", VendorTexts(contents));
  row.text = "contents as far as read, " + Count(known, "different word") + ": " + ContentsText(contents);
  if (header.checksum_state == esc::SiiChecksumState::kWrong) row.style = report::Style::kWarning;
}

void EepromLines::Pause(SlaveId slave) {
  if (slave >= slaves_.size()) return;
  Flush(slave, slaves_[slave]);
  WriteContents(slave, slaves_[slave]);
}

void EepromLines::End() {
  for (std::size_t i = 0; i < slaves_.size(); ++i) Pause(static_cast<SlaveId>(i));
}

}  // namespace ecaudit::cli
