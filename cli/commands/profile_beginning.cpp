#include "cli/commands/profile_beginning.h"

#include <string_view>
#include <vector>

#include "cli/report/json_text.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/soe.h"

namespace ecaudit::cli {
namespace {

using device::DeviceDescription;
using device::DictionaryObject;
using device::PdoDirection;
using report::JsonObject;

std::string_view Word(PdoDirection direction) {
  return direction == PdoDirection::kRx ? "rx" : "tx";
}

std::string_view Word(device::Access access) {
  static constexpr Named<device::Access> kNames[] = {
      {device::Access::kRead, "ro"},
      {device::Access::kWrite, "wo"},
      {device::Access::kReadWrite, "rw"},
  };
  return NameIn(kNames, access);
}

void PutIdentity(JsonObject& out, const DeviceDescription& esi, const std::string& source) {
  out.Object("match", [&](JsonObject& match) {
    if (esi.match.vendor_id) match.Put("vendor_id", Hex(*esi.match.vendor_id, 8));
    match.Array("product_codes", [&](report::JsonArray& codes) {
      for (const std::uint32_t code : esi.match.product_codes) codes.Add(Hex(code, 8));
    });
    if (esi.match.revision_min) {
      match.Put("note", "the file describes revision " + Hex(*esi.match.revision_min, 8) +
                            "; revision_min and revision_max would bind the family to some");
    }
    match.Put("source", source);
  });
}

void PutPdos(JsonObject& out, const DeviceDescription& esi, const std::string& source) {
  if (esi.pdo.fixed.empty() && esi.pdo.selectable.empty()) return;
  out.Object("pdo", [&](JsonObject& pdo) {
    pdo.List("selectable", esi.pdo.selectable, [&](JsonObject& row, const device::SelectablePdo& selectable) {
      row.Put("direction", Word(selectable.direction));
      row.Put("index", Hex(selectable.index));
      row.Put("source", source);
    });
    pdo.List("fixed", esi.pdo.fixed, [&](JsonObject& row, const device::PdoContent& content) {
      row.Put("index", Hex(content.index));
      row.Put("direction", Word(content.direction));
      if (!content.name.empty()) row.Text("name", content.name);
      if (content.entries.empty()) row.Put("known", false);
      if (!content.entries.empty()) {
        row.List("entries", content.entries, [&](JsonObject& entry, const device::PdoEntry& place) {
          entry.Put("index", Hex(place.index));
          entry.Put("sub", place.subindex);
          entry.Put("bits", place.bits);
          if (device::BitsOf(place.type) == place.bits) entry.Put("type", device::DataTypeName(place.type));
          if (!place.name.empty()) entry.Text("name", place.name);
        });
      }
      if (!content.fixed) row.Put("note", "the mapping can be changed");
      row.Put("source", source);
    });
    pdo.Put("source", source);
  });
}

void PutObject(JsonObject& row, const DictionaryObject& object, const std::string& source) {
  row.Put("index", Hex(object.index));
  if (object.head) row.Put("head", true);
  if (!object.head) row.Put("sub", object.subindex);
  if (object.last_subindex != object.subindex) row.Put("last_sub", object.last_subindex);
  std::string types;
  for (const device::DataType type : object.types) {
    if (type == device::DataType::kUnknown) continue;
    types += (types.empty() ? "" : "/") + std::string(device::DataTypeName(type));
  }
  if (!types.empty()) row.Put("type", types);
  const std::string_view access = object.constant ? "const" : Word(object.access);
  if (!access.empty()) row.Put("access", access);
  if (object.mappable == device::Mappable::kYes) row.Put("pdo", "yes");
  if (object.mappable == device::Mappable::kNo) row.Put("pdo", "no");
  if (object.only) row.Put("only", Word(*object.only));
  if (!object.unit.empty()) row.Text("unit", object.unit);
  if (!object.name.empty()) row.Text("name", object.name);
  row.Put("source", source);
}

void PutDictionary(JsonObject& out, const DeviceDescription& esi, const std::string& source) {
  if (!esi.dictionary || esi.dictionary->objects.empty()) return;
  out.Object("dictionary", [&](JsonObject& dictionary) {
    dictionary.Put("complete", false);
    dictionary.List("objects", esi.dictionary->objects,
                    [&](JsonObject& row, const DictionaryObject& object) { PutObject(row, object, source); });
    dictionary.Put("source", source);
  });
}

void PutMailbox(JsonObject& out, const DeviceDescription& esi, const std::string& source) {
  const device::MailboxDescription& mailbox = esi.mailbox;
  if (mailbox.sync_managers.empty() && mailbox.protocols.empty()) return;
  out.Object("mailbox", [&](JsonObject& json) {
    json.List("sync_managers", mailbox.sync_managers, [&](JsonObject& row, const device::SyncManagerRule& rule) {
      row.Put("number", rule.number);
      row.Put("use", device::Name(rule.use));
      if (rule.start) row.Put("start", Hex(*rule.start));
      if (rule.mailbox_mode && !rule.lengths.empty()) row.Values("lengths", rule.lengths);
      row.Put("source", source);
    });
    if (!mailbox.protocols.empty()) {
      json.List("protocols", mailbox.protocols, [&](JsonObject& row, const device::MailboxProtocol& protocol) {
        row.Put("type", protocol.type);
        row.Text("name", protocol.name);
        row.Put("source", source);
      });
    }
    json.Put("source", source);
  });
}

std::string Activation(const device::DcMode& mode) {
  std::string text = "AssignActivate " + Hex(mode.assign_activate);
  const auto add = [&](std::string_view name, const std::optional<TimeNs>& time, std::int32_t factor) {
    if (!time) return;
    text += ", " + std::string(name) + " ";
    text += *time == 0 && factor != 0 ? "the master's cycle times " + std::to_string(factor)
                                      : std::to_string(*time) + " ns";
  };
  add("SYNC0", mode.cycle_sync0, mode.factor_sync0);
  add("SYNC0 shift", mode.shift_sync0, 0);
  add("SYNC1", mode.cycle_sync1, mode.factor_sync1);
  add("SYNC1 shift", mode.shift_sync1, 0);
  return text;
}

void PutWritten(JsonObject& row, const std::vector<std::string>& transitions, const std::vector<std::uint8_t>& data,
                const std::string& comment) {
  std::string when;
  for (const std::string& transition : transitions) when += (when.empty() ? "" : ", ") + transition;
  row.Text("value", "written at " + when + ": " + HexBytes(data));
  if (!comment.empty()) row.Text("note", comment);
}

void PutFacts(JsonObject& out, const DeviceDescription& esi, const std::string& source) {
  if (!esi.esi) return;
  if (esi.esi->dc_modes.empty() && esi.esi->init_commands.empty() && esi.esi->mailbox_commands.empty()) return;
  out.Array("facts", [&](report::JsonArray& facts) {
    for (const device::DcMode& mode : esi.esi->dc_modes) {
      facts.AddObject([&](JsonObject& row) {
        row.Put("category", "DC mode");
        row.Text("name", mode.name);
        row.Text("value", Activation(mode));
        if (!mode.description.empty()) row.Text("note", mode.description);
        row.Put("source", source);
      });
    }
    for (const device::EsiInitCommand& command : esi.esi->init_commands) {
      facts.AddObject([&](JsonObject& row) {
        row.Put("category", "init command");
        row.Put("name", Hex(command.index) + ":" + std::to_string(command.subindex));
        PutWritten(row, command.transitions, command.data, command.comment);
        row.Put("source", source);
      });
    }
    for (const device::EsiMailboxCommand& command : esi.esi->mailbox_commands) {
      facts.AddObject([&](JsonObject& row) {
        row.Put("category", "init command");
        row.Put("name", mailbox::Name(command.protocol) + " " +
                            (command.protocol == mailbox::Protocol::kSoE ? mailbox::IdnName(command.number)
                                                                         : std::to_string(command.number)));
        PutWritten(row, command.transitions, command.data, command.comment);
        row.Put("source", source);
      });
    }
  });
}

}  // namespace

std::string ProfileBeginningText(const ProfileBeginning& wish) {
  const std::string source = "ESI, " + Printable(wish.esi_file);
  return report::JsonDocumentText([&](JsonObject& out) {
    out.Put("schema", "ecaudit.profile/1");
    out.Put("id", wish.id);
    out.Put("extends", wish.extends);
    if (wish.esi != nullptr && !wish.esi->title.empty()) {
      out.Text("title", wish.esi->title);
    } else {
      out.Put("title", wish.id);
    }
    out.Put("document", "MANUAL");
    out.Put(
        "note",
        "Sections that are missing are those of \"extends\". Replace MANUAL by the key of the manual (\"ABC-2024\") "
        "everywhere, cite its sections in \"source\", and ask 'ecaudit profiles --check' after each change.");
    out.Array("documents", [](report::JsonArray& documents) {
      documents.AddObject([](JsonObject& row) {
        row.Put("key", "MANUAL");
        row.Put("title", "name, edition and date of the manual");
      });
    });
    if (wish.esi != nullptr) {
      PutIdentity(out, *wish.esi, source);
      PutPdos(out, *wish.esi, source);
      PutDictionary(out, *wish.esi, source);
      PutMailbox(out, *wish.esi, source);
      PutFacts(out, *wish.esi, source);
      return;
    }
    out.Object("match", [](JsonObject& match) {
      match.Put(
          "note",
          "vendor_id and product_codes (\"0x0000006A\") are what drives are recognised by; without them --profile "
          "names the slaves");
      match.Put("source", "MANUAL, identity");
    });
  });
}

}  // namespace ecaudit::cli
