/// Shared by the mailbox tests: byte strings, reference tables, messages and a sink that keeps what it is given.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/wiring/event_bus.h"
#include "decoder/mailbox/coe.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/header.h"
#include "tests/support/folders.h"

namespace ecaudit::mailbox {

using Bytes = std::vector<std::uint8_t>;

/// "0a 00 1f" or "0a001f" to bytes.
inline Bytes FromHex(std::string_view text) {
  Bytes bytes;
  int high = -1;
  for (const char c : text) {
    if (c == ' ' || c == '|') continue;
    const int digit = c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10;
    if (high < 0) {
      high = digit;
    } else {
      bytes.push_back(static_cast<std::uint8_t>(high * 16 + digit));
      high = -1;
    }
  }
  return bytes;
}

inline std::string Text(ByteSpan bytes) {
  return {bytes.begin(), bytes.end()};
}
inline Bytes Copy(ByteSpan bytes) {
  return {bytes.begin(), bytes.end()};
}

/// Rows of a reference table by column name; empty when the table is absent.
inline std::vector<std::map<std::string, std::string>> ReadTable(const std::string& name) {
  std::ifstream file(test::SharedDir() + "/reference/" + name);
  std::vector<std::map<std::string, std::string>> rows;
  std::vector<std::string> columns;
  std::string line;
  while (std::getline(file, line)) {
    std::vector<std::string> fields(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') {
        quoted = !quoted;
      } else if (c == ',' && !quoted) {
        fields.emplace_back();
      } else {
        fields.back() += c;
      }
    }
    if (columns.empty()) {
      columns = fields;
      continue;
    }
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < columns.size() && i < fields.size(); ++i) row[columns[i]] = fields[i];
  }
  return rows;
}

inline std::string ReadReference(const std::string& name) {
  std::ifstream file(test::SharedDir() + "/reference/" + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

inline FrameRef Frame(FrameNo number) {
  return {number, static_cast<TimeNs>(number) * 1000, true};
}

/// A CoE message as the tracker of a slave hands it on; `payload` must outlive it.
inline MailboxMessage CoeMessage(Direction direction, FrameNo frame, ByteSpan payload) {
  MailboxMessage message;
  message.slave = 0;
  message.direction = direction;
  (direction == Direction::kOut ? message.sent : message.returned) = Frame(frame);
  message.header.protocol = Protocol::kCoE;
  message.header.length = static_cast<std::uint16_t>(payload.size());
  message.payload = payload;
  return message;
}

struct KeptTransfer : SdoTransfer {
  explicit KeptTransfer(const SdoTransfer& t) : SdoTransfer(t), bytes(Copy(t.data)) { data = {}; }
  Bytes bytes;
};

struct KeptMessage : MailboxMessage {
  explicit KeptMessage(const MailboxMessage& m) : MailboxMessage(m), bytes(Copy(m.payload)) { payload = behind = {}; }
  Bytes bytes;
};

struct KeptInfo : SdoInfo {
  explicit KeptInfo(const SdoInfo& i)
      : SdoInfo(i),
        objects(i.indices.begin(), i.indices.end()),
        text(i.name),
        initial(Copy(i.default_value)),
        low(Copy(i.minimum)),
        high(Copy(i.maximum)) {
    indices = {};
    name = {};
    default_value = minimum = maximum = {};
  }
  std::vector<std::uint16_t> objects;
  std::string text;
  Bytes initial, low, high;
};

struct KeptFile : FoeTransfer {
  explicit KeptFile(const FoeTransfer& f) : FoeTransfer(f), name(f.file_name), error(f.error_text) {
    file_name = {};
    error_text = {};
  }
  std::string name;
  std::string error;
};

struct KeptEoeFrame : EoeFrame {
  explicit KeptEoeFrame(const EoeFrame& f) : EoeFrame(f), bytes(Copy(f.data)) { data = {}; }
  Bytes bytes;
};

struct KeptEoeControl : EoeControl {
  explicit KeptEoeControl(const EoeControl& c) : EoeControl(c), dns_name(c.ip.dns_name.begin(), c.ip.dns_name.end()) {
    ip.dns_name = {};
  }
  std::string dns_name;
};

struct KeptSoe : SoeMessage {
  explicit KeptSoe(const SoeMessage& m) : SoeMessage(m), bytes(Copy(m.data)) { data = {}; }
  Bytes bytes;
};

struct KeptAoe : AoeMessage {
  explicit KeptAoe(const AoeMessage& m) : AoeMessage(m), bytes(Copy(m.parameters.data)) {
    header.data = {};
    parameters.data = {};
  }
  Bytes bytes;
};

struct KeptVoe : VoeMessage {
  explicit KeptVoe(const VoeMessage& m) : VoeMessage(m), bytes(Copy(m.data)) { data = {}; }
  Bytes bytes;
};

struct KeptPdo : CoePdo {
  explicit KeptPdo(const CoePdo& p) : CoePdo(p), bytes(Copy(p.data)) { data = {}; }
  Bytes bytes;
};

class Recorder : public EventBus {
 public:
  Recorder() {
    ListenTo<MailboxMessage, MailboxRefused, MailboxReadLost, MailboxRepeatRequest, MailboxUnanswered,
             MailboxErrorReply, SdoTransfer, SdoUnexpected, SdoInfo, Emergency, CoePdo, EoeFrame, EoeControl,
             FoeTransfer, SoeMessage, AoeMessage, VoeMessage>(Stage::kModel, *this);
  }
  void On(const MailboxMessage& event) { messages.emplace_back(event); }
  void On(const MailboxRefused& event) { refused.push_back(event); }
  void On(const MailboxReadLost& event) { lost.push_back(event); }
  void On(const MailboxRepeatRequest& event) { repeats.push_back(event); }
  void On(const MailboxUnanswered& event) { unanswered.push_back(event); }
  void On(const MailboxErrorReply& event) { errors.push_back(event); }
  void On(const SdoTransfer& event) { transfers.emplace_back(event); }
  void On(const SdoUnexpected& event) { unexpected.push_back(event); }
  void On(const SdoInfo& event) { infos.emplace_back(event); }
  void On(const Emergency& event) { emergencies.push_back(event); }
  void On(const CoePdo& event) { pdos.emplace_back(event); }
  void On(const EoeFrame& event) { eoe.emplace_back(event); }
  void On(const EoeControl& event) { eoe_controls.emplace_back(event); }
  void On(const FoeTransfer& event) { files.emplace_back(event); }
  void On(const SoeMessage& event) { soe.emplace_back(event); }
  void On(const AoeMessage& event) { aoe.emplace_back(event); }
  void On(const VoeMessage& event) { voe.emplace_back(event); }

  std::vector<KeptMessage> messages;
  std::vector<MailboxRefused> refused;
  std::vector<MailboxReadLost> lost;
  std::vector<MailboxRepeatRequest> repeats;
  std::vector<MailboxUnanswered> unanswered;
  std::vector<MailboxErrorReply> errors;
  std::vector<KeptTransfer> transfers;
  std::vector<SdoUnexpected> unexpected;
  std::vector<KeptInfo> infos;
  std::vector<Emergency> emergencies;
  std::vector<KeptPdo> pdos;
  std::vector<KeptEoeFrame> eoe;
  std::vector<KeptEoeControl> eoe_controls;
  std::vector<KeptFile> files;
  std::vector<KeptSoe> soe;
  std::vector<KeptAoe> aoe;
  std::vector<KeptVoe> voe;
};

}  // namespace ecaudit::mailbox
