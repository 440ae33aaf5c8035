#include "cli/stream/eeprom_lines.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "cli/report/json_text.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"
#include "decoder/esc/sii.h"

namespace ecaudit::cli {
namespace {

using report::JsonArray;
using report::JsonObject;
using report::JsonText;
using report::OnlyIf;

constexpr std::size_t kShownBytes = 24;
constexpr FrameNo kIdleFrames = 64;          // masters ask several slaves in turn
constexpr std::uint32_t kAlwaysShown = 512;  // words: the EEPROM of nearly every device

/// The member `key`, an object that `write(JsonObject&)` fills.
template <typename Write>
void PutObject(EventRow& row, std::string_view key, Write&& write) {
  JsonText text(JsonText::Layout::kLine);
  text.Object(write);
  row.fields.Json(key) += text.Take();
}

/// The member `key`, an array with an object for each of `items`, which `write(JsonObject&, item)` fills.
template <typename Range, typename Write>
void PutList(EventRow& row, std::string_view key, const Range& items, Write&& write) {
  JsonText text(JsonText::Layout::kLine);
  text.Array([&](JsonArray& array) {
    for (const auto& item : items) array.AddObject([&](JsonObject& object) { write(object, item); });
  });
  row.fields.Json(key) += text.Take();
}

std::string_view Name(esc::SiiChecksumState state) {
  static constexpr Named<esc::SiiChecksumState> kNames[] = {
      {esc::SiiChecksumState::kUnknown, "unknown"},
      {esc::SiiChecksumState::kRight, "right"},
      {esc::SiiChecksumState::kWrong, "wrong"},
      {esc::SiiChecksumState::kDisabled, "disabled"},
  };
  static_assert(NamesAll(kNames, esc::SiiChecksumState::kDisabled));
  return NameIn(kNames, state);
}

std::string_view SyncManagerUse(std::uint8_t type) {
  constexpr std::array<std::string_view, 5> kUses = {"unused", "mailbox out", "mailbox in", "outputs", "inputs"};
  return type < kUses.size() ? kUses[type] : "reserved";
}

std::string_view FmmuUse(esc::SiiFmmuUse use) {
  static constexpr Named<esc::SiiFmmuUse> kNames[] = {
      {esc::SiiFmmuUse::UNUSED, "unused"},
      {esc::SiiFmmuUse::OUTPUTS, "outputs"},
      {esc::SiiFmmuUse::INPUTS, "inputs"},
      {esc::SiiFmmuUse::MAILBOX_STATE, "mailbox state"},
  };
  const std::string_view name = NameIn(kNames, use);
  return !name.empty() ? name : "unused";
}

void PutIdentity(JsonObject& out, const esc::SiiHeader& header) {
  out.Put("vendor_id", header.vendor_id);
  out.Put("product_code", header.product_code);
  out.Put("revision", header.revision);
  out.Put("serial", header.serial);
}

void PutMailbox(JsonObject& out, const esc::SiiMailbox& mailbox) {
  out.Put("start", mailbox.offset);
  out.Put("length", mailbox.size);
}

void PutMailboxes(JsonObject& out, const esc::SiiHeader& header) {
  out.ObjectOrNull("out", header.standard_receive, PutMailbox);
  out.ObjectOrNull("in", header.standard_send, PutMailbox);
  out.ObjectOrNull("bootstrap_out", header.bootstrap_receive, PutMailbox);
  out.ObjectOrNull("bootstrap_in", header.bootstrap_send, PutMailbox);
}

void PutCategory(JsonObject& out, const esc::SiiCategory& category) {
  out.Put("type", category.type);
  out.Put("name", esc::SiiCategoryName(category.type));
  out.Put("address", category.first_word);
  out.Put("words", category.words);
  out.Put("complete", category.coverage == esc::SiiCategory::Coverage::kComplete);
  out.Put("malformed", category.malformed);
}

void PutSyncManager(JsonObject& out, const esc::SiiSyncManager& sm) {
  out.Put("start", sm.start);
  out.Put("length", sm.length);
  out.Put("control", sm.control);
  out.Put("enable", sm.enable);
  out.Put("use", SyncManagerUse(sm.type));
}

std::string MailboxText(std::string_view direction, const std::optional<esc::SiiMailbox>& mailbox) {
  if (!mailbox || mailbox->size == 0) return "";
  return std::string(direction) + " " + Hex(mailbox->offset) + " " + Count(mailbox->size, "byte");
}

void PutPdo(JsonObject& out, const esc::SiiPdo& pdo, const esc::SiiContents& contents) {
  out.Put("index", pdo.index);
  out.Put("sync_manager", OnlyIf(pdo.sync_manager != 0xFF, pdo.sync_manager));
  out.Put("name", Printable(contents.String(pdo.name_string)));
  out.Put("bits", pdo.Bits());
  out.List("entries", pdo.entries, [&](JsonObject& json, const esc::SiiPdoEntry& entry) {
    json.Put("index", entry.index);
    json.Put("subindex", entry.subindex);
    json.Put("bits", entry.bits);
    json.Put("name", Printable(contents.String(entry.name_string)));
  });
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
void PutVendorTexts(JsonObject& out, const esc::SiiContents& contents) {
  std::vector<std::uint16_t> shown;  // a category may appear twice; its text is one
  for (const esc::SiiRawCategory& raw : contents.raw) {
    if (raw.type < esc::kSiiVendorCategory || std::ranges::find(shown, raw.type) != shown.end()) continue;
    shown.push_back(raw.type);
    const std::string text = contents.VendorText(raw.type);
    if (!text.empty()) out.Put(Hex(raw.type), Printable(text));
  }
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
        esc::SiiPartNames(output_.network().state(id).sii.image(), slave.address, static_cast<std::uint32_t>(words));
    EventRow row(output_, EventType::kEeprom, slave.last, id);
    row.fields.Text("action", "read");
    row.fields.Number("address", slave.address);
    row.fields.Number("words", words);
    row.TextOrNull("part", part);
    row.fields.Bytes("data", slave.bytes);
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
  row.fields.Text("action", "write");
  row.fields.Number("address", event.address);
  row.fields.Number("words", 1);
  const std::string part = event.address == 4
                               ? "station alias"
                               : esc::SiiPartNames(output_.network().state(event.slave).sii.image(), event.address, 1);
  row.TextOrNull("part", part);
  if (event.word) {
    const std::array<std::uint8_t, 2> bytes = {static_cast<std::uint8_t>(*event.word & 0xFFU),
                                               static_cast<std::uint8_t>(*event.word >> 8U)};
    row.fields.Bytes("data", bytes);
  } else {
    row.fields.Null("data");
  }
  row.NumberOrNull("value", event.word);
  row.fields.Bool("confirmed", event.confirmed);
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
  row.fields.Text("action", "error");
  row.NumberOrNull("address", event.address);
  row.fields.Number("error_bits", event.bits);
  row.fields.Text("error", ErrorNames(event.bits));
  row.Frame("command_frame", event.command);
  row.text = ErrorNames(event.bits) + (event.address ? ", " + WordRange(*event.address, 1) : "");
  row.style = report::Style::kWarning;
}

void EepromLines::WriteContents(SlaveId id, Slave& slave, bool at_end) {
  if (!slave.last_read.seen()) return;
  const esc::SiiImage& image = output_.network().state(id).sii.image();
  const std::uint32_t known = image.KnownWords();
  if (known == slave.shown_words) return;  // read again what had been read
  // A master that turns away after every few words would have all that went before reported again each time.
  if (!at_end && known > kAlwaysShown && known < slave.shown_words + slave.shown_words / 8) return;
  slave.shown_words = known;
  if (!output_.Wants(EventType::kEeprom, slave.last_read, id)) return;
  const esc::SiiContents contents = esc::ParseSii(image);
  const esc::SiiHeader& header = contents.header;
  EventRow row(output_, EventType::kEeprom, slave.last_read, id);
  row.fields.Text("action", "contents");
  row.fields.Number("known_words", known);
  row.fields.Bool("complete", contents.chain_end == esc::SiiChainEnd::kEndMark);
  PutObject(row, "identity", [&](JsonObject& json) { PutIdentity(json, header); });
  row.TextOrNull("name", contents.Name());
  row.TextOrNull("order", contents.general && contents.general->order_string
                              ? contents.String(*contents.general->order_string)
                              : std::string_view());
  row.NumberOrNull("alias", header.alias);
  row.fields.Text("checksum", Name(header.checksum_state));
  PutObject(row, "mailboxes", [&](JsonObject& json) { PutMailboxes(json, header); });
  row.NumberOrNull("protocols", header.protocols);
  row.NumberOrNull("size_bytes", header.size_bytes);
  PutList(row, "categories", contents.categories, PutCategory);
  PutList(row, "sync_managers", contents.sync_managers, PutSyncManager);
  JsonText fmmus(JsonText::Layout::kLine);
  fmmus.Array([&](JsonArray& uses) {
    for (const esc::SiiFmmuUse use : contents.fmmus) uses.Add(FmmuUse(use));
  });
  row.fields.Json("fmmus") += fmmus.Take();
  const auto put_pdo = [&](JsonObject& json, const esc::SiiPdo& pdo) { PutPdo(json, pdo, contents); };
  PutList(row, "rx_pdos", contents.rx_pdos, put_pdo);
  PutList(row, "tx_pdos", contents.tx_pdos, put_pdo);
  PutObject(row, "vendor_texts", [&](JsonObject& json) { PutVendorTexts(json, contents); });
  row.text = "contents as far as read, " + Count(known, "different word") + ": " + ContentsText(contents);
  if (header.checksum_state == esc::SiiChecksumState::kWrong) row.style = report::Style::kWarning;
}

void EepromLines::Pause(SlaveId slave) {
  if (slave >= slaves_.size()) return;
  Flush(slave, slaves_[slave]);
  WriteContents(slave, slaves_[slave], false);
}

void EepromLines::End() {
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    const auto slave = static_cast<SlaveId>(i);
    Flush(slave, slaves_[i]);
    WriteContents(slave, slaves_[i], true);
  }
}

}  // namespace ecaudit::cli
